//! `.meas` and `.four`: what is measured, and carried out on the waveforms of a run.

use std::cell::RefCell;

use super::builder::Builder;
use super::formula::Formula;
use super::scope::ScopeId;
use super::{Circuit, Probe, Tran};
use crate::diagnostic::Diagnostic;
use crate::measure::{
    Expression, Found, MeasureError, Measurement, Scene, Signals, Spectrum, Trace, fourier,
};
use crate::netlist::ast::{Four, Meas, MeasAnalysis};
use crate::netlist::suggest::nearest;
use crate::settings::tolerances::times::SAME_TIME;

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
        // A card that names no analysis is of the one that the netlist asks for.
        let of_response = self.circuit.tran.is_none() && !self.circuit.ac.is_empty();
        let by_analysis = cards.iter().partition(|(_, card)| match card.analysis {
            Some(analysis) => analysis == MeasAnalysis::Ac,
            None => of_response,
        });
        let (responses, transient): (Vec<_>, Vec<_>) = by_analysis;
        self.measure_in(&transient, false);
        self.measure_in(&responses, true);
    }

    /// Takes in those of a transient, or those of the response to small sines.
    fn measure_in(&mut self, cards: &[&(ScopeId, &'n Meas)], of_response: bool) {
        let names: Vec<String> = cards
            .iter()
            .map(|(scope, card)| self.full_name(&card.name, *scope))
            .collect();
        for (k, (scope, card)) in cards.iter().enumerate() {
            if let Some(first) = names[..k].iter().position(|name| *name == names[k]) {
                let message = format!("measurement `{}` is defined again", names[k]);
                self.tell(
                    Diagnostic::warning("duplicate-measurement", card.name.span, message)
                        .first_at(cards[first].1.name.span)
                        .label("both are carried out; the name means the first one"),
                );
            }
            let before = self.scopes.findings.len();
            let what = card
                .what
                .map(&mut |expr, used| self.formula(expr, used, *scope, (&names, of_response)));
            // A run is worth having without one of its measurements.
            self.scopes
                .findings
                .soften(before, "; this measurement is left out");
            let all = if of_response {
                &mut self.circuit.responses
            } else {
                &mut self.circuit.measurements
            };
            all.push(NamedMeasurement {
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
    /// That there is no such measurement, and which there are; `None` where it is there.
    pub(crate) fn no_measurement(&self, of: &str) -> Option<String> {
        let name = of.to_lowercase();
        let known: Vec<&str> = self.measurements.iter().map(|m| &m.name[..]).collect();
        if known.contains(&name.as_str()) {
            return None;
        }
        let near = nearest(&name, known.iter().copied());
        Some(match (near, &known[..]) {
            (Some(near), _) => format!("no measurement `{of}`: did you mean `{near}`?"),
            (None, []) => format!("no measurement `{of}`: the netlist has no `.meas`"),
            (None, _) => format!("no measurement `{of}`: there are {}", known.join(", ")),
        })
    }

    /// The rows of a run as [`Self::measure`] sees them: times in s, nondecreasing, and as many values of each signal of [`Self::measured`] from
    /// `column`.
    #[must_use]
    pub fn seen<'t>(
        &self,
        time: &'t [f64],
        column: &dyn Fn(&Probe) -> Option<Vec<f64>>,
    ) -> Signals<'t> {
        let columns = self.measured.iter();
        let columns =
            columns.map(|probe| column(probe).unwrap_or_else(|| vec![f64::NAN; time.len()]));
        Signals::Lines {
            time,
            columns: columns.collect(),
        }
    }

    /// The time before which [`Self::measure`] and [`Self::harmonics`] need to see nothing of a transient, s.
    pub(crate) fn measured_from(&self, tran: &Tran) -> f64 {
        let Tran { tstart, tstop, .. } = *tran;
        let number = |formula: &Formula| formula.value(f64::NAN, &[], &[]);
        let measurements = self.measurements.iter().filter_map(|m| m.what.as_ref());
        let begins = measurements.map(|what| what.begins(&number));
        let periods = self
            .fourier
            .iter()
            .map(|four| tstop - four.frequency.recip());
        // What rounding leaves of a period before the start is none.
        let periods = periods.map(|t| t - SAME_TIME * tstop);
        let first = begins.chain(periods).fold(f64::INFINITY, f64::min);
        first.clamp(tstart, tstop)
    }

    /// From when to when they see the transient that `.tran` asks for, s; nothing where it asks for none.
    pub(crate) fn measured_span(&self) -> (f64, f64) {
        let span = |tran: &Tran| (self.measured_from(tran), tran.tstop);
        self.tran.as_ref().map_or((0.0, 0.0), span)
    }

    /// Carries out the measurements on the signals of [`Self::measured`].
    #[must_use]
    pub fn measure(&self, signals: &Signals<'_>) -> Vec<Measured> {
        carried_out(&self.measurements, signals)
    }

    /// Carries out the Fourier analyses, as [`Self::measure`] does the measurements.
    #[must_use]
    pub fn harmonics(&self, signals: &Signals<'_>) -> Vec<Harmonics> {
        let of = |analysis: &FourierAnalysis, signal: usize| Harmonics {
            signal: self.measured[signal].name.clone(),
            frequency: analysis.frequency,
            result: signals
                .signal(signal)
                .and_then(|trace| fourier(&trace, analysis.frequency, analysis.harmonics)),
        };
        let mut all = Vec::new();
        for analysis in &self.fourier {
            all.extend(analysis.signals.iter().map(|signal| of(analysis, *signal)));
        }
        all
    }
}

/// What measurements are carried out on.
pub(crate) trait Seen {
    /// Where it begins and ends.
    fn span(&self) -> (f64, f64);

    /// A formula as a waveform, less another one, where measurements have these results.
    fn trace(
        &self,
        formula: &Formula,
        less: Option<&Formula>,
        results: &[f64],
    ) -> Result<Trace<'_>, MeasureError>;

    /// A formula without signals.
    fn number(&self, formula: &Formula, results: &[f64]) -> f64;
}

impl Seen for Signals<'_> {
    fn span(&self) -> (f64, f64) {
        self.span()
    }

    fn trace(
        &self,
        formula: &Formula,
        less: Option<&Formula>,
        results: &[f64],
    ) -> Result<Trace<'_>, MeasureError> {
        if let (Formula::Signal(index), None) = (formula, less) {
            return self.signal(*index);
        }
        let value = |t: f64, row: &[f64]| {
            let less = less.map_or(0.0, |less| less.value(t, row, results));
            formula.value(t, row, results) - less
        };
        self.trace(&expression(&value, formula, less))
    }

    fn number(&self, formula: &Formula, results: &[f64]) -> f64 {
        formula.value(f64::NAN, &[], results)
    }
}

/// A formula less another one as an expression of which this is the value.
pub(super) fn expression<'f>(
    value: &'f dyn Fn(f64, &[f64]) -> f64,
    formula: &Formula,
    less: Option<&Formula>,
) -> Expression<'f> {
    Expression {
        value,
        is_affine: formula.is_affine() && less.is_none_or(Formula::is_affine),
        is_timed: formula.is_timed() || less.is_some_and(Formula::is_timed),
    }
}

/// Carries out measurements, each of which may use the others.
pub(crate) fn carried_out(all: &[NamedMeasurement], seen: &impl Seen) -> Vec<Measured> {
    let mut results: Vec<Option<Result<Found, MeasureError>>> = vec![None; all.len()];
    // A measurement may use one that stands below it: go round until nothing new is found.
    loop {
        let mut progress = false;
        for (k, NamedMeasurement { what, .. }) in all.iter().enumerate() {
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
                    return Err(MeasureError::Needs(all[other].name.clone()));
                }
                Ok(())
            };
            let trace = |formula: &Formula, less: Option<&Formula>| {
                known(formula)?;
                less.map_or(Ok(()), known)?;
                seen.trace(formula, less, &values)
            };
            let single = |formula: &Formula| {
                known(formula)?;
                Ok(seen.number(formula, &values))
            };
            let scene = Scene {
                span: seen.span(),
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
    let both = all.iter().zip(outcomes);
    both.map(|(m, result)| Measured {
        name: m.name.clone(),
        result,
    })
    .collect()
}

fn number(result: &Option<Result<Found, MeasureError>>) -> f64 {
    match result {
        Some(Ok(found)) => found.value,
        _ => f64::NAN,
    }
}
