//! Where a step of a circuit with curved laws ends before its time: at the first passage of a guard.
//!
//! Within a step every ideal port stays on its side of the corner, so that the motion is smooth and the method keeps its order. Guards say
//! whether it may: λ of a port that conducts, y of one that blocks, and how far the control of a switch is from its threshold. Where one
//! of them passes zero the step is made again up to there, and the ports go where the right limit of that instant has them. A step that
//! finds no solution so, one whose ports pass by little more than rounding, one that would end where it starts, and the one after a crowd
//! of passages let the ports go where they like within it, as error control allows.

use super::*;
use crate::integrate::curved::tableau::{NODES, STAGES};
use crate::settings::tolerances::steps::PASSED;

/// The guards of the steps.
#[derive(Debug)]
pub(super) struct Guards {
    /// Whether ideal ports stay on their sides in the next step.
    pub(super) hold: bool,
    /// Passages at the ends of the last steps, one by one.
    crowd: u32,
    /// Guards at the end of a step, and which of them count.
    values: Vec<f64>,
    counts: Vec<bool>,
}

impl Default for Guards {
    fn default() -> Self {
        Self {
            hold: true,
            crowd: 0,
            values: Vec::new(),
            counts: Vec::new(),
        }
    }
}

/// The end of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// When, s.
    pub(super) t: f64,
    /// Where a port passes there: how far the error of the steps may shift that, s.
    passage: Option<f64>,
}

impl Theta {
    /// Has the trial step to t1 end at the first passage of a guard in it, if there is one. Times are found to 2^−[`LOCATE`] of the step.
    ///
    /// # Errors
    /// Those of steps.
    pub(super) fn stop_at_passage(&mut self, t1: f64) -> Result<End, Error> {
        if !self.smooth.guards.hold {
            self.smooth.guards.counts.clear();
            self.look_at_end(t1);
        }
        let ordinary = |t: f64| End { t, passage: None };
        let mut end = t1;
        if !self.passes() {
            let Some(part) = self.passing_stage() else {
                return Ok(ordinary(t1));
            };
            // A port comes back before the end.
            let t0 = self.smooth.front.t;
            end = t0 + part * (t1 - t0);
            self.try_step(end)?;
            self.barely_passes(end);
            if !self.passes() {
                return Ok(ordinary(end));
            }
        }
        self.first_passage(end)
    }

    /// Looks at the guards at the end t1 of the trial step with ports held; whether ports alone pass there, by less than is worth to be located.
    pub(super) fn barely_passes(&mut self, t1: f64) -> bool {
        self.smooth.guards.counts.clear();
        self.look_at_end(t1);
        let mut guards = std::mem::take(&mut self.smooth.guards);
        let Guards {
            values,
            counts,
            hold,
            ..
        } = &mut guards;
        let ideal = self.ideal_ports(*hold);
        let some = values.iter().any(|guard| *guard > 0.0);
        counts.resize(values.len(), true);
        for (k, &port) in ideal.iter().enumerate() {
            counts[k] = values[k] > PASSED * self.size(port);
            if !counts[k] {
                values[k] = f64::MIN;
            }
        }
        let barely = some && values.iter().all(|guard| *guard <= 0.0);
        self.smooth.guards = guards;
        barely
    }

    /// What happens at the end of a step: ports that pass take the sides that the right limit has them on.
    pub(super) fn pass(&mut self, end: End) -> Result<(), Error> {
        let Some(uncertain) = end.passage else {
            self.smooth.guards.crowd = 0;
            return Ok(());
        };
        let before = self.now.active.clone();
        let known = self.pending.len();
        self.lambda.copy_from_slice(&self.smooth.front.lambda);
        self.y.copy_from_slice(&self.smooth.front.y);
        self.forget_start();
        self.find_mode()?;
        self.note_event_step(known, uncertain);
        let guards = &mut self.smooth.guards;
        guards.crowd += 1;
        if self.now.active == before || guards.crowd > CHATTER {
            (guards.hold, guards.crowd) = (false, 0);
        }
        Ok(())
    }

    /// The first passage in the trial step to `end`, at whose end guards are beyond zero, and the step up to right behind it: first tried where the polynomials
    /// of the step have it, then by inverse interpolation between the ends of a bracket.
    fn first_passage(&mut self, end: f64) -> Result<End, Error> {
        let t0 = self.smooth.front.t;
        let h = end - t0;
        let finest = (h / 2_f64.powi(LOCATE)).max(Self::slack(end));
        let mut before = (t0, self.guards_at_start());
        let mut beyond = (end, self.smooth.guards.values.clone());
        let (first, last) = (before.1.clone(), beyond.1.clone());
        let expected = self.expected_passage(before.clone(), beyond.clone());
        let mut third = None;
        let (mut made, mut aside) = (end, finest);
        for count in 1_u32.. {
            let (low, width) = (before.0, beyond.0 - before.0);
            if width <= 2.0 * finest {
                break;
            }
            let wanted = if count == 1 {
                expected - low
            } else if count % HALVED == 0 {
                0.5 * width
            } else {
                crossing(&before, &beyond, third.as_ref()) - low
            };
            // Aimed at a little behind the passage and a little before it in turn, so that the bracket closes.
            let t = low + (wanted + 0.5 * aside).clamp(finest, width - finest);
            self.try_step(t)?;
            made = t;
            self.look_at_end(t);
            let passed = if self.passes() {
                aside = -finest;
                &mut beyond
            } else {
                aside = finest;
                &mut before
            };
            third = Some(std::mem::replace(
                passed,
                (t, self.smooth.guards.values.clone()),
            ));
        }
        if made != beyond.0 {
            self.try_step(beyond.0)?;
        }
        let ideal = self.ideal();
        let passed = ideal.iter().enumerate().filter(|(k, _)| beyond.1[*k] > 0.0);
        let uncertain = passed.map(|(k, &port)| {
            let rate = (last[k] - first[k]).abs() / h;
            (self.settings.tol * self.size(port) / rate)
                .min(h)
                .max(finest)
        });
        Ok(End {
            t: beyond.0,
            passage: uncertain.reduce(f64::max),
        })
    }

    /// When a guard first passes on the polynomials of the trial step.
    fn expected_passage(
        &mut self,
        mut before: (f64, Vec<f64>),
        mut beyond: (f64, Vec<f64>),
    ) -> f64 {
        let trial = std::mem::take(&mut self.smooth.trial);
        let (t0, m) = (self.smooth.front.t, self.lambda.len());
        let (mut x, mut lambda, mut y) = (vec![0.0; trial.x.len()], vec![0.0; m], vec![0.0; m]);
        for _ in 0..HALVINGS {
            let t = 0.5 * (before.0 + beyond.0);
            let part = (t - t0) / trial.h;
            let point = (&mut x[..], &mut lambda[..], &mut y[..]);
            trial.at_part(&self.smooth.front, part, point);
            self.look(t, &x, (&lambda, &y));
            let passed = if self.passes() {
                &mut beyond
            } else {
                &mut before
            };
            passed.0 = t;
            passed.1.clone_from(&self.smooth.guards.values);
        }
        self.smooth.trial = trial;
        crossing(&before, &beyond, None)
    }

    /// The ideal ports of the present system, where they are held.
    fn ideal(&self) -> &[usize] {
        self.ideal_ports(self.smooth.guards.hold)
    }

    fn ideal_ports(&self, held: bool) -> &[usize] {
        match &self.system().smooth {
            Some(curved) if held => &curved.ideal,
            _ => &[],
        }
    }

    /// The largest |λ| so far of a port that conducts, or |y| of one that blocks.
    fn size(&self, port: usize) -> f64 {
        self.smooth.sizes[usize::from(!self.now.active[port])][port]
    }

    /// How far a port with these λ and y is beyond its side.
    fn beyond(&self, port: usize, lambda: &[f64], y: &[f64]) -> f64 {
        let side = if self.now.active[port] { lambda } else { y };
        -side[port]
    }

    /// Whether a guard was beyond zero where they were looked at last.
    fn passes(&self) -> bool {
        self.smooth.guards.values.iter().any(|guard| *guard > 0.0)
    }

    fn guards(&self, at: Point<'_>, y: &[f64], values: &mut Vec<f64>) {
        values.clear();
        values.extend((self.ideal().iter()).map(|&port| self.beyond(port, at.lambda, y)));
        if self.switches.watch() && !self.switches.chattering(CHATTER) {
            let lcs = &self.system().lcs;
            (self.switches).excess(lcs, at, &self.now.active, values);
        }
    }

    /// Looks at the guards at the end t of the trial step.
    fn look_at_end(&mut self, t: f64) {
        let trial = std::mem::take(&mut self.smooth.trial);
        self.look(t, &trial.x, trial.at_end());
        self.smooth.trial = trial;
    }

    /// Looks at the guards at a time t, state, λ and y.
    fn look(&mut self, t: f64, x: &[f64], (lambda, y): (&[f64], &[f64])) {
        if self.ideal().is_empty() && !self.switches.watch() {
            return self.smooth.guards.values.clear();
        }
        // Those of the piece that ends there.
        self.inputs.slopes(t - Self::slack(t), &mut self.du);
        self.inputs.left(t, &mut self.u_next);
        let mut values = std::mem::take(&mut self.smooth.guards.values);
        let at = Point {
            x,
            lambda,
            u: &self.u_next,
            du: &self.du,
        };
        self.guards(at, y, &mut values);
        for (value, counts) in values.iter_mut().zip(&self.smooth.guards.counts) {
            if !counts {
                *value = f64::MIN;
            }
        }
        self.smooth.guards.values = values;
    }

    fn guards_at_start(&mut self) -> Vec<f64> {
        self.inputs.slopes_behind(self.now.t, &mut self.du);
        let front = &self.smooth.front;
        let at = self.now.point(&front.lambda, &self.du);
        let mut values = Vec::new();
        self.guards(at, &front.y, &mut values);
        values
    }

    /// The part of the step after which a port is on its other side, though it is not at the end.
    fn passing_stage(&self) -> Option<f64> {
        let ideal = self.ideal();
        let stages = (1..STAGES - 1).filter(|&stage| {
            let (lambda, y) = self.smooth.trial.at_stage(stage);
            let decisive = |&port: &usize| PASSED * self.size(port);
            (ideal.iter()).any(|port| self.beyond(*port, lambda, y) > decisive(port))
        });
        stages.map(|stage| NODES[stage]).reduce(f64::min)
    }
}

/// Halvings of a step in which its polynomials are asked: these err by about that part of it.
const HALVINGS: u32 = 12;
/// Every so many times a bracket is halved, whatever interpolation says.
const HALVED: u32 = 4;

/// When the first of several quantities that are positive at the end of a bracket alone passes zero: by the inverse parabola through a third
/// point where it is monotone through all three, else by a straight line.
fn crossing(
    before: &(f64, Vec<f64>),
    beyond: &(f64, Vec<f64>),
    third: Option<&(f64, Vec<f64>)>,
) -> f64 {
    let passed = (0..beyond.1.len()).filter(|&k| beyond.1[k] > 0.0);
    let times = passed.map(|k| {
        let (a, b) = (before.1[k].min(0.0), beyond.1[k]);
        let line = before.0 + (beyond.0 - before.0) * (-a / (b - a));
        let Some((t, c)) = third.map(|(t, values)| (*t, values[k])) else {
            return line;
        };
        if (c - a) * (b - c) == 0.0 || a == b {
            return line;
        }
        let curved = before.0 * (b * c) / ((a - b) * (a - c))
            + beyond.0 * (a * c) / ((b - a) * (b - c))
            + t * (a * b) / ((c - a) * (c - b));
        if curved > before.0 && curved < beyond.0 {
            curved
        } else {
            line
        }
    });
    times.fold(beyond.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_several_passages_the_first_is_where_its_line_is_zero() {
        let at = |before: &[f64], beyond: &[f64]| {
            crossing(&(1.0, before.to_vec()), &(2.0, beyond.to_vec()), None)
        };
        assert_eq!(at(&[-1.0], &[1.0]), 1.5);
        assert_eq!(at(&[-1.0, -1.0, -3.0], &[1.0, 3.0, -1.0]), 1.25);
        // What is positive at once passed where the bracket begins; what is not, passes nowhere in it.
        assert_eq!(at(&[2.0], &[1.0]), 1.0);
        assert_eq!(at(&[-2.0], &[0.0]), 2.0);
    }

    #[test]
    fn a_third_point_bends_the_line() {
        // t = g² on both sides of the root of 2 − …: g(t) = √t − 1.2 passes at 1.44, and t is a parabola of g.
        let guard = |t: f64| (t, vec![t.sqrt() - 1.2]);
        let found = crossing(&guard(1.0), &guard(4.0), Some(&guard(9.0)));
        assert!((found - 1.44).abs() < 1e-14, "{found}");
    }
}
