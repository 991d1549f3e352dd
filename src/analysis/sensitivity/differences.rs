//! Derivatives by differences of runs, where nothing else tells them.

use super::gradients::started;
use super::{Beside, Passes, Sensitivity};
use crate::analysis::variation::{STEPS, difference_by};
use crate::circuit::NamedMeasurement;
use crate::integrate::{Error, Note};
use crate::measure::{Measurement, Over};
use crate::settings::tolerances::periodic::{RUN_STEP, SIDES_APART};

impl Beside<'_> {
    /// By extrapolated differences of runs.
    pub(super) fn differences(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let own = self.measured(None)?;
        let mut gradients = started(&own);
        let measuring = self.measuring(self.model.circuit())?;
        let extremal = measuring.measurements.iter().map(is_extremal);
        let extremal: Vec<bool> = extremal.collect();
        let mut parted: Vec<Vec<&str>> = vec![vec![]; gradients.len()];
        for (name, value) in to {
            self.go_on()?;
            let run = |step: f64| self.measured(Some((name, value * (1.0 + step * RUN_STEP))));
            let [a, b, c, d] = STEPS.map(run);
            let runs = [a?, b?, c?, d?];
            for (k, gradient) in gradients.iter_mut().enumerate() {
                let value_of = |m: usize| runs[m].get(k)?.result.as_ref().ok().map(|f| f.value);
                let all = [value_of(0), value_of(1), value_of(2), value_of(3)];
                if let (Ok(own), [Some(a), Some(b), Some(c), Some(d)]) = (&gradient.value, all)
                    && extremal[k]
                    && part(*own, [a, b, c, d])
                {
                    parted[k].push(name);
                }
                let derivative = match all {
                    [Some(a), Some(b), Some(c), Some(d)] => {
                        Some(difference_by([a, b, c, d], RUN_STEP * value))
                    }
                    _ => None,
                };
                gradient.to.push((name.clone(), derivative));
            }
        }
        let text = "the derivatives are differences of runs with values 1 and 2 % aside, as the run is not exact throughout, or too long for all that is between its events to be kept, or signals have impulses";
        let mut notes = vec![Note::run("not-exact", text)];
        for (gradient, names) in gradients.iter().zip(parted) {
            if !names.is_empty() && self.options.asks_for(&gradient.name) {
                let text = format!(
                    "`{}` moves otherwise with {} upward than downward, as an extremum does that is reached at two times with the same value: there is no derivative; the number is between those to both sides",
                    gradient.name,
                    names.join(", ")
                );
                notes.push(Note::run("one-sided", text));
            }
        }
        Ok(Sensitivity {
            of: gradients,
            at: to.to_vec(),
            exact: false,
            passes: Passes::default(),
            notes,
        })
    }
}

/// Whether a measurement is an extreme value, or when it is reached.
fn is_extremal(of: &NamedMeasurement) -> bool {
    let Some(Measurement::Over(over, ..)) = of.what else {
        return false;
    };
    !matches!(over, Over::Average | Over::Rms | Over::Integral)
}

/// Whether derivatives with ln p to both sides, from the value and from those two steps down, one down, one up and two up, are not the same.
fn part(own: f64, [a, b, c, d]: [f64; 4]) -> bool {
    let (down, up) = (3.0 * own - 4.0 * b + a, 4.0 * c - d - 3.0 * own);
    let [down, up] = [down, up].map(|twice| twice / (2.0 * RUN_STEP));
    (up - down).abs() > SIDES_APART * own.abs().max(down.abs()).max(up.abs())
}
