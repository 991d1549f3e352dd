//! Derivatives of a run that is exact throughout, forward or backward along it.

use std::collections::BTreeSet;

use super::base::Base;
use super::gradients::started;
use super::survey::Survey;
use super::{Beside, Sensitivity, SensitivityMethod, left_out};
use crate::analysis::curves::is_large;
use crate::analysis::variation::{
    Carried, Drawing, Lines, Moved, Parameter, Summed, Tableau, Weighted,
};
use crate::circuit::{Circuit, Measured, Weights, weights};
use crate::integrate::{Error, Note};
use crate::measure::{Curves, Signals};
use crate::mna::Perturbation;
use crate::model::Model;
use crate::settings::tolerances::periodic::{MOST_RIVALS, SAME_DERIVATIVE, SAME_EXTREMUM};
use crate::settings::tolerances::times::{MOST_PERIODS, MOST_STATES};

/// What measurements find in a run, and what they weigh of it.
pub(super) struct Weighing {
    pub(super) found: Vec<Measured>,
    /// Those that are asked for, or used by these.
    needed: Vec<bool>,
    weights: Vec<Option<Weights>>,
    pub(super) weighted: Vec<Option<Weighted>>,
    rivals: Vec<Rivalry>,
}

/// What derivatives to the pieces of curves are ones to.
type Weigh<'a> = dyn Fn(&Weights) -> Weighted + 'a;

/// An extremum that is reached a second time with the same value, or when it is.
struct Rivalry {
    /// Of which measurement.
    of: usize,
    /// The time that counts, and the other one, s.
    times: (f64, f64),
    /// What the signal spans.
    span: f64,
    /// What it weighs if the other one counts; for when it is reached, what the difference of the values there weighs.
    weighted: Weighted,
    is_time: bool,
    /// Values to which the derivative is another one there, and the part of the larger one by which it is.
    parted: Vec<(String, f64)>,
}

impl Weighing {
    /// Of what the measurements of a circuit find in curves, those that are asked for, whose extrema are the same to this part of what their signals span.
    pub(super) fn of(
        circuit: &Circuit,
        found: Vec<Measured>,
        (weigh, curves, same): (&Weigh<'_>, &Curves, f64),
        asked: impl Fn(&str) -> bool,
    ) -> Self {
        let mut needed: Vec<bool> = found.iter().map(|found| asked(&found.name)).collect();
        let weights = weights(&circuit.measurements, (curves, same), &found, &mut needed);
        let weighted = weights.iter().map(|own| own.as_ref().map(weigh));
        let weighted: Vec<Option<Weighted>> = weighted.collect();
        Self {
            rivals: rivals(weigh, &weights, &weighted),
            weighted,
            weights,
            needed,
            found,
        }
    }

    /// What they weigh, then what rivals do.
    pub(super) fn all(&self) -> impl Iterator<Item = &Weighted> {
        let rivals = self.rivals.iter().map(|rivalry| &rivalry.weighted);
        self.weighted.iter().flatten().chain(rivals)
    }

    /// Takes in what was compared for other values.
    pub(super) fn join(&mut self, other: Self) {
        for (own, other) in self.rivals.iter_mut().zip(other.rivals) {
            own.parted.extend(other.parted);
        }
    }

    /// Whether some derivative is a difference of what is measured on a run that is moved.
    pub(super) fn needs_moves(&self) -> bool {
        let all = self.found.iter().zip(&self.weights).zip(&self.needed);
        let mut all =
            all.map(|((found, weights), needed)| (found.result.is_ok() && *needed, weights));
        all.any(|(needed, weights)| needed && weights.is_none())
    }

    /// Derivatives with ln p by measurement, from those of what each weighs: those that use others follow them.
    pub(super) fn chained(&self, own: &[Option<f64>]) -> Vec<Option<f64>> {
        let count = own.len();
        let mut found: Vec<Option<f64>> = vec![None; count];
        for _ in 0..count {
            for k in 0..count {
                let (None, Some(direct), Some(weights)) = (found[k], own[k], &self.weights[k])
                else {
                    continue;
                };
                let used = weights.results.iter().enumerate();
                let used = used.filter(|(_, weight)| **weight != 0.0);
                let terms = used.map(|(j, weight)| Some(weight * found[j]?));
                found[k] = terms.sum::<Option<f64>>().map(|sum| direct + sum);
            }
        }
        found
    }
}

/// The extrema that are reached again elsewhere: where the same piece is seen again, as in each lap of an orbit, they move together.
fn rivals(
    weigh: &Weigh<'_>,
    weights: &[Option<Weights>],
    weighted: &[Option<Weighted>],
) -> Vec<Rivalry> {
    let mut all = Vec::new();
    for (of, (weights, own)) in weights.iter().zip(weighted).enumerate() {
        let (Some(weights), Some(own)) = (weights, own) else {
            continue;
        };
        let mut known = vec![own.clone()];
        for tie in &weights.rivals {
            let value = tie.value.as_ref().map(weigh);
            if let Some(value) = &value {
                known[0] = value.clone();
            }
            let weighted = weigh(&tie.weights);
            let again = known.iter().any(|k| k.is_like(&weighted, SAME_DERIVATIVE));
            if again || known.len() > MOST_RIVALS {
                continue;
            }
            known.push(weighted.clone());
            all.push(Rivalry {
                of,
                times: tie.times,
                span: tie.span,
                is_time: value.is_some(),
                weighted: match &value {
                    Some(value) => weighted.minus(value),
                    None => weighted,
                },
                parted: vec![],
            });
        }
    }
    all
}

impl Rivalry {
    /// Compares derivatives with the logarithm of a value.
    fn see(&mut self, name: &str, own: f64, other: f64) {
        let size = own.abs().max(other.abs()).max(self.span);
        if own != other {
            self.parted
                .push((name.to_owned(), (own - other).abs() / size));
        }
    }
}

impl Weighing {
    /// Compares derivatives with ln p of what extrema weigh where they are reached first and elsewhere.
    pub(super) fn compare(&mut self, name: &str, own: &[Option<f64>], others: &[f64]) {
        for (rivalry, other) in self.rivals.iter_mut().zip(others) {
            if let Some(own) = own[rivalry.of] {
                let own = if rivalry.is_time { 0.0 } else { own };
                rivalry.see(name, own, *other);
            }
        }
    }

    /// Tells which derivatives are those to one side, where this is what they may be off by, and how extrema were compared.
    pub(super) fn one_sided(&self, off: f64, compared: &str) -> Vec<Note> {
        let of = |k: usize| {
            let rivals = self.rivals.iter().filter(|r| r.of == k);
            let parted = rivals.flat_map(|r| r.parted.iter().map(|parted| (r.times, parted)));
            let parted: Vec<_> = parted.filter(|(_, (_, apart))| *apart > off).collect();
            let (first, again) = parted.first()?.0;
            let names: BTreeSet<&str> = parted.iter().map(|(_, (name, _))| &**name).collect();
            let text = format!(
                "an extremum of `{}` is reached at {first:.6e} s and, with the same value{compared}, at {again:.6e} s, where it moves otherwise with {}: there is no derivative; the number is that at {first:.6e} s, and holds to one side at most",
                self.found[k].name,
                names.into_iter().collect::<Vec<_>>().join(", ")
            );
            Some(Note::run("one-sided", text))
        };
        (0..self.found.len()).filter_map(of).collect()
    }
}

impl Beside<'_> {
    /// By the variational equation; `None` where steps are made.
    pub(super) fn exact(&self, to: &[(String, f64)]) -> Result<Option<Sensitivity>, Error> {
        let own = self.with(None)?;
        let Some(base) = self.base(&own)? else {
            return Ok(None);
        };
        let lines = Lines::of(&base.trajectory, &base.forms);
        let mut motions = lines.motions(base.sight.unit);
        let drawing = Drawing::of(&base.trajectory, (&lines, &mut motions), base.sight)?;
        let Some(drawing) = drawing else {
            return Ok(None);
        };
        let drawn = drawing.curves();
        let (whole, curves) = (base.seen(drawn.whole()), base.seen(drawn));
        let found = own.circuit().measure(&Signals::Curves(&whole));
        let asked = |name: &str| self.options.asks_for(name);
        let weigh = |weights: &Weights| drawing.weighted(weights);
        let mut weighing = Weighing::of(
            own.circuit(),
            found,
            (&weigh, &curves, SAME_EXTREMUM),
            asked,
        );
        let measured = weighing.weighted.iter().flatten().count();
        let back = match self.options.method {
            SensitivityMethod::Forward => false,
            SensitivityMethod::Adjoint => true,
            SensitivityMethod::Automatic => to.len() > measured,
        };
        let back = back && measured > 0 && !base.trajectory.has_chances();
        let mut sensitivity = Sensitivity {
            of: started(&weighing.found),
            exact: true,
            notes: self.seen_elsewhere(&own),
            ..Sensitivity::default()
        };
        let mut surveys = Vec::with_capacity(to.len());
        let mut cards = self.cards(base.grounds(), to, &own);
        for (name, value) in to {
            let survey =
                self.survey(base.grounds(), (name, *value), &mut cards, (&own, &curves))?;
            match survey {
                Some(survey) => surveys.push(survey),
                None => sensitivity.notes.push(left_out(name)),
            }
        }
        let perturbations = surveys
            .iter()
            .filter_map(|survey| survey.perturbation.as_ref());
        let perturbations: Vec<&Perturbation> = perturbations.collect();
        let tableau = Tableau::of(&base.multiport, &perturbations, &base.trajectory)
            .filter(|tableau| tableau.starts_apart(&base.trajectory, &base.forms));
        let rest = tableau
            .as_ref()
            .filter(|_| base.orbit.is_none() && !base.by_initial);
        let rest = rest.and_then(|tableau| tableau.at_rest(&base.trajectory, &base.state));
        let tableau = tableau.as_ref().map(|tableau| (tableau, rest.as_ref()));
        let mut carried: Option<Carried> = None;
        for survey in &surveys {
            let (name, value) = (survey.name, survey.value);
            self.go_on()?;
            let changes = self.changes(&base, tableau, (&own, survey))?;
            let changes = changes.with_constants(&base.trajectory, &base.forms);
            let plain = back && changes.is_plain();
            if plain && carried.is_none() {
                let weighted: Vec<&Weighted> = weighing.all().collect();
                carried = Some(base.back(&lines, &drawing, &weighted)?);
                sensitivity.passes.backward = weighted.len();
            }
            let forward = !plain || weighing.needs_moves();
            let moved = if forward {
                let parameter = Parameter {
                    trajectory: &base.trajectory,
                    forms: &base.forms,
                    changes: &changes,
                };
                let start = base.start(&changes, &parameter)?;
                sensitivity.passes.forward += 1;
                Some(parameter.along(&start, Some(&drawing))?.0)
            } else {
                None
            };
            let mut terms = vec![0.0; sensitivity.of.len()];
            let (direct, others): (Vec<Option<f64>>, Vec<f64>) =
                match carried.as_ref().filter(|_| plain) {
                    Some(carried) => {
                        let start = base.orbit.is_none().then(|| changes.start());
                        let place = (&base.trajectory, &base.forms);
                        let mut all = carried.with(place, &changes, start)?.into_iter();
                        let own = weighing.weighted.iter();
                        let own = own.map(|w| w.as_ref().and_then(|_| all.next()));
                        let own: Vec<Option<Summed>> = own.collect();
                        let others = all.map(|other| other.sum).collect();
                        for (terms, own) in terms.iter_mut().zip(&own) {
                            *terms = own.map_or(0.0, |own| own.terms);
                        }
                        let sum = |own: Option<Summed>| Some(own?.sum);
                        (own.into_iter().map(sum).collect(), others)
                    }
                    None => {
                        let of = |weighted: &Option<Weighted>| {
                            Some(moved.as_ref()?.weighed(weighted.as_ref()?))
                        };
                        let own = weighing.weighted.iter().map(of).collect();
                        let rivals = weighing.rivals.iter();
                        let others =
                            rivals.filter_map(|r| Some(moved.as_ref()?.weighed(&r.weighted)));
                        (own, others.collect())
                    }
                };
            weighing.compare(name, &direct, &others);
            let mut derivatives = weighing.chained(&direct);
            for (derivative, own) in derivatives.iter_mut().zip(&survey.own) {
                *derivative = derivative.zip(*own).map(|(a, b)| a + b);
            }
            if let Some(moved) = moved.as_ref().filter(|_| derivatives.contains(&None)) {
                let found = self.by_moves(&base, (&drawing, moved), survey)?;
                for (derivative, found) in derivatives.iter_mut().zip(found) {
                    *derivative = derivative.or(found);
                }
            }
            for (gradient, terms) in sensitivity.of.iter_mut().zip(terms) {
                gradient.terms.push(terms);
            }
            for (gradient, derivative) in sensitivity.of.iter_mut().zip(derivatives) {
                let derivative = derivative.map(|derivative| derivative / survey.unit());
                gradient.to.push((name.to_owned(), derivative));
            }
            sensitivity.at.push((name.to_owned(), value));
        }
        sensitivity
            .notes
            .extend(weighing.one_sided(SAME_DERIVATIVE, ""));
        Ok(Some(sensitivity))
    }

    /// Tells where a transient measures the same run on its rows.
    pub(super) fn seen_elsewhere(&self, own: &Model) -> Vec<Note> {
        let mut tran = own
            .circuit()
            .tran
            .filter(|_| !self.options.steady)
            .into_iter();
        let large = tran.any(|tran| is_large(own, &tran));
        let text = format!(
            "measured between events; `circ sim` measures a run of more than {MOST_STATES} states or {MOST_PERIODS:e} periods on its rows, and finds what straight lines between them have"
        );
        Vec::from_iter(large.then(|| Note::run("measured-between-events", text)))
    }

    /// Derivatives with ln p by differences of what is measured where the run is moved by ± a little.
    fn by_moves(
        &self,
        base: &Base,
        (drawing, moved): (&Drawing, &Moved),
        survey: &Survey<'_>,
    ) -> Result<Vec<Option<f64>>, Error> {
        let stretched = moved.stretched(drawing);
        let h = stretched.small();
        let at = |h: f64| {
            let model = self.with(Some((survey.name, survey.value * (1.0 + h))))?;
            let curves = base.seen(stretched.at(h));
            Ok::<_, Error>(model.circuit().measure(&Signals::Curves(&curves)))
        };
        let (low, high) = (at(-h)?, at(h)?);
        let of = |(low, high): (&Measured, &Measured)| {
            let both = low.result.as_ref().ok().zip(high.result.as_ref().ok());
            both.map(|(low, high)| (high.value - low.value) / (2.0 * h))
        };
        Ok(low.iter().zip(&high).map(of).collect())
    }
}
