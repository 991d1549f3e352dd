//! What the derivative of the flow needs to know of a run.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::Simulation;
use super::way::Way;
use crate::integrate::error::Error;
use crate::integrate::exact::{Assembler, Corners, Passage};
use crate::integrate::stats::Impulse;
use crate::integrate::theta::Instant;

impl Simulation {
    /// The changes of mode on the way from a place, as for [`Self::stand_at`], to time `until`, s: the first is the one into the mode there.
    /// `None` where the way is not exact throughout. Where corners are those that are seen, periods are taken together by their map. It ends when `cancel` is set.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub(crate) fn passages(
        &mut self,
        (t, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        corners: Corners,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<Vec<Passage>>, Error> {
        let Way::Exact(exact) = &mut self.way else {
            return Ok(None);
        };
        exact.keep_passages(corners);
        self.stand_at(t, state, switches)?;
        if let (Way::Exact(exact), Corners::Seen) = (&mut self.way, corners) {
            exact.take_periods();
        }
        let advanced = self.advance(until, false, cancel);
        let passages = match &mut self.way {
            Way::Exact(exact) => {
                exact.leave_periods();
                exact.take_passages()
            }
            Way::Steps(_) => None,
        };
        advanced?;
        let whole = |passages: &Vec<Passage>| {
            let mut from = passages.iter().map(|passage| passage.from.is_some());
            from.next() == Some(false) && from.all(|known| known)
        };
        Ok(passages.filter(whole))
    }

    /// Goes from a place, as for [`Self::stand_at`], to time `until`, s, where energy is not asked for: how many periods were taken together by
    /// their map; `None` where the way is not exact throughout. It ends when `cancel` is set.
    ///
    /// # Errors
    /// As [`Self::advance_to`].
    pub(crate) fn pass(
        &mut self,
        (t, state, switches): (f64, &[f64], &[bool]),
        until: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Option<u64>, Error> {
        self.stand_at(t, state, switches)?;
        let Way::Exact(exact) = &mut self.way else {
            return Ok(None);
        };
        exact.take_periods();
        let advanced = self.advance(until, false, cancel);
        let Way::Exact(exact) = &mut self.way else {
            return Ok(None);
        };
        let taken = exact.leave_periods();
        advanced?;
        Ok(Some(taken).filter(|_| !self.way.stepper().has_stepped()))
    }

    /// By input whether an exact run leaves it out: nothing but controls of switches sees it.
    pub(crate) fn silent_sources(&self) -> Vec<bool> {
        match &self.way {
            Way::Exact(exact) => exact.integrator().silent_sources().to_vec(),
            Way::Steps(_) => vec![],
        }
    }

    /// Where a run in steps stands; `None` of one that is exact.
    ///
    /// # Errors
    /// λ cannot be found there.
    pub(crate) fn instant(&mut self) -> Result<Option<Instant>, Error> {
        match &mut self.way {
            Way::Exact(_) => Ok(None),
            Way::Steps(theta) => theta.instant().map(Some),
        }
    }

    /// Reduces the circuit with devices that are open for a run as long as `span`, s; the laws of others are to be put back.
    pub(crate) fn opener(&self, span: f64) -> Assembler {
        let multiport = &self.problem.systems.multiport;
        Assembler::new(Arc::new(multiport.with_ideal_diodes())).with_span(span)
    }

    /// The impulses of devices and sources so far.
    pub(crate) fn impulses(&self) -> &[Impulse] {
        &self.impulses
    }

    /// Reduces the circuit for its modes, where no step is longer than `span`, s.
    pub(crate) fn assembler(&self, span: f64) -> Assembler {
        let systems = &self.problem.systems;
        Assembler::new(Arc::clone(&systems.multiport))
            .with_span(span)
            .sharing(&systems.reduced)
    }
}

#[cfg(test)]
mod tests {
    use crate::integrate::exact::Corners;
    use crate::integrate::{Method, Simulation, SimulationOptions};
    use crate::model::Model;

    /// What `cards` do until a time, in changes of mode one by one and with periods taken together: how far the states are apart, relative to the largest of each, by how
    /// much the steps differ, and how many periods were taken.
    fn apart(cards: &str, until: f64) -> (f64, i64, u64) {
        let text = format!("a clock\n{cards}\n.save v(out) i(l1)\n.tran 1u 10m uic\n.end\n");
        let model = Model::parse(&text, "clock.cir").expect("a circuit");
        let options = || SimulationOptions {
            method: Method::Exact,
            ..SimulationOptions::default()
        };
        let new = || {
            let made = Simulation::closed(model.circuit(), model.multiport(), options());
            made.expect("a simulation")
        };
        let (mut one, mut other) = (new(), new());
        let (state, positions) = (one.state(), one.positions());
        let place = (0.0, &*state, &*positions);
        one.stand_at(place.0, place.1, place.2).expect("a mode");
        one.advance(until, false, None).expect("a run");
        let taken = other.pass(place, until, None).expect("a run");
        let states = (one.state(), other.state());
        let apart = states.0.iter().zip(&states.1);
        let apart = apart.map(|(a, b)| (a - b).abs() / a.abs());
        let steps = one.exact_steps() as i64 - other.exact_steps() as i64;
        (
            apart.fold(0.0, f64::max),
            steps,
            taken.expect("an exact one"),
        )
    }

    const BUCK: &str = "s1 in sw g 0 sw\nd1 0 sw d\nl1 sw out 50u ic=2\nc1 out 0 100u ic=9.5\nr1 out 0 5\n\
        .model sw sw(vt=0.5 ron=10m roff=10meg)\n.model d d(ron=10m roff=10meg)";
    const GATE: &str = "vg g 0 pulse(0 1 0 10n 10n 3.99u 10u)";

    #[test]
    fn periods_taken_together_lead_where_single_ones_do() {
        let (apart, steps, taken) = apart(&format!("vin in 0 24\n{GATE}\n{BUCK}"), 9.993e-3);
        assert!(apart < 1e-11 && taken > 900, "{apart:e} {taken}");
        assert!(steps.abs() < 10, "{steps}");
    }

    /// Corners of the gate, which nothing but the switch sees, end no period where they are not asked for; where they are, each change is made.
    #[test]
    fn passages_of_periods_taken_together_are_those_of_single_ones() {
        let ends = "vin in 0 sin(24 12 300)\nib out 0 sin(0 1.2 170)";
        for (sources, until) in [("vin in 0 24", 0.9e-3), (ends, 4.7e-3)] {
            let text = format!(
                "a clock\n{sources}\n{GATE}\n{BUCK}\n.save v(out)\n.tran 1u 10m uic\n.end\n"
            );
            let model = Model::parse(&text, "clock.cir").expect("a circuit");
            let made = Simulation::closed(
                model.circuit(),
                model.multiport(),
                SimulationOptions::default(),
            );
            let mut simulation = made.expect("a simulation");
            let (state, positions) = (simulation.state(), simulation.positions());
            let mut of = |corners| {
                let place = (0.0, &*state, &*positions);
                let found = simulation.passages(place, until, corners, None);
                let mut passages = found.expect("a run").expect("an exact one");
                passages.retain(|passage| !passage.is_corner());
                (passages, simulation.state())
            };
            let ((seen, end), (all, other)) = (of(Corners::Seen), of(Corners::All));
            assert_eq!(seen.len(), all.len());
            let close = |a: &[f64], b: &[f64]| {
                let mut both = a.iter().zip(b);
                assert!(
                    both.all(|(a, b)| (a - b).abs() <= 1e-10 * b.abs().max(1.0)),
                    "{a:?} {b:?}"
                );
            };
            for (own, other) in seen.iter().zip(&all) {
                assert!((own.t - other.t).abs() < 1e-14 * until, "{}", other.t);
                assert_eq!((&own.from, &own.to), (&other.from, &other.to));
                assert_eq!(own.cause, other.cause);
                close(&own.before, &other.before);
                close(&own.after, &other.after);
            }
            close(&end, &other);
        }
    }

    /// The input swings so that the current ends in some periods and not in others; and sources that are followed are moved, too.
    #[test]
    fn periods_in_which_a_diode_blocks_are_not_taken() {
        let cards = format!("vin in 0 sin(24 12 300)\nib out 0 sin(0 1.2 170)\n{GATE}\n{BUCK}");
        for until in [2.5e-3, 4.7e-3, 9.993e-3] {
            let (apart, steps, taken) = apart(&cards, until);
            assert!(apart < 1e-10, "{until}: {apart:e}");
            assert!((50..900).contains(&taken), "{until}: {taken}");
            assert!(steps.abs() < 10, "{steps}");
        }
    }

    /// A second switch with twice the period, one with another phase, and one that stops.
    #[test]
    fn a_period_is_that_of_all_clocks() {
        let second = |gate: &str| {
            let cards =
                format!("vin in 0 24\n{GATE}\n{BUCK}\ns2 out x h 0 sw\nrx x 0 20\nvh h 0 {gate}");
            apart(&cards, 9.993e-3)
        };
        let (apart, _, taken) = second("pulse(0 1 3u 10n 10n 7u 20u)");
        assert!(apart < 1e-11 && taken > 400, "{apart:e} {taken}");
        let (apart, _, taken) = second("pulse(0 1 3u 10n 10n 7u 20u 100)");
        assert!(apart < 1e-11 && taken == 0, "{apart:e} {taken}");
        let (apart, _, taken) = second("pulse(0 1 3u 10n 10n 7u 23u)");
        assert!(apart < 1e-11 && taken == 0, "{apart:e} {taken}");
        let (apart, _, taken) = second("pulse(0 1 5.003m 10n 10n 1u 20u)");
        assert!(apart < 1e-11 && taken > 300, "{apart:e} {taken}");
    }
}
