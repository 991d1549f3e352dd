//! Energy, stated errors and verification.

use super::*;
use circ::integrate::JumpReason;
use circ::report::text;

const STEPPED: [Method; 2] = [Method::Theta, Method::Euler];
const ALL: [Method; 3] = [Method::Exact, Method::Theta, Method::Euler];

/// As [`run`], with prescribed steps.
fn stepped(name: &str, method: Method, step: f64) -> Run {
    let circuit = circuit(name);
    let behaviour = behaviour(&circuit).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let options = SimOptions {
        method,
        step: Some(step),
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// source = stored + dissipated + jumps + numerical + residual.
fn adds_up(run: &Run) {
    let e = &run.energy;
    let sum = e.stored + e.dissipated + e.jumps + e.numerical + e.residual;
    assert!(
        (e.source - sum).abs() <= 1e-15 * e.source.abs().max(e.stored.abs()),
        "{e:?}"
    );
}

/// CV² comes from the source; half of it is stored, and half is lost: in the resistor or, where the step is a thousand time constants,
/// by the scheme, which the balance must name.
#[test]
fn what_damped_steps_lose_is_numerical() {
    for method in STEPPED {
        let run = stepped("stiffrc", method, 1e-6);
        let e = &run.energy;
        adds_up(&run);
        assert!(
            (e.source - 144e-6).abs() < 1e-9 && (e.stored - 72e-6).abs() < 1e-9,
            "{e:?}"
        );
        assert!(e.numerical > 71e-6, "{method:?}: {e:?}");
        assert!(e.residual_relative < 1e-10, "{method:?}: {e:?}");
    }
    let fine = run("stiffrc", Method::Theta).energy;
    assert!(
        fine.numerical.abs() < 1e-9 && (fine.dissipated - 72e-6).abs() < 1e-8,
        "{fine:?}"
    );
}

/// 10 V charge the capacitor to zero, where diodes clamp it, within a tenth of the first step, and leave a current in the inductor that the
/// steps miss altogether: the stated error tells it.
#[test]
fn a_transient_inside_the_first_step_is_no_error_of_zero() {
    let exact = run_exactly("fixed_step_estimate_zero");
    let last = |run: &Run| run.waveforms.values[run.waveforms.values.len() - 1];
    for method in STEPPED {
        let found = stepped("fixed_step_estimate_zero", method, 1e-3);
        assert!(last(&found).abs() < 1e-9 && last(&exact) > 1.7e-3);
        // Small currents are related to a thousandth of the largest.
        let waves = &found.waveforms;
        let currents = (0..waves.width()).filter(|k| waves.units[*k] == "A");
        let largest = currents
            .flat_map(|k| waves.column(k))
            .fold(0.0, |m: f64, i| m.max(i.abs()));
        let truth = last(&exact) / (1e-3 * largest);
        assert!(
            found.error.max > Some(truth),
            "{method:?}: {:?}, {truth}",
            found.error
        );
    }
}

/// The energy of a tank falls by 1/(1 + h²ω²) a step with Moreau's scheme: 100 steps of ω h = 0.316.
#[test]
fn a_coarse_step_of_moreaus_scheme_shows_in_the_numerical_loss() {
    let run = stepped("tank", Method::Euler, 1e-5);
    let left = 0.5e-6 * 1.1_f64.powi(-100);
    let e = &run.energy;
    adds_up(&run);
    assert!(
        (e.numerical - (0.5e-6 - left)).abs() < 1e-12 * 0.5e-6,
        "{e:?}"
    );
    assert_eq!((e.source, e.dissipated, e.jumps), (0.0, 0.0, 0.0));
    assert!(e.residual_relative < 1e-13, "{e:?}");
    let exact = run_exactly("tank").energy;
    assert!(
        exact.numerical == 0.0 && exact.residual_relative < 1e-13,
        "{exact:?}"
    );
}

fn run_exactly(name: &str) -> Run {
    run(name, Method::Exact)
}

/// With both switches open and no diode the current jumps to zero, and takes ½LI² with it; a warning says so.
#[test]
fn a_dead_time_without_a_path_destroys_the_current_and_says_so() {
    // From rest: 10 V over L and R for 40 µs.
    let current = 10.0 * (1.0 - (-0.04_f64).exp());
    for method in ALL {
        let run = run("dead_time", method);
        adds_up(&run);
        let jumps = &run.state_jumps;
        assert_eq!(jumps.all.0, 3, "{method:?}: {:?}", jumps.first);
        for (k, jump) in jumps.first.iter().enumerate() {
            assert!(
                (jump.t - (k as f64 * 100e-6 + 40e-6)).abs() < 1e-12,
                "{jump:?}"
            );
            assert_eq!(jump.elements, ["l1"]);
            assert_eq!(jump.reason, JumpReason::Switch("s1".into()));
            let loss = 0.5e-3 * current * current;
            assert!(
                (jump.loss / loss - 1.0).abs() < 1e-3,
                "{method:?}: {jump:?} {loss}"
            );
            assert!(jump.destroys);
        }
        let lost: f64 = jumps.first.iter().map(|jump| jump.loss).sum();
        assert!((run.energy.jumps - lost).abs() < 1e-15 && jumps.all.1 == lost);
        assert!(run.energy.residual_relative < 1e-9, "{:?}", run.energy);
        let [warning] = &text::warnings(&run)[..] else {
            panic!("one warning");
        };
        assert!(
            warning.text.starts_with("l1 jumps at 40 µs (switch s1)"),
            "{}",
            warning.text
        );
        assert!(
            warning.text.contains("2 more jumps like it"),
            "{}",
            warning.text
        );
    }
}

/// 10 V on 1 µF and 2 V on 3 µF give 4 V and lose ½ · 0.75 µF · (8 V)²; short-circuited, they lose all.
#[test]
fn charges_that_are_joined_or_short_circuited_are_listed() {
    for method in ALL {
        let run = run("shorted_capacitor", method);
        adds_up(&run);
        let [joined, shorted] = &run.state_jumps.first[..] else {
            panic!("{method:?}: {:?}", run.state_jumps);
        };
        assert_eq!(joined.reason, JumpReason::Switch("s2".into()));
        assert_eq!(joined.elements, ["c1", "c2"]);
        assert!((joined.loss - 24e-6).abs() < 1e-9, "{method:?}: {joined:?}");
        assert_eq!(shorted.reason, JumpReason::Switch("s1".into()));
        assert_eq!(shorted.elements, ["c1", "c2"]);
        let v = 10.0 - 6.0 * (-0.25_f64).exp();
        assert!(
            (shorted.loss - 2e-6 * v * v).abs() < 1e-8,
            "{method:?}: {shorted:?}"
        );
        assert!(
            run.energy.residual_relative < 1e-9,
            "{method:?}: {:?}",
            run.energy
        );
    }
}
