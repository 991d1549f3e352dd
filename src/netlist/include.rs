//! `.include` and `.lib`: finding files and sections of libraries.

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
                if self.find(&file.whole, path).is_none() && self.find(short, path).is_some() =>
            {
                self.include(short, Some(section), file.span, path);
            }
            Some((short, section)) if short == &file.whole => {
                self.include(short, Some(section), file.span, path)
            }
            _ => self.include(&file.whole, None, file.span, path),
        }
    }

    /// The path and text of an included file, tried relative to the including one, with `\` as `/` too.
    pub(super) fn find(&self, written: &str, from: &Path) -> Option<(PathBuf, Vec<u8>)> {
        let folder = from.parent().unwrap_or(Path::new(""));
        let slashes = written.replace('\\', "/");
        [written, slashes.as_str()].into_iter().find_map(|name| {
            let path = lexical(&folder.join(name));
            (self.loader)(&path).ok().map(|bytes| (path, bytes))
        })
    }

    pub(super) fn include(
        &mut self,
        written: &str,
        section: Option<&String>,
        span: Span,
        from: &Path,
    ) {
        let Some((path, bytes)) = self.find(written, from) else {
            self.tell(
                Diagnostic::warning("missing-file", span, format!("cannot read `{written}`"))
                    .label("left out")
                    .help("what it defines may be missing further on"),
            );
            return;
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
