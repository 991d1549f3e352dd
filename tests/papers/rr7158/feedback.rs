//! Observers (39)-(42) and output feedback, Remark 10.

use circ::forms::feedback::{self, Feedback};
use circ::forms::observer::Observer;
use circ::forms::{Linear, constant, integrate};
use circ::passivity::{self, Origin, System, Verdict, lmi, strict};
use nalgebra::{DMatrix, dmatrix, dvector};

#[test]
fn section_3_2_3_observer_converges() {
    // The half-wave rectifier, measured by its diode voltage alone: neither state is measured.
    let system = System {
        a: dmatrix![-0.2, -1.0; 1.0, -0.1],
        b: dmatrix![-1.0; 0.0],
        c: dmatrix![-1.0, 0.0],
        d: dmatrix![0.5],
    };
    let (g, f) = (dmatrix![0.0, 1.0], dmatrix![0.3]);
    let rate = 0.25;
    // Without a gain this rate is out of reach.
    assert!(
        strict::maximise(&system, &DMatrix::identity(2, 2), Origin::StoredEnergy).decay_rate < rate
    );
    let observer = Observer::design(&system, &g, &f, rate).unwrap();
    let error = Observer::error_system(&system, &g, &f, &observer.gain);
    assert!(passivity::verify::check(&error.shifted(rate), &observer.p).is_ok());
    let plant = Linear::new(
        system,
        std::rc::Rc::new(|t: f64| dvector![2.0 * (1.3 * t).sin(), 0.0]),
        constant(dvector![0.0]),
    )
    .unwrap();
    let joint = observer.with_plant(&plant, &g, &f).unwrap();
    let x0 = dvector![2.0, -1.0, -3.0, 4.0];
    let steps = 6000;
    let run = joint.integrate((0.0, 30.0), &x0, steps).unwrap();
    let gap = |k: usize| run.x[k].rows(0, 2) - run.x[k].rows(2, 2);
    let bound = strict::overshoot(&observer.p) * gap(0).norm();
    for k in 0..=steps {
        // Implicit Euler keeps the bound with 1/(1 + αh)^k for exp(−αt).
        let decay = (1.0 + rate * 30.0 / steps as f64).powi(-(k as i32));
        assert!(
            gap(k).norm() <= bound * decay * (1.0 + 1e-6),
            "t = {}",
            run.t[k]
        );
    }
    assert!(gap(steps).norm() < 1e-2 * gap(0).norm());
    assert!(run.lambda.iter().any(|l| l[0] > 0.1), "the diode conducts");
}

/// A capacitor with a negative resistor and a diode to an inductor: active, controlled by a source in the mesh.
fn active() -> (System, DMatrix<f64>, DMatrix<f64>) {
    let system = System {
        a: dmatrix![0.5, -1.0; 1.0, -0.2],
        b: dmatrix![1.0; 0.0],
        c: dmatrix![0.4, 0.3],
        d: dmatrix![0.0],
    };
    (system, dmatrix![1.0; 0.2], dmatrix![0.0])
}

#[test]
fn remark_10_p1_matches_input_and_output() {
    let (system, e, _) = active();
    // With F = 1 and P = I: B + EG = (C + FS)ᵀ is solvable.
    let f = dmatrix![1.0];
    let p = DMatrix::identity(2, 2);
    let (s, g) = feedback::match_output(&system, &e, &f, &p).unwrap();
    let closed = feedback::close(&system, &e, &f, &s, &g);
    assert!((&p * &closed.b - closed.c.transpose()).amax() < 1e-12);
    assert!(
        (&p * &system.b - system.c.transpose()).amax() > 0.1,
        "it was not before"
    );
    // With neither E nor F there is nothing to choose.
    assert!(feedback::match_output(&system, &dmatrix![0.0; 0.0], &dmatrix![0.0], &p).is_err());
}

#[test]
fn remark_10_p2_makes_an_active_circuit_passive() {
    let (system, e, f) = active();
    let Verdict::NotPassive(witness) = passivity::decide(&system, None) else {
        panic!("active")
    };
    assert!(witness.verify(&system));
    for rate in [0.0, 0.1] {
        let found = Feedback::design(&system, &e, &f, rate).unwrap();
        let closed = feedback::close(&system, &e, &f, &found.s, &found.g);
        assert_eq!(
            passivity::decide(&closed, Some(&found.p)).answer(),
            Some(true)
        );
        // (48) itself, and the decay it gives.
        let q = lmi::matrix(&closed.shifted(rate), &found.p);
        assert!(q.symmetric_eigenvalues().max() < 1e-6 * found.p.amax());
        let run = integrate(
            &Linear::autonomous(closed).unwrap(),
            (0.0, 60.0),
            &dvector![1.0, -2.0],
            3000,
        )
        .unwrap();
        let grown = strict::overshoot(&found.p) * run.x[0].norm();
        assert!(run.x.iter().all(|x| x.norm() <= grown * (1.0 + 1e-6)));
        if rate > 0.0 {
            assert!(run.last().unwrap().norm() < 1e-1);
        }
    }
    // Without a control input nothing can be done.
    let (system, _, _) = active();
    assert!(Feedback::design(&system, &dmatrix![0.0; 0.0], &dmatrix![0.0], 0.0).is_err());
}
