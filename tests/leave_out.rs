//! What a circuit does not need is left out, and the counters show it.
#![allow(missing_docs, reason = "tests")]

use std::path::Path;

use circ::integrate::jump::JumpProblem;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::lcs::{Lcs, Position, reduce};
use circ::mna::behaviour;

fn netlist(name: &str) -> circ::circuit::Circuit {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("netlists")
        .join(name);
    let loaded = circ::netlist::load(&path, &Default::default());
    loaded.circuit.expect("a sound netlist")
}

fn run(name: &str, method: Method) -> Run {
    let circuit = netlist(name);
    let behaviour = behaviour(&circuit).expect("a behaviour");
    let tstep = circuit.tran.expect("a .tran card").tstep;
    let options = SimOptions {
        method,
        step: (method != Method::Auto && method != Method::Exact).then_some(tstep),
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).expect("a run")
}

fn system(name: &str) -> Lcs {
    let behaviour = behaviour(&netlist(name)).expect("a behaviour").standard();
    let position = Position::free(&behaviour, vec![false; behaviour.switches.len()]);
    reduce(&behaviour, &position).expect("a system")
}

fn says(run: &Run, words: &str) -> bool {
    run.plan.iter().any(|line| line.contains(words))
}

#[test]
fn a_linear_circuit_builds_no_complementarity_problem() {
    for method in [Method::Auto, Method::Euler, Method::Theta] {
        let linear = run("rlc.cir", method);
        assert!(
            says(&linear, "no complementarity problem"),
            "{:?}",
            linear.plan
        );
        let stats = &linear.stats;
        let counted = (stats.lcp_solves, stats.pivotings, stats.events, stats.modes);
        assert_eq!(counted, (0, 0, 0, 1), "{method:?}");
        // The same counters move as soon as there is a diode.
        let diode = run("rlcd.cir", method);
        assert!(!says(&diode, "no complementarity problem"));
        assert!(
            diode.stats.lcp_solves > 0 && diode.stats.modes > 1,
            "{method:?}"
        );
    }
}

#[test]
fn definite_feedthrough_needs_no_jump_logic() {
    for (name, needed) in [
        ("rlcd.cir", false),
        ("bridge-resistor.cir", false),
        ("jump-clamp.cir", true),
        ("bridge-capacitor-filter.cir", true),
    ] {
        assert_eq!(
            JumpProblem::new(&system(name), 1e-9).is_some(),
            needed,
            "{name}"
        );
    }
    let filter = run("bridge-capacitor-filter.cir", Method::Auto);
    assert!(!says(&filter, "no jump logic") && filter.stats.jumps > 0);
    let rectifier = run("rlcd.cir", Method::Auto);
    assert!(says(&rectifier, "no jump logic") && rectifier.stats.jumps == 0);
}

/// Over all positions: a chopper of switches alone builds no complementarity system in either of its two, a converter one in each, a
/// feedback circuit with capacitors behind its diodes jump logic too.
#[test]
fn what_is_built_is_counted_over_all_positions() {
    let of = |run: &Run| {
        let stats = &run.stats;
        (stats.positions, stats.systems, stats.impulsive)
    };
    for method in [Method::Exact, Method::Theta] {
        let text = "chopper\nv1 in 0 10\ns1 in out g 0 sw\nr1 out 0 1\nl1 out x 1m\nr2 x 0 2\nvg g 0 pulse(0 1 0 1n 1n 5u 10u)\n\
                    .model sw sw(vt=0.5 vh=0 ron=1m roff=1meg)\n.tran 1u 100u\n.end\n";
        let model = circ::Model::parse(text, "chopper").expect("a sound netlist");
        let step = (method == Method::Theta).then_some(1e-6);
        let options = SimOptions {
            method,
            step,
            ..SimOptions::default()
        };
        let chopper = model.transient(options).expect("a run");
        assert_eq!(of(&chopper), (2, 0, 0), "{method:?}");
        assert_eq!(of(&run("boost.cir", method)), (2, 2, 0), "{method:?}");
        assert_eq!(
            of(&run("bridge-capacitor-filter.cir", method)),
            (1, 1, 1),
            "{method:?}"
        );
    }
}

#[test]
fn what_nobody_reads_is_not_reconstructed() {
    let circuit = netlist("three-phase-rectifier.cir");
    let saved = system("three-phase-rectifier.cir");
    assert_eq!(saved.outputs.names.len(), 4);
    assert_eq!(saved.outputs.rows.x.nrows(), 4);
    let mut all = circuit.clone();
    all.probes.clear();
    let behaviour = behaviour(&all).expect("a behaviour").standard();
    let every = reduce(&behaviour, &Position::free(&behaviour, vec![])).expect("a system");
    assert!(every.outputs.names.len() > 10, "{:?}", every.outputs.names);
}

#[test]
fn modes_are_assembled_when_they_are_visited() {
    // Six diodes have 64 sets; a rectifier visits few of them.
    let rectifier = run("three-phase-rectifier.cir", Method::Exact);
    assert!(rectifier.stats.events > 30);
    assert!(rectifier.stats.modes < 32, "{}", rectifier.stats.modes);
}

/// A netlist in which elements of these names have other cards, or which has them besides; what is recorded, if not what the netlist says.
fn changed(name: &str, cards: &[(&str, &str)], probes: &[&str], method: Method) -> Run {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists");
    let text = std::fs::read_to_string(path.join(name)).expect("a netlist");
    let mut lines: Vec<&str> = text.lines().collect();
    for (name, card) in cards {
        let of = |line: &&str| line.split_whitespace().next() == Some(name);
        match lines.iter().position(of) {
            Some(at) => lines[at] = card,
            None => lines.insert(lines.len() - 1, card),
        }
    }
    let model = circ::Model::parse(&(lines.join("\n") + "\n"), name).expect("a sound netlist");
    let probes: Vec<String> = probes.iter().map(ToString::to_string).collect();
    let model = model.asked(None, &probes).expect("signals");
    let tstep = model.circuit().tran.expect("a .tran card").tstep;
    let options = SimOptions {
        method,
        step: (method == Method::Theta).then_some(tstep),
        unestimated: true,
        ..SimOptions::default()
    };
    model.transient(options).expect("a run")
}

/// The largest difference of a signal that both have, relative to its largest value; all rows are those of both.
fn apart(one: &Run, other: &Run) -> f64 {
    let (a, b) = (&one.waveforms, &other.waveforms);
    assert_eq!(a.time, b.time);
    let column = |run: &Run, name: &str| -> Option<Vec<f64>> {
        let w = &run.waveforms;
        let at = w.names.iter().position(|n| n == name)?;
        let rows = w.values.chunks(w.names.len());
        Some(rows.map(|row| row[at]).collect())
    };
    let both = a.names.iter().filter_map(|name| {
        let (x, y) = (column(one, name)?, column(other, name)?);
        let size = x.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        let far = x.iter().zip(&y).map(|(x, y)| (x - y).abs());
        Some(far.fold(0.0, f64::max) / size)
    });
    let found: Vec<f64> = both.collect();
    assert!(!found.is_empty(), "no signal of both");
    found.into_iter().fold(0.0, f64::max)
}

const NEVER: &str = "dx 2 3 clamp\n.model clamp d(vfwd=100 ron=10m)";

/// Both have the same answer; a complementarity problem costs one solve in the mode, or one a step, and guards that steps look out for.
#[test]
fn a_diode_that_never_conducts_is_what_a_linear_circuit_is_spared() {
    for (method, tolerance) in [(Method::Exact, 1e-12), (Method::Theta, 1e-8)] {
        let linear = changed("rlc.cir", &[], &[], method);
        let diode = changed("rlc.cir", &[("dx", NEVER)], &[], method);
        let of = |run: &Run| (run.stats.systems, run.stats.impulsive, run.stats.modes);
        assert_eq!((of(&linear), of(&diode)), ((0, 0, 1), (1, 0, 1)));
        assert_eq!(linear.stats.lcp_solves, 0);
        let (few, many) = (linear.stats.steps, diode.stats.steps);
        match method {
            Method::Exact => assert!(diode.stats.lcp_solves == 1 && many > 2 * few),
            _ => assert_eq!((diode.stats.lcp_solves, many), (many, few)),
        }
        assert!(apart(&linear, &diode) < tolerance, "{method:?}");
    }
}

/// The same diode with a resistance and without: one system each, jump logic in one of them, and the same answer.
#[test]
fn a_resistance_in_the_loop_of_a_diode_leaves_out_jump_logic() {
    let cases = [
        ("rlc.cir", "dx 2 3 clamp", (1, 0), (1, 1)),
        ("bridge-resistor.cir", "dx 0 1 clamp", (1, 0), (1, 1)),
        ("buck.cir", "dx 0 out clamp", (2, 0), (2, 2)),
    ];
    for (name, diode, without, with) in cases {
        let ideal = format!("{diode}\n.model clamp d(vfwd=100 ron=0)");
        let resistive = format!("{diode}\n.model clamp d(vfwd=100 ron=10m)");
        let of = |card: &str| changed(name, &[("dx", card)], &[], Method::Exact);
        let (resistive, ideal) = (of(&resistive), of(&ideal));
        let built = |run: &Run| (run.stats.systems, run.stats.impulsive);
        assert_eq!(
            (built(&resistive), built(&ideal)),
            (without, with),
            "{name}"
        );
        assert_eq!((resistive.stats.jumps, ideal.stats.jumps), (0, 0), "{name}");
        assert_eq!(resistive.stats.steps, ideal.stats.steps, "{name}");
        assert!(apart(&resistive, &ideal) < 1e-12, "{name}");
    }
}

/// Switches in place of the diode, and a load that does not interrupt the current: no position has a complementarity problem.
#[test]
fn converters_of_switches_alone_are_spared_a_complementarity_problem() {
    let low = "s2 sw 0 0 gate low\n.model low sw(vt=-0.5 vh=0 ron=5m roff=10meg)";
    let clocked = [
        ("d1", low),
        ("rload", "rload out 0 5"),
        (".tran", ".tran 1u 200u uic"),
    ];
    let low = "S2 0 sw 0 g low\n.model low SW(ideal Vt=-5)";
    let feedback = [("D1", low), (".tran", ".tran 0.1u 200u uic")];
    let body = ("d2", "d2 0 sw body\n.model body d(vfwd=100 ron=10m)");
    for (name, cards) in [
        ("buck-open-loop.cir", &clocked[..]),
        ("peak-current.cir", &feedback[..]),
    ] {
        for method in [Method::Exact, Method::Theta] {
            let alone = changed(name, cards, &[], method);
            let beside = changed(name, &[cards, &[body]].concat(), &[], method);
            let of = |run: &Run| (run.stats.systems, run.stats.lcp_solves);
            assert_eq!(of(&alone), (0, 0), "{name}, {method:?}");
            let (systems, solves) = of(&beside);
            assert!(
                systems >= 2 && solves > 0,
                "{name}, {method:?}: {systems}, {solves}"
            );
            assert!(
                method == Method::Exact || solves >= beside.stats.steps,
                "{name}"
            );
            assert_eq!(
                alone.stats.events, beside.stats.events,
                "{name}, {method:?}"
            );
            assert!(apart(&alone, &beside) < 1e-9, "{name}, {method:?}");
        }
    }
}

/// A source that controls switches alone is in no flow as long as nobody reads it: its corners are no steps.
#[test]
fn a_source_that_nobody_reads_is_not_followed() {
    let short = (".tran", ".tran 1u 200u uic");
    let gate = |probes: &[&str]| changed("buck-open-loop.cir", &[short], probes, Method::Exact);
    let (unread, read) = (gate(&["v(out)"]), gate(&["v(out)", "v(gate)"]));
    assert_eq!(unread.stats.events, read.stats.events);
    // Twenty periods; of the four corners of each at least two are at no row.
    let (few, many) = (unread.stats.steps, read.stats.steps);
    assert!(many >= few + 40, "{few}, {many}");
    assert!(apart(&unread, &read) < 1e-9);

    let pulse = ("vx", "vx x 0 pulse(0 1 0 10n 10n 3.99u 10u)");
    let linear = |probes: &[&str]| changed("rlc.cir", &[pulse], probes, Method::Exact);
    let (unread, read) = (linear(&["v(3)"]), linear(&["v(3)", "v(x)"]));
    assert_eq!(
        unread.stats.steps,
        changed("rlc.cir", &[], &[], Method::Exact).stats.steps
    );
    assert!(read.stats.steps >= unread.stats.steps + 3900);
    assert!(apart(&unread, &read) < 1e-12);
}

/// The next edge of a clock is known, and what it leads to: no problem is solved there. A control that feels the output by a part in 10⁹ asks at each edge.
#[test]
fn a_clock_is_spared_the_question_where_it_leads() {
    let at_once = ("vg", "vg gate 0 pulse(0 1 0 0 0 4u 10u)");
    let short = (".tran", ".tran 1u 500u uic");
    let felt = (
        "s1",
        "eg g 0 vol = {v(gate)+1e-9*v(out)}\ns1 in sw g 0 gated",
    );
    let of = |cards: &[(&str, &str)]| changed("buck-open-loop.cir", cards, &[], Method::Exact);
    let (clock, asked) = (of(&[at_once, short]), of(&[at_once, short, felt]));
    assert_eq!(clock.stats.events, asked.stats.events);
    let solves = (clock.stats.lcp_solves, asked.stats.lcp_solves);
    assert!(solves.0 < 20 && solves.1 > 100, "{solves:?}");
    assert!(apart(&clock, &asked) < 1e-9);
}

/// Without the runs beside it the error is not known, and nothing else is different.
#[test]
fn steps_that_nobody_asks_for_their_error_make_no_runs_beside() {
    let of = |unestimated| {
        let options = SimOptions {
            method: Method::Theta,
            unestimated,
            ..SimOptions::default()
        };
        let circuit = netlist("bridge-resistor.cir");
        let behaviour = behaviour(&circuit).expect("a behaviour");
        simulate(&circuit, &behaviour, options).expect("a run")
    };
    let (alone, beside) = (of(true), of(false));
    assert!(alone.error.max.is_none() && beside.error.max.is_some());
    assert_eq!(alone.stats.steps, beside.stats.steps);
    assert_eq!(apart(&alone, &beside), 0.0);
}

/// A feedback circuit with seven switches and a diode: exact runs solve where something changes, steps in every step.
#[test]
fn exact_runs_solve_where_something_changes() {
    let short = (".tran", ".tran 0.1u 200u uic");
    let of = |method| changed("peak-current.cir", &[short], &[], method);
    let (exact, steps) = (of(Method::Exact), of(Method::Theta));
    assert!(
        exact.stats.events > 80 && exact.stats.modes <= 8,
        "{:?}",
        exact.stats
    );
    assert!(exact.stats.lcp_solves < 20, "{}", exact.stats.lcp_solves);
    assert!(steps.stats.lcp_solves >= 2000, "{}", steps.stats.lcp_solves);
}
