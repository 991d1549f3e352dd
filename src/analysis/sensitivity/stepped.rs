//! Derivatives of runs of large circuits, in their steps: what measurements weigh is carried back along them, once for all values.
//!
//! ```text
//! dJ/dp = Σ υ z δc,      in the steady state with      (I − Mᵀ) ψ = ∂J/∂s₀      once more from its end,
//! ```
//!
//! Mᵀ by products ([`Returns::back`]). The error is stated by comparison with halved steps. Values that move waveforms or switches, or that change more than coefficients, are
//! left to differences of runs.

use std::collections::HashMap;

use nalgebra::{Complex, DVector};

use super::base::not_smooth;
use super::course::{Course, laid_out};
use super::exact::Weighing;
use super::gradients::started;
use super::survey::{Grounds, Survey};
use super::{Beside, Passes, Sensitivity, left_out, unsupported};
use crate::analysis::variation::difference;
use crate::circuit::{Measured, source::Wave};
use crate::integrate::{
    Drive, Error, Lengths, Note, Reads, Reason, Returned, Returns, STAGES, Tape, Weighed,
};
use crate::linalg::krylov::Recycled;
use crate::measure::{Curves, Signals};
use crate::mna::StandardMultiport;
use crate::model::Model;
use crate::settings::tolerances::periodic::{
    LEAST_BENT, LEFT_OF_RESPONSE, MOST_BESIDE, MOST_RECYCLED, RESPONSE_CLOSED, TIMES_APART,
};

/// Sources for the changes of all values.
#[derive(Default)]
struct Sources {
    equations: Places,
    storage: Places,
    columns: Places,
    drives: Vec<Drive>,
    known: HashMap<Drive, usize>,
    /// By value: drives, and their factors.
    of: Vec<Vec<(usize, f64)>>,
}

/// Numbers in the order in which they were seen first.
#[derive(Default)]
struct Places {
    all: Vec<usize>,
    known: HashMap<usize, usize>,
}

impl Places {
    fn of(&mut self, one: usize) -> usize {
        *self.known.entry(one).or_insert_with(|| {
            self.all.push(one);
            self.all.len() - 1
        })
    }
}

impl Sources {
    /// For these values, of a circuit with so many sources.
    fn of(surveys: &[Survey<'_>], sources: usize) -> Self {
        let mut own = Self::default();
        let all = || surveys.iter().filter_map(|s| s.perturbation.as_ref());
        for perturbation in all() {
            for (equation, column, _) in &perturbation.coefficients {
                own.equations.of(*equation);
                own.columns.of(*column);
            }
            for (row, column, _) in &perturbation.metric {
                own.storage.of(*row);
                own.storage.of(*column);
            }
        }
        let beside = sources + own.equations.all.len();
        let rates = own.columns.all.len();
        let constant = rates + own.storage.all.len();
        for survey in surveys {
            let mut drives = Vec::new();
            if let Some(perturbation) = &survey.perturbation {
                for (equation, column, values) in &perturbation.coefficients {
                    let drive = (
                        sources + own.equations.of(*equation),
                        own.columns.of(*column),
                    );
                    drives.push((own.drive(drive), difference(*values)));
                }
                for (row, column, values) in &perturbation.metric {
                    let drive = (
                        beside + own.storage.of(*row),
                        rates + own.storage.of(*column),
                    );
                    drives.push((own.drive(drive), difference(*values)));
                }
            }
            for (input, by) in constants(survey) {
                drives.push((own.drive((input, constant)), by));
            }
            own.of.push(drives);
        }
        own
    }

    fn drive(&mut self, drive: Drive) -> usize {
        *self.known.entry(drive).or_insert_with(|| {
            self.drives.push(drive);
            self.drives.len() - 1
        })
    }

    /// The multiport with them.
    fn perturbed(&self, multiport: &StandardMultiport) -> StandardMultiport {
        let (equations, storage) = (&self.equations.all, &self.storage.all);
        multiport.perturbed(equations, storage, &self.columns.all)
    }

    /// Values in a row of what they read.
    fn width(&self) -> usize {
        self.columns.all.len() + self.storage.all.len() + 1
    }

    fn reads(&self) -> Reads {
        Reads {
            last: self.columns.all.len(),
            rates: self.storage.all.clone(),
        }
    }
}

/// Constant sources that a value moves, and by how much.
fn constants<'a>(survey: &'a Survey<'_>) -> impl Iterator<Item = (usize, f64)> + 'a {
    let [a, b, c, d] = &survey.sources;
    let all = a.iter().zip(b).zip(c.iter().zip(d)).enumerate();
    all.filter_map(
        |(i, ((a, b), (c, d)))| match [a, b, c, d].map(|s| &s.wave) {
            [Wave::Dc(a), Wave::Dc(b), Wave::Dc(c), Wave::Dc(d)] if (a, b, c) != (b, c, d) => {
                Some((i, difference([*a, *b, *c, *d])))
            }
            _ => None,
        },
    )
}

/// Whether a value moves sources that are not constant.
fn moves_waves(survey: &Survey<'_>) -> bool {
    let [first, others @ ..] = &survey.sources;
    let constant = |i: usize| matches!(first[i].wave, Wave::Dc(_));
    let same = |i: usize| others.iter().all(|all| all[i] == first[i]);
    (0..first.len()).any(|i| !constant(i) && !same(i))
}

/// What measurements weigh of a run, and by value the derivatives with its logarithm of each.
struct Carried {
    weighing: Weighing,
    derivatives: Vec<Vec<Option<f64>>>,
    /// What counts as nothing of what is measured.
    rounding: f64,
}

impl Carried {
    /// Takes in other values.
    fn join(&mut self, other: Self) {
        self.derivatives.extend(other.derivatives);
        self.weighing.join(other.weighing);
    }
}

impl Beside<'_> {
    /// By the way back along the steps of a large circuit; `None` of another circuit, or where its steps fail and it is not too large for exact runs.
    pub(super) fn stepped(&self, to: &[(String, f64)]) -> Result<Option<Sensitivity>, Error> {
        match self.along_steps(to) {
            Err(error) if error.reason != Reason::Interrupted && !self.is_large() => Ok(None),
            found => found,
        }
    }

    /// Whether runs of the circuit are made in steps on matrices without their zeros.
    fn is_large(&self) -> bool {
        let multiport = self.model.multiport();
        let size = multiport.storage.len() + multiport.ideal_pairs();
        size >= self.options.settings.large
    }

    fn along_steps(&self, to: &[(String, f64)]) -> Result<Option<Sensitivity>, Error> {
        let own = self.with(None)?;
        let Some(course) = Course::of(self, &own)? else {
            return Ok(None);
        };
        let mut returns = course.returns(None, Reads::default())?;
        let (tape, steps) = course.pass(&mut returns, Lengths::Free, self.options.cancel)?;
        let curves = course.curves(&tape, own.multiport().probes);
        let bends = tape.steps().any(|step| step.bends || !step.at.is_empty());
        if self.weighed((&own, &course), &curves).needs_moves() {
            return self.otherwise(to);
        }
        let grounds = Grounds {
            multiport: &course.multiport,
            period: course.orbit.map(|(period, _)| period),
        };
        let mut notes = self.seen_elsewhere(&own);
        let (mut surveys, mut others) = (Vec::new(), Vec::new());
        let mut cards = self.cards(grounds, to, &own);
        for (name, value) in to {
            match self.survey(grounds, (name, *value), &mut cards, (&own, &curves))? {
                Some(survey) if is_plain(&survey, &returns) => surveys.push(survey),
                Some(_) => others.push((name.clone(), *value)),
                None => notes.push(left_out(name)),
            }
        }
        if !others.is_empty() && !self.is_large() {
            return Ok(None);
        }
        if surveys.is_empty() {
            return self.otherwise(to);
        }
        let at_once = self.at_once(&surveys, (2 * steps.len(), own.multiport().probes), &course)?;
        let mut made = Vec::new();
        for lengths in [Lengths::Same(&steps), Lengths::Halves(&steps)] {
            let mut whole: Option<Carried> = None;
            for surveys in surveys.chunks(at_once) {
                let Some(carried) = self.carried((&own, &course), surveys, lengths)? else {
                    return self.otherwise(to);
                };
                match &mut whole {
                    Some(whole) => whole.join(carried),
                    None => whole = Some(carried),
                }
            }
            made.extend(whole);
        }
        let (Some(halved), Some(coarse)) = (made.pop(), made.pop()) else {
            return Ok(None);
        };
        let mut of = started(&halved.weighing.found);
        for (survey, derivatives) in surveys.iter().zip(&halved.derivatives) {
            for (gradient, derivative) in of.iter_mut().zip(derivatives) {
                let derivative = derivative.map(|derivative| derivative / survey.unit());
                gradient.to.push((survey.name.to_owned(), derivative));
            }
        }
        let apart = apart(&coarse, &halved);
        let least = if bends { LEAST_BENT } else { 0.0 };
        let off = (TIMES_APART * apart).max(least);
        notes.push(in_steps(steps.len(), (apart, off), bends));
        notes.extend(halved.weighing.one_sided(off, " as far as the steps tell"));
        let mut found = Sensitivity {
            of,
            at: to.to_vec(),
            exact: false,
            passes: Passes {
                backward: halved.weighing.all().count(),
                ..Passes::default()
            },
            notes,
        };
        if !others.is_empty() {
            found.join(self.few_differences(&others)?);
        }
        found.sort(to);
        Ok(Some(found))
    }

    /// Values whose readings of all stages of so many steps there is memory for, beside so many outputs.
    fn at_once(
        &self,
        surveys: &[Survey<'_>],
        (steps, outputs): (usize, usize),
        course: &Course,
    ) -> Result<usize, Error> {
        let width = Sources::of(surveys, course.multiport.sources.len()).width();
        let bytes = |width: usize| steps * STAGES * width * size_of::<f64>();
        let held = self.options.settings.max_held;
        let parts = bytes(width).div_ceil(held.saturating_sub(bytes(outputs)).max(1));
        if parts > surveys.len() {
            let what = format!(
                "what one value multiplies along {steps} steps does not fit into {held} bytes: a shorter run has its derivatives"
            );
            return Err(unsupported(what));
        }
        Ok(surveys.len().div_ceil(parts))
    }

    /// Where steps do not tell: by differences of runs, or not here where the circuit is not too large for exact ones.
    fn otherwise(&self, to: &[(String, f64)]) -> Result<Option<Sensitivity>, Error> {
        let large = self.is_large();
        large.then(|| self.few_differences(to)).transpose()
    }

    /// By differences of runs of a large circuit, to not too many values.
    pub(super) fn few_differences(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        if to.len() > MOST_BESIDE {
            let what = format!(
                "derivatives to {} of these values are differences of four runs of so many elements for each of them: name up to {MOST_BESIDE} values (`--to`)",
                to.len()
            );
            return Err(unsupported(what));
        }
        self.differences(to)
    }

    fn weighed(&self, (own, course): (&Model, &Course), curves: &Curves) -> Weighing {
        let asked = |name: &str| self.options.asks_for(name);
        let found = own.circuit().measure(&Signals::Curves(curves));
        let same = course.known();
        Weighing::of(own.circuit(), found, (&laid_out, curves, same), asked)
    }

    /// The derivatives along a run to some of the values; `None` where an active set leaves them open, or the operating point that it begins at does.
    fn carried(
        &self,
        (own, course): (&Model, &Course),
        surveys: &[Survey<'_>],
        lengths: Lengths<'_>,
    ) -> Result<Option<Carried>, Error> {
        let columns = own.multiport().probes;
        let of_circuit = course.multiport.sources.len();
        let sources = Sources::of(surveys, of_circuit);
        let perturbed = sources.perturbed(&course.multiport);
        let returns = &mut course.returns(Some(perturbed.clone()), sources.reads())?;
        let tape = &course.pass(returns, lengths, self.options.cancel)?.0;
        if !returns.inputs_stay_apart(of_circuit) {
            return Ok(None);
        }
        let curves = course.curves(tape, columns);
        let mut weighing = self.weighed((own, course), &curves);
        let weighed = weighing.all();
        let weighed = weighed.map(|weighted| course.weighed(tape, weighted, columns));
        let weighed: Vec<Weighed> = weighed.collect();
        let drives = &sources.drives[..];
        let Some(mut returned) = returns.back(tape, drives, &weighed) else {
            return Ok(None);
        };
        let by_initial = course.begins_as_told();
        if course.orbit.is_some() {
            let ends = self.closed(returns, tape, &returned)?;
            let Some(again) = returns.back(tape, drives, &ends) else {
                return Ok(None);
            };
            for (own, again) in returned.iter_mut().zip(again) {
                let both = own.drives.iter_mut().zip(again.drives);
                both.for_each(|(own, again)| *own += again);
            }
        } else if !by_initial {
            let Some(rest) = course.rest(&perturbed, &sources.reads()) else {
                return Ok(None);
            };
            for own in &mut returned {
                let at_rest = rest.drives(&own.start, drives);
                let both = own.drives.iter_mut().zip(at_rest);
                both.for_each(|(own, at_rest)| *own += at_rest);
            }
        }
        let mut derivatives = Vec::with_capacity(surveys.len());
        for (survey, factors) in surveys.iter().zip(&sources.of) {
            let of = |returned: &Returned| {
                let driven = factors.iter().map(|&(k, by)| by * returned.drives[k]);
                let initial = returned.start.iter().zip(&survey.initial);
                let initial = initial.filter(|_| by_initial && course.orbit.is_none());
                driven.sum::<f64>() + initial.map(|(a, b)| a * b).sum::<f64>()
            };
            let mut all = returned.iter().map(of);
            let direct = weighing.weighted.iter();
            let direct: Vec<Option<f64>> = direct
                .map(|w| w.as_ref().and_then(|_| all.next()))
                .collect();
            weighing.compare(survey.name, &direct, &all.collect::<Vec<f64>>());
            let chained = weighing.chained(&direct).into_iter();
            let with_own = chained.zip(&survey.own);
            derivatives.push(with_own.map(|(a, b)| Some(a? + (*b)?)).collect());
        }
        Ok(Some(Carried {
            weighing,
            derivatives,
            rounding: RESPONSE_CLOSED * curves.largest(),
        }))
    }

    /// λ = (I − Mᵀ)⁻¹ ψ₀ of an orbit, in roots of energies.
    fn closed(
        &self,
        returns: &mut Returns,
        tape: &Tape,
        returned: &[Returned],
    ) -> Result<Vec<Weighed>, Error> {
        let roots = returns.weights();
        let mut recycled = Recycled::new();
        let mut found = Vec::with_capacity(returned.len());
        for own in returned {
            let mut product = |v: &DVector<f64>| {
                self.go_on()?;
                let end = Weighed {
                    end: v.component_mul(&roots).as_slice().to_vec(),
                    ..Weighed::default()
                };
                let back = returns.back(tape, &[], &[end]).ok_or_else(open)?;
                let start = DVector::from_vec(back[0].start.clone());
                Ok::<_, Error>(start.component_div(&roots))
            };
            let right = own.start.iter().zip(&roots);
            let right = right.map(|(weight, root)| Complex::from(weight / root));
            let right = DVector::from_iterator(roots.len(), right);
            let one = Complex::from(1.0);
            let limits = (LEFT_OF_RESPONSE, MOST_RECYCLED);
            let closed = recycled.solve(&mut product, (one, &right), limits)?;
            let closed = closed.ok_or_else(|| not_smooth(format!(
                "{MOST_RECYCLED} products with the derivative of the orbit do not tell where it moves: it is one of a family, or has as many slow modes"
            )))?;
            let end = closed.iter().zip(&roots).map(|(v, root)| v.re * root);
            found.push(Weighed {
                end: end.collect(),
                ..Weighed::default()
            });
        }
        Ok(found)
    }
}

/// Whether all that a value changes is coefficients and constant sources that no switch follows.
fn is_plain(survey: &Survey<'_>, returns: &Returns) -> bool {
    survey.perturbation.is_some()
        && !moves_waves(survey)
        && constants(survey).all(|(input, _)| !returns.moves_switches(input))
}

fn open() -> Error {
    not_smooth("devices share currents or voltages in a way that no derivative tells".into())
}

/// The largest difference of derivatives p ∂J/∂p, relative to the largest of each measurement or to what it measures.
fn apart(coarse: &Carried, halved: &Carried) -> f64 {
    let of = |(k, found): (usize, &Measured)| {
        let value = found.result.as_ref().map_or(0.0, |found| found.value.abs());
        let pairs = coarse.derivatives.iter().zip(&halved.derivatives);
        let pairs = pairs.filter_map(|(a, b)| a[k].zip(b[k]));
        let start = (0.0_f64, value.max(halved.rounding));
        let (apart, size) = pairs.fold(start, |(apart, size), (a, b)| {
            (apart.max((a - b).abs()), size.max(b.abs()))
        });
        if apart == 0.0 { 0.0 } else { apart / size }
    };
    let found = halved.weighing.found.iter().enumerate();
    found.map(of).fold(0.0, f64::max)
}

/// Tells what they may be off by: so many times what halved steps change, and where a device changes within a step no less than what is known of that.
fn in_steps(steps: usize, (apart, off): (f64, f64), bends: bool) -> Note {
    let text = format!(
        "the derivatives are those of a run in {} steps; they may be off by {off:.0e} of the largest p ∂J/∂p of a measurement, or of what it measures, as steps of twice the length are {apart:.0e} off{}",
        2 * steps,
        if bends {
            " and devices change within steps"
        } else {
            ""
        }
    );
    Note::run("tangents", text)
}
