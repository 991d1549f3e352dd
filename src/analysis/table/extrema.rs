//! The least and the greatest values of outputs over a stretch: at its ends, and where a rate vanishes.

use nalgebra::{DMatrix, DVector};

use crate::analysis::variation::Motion;
use crate::integrate::Error;
use crate::settings::tolerances::events::NOISE;
use crate::settings::tolerances::periodic::EXTREMUM;

/// The least and greatest values so far, by output.
#[derive(Debug, Clone)]
pub(super) struct Extrema {
    pub(super) least: Vec<f64>,
    pub(super) greatest: Vec<f64>,
    /// What rounding may leave of the outputs and of their rates in a motion.
    floors: [DVector<f64>; 2],
}

/// Outputs, their rates and the rates of these at one instant.
struct Readings {
    w: DVector<f64>,
    rows: [DVector<f64>; 3],
}

impl Readings {
    fn of(motion: &Motion<'_>, w: DVector<f64>) -> Self {
        let rows = motion.linear.rows.each_ref().map(|rows| rows * &w);
        Self { w, rows }
    }

    fn at(&self, k: usize) -> [f64; 3] {
        self.rows.each_ref().map(|row| row[k])
    }
}

impl Extrema {
    pub(super) fn of(count: usize) -> Self {
        Self {
            least: vec![f64::INFINITY; count],
            greatest: vec![f64::NEG_INFINITY; count],
            floors: [DVector::zeros(count), DVector::zeros(count)],
        }
    }

    pub(super) fn see(&mut self, k: usize, value: f64) {
        self.least[k] = self.least[k].min(value);
        self.greatest[k] = self.greatest[k].max(value);
    }

    /// Sees the whole of a motion from w.
    pub(super) fn over(&mut self, motion: &mut Motion<'_>, w: &DVector<f64>) -> Result<(), Error> {
        let start = Readings::of(motion, w.clone());
        let last = motion.after(0, w)?;
        let end = Readings::of(motion, last);
        let sizes = start.w.abs().sup(&end.w.abs());
        let [values, rates, _] = &motion.linear.rows;
        let floor = |rows: &DMatrix<f64>| NOISE * f64::EPSILON * (rows.abs() * &sizes);
        self.floors = [floor(values), floor(rates)];
        for readings in [&start, &end] {
            for (k, value) in readings.rows[0].iter().enumerate() {
                self.see(k, *value);
            }
        }
        self.within(motion, (0, 0.0), (&start, &end))
    }

    /// Sees what is between two instants, a part of the motion from `age` seconds on.
    fn within(
        &mut self,
        motion: &mut Motion<'_>,
        (level, age): (u32, f64),
        (start, end): (&Readings, &Readings),
    ) -> Result<(), Error> {
        let h = motion.part(level);
        if h > motion.linear.spectrum.step_limit(age) && level < motion.bottom {
            let w = motion.after(level + 1, &start.w)?;
            let middle = Readings::of(motion, w);
            for (k, value) in middle.rows[0].iter().enumerate() {
                self.see(k, *value);
            }
            self.within(motion, (level + 1, age), (start, &middle))?;
            return self.within(motion, (level + 1, age + 0.5 * h), (&middle, end));
        }
        for k in 0..self.least.len() {
            if self.may_turn(k, h, start.at(k), end.at(k)) {
                self.turn(motion, k, level, (&start.w, start.at(k)), end.at(k))?;
            }
        }
        Ok(())
    }

    /// Whether output k may pass its extrema between two instants h seconds apart, of which these are value, rate and its rate.
    fn may_turn(&self, k: usize, h: f64, a: [f64; 3], b: [f64; 3]) -> bool {
        let [y0, d0, s0] = a;
        let [y1, d1, s1] = b;
        let dips = d0 * s0 < 0.0 && d1 * s1 > 0.0;
        let still = d0.abs().max(d1.abs()) <= self.floors[1][k];
        if still || d0 * d1 > 0.0 && !dips {
            return false;
        }
        // No further beyond its ends than slopes and curvatures would take it.
        let reach = h * d0.abs().max(d1.abs()).max(h * s0.abs()).max(h * s1.abs());
        let size = self.greatest[k].abs().max(self.least[k].abs());
        let counts = self.floors[0][k].max(EXTREMUM * size);
        y0.max(y1) + reach > self.greatest[k] + counts
            || y0.min(y1) - reach < self.least[k] - counts
    }

    /// Sees the extrema of output k in a part of the motion.
    fn turn(
        &mut self,
        motion: &mut Motion<'_>,
        k: usize,
        level: u32,
        (w, start): (&DVector<f64>, [f64; 3]),
        end: [f64; 3],
    ) -> Result<(), Error> {
        let h = motion.part(level);
        if level < motion.bottom {
            let middle = motion.after(level + 1, w)?;
            let at = |row: usize| motion.linear.rows[row].row(k).transpose().dot(&middle);
            let between = [at(0), at(1), at(2)];
            self.see(k, between[0]);
            if self.may_turn(k, 0.5 * h, start, between) {
                self.turn(motion, k, level + 1, (w, start), between)?;
            }
            if self.may_turn(k, 0.5 * h, between, end) {
                self.turn(motion, k, level + 1, (&middle, between), end)?;
            }
            return Ok(());
        }
        /// Parts of a Taylor step in which a rate is looked at.
        const PARTS: u32 = 4;
        let row = motion.linear.rows[0].row(k).transpose();
        let series = motion.series(w, h);
        let polynomial: Vec<f64> = series.column_iter().map(|term| row.dot(&term)).collect();
        let value = |s: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * s + c);
        let terms = || polynomial.iter().enumerate().skip(1).rev();
        let rate = |s: f64| terms().fold(0.0, |sum, (k, c)| sum * s + k as f64 * c);
        for part in 0..PARTS {
            let [mut a, mut b] = [part, part + 1].map(|k| f64::from(k) / f64::from(PARTS));
            let mut low = rate(a);
            if low * rate(b) > 0.0 {
                continue;
            }
            // The value errs by the square of what the time does.
            while b - a > f64::EPSILON.sqrt() {
                let middle = 0.5 * (a + b);
                let between = rate(middle);
                if low * between <= 0.0 {
                    b = middle;
                } else {
                    (a, low) = (middle, between);
                }
            }
            self.see(k, value(0.5 * (a + b)));
        }
        Ok(())
    }
}
