//! Output times too far apart to show what repeats between them.

use std::collections::BTreeMap;

use crate::circuit::Tran;
use crate::circuit::source::Wave;
use crate::integrate::event::{Change, Event};
use crate::integrate::stats::Run;
use crate::settings::tolerances::times::WHOLE;

/// Something that repeats faster than the output times can show.
#[derive(Debug, Clone, PartialEq)]
pub struct Aliased {
    /// The source, or the device or switch whose events repeat.
    pub name: String,
    /// Its period, s.
    pub period: f64,
    /// Whether it is a source.
    pub source: bool,
    /// The distance of output times, s.
    pub tstep: f64,
    /// Whether the netlist names it.
    pub named: bool,
    /// Whether rows stand at its corners besides.
    pub corners: bool,
}

/// Periods of events in a row that make a period of the run.
const REPEATED: usize = 8;

/// The fastest of sources and events, of those without rows at corners if there are any, whose period is shorter than twice the print step, or just that.
///
/// A source counts if it repeats within the run. Where the netlist names no print step, rows stand at events and at corners, and events do not count.
/// The period of events is the median over those of one name.
#[must_use]
pub fn aliased<'a>(
    tran: &Tran,
    sources: impl Iterator<Item = (&'a str, &'a Wave)>,
    run: &Run,
) -> Option<Aliased> {
    let span = tran.tstop - tran.tstart;
    let too_fast = |period: f64| period * (1.0 - WHOLE) <= 2.0 * tran.tstep;
    let sources = sources.filter_map(|(name, wave)| {
        let period = wave.period().filter(|period| *period < span)?;
        let corners = !tran.prints && wave.has_corners();
        Some((name.to_string(), period, true, corners))
    });
    let events = if tran.prints {
        periods(run)
    } else {
        Vec::new()
    };
    let events = events
        .into_iter()
        .map(|(name, period)| (name, period, false, false));
    let fastest = sources
        .chain(events)
        .filter(|(_, period, ..)| too_fast(*period))
        // What has no rows of its own first.
        .min_by(|a, b| a.3.cmp(&b.3).then(a.1.total_cmp(&b.1)));
    fastest.map(|(name, period, source, corners)| Aliased {
        name,
        period,
        source,
        corners,
        tstep: tran.tstep,
        named: tran.prints,
    })
}

/// Names of events that repeat, and their periods, s.
fn periods(run: &Run) -> Vec<(String, f64)> {
    // What recurs is one list in memory, as a rule: what lists say is compared once for each of them.
    let mut lists: BTreeMap<(*const Change, bool), Vec<&Event>> = BTreeMap::new();
    for event in &run.events {
        let list = (event.changes.as_ptr(), event.jump);
        lists.entry(list).or_default().push(event);
    }
    let mut alike: BTreeMap<(&[Change], bool), Vec<&Event>> = BTreeMap::new();
    for ((_, jump), events) in lists {
        let kind = (&*events[0].changes, jump);
        alike.entry(kind).or_default().extend(events);
    }
    for events in alike.values_mut() {
        events.sort_by(|one, other| one.t.total_cmp(&other.t));
    }
    let period = |events: Vec<&Event>| {
        let event = events.first()?;
        let names: Vec<&str> = event.changes.iter().map(Change::name).collect();
        let plain = if names.is_empty() {
            event.to_string()
        } else {
            names.join(", ")
        };
        // What is on, or conducts, is so once a period; of jumps there may be one each way.
        let a_period = if event.changes.is_empty() { 2 } else { 1 };
        let pairs = events.iter().zip(events.iter().skip(a_period));
        let mut periods: Vec<f64> = pairs.map(|(from, to)| to.t - from.t).collect();
        if periods.len() < a_period * REPEATED {
            return None;
        }
        periods.sort_by(f64::total_cmp);
        let median = periods[periods.len() / 2];
        (median > 0.0).then_some((plain, median))
    };
    alike.into_values().filter_map(period).collect()
}
