//! A change of mode: one that is known to follow, or that is looked for.

use std::sync::Arc;

use super::{Exact, MOST_PASSAGES};
use crate::integrate::error::Error;
use crate::integrate::exact::key::{Key, Trigger};
use crate::integrate::exact::mode::Mode;
use crate::integrate::exact::passage::Passage;
use crate::integrate::exact::report::row_jumps;
use crate::integrate::exact::transition::Transition;
use crate::integrate::log::Log;

impl Exact {
    /// Tells the report how the devices stand in the present mode, but for the one that `fired`.
    fn look_back(&mut self, fired: Option<usize>) {
        let Some(at) = self.mode.filter(|_| self.started) else {
            return;
        };
        let mode = &self.table.modes[at];
        let guards = &self.travel.now[mode.flow.dim()..];
        let devices = mode.device_guards.iter().zip(guards).enumerate();
        let others = devices.filter(|(guard, _)| fired != Some(*guard));
        let sides = others.map(|(_, (&pair, g))| (pair, *g));
        let stored = || self.storage.amplitudes();
        self.report
            .note_hidden(&self.table, at, sides, stored, self.travel.t);
    }

    /// What a change of mode from here may look at and move.
    fn transition(&mut self) -> Transition<'_> {
        Transition {
            t: self.travel.t,
            mode: self.mode,
            key: &self.key,
            started: self.started,
            table: &mut self.table,
            sources: &mut self.sources,
            storage: &mut self.storage,
            inspector: &mut self.inspector,
            report: &mut self.report,
            memory: &mut self.memory,
        }
    }

    /// Enters the mode from here on, and keeps what the derivative of the flow needs to know of it. Where there is none, everything is as it
    /// was before.
    pub(super) fn change(
        &mut self,
        key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        if self.passages.is_some() {
            return self.pass(key, discontinuous, trigger, log);
        }
        self.change_to(key, discontinuous, trigger, log)
    }

    /// As [`Self::change`], and keeps the passage.
    #[cold]
    #[inline(never)]
    fn pass(
        &mut self,
        key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        let (mode, before) = (self.mode, self.storage.values.clone());
        self.change_to(key, discontinuous, trigger, log)?;
        let room = self
            .passages
            .as_mut()
            .filter(|all| all.len() < MOST_PASSAGES);
        if let Some(passages) = room {
            let from = mode.map(|at| &self.table.modes[at]);
            passages.push(Passage {
                t: self.travel.t,
                from: from.map(|mode| Arc::clone(&mode.key)),
                to: Arc::new(self.key.clone()),
                cause: match trigger {
                    Trigger::Guard(guard) => from.map(|mode| mode.owner(guard)),
                    Trigger::Sources => None,
                },
                before,
                after: self.storage.values.clone(),
            });
        }
        Ok(())
    }

    /// Enters the mode from here on. Where there is none, everything is as it was before.
    fn change_to(
        &mut self,
        mut key: Key,
        discontinuous: bool,
        trigger: Trigger,
        log: &mut Log,
    ) -> Result<(), Error> {
        self.wanted = None;
        self.look_back(match trigger {
            Trigger::Guard(guard) => Some(guard),
            _ => None,
        });
        let left_row = (log.wants_rows() && self.started).then(|| {
            self.read_row();
            self.row.clone()
        });
        // Most changes are like one before.
        let followed = self.transition().follow(&key, trigger);
        if let Some((at, guards)) = &followed
            && guards.is_empty()
            && self.table.let_go(*at).next().is_none()
        {
            let at = *at;
            key.closed.clone_from(&self.table.modes[at].key.closed);
            self.enter(at, key, false, trigger, left_row, log);
            return Ok(());
        }
        self.search(key, (discontinuous, trigger), followed, left_row, log)
    }

    /// Looks for the mode to enter where it is none that is known to follow.
    #[cold]
    #[inline(never)]
    fn search(
        &mut self,
        mut key: Key,
        (discontinuous, trigger): (bool, Trigger),
        followed: Option<(usize, Vec<usize>)>,
        left_row: Option<Vec<f64>>,
        log: &mut Log,
    ) -> Result<(), Error> {
        let left = self.mode.map(|at| Key::clone(&self.table.modes[at].key));
        self.key = left.unwrap_or_else(|| key.clone());
        let (values, scale) = (self.storage.values.clone(), self.storage.scale.clone());
        let known = self.storage.known.clone();
        let (balance, switches) = (self.storage.balance, key.switches.clone());
        let (events, impulses) = (log.events.len(), log.impulses.len());
        if let Some(at) = self.mode {
            self.sources.leave(self.table.modes[at].n, &self.travel.now);
        }
        let mut transition = self.transition();
        let found = transition.search(&mut key, discontinuous, trigger, followed, log);
        match found {
            Ok((at, jumped)) => {
                if jumped {
                    let reason = transition.jump_reason(at, trigger);
                    let loss = self.storage.balance.lost_in_jumps() - balance.lost_in_jumps();
                    self.storage
                        .note_jump(self.travel.t, &values, loss, reason, log);
                }
                key.copy_from(&self.table.modes[at].key);
                self.enter(at, key, jumped, trigger, left_row, log);
                Ok(())
            }
            Err(error) => {
                self.storage.restore(values, scale, known);
                (self.storage.balance, self.wanted) = (balance, Some(switches));
                log.back_to(events, impulses);
                Err(error)
            }
        }
    }

    /// Enters mode `at`, which was inspected last, under its key.
    fn enter(
        &mut self,
        at: usize,
        key: Key,
        jumped: bool,
        trigger: Trigger,
        left_row: Option<Vec<f64>>,
        log: &mut Log,
    ) {
        let t = self.travel.t;
        if let (Some(from), false) = (self.mode, jumped) {
            self.table.modes[from].remember(trigger, at);
        }
        if let Some(from) = self.mode {
            self.table.leave(from);
        }
        let same = self.mode == Some(at);
        let from = self.mode.filter(|_| self.started);
        self.report
            .enter(&mut self.table, (from, at), t, jumped, log);
        self.mode = Some(at);
        self.key = key;
        self.travel.power = self.storage.power(self.duration);
        let Mode {
            flow, magnitudes, ..
        } = &self.table.modes[at];
        self.travel.enter(flow, t, &self.inspector.w, magnitudes);
        let span = (t, self.until);
        self.sources
            .look_ahead(&self.table.thresholds, &self.key.switches, span);
        if jumped {
            self.report.jumps += 1;
        }
        if let Some(before) = left_row {
            self.log_rows(&before, same, log);
        }
    }

    /// Logs the rows of an event, of which this is the first.
    #[cold]
    #[inline(never)]
    fn log_rows(&mut self, before: &[f64], same: bool, log: &mut Log) {
        let t = self.travel.t;
        self.read_row();
        let jumped = row_jumps(before, &self.row, &self.row_is_volts);
        if jumped {
            log.row(t, before);
        }
        if jumped || !same {
            log.row(t, &self.row);
        } else if self.corner {
            log.corner(t, &self.row);
        }
    }
}
