//! Section 3: existence, uniqueness, slow solutions; all problems have the same solution.

use std::rc::Rc;

use circ::forms::projected::Map;
use circ::forms::unilateral::Unilateral;
use circ::forms::{Polyhedron, Signal, constant, integrate};
use nalgebra::{DVector, dmatrix, dvector};

use super::super::reference::{Motion, Projected};
use super::{driven, gradients, h, nearest, problem};

const END: f64 = 4.0;
const FINE: usize = 1600;

/// −f − g = 3(cos φ, sin φ) − x + rotation, where φ turns from 120° to −60°: the motion meets the circle, slides to the corner, rests
/// there and leaves along the line.
fn turning() -> Unilateral {
    driven(Rc::new(|t: f64| {
        let angle = (2.0 - 0.75 * t) * std::f64::consts::FRAC_PI_3;
        dvector![2.0 - 3.0 * angle.cos(), 1.0 - 3.0 * angle.sin()]
    }))
}

fn start() -> DVector<f64> {
    dvector![-0.2, 0.3]
}

/// (PDS), mode by mode.
fn projected_motion(problem: &Unilateral) -> Motion {
    let v = |t: f64, x: &DVector<f64>| problem.free_velocity(t, x);
    let flow = Projected {
        v: &v,
        c: &|x| -h(x),
        g: &|x| -gradients(x),
    };
    flow.integrate(&start(), END, FINE)
}

/// s of (4c) for K = T_C(x): s ∈ K, v − s ∈ K°, orthogonal; by trying all faces of K.
fn in_normal_cone_of_tangent(tangent: &Polyhedron, v: &DVector<f64>) -> DVector<f64> {
    let g = &tangent.g;
    (0..1_usize << g.nrows())
        .filter_map(|mask| {
            let face: Vec<usize> = (0..g.nrows()).filter(|i| mask >> i & 1 == 1).collect();
            if face.is_empty() {
                return Some(v.clone());
            }
            let span = g.select_rows(&face);
            let mu = -((&span * span.transpose()).try_inverse()? * &span * v);
            mu.iter()
                .all(|&m| m >= 0.0)
                .then(|| v + span.transpose() * mu)
        })
        .find(|s| (g * s).iter().all(|&c| c >= -1e-12))
        .expect("a projection")
}

/// Theorem 2: (CDS), (UDI-C), (UDI-T_C) and (PDS) have the same solution. Each is integrated by a scheme of its own; all of them come to
/// the motion of (PDS), exact to 1e-9, along the whole path and of first order in h. It meets circle, corner and line.
#[test]
fn theorem_2_all_problems_have_the_same_solution() {
    let problem = turning();
    let exact = projected_motion(&problem);
    let modes: Vec<&[usize]> = exact.events.iter().map(|(_, mode)| &mode[..]).collect();
    for mode in [&[0][..], &[0, 1], &[1]] {
        assert!(modes.contains(&mode), "{modes:?}");
    }
    let worst = |path: &[DVector<f64>]| {
        let each = FINE / (path.len() - 1);
        let gap = |(k, x): (usize, &DVector<f64>)| (x - &exact.x[k * each]).norm();
        path.iter().enumerate().map(gap).fold(0.0, f64::max)
    };
    // Each scheme makes a step from x at t to t + h.
    type Scheme<'a> = &'a dyn Fn(f64, &DVector<f64>, f64) -> DVector<f64>;
    let path = |scheme: Scheme, steps: usize| {
        let step = END / steps as f64;
        let mut path = vec![start()];
        for k in 0..steps {
            path.push(scheme(k as f64 * step, &path[k], step));
        }
        path
    };
    let implicit: Scheme = &|t, x, step| circ::forms::step(&problem, t, x, step).unwrap().x;
    // (UDI-C): v − x' ∈ N_C(x⁺), the projection onto C itself.
    let unilateral: Scheme = &|t, x, step| {
        let v = problem.free_velocity(t, x);
        let next = nearest(&(x + &v * step));
        let chosen = (&next - x) / step;
        let off = problem.distance_to_inclusion(t, &next, &chosen).unwrap();
        assert!(
            off < 20.0 * step,
            "an element of −f − g − N_C up to h: {off}"
        );
        next
    };
    // (UDI-T_C): an x' with v − x' ∈ N_{T_C(x)}(x'), then back onto C.
    let tangent: Scheme = &|t, x, step| {
        let s = in_normal_cone_of_tangent(&problem.tangent(x), &problem.free_velocity(t, x));
        assert!(problem.distance_to_tangent_inclusion(t, x, &s).unwrap() < 1e-9);
        nearest(&(x + s * step))
    };
    // (PDS) in the form (2).
    let quotient: Scheme = &|t, x, step| {
        let delta = 1e-7;
        let s = (nearest(&(x + problem.free_velocity(t, x) * delta)) - x) / delta;
        nearest(&(x + s * step))
    };
    for (name, scheme) in [
        ("CDS", implicit),
        ("UDI-C", unilateral),
        ("UDI-T_C", tangent),
        ("PDS", quotient),
    ] {
        let (e1, e2) = (worst(&path(scheme, 800)), worst(&path(scheme, 1600)));
        assert!(e2 < 6e-3 && e2 > 1e-6, "{name}: {e1} {e2}");
        assert!((1.7..2.3).contains(&(e1 / e2)), "{name}: {e1} {e2}");
    }
    // Furthermore x' ∈ T_C(x), and (slow) it is the right-hand side of (PDS).
    let h = END / FINE as f64;
    for k in 1..FINE {
        let t = k as f64 * h;
        if exact
            .events
            .iter()
            .all(|(event, _)| (event - t).abs() > 2.0 * h)
        {
            let x = nearest(&exact.x[k]);
            let velocity = (&exact.x[k + 1] - &exact.x[k - 1]) / (2.0 * h);
            assert!(problem.tangent(&x).contains(&velocity, 1e-4));
            assert!((velocity - problem.slow_velocity(t, &x).unwrap()).norm() < 1e-4);
        }
    }
}

/// Theorem 1 asks of g only that it is integrable: g = −1/(2√t) on C = {x ≤ 1} has the solution min(√t, 1), which the steps come to
/// with order ½.
#[test]
fn theorem_1_with_an_integrable_g() {
    let still = Map::affine(dmatrix![0.0], dvector![0.0]);
    let g: Signal = Rc::new(|t: f64| dvector![-0.5 / t.max(1e-300).sqrt()]);
    let h = Map::affine(dmatrix![1.0], dvector![-1.0]);
    let problem = Unilateral::new(still, g, &h, 1).unwrap();
    let error = |steps: usize| {
        let run = integrate(&problem, (0.0, 2.0), &dvector![0.0], steps).unwrap();
        let gap = |(t, x): (&f64, &DVector<f64>)| (x[0] - t.sqrt().min(1.0)).abs();
        run.t.iter().zip(&run.x).map(gap).fold(0.0, f64::max)
    };
    let (e1, e2) = (error(1000), error(4000));
    assert!(e2 < 2e-2 && (1.8..2.2).contains(&(e1 / e2)), "{e1} {e2}");
}

/// Section 3: for piecewise continuous g the right derivative is the slow velocity at every time, the jumps of g among them.
#[test]
fn right_derivatives_are_slow_at_jumps_of_g() {
    // Until t = 1 into the corner, then away from it, then out of the disc again.
    let g: Signal = Rc::new(|t: f64| match t {
        t if t < 1.0 => dvector![-2.0, -3.0],
        t if t < 1.5 => dvector![3.0, 4.0],
        _ => dvector![2.0, -4.0],
    });
    let problem = driven(g);
    let step = 1e-3_f64;
    let run = integrate(&problem, (0.0, 2.0), &start(), 2000).unwrap();
    for t in [1.0, 1.5_f64] {
        let k = (t / step).round() as usize;
        let x = nearest(&run.x[k]);
        let right = circ::forms::step(&problem, t, &x, 1e-7).unwrap().x;
        let slow = problem.slow_velocity(t, &x).unwrap();
        assert!(((right - &x) / 1e-7 - &slow).norm() < 1e-4, "t = {t}");
        let before = problem.slow_velocity(t - step, &x).unwrap();
        assert!((before - slow).norm() > 1.0, "the velocity jumps at {t}");
    }
}

/// The chain at the end of section 2: S(PDS) ⊂ S(UDI-C). As velocities of (UDI-C) there are others than the slow one, as motions there is
/// none: where a derivative exists and a constraint is met, ẇ = 0, so λᵀẇ = 0. Steps that choose a faster velocity at every point of
/// the boundary leave it, come back, and tend to the slow motion as h falls.
#[test]
fn no_motion_of_the_inclusion_is_other_than_slow() {
    let problem = problem();
    let exact = projected_motion(&problem);
    let restless = |steps: usize| {
        let step = END / steps as f64;
        let (mut x, mut worst, mut chosen) = (start(), 0.0_f64, 0);
        for k in 0..steps {
            let t = k as f64 * step;
            let mut velocity = problem.slow_velocity(t, &x).unwrap();
            let inward = problem.tangent(&x).g;
            if inward.nrows() > 0 {
                let mu = DVector::from_element(inward.nrows(), 0.5);
                velocity += inward.transpose() * mu;
                assert!(problem.distance_to_inclusion(t, &x, &velocity).unwrap() < 1e-8);
                assert!(problem.constraint_power(t, &x, &velocity) < -1e-3);
                chosen += 1;
            }
            x = nearest(&(x + velocity * step));
            worst = worst.max((&x - &exact.x[(k + 1) * FINE / steps]).norm());
        }
        assert!(chosen > steps / 20, "{chosen} of {steps}");
        worst
    };
    let (e1, e2) = (restless(400), restless(1600));
    assert!(e2 < 2e-2 && e2 < 0.35 * e1, "{e1} {e2}");
}

/// Theorem 1 asks for a monotone f: with f(x) = −2√x on C = R₊ two motions start at 0, both slow.
#[test]
fn without_monotonicity_solutions_part() {
    let root = Map::new(
        |x| dvector![-2.0 * x[0].max(0.0).sqrt()],
        |x| dmatrix![-1.0 / x[0].max(1e-12).sqrt()],
    );
    let half_line = Map::affine(dmatrix![-1.0], dvector![0.0]);
    let problem = Unilateral::new(root, constant(dvector![0.0]), &half_line, 1).unwrap();
    for t in [0.0, 0.5, 1.0] {
        for (x, velocity) in [(0.0, 0.0), (t * t, 2.0 * t)] {
            let (x, velocity) = (dvector![x], dvector![velocity]);
            assert!((problem.slow_velocity(t, &x).unwrap() - &velocity).norm() < 1e-12);
            assert!(problem.distance_to_inclusion(t, &x, &velocity).unwrap() < 1e-12);
        }
    }
}

/// Theorem 1: one solution from each start, and it is slow.
#[test]
fn theorem_1_monotone_problem_has_one_solution_and_it_is_slow() {
    let problem = problem();
    let (a, b) = (dvector![-0.9, 0.0], dvector![0.3, -0.7]);
    let steps = 4000;
    let run = integrate(&problem, (0.0, 4.0), &a, steps).unwrap();
    let other = integrate(&problem, (0.0, 4.0), &b, steps).unwrap();
    // Monotone: solutions never move apart, so there is one from each start.
    for k in 1..run.t.len() {
        let (before, after) = (
            (&run.x[k - 1] - &other.x[k - 1]).norm(),
            (&run.x[k] - &other.x[k]).norm(),
        );
        assert!(after <= before * (1.0 + 1e-12));
    }
    // Slow: its velocity is the projected one, except in the steps of impact.
    let h = 4.0 / steps as f64;
    let mut off = 0;
    for k in 1..run.t.len() {
        let velocity = (&run.x[k] - &run.x[k - 1]) / h;
        let slow = problem.slow_velocity(run.t[k], &run.x[k]).unwrap();
        off += usize::from((velocity - slow).norm() > 2e-2);
    }
    assert!(off <= 8, "{off}");
    assert!(run.lambda.iter().any(|l| l[0] > 0.0) && run.lambda.iter().any(|l| l[1] > 0.0));
}

/// Section 3, first remark: regular sets that are not convex. Outside of the unit disc, carried past it by a stream: (CDS) comes to the
/// motion of (PDS), which meets the disc, goes round it and leaves.
#[test]
fn a_regular_set_that_is_not_convex() {
    let outside = Map::new(
        |x| dvector![1.0 - x.norm_squared()],
        |x| dmatrix![-2.0 * x[0], -2.0 * x[1]],
    );
    let stream = Map::affine(dmatrix![0.1, 0.0; 0.0, 0.1], dvector![-1.0, -0.1]);
    let problem = Unilateral::new(stream, constant(dvector![0.0, 0.0]), &outside, 2).unwrap();
    let start = dvector![-2.0, 0.1];
    let v = |t: f64, x: &DVector<f64>| problem.free_velocity(t, x);
    let flow = Projected {
        v: &v,
        c: &|x| dvector![x.norm_squared() - 1.0],
        g: &|x| dmatrix![2.0 * x[0], 2.0 * x[1]],
    };
    let exact = flow.integrate(&start, 6.0, FINE);
    let modes: Vec<&[usize]> = exact.events.iter().map(|(_, mode)| &mode[..]).collect();
    assert_eq!(modes, [&[0][..], &[]]);
    problem.qualified(&dvector![0.0, 1.0]).unwrap();
    let error = |steps: usize| {
        let run = integrate(&problem, (0.0, 6.0), &start, steps).unwrap();
        let gap = |k: usize| (&run.x[k] - &exact.x[k * FINE / steps]).norm();
        (0..=steps).map(gap).fold(0.0, f64::max)
    };
    let (e1, e2) = (error(800), error(1600));
    assert!(
        e2 < 1e-2 && e2 > 1e-6 && (1.7..2.3).contains(&(e1 / e2)),
        "{e1} {e2}"
    );
}
