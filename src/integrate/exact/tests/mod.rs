//! The stepper against exact values.

use std::sync::Arc;

use nalgebra::DVector;

use super::{Assembler, Exact, Setup};
use crate::circuit::{Circuit, ElaborateOptions, Tran, elaborate};
use crate::diagnostic::SourceMap;
use crate::integrate::Run;
use crate::integrate::error::Error;
use crate::integrate::grid::Grid;
use crate::integrate::log::Log;
use crate::integrate::run::{Frame, run};
use crate::lcs::{Lcs, Position, reduce};
use crate::mna;
use crate::settings::Settings;

pub(in crate::integrate) mod bridges;
mod passive;
mod relays;
mod stiff;
mod switches;
mod travel;

pub(in crate::integrate) fn circuit(text: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, findings) = crate::netlist::parse(&mut sources, root, &|_| unreachable!());
    assert!(
        findings
            .iter()
            .all(|d| d.severity < crate::diagnostic::Severity::Error),
        "{findings:?}"
    );
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

/// A stepper for a netlist that starts from `uic` and whose switches start as their cards say.
pub(in crate::integrate) fn prepare_circuit(circuit: &Circuit, energy: bool) -> (Exact, Lcs, Tran) {
    let tran = circuit.tran.expect("a .tran card");
    let behaviour = mna::behaviour(circuit).expect("a sound circuit").standard();
    let position: Vec<bool> = behaviour
        .switches
        .iter()
        .map(|s| s.initial.unwrap_or(false))
        .collect();
    let start = Position::free(&behaviour, position.clone());
    let lcs = reduce(&behaviour, &start).expect("a system");
    let exact = Exact::new(Setup {
        assembler: Assembler::new(Arc::new(behaviour)),
        position,
        inputs: lcs.inputs.iter().map(|i| i.source.clone()).collect(),
        t: 0.0,
        until: tran.tstop,
        start: DVector::from_column_slice(lcs.storage.initial.as_slice()),
        h: tran.tstep,
        energy,
        free: false,
        settings: Settings::default(),
    })
    .expect("sources with closed forms");
    (exact, lcs, tran)
}

fn try_simulate(text: &str) -> Result<Run, Error> {
    simulate_circuit(&circuit(text))
}

fn simulate_circuit(circuit: &Circuit) -> Result<Run, Error> {
    let (mut exact, lcs, tran) = prepare_circuit(circuit, true);
    let columns = lcs.outputs.names.len();
    let frame = Frame {
        title: String::new(),
        names: lcs.outputs.names.clone(),
        units: lcs.outputs.units.clone(),
        grid: Grid {
            tstart: tran.tstart,
            tstep: tran.tstep,
            tstop: tran.tstop,
        },
        method: "exact".into(),
        plan: vec![],
        notes: vec![],
        progress: None,
    };
    run(&mut exact, frame, Log::new(columns, tran.tstart, false))
}

fn simulate(text: &str) -> Run {
    let run = try_simulate(text).unwrap_or_else(|e| panic!("{e}"));
    assert!(run.energy.residual_relative < 1e-11, "{:?}", run.energy);
    run
}

fn at(run: &Run, t: f64, name: &str) -> f64 {
    let column = run
        .waveforms
        .names
        .iter()
        .position(|n| n == name)
        .expect("a probe");
    let k = run
        .waveforms
        .time
        .iter()
        .position(|&s| (s - t).abs() < 1e-12)
        .expect("an output time");
    run.waveforms.values[k * run.waveforms.names.len() + column]
}

/// Times of the events whose label contains `what`, s.
fn times_of(run: &Run, what: &str) -> Vec<f64> {
    let events = run.events.iter().filter(|e| e.to_string().contains(what));
    events.map(|e| e.t).collect()
}

/// Times of the events after the start, s.
fn times_after_start(run: &Run) -> Vec<f64> {
    run.events
        .iter()
        .map(|e| e.t)
        .filter(|&t| t > 0.0)
        .collect()
}
