//! Parts of a circuit that share nothing but ground and sources: each goes its own way, with modes, events and steps of its own; rows,
//! events and energies are put together. Parts that are alike take turns with one set of modes.
//!
//! A row is the sum of what the parts add to it, so that only those which add anything are asked for it: the *readers* go along with the
//! rows, the others run ahead. Where rows at events are wanted the readers must not be past what happens elsewhere: copies of them,
//! *scouts*, run ahead too and tell when that is.

mod coming;
mod split;

use std::collections::VecDeque;

use self::coming::{Coming, Instant};
pub(crate) use self::split::{Cut, Ready};
use crate::integrate::energy::Balance;
use crate::integrate::error::{Error, is_final};
use crate::integrate::exact::{Exact, Modes, row_jumps};
use crate::integrate::grid::Times;
use crate::integrate::handover::Handover;
use crate::integrate::log::Log;
use crate::integrate::note::{self, Note};
use crate::integrate::rows::{Asked, RowKind};
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::stats::StatedError;
use crate::settings::tolerances::times::{FORESEEN, SAME_TIME};

/// Output steps that parts run ahead of the rows.
const AHEAD: u32 = 64;

/// Parts whose notes are told; of the others only the number is.
const MOST_NOTED: usize = 8;

/// A stepper around an exact integrator.
pub(crate) trait Modal: Stepper {
    /// The integrator.
    fn exact(&self) -> &Exact;
    /// The same.
    fn exact_mut(&mut self) -> &mut Exact;
}

impl Modal for Exact {
    fn exact(&self) -> &Exact {
        self
    }

    fn exact_mut(&mut self) -> &mut Exact {
        self
    }
}

impl Modal for Handover {
    fn exact(&self) -> &Exact {
        self.integrator()
    }

    fn exact_mut(&mut self) -> &mut Exact {
        self.integrator_mut()
    }
}

/// What a part is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Task {
    /// Adds to rows.
    Reader,
    /// Adds to none.
    Runner,
    /// A copy of the reader with this number, which counts for nothing.
    Scout(usize),
}

/// A part on its way.
struct Member<S> {
    stepper: S,
    task: Task,
    /// Its set of modes, where others share it.
    kind: Option<usize>,
    /// By probe of its own the column of the whole.
    columns: Vec<usize>,
    row: Vec<f64>,
}

impl<S: Modal> Member<S> {
    fn new(stepper: S, columns: &[usize], task: Task) -> Self {
        Self {
            stepper,
            task,
            kind: None,
            columns: columns.to_vec(),
            row: vec![0.0; columns.len()],
        }
    }

    /// Does something with the modes of its kind at hand.
    fn with<T>(&mut self, modes: &mut [Modes], act: impl FnOnce(&mut S) -> T) -> T {
        let Some(kind) = self.kind else {
            return act(&mut self.stepper);
        };
        self.stepper.exact_mut().exchange_modes(&mut modes[kind]);
        let done = act(&mut self.stepper);
        self.stepper.exact_mut().exchange_modes(&mut modes[kind]);
        done
    }

    /// Goes to `t`, or where it is to `pause` to its next event, and tells what happens on the way.
    fn advance(
        &mut self,
        t: f64,
        pause: bool,
        modes: &mut [Modes],
        whole: &Log<'_>,
    ) -> (Coming, Result<(), Error>) {
        let asked = Asked {
            events: whole.wants_rows(),
            corners: whole.wants_corners(),
            cancel: whole.cancel(),
            ..Asked::default()
        };
        let mut log = Log::of(self.columns.len(), f64::NEG_INFINITY, asked);
        log.pause_at_event(pause);
        let result = self.with(modes, |stepper| stepper.advance(t, &mut log));
        (Coming::of(log), result)
    }

    /// Adds what it adds to a row.
    fn add(&mut self, modes: &mut [Modes], row: &mut [f64]) {
        let mut own = std::mem::take(&mut self.row);
        self.with(modes, |stepper| stepper.read(&mut own));
        for (column, value) in self.columns.iter().zip(&own) {
            row[*column] += value;
        }
        self.row = own;
    }
}

/// See the [module](self).
pub(crate) struct Parts<S> {
    members: Vec<Member<S>>,
    /// By member, of readers: what their scouts have seen.
    foreseen: Vec<VecDeque<Instant>>,
    /// By kind.
    modes: Vec<Modes>,
    /// By column of a row: a voltage.
    is_volts: Vec<bool>,
    /// How far those have come that run ahead, how far they go at a time, and where they end, s.
    ahead: f64,
    stride: f64,
    until: f64,
    /// The time last asked for, s.
    t: f64,
    coming: Coming,
    /// What ended a part that ran ahead.
    failure: Option<Error>,
}

impl<S: Modal> Parts<S> {
    /// Parts with rows of such columns, `tstep` apart until `until`, s, and where `at_events` is, at events too; what modes keep, all together, is bounded by `most` bytes.
    ///
    /// # Errors
    /// Those of `make`.
    pub(crate) fn new(
        parts: &[Ready],
        make: impl Fn(&Ready) -> Result<S, Error>,
        is_volts: Vec<bool>,
        (tstep, until): (f64, f64),
        at_events: bool,
        most: usize,
    ) -> Result<Self, Error> {
        let mut members = Vec::new();
        for part in parts {
            let task = if part.columns.is_empty() {
                Task::Runner
            } else {
                Task::Reader
            };
            members.push(Member::new(make(part)?, &part.columns, task));
        }
        for (k, part) in parts.iter().enumerate() {
            if at_events && !part.columns.is_empty() {
                members.push(Member::new(make(part)?, &part.columns, Task::Scout(k)));
            }
        }
        let mut parts = Self {
            foreseen: vec![VecDeque::new(); members.len()],
            members,
            modes: Vec::new(),
            is_volts,
            ahead: f64::NEG_INFINITY,
            stride: f64::from(AHEAD) * tstep,
            until,
            t: f64::NEG_INFINITY,
            coming: Coming::default(),
            failure: None,
        };
        parts.share(most);
        Ok(parts)
    }

    /// Finds which parts are alike.
    fn share(&mut self, most: usize) {
        // The first of every kind, and how many it has.
        let mut kinds: Vec<(usize, usize)> = Vec::new();
        let mut kind_of = Vec::new();
        for member in &self.members {
            let exact = member.stepper.exact();
            let known = kinds
                .iter()
                .position(|&(first, _)| self.members[first].stepper.exact().is_alike(exact));
            let kind = known.unwrap_or_else(|| {
                kinds.push((kind_of.len(), 0));
                kinds.len() - 1
            });
            kinds[kind].1 += 1;
            kind_of.push(kind);
        }
        self.modes.resize_with(kinds.len(), Modes::default);
        let of_each = (most / kinds.len().max(1), most / self.members.len().max(1));
        for (member, kind) in self.members.iter_mut().zip(kind_of) {
            member.kind = (kinds[kind].1 > 1).then_some(kind);
            member.stepper.exact_mut().keep_at_most(of_each);
        }
    }

    /// Has all that run ahead go further.
    fn run_ahead(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        self.ahead = (t + self.stride).min(self.until).max(t);
        let to = self.ahead;
        let members = self.members.iter_mut();
        for member in members.filter(|member| member.task != Task::Reader) {
            let (mut coming, result) = member.advance(to, false, &mut self.modes, log);
            match member.task {
                Task::Scout(reader) => self.foreseen[reader].extend(coming.take_instants()),
                _ => self.coming.add(coming),
            }
            let Err(error) = result else { continue };
            if is_final(&error) {
                return Err(error);
            }
            // What happens before is still told.
            let when = error.t.unwrap_or(t);
            if when < self.ahead || self.failure.is_none() {
                self.ahead = when;
                self.failure = Some(error);
            }
        }
        self.coming.sort();
        Ok(())
    }

    /// The first instant up to `t` at which something happens, and the reader that has it.
    fn next_instant(&mut self, t: f64) -> Option<(Instant, Option<usize>)> {
        let near = t + SAME_TIME * t.abs();
        let fronts = self.foreseen.iter().enumerate();
        let fronts = fronts.filter_map(|(k, queue)| Some((queue.front()?.t, Some(k))));
        let fronts = fronts.chain(self.coming.next_time().map(|t| (t, None)));
        let first = fronts.min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, lead) = first.filter(|(t, _)| *t <= near)?;
        let instant = match lead {
            Some(reader) => self.foreseen[reader].pop_front()?,
            None => self.coming.pop_instant()?,
        };
        Some((instant, lead))
    }

    /// The readers go to `t`, but for the one that leads, which has told already.
    fn read_on(
        &mut self,
        t: f64,
        lead: Option<usize>,
        log: &Log<'_>,
    ) -> Result<Vec<(usize, Coming)>, Error> {
        let mut told = Vec::new();
        let readers = self.members.iter_mut().enumerate();
        let readers = readers.filter(|(k, member)| member.task == Task::Reader && Some(*k) != lead);
        for (k, member) in readers {
            let (coming, result) = member.advance(t, false, &mut self.modes, log);
            told.push((k, coming));
            if let Err(error) = result {
                let left = told.into_iter();
                left.for_each(|(_, coming)| self.coming.add(coming.without_instants()));
                return Err(error);
            }
        }
        Ok(told)
    }

    /// Takes all readers to an instant no later than `t` at which something happens. The one that has an event finds it at the time at which it
    /// is for itself, and the others follow to this time.
    fn go_through(
        &mut self,
        instant: Instant,
        lead: Option<usize>,
        t: f64,
        log: &mut Log,
    ) -> Result<(), Error> {
        let mut at = instant.t.min(t);
        let leads = lead.filter(|_| instant.is_event);
        let mut told = Vec::new();
        if let Some(reader) = leads {
            let limit = (at + FORESEEN * at.abs()).min(t);
            let member = &mut self.members[reader];
            let (coming, result) = member.advance(limit, true, &mut self.modes, log);
            // It may have gone there with a step that ends a rounding after `t`.
            at = member.stepper.time().min(t);
            told.push((reader, coming));
            result?;
        }
        told.extend(self.read_on(at, leads, log)?);
        for (reader, coming) in &told {
            let own = usize::from(lead == Some(*reader));
            for _ in own..coming.instants() {
                self.foreseen[*reader].pop_front();
            }
        }
        let kind = lead.is_none().then_some(instant.kind);
        self.tell_rows(at, kind, told, log);
        Ok(())
    }

    /// The rows of an instant at which something of this kind happens elsewhere, or what readers have `told`: one, or where a reader jumps two.
    fn tell_rows(
        &mut self,
        t: f64,
        kind: Option<RowKind>,
        told: Vec<(usize, Coming)>,
        log: &mut Log,
    ) {
        let kinds = told.iter().filter_map(|(_, coming)| coming.kind());
        let Some(kind) = kind.into_iter().chain(kinds).min() else {
            let told = told.into_iter();
            return told.for_each(|(_, coming)| self.coming.add(coming));
        };
        let mut after = vec![0.0; self.is_volts.len()];
        self.read(&mut after);
        // Where a reader jumps, what it was before stands in the place of what it is.
        let mut before = after.clone();
        for (reader, coming) in &told {
            if let Some((left, right)) = coming.jump() {
                let columns = &self.members[*reader].columns;
                for ((column, left), right) in columns.iter().zip(left).zip(right) {
                    before[*column] += left - right;
                }
            }
        }
        // What is rounding beside the other parts is no jump of the whole.
        match kind {
            _ if row_jumps(&before, &after, &self.is_volts) => {
                log.row(t, &before);
                log.row(t, &after);
            }
            RowKind::Corner => log.corner(t, &after),
            RowKind::Event | RowKind::Grid | RowKind::Both | RowKind::Between => log.row(t, &after),
        }
        for (_, coming) in told {
            self.coming.add(coming.without_instants());
        }
    }
}

impl<S: Modal> Stepper for Parts<S> {
    fn time(&self) -> f64 {
        self.t
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        while t > self.ahead && self.failure.is_none() {
            self.run_ahead(t, log)?;
        }
        if let Some(error) = self.failure.take_if(|_| t >= self.ahead) {
            self.coming.tell(self.ahead, log);
            return Err(error);
        }
        while let Some((instant, lead)) = self.next_instant(t) {
            self.go_through(instant, lead, t, log)?;
        }
        let told = self.read_on(t, None, log)?;
        for (reader, coming) in &told {
            for _ in 0..coming.instants() {
                self.foreseen[*reader].pop_front();
            }
        }
        self.tell_rows(t, None, told, log);
        self.coming.sort();
        self.coming.tell(t, log);
        self.t = t;
        log.go_on(t)
    }

    fn read(&mut self, row: &mut [f64]) {
        row.fill(0.0);
        let readers = self.members.iter_mut();
        for member in readers.filter(|member| member.task == Task::Reader) {
            member.add(&mut self.modes, row);
        }
    }

    fn rows_ahead(&mut self, times: &Times, k: usize) -> &[f64] {
        let scouted = |member: &Member<S>| matches!(member.task, Task::Scout(_));
        if self.members.iter().any(scouted) || self.failure.is_some() {
            return &[];
        }
        let readers = self.members.iter_mut();
        let mut readers = readers.filter(|member| member.task == Task::Reader);
        match (readers.next(), readers.next()) {
            // Its rows are those of the whole.
            (Some(only), None)
                if only.kind.is_none() && only.columns.len() == self.is_volts.len() =>
            {
                only.stepper.rows_ahead(times, k)
            }
            _ => &[],
        }
    }

    fn has_stepped(&self) -> bool {
        self.members
            .iter()
            .any(|member| member.stepper.has_stepped())
    }

    fn finish(&mut self) -> Outcome {
        let mut whole = Outcome::default();
        let mut balance = Balance::default();
        let (mut counted, mut noted) = (vec![false; self.modes.len()], 0);
        let members = self.members.iter_mut();
        for member in members.filter(|member| !matches!(member.task, Task::Scout(_))) {
            let mut own = member.with(&mut self.modes, S::finish);
            if let Some(kind) = member.kind
                && std::mem::replace(&mut counted[kind], true)
            {
                own.stats = own.stats.of_shared_modes();
            }
            whole.stats.add(&own.stats);
            balance.add_beside(member.stepper.exact_mut().balance());
            let far = |error: &StatedError| error.event_time;
            let both = far(&whole.error).into_iter().chain(far(&own.error));
            whole.error.event_time = both.reduce(f64::max);
            if !own.notes.is_empty() {
                noted += 1;
                if noted <= MOST_NOTED {
                    note::append(&mut whole.notes, own.notes);
                }
            }
        }
        if noted > MOST_NOTED {
            let text = format!(
                "{} more parts of the circuit have notes like these",
                noted - MOST_NOTED
            );
            whole.notes.push(Note::run("more", text));
        }
        whole.energy = balance.energy();
        whole
    }
}
