//! Where a run in steps stands, and how it tried to go on.

use crate::integrate::energy::Balance;
use crate::integrate::reading::Point;

/// Everything a rejected step has to give back.
#[derive(Debug, Clone, Default)]
pub(super) struct Now {
    pub(super) t: f64,
    pub(super) x: Vec<f64>,
    /// Right limit of u at t; the left one before the run begins.
    pub(super) u: Vec<f64>,
    /// The index set the next step tries first.
    pub(super) active: Vec<bool>,
    /// Which devices conducted at the last solve.
    pub(super) pattern: Vec<bool>,
    /// The next step must have γ = 1: the constraints may not hold at t.
    pub(super) settle: bool,
    /// A device turned off in the step before: what current it left behind decays through its blocking resistance, faster than any
    /// step, and the midpoint rule would ring at it.
    pub(super) turned_off: bool,
    pub(super) system: usize,
    pub(super) balance: Balance,
    /// The longest step in which a device changed, s: it did so somewhere in it.
    pub(super) event_step: f64,
    /// x' at the end of the last step; empty after a breakpoint, and where the method has no stages.
    pub(super) slope: Vec<f64>,
    /// What the last step did not see, see [`unseen`]; empty at the start of a step under error control.
    pub(super) unseen: Vec<f64>,
}

impl Now {
    /// The present point, with λ and the slopes of the inputs there.
    pub(super) fn point<'a>(&'a self, lambda: &'a [f64], du: &'a [f64]) -> Point<'a> {
        Point {
            x: &self.x,
            lambda,
            u: &self.u,
            du,
        }
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.x.clone_from(&other.x);
        self.u.clone_from(&other.u);
        self.active.clone_from(&other.active);
        self.pattern.clone_from(&other.pattern);
        self.t = other.t;
        self.settle = other.settle;
        self.turned_off = other.turned_off;
        self.system = other.system;
        self.balance = other.balance;
        self.slope.clone_from(&other.slope);
        self.unseen.clone_from(&other.unseen);
        self.event_step = other.event_step;
    }
}

/// How the present attempt was made.
#[derive(Debug, Clone, Default)]
pub(super) struct Attempt {
    pub(super) step: usize,
    pub(super) mode: usize,
    pub(super) h: f64,
    /// Whether it was made for a settling step.
    pub(super) settle: bool,
    /// Whether a device turned off in a step of the midpoint rule.
    pub(super) turned_off: bool,
    /// Basis and pattern after the step, where the solvers ran.
    pub(super) solved: Option<(Vec<bool>, Vec<Option<bool>>)>,
    /// The largest residual that a stage was solved to, relative to the terms it is a sum of.
    pub(super) residual: f64,
    /// Energy from sources, into resistors and devices, and lost by the method, J, where the stages tell it.
    pub(super) work: Option<((f64, f64), f64)>,
    /// x' at the end, where the method has stages.
    pub(super) slope: Vec<f64>,
    /// What the stages did not see.
    pub(super) unseen: Vec<f64>,
}
