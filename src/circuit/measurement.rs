//! `.meas` and `.four`: what is measured, and carried out on the waveforms of a run.

use std::borrow::Cow;
use std::cell::RefCell;

use super::builder::Builder;
use super::formula::Formula;
use super::scope::ScopeId;
use super::{Circuit, Probe};
use crate::diagnostic::Diagnostic;
use crate::measure::{Found, MeasureError, Measurement, Scene, Spectrum, Trace, fourier};
use crate::netlist::ast::{Four, Meas};

/// Harmonics of `.four` where it names no number.
const HARMONICS: usize = 9;
/// Most harmonics of `.four`.
const MAX_HARMONICS: f64 = 10_000.0;

/// A measurement by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedMeasurement {
    /// Lower-case name.
    pub name: String,
    /// What is measured; `None` if it refers to what the circuit does not have, which was reported.
    pub what: Option<Measurement<Formula>>,
}

/// A Fourier analysis over the last period of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierAnalysis {
    /// The fundamental, Hz.
    pub frequency: f64,
    /// Number of harmonics, the fundamental included.
    pub harmonics: usize,
    /// The signals, as indices into [`Circuit::measured`].
    pub signals: Vec<usize>,
}

/// The outcome of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Its name.
    pub name: String,
    /// What it found, or why it found nothing.
    pub result: Result<Found, MeasureError>,
}

/// The outcome of one Fourier analysis of one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// `v(out)`.
    pub signal: String,
    /// The fundamental, Hz.
    pub frequency: f64,
    /// Mean and harmonics, or why there are none.
    pub result: Result<Spectrum, MeasureError>,
}

impl<'n> Builder<'n, '_> {
    /// Takes in the measurements; what they refer to must exist.
    pub(super) fn measure(&mut self, cards: &[(ScopeId, &'n Meas)]) {
        let names: Vec<String> = cards
            .iter()
            .map(|(scope, card)| self.full_name(&card.name, *scope))
            .collect();
        for (k, (scope, card)) in cards.iter().enumerate() {
            if names[..k].contains(&names[k]) {
                let message = format!("measurement `{}` is defined again", names[k]);
                self.tell(
                    Diagnostic::warning("duplicate-measurement", card.name.span, message)
                        .label("both are carried out; the name means the first one"),
                );
            }
            let before = self.scopes.findings.len();
            let what = card
                .what
                .map(&mut |expr, used| self.formula(expr, used, *scope, &names));
            // A run is worth having without one of its measurements.
            self.scopes
                .findings
                .soften(before, "; this measurement is left out");
            self.circuit.measurements.push(NamedMeasurement {
                name: names[k].clone(),
                what,
            });
        }
    }

    /// Takes in a Fourier analysis.
    pub(super) fn fourier(&mut self, card: &'n Four, scope: ScopeId) {
        let before = self.scopes.findings.len();
        self.fourier_card(card, scope);
        self.scopes
            .findings
            .soften(before, "; its harmonics are left out");
    }

    fn fourier_card(&mut self, card: &'n Four, scope: ScopeId) {
        let Some(frequency) = self.scopes.finite(&card.frequency, scope) else {
            return;
        };
        if frequency.f64 <= 0.0 {
            let message = "the frequency of `.four` must be positive";
            self.tell(
                Diagnostic::error("bad-four", card.frequency.span, message).label("not positive"),
            );
            return;
        }
        let mut harmonics = HARMONICS;
        if let Some(expr) = &card.harmonics {
            let Some(count) = self.scopes.finite(expr, scope) else {
                return;
            };
            if !(1.0..=MAX_HARMONICS).contains(&count.f64) || count.f64.fract() != 0.0 {
                let message = format!("`.four` takes 1 to {MAX_HARMONICS} harmonics");
                self.tell(
                    Diagnostic::error("bad-four", expr.span, message).label("not such a number"),
                );
                return;
            }
            harmonics = count.f64 as usize;
        }
        let mut signals = Vec::new();
        for signal in &card.signals {
            if let Some(Formula::Signal(index)) = self.signal_formula(signal, scope) {
                signals.push(index);
            }
        }
        self.circuit.fourier.push(FourierAnalysis {
            frequency: frequency.f64,
            harmonics,
            signals,
        });
    }
}

impl Circuit {
    /// Carries out the measurements on the rows of a run.
    ///
    /// `time` in s, nondecreasing; `column` gives as many values of a signal of [`Self::measured`].
    #[must_use]
    pub fn measure(
        &self,
        time: &[f64],
        column: &dyn Fn(&Probe) -> Option<Vec<f64>>,
    ) -> Vec<Measured> {
        let columns = self.columns(time, column);
        let count = self.measurements.len();
        let mut results: Vec<Option<Result<Found, MeasureError>>> = vec![None; count];
        // A measurement may use one that stands below it: go round until nothing new is found.
        loop {
            let mut progress = false;
            for (k, NamedMeasurement { what, .. }) in self.measurements.iter().enumerate() {
                if results[k].is_some() {
                    continue;
                }
                let Some(what) = what else {
                    results[k] = Some(Err(MeasureError::Unread));
                    progress = true;
                    continue;
                };
                let values: Vec<f64> = results.iter().map(number).collect();
                let pending = RefCell::new(false);
                let known = |formula: &Formula| {
                    let mut needed = Vec::new();
                    formula.needs(&mut needed);
                    for other in needed {
                        match &results[other] {
                            None => *pending.borrow_mut() = true,
                            Some(Ok(_)) => continue,
                            Some(Err(_)) => {}
                        }
                        return Err(MeasureError::Needs(self.measurements[other].name.clone()));
                    }
                    Ok(())
                };
                let trace = |formula: &Formula| {
                    known(formula)?;
                    if let Formula::Signal(index) = formula {
                        let all = &columns[*index];
                        let finite = all.iter().all(|value| value.is_finite());
                        return finite
                            .then_some(Cow::Borrowed(&all[..]))
                            .ok_or(MeasureError::NotFinite);
                    }
                    let mut row = vec![0.0; columns.len()];
                    let mut all = Vec::with_capacity(time.len());
                    for (k, &t) in time.iter().enumerate() {
                        for (value, column) in row.iter_mut().zip(&columns) {
                            *value = column[k];
                        }
                        let value = formula.value(t, &row, &values);
                        if !value.is_finite() {
                            return Err(MeasureError::NotFinite);
                        }
                        all.push(value);
                    }
                    Ok(Cow::Owned(all))
                };
                let single = |formula: &Formula| {
                    known(formula)?;
                    Ok(formula.value(f64::NAN, &[], &values))
                };
                let scene = Scene {
                    time,
                    trace: &trace,
                    number: &single,
                };
                let found = scene.measure(what);
                if !*pending.borrow() {
                    results[k] = Some(found);
                    progress = true;
                }
            }
            if !progress {
                break;
            }
        }
        let outcomes = results
            .into_iter()
            .map(|r| r.unwrap_or(Err(MeasureError::Circular)));
        self.measurements
            .iter()
            .zip(outcomes)
            .map(|(m, result)| Measured {
                name: m.name.clone(),
                result,
            })
            .collect()
    }

    /// Carries out the Fourier analyses, as [`Self::measure`] does the measurements.
    #[must_use]
    pub fn harmonics(
        &self,
        time: &[f64],
        column: &dyn Fn(&Probe) -> Option<Vec<f64>>,
    ) -> Vec<Harmonics> {
        if self.fourier.is_empty() {
            return vec![];
        }
        let columns = self.columns(time, column);
        let mut all = Vec::new();
        for analysis in &self.fourier {
            for &signal in &analysis.signals {
                let trace = Trace {
                    time,
                    values: &columns[signal],
                };
                all.push(Harmonics {
                    signal: self.measured[signal].name.clone(),
                    frequency: analysis.frequency,
                    result: fourier(trace, analysis.frequency, analysis.harmonics),
                });
            }
        }
        all
    }

    fn columns(&self, time: &[f64], column: &dyn Fn(&Probe) -> Option<Vec<f64>>) -> Vec<Vec<f64>> {
        self.measured
            .iter()
            .map(|probe| column(probe).unwrap_or_else(|| vec![f64::NAN; time.len()]))
            .collect()
    }
}

fn number(result: &Option<Result<Found, MeasureError>>) -> f64 {
    match result {
        Some(Ok(found)) => found.value,
        _ => f64::NAN,
    }
}
