//! Commands between `.control` and `.endc`: analyses, measurements, what is to be saved, and values set before the run. What
//! changes the run and is not carried out is a warning, the rest is skipped with a note.

use super::ast::{Alter, Name, Statement};
use super::dot::{self, Dot};
use super::lex::{Line, State, input, word};
use super::read::{Reader, finish};
use super::value;
use crate::diagnostic::{Diagnostic, Severity, Span};

/// Commands that change what a run gives, besides `alter`.
const CHANGING: [&str; 8] = [
    "altermod",
    "alterparam",
    "stop",
    "resume",
    "step",
    "mc_source",
    "source",
    "optran",
];
/// Commands that begin a block, which `end` closes.
const BLOCKS: [&str; 5] = ["foreach", "while", "dowhile", "repeat", "if"];

/// What the commands read so far ask for.
#[derive(Debug, Default)]
pub(super) struct Script {
    /// Blocks of loops and conditions that are open.
    blocks: usize,
    runs: usize,
    /// Values and options set so far.
    set: Vec<Statement>,
    /// Those set before the latest run.
    before_run: Vec<Statement>,
    /// Commands that change a run and are not carried out.
    left_out: Vec<(String, Span)>,
}

impl Reader<'_> {
    /// A line between `.control` and `.endc`.
    pub(super) fn command(&mut self, line: &Line) {
        let state = State::default();
        let start = input(line, &state);
        let Ok((rest, name)) = word(start) else {
            return;
        };
        let parsed = match name.text.as_str() {
            "tran" => finish(
                dot::tran(start, rest, true)
                    .map(|(rest, t)| (rest, Dot::statement(Statement::Tran(t)))),
                line,
            ),
            "meas" | "measure" => finish(dot::measure::meas(start, rest, true), line),
            "fourier" => finish(dot::measure::four(start, rest), line),
            "save" => finish(dot::save(rest), line),
            "op" => Ok(Dot::statement(Statement::Analysis(name.span))),
            // They ask for nothing that is not done anyway.
            "run" | "quit" | "exit" | "*" => Ok(Dot::Nothing),
            "end" => {
                self.script.blocks = self.script.blocks.saturating_sub(1);
                Ok(Dot::Nothing)
            }
            "reset" => {
                let set = &mut self.script.set;
                set.retain(|statement| !matches!(statement, Statement::Alter(_)));
                Ok(Dot::Nothing)
            }
            "alter" => {
                match alter(line).filter(|_| self.script.blocks == 0) {
                    Some(alter) => self.script.set.push(Statement::Alter(alter)),
                    None => self.leave_out("alter", line),
                }
                Ok(Dot::Nothing)
            }
            "option" | "set" => match dot::options(rest) {
                Dot::Options(options) if !options.read.is_empty() => {
                    if self.script.blocks == 0 {
                        self.script.set.extend(options.read);
                    } else {
                        self.leave_out(&name.text, line);
                    }
                    Ok(Dot::Nothing)
                }
                _ => Ok(Dot::Skipped),
            },
            changing if CHANGING.contains(&changing) => {
                self.leave_out(changing, line);
                Ok(Dot::Nothing)
            }
            block => {
                self.script.blocks += usize::from(BLOCKS.contains(&block));
                Ok(Dot::Skipped)
            }
        };
        self.keep_findings(&state);
        if matches!(name.text.as_str(), "tran" | "run") {
            self.script.runs += 1;
            self.script.before_run.clone_from(&self.script.set);
        }
        match parsed {
            Ok(Dot::Statement(statement)) => self.push(*statement),
            Ok(Dot::Skipped) => self
                .skipped
                .push((format!("{} (in .control)", name.text), line.span())),
            Ok(_) => {}
            Err(fault) => self.tell(Diagnostic {
                severity: Severity::Warning,
                message: format!("{}; the command is left out", fault.message),
                ..*fault
            }),
        }
    }

    fn leave_out(&mut self, name: &str, line: &Line) {
        self.script.left_out.push((name.to_owned(), line.span()));
    }

    /// Keeps the values set before the last run, and tells what is not carried out.
    pub(super) fn end_script(&mut self) {
        let Script {
            runs,
            set,
            before_run,
            left_out,
            ..
        } = std::mem::take(&mut self.script);
        for statement in if runs == 0 { set } else { before_run } {
            self.push(statement);
        }
        let Some(&(_, span)) = left_out.first() else {
            return;
        };
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in &left_out {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        let message = format!(
            "the result is without what `.control` changes by {}",
            names.join(", ")
        );
        self.tell(
            Diagnostic::warning("control-left-out", span, message)
                .label("not carried out")
                .help("write what it changes into the cards; `alter element = number` outside of loops is carried out"),
        );
    }
}

/// `alter r1 = 100`, `alter v1 dc = 5`, `alter @r1[resistance] = 100`.
fn alter(line: &Line) -> Option<Alter> {
    let text = line.text.trim_start();
    let (_, rest) = text.split_once(char::is_whitespace)?;
    let (what, written) = rest
        .split_once('=')
        .or_else(|| rest.trim_end().rsplit_once(char::is_whitespace))?;
    let value = value::parse(written.trim()).ok()?;
    let what = what.trim().to_lowercase();
    let (element, quantity) = match what.strip_prefix('@') {
        Some(inside) => {
            let (element, quantity) = inside.strip_suffix(']')?.split_once('[')?;
            (element, Some(quantity))
        }
        None => match what.split_once(char::is_whitespace) {
            Some((element, quantity)) => (element, Some(quantity)),
            None => (what.as_str(), None),
        },
    };
    Some(Alter {
        name: Name {
            text: element.to_owned(),
            span: line.span(),
        },
        quantity: quantity.map(|q| q.trim().to_owned()),
        value,
    })
}
