//! ngspice's batch line, `circ -b FILE -r OUT.raw -o LOG`, for programs that call a simulator that way.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Mutex;

use clap::Parser;

use super::exit::Failure;
use super::files;

/// The arguments of ngspice that a batch line has.
#[derive(Debug, Parser)]
#[command(name = "circ -b", about = "Simulate as `ngspice -b` does", long_about = None)]
struct Batch {
    /// Carry out the analysis of the netlist, and end
    #[arg(short, long, required = true)]
    batch: bool,
    /// Write rows to this file, in ngspice's binary format unless it ends in csv, npz or json [default: csv to standard output]
    #[arg(short, long, value_name = "FILE")]
    rawfile: Option<PathBuf>,
    /// Write messages and measurements to this file, in the form of LTspice's log [default: standard error]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Taken and not used: circ knows which dialect a netlist is in
    #[arg(short = 'D', long, value_name = "NAME=VALUE")]
    define: Vec<String>,
    /// Taken and not used
    #[arg(short, long)]
    autorun: bool,
    /// Taken and not used
    #[arg(short, long)]
    no_spiceinit: bool,
    /// The netlist
    file: PathBuf,
}

/// Text for a person or program that reads it later.
#[derive(Debug)]
pub struct Log(Mutex<File>);

impl Log {
    /// Appends a line or several.
    pub(super) fn write(&self, text: &str) -> std::io::Result<()> {
        let mut file = self.0.lock().unwrap_or_else(|e| e.into_inner());
        writeln!(file, "{}", text.trim_end())
    }

    /// Begins a log with the line that readers know it by.
    ///
    /// # Errors
    /// It cannot be written, or would replace the netlist.
    pub(super) fn create(logged: &Logged) -> Result<Self, Failure> {
        let Logged { path, netlist } = logged;
        files::spare(&[path], [netlist.as_path()])?;
        let begun = File::create(path).and_then(|mut file| {
            writeln!(file, "Circuit: {}\n", netlist.display())?;
            Ok(Self(Mutex::new(file)))
        });
        begun.map_err(|error| Failure::File {
            path: path.clone(),
            error,
        })
    }
}

/// Where a log is to be, and of which netlist.
pub(super) struct Logged {
    path: PathBuf,
    netlist: PathBuf,
}

/// The command line that a batch line stands for, `circ sim …`, and its log; others stay as they are.
///
/// # Errors
/// An argument is missing or unknown, or help is asked for.
pub(super) fn expanded(
    args: Vec<OsString>,
) -> Result<(Vec<OsString>, Option<Logged>), clap::Error> {
    let asks = |arg: &OsString| arg == "--batch" || arg.to_string_lossy().starts_with("-b");
    if !args.iter().skip(1).take_while(|arg| *arg != "--").any(asks) {
        return Ok((args, None));
    }
    let Batch {
        rawfile,
        output,
        file,
        ..
    } = Batch::try_parse_from(args)?;
    let mut own: Vec<OsString> = ["circ", "sim"].map(Into::into).into();
    if let Some(rows) = rawfile {
        let ending = rows.extension().map(OsStr::to_ascii_lowercase);
        let named = ending.is_some_and(|e| ["csv", "raw", "npz", "json"].iter().any(|k| e == *k));
        if !named {
            own.extend(["--format".into(), "raw".into()]);
        }
        own.extend(["-o".into(), rows.into_os_string()]);
    }
    own.extend(["--".into(), file.clone().into_os_string()]);
    let netlist = file;
    Ok((own, output.map(|path| Logged { path, netlist })))
}
