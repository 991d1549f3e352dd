//! What a shell wants to know of the command line: completions and manual pages.

use clap::CommandFactory;

use super::args::{Cli, CompletionsArgs, ManArgs};
use super::exit::{Exit, Failure};
use super::files;
use super::streams::Streams;

/// Prints completions.
///
/// # Errors
/// Those of standard output.
pub(super) fn completions(args: &CompletionsArgs, streams: &Streams) -> Result<Exit, Failure> {
    let Some(shell) = args.shell.or_else(clap_complete::Shell::from_env) else {
        let message = "name a shell, as in `circ completions bash`: SHELL does not say which it is";
        return Err(Failure::told("no-shell", message.into()));
    };
    let mut command = Cli::command();
    // `circ FILE` takes what `circ sim FILE` does.
    let sim = command.find_subcommand("sim").into_iter();
    let own: Vec<_> = sim
        .flat_map(clap::Command::get_arguments)
        .cloned()
        .collect();
    command = command.args(own.into_iter().filter(|arg| !arg.is_global_set()));
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "circ", &mut text);
    streams.data(text)?;
    Ok(Exit::Done)
}

/// Prints the manual page, or writes those of all commands into a folder.
///
/// # Errors
/// Those of standard output and of the files.
pub(super) fn man(args: &ManArgs, streams: &Streams) -> Result<Exit, Failure> {
    // Commands know their full names, `circ-sim`, once it is built.
    let mut command = Cli::command();
    command.build();
    let Some(folder) = &args.folder else {
        streams.data(page(command)?)?;
        return Ok(Exit::Done);
    };
    let commands = command.get_subcommands().filter(|c| c.get_name() != "help");
    for one in std::iter::once(&command).chain(commands) {
        let name = one.get_display_name().unwrap_or(one.get_name());
        let path = folder.join(format!("{name}.1"));
        files::write(&path, &page(one.clone())?)?;
    }
    Ok(Exit::Done)
}

fn page(command: clap::Command) -> Result<Vec<u8>, Failure> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command).render(&mut text)?;
    Ok(text)
}
