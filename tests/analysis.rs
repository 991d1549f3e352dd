//! Analyses as calls of the library.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests"
)]

use circ::analysis::{Finished, dc, each, transient, variants};
use circ::{Method, Model, SimOptions};

fn model(cards: &str) -> Model {
    Model::parse(&format!("test\n{cards}.end\n"), "test.cir").unwrap()
}

/// Two nested sweeps of a resistor and a diode of 0.5 V and 2 Ω: i = max(0, (v − 0.5)/(r + 2)).
#[test]
fn a_characteristic_has_a_row_for_every_pair_of_values() {
    let model = model(
        "v1 a 0 0\nr1 a b 1\nd1 b 0 d\n.model d d(vfwd=0.5 ron=2 roff=1e30)\n\
         .dc v1 -1 3 1 r1 1 3 2\n.save i(v1)\n.print dc v(b)\n.print tran v(a)\n",
    );
    let found = dc(&model).unwrap();
    assert_eq!(found.names, ["v1", "r1", "i(v1)", "v(b)"]);
    assert_eq!(found.rows.len(), 10);
    for row in &found.rows {
        let [v, r, i, b] = row[..] else {
            panic!("{row:?}")
        };
        let current = ((v - 0.5) / (r + 2.0)).max(0.0);
        assert!((i + current).abs() < 1e-15 && (b - (v - r * current)).abs() < 1e-15);
    }
    // The first sweep is the inner one.
    assert_eq!(&found.rows[5][..2], &[-1.0, 3.0]);
}

/// A value with which the cards are no circuit.
#[test]
fn a_point_that_is_no_circuit_says_what_is_wrong() {
    let model = model("v1 a 0 1\nr1 a b 1\nr2 b 0 {1/x}\n.param x=1\n.dc param x 1 0 -1\n");
    let unsolved = dc(&model).unwrap_err();
    assert!(unsolved.circuit.is_none() && !unsolved.error.findings().is_empty());
    assert!(unsolved.error.to_string().contains("test.cir:4"));
    assert_eq!(unsolved.at, [("x".to_string(), 0.0)]);
}

#[test]
fn variants_keep_their_order_and_their_probes() {
    let model = model(
        "v1 a 0 1\nr1 a b {r}\nc1 b 0 1u ic=0\n.param r=1k\n.step param r list 1k 2k 5k\n.save v(b)\n\
         .tran 1m 1m uic\n",
    );
    let all = variants(&model, &model.circuit().steps);
    let last = each(&all, |variant| {
        let run = variant.model().unwrap().transient(SimOptions::default());
        let waves = run.unwrap().waveforms;
        assert_eq!(waves.names, ["v(b)"]);
        (variant.named(), *waves.values.last().unwrap())
    });
    for ((named, end), r) in last.iter().zip([1e3, 2e3, 5e3]) {
        assert_eq!(named, &[("r".to_string(), r)]);
        assert!((end - (1.0 - (-1.0 / (r * 1e-3)).exp())).abs() < 1e-14);
    }
}

/// The charge of an RC until 63 % and its mean, which see rows that the print step does not have; the rows are those of the print
/// step all the same, and a run that breaks off is measured as far as it came.
#[test]
fn a_transient_is_measured_on_more_rows_than_it_shows() {
    let cards = "v1 a 0 1\nr1 a b 1k\nc1 b 0 1u ic=0\n.save v(b)\n.tran 1m 4m uic\n\
        .meas tran late when v(b)=0.5\n.meas tran mean avg i(v1)\n";
    let Finished { run, error } = transient(&model(cards), SimOptions::default());
    let (run, found) = run.unwrap();
    assert!(error.is_none());
    assert_eq!(
        (run.waveforms.names.len(), run.waveforms.time.len()),
        (1, 5)
    );
    let value = |k: usize| found.measured[k].result.as_ref().unwrap().value;
    assert!((value(0) / (1e-3 * 2f64.ln()) - 1.0).abs() < 1e-6);
    assert!((value(1) / (-1e-6 * (1.0 - (-4.0f64).exp()) / 4e-3) - 1.0).abs() < 1e-5);
    let cancel = std::sync::atomic::AtomicBool::new(true);
    let stopped = SimOptions {
        method: Method::Exact,
        cancel: Some(&cancel),
        ..SimOptions::default()
    };
    let Finished { run, error } = transient(&model(cards), stopped);
    assert!(error.is_some());
    let shown = run.map(|(run, found)| (run.waveforms.names, found.measured.len()));
    assert!(shown.is_none_or(|(names, measured)| names == ["v(b)"] && measured == 2));
}
