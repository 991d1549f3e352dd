//! What a run in sparse steps was made of, and what it makes of small changes of where it began.
//!
//! Along the active sets of its stages and instants a run is an affine map of its start, and its derivative is the product of these:
//!
//! ```text
//! stage      (I − γh Â) δx_i = δx + h Σ_{j<i} a_ij δk_j,      δk_i = (δx_i − δx − h Σ a_ij δk_j)/(γh),
//! ```
//!
//! with Â = A on the active set, so that each stage is one solution with the factors of the run; instants are implicit steps as well, and a switch takes the storage into
//! its new system. No step of the run is made again for it.

use std::sync::Arc;

use super::bend::Bend;
use super::shift::Shift;
use super::system::System;
use crate::integrate::curved::tableau::{GAMMA, LOWER, NODES, STAGES};

/// A step of a run that was read.
#[derive(Debug, Clone)]
pub(crate) struct Stepped<'a> {
    /// s.
    pub(crate) begin: f64,
    /// How long it is, s.
    pub(crate) h: f64,
    /// By stage what was read.
    pub(crate) rows: &'a [f64],
    /// Whether a device changes within it.
    pub(crate) bends: bool,
    /// Where rates or outputs jump by that.
    pub(crate) at: Vec<&'a Bend>,
}

/// Weights of the stages at a part of a step: the cubic through four of them, whose values are of order 3; or the line between its ends, as cubics overshoot where a device changes.
pub(crate) fn through_stages(part: f64, bends: bool) -> [f64; STAGES] {
    const SMOOTH: &[usize] = &[0, 2, 3, 5];
    const BENT: &[usize] = &[0, 5];
    let through = if bends { BENT } else { SMOOTH };
    let mut weights = [0.0; STAGES];
    for &own in through {
        let others = through.iter().filter(|&&other| other != own);
        let factors = others.map(|&other| (part - NODES[other]) / (NODES[own] - NODES[other]));
        weights[own] = factors.product();
    }
    weights
}

/// An active set.
pub(super) type Set = Arc<[bool]>;

/// A part of a run.
#[derive(Debug)]
pub(super) enum Move {
    /// Switches have moved.
    Position {
        from: usize,
        to: usize,
        shift: Option<Box<Shift>>,
        /// What the storage jumped by as states of `to`, of what is [read](Reads).
        jumped: Vec<f64>,
    },
    /// A device changes within the next step, whose sets are those behind it.
    Bend(Box<Bend>),
    /// An instant, s: so many steps of next to no length.
    Jump {
        t: f64,
        system: usize,
        h: (f64, f64),
        sets: Vec<Set>,
        /// A row for each, see [`Reads`].
        rows: Vec<f64>,
    },
    /// A step, with the active sets of its implicit stages.
    Step {
        /// Its end, s.
        end: f64,
        system: usize,
        h: (f64, f64),
        sets: [Option<Set>; STAGES - 1],
        /// A row for each stage, see [`Reads`].
        rows: Vec<f64>,
    },
}

/// What is written down of a run: rows of all outputs, then of readings, rates of storage quantities, and 1.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reads {
    /// The last ones of what makes the powers.
    pub(crate) last: usize,
    /// Storage quantities whose rates are read.
    pub(crate) rates: Vec<usize>,
}

impl Reads {
    /// Where readings begin in a row of so many outputs, rates do, and its length.
    pub(super) fn places(&self, outputs: usize) -> [usize; 3] {
        let rates = outputs + self.last;
        [outputs, rates, rates + self.rates.len() + 1]
    }
}

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Tape {
    pub(super) moves: Vec<Move>,
    last: Option<Set>,
    /// The system of its start.
    pub(super) first: usize,
    /// Whether it is to know what shifts switches.
    pub(super) with_shifts: bool,
    /// Devices change in a way that is not written down.
    pub(super) open: bool,
    /// By output: the largest |value| so far.
    pub(super) largest: Vec<f64>,
}

impl Tape {
    /// Of a run that begins in this system.
    pub(super) fn of(first: usize) -> Self {
        Self {
            first,
            ..Self::default()
        }
    }

    /// Takes note of the sizes of so many outputs.
    pub(super) fn see(&mut self, rows: &[f64], outputs: usize) {
        self.largest.resize(outputs, 0.0);
        let stages = rows.chunks((rows.len() / STAGES).max(1));
        for row in stages {
            let both = self.largest.iter_mut().zip(row);
            both.for_each(|(largest, value)| *largest = largest.max(value.abs()));
        }
    }

    /// An active set, kept once where it stays.
    pub(super) fn set(&mut self, active: &[bool]) -> Set {
        match &self.last {
            Some(last) if **last == *active => Arc::clone(last),
            _ => Arc::clone(self.last.insert(active.into())),
        }
    }

    pub(super) fn position(&mut self, from: usize, to: usize, jumped: Vec<f64>) {
        self.moves.push(Move::Position {
            from,
            to,
            shift: None,
            jumped,
        });
    }

    /// What shifts the last change of position.
    pub(super) fn shifted(&mut self, by: Shift) {
        let mut back = self.moves.iter_mut().rev();
        let last = back.find_map(|part| match part {
            Move::Position { shift, .. } => Some(shift),
            _ => None,
        });
        if let Some(shift) = last {
            *shift = Some(Box::new(by));
        }
    }

    /// h and what it may be off by.
    pub(super) fn jump(
        &mut self,
        (t, system, h): (f64, usize, (f64, f64)),
        (sets, rows): (Vec<Set>, Vec<f64>),
    ) {
        self.moves.push(Move::Jump {
            t,
            system,
            h,
            sets,
            rows,
        });
    }

    pub(super) fn step(
        &mut self,
        (end, system, h): (f64, usize, (f64, f64)),
        (stages, rows): (&[Set], Vec<f64>),
    ) {
        let mut sets = [const { None }; STAGES - 1];
        for (to, set) in sets.iter_mut().zip(stages) {
            *to = Some(Arc::clone(set));
        }
        self.moves.push(Move::Step {
            end,
            system,
            h,
            sets,
            rows,
        });
    }

    /// The steps of a run that was read.
    pub(crate) fn steps(&self) -> impl Iterator<Item = Stepped<'_>> {
        let (mut last, mut at): (Option<&Set>, Vec<&Bend>) = (None, Vec::new());
        self.moves.iter().filter_map(move |part| match part {
            Move::Position { .. } => None,
            Move::Bend(bend) => {
                at.push(bend);
                None
            }
            Move::Jump { sets, .. } => {
                last = sets.last();
                None
            }
            Move::Step {
                end,
                h: (h, _),
                sets,
                rows,
                ..
            } => {
                let all = sets.iter().flatten();
                let bends = last
                    .into_iter()
                    .chain(all.clone())
                    .any(|set| Some(set) != all.clone().last());
                last = all.last();
                Some(Stepped {
                    begin: end - h,
                    h: *h,
                    rows,
                    bends,
                    at: std::mem::take(&mut at),
                })
            }
        })
    }

    /// What the run makes of a change of all storage quantities; `None` where an active set leaves it open.
    pub(super) fn product(
        &self,
        systems: &mut [(Vec<bool>, System)],
        change: &[f64],
    ) -> Option<Vec<f64>> {
        let mut system = self.first;
        let mut x = systems[system].1.change_of_storage(change);
        let mut slopes: [Vec<f64>; STAGES] = Default::default();
        let mut base = Vec::new();
        for part in &self.moves {
            match part {
                &Move::Position { from, to, .. } => {
                    let still = vec![0.0; systems[from].1.lcs.inputs.len()];
                    let storage = systems[from].1.storage_rate(&x, &still);
                    x = systems[to].1.change_of_storage(&storage);
                    system = to;
                }
                Move::Bend(bend) => {
                    let by = bend.by(&x, &[]);
                    x.iter_mut().zip(&bend.rate).for_each(|(x, k)| *x += k * by);
                }
                Move::Jump {
                    system, h, sets, ..
                } => {
                    let kernel = &mut systems[*system].1.kernel;
                    base.clone_from(&x);
                    for set in sets {
                        base.clone_from(&x);
                        if !kernel.change(*h, set, &mut x) {
                            return None;
                        }
                    }
                    // Back to the instant, as the run goes.
                    let (h, back) = (h.0, sets.len().saturating_sub(1) as f64);
                    let slope = x.iter().zip(&base).map(|(b, a)| (b - a) / h);
                    slopes[STAGES - 1] = slope.collect();
                    let ends = base.iter().zip(&slopes[STAGES - 1]);
                    x = ends.map(|(a, k)| a - back * h * k).collect();
                }
                Move::Step {
                    system, h, sets, ..
                } => {
                    let kernel = &mut systems[*system].1.kernel;
                    let (h, slack) = *h;
                    slopes.swap(0, STAGES - 1);
                    let start = x.clone();
                    for (stage, set) in (1..STAGES).zip(sets) {
                        base.clone_from(&start);
                        for (slope, weight) in slopes.iter().zip(LOWER[stage]) {
                            let add = base.iter_mut().zip(slope);
                            add.for_each(|(x, k)| *x += h * weight * k);
                        }
                        x.clone_from(&base);
                        if !kernel.change((GAMMA * h, slack), set.as_ref()?, &mut x) {
                            return None;
                        }
                        let moved = x.iter().zip(&base);
                        let slope = &mut slopes[stage];
                        slope.clear();
                        slope.extend(moved.map(|(x, old)| (x - old) / (GAMMA * h)));
                    }
                }
            }
        }
        let system = &systems[system].1;
        let still = vec![0.0; system.lcs.inputs.len()];
        Some(system.storage_rate(&x, &still))
    }
}
