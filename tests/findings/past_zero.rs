//! Ideal diodes whose voltage falls through zero late in a step: its mean is positive still, and that of both its halves.

use circ::integrate::Method;

use super::changed_at;
use super::runs::column;

/// The largest distance of two columns, over the largest value of the first.
fn apart(name: &str, tol: f64, probe: &str) -> (f64, [u64; 2]) {
    apart_by(Method::Theta, name, tol, probe)
}

fn apart_by(method: Method, name: &str, tol: f64, probe: &str) -> (f64, [u64; 2]) {
    let run = |method| changed_at(name, &[], method, tol);
    let (exact, stepped) = (run(Method::Exact), run(method));
    let columns = [&exact, &stepped].map(|run| column(run, probe));
    let size = columns[0].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let pairs = columns[0].iter().zip(&columns[1]);
    let apart = pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    (apart / size, [&exact, &stepped].map(|r| r.stats.events))
}

/// It was not seen until the next step, and the current was off by 2.2e-3 of the amplitude at either tolerance.
#[test]
fn a_diode_that_turns_on_late_in_a_step_is_seen() {
    for tol in [1e-4, 1e-6] {
        let (error, [exact, stepped]) = apart("turns_on_late_in_a_step", tol, "i(d3)");
        assert!(error < tol, "{tol}: {error}");
        // At the tighter one it starts to conduct in a step from which on it does nothing yet.
        assert_eq!(stepped, exact, "{tol}");
    }
}

/// 6.5e-4 of the amplitude.
#[test]
fn a_diode_whose_voltage_is_its_port_is_seen_too() {
    let (error, _) = apart("voltage_falls_late_in_a_step", 1e-4, "i(l1)");
    assert!(error < 1e-4, "{error}");
}

/// The step in which both change and its halves agree to rounding, as two diodes that conduct hold the state; what followed was off by 9.1e-5 of the
/// amplitude at any tolerance.
#[test]
fn a_diode_that_another_one_blocks_within_a_step_is_seen() {
    for tol in [1e-4, 1e-6] {
        let (error, _) = apart("one_diode_blocks_another_in_a_step", tol, "v(2)");
        assert!(error < tol, "{tol}: {error}");
    }
}

/// The right limit of the corner itself, where sources stand still, tells nothing of it: 1.7e-3 of the amplitude.
#[test]
fn a_diode_that_another_one_blocks_before_a_corner_is_seen() {
    for tol in [1e-4, 1e-6] {
        let (error, _) = apart("one_diode_blocks_another_at_a_corner", tol, "v(2)");
        assert!(error < tol, "{tol}: {error}");
    }
}

/// In both halves of the step it did so from the start; watched switches kept it from being looked for. 5e-7 of the amplitude at any tolerance.
#[test]
fn a_thyristor_that_follows_another_early_in_a_step_is_seen() {
    let (error, _) = apart("one_thyristor_follows_another", 1e-7, "i(l1)");
    assert!(error < 1e-7, "{error}");
}

/// Its mean voltage is positive in both halves, so that nothing refuses the step: 4.2e-6 of the amplitude at any tolerance.
#[test]
fn a_diode_that_turns_on_at_the_end_of_a_step_is_seen() {
    let (error, _) = apart("turns_on_at_the_end_of_a_step", 1e-7, "i(d2)");
    assert!(error < 1e-7, "{error}");
}

/// The step in which it does, and the first of its halves, have it conduct from the start; by symmetry the whole step moves nothing, and so was taken
/// for one that hides nothing. 4e-3 of the amplitude at any tolerance.
#[test]
fn a_diode_that_turns_on_in_the_middle_of_a_step_is_seen() {
    for tol in [1e-4, 1e-6] {
        let (error, _) = apart("sine_passes_zero_in_the_middle_of_a_step", tol, "i(l2)");
        assert!(error < tol, "{tol}: {error}");
    }
}

/// Its current is the mean slope of a sine, and nothing where that turns in the middle of the half: 2.2e-3 of the amplitude by `euler`, at any tolerance at which
/// a step is as long.
#[test]
fn a_current_that_ends_in_the_middle_of_a_half_is_seen_by_euler() {
    let name = "current_ends_in_the_middle_of_a_half";
    let (error, _) = apart_by(Method::Euler, name, 1e-4, "v(2)");
    assert!(error < 1e-4, "{error}");
}

/// A voltage that decays within a step passes zero by the midpoint rule, and the diode that it meets there held it at zero in both halves: 3e-3 of the
/// amplitude at any tolerance.
#[test]
fn a_diode_does_not_hide_that_the_midpoint_rule_rings() {
    let (error, _) = apart("clamped_before_it_rings", 1e-7, "v(3)");
    assert!(error < 1e-7, "{error}");
}
