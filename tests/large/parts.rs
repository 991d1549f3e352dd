//! Circuits that share nothing but ground and sources: each is solved as if it were alone.

use std::fmt::Write as _;

use circ::integrate::{RowKind, Run, SimOptions, simulate};
use circ::settings::Settings;
use proptest::prelude::*;

use crate::{difference, families, model, run};

/// In parts however small.
fn apart() -> Settings {
    Settings {
        apart: 0,
        ..Settings::default()
    }
}

/// A run with rows at events.
fn run_at_events(text: &str) -> Run {
    let model = model(text);
    let options = SimOptions {
        events: true,
        corners: true,
        settings: apart(),
        ..SimOptions::default()
    };
    simulate(model.circuit(), model.multiport(), options).unwrap_or_else(|e| panic!("{e}"))
}

fn is_apart(run: &Run) -> bool {
    run.plan.iter().any(|words| words.contains("share nothing"))
}

#[test]
fn copies_cost_what_one_costs_each_and_share_their_modes() {
    const COPIES: usize = 150;
    let one = run(&families::copies(1), Settings::default());
    let all = run(&families::copies(COPIES), Settings::default());
    assert!(!is_apart(&one) && is_apart(&all), "{:?}", all.plan);
    let difference = difference(&one, &all);
    assert!(difference < 1e-12, "{difference:e}");
    let (one_work, work) = (&one.stats, &all.stats);
    let copies = COPIES as u64;
    assert_eq!(work.events, copies * one_work.events);
    assert!(
        work.steps <= copies * one_work.steps,
        "{} steps",
        work.steps
    );
    // That with probes has modes of its own, all others have one set.
    assert_eq!(work.modes, 2 * one_work.modes);
    assert!(work.lcp_solves <= copies * one_work.lcp_solves);
    assert_eq!(all.events.len(), COPIES * one.events.len());
    assert!(all.events.is_sorted_by(|a, b| a.t <= b.t));
    for (whole, part) in [
        (all.energy.source, one.energy.source),
        (all.energy.dissipated, one.energy.dissipated),
        (all.energy.stored, one.energy.stored),
    ] {
        assert!((whole / (COPIES as f64 * part) - 1.0).abs() < 1e-11);
    }
    assert!(all.energy.residual_relative < 1e-12);
}

/// Parsing and set-up included. On a loaded machine CPU time is what is left to compare.
#[test]
#[ignore = "a measurement: cargo test --test large -- --ignored --nocapture"]
fn a_thousand_copies_cost_at_most_thirteen_hundred_runs() {
    use cpu_time::ProcessTime;
    const SINGLE: u32 = 250;
    let begin = ProcessTime::now();
    for _ in 0..SINGLE {
        run(&families::copies(1), Settings::default());
    }
    let single = begin.elapsed().as_secs_f64() / f64::from(SINGLE);
    let begin = ProcessTime::now();
    let all = run(&families::copies(1000), Settings::default());
    let together = begin.elapsed().as_secs_f64();
    let ratio = together / (1000.0 * single);
    let found = format!(
        "{ratio:.2}: {together:.2} s together, {:.2} ms alone\n",
        1e3 * single
    );
    std::io::Write::write_all(&mut std::io::stderr(), found.as_bytes()).expect("stderr");
    assert!(is_apart(&all) && ratio < 1.3, "{ratio}");
}

/// Buck converters of different values and clocks on one source; what is between their outputs and what the source delivers are sums.
fn bucks(which: &[usize], saved: &str) -> String {
    let mut text = String::from(
        "* bucks on one source\n.model sw sw(ron=1m roff=1meg vt=0 vh=0)\n.model di d(ron=1m roff=1meg)\nvi in 0 12\n",
    );
    for &k in which {
        let _ = write!(
            text,
            "vg{k} g{k} 0 pulse(-1 1 {}n 0 0 {}u {}u)\ns{k} in x{k} g{k} 0 sw\nd{k} 0 x{k} di\nl{k} x{k} o{k} {}u\nc{k} o{k} 0 47u\nr{k} o{k} 0 {}\n",
            130 * k,
            3 + k,
            9 + k,
            20 + 3 * k,
            3 + 20 * k
        );
    }
    text + saved + "\n.tran 1u 300u uic\n.end\n"
}

fn column(run: &Run, name: &str) -> Vec<f64> {
    let at = run.waveforms.names.iter().position(|n| n == name);
    let at = at.unwrap_or_else(|| panic!("no {name} in {:?}", run.waveforms.names));
    run.waveforms.column(at).collect()
}

fn amplitude(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

#[test]
fn readings_of_several_parts_are_sums() {
    let text = bucks(&[0, 1, 2], ".save v(o0) v(o0,o2) i(vi) v(in) v(g1)");
    let whole = run(&text, apart());
    // A small circuit stays in one piece.
    assert!(!is_apart(&run(&text, Settings::default())));
    assert!(is_apart(&whole));
    let alone: Vec<Run> = (0..3)
        .map(|k| {
            run(
                &bucks(&[k], &format!(".save v(o{k}) i(vi)")),
                Settings::default(),
            )
        })
        .collect();
    let of = |k: usize, name: &str| column(&alone[k], name);
    let currents = [0, 1, 2].map(|k| of(k, "i(vi)"));
    let (o0, o2) = (of(0, "v(o0)"), of(2, "v(o2)"));
    for (k, total) in column(&whole, "i(vi)").iter().enumerate() {
        let sum: f64 = currents.iter().map(|i| i[k]).sum();
        assert!(
            (total - sum).abs() < 1e-11 * amplitude(&currents[0]),
            "{total} {sum}"
        );
        let between = column(&whole, "v(o0,o2)")[k];
        assert!((between - (o0[k] - o2[k])).abs() < 1e-11 * 12.0);
    }
    let supply = column(&whole, "v(in)");
    assert!(
        supply.iter().all(|v| (v - 12.0).abs() < 1e-11),
        "{supply:?}"
    );
    let gate = column(&whole, "v(g1)");
    assert!(
        gate.iter().all(|v| (v.abs() - 1.0).abs() < 1e-11),
        "{gate:?}"
    );
    let sum = |of: fn(&Run) -> f64| alone.iter().map(of).sum::<f64>();
    let source = sum(|run| run.energy.source);
    assert!((whole.energy.source / source - 1.0).abs() < 1e-11);
    let dissipated = sum(|run| run.energy.dissipated);
    assert!((whole.energy.dissipated / dissipated - 1.0).abs() < 1e-11);
    assert!(whole.energy.residual_relative < 1e-12);
}

/// The same circuit in one piece: controlled sources with next to no gain join everything.
fn in_one_piece(text: &str, joints: &[(&str, &str)]) -> String {
    let mut joined = String::new();
    for (k, (a, b)) in joints.iter().enumerate() {
        let _ = writeln!(joined, "gjoin{k} {b} 0 {a} 0 1e-18");
    }
    text.replacen("\n.tran", &format!("\n{joined}.tran"), 1)
}

/// Whether two runs have the same rows, left and right limits included; events of microseconds are where they are to 1e-14 s.
fn same_rows(parts: &Run, whole: &Run, tolerance: f64) {
    let (a, b) = (&parts.waveforms, &whole.waveforms);
    assert_eq!(a.names, b.names);
    let rows = |run: &Run| -> Vec<(f64, RowKind)> {
        run.waveforms
            .time
            .iter()
            .copied()
            .zip(run.kinds.iter().copied())
            .collect()
    };
    for (k, (x, y)) in rows(parts).iter().zip(&rows(whole)).enumerate() {
        let same = (x.0 - y.0).abs() < 1e-14 && x.1 == y.1;
        assert!(same, "row {k}: {x:?} {y:?}");
    }
    assert_eq!(a.time.len(), b.time.len(), "rows");
    let difference = difference(parts, whole);
    assert!(difference < tolerance, "{difference:e}");
}

#[test]
fn rows_at_events_are_those_of_the_circuit_in_one_piece() {
    let text = bucks(&[0, 1, 2], ".save v(o0) v(x0) v(x1,x2) i(vi) v(g0)");
    let parts = run_at_events(&text);
    let whole = run_at_events(&in_one_piece(&text, &[("o0", "o1"), ("o1", "o2")]));
    assert!(is_apart(&parts), "{:?}", parts.plan);
    assert!(!is_apart(&whole), "{:?}", whole.plan);
    let jumps = |run: &Run| {
        run.waveforms
            .time
            .windows(2)
            .filter(|w| w[0] == w[1])
            .count()
    };
    same_rows(&parts, &whole, 1e-9);
    assert_eq!(jumps(&parts), jumps(&whole));
    same_rows(&parts, &whole, 1e-9);
    let changes = |run: &Run| run.events.iter().map(|e| e.changes.len()).sum::<usize>();
    assert_eq!(changes(&parts), changes(&whole));
}

/// A part with one of several circuits in it: elements, the node that may be joined, and what is probed.
fn piece(kind: usize, k: usize, [a, b, c]: [f64; 3]) -> String {
    let period = 20.0 + 15.0 * a;
    match kind {
        0 => format!(
            "vs{k} s{k} 0 sin(0 {:.3} {:.1} 0 0 {:.0})\nd{k} s{k} o{k} di\nc{k} o{k} 0 {:.3}u\nr{k} o{k} 0 {:.1}\n",
            5.0 + 5.0 * a,
            1e3 + 4e3 * b,
            // Odd: a sine that starts at what rounding leaves of 0 has its first event at once, or not.
            1.0 + 2.0 * (179.0 * c).floor(),
            1.0 + 10.0 * a,
            20.0 + 80.0 * c
        ),
        1 => format!(
            "vg{k} g{k} 0 pulse(-1 1 {:.3}u 0 0 {:.3}u {period:.3}u)\ns{k} in x{k} g{k} 0 sw\nd{k} 0 x{k} di\nl{k} x{k} o{k} {:.2}u\nc{k} o{k} 0 10u\nr{k} o{k} 0 {:.2}\n",
            5.0 * c,
            period * (0.2 + 0.6 * b),
            20.0 + 100.0 * c,
            2.0 + 60.0 * a
        ),
        2 => format!(
            "r{k} in m{k} {:.2}\nl{k} m{k} o{k} {:.2}u ic={:.3}\nc{k} o{k} 0 {:.3}u ic={:.3}\nrr{k} o{k} 0 {:.1}\n",
            1.0 + 9.0 * a,
            10.0 + 50.0 * b,
            a - b,
            0.5 + 2.0 * c,
            10.0 * b,
            50.0 + 100.0 * a
        ),
        3 => format!(
            "i{k} 0 o{k} pulse(0 {:.3} 10u 5u 5u 30u 90u)\nc{k} o{k} 0 {:.3}u\nd{k} o{k} e{k} di\nve{k} e{k} 0 {:.3}\nr{k} o{k} 0 {:.1}\n",
            0.1 + a,
            0.2 + b,
            1.0 + 3.0 * c,
            20.0 + 50.0 * b
        ),
        _ => format!(
            "s{k} in o{k} lim o{k} hys\nr{k} o{k} 0 {:.2}\nc{k} o{k} 0 {:.3}u\n",
            20.0 + 30.0 * a,
            0.5 + b
        ),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Random circuits beside each other, in parts and in one piece.
    #[test]
    fn parts_are_what_the_circuit_in_one_piece_is(
        pieces in prop::collection::vec((0_usize..5, [0.0..1.0, 0.0..1.0, 0.0..1.0_f64]), 2..6)
    ) {
        let mut text = String::from(
            "* pieces\n.model sw sw(ron=10m roff=1meg vt=0 vh=0)\n.model hys sw(ron=5 roff=1meg vt=0 vh=0.5)\n.model di d(ron=10m roff=1meg)\nvi in 0 12\nvl lim 0 6\n",
        );
        let mut joints = Vec::new();
        for (k, (kind, values)) in pieces.iter().enumerate() {
            text += &piece(*kind, k, *values);
            joints.push((format!("o{k}"), format!("o{}", (k + 1) % pieces.len())));
        }
        let last = pieces.len() - 1;
        let _ = write!(text, ".save v(o0) v(o0,o{last}) i(vi)\n.tran 2u 400u uic\n.end\n");
        let joints: Vec<(&str, &str)> = joints.iter().map(|(a, b)| (&**a, &**b)).collect();
        let joined = in_one_piece(&text, &joints);
        for at_events in [false, true] {
            let go = |text: &str| if at_events { run_at_events(text) } else { run(text, apart()) };
            let (parts, whole) = (go(&text), go(&joined));
            prop_assert!(is_apart(&parts), "{:?}", parts.plan);
            prop_assert!(!is_apart(&whole), "{:?}", whole.plan);
            prop_assert!(parts.energy.residual_relative < 1e-10, "{:e}", parts.energy.residual_relative);
            let energies = [parts.energy, whole.energy].map(|e| [e.source, e.dissipated, e.stored]);
            let largest = amplitude(&energies[1]);
            for (a, b) in energies[0].iter().zip(&energies[1]) {
                prop_assert!((a - b).abs() < 1e-9 * largest, "{a:e} {b:e}");
            }
            if at_events {
                same_rows(&parts, &whole, 1e-8);
            } else {
                let difference = difference(&parts, &whole);
                prop_assert!(difference < 1e-9, "{difference:e}");
            }
        }
    }
}

/// What one part cannot do exactly is its own matter: the others stay exact, and the note names the device.
#[test]
fn a_part_that_needs_steps_leaves_the_others_exact() {
    let controller = "v9 p9 0 10\ns9 p9 q9 ref o9 two off\nr9 q9 o9 1k\nc9 o9 0 0.1u\nrl9 o9 0 10k\nvref ref 0 pwl(0 5 0.1m 5 0.11m 8)\n\
        .model two sw(ideal vt=0 vh=1e-11)\n";
    let bucks_alone = bucks(&[0, 1], ".save v(o0)");
    let both = bucks_alone.replacen(".save", &format!("{controller}.save"), 1);
    let [alone, both] = [bucks_alone, both].map(|text| {
        let model = model(&text);
        let options = SimOptions {
            settings: apart(),
            ..SimOptions::default()
        };
        simulate(model.circuit(), model.multiport(), options).unwrap_or_else(|e| panic!("{e}"))
    });
    assert!(alone.notes.is_empty() && is_apart(&both));
    let notes: Vec<&str> = both.notes.iter().map(|note| &*note.text).collect();
    assert!(
        notes.iter().any(|text| text.contains("Moreau's steps")),
        "{notes:?}"
    );
    assert!(both.notes.iter().all(|note| note.elements == ["s9"]));
    let difference = difference(&alone, &both);
    assert!(difference < 1e-12, "{difference:e}");
}

/// Every row that is asked for comes, in the order of time, whatever ends a run.
#[test]
fn a_run_that_is_cancelled_keeps_its_rows() {
    use std::ops::ControlFlow;
    let text = bucks(&[0, 1, 2], ".save v(o0) v(o1)");
    let model = model(&text);
    let mut times = Vec::new();
    let mut sink = |block: circ::integrate::Block<'_>| {
        times.extend_from_slice(block.time);
        ControlFlow::Continue(())
    };
    let options = SimOptions {
        rows: Some(&mut sink),
        discard: true,
        settings: apart(),
        ..SimOptions::default()
    };
    simulate(model.circuit(), model.multiport(), options).unwrap();
    assert_eq!(times.len(), 301);
    assert!(times.is_sorted_by(|a, b| a < b));
    let cancel = std::sync::atomic::AtomicBool::new(true);
    let options = SimOptions {
        cancel: Some(&cancel),
        settings: apart(),
        ..SimOptions::default()
    };
    let error = simulate(model.circuit(), model.multiport(), options).unwrap_err();
    assert_eq!(error.reason, circ::integrate::Reason::Interrupted);
}
