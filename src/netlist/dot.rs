//! Dot cards: one parser each; what is only recognised is named, so that nothing is skipped in silence.

use nom::Input as _;

use super::ast::{Assign, Expr, Func, Model, Name, Signal, Statement, Tran, Wanted};
use super::card::{assign, assigns};
use super::expr;
use super::lex::{
    Fault, Input, Parsed, ahead, at_end, between, blank, end, expect_word, missing, node, refuse,
    separator, symbol, tell, word,
};
use crate::diagnostic::{Diagnostic, Span};

/// What a dot card means to the reader.
pub(super) enum Dot {
    /// A card that stands in the netlist.
    Statement(Statement),
    /// `.subckt name nodes params`.
    Subckt(Name, Vec<Name>, Vec<Assign>),
    /// `.ends [name]`.
    Ends(Option<Name>),
    /// `.if (condition)`.
    If(Expr),
    /// `.elseif (condition)`.
    ElseIf(Expr),
    /// `.else`.
    Else,
    /// `.endif`.
    EndIf,
    /// `.include path`.
    Include(Path),
    /// `.lib path [section]`, or the start of a section of a library.
    Lib(Path),
    /// `.endl`.
    EndLib,
    /// `.control`.
    Control,
    /// `.end`.
    End,
    /// `.title text`.
    Title(String),
    /// A card that does not change the transient and is skipped with a note.
    Skipped,
    /// A card that asks for nothing (`.backanno`, `.width`).
    Nothing,
}

/// A file name as written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Path {
    /// The whole text, which may be a path with blanks.
    pub(super) whole: String,
    /// The text up to the last word, and that word as a section.
    pub(super) section: Option<(String, String)>,
    /// Where it stands.
    pub(super) span: Span,
}

/// All directives, for "did you mean".
pub(super) const DIRECTIVES: [&str; 26] = [
    ".ac",
    ".backanno",
    ".control",
    ".dc",
    ".else",
    ".elseif",
    ".end",
    ".endif",
    ".ends",
    ".four",
    ".func",
    ".global",
    ".ic",
    ".if",
    ".include",
    ".lib",
    ".meas",
    ".model",
    ".nodeset",
    ".op",
    ".options",
    ".param",
    ".save",
    ".step",
    ".subckt",
    ".tran",
];

/// A card that begins with a dot.
pub(super) fn card(i: Input<'_>) -> Parsed<'_, Dot> {
    let start = blank(i);
    let (rest, name) = word(start)?;
    match name.text.as_str() {
        ".param" | ".params" | ".parameter" | ".csparam" => params(rest, &name),
        ".func" | ".function" => func(rest),
        ".model" => model(rest),
        ".subckt" | ".macro" => subckt(rest),
        ".ends" | ".eom" => Ok((skip(rest), Dot::Ends(word(rest).ok().map(|(_, name)| name)))),
        ".if" => condition(rest).map(|(rest, e)| (rest, Dot::If(e))),
        ".elseif" | ".elif" => condition(rest).map(|(rest, e)| (rest, Dot::ElseIf(e))),
        ".else" => Ok((skip(rest), Dot::Else)),
        ".endif" => Ok((skip(rest), Dot::EndIf)),
        ".include" | ".inc" | ".incl" => path(rest).map(|(rest, path)| (rest, Dot::Include(path))),
        ".lib" => path(rest).map(|(rest, path)| (rest, Dot::Lib(path))),
        ".endl" => Ok((skip(rest), Dot::EndLib)),
        ".control" => Ok((skip(rest), Dot::Control)),
        ".end" => Ok((skip(rest), Dot::End)),
        ".title" => Ok((skip(rest), Dot::Title(rest.fragment().trim().to_string()))),
        ".tran" => {
            tran(start, rest, false).map(|(rest, t)| (rest, Dot::Statement(Statement::Tran(t))))
        }
        ".op" => Ok((skip(rest), Dot::Statement(Statement::Analysis(name.span)))),
        ".ic" => initial(rest),
        ".global" => global(rest),
        ".save" | ".probe" => save(rest, false),
        ".print" | ".plot" => save(rest, true),
        ".ac" | ".dc" | ".noise" | ".tf" | ".four" | ".fourier" | ".meas" | ".measure"
        | ".option" | ".options" | ".opt" | ".temp" | ".nodeset" | ".sens" | ".pz" | ".disto"
        | ".sp" | ".pss" | ".net" | ".savebias" | ".loadbias" | ".machine" | ".endmachine"
        | ".ferret" | ".data" | ".enddata" | ".step" => Ok((skip(rest), Dot::Skipped)),
        ".backanno" | ".wave" | ".width" | ".protect" | ".unprotect" | ".prot" | ".unprot"
        | ".endc" | ".newpage" => Ok((skip(rest), Dot::Nothing)),
        _ => {
            let fault = Diagnostic::error(
                "unknown-directive",
                name.span,
                format!("unknown directive `{}`", name.text),
            )
            .label("not a directive");
            let near = super::suggest::nearest(&name.text, DIRECTIVES);
            Err(refuse(match near {
                Some(near) => fault.help(format!("did you mean `{near}`?")),
                None => fault.help(
                    "`docs/netlist.md` lists the directives; a comment begins with `*` or `;`",
                ),
            }))
        }
    }
}

fn skip(i: Input<'_>) -> Input<'_> {
    i.take_from(i.fragment().len())
}

/// `.param a = 1 b={2*a} f(x)={x^2}`.
fn params<'a>(i: Input<'a>, directive: &Name) -> Parsed<'a, Dot> {
    let mut all = Vec::new();
    let mut at = separator(i);
    while !at_end(at) {
        let (rest, name) = expect_word(at, "`name=value`")?;
        if symbol(rest, '(').is_some() && all.is_empty() {
            return func(at);
        }
        let Some(rest) = symbol(rest, '=') else {
            let fault = Diagnostic::error(
                "missing",
                name.span,
                format!("`{}` has no value", name.text),
            );
            return Err(refuse(
                fault.label(format!("expected `{}=value`", name.text)),
            ));
        };
        let (rest, value) = expr::expr(rest)?;
        all.push(Assign {
            name,
            value: Some(value),
        });
        at = separator(rest);
    }
    if all.is_empty() {
        return Err(missing(
            at,
            &format!("`name=value` after `{}`", directive.text),
        ));
    }
    Ok((at, Dot::Statement(Statement::Param(all))))
}

/// `.func f(x,y) {…}`, `.func f(x) = …`.
fn func(i: Input<'_>) -> Parsed<'_, Dot> {
    let (rest, name) = expect_word(i, "the name of the function")?;
    let Some(mut at) = symbol(rest, '(') else {
        return Err(missing(rest, "`(` and the arguments"));
    };
    let mut args = Vec::new();
    let rest = loop {
        at = separator(at);
        if let Some(rest) = symbol(at, ')') {
            break rest;
        }
        let (rest, arg) = expect_word(at, "an argument or `)`")?;
        args.push(arg);
        at = rest;
    };
    let (rest, body) = expr::expr(symbol(rest, '=').unwrap_or(rest))?;
    let (rest, ()) = end(rest)?;
    Ok((
        rest,
        Dot::Statement(Statement::Func(Func { name, args, body })),
    ))
}

/// `.model name type (a=1 b=2 flag)`, parentheses and commas optional.
fn model(i: Input<'_>) -> Parsed<'_, Dot> {
    let (rest, name) = expect_word(i, "the name of the model")?;
    let (mut rest, mut kind) = expect_word(rest, "the type of the model")?;
    let mut base = None;
    if let Some(of) = kind.text.strip_prefix("ako:") {
        if of.is_empty() {
            let (next, name) = expect_word(rest, "the model to extend")?;
            (rest, base) = (next, Some(name));
        } else {
            base = Some(Name {
                text: of.to_string(),
                span: kind.span,
            });
        }
        kind = Name {
            text: String::new(),
            span: kind.span,
        };
        if let Ok((next, name)) = word(rest)
            && symbol(next, '=').is_none()
        {
            (rest, kind) = (next, name);
        }
    }
    let mut params = Vec::new();
    let mut depth = 0_i64;
    let mut at = rest;
    loop {
        at = separator(at);
        if let Some(next) = symbol(at, '(') {
            depth += 1;
            at = next;
        } else if let Some(next) = symbol(at, ')') {
            depth -= 1;
            at = next;
        } else if at_end(at) {
            break;
        } else {
            let (next, one) = assign(at).map_err(|e| match e {
                nom::Err::Error(_) => missing(at, "`name=value`"),
                e => e,
            })?;
            params.push(one);
            at = next;
        }
    }
    if depth != 0 {
        let (what, help) = if depth > 0 {
            ("unclosed `(`", "`)`")
        } else {
            ("a `)` too many", "nothing")
        };
        tell(
            at,
            Diagnostic::warning(
                "unbalanced",
                between(blank(i), at),
                format!("model `{}` has {what}", name.text),
            )
            .label("read as if it were balanced")
            .help(format!("the card should end with {help}")),
        );
    }
    Ok((
        at,
        Dot::Statement(Statement::Model(Model {
            name,
            kind,
            base,
            params,
        })),
    ))
}

/// `.subckt name nodes [params:] a=1 …`.
fn subckt(i: Input<'_>) -> Parsed<'_, Dot> {
    let (mut at, name) = expect_word(i, "the name of the subcircuit")?;
    let mut nodes = Vec::new();
    loop {
        at = separator(at);
        if let Some(rest) = symbol(at, '(').or_else(|| symbol(at, ')')) {
            at = rest;
            continue;
        }
        if at_end(at) {
            break;
        }
        let (rest, one) = node(at).map_err(|_| missing(at, "a node or `name=value`"))?;
        if symbol(rest, '=').is_some() {
            break;
        }
        at = rest;
        if matches!(one.text.as_str(), "params:" | "param:") {
            break;
        }
        nodes.push(one);
    }
    let (at, params) = assigns(at)?;
    let (at, ()) = end(at)?;
    Ok((at, Dot::Subckt(name, nodes, params)))
}

/// `(a==1)`, `{a>0}`.
fn condition(i: Input<'_>) -> Parsed<'_, Expr> {
    let (rest, e) = expr::expr(i)?;
    let (rest, ()) = end(rest)?;
    Ok((rest, e))
}

/// A quoted path, or the rest of the card.
fn path(i: Input<'_>) -> Parsed<'_, Path> {
    let start = blank(i);
    let text = start.fragment().trim_end();
    let quote = text.chars().next().filter(|c| matches!(c, '"' | '\''));
    let (whole, section) = match quote.and_then(|q| text[1..].split_once(q)) {
        Some((inside, after)) => {
            let section = after.trim();
            (
                inside.to_string(),
                (!section.is_empty()).then(|| (inside.to_string(), section.to_lowercase())),
            )
        }
        None => {
            let split = text.rsplit_once(' ');
            (
                text.to_string(),
                split.map(|(path, section)| (path.trim_end().to_string(), section.to_lowercase())),
            )
        }
    };
    if whole.is_empty() {
        return Err(missing(start, "a file name"));
    }
    Ok((
        skip(i),
        Path {
            whole,
            section,
            span: ahead(start, text.len()),
        },
    ))
}

/// `.tran tstep tstop [tstart [tmax]] [uic]`, `.tran tstop`, and the command without its dot.
pub(super) fn tran<'a>(start: Input<'a>, i: Input<'a>, command: bool) -> Parsed<'a, Tran> {
    let (mut uic, mut startup) = (false, false);
    let mut args = Vec::new();
    let mut at = i;
    loop {
        at = separator(at);
        if at_end(at) {
            break;
        }
        if let Ok((rest, name)) = word(at) {
            match name.text.as_str() {
                "uic" => uic = true,
                "startup" => startup = true,
                "steady" | "nodiscard" | "step" => tell(
                    at,
                    Diagnostic::warning(
                        "ignored",
                        name.span,
                        format!("`{}` is ignored", name.text),
                    )
                    .label("not supported"),
                ),
                _ => {
                    let (rest, value) = expr::value(at)?;
                    args.push(value);
                    at = rest;
                    continue;
                }
            }
            at = rest;
            continue;
        }
        let (rest, value) = expr::value(at).map_err(|e| match e {
            nom::Err::Error(_) => missing(at, "a time"),
            e => e,
        })?;
        args.push(value);
        at = rest;
    }
    let span = between(start, at);
    let span = Span {
        end: span.start + start.fragment()[..span.end - span.start].trim_end().len(),
        ..span
    };
    if args.is_empty() {
        return Err(missing(at, "the stop time"));
    }
    if let Some(extra) = args.get(4) {
        let fault = Diagnostic::error("unexpected", extra.span, ".tran takes at most four times");
        return Err(refuse(
            fault
                .label("one too many")
                .help("write `.tran tstep tstop tstart tmax`"),
        ));
    }
    Ok((
        at,
        Tran {
            args,
            uic,
            startup,
            command,
            span,
        },
    ))
}

/// `.ic v(n)=1 v(a,b)=2 i(l1)=3`.
fn initial(i: Input<'_>) -> Parsed<'_, Dot> {
    let mut all = Vec::new();
    let mut at = separator(i);
    while !at_end(at) {
        let (rest, signal) = signal(at).map_err(|e| match e {
            nom::Err::Error(_) => missing(at, "`v(node)=value` or `i(inductor)=value`"),
            e => e,
        })?;
        let Some(rest) = symbol(rest, '=') else {
            return Err(missing(rest, "`=` and a value"));
        };
        let (rest, value) = expr::value(rest).map_err(|e| match e {
            nom::Err::Error(_) => missing(rest, "a value"),
            e => e,
        })?;
        all.push((signal, value));
        at = separator(rest);
    }
    Ok((at, Dot::Statement(Statement::Ic(all))))
}

/// `v(…)` or `i(…)`.
fn signal(i: Input<'_>) -> Parsed<'_, Signal> {
    let (rest, name) = word(i)?;
    match (name.text.as_str(), symbol(rest, '(')) {
        ("v" | "i", Some(open)) => expr::signal_arguments(open, &name),
        _ => Err(nom::Err::Error(Fault::Mismatch)),
    }
}

fn global(i: Input<'_>) -> Parsed<'_, Dot> {
    let mut names = Vec::new();
    let mut at = separator(i);
    while let Ok((rest, name)) = node(at) {
        names.push(name);
        at = separator(rest);
    }
    let (at, ()) = end(at)?;
    Ok((at, Dot::Statement(Statement::Global(names))))
}

/// Analyses that `.print` and `.plot` may name.
const ANALYSES: [&str; 11] = [
    "tran", "ac", "dc", "op", "noise", "four", "disto", "tf", "pz", "sp", "sens",
];

/// `.save v(a) i(d1) out @d1[i] all`, `.print tran …`.
fn save(i: Input<'_>, analysis: bool) -> Parsed<'_, Dot> {
    let mut at = separator(i);
    if let Ok((rest, name)) = word(at)
        && ANALYSES.contains(&name.text.as_str())
        && symbol(rest, '(').is_none()
        && (analysis || name.text == "tran")
    {
        if name.text != "tran" {
            return Ok((skip(at), Dot::Skipped));
        }
        at = separator(rest);
    }
    let mut all = Vec::new();
    while !at_end(at) {
        let (rest, one) = wanted(at)?;
        all.extend(one);
        at = separator(rest);
    }
    Ok((at, Dot::Statement(Statement::Save(all))))
}

/// One thing to print; `None` for the limits of a plot.
fn wanted(at: Input<'_>) -> Parsed<'_, Option<Wanted>> {
    let length = spaceless(at.fragment());
    let whole = at.take_from(length);
    let span = ahead(at, length);
    let text = at.fragment()[..length].to_lowercase();
    if text.starts_with('(') {
        return Ok((whole, None));
    }
    let other = Ok((
        whole,
        Some(Wanted::Other(Name {
            text: text.clone(),
            span,
        })),
    ));
    if matches!(
        text.as_str(),
        "all" | "allv" | "alli" | "v(*)" | "i(*)" | "*"
    ) {
        return Ok((whole, Some(Wanted::All(span))));
    }
    match signal(at) {
        Ok((rest, signal)) => {
            let follows = rest.fragment().chars().next();
            if follows.is_some_and(|c| !matches!(c, ' ' | ',' | '(')) {
                other
            } else {
                Ok((rest, Some(Wanted::Signal(signal))))
            }
        }
        Err(nom::Err::Error(_)) => match word(at) {
            Ok((rest, name)) if between(at, rest) == span => Ok((rest, Some(Wanted::Bare(name)))),
            _ if length > 0 => other,
            _ => Err(missing(at, "something to print")),
        },
        Err(e) => Err(e),
    }
}

/// The length up to a blank or comma outside parentheses and braces.
fn spaceless(text: &str) -> usize {
    let mut depth = 0_i64;
    for (at, c) in text.char_indices() {
        match c {
            '(' | '{' => depth += 1,
            ')' | '}' => depth -= 1,
            ' ' | ',' if depth <= 0 => return at,
            _ => {}
        }
    }
    text.len()
}
