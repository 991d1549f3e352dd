//! Jumps of random networks with ideal and curved diodes against the limit of the implicit step.
#![allow(missing_docs, reason = "tests")]

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::jump::JumpProblem;
use circ::lcs::{Lcs, Position, Role, reduce};
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::solve::{Driver, PortLaw, Status};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// Inductors, capacitors, resistors and diodes of every kind between a few nodes; resistors to ground make every one of them regular.
fn network() -> impl Strategy<Value = String> {
    let element = (0..9_u8, 0..5_usize, 0..5_usize, 0.5..3.0f64);
    (2..5_usize, prop::collection::vec(element, 2..9)).prop_map(|(nodes, elements)| {
        let mut text = String::from("random\n");
        for (k, (kind, a, b, value)) in elements.into_iter().enumerate() {
            let (a, b) = (a % nodes, b % nodes);
            if a == b {
                continue;
            }
            text += &match kind {
                0..=2 => format!("l{k} {a} {b} {value}m\n"),
                3 => format!("c{k} {a} {b} {value}u\n"),
                4 => format!("r{k} {a} {b} {value}\n"),
                5 => format!("d{k} {a} {b} di\n"),
                6 => format!("d{k} {a} {b} leaky\n"),
                7 => format!("d{k} {a} {b} zener\n"),
                _ => format!("d{k} {a} {b} round\n"),
            };
        }
        // Leakages large enough to be seen beside currents of some amperes; RS keeps charge from following a logarithm. These steps see what 1 pS lets through.
        text + ".model di d(ideal)
.model leaky d(is=0.1 rs=0.1 n=0.5)
.model zener d(is=0.2 rs=0.1 n=0.5 bv=5 ibv=1m)
.model round d(ron=0.1 roff=10k vfwd=0.5 epsilon=0.1)
.options gmin=0
.tran 1u 1u uic
.end
"
    })
}

fn system(text: &str) -> Option<Lcs> {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", text);
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, _) = elaborate(&netlist, &ElaborateOptions::default());
    let behaviour = behaviour(&circuit?).ok()?;
    reduce(&behaviour, &Position::free(&behaviour, vec![])).ok()
}

/// The state after one implicit step of h.
fn stepped(lcs: &Lcs, x: &DVector<f64>, h: f64) -> Option<DVector<f64>> {
    let w = (DMatrix::identity(lcs.n(), lcs.n()) - &lcs.a * h).try_inverse()?;
    let m = &lcs.d + &lcs.c * &w * &lcs.b * h;
    let ports = lcs.ports.iter().map(|port| PortLaw {
        law: port.law.clone(),
        current: port.role != Role::Voltage,
    });
    let free = &w * (x + &lcs.e0 * h);
    let q = &lcs.c * &free + &lcs.f;
    let mut driver = Driver::with_laws(m, ports.collect(), 1e-9);
    let solution = driver.solve(&q);
    (solution.status == Status::Solved).then(|| free + &w * &lcs.b * solution.lambda * h)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..Default::default() })]

    #[test]
    fn jumps_are_limits_of_implicit_steps(
        text in network(), start in prop::collection::vec(-4.0..4.0f64, 9),
    ) {
        let Some(lcs) = system(&text) else { return Ok(()) };
        if lcs.n() == 0 || lcs.m() == 0 {
            return Ok(());
        }
        let x = DVector::from_fn(lcs.n(), |i, _| start[i % start.len()]);
        let jump = match JumpProblem::new(&lcs, 1e-9) {
            None => None,
            Some(mut problem) => {
                prop_assert!(problem.monotone, "{}", text);
                let jump = problem.solve(&lcs, &x, &DVector::zeros(lcs.inputs.len()));
                prop_assert!(jump.is_ok(), "{jump:?}\n{text}");
                let jump = jump.unwrap();
                if let Some(jump) = &jump {
                    prop_assert_eq!(problem.verify(&lcs, jump), Ok(()));
                }
                jump
            }
        };
        let after = jump.map_or(x.clone(), |jump| jump.x);
        // Steps far below the least time constants, those of 0.1 Ω with 0.5 µF and of 0.5 mH with 10 kΩ, extrapolated to none.
        let steps = [1e-11, 0.5e-11].map(|h| stepped(&lcs, &x, h));
        let [Some(whole), Some(half)] = steps else {
            return Err(TestCaseError::fail(text));
        };
        let limit = half * 2.0 - whole;
        prop_assert!((&after - &limit).amax() < 1e-5, "{x} jumps to {after} and steps to {limit}\n{text}");
    }
}
