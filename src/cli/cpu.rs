//! User CPU time, s.

use std::io;

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;

/// Of this process so far.
///
/// # Errors
/// Those of the operating system.
pub(super) fn own() -> io::Result<f64> {
    user(UsageWho::RUSAGE_SELF)
}

/// Of all processes that this one started and waited for.
///
/// # Errors
/// Those of the operating system.
pub(super) fn of_children() -> io::Result<f64> {
    user(UsageWho::RUSAGE_CHILDREN)
}

fn user(who: UsageWho) -> io::Result<f64> {
    Ok(getrusage(who)?.user_time().num_microseconds() as f64 * 1e-6)
}
