//! Commands that look at a circuit, at results or at the program itself.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::ArgPredicate;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::values::{folder, named, not_negative, position, positive, program_or_points, readable};
use super::{Input, Method};
use crate::cli::output::Format;

/// `circ lcs`.
#[derive(Debug, Args)]
pub struct LcsArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Form of the system; else the ending of the output says it: json, py, m, tex or mtx, and txt is text
    #[arg(long, value_enum)]
    pub format: Option<SystemFormat>,
    /// Take a switch in this position (repeatable)
    #[arg(long = "switch", value_name = "NAME=on|off", value_parser = position)]
    pub switches: Vec<(String, bool)>,
    /// Write to this file instead of standard output
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
}

/// Forms of a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SystemFormat {
    /// Named rows and columns
    Text,
    /// circ-lcs/1, which `sim`, `check` and `bench` read
    Json,
    /// A Python script with NumPy arrays
    Numpy,
    /// A MATLAB or Octave script
    Matlab,
    /// LaTeX matrices
    Latex,
    /// A Python script that Siconos runs: ideal diodes, switches as they stand
    Siconos,
    /// Matrix Market: with `-o NAME.mtx` the files NAME.A.mtx, NAME.B.mtx, …
    Mtx,
}

/// `circ check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Take a switch in this position (repeatable)
    #[arg(long = "switch", value_name = "NAME=on|off", value_parser = position)]
    pub switches: Vec<(String, bool)>,
    /// Write the report to this file too (repeatable); the ending chooses json, txt or html
    #[arg(short, long = "output", value_name = "OUT")]
    pub outputs: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `circ op`.
#[derive(Debug, Args)]
pub struct OpArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Write it to this file, or `-`, standard output (repeatable); the ending chooses csv or json
    #[arg(short, long = "output", value_name = "OUT")]
    pub outputs: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `circ bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Measure `ngspice` too, or show what a csv file in the columns of this command says of other programs (repeatable)
    #[arg(long, value_name = "ngspice|POINTS.csv", value_parser = program_or_points)]
    pub against: Vec<PathBuf>,
    /// Only these methods: exact, euler, theta, theta:gamma=1 (θ = ½, γ = 1), ngspice
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', value_parser = ["exact", "euler", "theta", "theta:gamma=1", "ngspice"])]
    pub methods: Vec<String>,
    /// Write measurements to this file, or `-`, standard output (repeatable); the ending chooses csv, json, svg, png or html
    #[arg(
        short,
        long = "output",
        value_name = "OUT",
        default_value_if("format", ArgPredicate::IsPresent, Some("-"))
    )]
    pub outputs: Vec<PathBuf>,
    /// Format of standard output (`-o -`, csv without it): csv, json, svg, png or html
    #[arg(long, value_name = "FORMAT", value_parser = ["csv", "json", "svg", "png", "html"])]
    pub format: Option<String>,
    /// Write the errors of every signal to this csv file, a line for each
    #[arg(long, value_name = "OUT.csv")]
    pub signals: Option<PathBuf>,
}

/// `circ compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub integration: CompareMethodArgs,
    /// `ngspice`, or a csv, raw, npz or json file of waveforms
    #[arg(
        long,
        value_name = "ngspice|REF.csv|REF.raw",
        default_value = "ngspice"
    )]
    pub against: PathBuf,
    /// Largest error, relative to each signal's amplitude, that counts as equal
    #[arg(long, value_name = "R", default_value = "1e-2", value_parser = positive)]
    pub tol: f64,
    /// Forgive edges that stand this much earlier or later, s [default: a tenth of a print step against ngspice, 0 against a file]
    #[arg(long, value_name = "T", value_parser = not_negative)]
    pub shift: Option<f64>,
    /// How ngspice realises the diodes
    #[arg(long, value_enum, default_value_t = Realisation::N001)]
    pub realisation: Realisation,
    /// Keep the ngspice deck in this file
    #[arg(long, value_name = "DECK")]
    pub keep: Option<PathBuf>,
    /// Draw both and their difference to this svg, png or html file (repeatable)
    #[arg(short, long = "output", value_name = "OUT")]
    pub outputs: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// The method of the first side of a comparison (its `--tol` is the comparison's).
#[derive(Debug, Args)]
pub struct CompareMethodArgs {
    /// Integration method; auto follows the plan
    #[arg(help_heading = "Integration", long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// Fixed step of euler and theta, s
    #[arg(help_heading = "Integration", long, value_name = "H", value_parser = positive)]
    pub step: Option<f64>,
}

/// How ngspice realises piecewise-linear diodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Realisation {
    /// ngspice's default diode, N = 1
    #[value(name = "default")]
    Default,
    /// Emission coefficient 0.01
    #[value(name = "n0.01")]
    N001,
    /// Emission coefficient 0.001
    #[value(name = "n0.001")]
    N0001,
    /// The code model `sidiode`
    #[value(name = "sidiode")]
    Sidiode,
}

impl Realisation {
    /// As it is typed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::N001 => "n0.01",
            Self::N0001 => "n0.001",
            Self::Sidiode => "sidiode",
        }
    }
}

/// `circ graph`.
#[derive(Debug, Args)]
pub struct GraphArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Write to this file instead of Graphviz text on standard output (repeatable): svg or png, a circuit picture; dot, the graph
    #[arg(short = 'o', long = "output", value_name = "OUT")]
    pub outputs: Vec<PathBuf>,
    /// Format of standard output: dot, svg or png
    #[arg(long, value_name = "FORMAT", value_parser = ["dot", "svg", "png"], default_value = "dot")]
    pub format: String,
    /// Colour what conducts at this time of the transient, s
    #[arg(long, value_name = "TIME", value_parser = positive)]
    pub at: Option<f64>,
}

/// `circ view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Waveforms: csv, npz, json, or raw of ngspice or LTspice, whatever its name; `-` reads standard input
    #[arg(value_name = "FILE", value_parser = readable)]
    pub file: PathBuf,
    /// Write to this file instead of opening the browser, or to `-`, standard output (repeatable): html, svg or png
    #[arg(
        short,
        long = "output",
        value_name = "OUT",
        default_value_if("format", ArgPredicate::IsPresent, Some("-"))
    )]
    pub outputs: Vec<PathBuf>,
    /// Format of standard output: html, svg or png
    #[arg(long, value_name = "FORMAT", value_parser = PossibleValuesParser::new(["html", "svg", "png"]).try_map(|name| Format::from_str(&name, false)))]
    pub format: Option<Format>,
    /// Show this signal, or those of a pattern, v(x1.*) (repeatable)
    #[arg(long = "probe", value_name = "NAME", value_parser = named)]
    pub probes: Vec<String>,
    /// Which of several plots in a raw file
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..))]
    pub plot: u8,
}

/// `circ watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// Port of the page's address on this machine [default: one that is free]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Print the page's address alone
    #[arg(long)]
    pub no_open: bool,
    /// `FILE`, or `sim`, `pss` or `ac`, with their options
    #[arg(
        value_name = "COMMAND",
        required = true,
        trailing_var_arg = true,
        allow_hyphen_values = true
    )]
    pub command: Vec<OsString>,
}

/// `circ explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// The code, as it stands in brackets in a message [default: all, a line each]
    pub code: Option<String>,
}

/// `circ completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell; that of `SHELL` without
    pub shell: Option<clap_complete::Shell>,
}

/// `circ man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Write circ.1, circ-sim.1 and so on into this folder
    #[arg(value_name = "DIR", value_parser = folder)]
    pub folder: Option<PathBuf>,
}
