//! Waveforms as they are written, with their defaults.

use super::*;
use crate::circuit::{Circuit, ElaborateOptions, Kind, elaborate};
use crate::diagnostic::SourceMap;
use crate::netlist::parse;

fn circuit(cards: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("title\n{cards}\n"));
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{findings:?}"))
}

fn source(card: &str, tran: &str) -> Source {
    match circuit(&format!("{card}\nR1 a 0 1\n{tran}"))
        .elements
        .remove(0)
        .kind
    {
        Kind::VoltageSource(source) => source,
        other => panic!("{other:?}"),
    }
}

#[test]
fn omitted_values_take_the_defaults_of_ngspice_but_for_the_period() {
    let tran = ".tran 1u 100u";
    let pulse = source("V1 a 0 PULSE(0 5 1u)", tran).wave;
    let (rise, fall, width, period) = (1e-6, 1e-6, 1e-4, 0.0);
    assert_eq!(
        pulse,
        Wave::Pulse {
            v1: 0.0,
            v2: 5.0,
            delay: 1e-6,
            rise,
            fall,
            width,
            period,
            count: None
        }
    );
    let Wave::Sin { frequency, .. } = source("V1 a 0 SIN(0 5)", tran).wave else {
        panic!()
    };
    assert_eq!(frequency, 1.0 / 100e-6);
    let exp = source("V1 a 0 EXP(0 5)", tran).wave;
    let (rise_tau, fall_tau) = (1e-6, 1e-6);
    assert_eq!(
        exp,
        Wave::Exp {
            v1: 0.0,
            v2: 5.0,
            rise_delay: 0.0,
            rise_tau,
            fall_delay: 1e-6,
            fall_tau
        }
    );
}

#[test]
fn an_explicit_zero_is_a_true_edge() {
    let Wave::Pulse {
        rise, fall, count, ..
    } = source("V1 a 0 PULSE(0 5 0 0 0 5u 10u 3)", ".tran 1u 1m").wave
    else {
        panic!()
    };
    assert_eq!((rise, fall, count), (0.0, 0.0, Some(3.0)));
}

#[test]
fn the_dc_value_is_the_one_given_or_the_wave_before_zero() {
    let at = |card| source(card, ".tran 1u 1m").dc;
    assert_eq!(at("V1 a 0 DC 2 AC 1 SIN(1 5 1k)"), 2.0);
    assert_eq!(at("V1 a 0 SIN(1 5 1k)"), 1.0);
    assert_eq!(at("V1 a 0 SIN(0 5 1k 0 0 90)"), 5.0);
    assert!((at("V1 a 0 SIN(0 5 1k -0.25m)") - 5.0).abs() < 1e-12);
    assert_eq!(at("V1 a 0 PULSE(3 5)"), 3.0);
    assert_eq!(at("V1 a 0 PULSE(3 5 0 0)"), 3.0);
    assert_eq!(at("V1 a 0 AC 1"), 0.0);
}

#[test]
fn writings_of_one_source_agree() {
    let wanted = source("V1 a 0 PULSE(0 5 0 1u 1u 50u 100u)", ".tran 1u 1m");
    for card in [
        "V1 a 0 PULSE 0 5 0 1u 1u 50u 100u",
        "V1 a 0 (PULSE 0 5 0 1u 1u 50u 100u)",
        "V1 a 0 pulse (0,5,0,1u,1u,50u,100u )",
        "V1 (a 0) PULSE(0 5 0 {1u} '0.5u*2' 50us 100us",
        "V1 a 0 AC 1 0 DC 0 PULSE(0 5 0 1u 1u 50u 100u)",
    ] {
        assert_eq!(source(card, ".tran 1u 1m"), wanted, "{card}");
    }
}

#[test]
fn pwl_times_may_be_relative_and_repeat() {
    let wave = source(
        "V1 a 0 PWL REPEAT FOREVER (0 0 +1m 1 +1m 0) ENDREPEAT",
        ".tran 1u 1m",
    )
    .wave;
    assert_eq!(
        wave,
        Wave::Pwl {
            points: vec![(0.0, 0.0), (1e-3, 1.0), (2e-3, 0.0)],
            repeat: Some(0.0),
            delay: 0.0
        }
    );
    let wave = source("V1 a 0 PWL(0 0 1m 1) td=2m r=0", ".tran 1u 1m").wave;
    assert_eq!(
        wave,
        Wave::Pwl {
            points: vec![(0.0, 0.0), (1e-3, 1.0)],
            repeat: Some(0.0),
            delay: 2e-3
        }
    );
}

#[test]
fn supplies_ramp_up_at_startup() {
    let source = source("V1 a 0 5", ".tran 0 1m 0 1u startup");
    assert_eq!(source.dc, 5.0);
    assert_eq!(
        source.wave,
        Wave::Pwl {
            points: vec![(0.0, 0.0), (20e-6, 5.0)],
            repeat: None,
            delay: 0.0
        }
    );
}

#[test]
fn modulated_waves() {
    assert_eq!(
        source("V1 a 0 SFFM(0 1 1MEG 5 10K)", ".tran 10n 100u").wave,
        Wave::Sffm {
            offset: 0.0,
            amplitude: 1.0,
            carrier: 1e6,
            index: 5.0,
            signal: 1e4,
            carrier_phase: 0.0,
            signal_phase: 0.0,
        }
    );
    assert_eq!(
        source("V1 a 0 AM(2 1 1k 20k 1m 0)", ".tran 1u 1m").wave,
        Wave::Am {
            amplitude: 2.0,
            offset: 1.0,
            modulation: 1e3,
            carrier: 2e4,
            delay: 1e-3,
        }
    );
}

#[test]
fn pwl_repeats_a_number_of_times() {
    let wave = source("V1 a 0 PWL REPEAT FOR 2 (0 0 1 3) ENDREPEAT", ".tran 1m 3").wave;
    let points = vec![(0.0, 0.0), (1.0, 3.0), (1.0, 0.0), (2.0, 3.0)];
    assert_eq!(
        wave,
        Wave::Pwl {
            points,
            repeat: None,
            delay: 0.0,
        }
    );
}

/// Without a period there is no edge on the last row, where ngspice's period of the whole run would have it begin again.
#[test]
fn a_pulse_without_a_period_comes_once() {
    for card in [
        "V1 a 0 PULSE(0 5 0 10n)",
        "V1 a 0 PULSE(0 5 0 10n 10n 2m 0)",
    ] {
        let wave = source(card, ".tran 1u 1m").wave;
        assert_eq!(wave.value(1e-3), 5.0, "{card}");
        assert_eq!(wave.period(), None, "{card}");
    }
}
