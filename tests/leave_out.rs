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
