//! Circuits from text, for tests.

use super::{Circuit, Diodes, ElaborateOptions, elaborate};
use crate::diagnostic::{Diagnostic, SourceMap};
use crate::netlist::parse;

/// The circuit of a netlist without its title, and what elaboration found.
pub(super) fn read(text: &str, diodes: Diodes) -> (Option<Circuit>, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", format!("title\n{text}\n"));
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let options = ElaborateOptions {
        diodes,
        ..ElaborateOptions::default()
    };
    elaborate(&netlist, &options)
}
