//! Verdicts on the circuits of the papers, on random networks whose passivity is known, and under role swaps.

use nalgebra::{DMatrix, dmatrix};

use super::*;
use fixtures::{C, L, R, Random, bridge, filter};

#[path = "../../tests/systems/passive.rs"]
mod fixtures;
mod thresholds;

/// A random passive system with its energy: losses of random rank, energies over six decades.
fn passive(random: &mut Random, n: usize, m: usize) -> (System, DMatrix<f64>) {
    let rank = random.below(n + m + 1);
    fixtures::passive(random, (n, m), rank, 0.0, 1e3)
}

#[test]
fn stored_energy_certifies_the_bridge_of_37() {
    let energy = dmatrix![C, 0.0; 0.0, L];
    let verdict = decide(&bridge(), Some(&energy));
    let certificate = verdict.certificate().expect("passive");
    assert_eq!(certificate.from, Origin::StoredEnergy);
    assert!(certificate.residuals.lmi_max_eigenvalue <= 1e-12);
    assert!(certificate.residuals.pb_minus_ct <= 1e-12);
}

#[test]
fn the_inequality_alone_finds_the_energy_of_the_bridge() {
    // The feasible set is the single point diag(C, L); (36) prints another.
    let certificate = decide(&bridge(), None)
        .certificate()
        .cloned()
        .expect("passive");
    assert_eq!(certificate.from, Origin::Lmi);
    assert!(
        (certificate.p[(0, 0)] / C - 1.0).abs() < 1e-9,
        "{}",
        certificate.p
    );
    assert!(
        (certificate.p[(1, 1)] / L - 1.0).abs() < 1e-9,
        "{}",
        certificate.p
    );
    assert!(certificate.p[(0, 1)].abs() < 1e-9 * (C * L).sqrt());
}

#[test]
fn the_skew_bridge_of_38_has_p_equal_to_c() {
    let certificate = decide(&filter(), None)
        .certificate()
        .cloned()
        .expect("passive");
    assert!((certificate.p[(0, 0)] / C - 1.0).abs() < 1e-12);
    let strict = strict::maximise(&filter(), &certificate.p, certificate.from);
    assert!(
        (strict.decay_rate * R * C - 1.0).abs() < 1e-5,
        "{}",
        strict.decay_rate
    );
}

#[test]
fn variants_of_the_bridge_that_gain_energy_are_refused() {
    let broken: [fn(&mut System); 4] = [
        |s| s.d[(0, 0)] = -1.0 / R,
        |s| s.c[(2, 0)] = 1.0,
        |s| s.a[(0, 0)] = 1.0 / (R * C),
        |s| s.a[(0, 1)] = 1.0 / C,
    ];
    for breaks in broken {
        let mut system = bridge();
        breaks(&mut system);
        match decide(&system, Some(&dmatrix![C, 0.0; 0.0, L])) {
            Verdict::NotPassive(witness) => assert!(witness.verify(&system)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_negative_resistor_across_a_capacitor_grows() {
    // C x' = x/R, observed through a port with a series resistor.
    let system = System {
        a: dmatrix![1.0 / (R * C)],
        b: dmatrix![1.0 / C],
        c: dmatrix![1.0],
        d: dmatrix![R],
    };
    let Verdict::NotPassive(witness) = decide(&system, Some(&dmatrix![C])) else {
        panic!()
    };
    assert!(witness.verify(&system));
    assert!(!witness.verify(&System {
        a: dmatrix![-1.0 / (R * C)],
        ..system.clone()
    }));
    assert!(
        witness.describe().contains("grows"),
        "{}",
        witness.describe()
    );
}

#[test]
fn role_swaps_keep_verdict_and_certificate() {
    let mut random = Random(7);
    for _ in 0..40 {
        let (n, m) = (1 + random.below(3), 1 + random.below(3));
        let (system, h) = passive(&mut random, n, m);
        let mut active = system.clone();
        active.a[(0, 0)] += 10.0 * (1.0 + active.a.amax());
        for set in 0..1_usize << m {
            let ports: Vec<usize> = (0..m).filter(|j| set >> j & 1 == 1).collect();
            if let Some(pivoted) = system.pivot(&ports) {
                assert!(
                    energy::certificate(&pivoted, &h).is_some(),
                    "{ports:?} {pivoted:?}"
                );
                let back = pivoted.pivot(&ports).expect("invertible");
                assert!((back.d - &system.d).amax() < 1e-9 * (1.0 + pivoted.d.amax().powi(2)));
            }
            if let Some(pivoted) = active.pivot(&ports) {
                assert_eq!(decide(&pivoted, Some(&h)).answer(), Some(false));
            }
        }
    }
}

#[test]
fn a_thousand_passive_networks_are_passive() {
    let mut random = Random(1);
    let mut by_lmi = 0;
    for k in 0..1000 {
        let (n, m) = (random.below(4), 1 + random.below(3));
        let (system, h) = passive(&mut random, n, m);
        assert!(
            energy::certificate(&system, &h).is_some(),
            "energy, network {k}: {system:?}"
        );
        if k % 4 == 0 {
            // Without the energy: the matrix inequality must find a certificate, or say that it did not decide.
            match decide(&system, None) {
                Verdict::Passive(_) => by_lmi += 1,
                Verdict::NotPassive(w) => panic!("network {k}: {w:?} {system:?}"),
                Verdict::NotDecided { .. } => {}
            }
        }
    }
    // What is left is "not decided" (losses 1e-11 of the rest), never wrong.
    assert!(by_lmi >= 247, "{by_lmi} of 250");
}

#[test]
fn a_thousand_active_networks_are_not_passive() {
    let mut random = Random(2);
    let mut decided = 0;
    for k in 0.. {
        if decided == 1000 {
            break;
        }
        let (n, m) = (1 + random.below(3), 1 + random.below(3));
        let (mut system, h) = passive(&mut random, n, m);
        // Ground truth by construction: along v the port gains, or the state gains, or positive-realness fails.
        match k % 3 {
            0 => system.d -= DMatrix::identity(m, m) * (1.05 * system.d.amax() * m as f64 + 0.1),
            1 => {
                let growth = witness::eigenvalues(&system.a)
                    .iter()
                    .map(|s| s.re)
                    .fold(f64::NEG_INFINITY, f64::max);
                for i in 0..n {
                    system.a[(i, i)] += 0.1 * system.a.amax() + 0.1 - growth;
                }
            }
            _ => system.c = -&system.c,
        }
        if k % 3 == 2 && !sweep_fails(&system) {
            continue;
        }
        match decide(&system, Some(&h)) {
            Verdict::NotPassive(witness) => {
                assert!(witness.verify(&system));
                decided += 1;
            }
            other => panic!("network {k}: {other:?} {system:?}"),
        }
    }
}

#[test]
fn an_infeasible_inequality_has_a_mixture_of_motions_for_a_witness() {
    // The inequality alone, without the search for single motions: a negative margin comes with a verified dual solution.
    let mut random = Random(5);
    let (mut refuted, mut proved, mut mixtures) = (0, 0, 0);
    for k in 0..60 {
        let (n, m) = (1 + random.below(4), 1 + random.below(3));
        let (mut system, _) = passive(&mut random, n, m);
        match k % 3 {
            0 => system.d -= DMatrix::identity(m, m) * (1.05 * system.d.amax() * m as f64 + 0.1),
            1 => {
                for i in 0..n {
                    system.a[(i, i)] += 1.0 + 2.0 * system.a.amax();
                }
            }
            _ => system.c[(0, 0)] += 3.0 * system.c.amax(),
        }
        let verdict = decide(&system, None);
        if let Err(lmi::Unsolved::Witness(witness)) = lmi::solve(&system) {
            assert!(witness.verify(&system));
            assert_eq!(verdict.answer(), Some(false), "network {k}: {witness:?}");
            proved += 1;
            mixtures += usize::from(matches!(witness, Witness::Mixture(_)));
        }
        refuted += usize::from(verdict.answer() == Some(false));
    }
    assert!(
        proved >= refuted - 5 && mixtures > 45,
        "{mixtures} mixtures, {proved} proofs for {refuted} refuted"
    );
    // A passive system has none: x' = −x + v, y = x gains energy at v = −x only while x shrinks, and grows only if fed.
    let rc = System {
        a: dmatrix![-1.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    };
    for v in [-1.0, 2.0] {
        let mixture = mixture::Mixture {
            states: dmatrix![1.0],
            inputs: dmatrix![v],
            supply: -1.0,
        };
        assert!(!Witness::Mixture(mixture).verify(&rc), "{v}");
    }
}

/// An independent sweep of λ_min(H(jω) + H(jω)*), real arithmetic: H(jω) = D + C(A² + ω²)⁻¹(−A − jω)B.
fn sweep_fails(system: &System) -> bool {
    let n = system.n();
    (0..200).any(|k| {
        let w = 10_f64.powf(-6.0 + 12.0 * f64::from(k) / 199.0);
        let Some(inverse) =
            (&system.a * &system.a + DMatrix::identity(n, n) * (w * w)).try_inverse()
        else {
            return false;
        };
        let re = &system.d - &system.c * &inverse * &system.a * &system.b;
        let im = -(&system.c * &inverse * &system.b) * w;
        // The Hermitian form of G = re + j im is the symmetric matrix [[re + reᵀ, imᵀ − im], [im − imᵀ, re + reᵀ]].
        let m = system.m();
        let mut form = DMatrix::zeros(2 * m, 2 * m);
        let (s, t) = (&re + re.transpose(), &im - im.transpose());
        form.view_mut((0, 0), (m, m)).copy_from(&s);
        form.view_mut((m, m), (m, m)).copy_from(&s);
        form.view_mut((m, 0), (m, m)).copy_from(&t);
        form.view_mut((0, m), (m, m)).copy_from(&-&t);
        form.symmetric_eigenvalues().min() < -1e-6 * (re.amax() + im.amax())
    })
}

#[cfg(feature = "sdp")]
mod second_opinion {
    use super::*;

    #[test]
    fn cone_solver_and_barrier_agree() {
        for system in [bridge(), filter()] {
            let barrier = lmi::solve(&system).expect("barrier");
            let cone = sdp::solve(&system).expect("cone");
            let scale = barrier.p.diagonal().map(f64::sqrt);
            for i in 0..system.n() {
                for j in 0..system.n() {
                    let difference = (barrier.p[(i, j)] - cone.p[(i, j)]) / (scale[i] * scale[j]);
                    assert!(difference.abs() < 1e-6, "{} {}", barrier.p, cone.p);
                }
            }
        }
        let mut random = Random(11);
        let mut confirmed = 0;
        for _ in 0..60 {
            let (n, m) = (1 + random.below(4), 1 + random.below(3));
            let (system, _) = passive(&mut random, n, m);
            // Neither may refute; both certificates are verified by the same test.
            let found = sdp::solve(&system);
            assert!(!matches!(found, Err(lmi::Unsolved::Witness(_))));
            confirmed += usize::from(found.is_ok() && lmi::solve(&system).is_ok());
            let mut active = system.clone();
            active.d -= DMatrix::identity(m, m) * (1.05 * active.d.amax() * m as f64 + 0.1);
            assert!(sdp::solve(&active).is_err() && lmi::solve(&active).is_err());
        }
        assert!(confirmed >= 50, "{confirmed} of 60");
    }
}
