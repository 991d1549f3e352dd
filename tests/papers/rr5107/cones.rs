//! Section 2.1 and 2.2: projections onto cones, (PDS), (UDI-T_C) and the slow velocity.

use circ::forms::Polyhedron;
use nalgebra::DVector;

use super::super::Random;
use super::{boundary, nearest, problem};

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
    // On the curved set as well, with its nearest point by hand.
    let problem = problem();
    for x in boundary() {
        let v = problem.free_velocity(0.0, &x);
        let delta = 1e-7;
        let quotient = (nearest(&(&x + &v * delta)) - &x) / delta;
        assert!((quotient - problem.slow_velocity(0.0, &x).unwrap()).norm() < 1e-5);
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
