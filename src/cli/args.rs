//! What may be typed.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

use clap::builder::{ArgPredicate, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use super::examples;
use super::output::Format;

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
    /// Make no coarser runs beside one in steps: it takes less time, and its error is not known
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
    /// Only of this measurement (repeatable) [default: all]
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

/// Forms of the summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Summary {
    /// One JSON object on one line
    Json,
    /// Words
    Text,
}

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
    /// Measure this program too
    #[arg(long, value_name = "PROGRAM", value_parser = ["ngspice"])]
    pub against: Option<String>,
    /// Only these methods: exact, euler, theta, siconos (θ = ½, γ = 1), ngspice
    #[arg(long, value_name = "A,B,..", value_delimiter = ',', value_parser = ["exact", "euler", "theta", "siconos", "ngspice"])]
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

/// A number with SPICE's suffixes: `1u`, `4k7`, `2.2e-6`.
fn number(text: &str) -> Result<f64, String> {
    crate::netlist::value::parse(text)
        .map(|v| v.f64)
        .map_err(|e| e.to_string())
}

/// A name, of a signal or a pattern.
fn named(text: &str) -> Result<String, String> {
    if text.trim().is_empty() {
        return Err("a name is missing".into());
    }
    Ok(text.to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if x > 0.0 {
            Ok(x)
        } else {
            Err("must be positive".into())
        }
    })
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if x >= 0.0 {
            Ok(x)
        } else {
            Err("must not be negative".into())
        }
    })
}

fn implicitness(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if (0.5..=1.0).contains(&x) {
            Ok(x)
        } else {
            Err("must be in [0.5, 1]".into())
        }
    })
}

/// `r1=5%`, or the part itself, `r1=0.05`.
fn tolerance(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=5%")?;
    let value = match value.trim().strip_suffix('%') {
        Some(percent) => 0.01 * not_negative(percent)?,
        None => match not_negative(value.trim())? {
            part if part < 1.0 => part,
            part => {
                return Err(format!(
                    "{part} is {} %: write `{part}%` for {part} %, or a part below 1",
                    100.0 * part
                ));
            }
        },
    };
    Ok((name.trim().to_lowercase(), value))
}

/// `r=1k`, `r=1k,2k`, `r=lin:1k:2k:11`, `r=log:1:100:7`.
fn assignment(text: &str) -> Result<Assigned, String> {
    let (name, values) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let parts: Vec<&str> = values.split(':').collect();
    let values = match parts[..] {
        [kind @ ("lin" | "log"), first, last, count] => {
            let (first, last) = (number(first.trim())?, number(last.trim())?);
            let count = count.trim().parse::<usize>().ok().filter(|n| (2..=MOST_VALUES).contains(n));
            let count = count.ok_or(format!("expected a number of values from 2 to {MOST_VALUES}"))?;
            spaced(kind == "log", (first, last), count)?
        }
        [list] => {
            let values = list.split(',').map(|value| number(value.trim()));
            values.collect::<Result<_, _>>()?
        }
        _ => return Err("expected a value, or several as `1k,2k`, `lin:FIRST:LAST:COUNT` or `log:FIRST:LAST:COUNT`".into()),
    };
    let milli = parts.iter().flat_map(|part| part.split(',')).map(str::trim);
    let milli = milli.filter_map(|part| Some((part, part.strip_suffix('M')?)));
    let mut milli =
        milli.filter(|(_, digits)| digits.ends_with(|c: char| c.is_ascii_digit() || c == '.'));
    let milli = milli.next().map(|(part, _)| part.to_owned());
    let name = name.trim().to_lowercase();
    Ok(Assigned {
        name,
        values,
        milli,
    })
}

/// Most values of one name in a sweep.
const MOST_VALUES: usize = 1_000_000;

/// So many values, the first and the last among them exactly.
fn spaced(by_ratio: bool, (first, last): (f64, f64), count: usize) -> Result<Vec<f64>, String> {
    if by_ratio && first * last <= 0.0 {
        return Err("a logarithmic sweep needs values of one sign".into());
    }
    let value = |k: usize| {
        let part = k as f64 / (count - 1) as f64;
        match k {
            0 => first,
            k if k + 1 == count => last,
            _ if by_ratio => first * (last / first).powf(part),
            _ => first + (last - first) * part,
        }
    };
    Ok((0..count).map(value).collect())
}

/// The name of standard input in messages.
pub const STDIN: &str = "<stdin>";

fn readable(text: &str) -> Result<PathBuf, String> {
    Ok(PathBuf::from(if text == "-" { STDIN } else { text }))
}

fn folder(text: &str) -> Result<PathBuf, String> {
    let folder = PathBuf::from(text);
    if folder.is_dir() {
        Ok(folder)
    } else {
        Err("there is no such folder".into())
    }
}

fn position(text: &str) -> Result<(String, bool), String> {
    let (name, position) = text.split_once('=').ok_or("expected NAME=on or NAME=off")?;
    let on = match position.trim().to_ascii_lowercase().as_str() {
        "on" | "1" | "closed" => true,
        "off" | "0" | "open" => false,
        other => return Err(format!("`{other}` is neither on nor off")),
    };
    Ok((name.trim().to_lowercase(), on))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn every_argument_has_help_and_none_contradict() {
        Cli::command().debug_assert();
    }

    #[test]
    fn numbers_take_suffixes_and_ranges_hold() {
        assert_eq!(positive("1u"), Ok(1e-6));
        let assigned = |text| assignment(text).map(|a| (a.name, a.values));
        assert_eq!(assigned("R=4k7"), Ok(("r".into(), vec![4700.0])));
        assert_eq!(assigned("r=lin:1:2:3").unwrap().1, [1.0, 1.5, 2.0]);
        assert_eq!(assigned("r=log:1:4:3").unwrap().1, [1.0, 2.0, 4.0]);
        assert_eq!(position("S1=ON"), Ok(("s1".into(), true)));
        for refused in ["0", "-1u", "x", ""] {
            assert!(positive(refused).is_err(), "{refused}");
        }
        assert!(named(" ").is_err() && named("v(a)").is_ok());
        assert!(implicitness("0.4").is_err() && implicitness("1").is_ok());
        assert!(assignment("r").is_err() && position("s1=half").is_err());
    }
}
