//! Points of a PWL source from a file of numbers.

use std::path::Path;

use super::ast::{Device, Element, Expr, ExprKind, WaveArg};
use super::include::{Found, MAX_BYTES, MAX_FILES};
use super::read::Reader;
use super::{decode, value};
use crate::diagnostic::{Diagnostic, FileId, Span};

/// Most numbers of one file.
const MAX_NUMBERS: usize = 2_000_000;

impl Reader<'_> {
    /// Reads the points of `PWL file=name`: times and values between blanks, commas and line ends; lines that begin with
    /// `*`, `#`, `;` or `//` are comments. The path is relative to the file that names it.
    pub(super) fn read_points(&mut self, element: &mut Element, from: &Path) {
        let Device::Source {
            wave: Some(wave),
            args,
            ..
        } = &mut element.device
        else {
            return;
        };
        let is_file = |name: &str| name == "file";
        let Some(file) = args.iter().find(|a| is_file(&a.name.text)) else {
            return;
        };
        let span = file.value.as_ref().map_or(file.name.span, |e| e.span);
        let written = &self.sources.files[span.file.0 as usize].text[span.start..span.end];
        let written = written.trim_matches(['"', '\'']).to_string();
        if wave.name.text != "pwl" || !wave.args.is_empty() {
            let fault = Diagnostic::error("unexpected", span, "a file besides the values");
            self.tell(fault.label("only a PWL without points of its own reads a file"));
            return;
        }
        let Found { path, bytes } = match self.find(&written, from) {
            Ok(Some(found)) => found,
            missing => {
                let help = self.missing_help();
                let why = missing
                    .err()
                    .map_or(String::new(), |error| format!(": {error}"));
                let message = format!("cannot read `{written}`{why}");
                let fault = Diagnostic::error("missing-file", span, message);
                self.tell(
                    fault
                        .label("the points of the PWL should be in it")
                        .help(help),
                );
                return;
            }
        };
        self.tell_elsewhere(&written, &path, span);
        self.bytes += bytes.len();
        if self.sources.files.len() > MAX_FILES || self.bytes > MAX_BYTES {
            let fault = Diagnostic::error("too-deep", span, "too many or too large files");
            self.tell(fault.label("not read"));
            return;
        }
        let text = decode::decode(&bytes);
        let file = self.sources.add(path.to_string_lossy(), text.clone());
        match points(&text, file) {
            Ok(points) => wave.args = points,
            Err(fault) => self.tell(*fault),
        }
    }
}

fn points(text: &str, file: FileId) -> Result<Vec<WaveArg>, Box<Diagnostic>> {
    let mut all = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive(['\n', '\r']) {
        let comment =
            line.trim_start().starts_with(['*', '#', ';']) || line.trim_start().starts_with("//");
        let mut at = start;
        start += line.len();
        if comment {
            continue;
        }
        let blank = |c: char| c.is_whitespace() || matches!(c, ',' | ';');
        for word in line.split_inclusive(blank) {
            let length = word.trim_end_matches(blank).len();
            let span = Span {
                file,
                start: at,
                end: at + length,
            };
            at += word.len();
            if length == 0 {
                continue;
            }
            let number = value::parse(&word[..length]).map_err(|why| {
                let message = format!("`{}` is not a number", &word[..length]);
                Diagnostic::error("bad-number", span, message).label(why.to_string())
            })?;
            if all.len() >= MAX_NUMBERS {
                let message = format!("more than {MAX_NUMBERS} numbers");
                return Err(Box::new(
                    Diagnostic::error("too-large", span, message).label("too many up to here"),
                ));
            }
            all.push(WaveArg {
                value: Expr {
                    kind: ExprKind::Number(number),
                    span,
                },
                plus: word.starts_with('+'),
            });
        }
    }
    Ok(all)
}
