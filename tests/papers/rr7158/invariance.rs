//! Section 5: dependence on the start, limit sets, the invariance theorem, stationary solutions. Theorems 4 and 5, Proposition 6, Lemma 1,
//! Remark 9.

use circ::forms::lure::{Lure, Phi};
use circ::forms::{Linear, constant};
use circ::law::Law;
use circ::passivity::System;
use circ::passivity::{self, lmi, strict};
use circ::{Model, SimOptions};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::{Random, circuit, energy, passive};

/// Theorem 4: x₀ ↦ x(t; x₀) is Lipschitz with √(‖P‖/λ_min(P)).
#[test]
fn theorem_4_solutions_depend_lipschitz_on_the_start() {
    let mut random = Random(40);
    for _ in 0..10 {
        let (system, h) = passive(&mut random, (3, 2), 1, 0.0);
        let verdict = passivity::decide(&system, Some(&h));
        let p = verdict.certificate().expect("passive").p.clone();
        let linear = Linear::autonomous(system).unwrap();
        let (a, b) = (random.vector(3), random.vector(3));
        let run = |x0: &DVector<f64>| linear.integrate((0.0, 3.0), x0, 300).unwrap();
        let (one, other) = (run(&a), run(&b));
        for k in 1..=300 {
            let (before, after) = (&one.x[k - 1] - &other.x[k - 1], &one.x[k] - &other.x[k]);
            assert!(energy(&p, &after) <= energy(&p, &before) * (1.0 + 1e-9) + 1e-15);
            assert!(after.norm() <= strict::overshoot(&p) * (&a - &b).norm() * (1.0 + 1e-9));
        }
    }
}

/// Theorem 5: the orbit tends to the largest invariant subset of E; its hypothesis on φ* and what happens without.
#[test]
fn theorem_5_invariance_and_its_hypothesis() {
    // A series RLC with a port in the loop: E = {⟨PAz, z⟩ = 0} = {i = 0}, its largest invariant subset is {0}.
    let system = System {
        a: dmatrix![0.0, 1.0; -1.0, -0.4],
        b: dmatrix![0.0; 1.0],
        c: dmatrix![0.0, 1.0],
        d: dmatrix![0.0],
    };
    let p = DMatrix::identity(2, 2);
    assert!(passivity::decide(&system, Some(&p)).answer() == Some(true));
    // φ = indicator of [−1, 1]: φ^{*,−}(z) = |z| > φ^{*,−}(0) for z ≠ 0.
    let clamp = Phi::Interval {
        low: -1.0,
        high: 1.0,
    };
    assert!(
        clamp.conjugate(0.3) > clamp.conjugate(0.0) && clamp.conjugate(-0.3) > clamp.conjugate(0.0)
    );
    let lure = Lure::new(Linear::autonomous(system.clone()).unwrap(), vec![clamp]).unwrap();
    let run = lure
        .integrate((0.0, 60.0), &dvector![3.0, 0.0], 6000)
        .unwrap();
    assert!(
        run.lambda.iter().any(|l| l[0].abs() > 0.5),
        "the clamp acts"
    );
    assert!(
        run.x
            .windows(2)
            .skip(1)
            .all(|w| w[1].norm() <= w[0].norm() * (1.0 + 1e-12)),
        "V decreases"
    );
    assert!(
        run.last().unwrap().norm() < 1e-3,
        "the orbit tends to the largest invariant subset of E"
    );
    // A relay does not satisfy the hypothesis (φ^{*,−} = 0 on [−g, g]), and the orbit stops outside {0}.
    let relay = Phi::Relay { gain: 0.5 };
    assert_eq!(relay.conjugate(0.3), relay.conjugate(0.0));
    let stuck = Lure::new(Linear::autonomous(system).unwrap(), vec![relay]).unwrap();
    let run = stuck
        .integrate((0.0, 60.0), &dvector![3.0, 0.0], 6000)
        .unwrap();
    let rest = run.last().unwrap();
    assert!(
        rest[0].abs() > 1e-2 && rest[0].abs() <= 0.5 + 1e-6 && rest[1].abs() < 1e-9,
        "{rest}"
    );
    // Ideal diodes do not satisfy it either.
    assert_eq!(Phi::HalfLine.conjugate(5.0), Phi::HalfLine.conjugate(0.0));
}

/// (v, i) of a tank of 1 F and 1 H whose voltage an ideal diode holds above −1 V, at equal times, without any step.
fn clamped_tank(v: f64, i: f64, end: f64) -> Vec<DVector<f64>> {
    let text = format!(
        "tank\nc1 a 0 1 ic={v}\nl1 a 0 1 ic={i}\nv1 n 0 -1\nd1 n a d\n.model d d(ideal)\n\
         .save v(a) i(l1)\n.tran {} {end} uic\n.end\n",
        end / 400.0
    );
    let model = Model::parse(&text, "tank.cir").unwrap();
    let run = model.transient(SimOptions::default()).unwrap();
    let (v, i) = (run.waveforms.column(0), run.waveforms.column(1));
    v.zip(i).map(|(v, i)| dvector![v, i]).collect()
}

/// Lemma 1 and Proposition 6: V is one constant on the limit set, and the limit set is invariant. The clamped tank falls to the circle
/// V = 1 that the diode no longer holds, and from every point of that circle stays on it.
#[test]
fn lemma_1_and_proposition_6_the_limit_set_is_invariant_and_v_constant_on_it() {
    let period = std::f64::consts::TAU;
    let orbit = clamped_tank(3.0, 0.0, 10.0 * period);
    assert!((orbit[0].norm_squared() - 9.0).abs() < 1e-12);
    // V never rises.
    assert!(
        orbit
            .windows(2)
            .all(|w| w[1].norm() <= w[0].norm() * (1.0 + 1e-9))
    );
    let limit = &orbit[200..];
    assert!(limit.iter().all(|x| (x.norm_squared() - 1.0).abs() < 1e-9));
    for z in limit.iter().step_by(37) {
        let on = clamped_tank(z[0], z[1], 2.0 * period);
        assert!(
            on.iter().all(|x| (x.norm_squared() - 1.0).abs() < 1e-8),
            "from {z}"
        );
    }
    // From inside the circle V keeps another value: the constant depends on the start.
    let inside = clamped_tank(0.5, 0.0, 4.0 * period);
    assert!(
        inside
            .iter()
            .all(|x| (x.norm_squared() - 0.25).abs() < 1e-9)
    );
}

/// Remark 9 and what `circ check` makes of it: the equilibria it shows solve 0 = Az + Bλ + e with their laws, are not zero, and every motion of
/// a strictly passive system ends there.
#[test]
fn remark_9_equilibria_are_where_motions_end() {
    let mut random = Random(9);
    let mut conducting = 0;
    for _ in 0..12 {
        let (system, h) = passive(&mut random, (3, 2), 2, 0.2);
        let (e, f) = (random.vector(3), random.vector(2));
        let mut parts =
            circuit(&system, &h, &[Law::ideal_diode(), Law::ideal_diode()]).into_parts();
        (parts.e0, parts.f) = (e.clone(), f.clone());
        let report = circ::check::system(&circ::lcs::Lcs::new(parts).unwrap());
        let found = &report.equilibria.expect("autonomous")[0];
        assert_eq!(found.unique, Some(true));
        let (z, lambda) = (
            DVector::from(found.x.clone()),
            DVector::from(found.lambda.clone()),
        );
        let y = &system.c * &z + &system.d * &lambda + &f;
        assert!((&system.a * &z + &system.b * &lambda + &e).amax() < 1e-9);
        assert!(lambda.min() >= 0.0 && y.min() > -1e-9 && lambda.dot(&y).abs() < 1e-9);
        assert!(z.norm() > 1e-2);
        conducting += usize::from(lambda.amax() > 1e-3);
        let linear = Linear::new(system, constant(e), constant(f)).unwrap();
        let run = linear
            .integrate((0.0, 4e3), &random.vector(3), 400)
            .unwrap();
        assert!((run.last().unwrap() - &z).norm() < 1e-6 * (1.0 + z.norm()));
    }
    assert!(conducting > 4, "{conducting}");
}

/// Remark 9 where there are many: S lies in E = {⟨PAz, z⟩ = 0}, counted from any of them for constant sources. A detector of 5 V with a loaded
/// capacitor beside it rests wherever it was charged above 5 V; between two such states nothing is dissipated, towards any other
/// state something is.
#[test]
fn remark_9_stationary_solutions_dissipate_nothing() {
    let system = System {
        a: dmatrix![0.0, 0.0; 0.0, -1.0],
        b: dmatrix![1.0; 0.0],
        c: dmatrix![1.0, 0.0],
        d: dmatrix![2.0],
    };
    let p = DMatrix::identity(2, 2);
    let (e, f) = (dvector![0.0, 3.0], dvector![-5.0]);
    let mut parts = circuit(&system, &p, &[Law::ideal_diode()]).into_parts();
    (parts.e0, parts.f) = (e.clone(), f.clone());
    let report = circ::check::system(&circ::lcs::Lcs::new(parts).unwrap());
    let first = DVector::from(report.equilibria.expect("one at least")[0].x.clone());
    assert!((&first - dvector![5.0, 3.0]).norm() < 1e-8, "{first}");
    let linear = Linear::new(system.clone(), constant(e.clone()), constant(f)).unwrap();
    let mut ends = Vec::new();
    for x0 in [dvector![8.0, 0.0], dvector![6.5, -4.0], dvector![1.0, 9.0]] {
        let run = linear.integrate((0.0, 400.0), &x0, 4000).unwrap();
        let (end, lambda) = (run.last().unwrap().clone(), run.lambda.last().unwrap());
        assert!(
            (&system.a * &end + &system.b * lambda + &e).amax() < 1e-9,
            "at rest"
        );
        let away = &end - &first;
        let mut z = away.clone().insert_row(2, 0.0);
        z[2] = lambda[0];
        let form = z.dot(&(lmi::matrix(&system, &p) * &z));
        assert!((&p * &system.a * &away).dot(&away).abs() < 1e-12 && form.abs() < 1e-12);
        ends.push(end[0]);
    }
    assert!(
        (ends[0] - 8.0).abs() < 1e-9
            && (ends[1] - 6.5).abs() < 1e-9
            && (ends[2] - 5.0).abs() < 1e-6
    );
    // (6, 4) is no rest: its distance from one has a part in the loaded capacitor.
    let away = dvector![6.0, 4.0] - &first;
    assert!((&p * &system.a * &away).dot(&away) < -0.9);
}
