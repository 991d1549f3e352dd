//! Section 4: passivity of the linear part and of the interconnection, its consequences. Definitions 1 to 4, Theorem 3, section 4.2.

use circ::forms::Linear;
use circ::forms::lure::{Lure, Phi};
use circ::passivity::{self, Origin, System, gradient, lmi, strict};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::{Random, energy, passive};

/// The left side of Definition 3 (of Definition 4 for a shifted system) at (x, z).
fn definition_3(
    s: &System,
    p: &DMatrix<f64>,
    phi: &[Phi],
    x: &DVector<f64>,
    z: &DVector<f64>,
) -> f64 {
    let conjugates =
        |z: &DVector<f64>| -> f64 { phi.iter().zip(z.iter()).map(|(f, z)| f.conjugate(*z)).sum() };
    x.dot(&(p * &s.a * x)) + x.dot(&((p * &s.b - s.c.transpose()) * z)) - z.dot(&(&s.d * z))
        + conjugates(&DVector::zeros(z.len()))
        - conjugates(z)
}

/// Laws with Φ*⁻(z) ≥ Φ*⁻(0), and one λ each of their domain.
fn laws_at_rest(random: &mut Random) -> (Phi, f64) {
    match random.below(4) {
        0 => (Phi::HalfLine, random.next().abs()),
        1 => (
            Phi::Interval {
                low: -0.2,
                high: 0.4,
            },
            random.next(),
        ),
        2 => (Phi::Relay { gain: 0.6 }, 0.6 * random.next()),
        _ => (Phi::Quadratic { stiffness: 0.5 }, random.next()),
    }
}

/// Proposition 4: a passive quadruple and Φ*⁻(z) ≥ Φ*⁻(0) make the interconnection passive (Definition 3), whatever the laws. A law without
/// the second hypothesis, y ∈ [1, 2], does not: the inequality fails near z = 0, and 0 is no solution.
#[test]
fn proposition_4_passive_quadruple_makes_the_interconnection_passive() {
    let mut random = Random(4);
    let mut violated = 0;
    for _ in 0..40 {
        let (system, h) = passive(&mut random, (3, 2), 2, 0.0);
        let verdict = passivity::decide(&system, Some(&h));
        let p = &verdict.certificate().expect("passive").p;
        for _ in 0..20 {
            let ((phi1, z1), (phi2, z2)) = (laws_at_rest(&mut random), laws_at_rest(&mut random));
            for phi in [phi1, phi2] {
                assert!(phi.conjugate(random.next()) >= phi.conjugate(0.0));
            }
            let x = random.vector(3);
            assert!(definition_3(&system, p, &[phi1, phi2], &x, &dvector![z1, z2]) <= 1e-9);
        }
        // Equality of the first three terms with ½(x, z)ᵀQ(x, z), (45).
        let (x, z) = (random.vector(3), random.vector(2).map(f64::abs));
        let mut both = DVector::zeros(5);
        both.rows_mut(0, 3).copy_from(&x);
        both.rows_mut(3, 2).copy_from(&z);
        let half = 0.5 * both.dot(&(lmi::matrix(&system, p) * &both));
        let pairs = [Phi::HalfLine; 2];
        assert!((definition_3(&system, p, &pairs, &x, &z) - half).abs() < 1e-12);
        // Without Φ*⁻ ≥ Φ*⁻(0).
        let away = Phi::Interval {
            low: 1.0,
            high: 2.0,
        };
        assert!(away.conjugate(0.1) < away.conjugate(0.0));
        let small = dvector![0.1 / (1.0 + system.d.amax()), 0.0];
        let left = definition_3(
            &system,
            p,
            &[away, Phi::HalfLine],
            &DVector::zeros(3),
            &small,
        );
        violated += usize::from(left > 1e-3);
    }
    assert_eq!(violated, 40);
    // … and Theorem 3 with it: from 0 the motion goes to y = 1.
    let rc = System {
        a: dmatrix![-1.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    };
    let law = Phi::Interval {
        low: 1.0,
        high: 2.0,
    };
    let lure = Lure::new(Linear::autonomous(rc).unwrap(), vec![law]).unwrap();
    let run = lure.integrate((0.0, 1.0), &dvector![0.0], 10).unwrap();
    assert!((run.last().unwrap()[0] - 1.0).abs() < 1e-9);
}

/// Proposition 5, Definitions 2 and 4, (46): strictly passive iff (A + ½εI, B, C, D) is passive; the largest ε is tight.
#[test]
fn proposition_5_strictly_passive_quadruple_makes_it_strictly_passive() {
    let mut random = Random(5);
    for _ in 0..3 {
        let (system, h) = passive(&mut random, (3, 2), 2, 0.2);
        let found = strict::maximise(&system, &h, Origin::StoredEnergy);
        assert!(found.decay_rate > 0.0);
        let shifted = system.shifted(found.decay_rate);
        let epsilon = 2.0 * found.decay_rate;
        for _ in 0..20 {
            let ((phi1, z1), (phi2, z2)) = (laws_at_rest(&mut random), laws_at_rest(&mut random));
            let (phi, x, z) = ([phi1, phi2], random.vector(3), dvector![z1, z2]);
            let left = definition_3(&shifted, &found.p, &phi, &x, &z);
            assert!(left <= 1e-8 * found.p.amax());
            // ½ε⟨Px, x⟩ more than Definition 3.
            let plain = definition_3(&system, &found.p, &phi, &x, &z);
            assert!(
                (left - plain - 0.5 * epsilon * energy(&found.p, &x)).abs() < 1e-9 * found.p.amax()
            );
        }
        let beyond = system.shifted(found.decay_rate * 1.01);
        assert_ne!(passivity::decide(&beyond, None).answer(), Some(true));
    }
}

/// The dissipation equality below (45) is ½xᵀPx|₀ᵗ = ∫yᵀλ + ½∫(x, λ)ᵀQ(x, λ): the ½ of the last integral is missing in print.
#[test]
fn dissipation_equality_with_its_half() {
    let mut random = Random(45);
    for _ in 0..20 {
        let (system, p) = passive(&mut random, (3, 2), 3, 0.0);
        let (x, lambda) = (random.vector(3), random.vector(2));
        let gained = x.dot(&(&p * (&system.a * &x + &system.b * &lambda)));
        let supplied = lambda.dot(&(&system.c * &x + &system.d * &lambda));
        let mut z = DVector::zeros(5);
        z.rows_mut(0, 3).copy_from(&x);
        z.rows_mut(3, 2).copy_from(&lambda);
        let form = z.dot(&(lmi::matrix(&system, &p) * &z));
        assert!((gained - supplied - 0.5 * form).abs() < 1e-12);
        assert!((gained - supplied - form).abs() > 1e-6, "as printed");
    }
}

/// Section 4.2: (45) with any P implies D + Dᵀ ⪰ 0 and PB_I = C_Iᵀ for ports without feedthrough, and PB = Cᵀ where D is skew. The P is found
/// by the inequality alone.
#[test]
fn section_4_2_passivity_implies_assumptions_2_and_5() {
    let mut random = Random(42);
    for k in 0..10 {
        // Lossless, so D is skew; or losses everywhere but at port 0, which has no feedthrough.
        let skew = k % 2 == 0;
        let (mut system, p) = passive(&mut random, (3, 2), 0, 0.0);
        if !skew {
            system.a -= DMatrix::identity(3, 3) * &p * 0.3;
            system.d = dmatrix![0.0, 0.0; 0.0, 0.5];
        }
        let found = passivity::decide(&system, None);
        let own = &found.certificate().expect("passive").p;
        assert!(
            (&system.d + system.d.transpose())
                .symmetric_eigenvalues()
                .min()
                > -1e-12
        );
        let ports: &[usize] = if skew { &[0, 1] } else { &[0] };
        let (b, c) = (system.b.select_columns(ports), system.c.select_rows(ports));
        assert!(gradient::residual(own, &b, &c) < 1e-9);
        // Off by δ at such a port, no P is left beside this A.
        if skew {
            let mut off = system.clone();
            off.c[(0, 0)] += 0.3;
            assert_ne!(passivity::decide(&off, None).answer(), Some(true));
        }
    }
}

/// Theorem 3 and Remark 8: ‖x(t)‖ ≤ c‖x₀‖e^{−αt} with c = √(‖P‖/λ_min(P)): bounded where passive, so the trivial solution is stable, and
/// decaying to zero where strictly passive.
#[test]
fn theorem_3_and_remark_8_bounded_and_exponentially_decaying() {
    let mut random = Random(30);
    for damping in [0.0, 0.3] {
        let mut rates = 0;
        for _ in 0..3 {
            let (system, h) = passive(&mut random, (3, 2), 1, damping);
            let found = strict::maximise(&system, &h, Origin::StoredEnergy);
            rates += usize::from(found.decay_rate > 0.0);
            let linear = Linear::autonomous(system).unwrap();
            let steps = 200;
            // Remark 8 i): starts in the ball of radius ε/c stay in that of radius ε = 1.
            let x0 = random.vector(3).normalize() / found.bound;
            let run = linear.integrate((0.0, 20.0), &x0, steps).unwrap();
            for k in 1..=steps {
                // Implicit steps decay by 1/(1 + αh) for e^{−αh}.
                let decay = (1.0 + found.decay_rate * 20.0 / steps as f64).powi(-(k as i32));
                assert!(run.x[k].norm() <= decay * (1.0 + 1e-7), "{k}");
            }
            // ii): attractive where strict.
            if damping > 0.0 {
                let far = linear.integrate((0.0, 400.0), &(&x0 * 100.0), 400).unwrap();
                assert!(far.last().unwrap().norm() < 1e-3 * far.x[0].norm());
            }
        }
        assert!(rates == 3 || damping == 0.0);
    }
}
