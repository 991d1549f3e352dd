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

    /// The path and text of an included file, tried relative to the including one, with `\` as `/` too; `None` where there is
    /// none.
    ///
    /// # Errors
    /// Why what is there cannot be read.
    pub(super) fn find(
        &self,
        written: &str,
        from: &Path,
    ) -> io::Result<Option<(PathBuf, Vec<u8>)>> {
        let folder = from.parent().unwrap_or(Path::new(""));
        let slashes = written.replace('\\', "/");
        for name in [written, slashes.as_str()] {
            let path = lexical(&folder.join(name));
            match (self.loader)(&path) {
                Ok(bytes) => return Ok(Some((path, bytes))),
                Err(error) if is_there(&error) => return Err(error),
                Err(_) => {}
            }
        }
        Ok(None)
    }

    pub(super) fn include(
        &mut self,
        written: &str,
        section: Option<&String>,
        span: Span,
        from: &Path,
    ) {
        let (path, bytes) = match self.find(written, from) {
            Ok(Some(found)) => found,
            Ok(None) => {
                self.tell(
                    Diagnostic::warning("missing-file", span, format!("cannot read `{written}`"))
                        .label("left out")
                        .help("what it defines may be missing further on"),
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
                    .label("already being read"),
            );
            return;
        }
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
