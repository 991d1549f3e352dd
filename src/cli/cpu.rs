//! User CPU time, s.

use std::io;

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;

/// Of all processes that this one started and waited for.
///
/// # Errors
/// Those of the operating system.
pub(super) fn of_children() -> io::Result<f64> {
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    Ok(usage.user_time().num_microseconds() as f64 * 1e-6)
}
