//! `circ watch`: carries out a command anew whenever a file that it reads changes, and shows its page in the browser.
//!
//! [`job`] runs the command as a process of its own, so that a run can be ended when its netlist has changed already; [`server`] hands out the
//! page on this machine alone.

mod job;
mod server;

use std::ffi::OsString;
use std::thread;
use std::time::Duration;

use super::args::WatchArgs;
use super::exit::{Exit, Failure};
use super::signals::Signals;
use super::streams::Streams;
use job::{Ended, Job, stamp};
use server::Server;

/// How often files are looked at.
const LOOK: Duration = Duration::from_millis(100);

/// Runs and shows until a signal comes.
///
/// # Errors
/// See [`Failure`].
pub(super) fn watch(args: &WatchArgs, streams: &Streams) -> Result<Exit, Failure> {
    let Own {
        port,
        no_open,
        command,
    } = Own::of(args)?;
    let job = Job::of(&command)?;
    let server = Server::start(port)?;
    let signals = Signals::watch()?;
    streams.data(format!("{}\n", server.address()))?;
    if !no_open && open::that_detached(server.address()).is_err() {
        streams.note(
            "browser",
            "no browser could be opened; the page is at the address above",
        );
    }
    let mut latest = None;
    loop {
        let files = job.files();
        let before = stamp(&files);
        let is_over = || signals.received().is_some() || stamp(&files) != before;
        match job.run(is_over)? {
            Ended::Done {
                well,
                page,
                messages,
            } => {
                streams.say(&messages);
                // Where there is none the one before stays, below what was said.
                latest = page.or(latest);
                server.publish(latest.clone(), (well, &messages));
                while !is_over() {
                    thread::sleep(LOOK);
                }
            }
            Ended::Stopped => {}
        }
        if let Some((signal, _)) = signals.received() {
            return Ok(Exit::Signal(signal));
        }
        // An editor may write a file in several steps.
        thread::sleep(LOOK);
    }
}

/// The options of `watch` itself, wherever they stand, as one types them (`circ watch FILE --no-open`), and the command without them.
struct Own {
    port: Option<u16>,
    no_open: bool,
    command: Vec<OsString>,
}

impl Own {
    fn of(args: &WatchArgs) -> Result<Self, Failure> {
        let mut own = Self {
            port: args.port,
            no_open: args.no_open,
            command: Vec::new(),
        };
        let mut words = args.command.iter();
        while let Some(word) = words.next() {
            let text = word.to_string_lossy();
            if text == "--no-open" {
                own.no_open = true;
            } else if text == "--port" {
                own.port = Some(port(
                    &words.next().map_or("".into(), |n| n.to_string_lossy()),
                )?);
            } else if let Some(number) = text.strip_prefix("--port=") {
                own.port = Some(port(number)?);
            } else {
                own.command.push(word.clone());
            }
        }
        Ok(own)
    }
}

fn port(text: &str) -> Result<u16, Failure> {
    let what = || format!("`--port {text}`: expected a number from 0 to 65535");
    text.parse()
        .map_err(|_| Failure::told("bad-option", what()))
}
