//! When two times are one, and how many steps make a span.

/// Two times are one where they differ by no more than this part of themselves: event times, corners, clocks, rows and the ends of steps.
/// Sums of two or three times carry that. Larger: distinct edges fall together; smaller: steps and pulses of a rounding's length.
pub(crate) const SAME_TIME: f64 = 8.0 * f64::EPSILON;

/// Two lengths of time are one where they differ by no more than this part of the times between which they lie: their difference is known no better. Larger: an exponential
/// stands for one that is another; smaller: each is made again.
pub(crate) const SAME_LENGTH: f64 = 4.0 * f64::EPSILON;

/// The same for what arrives over a line: its time is a sum of a delay and a time that was a sum already. Larger: waves that follow each
/// other closely arrive as one; smaller: the two sides of a jump are told apart by rounding.
pub(crate) const ARRIVED: f64 = 16.0 * f64::EPSILON;

/// A count of steps is whole where it is whole to this part: decimal fractions are not exact in binary. Larger: a short last step is left
/// out; smaller: a step of rounding is added.
pub(crate) const WHOLE: f64 = 1e-9;

/// A row this close before the end, in parts of a print step, is the last one; unlike [`WHOLE`] it is no part of the count,
/// which carries its roundings. Larger: a last interval that was meant is left out; smaller: two rows at the end.
pub(crate) const LAST_ROW: f64 = 1e-6;

/// A period may be any fraction within this part of it: frequencies and periods are written as decimals or computed by a division or two. Larger:
/// periods that differ become one; smaller: 1/(65 kHz) has no period in common with 50 Hz.
pub(crate) const SAME_PERIOD: f64 = 4.0 * f64::EPSILON;

/// Print steps in a span where nothing says how many. Larger: rows that nobody asked for; smaller: coarse pictures.
pub(crate) const SPAN_PARTS: f64 = 1000.0;

/// Print steps at most where a largest step says how many, as LTspice's `.tran 0 5m 0 10n` does. Larger: files that nobody can look at; smaller: rows further
/// apart than was asked for.
pub(crate) const MOST_PARTS: f64 = 1e5;

/// How much a measurement may change where two of three rows are left out, over its value, before a note says that rows are too far apart. Larger: wrong powers
/// without a word; smaller: notes where the eye sees nothing.
pub(crate) const ROWS_APART: f64 = 1e-2;

/// The same before rows are computed closer for measurements, once. As straight lines are off by the square of their length, a ninth of it is left out at
/// most then. Larger: less exact measurements; smaller: a second run and more rows for more circuits.
pub(crate) const ROWS_CLOSE: f64 = 1e-3;

/// States of a circuit up to which measurements of an exact run see what happens between events and not its rows: the exponentials of its modes cost their cube.
/// Larger: measurements that take longer than the run; smaller: more measurements on straight lines.
pub(crate) const MOST_STATES: usize = 12;

/// Changes of mode are kept from this part of a run before what is measured on. It is no simple fraction: none is to happen just there.
/// Larger: memory and time; smaller: none that is measured.
pub(crate) const LEAD: f64 = 6.18e-3;

/// Periods of the fastest source up to which they do: a kilobyte each for its changes of mode. Larger: more memory; smaller: long runs are measured on rows.
pub(crate) const MOST_PERIODS: f64 = 1e5;

/// How far the polynomial of an expression may stand from it where it has no values, over the largest value of the expression. Larger: less exact measurements; smaller:
/// more pieces about corners of `abs` and the like.
pub(crate) const CURVE_CLOSE: f64 = 1e-10;

/// How far two rows of one time may be apart, over the largest value of their signal, and be one value. Larger: small jumps are not crossings; smaller: the
/// rounding of an event on its level is several.
pub(crate) const NO_STEP: f64 = 1e-9;

/// The part of a print step that is an instant where spikes are looked for. Larger: rows that show a fall are taken for one; smaller: a spike of two rows, at both ends of an
/// edge, seems to last.
pub(crate) const BRIEF: f64 = 1e-2;

/// How often as large as the next row, and as all that lasts from one row to the next in its unit, a value at an event is before a note says that rows do not
/// show its course. Larger: spikes of kilovolts without a word; smaller: notes on the peaks of converters.
pub(crate) const SPIKE: f64 = 100.0;

/// Radians by which an oscillation turns while it decays by e from which on it is said that rows do not show it. Larger: ringing of parasitics without a word;
/// smaller: notes on what hardly overshoots.
pub(crate) const RINGS: f64 = 4.0;

/// Rows of a picture for each period of the fastest source. Larger: more memory and larger files for pictures; smaller: a second run for more circuits.
pub(crate) const ROWS_A_PERIOD: f64 = 16.0;

/// How far a row of a picture may stand from the straight line that two of three rows left out make, over the extent of its signal, before rows are
/// computed closer, once; a ninth of it is what the eye sees. Larger: curves with edges; smaller: a second run and more rows for more circuits.
pub(crate) const LINES_CLOSE: f64 = 2e-2;

/// Twice the rows at events over those of the grid from which on a note says that measurements may see too little between events, where memory does not
/// allow more. Larger: ripples that are not seen without a word; smaller: notes where all is seen.
pub(crate) const CROWDED: f64 = 4.0;

/// A measurement below this part of the largest value in the rows counts as zero there. Larger: small powers are not looked at; smaller: means of what has none.
pub(crate) const NOTHING: f64 = 1e-6;

/// An event that a copy of a part has foreseen is looked for until this part of its time after it: the two have gone other steps, and their
/// roundings differ. Larger: where rounding hides the event the part is seen so much too late; smaller: it is missed.
pub(crate) const FORESEEN: f64 = 1e-9;
