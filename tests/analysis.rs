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

#[test]
fn a_model_refuses_what_is_no_number_and_names_what_is_unknown() {
    let text = "rc\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u\n.tran 0.1m 1m uic\n.end\n";
    let mut model = Model::parse(text, "rc.cir").unwrap();
    for nothing in [f64::NAN, f64::INFINITY] {
        let error = model.set("r1", nothing).unwrap_err();
        assert!(error.to_string().contains("no number"), "{error}");
    }
    let tran = model.circuit().tran.map(|tran| circ::circuit::Tran {
        tstop: 0.5e-3,
        ..tran
    });
    let asked = model.asked(tran, &["v(out)".into()]).unwrap();
    let run = asked.transient(circ::SimOptions::default()).unwrap();
    assert_eq!(run.waveforms.names, ["v(out)"]);
    assert_eq!(run.waveforms.time.last(), Some(&0.5e-3));
    let error = model.asked(None, &["v(nowhere)".into()]).unwrap_err();
    assert!(
        matches!(error.reason, circ::integrate::Reason::Unknown(_)),
        "{error}"
    );
}

#[test]
fn a_model_is_read_from_the_files_that_it_was_read_from() {
    let file = |path: &str, text: &str| circ::diagnostic::SourceFile {
        path: path.into(),
        text: text.into(),
    };
    let main = file(
        "main.cir",
        "main\n.include r.inc\nv1 a 0 1\nr1 a 0 {r}\n.op\n.end\n",
    );
    let both = [main.clone(), file("r.inc", ".param r=2k\n")];
    let model = Model::of_files(&both, circ::ElaborateOptions::default()).unwrap();
    let current = model.operating_point().unwrap();
    let (_, through) = current
        .currents
        .iter()
        .find(|(name, _)| name == "r1")
        .unwrap();
    assert!((through - 0.5e-3).abs() < 1e-15);
    // What is included is taken from them alone.
    assert!(Model::of_files(&[main], circ::ElaborateOptions::default()).is_err());
    assert!(Model::of_files(&[], circ::ElaborateOptions::default()).is_err());
}

#[test]
fn an_advance_ends_where_its_flag_is_set() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    let text = "osc\nv1 in 0 pulse(0 1 0 0 0 5u 10u)\ns1 in out in 0 sw\nr1 out 0 1k\nc1 out 0 1n\n.model sw sw(vt=0.5)\n.tran 1u 10 uic\n.end\n";
    let model = Model::parse(text, "osc.cir").unwrap();
    let cancel = Arc::new(AtomicBool::new(false));
    let options = circ::SimulationOptions {
        cancel: Some(Arc::clone(&cancel)),
        ..circ::SimulationOptions::default()
    };
    let mut simulation = model.simulation(options).unwrap();
    simulation.advance_to(1e-4).unwrap();
    cancel.store(true, Ordering::Relaxed);
    let error = simulation.advance_to(10.0).unwrap_err();
    assert!(
        matches!(error.reason, circ::integrate::Reason::Interrupted),
        "{error}"
    );
    cancel.store(false, Ordering::Relaxed);
    let t = simulation.time();
    assert!(t < 10.0);
    simulation.advance_to(t + 1e-4).unwrap();
}
