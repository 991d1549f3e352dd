//! What certificates and witnesses are accepted: the thresholds that docs/theory.md names, from both sides.

use super::*;

#[test]
fn the_inequality_is_granted_rounding_and_no_more() {
    // A tank with a source of energy ε in its capacitor: Q(I) = diag(0, 2ε), equilibrated by ¼ to 1.
    let tank = |e: f64| System {
        a: dmatrix![0.0, 1.0; -1.0, e],
        b: DMatrix::zeros(2, 0),
        c: DMatrix::zeros(0, 2),
        d: DMatrix::zeros(0, 0),
    };
    let one = DMatrix::identity(2, 2);
    assert!(verify::check(&tank(1e-13), &one).is_ok());
    for e in [1e-10, 1e-9, 1e-8] {
        let refused = verify::check(&tank(e), &one);
        assert!(
            matches!(refused, Err(verify::Failure::Inequality(v)) if v >= 0.5 * e && v < 3.0 * e),
            "{refused:?}"
        );
    }
}

#[test]
fn the_coupling_on_a_kernel_is_verified_by_itself() {
    // PB − Cᵀ = δ beside a loss of one: the eigenvalue of (45) is δ²/2 only, and yet no Q ⪯ 0 has the entry δ there.
    let lossless_port = |delta: f64| System {
        a: dmatrix![-1.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0 + delta],
        d: dmatrix![0.0],
    };
    let lossless_state = |delta: f64| System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0 + delta],
        d: dmatrix![1.0],
    };
    let one = dmatrix![1.0];
    for system in [lossless_port(1e-11), lossless_state(1e-11)] {
        assert!(verify::check(&system, &one).is_ok());
    }
    for delta in [1e-8, 1e-7, 1e-6] {
        for system in [lossless_port(delta), lossless_state(delta)] {
            let refused = verify::check(&system, &one);
            assert!(
                matches!(refused, Err(verify::Failure::Kernel(v)) if v > 0.1 * delta && v < 10.0 * delta),
                "{refused:?}"
            );
        }
    }
}

#[test]
fn an_unreached_pattern_must_reach_no_state() {
    let seen = |b: f64| System {
        a: dmatrix![-1.0],
        b: dmatrix![b],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    };
    let witness = Witness::Unreached {
        direction: vec![1.0],
    };
    // B = 0: the input −c/ε draws as much as it likes. B = 1 is an RC at a port, and passive.
    assert!(witness.verify(&seen(0.0)));
    assert_eq!(decide(&seen(0.0), None).answer(), Some(false));
    assert!(!witness.verify(&seen(1.0)));
    assert!(!witness.verify(&seen(-1.0)));
    assert_eq!(decide(&seen(1.0), None).answer(), Some(true));
    // Nor is a pattern with losses one, nor one that sees nothing.
    let lossy = System {
        d: dmatrix![1.0],
        ..seen(0.0)
    };
    assert!(!witness.verify(&lossy));
    let blind = System {
        c: dmatrix![0.0],
        ..seen(0.0)
    };
    assert!(!witness.verify(&blind));
}
