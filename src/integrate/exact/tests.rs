//! The stepper against exact values.

use nalgebra::DVector;

use super::{Exact, Setup};
use crate::circuit::{Circuit, ElaborateOptions, elaborate};
use crate::diagnostic::SourceMap;
use crate::integrate::Run;
use crate::integrate::run::{Frame, Grid, Log, Reason, SimError, run};
use crate::integrate::switching::Threshold;
use crate::lcs::{Hold, Position, StorageHold, reduce};
use crate::mna;
use crate::settings::Settings;

fn circuit(text: &str) -> Circuit {
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

/// Runs a netlist that starts from `uic` and whose switches start as their cards say.
fn try_simulate(text: &str) -> Result<Run, SimError> {
    let circuit = circuit(text);
    let tran = circuit.tran.expect("a .tran card");
    let behaviour = mna::behaviour(&circuit)
        .expect("a sound circuit")
        .standard();
    let thresholds: Vec<Threshold> = behaviour
        .switches
        .iter()
        .map(|s| Threshold {
            name: s.name.clone(),
            on_above: s.on_above,
            off_below: s.off_below,
        })
        .collect();
    let position: Vec<bool> = behaviour
        .switches
        .iter()
        .map(|s| s.initial.unwrap_or(false))
        .collect();
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
    let columns = lcs.outputs.names.len();
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
        worst = worst
            .max((row[0] - v).abs() / 10.0)
            .max((row[1] - i).abs() / 0.1);
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
        4.749127099,
        -4.257226516,
        3.002362663,
        -6.447263215,
        2.208187416,
        0.911038067,
        -2.470584256,
        2.800403336,
    ];
    for (t, v) in TIMES.iter().zip(expected) {
        assert!((at(&run, *t, "v(1)") - v).abs() < 1e-9, "{t}");
    }
    let switching = [
        152.268001,
        466.427266,
        780.979969,
        1095.139234,
        1409.691936,
        1723.851202,
    ];
    for ((t, _), expected) in run.events.iter().zip(switching) {
        assert!((t - expected * 1e-6).abs() < 1e-12, "{t} {expected}");
    }
    assert_eq!(run.events.len(), 16);
}

#[test]
fn bridge_with_capacitor_filter() {
    let run = simulate(&format!(
        "{BRIDGE}Cf 2 3 300n IC=0\n.tran 1u 5m uic\n.save v(1) v(2,3) i(L1)"
    ));
    let v1 = [
        4.096759706,
        -3.171106268,
        1.151156521,
        -4.437266965,
        2.419957461,
        -1.216047855,
        0.541524743,
        -0.190911385,
    ];
    let vf = [
        5.747070623,
        4.117956045,
        3.780465849,
        4.437266965,
        2.465263706,
        1.366750975,
        0.757731606,
        0.420089100,
    ];
    for ((t, v1), vf) in TIMES.iter().zip(v1).zip(vf) {
        assert!(
            (at(&run, *t, "v(1)") - v1).abs() < 1e-9,
            "{t}: {}",
            at(&run, *t, "v(1)")
        );
        assert!((at(&run, *t, "v(2,3)") - vf).abs() < 1e-9, "{t}");
    }
    assert!((at(&run, 1e-3, "i(l1)") + 0.01136058723).abs() < 1e-11);
    assert!((at(&run, 0.0, "v(1)") - 10.0 / 1.3).abs() < 1e-14);
    let switching = [
        32.0421, 211.7642, 357.0594, 536.7816, 682.0768, 861.7989, 1007.0942, 1186.8163,
    ];
    let times: Vec<f64> = run
        .events
        .iter()
        .map(|e| e.0)
        .filter(|&t| t > 0.0)
        .collect();
    for (t, expected) in times.iter().zip(switching) {
        assert!((t - expected * 1e-6).abs() < 1e-10, "{t} {expected}");
    }
    assert_eq!(times.len(), 31);
    let charge = run
        .impulses
        .iter()
        .find(|i| i.name == "i(df1)")
        .expect("an impulse")
        .area;
    assert!((charge - 3e-6 / 1.3).abs() < 1e-18, "{charge:e}");
}

const MAFFEZZONI_SWITCHING: [f64; 10] = [
    12.564487, 30.693306, 49.264901, 68.179976, 87.359148, 106.739990, 126.274023, 145.923954,
    165.661302, 185.464434,
];

/// Maffezzoni's closed-loop switched circuit; the sawtooth falls without an edge time.
fn maffezzoni(models: &str) -> String {
    format!(
        "V4 4 0 20\nS1 4 1 3 2 SWM ON\nD1 0 1 DM\nL1 1 2 200u IC=0\nR1 2 0 1\nV3 3 0 PULSE(7.5 -2.5 0 20u 0 0 20u)\n\
         {models}\n.tran 0.1u 200u uic\n.save i(L1)"
    )
}

#[test]
fn maffezzoni_without_hysteresis() {
    let run = simulate(&maffezzoni(
        ".model SWM SW(Vt=0 Vh=0 Ron=1m Roff=1k)\n.model DM D(Ron=1m Roff=1k Vfwd=0)",
    ));
    let peaks = [
        1.217756661,
        2.153347057,
        2.867549533,
        3.410012002,
        3.820425992,
        4.130004785,
        4.362988328,
        4.538022829,
        4.669348767,
        4.767783032,
    ];
    let ends = [
        1.173271783,
        2.055345254,
        2.717545430,
        3.214130750,
        3.586205968,
        3.864810108,
        4.073322606,
        4.229319604,
        4.345995076,
        4.433242386,
    ];
    let off: Vec<f64> = run
        .events
        .iter()
        .filter(|e| e.1.contains("off"))
        .map(|e| e.0)
        .collect();
    assert_eq!(off.len(), 10, "{:?}", run.events);
    for (k, t) in off.iter().enumerate() {
        assert!((t * 1e6 - MAFFEZZONI_SWITCHING[k]).abs() < 1e-6, "{t}");
        // control: e(t) = R i at the switching time
        let e = 7.5 - 0.5e6 * (t - k as f64 * 20e-6);
        assert!((e - peaks[k]).abs() < 1e-9, "{e}");
        let end = at(&run, (k as f64 + 1.0) * 20e-6, "i(l1)");
        assert!((end - ends[k]).abs() < 1e-9, "{end} {}", ends[k]);
    }
}
#[test]
fn maffezzoni_truly_ideal() {
    let run = simulate(&maffezzoni(
        ".model SWM SW(Vt=0 Vh=0 ideal)\n.model DM D(ideal)",
    ));
    // Between switchings i relaxes to 20 A or to 0 with L/R = 200 µs: an independent scalar iteration.
    let tau = 200e-6;
    let (mut i, mut k) = (0.0_f64, 0);
    let off: Vec<f64> = run
        .events
        .iter()
        .filter(|e| e.1.contains("off"))
        .map(|e| e.0)
        .collect();
    assert_eq!(off.len(), 10, "{:?}", run.events);
    while k < 10 {
        let rise = |s: f64| 20.0 + (i - 20.0) * (-s / tau).exp();
        let (mut low, mut high) = (0.0, 20e-6);
        for _ in 0..100 {
            let mid = 0.5 * (low + high);
            if 7.5 - 0.5e6 * mid > rise(mid) {
                low = mid
            } else {
                high = mid
            }
        }
        assert!(
            (off[k] - (k as f64 * 20e-6 + low)).abs() < 1e-15,
            "{}",
            off[k]
        );
        i = rise(low) * (-(20e-6 - low) / tau).exp();
        k += 1;
        assert!((at(&run, k as f64 * 20e-6, "i(l1)") - i).abs() < 1e-12);
    }
}

#[test]
fn charge_is_shared_through_a_closing_switch() {
    let run = simulate(
        "C1 1 0 1u IC=10\nC2 2 0 0.3u IC=0\nS1 1 2 3 0 sw OFF\nV3 3 0 PULSE(0 1 1u 0 0 1 2)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 1u 2u uic\n.save v(1) v(2)",
    );
    assert_eq!(at(&run, 0.0, "v(2)"), 0.0);
    for t in [1e-6, 2e-6] {
        assert!((at(&run, t, "v(1)") - 10.0 / 1.3).abs() < 1e-14);
        assert!((at(&run, t, "v(2)") - 10.0 / 1.3).abs() < 1e-14);
    }
    // ½ C1 C2/(C1 + C2) V²
    let loss = 0.5 * 1e-6 * 0.3e-6 / 1.3e-6 * 100.0;
    assert!(
        (run.energy.dissipated - loss).abs() < 1e-12 * loss,
        "{:?}",
        run.energy
    );
}

#[test]
fn freewheeling_diode_takes_over() {
    let run = simulate(
        "V1 1 0 5\nS1 1 2 3 0 sw ON\nD1 0 2 d\nL1 2 0 1m IC=2\nV3 3 0 PULSE(1 0 1m 0 0 1 2)\n.model d D(ideal)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 0.5m 3m uic\n.save v(2) i(L1) i(D1)",
    );
    // 2 A + 5 V/1 mH · 1 ms
    for t in [1e-3, 1.5e-3, 3e-3] {
        assert!((at(&run, t, "i(l1)") - 7.0).abs() < 1e-13);
        assert!(at(&run, t, "v(2)").abs() < 1e-14);
        assert!((at(&run, t, "i(d1)") - 7.0).abs() < 1e-13);
    }
    assert!((at(&run, 0.5e-3, "i(l1)") - 4.5).abs() < 1e-13);
}

#[test]
fn flux_is_shared_through_an_opening_switch() {
    let run = simulate(
        "L1 1 0 1m IC=1\nL2 1 0 3m IC=0\nS1 1 0 3 0 sw ON\nV3 3 0 PULSE(1 0 1m 0 0 1 2)\n\
         .model sw SW(Vt=0.5 Vh=0 ideal)\n.tran 1m 2m uic\n.save i(L1) i(L2)",
    );
    assert!((at(&run, 0.0, "i(l1)") - 1.0).abs() < 1e-15);
    for t in [1e-3, 2e-3] {
        assert!(
            (at(&run, t, "i(l1)") - 0.25).abs() < 1e-15,
            "{}",
            at(&run, t, "i(l1)")
        );
        assert!((at(&run, t, "i(l2)") + 0.25).abs() < 1e-15);
    }
}
