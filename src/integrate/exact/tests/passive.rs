//! Random passive circuits.

use proptest::prelude::*;

use super::{at, circuit, simulate, simulate_circuit};
use crate::integrate::{Method, SimOptions};
use crate::mna;

/// A passive network of a few nodes: every node has a capacitor or an inductor with a resistor to somewhere, diodes between.
fn passive() -> impl Strategy<Value = String> {
    let value = || (0.3_f64..3.0).prop_map(|v| (v * 100.0).round() / 100.0);
    let branch = (0_usize..5, 0_usize..5, 0_u8..7, value(), -1.0_f64..1.0);
    (prop::collection::vec(branch, 5..11), value(), 0_u8..2).prop_map(
        |(branches, omega, square)| {
            let mut text = if square == 1 {
                format!("Rs s 1 0.1\nV1 s 0 PULSE(-1 1 0.31 0 0 {omega} 2.7)\n")
            } else {
                format!("Rs s 1 0.1\nV1 s 0 SIN(0 2 {omega} 0.1)\n")
            };
            for k in 1..5 {
                text += &format!("Rg{k} {k} 0 10\n");
            }
            for (j, (p, n, kind, v, ic)) in branches.iter().enumerate().filter(|(_, b)| b.0 != b.1)
            {
                text += &match kind {
                    0 => format!("R{j} {p} {n} {v}\n"),
                    1 => format!("Rc{j} {p} c{j} 0.2\nC{j} c{j} {n} {v} IC={ic:.2}\n"),
                    2 => format!("L{j} {p} {n} {v} IC={ic:.2}\n"),
                    3 => format!("C{j} {p} {n} {v} IC={ic:.2}\n"),
                    _ => format!("D{j} {p} {n} d\n"),
                };
            }
            text + ".model d D(ideal)\n"
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), cases: 32, ..ProptestConfig::default() })]
    /// Moreau's scheme, extrapolated from h and h/2 to h → 0 (Richardson), is the exact solution.
    #[test]
    fn random_passive_circuits_agree_with_moreau(text in passive()) {
        let full = format!("{text}.tran 0.1 3 uic");
        let circuit = circuit(&full);
        let exact = match simulate_circuit(&circuit) {
            Ok(run) => run,
            Err(e) => return Err(TestCaseError::fail(format!("{e}\n{full}"))),
        };
        prop_assert!(exact.energy.residual_relative < 1e-11, "{:?}\n{full}", exact.energy);
        let behaviour = mna::behaviour(&circuit).expect("a sound circuit");
        let moreau = |step: f64| {
            let options = SimOptions { method: Method::Euler, step: Some(step), ..SimOptions::default() };
            // A case that the other method cannot do is no comparison.
            crate::integrate::simulate(&circuit, &behaviour, options)
                .map_err(|e| TestCaseError::reject(format!("{e}")))
        };
        // Currents of inductors and voltages of capacitors: those of devices may jump.
        let column = |name: &str| exact.waveforms.names.iter().position(|n| n == name);
        let voltage = |node: &str| column(&format!("v({node})"));
        let quantities: Vec<[Option<usize>; 2]> = text
            .lines()
            .filter_map(|card| {
                let words: Vec<&str> = card.split(' ').collect();
                match words[0].as_bytes()[0] {
                    b'L' => Some([column(&format!("i({})", words[0].to_lowercase())), None]),
                    b'C' => Some([voltage(words[1]), voltage(words[2])]),
                    _ => None,
                }
            })
            .collect();
        let width = exact.waveforms.names.len();
        // Largest errors of Moreau's scheme, with h and extrapolated from 2h and h.
        let errors = |h: f64| -> Result<[f64; 2], TestCaseError> {
            let (coarse, fine) = (moreau(2.0 * h)?, moreau(h)?);
            let mut errors = [0.0_f64; 2];
            for k in 0..exact.waveforms.time.len() {
                for &[plus, minus] in &quantities {
                    let [a, b, x] = [&coarse, &fine, &exact].map(|run| {
                        let value = |j: Option<usize>| j.map_or(0.0, |j| run.waveforms.values[k * width + j]);
                        value(plus) - value(minus)
                    });
                    errors = [errors[0].max((b - x).abs()), errors[1].max((2.0 * b - a - x).abs())];
                }
            }
            Ok(errors)
        };
        let [plain, extrapolated] = errors(1e-3)?;
        prop_assert!(plain < 0.1, "{plain:e}\n{full}");
        // Where in a step a corner lies is not in the series: that leaves a part of the step, which goes with it.
        if extrapolated >= 0.5 * plain + 1e-3 {
            let finer = errors(1e-3 / 16.0)?;
            prop_assert!(finer[0] < plain / 4.0 && finer[1] < extrapolated / 4.0, "{plain:e} {extrapolated:e} {finer:?}\n{full}");
        }
    }
}

#[test]
fn a_capacitor_shorted_by_two_diodes() {
    let run = simulate(
        "Rs s 1 0.1\nV1 s 0 SIN(0 2 0.3 0.1)\nRg1 1 0 10\nRg2 2 0 10\nRg3 3 0 10\nRg4 4 0 10\nD0 4 1 d\nD1 1 2 d\n\
         C2 2 4 0.3 IC=-0.54\nD4 2 0 d\n.model d D(ideal)\n.tran 0.1 3 uic",
    );
    assert!(at(&run, 0.0, "v(4)").abs() < 1e-15);
}

/// The diode's voltage and the current of one inductor decay towards values that the other gives, with a rate of its own size.
#[test]
fn a_diode_lets_go_while_two_currents_decay_together() {
    let run = simulate(
        "R2 2 0 10\nR4 4 0 10\nD2 2 4 d\nL3 2 0 0.3 IC=-0.53\nL4 2 4 0.3 IC=0.12\n.model d D(ideal)\n.tran 0.1 0.3 uic",
    );
    // i(l3) = −0.53 e^(−t·5/0.3) as long as d2 conducts, until it is twice that of l4, which stands.
    let event = 0.06 * (0.53_f64 / 0.24).ln();
    assert_eq!(run.events.len(), 1);
    assert!((run.events[0].t / event - 1.0).abs() < 1e-14);
    // Then x' = −(10/0.3) M x with M = [1 1; 1 2], whose eigenvalues are (3 ± √5)/2.
    let root = 5.0_f64.sqrt();
    let [slow, fast] = [(3.0 - root) / 2.0, (3.0 + root) / 2.0];
    let t = 0.3 - event;
    let [p, q] = [slow, fast].map(|value| (-t * value / 0.03).exp());
    // x(0) = 0.12 (−2, 1); e^(−Mτ) by Sylvester's formula.
    let [mx, x] = [[-1.0, 0.0], [-2.0, 1.0]];
    let i4 = 0.12
        * (p * (mx[1] - fast * x[1]) / (slow - fast) + q * (mx[1] - slow * x[1]) / (fast - slow));
    assert!((at(&run, 0.3, "i(l4)") - i4).abs() < 1e-15, "{i4}");
}

/// A current or voltage that is zero to rounding when the source passes zero leaves with a slope that is rounding, or as small as
/// what is left of a transient: the curvature says on which side.
#[test]
fn where_sources_pass_zero_curvatures_decide() {
    let circuits = [
        (
            "2.79",
            "L0 3 2 0.3 IC=0\nD1 4 3 d\nR2 0 1 2.29\nD3 3 2 d\nD4 0 2 d\nC5 1 2 2.98 IC=0.8\n",
            32,
        ),
        ("0.3", "D0 4 1 d\nD1 2 1 d\nC4 2 0 0.3 IC=0\n", 2),
        ("0.55", "C0 0 1 0.3 IC=0\nL1 1 2 0.3 IC=0.62\nD2 0 1 d\n", 4),
        ("0.3", "D0 1 2 d\nL1 1 2 0.3 IC=0\nD2 0 2 d\nD4 0 2 d\n", 2),
        (
            "0.75",
            "D0 1 3 d\nL1 3 2 0.46 IC=0\nD2 0 2 d\nL3 4 0 1.04 IC=0\nRc4 0 c4 0.2\nC4 c4 4 2.43 IC=-0.65\n",
            5,
        ),
    ];
    for (frequency, elements, events) in circuits {
        let run = simulate(&format!(
            "Rs s 1 0.1\nV1 s 0 SIN(0 2 {frequency} 0.1)\nRg1 1 0 10\nRg2 2 0 10\nRg3 3 0 10\nRg4 4 0 10\n\
             {elements}.model d D(ideal)\n.tran 0.1 3 uic"
        ));
        assert_eq!(
            (run.stats.events, run.stats.jumps),
            (events, 0),
            "{elements}"
        );
    }
}
