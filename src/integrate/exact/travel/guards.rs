//! What the guards say about a step: clear of zero, crossed, or fallen.

use super::{Travel, larger, smaller};
use crate::integrate::exact::flow::Flow;
use crate::integrate::exact::rounding::resolution;
use crate::linalg::polynomial;
use crate::settings::tolerances::events::{CLEAR_OF_ZERO, NEARLY_FALLEN, NO_MOVE, SIMULTANEOUS};

/// What the guards say about a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Clear,
    /// Crossed, or not known without looking closer.
    Unclear,
}

impl Travel {
    /// Whether a guard stands at zero, as far as its rounding and that of the time tell simultaneous events apart.
    pub(crate) fn is_at_zero(&self, flow: &Flow, guard: usize) -> bool {
        let [value, slope] = [guard, flow.guards() + guard].map(|at| self.now[flow.dim() + at]);
        let noise = SIMULTANEOUS * self.floors[guard] + resolution(self.t) * slope.abs();
        value <= noise
    }

    /// Whether no guard can have been negative on the step from `now` to `next`: Bernstein coefficients of the cubic through
    /// values and slopes, with a margin for what the cubic does not follow.
    #[inline]
    pub(super) fn judge(&self, flow: &Flow, h: f64) -> Verdict {
        let (dim, m) = (flow.dim(), flow.guards());
        let (g0, s0) = self.now[dim..dim + 2 * m].split_at(m);
        let (g1, s1) = self.next[dim..dim + 2 * m].split_at(m);
        let (floor, slope_floor) = self.floors[..2 * m].split_at(m);
        let third = h / 3.0;
        let mut clear = true;
        for i in 0..m {
            let (b0, b3) = (g0[i], g1[i]);
            let (b1, b2) = (b0 + third * s0[i], b3 - third * s1[i]);
            let low = smaller(b1, b2);
            let high = larger(larger(b1, b2), larger(b0, b3));
            let spread = high - smaller(low, smaller(b0, b3));
            let noise = floor[i] + third * slope_floor[i];
            clear &= b3 >= -floor[i] && low + noise >= CLEAR_OF_ZERO * spread;
        }
        if clear {
            Verdict::Clear
        } else {
            Verdict::Unclear
        }
    }

    /// A guard that falls and is zero to its rounding, where a step of h seconds is none to the time, or none to a guard that has nearly fallen through its
    /// rounding, but not for what may still be a transient that began with the mode: such steps move nothing, and could go on without end.
    pub(super) fn fallen(&self, flow: &Flow, h: f64) -> Option<usize> {
        let ulp = f64::EPSILON * self.t.abs();
        if self.age <= ulp {
            return None;
        }
        let none_to_time = h <= 0.25 * ulp;
        let (g, slopes) = self.now[flow.dim()..].split_at(flow.guards());
        let (floors, slope_floors) = self.floors.split_at(flow.guards());
        let none_to_guard = |i: usize| {
            let left = g[i] + floors[i];
            -slopes[i] * h <= NO_MOVE * floors[i] && left <= NEARLY_FALLEN * floors[i]
        };
        let falls = |&i: &usize| {
            let is_zero = g[i] <= floors[i] && slopes[i] < -slope_floors[i];
            is_zero && (none_to_time || none_to_guard(i))
        };
        (0..flow.guards()).find(falls)
    }

    /// The part of the step from `now` to `next` after which the first guard falls through zero, by the cubics through values and
    /// slopes; `None` if all end above it.
    pub(super) fn crossing(&self, flow: &Flow, h: f64) -> Option<f64> {
        let (dim, m) = (flow.dim(), flow.guards());
        let ends = |k: usize| [self.now[k], self.next[k]];
        let fallen = (0..m).filter(|&i| self.next[dim + i] < -self.floors[i]);
        fallen
            .map(|i| {
                let slopes = ends(dim + m + i).map(|slope| slope * h);
                polynomial::zero_of_cubic(ends(dim + i), slopes)
            })
            .reduce(smaller)
    }
}
