//! Commands that run a circuit.

use std::path::PathBuf;

use clap::builder::ArgPredicate;
use clap::{Args, ValueEnum};

use super::values::{named, positive};
use super::{Input, MethodArgs, ResultArgs, TableArgs};
use crate::cli::output::Format;

/// `circ sim`.
#[derive(Debug, Args)]
pub struct SimArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub method: MethodArgs,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub results: ResultArgs,
    /// Make the run a second time by an independent method; status 1 where the two differ by more than their errors
    ///
    /// An exact run is made in steps at two tolerances, a run in steps exactly if that can be, else in steps of another scheme. The
    /// summary has the largest difference relative to a signal's amplitude, and what is tolerated.
    #[arg(help_heading = "Analysis", long, conflicts_with = "from_pss")]
    pub verify: bool,
    /// Bound this measurement within the tolerances of values, `tol=5` (%) on cards or `--tol-of`, and verify the bounds by runs (repeatable)
    #[arg(
        help_heading = "Analysis",
        long,
        value_name = "MEAS",
        conflicts_with = "from_pss"
    )]
    pub worst: Vec<String>,
    /// Start at the periodic steady state, with sources that do not repeat held before 0 and running from there on
    #[arg(help_heading = "Analysis", long)]
    pub from_pss: bool,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub table: TableArgs,
}

/// `circ pss`.
#[derive(Debug, Args)]
pub struct PssArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub results: ResultArgs,
    /// The period, s, in place of the common one of the sources: a multiple of the period of each; suffixes as in netlists (`10u`)
    #[arg(help_heading = "Analysis", long, value_name = "T", value_parser = positive)]
    pub period: Option<f64>,
    /// The orbit that closes after N periods of the sources [default: 1, or that of the stable one]
    #[arg(help_heading = "Analysis", long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub order: Option<u16>,
    /// How well the orbit must close, relative to the amplitudes [default: 1e-9; 1e-6 where laws are curved]
    #[arg(help_heading = "Analysis", long, value_name = "R", value_parser = positive)]
    pub tol: Option<f64>,
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub table: TableArgs,
}

/// `circ ac`.
#[derive(Debug, Args)]
pub struct AcArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Write the response to this file, or `-`, standard output (repeatable); the ending chooses csv, raw, npz, json, svg, png or html
    ///
    /// Pictures show gain in dB and phase over the logarithm of the frequency, and of ratios their margins.
    #[arg(
        display_order = 1,
        short,
        long = "output",
        value_name = "OUT",
        default_value_if("format", ArgPredicate::IsPresent, Some("-"))
    )]
    pub outputs: Vec<PathBuf>,
    /// Show the results as a page in the browser
    #[arg(help_heading = "Results", long, conflicts_with = "format")]
    pub open: bool,
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
        help = "Show exactly these signals and ratios: v(a), i(l1), v(a)/v(b), -v(y)/v(x) (repeatable)"
    )]
    pub probes: Vec<String>,
    /// Show K sidebands on either side too, at f + k/T: `v(out)@-1`
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub sidebands: u16,
    /// Where the circuit is made linear [default: about the periodic steady state if it switches periodically, else the operating point]
    #[arg(long, value_enum)]
    pub about: Option<About>,
    /// The period, s, in place of the common one of the sources: a multiple of the period of each; suffixes as in netlists (`10u`)
    #[arg(long, value_name = "T", value_parser = positive)]
    pub period: Option<f64>,
}

/// `circ sens`.
#[derive(Debug, Args)]
pub struct SensArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Only of this measurement, or entry of the table (`table.power.efficiency`, `table.l1.i.rms`; repeatable) [default: all]
    #[arg(long, value_name = "MEAS")]
    pub of: Vec<String>,
    /// Only to this element's value or `.param` (repeatable) [default: all that are not 0]
    #[arg(long, value_name = "NAME")]
    pub to: Vec<String>,
    /// Of the periodic steady state instead of the transient
    #[arg(long)]
    pub pss: bool,
    /// The period, s, in place of the common one of the sources: a multiple of the period of each; suffixes as in netlists (`10u`)
    #[arg(long, value_name = "T", value_parser = positive, requires = "pss")]
    pub period: Option<f64>,
    /// Of the entries of `--table` too
    #[arg(long)]
    pub table: bool,
    /// An element whose power is the table's input (repeatable) [default: all sources]
    #[arg(id = "in", long = "in", value_name = "NAME", num_args = 1.., requires = "table")]
    pub inputs: Vec<String>,
    /// An element whose power is the table's output (repeatable) [default: those whose current `.save` names, or resistors across voltages it names]
    #[arg(id = "out", long = "out", value_name = "NAME", num_args = 1.., requires = "table")]
    pub outputs: Vec<String>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// `circ sweep`.
#[derive(Debug, Args)]
pub struct SweepArgs {
    #[command(flatten)]
    #[expect(missing_docs, reason = "documented where it is defined")]
    pub input: Input,
    /// Draw so many samples of random functions and tolerances, at every combination of the values
    #[arg(long, value_name = "N", conflicts_with = "sample", value_parser = clap::value_parser!(u64).range(1..))]
    pub mc: Option<u64>,
    /// Only this measurement (repeatable) [default: all]
    #[arg(long, value_name = "MEAS")]
    pub of: Vec<String>,
    /// Measure the periodic steady state instead of the transient
    #[arg(long)]
    pub pss: bool,
    /// Relative tolerance of the error-controlled step [default: 1e-4]
    #[arg(long, value_name = "R", value_parser = positive)]
    pub tol: Option<f64>,
    /// Write a row for every run to this file, or `-`, standard output (repeatable); the ending chooses csv, jsonl or npz [default: csv to
    /// standard output]
    #[arg(short, long = "output", value_name = "OUT")]
    pub outputs: Vec<PathBuf>,
}

/// Where a circuit is made linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum About {
    /// About the periodic steady state
    Pss,
    /// About the operating point
    Op,
}
