//! What several commands take: the netlist, its values, the method, the files of results.

use std::path::PathBuf;
use std::sync::OnceLock;

use clap::builder::ArgPredicate;
use clap::{Args, ValueEnum};

use super::values::{assignment, folder, implicitness, named, positive, readable, tolerance};
use crate::cli::output::Format;

/// The circuit and what changes it.
#[derive(Debug, Clone, Args)]
pub struct Input {
    /// SPICE netlist, or a system in the JSON of `circ lcs`; `-` reads standard input
    #[arg(value_name = "FILE", value_parser = readable)]
    pub file: PathBuf,
    /// What was read of it.
    #[arg(skip)]
    pub read: OnceLock<Vec<u8>>,
    /// Replace the value of a top-level `.param` (repeatable)
    #[arg(display_order = 3, long = "param", value_name = "NAME=VALUE", value_parser = assignment)]
    pub params: Vec<Assigned>,
    /// How diode models are read
    #[arg(help_heading = "Circuit", long, value_enum, default_value_t = Diodes::Auto)]
    pub diodes: Diodes,
    /// Look for files of `.include` and `.lib` in this folder after the netlist's own (repeatable); then in those of CIRC_LIB
    #[arg(help_heading = "Circuit", long = "lib", value_name = "DIR", value_parser = folder)]
    pub libraries: Vec<PathBuf>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub random: RandomArgs,
}

/// A name and the values it is given, several in a sweep alone.
#[derive(Debug, Clone)]
pub struct Assigned {
    /// In lower case.
    pub name: String,
    /// At least one.
    pub values: Vec<f64>,
    /// The first of them that ends in a capital `M`, as it was written.
    pub milli: Option<String>,
}

/// What is drawn from distributions.
#[derive(Debug, Clone, Args)]
pub struct RandomArgs {
    /// Draw random functions (`mc`, `gauss`, …) and tolerances: sample K, as `circ sweep --mc` numbers them [default: all nominal]
    #[arg(help_heading = "Random values", long, value_name = "K")]
    pub sample: Option<u64>,
    /// What samples are drawn from: another seed gives others
    #[arg(
        help_heading = "Random values",
        long,
        value_name = "S",
        default_value_t = 1
    )]
    pub seed: u64,
    /// The tolerance of an element's value or `.param`, evenly distributed, in place of `tol=5` (%) on its card (repeatable)
    #[arg(help_heading = "Random values", long = "tol-of", value_name = "NAME=5%", value_parser = tolerance)]
    pub tolerances: Vec<(String, f64)>,
    /// The standard deviation of an element's value or `.param`, normally distributed (repeatable)
    #[arg(help_heading = "Random values", long = "sigma-of", value_name = "NAME=1%", value_parser = tolerance)]
    pub deviations: Vec<(String, f64)>,
}

/// How diode models are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Diodes {
    /// As the model says: piecewise linear for Ron/Roff/Vfwd, N ≤ 0.05 or `ideal`
    Auto,
    /// Every diode ideal, in series with its RS
    Ideal,
    /// Every diode exponential
    Exp,
}

/// How time is integrated.
#[derive(Debug, Args)]
pub struct MethodArgs {
    /// Integration method; auto follows the plan
    #[arg(help_heading = "Integration", long, value_enum, default_value_t = Method::Auto)]
    pub method: Method,
    /// θ of the state for `--method theta` (0.5 to 1; default 0.5)
    #[arg(help_heading = "Integration", long, value_name = "X", value_parser = implicitness)]
    pub theta: Option<f64>,
    /// γ of the device quantities for `--method theta` (0.5 to 1; default 0.5)
    #[arg(help_heading = "Integration", long, value_name = "X", value_parser = implicitness)]
    pub gamma: Option<f64>,
    /// Fixed step of euler and theta, s; suffixes as in netlists (`1u`)
    #[arg(help_heading = "Integration", long, value_name = "H", value_parser = positive)]
    pub step: Option<f64>,
    /// Relative tolerance of the error-controlled step [default: 1e-4]
    #[arg(help_heading = "Integration", long, value_name = "R", value_parser = positive)]
    pub tol: Option<f64>,
    /// Make no further runs beside one in steps: it takes less time, and its error is not known
    #[arg(help_heading = "Integration", long)]
    pub no_estimate: bool,
}

/// Integration methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// What the plan recommends
    Auto,
    /// Event-driven, exact between events
    Exact,
    /// Moreau's implicit Euler, θ = γ = 1
    Euler,
    /// The (θ, γ) scheme
    Theta,
}

/// Where the waveforms of a run go, which of them, and what is said of it.
#[derive(Debug, Clone, Args)]
pub struct ResultArgs {
    /// Write results to this file, or `-`, standard output (repeatable); the ending chooses csv, raw, npz, json, svg, png or html
    ///
    /// A file appears when it is whole, or as far as the run came. Rows of csv and raw are written as they come; the others hold all rows,
    /// 1 GiB at most. Pictures show events, jumps and corners of sources whatever the print step.
    #[arg(
        display_order = 1,
        short,
        long = "output",
        value_name = "OUT",
        default_value_if("format", ArgPredicate::IsPresent, Some("-"))
    )]
    pub outputs: Vec<PathBuf>,
    /// Format of standard output (`-o -`, csv without it), and of files whose ending names none
    #[arg(help_heading = "Results", long, value_enum, value_name = "FORMAT")]
    pub format: Option<Format>,
    /// Signals to show.
    #[arg(
        display_order = 2,
        long = "probe",
        value_name = "NAME",
        value_parser = named,
        allow_hyphen_values = true,
        help = "Show exactly this: v(a), v(a,b), i(d1), @d1[i], v1#branch, patterns v(x1.*), all, expressions v(a)*i(r1) (repeatable)"
    )]
    pub probes: Vec<String>,
    /// Show the results as a page in the browser
    #[arg(help_heading = "Results", long, conflicts_with = "format")]
    pub open: bool,
    /// Add rows at event times: two with equal time at a jump, before and after
    ///
    /// Where `.tran` names no print step they are there anyway, and so are rows at corners of sources.
    #[arg(help_heading = "Results", long)]
    pub events: bool,
    /// Print a summary of the run on standard error
    #[arg(help_heading = "Results", long, value_enum, value_name = "FORMAT")]
    pub summary: Option<Summary>,
}

/// The table of means.
#[derive(Debug, Clone, Args)]
pub struct TableArgs {
    /// Print mean, rms, least and greatest current and voltage and the mean power of every element, exact where the run is
    ///
    /// From tstart to tstop, or over the period. With the powers of sources and loads, efficiency, ripple and distortion of the signals
    /// shown, and losses of switching and temperatures where models have tables of them; in `--summary json` as `table`.
    #[arg(help_heading = "Analysis", long)]
    pub table: bool,
    /// An element whose power is input (repeatable) [default: all sources]
    #[arg(help_heading = "Analysis", id = "in", long = "in", value_name = "NAME", num_args = 1.., requires = "table")]
    pub inputs: Vec<String>,
    /// An element whose power is output (repeatable) [default: those whose current `.save` names, or resistors across voltages it names]
    #[arg(help_heading = "Analysis", id = "out", long = "out", value_name = "NAME", num_args = 1.., requires = "table")]
    pub outputs: Vec<String>,
}

/// Forms of the summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Summary {
    /// One JSON object on one line
    Json,
    /// Words
    Text,
}
