//! Section 2.3: constraints, their qualification, and λᵀẇ = 0.

use circ::forms::projected::Map;
use circ::forms::unilateral::Unilateral;
use circ::forms::{constant, integrate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::Random;
use super::{boundary, problem};

/// {Gx ≤ b} with f = 0, g = 0.
fn polyhedral(g: DMatrix<f64>, b: DVector<f64>) -> Unilateral {
    let n = g.ncols();
    let still = Map::affine(DMatrix::zeros(n, n), DVector::zeros(n));
    Unilateral::new(still, constant(DVector::zeros(n)), &Map::affine(g, -b), n).unwrap()
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

/// (QC.1) is dual to (QC.2): a common inward direction exists iff no convex combination of the active gradients vanishes. (QC.3) is
/// more than either: three constraints in the plane are dependent and may still be qualified.
#[test]
fn qualifications_1_and_2_are_dual_and_3_is_more() {
    let mut random = Random(23);
    let (mut qualified, mut dependent) = (0, 0);
    for _ in 0..60 {
        let problem = polyhedral(random.matrix(3, 2), DVector::zeros(3));
        let origin = dvector![0.0, 0.0];
        let one = problem.qualified(&origin).is_ok();
        assert_eq!(one, problem.shortest_combination(&origin) > 1e-4);
        qualified += usize::from(one);
        assert!(problem.independent(&origin).is_err(), "three in the plane");
        dependent += usize::from(one);
    }
    assert!(
        (10..50).contains(&qualified) && dependent == qualified,
        "{qualified}"
    );
    for _ in 0..20 {
        let problem = polyhedral(random.matrix(2, 3), DVector::zeros(2));
        let origin = DVector::zeros(3);
        problem.independent(&origin).unwrap();
        problem.qualified(&origin).unwrap();
        assert!(problem.shortest_combination(&origin) > 1e-4);
    }
    // Nothing active, nothing to ask.
    let inside = polyhedral(dmatrix![1.0, 0.0], dvector![1.0]);
    inside.qualified(&dvector![0.0, 0.0]).unwrap();
    assert_eq!(
        inside.shortest_combination(&dvector![0.0, 0.0]),
        f64::INFINITY
    );
}

/// (QC.4), Slater, for convex h: a point with h < 0 is found iff there is one, and then (QC.1) holds at every point of C.
#[test]
fn qualification_4_is_qualification_1_everywhere() {
    // Two discs of radius 1 with centres 2c apart: a lens for c < 1, a point for c = 1, nothing beyond.
    let lens = |c: f64| {
        let h = Map::new(
            move |x| {
                let (a, b) = (dvector![x[0] - c, x[1]], dvector![x[0] + c, x[1]]);
                dvector![a.norm_squared() - 1.0, b.norm_squared() - 1.0]
            },
            move |x| dmatrix![2.0 * (x[0] - c), 2.0 * x[1]; 2.0 * (x[0] + c), 2.0 * x[1]],
        );
        let still = Map::affine(DMatrix::zeros(2, 2), DVector::zeros(2));
        Unilateral::new(still, constant(dvector![0.0, 0.0]), &h, 2).unwrap()
    };
    for c in [0.3, 0.9, 0.99] {
        for start in [dvector![3.0, -4.0], dvector![0.0, 0.9]] {
            let point = lens(c).slater(&start).expect("a lens has an inside");
            assert!((point[0].abs() + c).hypot(point[1]) < 1.0);
        }
        let tip = dvector![0.0, (1.0 - c * c).sqrt()];
        lens(c).qualified(&tip).unwrap();
    }
    for c in [1.0, 1.1] {
        assert_eq!(lens(c).slater(&dvector![3.0, -4.0]), None);
    }
    // At the point of contact the gradients are opposite.
    let contact = dvector![0.0, 0.0];
    assert!(lens(1.0).qualified(&contact).is_err());
    assert!(lens(1.0).shortest_combination(&contact) < 1e-4);
    // The other tests' set has an inside.
    assert!(problem().slater(&dvector![5.0, 5.0]).is_some());
}

/// Proposition 3 under (QC.1) alone: at the tip of a pyramid with four faces the gradients are dependent, λ is not unique, and (CDS)
/// is (UDI-C) all the same.
#[test]
fn proposition_3_with_dependent_gradients() {
    let g = dmatrix![1.0, 0.0, 1.0; -1.0, 0.0, 1.0; 0.0, 1.0, 1.0; 0.0, -1.0, 1.0];
    let problem = polyhedral(g.clone(), DVector::zeros(4));
    let tip = DVector::zeros(3);
    assert!(problem.independent(&tip).is_err());
    problem.qualified(&tip).unwrap();
    let mut random = Random(33);
    for _ in 0..20 {
        let lambda = random.vector(4).map(f64::abs);
        let velocity = -(g.transpose() * &lambda);
        // N_C(tip) = {ν : ν₃ ≥ |ν₁| + … } by hand: ⟨ν, y⟩ ≤ 0 for the edges y = (±1, ±1, −1) of C.
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            assert!((-&velocity).dot(&dvector![a, b, -1.0]) <= 1e-12);
        }
        assert!(problem.distance_to_inclusion(0.0, &tip, &velocity).unwrap() < 1e-8);
        let found = problem.multiplier(0.0, &tip, &velocity).unwrap();
        assert!((g.transpose() * (&found - &lambda)).norm() < 1e-7 && found.min() >= 0.0);
    }
}

/// Section 3: for velocities of (UDI-C) that stay in the tangent cone, λᵀẇ = 0 iff the velocity is slow; otherwise it is negative.
#[test]
fn lambda_w_dot_vanishes_iff_the_velocity_is_slow() {
    let problem = problem();
    let mut random = Random(31);
    let mut others = 0;
    for x in boundary() {
        let slow = problem.slow_velocity(0.0, &x).unwrap();
        assert!(problem.constraint_power(0.0, &x, &slow).abs() < 1e-12);
        let inward = problem.tangent(&x).g;
        for _ in 0..20 {
            // v + Gᵀλ, the velocity of any λ ≥ 0; those that leave C are no velocities of a motion in C.
            let lambda = random.vector(inward.nrows()).map(|v| 3.0 * v.abs());
            let velocity = problem.free_velocity(0.0, &x) + inward.transpose() * &lambda;
            let w_dot = -(&inward * &velocity);
            let power = problem.constraint_power(0.0, &x, &velocity);
            assert!((power - lambda.dot(&w_dot)).abs() < 1e-12);
            if w_dot.max() <= 0.0 && (&velocity - &slow).norm() > 1e-3 {
                assert!(power < -1e-6, "{power}");
                others += 1;
            }
        }
    }
    assert!(others > 10, "{others}");
}

/// Section 2.3: S(UDI-C) ⊋ S(CDS) without qualification.
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
    // Nor do the steps of (CDS) find a motion, while those of the qualified description rest.
    assert!(integrate(&squared, (0.0, 1.0), &origin, 10).is_err());
    let still = integrate(&exact, (0.0, 1.0), &origin, 10).unwrap();
    assert!(still.x.iter().all(|x| x[0].abs() < 1e-12));
}
