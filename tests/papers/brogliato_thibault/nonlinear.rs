//! Section 4, smooth motions: Examples 4.5 and 4.6, the state map and (38).

use std::rc::Rc;

use circ::forms::nonlinear::NonlinearComplementarity;
use circ::forms::projected::Map;
use circ::forms::sweeping::SweepingProcess;
use circ::forms::{constant, integrate, step};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::Random;
use super::gradient_type;

/// (54) with its storage V = x²/2.
fn example_4_5(u: impl Fn(f64) -> f64 + Clone + 'static) -> NonlinearComplementarity {
    let (v, w) = (u.clone(), u.clone());
    NonlinearComplementarity {
        field: Rc::new(move |t, x| dvector![-x[0].powi(3) + (x[0] * x[0] + 1.0) * u(t)]),
        field_jacobian: Rc::new(move |t, x| dmatrix![-3.0 * x[0] * x[0] + 2.0 * x[0] * v(t)]),
        b: dmatrix![1.0],
        c: Map::affine(dmatrix![1.0], dvector![0.0]),
        g: Rc::new(move |t| dvector![w(t).sin()]),
        hessian: Rc::new(|_| dmatrix![1.0]),
    }
}

#[test]
fn example_4_5_scalar_system_with_cubic_drift() {
    let points: Vec<DVector<f64>> = (-5..6).map(|k| dvector![f64::from(k) * 0.5]).collect();
    // Without input: x' = −x³, x(t) = x₀/√(1 + 2x₀²t), never touching the constraint.
    let free = example_4_5(|_| 0.0);
    free.check_storage(&points).unwrap();
    assert_eq!(free.prox_regularity(&points, 0.0).unwrap(), f64::INFINITY);
    let run = integrate(&free, (0.0, 2.0), &dvector![1.5], 20_000).unwrap();
    let exact = 1.5 / (1.0 + 2.0 * 1.5 * 1.5 * 2.0_f64).sqrt();
    assert!((run.last().unwrap()[0] - exact).abs() < 1e-4);
    // From outside S = [0, ∞) the first step lands on its boundary.
    assert!(step(&free, 0.0, &dvector![-1.0], 1e-9).unwrap().x[0].abs() < 1e-9);
    // With input: solutions from two admissible starts approach each other on the boundary and stay admissible.
    let u = |t: f64| -(2.0 * t).sin();
    let driven = example_4_5(u);
    let one = integrate(&driven, (0.0, 3.0), &dvector![0.0], 6000).unwrap();
    let other = integrate(&driven, (0.0, 3.0), &dvector![1.0], 6000).unwrap();
    for (t, x) in one.t.iter().zip(&one.x).skip(1) {
        assert!(x[0] + u(*t).sin() >= -1e-9);
    }
    assert!(one.lambda.iter().any(|l| l[0] > 1e-3));
    let gap = |k: usize| (one.x[k][0] - other.x[k][0]).abs();
    assert!(gap(6000) < 0.2 * gap(0));
    // One solution: half the step changes it by O(h).
    let coarse = integrate(&driven, (0.0, 3.0), &dvector![0.0], 3000).unwrap();
    assert!((one.last().unwrap() - coarse.last().unwrap()).norm() < 5e-3);
}

#[test]
fn example_4_6_quadratic_storage_gives_convex_sets() {
    let mut random = Random(46);
    let (linear, p) = gradient_type(&mut random, (3, 2), constant(DVector::zeros(2)));
    let (a, g) = (random.matrix(3, 3), random.matrix(3, 3));
    let (a2, g2) = (a.clone(), g.clone());
    let system = NonlinearComplementarity {
        field: Rc::new(move |_, x| &a * x * x.dot(&(&g * x))),
        field_jacobian: Rc::new(move |_, x| {
            &a2 * x.dot(&(&g2 * x)) + &a2 * x * (x.transpose() * (&g2 + g2.transpose()))
        }),
        b: linear.system.b.clone(),
        c: Map::affine(linear.system.c.clone(), DVector::zeros(2)),
        g: Rc::new(|t: f64| dvector![0.05 - 0.5 * (4.0 * t).sin(), 0.3 * (3.0 * t).cos()]),
        hessian: Rc::new({
            let p = p.clone();
            move |_| p.clone()
        }),
    };
    let points: Vec<DVector<f64>> = (0..5).map(|_| random.vector(3)).collect();
    system.check_storage(&points).unwrap();
    assert_eq!(system.prox_regularity(&points, 0.0).unwrap(), f64::INFINITY);
    // z = Rx: the state map is linear.
    let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
    for x in &points {
        assert!((system.state_map(x).unwrap() - &process.r * x).norm() < 1e-9);
    }
    // (34) in x and (40) in z are the same motion.
    let x0 = random.vector(3) * 0.05;
    let in_x = integrate(&system, (0.0, 1.0), &x0, 150).unwrap();
    let in_z = integrate(
        &system.in_z(&x0).unwrap(),
        (0.0, 1.0),
        &(&process.r * &x0),
        150,
    )
    .unwrap();
    assert!((&process.r * in_x.last().unwrap() - in_z.last().unwrap()).norm() < 1e-8);
    assert!(in_x.lambda.iter().any(|l| l.amax() > 0.0));
}

/// (38): ρ is the largest radius with ρ𝔹 ⊂ BᵀΛ𝔹 − R₊ᵐ, by duality min ‖ΛBμ‖ over μ ≥ 0, ‖μ‖ = 1, here by trial of many μ; an entry of B that
/// is the opposite of another one leaves no radius.
#[test]
fn equation_38_the_radius_of_the_inclusion() {
    let mut random = Random(380);
    for _ in 0..20 {
        let (linear, p) = gradient_type(&mut random, (3, 2), constant(DVector::zeros(2)));
        let system = linear_as_nonlinear(&linear.system.b, &linear.system.c, &p);
        let rho = system.slope(&DVector::zeros(3)).unwrap();
        let reach = system.lambda(&DVector::zeros(3)).unwrap() * &linear.system.b;
        let tried = (0..=1000)
            .map(|k| f64::from(k) / 1000.0 * std::f64::consts::FRAC_PI_2)
            .map(|a| (&reach * dvector![a.cos(), a.sin()]).norm())
            .fold(f64::INFINITY, f64::min);
        assert!(
            rho <= tried + 1e-12 && tried < rho * (1.0 + 1e-4) + 1e-9,
            "{rho} {tried}"
        );
        // q of length ρ is BᵀΛq' − p with ‖q'‖ ≤ 1, p ≥ 0: the least ‖q'‖ with BᵀΛq' ≥ q is at most one.
        for k in 0..16 {
            let angle = f64::from(k) * std::f64::consts::FRAC_PI_8;
            let q = dvector![angle.cos(), angle.sin()] * rho;
            let halves = circ::forms::Polyhedron {
                g: reach.transpose(),
                h: -q,
            };
            let least = halves.project(&DVector::zeros(3)).unwrap().0;
            assert!(least.norm() <= 1.0 + 1e-9);
        }
    }
    let b = dmatrix![1.0, -1.0; 0.5, -0.5];
    let opposite = linear_as_nonlinear(&b, &b.transpose(), &DMatrix::identity(2, 2));
    assert!(opposite.slope(&dvector![0.0, 0.0]).unwrap() < 1e-7);
}

/// x' = Bζ, w = Cx ≥ 0 with V = ½xᵀPx.
fn linear_as_nonlinear(
    b: &DMatrix<f64>,
    c: &DMatrix<f64>,
    p: &DMatrix<f64>,
) -> NonlinearComplementarity {
    let (n, m) = b.shape();
    let p = p.clone();
    NonlinearComplementarity {
        field: Rc::new(move |_, _| DVector::zeros(n)),
        field_jacobian: Rc::new(move |_, _| DMatrix::zeros(n, n)),
        b: b.clone(),
        c: Map::affine(c.clone(), DVector::zeros(m)),
        g: constant(DVector::zeros(m)),
        hessian: Rc::new(move |_| p.clone()),
    }
}
