//! Motions that end before the first stage of a step, with curved laws: no stage sees them, nor do the stages of half the step, so that
//! error control by halves has both agree on a current that stopped at once and on no charge that it brought.
//!
//! The slope f₀ at the start of a step does see them. The stages' polynomial has the slope P'(0) there, and what is not seen moves the
//! state by w h (f₀ − f₁) at most, w = c₁/2, if it goes on for as long as the first stage is away; f₁ is what comes nearest to f₀ between
//! P'(0) and the slope of the first stage. In a smooth motion that is of the order of the error of the step. A stage is an implicit Euler
//! step: what a state forgets until then is no error, and the derivative of the last stage tells it.
//!
//! Behind a step f₀ is the slope of its last stage. After a breakpoint there is none: layers that decay in no time and currents that end
//! soon begin together. Implicit Euler steps from the same start, each [`CLOSER`] times shorter than the last, tell the slopes
//! s₁, s₂, … at all distances δ₁ > δ₂ > …; in between as much as δ_k (s_{k+1} − s_k) may be hidden.

use super::stages::Tableau;
use super::*;
use crate::settings::tolerances::steps::{CLOSER, CLOSEST, GRANT, SUDDEN};

/// The slopes right after a breakpoint.
#[derive(Debug, Default)]
pub(super) struct Looks {
    /// Where they were looked at, s.
    t: f64,
    /// δ_k and s_k, by falling δ.
    slopes: Vec<(f64, DVector<f64>)>,
}

impl Looks {
    /// What is known is of the past.
    pub(super) fn forget(&mut self) {
        self.slopes.clear();
    }
}

impl Theta {
    /// The error that is granted to a step, relative to amplitudes.
    fn granted(&self) -> f64 {
        GRANT * self.settings.tol
    }

    /// Looks at the slopes after a breakpoint, before a step of length `h` from there.
    pub(super) fn look_closer(&mut self, h: f64) {
        let Stepping::Controlled { span, .. } = self.stepping else {
            return;
        };
        if !self.system().curved || !self.now.slope.is_empty() {
            return;
        }
        if !self.looks.slopes.is_empty() && self.looks.t == self.now.t {
            return;
        }
        let t = self.now.t;
        let mut slopes = Vec::new();
        // Few lengths for all steps: their matrices are kept.
        let mut distance = span;
        while distance > h / CLOSER {
            distance /= CLOSER;
        }
        while distance > CLOSEST * Self::slack(t) {
            let Ok(found) = self.attempt_tableau(&stages::EULER, distance, t + distance) else {
                break;
            };
            let n = self.now.x.len();
            let lcs = &self.plant.systems[self.now.system].1.lcs;
            let moved = (self.amplitudes).error(lcs, &self.now.x, &self.out[..n]);
            slopes.extend(found.into_iter().map(|s| (distance, s / distance)));
            if moved <= SUDDEN * self.granted() {
                break;
            }
            distance /= CLOSER;
        }
        self.looks = Looks { t, slopes };
    }

    /// Whether the attempt has other devices active than those at its start.
    pub(super) fn changes(&self) -> bool {
        match &self.attempt.solved {
            Some((basis, _)) => *basis != self.now.active,
            None => false,
        }
    }

    /// The attempt of length h, and what it came to, if devices that move the state change in it and it was tried with straight laws, but not from a
    /// breakpoint, where [`Self::hidden`] looks anyway. Those of comparators do not: steps too short to tell on which side of their thresholds they
    /// are would follow.
    pub(super) fn change_on_the_way(&self, h: f64) -> Option<(f64, Attempt, Vec<f64>)> {
        let may = self.control.is_some() && !self.now.settle && !self.system().curved;
        let (Some((basis, _)), true) = (&self.attempt.solved, may) else {
            return None;
        };
        let b = &self.system().lcs.b;
        let mut changed = (0..basis.len()).filter(|&j| basis[j] != self.now.active[j]);
        let moves = changed.any(|j| b.column(j).amax() > 0.0);
        moves.then(|| (h, self.attempt.clone(), self.out.clone()))
    }

    /// What a step of length h that was tried from a breakpoint may hide where an ideal device changes within it: a capacitor that is
    /// discharged until a diode takes over ends at the diode's voltage after any step, and after its halves, with no area below it.
    ///
    /// Implicit Euler steps of δ = h/[`CLOSER`]ᵏ have the devices as they are now from some k on, with slope s; where they change, as much as
    /// [`CLOSER`] δ (s − s₋) is hidden, s₋ the slope of the step before. What the devices forget by the end of the step is no error.
    pub(super) fn hidden(&mut self, h: f64) -> Result<Vec<f64>, Error> {
        if self.control.is_none() || !self.now.settle || self.system().curved || !self.changes() {
            return Ok(Vec::new());
        }
        self.looked_for(h)
    }

    /// The same of a step that went on to its end, or of its first half, which was tried with length `h`, with `tried` and `out` as they were for it:
    /// where devices change before its middle, it and both its halves have them changed from the start (γ = 1). Half of that is hidden, as what
    /// they carry falls to nothing. The whole step tells nothing of a motion that it undoes, as that by a sine which passes zero in its middle.
    pub(super) fn hidden_on_the_way(
        &mut self,
        h: f64,
        (tried, out): (Attempt, &[f64]),
    ) -> Result<Vec<f64>, Error> {
        let end = (self.out.clone(), self.lambda.clone());
        let (z, u_next) = (self.z.clone(), self.u_next.clone());
        std::mem::swap(&mut self.now, &mut self.kept);
        self.attempt = tried;
        self.out.copy_from_slice(out);
        let found = self.looked_for(h);
        std::mem::swap(&mut self.now, &mut self.kept);
        (self.out, self.lambda) = end;
        (self.z, self.u_next) = (z, u_next);
        let mut found = found?;
        found.iter_mut().for_each(|change| *change *= 0.5);
        Ok(found)
    }

    /// What an attempt of length h from the present hides, at its end: see [`Self::hidden`]. The attempt is gone.
    fn looked_for(&mut self, h: f64) -> Result<Vec<f64>, Error> {
        let tried = self.attempt.clone();
        let (n, t) = (self.now.x.len(), self.now.t);
        let slope = |theta: &Self, distance: f64| -> DVector<f64> {
            let moved = theta.out[..n].iter().zip(&theta.now.x);
            DVector::from_iterator(n, moved.map(|(next, x)| (next - x) / distance))
        };
        let (mut distance, mut before) = (h, slope(self, h));
        let mut change = DVector::zeros(n);
        while distance > CLOSEST * Self::slack(t) {
            let closer = distance / CLOSER;
            self.inputs.left(t + closer, &mut self.u_next);
            self.stats.lcp_solves += 1;
            let system = &self.plant.systems[self.now.system].1;
            system
                .columns
                .fill(&self.now.x, &self.u_next, &self.now.u, &mut self.z);
            if self.solve_with(Scheme::MOREAU, closer, t + closer).is_err() {
                break;
            }
            let now = slope(self, closer);
            if !self.changes() {
                change = (now - before) * distance;
                break;
            }
            (distance, before) = (closer, now);
        }
        self.attempt.h = f64::NAN;
        self.attempt.solved = None;
        let Some((basis, _)) = tried.solved else {
            return Ok(Vec::new());
        };
        let system = &mut self.plant.systems[self.now.system].1;
        let (mode, _) = system.mode(tried.step, &basis);
        self.z.fill(0.0);
        self.z[..n].copy_from_slice(change.as_slice());
        let fused = system.step(tried.step).fused(mode);
        fused.step(&self.z, n, &mut self.out, |_| 0.0);
        Ok(self.out[..n].to_vec())
    }

    /// What the stages of a step of length h by their h f(X_j) do not see of its start, with what was not seen before it.
    pub(super) fn unseen(
        &self,
        tableau: &Tableau,
        h: f64,
        slopes: &[DVector<f64>],
        carry: impl Fn(&DVector<f64>) -> DVector<f64>,
    ) -> Vec<f64> {
        let weight = 0.5 * tableau.first();
        let mut change = DVector::zeros(self.now.x.len());
        let mut start = None;
        if !self.now.slope.is_empty() {
            start = Some(DVector::from_column_slice(&self.now.slope));
        } else if self.looks.t == self.now.t {
            let mut looks = self.looks.slopes.iter();
            let mut before = looks.find(|look| look.0 <= h / CLOSER);
            start = before.map(|look| look.1.clone());
            for look in looks {
                if let Some((distance, slope)) = before {
                    change += (&look.1 - slope) * (weight * distance);
                }
                before = Some(look);
            }
        }
        if let Some(start) = start {
            for k in 0..change.len() {
                let ahead: f64 = (tableau.at_start.iter().zip(slopes))
                    .map(|(weight, slope)| weight * slope[k])
                    .sum();
                // Between the first stage's and what it goes on to is a motion that the stages follow.
                let (low, high) = (ahead.min(slopes[0][k]), ahead.max(slopes[0][k]));
                let slope = h * start[k];
                change[k] += weight * (slope - slope.clamp(low, high));
            }
        }
        if !self.now.unseen.is_empty() {
            change += DVector::from_column_slice(&self.now.unseen);
        }
        for (change, rounding) in change.iter_mut().zip(&self.rounding) {
            if change.abs() <= *rounding {
                *change = 0.0;
            }
        }
        if self.size_of(change.as_slice()) <= SUDDEN * self.granted() {
            change.fill(0.0);
        } else {
            change = carry(&change);
        }
        change.as_slice().to_vec()
    }

    /// A change of the present state, relative to amplitudes; none is zero.
    pub(super) fn size_of(&self, change: &[f64]) -> f64 {
        if change.is_empty() {
            return 0.0;
        }
        let moved: Vec<f64> = self.now.x.iter().zip(change).map(|(x, d)| x + d).collect();
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        self.amplitudes.error(lcs, &moved, &self.now.x)
    }
}

/// Takes out of e₁, what the first half of a step does not see, and e₂, which it shall be added to, what a smooth motion makes of them. It
/// shrinks with h³ (as stages are of first order), what is hidden with h: e₀ = s + d of the whole step and e₁ = s/8 + d/2 tell s,
/// and the two halves have a quarter of it.
pub(super) fn without_smooth(whole: &[f64], half: &mut [f64]) {
    for (half, whole) in half.iter_mut().zip(whole) {
        *half = (5.0 * *half - whole) / 3.0;
    }
}
