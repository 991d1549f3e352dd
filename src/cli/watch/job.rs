//! The command that is carried out anew.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command as Process, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::SystemTime;

use clap::{CommandFactory, Parser};
use tempfile::TempDir;

use super::super::args::{Cli, Command, Input, STDIN};
use super::super::exit::Failure;
use super::super::{code, input, no_such_input, with_command};
use super::LOOK;

/// What each file was when it was looked at; `None` where there is none.
pub(super) fn stamp(files: &[PathBuf]) -> Vec<Option<(SystemTime, u64)>> {
    let state = |path: &PathBuf| {
        let data = fs::metadata(path).ok()?;
        Some((data.modified().ok()?, data.len()))
    };
    files.iter().map(state).collect()
}

/// A command with a page among its outputs.
pub(super) struct Job {
    /// As it is typed after `circ`.
    arguments: Vec<OsString>,
    input: Input,
    folder: TempDir,
}

/// How a run ended.
pub(super) enum Ended {
    /// By itself: whether all went well, the page, where there is one, and what was said on standard error.
    Done {
        well: bool,
        page: Option<String>,
        messages: String,
    },
    /// As it was asked to.
    Stopped,
}

impl Job {
    /// The command that is typed after `circ watch`.
    ///
    /// # Errors
    /// [`Failure::Told`] for a command that cannot be carried out or has no page.
    pub(super) fn of(typed: &[OsString]) -> Result<Self, Failure> {
        let typed = [OsString::from("circ")].into_iter().chain(typed.to_vec());
        let mut command = Cli::command();
        let arguments = with_command(typed.collect(), &command);
        let cli = Cli::try_parse_from(&arguments);
        let cli = cli.map_err(|error| {
            let error = no_such_input(error, &mut command);
            let text = error.to_string();
            let text = text.strip_prefix("error: ").unwrap_or(&text);
            let said = text.split("\n\nUsage:").next().unwrap_or(text);
            Failure::told(code(error.kind()), said.to_owned())
        })?;
        let input = match cli.command {
            Command::Sim(args) => args.input,
            Command::Pss(args) => args.input,
            Command::Ac(args) => args.input,
            _ => {
                let message = "`circ watch` takes sim, pss or ac and their options";
                return Err(Failure::told("not-watched", message.into()));
            }
        };
        if input.file.as_os_str() == STDIN {
            let message = "`circ watch` takes a file; standard input does not change";
            return Err(Failure::told("not-watched", message.into()));
        }
        Ok(Self {
            arguments: arguments[1..].to_vec(),
            input,
            folder: TempDir::with_prefix("circ-watch-")?,
        })
    }

    /// The files that the netlist is read from.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let fresh = Input {
            read: OnceLock::new(),
            ..self.input.clone()
        };
        let sources = input::load(&fresh).sources;
        let mut files = vec![self.input.file.clone()];
        files.extend(sources.files.iter().map(|file| PathBuf::from(&file.path)));
        files
    }

    /// Carries the command out, until `is_over`.
    ///
    /// # Errors
    /// Where it cannot be begun.
    pub(super) fn run(&self, is_over: impl Fn() -> bool) -> Result<Ended, Failure> {
        let place = |name: &str| self.folder.path().join(name);
        let (page, messages) = (place("page.html"), place("messages"));
        let _ = fs::remove_file(&page);
        let child = Process::new(std::env::current_exe()?)
            .args(&self.arguments)
            .arg("-o")
            .arg(&page)
            .env_remove("CLICOLOR_FORCE")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(&messages)?)
            .spawn()?;
        let mut child = Ending(child);
        let status = loop {
            match child.0.try_wait()? {
                Some(status) => break status,
                None if is_over() => return Ok(Ended::Stopped),
                None => thread::sleep(LOOK),
            }
        };
        Ok(Ended::Done {
            well: status.success(),
            page: fs::read_to_string(&page).ok(),
            messages: String::from_utf8_lossy(&fs::read(&messages)?).into_owned(),
        })
    }
}

/// A process that does not outlive this value.
struct Ending(Child);

impl Drop for Ending {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
