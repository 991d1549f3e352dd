//! Files to blocks of cards: includes, libraries, subcircuits, conditionals, `.control`.

use std::io;
use std::path::{Path, PathBuf};

use super::ast::{Block, Branch, Netlist, Statement, Subckt};
use super::block::{Open, OpenKind};
use super::control::Script;
use super::dot::{self, Dot};
use super::include::{Files, lexical, library_sections};
use super::lex::{Fault, Line, Parsed, State, at_end, input, logical, next_word, title};
use super::{card, code, decode, schematic, stepped, suffix};
use crate::diagnostic::{Diagnostic, FileId, Severity, SourceMap, Span};

/// Reads a netlist: text to cards, includes in place. Never stops at the first fault.
///
/// `root` is a file of `sources` already; `loader` gives the bytes of included files, whose paths are relative to the
/// file that includes them. Faults inside a subcircuit or a branch of `.if` stay with it: they are errors only if it
/// is used.
pub fn parse(
    sources: &mut SourceMap,
    root: FileId,
    loader: &dyn Fn(&Path) -> io::Result<Vec<u8>>,
) -> (Netlist, Vec<Diagnostic>) {
    let search = Files {
        read: loader,
        names: &|_| Vec::new(),
        libraries: &[],
    };
    parse_among(sources, root, search)
}

/// As [`parse`], with included files looked for in any letter case and in libraries too.
pub fn parse_among(
    sources: &mut SourceMap,
    root: FileId,
    search: Files<'_>,
) -> (Netlist, Vec<Diagnostic>) {
    let file = &sources.files[root.0 as usize];
    let (path, text) = (PathBuf::from(&file.path), file.text.clone());
    let first = title(&text);
    let used = text.trim_end();
    let last_line = used.rfind('\n').map_or(0, |i| i + 1);
    let end = Span {
        file: root,
        start: last_line,
        end: used.len(),
    };
    let mut netlist = Netlist {
        title: String::new(),
        body: Block::default(),
        end,
        sheet: None,
    };

    let title_span = Span {
        file: root,
        start: first.start,
        end: first.end,
    };
    if let Some(foreign) = decode::foreign(&text, title_span).filter(|_| !schematic::is_one(&text))
    {
        netlist.body.faults.push(foreign.clone());
        return (netlist, vec![foreign]);
    }
    let mut reader = Reader {
        sources,
        search,
        open: vec![Open {
            kind: OpenKind::Root,
            block: Block::default(),
            span: end,
        }],
        files: vec![lexical(&path)],
        bytes: text.len(),
        skipped: Vec::new(),
        script: Script::default(),
        title: None,
    };
    if schematic::is_one(&text) {
        reader.title = path
            .file_stem()
            .map(|name| name.to_string_lossy().into_owned());
        netlist.sheet = Some(reader.sheet(root, &text, &path));
    } else {
        reader.title_line(&text, title_span);
        let (lines, orphans) = logical(root, &text, first.end);
        for span in orphans {
            reader.tell(
                Diagnostic::error("unexpected", span, "there is no card to continue")
                    .label("a line that begins with `+` continues the card above"),
            );
        }
        reader.lines(&lines, &path);
    }
    reader.close_all();
    reader.end_script();
    reader.note_skipped();

    netlist.title = reader.title.take().unwrap_or_default();
    netlist.body = reader.open.pop().map(|o| o.block).unwrap_or_default();
    stepped::free(&mut netlist.body);
    code::expand(&mut netlist.body, reader.sources);
    let milli = suffix::of_parameters(&netlist, reader.sources);
    netlist.body.faults.extend(milli);
    let findings = netlist.body.faults.clone();
    (netlist, findings)
}

pub(super) struct Reader<'a> {
    pub(super) sources: &'a mut SourceMap,
    pub(super) search: Files<'a>,
    pub(super) open: Vec<Open>,
    /// The files being read, from the root inwards.
    pub(super) files: Vec<PathBuf>,
    pub(super) bytes: usize,
    pub(super) skipped: Vec<(String, Span)>,
    pub(super) script: Script,
    title: Option<String>,
}

impl Reader<'_> {
    /// Keeps a finding with the block it belongs to.
    pub(super) fn tell(&mut self, finding: Diagnostic) {
        if let Some(open) = self.open.last_mut() {
            open.block.faults.push(finding);
        }
    }

    pub(super) fn push(&mut self, statement: Statement) {
        if let Some(open) = self.open.last_mut() {
            open.block.statements.push(statement);
        }
    }

    /// The title line; warns where it looks like a card that is lost this way.
    fn title_line(&mut self, text: &str, span: Span) {
        let first = text[span.start..span.end].trim();
        let lower = first.to_lowercase();
        if lower.starts_with(".title") {
            self.title = Some(first[6..].trim().to_string());
            return;
        }
        self.title = Some(first.trim_start_matches(['*', ' ', '\t']).to_string());
        if first.starts_with(['*', ';', '#', '$', '+']) || first.is_empty() {
            return;
        }
        let line = Line {
            file: span.file,
            start: span.start,
            text: text[span.start..span.end].replace('\t', " "),
            pieces: Vec::new(),
        };
        let state = State::default();
        let is_card = if first.starts_with('.') {
            dot::card(input(&line, &state)).is_ok()
        } else {
            let named = first.split([' ', '\t']).next().unwrap_or("");
            // Titles begin with an article, "A buck converter".
            let is_short = named.len() == 1 && !named.eq_ignore_ascii_case("a");
            let plausible = is_short || named.chars().any(|c| c.is_ascii_digit());
            plausible
                && card::element(input(&line, &state)).is_ok_and(|(_, e)| {
                    !e.nodes.is_empty() || !named.is_empty() && first.split_whitespace().count() > 3
                })
        };
        if is_card {
            self.tell(
                Diagnostic::warning(
                    "title",
                    line.span(),
                    "the first line looks like a card, but it is the title",
                )
                .label("this is not part of the circuit")
                .help("put a title line above it"),
            );
        }
    }

    pub(super) fn lines(&mut self, lines: &[Line], path: &Path) {
        let sections = library_sections(lines);
        let mut control = None;
        let mut in_section = false;
        for (index, line) in lines.iter().enumerate() {
            let lower = line.text.trim().to_lowercase();
            if control.is_some() {
                if lower.starts_with(".endc") {
                    control = None;
                } else {
                    self.command(line);
                }
                continue;
            }
            if in_section || sections.contains(&index) {
                // A section of a library that was not asked for.
                in_section = !lower.starts_with(".endl");
                continue;
            }
            if lower.starts_with(".control") {
                control = Some(line.span());
            }
            if !self.line(line, path) {
                self.note_after_end(&lines[index + 1..]);
                return;
            }
        }
        if let Some(span) = control {
            self.tell(
                Diagnostic::warning("unterminated", span, "`.control` is never closed")
                    .label("no `.endc` follows"),
            );
        }
    }

    /// Notes cards that stand after `.end`.
    fn note_after_end(&mut self, lines: &[Line]) {
        let Some(first) = lines.first() else {
            return;
        };
        let (message, label) = match lines.len() {
            1 => ("a card after `.end` is not read".to_owned(), "left out"),
            count => (
                format!("{count} cards after `.end` are not read"),
                "the first of them",
            ),
        };
        self.tell(
            Diagnostic::note("after-end", first.span(), message)
                .label(label)
                .help("move `.end` behind what belongs to the circuit"),
        );
    }

    /// Reads one card; false at `.end`.
    fn line(&mut self, line: &Line, path: &Path) -> bool {
        let state = State::default();
        let start = input(line, &state);
        if line.text.trim_start().starts_with('.') {
            let parsed = finish(dot::card(start), line);
            self.keep_findings(&state);
            match parsed {
                Ok(dot) => return self.dot(dot, line, path),
                Err(fault) if dot::is_measurement(&line.text) => self.tell(Diagnostic {
                    severity: Severity::Warning,
                    message: format!("{}; this measurement is left out", fault.message),
                    ..*fault
                }),
                Err(fault) => self.tell(*fault),
            }
        } else {
            let parsed = finish(card::element(start), line);
            self.keep_findings(&state);
            match parsed {
                Ok(mut element) => {
                    self.read_points(&mut element, path);
                    self.push(Statement::Element(element));
                }
                Err(fault) => self.tell(*fault),
            }
        }
        true
    }

    pub(super) fn keep_findings(&mut self, state: &State) {
        for finding in state.findings.take() {
            self.tell(finding);
        }
    }

    fn dot(&mut self, dot: Dot, line: &Line, path: &Path) -> bool {
        let span = line.span();
        match dot {
            Dot::Statement(statement) => self.push(*statement),
            Dot::Subckt(name, nodes, params) => {
                let subckt = Subckt {
                    name,
                    nodes,
                    params,
                    body: Block::default(),
                };
                self.begin(OpenKind::Subckt(Box::new(subckt)), span);
            }
            Dot::Ends(name) => self.ends(name.as_ref(), span),
            Dot::If(condition) => {
                let first = Branch {
                    condition: Some(condition),
                    body: Block::default(),
                };
                self.begin(OpenKind::If(vec![first]), span);
            }
            Dot::ElseIf(condition) => self.next_branch(Some(condition), span),
            Dot::Else => self.next_branch(None, span),
            Dot::EndIf => {
                if matches!(
                    self.open.last(),
                    Some(Open {
                        kind: OpenKind::If(_),
                        ..
                    })
                ) {
                    self.close();
                } else {
                    self.tell(
                        Diagnostic::error("unexpected", span, "`.endif` without `.if`")
                            .label("nothing to close"),
                    );
                }
            }
            Dot::Include(file) => self.include(&file.whole, None, file.span, path),
            Dot::Lib(file) => self.lib(&file, path),
            Dot::Options(options) => {
                match (options.others, &options.read[..]) {
                    (false, _) => {}
                    (true, []) => self.skip(line),
                    (true, _) => self.skip_as(".options but for temp, tnom and gmin", line),
                }
                for statement in options.read {
                    self.push(statement);
                }
            }
            Dot::EndLib | Dot::Control | Dot::Nothing => {}
            Dot::End => return false,
            Dot::Title(text) => self.title = Some(text),
            Dot::Skipped => self.skip(line),
        }
        true
    }

    /// Keeps the first word of a line for the note about what is skipped.
    fn skip(&mut self, line: &Line) {
        let name = line.text.split_whitespace().next().unwrap_or("");
        self.skip_as(&name.to_lowercase(), line);
    }

    fn skip_as(&mut self, name: &str, line: &Line) {
        self.skipped.push((name.to_owned(), line.span()));
    }

    fn note_skipped(&mut self) {
        let Some(&(_, span)) = self.skipped.first() else {
            return;
        };
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in &self.skipped {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        let message = format!(
            "skipped, as they do not change the transient: {}",
            names.join(", ")
        );
        let label = if self.skipped.len() > 1 {
            "the first of them"
        } else {
            ""
        };
        self.tell(Diagnostic::note("skipped", span, message).label(label));
    }
}

/// The result of a card's parser as a result with a diagnostic; a card must be read to its end.
pub(super) fn finish<T>(parsed: Parsed<'_, T>, line: &Line) -> Result<T, Box<Diagnostic>> {
    match parsed {
        Ok((rest, value)) if at_end(rest) => Ok(value),
        Ok((rest, _)) => Err(Box::new(
            Diagnostic::error(
                "unexpected",
                next_word(rest),
                "this does not belong to the card",
            )
            .label("unexpected"),
        )),
        Err(nom::Err::Failure(Fault::Told(fault)) | nom::Err::Error(Fault::Told(fault))) => {
            Err(fault)
        }
        Err(_) => Err(Box::new(
            Diagnostic::error("bad-card", line.span(), "this is no card")
                .label("expected an element or a directive"),
        )),
    }
}
