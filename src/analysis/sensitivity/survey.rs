//! What differs where a value is another, and how a run changes with it.

use std::collections::HashMap;

use nalgebra::DVector;

use super::base::{Base, not_smooth};
use super::{Beside, value_of};
use crate::analysis::periodic::{at_rest, beside, repeating};
use crate::analysis::variation::{Changes, Near, Rest, STEPS, Tableau, difference};
use crate::circuit::{Kind, Source};
use crate::integrate::{Error, Reason};
use crate::measure::{Curves, Signals};
use crate::mna::{Perturbation, StandardMultiport, StaticMultiport, behaviour};
use crate::model::Model;
use crate::settings::tolerances::periodic::{MARK, PERIOD_MOVES, VALUE_STEP};

/// A value, and what differs where it is another.
pub(super) struct Survey<'a> {
    pub(super) name: &'a str,
    pub(super) value: f64,
    /// What h p is in doubles: p with it and without are exact, which their rounding over h is not.
    step: f64,
    /// By storage element: of its `IC=`.
    pub(super) initial: DVector<f64>,
    pub(super) sources: [Vec<Source>; 4],
    /// What else differs, where that is numbers of the equations.
    pub(super) perturbation: Option<Perturbation>,
    /// By measurement: what its own numbers make, in the run as it is.
    pub(super) own: Vec<Option<f64>>,
}

/// What differs with the value of a card alone.
pub(super) struct Card {
    perturbation: Perturbation,
    sources: [Vec<Source>; 4],
}

fn sources(multiport: &StandardMultiport) -> Vec<Source> {
    let all = multiport.sources.iter();
    all.map(|source| source.input.source.clone()).collect()
}

impl Card {
    /// By card, from a circuit in which each has its mark for a value, where the others have these values; `None` where more differs than that.
    fn all(
        own: &StandardMultiport,
        near: &StandardMultiport,
        cards: &[(f64, [f64; 4])],
    ) -> Option<Vec<Self>> {
        let perturbations = own.perturbations_by(near, cards)?;
        let (own, near) = (sources(own), sources(near));
        let mut all: Vec<Self> = perturbations
            .into_iter()
            .map(|perturbation| Self {
                perturbation,
                sources: [(); 4].map(|()| own.clone()),
            })
            .collect();
        for (k, _) in own
            .iter()
            .zip(&near)
            .enumerate()
            .filter(|(_, (own, near))| own != near)
        {
            let card = cards
                .iter()
                .position(|(mark, _)| near[k] == Source::constant(*mark))?;
            for (sources, value) in all[card].sources.iter_mut().zip(cards[card].1) {
                sources[k] = Source::constant(value);
            }
        }
        Some(all)
    }
}

/// What a value is looked at beside: the circuit, and the period of its orbit, s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grounds<'a> {
    pub(super) multiport: &'a StandardMultiport,
    pub(super) period: Option<f64>,
}

impl Survey<'_> {
    /// What a derivative with ln p is divided by for that with p.
    pub(super) const fn unit(&self) -> f64 {
        self.step / VALUE_STEP
    }
}

/// With steps of a part of a value: values two steps and one below it, one and two above it, and what a step is in doubles.
pub(super) fn beside_value(value: f64, part: f64) -> ([f64; 4], f64) {
    let step = value * (1.0 + part) - value;
    (STEPS.map(|steps| value + steps * step), step)
}

impl Beside<'_> {
    /// What differs where a value is another; `None` where it changes the period.
    pub(super) fn survey<'n>(
        &self,
        base: Grounds<'_>,
        (name, value): (&'n str, f64),
        cards: &mut HashMap<String, Card>,
        (own, curves): (&Model, &Curves),
    ) -> Result<Option<Survey<'n>>, Error> {
        self.go_on()?;
        let (values, step) = beside_value(value, VALUE_STEP);
        let count = own.circuit().measurements.len();
        let mut explicit = vec![Some(0.0); count];
        if let Some(card) = cards.remove(name) {
            return Ok(Some(Survey {
                name,
                value,
                step,
                initial: DVector::zeros(base.multiport.storage.len()),
                sources: card.sources,
                perturbation: Some(card.perturbation),
                own: explicit,
            }));
        }
        let at = |value: f64| {
            let mut model = own.clone();
            self.set(&mut model, name, value)?;
            Ok::<_, Error>(model)
        };
        let [a, b, c, d] = values.map(at);
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
            multiports.push(multiport.into_standard());
        }
        let near: [StandardMultiport; 4] = multiports.try_into().map_err(|_| {
            Error::before(Reason::internal("analysis::sensitivity", "four circuits"))
        })?;
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
        Ok(Some(Survey {
            name,
            value,
            step,
            initial: DVector::from_vec(initial.collect()),
            sources: near.each_ref().map(sources),
            perturbation: base.multiport.perturbation(near.each_ref()),
            own: explicit,
        }))
    }

    /// By name what differs where a resistance, capacitance, inductance or constant source of a card has another value: coefficients that are its value or the inverse of that, and
    /// sources that are that. Names of other values are left out, and where something else follows a value, as the metric of coupled inductors does, or a clock a voltage that a
    /// triangle is compared with.
    pub(super) fn cards(
        &self,
        base: Grounds<'_>,
        to: &[(String, f64)],
        own: &Model,
    ) -> HashMap<String, Card> {
        let (mut names, mut cards, mut given) = (Vec::new(), Vec::new(), Vec::new());
        for (name, value) in to {
            let Some(id) = own.circuit().element(name) else {
                continue;
            };
            let kind = &own.circuit().elements[id.index()].kind;
            let letter = match kind {
                Kind::Resistor(_) => 'r',
                Kind::Capacitor(_) => 'c',
                Kind::Inductor(_) => 'l',
                Kind::VoltageSource(_) => 'v',
                Kind::CurrentSource(_) => 'i',
                _ => continue,
            };
            let Some(whole) = value_of(kind).filter(|_| name.starts_with(letter)) else {
                continue;
            };
            // The card's value may be multiplied.
            let factor = whole / value;
            let (values, _) = beside_value(*value, VALUE_STEP);
            // A number that no other card has.
            let part = 1.0 + (cards.len() + 1) as f64 * MARK;
            // What a source is may stand in anything.
            if matches!(letter, 'v' | 'i') {
                given.push((name.clone(), value * part));
            }
            names.push((name, id));
            cards.push((whole * part, values.map(|value| value * factor)));
        }
        let circuit = if given.is_empty() {
            Some(own.circuit().clone())
        } else {
            own.circuit_with(&given).ok().map(|(circuit, _)| circuit)
        };
        let mut found = None;
        if let Some(mut circuit) = circuit {
            for ((_, id), (mark, _)) in names.iter().zip(&cards) {
                circuit.elements[id.index()].kind.set_value(*mark);
            }
            let same = circuit.measurements == own.circuit().measurements;
            if self.options.steady {
                circuit = at_rest(&circuit);
            }
            let near = behaviour(&circuit).ok().filter(|_| same);
            let near = near.map(StaticMultiport::into_standard);
            found = near.and_then(|near| Card::all(base.multiport, &near, &cards));
        }
        match found {
            Some(found) => names
                .iter()
                .map(|(name, _)| (*name).clone())
                .zip(found)
                .collect(),
            None if names.len() > 1 => {
                let each = to.iter().map(std::slice::from_ref);
                each.flat_map(|one| self.cards(base, one, own)).collect()
            }
            None => HashMap::new(),
        }
    }

    /// Whether this is another period than that of the orbit, which is refused if that was asked for.
    fn moves(&self, base: Grounds<'_>, name: &str, period: Option<f64>) -> Result<bool, Error> {
        let moves = base.period.zip(period).is_some_and(|(own, other)| {
            let laps = (own / other).round() * other;
            (laps - own).abs() > PERIOD_MOVES * VALUE_STEP * own
        });
        if moves && !self.options.to.is_empty() {
            let what =
                format!("`{name}` changes the period, on which the steady state depends otherwise");
            return Err(not_smooth(what));
        }
        Ok(moves)
    }

    /// How all changes with a value: by the reductions that all values have in common, or by those of the circuits beside.
    pub(super) fn changes(
        &self,
        base: &Base,
        tableau: Option<(&Tableau, Option<&Rest>)>,
        (own, survey): (&Model, &Survey<'_>),
    ) -> Result<Changes, Error> {
        let at = |steps: f64| {
            let mut model = own.clone();
            model.set(survey.name, survey.value + steps * survey.step)?;
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
}
