//! Standard output for data, standard error for everything else.

use std::env;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use console::Term;
use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};

use super::args::MessageFormat;
use super::batch::Log;
use super::render;
use crate::diagnostic::Severity;
use crate::integrate::{Note, Places};

/// How often a progress bar moves by itself: what takes long is still alive.
const TICK: Duration = Duration::from_millis(120);
/// Lines of a terminal when it does not say.
const DEFAULT_SIZE: (usize, usize) = (24, 80);

/// Whether the terminal only takes text, line after line.
fn is_dumb() -> bool {
    env::var_os("TERM").is_some_and(|term| term == "dumb")
}

/// Whether a stream shows colours: a terminal that can, unless the user's environment says otherwise (`NO_COLOR`, `CLICOLOR=0`), and
/// wherever it asks for them (`CLICOLOR_FORCE`).
fn colours(is_terminal: bool) -> bool {
    let no_colour = env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let unwanted = env::var_os("CLICOLOR").is_some_and(|value| value == "0");
    let forced = env::var_os("CLICOLOR_FORCE").is_some_and(|value| value != "0");
    let able = forced || (is_terminal && !is_dumb() && !unwanted);
    able && !no_colour
}

/// Where a command writes, and how much it says.
pub struct Streams {
    /// Only errors on standard error.
    pub quiet: bool,
    /// Explanations on standard error.
    pub verbose: bool,
    /// How findings are written.
    pub messages: MessageFormat,
    /// What is written in place of standard error.
    pub log: Option<&'static Log>,
}

impl Streams {
    /// Whether data goes to a person.
    #[must_use]
    pub fn out_is_terminal(&self) -> bool {
        io::stdout().is_terminal()
    }

    /// Whether a person reads standard error.
    #[must_use]
    pub fn err_is_terminal(&self) -> bool {
        self.log.is_none() && io::stderr().is_terminal()
    }

    /// Whether standard error shows colours.
    #[must_use]
    pub fn colours(&self) -> bool {
        colours(self.err_is_terminal())
    }

    /// Whether standard output shows colours.
    #[must_use]
    pub fn out_colours(&self) -> bool {
        colours(self.out_is_terminal())
    }

    /// Lines and columns of the terminal on standard output.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        Term::stdout()
            .size_checked()
            .map_or(DEFAULT_SIZE, |(rows, columns)| {
                (usize::from(rows), usize::from(columns))
            })
    }

    /// Writes data to standard output.
    ///
    /// # Errors
    /// Those of standard output.
    pub fn data(&self, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        let mut out = io::stdout().lock();
        out.write_all(bytes.as_ref())?;
        out.flush()
    }

    /// Standard output for a long stream of data; errors of its end are lost on drop, so flush it.
    #[must_use]
    pub fn out(&self) -> impl Write + use<> {
        io::BufWriter::new(io::stdout().lock())
    }

    /// Says something unless asked to be quiet. That nobody listens on standard error is no failure.
    pub fn say(&self, text: impl Display) {
        if !self.quiet {
            self.error(text);
        }
    }

    /// Says something that is worth knowing of a run, which may begin with its place, in the form of findings.
    pub fn note(&self, code: &'static str, text: impl Display) {
        let text = text.to_string();
        self.say(render::remark((Severity::Note, code), &text, self.messages));
    }

    /// Says something of a run that is probably not what was meant, in the form of findings.
    pub fn warning(&self, code: &'static str, text: impl Display) {
        let text = text.to_string();
        let warning = (Severity::Warning, code);
        self.say(render::remark(warning, &text, self.messages));
    }

    /// Says the notes of a run.
    pub fn notes(&self, places: Places<'_>, notes: &[Note]) {
        for note in notes {
            self.note(note.code, places.of(note));
        }
    }

    /// Says the warnings of a run.
    pub fn warnings(&self, places: Places<'_>, warnings: &[Note]) {
        for warning in warnings {
            self.warning(warning.code, places.of(warning));
        }
    }

    /// Says something even when quiet.
    pub fn error(&self, text: impl Display) {
        let text = text.to_string();
        let _ = match self.log {
            Some(log) => log.write(&text),
            None => writeln!(io::stderr().lock(), "{}", text.trim_end()),
        };
    }

    /// A progress bar over `length` units on a terminal; hidden elsewhere and when quiet.
    #[must_use]
    pub fn progress(&self, length: u64, what: &str) -> ProgressBar {
        self.bar(length, what, "{spinner} {msg} {wide_bar} {percent}% {eta}")
    }

    /// What is being done, for as long as the result lives, where nobody knows how long it takes; hidden as [`Self::progress`] is.
    #[must_use]
    pub fn busy(&self, what: &str) -> ProgressBar {
        self.bar(1, what, "{spinner} {msg} {elapsed}")
    }

    fn bar(&self, length: u64, what: &str, template: &str) -> ProgressBar {
        if self.quiet || !self.err_is_terminal() || is_dumb() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template(template);
        let bar = ProgressBar::new(length)
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
            .with_message(what.to_owned())
            .with_finish(ProgressFinish::AndClear);
        bar.tick();
        bar.enable_steady_tick(TICK);
        bar
    }
}
