//! Summaries in words.

use super::{si, table};
use crate::integrate::{Aliased, Method, Note, Orbit, OrbitKind, Places, Run, StateJump, Stats};
use crate::waveform::compare::{Comparison, SignalError};

/// Impulses and jumps listed before the rest is only counted.
const SHOWN: usize = 8;

/// What a run did: method, work, energy balance, impulses and notes; with `verbose` the plan and the event times too.
#[must_use]
pub fn summary(run: &Run, places: Places<'_>, verbose: bool) -> String {
    let stats = &run.stats;
    let mut lines = Vec::new();
    if !run.waveforms.title.is_empty() {
        lines.push(run.waveforms.title.clone());
    }
    if verbose {
        lines.extend(run.plan.iter().map(|reason| format!("plan: {reason}")));
    }
    let rejected = if stats.rejected > 0 {
        format!(" ({} rejected)", stats.rejected)
    } else {
        String::new()
    };
    lines.push(format!(
        "{}: {} steps{rejected}, {} events, {} jumps, {} modes, {} LCP solves, {} CPU",
        run.method,
        stats.steps,
        stats.events,
        stats.jumps,
        stats.modes,
        stats.lcp_solves,
        si::quantity(stats.cpu_seconds, "s", 3),
    ));
    if verbose && stats.modes > 0 {
        lines.extend(built(stats));
    }
    lines.extend(run.orbit.as_ref().map(orbit));
    let energy = &run.energy;
    let balance = format!(
        "energy: source {}, dissipated {}, stored {}, lost in jumps {}, by numerical damping {}, residual {} of the largest",
        si::quantity(energy.source, "J", 4),
        si::quantity(energy.dissipated, "J", 4),
        si::quantity(energy.stored, "J", 4),
        si::quantity(energy.jumps, "J", 4),
        si::quantity(energy.numerical, "J", 4),
        si::plain(energy.residual_relative, 2),
    );
    lines.extend(run.balanced.then_some(balance));
    lines.extend(stated_error(run));
    let jumps = &run.state_jumps;
    for jump in jumps.first.iter().take(SHOWN) {
        lines.push(format!(
            "jump: {} at {} ({}), {} lost",
            jump.elements.join(", "),
            si::quantity(jump.t, "s", 6),
            jump.reason,
            si::quantity(jump.loss, "J", 4),
        ));
    }
    let (count, loss) = jumps.all;
    if count > SHOWN as u64 {
        let (more, all) = (count - SHOWN as u64, si::quantity(loss, "J", 4));
        lines.push(format!("jump: {more} more, {all} lost in all"));
    }
    for impulse in run.impulses.iter().take(SHOWN) {
        let unit = if impulse.name.starts_with("i(") {
            "A·s"
        } else {
            "V·s"
        };
        let (time, area) = (
            si::quantity(impulse.t, "s", 6),
            si::quantity(impulse.area, unit, 4),
        );
        lines.push(format!("impulse: {} at {time}, area {area}", impulse.name));
    }
    if run.impulses.len() > SHOWN {
        lines.push(format!("impulse: {} more", run.impulses.len() - SHOWN));
    }
    if let Some(verified) = &run.verified {
        lines.push(format!(
            "verified by {}: {} differs by {} of its amplitude at {}, {} is tolerated",
            verified.method,
            verified.signal,
            si::plain(verified.max_difference, 2),
            si::quantity(verified.time, "s", 6),
            si::plain(verified.tolerance, 2),
        ));
    }
    if verbose {
        lines.extend(
            run.events
                .iter()
                .map(|event| format!("event: {} {event}", si::quantity(event.t, "s", 9))),
        );
    }
    for warning in warnings(run) {
        lines.push(format!(
            "warning[{}]: {}",
            warning.code,
            places.of(&warning)
        ));
        lines.extend(warning.help().map(|help| format!("  help: {help}")));
    }
    let notes = run.notes.iter();
    lines.extend(notes.map(|note| format!("note[{}]: {}", note.code, places.of(note))));
    lines.join("\n") + "\n"
}

/// What was needed in all positions of the switches, and what was not and therefore not built.
fn built(stats: &Stats) -> Vec<String> {
    let Stats {
        modes,
        positions,
        systems,
        impulsive,
        lcp_solves,
        jumps,
        ..
    } = *stats;
    let built = format!(
        "built: modes {modes}, positions of the switches {positions}, complementarity systems {systems} (with jump logic {impulsive})"
    );
    let mut left = Vec::new();
    let mut leave = |least: bool, what: String| left.extend(least.then_some(what));
    leave(
        systems < positions,
        format!(
            "complementarity systems of positions: {}",
            positions.saturating_sub(systems)
        ),
    );
    leave(lcp_solves == 0, "complementarity solver".into());
    leave(impulsive == 0, "jump logic".into());
    leave(
        impulsive > 0 && jumps == 0,
        "impulses (none was needed)".into(),
    );
    let left = (!left.is_empty()).then(|| format!("left out: {}", left.join(", ")));
    [built].into_iter().chain(left).collect()
}

/// An orbit in a line.
/// What is said of an orbit, on one line.
#[must_use]
pub fn orbit(orbit: &Orbit) -> String {
    /// Multipliers shown.
    const FIRST: usize = 6;
    let multiplier = |[re, im]: &[f64; 2]| match *im {
        0.0 => si::plain(*re, 4),
        im => format!(
            "{}{}{}i",
            si::plain(*re, 4),
            if im < 0.0 { "-" } else { "+" },
            si::plain(im.abs(), 4)
        ),
    };
    let first = orbit.multipliers.iter().take(FIRST).map(multiplier);
    let more = if orbit.multipliers.len() > FIRST {
        ", …"
    } else {
        ""
    };
    let kind = match orbit.kind {
        OrbitKind::Driven => "driven".to_string(),
        OrbitKind::Equilibrium => "at rest".to_string(),
        OrbitKind::Autonomous => match &orbit.section {
            Some(section) => format!("autonomous, beginning after `{section}`"),
            None => "autonomous".to_string(),
        },
    };
    let stability = match (orbit.stable, orbit.multipliers.is_empty()) {
        (true, _) => "stable",
        (false, false) => "unstable",
        (false, true) => "of unknown stability",
    };
    let multipliers = match first.collect::<Vec<_>>().join(", ") {
        none if none.is_empty() => "no multipliers".into(),
        some => format!("multipliers {some}{more}"),
    };
    format!(
        "orbit: period {}, {kind}, order {}, {stability}, closed to {} after {} corrections, {multipliers}",
        si::quantity(orbit.period, "s", 6),
        orbit.order,
        si::plain(orbit.residual, 2),
        orbit.iterations,
    )
}

/// The error that a run states, or that it does not know it; nothing where there are no steps to err.
fn stated_error(run: &Run) -> Option<String> {
    let part = |error: f64| si::plain(error, 2);
    match (run.error.max, run.error.rms) {
        (Some(max), Some(rms)) => Some(format!(
            "stated error: {} of the amplitudes at most, {} RMS, as the steps let expect",
            part(max),
            part(rms)
        )),
        (Some(max), None) => Some(format!(
            "stated error: {} of the amplitudes, as the steps let expect",
            part(max)
        )),
        _ if run.method == Method::Exact.name() => None,
        _ => Some("stated error: not known".into()),
    }
}

/// What a user must be told by default: that a current or charge was destroyed, that rows do not show what happens between them.
#[must_use]
pub fn warnings(run: &Run) -> Vec<Note> {
    let warnings = [
        destroyed(run),
        unbalanced(run),
        imprecise(run),
        run.aliased.as_ref().map(aliasing),
    ];
    warnings.into_iter().flatten().collect()
}

/// A stated error that is a good part of what is shown: of single rows, or of so many that the run is of no use.
fn imprecise(run: &Run) -> Option<Note> {
    let error = run.error.max.filter(|_| !run.error.is_small())?;
    let error = si::plain(error, 2);
    let text = match run.error.rms {
        Some(rms) if run.error.is_of_single_rows() => format!(
            "single rows may be off by {error} of the amplitudes, as beside edges that come a little early or late; root mean squares of the error are {} at most",
            si::plain(rms, 2)
        ),
        _ => format!(
            "the error of this run may be {error} of the amplitudes: its values are not to be relied on"
        ),
    };
    Some(Note::run("imprecise", text))
}

/// Energies beyond doubles: what grows so far is unstable, or wrong. Energies that do not add up: something is wrong, if only an energy.
fn unbalanced(run: &Run) -> Option<Note> {
    if !run.balanced || run.energy.adds_up() {
        return None;
    }
    let text = if run.energy.residual.is_finite() {
        format!(
            "the energies of this run do not add up: {} of the largest is too much or missing; where a controlled source carries the impulse of \
             a jump it may be the energy alone that is wrong (--verify runs it a second time)",
            si::plain(run.energy.residual_relative, 2)
        )
    } else {
        "the energies of this run are beyond the range of numbers, so that nothing checks it; unless the circuit is \
         unstable, its values are wrong (--verify runs it a second time)"
            .into()
    };
    Some(Note::run("energy", text))
}

/// That a circuit rings faster than rows show.
#[must_use]
pub fn ringing(frequency: f64, tstep: f64) -> Note {
    let text = format!(
        "with its switches where they start, the circuit rings at {}: rows that are {} apart do not show what rings down between them; a print step of {} does",
        si::quantity(frequency, "Hz", 3),
        si::quantity(tstep, "s", 3),
        si::quantity(0.1 / frequency, "s", 1),
    );
    Note::run("rows-apart", text)
}

/// That rows do not show what happens between them.
#[must_use]
pub fn aliasing(aliased: &Aliased) -> Note {
    let Aliased {
        name,
        period,
        source,
        tstep,
        named,
        corners,
    } = aliased;
    let whose = if *source {
        "the period of"
    } else {
        "the period in which events repeat at"
    };
    let step = if *named {
        "the print step"
    } else {
        "the step of the 1,000 rows that `.tran` without a print step has"
    };
    let (hidden, shows) = if *corners {
        let between =
            "between its corners and events curves are straight lines, also where they ripple";
        (between, "shows more")
    } else {
        ("rows do not show its course", "does")
    };
    let text = format!(
        "{step}, {}, is half or more of {whose} {name}, {}: {hidden}; a print step below {} in `.tran` {shows}",
        si::quantity(*tstep, "s", 4),
        si::quantity(*period, "s", 4),
        si::quantity(0.1 * period, "s", 2),
    );
    // Events of several devices at once are named together.
    Note::of("rows-apart", name.split(", "), text)
}

fn destroyed(run: &Run) -> Option<Note> {
    let first = run.state_jumps.destroyer.as_ref()?;
    let (count, loss) = run.state_jumps.destroying;
    let more = if count > 1 {
        format!(
            "; {} more jumps like it, {} in all",
            count - 1,
            si::quantity(loss, "J", 3)
        )
    } else {
        String::new()
    };
    let StateJump {
        t,
        elements,
        loss,
        reason,
        ..
    } = first;
    let text = format!(
        "{} jumps at {} ({reason}): a current or charge is destroyed, and {} with it{more}",
        elements.join(", "),
        si::quantity(*t, "s", 6),
        si::quantity(*loss, "J", 3),
    );
    Some(Note::of("destroyed", elements, text))
}

/// One line per signal: amplitude and its errors relative to it, with the instants of the worst points.
#[must_use]
pub fn comparison(found: &Comparison) -> String {
    let rows: Vec<Vec<String>> = found.signals.iter().map(difference).collect();
    let shifted = format!("max ±{}", si::quantity(found.shift, "s", 3));
    let mut text = table::aligned(
        &["signal", "amplitude", "max", "at", "rms", &shifted, "at"],
        &rows,
    );
    if !found.missing.is_empty() {
        text.push_str(&format!(
            "not in the reference: {}\n",
            found.missing.join(" ")
        ));
    }
    text
}

/// A line of [`comparison`].
pub(super) fn difference(s: &SignalError) -> Vec<String> {
    vec![
        s.name.clone(),
        si::quantity(s.amplitude, s.unit, 4),
        si::plain(s.max, 3),
        si::quantity(s.max_time, "s", 6),
        si::plain(s.rms, 3),
        si::plain(s.shifted, 3),
        si::quantity(s.shifted_time, "s", 6),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::event::conducts;
    use crate::integrate::{Energy, Impulse, JumpReason, StateJumps, StatedError, Stats};

    #[test]
    fn a_run_in_words() {
        let jump = StateJump {
            t: 1e-3,
            elements: vec!["l1".into()],
            loss: 1e-3,
            reason: JumpReason::Switch("s1".into()),
            destroys: true,
            change: 0.0,
        };
        let run = Run {
            state_jumps: StateJumps {
                first: vec![jump.clone()],
                destroyer: Some(jump),
                all: (2, 2e-3),
                destroying: (2, 2e-3),
            },
            method: "theta".into(),
            plan: vec!["no devices: linear".into()],
            stats: Stats {
                steps: 1200,
                rejected: 3,
                events: 4,
                cpu_seconds: 1.5e-3,
                ..Stats::default()
            },
            energy: Energy {
                source: 0.0125,
                dissipated: 0.01,
                stored: 0.0015,
                jumps: 0.001,
                residual_relative: 3.1e-7,
                ..Energy::default()
            },
            balanced: true,
            impulses: vec![
                Impulse {
                    t: 1e-3,
                    name: "i(d1)".into(),
                    area: 2e-6
                };
                9
            ],
            events: vec![conducts("d1", 1e-3)],
            notes: vec![Note::run("island", "v(x) is relative to node a")],
            ..Run::default()
        };
        insta::assert_snapshot!(summary(&run, Places::default(), true), @r"
        plan: no devices: linear
        theta: 1200 steps (3 rejected), 4 events, 0 jumps, 0 modes, 0 LCP solves, 1.5 ms CPU
        energy: source 12.5 mJ, dissipated 10 mJ, stored 1.5 mJ, lost in jumps 1 mJ, by numerical damping 0 J, residual 3.1e-7 of the largest
        stated error: not known
        jump: l1 at 1 ms (switch s1), 1 mJ lost
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: i(d1) at 1 ms, area 2 µA·s
        impulse: 1 more
        event: 1 ms d1 conducts
        warning[destroyed]: l1 jumps at 1 ms (switch s1): a current or charge is destroyed, and 1 mJ with it; 1 more jumps like it, 2 mJ in all
          help: give the current a path (a freewheeling diode, a snubber, `Roff` of the switch), or the charge a resistance (`Ron`), unless the ideal jump is what is meant
        note[island]: v(x) is relative to node a
        ");
        assert!(!summary(&run, Places::default(), false).contains("plan:"));
    }

    #[test]
    fn a_large_stated_error_is_a_warning() {
        let stating = |max, rms| Run {
            error: StatedError {
                max,
                rms,
                ..StatedError::default()
            },
            ..Run::default()
        };
        let said = |max, rms| {
            let notes = warnings(&stating(max, rms)).into_iter();
            let mut found = notes.filter(|note| note.code == "imprecise");
            found.next().map(|note| note.text)
        };
        for max in [None, Some(0.05)] {
            assert_eq!(said(max, None), None, "{max:?}");
        }
        for rms in [None, Some(0.2)] {
            let text = said(Some(0.4), rms).expect("a warning");
            assert!(text.ends_with("not to be relied on"), "{text}");
        }
        let text = said(Some(0.4), Some(0.002)).expect("a warning");
        assert!(
            text.starts_with("single rows may be off by 0.4 of"),
            "{text}"
        );
    }

    #[test]
    fn a_comparison_in_a_table() {
        let signal = |name: &str, unit, max| SignalError {
            name: name.into(),
            unit,
            amplitude: 12.0,
            max,
            max_time: 1.5e-3,
            rms: max / 3.0,
            shifted: max / 10.0,
            shifted_time: 0.0,
        };
        insta::assert_snapshot!(comparison(&Comparison {
            from: 0.0,
            to: 1.0,
            shift: 1e-6,
            signals: vec![signal("v(out)", "V", 1.234e-3), signal("i(l1)", "A", 0.0)],
            missing: vec!["i(d1)".into()],
        }), @r"
        signal  amplitude      max      at       rms  max ±1 µs   at
        v(out)       12 V  0.00123  1.5 ms  0.000411   0.000123  0 s
        i(l1)        12 A        0  1.5 ms         0          0  0 s
        not in the reference: i(d1)
        ");
    }
}
