//! Every number that decides something, by the question that it answers.
//!
//! | question | file |
//! |---|---|
//! | are two times one, is a count whole | `times` |
//! | is a guard zero, does a control pass its threshold, will events end | `events` |
//! | did the state jump, does a condition at an instant hold | `jumps` |
//! | is a number zero beside others, is an inverse to be trusted | `ranks` |
//! | how long is a step of the implicit methods, how exact must it be | `steps` |
//! | how does an exact mode travel | `exponentials` |
//! | how wrong does a run say it is | `stated` |
//! | does a method for complementarity problems go on | `complementarity` |
//! | is a system passive | `passivity` |
//! | is an orbit closed, is it stable | `periodic` |
//! | is an eigenvalue known that products alone tell | `krylov` |
//! | does a hypothesis of a theorem hold | `theorems` |
//! | are two numbers of a netlist meant to be one | `netlists` |
//!
//! They are relative, hence without unit, to what their documentation says: amplitudes, terms of a sum, the largest entry of an equilibrated matrix. The
//! scales that they rest on: doubles carry 1.1e-16 (2⁻⁵³); entries of a circuit's matrices, after products of a few of them, 1e-12; solutions of stiff
//! circuits 1e-9. What users may change stands in [`Settings`](super::Settings). Counts (iterations, sizes of caches, largest problems) stand
//! where they are counted.

pub(crate) mod complementarity;
pub(crate) mod events;
pub(crate) mod exponentials;
pub(crate) mod jumps;
pub(crate) mod krylov;
pub(crate) mod netlists;
pub(crate) mod passivity;
pub(crate) mod periodic;
pub(crate) mod ranks;
pub(crate) mod sparse;
pub(crate) mod stated;
pub(crate) mod steps;
pub(crate) mod theorems;
pub(crate) mod times;
