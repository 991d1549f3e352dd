//! The lines of a schematic: wires, labels, symbols with attributes, directives.

use std::ops::Range;

/// A place on a sheet, in LTspice's units, y down.
pub(super) type Point = (i64, i64);

/// A piece of the file's text, by its bytes.
pub(super) type Place = Range<usize>;

/// How a symbol lies: turned by quarters, clockwise as seen, then mirrored at the upright axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Orientation {
    pub(super) quarters: u8,
    pub(super) mirrored: bool,
}

impl Orientation {
    /// `R0` to `M270`.
    fn read(word: &str) -> Option<Self> {
        let (kind, degrees) = word.split_at_checked(1)?;
        let quarters = match degrees {
            "0" => 0,
            "90" => 1,
            "180" => 2,
            "270" => 3,
            _ => return None,
        };
        let mirrored = match kind {
            "R" | "r" => false,
            "M" | "m" => true,
            _ => return None,
        };
        Some(Self { quarters, mirrored })
    }

    /// Where a point of a symbol is, relative to the symbol's own place.
    pub(super) const fn apply(self, (x, y): Point) -> Point {
        let (x, y) = match self.quarters {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        };
        if self.mirrored { (-x, y) } else { (x, y) }
    }
}

/// A symbol as it is placed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Placed {
    /// `Misc\battery`.
    pub(super) kind: String,
    pub(super) at: Point,
    pub(super) orientation: Orientation,
    /// Of its `SYMBOL` line.
    pub(super) place: Place,
    /// Names of attributes in lower case, and where their values stand.
    pub(super) attributes: Vec<(String, Place)>,
}

impl Placed {
    /// Where an attribute's value stands; the last one counts.
    pub(super) fn attribute(&self, name: &str) -> Option<&Place> {
        let own = self.attributes.iter().rev();
        own.into_iter().find(|a| a.0 == name).map(|a| &a.1)
    }
}

/// A name of a net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Flag {
    pub(super) at: Point,
    pub(super) name: String,
    pub(super) place: Place,
}

/// What stands on a sheet.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Sheet {
    pub(super) wires: Vec<(Point, Point)>,
    pub(super) flags: Vec<Flag>,
    pub(super) symbols: Vec<Placed>,
    /// Where directives stand, several lines separated by `\n` in two letters.
    pub(super) directives: Vec<Place>,
    /// Lines that cannot be read.
    pub(super) faults: Vec<Place>,
}

/// Coordinates beyond these are of no sheet; sums of them are still numbers.
const LARGEST: i64 = 1 << 40;

impl Sheet {
    pub(super) fn read(text: &str) -> Self {
        let mut sheet = Self::default();
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let trimmed = line.trim_end_matches(['\n', '\r', ' ']);
            let place = start..start + trimmed.len();
            start += line.len();
            if sheet.line(trimmed, place.clone()).is_none() {
                sheet.faults.push(place);
            }
        }
        sheet
    }

    /// Takes one line; `None` where it cannot be read.
    fn line(&mut self, line: &str, place: Place) -> Option<()> {
        let mut words = Words { line, at: 0 };
        let Some(keyword) = words.next() else {
            return Some(());
        };
        match keyword.to_ascii_uppercase().as_str() {
            "WIRE" => self.wires.push((words.point()?, words.point()?)),
            "FLAG" => {
                let at = words.point()?;
                let name = words.rest();
                if name.is_empty() {
                    return None;
                }
                self.flags.push(Flag {
                    at,
                    name: name.to_owned(),
                    place,
                });
            }
            "SYMBOL" => {
                // The kind may contain blanks.
                let mut backwards = line.rsplitn(4, ' ');
                let orientation = Orientation::read(backwards.next()?)?;
                let y = coordinate(backwards.next()?)?;
                let x = coordinate(backwards.next()?)?;
                let kind = backwards.next()?.get(keyword.len()..)?.trim();
                self.symbols.push(Placed {
                    kind: kind.to_owned(),
                    at: (x, y),
                    orientation,
                    place,
                    attributes: Vec::new(),
                });
            }
            "SYMATTR" => {
                let name = words.next()?.to_ascii_lowercase();
                let value = place.end - words.rest().len()..place.end;
                self.symbols.last_mut()?.attributes.push((name, value));
            }
            "TEXT" => {
                words.point()?;
                words.next()?;
                words.next()?;
                let text = words.rest();
                if text.starts_with('!') {
                    self.directives.push(place.end - text.len() + 1..place.end);
                }
            }
            // What is drawn, where words stand, and what a net is to the sheet above.
            "VERSION" | "SHEET" | "WINDOW" | "LINE" | "RECTANGLE" | "CIRCLE" | "ARC"
            | "DATAFLAG" | "BUSTAP" | "IOPIN" => {}
            _ => return None,
        }
        Some(())
    }
}

fn coordinate(word: &str) -> Option<i64> {
    let value: i64 = word.parse().ok()?;
    (-LARGEST..=LARGEST).contains(&value).then_some(value)
}

/// The words of a line.
pub(super) struct Words<'l> {
    pub(super) line: &'l str,
    pub(super) at: usize,
}

impl<'l> Words<'l> {
    pub(super) fn next(&mut self) -> Option<&'l str> {
        let rest = self.rest();
        let word = rest.split([' ', '\t']).next().filter(|w| !w.is_empty())?;
        self.at = self.line.len() - rest.len() + word.len();
        Some(word)
    }

    pub(super) fn point(&mut self) -> Option<Point> {
        Some((coordinate(self.next()?)?, coordinate(self.next()?)?))
    }

    /// Everything after the blanks that come next.
    pub(super) fn rest(&self) -> &'l str {
        self.line[self.at..].trim_start_matches([' ', '\t'])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_turn_and_are_mirrored() {
        let at = |word: &str| Orientation::read(word).map(|o| o.apply((3, 10)));
        for (word, point) in [
            ("R0", (3, 10)),
            ("R90", (-10, 3)),
            ("R180", (-3, -10)),
            ("R270", (10, -3)),
            ("M0", (-3, 10)),
            ("M90", (10, 3)),
            ("M180", (3, -10)),
            ("M270", (-10, -3)),
        ] {
            assert_eq!(at(word), Some(point), "{word}");
        }
        assert_eq!((at("R45"), at("X0"), at("")), (None, None, None));
    }

    #[test]
    fn lines_are_read_with_the_places_of_what_they_say() {
        let text = "Version 4\nSHEET 1 880 680\nWIRE 0 0 16 0\nFLAG 16 0 out\nIOPIN 16 0 Out\nSYMBOL my parts\\res 32 48 M90\n\
                    SYMATTR InstName R1\nSYMATTR Value 10k tol=1\nTEXT 8 8 Left 2 !.tran 1m\\n.op\nTEXT 8 8 Left 2 ;words\nBROKEN 1\nWIRE 1 2 3\n";
        let sheet = Sheet::read(text);
        assert_eq!(sheet.wires, [((0, 0), (16, 0))]);
        assert_eq!(sheet.flags[0].name, "out");
        let symbol = &sheet.symbols[0];
        assert_eq!(
            (symbol.kind.as_str(), symbol.at),
            ("my parts\\res", (32, 48))
        );
        assert_eq!(
            &text[symbol.attribute("value").unwrap().clone()],
            "10k tol=1"
        );
        assert_eq!(&text[sheet.directives[0].clone()], ".tran 1m\\n.op");
        let faults: Vec<&str> = sheet.faults.iter().map(|f| &text[f.clone()]).collect();
        assert_eq!(faults, ["BROKEN 1", "WIRE 1 2 3"]);
    }
}
