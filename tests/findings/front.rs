//! What netlists say: sources, start values, devices.

use std::io::ErrorKind;

use circ::circuit::{Circuit, ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::parse;

use crate::run;

const METHODS: [Method; 3] = [Method::Exact, Method::Euler, Method::Theta];

/// The circuit of a netlist without includes.
fn read(text: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", text);
    let (netlist, faults) = parse(&mut sources, root, &|_| Err(ErrorKind::NotFound.into()));
    let (circuit, more) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{text}: {faults:?} {more:?}"))
}

fn run_text(text: &str, method: Method) -> Run {
    let circuit = read(text);
    let behaviour = behaviour(&circuit).unwrap_or_else(|e| panic!("{text}: {e:?}"));
    let options = SimOptions {
        method,
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{text}: {e}"))
}

/// (time, value) of a signal at the row nearest to `t`.
fn value(run: &Run, name: &str, t: f64) -> f64 {
    let waves = &run.waveforms;
    let column = waves.names.iter().position(|n| n == name).expect(name);
    let distance = |k: &usize| (waves.time[*k] - t).abs();
    let nearest = (0..waves.time.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    waves.values[nearest.expect("rows") * waves.names.len() + column]
}

#[test]
fn an_edge_at_zero_acts_after_the_operating_point() {
    for method in METHODS {
        let run = run("edge_at_zero", method);
        for t in [0.0, 50e-6, 100e-6, 300e-6_f64] {
            let right = 1.0 - (-t / 1e-4).exp();
            let found = value(&run, "v(b)", t);
            assert!((found - right).abs() < 1e-4, "{method:?} {t}: {found}");
        }
        assert_eq!(value(&run, "v(a)", 0.0), 1.0);
    }
}

/// Every kind of source with an edge at t = 0, into R and C: what is charged in 0.1 ms of a time constant of 0.1 ms.
#[test]
fn every_edge_at_zero_acts_after_the_operating_point() {
    let charged = 1.0 - (-1.0_f64).exp();
    for (source, start, uic) in [
        ("PULSE(0 1 0 0 0 1 2)", 0.0, ""),
        ("PULSE(0 1 0 0 0 1 2)", 0.0, "uic"),
        // From 2 V in steady state.
        ("PULSE(2 1 0 0 0 1 2)", 2.0, ""),
        ("PWL(0 0 0 1 1 1)", 0.0, ""),
        ("PWL(0 3 0 2 0 1)", 3.0, ""),
        // No edge: what the waveform says at t = 0.
        ("SIN(1 1 0 0 0 0)", 1.0, ""),
        ("PULSE(1 0 1 0 0 1 2)", 1.0, ""),
        ("PWL(0 1 1 1)", 1.0, ""),
        // Its edges lie before t = 0.
        ("PULSE(0 1 -1u 0 0 1 2)", 1.0, ""),
    ] {
        let text = format!("t\nV1 a 0 {source}\nR1 a b 1k\nC1 b 0 100n\n.tran 1u 100u {uic}\n");
        for method in METHODS {
            let found = run_text(&text, method);
            let right = start + (1.0 - start) * charged;
            let (first, last) = (value(&found, "v(b)", 0.0), value(&found, "v(b)", 1e-4));
            assert!(
                (first - start).abs() < 1e-12,
                "{source} {method:?}: {first}"
            );
            assert!((last - right).abs() < 1e-4, "{source} {method:?}: {last}");
        }
    }
}

/// Two capacitors across the source: the edge shares its charge among them, and the source's work is CV²/2 + CV²/2.
#[test]
fn an_edge_at_zero_charges_capacitors_across_the_source() {
    let text = "t\nV1 a 0 PULSE(0 4 0 0 0 1 2)\nC1 a b 1u\nC2 b 0 3u\nR1 b 0 1g\n.tran 1u 10u\n";
    for method in METHODS {
        let run = run_text(text, method);
        assert!((value(&run, "v(b)", 0.0) - 1.0).abs() < 1e-9, "{method:?}");
        let work = 0.5 * 0.75e-6 * 16.0;
        // No resistance: what the source brings beyond the stored energy would be lost; here nothing is.
        assert!(
            (run.energy.source / work - 1.0).abs() < 1e-3,
            "{method:?} {:?}",
            run.energy
        );
        assert!(
            run.energy.residual_relative < 1e-9,
            "{method:?} {:?}",
            run.energy
        );
    }
}

/// A gate that rises at t = 0 closes its switch after the operating point, in which it is open.
#[test]
fn a_gate_that_rises_at_zero_finds_the_operating_point_before_it() {
    let text = "t\nV1 a 0 10\nVg g 0 PULSE(0 1 0 0 0 1 2)\nS1 a b g 0 sw\nR1 b 0 1k\nC1 b 0 1u\n\
                R2 a b 1k\n.model sw SW(Vt=0.5 Ron=1k Roff=1g)\n.tran 1u 1m\n.meas tran v0 find v(b) at=0\n";
    for method in METHODS {
        let run = run_text(text, method);
        let first = value(&run, "v(b)", 0.0);
        assert!((first - 5.0).abs() < 1e-4, "{method:?}: {first}");
        // 500 Ω against 1 kΩ, 1 µF: 20/3 V with 1/3 ms.
        let (right, found) = (
            20.0 / 3.0 - 5.0 / 3.0 * (-3.0_f64).exp(),
            value(&run, "v(b)", 1e-3),
        );
        assert!((found - right).abs() < 1e-3, "{method:?}: {found} {right}");
    }
}

#[test]
fn a_held_voltage_takes_the_current_from_inductors_beside_it() {
    // ngspice 39: i(l1) is 0 at t = 0 and 3.622196 mA at 1 ms.
    for method in METHODS {
        let run = run("ic_across_inductor", method);
        assert_eq!(value(&run, "i(l1)", 0.0), 0.0, "{method:?}");
        let found = value(&run, "i(l1)", 1e-3);
        assert!((found - 3.622196e-3).abs() < 1e-7, "{method:?}: {found}");
    }
    // Of two in series the one at the held node; the other one's current follows from it.
    let text = "t\nV1 a 0 5\nR1 a b 100\nL1 b c 1m\nL2 c 0 1m\nI1 c 0 2\nC1 b 0 1u\n.ic v(b)=0\n.tran 1u 2u\n\
                .save i(l1) i(l2)\n";
    let run = run_text(text, Method::Exact);
    let found = [value(&run, "i(l1)", 0.0), value(&run, "i(l2)", 0.0)];
    assert!(
        found[0].abs() < 1e-12 && (found[1] + 2.0).abs() < 1e-12,
        "{found:?}"
    );
}

#[test]
fn a_latch_starts_as_ic_says() {
    let run = run("latch_ic", Method::Exact);
    assert_eq!(
        [value(&run, "v(q)", 0.0), value(&run, "v(qbar)", 0.0)],
        [0.0, 5.0]
    );
    let column = run
        .waveforms
        .names
        .iter()
        .position(|n| n == "v(q)")
        .expect("v(q)");
    let width = run.waveforms.names.len();
    let mut passages = Vec::new();
    for k in 1..run.waveforms.time.len() {
        let [before, after] = [k - 1, k].map(|k| run.waveforms.values[k * width + column] > 2.5);
        if before != after {
            passages.push(run.waveforms.time[k]);
        }
    }
    // Set by the trigger at a third of 5 V; then 10 kΩ against the open switch charge the capacitor to two thirds.
    let (low, high, share) = (5.0 * 10.0 / 10010.0, 10.0 / 3.0, 1e7 / (1e7 + 1e4_f64));
    let set = 5e-3 + 10e-9 * 2.0 / 3.0;
    let charged = 1e-2 * share * ((5.0 * share - low) / (5.0 * share - high)).ln();
    assert!((passages[0] - set).abs() < 1e-9, "{passages:?}");
    assert!(
        (passages[1] - passages[0] - charged).abs() < 1e-8,
        "{passages:?} {charged}"
    );
}

/// Two cross-coupled comparators at rest are in the state that is prescribed, by `.ic` or `.nodeset`, and stay in it.
#[test]
fn of_two_states_at_rest_the_prescribed_one_is_taken() {
    for card in [".ic", ".nodeset"] {
        for (q, other) in [(0.0, 5.0), (5.0, 0.0)] {
            let text = format!(
                "t\nE3 p 0 VALUE={{V(o) > 2.5 ? 0 : 5}}\n\
                 E4 o 0 VALUE={{V(p) > 2.5 ? 0 : 5}}\n{card} v(p)={q} v(o)={other}\nR1 p c 1k\nC1 c 0 1n\n.tran 1u 10u\n"
            );
            for method in METHODS {
                let run = run_text(&text, method);
                for t in [0.0, 1e-5] {
                    let found = [value(&run, "v(p)", t), value(&run, "v(o)", t)];
                    assert_eq!(found, [q, other], "{card} {method:?} {t}");
                }
            }
        }
    }
}

/// What a source drives it drives, whatever `.ic` says, and a note tells it.
#[test]
fn a_driven_node_keeps_its_voltage() {
    let text = "t\nV1 a 0 5\nR1 a 0 1k\nE1 b 0 a 0 2\nR2 b c 1k\nC1 c 0 1u\n.ic v(b)=0 v(c)=1\n.tran 1u 10u\n";
    let run = run_text(text, Method::Exact);
    assert_eq!(
        [value(&run, "v(b)", 0.0), value(&run, "v(c)", 0.0)],
        [10.0, 1.0]
    );
    assert!(
        run.notes.iter().any(|n| n.text.contains("drives v(b)")),
        "{:?}",
        run.notes
    );
}

/// 2 A and 10 A into 1 kΩ, as ngspice 39 reads them.
/// The saturation current follows from N at another temperature, and is no number where N is 0: that is what is wrong.
#[test]
fn a_diode_of_emission_coefficient_0_is_told_so() {
    let text =
        "t\nv1 a 0 1\nr1 a b 1\nd1 b 0 di\n.model di d(is=1e-14 n=0 rs=1)\n.tran 1u 1m\n.end\n";
    let options = ElaborateOptions {
        diodes: circ::circuit::Diodes::Exp,
        ..ElaborateOptions::default()
    };
    let mut sources = SourceMap::default();
    let root = sources.add("t.cir", text.to_owned());
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (_, findings) = elaborate(&netlist, &options);
    let told: Vec<&str> = findings
        .iter()
        .map(|found| found.message.as_str())
        .collect();
    assert!(told.iter().any(|told| told.ends_with("N is 0")), "{told:?}");
}

#[test]
fn a_is_the_unit_ampere() {
    assert_eq!(value(&run("ampere", Method::Exact), "v(a)", 5e-6), 2e3);
    assert_eq!(
        value(&run("ampere_param", Method::Exact), "v(a)", 5e-6),
        1e4
    );
}

#[test]
fn models_of_levels_with_other_equations_are_refused() {
    let loaded = circ::netlist::load(&crate::path("hicum"), &ElaborateOptions::default());
    let said: Vec<&str> = loaded
        .diagnostics
        .iter()
        .map(|d| d.message.as_str())
        .collect();
    assert!(
        loaded.circuit.is_none() && said[0].contains("level 8 (HICUM)"),
        "{said:?}"
    );
}

#[test]
fn values_altered_before_the_run_count() {
    let run = run("control_alter", Method::Exact);
    assert!((value(&run, "v(b)", 5e-3) - 10.0).abs() < 1e-12);
    // From 1 V in steady state; 2 kΩ and 2 µF; what follows the run, or is undone before it, does not count.
    let text = "t\nV1 a 0 PULSE(1 3 0 0 0 1 2)\nR1 a b 1k\nC1 b 0 1u\nV2 c 0 1\n.control\nalter r1 = 7\nreset\n\
                alter @r1[resistance]=2k\nalter c1 capacitance = 2u\nalter v2 dc 5\ntran 1u 4m\nalter r1 = 1\n.endc\n";
    let run = run_text(text, Method::Exact);
    let right = 3.0 - 2.0 * (-1.0_f64).exp();
    assert!((value(&run, "v(b)", 4e-3) - right).abs() < 1e-9);
    assert_eq!(value(&run, "v(c)", 4e-3), 5.0);
}

/// 1 kΩ are 1.5 kΩ at 77 °C; what cannot be carried out is warned of.
#[test]
fn options_of_a_script_are_those_of_cards() {
    for set in ["option temp=77", "set temp = 77"] {
        let text = format!(
            "t\nV1 a 0 5\nR1 a b 1k tc1=1e-2\nR2 b 0 1k\n.options temp=27\n.control\n{set}\ntran 1u 4u\noption temp=127\n.endc\n"
        );
        let run = run_text(&text, Method::Exact);
        assert!((value(&run, "v(b)", 4e-6) - 2.0).abs() < 1e-12, "{set}");
    }
    let text = "t\nV1 a 0 5\nR1 a 0 1k\n.control\noption rshunt=1k\ntran 1u 4u\n.endc\n.end\n";
    let path = std::path::Path::new("t.cir");
    let read = Ok(text.as_bytes().to_vec());
    let loaded = circ::netlist::load_read(path, read, &ElaborateOptions::default());
    let mut said = loaded.diagnostics.iter().map(|d| d.message.as_str());
    assert!(said.any(|message| message.contains("without `rshunt`")));
}

/// A triangle, as in ngspice 47.
#[test]
fn a_pulse_of_no_width_is_a_triangle() {
    let run = run("pulse_width_0", Method::Exact);
    for (t, right) in [(25e-6, 0.0), (50e-6, 1.0), (75e-6, 0.0), (100e-6, -1.0)] {
        assert!((value(&run, "v(a)", t) - right).abs() < 1e-9, "{t}");
    }
}

#[test]
fn a_print_step_longer_than_the_run_leaves_first_and_last_row() {
    let run = run_text("t\nV1 a 0 5\nR1 a 0 1k\n.tran 1 1u\n", Method::Auto);
    assert_eq!(run.waveforms.time, [0.0, 1e-6]);
}

/// A device never ends, and a pipe waits for its writer: neither is read.
#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo").success());
    let cards = [
        ".include /dev/zero".to_string(),
        ".lib /dev/zero".into(),
        format!(".include {}", pipe.display()),
        "V2 b 0 PWL file=/dev/zero".into(),
    ];
    for card in cards {
        let file = folder.path().join("t.cir");
        std::fs::write(
            &file,
            format!("t\nV1 a 0 1\nR1 a b 1\nR2 b 0 1\n{card}\n.tran 1u 1m\n"),
        )
        .expect("a file");
        let loaded = circ::netlist::load(&file, &ElaborateOptions::default());
        let said = loaded
            .diagnostics
            .iter()
            .any(|d| d.message.contains("not a regular file"));
        assert!(
            said && loaded.circuit.is_none(),
            "{card}: {:?}",
            loaded.diagnostics
        );
    }
    let loaded = circ::netlist::load(&pipe, &ElaborateOptions::default());
    assert_eq!(loaded.diagnostics[0].code, "unreadable");
}

#[test]
fn edges_without_number_are_refused_before_the_run() {
    let text = "t\nV1 a 0 PULSE(0 1 0 0 0 0.5p 1p)\nR1 a 0 1k\n.tran 1m 1000\n";
    let circuit = read(text);
    let equations = behaviour(&circuit).expect("equations");
    for method in METHODS {
        let options = SimOptions {
            method,
            ..SimOptions::default()
        };
        let error = simulate(&circuit, &equations, options).expect_err("1e15 periods");
        assert_eq!(
            (error.t, &error.elements[..]),
            (None, &["v1".to_string()][..])
        );
        assert!(error.to_string().contains("2.0e15 edges"), "{error}");
    }
}

/// What is shown of a line of any length can be read.
#[cfg(feature = "cli")]
#[test]
fn a_long_line_is_shown_around_the_place() {
    let nodes: String = (0..100_000).map(|k| format!("µ{k} ")).collect();
    let mut sources = SourceMap::default();
    let root = sources.add(
        "long.cir",
        format!("t\nV1 a 0 1\nR1 a 0 1\nX1 {nodes} none {nodes}\n.tran 1u 1m\n"),
    );
    let (netlist, _) = parse(&mut sources, root, &|_| Err(ErrorKind::NotFound.into()));
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    assert!(circuit.is_none());
    let cards = netlist.body.statements.iter();
    let mut span = cards.filter_map(|s| match s {
        circ::netlist::ast::Statement::Element(e) => Some(e.span),
        _ => None,
    });
    let whole = circ::diagnostic::Diagnostic::error("long", span.next_back(), "the whole card");
    for findings in [findings, vec![whole]] {
        let text = circ::cli::render(&findings, &sources, false);
        assert!(
            text.len() < 10_000 && text.contains("long.cir:4:"),
            "{} bytes",
            text.len()
        );
    }
}

#[test]
fn products_of_comparisons_are_logic() {
    let truth = |yes: bool| f64::from(u8::from(yes));
    let run = run("behaviour_and", Method::Exact);
    let rows = run.waveforms.time.len();
    assert!(rows > 2000);
    // At t = 0 and at the comparators' own instants either side counts.
    let check = |run: &Run, name: &str, right: &dyn Fn([f64; 3]) -> f64, near: [f64; 3]| {
        for &t in &run.waveforms.time[1..] {
            let inputs = ["v(a)", "v(b)", "v(d)"].map(|name| {
                let there = run.waveforms.names.iter().any(|n| n == name);
                if there { value(run, name, t) } else { 0.0 }
            });
            if inputs
                .iter()
                .zip(near)
                .any(|(v, level)| (v - level).abs() < 1e-3)
            {
                continue;
            }
            let found = value(run, name, t);
            assert!(
                (found - right(inputs)).abs() < 1e-9,
                "{name} at {t}: {found}, {inputs:?}"
            );
        }
    };
    check(
        &run,
        "v(c)",
        &|[a, b, _]| 5.0 * truth(a > 0.5) * truth(b < 0.2),
        [0.5, 0.2, 9.0],
    );
    let sources = "t\nV1 a 0 SIN(0 1 1k)\nV2 b 0 SIN(0 1 3k)\nV3 d 0 SIN(0.1 1 700)\n";
    let run = run_text(
        &format!(
            "{sources}B1 e 0 V=(V(a)>0)*(V(b)>0)*(V(d)>0)*3 - 1\n\
             B2 f 0 V=V(a)>0 ? (V(b)>0 ? 5 : 2) : (V(d)>0 ? 1 : -1)\n.tran 5u 2m\n"
        ),
        Method::Exact,
    );
    let three = |[a, b, d]: [f64; 3]| 3.0 * truth(a > 0.0) * truth(b > 0.0) * truth(d > 0.0) - 1.0;
    check(&run, "v(e)", &three, [0.0; 3]);
    let nested = |[a, b, d]: [f64; 3]| match (a > 0.0, b > 0.0, d > 0.0) {
        (true, true, _) => 5.0,
        (true, false, _) => 2.0,
        (false, _, true) => 1.0,
        _ => -1.0,
    };
    check(&run, "v(f)", &nested, [0.0; 3]);
}

#[test]
fn products_of_known_sines_are_sines() {
    let run = run("product_of_sources", Method::Exact);
    for &t in &run.waveforms.time {
        let right = value(&run, "v(a)", t) * value(&run, "v(b)", t);
        assert!((value(&run, "v(c)", t) - right).abs() < 1e-12, "{t}");
    }
    let text = "t\nV1 a 0 SIN(0 1 1k)\nV3 d 0 SIN(0.5 2 3k 0 0 30)\nV4 0 e SIN(1 1 1k -0.1m)\nV5 q 0 3\n\
                B1 f 0 V=(V(a)+2*V(d)+1)*(V(d)-V(e))\nB2 g 0 V=V(q)*V(a)*V(a)*V(d)\n.tran 1u 0.2m\n";
    let run = run_text(text, Method::Exact);
    for &t in &run.waveforms.time {
        let [a, d, e] = ["v(a)", "v(d)", "v(e)"].map(|name| value(&run, name, t));
        let found = [value(&run, "v(f)", t), value(&run, "v(g)", t)];
        let right = [(a + 2.0 * d + 1.0) * (d - e), 3.0 * a * a * d];
        assert!(
            (found[0] - right[0]).abs() + (found[1] - right[1]).abs() < 1e-11,
            "{t}: {found:?} {right:?}"
        );
    }
}

/// Every failure of a run names its place, its cause and what to do; the whole message is the snapshot.
#[cfg(feature = "cli")]
#[test]
fn a_run_that_fails_says_where_and_why_and_what_to_do() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/findings/failing");
    let entries = std::fs::read_dir(folder).expect("the folder");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    assert!(files.len() >= 10);
    for file in files {
        let name = file
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let text = std::fs::read_to_string(&file).expect("a netlist");
        let mut sources = SourceMap::default();
        let root = sources.add(format!("{name}.cir"), text);
        let (netlist, _) = parse(&mut sources, root, &|_| Err(ErrorKind::NotFound.into()));
        let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
        let circuit = circuit.unwrap_or_else(|| panic!("{name}: {findings:?}"));
        let equations = behaviour(&circuit).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        let error = simulate(&circuit, &equations, SimOptions::default()).expect_err(&name);
        let finding = error.diagnostic(&circuit);
        let text = circ::cli::render(&[finding], &sources, false);
        let text: Vec<&str> = text.lines().map(str::trim_end).collect();
        insta::with_settings!({ snapshot_path => "../snapshots/failing", prepend_module_to_snapshot => false }, {
            insta::assert_snapshot!(name.as_str(), text.join("\n"));
        });
    }
}
