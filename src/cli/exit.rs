//! Exit statuses and why a command could not finish.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::signals::Signals;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::explain::{Explanation, explain};
use crate::integrate::Error;
use crate::report::PictureError;
use crate::waveform::WaveformError;
use crate::waveform::compare::CompareError;

/// The status of the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// 0: done.
    Done,
    /// 1: done, and the answer is no.
    No,
    /// 2: it could not be done.
    Failed,
    /// 128 + its number: ended by a signal.
    Signal(i32),
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Done => 0,
            Exit::No => 1,
            Exit::Failed => 2,
            Exit::Signal(signal) => u8::try_from(Signals::status(signal)).unwrap_or(u8::MAX),
        })
    }
}

/// Why a command could not be carried out (status 2).
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Standard output or standard error broke; a closed pipe is no failure.
    #[error("writing failed: {0}")]
    Stream(#[from] io::Error),
    /// A file could not be read or written.
    #[error("{}: {error}{}", path.display(), folder(path, error))]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A file of waveforms could not be read.
    #[error("{}: {error}", path.display())]
    Waveforms {
        /// Which.
        path: PathBuf,
        /// Why.
        error: WaveformError,
    },
    /// The netlist has faults; they have been shown already.
    #[error("{0}")]
    Faults(String),
    /// A picture could not be made.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Two sets of waveforms have nothing in common.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// A run, or its start, could not be computed; shown at its element where the circuit is at hand.
    #[error(transparent)]
    Run(#[from] Box<Error>),
    /// Anything else that the user should read.
    #[error("{message}")]
    Told {
        /// A code that `circ explain` knows.
        code: &'static str,
        /// What is wrong.
        message: String,
        /// What to do, where more is known than what stands behind the code.
        help: Option<String>,
    },
}

/// Says where a folder is missing.
fn folder(path: &Path, error: &io::Error) -> String {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    match parent.filter(|p| error.kind() == io::ErrorKind::NotFound && !p.exists()) {
        Some(missing) => format!("; there is no folder `{}`", missing.display()),
        None => String::new(),
    }
}

impl Failure {
    /// What the user should read, under a code that `circ explain` knows.
    pub fn told(code: &'static str, message: String) -> Self {
        Self::Told {
            code,
            message,
            help: None,
        }
    }

    /// A run that could not be made, where no circuit is at hand to show its place in.
    pub fn of_run(before: &str, error: &Error) -> Self {
        let Diagnostic { code, help, .. } = error.finding();
        Self::Told {
            code,
            message: format!("{before}{error}"),
            help,
        }
    }

    /// Its code and what to do.
    #[must_use]
    pub fn code(&self) -> (&'static str, Option<String>) {
        let code = match self {
            Self::Stream(_) => "stream",
            Self::File { .. } => "file",
            Self::Waveforms { .. } => "waveforms",
            Self::Faults(_) => "netlist",
            Self::Picture(_) => "no-picture",
            Self::Compare(_) => "nothing-in-common",
            Self::Run(error) => {
                let Diagnostic { code, help, .. } = error.finding();
                return (code, help);
            }
            Self::Told { code, help, .. } if help.is_some() => return (code, help.clone()),
            Self::Told { code, .. } => code,
        };
        (code, explain(code).map(Explanation::help))
    }

    /// A failure of this file.
    pub fn file(path: &Path, error: io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            error,
        }
    }

    /// Whether the reader of our output went away.
    #[must_use]
    pub fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Stream(e) | Self::File { error: e, .. } if e.kind() == io::ErrorKind::BrokenPipe)
    }
}
