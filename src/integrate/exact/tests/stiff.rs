//! Graded stiffness, and contacts that one output step would hide.

use super::{at, simulate, try_simulate};

/// Exponent k, capacitors, voltages after 1 s; from `tests/exact/reference.py`.
const GRADED: [(u32, [&str; 5], [f64; 5]); 4] = [
    (
        6,
        [
            "1.0",
            "0.03162277660168379",
            "0.001",
            "3.162277660168379e-5",
            "1.0e-6",
        ],
        [
            0.805298660971036,
            0.6475065252107914,
            0.4857022822650687,
            0.32380286965847765,
            0.16190145069091655,
        ],
    ),
    (
        9,
        [
            "1.0",
            "0.005623413251903491",
            "3.162277660168379e-5",
            "1.778279410038923e-7",
            "1.0e-9",
        ],
        [
            0.8163678347812925,
            0.6536821564642387,
            0.4902639403002551,
            0.3268426345993559,
            0.16342131731596127,
        ],
    ),
    (
        12,
        ["1.0", "0.001", "1.0e-6", "1.0e-9", "1.0e-12"],
        [
            0.8183113842308656,
            0.6547538598662745,
            0.49106546854510497,
            0.3273769790737032,
            0.16368848953686796,
        ],
    ),
    (
        15,
        [
            "1.0",
            "0.0001778279410038923",
            "3.162277660168379e-8",
            "5.623413251903491e-12",
            "1.0e-15",
        ],
        [
            0.8186562037043066,
            0.6549435974699571,
            0.4912077004323895,
            0.3274718002885052,
            0.1637359001442526,
        ],
    ),
];

#[test]
fn graded_line() {
    for (k, c, v) in GRADED {
        let mut text = String::new();
        for (i, c) in c.iter().enumerate() {
            text += &format!(
                "C{i} {} 0 {} IC={}\nR{i} {} {} 1\n",
                i + 1,
                c,
                if i == 0 { 1 } else { 0 },
                i + 1,
                (i + 2) % 6
            );
        }
        let run = simulate(&format!(
            "{text}.tran 0.01 1 uic\n.save v(1) v(2) v(3) v(4) v(5)"
        ));
        for (i, v) in v.iter().enumerate() {
            let found = at(&run, 1.0, &format!("v({})", i + 1));
            assert!((found - v).abs() < 1e-10, "1e{k}: {found} {v}");
        }
        assert_eq!(
            (run.stats.lcp_solves, run.stats.events),
            (0, 0),
            "a linear circuit needs no complementarity problem"
        );
    }
}

/// Tuned to touch: L-C swings u(t) = a (1 − cos t) against a diode to a source at 2 a − δ.
#[test]
fn grazing_contacts_within_one_output_step() {
    // v swings between 0 and 2 with period 2π; the diode to 2 − δ conducts only near the crest. The output step of 5 s sees
    // neither the crest nor the dip before it.
    for (delta, events) in [(-1e-6_f64, 0), (1e-6, 2)] {
        let text = format!(
            "V1 1 0 1\nL1 1 2 1 IC=0\nC1 2 0 1 IC=0\nD1 2 3 d\nV2 4 0 {}\nR1 3 4 1e6\n.model d D(ideal)\n\
             .tran 5 5 uic\n.save v(2)",
            2.0 - delta
        );
        let run = simulate(&text);
        assert_eq!(run.events.len(), events, "{delta}: {:?}", run.events);
        if events == 2 {
            // 1 − cos t = 2 − δ
            let first = (delta - 1.0).acos();
            assert!(
                (run.events[0].t - first).abs() < 1e-11,
                "{} {first}",
                run.events[0].t
            );
        }
    }
}

/// Rates of 1e21 1/s on an output step of 10 ms: L di/dt = R (I − i) − v with R I = 1 nV, I = 1 mA.
#[test]
fn twenty_decades_within_an_output_step() {
    let run = try_simulate(
        "v1 1 0 pulse(0 1e9 0 1p 1p 0.5 1)\nr1 1 2 1e12\nc1 2 0 1e-15\nd1 2 3 d\nr2 3 0 1u\nl1 3 4 1e3\nc2 4 0 1k\n\
         .model d d(ideal)\n.tran 10m 0.4\n",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let i = at(&run, 0.4, "i(l1)");
    assert!((i / 4e-13 - 1.0).abs() < 1e-6, "{i:e}");
}
