//! Text to logical lines, and the small parsers that every card is made of.
//!
//! A logical line keeps its place: comments, line ends and the `+` of a continuation become spaces of the same
//! length, so a byte of the line is a byte of the file and every span points at what the user wrote.

use std::cell::{Cell, RefCell};
use std::ops::Range;

use nom::bytes::complete::take_while;
use nom::error::{ErrorKind, ParseError};
use nom::{Err as NomErr, IResult, Input as _};
use nom_locate::LocatedSpan;

use super::ast::Name;
use super::suggest::is_unit;
use crate::diagnostic::{Diagnostic, FileId, Span};

/// A card as it stands in its file, continuations joined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line {
    /// The file.
    pub(super) file: FileId,
    /// First byte.
    pub(super) start: usize,
    /// The text, with everything that is no part of the card blanked.
    pub(super) text: String,
    /// Where its pieces stand, where it is put together from several; none where a byte of the line is a byte of the file.
    pub(super) pieces: Vec<Piece>,
}

/// A part of a line, up to the next one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    /// Its first byte in the line.
    pub(super) at: usize,
    /// Where it stands in the file, or what it is said of.
    pub(super) place: Range<usize>,
    /// Its bytes are those of the file.
    pub(super) copied: bool,
}

/// The place in the file of the bytes `from..to` of a line.
fn place(file: FileId, start: usize, pieces: &[Piece], (from, to): (usize, usize)) -> Span {
    let to = to.max(from);
    if pieces.is_empty() {
        return Span {
            file,
            start: start + from,
            end: start + to,
        };
    }
    let piece = |before: usize| &pieces[before.saturating_sub(1)];
    let first = piece(pieces.partition_point(|p| p.at <= from));
    let last = piece(pieces.partition_point(|p| p.at < to.max(from + 1)));
    let within =
        |p: &Piece, offset: usize| (p.place.start + offset.saturating_sub(p.at)).min(p.place.end);
    let start = if first.copied {
        within(first, from)
    } else {
        first.place.start
    };
    let end = if last.copied {
        within(last, to)
    } else {
        last.place.end
    };
    Span {
        file,
        start,
        end: end.max(start),
    }
}

impl Line {
    /// The place of the card without the blanks around it.
    pub(super) fn span(&self) -> Span {
        let from = self.text.len() - self.text.trim_start().len();
        let to = self.text.trim_end().len();
        place(self.file, self.start, &self.pieces, (from, to))
    }
}

/// Physical lines as byte ranges; LF, CRLF and CR end a line.
fn physical(text: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    let bytes = text.as_bytes();
    let mut at = 0;
    std::iter::from_fn(move || {
        if at >= bytes.len() {
            return None;
        }
        let start = at;
        let length = bytes[start..]
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(bytes.len() - start);
        at = start + length + 1;
        if bytes.get(start + length..start + length + 2) == Some(b"\r\n") {
            at += 1;
        }
        Some(start..start + length)
    })
}

/// The first physical line, which is the title of a root file.
pub(super) fn title(text: &str) -> Range<usize> {
    physical(text).next().unwrap_or(0..0)
}

/// The logical lines of a file from byte `from` on, and the places of continuations of nothing.
pub(super) fn logical(file: FileId, text: &str, from: usize) -> (Vec<Line>, Vec<Span>) {
    let mut lines: Vec<Line> = Vec::new();
    let mut orphans = Vec::new();
    for range in physical(text).skip_while(|r| r.start < from) {
        let length = without_comment(&text[range.clone()]);
        let kept = blanked(&text[range.start..range.start + length]);
        let indent = kept.len() - kept.trim_start_matches(' ').len();
        if indent == kept.len() {
            continue;
        }
        if kept.trim() == ")"
            && let Some(line) = lines.last_mut().filter(|line| is_open(&line.text))
        {
            // The end of a `.model` written over several lines.
            let gap = range.start - (line.start + line.text.len());
            line.text.extend(std::iter::repeat_n(' ', gap));
            line.text.push_str(&kept);
        } else if !kept[indent..].starts_with('+') {
            lines.push(Line {
                file,
                start: range.start,
                text: kept,
                pieces: Vec::new(),
            });
        } else if let Some(line) = lines.last_mut() {
            let gap = range.start - (line.start + line.text.len());
            line.text.extend(std::iter::repeat_n(' ', gap + indent + 1));
            line.text.push_str(&kept[indent + 1..]);
        } else {
            let end = range.start + kept.trim_end_matches(' ').len();
            orphans.push(Span {
                file,
                start: range.start + indent,
                end,
            });
        }
    }
    (lines, orphans)
}

/// Whether more parentheses open than close.
fn is_open(text: &str) -> bool {
    let count = |c| text.matches(c).count();
    count('(') > count(')')
}

/// The length of a physical line without its comment.
fn without_comment(line: &str) -> usize {
    if line.trim_start().starts_with(['*', '#']) {
        return 0;
    }
    let mut quoted = false;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        let rest = &line[at..];
        match c {
            '"' => quoted = !quoted,
            ';' if !quoted => return at,
            '$' if !quoted
                && before.is_whitespace()
                && !rest[1..].starts_with(|c: char| !c.is_whitespace()) =>
            {
                return at;
            }
            '/' if !quoted && before.is_whitespace() && rest.starts_with("//") => return at,
            _ => {}
        }
        before = c;
    }
    line.len()
}

/// The same text with whitespace and control characters as spaces, byte for byte.
fn blanked(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_whitespace() || c.is_control() {
            out.extend(std::iter::repeat_n(' ', c.len_utf8()));
        } else {
            out.push(c);
        }
    }
    out
}

/// What the parsers of one line share.
#[derive(Debug, Default)]
pub(super) struct State {
    /// Findings that do not stop the card.
    pub(super) findings: RefCell<Vec<Diagnostic>>,
    /// Nesting of the expression being read.
    pub(super) depth: Cell<usize>,
    /// Operators read in the expression so far.
    pub(super) operators: Cell<usize>,
}

/// Where a line comes from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin<'a> {
    file: FileId,
    start: usize,
    /// The whole line.
    line: &'a str,
    pieces: &'a [Piece],
    pub(super) state: &'a State,
}

/// The input of all card parsers: the rest of a logical line.
pub(super) type Input<'a> = LocatedSpan<&'a str, Origin<'a>>;
/// The result of a card parser.
pub(super) type Parsed<'a, T> = IResult<Input<'a>, T, Fault>;

/// A whole line as input.
pub(super) fn input<'a>(line: &'a Line, state: &'a State) -> Input<'a> {
    LocatedSpan::new_extra(
        &line.text,
        Origin {
            file: line.file,
            start: line.start,
            line: &line.text,
            pieces: &line.pieces,
            state,
        },
    )
}

/// Why a card cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// An alternative did not match; a caller may try another.
    Mismatch,
    /// What to tell the user.
    Told(Box<Diagnostic>),
}

impl Fault {
    /// With this as its remedy.
    pub(super) fn helped(self, help: &str) -> Self {
        match self {
            Self::Mismatch => Self::Mismatch,
            Self::Told(finding) => Self::Told(Box::new(finding.help(help))),
        }
    }
}

impl ParseError<Input<'_>> for Fault {
    fn from_error_kind(_: Input<'_>, _: ErrorKind) -> Self {
        Self::Mismatch
    }

    fn append(_: Input<'_>, _: ErrorKind, other: Self) -> Self {
        other
    }
}

/// A fault that no alternative may hide (nom's `cut`).
pub(super) fn refuse(diagnostic: Diagnostic) -> NomErr<Fault> {
    NomErr::Failure(Fault::Told(Box::new(diagnostic)))
}

/// A mismatch that lets the caller try something else.
pub(super) fn mismatch<'a, T>() -> Parsed<'a, T> {
    Err(NomErr::Error(Fault::Mismatch))
}

/// Keeps a finding that does not stop the card, once where a text is read in several ways.
pub(super) fn tell(i: Input<'_>, diagnostic: Diagnostic) {
    let mut findings = i.extra.state.findings.borrow_mut();
    if !findings.contains(&diagnostic) {
        findings.push(diagnostic);
    }
}

/// The text from one input to a later one.
pub(super) fn written<'a>(from: Input<'a>, to: Input<'_>) -> &'a str {
    &from.fragment()[..to.location_offset() - from.location_offset()]
}

/// The place from one input to a later one.
pub(super) fn between(from: Input<'_>, to: Input<'_>) -> Span {
    let Origin {
        file,
        start,
        pieces,
        ..
    } = from.extra;
    let bytes = (from.location_offset(), to.location_offset());
    place(file, start, pieces, bytes)
}

/// The place of the next `length` bytes.
pub(super) fn ahead(i: Input<'_>, length: usize) -> Span {
    let Origin {
        file,
        start,
        pieces,
        ..
    } = i.extra;
    let from = i.location_offset();
    let to = from + length.min(i.fragment().len());
    place(file, start, pieces, (from, to))
}

/// The place of the word that comes next; at the end of the card, its last word.
pub(super) fn next_word(i: Input<'_>) -> Span {
    let i = blank(i);
    if !i.fragment().is_empty() {
        return ahead(i, i.fragment().find(' ').unwrap_or(i.fragment().len()));
    }
    let Origin {
        file,
        start,
        line,
        pieces,
        ..
    } = i.extra;
    let used = line.trim_end_matches(' ');
    let word = used.rfind(' ').map_or(0, |at| at + 1);
    place(file, start, pieces, (word, used.len()))
}

/// Skips blanks.
pub(super) fn blank(i: Input<'_>) -> Input<'_> {
    let spaces = i.fragment().len() - i.fragment().trim_start_matches(' ').len();
    i.take_from(spaces)
}

/// Skips blanks and commas.
pub(super) fn separator(i: Input<'_>) -> Input<'_> {
    let length = i.fragment().len() - i.fragment().trim_start_matches([' ', ',']).len();
    i.take_from(length)
}

/// Whether nothing but blanks is left.
pub(super) fn at_end(i: Input<'_>) -> bool {
    blank(i).fragment().is_empty()
}

/// A character after blanks.
pub(super) fn symbol<'a>(i: Input<'a>, c: char) -> Option<Input<'a>> {
    let i = blank(i);
    i.fragment()
        .starts_with(c)
        .then(|| i.take_from(c.len_utf8()))
}

/// Characters that end a word.
pub(super) const fn ends_word(c: char) -> bool {
    matches!(c, ' ' | '=' | '(' | ')' | '{' | '}' | ',' | '\'' | '"')
}

/// A word: anything up to a blank or one of `=(){},'"`.
pub(super) fn word(i: Input<'_>) -> Parsed<'_, Name> {
    let start = blank(i);
    let (rest, text) = take_while(|c| !ends_word(c))(start)?;
    if text.fragment().is_empty() {
        return mismatch();
    }
    Ok((
        rest,
        Name {
            text: text.fragment().to_lowercase(),
            span: between(start, rest),
        },
    ))
}

/// A node name: a word, with parentheses glued to it (`Net-(R1-Pad1)`) as part of the name.
pub(super) fn node(i: Input<'_>) -> Parsed<'_, Name> {
    let start = blank(i);
    let (mut rest, _) = word(start)?;
    while rest.fragment().starts_with('(') {
        let Some(length) = balanced(rest.fragment()) else {
            break;
        };
        rest = rest.take_from(length);
        rest = rest.take_from(
            rest.fragment()
                .find(ends_word)
                .unwrap_or(rest.fragment().len()),
        );
    }
    Ok((
        rest,
        Name {
            text: written(start, rest).to_lowercase(),
            span: between(start, rest),
        },
    ))
}

/// The length of a parenthesised text without blanks.
fn balanced(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ' ' => return None,
            _ => {}
        }
        if depth == 0 {
            return Some(at + c.len_utf8());
        }
    }
    None
}

/// A word that is expected; the message says what it should be.
pub(super) fn expect_word<'a>(i: Input<'a>, what: &str) -> Parsed<'a, Name> {
    word(i).map_err(|_| missing(i, what))
}

/// "`what` is missing" at the next place.
pub(super) fn missing(i: Input<'_>, what: &str) -> NomErr<Fault> {
    let message = if at_end(i) {
        format!("{what} is missing")
    } else {
        format!("expected {what}")
    };
    refuse(
        Diagnostic::error("missing", next_word(i), message)
            .label(format!("{what} should stand here")),
    )
}

/// The end of the card.
pub(super) fn end(i: Input<'_>) -> Parsed<'_, ()> {
    let i = blank(i);
    if i.fragment().is_empty() {
        return Ok((i, ()));
    }
    let text = i.fragment().split(' ').next().unwrap_or("");
    let fault = Diagnostic::error("unexpected", next_word(i), format!("unexpected `{text}`"))
        .label("nothing should stand here");
    Err(refuse(if is_unit(text) {
        fault.help(format!(
            "write the unit directly after the number, as in `10{text}`"
        ))
    } else if text == ")" {
        fault.help("there is one closing parenthesis too many")
    } else {
        fault.help("take it out; a comment at the end of a card begins with `;`")
    }))
}
