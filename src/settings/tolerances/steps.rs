//! Lengths and errors of the implicit steppers.

/// A step is doubled, and doubled again, where the error of the longer one would still leave this factor of room: a step that an edge cut
/// short says nothing against the next one. Larger: steps stay short for long; smaller: they are tried in vain.
pub(crate) const ROOM: f64 = 2.0;

/// A step that does not see its start is made at most so many times shorter at once. Larger: far too short steps; smaller: more attempts.
pub(crate) const SHORTEN: f64 = 16.0;

/// The part of the tolerance that is granted where the solution has corners (a diode that turns on): they are few, and shorter steps only
/// there would not pay. Larger: event times suffer; smaller: many short steps around every event.
pub(crate) const CORNER: f64 = 1e-5;

/// A state is known to this part of its amplitude, a few roundings. Larger: errors of small signals are excused; smaller: steps shrink
/// where rounding is all the error there is.
pub(crate) const STATE_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A quantity smaller than this part of the largest of its unit is judged by that part: the leakage of a blocking device is no signal.
/// Larger: small signals lose digits; smaller: leakage chooses the steps.
pub(crate) const FAINT: f64 = 1e-3;

/// Differences of stages below this part of the terms that a state is a sum of are rounding and no error of the step. Larger: errors are excused; smaller: steps shrink for rounding.
pub(crate) const STAGE_ROUNDING: f64 = 1e-11;

/// The part of the tolerance granted to every step in stages: resistive laws forget errors instead of adding them up. Larger: errors of many
/// steps add up to more than asked; smaller: more steps.
pub(crate) const GRANT: f64 = 1e-3;

/// A motion has ended within a step where its last stage moves by less than this part of its first; and what a first stage moves is of
/// interest above this part of the tolerance, or of the amplitude where steps are prescribed. Larger: slow motions are taken for ended ones;
/// smaller: the charge of a current that stops within a step is lost.
pub(crate) const SUDDEN: f64 = 0.1;

/// The ratio of the distances of two looks at what happens right after a breakpoint: what is hidden between them is overestimated by it.
/// Larger: steps too short; smaller: more looks.
pub(crate) const CLOSER: f64 = 8.0;

/// The closest look, in units of [`SAME_TIME`](super::times::SAME_TIME). Larger: the fastest motion is not seen; smaller: a slope of
/// rounding.
pub(crate) const CLOSEST: f64 = 64.0;

/// The part of a print step that the first of chosen steps is tried at. Larger: a first step in vain; smaller: more steps until they are
/// long.
pub(crate) const FIRST: f64 = 1.0 / 64.0;

/// Chosen steps in a period of the fastest sine: an error estimate must not alias. Larger: more steps than the tolerance asks for; smaller:
/// a sine is stepped over.
pub(crate) const STEPS_PER_PERIOD: f64 = 8.0;

/// Steps that tell their error by an embedded method are at most this part of what [`STEPS_PER_PERIOD`] allows: where a sine drives smooth laws, eight of them
/// in a period err by 3e-6 and the method does not see it. Larger: that error; smaller: more steps than the tolerance asks for.
pub(crate) const SINE_EMBEDDED: f64 = 0.5;

/// A step is no longer than a delay over this: what arrives at its end has left before its start, and enough records lie between the two for
/// straight lines. Larger: more steps; smaller: waves are rounded off.
pub(crate) const STEPS_PER_DELAY: f64 = 8.0;

/// Jumps and kinks on a line below this part of the largest wave are not followed; a kink's is its change of slope times the delay. Larger:
/// echoes are rounded off; smaller: breakpoints for what nobody sees, 2^k of them.
pub(crate) const FOLLOWED: f64 = 1e-9;

/// A kink stands out from the curvature beside it by this factor. Larger: kinks are taken for curvature; smaller: sines are full of kinks.
pub(crate) const KINK: f64 = 4.0;

/// The implicit step that tells y and λ at the right limit of an instant, relative to the last step: 2⁻¹². Its own error is that part of the
/// step's, the amplified rounding of the state 2¹² ε. Larger: the one; smaller: the other.
pub(crate) const SHORT: f64 = 1.0 / 4096.0;

/// What is read at the end of a line goes on along it, so that its error adds up with every reflection: it is read by a step shorter by this
/// part, where the rounding of the state grows to 2¹⁸ ε.
pub(crate) const SHORT_ON_LINES: f64 = 1.0 / 64.0;

/// The ratio of the two short steps by which λ is read. Larger: rounding in the shorter one, which grows with it; smaller: what is
/// left is larger, (δ/τ)² over this for a motion of time constant τ.
pub(crate) const NEARER: f64 = 16.0;

/// A λ that is a derivative is made of magnitudes 1/[`SHORT`] times as large in a short step as in a whole one, another one of the same: what
/// lies between these belongs to the latter up to here.
pub(crate) const DIRECT: f64 = 16.0;

/// Moreau's steps in a print step where they take the place of exact integration. Larger: slower; smaller: chattering is coarse.
pub(crate) const HANDOVER_STEPS: f64 = 128.0;

/// Steps of the run that finds the amplitudes beforehand. Larger: slower; smaller: amplitudes of what happens between are missed, and the first steps are shorter than
/// their tolerance asks.
pub(crate) const SCOUT_STEPS: f64 = 64.0;

/// A fastest rate that does less than this in the simulated span leaves the slow ones at least four digits, and devices keep the roles that
/// the reduction prefers. Larger: slow rates drown in rounding; smaller: roles are looked for in vain.
pub(crate) const ROLES_LOST: f64 = 1e12;

/// Other roles are taken where they bring the fastest rate down to this part. Larger: roles change for little; smaller: digits stay lost.
pub(crate) const ROLES_GAIN: f64 = 1e-3;

/// The same as [`GRANT`] for steps that tell their error by an embedded method, which is one order lower. Larger and smaller as there.
pub(crate) const GRANT_EMBEDDED: f64 = 1e-3;

/// A step is so much shorter than its predecessor's error allows. Larger: steps in vain; smaller: more steps.
pub(crate) const SHORTER: f64 = 0.9;

/// A step is at most so many times as long as the one before. Larger: steps in vain; smaller: more steps until they are long.
pub(crate) const LONGER: f64 = 8.0;

/// Lengths that differ by no more than this factor are one of the ladder 2^(−k/2). Larger, up to √2: the next one up; smaller, down to 1: rounding takes one down.
pub(crate) const NO_LONGER: f64 = 1.2;

/// The rate at the end of a step tells the first stage of the next one where to look up to so many times that step's length. Larger: it starts
/// far off; smaller: it starts from what was.
pub(crate) const AHEAD: f64 = 3.0;

/// The part of the error granted to a step that the last step of Newton's method at its stages may be. Larger: stages err as much as steps;
/// smaller: one solve more a stage.
pub(crate) const STAGE_SOLVED: f64 = 1e-3;

/// That last step is wanted at this part of the largest quantity, where rounding allows it: differences of stages tell the error of states that are much
/// smaller, and where ports are ideal the side of a corner that one is on decides when switches move. Larger: noise chooses the steps, a switch moves that a
/// moment later does not; smaller: more solves.
pub(crate) const SOLVED: f64 = 1e-13;

/// A stop that cuts a step so much is no reason to halve it for a coarser run to compare with: its error is that of a whole step times the
/// fourth power of it. Larger: coarser runs make the same steps; smaller: more steps.
pub(crate) const CUT: f64 = 0.25;

/// Steps that are shorter than this part of the span and want to grow no longer take currents below what leaks beside junctions (`gmin`) for no signal. Larger:
/// errors of a leakage add up; smaller: steps that follow a leakage have no end.
pub(crate) const CREEPS: f64 = 1e-5;

/// A state whose mean slope in a step is below this part of the largest at a stage rests. Larger: slopes of states that move are taken for noise; smaller: those of states that rest are not.
pub(crate) const GOES_NOWHERE: f64 = 1e-3;

/// What a row's polynomials may be off at the stages that test them, over the tolerance and the row's amplitude: it adds up with nothing. Larger: rows err more than
/// steps; smaller: more rows are stepped to.
pub(crate) const ROWS: f64 = 0.04;

/// Switches that sources alone drive are asked so many steps ahead when they move next. Larger: passages far ahead are found again after every
/// switching; smaller: they are asked at every step.
pub(crate) const ASKED_AHEAD: f64 = 16.0;

/// A port that leaves its side of the corner within a step by less than this part of the largest λ or y it had there is worth no event of its own: the step is made
/// with ports that go where they like. Larger: events are missed by what that takes; smaller: rounding at rest is located.
pub(crate) const PASSED: f64 = 1e-11;
