//! LTspice's smooth switch, a model with negative hysteresis, as a staircase of switches in parallel.
//!
//! Between Vt − |Vh| and Vt + |Vh| the logarithm of its conductance goes from that of 1/Roff to that of 1/Ron along the polynomial of third
//! degree that is level at both ends. Here the conductance takes this way in equal ratios of at most ten: at every
//! control value it is within a factor of √10 of the smooth one, and equal to it at Vt and in the middle of every step. A switch
//! that its own voltage v controls is no switch but a law, i = v G(v): a table with two points for every step.

use crate::law::Curve;
use crate::settings::tolerances::netlists::STAIR;

/// x with ½ + 3/2 x − 2x³ = part, as 3 sin a − 4 sin³ a = sin 3a.
fn place(part: f64) -> f64 {
    ((2.0 * part - 1.0).asin() / 3.0).sin()
}

/// The law of a switch whose control is its voltage, with as many steps as [`stairs`] says. It rises for Vt ≥ |Vh|.
pub(super) fn law((threshold, width): (f64, f64), (ron, roff): (f64, f64), steps: usize) -> Curve {
    let point = |k: usize| {
        let part = k as f64 / (2 * steps) as f64;
        let v = threshold + 2.0 * width * place(part);
        (v.into(), (v * (roff / ron).powf(part) / roff).into())
    };
    let points = (0..=2 * steps).map(point).collect();
    let ends = [roff, ron].map(|r| (r.into(), 1.0.into()));
    Curve::table(points, ends[0], ends[1])
}

/// (level of the control, resistance switched in parallel there) of every step, by rising levels; `None` where the ratio of the
/// resistances has no logarithm or Roff is not the larger one.
pub(super) fn stairs(
    threshold: f64,
    width: f64,
    ron: f64,
    roff: Option<f64>,
) -> Option<Vec<(f64, f64)>> {
    let roff = roff?;
    if !(ron > 0.0 && roff > ron && roff.is_finite()) {
        return None;
    }
    // An even number, so that the middle of one step is at the threshold.
    let half = ((roff / ron).ln() / STAIR.ln() / 2.0).ceil().max(1.0);
    let count = 2.0 * half;
    let conductance = |k: f64| (roff / ron).powf(k / count) / roff;
    let step = |k: u32| {
        let k = f64::from(k);
        // x = (control − Vt)/(2 |Vh|).
        let x = place((k - 0.5) / count);
        let more = conductance(k) - conductance(k - 1.0);
        (threshold + 2.0 * width * x, 1.0 / more)
    };
    Some((1..=count as u32).map(step).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stairs_follow_the_polynomial() {
        let (threshold, width, ron, roff) = (0.5, 0.4, 0.1, 1e6);
        let stairs = stairs(threshold, width, ron, Some(roff)).unwrap();
        assert_eq!(stairs.len(), 8);
        let staircase = |control: f64| -> f64 {
            let on = stairs.iter().filter(|(level, _)| control > *level);
            1.0 / roff + on.map(|(_, ohms)| 1.0 / ohms).sum::<f64>()
        };
        let smooth = |control: f64| -> f64 {
            let x = ((control - threshold) / (2.0 * width)).clamp(-0.5, 0.5);
            let part: f64 = 0.5 + 1.5 * x - 2.0 * x.powi(3);
            (roff / ron).powf(part) / roff
        };
        let mut worst = 1.0_f64;
        for k in 0..=1000 {
            let control = f64::from(k) * 1e-3;
            let ratio = staircase(control) / smooth(control);
            worst = worst.max(ratio).max(1.0 / ratio);
        }
        let bound = (1e7_f64).powf(1.0 / 16.0);
        assert!(worst < bound * 1.0001 && worst > bound * 0.9, "{worst}");
        assert!((staircase(2.0) * ron - 1.0).abs() < 1e-12);
        assert_eq!(staircase(-1.0), 1.0 / roff);
        assert!((staircase(threshold) * (ron * roff).sqrt() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_switch_on_its_own_voltage_is_a_table() {
        let curve = law((0.5, 0.4), (0.1, 1e6), 8);
        assert_eq!((curve.check(), curve.vertices.len()), (Ok(()), 17));
        // Half way up the conductance is that of √(Ron Roff).
        let middle = 0.5 / (0.1_f64 * 1e6).sqrt();
        assert!(curve.contains(0.5, middle, 1.0, 1e-12));
        assert!(curve.contains(2.0, 20.0, 1.0, 1e-12));
        assert!(curve.contains(-3.0, -3e-6, 1.0, 1e-12));
    }

    #[test]
    fn switches_without_a_ratio_have_no_stairs() {
        assert_eq!(stairs(1.0, 0.1, 0.0, Some(1e6)), None);
        assert_eq!(stairs(1.0, 0.1, 1.0, None), None);
        assert_eq!(stairs(1.0, 0.1, 10.0, Some(1.0)), None);
    }
}
