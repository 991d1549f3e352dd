//! Rows on a grid that is finer than the one that is shown: whether they are close enough, and which of them are kept.

use std::f64::consts::TAU;

use crate::integrate::{Block, Grid, RowKind};
use crate::linalg::eigenvalues::eigenvalues;
use crate::model::Model;
use crate::settings::tolerances::times::{BRIEF, NOTHING, RINGS, SAME_TIME, SPIKE};
use crate::waveform::Waveforms;

/// Twice the rows at events and corners over those of the grid.
pub(super) fn crowd(kinds: &[RowKind]) -> f64 {
    let grid = kinds.iter().filter(|kind| kind.is_grid()).count();
    2.0 * (kinds.len() - grid) as f64 / grid.max(1) as f64
}

/// First and last row of each three steps of the grid without an event or a corner. (The front after an event may be steeper than any grid.)
fn lines(kinds: &[RowKind]) -> Vec<(usize, usize)> {
    let smooth = kinds.chunk_by(|one, next| (*one == RowKind::Grid) == (*next == RowKind::Grid));
    let (mut lines, mut first) = (Vec::new(), 0);
    for rows in smooth {
        let end = first + rows.len();
        if rows[0] == RowKind::Grid {
            lines.extend(
                (first..end.saturating_sub(3))
                    .step_by(3)
                    .map(|k| (k, k + 3)),
            );
        }
        first = end;
    }
    lines
}

/// How far rows of the grid stand from straight lines over two of them left out, from each event on, over the extent of their signal: the most.
pub(super) fn bent(waves: &Waveforms, kinds: &[RowKind], columns: usize) -> f64 {
    let lines = lines(kinds);
    let range = |j: usize| {
        let fold = |(low, high): (f64, f64), v| (low.min(v), high.max(v));
        waves.column(j).fold((f64::MAX, f64::MIN), fold)
    };
    let ranges: Vec<_> = (0..columns).map(range).collect();
    let of_signal = |j: usize| {
        let value = |k: usize| waves.values[k * waves.width() + j];
        let (low, high) = ranges[j];
        // What is zero but for rounding, beside others of its unit, has no line.
        let alike = ranges.iter().zip(&waves.units);
        let alike = alike.filter(|(_, unit)| **unit == waves.units[j]);
        let least = NOTHING * alike.fold(0.0, |m: f64, ((l, h), _)| m.max(l.abs()).max(h.abs()));
        let off = lines.iter().flat_map(|&(from, to)| {
            let since = move |k: usize| waves.time[k] - waves.time[from];
            let slope = (value(to) - value(from)) / since(to);
            (from + 1..to).map(move |k| (value(k) - value(from) - slope * since(k)).abs())
        });
        let extent = (high - low).max(least).max(f64::MIN_POSITIVE);
        off.fold(0.0, f64::max) / extent
    };
    (0..columns).map(of_signal).fold(0.0, f64::max)
}

/// Values that fall by themselves before the next row.
#[derive(Debug, Default)]
pub(super) struct Spikes {
    /// Rows that are no further apart are of one instant, s.
    instant: f64,
    /// Whether rows tell what is right before an event, too.
    tells_left: bool,
    /// The row before, and its time, s.
    before: Option<(f64, Vec<f64>)>,
    /// The largest |value| that two rows in a row have, by column.
    sustained: Vec<f64>,
    /// The largest value of which the next row has less than a part in [`SPIKE`], and the times of both, s, by column.
    largest: Vec<(f64, [f64; 2])>,
}

impl Spikes {
    /// Of a run with such a print step, s.
    pub(super) fn of(step: f64) -> Self {
        Self {
            instant: BRIEF * step,
            ..Self::default()
        }
    }

    /// Looks at rows of so many columns.
    pub(super) fn see(&mut self, columns: usize, block: Block<'_>) {
        self.tells_left = !block.kinds.is_empty();
        self.sustained.resize(columns, 0.0);
        self.largest.resize(columns, (0.0, [0.0; 2]));
        let kept = self.before.take();
        let mut before = kept.as_ref().map(|(t, values)| (*t, values.as_slice()));
        for (t, values, _) in block.rows() {
            if let Some((at, was)) = before
                && t - at > self.instant
            {
                self.compare((at, was), (t, values));
            }
            before = Some((t, values));
        }
        self.before = before.map(|(t, values)| (t, values.to_vec()));
    }

    /// Looks at two rows in a row. Few values fall: they are looked for where any does.
    fn compare(&mut self, (at, before): (f64, &[f64]), (t, values): (f64, &[f64])) {
        let mut falls = false;
        let both = before.iter().zip(values);
        for ((was, is), sustained) in both.zip(&mut self.sustained) {
            let (was, is) = (was.abs(), is.abs());
            let lower = if was < is { was } else { is };
            *sustained = if lower > *sustained {
                lower
            } else {
                *sustained
            };
            falls |= was > SPIKE * is;
        }
        if falls {
            let both = before.iter().zip(values);
            for ((was, is), largest) in both.zip(&mut self.largest) {
                if was.abs() > SPIKE * is.abs() && was.abs() > largest.0.abs() {
                    *largest = (*was, [at, t]);
                }
            }
        }
    }

    /// Signal, value and time of the largest value that an event makes, that is [`SPIKE`] times as large as all that lasts in its unit, and that falls with no
    /// other event. `units` by column, times of `events` in order, s.
    pub(super) fn found(&self, units: &[&str], events: &[f64]) -> Option<(usize, f64, f64)> {
        let stands_out = |(j, (value, [t, next])): (usize, &(f64, [f64; 2]))| {
            let same = self.sustained.iter().zip(units);
            let same = same.filter(|(_, unit)| **unit == units[j]);
            let lasts = same.fold(0.0, |m: f64, (most, _)| m.max(*most));
            let before = |t: f64| events.partition_point(|e| *e < t);
            let rounding = SAME_TIME * next.abs();
            let began = before(t - self.instant) < before(t + rounding);
            let last = if self.tells_left {
                before(next - rounding)
            } else {
                before(next + rounding)
            };
            let spikes = lasts > 0.0 && value.abs() > SPIKE * lasts;
            (spikes && began && last <= before(t + rounding)).then_some((j, *value, *t))
        };
        let all = self.largest.iter().enumerate().filter_map(stands_out);
        all.max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()))
    }
}

/// The highest frequency at which a circuit rings, with its switches where they start, of which rows so far apart show not even two a period, Hz.
///
/// A pair of eigenvalues of A that turns by four radians while it decays by e counts. Of more than 100 states nothing is said.
#[must_use]
pub fn ringing(model: &Model, spacing: f64) -> Option<f64> {
    const MOST: usize = 100;
    let lcs = model.lcs().ok().filter(|lcs| lcs.n() <= MOST)?;
    let pairs = eigenvalues(&lcs.a)?;
    let rings = pairs.iter().filter(|s| s.im > RINGS * s.re.abs());
    let fastest = rings.map(|s| s.im / TAU).fold(0.0, f64::max);
    (2.0 * fastest * spacing > 1.0).then_some(fastest)
}

/// What is shown of rows on a finer grid.
#[derive(Debug)]
pub(super) struct Cut {
    /// Columns, the first ones.
    pub(super) columns: usize,
    /// The output times that are shown; none where all are.
    pub(super) grid: Option<Grid>,
    /// Rows of the finer grid.
    pub(super) fine: Option<usize>,
    /// Its rows for each that is shown.
    pub(super) divisions: usize,
    /// Rows between output times are kept as such.
    pub(super) between: bool,
}

impl Cut {
    /// The rows that are shown, and what they are.
    pub(super) fn of(&self, waves: &Waveforms, kinds: &[RowKind]) -> (Waveforms, Vec<RowKind>) {
        let mut kept = Waveforms {
            title: waves.title.clone(),
            names: waves.names[..self.columns].to_vec(),
            units: waves.units[..self.columns].to_vec(),
            ..Waveforms::default()
        };
        let mut kept_kinds = Vec::new();
        // The next of the fine grid.
        let mut next = 0;
        for (t, values, kind) in Block::of(waves, kinds).rows() {
            let (mut time, mut kind) = (Some(t), kind);
            if let (true, Some(grid), Some(fine)) = (kind.is_grid(), &self.grid, self.fine) {
                let shown = if next + 1 == fine {
                    Some(grid.len() - 1)
                } else {
                    (next % self.divisions == 0).then(|| next / self.divisions)
                };
                time = shown.map(|k| grid.time(k));
                next += 1;
                // Between the output times that are shown it stands for what else is there.
                if time.is_none() && kind == RowKind::Both {
                    (time, kind) = (Some(t), RowKind::Corner);
                } else if time.is_none() && self.between {
                    (time, kind) = (Some(t), RowKind::Between);
                }
            }
            if let Some(mut time) = time {
                // One row for an output time and a corner that are an ulp apart.
                let is_last = |late: &f64| (*late - time).abs() <= SAME_TIME * time.abs();
                if kept.time.last().is_some_and(is_last) {
                    match (kept_kinds.last(), kind) {
                        (Some(RowKind::Grid | RowKind::Both), RowKind::Corner) => continue,
                        (Some(RowKind::Corner), _) if kind.is_grid() => {
                            kept.time.pop();
                            kept.values.truncate(kept.time.len() * self.columns);
                            kept_kinds.pop();
                        }
                        _ => {}
                    }
                }
                // The two grids put one instant an ulp apart; rows at events there stand with the row that is shown.
                if kind.is_grid() {
                    let later = kept.time.iter_mut().rev().take_while(|late| **late > time);
                    later.for_each(|late| *late = time);
                } else {
                    time = kept.time.last().map_or(time, |last| time.max(*last));
                }
                kept.time.push(time);
                kept.values.extend_from_slice(&values[..self.columns]);
                kept_kinds.push(kind);
            }
        }
        (kept, kept_kinds)
    }
}
