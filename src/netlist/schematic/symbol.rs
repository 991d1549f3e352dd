//! What a symbol is: its pins, and what stands on its card where an instance says nothing else.

use super::sheet::{Point, Words};

/// A pin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pin {
    pub(super) at: Point,
    /// Which node of the card it is, from 1.
    pub(super) order: usize,
    pub(super) name: String,
}

/// A symbol.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Symbol {
    /// The card's letter, in lower case; none of a sheet drawn as a block.
    pub(super) prefix: Option<char>,
    pub(super) pins: Vec<Pin>,
    /// Attributes by their names in lower case: `value`, `value2`, `spicemodel`, `spiceline`, `spiceline2`, `modelfile`.
    pub(super) attributes: Vec<(String, String)>,
}

impl Symbol {
    /// An attribute's value.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let own = self.attributes.iter().rev().find(|a| a.0 == name);
        own.map(|a| a.1.as_str()).filter(|value| !value.is_empty())
    }

    /// Reads an `.asy` file; what is drawn is passed over.
    pub(super) fn read(text: &str) -> Self {
        let mut symbol = Self::default();
        for line in text.lines() {
            symbol.line(line.trim_end());
        }
        // Without orders the pins' own.
        if symbol.pins.iter().any(|pin| pin.order == 0) {
            for (k, pin) in symbol.pins.iter_mut().enumerate() {
                pin.order = k + 1;
            }
        }
        symbol.pins.sort_by_key(|pin| pin.order);
        symbol
    }

    /// Takes one line; `None` where it says nothing of what counts here.
    fn line(&mut self, line: &str) -> Option<()> {
        let mut words = Words { line, at: 0 };
        match words.next()?.to_ascii_uppercase().as_str() {
            "PIN" => self.pins.push(Pin {
                at: words.point()?,
                order: 0,
                name: String::new(),
            }),
            "PINATTR" => {
                let pin = self.pins.last_mut()?;
                match words.next()?.to_ascii_lowercase().as_str() {
                    "pinname" => pin.name = words.rest().to_owned(),
                    "spiceorder" => pin.order = words.rest().parse().ok()?,
                    _ => {}
                }
            }
            "SYMATTR" => {
                let name = words.next()?.to_ascii_lowercase();
                let value = words.rest();
                if name == "prefix" {
                    self.prefix = value.chars().next().map(|c| c.to_ascii_lowercase());
                } else {
                    self.attributes.push((name, value.to_owned()));
                }
            }
            _ => {}
        }
        Some(())
    }

    /// A symbol that comes with LTspice, by the last part of its name in lower case.
    pub(super) fn built_in(name: &str) -> Option<Self> {
        let &(_, prefix, value, pins) = BUILT_IN.iter().find(|known| known.0.contains(&name))?;
        let pin = |&(order, x, y): &(usize, i64, i64)| Pin {
            at: (x, y),
            order,
            name: String::new(),
        };
        let attribute = if prefix == 'a' { "spicemodel" } else { "value" };
        Some(Self {
            prefix: Some(prefix),
            pins: pins.iter().map(pin).collect(),
            attributes: vec![(attribute.into(), value.into())],
        })
    }
}

/// Names, letter of the card, default value (of an `A` device its function), and pins: node of the card, x, y.
type Known = (
    &'static [&'static str],
    char,
    &'static str,
    &'static [(usize, i64, i64)],
);

const UPRIGHT: &[(usize, i64, i64)] = &[(1, 16, 16), (2, 16, 96)];
const SHORT: &[(usize, i64, i64)] = &[(1, 16, 0), (2, 16, 64)];
const VOLTAGE: &[(usize, i64, i64)] = &[(1, 0, 16), (2, 0, 96)];
const CURRENT: &[(usize, i64, i64)] = &[(1, 0, 0), (2, 0, 80)];
const BIPOLAR: &[(usize, i64, i64)] = &[(1, 64, 0), (2, 0, 48), (3, 64, 96)];
const MOS: &[(usize, i64, i64)] = &[(1, 48, 0), (2, 0, 80), (3, 48, 96)];
const MOS4: &[(usize, i64, i64)] = &[(1, 48, 0), (2, 0, 80), (3, 48, 96), (4, 48, 48)];
const JUNCTION: &[(usize, i64, i64)] = &[(1, 48, 0), (2, 0, 64), (3, 48, 96)];
const GATE: &[(usize, i64, i64)] = &[
    (1, -32, 32),
    (2, -32, 48),
    (3, -32, 64),
    (4, -32, 80),
    (5, -32, 96),
    (6, 32, 80),
    (7, 32, 48),
    (8, -16, 96),
];
const XOR: &[(usize, i64, i64)] = &[
    (1, -48, 32),
    (2, -48, 48),
    (3, -48, 64),
    (4, -48, 80),
    (5, -48, 96),
    (6, 32, 80),
    (7, 16, 48),
    (8, -16, 96),
];
const INVERTER: &[(usize, i64, i64)] = &[(1, 0, 64), (6, 64, 64), (8, 0, 80)];
const BUFFER: &[(usize, i64, i64)] = &[(1, 0, 64), (6, 64, 80), (7, 64, 48), (8, 0, 96)];
const BUFFER1: &[(usize, i64, i64)] = &[(1, 0, 64), (7, 64, 64), (8, 0, 80)];

/// The symbols of LTspice's library that `circ` has a model of, in the coordinates of its sheets.
const BUILT_IN: &[Known] = &[
    (&["res"], 'r', "R", UPRIGHT),
    (&["res2"], 'r', "R", SHORT),
    (&["cap", "polcap", "xtal"], 'c', "C", SHORT),
    (&["ind", "ind2"], 'l', "L", UPRIGHT),
    (&["voltage", "battery", "signal"], 'v', "V", VOLTAGE),
    (&["current"], 'i', "I", CURRENT),
    (&["bv"], 'b', "V=F(...)", VOLTAGE),
    (&["bi"], 'b', "I=F(...)", CURRENT),
    (&["bi2"], 'b', "I=F(...)", &[(1, 0, 80), (2, 0, 0)]),
    (
        &["e"],
        'e',
        "E",
        &[(1, 0, 16), (2, 0, 96), (3, -48, 32), (4, -48, 80)],
    ),
    (
        &["e2"],
        'e',
        "E",
        &[(1, 0, 16), (2, 0, 96), (3, -48, 80), (4, -48, 32)],
    ),
    (
        &["g"],
        'g',
        "G",
        &[(1, 0, 96), (2, 0, 16), (3, -48, 32), (4, -48, 80)],
    ),
    (
        &["g2"],
        'g',
        "G",
        &[(1, 0, 96), (2, 0, 16), (3, -48, 80), (4, -48, 32)],
    ),
    (&["f"], 'f', "F", CURRENT),
    (&["h"], 'h', "H", VOLTAGE),
    (
        &["sw"],
        's',
        "SW",
        &[(1, 0, 16), (2, 0, 96), (3, -48, 80), (4, -48, 32)],
    ),
    (&["csw"], 'w', "CSW", VOLTAGE),
    (
        &["diode", "schottky", "zener", "led", "varactor"],
        'd',
        "D",
        SHORT,
    ),
    (&["npn", "npn2", "npn3"], 'q', "NPN", BIPOLAR),
    (&["pnp", "pnp2"], 'q', "PNP", BIPOLAR),
    (&["nmos"], 'm', "NMOS", MOS),
    (&["pmos"], 'm', "PMOS", MOS),
    (&["nmos4"], 'm', "NMOS", MOS4),
    (&["pmos4"], 'm', "PMOS", MOS4),
    (&["njf"], 'j', "NJF", JUNCTION),
    (&["pjf"], 'j', "PJF", JUNCTION),
    (
        &["tline"],
        't',
        "Td=50n Z0=50",
        &[(1, -48, -16), (2, -48, 16), (3, 48, -16), (4, 48, 16)],
    ),
    (
        &["opamp"],
        'x',
        "opamp",
        &[(1, -32, 48), (2, -32, 80), (3, 32, 64)],
    ),
    (
        &["opamp2"],
        'x',
        "opamp2",
        &[
            (1, -32, 80),
            (2, -32, 48),
            (3, 0, 32),
            (4, 0, 96),
            (5, 32, 64),
        ],
    ),
    (
        &["triac"],
        'x',
        "TRIAC",
        &[(1, 32, 0), (2, -16, 64), (3, 32, 64)],
    ),
    (&["and"], 'a', "AND", GATE),
    (&["or"], 'a', "OR", GATE),
    (&["xor"], 'a', "XOR", XOR),
    (&["inv"], 'a', "BUF", INVERTER),
    (&["buf"], 'a', "BUF", BUFFER),
    (&["buf1"], 'a', "BUF", BUFFER1),
    (&["schmitt"], 'a', "SCHMITT", BUFFER),
    (&["schmtbuf"], 'a', "SCHMITT", BUFFER1),
    (&["schmtinv"], 'a', "SCHMITT", INVERTER),
    (
        &["diffschmitt"],
        'a',
        "SCHMITT",
        &[(1, 0, 48), (2, 0, 80), (6, 64, 80), (7, 64, 48), (8, 0, 96)],
    ),
    (
        &["diffschmtbuf"],
        'a',
        "SCHMITT",
        &[(1, 0, 48), (2, 0, 80), (7, 64, 64), (8, 0, 96)],
    ),
    (
        &["diffschmtinv"],
        'a',
        "SCHMITT",
        &[(1, 0, 48), (2, 0, 80), (6, 64, 64), (8, 0, 96)],
    ),
    (
        &["dflop"],
        'a',
        "DFLOP",
        &[
            (1, -80, 48),
            (3, -80, 96),
            (4, 0, 0),
            (5, 0, 144),
            (6, 96, 96),
            (7, 80, 48),
            (8, -80, 144),
        ],
    ),
    (
        &["srflop"],
        'a',
        "SRFLOP",
        &[
            (1, -48, 48),
            (2, -48, 96),
            (6, 64, 96),
            (7, 48, 48),
            (8, -48, 128),
        ],
    ),
    (
        &["sample"],
        'a',
        "SAMPLEHOLD",
        &[
            (1, -80, -32),
            (2, -80, 0),
            (3, -80, 32),
            (4, -80, 64),
            (7, 96, 16),
            (8, -80, 96),
        ],
    ),
    (
        &["modulate"],
        'a',
        "MODULATE",
        &[(1, 0, 0), (2, 0, 64), (7, 144, 32), (8, 0, 96)],
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_file_gives_pins_in_the_order_of_the_card() {
        let text = "Version 4\nSymbolType CELL\nLINE Normal 0 0 1 1\nSYMATTR Prefix QN\nSYMATTR Value2 fast one\nPIN 64 0 NONE 0\n\
                    PINATTR PinName C out\nPINATTR SpiceOrder 2\nPIN 0 48 NONE 0\nPINATTR PinName B\nPINATTR SpiceOrder 1\n";
        let symbol = Symbol::read(text);
        assert_eq!(symbol.prefix, Some('q'));
        let pins: Vec<_> = symbol
            .pins
            .iter()
            .map(|p| (p.at, p.name.as_str()))
            .collect();
        assert_eq!(pins, [((0, 48), "B"), ((64, 0), "C out")]);
        assert_eq!(symbol.attribute("value2"), Some("fast one"));
        assert_eq!(symbol.attribute("value"), None);
    }

    #[test]
    fn every_built_in_symbol_has_pins_of_its_own() {
        let mut names: Vec<&str> = BUILT_IN.iter().flat_map(|known| known.0).copied().collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
        for (names, _, _, pins) in BUILT_IN {
            let mut places: Vec<_> = pins.iter().map(|pin| (pin.1, pin.2)).collect();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), pins.len(), "{names:?}");
            assert!(
                pins.windows(2).all(|pair| pair[0].0 < pair[1].0),
                "{names:?}"
            );
        }
    }
}
