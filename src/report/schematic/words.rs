//! Words beside symbols, and ground.

use super::super::sheet::{Anchor, INK, Sheet, Stroke};
use super::part::{Part, brief};
use super::symbol;

/// Letter heights, px.
pub(super) const TEXT: f64 = 11.0;
pub(super) const SMALL: f64 = 10.0;
/// The longest words above a symbol that lies, and beside one that stands, letters.
pub(super) const ABOVE: usize = 16;
const BESIDE: usize = 12;
/// Colours of names of nets, and of values.
const NET: &str = "#0072b2";
pub(super) const FAINT: &str = "#6a6a6a";
/// Wires.
pub(super) const WIRE: Stroke = Stroke::plain(INK, 1.4);

pub(super) fn ground(sheet: &mut Sheet, (x, y): (f64, f64)) {
    for (half, down) in [(10.0, 0.0), (6.5, 4.0), (3.0, 8.0)] {
        sheet.line((x - half, y + down), (x + half, y + down), WIRE);
    }
}

pub(super) fn upright_words(sheet: &mut Sheet, part: &Part, (x, y): (f64, f64), is_left: bool) {
    let words = [part.name.as_str(), &part.value, &part.control];
    let lines: Vec<&str> = words.into_iter().filter(|w| !w.is_empty()).collect();
    let aside = symbol::beside(part.symbol);
    let (x, anchor) = if is_left {
        (x - aside, Anchor::End)
    } else {
        (x + aside, Anchor::Start)
    };
    for (k, line) in lines.iter().enumerate() {
        let y = y + 13.0 * (k as f64 - 0.5 * (lines.len() - 1) as f64);
        let look = (TEXT, if k == 0 { INK } else { FAINT });
        written(sheet, line, (x, y), look, anchor);
    }
}

pub(super) fn lying_words(sheet: &mut Sheet, part: &Part, (x, y): (f64, f64)) {
    let above = y - 4.0 - symbol::beside(part.symbol).max(14.0);
    let both = format!("{} {}", part.name, part.value);
    if both.chars().count() <= 16 {
        written(
            sheet,
            both.trim_end(),
            (x, above),
            (TEXT, INK),
            Anchor::Middle,
        );
    } else {
        written(
            sheet,
            &part.name,
            (x, above - 13.0),
            (TEXT, INK),
            Anchor::Middle,
        );
        written(
            sheet,
            &part.value,
            (x, above),
            (TEXT, FAINT),
            Anchor::Middle,
        );
    }
    written(
        sheet,
        &part.control,
        (x, y + 18.0),
        (TEXT, FAINT),
        Anchor::Middle,
    );
}

pub(super) fn named(sheet: &mut Sheet, net: &str, at: (f64, f64), anchor: Anchor) {
    written(sheet, net, at, (SMALL, NET), anchor);
}

/// Words in a colour, shortened to what has room; whole where a pointer rests on them.
pub(super) fn written(
    sheet: &mut Sheet,
    words: &str,
    at: (f64, f64),
    (size, colour): (f64, &str),
    anchor: Anchor,
) {
    if words.is_empty() {
        return;
    }
    let longest = if anchor == Anchor::Middle {
        ABOVE
    } else {
        BESIDE
    };
    sheet.coloured(&brief(words, longest), words, at, size, (anchor, colour));
}
