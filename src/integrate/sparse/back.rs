//! What measurements weigh of a run, carried back along its [`Tape`]: the transpose of its derivative, step by step.
//!
//! ```text
//! stage      [r; q] = K⁻ᵀ [ξ_i + κ_i/(γh); η_i],      β_i = r − κ_i/(γh),      κ_j += h a_ij β_i (j < i),      ξ⁻ = Σ β_i,
//! sources    υ_i = γh Êᵀ r + Gᵀ q + Fᵀ ω_i,
//! ```
//!
//! with what x, x' and λ of a stage weigh in ξ, κ and η, and what outputs do in ω. A source e = δc z that stands for another coefficient c + δc weighs Σ υ_i z_i of what was [read](Reads)
//! in the run (S. W. Director, R. A. Rohrer, "The generalized adjoint network and network sensitivities", IEEE Trans. Circuit Theory, 1969): one way back serves all values.

use super::Returns;
use super::bend::Bend;
use super::system::System;
use super::tape::{Move, Reads, Set, Tape};
use crate::integrate::curved::tableau::{GAMMA, LOWER, STAGES};
use crate::lcs::sparse::SparseRows;

/// What is carried back.
#[derive(Debug, Clone, Default)]
pub(crate) struct Weighed {
    /// By storage quantity at the end.
    pub(crate) end: Vec<f64>,
    /// By step, stage and output; nothing where no output counts.
    pub(crate) stages: Vec<f64>,
    /// By [`Bend`]: its time.
    pub(crate) times: Vec<f64>,
}

/// What came of it.
#[derive(Debug, Clone)]
pub(crate) struct Returned {
    /// By storage quantity where the run begins.
    pub(crate) start: Vec<f64>,
    /// By drive: Σ υ z.
    pub(crate) drives: Vec<f64>,
}

/// An input that is driven, and the place in a row of what drives it, from the first reading on.
pub(crate) type Drive = (usize, usize);

/// What states, slopes and λ weigh where the way back stands.
struct Costate<'a> {
    stages: &'a [f64],
    x: Vec<f64>,
    slope: Vec<f64>,
    lambda: Vec<f64>,
    drives: Vec<f64>,
}

/// The way back.
struct Way<'a> {
    reads: &'a Reads,
    drives: &'a [Drive],
    /// What inputs weigh at an instant.
    inputs: Vec<f64>,
}

impl Way<'_> {
    /// Adds what inputs weigh times what drives them, from a row of readings on.
    fn add(&mut self, row: &[f64], sums: &mut [f64]) {
        for (sum, &(input, place)) in sums.iter_mut().zip(self.drives) {
            *sum += self.inputs[input] * row[place];
        }
        self.inputs.fill(0.0);
    }

    fn step(
        &mut self,
        system: &mut System,
        ((h, slack), sets): ((f64, f64), &[Option<Set>]),
        rows: &[f64],
        (at, costate): (usize, &mut Costate<'_>),
    ) -> Option<()> {
        let outputs = system.lcs.outputs.len();
        let [first, _, width] = self.reads.places(outputs);
        let of_stage = |stage: usize| {
            let from = (at * STAGES + stage) * outputs;
            costate.stages.get(from..from + outputs).unwrap_or(&[])
        };
        let mut slopes: [Vec<f64>; STAGES] = [const { Vec::new() }; STAGES];
        for slope in &mut slopes {
            slope.resize(costate.x.len(), 0.0);
        }
        slopes[STAGES - 1] = std::mem::take(&mut costate.slope);
        let mut start = vec![0.0; costate.x.len()];
        let (mut x, mut lambda) = (
            std::mem::take(&mut costate.x),
            std::mem::take(&mut costate.lambda),
        );
        for stage in (1..STAGES).rev() {
            weigh(
                &system.lcs.output_rows,
                of_stage(stage),
                (&mut x, &mut lambda, &mut self.inputs),
            );
            let turned: Vec<f64> = slopes[stage].iter().map(|k| k / (GAMMA * h)).collect();
            x.iter_mut().zip(&turned).for_each(|(x, k)| *x += k);
            let set = sets[stage - 1].as_ref()?;
            if !system
                .kernel
                .back((GAMMA * h, slack), set, &mut x, &mut lambda)
            {
                return None;
            }
            let lcs = &system.lcs;
            lcs.e.add_transposed(GAMMA * h, &x, &mut self.inputs);
            lcs.g.add_transposed(1.0, &lambda, &mut self.inputs);
            let row = &rows[stage * width + first..][..width - first];
            self.add(row, &mut costate.drives);
            x.iter_mut().zip(&turned).for_each(|(x, k)| *x -= k);
            start.iter_mut().zip(&x).for_each(|(sum, x)| *sum += x);
            for (slope, weight) in slopes.iter_mut().zip(LOWER[stage]) {
                let add = slope.iter_mut().zip(&x);
                add.for_each(|(k, x)| *k += h * weight * x);
            }
            x.fill(0.0);
            lambda.fill(0.0);
        }
        weigh(
            &system.lcs.output_rows,
            of_stage(0),
            (&mut start, &mut lambda, &mut self.inputs),
        );
        self.add(&rows[first..width], &mut costate.drives);
        costate.x = start;
        costate.lambda = lambda;
        costate.slope = std::mem::take(&mut slopes[0]);
        Some(())
    }

    fn jump(
        &mut self,
        system: &mut System,
        ((h, slack), sets): ((f64, f64), &[Set]),
        rows: &[f64],
        costate: &mut Costate<'_>,
    ) -> Option<()> {
        let [first, _, width] = self.reads.places(system.lcs.outputs.len());
        let Costate {
            x, slope, lambda, ..
        } = costate;
        // Back to the instant, as the run goes: x_n − (n − 1)(x_n − x_{n−1}).
        let back = sets.len().saturating_sub(1) as f64;
        let mut before: Vec<f64> = x.iter().map(|x| back * x).collect();
        x.iter_mut().for_each(|x| *x *= 1.0 - back);
        let lcs = &system.lcs;
        lcs.a.add_transposed(1.0, slope, x);
        lcs.b.add_transposed(1.0, slope, lambda);
        lcs.e.add_transposed(1.0, slope, &mut self.inputs);
        slope.fill(0.0);
        for (k, set) in sets.iter().enumerate().rev() {
            if !system.kernel.back((h, slack), set, x, lambda) {
                return None;
            }
            let lcs = &system.lcs;
            lcs.e.add_transposed(h, x, &mut self.inputs);
            lcs.g.add_transposed(1.0, lambda, &mut self.inputs);
            let row = &rows[k * width + first..][..width - first];
            self.add(row, &mut costate.drives);
            x.iter_mut().zip(&before).for_each(|(x, b)| *x += b);
            before.fill(0.0);
            lambda.fill(0.0);
        }
        Some(())
    }

    fn bend(&mut self, bend: &Bend, (time, outputs): (f64, usize), costate: &mut Costate<'_>) {
        let [first, ..] = self.reads.places(outputs);
        let along: f64 = bend.rate.iter().zip(&costate.x).map(|(k, x)| k * x).sum();
        let by = -(along + time);
        let moved = costate.x.iter_mut().zip(&bend.states);
        moved.for_each(|(x, g)| *x += by * g);
        let driven = self.inputs.iter_mut().zip(&bend.inputs);
        driven.for_each(|(u, g)| *u += by * g);
        self.add(&bend.row[first..], &mut costate.drives);
    }

    fn position(
        &mut self,
        (from, to): (&System, &System),
        jumped: &[f64],
        costate: &mut Costate<'_>,
    ) {
        let [first, rates, width] = self.reads.places(from.lcs.outputs.len());
        let mut row = vec![0.0; width - first];
        let places = row[rates - first..].iter_mut();
        places.zip(jumped).for_each(|(place, by)| *place = *by);
        to.lcs.e.add_transposed(1.0, &costate.x, &mut self.inputs);
        self.add(&row, &mut costate.drives);
        let mut storage = vec![0.0; from.readings.storage.one.len()];
        to.lcs.inject.add_transposed(1.0, &costate.x, &mut storage);
        self.storage(from, &storage, costate);
    }

    /// From what storage quantities of a system weigh to its states and inputs.
    fn storage(&mut self, system: &System, storage: &[f64], costate: &mut Costate<'_>) {
        let [first, _, width] = self.reads.places(system.lcs.outputs.len());
        let n = system.lcs.states.len();
        for part in [&mut costate.x, &mut costate.slope] {
            part.clear();
            part.resize(n, 0.0);
        }
        costate.lambda.clear();
        costate.lambda.resize(system.m(), 0.0);
        let rows = &system.readings.storage;
        rows.x.add_transposed(1.0, storage, &mut costate.x);
        rows.u.add_transposed(1.0, storage, &mut self.inputs);
        // What is constant is driven there too.
        let mut row = vec![0.0; width - first];
        row[width - first - 1] = 1.0;
        self.add(&row, &mut costate.drives);
    }
}

/// Adds what rows weigh by what they are of.
fn weigh(rows: &SparseRows, weights: &[f64], (x, lambda, u): (&mut [f64], &mut [f64], &mut [f64])) {
    rows.x.add_transposed(1.0, weights, x);
    rows.lambda.add_transposed(1.0, weights, lambda);
    rows.u.add_transposed(1.0, weights, u);
}

impl Returns {
    /// Carries these back along the tape of a run with [`Self::reads`]; `None` where an active set leaves it open.
    pub(crate) fn back(
        &mut self,
        tape: &Tape,
        drives: &[Drive],
        weighed: &[Weighed],
    ) -> Option<Vec<Returned>> {
        if tape.open {
            return None;
        }
        let reads = self.sparse.reads.clone().unwrap_or_default();
        let systems = &mut self.sparse.systems;
        let last = tape.moves.iter().rev().find_map(|part| match part {
            Move::Step { system, .. } | Move::Jump { system, .. } => Some(*system),
            Move::Position { to, .. } => Some(*to),
            Move::Bend(_) => None,
        });
        let mut at = last.unwrap_or(tape.first);
        let mut way = Way {
            reads: &reads,
            drives,
            inputs: vec![0.0; systems[at].1.lcs.inputs.len()],
        };
        let costates = weighed.iter().map(|weighed| {
            let mut costate = Costate {
                stages: &weighed.stages,
                x: vec![],
                slope: vec![],
                lambda: vec![],
                drives: vec![0.0; drives.len()],
            };
            way.storage(&systems[at].1, &weighed.end, &mut costate);
            costate
        });
        let mut costates: Vec<Costate<'_>> = costates.collect();
        let mut steps = tape.steps().count();
        let of_bends = tape
            .moves
            .iter()
            .filter(|part| matches!(part, Move::Bend(_)));
        let mut bends = of_bends.count();
        for part in tape.moves.iter().rev() {
            match part {
                &Move::Position {
                    from,
                    to,
                    ref jumped,
                    ..
                } => {
                    for costate in &mut costates {
                        way.position((&systems[from].1, &systems[to].1), jumped, costate);
                    }
                    at = from;
                }
                Move::Bend(bend) => {
                    bends -= 1;
                    let outputs = systems[at].1.lcs.outputs.len();
                    for (costate, weighed) in costates.iter_mut().zip(weighed) {
                        let time = weighed.times.get(bends).copied().unwrap_or_default();
                        way.bend(bend, (time, outputs), costate);
                    }
                }
                Move::Jump { h, sets, rows, .. } => {
                    for costate in &mut costates {
                        way.jump(&mut systems[at].1, (*h, sets), rows, costate)?;
                    }
                }
                Move::Step { h, sets, rows, .. } => {
                    steps -= 1;
                    for costate in &mut costates {
                        let of = (steps, costate);
                        way.step(&mut systems[at].1, (*h, sets), rows, of)?;
                    }
                }
            }
        }
        let first = &systems[at].1;
        let returned = costates.into_iter().map(|costate| {
            let mut start = vec![0.0; first.readings.storage.one.len()];
            first.lcs.inject.add_transposed(1.0, &costate.x, &mut start);
            Returned {
                start,
                drives: costate.drives,
            }
        });
        Some(returned.collect())
    }

    /// Has tapes hold what is read of a run.
    pub(crate) fn read(&mut self, reads: Reads) {
        self.sparse.reads = Some(reads);
    }

    /// Whether no output, reading, storage or control follows the derivative of an input from this one on, nor storage or a control the input itself: in all positions so far.
    pub(crate) fn inputs_stay_apart(&self, first: usize) -> bool {
        self.sparse.systems.iter().all(|(_, system)| {
            let readings = &system.readings;
            let still =
                |matrix: &crate::lcs::sparse::Csr| matrix.indices.iter().all(|&j| j < first);
            let rows = [&system.lcs.output_rows, &readings.power_v];
            rows.iter().all(|rows| still(&rows.du))
                && [&readings.storage, &readings.controls]
                    .iter()
                    .all(|rows| still(&rows.u) && still(&rows.du))
        })
    }

    /// Whether some switch follows this input, in the positions so far.
    pub(crate) fn moves_switches(&self, input: usize) -> bool {
        let mut systems = self.sparse.systems.iter();
        systems.any(|(_, system)| system.readings.controls.u.indices.contains(&input))
    }
}
