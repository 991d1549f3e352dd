//! Dot cards: one parser each; what is only recognised is named, so that nothing is skipped in silence.

mod define;
pub(in crate::netlist) mod measure;
mod output;
mod sweep;

use nom::Input as _;

use define::{func, model, params, subckt};

use crate::diagnostic::{Diagnostic, Span};
use crate::netlist::ast::{
    Assign, Expr, Name, Points, Signal, Statement, Sweep, Target, Thermal, Tran,
};
use crate::netlist::lex::{
    Fault, Input, Parsed, ahead, at_end, between, blank, end, missing, node, refuse, separator,
    symbol, tell, word,
};
use crate::netlist::suggest::nearest;
use crate::netlist::{expr, operand};

/// What a dot card means to the reader.
pub(in crate::netlist) enum Dot {
    /// A card that stands in the netlist.
    Statement(Box<Statement>),
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
    /// `.options`.
    Options(Options),
    /// A card that does not change the transient and is skipped with a note.
    Skipped,
    /// A card that asks for nothing (`.backanno`, `.width`).
    Nothing,
}

/// What `.options` says, and whether there is more, which is skipped.
#[derive(Debug, Default)]
pub(in crate::netlist) struct Options {
    pub(in crate::netlist) read: Vec<Statement>,
    pub(in crate::netlist) others: bool,
}

impl Dot {
    /// A card that stands in the netlist.
    pub(in crate::netlist) fn statement(statement: Statement) -> Self {
        Self::Statement(Box::new(statement))
    }
}

/// A file name as written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::netlist) struct Path {
    /// The whole text, which may be a path with blanks.
    pub(in crate::netlist) whole: String,
    /// The text up to the last word, and that word as a section.
    pub(in crate::netlist) section: Option<(String, String)>,
    /// Where it stands.
    pub(in crate::netlist) span: Span,
}

/// All directives, for "did you mean".
pub(in crate::netlist) const DIRECTIVES: [&str; 28] = [
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
    ".temp",
    ".thermal",
    ".tran",
];

/// A card that begins with a dot.
pub(in crate::netlist) fn card(i: Input<'_>) -> Parsed<'_, Dot> {
    let start = blank(i);
    let (rest, name) = word(start)?;
    match name.text.as_str() {
        ".param" | ".params" | ".parameter" | ".csparam" | ".global_param" => params(rest, &name),
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
            tran(start, rest, false).map(|(rest, t)| (rest, Dot::statement(Statement::Tran(t))))
        }
        ".op" => Ok((skip(rest), Dot::statement(Statement::Analysis(name.span)))),
        ".ic" => initial(rest, Statement::Ic),
        ".nodeset" => initial(rest, Statement::Nodeset),
        ".temp" => temperature(rest),
        ".thermal" => thermal(rest),
        ".option" | ".options" | ".opt" => Ok((skip(rest), options(rest))),
        ".global" => global(rest),
        ".save" | ".probe" => save(rest),
        ".print" | ".plot" => output::save(rest, true),
        ".meas" | ".measure" => measure::meas(start, rest, false),
        ".four" | ".fourier" => measure::four(start, rest),
        ".step" => sweep::step(rest),
        ".dc" => sweep::dc(rest),
        ".ac" => Ok(sweep::ac(start, rest)),
        ".pss" => Ok(sweep::pss(start, rest)),
        ".noise" | ".tf" | ".sens" | ".pz" | ".disto" | ".sp" | ".net" | ".savebias"
        | ".loadbias" | ".wave" | ".machine" | ".endmachine" | ".ferret" | ".data" | ".enddata" => {
            Ok((skip(rest), Dot::Skipped))
        }
        ".backanno" | ".width" | ".protect" | ".unprotect" | ".prot" | ".unprot" | ".endc"
        | ".newpage" => Ok((skip(rest), Dot::Nothing)),
        _ => {
            let fault = Diagnostic::error(
                "unknown-directive",
                name.span,
                format!("unknown directive `{}`", name.text),
            )
            .label("not a directive");
            let near = nearest(&name.text, DIRECTIVES);
            Err(refuse(match near {
                Some(near) => fault.help(format!("did you mean `{near}`?")),
                None => fault.help(
                    "`docs/netlist.md` lists the directives; a comment begins with `*` or `;`",
                ),
            }))
        }
    }
}

/// Whether a card asks for a measurement, without which a run is worth having too.
pub(in crate::netlist) fn is_measurement(card: &str) -> bool {
    let name = card.split_whitespace().next().unwrap_or("").to_lowercase();
    matches!(name.as_str(), ".meas" | ".measure" | ".four" | ".fourier")
}

pub(in crate::netlist) fn skip(i: Input<'_>) -> Input<'_> {
    i.take_from(i.fragment().len())
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
pub(in crate::netlist) fn tran<'a>(
    start: Input<'a>,
    i: Input<'a>,
    command: bool,
) -> Parsed<'a, Tran> {
    let (mut uic, mut startup, mut steady) = (false, false, false);
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
                "steady" => steady = true,
                "nodiscard" | "step" => tell(
                    at,
                    Diagnostic::warning(
                        "ignored",
                        name.span,
                        format!("`{}` is ignored", name.text),
                    )
                    .label("not supported"),
                ),
                other => {
                    if let Some(meant) = nearest(other, ["uic", "startup", "steady"]) {
                        let message = format!("`{other}` is no option of .tran");
                        return Err(refuse(
                            Diagnostic::error("unexpected", name.span, message)
                                .label("unknown option")
                                .help(format!("did you mean `{meant}`?")),
                        ));
                    }
                    let (rest, value) = operand::value(at)?;
                    args.push(value);
                    at = rest;
                    continue;
                }
            }
            at = rest;
            continue;
        }
        let (rest, value) = operand::value(at).map_err(|e| match e {
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
            steady,
            command,
            span,
        },
    ))
}

/// `.save`, `.probe`, and the command.
pub(in crate::netlist) fn save(i: Input<'_>) -> Parsed<'_, Dot> {
    output::save(i, false)
}

/// `.ic v(n)=1 v(a,b)=2 i(l1)=3`, `.nodeset v(n)=1`.
fn initial(i: Input<'_>, statement: fn(Vec<(Signal, Expr)>) -> Statement) -> Parsed<'_, Dot> {
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
        let (rest, value) = operand::value(rest).map_err(|e| match e {
            nom::Err::Error(_) => missing(rest, "a value"),
            e => e,
        })?;
        all.push((signal, value));
        at = separator(rest);
    }
    Ok((at, Dot::statement(statement(all))))
}

/// `v(…)` or `i(…)`.
pub(in crate::netlist) fn signal(i: Input<'_>) -> Parsed<'_, Signal> {
    let (rest, name) = word(i)?;
    match (name.text.as_str(), symbol(rest, '(')) {
        ("v" | "i", Some(open)) => expr::signal_arguments(open, &name),
        _ => Err(nom::Err::Error(Fault::Mismatch)),
    }
}

/// `.temp t`, or several temperatures, which are a sweep as in LTspice.
fn temperature(i: Input<'_>) -> Parsed<'_, Dot> {
    let start = separator(i);
    let mut values = Vec::new();
    let mut at = start;
    while !at_end(at) {
        let (rest, value) = operand::value(at).map_err(|e| match e {
            nom::Err::Error(_) => missing(at, "a temperature"),
            e => e,
        })?;
        values.push(value);
        at = separator(rest);
    }
    let span = between(start, at);
    let statement = match values.len() {
        0 => return Err(missing(at, "a temperature")),
        1 => values.pop().map(Statement::Temperature),
        _ => Some(Statement::Step(Box::new(Sweep {
            target: Target::Temperature(span),
            points: Points::List(values),
            span,
        }))),
    };
    Ok((at, statement.map_or(Dot::Nothing, Dot::statement)))
}

/// Options of LTspice's that say how its files and pictures look; nearly every netlist of its has the first.
const OF_FILES: [&str; 8] = [
    "plotwinsize",
    "numdgt",
    "measdgt",
    "nomarch",
    "plotreltol",
    "plotvntol",
    "plotabstol",
    "fastaccess",
];

/// Options that change what ngspice and LTspice give and are not carried out, and what they mean.
const CHANGING: [(&str, &str); 7] = [
    ("rshunt", "a resistance from every node to ground"),
    ("gshunt", "a conductance from every node to ground"),
    ("cshunt", "a capacitance from every node to ground"),
    ("scale", "the unit of sizes of transistors"),
    ("defl", "the length of transistors without `l`"),
    ("defw", "the width of transistors without `w`"),
    ("ramptime", "sources that ramp up"),
];

/// The warning of an option among [`CHANGING`].
fn left_out(option: &Name) -> Option<Diagnostic> {
    let (_, meaning) = CHANGING.iter().find(|(name, _)| option.text == *name)?;
    let message = format!(
        "the result is without `{}` of `.options`: {meaning}",
        option.text
    );
    Some(Diagnostic::warning("ignored", option.span, message).label("not carried out"))
}

/// The options that matter among names with and without values.
pub(in crate::netlist) fn options(i: Input<'_>) -> Dot {
    let mut options = Options::default();
    let mut at = separator(i);
    while let Ok((rest, name)) = word(at) {
        at = separator(rest);
        let value = match symbol(rest, '=') {
            Some(rest) => match operand::lenient(rest) {
                Ok((rest, value)) => {
                    at = separator(rest);
                    Some(value)
                }
                Err(_) => {
                    options.others = true;
                    return Dot::Options(options);
                }
            },
            None => None,
        };
        match (name.text.as_str(), value) {
            ("temp", Some(value)) => options.read.push(Statement::Temperature(value)),
            ("tnom", Some(value)) => options.read.push(Statement::Nominal(value)),
            ("gmin", Some(value)) => options.read.push(Statement::Gmin(value)),
            (other, _) => match left_out(&name) {
                Some(warning) => tell(i, warning),
                None => options.others |= !OF_FILES.contains(&other),
            },
        }
    }
    options.others |= !at_end(at);
    Dot::Options(options)
}

/// `.thermal node device …`.
fn thermal(i: Input<'_>) -> Parsed<'_, Dot> {
    let Ok((mut at, node_name)) = node(separator(i)) else {
        return Err(missing(i, "a node and the devices whose heat goes there"));
    };
    let mut devices = Vec::new();
    while let Ok((rest, name)) = word(separator(at)) {
        devices.push(name);
        at = rest;
    }
    if devices.is_empty() {
        return Err(missing(at, "the devices whose heat goes there"));
    }
    let (at, ()) = end(at)?;
    let statement = Statement::Thermal(Thermal {
        node: node_name,
        devices,
    });
    Ok((at, Dot::statement(statement)))
}

fn global(i: Input<'_>) -> Parsed<'_, Dot> {
    let mut names = Vec::new();
    let mut at = separator(i);
    while let Ok((rest, name)) = node(at) {
        names.push(name);
        at = separator(rest);
    }
    let (at, ()) = end(at)?;
    Ok((at, Dot::statement(Statement::Global(names))))
}
