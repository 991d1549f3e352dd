//! Whether a mode can be entered: what it conserves, what must vanish, and on which side of zero its guards leave.

use super::exosystem::Exosystem;
use super::key::Owner;
use super::magnitudes::ORDERS;
use super::mode::Mode;
use super::rounding::resolution;
use super::slaved::Manifold;
use crate::linalg::refill::{raise, refill};
use crate::settings::tolerances::events::{GROUP, NOISE};
use crate::settings::tolerances::jumps::CONSISTENT;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// The mode does not exist at this state: it would move charge or flux, or a constraint does not hold.
    Inconsistent,
    /// A guard of devices or of a sliding switch leaves downwards: its row.
    Refused(usize),
    /// All guards of devices hold on some interval after now; these switches leave at once.
    Holds(Vec<usize>),
}

/// Work space of inspections; after one, `w` stands in the inspected mode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inspector {
    /// `[w | g | g']` in the inspected mode.
    pub(crate) w: Vec<f64>,
    s: Vec<f64>,
    /// w with the sources a few units in the last place of t later, and the storage there.
    later: Vec<f64>,
    s_later: Vec<f64>,
    s_sizes: Vec<f64>,
    /// How large w can have been.
    sizes: Vec<f64>,
    /// Guards with their derivatives, and their sizes.
    jets: Vec<f64>,
    jet_sizes: Vec<f64>,
    /// How fast the storage came to this instant, where it is known, and the same as w' in the inspected mode with all that its guards
    /// make of it: what the resolution of the time leaves of them.
    pace: Vec<f64>,
    rates: Vec<f64>,
    drifts: Vec<f64>,
    work: Vec<f64>,
    /// Whose quantities pass zero at this instant, and what the resolution of the time leaves of them.
    slips: Vec<(Owner, f64)>,
    /// The same where some states follow the others, and which of the manifolds w is on.
    slow: Vec<f64>,
    slow_sizes: Vec<f64>,
    settled: Option<usize>,
}

impl Inspector {
    /// Stands at w in `mode` from storage `s`.
    fn stand(&mut self, mode: &Mode, z: &[f64], s: &[f64]) {
        mode.state_from(s, &mut self.w);
        self.w.extend_from_slice(z);
        mode.settle(&mut self.w, &mut self.work);
        self.w.resize(mode.flow.dim() + 2 * mode.flow.guards(), 0.0);
    }

    /// The storage that `mode` would have after taking over storage `s` by conservation of charge and flux.
    pub(crate) fn project(&mut self, mode: &Mode, z: &[f64], s: &[f64]) -> Option<Vec<f64>> {
        self.stand(mode, z, s);
        mode.storage.values(&self.w, &mut self.s);
        self.s.iter().all(|v| v.is_finite()).then(|| self.s.clone())
    }

    /// Inspects `mode` at storage `s`, whose amplitudes so far are `scale` and those it was rounded from `known`, at time t on the current
    /// source pieces, where the exosystem is at z.
    pub(crate) fn inspect(
        &mut self,
        mode: &mut Mode,
        (exosystem, t, z): (&Exosystem, f64, &[f64]),
        s: &[f64],
        (scale, known): (&[f64], &[f64]),
    ) -> Finding {
        self.stand(mode, z, s);
        // What the sources move within the resolution of t: at 1 V/ps that is a millivolt where t is a second.
        let time = resolution(t);
        if !mode.keeps {
            mode.storage.values(&self.w, &mut self.s);
            if mode.driven {
                refill(&mut self.later, &self.w);
                exosystem.write(t + time, &mut self.later[mode.n..]);
                mode.storage.values(&self.later, &mut self.s_later);
            } else {
                refill(&mut self.s_later, &self.s);
            }
            mode.sizes_from(s, z, &mut self.sizes, &mut self.work);
            mode.storage.largest(&self.sizes, &mut self.s_sizes);
            let moved = (0..s.len()).any(|i| {
                let drift = (self.s_later[i] - self.s[i]).abs();
                let rounding = NOISE * f64::EPSILON * self.s_sizes[i];
                (self.s[i] - s[i]).abs() > CONSISTENT * scale[i] + drift + rounding
            });
            if moved {
                return Finding::Inconsistent;
            }
        }
        mode.flow.read_guards(&mut self.w);
        mode.sizes_of_state(known, &mut self.sizes);
        self.sizes.resize(mode.flow.dim(), 0.0);
        raise(&mut self.sizes, &self.w);
        self.read_rates(mode, (exosystem, z), time);
        let undisturbed = mode.constraints.is_empty() && self.slips.is_empty();
        if undisturbed && mode.magnitudes.cover(&self.sizes) {
            let (g, slopes) = self.w[mode.flow.dim()..].split_at(mode.flow.guards());
            if !self.rates.is_empty() {
                let drifts = &mut self.drifts;
                mode.jets.first_values(g.len(), &self.rates, drifts);
            }
            let drift = |i: usize| {
                let moved = self.drifts.get(i).filter(|_| !self.rates.is_empty());
                moved.map_or(time * slopes[i].abs(), |moved| moved.abs())
            };
            if mode.magnitudes.clear(g, drift) {
                return Finding::Holds(Vec::new());
            }
        }
        let (w, later, sizes) = (&self.w[..mode.flow.dim()], &self.later, &self.sizes);
        let broken = mode.constraints.row_iter().any(|row| {
            let value = |w: &[f64]| row.iter().zip(w).map(|(c, w)| c * w).sum::<f64>();
            let whole: f64 = row.iter().zip(sizes).map(|(c, size)| c.abs() * size).sum();
            let drift = (value(later) - value(w)).abs();
            value(w).abs() > CONSISTENT * whole + drift
        });
        if broken {
            return Finding::Inconsistent;
        }
        // Waves count with their amplitudes: they come back.
        let waves = |sizes: &mut [f64]| exosystem.envelope(z, sizes);
        mode.magnitudes.take(&mode.flow, sizes, waves);
        if !self.rates.is_empty() {
            mode.jets.values(&self.rates, &mut self.drifts);
        }
        self.read_jets(mode, t);
        let mut leaving = Vec::new();
        for i in 0..mode.flow.guards() {
            if self.leaves(mode, i, t) {
                match mode.owner(i) {
                    Owner::Switch(k) => leaving.push(k),
                    Owner::Device(_) | Owner::Slide(..) => return Finding::Refused(i),
                }
            }
        }
        Finding::Holds(leaving)
    }

    /// Forgets what passed zero at an instant before.
    pub(crate) fn forget_slips(&mut self) {
        self.slips.clear();
    }

    /// Notes how fast the storage comes to this instant along `mode` at w.
    pub(crate) fn note_pace(&mut self, mode: &Mode, w: &[f64]) {
        mode.storage_rates(w, &mut self.pace, &mut self.work);
    }

    /// The storage did not come to where it is by travelling.
    pub(crate) fn forget_pace(&mut self) {
        self.pace.clear();
    }

    /// How far w moves in `mode` with the pace within the resolution of the time. Where a transient begins with the mode, its slope says
    /// nothing of the past.
    fn read_rates(&mut self, mode: &Mode, sources: (&Exosystem, &[f64]), time: f64) {
        self.rates.clear();
        if self.pace.is_empty() {
            return;
        }
        mode.rates_from(&self.pace, sources, &mut self.rates, &mut self.work);
        for rate in &mut self.rates {
            *rate *= time;
        }
    }

    /// Notes that the quantity of this owner passes zero at t with this slope: in the mode that follows, where it may change much
    /// more slowly, it is zero as far as the old slope and the resolution of the time tell.
    pub(crate) fn note_slip(&mut self, owner: Owner, t: f64, slope: f64) {
        self.slips.push((owner, resolution(t) * slope.abs()));
    }

    fn slip(&self, owner: Owner) -> f64 {
        let own = self.slips.iter().filter(|(o, _)| *o == owner);
        own.map(|(_, slip)| *slip).fold(0.0, f64::max)
    }

    /// Reads the guards of the mode in which the run stands at state x and time t, with the sources at z, for [`Self::leaves`].
    pub(crate) fn look(&mut self, mode: &mut Mode, x: &[f64], (t, z): (f64, &[f64])) {
        refill(&mut self.w, x);
        self.w.extend_from_slice(z);
        self.sizes.clear();
        self.sizes.resize(self.w.len(), 0.0);
        raise(&mut self.sizes, &self.w);
        raise(&mut self.sizes, &mode.magnitudes.sizes);
        self.rates.clear();
        self.read_jets(mode, t);
    }

    /// The guards with their derivatives at w, and where states follow the others and a guard that sees them may be zero those on their
    /// manifold.
    fn read_jets(&mut self, mode: &mut Mode, t: f64) {
        let w = &self.w[..mode.flow.dim()];
        mode.jets.values(w, &mut self.jets);
        mode.jets.largest(&self.sizes, &mut self.jet_sizes);
        self.settled = None;
        let (flow, m) = (&mode.flow, mode.flow.guards());
        let asks = |i: usize| self.may_be_zero(i, m, t) && mode.magnitudes.is_slaved(flow, i);
        if !(0..m).any(asks) {
            return;
        }
        let holds = |m: &Manifold| m.holds(w, &self.sizes, GROUP * f64::EPSILON, &self.rates);
        self.settled = mode.magnitudes.settle(flow, holds);
        if let Some(at) = self.settled {
            let manifold = &mode.magnitudes.manifolds[at];
            manifold.jets(w, &self.sizes, &mut self.slow, &mut self.slow_sizes);
        }
    }

    /// What the resolution of the time leaves of derivative k of guard i of `m`.
    fn drift(&self, k: usize, i: usize, m: usize, t: f64) -> f64 {
        if self.rates.is_empty() {
            resolution(t) * self.jets[(k + 1) * m + i].abs()
        } else {
            self.drifts[k * m + i].abs()
        }
    }

    /// Whether guard i of `m` may be zero, by its rounding and that of the time.
    fn may_be_zero(&self, i: usize, m: usize, t: f64) -> bool {
        self.jets[i].abs() <= GROUP * f64::EPSILON * self.jet_sizes[i] + self.drift(0, i, m, t)
    }

    /// Whether guard i, as it was read last, is negative right after t. The first derivative that is no rounding decides, the next one
    /// says what an error of the time does to it; but one that the next turns around before the guard has left its rounding
    /// decides nothing. A guard at rest on zero stays, but for that of a switch which is off there.
    pub(crate) fn leaves(&self, mode: &Mode, i: usize, t: f64) -> bool {
        let time = resolution(t);
        let m = mode.flow.guards();
        let g = self.jets[i];
        // What of a guard is a transient that is rounding decides nothing.
        let manifold = self.settled.map(|at| &mode.magnitudes.manifolds[at]);
        let slow = manifold.is_some_and(|manifold| manifold.is_seen_by(mode.flow.guard_row(i)))
            && self.may_be_zero(i, m, t);
        let (jets, sizes) = if slow {
            (&self.slow, &self.slow_sizes)
        } else {
            (&self.jets, &self.jet_sizes)
        };
        // What it is off the manifold is there until then: a value that the slope moves that far in the meantime decides nothing.
        let gone = manifold.map_or(0.0, |manifold| mode.magnitudes.age_of(manifold));
        let dot = |k: usize| (jets[k * m + i], sizes[k * m + i]);
        let (mut next, mut floor) = (dot(0), 0.0);
        let first = (0..ORDERS).find_map(|k| {
            let (value, whole) = next;
            let mut noise = GROUP * f64::EPSILON * whole;
            if k + 1 < ORDERS {
                next = dot(k + 1);
                noise += if slow {
                    time * next.0.abs()
                } else {
                    self.drift(k, i, m, t)
                };
            }
            if k == 0 {
                noise += self.slip(mode.owner(i));
                let off = (value - g).abs();
                if slow && off <= gone * next.0.abs() {
                    noise += off;
                }
                floor = noise;
            }
            let turned = k > 0
                && value * next.0 < 0.0
                && next.0.abs() > GROUP * f64::EPSILON * next.1
                && value.abs().powi(k as i32 + 1) <= floor * next.0.abs().powi(k as i32);
            (value.abs() > noise && !turned).then_some(value)
        });
        let first = first.or_else(|| mode.flow.first_term(i, ORDERS, &self.w, &self.sizes, GROUP));
        first.map_or_else(|| mode.is_off_at_rest(i), |value| value < 0.0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::circuit::Source;
    use crate::integrate::exact::Assembler;
    use crate::integrate::exact::key::Key;
    use crate::integrate::exact::mode::SwitchFacts;
    use crate::integrate::exact::tests::circuit;
    use crate::lcs::Hold;
    use crate::mna;

    /// The mode of a circuit without switches in which its devices do this, and its sources.
    fn mode(text: &str, closed: &[bool]) -> (Mode, Exosystem) {
        let behaviour = mna::behaviour(&circuit(text)).expect("a sound circuit");
        let hold = |closed: &bool| if *closed { Hold::Closed } else { Hold::Open };
        let holds: Vec<Hold> = closed.iter().map(hold).collect();
        let mut assembler = Assembler::new(Arc::new(behaviour.standard()));
        let lcs = assembler.assemble(&holds, &[], &[]).expect("a system");
        let sources: Vec<Source> = lcs.inputs.iter().map(|i| i.source.clone()).collect();
        let silent = vec![false; sources.len()];
        let mut exosystem = Exosystem::of(&sources, silent, (0.0, 1.0), false).expect("lines");
        for (i, source) in sources.iter().enumerate() {
            exosystem.set_piece(i, source.piece(0.0).expect("a piece"));
        }
        let key = Key {
            closed: closed.to_vec(),
            ..Key::default()
        };
        let facts = SwitchFacts {
            thresholds: &[],
            limits: &[],
            clocks: &[],
        };
        let mode = Mode::new(key, &lcs, &exosystem, &facts, 1e-3, false).expect("a mode");
        (mode, exosystem)
    }

    /// What an inspection at storage s and time t finds.
    fn inspected(
        inspector: &mut Inspector,
        (mode, exosystem): &mut (Mode, Exosystem),
        t: f64,
        s: f64,
    ) -> Finding {
        let mut z = vec![0.0; exosystem.dim()];
        exosystem.write(t, &mut z);
        inspector.inspect(mode, (exosystem, t, &z), &[s], (&[1.0], &[1.0]))
    }

    /// A diode that conducts across a source of another voltage than 0, of either sign.
    #[test]
    fn a_constraint_that_is_broken_on_either_side_forbids_a_mode() {
        for volts in [-1.0, 1.0] {
            let text = format!(
                "v1 1 0 {volts}\nd1 1 0 d\nr1 1 2 1\nc1 2 0 1 ic=1\n.model d d(ideal)\n.tran 1 1 uic"
            );
            let mut parts = mode(&text, &[true]);
            let found = inspected(&mut Inspector::default(), &mut parts, 0.0, 1.0);
            assert_eq!(found, Finding::Inconsistent, "{volts} V");
        }
    }

    /// A diode blocks the voltage of a capacitor that decays. What is small, but falls as fast as to have passed zero within the resolution of
    /// the time, is decided by its slope.
    #[test]
    fn a_guard_that_passes_zero_at_this_instant_is_decided_by_its_slope() {
        let text = "c1 1 0 1 ic=1\nr1 1 0 1\nd1 0 1 d\n.model d d(ideal)\n.tran 1 1 uic";
        let (mut parts, mut inspector) = (mode(text, &[false]), Inspector::default());
        let holds = Finding::Holds(vec![]);
        assert_eq!(inspected(&mut inspector, &mut parts, 1.0, 1.0), holds);
        assert_eq!(inspected(&mut inspector, &mut parts, 1.0, 1e-9), holds);
        inspector.note_slip(Owner::Device(0), 1.0, 1e8);
        let refused = Finding::Refused(0);
        assert_eq!(inspected(&mut inspector, &mut parts, 1.0, 1e-9), refused);
    }

    /// A guard that is a difference of 10⁶ V: what its slope makes of it before the curvature turns it around, g'²/2|g''|, may be rounding.
    #[test]
    fn a_slope_that_the_curvature_turns_around_within_rounding_decides_nothing() {
        let text = "c1 1 0 1 ic=1\nr1 1 0 1\nd1 0 1 d\n.model d d(ideal)\n.tran 1 1 uic";
        let (mode, _) = mode(text, &[false]);
        let leaves = |slope: f64, curvature: f64| {
            let inspector = Inspector {
                jets: vec![0.0, slope, curvature, 0.0],
                jet_sizes: vec![1e6, slope.abs(), curvature.abs(), 0.0],
                ..Inspector::default()
            };
            inspector.leaves(&mode, 0, 0.0)
        };
        assert!(leaves(1e-5, -1.0) && !leaves(-1e-5, 1.0));
        assert!(!leaves(1e-2, -1.0) && leaves(-1e-2, 1.0));
    }
}
