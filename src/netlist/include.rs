//! `.include` and `.lib`: finding files and sections of libraries.

use std::io;
use std::path::{Component, Path, PathBuf};

use super::lex::{Line, logical, title};
use super::read::Reader;
use super::{decode, dot};
use crate::diagnostic::{Diagnostic, Span};

/// Deepest nesting of includes.
const MAX_INCLUDES: usize = 32;
/// Most files in one netlist.
pub(super) const MAX_FILES: usize = 512;
/// Most bytes in one netlist.
pub(super) const MAX_BYTES: usize = 256 << 20;

/// Where included files come from.
#[derive(Clone, Copy)]
pub struct Files<'a> {
    /// The bytes of a file.
    pub read: &'a dyn Fn(&Path) -> io::Result<Vec<u8>>,
    /// The names in a folder, which is the working folder where its path is empty; none where they cannot be known.
    pub names: &'a dyn Fn(&Path) -> Vec<String>,
    /// Folders that are searched after those of the including file and of the netlist.
    pub libraries: &'a [PathBuf],
}

/// An included file.
pub(super) struct Found {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
}

impl Files<'_> {
    /// A file of one of these names in a folder, as written or else in other letter case.
    fn within(&self, folder: &Path, names: &[&str]) -> io::Result<Option<Found>> {
        let exact = names.iter().map(|name| lexical(&folder.join(name)));
        let other = names.iter().filter_map(|name| self.any_case(folder, name));
        for path in exact.chain(other) {
            match (self.read)(&path) {
                Ok(bytes) => return Ok(Some(Found { path, bytes })),
                Err(error) if is_there(&error) => return Err(error),
                Err(_) => {}
            }
        }
        Ok(None)
    }

    /// The path below a folder with the letters that its parts have there; the first one in order where several differ in case.
    fn any_case(&self, folder: &Path, written: &str) -> Option<PathBuf> {
        let mut path = lexical(folder);
        for part in lexical(Path::new(written)).components() {
            match part {
                Component::Normal(part) => {
                    let part = part.to_str()?.to_lowercase();
                    let names = (self.names)(&path);
                    let same = names.iter().filter(|name| name.to_lowercase() == part);
                    path.push(same.min()?);
                }
                Component::ParentDir => path = lexical(&path.join("..")),
                _ => return None,
            }
        }
        Some(path)
    }
}

impl Reader<'_> {
    /// `.lib path`, `.lib path section`; a path may contain blanks.
    pub(super) fn lib(&mut self, file: &dot::Path, path: &Path) {
        match &file.section {
            Some((short, section))
                if self.is_missing(&file.whole, path) && !self.is_missing(short, path) =>
            {
                self.include(short, Some(section), file.span, path);
            }
            Some((short, section)) if short == &file.whole => {
                self.include(short, Some(section), file.span, path)
            }
            _ => self.include(&file.whole, None, file.span, path),
        }
    }

    fn is_missing(&self, written: &str, from: &Path) -> bool {
        matches!(self.find(written, from), Ok(None))
    }

    /// The folders in which included files are looked for, in this order.
    fn folders<'p>(&'p self, from: &'p Path) -> impl Iterator<Item = &'p Path> {
        let beside = [Some(from), self.files.first().map(PathBuf::as_path)];
        let beside = beside.into_iter().flatten();
        let beside = beside.map(|file| file.parent().unwrap_or(Path::new("")));
        beside.chain(self.search.libraries.iter().map(PathBuf::as_path))
    }

    /// An included file, looked for beside the including one, beside the netlist and in the libraries, with `\` as `/` too and in any
    /// letter case. Of a path from another machine, which is not there, the file name counts.
    ///
    /// # Errors
    /// Why what is there cannot be read.
    pub(super) fn find(&self, written: &str, from: &Path) -> io::Result<Option<Found>> {
        let slashes = written.replace('\\', "/");
        for folder in self.folders(from) {
            if let Some(found) = self.search.within(folder, &[written, &slashes])? {
                return Ok(Some(found));
            }
        }
        let Some(name) = foreign_name(&slashes) else {
            return Ok(None);
        };
        for folder in self.folders(from) {
            if let Some(found) = self.search.within(folder, &[name])? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Says where a file was found of which the path as written is on another machine.
    pub(super) fn tell_elsewhere(&mut self, written: &str, found: &Path, span: Span) {
        let slashes = written.replace('\\', "/");
        if foreign_name(&slashes).is_some() && found != lexical(Path::new(&slashes)) {
            let message = format!("`{written}` is not here; `{}` is read", found.display());
            self.tell(
                Diagnostic::note("found-elsewhere", span, message).label("found by its name"),
            );
        }
    }

    /// Where a file that is missing was looked for, and what to do.
    pub(super) fn missing_help(&self) -> String {
        let count = self.search.libraries.len();
        let searched = match count {
            0 => String::new(),
            1 => " and the folder of `--lib`".into(),
            _ => format!(" and the {count} folders of `--lib`"),
        };
        format!("looked for beside the netlist{searched}; `--lib DIR` names a folder to search")
    }

    pub(super) fn include(
        &mut self,
        written: &str,
        section: Option<&String>,
        span: Span,
        from: &Path,
    ) {
        let Found { path, bytes } = match self.find(written, from) {
            Ok(Some(found)) => found,
            Ok(None) => {
                let help = self.missing_help();
                self.tell(
                    Diagnostic::warning("missing-file", span, format!("cannot read `{written}`"))
                        .label("left out: what it defines may be missing further on")
                        .help(help),
                );
                return;
            }
            Err(error) => {
                let message = format!("cannot read `{written}`: {error}");
                self.tell(Diagnostic::error("unreadable", span, message).label("not read"));
                return;
            }
        };
        if self.files.contains(&path) {
            self.tell(
                Diagnostic::error("include-loop", span, format!("`{written}` includes itself"))
                    .label("already being read")
                    .help("take this card out: what the file defines is there once"),
            );
            return;
        }
        self.tell_elsewhere(written, &path, span);
        self.bytes += bytes.len();
        if self.files.len() > MAX_INCLUDES
            || self.sources.files.len() > MAX_FILES
            || self.bytes > MAX_BYTES
        {
            let message = format!(
                "too many included files (more than {MAX_INCLUDES} deep, {MAX_FILES} in all, or {MAX_BYTES} bytes)"
            );
            self.tell(Diagnostic::error("too-deep", span, message).label("not read"));
            return;
        }
        let text = decode::decode(&bytes);
        let file = self.sources.add(path.to_string_lossy(), text.clone());
        let whole = Span {
            file,
            start: 0,
            end: title(&text).end,
        };
        if let Some(foreign) = decode::foreign(&text, whole).filter(|d| d.code != "empty") {
            self.tell(foreign);
            return;
        }
        let (lines, orphans) = logical(file, &text, 0);
        for span in orphans {
            self.tell(Diagnostic::error(
                "unexpected",
                span,
                "there is no card to continue",
            ));
        }
        self.files.push(path.clone());
        match section {
            None => self.lines(&lines, &path),
            Some(section) => match library_section(&lines, section) {
                Some(part) => self.lines(part, &path),
                None => self.tell(
                    Diagnostic::error(
                        "missing-section",
                        span,
                        format!("`{written}` has no section `{section}`"),
                    )
                    .label("no `.lib` with this name in the file"),
                ),
            },
        }
        self.files.pop();
    }
}

/// Whether it is not the name that is at fault.
fn is_there(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::Other | io::ErrorKind::PermissionDenied
    )
}

/// The file name in a path that names its place on some machine: `C:/…`, `/…`, `~/…`.
fn foreign_name(slashes: &str) -> Option<&str> {
    let (folder, name) = slashes.rsplit_once('/')?;
    let drive =
        folder.as_bytes().get(1) == Some(&b':') && folder.as_bytes()[0].is_ascii_alphabetic();
    let rooted = slashes.starts_with(['/', '~']) || drive;
    (rooted && !name.is_empty()).then_some(name)
}

/// The name of a `.lib name` line.
fn section_name(line: &Line) -> Option<String> {
    let mut words = line.text.split_whitespace();
    let directive = words.next()?;
    let name = words.next()?;
    (directive.eq_ignore_ascii_case(".lib") && words.next().is_none())
        .then(|| name.trim_matches(['"', '\'']).to_lowercase())
}

fn is_end_of_section(line: &Line) -> bool {
    line.text.trim().to_lowercase().starts_with(".endl")
}

/// Lines that begin a section of a library: `.lib name` with an `.endl` before the next one.
pub(super) fn library_sections(lines: &[Line]) -> Vec<usize> {
    let mut starts = Vec::new();
    let mut candidate = None;
    for (index, line) in lines.iter().enumerate() {
        if is_end_of_section(line) {
            starts.extend(candidate.take());
        } else if section_name(line).is_some() {
            candidate = Some(index);
        }
    }
    starts
}

/// The lines of one section of a library.
fn library_section<'l>(lines: &'l [Line], name: &str) -> Option<&'l [Line]> {
    let start = library_sections(lines)
        .into_iter()
        .find(|&i| section_name(&lines[i]).as_deref() == Some(name))?;
    let length = lines[start + 1..].iter().position(is_end_of_section)?;
    Some(&lines[start + 1..start + 1 + length])
}

/// A path without `.` and, where possible, without `..`.
pub(super) fn lexical(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}
