//! Hypotheses of theorems: strict and other inequalities, equilibria, limits, the conversions between forms.

/// Duality gap and feasibility asked of clarabel. Larger: strict inequalities are not told from others; smaller: it does not finish.
pub(crate) const INTERIOR_POINT: f64 = 1e-10;

/// Slack above which a strict inequality counts as satisfied (rows are scaled to size one, the slack is at most one): a thousand times
/// [`INTERIOR_POINT`]. Larger: true ones are denied; smaller: false ones are granted.
pub(crate) const STRICT: f64 = 1e-7;

/// Residual in balanced units at which the interior point method's answer counts as an equilibrium. Larger: what is none is shown; smaller:
/// true ones are not.
pub(crate) const ROUGH_EQUILIBRIUM: f64 = 1e-7;

/// Relative size below which a λ or y of the equilibrium is zero. Larger: strict complementarity is denied; smaller: it is granted to
/// rounding.
pub(crate) const AT_ZERO: f64 = 1e-9;

/// Relative size above which it is not; between [`AT_ZERO`] and this nothing is concluded from it.
pub(crate) const NOT_AT_ZERO: f64 = 1e-5;

/// Size, in balanced units, below which a constraint on the limit set is not counted: larger sets are the safe side. Larger: less is
/// concluded; smaller: rounding constrains.
pub(crate) const FAINT_CONSTRAINT: f64 = 1e-9;

/// What the linear program must say of a row, between 0 and 1, for the row to vanish: it is at one of the two but for the accuracy of the
/// program.
pub(crate) const VANISHES: f64 = 1e-6;

/// A constraint is active where it is met with equality to this part of its terms. Larger: the state is held where it could move; smaller: it
/// leaves the set by rounding.
pub(crate) const ACTIVE: f64 = 1e-9;

/// Residual of D = VD̄Vᵀ, relative to |V||D̄||V|ᵀ. Larger: D that is not of this form passes; smaller: rounding refuses it.
pub(crate) const FACTORED: f64 = 1e-10;

/// Bound on the gains of feedback and observer in balanced units: larger ones are not looked for. Larger: gains that no device has; smaller:
/// feedback that exists is not found.
pub(crate) const LARGEST_GAIN: f64 = 1e4;

/// Change of the iterate, relative to its size, at which the inversion of the state map ends.
pub(crate) const MAP_INVERTED: f64 = 1e-14;

/// Change of the iterate, relative to its size, at which the linearisation of a nonlinear step ends. Larger: the step is not implicit;
/// smaller: iterations that move rounding.
pub(crate) const LINEARISED: f64 = 1e-12;
