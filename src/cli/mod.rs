//! The command line: the only code that prints or opens files of results.

mod ac;
pub mod args;
mod batch;
mod bench;
mod browser;
mod check;
mod compare;
mod cpu;
mod dc;
mod destination;
mod examples;
pub mod exit;
mod explain;
mod files;
mod forms;
mod graph;
pub mod input;
mod lcs;
pub mod ngspice;
mod op;
pub mod output;
mod pss;
mod render;
mod request;
mod rows;
mod sens;
mod shell;
mod signals;
pub mod sim;
mod steps;
pub mod streams;
mod sweep;
mod tabulate;
mod view;
mod watch;

use std::ffi::OsString;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgMatches, CommandFactory, FromArgMatches};

use args::{Assigned, Cli, Command, MessageFormat};
use batch::Log;
use exit::{Exit, Failure};
use streams::Streams;

use crate::circuit::load::near_file;
use crate::diagnostic::explain::{Explanation, explain};
use crate::netlist::suggest::nearest;

pub use render::render;

/// Carries out the command line of this process.
#[must_use]
pub fn main() -> Exit {
    let mut command = Cli::command();
    let mut logged = None;
    let parsed = batch::expanded(std::env::args_os().collect()).and_then(|(args, log)| {
        logged = log;
        let args = joined(with_command(args, &command));
        let matches = command.try_get_matches_from_mut(args);
        let matches = matches.map_err(|error| no_such_input(error, &mut command))?;
        Cli::from_arg_matches(&one_value_each(matches, &mut command)?)
    });
    // The run takes over its memory.
    drop(command);
    let mut cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version go to standard output, usage errors to standard error.
            let form = form_of_messages(std::env::args_os());
            let is_fault = error.use_stderr()
                && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
            if let (true, Some(form)) = (is_fault, form) {
                told_otherwise(&error, form);
                return Exit::Failed;
            }
            if is_fault {
                return usage(&error);
            }
            let printed = error.print();
            let asked = matches!(
                error.kind(),
                ErrorKind::DisplayHelp | ErrorKind::DisplayVersion
            );
            return if asked && printed.map_or_else(|e| Failure::from(e).is_closed_pipe(), |()| true)
            {
                Exit::Done
            } else {
                Exit::Failed
            };
        }
    };
    let mut streams = Streams {
        quiet: cli.quiet,
        verbose: cli.verbose,
        messages: cli.message_format,
        log: None,
    };
    // A fault of the program itself still ends with the status for "could not be done".
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| {
        // It lives as long as the process.
        let log = logged.map(|logged| Log::create(&logged)).transpose()?;
        streams.log = log.map(|log| &*Box::leak(Box::new(log)));
        opened(&mut cli.command, &streams)
    }));
    let outcome = outcome.unwrap_or_else(|_| {
        let message = "a fault in circ itself (see above); please report it with the netlist";
        Err(Failure::told("internal", message.into()))
    });
    match outcome {
        Ok(exit) => exit,
        Err(failure) if failure.is_closed_pipe() => Exit::Done,
        Err(failure) => {
            // Faults were shown one by one.
            let told = matches!(failure, Failure::Faults(_));
            let tell = |streams: &Streams| match cli.message_format {
                MessageFormat::Json if told => {}
                _ if told => streams.error(format!("error: {failure}")),
                form => streams.error(render::failure(&failure.to_string(), failure.code(), form)),
            };
            tell(&streams);
            if streams.log.is_some() {
                tell(&Streams {
                    log: None,
                    ..streams
                });
            }
            if told && cli.message_format == MessageFormat::Human && streams.err_is_terminal() {
                streams.say("`circ explain CODE` tells more of a code above");
            }
            Exit::Failed
        }
    }
}

/// A negative number behind an option is its value, `--step -1`: it is for the option to say what it thinks of it.
fn joined(args: Vec<OsString>) -> Vec<OsString> {
    let mut all: Vec<OsString> = Vec::with_capacity(args.len());
    for arg in args {
        let is_number = arg.to_str().is_some_and(|text| {
            let digits = text
                .strip_prefix('-')
                .map(|text| text.trim_start_matches('.'));
            digits.is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit()))
        });
        let is_option = |before: &&mut OsString| {
            let text = before.to_str().unwrap_or_default();
            text.len() > 2 && text.starts_with("--") && !text.contains('=')
        };
        match all
            .last_mut()
            .filter(|before| is_number && is_option(before))
        {
            Some(option) => {
                option.push("=");
                option.push(arg);
            }
            None => all.push(arg),
        }
    }
    all
}

/// The form of messages that a command line asks for which could not be read, where it is not that of persons.
fn form_of_messages(args: impl Iterator<Item = OsString>) -> Option<MessageFormat> {
    const OPTION: &str = "--message-format";
    let args: Vec<String> = args.filter_map(|arg| arg.into_string().ok()).collect();
    let behind = args.iter().zip(args.iter().skip(1));
    let behind = behind.filter_map(|(option, form)| (option == OPTION).then_some(form.as_str()));
    let within = args
        .iter()
        .filter_map(|arg| arg.strip_prefix(OPTION)?.strip_prefix('='));
    match within.chain(behind).last()? {
        "json" => Some(MessageFormat::Json),
        "short" => Some(MessageFormat::Short),
        _ => None,
    }
}

/// The code of what is wrong with a command line.
const fn code(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::UnknownArgument => "unknown-option",
        ErrorKind::InvalidSubcommand => "unknown-command",
        ErrorKind::ArgumentConflict => "option-conflict",
        ErrorKind::MissingRequiredArgument | ErrorKind::MissingSubcommand => "missing-argument",
        _ => "bad-option",
    }
}

/// Says to a person what is wrong with a command line, under its code.
fn usage(error: &clap::Error) -> Exit {
    let streams = Streams {
        quiet: false,
        verbose: false,
        messages: MessageFormat::Human,
        log: None,
    };
    let rendered = error.render();
    let text = match streams.colours() {
        true => rendered.ansi().to_string(),
        false => rendered.to_string(),
    };
    let code = code(error.kind());
    streams.error(text.replacen("error:", &format!("error[{code}]:"), 1));
    Exit::Failed
}

/// Says of a command line what is wrong with it as findings are said.
fn told_otherwise(error: &clap::Error, form: MessageFormat) {
    let text = error.to_string();
    let is_said = |line: &&str| !line.starts_with("Usage:") && !line.starts_with("For more");
    let lines = text.lines().map(str::trim).take_while(is_said);
    let lines: Vec<&str> = lines.filter(|line| !line.is_empty()).collect();
    let message = lines.join("; ").replace(":; ", ": ");
    let message = message.strip_prefix("error: ").unwrap_or(&message);
    let streams = Streams {
        quiet: false,
        verbose: false,
        messages: form,
        log: None,
    };
    let code = code(error.kind());
    let help = explain(code).map(Explanation::help);
    streams.error(render::failure(message, (code, help), form));
}

/// `circ FILE` is `circ sim FILE`: where no argument is a command and one is a file or `-`; a first word that is neither is meant as a command.
fn with_command(mut args: Vec<OsString>, commands: &clap::Command) -> Vec<OsString> {
    let is_command = |arg: &OsString| {
        let name = arg.to_str();
        name.is_some_and(|name| name == "help" || commands.find_subcommand(name).is_some())
    };
    let is_input = |arg: &OsString| arg == "-" || Path::new(arg).is_file();
    let given = args.get(1..).unwrap_or_default();
    let is_option = |arg: &OsString| arg.as_encoded_bytes().starts_with(b"-");
    let begins = given
        .first()
        .is_some_and(|arg| is_option(arg) || is_input(arg));
    if begins && !given.iter().any(is_command) && given.iter().any(is_input) {
        args.insert(1, "sim".into());
    }
    args
}

/// Says of a word that is no command, nor like one, that it is no file either, and of a second file of `compare` and of options of other programs how
/// they are named here.
fn no_such_input(error: clap::Error, command: &mut clap::Command) -> clap::Error {
    if let Some(message) = named_otherwise(&error, command) {
        return command.error(error.kind(), message);
    }
    if let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidArg)
        && Path::new(word).is_file()
        && std::env::args().any(|arg| arg == "compare")
    {
        let message = format!("a file to compare with is given as `--against {word}`");
        return command.error(ErrorKind::UnknownArgument, message);
    }
    let word = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(word)) => word,
        _ => return error,
    };
    let is_like_one = error.get(ContextKind::SuggestedSubcommand).is_some();
    let message = if Path::new(word).is_dir() {
        format!("`{word}` is a folder: name a netlist in it")
    } else if is_like_one && !word.contains(['.', '/']) {
        return error;
    } else {
        let commands = command.get_subcommands().map(clap::Command::get_name);
        let near = near_file(Path::new(word)).map(|near| near.display().to_string());
        let near = near.or_else(|| nearest(word, commands));
        let near = near
            .map(|near| format!(": did you mean `{near}`?"))
            .unwrap_or_default();
        format!("`{word}` is neither a file nor a command{near}")
    };
    command.error(ErrorKind::InvalidSubcommand, message)
}

/// What an option that is none, or that stands alone, may have been meant as.
fn named_otherwise(error: &clap::Error, command: &clap::Command) -> Option<String> {
    let of = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => vec![word.as_str()],
        Some(ContextValue::Strings(words)) => words.iter().map(String::as_str).collect(),
        _ => vec![],
    };
    let missing = error.kind() == ErrorKind::MissingRequiredArgument;
    let wrong = of(ContextKind::InvalidArg);
    if missing && wrong.iter().any(|arg| arg.contains("--table")) {
        return Some(
            "`--in` and `--out` name sources and loads of `--table`; results go to a file with `-o FILE`"
                .into(),
        );
    }
    if error.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    if wrong.contains(&"--tran") {
        return Some("the span of a run stands in the netlist: `.tran 10u 5m`".into());
    }
    // `-probe`, as other programs write it: read as `-p` and so on.
    let long = |arg: &String| {
        let name = arg.strip_prefix('-').filter(|name| name.len() > 1)?;
        let name = name.split('=').next().unwrap_or(name).to_owned();
        let mut all = command
            .get_subcommands()
            .flat_map(clap::Command::get_arguments);
        all.any(|a| a.get_long() == Some(&name)).then_some(name)
    };
    let meant = std::env::args().skip(1).find_map(|arg| long(&arg))?;
    Some(format!("`-{meant}` is written `--{meant}`"))
}

/// Several values of `--param` are for a sweep alone.
fn one_value_each(
    matches: ArgMatches,
    command: &mut clap::Command,
) -> Result<ArgMatches, clap::Error> {
    let Some((name, own)) = matches.subcommand().filter(|(name, _)| *name != "sweep") else {
        return Ok(matches);
    };
    let params = own.try_get_many::<Assigned>("params").ok().flatten();
    match params.into_iter().flatten().find(|p| p.values.len() != 1) {
        Some(several) => {
            let message = format!(
                "`circ {name}` takes one value of `{}`; `circ sweep` takes several",
                several.name
            );
            Err(command.error(ErrorKind::ValueValidation, message))
        }
        None => Ok(matches),
    }
}

/// Carries out a command, and shows its page where it asks for that.
fn opened(command: &mut Command, streams: &Streams) -> Result<Exit, Failure> {
    let outputs = match command {
        Command::Sim(args) if args.results.open => &mut args.results.outputs,
        Command::Pss(args) if args.results.open => &mut args.results.outputs,
        Command::Ac(args) if args.open => &mut args.outputs,
        _ => return run(command, streams),
    };
    let is_page = |path: &&PathBuf| path.extension().is_some_and(|e| e == "html" || e == "htm");
    let page = match outputs.iter().find(is_page) {
        Some(page) => page.clone(),
        None => {
            outputs.push(browser::place()?);
            outputs[outputs.len() - 1].clone()
        }
    };
    let exit = run(command, streams)?;
    browser::show(&page, streams)?;
    Ok(exit)
}

fn run(command: &Command, streams: &Streams) -> Result<Exit, Failure> {
    match command {
        Command::Sim(args) => sim::sim(args, streams),
        Command::Pss(args) => pss::pss(args, streams),
        Command::Ac(args) => ac::ac(args, streams),
        Command::Sens(args) => sens::sens(args, streams),
        Command::Sweep(args) => sweep::sweep(args, streams),
        Command::Lcs(args) => lcs::lcs(args, streams),
        Command::Check(args) => check::check(args, streams),
        Command::Op(args) => op::op(args, streams),
        Command::Bench(args) => bench::bench(args, streams),
        Command::Compare(args) => compare::compare(args, streams),
        Command::Graph(args) => graph::graph(args, streams),
        Command::View(args) => view::view(args, streams),
        Command::Watch(args) => watch::watch(args, streams),
        Command::Explain(args) => explain::explain(args, streams),
        Command::Completions(args) => shell::completions(args, streams),
        Command::Man(args) => shell::man(args, streams),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_numbers_are_values_of_options() {
        let read = |text: &str| {
            let args = text.split(' ').map(OsString::from).collect();
            let all = joined(args)
                .into_iter()
                .map(|arg| arg.into_string().expect("text"));
            all.collect::<Vec<_>>().join(" ")
        };
        for (typed, expected) in [
            ("circ a.cir --step -1", "circ a.cir --step=-1"),
            ("circ a.cir --step -.5m -q", "circ a.cir --step=-.5m -q"),
            ("circ - --step=1 -1 -- -1", "circ - --step=1 -1 -- -1"),
            ("circ ac a --probe -v(y)", "circ ac a --probe -v(y)"),
        ] {
            assert_eq!(read(typed), expected);
        }
    }
}
