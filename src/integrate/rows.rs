//! The rows of a run on their way: collected, handed on as they come, or both.

use std::cell::Cell;
use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::integrate::cpu::ThreadTime;

use crate::integrate::error::{Error, Reason};
use crate::integrate::grid::Times;
use crate::settings::tolerances::times::SAME_TIME;
use crate::waveform::Waveforms;

/// What stands at the time of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowKind {
    /// An output time of the grid; at a jump the values after it.
    Grid,
    /// An event; at a jump two rows, before and after.
    Event,
    /// A corner of a source where nothing else happens.
    Corner,
    /// An output time of the grid at which an event or a corner is, too.
    Both,
    /// Between output times, where pictures follow the curve; files do not have it.
    Between,
}

impl RowKind {
    /// Whether the row stands at an output time of the grid.
    #[must_use]
    pub const fn is_grid(self) -> bool {
        matches!(self, Self::Grid | Self::Both)
    }
}

/// Rows that follow each other.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    /// Times, s, nondecreasing.
    pub time: &'a [f64],
    /// Values, row after row.
    pub values: &'a [f64],
    /// What the rows stand at; empty where all are the grid's.
    pub kinds: &'a [RowKind],
}

impl<'a> Block<'a> {
    /// All rows of these waveforms.
    #[must_use]
    pub fn of(waves: &'a Waveforms, kinds: &'a [RowKind]) -> Self {
        Self {
            time: &waves.time,
            values: &waves.values,
            kinds,
        }
    }

    /// Time, values and kind of each row.
    pub fn rows(self) -> impl Iterator<Item = (f64, &'a [f64], RowKind)> {
        let width = self.values.len() / self.time.len().max(1);
        let kind = move |k: usize| self.kinds.get(k).copied().unwrap_or(RowKind::Grid);
        let row = move |(k, &t): (usize, &f64)| {
            let values = &self.values[k * width..(k + 1) * width];
            (t, values, kind(k))
        };
        self.time.iter().enumerate().map(row)
    }
}

/// Takes rows; [`ControlFlow::Break`] ends the run.
pub type Sink<'a> = &'a mut dyn FnMut(Block<'_>) -> ControlFlow<()>;

/// Which rows a run makes and where they go.
#[derive(Default)]
pub struct Asked<'a> {
    /// Rows at events.
    pub events: bool,
    /// Rows at corners of sources.
    pub corners: bool,
    /// Takes the rows as they come.
    pub sink: Option<Sink<'a>>,
    /// Rows are for the sink alone, not collected.
    pub discard: bool,
    /// Rows collected at most.
    pub most: Option<usize>,
    /// Set by another thread or a signal: the run is to end.
    pub cancel: Option<&'a AtomicBool>,
    /// CPU seconds that the sink has taken, no part of the solve's.
    pub elsewhere: Rc<Cell<f64>>,
}

/// Rows handed on at a time, at least.
const BLOCK: usize = 1024;
/// The last rows may be taken back: of several at one instant the first and the last stay.
const REVOCABLE: usize = 2;
/// Rows that may come at once, with those that may be taken back.
const AT_ONCE: usize = 64;
/// Longer collections grow as they go.
const RESERVED: usize = 1 << 20;

/// Why no more rows are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    Sink,
    Full,
}

/// Rows so far.
#[derive(Default)]
pub(super) struct Sheet<'a> {
    columns: usize,
    /// No row before, s.
    from: f64,
    /// No row up to here, s: an attempt before has handed them on.
    known: f64,
    asked: Asked<'a>,
    time: Vec<f64>,
    values: Vec<f64>,
    /// Empty where only the grid's rows are wanted.
    kinds: Vec<RowKind>,
    /// Rows between those of the grid wait for these, where that is asked for.
    held: Option<VecDeque<(f64, RowKind, Vec<f64>)>>,
    /// How many of the rows here the sink has.
    handed: usize,
    /// The time of the last row that the sink has, s.
    last_handed: f64,
    /// How many rows here ask for a look at the sink or the limit.
    look_at: usize,
    stop: Option<Stop>,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(columns: usize, from: f64, asked: Asked<'a>) -> Self {
        let mut sheet = Self {
            columns,
            from,
            known: f64::NEG_INFINITY,
            last_handed: f64::NEG_INFINITY,
            asked,
            ..Self::default()
        };
        sheet.look_again();
        sheet
    }

    /// Rows at events and jumps are wanted.
    #[inline]
    pub(super) fn wants_events(&self) -> bool {
        self.asked.events || self.asked.corners
    }

    /// What cancels the run.
    pub(super) fn cancel(&self) -> Option<&'a AtomicBool> {
        self.asked.cancel
    }

    /// Rows at corners are wanted.
    #[inline]
    pub(super) fn wants_corners(&self) -> bool {
        self.asked.corners
    }

    /// Whether the run at `t` may go on.
    ///
    /// # Errors
    /// [`Reason::Interrupted`], [`Reason::TooManyRows`].
    #[inline]
    pub(super) fn go_on(&self, t: f64) -> Result<(), Error> {
        let cancelled = |flag: &AtomicBool| flag.load(Ordering::Relaxed);
        if self.stop.is_some() || self.asked.cancel.is_some_and(cancelled) {
            return Err(self.stopped(t));
        }
        Ok(())
    }

    #[cold]
    fn stopped(&self, t: f64) -> Error {
        let reason = match self.stop {
            Some(Stop::Full) => Reason::TooManyRows {
                rows: self.time.len() as f64,
                columns: self.columns,
                limit: self.asked.most.unwrap_or(usize::MAX),
            },
            Some(Stop::Sink) | None => Reason::Interrupted,
        };
        Error::at(t, reason)
    }

    /// Makes room for so many rows.
    pub(super) fn expect(&mut self, rows: usize) {
        let most = if self.asked.discard {
            BLOCK + AT_ONCE
        } else {
            RESERVED
        };
        let rows = rows.min(most);
        self.time.reserve(rows);
        self.values.reserve(rows * self.columns);
    }

    fn pop(&mut self) {
        self.time.pop();
        self.kinds.pop();
        self.values.truncate(self.time.len() * self.columns);
    }

    /// Whether the last row is none of the grid's.
    fn ends_between(&self) -> bool {
        self.kinds.last().is_some_and(|kind| !kind.is_grid())
    }

    /// A row between those of the grid. Of several at one instant the first and the last stay; a corner where there is a row adds none.
    pub(super) fn between(&mut self, t: f64, row: &[f64], kind: RowKind) {
        debug_assert_eq!(row.len(), self.columns);
        if !self.wants_events() || t < self.from || t <= self.known {
            return;
        }
        match &mut self.held {
            Some(held) => held.push_back((t, kind, row.to_vec())),
            None => self.insert(t, row, kind),
        }
    }

    /// Has rows between those of the grid wait until the grid has come to them.
    pub(super) fn hold(&mut self) {
        if self.held.is_none() {
            self.held = Some(VecDeque::new());
        }
    }

    /// Takes the rows that have waited for a row at `t`. One at the same time but for rounding is what that row follows, which is read behind it.
    fn take_held(&mut self, t: f64) {
        let due = |held: &mut VecDeque<(f64, RowKind, Vec<f64>)>| match held.front() {
            Some((at, ..)) if *at <= t + SAME_TIME * t.abs() => held.pop_front(),
            _ => None,
        };
        while let Some((at, kind, row)) = self.held.as_mut().and_then(due) {
            let last = self.time.last().copied().unwrap_or(f64::NEG_INFINITY);
            self.insert(at.min(t).max(last), &row, kind);
        }
    }

    fn insert(&mut self, t: f64, row: &[f64], kind: RowKind) {
        let at = self.time.len();
        if kind == RowKind::Corner && self.time.last() == Some(&t) {
            if let Some(last) = self.kinds.last_mut().filter(|last| last.is_grid()) {
                *last = RowKind::Both;
            }
            return;
        }
        if at >= 2 && self.ends_between() && self.time[at - 2..] == [t, t] {
            self.pop();
        }
        self.time.push(t);
        self.kinds.push(kind);
        self.values.extend_from_slice(row);
        self.look();
    }

    /// Rows at these output times, one after the other; the first replaces an event row for the same right limit.
    ///
    /// # Errors
    /// [`Reason::Overflow`] at the first row that is not finite; those before it are taken.
    pub(super) fn grid(
        &mut self,
        times: &Times,
        which: Range<usize>,
        rows: &[f64],
    ) -> Result<(), Error> {
        if let Some(at) = not_finite(rows) {
            let bad = which.start + at / self.columns;
            self.grid(times, which.start..bad, &rows[..at - at % self.columns])?;
            return Err(Error::at(times.at(bad), Reason::Overflow));
        }
        let (which, rows) = self.unknown(times, which, rows);
        self.take_held(times.at(which.start));
        let meets = self.ends_between() && self.time.last() == Some(&times.at(which.start));
        if meets {
            self.pop();
        }
        let first = self.time.len();
        times.extend(which, &mut self.time);
        self.values.extend_from_slice(rows);
        if self.wants_events() {
            self.kinds.resize(self.time.len(), RowKind::Grid);
        }
        if let Some(kind) = self.kinds.get_mut(first).filter(|_| meets) {
            *kind = RowKind::Both;
        }
        self.look();
        Ok(())
    }

    /// Without the rows that were handed on before.
    fn unknown<'r>(
        &self,
        times: &Times,
        which: Range<usize>,
        rows: &'r [f64],
    ) -> (Range<usize>, &'r [f64]) {
        if self.known == f64::NEG_INFINITY {
            return (which, rows);
        }
        let known = which
            .clone()
            .take_while(|&k| times.at(k) <= self.known)
            .count();
        let rows = rows.get(known * self.columns..).unwrap_or_default();
        (which.start + known..which.end, rows)
    }

    #[inline]
    fn look(&mut self) {
        if self.time.len() >= self.look_at {
            self.hand_on(REVOCABLE);
            self.look_again();
        }
    }

    /// Chooses when to look next.
    fn look_again(&mut self) {
        let full = match self.asked.most {
            Some(most) if !self.asked.discard => most,
            _ => usize::MAX,
        };
        if self.time.len() >= full {
            self.stop = self.stop.or(Some(Stop::Full));
        }
        let next = match &self.asked.sink {
            Some(_) => self.time.len() + BLOCK,
            None => usize::MAX,
        };
        self.look_at = next.min(full);
    }

    /// Gives the sink all rows but so many.
    fn hand_on(&mut self, but: usize) {
        let Some(sink) = &mut self.asked.sink else {
            return;
        };
        let end = self.time.len().saturating_sub(but);
        if end <= self.handed || self.stop == Some(Stop::Sink) {
            return;
        }
        let block = Block {
            time: &self.time[self.handed..end],
            values: &self.values[self.handed * self.columns..end * self.columns],
            kinds: self.kinds.get(self.handed..end).unwrap_or_default(),
        };
        let begin = ThreadTime::now();
        if sink(block).is_break() {
            self.stop = Some(Stop::Sink);
        }
        let elsewhere = &self.asked.elsewhere;
        elsewhere.set(elsewhere.get() + begin.elapsed().as_secs_f64());
        self.last_handed = self.time[end - 1];
        self.handed = end;
        if self.asked.discard {
            self.time.drain(..end);
            self.values.drain(..end * self.columns);
            self.kinds.drain(..end.min(self.kinds.len()));
            self.handed = 0;
        }
    }

    /// The sink gets what it has not got yet.
    pub(super) fn end(&mut self) {
        self.take_held(f64::INFINITY);
        self.hand_on(0);
    }

    /// For another attempt from the start: rows that were handed on stay as they are and are not made again; returns the time of the
    /// last of them, s.
    pub(super) fn again(&mut self) -> Option<f64> {
        self.held = None;
        let handed = self.last_handed > f64::NEG_INFINITY;
        if handed {
            self.hand_on(0);
            self.known = self.last_handed;
        }
        let kept = if self.asked.discard || !handed {
            0
        } else {
            self.time.len()
        };
        self.time.truncate(kept);
        self.kinds.truncate(kept);
        self.values.truncate(kept * self.columns);
        self.handed = kept;
        if self.stop == Some(Stop::Full) {
            self.stop = None;
        }
        self.look_again();
        handed.then_some(self.known)
    }

    /// Times, values and kinds of the rows that were collected.
    pub(super) fn collected(&mut self) -> (Vec<f64>, Vec<f64>, Vec<RowKind>) {
        if self.asked.discard {
            return Default::default();
        }
        (
            std::mem::take(&mut self.time),
            std::mem::take(&mut self.values),
            std::mem::take(&mut self.kinds),
        )
    }
}

/// The first value that is not finite.
fn not_finite(values: &[f64]) -> Option<usize> {
    // What is finite is nothing when taken zero times: four values at once, and no branch for each.
    let (fours, rest) = values.as_chunks::<4>();
    let nothing = fours.iter().fold([0.0; 4], |sum, four| {
        std::array::from_fn(|i| sum[i] + 0.0 * four[i])
    });
    let finite = nothing.iter().all(|v| *v == 0.0) && rest.iter().all(|v| v.is_finite());
    if finite {
        None
    } else {
        values.iter().position(|v| !v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_found_wherever_it_stands() {
        for len in 0..10 {
            let mut values = vec![-1e308; len];
            assert_eq!(not_finite(&values), None);
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                for at in (0..len).rev() {
                    values[at] = bad;
                    assert_eq!(not_finite(&values), Some(at));
                }
                values.fill(-1e308);
            }
        }
    }

    fn sheet<'a>(from: f64, most: Option<usize>, sink: Option<Sink<'a>>) -> Sheet<'a> {
        let asked = Asked {
            events: true,
            most,
            sink,
            ..Asked::default()
        };
        Sheet::new(1, from, asked)
    }

    #[test]
    fn a_row_at_the_time_that_rows_begin_at_is_the_first() {
        let mut sheet = sheet(1.0, None, None);
        for t in [0.5, 1.0, 1.5] {
            sheet.between(t, &[t], RowKind::Event);
        }
        assert_eq!(sheet.collected().0, [1.0, 1.5]);
    }

    #[test]
    fn an_attempt_that_was_full_may_be_made_again_and_one_that_was_stopped_may_not() {
        let mut full = sheet(0.0, Some(2), None);
        for t in [0.0, 1.0] {
            full.between(t, &[t], RowKind::Event);
        }
        assert!(full.go_on(1.0).is_err());
        assert_eq!(full.again(), None);
        assert!(full.go_on(0.0).is_ok());

        let mut stop = |_: Block<'_>| ControlFlow::Break(());
        let mut stopped = sheet(0.0, None, Some(&mut stop));
        stopped.between(0.0, &[0.0], RowKind::Event);
        stopped.end();
        stopped.again();
        assert!(stopped.go_on(0.0).is_err());
    }
}
