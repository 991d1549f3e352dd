//! When an orbit is closed, and what its multipliers say.

/// Length of the differences that make the derivative of the flow over a period, relative to the amplitude of a state: the square root of
/// what doubles carry, so that rounding and curvature leave as much each. Larger: an event passes between the two ends; smaller: rounding.
pub(crate) const DIFFERENCE: f64 = 1.5e-8;

/// The same where the flow is made of implicit steps, whose solutions are known to the residual of their solver.
pub(crate) const STEPPED_DIFFERENCE: f64 = 1e-5;

/// A state counts as at least this part of the largest of its unit: a current that is always zero is moved by a part of the others.
pub(crate) const LEAST_AMPLITUDE: f64 = 1e-6;

/// A circuit whose states are all below this part of its sources is at rest but for leakage and rounding, and they count as what the sources do. Larger: small
/// signals are known to fewer digits; smaller: digits of rounding are looked for.
pub(crate) const NEXT_TO_SOURCES: f64 = 1e-9;

/// The same as [`STEPPED_DIFFERENCE`], relative to the sources, where the circuit rests. Larger: a loop of large gain moves a switch that is not on its threshold; smaller: what
/// solvers leave.
pub(crate) const DIFFERENCE_AT_REST: f64 = 1e-6;

/// Differences to either side of a rest, relative to the largest of a column or to 1, are those of one derivative up to here. Larger: a switch on its threshold is
/// not seen; smaller: curvature and what solvers leave are taken for one.
pub(crate) const SIDES_OF_REST: f64 = 1e-2;

/// An orbit of exact integration is closed to this part of its amplitudes, one of steps to [`STEPPED_CLOSED`]. Larger: an orbit that still drifts
/// passes; smaller: rounding of many events refuses one.
pub(crate) const CLOSED: f64 = 1e-9;

/// See [`CLOSED`].
pub(crate) const STEPPED_CLOSED: f64 = 1e-6;

/// A correction that leaves less than this part of the residual was good enough for its derivative to be used again.
pub(crate) const REUSED: f64 = 1e-2;

/// A residual below this part of the amplitudes may be rounding of the way around: a correction that does not make it smaller is not halved. Larger:
/// orbits a little further from closed; smaller: ways around in vain.
pub(crate) const ROUNDING_OF_RETURN: f64 = 1e-13;

/// A residual below this part of the amplitudes is rounding of the way around, and none that is worth a correction. Larger: digits of orbits whose
/// multipliers are near 1; smaller: ways around in vain.
pub(crate) const AT_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A multiplier within this of 1 is 1, and beyond 1 by this one is unstable: what differences leave of it. Larger: slow drifts pass for
/// families of orbits; smaller: rounding makes orbits unstable.
pub(crate) const NEUTRAL: f64 = 1e-6;

/// A transient that returns to this part of its amplitudes after some periods is near an orbit of that order.
pub(crate) const RETURNS: f64 = 1e-3;

/// A transient whose states move less than this part of their amplitudes in a tenth of its span, without events, comes to rest.
pub(crate) const AT_REST: f64 = 1e-3;

/// A step away from an unstable orbit, relative to the amplitudes.
pub(crate) const NUDGE: f64 = 1e-4;

/// The steps of a period where laws are curved keep this part of the tolerance of runs. Larger: orbits that are not found, as what returns lead to is cut by
/// the steps; smaller: time.
pub(crate) const ORBIT_TOL: f64 = 0.1;

/// So many such steps a period may take at the default tolerance, and at another one that times the root of their ratio: where error control looks for the digits of a circuit at rest, or for
/// those of a switch that slides, equal steps take over. Larger: time in vain; smaller: orbits in equal steps, which have no multipliers.
pub(crate) const LAP_STEPS: f64 = 5e3;

/// So many more for each corner of the sources, after which steps begin short. Larger and smaller as [`LAP_STEPS`].
pub(crate) const LAP_STEPS_OF_CORNER: f64 = 1e2;

/// An orbit of steps that keep a tolerance is closed to so many times that, as what returns lead to is cut by the choice of the steps. Larger: finer steps begin further from
/// theirs; smaller: orbits that are not found.
pub(crate) const COARSE_CLOSED: f64 = 10.0;

/// Those of the orbit that is kept have this part of the tolerance of the first ones, and the difference of the two orbits is the error that is stated. Larger: less is known of it, and
/// derivatives see where in a step a device turns off; smaller: time.
pub(crate) const FINER_TOL: f64 = 1e-2;

/// Equal steps of a period where exact integration of straight laws takes too many; the orbit that is kept has twice as many. Larger: time;
/// smaller: orbits that differ by more than what is asked of a run.
pub(crate) const PARTS_OF_PERIOD: f64 = 1000.0;

/// The steps of exact integration in a period over these tell those of a whole one, the second where the first are too many. Larger: many events together pass for a period full of them;
/// smaller: time before a circuit that is too fast is known to be.
pub(crate) const PARTS_FORESEEN: [f64; 2] = [1024.0, 64.0];

/// Table steps of exact integration in a period. Larger: more of them on the way through a calm mode; smaller: deeper tables.
pub(crate) const TABLE_STEPS: f64 = 64.0;

/// Parts of a run in steps, over each of which and over half of which its tangents stay as they are in the middle, at least. Larger: time and memory for
/// each frequency; smaller: parts that are divided, and tangents that change within one.
pub(crate) const LINEAR_PARTS: f64 = 256.0;

/// A part is divided where from one quarter of it to the next its tangents change what the state becomes by more than this part. Larger: responses that are less
/// accurate than they say; smaller: time.
pub(crate) const TANGENT_CHANGE: f64 = 1e-3;

/// Steps of the orbit that is kept, in parts of those of the first, which tell its error. Larger: less is known of it; smaller: time.
pub(crate) const FINER: f64 = 0.5;

/// A response about an orbit in steps is refused where orbits with other sources move the state otherwise than tangents say by more than this part. Larger:
/// wrong responses; smaller: circuits that are curved within [`SHIFTED`].
pub(crate) const SHIFTED_OTHERWISE: f64 = 3e-2;

/// Sources are moved by what moves the state by this part of its amplitudes. Larger: the curvature of laws; smaller: what steps leave open.
pub(crate) const SHIFTED: f64 = 1e-3;

/// They are moved by at most this part of the largest of them. Larger: other modes; smaller: states that owe little to them are not looked at.
pub(crate) const SHIFTED_SOURCES: f64 = 1e-2;

/// A state that is moved by less than this part of its amplitudes is not looked at: steps leave [`STEPPED_CLOSED`] open.
pub(crate) const LEAST_SHIFTED: f64 = 1e-4;

/// What is static repeats but for this part of a turn a period. Larger: the response has a phase; smaller: rounding of modes without a resistance.
pub(crate) const STATIC: f64 = 1e-6;

/// A multiplier that is nearer to 1 leaves no static response. Larger: slow circuits are not looked at; smaller: [`STATIC`] is too fast.
pub(crate) const TOO_SLOW: f64 = 1e-4;

/// No part is divided that is shorter than this part of the longest: a diode turns off as if it were ideal. Larger: responses are off by what it conducts in
/// a part; smaller: time, and rounding of times.
pub(crate) const SHORTEST_PART: f64 = 1e-5;

/// Parts of a stretch beyond which none is divided: tangents that change everywhere are not found by dividing. Larger: time; smaller: errors, which are stated.
pub(crate) const MOST_DIVIDED: usize = 2_000;

/// A device carries no current where its conductance is below this part of the largest current over the largest voltage of all devices. Larger: leakage is left
/// out; smaller: exponentials of resistances that are decades apart.
pub(crate) const CARRIES: f64 = 1e-9;

/// What a switch is about to pass its threshold with is read this part of a quarter of a part before it. Larger: extrapolation; smaller: rounding.
pub(crate) const BEFORE_EVENT: f64 = 1e-3;

/// A run is taken up again this part of a quarter of a part behind a switching. Larger: what the state moves by in it; smaller: rounding of controls.
pub(crate) const BEHIND_EVENT: f64 = 1e-6;

/// A source is taken to repeat after a period that was asked for if it is off its own by no more than this part then. Larger: orbits of sources that are cut in
/// their midst; smaller: tones without a common period cannot be given one.
pub(crate) const PERIOD_OFF: f64 = 1e-2;

/// No search is longer than so many periods, or spans where no source varies.
pub(crate) const LONGEST_SEARCH: f64 = 1e6;

/// A state takes part in a direction of length 1 by more than this. Larger: names left out; smaller: names of what hardly moves.
pub(crate) const TAKES_PART: f64 = 0.1;

/// Waves on lines of which rounding may change more than this part are those of a resonance. Larger: a response of rounding; smaller: none close to a resonance.
pub(crate) const LEAST_KNOWN: f64 = 0.1;

/// A small-signal response of which rounding may leave less than this is told. Larger: wrong digits unsaid; smaller: notes on what rounding does not
/// do, as its bound is one.
pub(crate) const LOST: f64 = 1e-6;

/// An extremum that is no more than this part of the largest value beyond those known is not looked for. Larger: extrema lose digits; smaller:
/// searches among rounding.
pub(crate) const EXTREMUM: f64 = 1e-14;

/// Temperatures that Newton's method moves no further than this are those at rest, K. Larger: energies of tables that rise steeply with temperature lose digits;
/// smaller: rounding of hundreds of degrees.
pub(crate) const WARM: f64 = 1e-9;

/// No more steps of Newton's method from piece to piece of loss tables. Larger: time where heat runs away; smaller: tables of many temperatures are
/// taken for runaway.
pub(crate) const HEATINGS: usize = 200;

/// A fundamental below this part of a signal's root mean square, or of its mean and harmonics, is none, and the signal has no distortion. Larger: small fundamentals are
/// denied; smaller: the rounding of a constant gets a distortion.
pub(crate) const FUNDAMENTAL: f64 = 1e-9;

/// The difference of a value, relative to it, by which matrices and sources are differentiated to it: extrapolated differences leave 4 of its fourth powers, and
/// rounding over it. Larger: frequencies many periods long are differentiated wrongly; smaller: rounding.
pub(crate) const VALUE_STEP: f64 = 1e-4;

/// Cards whose values are changed together are told by numbers that are this part of theirs apart. Larger: other circuits; smaller: two of many are the same number, and each card is
/// looked at alone.
pub(crate) const MARK: f64 = 1e-9;

/// Capacitors, inductors and ideal pairs from which on derivatives are those along sparse steps, where these can be made: exact ones take matrices of that size for each mode, and as
/// many modes as devices change alone. Larger: minutes and gigabytes; smaller: derivatives known to the steps' error instead of rounding.
pub(crate) const STEPPED_DERIVATIVES: usize = 120;

/// The same of whole runs in steps, whose errors change from one to the other. Larger: curvature; smaller: the steps' errors.
pub(crate) const RUN_STEP: f64 = 1e-2;

/// Derivatives of an extremum with the logarithm of a value by differences to both sides of it are not the same if they are this part of the largest of them and of the extremum apart.
/// Larger: ties of two extrema are not told; smaller: curvature over two steps, 4e-4 where the extremum falls with the value, and errors of the runs are.
pub(crate) const SIDES_APART: f64 = 1e-2;

/// Where runs at the ends of tolerances are further from what derivatives let expect than this part of the range, another corner may be worse. Larger:
/// worse corners unsaid; smaller: notes on slight curvature.
pub(crate) const NOT_STRAIGHT: f64 = 0.1;

/// A period changes with a value where it does so by more than this part of what the value does. Larger: orbits of another period are taken for one; smaller: rounding of
/// periods.
pub(crate) const PERIOD_MOVES: f64 = 1e-3;

/// How far pieces of a run are moved to differentiate what is measured on them, as a part of their lengths and values, and of the value that moves them. Larger:
/// curvature; smaller: rounding, and corners of expressions that are looked for otherwise on either side.
pub(crate) const MOVED: f64 = 1e-5;

/// The same relative to the value, at least. Larger: edges that move by their own length; smaller: rounding.
pub(crate) const MEASURE_STEP: f64 = 3e-7;

/// A run that is made again looks for the event that closed it until this part of its time later. Smaller: where rounding puts it an ulp behind the end it is
/// missed, and the derivative of the return is taken by differences; larger: what follows within that time is taken for the orbit's end.
pub(crate) const EVENT_AGAIN: f64 = 32.0 * f64::EPSILON;

/// The part of what controlled sources take and deliver up to which they are in balance, as the two sides of an ideal transformer, and no input of a table. Larger: an amplifier
/// beside a large transformer is overlooked; smaller: rounding is an input.
pub(crate) const BALANCED: f64 = 1e-9;

/// The part of a table's input that is stored from which on a note says so beside the efficiency. Larger: efficiencies of transients that are taken for those of the steady
/// state; smaller: notes on what no digit shows.
pub(crate) const STORED: f64 = 1e-2;

/// The difference of an argument, relative to it, by which functions without a derivative in closed form are differentiated in expressions over measured signals. Larger:
/// corners of tables count from further away; smaller: rounding.
pub(crate) const ARGUMENT_STEP: f64 = 1e-6;

/// Reductions of a circuit with sources for the changes of values are of the same mode where matrices agree to this part of their largest entries. Larger: other bases of fast states pass
/// for the same; smaller: rounding of reductions in fewer digits costs one for each value.
pub(crate) const SAME_REDUCTION: f64 = 1e-8;

/// A switch whose control is within this part of its terms from its threshold where a run begins may begin on its other side where a value is another by twice [`VALUE_STEP`]. Larger:
/// reductions of its own for each value where none are needed; smaller: a start on the other side is not told.
pub(crate) const NEAR_THRESHOLD: f64 = 1e-2;

/// The orbit of a large circuit, which is made of steps on matrices without their zeros, is computed to this part of the tolerance of runs, and its rows are. Larger: multipliers of fewer digits; smaller:
/// time.
pub(crate) const FINER_ORBIT: f64 = 1e-1;

/// No finer than this. Smaller: steps that are made of rounding; larger: less than what is asked for.
pub(crate) const FINEST_ORBIT: f64 = 1e-10;

/// A correction by products leaves this part of the residual, where the return goes on as it did. Larger: corrections, a return each; smaller: products for a direction that the next
/// correction leaves.
pub(crate) const LEFT_OF_RESIDUAL: f64 = 1e-3;

/// A correction that leaves no more than this many times what products let expect came to a return of the same active sets: the next one is computed to the end. Larger: products that the next
/// change of an active set makes vain; smaller: spaces of products that are begun again.
pub(crate) const KEPT_ITS_WORD: f64 = 30.0;

/// An orbit by products is closed far enough here, and where its largest multiplier is μ at 1 − μ of this: what it is off by is then no more than this. Larger: slow orbits are less exact; smaller:
/// returns in vain.
pub(crate) const CLOSED_ENOUGH: f64 = 1e-9;

/// Rounding of the steps of a return leaves no less than this of its residual. Larger: slow orbits are less exact; smaller: returns in vain.
pub(crate) const CLOSED_AT_BEST: f64 = 1e-12;

/// Below [`STEPPED_CLOSED`] a correction that leaves more than this part of the residual is the last one. Larger: returns in vain; smaller: orbits less exact than they could be.
pub(crate) const GOES_ON: f64 = 0.5;

/// Steps are chosen anew where a correction moves the state by more than this part of its amplitudes. Larger: events leave the steps that are short for their sake; smaller: returns that are no smooth
/// function of where they begin.
pub(crate) const STEPS_ANEW: f64 = 1e-3;

/// A quantity counts in products by the root of its energy, and by this part of the largest of all at least. Larger: products are no contraction any more where the circuit is passive; smaller: what
/// stores little is closed late.
pub(crate) const LEAST_WEIGHT: f64 = 1e-3;

/// Where an extremum is reached again to this part of what the values span, its derivatives there are looked at too. Larger: derivatives that hold are told to be one-sided; smaller: ties
/// that rounding parts are not told. Along sparse steps it is their tolerance.
pub(crate) const SAME_EXTREMUM: f64 = 1e-9;

/// So many other times at which an extremum is reached are looked at. Larger: runs back for each; smaller: a tie is not told where these have the derivatives of the first one.
pub(crate) const MOST_RIVALS: usize = 6;

/// Derivatives to the logarithm of a value at two times at which an extremum is reached are the same if they are to this part of the larger one, or of what the signal spans. Larger: ties are not told;
/// smaller: rounding is.
pub(crate) const SAME_DERIVATIVE: f64 = 1e-9;

/// Capacitors, inductors and ideal pairs up to which an orbit is made linear, for small signals and derivatives: dense matrices in some minutes. Larger: commands that take hours
/// instead of an error; smaller: errors for circuits that they master.
pub(crate) const MOST_LINEARISED: usize = 1200;

/// The part of a radian of the highest frequency that a step of a large circuit takes at most, where its response to small sines is asked for. Larger: errors, which are stated; smaller: more steps.
pub(crate) const RADIANS_OF_STEP: f64 = 0.25;

/// The state that repeats in a response of a large circuit is found to this part of what sources make of a period. Larger: an error that counts beside that of the steps; smaller: corrections of rounding.
pub(crate) const RESPONSE_CLOSED: f64 = 1e-9;

/// The part of a residual that one correction of that state leaves. Larger: more corrections; smaller: more products.
pub(crate) const LEFT_OF_RESPONSE: f64 = 1e-10;

/// Frequencies at which a response of a large circuit is compared with that of halved steps, at most. Larger: time; smaller: an error that is largest between them is stated too small.
pub(crate) const COMPARED: usize = 8;

/// So many times the largest difference at these is what the others may be off by, as steps are those of the highest frequency of two octaves. Larger: errors that are stated too large; smaller: too small.
pub(crate) const BETWEEN_COMPARED: f64 = 4.0;

/// Products with the derivative of an orbit that the response at one frequency may take, and that are kept for the next ones. Larger: memory and time for each frequency; smaller: circuits of many slow modes
/// have no response.
pub(crate) const MOST_RECYCLED: usize = 240;

/// Values to which derivatives of a large circuit are differences of runs, where its steps do not tell them. Larger: hours of runs that nobody meant to ask for; smaller: values have to be named in several runs.
pub(crate) const MOST_BESIDE: usize = 50;

/// Derivatives along sparse steps are stated to be off by so many times what steps of twice the length are. Larger: errors that are stated too large; smaller: too small.
pub(crate) const TIMES_APART: f64 = 8.0;

/// And by this part at least where a device changes within a step: its instant is that of a line, also where currents end within nanoseconds, in long and short steps alike. Larger: errors
/// that are stated too large; smaller: too small (docs/validation.md).
pub(crate) const LEAST_BENT: f64 = 3e-2;
