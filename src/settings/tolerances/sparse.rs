//! Steps of large circuits.

/// Factors kept. Larger: memory; smaller: those of an active set or step length that comes again are made again.
pub(crate) const KEPT: usize = 96;

/// So often all ports that disagree change sides at once though they grow no fewer, before it is one at a time. Larger: rounds in vain; smaller: rounds of one port.
pub(crate) const PATIENCE: usize = 10;

/// Rounds by port before the dense problem is tried. Larger: rounds in vain; smaller: a dense matrix in their place.
pub(crate) const LONE: usize = 2;

/// Most entries of a dense response of states to ports. Larger: hundreds of megabytes; smaller: degenerate circuits of this size are refused.
pub(crate) const MOST_DENSE: usize = 1 << 25;

/// The step that takes up a jump, as a part of the span. Larger: fast motions behind an edge are cut; smaller: slopes of rounding.
pub(crate) const INSTANT: f64 = 1.0 / (1_u64 << 34) as f64;

/// The first step behind a jump, in units of [`INSTANT`]. Larger: steps in vain; smaller: more steps until they are long.
pub(crate) const AFTER: f64 = 64.0;

/// Where in a step the slopes of sources at its end are taken, as they may turn there. Larger: rounding takes it beyond; smaller: the slope of a sine some way before.
pub(crate) const INSIDE: f64 = 1.0 - 1e-9;

/// Such steps at most. Larger: more of them where something is as fast as they are; smaller: a jump in several parts is cut.
pub(crate) const INSTANTS: u32 = 8;

/// A jump is over where the next of these steps moves the state by less than this part. Larger: the end of a jump is taken for a slope; smaller: fast motions for a jump.
pub(crate) const RESTS: f64 = 1e-6;

/// Storage elements and ideal pairs up to which dense matrices take over where sparse steps cannot go on. Larger: runs that take hours instead of an error; smaller: errors
/// for circuits that dense matrices master.
pub(crate) const MOST_DENSE_STATES: usize = 2000;

/// So many steps have to come further than [`PROGRESS`]. Larger: a run that is stuck is noticed late; smaller: runs of many events end that would come to their end.
pub(crate) const PROGRESS_STEPS: u64 = 20_000;

/// A part of the span, see [`PROGRESS_STEPS`].
pub(crate) const PROGRESS: f64 = 1e-4;

/// Factors kept where a period is gone through again and again, each step of which comes again. Larger: memory, up to [`Settings::max_kept`](crate::settings::Settings::max_kept) bytes; smaller: all of them are made again
/// in each period.
pub(crate) const KEPT_OF_RETURNS: usize = 1 << 14;

/// The part of the time between two instants that the first step behind an instant is tried with, where steps are chosen to be made again. Larger: steps in vain, once; smaller: many short
/// steps in each return.
pub(crate) const FIRST_TRIED: f64 = 1.0 / 64.0;

/// Rates of states, in energy, and outputs jump where a device changes within a step if they do by more than this part of themselves, and of the amplitude of the output. Larger: derivatives lack what the instant moves;
/// smaller: what changes in the course of the step counts as a jump.
pub(crate) const LEAPS: f64 = 1e-4;

/// A device is the one that changes first if it is due within its step, or this part of it beside, as lines have it. Larger: those that follow it count as well; smaller: the first one is missed.
pub(crate) const PRIMARY: f64 = 0.5;

/// Devices change together where the times at which they are due follow the states alike to this part. Larger: two of them count as one; smaller: one counts as two.
pub(crate) const ALIKE: f64 = 1e-3;

/// So much of a step behind the instant at which a device is due it is told which devices conduct then. Larger: those that change a little later count as well; smaller: rounding tells.
pub(crate) const PUSH: f64 = 1e-3;
