//! What a run says of its own error, and the second run that verifies it.

/// The part of the largest energy that may be missing before a run warns of it. Where all is right it is rounding, and up to 4e-5 where steps
/// follow waves on lines. Larger: a wrong jump may pass; smaller: long steps beside lines would be called wrong.
pub(crate) const UNBALANCED: f64 = 1e-3;

/// The stated error, relative to the amplitudes, from which on a run warns of it: values that are off by more look wrong to the eye. Larger: what is
/// of no use passes as a result; smaller: runs in few long steps, which are made to be looked at, are warned of.
pub(crate) const IMPRECISE: f64 = 0.1;

/// Root mean square of the stated error, relative to the amplitudes, up to which a warning says that a larger one is that of single rows. Larger: what is off for good is
/// called an edge; smaller: a converter whose diodes turn off between rows is called useless.
pub(crate) const SELDOM: f64 = 1e-2;

/// An error that is no small part of the amplitudes is told but roughly by what runs differ: it is stated larger by the part of [`IMPRECISE`] that it is, at
/// most so many times. Larger: what is of no use is stated larger than it is; smaller: the statement no longer bounds such errors (`tests/stated/`).
pub(crate) const ROUGHLY: f64 = 4.0;

/// Prescribed steps of the two companions, over those of the run. Halves tell the error of the run even where its steps are too long for what they
/// follow; where a change of a device stands alike in both, twice as long ones do. Larger: the distances say less of the run's own error; smaller: dearer.
pub(crate) const FINER_AND_COARSER: [f64; 2] = [0.5, 2.0];

/// The error of a run of first order over what these differ by: 2 and 1 were the errors smooth; those of events are not. Larger: errors
/// stated larger than they are; smaller: the statement no longer bounds the error (`tests/stated/`).
pub(crate) const FIRST_ORDER: [f64; 2] = [4.0, 1.25];

/// The same for methods of order 2 and 3: 4/3 and 1/3 or less were they smooth. A step in which a device changes errs by h² times a part that depends
/// on where in the step the change is, in each run another one.
pub(crate) const HIGHER_ORDER: [f64; 2] = [6.0, 1.25];

/// How far events stand aside at most, over what they do in a companion: 2 beside halves of the steps. Larger and smaller as [`FIRST_ORDER`].
pub(crate) const EVENTS: f64 = 2.0;

/// Tolerance of the companion of a run whose steps are chosen, over that of the run. It makes its steps whole where the run makes them in
/// halves, so that they are longer even where rows and edges choose them.
pub(crate) const LOOSER: f64 = 2.0;

/// The error of the run over what that companion differs by: 1/3 or less were the errors smooth. Larger and smaller as [`FIRST_ORDER`].
pub(crate) const LOOSER_SHARE: f64 = 1.25;

/// The same for steps that tell their error themselves, whose lengths are powers of √2: of order 3 they are one power longer. Larger: the
/// distance says less of the run's own error; smaller: its steps are those of the run and it sees no error.
pub(crate) const LOOSER_EMBEDDED: f64 = 4.0;

/// The error of the run over what that companion differs by: 1/5 were the errors smooth and of one sign; those of a row on the edge of a diode's
/// voltage are not. Larger and smaller as [`FIRST_ORDER`].
pub(crate) const LOOSER_EMBEDDED_SHARE: f64 = 1.7;

/// Steps by which companions read what flows at an instant, over those of the run: a curved diode's voltage is the logarithm of a current that grows
/// with the time since the instant, and the current that keeps a capacitor's voltage has its rounding over the step. Larger: errors stated larger than
/// they are; smaller: that of a reading is not seen.
pub(crate) const READING: f64 = 64.0;

/// The error of exact runs, relative to amplitudes: rounding in stiff circuits. Larger: a wrong run is confirmed; smaller: right ones are not.
pub(crate) const EXACT: f64 = 1e-9;

/// Tolerances of the verifying steps, one after the other until they know enough. Their own error is no less than that.
pub(crate) const TOLERANCES: [f64; 3] = [1e-4, 1e-5, 1e-6];

/// Steps of a verifying run at most. Larger: a check that takes minutes for a run of milliseconds; smaller: long runs are not checked.
pub(crate) const MOST_STEPS: u64 = 300_000;

/// Where those do not suffice, the part of the run is verified that they reached, over this. Larger: less of it; smaller: the tighter ones of
/// [`TOLERANCES`] do not reach its end (steps of order 2 are √10 times as many from one to the next).
pub(crate) const SHORTENED: f64 = 4.0;

/// Print steps of that part at least. Smaller: a start is taken for a run; larger: less is verified.
pub(crate) const ROWS_LEFT: f64 = 10.0;

/// An error of the verifying steps, relative to amplitudes, below which they know enough. Larger: a verdict that says little; smaller: dearer.
pub(crate) const ENOUGH: f64 = 3e-3;

/// The distance of two runs of steps may be smaller than the error of the finer one by this factor. Larger: a verdict that says little;
/// smaller: right runs are called wrong.
pub(crate) const SAFETY: f64 = 2.0;

/// Events of the two methods may be apart by this part of a print step where the events of the verifying runs agree better, and rows so close
/// to an event are left out: what decays within an instant is not followed by steps. Larger: less is compared; smaller: the steps' own event
/// times are held against the run.
pub(crate) const ASIDE: f64 = 0.01;

/// Where more than this part of the rows would be left out (a print step of a clock's period), all are compared.
pub(crate) const MOST_LEFT_OUT: f64 = 0.5;

/// The smallest amplitude that errors of a comparison are related to, as a part of the largest amplitude of the same unit: a signal below it
/// is the rounding or leakage of its neighbours. Larger: small signals may differ; smaller: rounding counts as a difference.
pub(crate) const AMPLITUDE_FLOOR: f64 = 1e-9;
