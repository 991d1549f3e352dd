//! Projected motions mode by mode: x' = v(t, x) + GᵀJ u with the constraints J met with equality, by Runge-Kutta steps up to the
//! bisected event. Modes are found by trying all of them: nothing of the library takes part.

use nalgebra::{DMatrix, DVector};

type Vector = DVector<f64>;

/// x' = proj of v(t, x) onto the tangent cone of {c ≥ 0}.
pub(super) struct Projected<'a> {
    /// v.
    pub(super) v: &'a dyn Fn(f64, &Vector) -> Vector,
    /// c.
    pub(super) c: &'a dyn Fn(&Vector) -> Vector,
    /// ∂c/∂x.
    pub(super) g: &'a dyn Fn(&Vector) -> DMatrix<f64>,
}

/// A motion on a grid.
pub(super) struct Motion {
    /// x.
    pub(super) x: Vec<Vector>,
    /// Multipliers of all constraints.
    pub(super) u: Vec<Vector>,
    /// Times at which the mode changes, and the mode after.
    pub(super) events: Vec<(f64, Vec<usize>)>,
}

/// How far a constraint or a multiplier may be below zero by rounding.
const ROUNDING: f64 = 1e-11;

/// The solution of a regular system, of size zero as well.
fn solve(m: &DMatrix<f64>, b: &Vector) -> Vector {
    if b.is_empty() {
        return b.clone();
    }
    m.clone().lu().solve(b).expect("independent gradients")
}

impl Projected<'_> {
    /// u of a mode: G_J(v + G_Jᵀu) = 0.
    fn multipliers(&self, mode: &[usize], t: f64, x: &Vector) -> Vector {
        let g = (self.g)(x).select_rows(mode);
        let gram = &g * g.transpose();
        let sink = -(&g * (self.v)(t, x));
        solve(&gram, &sink)
    }

    /// x' of a mode.
    pub(super) fn velocity(&self, mode: &[usize], t: f64, x: &Vector) -> Vector {
        let g = (self.g)(x).select_rows(mode);
        (self.v)(t, x) + g.transpose() * self.multipliers(mode, t, x)
    }

    /// A classical Runge-Kutta step of a mode, put back onto its constraints.
    fn step(&self, mode: &[usize], t: f64, x: &Vector, h: f64) -> Vector {
        let f = |t: f64, x: &Vector| self.velocity(mode, t, x);
        let k1 = f(t, x);
        let k2 = f(t + h / 2.0, &(x + &k1 * (h / 2.0)));
        let k3 = f(t + h / 2.0, &(x + &k2 * (h / 2.0)));
        let k4 = f(t + h, &(x + &k3 * h));
        let mut end = x + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        for _ in 0..3 {
            let g = (self.g)(&end).select_rows(mode);
            let c = (self.c)(&end).select_rows(mode);
            let back = solve(&(&g * g.transpose()), &c);
            end -= g.transpose() * back;
        }
        end
    }

    /// Whether a mode is right at a point: nothing else leaves the set, no multiplier pulls.
    fn admits(&self, mode: &[usize], t: f64, x: &Vector) -> bool {
        let c = (self.c)(x);
        c.iter()
            .enumerate()
            .all(|(i, &c)| mode.contains(&i) || c >= -ROUNDING)
            && self.multipliers(mode, t, x).iter().all(|&u| u >= -ROUNDING)
    }

    /// All modes that can start at a point, with where they are a little later.
    pub(super) fn starts(&self, t: f64, x: &Vector) -> Vec<(Vec<usize>, Vector)> {
        let c = (self.c)(x);
        let active: Vec<usize> = (0..c.len()).filter(|&i| c[i].abs() < 1e-8).collect();
        let later = 1e-3;
        (0..1_usize << active.len())
            .map(|mask| -> Vec<usize> {
                let chosen = |k: &usize| mask >> k & 1 == 1;
                (0..active.len())
                    .filter(chosen)
                    .map(|k| active[k])
                    .collect()
            })
            .filter(|mode| mode.len() <= x.len() && self.admits(mode, t, x))
            .filter_map(|mode| {
                let fits = (1..=10).all(|k| {
                    let s = later * f64::from(k) / 10.0;
                    self.admits(&mode, t + s, &self.step(&mode, t, x, s))
                });
                let end = self.step(&mode, t, x, later);
                fits.then_some((mode, end))
            })
            .collect()
    }

    fn start(&self, t: f64, x: &Vector) -> Vec<usize> {
        let modes = self.starts(t, x);
        modes.into_iter().next().expect("a mode").0
    }

    /// The motion from x on `steps` equal steps of [0, end].
    pub(super) fn integrate(&self, x: &Vector, end: f64, steps: usize) -> Motion {
        let mut x = x.clone();
        let mut mode = self.start(0.0, &x);
        let mut motion = Motion {
            x: vec![x.clone()],
            u: vec![Vector::zeros((self.c)(&x).len())],
            events: Vec::new(),
        };
        let grid = end / steps as f64;
        for k in 0..steps {
            let mut t = k as f64 * grid;
            let stop = (k + 1) as f64 * grid;
            while stop - t > 1e-13 {
                let h = stop - t;
                let next = self.step(&mode, t, &x, h);
                if self.admits(&mode, stop, &next) {
                    (x, t) = (next, stop);
                    continue;
                }
                let (mut good, mut bad) = (0.0, h);
                for _ in 0..60 {
                    let middle = 0.5 * (good + bad);
                    if self.admits(&mode, t + middle, &self.step(&mode, t, &x, middle)) {
                        good = middle;
                    } else {
                        bad = middle;
                    }
                }
                x = self.step(&mode, t, &x, bad);
                t += bad;
                mode = self.start(t, &x);
                motion.events.push((t, mode.clone()));
            }
            let mut u = Vector::zeros((self.c)(&x).len());
            for (&i, value) in mode.iter().zip(self.multipliers(&mode, t, &x).iter()) {
                u[i] = *value;
            }
            motion.x.push(x.clone());
            motion.u.push(u);
        }
        motion
    }
}
