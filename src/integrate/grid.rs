//! Output times.

use std::ops::Range;

use crate::circuit::Tran;
use crate::integrate::error::{Error, Reason};
use crate::settings::tolerances::times::LAST_ROW;

/// Output times `tstart + k·tstep`, the last exactly `tstop`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// First output time, s.
    pub tstart: f64,
    /// Distance of output times, s.
    pub tstep: f64,
    /// Last output time, s.
    pub tstop: f64,
}

impl Grid {
    /// The output times of a transient analysis.
    #[must_use]
    pub const fn of(tran: &Tran) -> Self {
        Self {
            tstart: tran.tstart,
            tstep: tran.tstep,
            tstop: tran.tstop,
        }
    }

    /// Number of output times.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count() as usize
    }

    /// The same, which may be more than a computer can count.
    #[must_use]
    pub fn count(&self) -> f64 {
        let span = self.tstop - self.tstart;
        if !(span > 0.0 && self.tstep > 0.0) {
            return 1.0;
        }
        (span / self.tstep - LAST_ROW).ceil().max(1.0) + 1.0
    }

    /// How many rows of so many columns besides time so many bytes hold.
    pub(crate) fn most(columns: usize, held: usize) -> usize {
        held / ((columns + 1) * size_of::<f64>())
    }

    /// # Errors
    /// [`Reason::RowsTooDense`] for output times that doubles do not tell apart; [`Reason::TooManyRows`] for more than `most` rows, of
    /// so many columns besides time.
    pub fn check(&self, columns: usize, most: Option<usize>) -> Result<(), Error> {
        let Self {
            tstart,
            tstep,
            tstop,
        } = *self;
        let rows = self.count();
        let least = 2.0 * f64::EPSILON * tstop.abs();
        if tstep < least {
            return Err(Error::before(Reason::RowsTooDense {
                rows,
                tstart,
                tstop,
                least,
            }));
        }
        match most {
            Some(limit) if rows > limit as f64 => Err(Error::before(Reason::TooManyRows {
                rows,
                columns,
                limit,
            })),
            _ => Ok(()),
        }
    }

    /// Never: `tstop` is always there.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Output time k < [`Self::len`], s.
    #[must_use]
    pub fn time(&self, k: usize) -> f64 {
        self.times().at(k)
    }

    /// The times one by one.
    #[must_use]
    pub fn times(&self) -> Times {
        Times {
            grid: *self,
            len: self.len(),
        }
    }
}

/// The times of a [`Grid`], counted once.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    grid: Grid,
    /// Their number.
    pub len: usize,
}

impl Times {
    /// Output time k, s.
    #[must_use]
    pub fn at(&self, k: usize) -> f64 {
        let Grid {
            tstart,
            tstep,
            tstop,
        } = self.grid;
        if k + 1 >= self.len {
            tstop
        } else {
            tstart + k as f64 * tstep
        }
    }

    /// Adds some of them.
    pub(crate) fn extend(&self, which: Range<usize>, to: &mut Vec<f64>) {
        let Grid { tstart, tstep, .. } = self.grid;
        let ends = which.end >= self.len && !which.is_empty();
        to.extend(which.map(|k| tstart + k as f64 * tstep));
        if let Some(last) = to.last_mut().filter(|_| ends) {
            *last = self.grid.tstop;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_ends_exactly_at_tstop() {
        let grid = Grid {
            tstart: 0.0,
            tstep: 1e-6,
            tstop: 5e-3,
        };
        assert_eq!(grid.len(), 5001);
        assert_eq!(grid.time(5000), 5e-3);
        let uneven = Grid {
            tstart: 1.0,
            tstep: 0.4,
            tstop: 2.0,
        };
        let times: Vec<f64> = (0..uneven.len()).map(|k| uneven.time(k)).collect();
        assert_eq!(times, [1.0, 1.4, 1.8, 2.0]);
    }
}
