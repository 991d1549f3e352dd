//! A netlist file to a circuit, in one call.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::Circuit;
use super::elaborate::{ElaborateOptions, elaborate};
use crate::diagnostic::{Diagnostic, SourceMap, independent};
use crate::netlist::suggest::nearest;
use crate::netlist::{self, Files, Netlist};

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

/// Most bytes that are read of one file.
const MOST: u64 = 256 << 20;

/// The bytes of a regular file: what never ends (a device), or keeps its reader waiting (a pipe without a writer), is refused.
///
/// # Errors
/// Those of the file system; a file that is not regular or larger than 256 MB.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    read_all(File::open(path)?)
}

/// All bytes of a stream.
///
/// # Errors
/// Those of the stream; more than 256 MB.
pub(crate) fn read_all(stream: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(MOST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST {
        return Err(io::Error::other(format!(
            "it has more than {} MB",
            MOST >> 20
        )));
    }
    Ok(bytes)
}

/// The names in a folder; none where it cannot be read.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let here = Path::new(".");
    let folder = if folder.as_os_str().is_empty() {
        here
    } else {
        folder
    };
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect()
}

/// The file with the name nearest to that of one that is missing, or of the same name in the nearest folder.
pub(crate) fn near_file(path: &Path) -> Option<PathBuf> {
    let known = names(path.parent().unwrap_or(Path::new("")));
    let name = path.file_name()?.to_string_lossy();
    // Of files with one ending the rest is the name.
    let ending = path
        .extension()
        .map(|ending| format!(".{}", ending.to_string_lossy()));
    let ending = ending.unwrap_or_default();
    let stems = known.iter().filter_map(|known| known.strip_suffix(&ending));
    let of_stem = nearest(name.strip_suffix(&ending)?, stems).map(|stem| stem + &ending);
    let others = known.iter().filter(|known| !known.ends_with(&ending));
    let near = of_stem.or_else(|| nearest(&name, others.map(String::as_str)));
    let near = near.map(|near| path.with_file_name(near));
    near.or_else(|| in_near_folder(path))
}

/// A file of the same name in a folder whose name is like that of one that is missing.
fn in_near_folder(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let (above, name) = (folder.parent()?, folder.file_name()?.to_string_lossy());
    let known = names(above);
    let near = nearest(&name, known.iter().map(String::as_str))?;
    let file = above.join(near).join(path.file_name()?);
    file.is_file().then_some(file)
}

/// Reads, parses and elaborates a netlist file.
#[must_use]
pub fn load(path: &Path, options: &ElaborateOptions) -> Loaded {
    load_read(path, read(path), options)
}

/// The same of what reading it gave; `path` is its name in findings, and what it includes is looked for beside it.
#[must_use]
pub fn load_read(path: &Path, bytes: io::Result<Vec<u8>>, options: &ElaborateOptions) -> Loaded {
    let mut sources = SourceMap::default();
    let bytes = match bytes {
        Ok(bytes) => bytes,
        Err(error) => {
            let message = format!("cannot read `{}`: {error}", path.display());
            let unreadable = Diagnostic::error("unreadable", None, message);
            let help = match near_file(path) {
                Some(near) => format!("did you mean `{}`?", near.display()),
                None => "check its name and folder".into(),
            };
            return Loaded {
                sources,
                netlist: None,
                circuit: None,
                diagnostics: vec![unreadable.help(help)],
            };
        }
    };
    if path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("plecs"))
    {
        let message = format!(
            "`{}` is a model of PLECS, which circ does not read",
            path.display()
        );
        let foreign = Diagnostic::error("unreadable", None, message)
            .help("write the circuit as a netlist: docs/from-plecs.md has the parts of PLECS with the cards that take their place");
        return Loaded {
            sources,
            netlist: None,
            circuit: None,
            diagnostics: vec![foreign],
        };
    }
    let root = sources.add(path.to_string_lossy(), netlist::decode(&bytes));
    let search = Files {
        read: &read,
        names: &names,
        libraries: &options.libraries,
    };
    let (parsed, mut diagnostics) = netlist::parse_among(&mut sources, root, search);
    let (circuit, more) = elaborate(&parsed, options);
    diagnostics.extend(independent(more, &diagnostics, &sources));
    Loaded {
        sources,
        netlist: Some(parsed),
        circuit,
        diagnostics,
    }
}
