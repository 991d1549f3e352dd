//! Rows ahead: where a mode is calm, one long step passes several output times, and their rows follow from its begin; where a clock
//! switches the circuit it goes on to where the clock is known to switch next.

use super::exosystem::Exosystem;
use super::flow::{Flow, LONG};
use super::mode::Mode;
use super::sampled::MOST;
use super::travel::{Arrival, Leap, Travel};
use crate::integrate::grid::Times;
use crate::settings::tolerances::times::SAME_TIME;

/// Rows that were computed and not asked for yet.
#[derive(Debug, Clone, Default)]
pub(super) struct DenseOutput {
    /// An output step before the first row, s.
    begin: f64,
    /// Rows of the step, and how many of them were asked for; none without a step.
    count: usize,
    taken: usize,
    values: Vec<f64>,
    /// The time last asked for, s.
    pub(super) t: f64,
    /// The step, if it is one from an event to where something is known to happen, and the state at its first row.
    leap: Option<Leap>,
    first: Vec<f64>,
}

impl DenseOutput {
    /// Whether rows are left.
    fn pending(&self) -> bool {
        self.taken < self.count
    }

    /// Whether the run is behind the rows.
    pub(super) fn leads(&self) -> bool {
        self.count > 0
    }

    /// The row last asked for, of so many columns.
    pub(super) fn row(&self, columns: usize) -> Option<&[f64]> {
        let from = self.taken.checked_sub(1)? * columns;
        self.values.get(from..from + columns)
    }

    /// Whether `t` is the time of the next row of the output step `h`, which is taken then.
    pub(super) fn take(&mut self, t: f64, h: f64) -> bool {
        let off = t - self.begin - (self.taken + 1) as f64 * h;
        let next = self.pending() && off.abs() <= SAME_TIME * t.abs();
        if next {
            self.taken += 1;
            self.t = t;
        }
        next
    }

    /// See [`Stepper::rows_ahead`](crate::integrate::run::Stepper::rows_ahead), of so many columns, an output step `h` apart.
    pub(super) fn take_all(&mut self, times: &Times, k: usize, columns: usize, h: f64) -> &[f64] {
        let Some(here) = self.taken.checked_sub(1) else {
            return &[];
        };
        // The last output time need not be a step away from the one before.
        let count = (self.count - self.taken).min(times.len.saturating_sub(k + 2));
        if count > 0 {
            self.taken += count - 1;
            if !self.take(times.at(k + count), h) {
                self.taken = here + 1;
            }
        }
        &self.values[here * columns..self.taken * columns]
    }

    /// Has the run stand at the last row that was asked for, or at the end of the step where that is no later than `t`.
    pub(super) fn end(
        &mut self,
        travel: &mut Travel,
        flow: &mut Flow,
        exosystem: &Exosystem,
        t: f64,
    ) {
        let (count, mut taken) = (self.count, self.taken);
        (self.count, self.taken) = (0, 0);
        match self.leap.take() {
            _ if count == 0 => {}
            None => travel.arrive(flow, exosystem, taken, Some(count), self.t),
            Some(leap) if leap.stop <= t + SAME_TIME * t.abs() => {
                travel.take_span(flow, exosystem, leap);
            }
            Some(_) => {
                if !self.first.is_empty() {
                    taken -= 1;
                    let first = self.t - taken as f64 * flow.step(LONG);
                    // It is clear as part of the span; where a closer look sees an event after all the run stands there.
                    if travel.advance(flow, exosystem, first) != Arrival::Reached {
                        return;
                    }
                }
                travel.arrive(flow, exosystem, taken, None, self.t);
            }
        }
    }

    /// Steps over as many rows as nothing can happen on, `t` the first of them and `end` the last time to be passed; something is known to
    /// happen at `next` right after it.
    pub(super) fn step(
        &mut self,
        travel: &mut Travel,
        mode: &mut Mode,
        (t, end): (f64, f64),
        next: Option<f64>,
    ) -> bool {
        let h = mode.flow.step(LONG);
        let negligible = SAME_TIME * (t + MOST as f64 * h).abs();
        let off_row = (t - travel.t - h).abs() > negligible;
        let begins = travel.age == 0.0 && t > travel.t + negligible;
        let next = next.filter(|_| begins);
        // Behind the first row.
        let others = next.map_or(f64::NAN, |_| (end - t) / h);
        let next = next.filter(|_| (0.0..MOST as f64).contains(&others));
        let count = if next.is_some_and(|next| self.leap_to(travel, mode, (t, next), off_row)) {
            others as usize + 1
        } else {
            let (flow, outputs) = (&mut mode.flow, &mode.outputs);
            if !travel.steady || off_row || !mode.rows.ready(flow, outputs) {
                return false;
            }
            self.first.clear();
            match travel.leap_ahead(flow, end) {
                Some(count) => count,
                None => return false,
            }
        };
        let (rows, columns) = (&mode.rows, mode.rows.columns);
        let Some(table) = &rows.table else {
            return false;
        };
        self.values.resize(MOST * columns, 0.0);
        if self.first.is_empty() {
            table.apply_first(count * columns, &travel.now, &mut self.values);
        } else {
            let (row, values) = self.values.split_at_mut(columns);
            mode.outputs.apply(&self.first, row);
            table.apply_first((count - 1) * columns, &self.first, values);
        }
        (self.begin, self.t) = (t - h, t);
        (self.count, self.taken) = (count, 1);
        true
    }

    /// A step from an event over a span that recurs to `next`, where the first row at `t` is as far away as other times, too.
    fn leap_to(
        &mut self,
        travel: &mut Travel,
        mode: &mut Mode,
        (t, next): (f64, f64),
        off_row: bool,
    ) -> bool {
        let flow = &mut mode.flow;
        self.first.clear();
        if !mode.rows.fits {
            return false;
        }
        // Spans are counted while there is no table yet.
        let ready = mode.rows.ready(flow, &mode.outputs);
        let leap = travel.leap_span(flow, next).filter(|_| ready);
        let seen = |_: &Leap| !off_row || travel.look_ahead(flow, t, &mut self.first);
        self.leap = leap.filter(seen);
        self.leap.is_some()
    }
}

#[cfg(test)]
mod tests {
    use crate::integrate::exact::tests::{circuit, prepare_circuit};
    use crate::integrate::log::Log;
    use crate::integrate::run::Stepper;

    const RINGING: &str = "v1 a 0 sin(0 10 1k)\nr1 a b 10\nl1 b c 1m ic=0.1\nc1 c 0 1u ic=-3\nd1 c e d\nr2 e 0 300\n\
        c2 e 0 2u ic=1\n.model d d(ideal)\n.tran 1u 3m uic\n";

    /// Edges on rows and between them, with the same number of rows between edges and with one more now and then.
    const CLOCKED: &str = "v1 a 0 dc 24\ns1 a b g 0 sw\nd1 0 b d\nl1 b c 40u\nc1 c 0 20u\nr1 c 0 4\n\
        vg g 0 pulse(0 1 3.3u 0 0 WIDTH 10u)\n.model d d(ideal)\n.model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)\n\
        .save v(c) i(l1) i(v1)\n.tran 1u 3m uic\n";

    /// The last row asked for, between two edges.
    const LAST: usize = 2995;

    /// Asked along the output grid, which long steps pass, and at times of its own in between, where they are given up: the
    /// same rows, energies and events.
    #[test]
    fn rows_do_not_depend_on_what_is_asked_for_between() {
        let clocked = |width| CLOCKED.replace("WIDTH", width);
        for (netlist, most) in [
            (RINGING.to_string(), 1000),
            (clocked("4.7u"), 2600),
            (clocked("4.5u"), 2600),
        ] {
            let circuit = circuit(&netlist);
            let run = |odd: usize| {
                let (mut exact, lcs, tran) = prepare_circuit(&circuit, true);
                let columns = lcs.outputs.names.len();
                let (mut log, mut row) = (Log::new(columns, 0.0, false), vec![0.0; columns]);
                let mut rows = Vec::new();
                for k in 0..=LAST {
                    let t = k as f64 * tran.tstep;
                    exact.advance(t, &mut log).expect("a run");
                    assert!((exact.time() - t).abs() < 1e-18);
                    exact.read(&mut row);
                    rows.extend_from_slice(&row);
                    if odd > 0 && k % odd == 0 && k < LAST {
                        let between = t + 0.2 * tran.tstep;
                        exact.advance(between, &mut log).expect("a run");
                        assert!((exact.time() - between).abs() < 1e-18);
                    }
                }
                (rows, exact.finish(), log.events)
            };
            let (rows, outcome, events) = run(0);
            assert!(outcome.stats.steps < most, "{} steps", outcome.stats.steps);
            assert!(outcome.energy.residual_relative < 1e-12);
            for odd in [1, 5, 37] {
                let (others, other, found) = run(odd);
                assert!(other.stats.steps > outcome.stats.steps);
                assert!(other.energy.residual_relative < 1e-12);
                assert!((other.energy.source / outcome.energy.source - 1.0).abs() < 1e-11);
                let far = rows.iter().zip(&others).map(|(a, b)| (a - b).abs());
                let largest = rows.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let far = far.fold(0.0, f64::max) / largest;
                assert!(far < 2e-13, "{far:e}");
                let apart = events.iter().zip(&found).map(|(a, b)| (a.t - b.t).abs());
                assert!(apart.fold(0.0, f64::max) < 1e-15 && events.len() == found.len());
            }
        }
    }

    /// A run that ends on a row in the middle of a long step has its energy from the state there.
    #[test]
    fn a_run_may_end_between_edges() {
        let circuit = circuit(&CLOCKED.replace("WIDTH", "4.7u"));
        let (mut exact, lcs, tran) = prepare_circuit(&circuit, true);
        let columns = lcs.outputs.names.len();
        let (mut log, mut row) = (Log::new(columns, 0.0, false), vec![0.0; columns]);
        for k in 0..=LAST {
            let t = k as f64 * tran.tstep;
            exact.advance(t, &mut log).expect("a run");
            exact.read(&mut row);
        }
        assert!(exact.dense.leads());
        let energy = exact.finish().energy;
        let stored = 0.5 * (20e-6 * row[0] * row[0] + 40e-6 * row[1] * row[1]);
        assert!((energy.stored / stored - 1.0).abs() < 1e-12);
        assert!(energy.residual_relative < 1e-12);
    }
}
