//! A netlist file to a circuit, in one call.

use std::fs;
use std::path::Path;

use super::Circuit;
use super::elaborate::{ElaborateOptions, elaborate};
use crate::diagnostic::{Diagnostic, SourceMap};
use crate::netlist::{self, Netlist};

/// What came of a netlist file.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// All files read, for showing findings.
    pub sources: SourceMap,
    /// The cards, to elaborate again with other values; `None` if the file could not be read.
    pub netlist: Option<Netlist>,
    /// The circuit, unless there was an error.
    pub circuit: Option<Circuit>,
    /// Everything found, the parser's findings first.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads, parses and elaborates a netlist file.
#[must_use]
pub fn load(path: &Path, options: &ElaborateOptions) -> Loaded {
    let mut sources = SourceMap::default();
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            let message = format!("cannot read `{}`: {error}", path.display());
            return Loaded {
                sources,
                netlist: None,
                circuit: None,
                diagnostics: vec![Diagnostic::error("unreadable", None, message)],
            };
        }
    };
    let root = sources.add(path.to_string_lossy(), netlist::decode(&bytes));
    let (parsed, mut diagnostics) = netlist::parse(&mut sources, root, &|path| fs::read(path));
    let (circuit, more) = elaborate(&parsed, options);
    diagnostics.extend(more);
    Loaded {
        sources,
        netlist: Some(parsed),
        circuit,
        diagnostics,
    }
}
