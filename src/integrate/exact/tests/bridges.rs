//! Rectifiers.

use super::{at, simulate, times_after_start};

pub(in crate::integrate) const BRIDGE: &str = "C1 1 0 1u IC=10\nL1 1 0 10m IC=0\nDF1 1 2 ideal\nDR1 0 2 ideal\nDR2 3 1 ideal\nDF2 3 0 ideal\n\
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
    for (event, expected) in run.events.iter().zip(switching) {
        let t = event.t;
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
    let times = times_after_start(&run);
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

// From `tests/exact/reference.py`.
const BRIDGE_C_SWITCHING: [f64; 32] = [
    3.084685977148901e-05,
    0.00021376880077046006,
    0.00034500612513046835,
    0.0005279280661294394,
    0.0006591653904894477,
    0.0008420873314884187,
    0.000973324655848427,
    0.001156246596847398,
    0.0012874839212074062,
    0.0014704058622063774,
    0.0016016431865663856,
    0.0017845651275653566,
    0.001915802451925365,
    0.002098724392924336,
    0.0022299617172843443,
    0.0024128836582833152,
    0.0025441209826433235,
    0.0027270429236422944,
    0.002858280248002303,
    0.003041202189001274,
    0.0031724395133612823,
    0.0033553614543602533,
    0.0034865987787202615,
    0.0036695207197192325,
    0.0038007580440792407,
    0.003983679985078212,
    0.00411491730943822,
    0.004297839250437191,
    0.0044290765747972,
    0.0046119985157961705,
    0.004743235840156179,
    0.00492615778115515,
];
const BRIDGE_C_VALUES: [f64; 8] = [
    7.232915925773608,
    5.182610727564596,
    5.4330815738088685,
    8.333094849151687,
    6.879144084924982,
    5.678877319628232,
    6.249380616522618,
    9.229660284921133,
];

#[test]
fn bridge_from_a_source() {
    let run = simulate(
        "V1 1 0 SIN(0 10 {1e4/(2*pi)} 0 0 90)\nDF1 1 2 d\nDR1 0 2 d\nDR2 3 1 d\nDF2 3 0 d\nR1 2 3 1k\nCf 2 3 300n IC=0\n\
         .model d D(Vfwd=0.21 Ron=0 ideal)\n.tran 1u 5m uic\n.save v(2,3)",
    );
    let times = times_after_start(&run);
    assert_eq!(times.len(), BRIDGE_C_SWITCHING.len());
    for (t, expected) in times.iter().zip(BRIDGE_C_SWITCHING) {
        assert!((t - expected).abs() < 1e-15, "{t} {expected}");
    }
    for (t, v) in TIMES.iter().zip(BRIDGE_C_VALUES) {
        assert!(
            (at(&run, *t, "v(2,3)") - v).abs() < 1e-12,
            "{t}: {} {v}",
            at(&run, *t, "v(2,3)")
        );
    }
    assert!((at(&run, 0.0, "v(2,3)") - 9.58).abs() < 1e-13);
}
