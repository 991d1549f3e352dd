//! Section 3 with jumps: Remark 3.7, (24)-(26), the energy of jumps (32), (33), accumulations of them.

use std::rc::Rc;

use circ::forms::sweeping::SweepingProcess;
use circ::forms::{Complementarity, Linear, Signal, constant, integrate, step};
use circ::passivity::System;
use nalgebra::{DVector, dmatrix, dvector};

use super::super::{C, Random, energy, filter};
use super::{gradient_type, square};

#[test]
fn theorem_3_5_and_remark_3_7_jumps_are_projections() {
    // Gu of bounded variation: at an edge z⁺ = prox[S(t⁺); z⁻] (25), the minimiser (26), and −z⁺ + z⁻ ∈ N (24).
    let mut random = Random(37);
    for _ in 0..10 {
        let height = random.vector(2) * 2.0;
        let drive: Signal = Rc::new(move |t| -&height * square(t));
        let (linear, p) = gradient_type(&mut random, (3, 2), drive);
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let before = process.jump(0.4, &random.vector(3)).unwrap();
        let h = 1e-9;
        let t = 0.5 - 0.5 * h;
        let after = step(&process, t, &before, h).unwrap().x;
        let projected = process.jump(0.5, &before).unwrap();
        assert!((&after - &projected).norm() < 1e-6);
        // (26) by the interior point method, and in the state x with the metric P.
        assert!((process.set(0.5).nearest(&before).unwrap() - &projected).norm() < 1e-5);
        let x = |z: &DVector<f64>| &process.r_inverse * z;
        let moved = step(&linear, t, &x(&before), h).unwrap().x;
        assert!((&moved - x(&projected)).norm() < 1e-6);
        let metric = energy(&p, &(&moved - x(&before)));
        assert!((metric - (&projected - &before).norm_squared()).abs() < 1e-5);
        // (24).
        assert!(
            process
                .set(0.5)
                .distance_to_normal(&projected, &(&before - &projected))
                .unwrap()
                < 1e-6
        );
    }
}

/// (32), (33): what a jump takes from the storage is the impulse times the mean of w before and after.
#[test]
fn equation_33_energy_lost_at_jumps() {
    let mut random = Random(33);
    let mut lossy = 0;
    for _ in 0..20 {
        // A cone (F = 0): 0 ∈ S, where (33) says that V does not increase.
        let (linear, p) = gradient_type(&mut random, (3, 2), constant(DVector::zeros(2)));
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let before = random.vector(3);
        let (after, impulse) = process.set(0.0).project(&before).unwrap();
        let v = |z: &DVector<f64>| 0.5 * z.norm_squared();
        assert!(v(&after) <= v(&before) + 1e-12);
        let supplied = 0.5 * impulse.dot(&(&process.set(0.0).g * (&after + &before)));
        assert!((v(&after) - v(&before) - supplied).abs() < 1e-9);
        // The same of a step of no duration in x: the energy falls by what the impulse hλ takes at the mean of w (32).
        let h = 1e-10;
        let x = &process.r_inverse * &before;
        let end = step(&linear, 0.0, &x, h).unwrap();
        let w = (linear.constraint(0.0, &x) + &end.y) * 0.5;
        let lost = 0.5 * (energy(&p, &end.x) - energy(&p, &x));
        assert!((lost - h * end.lambda.dot(&w)).abs() < 1e-7, "{lost}");
        assert!((lost - supplied).abs() < 1e-7);
        // The printed difference z⁺ − z⁻ gives another number.
        let printed = 0.5 * impulse.dot(&(&process.set(0.0).g * (&after - &before)));
        if lost < -1e-3 {
            lossy += 1;
            assert!((lost - printed).abs() > 1e-4);
        }
    }
    assert!(lossy > 10, "{lossy}");
}

#[test]
fn capacitor_filter_jumps_to_its_projection() {
    // CIRCUITS 3.3 at t = 0+ in (38) alone: v_f = −3 V is inadmissible, the bridge conducts an impulse to 0 V.
    let linear = Linear::autonomous(filter()).unwrap();
    let end = step(&linear, 0.0, &dvector![-3.0], 1e-12).unwrap();
    assert!(end.x[0].abs() < 1e-6, "{}", end.x);
    let charge = (end.lambda[0] + end.lambda[2]) * 1e-12;
    assert!((charge / (3.0 * C) - 1.0).abs() < 1e-5, "{charge}");
}

/// Remark 3.7: from a start outside S(0) the motion is the one from its projection; the first step goes there.
#[test]
fn remark_3_7_a_start_outside_the_set_jumps_at_once() {
    let mut random = Random(370);
    let mut outside = 0;
    for _ in 0..10 {
        let drive: Signal = Rc::new(|t: f64| dvector![-1.0 + t, -2.0]);
        let (linear, p) = gradient_type(&mut random, (3, 2), drive);
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let start = random.vector(3);
        let projected = process.jump(0.0, &start).unwrap();
        outside += usize::from((&projected - &start).norm() > 0.1);
        let gap = |steps: usize| {
            let run = |from: &DVector<f64>| integrate(&process, (0.0, 0.5), from, steps).unwrap();
            let (one, other) = (run(&start), run(&projected));
            let apart = |k: usize| (&one.x[k] - &other.x[k]).norm();
            (1..=steps).map(apart).fold(0.0, f64::max)
        };
        let (g1, g2) = (gap(200), gap(400));
        assert!(g2 < 0.1 && g2 <= 0.6 * g1 + 1e-9, "{g1} {g2}");
    }
    assert!(outside > 5);
}

/// Section 5: accumulations of jumps are no obstacle. −dx ∈ N([i(t), ∞); x) with i = 1 − 2⁻ⁿ on [1 − 2⁻ⁿ, 1 − 2⁻⁽ⁿ⁺¹⁾): infinitely many
/// jumps before t = 1, of total variation 1; x is the running maximum, at 1 and after it.
#[test]
fn zeno_infinitely_many_jumps_before_a_time() {
    let source = |t: f64| {
        if t >= 1.0 {
            return 2.0 - t;
        }
        let n = (-(1.0 - t).log2() + 1e-9).floor();
        1.0 - (-n).exp2()
    };
    assert_eq!(
        (source(0.0), source(0.5), source(0.8), source(0.9)),
        (0.0, 0.5, 0.75, 0.875)
    );
    let system = System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    };
    let drive: Signal = Rc::new(move |t| dvector![-source(t)]);
    let linear = Linear::new(system, constant(dvector![0.0]), drive).unwrap();
    let process = SweepingProcess::of(&linear, None).unwrap();
    for steps in [1 << 4, 1 << 10] {
        let run = integrate(&process, (0.0, 2.0), &dvector![0.0], steps).unwrap();
        let mut running = 0.0_f64;
        for k in 1..=steps {
            running = running.max(source(run.t[k]));
            assert!((run.x[k][0] - running).abs() < 1e-12, "t = {}", run.t[k]);
        }
        assert!((run.x[steps][0] - 1.0).abs() < 1e-12);
    }
}
