//! The exact integrator on whole circuits: where it gives way to steps, sliding, accumulation.
#![allow(missing_docs, reason = "tests")]

mod buck;
mod events;
mod handover;
mod relays;
#[path = "../runs/mod.rs"]
mod runs;

use circ::circuit::{Circuit, ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Error, Run, SimOptions, simulate};
use circ::mna::behaviour;

/// The circuit of a netlist without title.
fn circuit(text: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| unreachable!());
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

fn try_run(text: &str, options: SimOptions<'_>) -> Result<Run, Error> {
    let circuit = circuit(text);
    let behaviour = behaviour(&circuit).expect("a sound circuit");
    simulate(&circuit, &behaviour, options)
}
