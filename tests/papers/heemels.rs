//! Heemels, Schumacher, Weiland 2000: projected dynamical systems in a complementarity formalism.
//!
//! K = {h ≥ 0} is convex for concave h (the paper's "convex" is a misprint).

use circ::check::program::minimise;
use circ::forms::projected::{Map, ProjectedSystem};
use circ::forms::{Complementarity, Polyhedron, integrate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::Random;

/// F(x) = x − target + a rotation, on the unit disc cut by x₂ ≥ −1/2: drives the state into and along the boundary.
fn on_a_cut_disc() -> ProjectedSystem {
    let turn = dmatrix![1.0, -2.0; 2.0, 1.0];
    let field = Map::affine(turn, dvector![1.0, 2.5]);
    let set = Map::new(
        |x| dvector![1.0 - x.norm_squared(), x[1] + 0.5],
        |x| dmatrix![-2.0 * x[0], -2.0 * x[1]; 0.0, 1.0],
    );
    ProjectedSystem::new(field, set, 2).unwrap()
}

/// A polyhedron with a point on `active` of its facets, and the projected system on it.
fn random_corner(
    random: &mut Random,
    n: usize,
    active: usize,
) -> (ProjectedSystem, Polyhedron, DVector<f64>) {
    let g = random.matrix(active + 1, n);
    let x = random.vector(n);
    let mut h = -(&g * &x);
    h[active] += 1.0;
    let field = Map::affine(random.matrix(n, n), random.vector(n));
    let system = ProjectedSystem::new(field, Map::affine(g.clone(), h.clone()), n).unwrap();
    (system, Polyhedron { g, h }, x)
}

/// x' = Π_K(x, −F(x)) by small explicit steps followed by the nearest point, an implementation of its own.
fn projected_flow(
    system: &ProjectedSystem,
    mut x: DVector<f64>,
    end: f64,
    steps: usize,
) -> DVector<f64> {
    let h = end / steps as f64;
    for _ in 0..steps {
        let free = &x + system.velocity(&x).unwrap() * h;
        x = system.nearest(&free).unwrap();
    }
    x
}

#[test]
fn theorem_4_7_projected_and_gradient_systems_have_the_same_trajectory() {
    let system = on_a_cut_disc();
    let x0 = dvector![0.3, 0.6];
    let mut distances = Vec::new();
    for steps in [400, 800, 1600] {
        let gradient = integrate(&system, (0.0, 3.0), &x0, steps).unwrap();
        let projected = projected_flow(&system, x0.clone(), 3.0, steps);
        distances.push((gradient.last().unwrap() - projected).norm());
        // The trajectory uses both constraints, so the statement is not tested on a free motion.
        let touched = |i: usize| gradient.lambda.iter().any(|u| u[i] > 1e-3);
        assert!(touched(0) && touched(1));
    }
    // Two schemes of first order for one solution: their distance vanishes with the step.
    assert!(
        distances[2] < 1e-2 && distances[2] < 0.75 * distances[0] || distances[2] < 1e-6,
        "{distances:?}"
    );
}

#[test]
fn theorem_5_1_projection_is_the_nearest_admissible_velocity() {
    let mut random = Random(51);
    for _ in 0..50 {
        let n = 2 + random.below(3);
        let active = 1 + random.below(n);
        let (system, polyhedron, x) = random_corner(&mut random, n, active);
        let v = random.vector(n);
        let by_definition = definition_3(&polyhedron, &x, &v);
        // (15): the minimiser of ‖w − v‖ over W(x), by an interior point method.
        let nearest = system.admissible(&x).nearest(&v).unwrap();
        assert!(
            (&by_definition - &nearest).norm() < 1e-5,
            "{by_definition} {nearest}"
        );
        assert!((system.project_velocity(&x, &v).unwrap().0 - nearest).norm() < 1e-5);
    }
}

/// (3): v − ⟨v, n*⟩n* with n* the inward unit normal that maximises ⟨v, −n⟩, found without any projection: over the faces
/// of the normal cone, the maximiser is −v's component in their span.
fn definition_3(polyhedron: &Polyhedron, x: &DVector<f64>, v: &DVector<f64>) -> DVector<f64> {
    let normals = polyhedron.g.select_rows(&polyhedron.active(x));
    let mut best: Option<(f64, DVector<f64>)> = None;
    for mask in 1..1_usize << normals.nrows() {
        let face: Vec<usize> = (0..normals.nrows())
            .filter(|i| mask >> i & 1 == 1)
            .collect();
        let span = normals.select_rows(&face).transpose();
        let Some(gram) = (span.transpose() * &span).try_inverse() else {
            continue;
        };
        let weights = -(gram * span.transpose() * v);
        if weights.iter().any(|&w| w < 0.0) {
            continue;
        }
        let n = &span * weights;
        if n.norm() > 1e-12 {
            let n = n.normalize();
            let gain = -v.dot(&n);
            if best.as_ref().is_none_or(|(g, _)| gain > *g) {
                best = Some((gain, n));
            }
        }
    }
    match best {
        Some((gain, n)) if gain > 0.0 => v - &n * v.dot(&n),
        _ => v.clone(),
    }
}

#[test]
fn proposition_5_2_and_remark_5_3_moreau_decomposition() {
    let mut random = Random(52);
    for _ in 0..30 {
        let cone = Polyhedron {
            g: random.matrix(3, 4),
            h: DVector::zeros(3),
        };
        let v = random.vector(4);
        let w = cone.nearest(&v).unwrap();
        let polar = &v - &w;
        // w* = v − ⟨v, z*⟩z* with z* the unit vector of the polar part, orthogonal to w*.
        if polar.norm() > 1e-6 {
            let z = polar.normalize();
            assert!((&v - &z * v.dot(&z) - &w).norm() < 1e-5);
        }
        assert!(w.dot(&polar).abs() < 1e-6);
    }
}

#[test]
fn theorem_5_4_projection_solves_the_complementarity_problem() {
    let mut random = Random(54);
    for _ in 0..50 {
        let n = 2 + random.below(3);
        let active = 1 + random.below(n);
        let (system, polyhedron, x) = random_corner(&mut random, n, active);
        let v = random.vector(n);
        let (projected, u) = system.project_velocity(&x, &v).unwrap();
        let h = polyhedron.g.select_rows(&polyhedron.active(&x));
        let y = &h * &v + &h * h.transpose() * &u;
        assert!(u.iter().chain(y.iter()).all(|&c| c >= -1e-9) && u.dot(&y).abs() < 1e-9);
        assert!((&projected - (&v + h.transpose() * &u)).norm() < 1e-12);
        assert!((projected - definition_3(&polyhedron, &x, &v)).norm() < 1e-8);
    }
}

#[test]
fn equation_5_the_limit_of_projected_quotients_is_the_same_operator() {
    let system = on_a_cut_disc();
    let corner = dvector![0.75_f64.sqrt(), -0.5];
    for (x, v) in [
        (dvector![0.6, 0.8], dvector![1.0, 0.3]),
        (corner.clone(), dvector![1.0, -2.0]),
        (corner, dvector![-1.0, -2.0]),
        (dvector![0.1, 0.2], dvector![1.0, 1.0]),
    ] {
        let delta = 1e-6;
        let quotient = (system.nearest(&(&x + &v * delta)).unwrap() - &x) / delta;
        let projected = system.project_velocity(&x, &v).unwrap().0;
        assert!(
            (&quotient - &projected).norm() < 1e-4,
            "{quotient} {projected}"
        );
    }
}

#[test]
fn corollary_5_5_multipliers_of_the_trajectory_solve_26() {
    let system = on_a_cut_disc();
    let steps = 3000;
    let run = integrate(&system, (0.0, 3.0), &dvector![0.3, 0.6], steps).unwrap();
    let h = 3.0 / steps as f64;
    let mut constrained = 0;
    for k in 1..run.t.len() {
        let velocity = (&run.x[k] - &run.x[k - 1]) / h;
        let u = &run.lambda[k];
        // (26a) and complementarity with h(x).
        let jacobian = system.constraint_jacobian(0.0, &run.x[k]);
        let expected = system.drift(0.0, &run.x[k]) + jacobian.transpose() * u;
        assert!((&velocity - expected).norm() < 1e-8);
        assert!(
            u.iter()
                .zip(run.y[k].iter())
                .all(|(&u, &y)| u >= 0.0 && y > -1e-9 && u * y < 1e-8)
        );
        // (26c) away from the moments of impact: the velocity is Π_K(x, −F(x)).
        if k > 1
            && run.lambda[k - 1]
                .iter()
                .zip(u.iter())
                .all(|(a, b)| (*a > 0.0) == (*b > 0.0))
            && u.amax() > 0.0
        {
            constrained += 1;
            let projected = system.velocity(&run.x[k]).unwrap();
            assert!((&velocity - projected).norm() < 2e-2, "step {k}");
        }
    }
    assert!(constrained > steps / 4);
}

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

#[test]
fn theorem_5_6_gradient_system_starts_uniquely_from_every_qualified_point() {
    let system = on_a_cut_disc();
    let corner = dvector![0.75_f64.sqrt(), -0.5];
    system.qualified(&corner).unwrap();
    // Two step sizes from the corner agree to first order.
    let fine = integrate(&system, (0.0, 0.2), &corner, 800).unwrap();
    let coarse = integrate(&system, (0.0, 0.2), &corner, 200).unwrap();
    assert!((fine.last().unwrap() - coarse.last().unwrap()).norm() < 5e-3);
    // Without Assumption 4.2 the condition is reported: three active constraints in the plane.
    let doubled = Map::affine(
        dmatrix![1.0, 0.0; 1.0, 0.0; 0.0, 1.0],
        dvector![0.0, 0.0, 0.0],
    );
    let dependent = ProjectedSystem::new(
        Map::affine(DMatrix::identity(2, 2), DVector::zeros(2)),
        doubled,
        2,
    )
    .unwrap();
    assert!(dependent.qualified(&DVector::zeros(2)).is_err());
}
