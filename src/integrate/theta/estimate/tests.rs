//! One state along curves whose derivatives are known.

use nalgebra::dvector;

use super::*;
use crate::integrate::fixtures;
use crate::integrate::inputs::Inputs;

fn entered(error: f64) -> Estimate {
    let mut estimate = Estimate::default();
    estimate.enter([error].into_iter());
    estimate
}

/// Steps of length h along `x`, carried by the factor `map`; the errors after each.
fn along(
    estimate: &mut Estimate,
    x: impl Fn(f64) -> f64,
    h: f64,
    steps: std::ops::Range<u32>,
    map: Option<f64>,
    second_order: bool,
) -> Vec<f64> {
    let rows = map.map(|r| [r, 7.0]);
    let step = |k: u32| {
        let (t, map) = (h * f64::from(k), rows.as_ref().map(|rows| (&rows[..], 2)));
        estimate.step(h, &[x(t)], &[x(t + h)], map, second_order);
        estimate.error()[0]
    };
    steps.map(step).collect()
}

/// x'' = 1: every step of a method of first order errs by h²/2.
#[test]
fn first_order_steps_err_by_half_the_second_difference() {
    let parabola = |t: f64| 0.5 * t * t;
    let errors = along(&mut entered(0.0), parabola, 2.0, 0..4, Some(1.0), false);
    // Nothing is known after one step; the second counts for both.
    assert_eq!(errors, [0.0, 4.0, 6.0, 8.0]);
}

/// x''' = 1: every step of the midpoint rule errs by h³/12.
#[test]
fn second_order_steps_err_by_a_twelfth_of_the_third_difference() {
    let cubic = |t: f64| t * t * t / 6.0;
    let errors = along(&mut entered(0.0), cubic, 1.0, 0..5, Some(1.0), true);
    for (found, expected) in errors.iter().zip([0.0, 0.0, 3.0, 4.0, 5.0]) {
        assert!((found - expected / 12.0).abs() < 1e-14, "{errors:?}");
    }
}

#[test]
fn the_map_of_the_step_carries_the_error() {
    let line = |t: f64| t;
    let mut estimate = entered(-8.0);
    let errors = along(&mut estimate, line, 1.0, 0..3, Some(0.5), false);
    assert_eq!(errors, [-4.0, -2.0, -1.0]);
    // Where the active set changes there is no map, and nothing is forgotten; a second one in a row counts as after rest.
    let errors = along(&mut estimate, line, 1.0, 3..5, None, true);
    assert_eq!(errors, [-1.0, -0.5]);
}

/// Somewhere in the step x' changes by 1.
#[test]
fn a_change_of_the_active_set_counts_with_first_order() {
    let kinked = |t: f64| if t > 5.0 { t - 5.0 } else { 0.0 };
    let mut estimate = entered(0.0);
    let before = along(&mut estimate, kinked, 1.0, 0..5, Some(1.0), true);
    assert_eq!(before, [0.0; 5]);
    let across = along(&mut estimate, kinked, 1.0, 5..6, None, true);
    assert_eq!(across, [0.5]);
    // The differences across the kink say nothing about the next steps.
    let after = along(&mut estimate, kinked, 1.0, 6..9, Some(1.0), true);
    assert_eq!(after, [0.5; 3]);
}

#[test]
fn differences_do_not_reach_over_a_restart_or_another_step_length() {
    let jumping = |t: f64| if t > 2.5 { 100.0 * t } else { 0.0 };
    let mut estimate = entered(0.0);
    along(&mut estimate, jumping, 1.0, 0..2, Some(1.0), false);
    estimate.restart();
    let errors = along(&mut estimate, jumping, 1.0, 3..6, Some(1.0), false);
    assert_eq!(errors, [0.0; 3]);
    let errors = along(&mut estimate, jumping, 2.0, 3..6, Some(1.0), false);
    assert_eq!(errors, [0.0; 3]);
}

#[test]
fn stages_tell_the_error_by_the_change_of_their_difference() {
    let mut estimate = entered(1.0);
    let step = |carried: f64, embedded: f64| StepError {
        carried: dvector![carried],
        embedded: dvector![embedded],
        constant: 0.25,
        order: 3,
    };
    estimate.stages(1.0, &[0.0], step(0.5, 4.0));
    assert_eq!(estimate.error(), [1.5]);
    estimate.stages(1.0, &[0.0], step(1.5, 6.0));
    assert_eq!(estimate.error(), [2.0]);
    // A step of twice the length has eight times the difference.
    estimate.stages(2.0, &[0.0], step(2.0, 48.0));
    assert_eq!(estimate.error(), [2.0]);
    estimate.restart();
    estimate.stages(2.0, &[0.0], step(2.0, 48.0));
    assert_eq!(estimate.error(), [14.0]);
}

/// Two systems one after the other, each with its largest error over its amplitude.
#[test]
fn the_worst_system_counts() {
    let lcs = fixtures::bridge();
    let mut amplitudes = Amplitudes::new(&lcs, &Inputs::new(&[]));
    let mut estimate = Estimate::default();
    let rows = [1.0, 0.0, 0.0, 1.0];
    let step = |estimate: &mut Estimate, before: f64, after: f64| {
        estimate.step(1.0, &[before, 0.0], &[after, 0.0], Some((&rows, 2)), false);
    };
    estimate.enter([0.0, 0.0].into_iter());
    // The second difference is −16.
    step(&mut estimate, -6.0, 10.0);
    step(&mut estimate, 10.0, 10.0);
    assert_eq!(estimate.error(), [-16.0, 0.0]);
    estimate.settle(&lcs, &mut amplitudes);
    assert_eq!(estimate.stated().max, Some(MARGIN * 1.6));
    estimate.enter([-2.0, 0.0].into_iter());
    step(&mut estimate, 10.0, 10.0);
    assert_eq!(estimate.error(), [-2.0, 0.0]);
    estimate.settle(&lcs, &mut amplitudes);
    assert_eq!(estimate.stated().max, Some(MARGIN * 1.6));
}

/// What the step did to the state, at that time only.
#[test]
fn a_late_switch_is_no_error_to_carry() {
    let lcs = fixtures::bridge();
    let mut amplitudes = Amplitudes::new(&lcs, &Inputs::new(&[]));
    let mut estimate = Estimate::default();
    estimate.enter([-2.0, 0.0].into_iter());
    let rows = [1.0, 0.0, 0.0, 1.0];
    estimate.step(1.0, &[-32.0, 0.0], &[0.0; 2], Some((&rows, 2)), false);
    estimate.step(1.0, &[0.0; 2], &[32.0, 0.0], Some((&rows, 2)), false);
    estimate.switched_late(&[2.0, 0.0], &[32.0, 0.0]);
    estimate.settle(&lcs, &mut amplitudes);
    assert_eq!(estimate.stated().max, Some(MARGIN));
    assert_eq!(estimate.error()[0], -2.0);
}

#[test]
fn errors_of_chosen_steps_add_up() {
    let mut estimate = Estimate::default();
    estimate.add(0.5, 1.0);
    estimate.add(0.25, 3.0);
    let stated = estimate.stated();
    assert_eq!(stated.max, Some(0.75));
    // ½ for 1 s and ¾ for 3 s.
    let mean: f64 = (0.25 + 3.0 * 0.5625) / 4.0;
    assert_eq!(stated.rms, Some(mean.sqrt()));
}

#[test]
fn what_no_step_has_told_is_not_known() {
    // One step tells nothing, nor do equal ones; different ones do.
    let lcs = fixtures::bridge();
    let mut amplitudes = Amplitudes::new(&lcs, &Inputs::new(&[]));
    let mut estimate = Estimate::default();
    estimate.enter([0.0, 0.0].into_iter());
    let rows = [1.0, 0.0, 0.0, 1.0];
    for x in [0.0, 1.0] {
        estimate.step(1.0, &[x * x, 0.0], &[x + 1.0, 0.0], Some((&rows, 2)), false);
        estimate.settle(&lcs, &mut amplitudes);
        assert_eq!(estimate.stated().max, None);
    }
    estimate.step(1.0, &[2.0, 0.0], &[5.0, 0.0], Some((&rows, 2)), false);
    estimate.settle(&lcs, &mut amplitudes);
    assert!(estimate.stated().max.is_some() && estimate.stated().rms.is_some());
}

/// A start whose transient is over within the first half of the first step.
#[test]
fn a_transient_inside_the_first_step_is_seen() {
    let over = |t: f64| if t > 0.0 { 0.0 } else { 5.0 };
    let mut estimate = entered(0.0);
    estimate.restart();
    along(&mut estimate, over, 1.0, 0..1, Some(0.0), false);
    estimate.pair();
    estimate.restart();
    let errors = along(&mut estimate, over, 1.0, 1..2, Some(0.0), false);
    assert_eq!(errors, [5.0]);
    // A device that changed in it is no excuse.
    let errors = along(&mut entered(0.0), over, 1.0, 0..1, None, false);
    assert_eq!(errors, [-2.5]);
}

/// Where the state follows what is slower than the step, the error of the step is damped as the state is.
#[test]
fn what_decays_within_the_step_hardly_counts() {
    let parabola = |t: f64| 0.5 * t * t;
    let mut estimate = entered(0.0);
    let errors = along(&mut estimate, parabola, 1.0, 0..5, Some(0.01), false);
    assert!((errors[4] - 0.5 * 0.01).abs() < 1e-4, "{errors:?}");
}
