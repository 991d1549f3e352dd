//! A placed symbol as a card: `name nodes spicemodel value value2 spiceline spiceline2`.

use super::super::lex::{Line, Piece};
use super::leaf;
use super::sheet::{Place, Placed};
use super::symbol::Symbol;
use crate::diagnostic::{Diagnostic, FileId, Span};

/// A card that is put together.
pub(super) struct Card {
    line: Line,
    /// What is said of pieces that stand nowhere.
    whole: Place,
}

impl Card {
    /// An empty card that is said of this place.
    pub(super) fn new(file: FileId, whole: Place) -> Self {
        Self {
            line: Line {
                file,
                start: whole.start,
                text: String::new(),
                pieces: Vec::new(),
            },
            whole,
        }
    }

    /// Adds words that stand nowhere.
    pub(super) fn said(&mut self, words: &str) {
        self.push(words, self.whole.clone(), false);
    }

    /// Adds what stands at a place.
    fn copied(&mut self, text: &str, place: &Place) {
        self.push(&text[place.clone()], place.clone(), true);
    }

    fn push(&mut self, words: &str, place: Place, copied: bool) {
        if !self.line.text.is_empty() {
            self.line.text.push(' ');
        }
        self.line.pieces.push(Piece {
            at: self.line.text.len(),
            place,
            copied,
        });
        let blank = |c: char| {
            if c.is_whitespace() || c.is_control() {
                ' '
            } else {
                c
            }
        };
        for c in words.chars() {
            let kept = blank(c);
            // Byte for byte.
            let fill = c.len_utf8() - kept.len_utf8();
            self.line.text.push(kept);
            self.line.text.extend(std::iter::repeat_n(' ', fill));
        }
    }

    pub(super) fn line(self) -> Line {
        self.line
    }
}

/// A symbol as it is placed in a text.
#[derive(Clone, Copy)]
pub(super) struct Instance<'a> {
    pub(super) file: FileId,
    pub(super) text: &'a str,
    pub(super) placed: &'a Placed,
    pub(super) symbol: &'a Symbol,
}

/// An attribute: on the sheet, where its value stands, or of the symbol.
#[derive(Clone, Copy)]
enum Said<'a> {
    Here(&'a Place),
    BySymbol(&'a str),
}

impl<'a> Instance<'a> {
    /// The attribute that counts; none where it is empty.
    fn attribute(&self, name: &str) -> Option<Said<'a>> {
        let Some(place) = self.placed.attribute(name) else {
            return self.symbol.attribute(name).map(Said::BySymbol);
        };
        let value = self.text[place.clone()].trim();
        (!value.is_empty() && value != "\"\"").then_some(Said::Here(place))
    }

    fn words(&self, said: Said<'a>) -> &'a str {
        match said {
            Said::Here(place) => self.text[place.clone()].trim(),
            Said::BySymbol(value) => value,
        }
    }

    /// The letter of the card; none of a block, which is called by its sheet's name.
    fn letter(&self) -> Option<char> {
        let place = self.placed.attribute("prefix");
        let own = place.and_then(|place| self.text[place.clone()].chars().next());
        own.map(|c| c.to_ascii_lowercase()).or(self.symbol.prefix)
    }

    /// The model, and whether that is the name of a library in which the subcircuit stands.
    fn model(&self) -> Option<(Said<'a>, bool)> {
        let said = self.attribute("spicemodel")?;
        let is_library = self.letter() == Some('x') && is_file(self.words(said));
        Some((said, is_library))
    }

    /// The file that a subcircuit stands in.
    pub(super) fn library(&self) -> Option<&'a str> {
        let named = self.attribute("modelfile");
        let library = self.model().filter(|model| model.1).map(|model| model.0);
        named.or(library).map(|said| self.words(said))
    }

    /// The card, with nodes by their numbers; none of a terminal that is open.
    ///
    /// # Errors
    /// A symbol without a name.
    pub(super) fn card(&self, nodes: &[(usize, Option<String>)]) -> Result<Line, Box<Diagnostic>> {
        let Some(Said::Here(name)) = self.attribute("instname") else {
            let span = Span {
                file: self.file,
                start: self.placed.place.start,
                end: self.placed.place.end,
            };
            let message = format!("a `{}` has no name", leaf(&self.placed.kind));
            let finding = Diagnostic::error("bad-symbol", span, message).label("this symbol");
            return Err(Box::new(finding.help("give it one: `SYMATTR InstName R1`")));
        };
        let own = self.letter();
        let letter = own.unwrap_or('x');
        let mut card = Card::new(self.file, self.placed.place.clone());
        let written = self.text[name.clone()].trim();
        if own.is_some() && written.to_lowercase().starts_with(letter) {
            card.copied(self.text, name);
        } else {
            card.push(&format!("{letter}{written}"), name.clone(), false);
        }
        card.said(&nodes_of(letter, nodes).join(" "));
        for said in self.values(letter) {
            match said {
                Said::Here(place) => card.copied(self.text, place),
                Said::BySymbol(value) => card.said(value),
            }
        }
        Ok(card.line())
    }

    /// What stands on the card after the nodes.
    fn values(&self, letter: char) -> impl Iterator<Item = Said<'a>> {
        let (first, second) = (self.attribute("value"), self.attribute("value2"));
        let values = match self.model() {
            // Of a library's subcircuit the second value is its name, the first what is written on the sheet.
            Some((_, true)) if second.is_some() => [second, None, None],
            Some((_, true)) | None => [first, second, None],
            // The first is the name again, or parameters.
            Some((model, false)) => {
                let counts = |said: &Said<'a>| letter != 'x' || self.words(*said).contains('=');
                [Some(model), first.filter(counts), second]
            }
        };
        let lines = ["spiceline", "spiceline2"].map(|name| self.attribute(name));
        values.into_iter().chain(lines).flatten()
    }
}

/// Whether a model's name is that of a library.
fn is_file(name: &str) -> bool {
    const ENDINGS: [&str; 10] = [
        "lib", "sub", "mod", "cir", "net", "txt", "inc", "ckt", "sp", "spi",
    ];
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    ENDINGS.contains(&ending.to_ascii_lowercase().as_str())
}

/// Nodes as they stand on the card.
fn nodes_of(letter: char, nodes: &[(usize, Option<String>)]) -> Vec<String> {
    let name = |k: usize| {
        nodes
            .iter()
            .find(|node| node.0 == k)
            .and_then(|node| node.1.clone())
    };
    if letter == 'a' {
        // Open terminals are at the common one, which is ground where it is open itself.
        let common = name(8).unwrap_or_else(|| "0".into());
        return (1..=8)
            .map(|k| name(k).unwrap_or_else(|| common.clone()))
            .collect();
    }
    let mut all: Vec<String> = nodes.iter().filter_map(|node| node.1.clone()).collect();
    if let ('m', [_, _, source]) = (letter, &all[..]) {
        let bulk = source.clone();
        all.push(bulk);
    }
    all
}
