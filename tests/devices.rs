//! `A` devices: truth tables, flip-flops, thresholds and what is refused.

use circ::diagnostic::Severity;
use circ::{Error, Method, Model, SimOptions, Waveforms};

fn model(cards: &str) -> Result<Model, Error> {
    Model::parse(&format!("title\n{cards}\n.end\n"), "a.cir")
}

fn run(cards: &str) -> Waveforms {
    let model = model(cards).unwrap_or_else(|e| panic!("{cards}: {:?}", e.findings()));
    let run = model.transient(SimOptions::default());
    run.unwrap_or_else(|e| panic!("{cards}: {e}")).waveforms
}

/// The values of a signal at the middle of each second.
fn halves(waves: &Waveforms, name: &str) -> Vec<f64> {
    let column: Vec<f64> = waves.column(waves.find(name).expect("a column")).collect();
    column
        .iter()
        .skip(1)
        .step_by(2)
        .map(|v| v * 1e9)
        .map(|v| v.round() * 1e-9)
        .collect()
}

/// Levels that last a second each, as a source.
fn levels(name: &str, node: &str, values: &[f64]) -> String {
    let points: Vec<String> = values
        .iter()
        .enumerate()
        .map(|(k, v)| format!("{k} {v} {} {v}", k + 1))
        .collect();
    format!("{name} {node} 0 PWL({})\n", points.join(" "))
}

/// Codes and severities of everything that is said of these cards.
fn said(cards: &str) -> Vec<(&'static str, Severity)> {
    let findings = match &model(cards) {
        Ok(model) => model.findings().to_vec(),
        Err(error) => error.findings().to_vec(),
    };
    let told = findings.iter().filter(|d| d.code != "no-analysis");
    told.map(|d| (d.code, d.severity)).collect()
}

#[test]
fn gates_have_their_truth_tables() {
    type Truth = fn(usize, usize) -> bool;
    let kinds: [(&str, Truth); 3] = [
        ("AND", |count, of| count == of),
        ("OR", |count, _| count > 0),
        ("XOR", |count, _| count == 1),
    ];
    for (kind, truth) in kinds {
        for terminals in [vec![0], vec![1, 3], vec![0, 2, 4], vec![0, 1, 2, 3, 4]] {
            let of = terminals.len();
            let rows = 1_usize << of;
            let (mut cards, mut pins) = (String::new(), ["com"; 5].map(str::to_owned));
            for (k, &terminal) in terminals.iter().enumerate() {
                let bits: Vec<f64> = (0..rows)
                    .map(|row| f64::from((row >> k & 1) as u8))
                    .collect();
                cards += &levels(&format!("v{k}"), &format!("n{k}"), &bits);
                pins[terminal] = format!("n{k}");
            }
            // The common is at −0.2 V, so that an input counts from there.
            let pins = pins.join(" ");
            cards += &format!(
                "vcom com 0 -0.2\na1 {pins} qb q com {kind} Vhigh=5 Vlow=-1 Ref=0.6\n.tran 0.5 {rows}"
            );
            let waves = run(&cards);
            let expected: Vec<bool> = (0..rows)
                .map(|row| truth(row.count_ones() as usize, of))
                .collect();
            let volts = |high: f64, low: f64| -> Vec<f64> {
                let level = |on: &bool| ((if *on { high } else { low }) * 1e9_f64).round() * 1e-9;
                expected.iter().map(level).collect()
            };
            assert_eq!(
                halves(&waves, "v(q)"),
                volts(4.8, -1.2),
                "{kind} {terminals:?}"
            );
            assert_eq!(
                halves(&waves, "v(qb)"),
                volts(-1.2, 4.8),
                "{kind} {terminals:?}"
            );
        }
    }
}

#[test]
fn a_loaded_output_has_its_resistance() {
    let cards = "v1 a 0 3\na1 a 0 0 0 0 0 q 0 BUF Vhigh=4 Rout=300\nr1 q 0 100\n.tran 0.5 1";
    assert_eq!(halves(&run(cards), "v(q)"), [1.0]);
    // Half of Vhigh + Vlow where no Ref stands.
    let cards = "v1 a 0 1.9\na1 a 0 0 0 0 qb 0 0 BUF Vhigh=4\nr1 qb 0 1meg\n.tran 0.5 1";
    assert_eq!(
        halves(&run(cards), "v(qb)"),
        [(4e6_f64 / 1_000_001.0 * 1e9).round() * 1e-9]
    );
}

#[test]
fn flip_flops_remember() {
    let s = [0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0];
    let r = [0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let q = [0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0];
    let cards = levels("vs", "s", &s) + &levels("vr", "r", &r);
    let waves = run(&format!(
        "{cards}a1 s r 0 0 0 qb q 0 SRFLOP\nr1 q 0 1t\n.tran 0.5 9"
    ));
    assert_eq!(halves(&waves, "v(q)"), q);
    assert_eq!(halves(&waves, "v(qb)"), q.map(|x| 1.0 - x));

    let c = [
        0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0,
    ];
    let d = [
        1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0,
    ];
    let p = [
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
    ];
    let l = [
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0,
    ];
    let q = [
        0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0,
    ];
    let cards = levels("vc", "c", &c)
        + &levels("vd", "d", &d)
        + &levels("vp", "p", &p)
        + &levels("vl", "l", &l);
    let waves = run(&format!("{cards}a1 d 0 c p l qb q 0 DFLOP\n.tran 0.5 15"));
    assert_eq!(halves(&waves, "v(q)"), q);
    assert_eq!(halves(&waves, "v(qb)"), q.map(|x| 1.0 - x));
}

#[test]
fn flip_flops_count() {
    let cards = "vc c 0 PULSE(0 1 0.75 0 0 0.5 1)\na1 q1b 0 c 0 0 q1b q1 0 DFLOP\na2 q2b 0 q1b 0 0 q2b q2 0 DFLOP\n\
        a3 q3b 0 q2b 0 0 q3b q3 0 DFLOP\n.tran 0.5 17";
    let waves = run(cards);
    let bits = ["v(q1)", "v(q2)", "v(q3)"].map(|name| halves(&waves, name));
    let counts = bits[0].iter().zip(&bits[1]).zip(&bits[2]);
    let counts: Vec<f64> = counts.map(|((a, b), c)| a + 2.0 * b + 4.0 * c).collect();
    let edges: Vec<f64> = (0..17).map(|second| f64::from(second % 8)).collect();
    assert_eq!(counts, edges);
}

#[test]
fn a_schmitt_trigger_oscillates_with_its_closed_form() {
    // C from 1 V to 3 V and back through R between 0 V and 5 V: RC (ln 4/2 + ln 3/1).
    let cards = "a1 c 0 0 0 0 q 0 0 SCHMITT Vt=2 Vh=1 Vhigh=5 Rout=0\nr1 q c 1k\nc1 c 0 1u IC=0\n.tran 1u 12m uic\n\
        .meas tran t TRIG v(c) VAL=2.9999 RISE=2 TARG v(c) VAL=2.9999 RISE=4";
    let done = circ::analysis::transient(&model(cards).unwrap(), SimOptions::default());
    let found = done.run.unwrap().1.measured;
    let period = 0.5 * found[0].result.as_ref().unwrap().value;
    let exact = 1e-3 * (2.0_f64.ln() + 3.0_f64.ln());
    assert!((period / exact - 1.0).abs() < 1e-6, "{period} {exact}");
}

#[test]
fn between_two_inputs_a_schmitt_trigger_compares() {
    let a = [0.0, 3.0, 2.2, 1.9, 1.7, 2.2, 2.4];
    let cards =
        levels("va", "a", &a) + "vb b 0 2\na1 a b 0 0 0 0 q 0 SCHMITT Vt=0.05 Vh=0.25\n.tran 0.5 7";
    assert_eq!(
        halves(&run(&cards), "v(q)"),
        [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0]
    );
}

/// LTspice's symbols with two inputs, as cards by their names and on a sheet, with both outputs.
#[test]
fn differential_schmitt_triggers_have_both_outputs() {
    let (a, on) = (
        [0.0, 3.0, 2.2, 1.9, 1.7, 2.2, 2.4],
        [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0],
    );
    let off = on.map(|on| 5.0 - 5.0 * on);
    for name in ["DIFFSCHMITT", "diffschmtbuf", "DIFFSCHMTINV", "SCHMITT"] {
        let cards = levels("va", "a", &a)
            + &format!("vb b 0 2\na1 a b 0 0 0 n q 0 {name} Vt=0.05 Vh=0.25 Vhigh=5\n.tran 0.5 7");
        let waves = run(&cards);
        assert_eq!(halves(&waves, "v(q)"), on.map(|on| 5.0 * on), "{name}");
        assert_eq!(halves(&waves, "v(n)"), off, "{name}");
    }
    // Pins of LTspice's symbols: + and − at the left, Q, its inverse, and the common.
    for (symbol, pins) in [
        ("diffschmitt", &["64 48 q", "64 80 n"][..]),
        ("diffschmtbuf", &["64 64 q"]),
        ("diffschmtinv", &["64 64 n"]),
    ] {
        let flags: String = pins.iter().map(|pin| format!("FLAG {pin}\n")).collect();
        let sheet = format!(
            "Version 4\nSHEET 1 880 680\n{flags}FLAG 0 48 a\nFLAG 0 80 b\nFLAG 0 96 0\nSYMBOL Digital\\\\{symbol} 0 0 R0\n\
             SYMATTR InstName A1\nSYMATTR Value Vt=0.05 Vh=0.25 Vhigh=5\nTEXT 0 300 Left 2 !{}\n",
            format!("{}vb b 0 2\n.tran 0.5 7", levels("va", "a", &a)).replace('\n', "\\n")
        );
        let model = circ::Model::parse(&sheet, "a.asc").expect("a sheet");
        let waves = model
            .transient(SimOptions::default())
            .expect("a run")
            .waveforms;
        for pin in pins {
            let (node, truth) = match pin.ends_with('q') {
                true => ("v(q)", on.map(|on| 5.0 * on)),
                false => ("v(n)", off),
            };
            assert_eq!(halves(&waves, node), truth, "{symbol}");
        }
    }
}

#[test]
fn what_is_not_simulated_is_refused() {
    let inputs = "v1 a 0 1\nr1 q 0 1\n";
    for card in [
        "a1 a 0 0 0 0 0 q 0 INV",
        "a1 a 0 0 0 0 0 q 0 COUNTER cycles=3",
        "a1 a 0 0 0 0 0 q 0 SAMPLEHOLD",
        "a1 a 0 0 0 0 0 q 0 FOO",
        "a1 a 0 0 0 0 0 q AND",
        "a1 0 0 0 0 0 0 q 0 AND",
        "a1 a a 0 0 0 0 q 0 BUF",
        "a1 a 0 0 0 0 0 q 0 SCHMITT Vh=1",
        "a1 a 0 a 0 0 0 q 0 SCHMITT Vt=1",
        "a1 a 0 0 0 0 0 q 0 DFLOP",
        "a1 a 0 0 0 0 0 q 0 AND Rhigh=5",
        "a1 a q m\n.model m d_and",
        "a1 a q m\n.model m gain(gain=2 colour=3)",
        "a1 a q m\n.model m limit(gain=2)",
        "a1 a q m\n.model m d_dt(out_lower_limit=0)",
        "a1 [a a] q m\n.model m gain(gain=2)",
        "a1 a q m\n.model m summer",
        "a1 a a q m\n.model m climit",
        "a1 %vnam v1 q m\n.model m gain",
        "a1 %vd a q m\n.model m gain",
    ] {
        let told = said(&format!("{inputs}{card}"));
        assert_eq!(told, [("unsupported-element", Severity::Error)], "{card}");
    }
    assert_eq!(
        said(&format!("{inputs}a1 a q m")),
        [("unknown-model", Severity::Error)]
    );
    assert_eq!(
        said(&format!("{inputs}a1 a [b q")),
        [("missing", Severity::Error)]
    );
    // The product of two that vary.
    let product = said(&format!(
        "{inputs}a1 [a q] p m\n.model m mult\nr2 p 0 1\nr3 a q 1"
    ));
    assert!(
        product.iter().any(|(code, _)| *code == "not-linear") || product.is_empty(),
        "{product:?}"
    );
}

#[test]
fn delays_are_left_out_with_one_warning() {
    let cards = "v1 a 0 1\na1 a 0 0 0 0 b 0 0 BUF Td=10n Trise=1n tripdt=1n\na2 a b 0 0 0 0 q 0 AND Td=5n\n.tran 0.5 1";
    assert_eq!(said(cards), [("device-at-once", Severity::Warning)]);
}

#[test]
fn devices_inside_subcircuits_and_branches() {
    let cards = "v1 a 0 1\nx1 a b twice\nx2 b c twice k=5\n.param inner=3\n.subckt twice i o k={inner}\na1 i m g\na2 m o h\n\
        .model g gain(gain={k})\n.if (inner>2)\n.model h gain(in_offset=1)\n.endif\n.ends\n.tran 0.5 1";
    // 3·1 + 1 = 4, 5·4 + 1 = 21.
    assert_eq!(halves(&run(cards), "v(c)"), [21.0]);
}

#[test]
fn a_converter_is_controlled_by_its_peak_current() {
    let text = include_str!("../netlists/peak-current.cir");
    let model = Model::parse(text, "peak-current.cir").unwrap();
    let done = circ::analysis::transient(&model, SimOptions::default());
    let found = done.run.unwrap().1.measured;
    let top = found[0].result.as_ref().unwrap().value;
    assert!((top - 2.001).abs() < 1e-9, "{top}");
    // v = R (2.001 A − ripple/2) with the ripple (1 − d) T v/L at d = v/24 V: the mean of a triangle of current.
    let mean = found[1].result.as_ref().unwrap().value;
    let ripple = (1.0 - mean / 24.0) * 10e-6 * mean / 22e-6;
    assert!(
        (mean - 6.0 * (2.001 - 0.5 * ripple)).abs() < 1e-2 * mean,
        "{mean}"
    );
}

/// 4 V over 300 and 100 ohms for a second are 40 mJ; what the gate is made of takes none. A flip-flop that drives nothing gives none.
#[test]
fn gates_have_no_power_but_that_of_their_outputs() {
    let gate = "v1 a 0 3\na1 a 0 0 0 0 0 q 0 BUF Vhigh=4 Rout=300\nr1 q 0 100\n";
    let clock =
        "vd d 0 1\nvc c 0 PULSE(0 1 0.25 0 0 0.25 0.5)\na2 d 0 c 0 0 qb q2 0 DFLOP Rout=1k\n";
    for method in [Method::Exact, Method::Theta] {
        for (cards, expected) in [(gate.to_owned(), 0.04), (format!("{gate}{clock}"), 0.04)] {
            let options = SimOptions {
                method,
                ..SimOptions::default()
            };
            let run = model(&format!("{cards}.tran 0.5 1")).expect("a circuit");
            let run = run.transient(options).expect("a run");
            let energy = [run.energy.source, run.energy.dissipated];
            let off = energy.map(|of| (of - expected).abs());
            assert!(off.iter().all(|off| *off < 1e-9), "{method:?}: {energy:?}");
        }
    }
}
