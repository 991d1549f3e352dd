//! The stepper against exact values.

use nalgebra::DVector;

use super::{Exact, Setup};
use crate::circuit::{Circuit, ElaborateOptions, elaborate};
use crate::diagnostic::SourceMap;
use crate::integrate::run::{Frame, Grid, Log, Reason, SimError, run};
use crate::integrate::switching::Threshold;
use crate::integrate::Run;
use crate::lcs::{Hold, Position, StorageHold, reduce};
use crate::mna;
use crate::settings::Settings;

fn circuit(text: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("test\n{text}\n.end\n"));
    let (netlist, findings) = crate::netlist::parse(&mut sources, root, &|_| unreachable!());
    assert!(findings.iter().all(|d| d.severity < crate::diagnostic::Severity::Error), "{findings:?}");
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

/// Runs a netlist that starts from `uic` and whose switches start as their cards say.
fn try_simulate(text: &str) -> Result<Run, SimError> {
    let circuit = circuit(text);
    let tran = circuit.tran.expect("a .tran card");
    let behaviour = mna::behaviour(&circuit).expect("a sound circuit").standard();
    let thresholds: Vec<Threshold> = behaviour
        .switches
        .iter()
        .map(|s| Threshold { name: s.name.clone(), on_above: s.on_above, off_below: s.off_below })
        .collect();
    let position: Vec<bool> = behaviour.switches.iter().map(|s| s.initial.unwrap_or(false)).collect();
    let pairs = behaviour.pairs.len();
    let mut assemble = move |devices: &[Hold], switches: &[bool]| {
        let position = Position {
            devices: devices.to_vec(),
            switches: switches.to_vec(),
            storage: StorageHold::Dynamic,
        };
        reduce(&behaviour, &position).map_err(|e| SimError::before(Reason::Circuit(e.to_string())))
    };
    let lcs = assemble(&vec![Hold::Free; pairs], &position).expect("a system");
    let mut exact = Exact::new(Setup {
        assemble: Box::new(assemble),
        pairs,
        position,
        thresholds,
        t: 0.0,
        until: tran.tstop,
        start: DVector::from_column_slice(lcs.storage.initial.as_slice()),
        h: tran.tstep,
        energy: true,
        settings: Settings::default(),
    })?;
    let frame = Frame {
        title: String::new(),
        names: lcs.outputs.names.clone(),
        units: lcs.outputs.units.clone(),
        grid: Grid { tstart: tran.tstart, tstep: tran.tstep, tstop: tran.tstop },
        method: "exact".into(),
        plan: vec![],
        notes: vec![],
        progress: None,
    };
    let columns = lcs.outputs.names.len();
    run(&mut exact, frame, Log::new(columns, tran.tstart, false))
}

fn simulate(text: &str) -> Run {
    try_simulate(text).unwrap_or_else(|e| panic!("{e}"))
}

fn at(run: &Run, t: f64, name: &str) -> f64 {
    let column = run.waveforms.names.iter().position(|n| n == name).expect("a probe");
    let k = run.waveforms.time.iter().position(|&s| (s - t).abs() < 1e-12).expect("an output time");
    run.waveforms.values[k * run.waveforms.names.len() + column]
}

const BRIDGE: &str = "C1 1 0 1u IC=10\nL1 1 0 10m IC=0\nDF1 1 2 ideal\nDR1 0 2 ideal\nDR2 3 1 ideal\nDF2 3 0 ideal\n\
    R1 2 3 1k\n.model ideal D(ideal)\n";

const TIMES: [f64; 8] = [0.1e-3, 0.2e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3];

#[test]
fn bridge_with_resistor_is_a_parallel_rlc() {
    let run = simulate(&format!("{BRIDGE}.tran 1u 5m uic\n.save v(1) i(L1) v(2,3)"));
    let (r, l, c) = (1e3, 1e-2, 1e-6);
    let alpha: f64 = 1.0 / (2.0 * r * c);
    let omega = (1.0 / (l * c) - alpha * alpha).sqrt();
    let mut worst = 0.0_f64;
    for (k, &t) in run.waveforms.time.iter().enumerate() {
        let e = (-alpha * t).exp();
        let v = 10.0 * e * ((omega * t).cos() - alpha / omega * (omega * t).sin());
        let i = 10.0 * e * (omega * t).sin() / (l * omega);
        let row = &run.waveforms.values[3 * k..3 * k + 3];
        worst = worst.max((row[0] - v).abs() / 10.0).max((row[1] - i).abs() / 0.1);
        worst = worst.max((row[2] - v.abs()).abs() / 10.0);
    }
    assert!(worst < 1e-12, "{worst:e}");
    assert_eq!(run.stats.events, 16);
    assert!((at(&run, 5e-3, "v(1)") - 0.790322820).abs() < 1e-9);
}

#[test]
fn half_wave() {
    let run = simulate(
        "C1 1 0 1u IC=10\nL1 1 0 10m IC=0\nR1 1 2 1k\nD1 2 0 ideal\n.model ideal D(ideal)\n\
         .tran 1u 5m uic\n.save v(1)",
    );
    let expected = [
        4.749127099, -4.257226516, 3.002362663, -6.447263215, 2.208187416, 0.911038067, -2.470584256, 2.800403336,
    ];
    for (t, v) in TIMES.iter().zip(expected) {
        assert!((at(&run, *t, "v(1)") - v).abs() < 1e-9, "{t}");
    }
    let switching = [152.268001, 466.427266, 780.979969, 1095.139234, 1409.691936, 1723.851202];
    for ((t, _), expected) in run.events.iter().zip(switching) {
        assert!((t - expected * 1e-6).abs() < 1e-12, "{t} {expected}");
    }
    assert_eq!(run.events.len(), 16);
}

#[test]
fn bridge_with_capacitor_filter() {
    let run = simulate(&format!("{BRIDGE}Cf 2 3 300n IC=0\n.tran 1u 5m uic\n.save v(1) v(2,3) i(L1)"));
    let v1 = [
        4.096759706, -3.171106268, 1.151156521, -4.437266965, 2.419957461, -1.216047855, 0.541524743, -0.190911385,
    ];
    let vf = [
        5.747070623, 4.117956045, 3.780465849, 4.437266965, 2.465263706, 1.366750975, 0.757731606, 0.420089100,
    ];
    for ((t, v1), vf) in TIMES.iter().zip(v1).zip(vf) {
        assert!((at(&run, *t, "v(1)") - v1).abs() < 1e-9, "{t}: {}", at(&run, *t, "v(1)"));
        assert!((at(&run, *t, "v(2,3)") - vf).abs() < 1e-9, "{t}");
    }
    assert!((at(&run, 1e-3, "i(l1)") + 0.01136058723).abs() < 1e-11);
    assert!((at(&run, 0.0, "v(1)") - 10.0 / 1.3).abs() < 1e-14);
    let switching = [32.0421, 211.7642, 357.0594, 536.7816, 682.0768, 861.7989, 1007.0942, 1186.8163];
    let times: Vec<f64> = run.events.iter().map(|e| e.0).filter(|&t| t > 0.0).collect();
    for (t, expected) in times.iter().zip(switching) {
        assert!((t - expected * 1e-6).abs() < 1e-10, "{t} {expected}");
    }
    assert_eq!(times.len(), 31);
    let charge = run.impulses.iter().find(|i| i.name == "i(df1)").expect("an impulse").area;
    assert!((charge - 3e-6 / 1.3).abs() < 1e-18, "{charge:e}");
}
