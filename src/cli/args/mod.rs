//! What may be typed.

mod runs;
mod shared;
mod tools;
mod values;

use clap::{Parser, Subcommand, ValueEnum};

pub use runs::*;
pub use shared::*;
pub use tools::*;
pub use values::STDIN;

use super::examples;

/// Simulates circuits with ideal diodes and switches: netlist to complementarity system to waveforms.
#[derive(Debug, Parser)]
#[command(
    name = "circ",
    version,
    arg_required_else_help = true,
    subcommand_required = true,
    help_expected = true,
    after_help = examples::CIRC
)]
pub struct Cli {
    /// Say nothing but errors, measurements and a summary asked for
    #[arg(
        help_heading = "Messages",
        short,
        long,
        global = true,
        conflicts_with = "verbose",
        display_order = 90
    )]
    pub quiet: bool,
    /// Explain what is done and why
    #[arg(
        help_heading = "Messages",
        short,
        long,
        global = true,
        display_order = 91
    )]
    pub verbose: bool,
    /// Form of findings: underlined in their text, a line each, or a JSON object each
    #[arg(help_heading = "Messages", long, global = true, value_enum, value_name = "FORM", default_value_t = MessageFormat::Human, display_order = 92)]
    pub message_format: MessageFormat,
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// Forms of findings on standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum MessageFormat {
    /// With the text underlined
    #[default]
    Human,
    /// `file:line:col: severity[code]: message`
    Short,
    /// One object a line: code, severity, message, file, line, column, help
    Json,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simulate the transient that `.tran` asks for
    #[command(after_help = examples::SIM)]
    Sim(SimArgs),
    /// Find the periodic steady state, and write one period of it
    #[command(after_help = examples::PSS)]
    Pss(PssArgs),
    /// Find the response to small sines, about the operating point or the periodic steady state
    #[command(after_help = examples::AC)]
    Ac(AcArgs),
    /// Find the derivatives of what `.meas` finds to values of elements and parameters
    #[command(after_help = examples::SENS)]
    Sens(SensArgs),
    /// Measure what `.meas` asks for at many values, and at samples of random ones
    #[command(after_help = examples::SWEEP, mut_arg("params", |arg| {
        let arg = arg.value_name("NAME=VALUES").help("Values of an element or `.param`: `1k,2k`, `lin:1k:2k:11`, `log:1:100:7` (first, last, how many; repeatable)");
        arg.long_help(None)
    }))]
    Sweep(SweepArgs),
    /// Print the complementarity system (A, B, C, D, E, F, G) with names and units
    #[command(after_help = examples::LCS)]
    Lcs(LcsArgs),
    /// Check topology, passivity and which theorems hold
    #[command(after_help = examples::CHECK)]
    Check(CheckArgs),
    /// Solve the operating point
    #[command(after_help = examples::OP)]
    Op(OpArgs),
    /// Measure error against run time over a ladder of steps and tolerances
    #[command(after_help = examples::BENCH)]
    Bench(BenchArgs),
    /// Compare with ngspice or with waveforms from a file
    #[command(after_help = examples::COMPARE)]
    Compare(CompareArgs),
    /// Draw the circuit
    #[command(after_help = examples::GRAPH)]
    Graph(GraphArgs),
    /// Show waveforms of a file, of circ, ngspice, LTspice or any other program, as a page in the browser
    #[command(after_help = examples::VIEW)]
    View(ViewArgs),
    /// Carry out a command anew whenever its netlist changes, and show its page in the browser
    #[command(after_help = examples::WATCH)]
    Watch(WatchArgs),
    /// Explain a code of a finding, such as `unknown-model`, or list all
    #[command(after_help = examples::EXPLAIN)]
    Explain(ExplainArgs),
    /// Print completions for a shell
    #[command(after_help = examples::COMPLETIONS)]
    Completions(CompletionsArgs),
    /// Print the manual page, or write one for every command into a folder
    #[command(after_help = examples::MAN)]
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn every_argument_has_help_and_none_contradict() {
        Cli::command().debug_assert();
    }
}
