//! Trajectories: Theorems 4.7 and 5.6, Corollary 5.5, Remarks 4.10 and 4.11.

use circ::check::program::minimise;
use circ::forms::projected::{Map, ProjectedSystem};
use circ::forms::{Trajectory, integrate};
use nalgebra::{DMatrix, DVector, dvector};

use super::super::Random;
use super::super::reference::{Motion, Projected};
use super::{constraints, corner, gradients, in_the_cut_disc, on_a_cut_disc, turn};

const END: f64 = 3.0;
const FINE: usize = 1600;

/// x' = Π_K(x, −F(x)) on the cut disc from a start of which the motion meets circle, line and corner.
fn projected_motion() -> Motion {
    let v = |_: f64, x: &DVector<f64>| -(turn() * x + dvector![1.0, 2.5]);
    let flow = Projected {
        v: &v,
        c: &constraints,
        g: &gradients,
    };
    flow.integrate(&start(), END, FINE)
}

fn start() -> DVector<f64> {
    dvector![0.3, 0.6]
}

/// GTCS(F, h) by implicit steps.
fn gradient_type(steps: usize) -> Trajectory {
    integrate(&on_a_cut_disc(), (0.0, END), &start(), steps).unwrap()
}

/// Theorem 4.7: PDS(F, K) and GTCS(F, h) have the same solution. The first is integrated mode by mode to 1e-10, the second by
/// implicit steps, whose distance along the whole path falls as h.
#[test]
fn theorem_4_7_projected_and_gradient_systems_have_the_same_trajectory() {
    let exact = projected_motion();
    let modes: Vec<&[usize]> = exact.events.iter().map(|(_, mode)| &mode[..]).collect();
    assert!(
        modes.contains(&&[0][..]) && modes.contains(&&[1][..]),
        "{modes:?}"
    );
    let distance = |steps: usize| {
        let run = gradient_type(steps);
        let each = FINE / steps;
        (0..=steps)
            .map(|k| (&run.x[k] - &exact.x[k * each]).norm())
            .fold(0.0, f64::max)
    };
    let (e1, e2, e3) = (distance(400), distance(800), distance(1600));
    assert!(e3 < 5e-3 && e3 > 1e-6, "{e1} {e2} {e3}");
    for ratio in [e1 / e2, e2 / e3] {
        assert!((1.8..2.2).contains(&ratio), "{e1} {e2} {e3}");
    }
    // Unique by (12) with C = −1: motions from any two starts approach each other, step by step.
    let mut random = Random(47);
    let system = on_a_cut_disc();
    let steps = 200;
    for _ in 0..5 {
        let other = system.nearest(&(random.vector(2) * 2.0)).unwrap();
        let near = integrate(&system, (0.0, END), &other, steps).unwrap();
        let run = gradient_type(steps);
        for k in 1..=steps {
            let (before, after) = (
                (&run.x[k - 1] - &near.x[k - 1]).norm(),
                (&run.x[k] - &near.x[k]).norm(),
            );
            assert!(after <= before / (1.0 + END / steps as f64) + 1e-12);
        }
    }
}

/// Remark 4.10: outside a right-isolated set of event times the solution is real-analytic: finitely many modes here, and the implicit
/// steps change theirs within a step of the same times.
#[test]
fn remark_4_10_modes_change_at_isolated_times() {
    let exact = projected_motion();
    assert!((2..20).contains(&exact.events.len()), "{:?}", exact.events);
    assert!(exact.events.windows(2).all(|w| w[1].0 - w[0].0 > 1e-3));
    let h = END / FINE as f64;
    let run = gradient_type(FINE);
    let held = |u: &DVector<f64>| -> Vec<usize> { (0..2).filter(|&i| u[i] > 0.0).collect() };
    for k in 1..=FINE {
        let near = |(event, _): &(f64, Vec<usize>)| (event - run.t[k]).abs() < 3.0 * h;
        if !exact.events.iter().any(near) {
            assert_eq!(held(&run.lambda[k]), held(&exact.u[k]), "t = {}", run.t[k]);
        }
    }
}

/// Corollary 5.5, (26): the multipliers of (26c) at the points of the projected motion make its velocity (26a), vanish off the active
/// set (26b), and are those that the implicit steps come to as h falls.
#[test]
fn corollary_5_5_multipliers_of_the_trajectory_solve_26() {
    let exact = projected_motion();
    let system = on_a_cut_disc();
    let h = END / FINE as f64;
    let mut constrained = 0;
    for k in 1..FINE {
        let (before, at, after) = (&exact.x[k - 1], &exact.x[k], &exact.x[k + 1]);
        let calm = |t: f64| {
            exact
                .events
                .iter()
                .all(|(event, _)| (event - t).abs() > 2.0 * h)
        };
        if !calm(k as f64 * h) {
            continue;
        }
        let active = system.active(at);
        let force = -(turn() * at + dvector![1.0, 2.5]);
        let (velocity, u) = system.project_velocity(at, &force).unwrap();
        let rows = gradients(at).select_rows(&active);
        assert!((&velocity - (&force + rows.transpose() * &u)).norm() < 1e-12);
        let quotient = (after - before) / (2.0 * h);
        assert!((quotient - &velocity).norm() < 1e-4, "t = {}", k as f64 * h);
        for (&i, u) in active.iter().zip(u.iter()) {
            assert!((exact.u[k][i] - u).abs() < 1e-8);
        }
        constrained += usize::from(!active.is_empty());
    }
    assert!(constrained > FINE / 4);
    // u of the steps, away from the events.
    let distance = |steps: usize| {
        let run = gradient_type(steps);
        let each = FINE / steps;
        let away = |k: usize| {
            let t = run.t[k];
            exact
                .events
                .iter()
                .all(|(event, _)| (event - t).abs() > 4.0 * END / steps as f64)
        };
        (2..=steps)
            .filter(|&k| away(k))
            .map(|k| (&run.lambda[k] - &exact.u[k * each]).norm())
            .fold(0.0, f64::max)
    };
    let (u1, u2) = (distance(800), distance(1600));
    assert!(u2 < 2e-2 && u2 < 0.6 * u1, "{u1} {u2}");
}

/// Theorem 5.6: from every qualified point one motion starts. Of all subsets of the constraints at the corner exactly one set of
/// them (or several with the same motion) can be met without pulling or leaving, and the implicit steps go there.
#[test]
fn theorem_5_6_gradient_system_starts_uniquely_from_every_qualified_point() {
    let mut random = Random(56);
    let mut modes = std::collections::BTreeSet::new();
    for _ in 0..60 {
        let (m, c) = (random.matrix(2, 2), random.vector(2) * 2.0);
        let system = in_the_cut_disc(Map::affine(m.clone(), c.clone()));
        system.qualified(&corner()).unwrap();
        let v = |_: f64, x: &DVector<f64>| -(&m * x + &c);
        let flow = Projected {
            v: &v,
            c: &constraints,
            g: &gradients,
        };
        let starts = flow.starts(0.0, &corner());
        let (mode, end) = starts.first().expect("a motion starts");
        assert!(
            starts.iter().all(|(_, other)| (other - end).norm() < 1e-9),
            "{starts:?}"
        );
        let run = integrate(&system, (0.0, 1e-3), &corner(), 20).unwrap();
        assert!((run.last().unwrap() - end).norm() < 1e-5);
        modes.insert(mode.clone());
    }
    assert_eq!(modes.len(), 4, "{modes:?}");
}

/// Remark 4.11: the stationary points solve the variational inequality (13), a linear program, and (14).
#[test]
fn remark_4_11_stationary_points_solve_the_variational_inequality() {
    let mut random = Random(411);
    for _ in 0..20 {
        // A strongly monotone field on a polyhedron that contains 0 in its interior.
        let n = 3;
        let g = random.matrix(4, n);
        let h = DVector::from_element(4, 0.3);
        let skew = random.matrix(n, n);
        let field = Map::affine(
            &skew - skew.transpose() + DMatrix::identity(n, n),
            random.vector(n) * 3.0,
        );
        let system =
            ProjectedSystem::new(field.clone(), Map::affine(g.clone(), h.clone()), n).unwrap();
        let run = integrate(&system, (0.0, 60.0), &DVector::zeros(n), 300).unwrap();
        let rest = run.last().unwrap();
        assert!(system.velocity(rest).unwrap().norm() < 1e-6);
        // (13): F(x̄) is minimised over K at x̄ (a linear program), and (14) holds with the multipliers of the run.
        let force = (field.value)(rest);
        let best = minimise(&DMatrix::zeros(n, n), &force, &g, &h, 0);
        let bound = best.map_or(f64::NEG_INFINITY, |x| force.dot(&x));
        assert!(
            (force.dot(rest) - bound).abs() < 1e-5 * (1.0 + force.norm()),
            "{bound}"
        );
        let u = run.lambda.last().unwrap();
        assert!((g.transpose() * u - force).norm() < 1e-6);
    }
}
