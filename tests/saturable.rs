//! Inductors and capacitors with piecewise-linear flux and charge, against closed forms.

use circ::{Error, Model, SimOptions, Waveforms};

fn model(cards: &str) -> Result<Model, Error> {
    Model::parse(&format!("title\n{cards}\n.end\n"), "a.cir")
}

fn run(cards: &str) -> Waveforms {
    let model = model(cards).unwrap_or_else(|e| panic!("{cards}: {:?}", e.findings()));
    let run = model.transient(SimOptions::default());
    run.unwrap_or_else(|e| panic!("{cards}: {e}")).waveforms
}

/// Compares a signal with a function of time.
fn follows(waves: &Waveforms, name: &str, expected: impl Fn(f64) -> f64) {
    let values = waves.column(waves.find(name).expect("a column"));
    for (&t, value) in waves.time.iter().zip(values) {
        let expected = expected(t);
        assert!(
            (value - expected).abs() < 1e-9 * expected.abs().max(1.0),
            "{name} at {t}: {value}, not {expected}"
        );
    }
}

/// 10 mH up to 1 A, 1 mH above.
const FLUX: &str = "Flux=pwl(x, -2, -11m, -1, -10m, 1, 10m, 2, 11m)";

#[test]
fn a_saturating_inductor_follows_its_curve() {
    // The flux is 12 V·t.
    let waves = run(&format!(
        "v1 a 0 12\nl1 a 0 {FLUX} IC=0\n.tran 10u 2m uic\n.save i(l1)"
    ));
    follows(&waves, "i(l1)", |t| {
        let flux = 12.0 * t;
        if flux < 10e-3 {
            flux / 10e-3
        } else {
            1.0 + (flux - 10e-3) / 1e-3
        }
    });
    // The same curve the other way round, from −1.5 A on.
    let waves = run(&format!(
        "v1 a 0 12\nl1 a 0 {FLUX} IC=-1.5\n.tran 10u 2m uic\n.save i(l1)"
    ));
    follows(&waves, "i(l1)", |t| {
        let flux = -10.5e-3 + 12.0 * t;
        match flux {
            f if f < -10e-3 => -1.0 + (f + 10e-3) / 1e-3,
            f if f > 10e-3 => 1.0 + (f - 10e-3) / 1e-3,
            f => f / 10e-3,
        }
    });
}

#[test]
fn behind_a_resistance_it_is_two_exponentials() {
    let (v, r, knee) = (10.0_f64, 5.0, 1.0);
    let waves = run(&format!(
        "v1 a 0 10\nr1 a b 4\nl1 b 0 {FLUX} Rser=1 IC=0\n.tran 50u 8m uic\n.save i(l1) i(v1)"
    ));
    let reached = 10e-3 / r * (v / (v - r * knee)).ln();
    let current = |t: f64| {
        if t < reached {
            v / r * (1.0 - (-r * t / 10e-3).exp())
        } else {
            v / r - (v / r - knee) * (-r * (t - reached) / 1e-3).exp()
        }
    };
    follows(&waves, "i(l1)", current);
    follows(&waves, "i(v1)", |t| -current(t));
}

#[test]
fn at_rest_it_is_a_short_with_its_flux() {
    let point = model(&format!("v1 a 0 10\nr1 a b 5\nl1 b 0 {FLUX}"))
        .unwrap()
        .operating_point()
        .unwrap();
    let value =
        |list: &[(String, f64)], name: &str| list.iter().find(|(n, _)| n == name).unwrap().1;
    assert!(
        (value(&point.currents, "l1") - 2.0).abs() < 1e-12
            && value(&point.nodes, "b").abs() < 1e-12
    );
    // φ(2 A)/10 mH.
    assert!(
        (value(&point.currents, "l1.flux") - 1.1).abs() < 1e-12,
        "{point:?}"
    );
}

#[test]
fn a_straight_flux_is_an_inductance_and_a_straight_charge_a_capacitance() {
    for (bent, straight) in [
        ("l1 b 0 Flux={2*k}*x+1m Rpar=50", "l1 b 0 4m Rpar=50"),
        ("c1 b 0 Q=3u*x Rser=2", "c1 b 0 3u Rser=2"),
    ] {
        let cards = |card: &str| {
            format!(".param k=2m\nv1 a 0 SIN(0 5 1k)\nr1 a b 10\n{card}\n.tran 10u 2m\n.save v(b)")
        };
        let [bent, straight] = [bent, straight].map(|card| run(&cards(card)));
        let expected: Vec<f64> = straight.column(0).collect();
        for (found, expected) in bent.column(0).zip(expected) {
            assert!((found - expected).abs() < 1e-10, "{found} {expected}");
        }
    }
}

#[test]
fn a_bent_charge_follows_its_curve() {
    // 1 µF below 2 V, 4 µF above: the charge is 1 mA·t.
    let waves = run("i1 0 a 1m\nc1 a 0 Q=1u*x+3u*max(x-2,0) IC=0\n.tran 50u 8m uic\n.save v(a)");
    follows(&waves, "v(a)", |t| {
        let charge = 1e-3 * t;
        if charge < 2e-6 {
            charge / 1e-6
        } else {
            2.0 + (charge - 2e-6) / 4e-6
        }
    });
}

#[test]
fn what_has_no_inverse_is_refused() {
    for (card, code) in [
        ("l1 a 0 Flux=1m*tanh(5*x)", "not-linear"),
        ("l1 a 0 Flux=table(x,-1,-1m,1,1m)", "not-linear"),
        ("l1 a 0 Flux=-1m*x", "not-linear"),
        ("l1 a 0 Flux=1m*x+u(x)", "not-linear"),
        ("l1 a 0 Flux=1m", "not-linear"),
        ("l1 a 0 Flux=1m*v(a)", "bad-expression"),
        ("l1 a 0 Flux=1m*x m=2", "unsupported"),
        (
            "l1 a 0 Hc=16 Bs=0.44 Br=0.1 A=0.25u Lm=0.0198 Lg=0.0006 N=1000",
            "unsupported",
        ),
        (
            "l1 a 0 Flux=1m*x\nl2 b 0 1m\nr2 b 0 1\nk1 l1 l2 0.5",
            "coupling",
        ),
    ] {
        let refused = model(&format!("v1 a 0 1\nr1 a 0 1\n{card}")).expect_err(card);
        assert!(
            refused.findings().iter().any(|d| d.code == code),
            "{card}: {:?}",
            refused.findings()
        );
    }
}
