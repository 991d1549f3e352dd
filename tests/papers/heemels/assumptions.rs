//! Assumptions 4.1 to 4.5 one by one, with what is lost without them (Remarks 4.8 and 4.9).

use circ::forms::projected::{Map, ProjectedSystem};
use circ::forms::{FormError, integrate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::Random;
use super::{corner, in_the_cut_disc, on_a_cut_disc, turn};

fn points(random: &mut Random, n: usize, count: usize) -> Vec<DVector<f64>> {
    (0..count).map(|_| random.vector(n)).collect()
}

/// Assumption 4.1 (with "convex" read as concave): h lies under its linearisations, so that K is convex.
#[test]
fn assumption_4_1_concave_constraints() {
    let mut random = Random(41);
    let points = points(&mut random, 2, 30);
    on_a_cut_disc().concave(&points).unwrap();
    // Printed "convex": h = ‖x‖² − 1 is the outside of the disc.
    let outside = Map::new(
        |x| dvector![x.norm_squared() - 1.0],
        |x| dmatrix![2.0 * x[0], 2.0 * x[1]],
    );
    let field = Map::affine(DMatrix::identity(2, 2), dvector![0.0, 0.0]);
    let hole = ProjectedSystem::new(field, outside, 2).unwrap();
    let Err(FormError::Hypothesis {
        condition, size, ..
    }) = hole.concave(&points)
    else {
        panic!("not concave");
    };
    assert!(condition.contains("Assumption 4.1"));
    // h(y) − h(x) − ∇h(x)(y − x) = ‖y − x‖².
    let mut widest = 0.0_f64;
    for x in &points {
        for y in &points {
            widest = widest.max((y - x).norm_squared());
        }
    }
    assert!((size / widest - 1.0).abs() < 1e-12);
}

/// Assumption 4.2: independent gradients of the active constraints; refused where they depend on each other.
#[test]
fn assumption_4_2_independent_gradients() {
    on_a_cut_disc().qualified(&corner()).unwrap();
    let doubled = Map::affine(dmatrix![1.0, 0.0; 1.0, 0.0; 0.0, 1.0], DVector::zeros(3));
    let field = Map::affine(DMatrix::identity(2, 2), DVector::zeros(2));
    let dependent = ProjectedSystem::new(field, doubled, 2).unwrap();
    for x in [dvector![0.0, 0.0], dvector![0.0, 1.0]] {
        assert!(dependent.qualified(&x).is_err());
    }
    dependent.qualified(&dvector![1.0, 0.0]).unwrap();
}

/// Remark 4.9: a Jacobian of locally constant rank will do. A constraint written twice changes u, not x.
#[test]
fn remark_4_9_a_constraint_written_twice() {
    let single = on_a_cut_disc();
    let doubled = Map::new(
        |x| {
            let disc = 1.0 - x.norm_squared();
            dvector![disc, x[1] + 0.5, 2.0 * disc]
        },
        |x| dmatrix![-2.0 * x[0], -2.0 * x[1]; 0.0, 1.0; -4.0 * x[0], -4.0 * x[1]],
    );
    let doubled = ProjectedSystem::new(single.field.clone(), doubled, 2).unwrap();
    let run =
        |system: &ProjectedSystem| integrate(system, (0.0, 3.0), &dvector![0.3, 0.6], 300).unwrap();
    let (one, two) = (run(&single), run(&doubled));
    for k in 0..=300 {
        assert!((&one.x[k] - &two.x[k]).norm() < 1e-9);
        let together = two.lambda[k][0] + 2.0 * two.lambda[k][2];
        assert!(
            (one.lambda[k][0] - together).abs() < 1e-7,
            "u₀ = u₀' + 2u₂'"
        );
    }
    assert!(one.lambda.iter().any(|u| u[0] > 0.1));
}

/// Assumptions 4.3 to 4.5 for the field of the other tests: (11) with the least B, (12) with C = −1 for every pair.
#[test]
fn assumptions_4_4_and_4_5_of_an_affine_field() {
    let mut random = Random(44);
    let points = points(&mut random, 2, 40);
    let system = on_a_cut_disc();
    // ⟨−F(x) + F(y), x − y⟩ = −‖x − y‖² exactly, for the rotation does not count.
    assert!((system.one_sided(&points) + 1.0).abs() < 1e-12);
    let bound = system.growth(&points);
    assert!(
        points
            .iter()
            .all(|x| (turn() * x + dvector![1.0, 2.5]).norm() <= bound * (1.0 + x.norm()) + 1e-12)
    );
    let attained = points
        .iter()
        .any(|x| (turn() * x + dvector![1.0, 2.5]).norm() > 0.999 * bound * (1.0 + x.norm()));
    assert!(attained);
}

/// Remark 4.8: without (11) solutions are the same and unique as long as they exist. x' = x² escapes at T = 1/x₀, along a
/// constraint as inside.
#[test]
fn remark_4_8_a_solution_that_escapes() {
    // F(x) = −(x₁², 1) on x₂ ≤ 0: x₁ = 1/(2 − t), held at x₂ = 0.
    let field = Map::new(
        |x| dvector![-x[0] * x[0], -1.0],
        |x| dmatrix![-2.0 * x[0], 0.0; 0.0, 0.0],
    );
    let set = Map::affine(dmatrix![0.0, -1.0], dvector![0.0]);
    let system = ProjectedSystem::new(field, set, 2).unwrap();
    let start = dvector![0.5, 0.0];
    let error = |steps: usize| {
        let run = integrate(&system, (0.0, 1.5), &start, steps).unwrap();
        assert!(run.lambda.iter().skip(1).all(|u| (u[0] - 1.0).abs() < 1e-9));
        let exact = |t: f64| 1.0 / (2.0 - t);
        run.t
            .iter()
            .zip(&run.x)
            .map(|(&t, x)| (x[0] - exact(t)).abs())
            .fold(0.0, f64::max)
    };
    let (e1, e2) = (error(2000), error(4000));
    assert!(e2 < 2.5e-3 && (1.9..2.1).contains(&(e1 / e2)), "{e1} {e2}");
    // Beyond T there is nothing to find, and the steps say so.
    let beyond = integrate(&system, (0.0, 2.5), &start, 1000);
    assert!(
        matches!(beyond, Err(FormError::Step { t, .. }) if (1.8..2.2).contains(&t)),
        "{beyond:?}"
    );
    // (11) is what fails: the least B grows with the points it is looked for at.
    let at = |size: f64| system.growth(&[dvector![size, 0.0]]);
    assert!(at(1e3) > 5.0 * at(1e2) && at(1e2) > 5.0 * at(1e1));
}

/// Without (12) one start has several solutions: F(x) = −2√x on K = R₊ has x = 0 and x = t² from 0.
#[test]
fn without_assumption_4_5_solutions_part() {
    let field = Map::new(
        |x| dvector![-2.0 * x[0].max(0.0).sqrt()],
        |x| dmatrix![-1.0 / x[0].max(1e-12).sqrt()],
    );
    let system = ProjectedSystem::new(field, Map::affine(dmatrix![1.0], dvector![0.0]), 1).unwrap();
    for t in [0.0, 0.3, 1.0] {
        assert_eq!(system.velocity(&dvector![0.0]).unwrap()[0], 0.0);
        let velocity = system.velocity(&dvector![t * t]).unwrap()[0];
        assert!((velocity - 2.0 * t).abs() < 1e-12);
    }
    // C of (12) between 0 and ε² is 2/ε.
    for e in [1e-1, 1e-2, 1e-3_f64] {
        let c = system.one_sided(&[dvector![0.0], dvector![e * e]]);
        assert!((c * e - 2.0).abs() < 1e-9, "{c}");
    }
    // On the cut disc a field with (12) has none of this.
    assert!(
        in_the_cut_disc(Map::affine(turn(), dvector![0.0, 0.0]))
            .one_sided(&[dvector![0.0, 0.0], dvector![0.1, 0.0]])
            < 0.0
    );
}
