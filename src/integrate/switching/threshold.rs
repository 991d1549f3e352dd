//! When a control moves a switch.

use crate::mna::{LatchPort, SwitchPort};

/// A value with the bound of its rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Known {
    pub(crate) value: f64,
    pub(crate) noise: f64,
}

/// Thresholds of one switch.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// The switch's name.
    pub name: String,
    /// Turns on when the control exceeds this.
    pub on_above: f64,
    /// Turns off when the control is below this.
    pub off_below: f64,
    /// What holds the switch of a thyristor.
    pub latch: Option<LatchPort>,
}

/// Turns on every latch one of whose gates is on, and gives the switches that depend on latches their positions.
pub(crate) fn fire(thresholds: &[Threshold], position: &mut [bool]) {
    for (i, threshold) in thresholds.iter().enumerate() {
        if threshold.gated(position) {
            position[i] = true;
        }
    }
    for (i, threshold) in thresholds.iter().enumerate() {
        if let Some(LatchPort::Rest(latch)) = threshold.latch {
            position[i] = !position[latch];
        }
    }
}

/// Positions at a start from nothing, where a latch is on if a gate is; `asked` is what the controls ask the switches for.
pub(crate) fn at_start(switches: &[SwitchPort], mut asked: Vec<bool>) -> Vec<bool> {
    let thresholds: Vec<Threshold> = switches.iter().map(Threshold::of).collect();
    for (i, threshold) in thresholds.iter().enumerate() {
        if threshold.latch.is_some() {
            asked[i] = false;
        }
    }
    fire(&thresholds, &mut asked);
    asked
}

impl Threshold {
    /// Those of a switch.
    #[must_use]
    pub fn of(switch: &SwitchPort) -> Self {
        Self {
            name: switch.name.clone(),
            on_above: switch.on_above,
            off_below: switch.off_below,
            latch: switch.latch.clone(),
        }
    }

    /// The device in series with a thyristor's switch.
    #[must_use]
    pub fn valve(&self) -> Option<&str> {
        match &self.latch {
            Some(LatchPort::Hold { valve, .. }) => Some(valve),
            _ => None,
        }
    }

    /// The gates that fire it, where it is a thyristor's latch.
    pub(super) fn hold_gates(&self) -> Option<&[usize]> {
        match &self.latch {
            Some(LatchPort::Hold { gates, .. }) => Some(gates),
            _ => None,
        }
    }

    /// Whether a gate holds it on; `position` is that of all switches.
    #[must_use]
    pub fn gated(&self, position: &[bool]) -> bool {
        match &self.latch {
            Some(LatchPort::Hold { gates, .. }) => gates.iter().any(|&gate| position[gate]),
            _ => false,
        }
    }

    /// Whether it is the switch of a thyristor that conducts without a gate.
    #[must_use]
    pub fn holds(&self, on: bool, position: &[bool]) -> bool {
        on && self.valve().is_some() && !self.gated(position)
    }

    /// Whether it moves with a latch and is not worth a word.
    pub(crate) const fn is_rest(&self) -> bool {
        matches!(self.latch, Some(LatchPort::Rest(_)))
    }

    /// How far a control value is beyond the threshold that a switch in this position waits for.
    #[must_use]
    pub fn excess(&self, on: bool, control: f64) -> f64 {
        if on {
            self.off_below - control
        } else {
            control - self.on_above
        }
    }

    /// The position that a control value asks for. Without hysteresis the switch is on exactly for values above the threshold;
    /// with it the position stays where the control is between the thresholds or on one of them.
    #[must_use]
    pub fn position(&self, on: bool, control: f64) -> bool {
        if self.is_sharp() {
            control > self.on_above
        } else {
            on != (self.excess(on, control) > 0.0)
        }
    }

    /// Whether one threshold serves both directions: then a control that rests on it turns the switch off.
    #[must_use]
    pub fn is_sharp(&self) -> bool {
        self.latch.is_none() && self.on_above == self.off_below
    }

    /// The level at which a control leaves position `on`.
    pub(crate) fn level(&self, on: bool) -> f64 {
        if on { self.off_below } else { self.on_above }
    }

    /// Whether the switch leaves position `on` right after an instant at which its control has this value and slope, each known
    /// up to its noise: beyond the threshold, on the way there, or at rest on a threshold that serves both directions.
    #[must_use]
    pub(crate) fn leaves(&self, on: bool, control: Known, slope: Known) -> bool {
        let excess = self.excess(on, control.value);
        let drift = if on { -slope.value } else { slope.value };
        if excess.abs() > control.noise {
            excess > 0.0
        } else if drift.abs() > slope.noise {
            drift > 0.0
        } else {
            on && self.is_sharp()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hysteresis_keeps_the_position_inside_the_band() {
        let switch = Threshold {
            name: "s1".into(),
            on_above: 2.0,
            off_below: 1.0,
            latch: None,
        };
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 2.5].map(|v| switch.position(false, v)),
            [false, false, false, false, true]
        );
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 2.5].map(|v| switch.position(true, v)),
            [false, true, true, true, true]
        );
    }

    #[test]
    fn without_hysteresis_a_control_at_rest_on_the_threshold_is_off() {
        let switch = Threshold {
            name: "s1".into(),
            on_above: 1.0,
            off_below: 1.0,
            latch: None,
        };
        let known = |value: f64| Known {
            value,
            noise: 1e-15,
        };
        for (on, value, slope, leaves) in [
            (true, 1.0, 0.0, true),
            (true, 1.0, 1.0, false),
            (true, 1.0, -1.0, true),
            (false, 1.0, 0.0, false),
            (false, 1.0, 1.0, true),
            (false, 1.0, -1.0, false),
            (true, 0.9, 5.0, true),
            (false, 1.1, -5.0, true),
        ] {
            let found = switch.leaves(on, known(value), known(slope));
            assert_eq!(found, leaves, "{on} {value} {slope}");
        }
        assert!(!switch.position(true, 1.0));
    }
}
