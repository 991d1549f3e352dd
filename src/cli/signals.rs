//! Ctrl-C and its like: a run ends with what it has, and the status says why.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::signal::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

/// What asks a run to end, with its name.
const SIGNALS: [(i32, &str); 3] = [(SIGINT, "SIGINT"), (SIGTERM, "SIGTERM"), (SIGHUP, "SIGHUP")];

/// Signals that were received. Ctrl-C after any of them ends the process at once; others do not, as `timeout` sends each twice.
#[derive(Debug, Default)]
pub(super) struct Signals {
    received: Arc<AtomicBool>,
    which: Arc<AtomicUsize>,
}

impl Signals {
    /// Watches from now on.
    ///
    /// # Errors
    /// The system's.
    pub(super) fn watch() -> io::Result<Self> {
        let signals = Self::default();
        for (signal, _) in SIGNALS {
            if signal == SIGINT {
                let status = Self::status(signal);
                flag::register_conditional_shutdown(signal, status, signals.received.clone())?;
            }
            flag::register_usize(signal, signals.which.clone(), signal as usize)?;
            flag::register(signal, signals.received.clone())?;
        }
        Ok(signals)
    }

    /// Set once a signal came.
    pub(super) fn flag(&self) -> &AtomicBool {
        &self.received
    }

    /// The signal that came, with its name.
    pub(super) fn received(&self) -> Option<(i32, &'static str)> {
        let which = self.which.load(Ordering::SeqCst);
        SIGNALS
            .into_iter()
            .find(|(signal, _)| *signal as usize == which)
    }

    /// The exit status by convention.
    pub(super) const fn status(signal: i32) -> i32 {
        128 + signal
    }
}
