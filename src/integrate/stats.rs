//! What a run did and what it found, besides the waveforms.

use crate::integrate::Note;
use crate::integrate::aliasing::Aliased;
use crate::integrate::event::Event;
use crate::integrate::orbit::Orbit;
use crate::integrate::rows::RowKind;
use crate::integrate::verify::Verified;
use crate::settings::tolerances::jumps::{DESTROYED, NO_JUMP};
use crate::settings::tolerances::stated::{IMPRECISE, SELDOM, UNBALANCED};
use crate::waveform::Waveforms;

/// Counters of one run; deterministic except `cpu_seconds`.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Accepted time steps.
    pub steps: u64,
    /// Rejected time steps.
    pub rejected: u64,
    /// Changes of mode.
    pub events: u64,
    /// Changes of state by an impulse.
    pub jumps: u64,
    /// Distinct modes (active sets, switch positions) visited.
    pub modes: u64,
    /// Positions of the switches stood in.
    pub positions: u64,
    /// Complementarity systems reduced, each of one of these.
    pub systems: u64,
    /// Of these, the ones whose devices may need an impulse: they have jump logic.
    pub impulsive: u64,
    /// One-step complementarity problems solved (cached active sets that were accepted included).
    pub lcp_solves: u64,
    /// Of these, the ones where the cached active set did not hold and a solver ran.
    pub pivotings: u64,
    /// Factorisations computed.
    pub factorisations: u64,
    /// User CPU seconds of the solve alone.
    pub cpu_seconds: f64,
}

impl Stats {
    /// Without what was built once for several parts, or for the run before.
    #[must_use]
    pub const fn of_shared_modes(self) -> Self {
        Self {
            modes: 0,
            positions: 0,
            systems: 0,
            impulsive: 0,
            ..self
        }
    }

    /// Adds those of another part.
    pub fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.rejected += other.rejected;
        self.events += other.events;
        self.jumps += other.jumps;
        self.modes += other.modes;
        self.positions += other.positions;
        self.systems += other.systems;
        self.impulsive += other.impulsive;
        self.lcp_solves += other.lcp_solves;
        self.pivotings += other.pivotings;
        self.factorisations += other.factorisations;
        self.cpu_seconds += other.cpu_seconds;
    }
}

/// The energy balance of a run, J.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Energy {
    /// Delivered by sources.
    pub source: f64,
    /// Dissipated in resistors, switches and devices.
    pub dissipated: f64,
    /// Stored at the end minus stored at the start.
    pub stored: f64,
    /// Lost in jumps: where charges or fluxes are joined, or find no path, in no time.
    pub jumps: f64,
    /// Lost by the damping of the steps; less than nothing where they add energy.
    pub numerical: f64,
    /// source − dissipated − stored − jumps − numerical: what these, each computed by itself, leave unexplained.
    pub residual: f64,
    /// |residual| relative to the largest energy seen.
    pub residual_relative: f64,
}

impl Energy {
    /// Whether the residual is no more than rounding and what steps beside lines leave.
    pub(crate) fn adds_up(&self) -> bool {
        self.residual.is_finite() && self.residual_relative <= UNBALANCED
    }

    /// What was at hand in the course of the run, J.
    pub(crate) fn at_hand(&self) -> f64 {
        self.source.abs() + self.dissipated.abs() + self.stored.abs()
    }
}

/// A current (or voltage) impulse.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Impulse {
    /// Time, s.
    pub t: f64,
    /// `i(d1)`.
    pub name: String,
    /// A·s or V·s.
    pub area: f64,
}

/// What made the state jump.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum JumpReason {
    /// The initial values contradict each other, or the sources at t = 0⁺.
    Start,
    /// An edge of a source.
    SourceEdge,
    /// Switches that moved, `s1, s2`.
    Switch(String),
    /// A device that began to conduct or to block.
    Device(String),
}

impl std::fmt::Display for JumpReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Start => f.write_str("start"),
            Self::SourceEdge => f.write_str("source edge"),
            Self::Switch(name) => write!(f, "switch {name}"),
            Self::Device(name) => write!(f, "device {name}"),
        }
    }
}

impl serde::Serialize for JumpReason {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A jump that changed voltages of capacitors or currents of inductors by more than rounding.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StateJump {
    /// Time, s.
    pub t: f64,
    /// The capacitors and inductors that jumped.
    pub elements: Vec<String>,
    /// The energy it lost, J.
    pub loss: f64,
    /// What made it.
    pub reason: JumpReason,
    /// Whether a current lost its path or charges of different voltages were joined: energy that no device took up in time.
    #[serde(skip)]
    pub destroys: bool,
    /// ½ ΔᵀMΔ of the change Δ of the storage, with its energy ½ sᵀMs, J.
    #[serde(skip)]
    pub(crate) change: f64,
}

impl StateJump {
    /// The jump at `t` of the storage elements `moved`, which lost `loss`, J, by a change of ½ ΔᵀMΔ = `change`, J, where `energy`, J, is at hand. At an edge of a source
    /// capacitors take up their charge through devices that a resistance, however small, would have warmed in their place: no charge
    /// is destroyed.
    pub(crate) fn new(
        t: f64,
        storage: (&[String], &[&str]),
        moved: &[usize],
        (loss, change, energy): (f64, f64, f64),
        reason: JumpReason,
    ) -> Self {
        let (elements, units) = storage;
        let current = moved.iter().any(|&k| units[k] == "A");
        Self {
            t,
            elements: moved.iter().map(|&k| elements[k].clone()).collect(),
            loss,
            destroys: loss > DESTROYED * energy && (current || reason != JumpReason::SourceEdge),
            reason,
            change,
        }
    }
}

/// The jumps of a run: the first one by one, and all of them together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StateJumps {
    /// The first [`Self::KEPT`].
    pub first: Vec<StateJump>,
    /// The first of those that destroy a current or charge.
    pub destroyer: Option<StateJump>,
    /// Number and loss, J, of all.
    pub all: (u64, f64),
    /// Number and loss, J, of those that destroy a current or charge.
    pub destroying: (u64, f64),
}

impl StateJumps {
    /// Jumps that are kept one by one.
    pub const KEPT: usize = 100;

    /// Adds the jumps of another run.
    pub fn extend(&mut self, other: &Self) {
        let add = |sum: &mut (u64, f64), own: (u64, f64)| {
            sum.0 += own.0;
            sum.1 += own.1;
        };
        add(&mut self.all, other.all);
        add(&mut self.destroying, other.destroying);
        if self.destroyer.is_none() {
            self.destroyer.clone_from(&other.destroyer);
        }
        let room = Self::KEPT - self.first.len().min(Self::KEPT);
        self.first.extend(other.first.iter().take(room).cloned());
    }

    /// Adds the jumps of a part that goes on beside, in the order of time.
    pub(crate) fn add_beside(&mut self, other: &Self) {
        if other.all.0 == 0 {
            return;
        }
        let earlier = |jump: &&StateJump| {
            let known = self.destroyer.as_ref();
            known.is_none_or(|known| jump.t < known.t)
        };
        if let Some(first) = other.destroyer.as_ref().filter(earlier) {
            self.destroyer = Some(first.clone());
        }
        let kept = std::mem::take(&mut self.first);
        self.extend(other);
        self.first = kept;
        self.first.extend(other.first.iter().cloned());
        self.first.sort_by(|a, b| a.t.total_cmp(&b.t));
        self.first.truncate(Self::KEPT);
    }

    /// Takes back the jump at the start whose change is rounding beside the energy of the whole run, J: there nothing is known of sizes yet. What it lost says
    /// nothing of its size in an active network, and without an energy there is none. Whether there was one.
    pub(crate) fn forget_rounding(&mut self, energy: f64) -> bool {
        let is = |jump: &StateJump| {
            let rounding = NO_JUMP * NO_JUMP * energy;
            jump.reason == JumpReason::Start && jump.change > 0.0 && jump.change <= rounding
        };
        let Some(at) = self.first.iter().position(is) else {
            return false;
        };
        let jump = self.first.remove(at);
        let less = |(number, loss): &mut (u64, f64)| {
            *number -= 1;
            *loss -= jump.loss;
        };
        less(&mut self.all);
        if jump.destroys {
            less(&mut self.destroying);
            self.destroyer = self.first.iter().find(|other| other.destroys).cloned();
        }
        true
    }

    /// Adds a jump.
    pub fn add(&mut self, jump: StateJump) {
        let count = |(number, loss): &mut (u64, f64)| {
            *number += 1;
            *loss += jump.loss;
        };
        count(&mut self.all);
        if jump.destroys {
            count(&mut self.destroying);
            self.destroyer.get_or_insert_with(|| jump.clone());
        }
        if self.first.len() < Self::KEPT {
            self.first.push(jump);
        }
    }
}

/// The error of a run as far as its method knows it, relative to the amplitude of each quantity.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct StatedError {
    /// Of the worst value.
    pub max: Option<f64>,
    /// Root mean square over the run, of the worst quantity.
    pub rms: Option<f64>,
    /// How far events may be aside, s. A row that an event passes by less than this and less than its distance to the next row is no error of
    /// [`Self::max`].
    pub event_time: Option<f64>,
}

impl StatedError {
    /// That of a run whose start is off by so much, in parts of the amplitudes; infinitely where it is not known by how much.
    pub(crate) fn begins_off(&mut self, off: f64) {
        for error in [&mut self.max, &mut self.rms] {
            *error = error.map(|error| error.max(off)).filter(|e| e.is_finite());
        }
    }

    /// Whether the worst value, if it is known, is good for more than its order of magnitude.
    pub(crate) fn is_small(&self) -> bool {
        self.max.is_none_or(|max| max <= IMPRECISE)
    }

    /// Whether the worst value, however large its error, is one of few.
    pub(crate) fn is_of_single_rows(&self) -> bool {
        self.rms.is_some_and(|rms| rms <= SELDOM)
    }

    /// That of two runs together: known where both are.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let both = |a: Option<f64>, b: Option<f64>| Some(a?.max(b?));
        Self {
            max: both(self.max, other.max),
            rms: both(self.rms, other.rms),
            event_time: both(self.event_time, other.event_time),
        }
    }
}

/// Everything a simulation returns.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// The waveforms on the output grid (with event rows if asked for); no row where they were for [`SimOptions::rows`] alone.
    ///
    /// [`SimOptions::rows`]: crate::integrate::SimOptions::rows
    pub waveforms: Waveforms,
    /// What each row stands at; empty where all are the grid's.
    pub kinds: Vec<RowKind>,
    /// `exact`, `theta`, `euler`.
    pub method: String,
    /// What the plan decided, in words.
    pub plan: Vec<String>,
    /// Counters.
    pub stats: Stats,
    /// The energy balance.
    pub energy: Energy,
    /// Whether the energies are known: a system without a circuit has no powers to balance.
    pub balanced: bool,
    /// The error that the steps themselves let expect; nothing for exact runs, nor where the steps do not tell.
    pub error: StatedError,
    /// Impulses at jumps.
    pub impulses: Vec<Impulse>,
    /// Jumps of the state.
    pub state_jumps: StateJumps,
    /// Changes of devices and switches, and jumps, in order of time.
    pub events: Vec<Event>,
    /// Things the user should know.
    pub notes: Vec<Note>,
    /// What repeats too fast for the output times.
    pub aliased: Option<Aliased>,
    /// What a second run by an independent method found, where there was one.
    pub verified: Option<Verified>,
    /// The periodic steady state of which it is one period, if it is one.
    pub orbit: Option<Orbit>,
    /// Capacitor voltages, V, and inductor currents, A, where it ends; empty where they are not told.
    pub storage: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jump(loss: f64, reason: JumpReason) -> StateJump {
        let storage = (&["l1".to_owned()][..], &["A"][..]);
        StateJump::new(0.0, storage, &[0], (loss, loss, loss), reason)
    }

    /// At the start a current of rounding is the largest there has been; beside the energy of the run it is nothing.
    #[test]
    fn a_jump_of_rounding_at_the_start_is_none() {
        let mut jumps = StateJumps::default();
        jumps.add(jump(1e-33, JumpReason::Start));
        jumps.add(jump(1e-3, JumpReason::Switch("s1".into())));
        assert_eq!(jumps.destroying, (2, 1e-33 + 1e-3));
        assert!(!jumps.forget_rounding(1e-10));
        assert!(jumps.forget_rounding(1.0));
        assert_eq!((jumps.all, jumps.destroying), ((1, 1e-3), (1, 1e-3)));
        assert_eq!(jumps.destroyer.map(|jump| jump.loss), Some(1e-3));
        // A source may give what the jump takes, and a system may have no energy.
        for (loss, change) in [(0.0, 1e-3), (-1e-3, 1e-3), (0.0, 0.0)] {
            let mut jumps = StateJumps::default();
            jumps.add(StateJump {
                change,
                ..jump(loss, JumpReason::Start)
            });
            assert!(!jumps.forget_rounding(1.0), "{loss} {change}");
        }
    }

    #[test]
    fn the_counts_of_two_parts_add_up_one_by_one() {
        let counts = |n: u64| Stats {
            steps: n,
            rejected: 2 * n,
            events: 3 * n,
            jumps: 4 * n,
            modes: 5 * n,
            positions: 6 * n,
            systems: 7 * n,
            impulsive: 8 * n,
            lcp_solves: 9 * n,
            pivotings: 10 * n,
            factorisations: 11 * n,
            cpu_seconds: 12.0 * n as f64,
        };
        let mut sum = counts(1);
        sum.add(&counts(10));
        assert_eq!(sum, counts(11));
    }
}
