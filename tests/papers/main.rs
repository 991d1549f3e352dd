//! Every numbered statement of the four papers, as a test that fails if the statement is violated.
//!
//! Data: random systems from a fixed seed, or the papers' own circuits with their misprints corrected (docs/theory.md).

mod brogliato_thibault;
mod heemels;
mod list;
mod reference;
mod rr5107;
mod rr7158;
#[path = "../systems/passive.rs"]
mod systems;

use circ::forms::Complementarity;
use circ::law::Law;
use circ::lcs::{Lcs, LcsParts, Port, Role, State, Storage};
use circ::solve::{Lcp, enumerate};
use nalgebra::{DMatrix, DVector};

use systems::{C, L, R, Random, bridge, filter};

/// xᵀPx.
fn energy(p: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
    x.dot(&(p * x))
}

/// [`systems::passive`] with energies within a factor of four.
fn passive(
    random: &mut Random,
    size: (usize, usize),
    rank: usize,
    damping: f64,
) -> (circ::passivity::System, DMatrix<f64>) {
    systems::passive(random, size, rank, damping, 2.0)
}

/// A number of a law.
fn value(v: f64) -> circ::algebra::Value {
    circ::algebra::Value::binary(v)
}

/// The system of a circuit whose ports are currents λ = i of devices with the given laws.
fn circuit(system: &circ::passivity::System, energy: &DMatrix<f64>, laws: &[Law]) -> Lcs {
    let (n, m) = (system.n(), system.m());
    let port = |(j, law): (usize, &Law)| Port {
        device: format!("d{}", j + 1),
        role: Role::Current,
        lambda: format!("i(d{})", j + 1),
        y: format!("-v(d{})", j + 1),
        law: law.clone(),
    };
    let state = |k: usize| State {
        name: format!("x{}", k + 1),
        unit: "V",
    };
    Lcs::new(LcsParts {
        states: (0..n).map(state).collect(),
        ports: laws.iter().enumerate().map(port).collect(),
        a: system.a.clone(),
        b: system.b.clone(),
        c: system.c.clone(),
        d: system.d.clone(),
        e: DMatrix::zeros(n, 0),
        g: DMatrix::zeros(m, 0),
        e0: DVector::zeros(n),
        f: DVector::zeros(m),
        shift: DMatrix::zeros(n, 0),
        energy: energy.clone(),
        storage: Storage {
            inject_one: DVector::zeros(n),
            ..Storage::default()
        },
        ..LcsParts::default()
    })
    .unwrap()
}

/// All (x⁺, λ) of one implicit step of a linear form, by enumeration of its complementarity problem.
fn every_solution_of_a_step(
    system: &impl Complementarity,
    t: f64,
    x: &DVector<f64>,
    h: f64,
) -> Vec<(DVector<f64>, DVector<f64>)> {
    let (n, zero) = (x.len(), DVector::zeros(x.len()));
    let implicit = DMatrix::identity(n, n) - system.drift_jacobian(t, x) * h;
    let inverse = implicit.try_inverse().expect("a small step");
    let (b, c) = (system.input(x), system.constraint_jacobian(t, x));
    let free = &inverse * (x + system.drift(t + h, &zero) * h);
    let problem = Lcp {
        m: system.feedthrough() + &c * &inverse * &b * h,
        q: &c * &free + system.constraint(t + h, &zero),
    };
    let end = |lambda: &DVector<f64>| &free + &inverse * &b * lambda * h;
    enumerate::solve(&problem, 1e-9)
        .into_iter()
        .map(|lambda| (end(&lambda), lambda))
        .collect()
}
