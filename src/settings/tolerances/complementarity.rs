//! Inside the solvers of one complementarity problem; what they give is judged by `Settings::lcp_residual` alone.

/// A residual at which no other method is asked for a better one: a few roundings of a solve. Larger: worse solutions; smaller: methods in
/// vain.
pub(crate) const NOTHING_TO_GAIN: f64 = 1e-13;

/// Violations below this part of the problem's size count as zero inside the pivoting methods (rounding of one solve). Larger: wrong sets are
/// offered; smaller: cycles of rounding.
pub(crate) const SLACK: f64 = 1e-14;

/// Ratios closer than this, relative to the larger, tie in Lemke's method and are decided by the next lexicographic column. Larger: wrong
/// rows leave; smaller: cycles.
pub(crate) const TIE: f64 = 1e-12;

/// Entries of a column of Lemke's tableau are known to this part of its largest.
pub(crate) const TABLEAU_NOISE: f64 = 1e-15;

/// A residual of Newton's method on resolvents that is rounding: no iteration improves on it.
pub(crate) const NEWTON_ENDS: f64 = 1e-15;

/// A residual from which on a step of Newton's method that lowers it no more is rounding; above, the steps after it may. Larger: solutions err where
/// large terms cancel; smaller: steps that change nothing.
pub(crate) const NEWTON_SETTLES: f64 = 1e-12;

/// A solution is off its laws by no more than this part of the largest current or voltage of all ports, unless that is the rounding of larger terms. Larger: a leakage is
/// taken for a solution that large terms hide; smaller: solutions that are as good as rounding lets them are refused.
pub(crate) const ON_LAWS: f64 = 1e-6;

/// Where no method comes to [`ON_LAWS`], the best of them serves up to so many times that. Larger: as there; smaller: circuits in which nothing but leakage flows are refused.
pub(crate) const BARELY: f64 = 100.0;

/// A residual of this part of the terms that it is a sum of is their rounding. Larger and smaller as [`ON_LAWS`].
pub(crate) const TERMS_ROUNDING: f64 = 1e-13;

/// The rounding of an equation in the sum of the magnitudes of its terms. Larger: errors are excused; smaller: steps shrink for rounding, without end where all that flows is leakage.
pub(crate) const EQUATION_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A port whose w is below this part of the largest is solved to that part. Larger: noise of junctions that block behind inductors chooses the steps of these; smaller: steps of Newton's method
/// for what is nothing.
pub(crate) const SMALL_W: f64 = 1e-9;

/// What counts as small beside the largest quantity: its tolerated residual is this part of that of the largest. Larger: leakage loses
/// digits; smaller: it decides when Newton ends.
pub(crate) const SMALL_PORT: f64 = 1e-5;

/// The part of the decrease that a linear function would have which a step of the line search must bring (Armijo). Larger: shorter steps;
/// smaller: steps that hardly help.
pub(crate) const DECREASE: f64 = 0.1;

/// μ of the proximal points, in equilibrated units. Larger: more of them; smaller: each as hard as the problem itself.
pub(crate) const PROXIMAL: f64 = 1e-4;

/// Largest μ of the continuation, in equilibrated units: there M' + μI is well conditioned.
pub(crate) const CONTINUED: f64 = 10.0;

/// What each μ of the continuation is to the one before. Larger: more of them; smaller: Newton loses its way between two.
pub(crate) const CONTINUED_RATIO: f64 = 0.25;

/// A pivot of R' this small, beside its largest entry, is a direction that neither the network nor the laws determine; pivots are raised to
/// it. Larger: slower convergence; smaller: steps far along such directions.
pub(crate) const UNDETERMINED: f64 = 1e-10;

/// Added to M' in Newton's matrix: rounding leaves M' an eigenvalue of −1e-16 in place of 0, and along its vector the step would go the wrong
/// way; the bound of what it takes from the speed of convergence is far below the tolerance.
pub(crate) const MONOTONE: f64 = 1e-13;

/// Least −dy'/dw in the second method: a blocking junction has next to none, and a loop of such ports no regular matrix. Larger: slower
/// convergence; smaller: singular matrices.
pub(crate) const BLOCKED: f64 = 1e-8;

/// A contraction of Newton's steps below which the last one tells, by a geometric series, what is left. Larger: one step that fell short is
/// trusted; smaller: a step more than needed.
pub(crate) const CONTRACTS: f64 = 0.5;

/// A contraction with which R' is factored anew: simplified steps have become slower than a factorisation is dear. Larger: more steps; smaller:
/// more factorisations.
pub(crate) const CONTRACTS_NO_MORE: f64 = 0.1;

/// Newton's iterates that have grown by this factor, beside start and right-hand side, are no solution. Larger: rounding of the voltages of junctions
/// passes for a solution with enormous currents; smaller: ports that are driven through much smaller resistances go to slower methods.
pub(crate) const RUNAWAY: f64 = 1e8;

/// Steps of Newton's method that shrink by no more than this factor are rounding, if they are as small as granted. Larger, up to 1: iterations in vain;
/// smaller: steps that still contract are taken for rounding.
pub(crate) const ROUNDING_STEPS: f64 = 0.5;
