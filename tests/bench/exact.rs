//! The exact integrator: milliseconds per run, nanoseconds per output point, set-up of the modes included.
//!
//! `cargo bench --bench exact` prints one line per circuit: median thread time of nine runs.
#![allow(clippy::print_stdout, missing_docs, reason = "a bench prints")]

use std::sync::Arc;

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::exact::{Assembler, Exact, Setup};
use circ::integrate::stats::Stats;
use circ::integrate::{Grid, Log, Stepper};
use circ::lcs::{Position, reduce};
use circ::mna;
use circ::settings::Settings;
use cpu_time::ThreadTime;
use nalgebra::DVector;

/// That of the command.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const BRIDGE: &str = "C1 1 0 1u IC=10\nL1 1 0 10m IC=0\nDF1 1 2 d\nDR1 0 2 d\nDR2 3 1 d\nDF2 3 0 d\nR1 2 3 1k\n.model d D(ideal)\n";
const RECTIFIER: &str = "V1 a 0 SIN(0 325 50)\nV2 b 0 SIN(0 325 50 0 0 -120)\nV3 c 0 SIN(0 325 50 0 0 120)\n\
    L1 a a1 1m\nL2 b b1 1m\nL3 c c1 1m\nR1 a1 a2 0.1\nR2 b1 b2 0.1\nR3 c1 c2 0.1\n\
    D1 a2 p d\nD2 b2 p d\nD3 c2 p d\nD4 n a2 d\nD5 n b2 d\nD6 n c2 d\nC1 p n 1m IC=500\nR4 p n 20\n.model d D(ideal)\n";
const BUCK: &str = "V1 1 0 24\nS1 1 2 g 0 sw\nD1 0 2 d\nL1 2 3 100u\nC1 3 0 100u\nR1 3 0 5\nVg g 0 PULSE(0 1 0 0 0 5u 10u)\n\
    .model d D(ideal)\n.model sw SW(ideal Vt=0.5 Vh=0)\n";

fn run(text: &str, energy: bool) -> (f64, f64, Stats, usize) {
    let mut sources = SourceMap::default();
    let root = sources.add("bench.cir", format!("bench\n{text}\n.end\n"));
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}"));
    let tran = circuit.tran.expect("a .tran card");
    let behaviour = mna::behaviour(&circuit)
        .expect("a sound circuit")
        .standard();
    let position = vec![false; behaviour.switches.len()];
    let lcs = reduce(&behaviour, &Position::free(&behaviour, position.clone())).expect("a system");
    let begin = ThreadTime::now();
    let mut exact = Exact::new(Setup {
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
    .expect("a system");
    let columns = lcs.outputs.names.len();
    let mut log = Log::new(columns, 0.0, false);
    let mut row = vec![0.0; columns];
    let grid = Grid {
        tstart: 0.0,
        tstep: tran.tstep,
        tstop: tran.tstop,
    };
    let mut first = 0.0;
    for k in 0..grid.len() {
        exact.advance(grid.time(k), &mut log).expect("a run");
        exact.read(&mut row);
        if k == 0 {
            first = begin.elapsed().as_secs_f64();
        }
    }
    let total = begin.elapsed().as_secs_f64();
    (total, first, exact.finish().stats, grid.len())
}

fn main() {
    for (name, text) in [
        (
            "bridge, 1 us",
            format!("{BRIDGE}.tran 1u 5m uic\n.save v(1) i(L1) v(2,3)"),
        ),
        (
            "bridge, 50 us",
            format!("{BRIDGE}.tran 50u 5m uic\n.save v(1) i(L1) v(2,3)"),
        ),
        (
            "bridge and filter, 1 us",
            format!("{BRIDGE}Cf 2 3 300n\n.tran 1u 5m uic\n.save v(1) i(L1) v(2,3)"),
        ),
        (
            "buck, 0.5 us",
            format!("{BUCK}.tran 0.5u 10m uic\n.save v(3) i(L1)"),
        ),
        (
            "buck, 5 us",
            format!("{BUCK}.tran 5u 10m uic\n.save v(3) i(L1)"),
        ),
        (
            "three-phase, 10 us",
            format!("{RECTIFIER}.tran 10u 60m uic\n.save v(p,n) i(L1)"),
        ),
    ] {
        for energy in [false, true] {
            let mut times: Vec<_> = (0..9).map(|_| run(&text, energy)).collect();
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (total, first, stats, points) = &times[4];
            println!(
                "{name:24} energy {energy:5}: {:.3} ms (start {:.3}), {points} points, {:.0} ns/point, {} events, {} modes",
                1e3 * total,
                1e3 * first,
                1e9 * (total - first) / *points as f64,
                stats.events,
                stats.modes
            );
        }
    }
}
