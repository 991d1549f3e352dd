//! The projection of a velocity: (3), (5), Theorems 5.1 and 5.4, Proposition 5.2, Remark 5.3.

use circ::forms::Polyhedron;
use circ::forms::projected::{Map, ProjectedSystem};
use nalgebra::{DMatrix, DVector, dvector};

use super::super::Random;
use super::{corner, on_a_cut_disc};

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

/// (3): v − ⟨v, n*⟩n* with n* the inward unit normal that maximises ⟨v, −n⟩.
fn definition_3(polyhedron: &Polyhedron, x: &DVector<f64>, v: &DVector<f64>) -> DVector<f64> {
    let normals = polyhedron.g.select_rows(&polyhedron.active(x));
    steepest(&normals, v).map_or_else(|| v.clone(), |z| v - &z * v.dot(&z))
}

/// Inward normals of the cone at `x`, or of the cone itself, whose combinations make n(x) = −W°.
fn faces(normals: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
    (1..1_usize << normals.nrows())
        .map(|mask| {
            let face = (0..normals.nrows()).filter(|i| mask >> i & 1 == 1);
            normals.select_rows(&face.collect::<Vec<_>>()).transpose()
        })
        .collect()
}

/// z* of (19): the unit vector of W° that maximises ⟨v, z⟩, over its faces, without any projection; `None` if v ∈ W.
fn steepest(normals: &DMatrix<f64>, v: &DVector<f64>) -> Option<DVector<f64>> {
    let mut best: Option<(f64, DVector<f64>)> = None;
    for span in faces(normals) {
        let Some(gram) = (span.transpose() * &span).try_inverse() else {
            continue;
        };
        let weights = -(gram * span.transpose() * v);
        let z = -&span * &weights;
        if weights.iter().all(|&w| w >= 0.0) && z.norm() > 1e-12 {
            let gain = v.dot(&z.normalize());
            if best.as_ref().is_none_or(|(g, _)| gain > *g) {
                best = Some((gain, z.normalize()));
            }
        }
    }
    best.filter(|(gain, _)| *gain > 0.0).map(|(_, z)| z)
}

/// Proposition 5.2, (18)-(21), and Remark 5.3: w* = v − ⟨v, z*⟩z* with z* maximising over the polar cone; both parts lie in their
/// cones and are orthogonal, and min ‖w − v‖ = max ⟨v, z⟩.
#[test]
fn proposition_5_2_and_remark_5_3_moreau_decomposition() {
    let mut random = Random(52);
    let mut outside = 0;
    for _ in 0..60 {
        let cone = Polyhedron {
            g: random.matrix(3, 4),
            h: DVector::zeros(3),
        };
        let v = random.vector(4);
        let (w, mu) = cone.project(&v).unwrap();
        assert!(cone.contains(&w, 1e-12));
        let Some(z) = steepest(&cone.g, &v) else {
            assert!((&v - &w).norm() < 1e-12, "v ∈ W stays");
            continue;
        };
        outside += 1;
        // (20), (21).
        assert!((&v - &z * v.dot(&z) - &w).norm() < 1e-10);
        assert!(((&w - &v).norm() - v.dot(&z)).abs() < 1e-10);
        // Remark 5.3: w ⟂ z, and ⟨v, z⟩z is the projection onto W°, a nonnegative combination of −g.
        assert!(w.dot(&z).abs() < 1e-10);
        assert!((&v - &w + cone.g.transpose() * &mu).norm() < 1e-10 && mu.min() >= 0.0);
        // (19): no other vector of the ball in W° does better.
        for _ in 0..50 {
            let other = -(cone.g.transpose() * random.vector(3).map(f64::abs)).normalize();
            assert!(v.dot(&other) <= v.dot(&z) + 1e-12);
        }
        // The minimiser by the interior point method is the same.
        assert!((cone.nearest(&v).unwrap() - &w).norm() < 1e-5);
    }
    assert!(outside > 20);
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
    for (x, v) in [
        (dvector![0.6, 0.8], dvector![1.0, 0.3]),
        (corner(), dvector![1.0, -2.0]),
        (corner(), dvector![-1.0, -2.0]),
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
