//! Random passive RLC–diode circuits: no failure, energy in balance, complementarity to rounding, and the same states as a
//! time-stepping written down in ten lines around the enumerating solver.
#![allow(missing_docs, reason = "tests")]

use circ::circuit::{Circuit, ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::jump::JumpProblem;
use circ::integrate::step::Scheme;
use circ::integrate::theta::{Setup, Start, Stepping, Theta};
use circ::integrate::{Log, Method, SimOptions, Stepper, simulate};
use circ::lcs::{Lcs, Position, reduce};
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::settings::Settings;
use circ::solve::enumerate;
use circ::solve::lcp::Lcp;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

fn circuit(text: &str) -> Option<Circuit> {
    let mut sources = SourceMap::default();
    let root = sources.add("random.cir", text);
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    elaborate(&netlist, &ElaborateOptions::default()).0
}

/// A driven tree of resistors with capacitors, inductors, diodes and resistors across it, from inconsistent initial values.
fn netlist() -> impl Strategy<Value = String> {
    let element = (0..4_u8, 0..5_usize, 0..5_usize, 1..100_u32, -20..20_i32);
    (2..5_usize, proptest::collection::vec(element, 3..9), 1..4_u32).prop_map(
        |(nodes, elements, frequency)| {
            let mut text = format!(
                "random\n.model di d(ron=0 vfwd=0 n=0.01)\nv1 s 0 sin(0 10 {frequency}k)\nrs s 1 100\n"
            );
            for k in 2..=nodes {
                text += &format!("rt{k} {k} {} {}\n", k - 1, 470 * k);
            }
            for (k, (kind, a, b, value, ic)) in elements.into_iter().enumerate() {
                let (a, b) = (a % (nodes + 1), b % (nodes + 1));
                if a == b {
                    continue;
                }
                text += &match kind {
                    0 => format!("c{k} {a} {b} {value}n ic={ic}\n"),
                    1 => format!("l{k} {a} {b} {value}u ic={}\n", f64::from(ic) * 1e-3),
                    2 => format!("d{k} {a} {b} di\n"),
                    _ => format!("r{k} {a} {b} {value}\n"),
                };
            }
            text + ".tran 2u 200u uic\n.end\n"
        },
    )
}

fn system(circuit: &Circuit) -> (Lcs, DVector<f64>) {
    let behaviour = behaviour(circuit).expect("a behaviour").standard();
    let lcs = reduce(&behaviour, &Position::free(&behaviour, vec![])).expect("a system");
    let s = circ::integrate::start::from_initial_conditions(circuit, &behaviour);
    let x = &lcs.storage.inject * s + &lcs.storage.inject_one;
    // The oracle knows no jump at t = 0+: it starts after it.
    let u = DVector::from_iterator(lcs.p(), lcs.inputs.iter().map(|i| i.source.value(0.0)));
    let jump =
        JumpProblem::new(&lcs, 1e-9).and_then(|mut j| j.solve(&lcs, &x, &u).expect("a jump"));
    let x = jump.map_or(x, |j| j.x);
    (lcs, x)
}

/// Moreau's scheme from the formula, each step by enumeration of all index sets, to the smallest tolerance that one meets: 1e-9
/// alone lets a wrong set pass by 1e-10 of the currents, and is for circuits whose equations are no better. `None` where none does.
fn oracle(lcs: &Lcs, mut x: DVector<f64>, h: f64, steps: usize) -> Option<DVector<f64>> {
    let n = lcs.n();
    let w = (DMatrix::identity(n, n) - &lcs.a * h).try_inverse()?;
    let m = &lcs.d + &lcs.c * &w * &lcs.b * h;
    for k in 1..=steps {
        let t = k as f64 * h;
        let u = DVector::from_iterator(lcs.p(), lcs.inputs.iter().map(|i| i.source.value_left(t)));
        let free = &w * (&x + (&lcs.e * &u + &lcs.e0) * h);
        let q = &lcs.c * &free + &lcs.g * &u + &lcs.f;
        let lcp = Lcp { m: m.clone(), q };
        let lambda = [1e-13, 1e-11, 1e-9]
            .iter()
            .find_map(|&tolerance| enumerate::solve(&lcp, tolerance).into_iter().next())?;
        x = free + &w * &lcs.b * lambda * h;
    }
    Some(x)
}

fn stepped(lcs: &Lcs, x: DVector<f64>, h: f64, steps: usize) -> (DVector<f64>, f64) {
    let owned = lcs.clone();
    let mut theta = Theta::new(Setup {
        reduce: Box::new(move |_| Ok(owned.clone())),
        position: vec![],
        thresholds: vec![],
        t: 0.0,
        start: Start::State(x),
        scheme: Scheme::MOREAU,
        stepping: Stepping::Fixed(h),
        longest: f64::INFINITY,
        settings: Settings::default(),
    })
    .expect("a stepper");
    let mut log = Log::new(lcs.outputs.names.len(), 0.0, false);
    theta
        .advance(h * steps as f64, &mut log)
        .unwrap_or_else(|e| panic!("{e}"));
    let worst = theta.worst_residual();
    (DVector::from_column_slice(theta.state()), worst)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]

    #[test]
    fn same_states_as_the_oracle(text in netlist()) {
        let Some(circuit) = circuit(&text) else { return Err(TestCaseError::fail(text)) };
        let (lcs, x) = system(&circuit);
        prop_assume!(lcs.m() <= 5);
        let (h, steps) = (1e-6, 40);
        if let Some(expected) = oracle(&lcs, x.clone(), h, steps) {
            let (state, residual) = stepped(&lcs, x.clone(), h, steps);
            let metric = |v: &DVector<f64>| v.dot(&(&lcs.energy * v)).sqrt();
            let scale = metric(&expected).max(metric(&x)).max(1e-6);
            prop_assert!(metric(&(&state - &expected)) <= 1e-7 * scale, "{text}\n{state}{expected}");
            prop_assert!(residual <= 1e-11, "{text}\n{residual:e}");
        }
    }

    #[test]
    fn midpoint_keeps_the_energy_balance(text in netlist()) {
        balances(&text)?;
    }
}

/// A run by the midpoint rule has its energy balance and does not create energy.
fn balances(text: &str) -> Result<(), TestCaseError> {
    let Some(circuit) = circuit(text) else {
        return Err(TestCaseError::fail(text.to_owned()));
    };
    let behaviour = behaviour(&circuit).expect("a behaviour");
    let options = SimOptions {
        method: Method::Theta,
        ..SimOptions::default()
    };
    let run = simulate(&circuit, &behaviour, options)
        .map_err(|e| TestCaseError::fail(format!("{text}{e}")))?;
    // Of what the source can deliver at most: 1 W for 200 µs (10 V into 100 Ω).
    let (energy, rounding) = (run.energy, 64.0 * f64::EPSILON * 200e-6);
    if energy.source.abs().max(energy.stored.abs()) > rounding {
        prop_assert!(energy.residual_relative < 1e-3, "{text}\n{energy:?}");
    }
    prop_assert!(
        energy.dissipated >= -1e-9 * energy.source.abs() - rounding,
        "{energy:?}"
    );
    Ok(())
}

/// Circuits that were hard: currents and voltages that stay a rounding beside zero, so that the solvers are asked in every step; rings
/// of three diodes, whose equations contradict each other by rounding; many events.
#[test]
fn balance_beside_zero() {
    let circuits = [
        "rt2 2 1 940\nrt3 3 2 1410\nrt4 4 3 1880\nd0 4 3 di\nl1 1 4 5u ic=-0.001\nd2 4 3 di\nd3 3 1 di\nc4 2 3 5n ic=-1\n",
        "rt2 2 1 940\nrt3 3 2 1410\nrt4 4 3 1880\nd0 2 3 di\nd1 2 4 di\nl2 4 2 1u ic=-0.001\nc3 2 1 17n ic=-10\nd4 0 1 di\n",
        "rt2 2 1 940\nd0 2 1 di\nl1 1 2 1u ic=-0.001\nd2 0 1 di\n",
        "rt2 2 1 940\nrt3 3 2 1410\nc0 1 0 1n ic=0\nc1 2 0 8n ic=0\nd2 2 0 di\nd3 0 3 di\nl4 2 1 1u ic=0\nd5 3 2 di\nc6 1 3 1n ic=-1\n",
        "rt2 2 1 940\nrt3 3 2 1410\nrt4 4 3 1880\nr0 4 1 1\nl1 2 4 2u ic=0\nc2 4 0 1n ic=-1\nd3 4 3 di\n",
        "rt2 2 1 940\nrt3 3 2 1410\nc0 2 0 74n ic=-16\nd1 1 2 di\nl2 2 3 83u ic=0.011\nd3 2 3 di\n",
        "rt2 2 1 940\nrt3 3 2 1410\nrt4 4 3 1880\nd0 1 2 di\nd1 2 4 di\nl2 3 4 31u ic=-0.001\nc3 3 1 49n ic=1\nd4 4 1 di\nr5 1 3 54\nc6 0 1 1n ic=0\n",
        "rt2 2 1 940\nrt3 3 2 1410\nrt4 4 3 1880\nd0 1 4 di\nl1 4 3 6u ic=0.001\nd2 0 1 di\n",
        "rt2 2 1 940\nrt3 3 2 1410\nc0 0 1 58n ic=0\nd1 0 1 di\nd2 1 3 di\nd3 3 0 di\nl4 2 0 1u ic=0\nc5 0 2 1n ic=0\nc6 3 2 1n ic=-1\n",
    ];
    for elements in circuits {
        let text = format!(
            "random\n.model di d(ron=0 vfwd=0 n=0.01)\nv1 s 0 sin(0 10 1k)\nrs s 1 100\n{elements}.tran 2u 200u uic\n.end\n"
        );
        balances(&text).unwrap_or_else(|e| panic!("{e}"));
    }
}
