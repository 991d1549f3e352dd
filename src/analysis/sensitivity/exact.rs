//! Derivatives of a run that is exact throughout, forward or backward along it.

use nalgebra::{DMatrix, DVector};

use super::{Beside, Sensitivity, SensitivityMethod, started, unsupported};
use crate::analysis::curves::{MOST_VALUES, laps};
use crate::analysis::periodic::{beside, repeating, steady};
use crate::analysis::variation::{
    Adjoint, Carried, Changes, Drawing, Forms, Lines, Moved, Near, Parameter, Rest, STEPS, Sight,
    Tableau, Trajectory, Weighted, difference, unit,
};
use crate::circuit::{Circuit, Measured, Source, Tran, Weights, weights};
use crate::integrate::{Error, OrbitKind, Reason, Simulation};
use crate::measure::{Curves, Signals};
use crate::mna::{Perturbation, StandardMultiport};
use crate::model::Model;
use crate::settings::tolerances::periodic::{PERIOD_MOVES, VALUE_STEP};

/// A run that is differentiated, and which part of it measurements see.
struct Base {
    trajectory: Trajectory,
    forms: Forms,
    multiport: StandardMultiport,
    /// Where it begins.
    positions: Vec<bool>,
    /// The storage there, and whether it is what `IC=` says.
    state: Vec<f64>,
    by_initial: bool,
    sight: Sight,
    /// s.
    span: (f64, f64),
    orbit: Option<Repeated>,
}

/// An orbit as measurements see it: repeated until the end of `.tran`.
struct Repeated {
    monodromy: DMatrix<f64>,
    /// s.
    period: f64,
    /// From when on it counts, s.
    from: f64,
    tran: Option<Tran>,
}

/// A value, and what differs where it is another.
struct Survey<'a> {
    name: &'a str,
    value: f64,
    /// By storage element: of its `IC=`.
    initial: DVector<f64>,
    sources: [Vec<Source>; 4],
    /// What else differs, where that is numbers of the equations.
    perturbation: Option<Perturbation>,
    /// By measurement: what its own numbers make, in the run as it is.
    own: Vec<Option<f64>>,
}

/// What measurements find in a run, and what they weigh of it.
struct Weighing {
    found: Vec<Measured>,
    /// Those that are asked for, or used by these.
    needed: Vec<bool>,
    weights: Vec<Option<Weights>>,
    weighted: Vec<Option<Weighted>>,
}

fn not_smooth(what: String) -> Error {
    Error::before(Reason::NotSmooth(what))
}

impl Base {
    /// `None` where an output has an impulse: of that the variation is not carried along.
    fn of(
        trajectory: Trajectory,
        (simulation, state): (&Simulation, Option<(bool, Vec<f64>, Vec<bool>)>),
        span: (f64, f64),
        orbit: Option<Repeated>,
    ) -> Result<Option<Self>, Error> {
        let impulses = trajectory
            .saltations
            .iter()
            .filter_map(|s| s.impulse.as_ref());
        let mut areas = impulses.flat_map(|impulse| impulse.areas.iter());
        if areas.any(|area| *area != 0.0) {
            return Ok(None);
        }
        let lengths = trajectory
            .segments
            .iter()
            .map(|segment| segment.to - segment.from);
        // The segment before moves into what is seen.
        let first = trajectory
            .segments
            .iter()
            .rev()
            .find(|segment| segment.to < span.0);
        let sight = Sight {
            from: first.map_or(f64::NEG_INFINITY, |segment| segment.from),
            unit: unit(lengths.fold(0.0, f64::max)),
            most: MOST_VALUES,
        };
        let multiport = simulation.assembler(1.0).multiport().clone();
        let (uic, state, positions) = state.unwrap_or_default();
        let initial = multiport.storage.iter().map(|s| s.initial.unwrap_or(0.0));
        Ok(Some(Self {
            forms: Forms::of(&trajectory)?,
            by_initial: uic && initial.eq(state.iter().copied()),
            state,
            multiport,
            trajectory,
            positions,
            sight,
            span,
            orbit,
        }))
    }

    /// A run as measurements see it: an orbit again and again, from its beginning, which is not that of the trajectory.
    fn seen(&self, curves: Curves) -> Curves {
        let Some(orbit) = &self.orbit else {
            return curves.within(self.span);
        };
        let (period, from) = (orbit.period, orbit.from);
        // What is left out of many laps is told where they are measured.
        let (laps, _) = laps(orbit.tran, period, curves.values());
        let [begin, end] = [laps.0, laps.1].map(|lap| lap as f64 * period);
        let all = curves.repeated((0, laps.1 - laps.0 + 1), period, from + period - begin);
        all.within((begin, end))
    }

    /// δs where the run begins, forward: of an orbit (I − M) δs₀ = φ.
    fn start(&self, changes: &Changes, parameter: &Parameter<'_>) -> Result<DVector<f64>, Error> {
        let Some(Repeated { monodromy: m, .. }) = &self.orbit else {
            return Ok(changes.start().clone());
        };
        let forced = parameter.along(&DVector::zeros(m.nrows()), None)?.1;
        let closed = DMatrix::identity(m.nrows(), m.nrows()) - m;
        closed.lu().solve(&forced).ok_or_else(family)
    }

    /// Back along the run with what these weigh; of an orbit once more with λ = (I − Mᵀ)⁻¹ ψ₀.
    fn back(
        &self,
        lines: &Lines,
        drawing: &Drawing,
        weighted: &[Weighted],
    ) -> Result<Carried, Error> {
        let adjoint = Adjoint {
            trajectory: &self.trajectory,
            forms: &self.forms,
            lines,
            drawing,
        };
        let mut motions = lines.motions(self.sight.unit);
        let carried = adjoint.back(&mut motions, Some(weighted), None)?;
        let Some(Repeated { monodromy: m, .. }) = &self.orbit else {
            return Ok(carried);
        };
        let closed = DMatrix::identity(m.nrows(), m.nrows()) - m.transpose();
        let last = closed.lu().solve(&carried.start).ok_or_else(family)?;
        let again = adjoint.back(&mut motions, None, Some(&last))?;
        Ok(carried.plus(&again))
    }
}

fn family() -> Error {
    not_smooth("the orbit is one of a family: where it moves is not determined".into())
}

impl Weighing {
    /// Of the measurements of a circuit that are asked for.
    fn of(
        circuit: &Circuit,
        (drawing, curves): (&Drawing, &Curves),
        asked: impl Fn(&str) -> bool,
    ) -> Self {
        let found = circuit.measure(&Signals::Curves(curves));
        let weights = weights(&circuit.measurements, curves, &found);
        let mut needed: Vec<bool> = found.iter().map(|found| asked(&found.name)).collect();
        for _ in 0..found.len() {
            for (k, weights) in weights
                .iter()
                .enumerate()
                .filter(|(k, _)| needed[*k])
                .collect::<Vec<_>>()
            {
                let used = weights
                    .iter()
                    .flat_map(|weights| weights.results.iter().enumerate());
                let used: Vec<usize> = used.filter(|(_, w)| **w != 0.0).map(|(j, _)| j).collect();
                used.into_iter().chain([k]).for_each(|j| needed[j] = true);
            }
        }
        let of = |(needed, weights): (&bool, &Option<Weights>)| {
            Some(drawing.weighted(weights.as_ref().filter(|_| *needed)?))
        };
        Self {
            weighted: needed.iter().zip(&weights).map(of).collect(),
            weights,
            needed,
            found,
        }
    }

    /// Whether some derivative is a difference of what is measured on a run that is moved.
    fn needs_moves(&self) -> bool {
        let all = self.found.iter().zip(&self.weights).zip(&self.needed);
        let mut all =
            all.map(|((found, weights), needed)| (found.result.is_ok() && *needed, weights));
        all.any(|(needed, weights)| needed && weights.is_none())
    }

    /// Derivatives with ln p by measurement, from those of what each weighs: those that use others follow them.
    fn chained(&self, own: &[Option<f64>]) -> Vec<Option<f64>> {
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

impl Beside<'_> {
    /// The run, where it is exact throughout and nothing that is measured has an impulse.
    fn base(&self, model: &Model) -> Result<Option<Base>, Error> {
        let circuit = model.circuit();
        if !self.options.steady {
            let Some(tran) = circuit.tran else {
                return Err(unsupported("the netlist asks for no .tran analysis".into()));
            };
            let mut simulation = self.simulation(model)?;
            let (state, positions) = (simulation.state(), simulation.positions());
            let place = (0.0, &state[..], &positions[..]);
            let cancel = self.options.cancel;
            if !simulation.is_exact() {
                return Ok(None);
            }
            let trajectory = Trajectory::by_chance(&mut simulation, place, tran.tstop, cancel)?;
            let Some(trajectory) = trajectory else {
                return Ok(None);
            };
            let span = (circuit.measured_from(&tran), tran.tstop);
            return Base::of(
                trajectory,
                (&simulation, Some((tran.uic, state, positions))),
                span,
                None,
            );
        }
        let mut found = steady(model, &self.periodic())?;
        let orbit = found.orbit();
        let driven = orbit.kind == OrbitKind::Driven;
        if !driven || !found.simulation.is_exact() || found.course()?.is_none() {
            return Ok(None);
        }
        let (trajectory, from) = found.trajectory()?;
        let orbit = Repeated {
            monodromy: trajectory.monodromy(),
            period: orbit.period,
            from,
            tran: circuit.tran,
        };
        let always = (f64::NEG_INFINITY, f64::INFINITY);
        Base::of(trajectory, (&found.simulation, None), always, Some(orbit))
    }

    /// What differs where a value is another; `None` where it changes the period.
    fn survey<'n>(
        &self,
        base: &Base,
        (name, value): (&'n str, f64),
        (own, curves): (&Model, &Curves),
    ) -> Result<Option<Survey<'n>>, Error> {
        self.go_on()?;
        let at = |step: f64| {
            let mut model = own.clone();
            model.set(name, value * (1.0 + step * VALUE_STEP))?;
            Ok::<_, Error>(model)
        };
        let [a, b, c, d] = STEPS.map(at);
        let models = [a?, b?, c?, d?];
        let mut multiports = Vec::with_capacity(models.len());
        for model in &models {
            let multiport = if self.options.steady {
                let (period, _, multiport) = repeating(model)?;
                if self.moves(base, name, self.options.period.or(period))? {
                    return Ok(None);
                }
                multiport
            } else {
                model.multiport().clone()
            };
            multiports.push(multiport.standard());
        }
        let near: [StandardMultiport; 4] = multiports.try_into().map_err(|_| {
            Error::before(Reason::internal("analysis::sensitivity", "four circuits"))
        })?;
        let count = own.circuit().measurements.len();
        let mut explicit = vec![Some(0.0); count];
        let differs = |model: &Model| model.circuit().measurements != own.circuit().measurements;
        if models.iter().any(differs) {
            let found = models
                .each_ref()
                .map(|model| model.circuit().measure(&Signals::Curves(curves)));
            let value = |m: usize, k: usize| found[m][k].result.as_ref().ok().map(|f| f.value);
            let of = |k: usize| {
                Some(difference([
                    value(0, k)?,
                    value(1, k)?,
                    value(2, k)?,
                    value(3, k)?,
                ]))
            };
            explicit = (0..count).map(of).collect();
        }
        let storage = 0..base.multiport.storage.len();
        let initial = storage.map(|i| {
            let of = |near: &StandardMultiport| near.storage.get(i).and_then(|s| s.initial);
            difference(near.each_ref().map(|near| of(near).unwrap_or(0.0)))
        });
        let sources = |near: &StandardMultiport| {
            let all = near.sources.iter();
            all.map(|source| source.input.source.clone()).collect()
        };
        Ok(Some(Survey {
            name,
            value,
            initial: DVector::from_vec(initial.collect()),
            sources: near.each_ref().map(sources),
            perturbation: base.multiport.perturbation(near.each_ref()),
            own: explicit,
        }))
    }

    /// Whether this is another period than that of the orbit, which is refused if that was asked for.
    fn moves(&self, base: &Base, name: &str, period: Option<f64>) -> Result<bool, Error> {
        let moves = base.orbit.as_ref().zip(period).is_some_and(|(own, other)| {
            let laps = (own.period / other).round() * other;
            (laps - own.period).abs() > PERIOD_MOVES * VALUE_STEP * own.period
        });
        if moves && !self.options.to.is_empty() {
            let what =
                format!("`{name}` changes the period, on which the steady state depends otherwise");
            return Err(not_smooth(what));
        }
        Ok(moves)
    }

    /// How all changes with a value: by the reductions that all values have in common, or by those of the circuits beside.
    fn changes(
        &self,
        base: &Base,
        tableau: Option<(&Tableau, Option<&Rest>)>,
        (own, survey): (&Model, &Survey<'_>),
    ) -> Result<Changes, Error> {
        let at = |step: f64| {
            let mut model = own.clone();
            model.set(survey.name, survey.value * (1.0 + step * VALUE_STEP))?;
            let simulation = if self.options.steady {
                beside(&model, &self.periodic())?
            } else {
                self.simulation(&model)?
            };
            Ok::<_, Error>(simulation)
        };
        if let Some(((tableau, rest), perturbation)) = tableau.zip(survey.perturbation.as_ref()) {
            let change = |rest| tableau.rest_change(rest, perturbation, &survey.sources);
            let start = if base.orbit.is_some() || base.by_initial {
                survey.initial.clone()
            } else if let Some(change) = rest.and_then(change) {
                change
            } else {
                let [a, b, c, d] = STEPS.map(|step| Ok::<_, Error>(at(step)?.state()));
                let states = [a?, b?, c?, d?];
                let of = |i: usize| difference(states.each_ref().map(|state| state[i]));
                DVector::from_fn(survey.initial.len(), |i, _| of(i))
            };
            let beside = (survey.sources.clone(), start);
            let changes = tableau.changes(&base.trajectory, perturbation, beside)?;
            if let Some(changes) = changes {
                return Ok(changes);
            }
        }
        let near = |step: f64| {
            let mut simulation = at(step)?;
            if !self.options.steady && simulation.positions() != base.positions {
                let name = survey.name;
                let what = format!("a switch starts on another side where `{name}` is another");
                return Err(not_smooth(what));
            }
            Near::of(&mut simulation, &base.trajectory)
        };
        let [a, b, c, d] = STEPS.map(near);
        Changes::of(&base.trajectory, &[a?, b?, c?, d?])
    }

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
        let curves = base.seen(drawing.curves());
        let asked = |name: &str| self.options.asks_for(name);
        let weighing = Weighing::of(own.circuit(), (&drawing, &curves), asked);
        let weighted: Vec<Weighted> = weighing.weighted.iter().flatten().cloned().collect();
        let back = match self.options.method {
            SensitivityMethod::Forward => false,
            SensitivityMethod::Adjoint => true,
            SensitivityMethod::Automatic => to.len() > weighted.len(),
        };
        let back = back && !weighted.is_empty() && !base.trajectory.has_chances();
        let mut sensitivity = Sensitivity {
            of: started(&weighing.found),
            exact: true,
            ..Sensitivity::default()
        };
        let mut surveys = Vec::with_capacity(to.len());
        for (name, value) in to {
            match self.survey(&base, (name, *value), (&own, &curves))? {
                Some(survey) => surveys.push(survey),
                None => {
                    let text = format!(
                        "`{name}` is left out: it changes the period, on which the steady state depends otherwise"
                    );
                    sensitivity.notes.push(text.into());
                }
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
            let direct: Vec<Option<f64>> = match carried.as_ref().filter(|_| plain) {
                Some(carried) => {
                    let start = base.orbit.is_none().then(|| changes.start());
                    let place = (&base.trajectory, &base.forms);
                    let mut all = carried.with(place, &changes, start)?.into_iter();
                    let all = weighing
                        .weighted
                        .iter()
                        .map(|w| w.as_ref().and_then(|_| all.next()));
                    all.collect()
                }
                None => {
                    let of = |weighted: &Option<Weighted>| {
                        Some(moved.as_ref()?.weighed(weighted.as_ref()?))
                    };
                    weighing.weighted.iter().map(of).collect()
                }
            };
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
            for (gradient, derivative) in sensitivity.of.iter_mut().zip(derivatives) {
                let derivative = derivative.map(|derivative| derivative / value);
                gradient.to.push((name.to_owned(), derivative));
            }
            sensitivity.at.push((name.to_owned(), value));
        }
        Ok(Some(sensitivity))
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
