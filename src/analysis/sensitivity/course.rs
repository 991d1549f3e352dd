//! A run in steps on matrices without their zeros, to be differentiated: where it begins, and what measurements see of it.

use std::sync::atomic::AtomicBool;

use super::Beside;
use super::base::seen;
use crate::analysis::periodic::{PeriodicOptions, settled_large};
use crate::analysis::variation::Weighted;
use crate::circuit::{Circuit, Tran, Weights};
use crate::integrate::{
    Bend, Error, Lengths, Reads, Reason, Returns, STAGES, Standing, Stepped, Tape, Weighed,
    through_stages,
};
use crate::lcs::{Hold, Position, SparseLcs, StorageHold};
use crate::measure::{Curves, INTERVALS, VALUES};
use crate::mna::{StandardMultiport, StaticMultiport};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{
    FINER_ORBIT, FINEST_ORBIT, SAME_REDUCTION, STEPPED_DERIVATIVES,
};

/// Values of a piece of a curve by stage of its step.
type Through = [[f64; STAGES]; VALUES];

/// See the [module](self).
pub(super) struct Course {
    circuit: Circuit,
    behaviour: StaticMultiport,
    pub(super) multiport: StandardMultiport,
    pub(super) standing: Standing,
    /// By switch, at the operating point that a transient begins with: on.
    rest: Vec<bool>,
    /// The end of the run, s, and of a transient what is asked for.
    until: f64,
    tran: Tran,
    /// Of an orbit its period, and from when to when measurements see it, s.
    pub(super) orbit: Option<(f64, (f64, f64))>,
    /// What of a transient is seen, s.
    span: (f64, f64),
    settings: Settings,
    /// Of smooth steps, and of those that bend.
    through: [Through; 2],
}

impl Course {
    /// Of what [`Beside`] asks for, where its steps are made on matrices without their zeros.
    pub(super) fn of(beside: &Beside<'_>, model: &Model) -> Result<Option<Self>, Error> {
        let options = beside.options;
        let settings = Settings {
            tol: (FINER_ORBIT * options.settings.tol).max(FINEST_ORBIT),
            large: options.settings.large.min(STEPPED_DERIVATIVES),
            ..options.settings.clone()
        };
        let through = [false, true].map(|bends| {
            std::array::from_fn(|k| through_stages(k as f64 / INTERVALS as f64, bends))
        });
        if options.steady {
            let asked = PeriodicOptions {
                settings: Settings {
                    tol: options.settings.tol,
                    ..settings.clone()
                },
                ..beside.periodic()
            };
            let Some(found) = settled_large(model, &asked)? else {
                return Ok(None);
            };
            let (standing, period) = (found.standing(), found.orbit().period);
            return Ok(Some(Self {
                until: standing.t + period,
                tran: found.searched(),
                orbit: Some((period, beside.seen_span(model.circuit()))),
                span: (f64::NEG_INFINITY, f64::INFINITY),
                multiport: found.multiport().standard(),
                behaviour: found.multiport().clone(),
                circuit: found.circuit().clone(),
                standing,
                rest: Vec::new(),
                settings,
                through,
            }));
        }
        let Some(tran) = model.circuit().tran else {
            return Ok(None);
        };
        let (circuit, behaviour) = (model.circuit(), model.multiport());
        let Some(returns) = Returns::of(circuit, behaviour, None, (&tran, &settings))? else {
            return Ok(None);
        };
        Ok(Some(Self {
            standing: returns.start().clone(),
            rest: returns.rest().to_vec(),
            until: tran.tstop,
            span: (circuit.measured_from(&tran), tran.tstop),
            tran,
            orbit: None,
            multiport: behaviour.standard(),
            behaviour: behaviour.clone(),
            circuit: circuit.clone(),
            settings,
            through,
        }))
    }

    /// What makes the run, of the circuit or of one with sources for changes, and writes this down of it.
    pub(super) fn returns(
        &self,
        perturbed: Option<StandardMultiport>,
        reads: Reads,
    ) -> Result<Returns, Error> {
        let asked = (&self.tran, &self.settings);
        let made = Returns::of(&self.circuit, &self.behaviour, perturbed, asked)?;
        let mut returns = made.ok_or_else(|| {
            let what = "a large circuit is none with sources for changes";
            Error::before(Reason::internal("analysis::sensitivity", what))
        })?;
        returns.read(reads);
        Ok(returns)
    }

    /// The run; its steps (h, end), s, where they were chosen.
    pub(super) fn pass(
        &self,
        returns: &mut Returns,
        lengths: Lengths<'_>,
        cancel: Option<&AtomicBool>,
    ) -> Result<(Tape, Vec<(f64, f64)>), Error> {
        let Standing {
            t, state, switches, ..
        } = &self.standing;
        let place = (*t, &state[..], &switches[..]);
        let passed = returns.pass(place, self.until, lengths, cancel)?;
        Ok((passed.tape, passed.steps))
    }

    /// The first columns of what was read, as measurements see them.
    pub(super) fn curves(&self, tape: &Tape, columns: usize) -> Curves {
        let mut curves = Curves::of(columns);
        for part in parts(tape) {
            let values: Vec<[f64; VALUES]> = match part.ends {
                None => {
                    let through = self.through(part.step.bends);
                    let of = |c: usize| {
                        through.map(|weights| {
                            let stages = weights.iter().enumerate();
                            let terms = stages.map(|(k, weight)| weight * part.stage(k)[c]);
                            terms.sum()
                        })
                    };
                    (0..columns).map(of).collect()
                }
                Some(_) => {
                    let (left, right) = part.sides();
                    let both = left.iter().zip(right).take(columns);
                    let line = |(a, b): (&f64, &f64)| {
                        std::array::from_fn(|k| a + (b - a) * k as f64 / INTERVALS as f64)
                    };
                    both.map(line).collect()
                }
            };
            curves.push((part.begin, part.length, 1.0), &values);
        }
        let orbit = self
            .orbit
            .map(|(period, asked)| (period, self.standing.t, asked));
        seen(curves, self.span, orbit)
    }

    /// The part of what signals span to which the steps know them.
    pub(super) const fn known(&self) -> f64 {
        self.settings.tol
    }

    const fn through(&self, bends: bool) -> &Through {
        &self.through[bends as usize]
    }

    /// What these weigh of the stages of steps, and of the times of changes within them.
    pub(super) fn weighed(&self, tape: &Tape, weighted: &Weighted, columns: usize) -> Weighed {
        let parts = parts(tape);
        let (begins, lengths) = weighted.shifts().split_at(parts.len());
        let last = parts.last();
        let mut found = Weighed {
            end: vec![0.0; self.standing.state.len()],
            stages: vec![0.0; last.map_or(0, |part| part.number + 1) * STAGES * columns],
            times: vec![
                0.0;
                parts
                    .iter()
                    .filter_map(|part| part.ends?.1)
                    .map(|(k, _)| k + 1)
                    .max()
                    .unwrap_or(0)
            ],
        };
        for (k, part) in parts.iter().enumerate() {
            let nodes = &weighted.nodes()[k * columns..(k + 1) * columns];
            let stages = &mut found.stages[part.number * STAGES * columns..];
            let Some((from, to)) = part.ends else {
                let through = self.through(part.step.bends);
                for (c, nodes) in nodes.iter().enumerate() {
                    for (weight, through) in nodes.iter().zip(through) {
                        let of = through.iter().enumerate();
                        of.for_each(|(stage, own)| stages[stage * columns + c] += weight * own);
                    }
                }
                continue;
            };
            let stage = if from.is_none() { 0 } else { STAGES - 1 };
            let (left, right) = part.sides();
            let (mut begin, mut length) = (begins[k], lengths[k]);
            for (c, nodes) in nodes.iter().enumerate() {
                let rate = (right[c] - left[c]) / part.length;
                for (j, weight) in nodes.iter().enumerate() {
                    stages[stage * columns + c] += weight;
                    begin += weight * rate;
                    length += weight * rate * j as f64 / INTERVALS as f64;
                }
            }
            if let Some((bend, _)) = from {
                found.times[bend] += begin - length;
            }
            if let Some((bend, _)) = to {
                found.times[bend] += length;
            }
        }
        found
    }

    /// Whether a transient begins with what `IC=` says.
    pub(super) fn begins_as_told(&self) -> bool {
        let storage = self.multiport.storage.iter();
        let initial = storage.map(|s| s.initial.unwrap_or(0.0));
        self.tran.uic && initial.eq(self.standing.state.iter().copied())
    }

    /// The static equations at a transient's start, with sources for changes: nothing where its storage is not theirs.
    pub(super) fn rest(&self, perturbed: &StandardMultiport, reads: &Reads) -> Option<AtRest> {
        let hold = |conducts: &bool| if *conducts { Hold::Closed } else { Hold::Open };
        let position = Position {
            devices: self.standing.conducting.iter().map(hold).collect(),
            switches: self.rest.clone(),
            storage: StorageHold::Static,
        };
        if position.devices.len() != self.multiport.pairs.len() {
            return None;
        }
        let (lcs, readings) = SparseLcs::with_readings(perturbed, &position).ok()?;
        let inputs = lcs.inputs.iter();
        let u: Vec<f64> = inputs.map(|i| i.source.value_left(0.0)).collect();
        let mut found = readings.storage.one.clone();
        readings.storage.u.add_times(1.0, &u, &mut found);
        let own = &self.standing.state;
        let largest = own.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let mut both = found.iter().zip(own);
        if found.len() != own.len() || !both.all(|(a, b)| (a - b).abs() <= SAME_REDUCTION * largest)
        {
            return None;
        }
        let powers = &readings.power_v;
        let mut row = powers.one.clone();
        powers.u.add_times(1.0, &u, &mut row);
        let mut row = row.split_off(row.len() - reads.last);
        row.extend(reads.rates.iter().map(|_| 0.0));
        row.push(1.0);
        Some(AtRest {
            storage: readings.storage.u,
            row,
        })
    }
}

/// An operating point with sources for changes.
pub(super) struct AtRest {
    /// Storage over inputs.
    storage: crate::lcs::sparse::Csr,
    /// What is read there.
    row: Vec<f64>,
}

impl AtRest {
    /// What inputs weigh there times what drives them, from what the storage weighs.
    pub(super) fn drives(&self, storage: &[f64], drives: &[(usize, usize)]) -> Vec<f64> {
        let mut inputs = vec![0.0; self.storage.shape[1]];
        self.storage.add_transposed(1.0, storage, &mut inputs);
        let driven = drives.iter();
        driven
            .map(|&(input, place)| inputs[input] * self.row[place])
            .collect()
    }
}

/// A change within a step, and its number.
type Change<'a> = Option<(usize, &'a Bend)>;

/// A piece of what measurements see: a step, or a part of one from or to a change within it, which is a line.
struct Part<'a> {
    step: Stepped<'a>,
    /// Of the step.
    number: usize,
    begin: f64,
    length: f64,
    ends: Option<(Change<'a>, Change<'a>)>,
}

impl Part<'_> {
    fn stage(&self, k: usize) -> &[f64] {
        let width = self.step.rows.len() / STAGES;
        &self.step.rows[k * width..(k + 1) * width]
    }

    /// Outputs where it begins and ends.
    fn sides(&self) -> (&[f64], &[f64]) {
        let (from, to) = self.ends.unwrap_or_default();
        (
            from.map_or_else(|| self.stage(0), |(_, bend)| &bend.behind),
            to.map_or_else(|| self.stage(STAGES - 1), |(_, bend)| &bend.before),
        )
    }
}

fn parts(tape: &Tape) -> Vec<Part<'_>> {
    let (mut all, mut bends) = (Vec::new(), 0);
    for (number, step) in tape.steps().enumerate() {
        let (mut begin, mut from) = (step.begin, None);
        let changes: Vec<(usize, &Bend)> = (bends..).zip(step.at.iter().copied()).collect();
        bends += changes.len();
        let cut = !changes.is_empty();
        for to in changes.into_iter().map(Some).chain([None]) {
            let end = to.map_or(step.begin + step.h, |(_, bend)| bend.t);
            all.push(Part {
                step: step.clone(),
                number,
                begin,
                length: if cut { end - begin } else { step.h },
                ends: cut.then_some((from, to)),
            });
            (begin, from) = (end, to);
        }
    }
    all
}

/// What derivatives to the pieces of a tape are ones to: their values, then where they begin and how long they are.
pub(super) fn laid_out(weights: &Weights) -> Weighted {
    let shifts = [&weights.begins[..], &weights.lengths].concat();
    Weighted::of_values(weights.values.clone(), shifts)
}
