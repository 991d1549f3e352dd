//! Acary, Brogliato, Daniilidis, Lemaréchal 2004 (RR-5107): equivalence of projected, complementarity and unilateral systems.

use circ::forms::projected::Map;
use circ::forms::unilateral::Unilateral;
use circ::forms::{Polyhedron, constant, integrate};
use nalgebra::{DVector, dmatrix, dvector};

use super::Random;

/// f(x) = x − (2, 1) + rotation (monotone), C = {‖x‖² ≤ 1, x₁ ≤ 1/2}.
fn problem() -> Unilateral {
    let f = Map::affine(dmatrix![1.0, 1.0; -1.0, 1.0], dvector![-2.0, -1.0]);
    let h = Map::new(
        |x| dvector![x.norm_squared() - 1.0, x[0] - 0.5],
        |x| dmatrix![2.0 * x[0], 2.0 * x[1]; 1.0, 0.0],
    );
    Unilateral::new(f, constant(dvector![0.0, 0.5]), &h, 2).unwrap()
}

/// Points of the boundary of C: on the disc, on the line, at the corner.
fn boundary() -> [DVector<f64>; 3] {
    [
        dvector![-0.6, 0.8],
        dvector![0.5, 0.2],
        dvector![0.5, 0.75_f64.sqrt()],
    ]
}

fn random_cone(random: &mut Random, n: usize) -> Polyhedron {
    let rows = 1 + random.below(n);
    Polyhedron {
        g: random.matrix(rows, n),
        h: DVector::zeros(rows),
    }
}

#[test]
fn proposition_1_projected_velocity_is_the_limit_of_quotients() {
    let mut random = Random(1);
    for _ in 0..30 {
        let polyhedron = Polyhedron {
            g: random.matrix(4, 3),
            h: random.vector(4).map(f64::abs),
        };
        let x = polyhedron.project(&(random.vector(3) * 5.0)).unwrap().0;
        let v = random.vector(3);
        let delta = 1e-4;
        let quotient = (polyhedron.project(&(&x + &v * delta)).unwrap().0 - &x) / delta;
        let tangent = polyhedron.tangent(&x).project(&v).unwrap().0;
        assert!((quotient - tangent).norm() < 1e-5 * (1.0 + x.norm()));
    }
}

#[test]
fn lemma_1_and_corollary_1_the_normal_that_maximises() {
    let mut random = Random(11);
    for _ in 0..30 {
        let tangent = random_cone(&mut random, 3);
        let v = random.vector(3);
        let onto_tangent = tangent.project(&v).unwrap().0;
        let onto_normal = &v - &onto_tangent;
        if onto_normal.norm() < 1e-9 {
            continue;
        }
        let best = onto_normal.normalize();
        // proj_N(v)/‖proj_N(v)‖ beats every other unit vector of N = {−Gᵀμ}.
        for _ in 0..50 {
            let mu = random.vector(tangent.g.nrows()).map(f64::abs);
            let other = -(tangent.g.transpose() * mu);
            assert!(v.dot(&other.normalize()) <= v.dot(&best) + 1e-9);
        }
        assert!((&v - &best * v.dot(&best) - onto_tangent).norm() < 1e-9);
    }
}

#[test]
fn proposition_2_four_characterisations_of_a_projection() {
    let mut random = Random(2);
    for _ in 0..40 {
        let cone = random_cone(&mut random, 3);
        let v = random.vector(3);
        let s = cone.project(&v).unwrap().0;
        let polar = |w: &DVector<f64>| cone.project(w).unwrap().0.norm();
        let fulfils = |s: &DVector<f64>| {
            let b = cone.contains(s, 1e-9) && cone.distance_to_normal(s, &(&v - s)).unwrap() < 1e-7;
            let c =
                cone.contains(s, 1e-9) && polar(&(&v - s)) < 1e-7 && (&v - s).dot(s).abs() < 1e-7;
            // (4d): ‖s‖² ≤ ⟨s, v − ν⟩ for all ν ∈ K°, whose generators are the rows of −G (and 0).
            let generators = cone.g.row_iter().all(|g| s.dot(&(-g.transpose())) <= 1e-9);
            let d = polar(&(&v - s)) < 1e-7 && generators && s.norm_squared() <= s.dot(&v) + 1e-7;
            [b, c, d]
        };
        assert_eq!(fulfils(&s), [true; 3]);
        // Another vector fulfils none of them.
        let other = &s + random.vector(3) * 0.3;
        if (&other - &s).norm() > 0.05 {
            assert_eq!(fulfils(&other), [false; 3]);
        }
    }
}

#[test]
fn corollary_2_slow_velocity_is_the_one_of_least_norm() {
    let problem = problem();
    for x in boundary() {
        problem.qualified(&x).unwrap();
        let slow = problem.slow_velocity(0.0, &x).unwrap();
        assert!(
            problem
                .distance_to_tangent_inclusion(0.0, &x, &slow)
                .unwrap()
                < 1e-8
        );
        assert!(problem.distance_to_inclusion(0.0, &x, &slow).unwrap() < 1e-8);
        // Other elements of −f − g − N_C(x) fulfil (UDI-C) but not (UDI-T_C), and are longer.
        let gradients = problem.tangent(&x).g;
        for mu in [0.5, 2.0] {
            let other =
                &slow + gradients.transpose() * DVector::from_element(gradients.nrows(), mu);
            assert!(problem.distance_to_inclusion(0.0, &x, &other).unwrap() < 1e-8);
            assert!(
                problem
                    .distance_to_tangent_inclusion(0.0, &x, &other)
                    .unwrap()
                    > 1e-2
            );
            assert!(other.norm() > slow.norm() - 1e-12);
        }
        // (iii)₁: x' = v − proj_N(v).
        let v = problem.free_velocity(0.0, &x);
        let normal_part = &v - problem.tangent(&x).project(&v).unwrap().0;
        assert!((&v - normal_part - slow).norm() < 1e-9);
    }
}

#[test]
fn proposition_3_complementarity_and_inclusion_agree_where_qualified() {
    let problem = problem();
    let mut random = Random(3);
    for x in boundary() {
        for _ in 0..10 {
            let gradients = problem.tangent(&x).g;
            let lambda = random.vector(gradients.nrows()).map(f64::abs);
            // (CDS) with this λ is an element of (UDI-C) …
            let velocity = problem.free_velocity(0.0, &x) + gradients.transpose() * &lambda;
            assert!(problem.distance_to_inclusion(0.0, &x, &velocity).unwrap() < 1e-8);
            // … and the multiplier is recovered from the velocity.
            let found = problem.multiplier(0.0, &x, &velocity).unwrap();
            assert!((gradients.transpose() * (&found - &lambda)).norm() < 1e-7);
        }
        // A velocity pushed outwards is in neither.
        let outward = problem.free_velocity(0.0, &x) - problem.tangent(&x).g.row(0).transpose();
        assert!(problem.distance_to_inclusion(0.0, &x, &outward).unwrap() > 1e-2);
    }
}

#[test]
fn unqualified_inclusion_has_more_solutions_than_the_complementarity_system() {
    // h(x) = x² describes C = {0} without a qualification: ∇h(0) = 0, so N^h(0) = {0} while N_C(0) = R.
    let f = Map::affine(dmatrix![1.0], dvector![1.0]);
    let h = Map::new(|x| dvector![x[0] * x[0]], |x| dmatrix![2.0 * x[0]]);
    let squared = Unilateral::new(f.clone(), constant(dvector![0.0]), &h, 1).unwrap();
    let origin = dvector![0.0];
    assert!(squared.qualified(&origin).is_err());
    // x ≡ 0 solves (UDI-C) with the true normal cone of C = {0} = {x ≥ 0, −x ≥ 0} …
    let both = Map::affine(dmatrix![1.0; -1.0], dvector![0.0, 0.0]);
    let exact = Unilateral::new(f, constant(dvector![0.0]), &both, 1).unwrap();
    assert!(exact.distance_to_inclusion(0.0, &origin, &origin).unwrap() < 1e-9);
    // … but not (CDS): −0 = f(0) + 0·λ would need f(0) = 0.
    let distance = squared
        .distance_to_inclusion(0.0, &origin, &origin)
        .unwrap();
    assert!((distance - 1.0).abs() < 1e-9);
}

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

#[test]
fn theorem_2_all_problems_have_the_same_solution() {
    let problem = problem();
    let x0 = dvector![-0.9, 0.0];
    let steps = 4000;
    let h = 2.0 / steps as f64;
    // (CDS) by the implicit step; (PDS) = (UDI-T_C) by explicit steps of the slow velocity, kept in C by rescaling.
    let run = integrate(&problem, (0.0, 2.0), &x0, steps).unwrap();
    let mut x = x0;
    for k in 0..steps {
        x += problem.slow_velocity(k as f64 * h, &x).unwrap() * h;
        x[0] = x[0].min(0.5);
        if x.norm() > 1.0 {
            x /= x.norm();
        }
        if x[0] >= 0.5 - 1e-12 && x.norm() >= 1.0 - 1e-9 {
            x = dvector![0.5, 0.75_f64.sqrt()];
        }
        assert!((&x - &run.x[k + 1]).norm() < 2e-2, "t = {}", run.t[k + 1]);
    }
}
