//! LTspice's schematics (`.asc`): the cards that a sheet stands for.
//!
//! A file is lines of words ([`sheet`]); wires, labels and pins give nets ([`nets`]); a symbol, LTspice's own or of an `.asy` file
//! ([`symbol`]), gives a card ([`cards`]): name, nodes in the order of its pins, then its attributes. A symbol whose sheet stands beside it is
//! a subcircuit. The format: Analog Devices, *LTspice reference*, schematic and symbol files.

mod cards;
mod nets;
mod sheet;
mod symbol;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::include::MAX_BYTES;
use super::lex::{Line, logical};
use super::read::Reader;
use super::{ast, decode};
use crate::diagnostic::{Diagnostic, FileId, Span};
use cards::{Card, Instance};
use nets::Nets;
use sheet::{Place, Placed, Point, Sheet};
use symbol::{Pin, Symbol};

/// Sheets within sheets.
const DEEPEST: usize = 16;
/// What stands for a model of its own where nothing else is said, `D1 a 0 D`.
const OWN_MODELS: [(char, &str); 7] = [
    ('d', "d"),
    ('q', "npn"),
    ('q', "pnp"),
    ('m', "nmos"),
    ('m', "pmos"),
    ('j', "njf"),
    ('j', "pjf"),
];

/// Whether a text is a schematic.
pub(super) fn is_one(text: &str) -> bool {
    let mut lines = text.trim_start().lines();
    let version = lines.next().unwrap_or("").trim().to_ascii_lowercase();
    let is_sheet = |line: &str| line.trim_start().to_ascii_uppercase().starts_with("SHEET ");
    version.starts_with("version ") && lines.next().is_some_and(is_sheet)
}

/// A schematic that is being read.
struct Schematic<'r, 's, 'p> {
    reader: &'r mut Reader<'s>,
    /// Where its symbols are looked for.
    path: &'p Path,
    symbols: BTreeMap<String, Option<Symbol>>,
    /// Sheets that are subcircuits already, by name.
    sheets: BTreeSet<String>,
    /// Lines of the netlist as a whole: libraries of symbols, subcircuits of sheets.
    common: Vec<Line>,
    /// What the outermost sheet shows.
    drawn: ast::Sheet,
    depth: usize,
}

impl Reader<'_> {
    /// Takes the cards of a schematic; what it shows.
    pub(super) fn sheet(&mut self, file: FileId, text: &str, path: &Path) -> ast::Sheet {
        let mut schematic = Schematic {
            reader: self,
            path,
            symbols: BTreeMap::new(),
            sheets: BTreeSet::new(),
            common: Vec::new(),
            drawn: ast::Sheet::default(),
            depth: 0,
        };
        let mut lines = schematic.lines(file, text);
        lines.append(&mut schematic.common);
        lines.extend(own_models(&lines));
        let drawn = std::mem::take(&mut schematic.drawn);
        self.lines(&lines, path);
        drawn
    }
}

/// `.model D D` for models of no card that symbols name by default.
fn own_models(lines: &[Line]) -> Vec<Line> {
    let words = |line: &Line| -> Vec<String> {
        let text = line.text.to_lowercase();
        text.split_whitespace().map(str::to_owned).collect()
    };
    let cards: Vec<(Vec<String>, &Line)> = lines.iter().map(|line| (words(line), line)).collect();
    let model = |&(letter, model): &(char, &str)| {
        let is_model = |card: &&(Vec<String>, &Line)| {
            card.0.len() > 1 && card.0[0] == ".model" && card.0[1] == model
        };
        let is_user = |card: &&(Vec<String>, &Line)| {
            let named = card.0.iter().skip(3).any(|word| word == model);
            named && card.0[0].starts_with(letter)
        };
        let (_, user) = cards.iter().find(is_user)?;
        if cards.iter().any(|card| is_model(&card)) {
            return None;
        }
        let mut card = Card::new(user.file, place_of(user));
        card.said(&format!(".model {model} {model}"));
        Some(card.line())
    };
    OWN_MODELS.iter().filter_map(model).collect()
}

/// What is said of a pin of a part that touches nothing.
fn open_pin(
    (part, pin, at): (&str, &Pin, Point),
    wires: &[(Point, Point)],
    span: Span,
) -> Diagnostic {
    /// Two steps of LTspice's grid.
    const NEAR: i64 = 32;
    let pin = match &pin.name[..] {
        "" => pin.order.to_string(),
        name => format!("`{name}`"),
    };
    let (x, y) = at;
    let mut ends = wires.iter().flat_map(|(a, b)| [*a, *b]);
    let near = ends.find(|end| (end.0 - x).abs() <= NEAR && (end.1 - y).abs() <= NEAR);
    let note = Diagnostic::note(
        "open-pin",
        span,
        format!("pin {pin} of `{part}` at ({x}, {y}) touches no wire"),
    );
    note.label("of this part").help(match near {
        Some((x, y)) => format!("the wire that ends at ({x}, {y}) misses it"),
        None => "draw a wire to it; an open end that is meant does no harm".into(),
    })
}

fn place_of(line: &Line) -> Place {
    let span = line.span();
    span.start..span.end
}

impl Schematic<'_, '_, '_> {
    fn tell(&mut self, finding: Diagnostic) {
        self.reader.tell(finding);
    }

    /// The cards of one sheet.
    fn lines(&mut self, file: FileId, text: &str) -> Vec<Line> {
        let span = |place: &Place| Span {
            file,
            start: place.start,
            end: place.end,
        };
        let sheet = Sheet::read(text);
        for place in &sheet.faults {
            self.tell(
                Diagnostic::error("bad-sheet", span(place), "this is no line of a schematic")
                    .label("cannot be read")
                    .help("save the schematic again with LTspice"),
            );
        }
        let mut parts: Vec<(&Placed, Symbol)> = Vec::new();
        for placed in &sheet.symbols {
            match self.symbol(&placed.kind) {
                Some(symbol) => parts.push((placed, symbol)),
                None => {
                    let kind = &placed.kind;
                    let message = format!("there is no symbol `{kind}`");
                    let help = format!(
                        "put {}.asy beside the schematic, or name its folder by `--lib DIR`",
                        leaf(kind)
                    );
                    self.tell(
                        Diagnostic::error("unknown-symbol", span(&placed.place), message)
                            .label("neither of LTspice's that are known nor a file")
                            .help(help),
                    );
                }
            }
        }
        let pins: Vec<Point> = parts
            .iter()
            .flat_map(|(placed, symbol)| symbol.pins.iter().map(|pin| at(placed, pin)))
            .collect();
        let mut told = Vec::new();
        let mut nets = Nets::of(&sheet.wires, &sheet.flags, &pins, |flag, first| {
            let message = format!("`{}` and `{first}` are one net", flag.name);
            told.push(
                Diagnostic::note("one-net", span(&flag.place), message)
                    .label(format!("called `{first}` in results")),
            );
        });
        told.into_iter().for_each(|finding| self.tell(finding));
        let mut lines = Vec::new();
        let mut shown = ast::Sheet {
            wires: sheet.wires.clone(),
            labels: (sheet.flags.iter())
                .map(|flag| (flag.at, nets.name(flag.at)))
                .collect(),
            symbols: Vec::new(),
        };
        for (placed, symbol) in &parts {
            // Of an `A` device they are functions that are not used.
            let may_be_open = symbol.prefix == Some('a');
            let mut open = Vec::new();
            let nodes: Vec<(usize, Option<String>)> = symbol
                .pins
                .iter()
                .map(|pin| {
                    let at = at(placed, pin);
                    let is_open = nets.is_open(at);
                    if is_open && !may_be_open {
                        open.push((pin, at));
                    }
                    (pin.order, (!is_open || !may_be_open).then(|| nets.name(at)))
                })
                .collect();
            for (pin, at) in open {
                let name = placed.attribute("instname");
                let name = name.map_or(&placed.kind[..], |place| &text[place.clone()]);
                self.tell(open_pin((name, pin, at), &sheet.wires, span(&placed.place)));
            }
            let instance = Instance {
                file,
                text,
                placed,
                symbol,
            };
            match instance.card(&nodes) {
                Ok(line) => {
                    shown.symbols.push(shown_symbol(&line, placed, symbol));
                    lines.push(line);
                }
                Err(finding) => self.tell(*finding),
            }
            if let Some(library) = instance.library() {
                self.library(Card::new(file, placed.place.clone()), library);
            }
        }
        if self.depth == 0 {
            self.drawn = shown;
        }
        for place in &sheet.directives {
            // Byte for byte, so that places stay.
            let content = text[place.clone()].replace("\\n", " \n");
            let (own, orphans) = logical(file, &content, 0);
            for orphan in orphans {
                let (start, end) = (place.start + orphan.start, place.start + orphan.end);
                let finding = Diagnostic::error(
                    "unexpected",
                    span(&(start..end)),
                    "there is no card to continue",
                );
                self.tell(finding.label("a line that begins with `+` continues the card above"));
            }
            lines.extend(own.into_iter().map(|line| Line {
                start: place.start + line.start,
                ..line
            }));
        }
        lines
    }

    /// Asks for the library that a symbol's model stands in, once.
    fn library(&mut self, mut card: Card, library: &str) {
        card.said(&format!(".lib {library}"));
        let line = card.line();
        if !self.common.iter().any(|known| known.text == line.text) {
            self.common.push(line);
        }
    }

    /// A symbol by its name on a sheet: of a file in a folder of the schematic or of the libraries, else one that LTspice has.
    fn symbol(&mut self, kind: &str) -> Option<Symbol> {
        if let Some(known) = self.symbols.get(kind) {
            return known.clone();
        }
        let found = self.symbol_file(kind);
        let found = found.or_else(|| Symbol::built_in(&leaf(kind).to_lowercase()));
        self.symbols.insert(kind.to_owned(), found.clone());
        found
    }

    fn symbol_file(&mut self, kind: &str) -> Option<Symbol> {
        // A blank is written `\ `.
        let slashes = kind.replace("\\ ", " ").replace('\\', "/");
        let mut names = vec![format!("{slashes}.asy")];
        if slashes.contains('/') {
            names.push(format!("{}.asy", leaf(kind)));
        }
        let found = names
            .iter()
            .find_map(|name| self.reader.find(name, self.path).ok().flatten())?;
        let mut symbol = Symbol::read(&decode::decode(&found.bytes));
        if symbol.prefix.is_none() {
            let name = leaf(kind).to_lowercase();
            self.subcircuit(&name, &slashes, &symbol.pins)?;
            symbol.attributes = vec![("value".into(), name)];
        }
        Some(symbol)
    }

    /// Makes a subcircuit of the sheet that a block stands for; `None` where there is none.
    fn subcircuit(&mut self, name: &str, kind: &str, pins: &[Pin]) -> Option<()> {
        if self.sheets.contains(name) {
            return Some(());
        }
        let found = self
            .reader
            .find(&format!("{kind}.asc"), self.path)
            .ok()
            .flatten()?;
        if self.depth >= DEEPEST || self.reader.bytes + found.bytes.len() > MAX_BYTES {
            return None;
        }
        self.sheets.insert(name.to_owned());
        self.reader.bytes += found.bytes.len();
        let text = decode::decode(&found.bytes);
        if !is_one(&text) {
            return None;
        }
        let file = self
            .reader
            .sources
            .add(found.path.to_string_lossy(), text.clone());
        self.depth += 1;
        let lines = self.lines(file, &text);
        self.depth -= 1;
        let first = text.lines().next().unwrap_or("").len();
        let mut head = Card::new(file, 0..first);
        let ports: Vec<&str> = pins.iter().map(|pin| pin.name.as_str()).collect();
        head.said(&format!(".subckt {name} {}", ports.join(" ")));
        let mut end = Card::new(file, 0..first);
        end.said(".ends");
        self.common.push(head.line());
        self.common.extend(lines);
        self.common.push(end.line());
        Some(())
    }
}

/// What a reader sees of a symbol that stands for a card.
fn shown_symbol(card: &Line, placed: &Placed, symbol: &Symbol) -> ast::PlacedSymbol {
    let name = card.text.split_whitespace().next().unwrap_or("");
    let mut pins: Vec<&Pin> = symbol.pins.iter().collect();
    pins.sort_by_key(|pin| pin.order);
    ast::PlacedSymbol {
        name: name.to_lowercase(),
        pins: (pins.into_iter().map(|pin| (pin.order, at(placed, pin)))).collect(),
    }
}

/// The last part of a symbol's name.
fn leaf(kind: &str) -> &str {
    kind.rsplit(['\\', '/']).next().unwrap_or(kind)
}

/// Where a pin of a placed symbol is.
fn at(placed: &Placed, pin: &Pin) -> Point {
    let (x, y) = placed.orientation.apply(pin.at);
    (placed.at.0 + x, placed.at.1 + y)
}
