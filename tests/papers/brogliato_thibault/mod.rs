//! Brogliato, Thibault 2010: existence and uniqueness for non-autonomous complementarity dynamical systems.

mod jumps;
mod nonlinear;
mod prox_regular;
mod sweeping;

use circ::forms::{Linear, Signal, constant};
use circ::passivity::System;
use nalgebra::DMatrix;

use super::Random;

/// A random system with D = 0 and PB = Cᵀ, P not the identity, with the driven term f(t).
fn gradient_type(random: &mut Random, (n, m): (usize, usize), f: Signal) -> (Linear, DMatrix<f64>) {
    let root = random.matrix(n, n) + DMatrix::identity(n, n) * 2.0;
    let p = &root * root.transpose();
    let b = random.matrix(n, m);
    let system = System {
        a: random.matrix(n, n),
        c: b.transpose() * &p,
        b,
        d: DMatrix::zeros(m, m),
    };
    (
        Linear::new(system, constant(random.vector(n)), f).unwrap(),
        p,
    )
}

/// ⌊2t⌋ odd: the square wave of period one.
fn square(t: f64) -> f64 {
    f64::from((2.0 * t).floor() as i64 % 2 != 0)
}
