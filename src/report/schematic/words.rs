//! Words beside symbols, and ground.

use super::super::sheet::{Anchor, INK, Stroke};
use super::canvas::{Canvas, Line, Place};
use super::part::{Part, brief};
use super::symbol;

/// Letter heights, px.
pub(super) const TEXT: f64 = 11.0;
pub(super) const SMALL: f64 = 10.0;
/// The longest words above a symbol that lies, and beside one that stands, letters.
pub(super) const ABOVE: usize = 16;
const BESIDE: usize = 12;
/// How far words step aside, px.
const AWAY: f64 = 16.0;
/// Colours of names of nets, and of values.
const NET: &str = "#0072b2";
pub(super) const FAINT: &str = "#6a6a6a";
/// Wires.
pub(super) const WIRE: Stroke = Stroke::plain(INK, 1.4);

pub(super) fn ground(canvas: &mut Canvas, (x, y): (f64, f64)) {
    for (half, down) in [(10.0, 0.0), (6.5, 4.0), (3.0, 8.0)] {
        canvas.line((x - half, y + down), (x + half, y + down), WIRE);
    }
}

/// Beside a symbol that stands: at one side, the other, or there above or below its middle.
pub(super) fn upright_words(canvas: &mut Canvas, part: &Part, (x, y): (f64, f64), is_left: bool) {
    let words = [part.name.as_str(), &part.value, &part.control];
    let lines: Vec<&str> = words.into_iter().filter(|w| !w.is_empty()).collect();
    let aside = symbol::beside(part.symbol);
    let mut sides = [(x + aside, Anchor::Start), (x - aside, Anchor::End)];
    if is_left {
        sides.reverse();
    }
    let middle = 0.5 * (lines.len() as f64 - 1.0);
    let written = lines.iter().enumerate().filter_map(|(k, line)| {
        let look = (TEXT, if k == 0 { INK } else { FAINT });
        words_in(line, look, BESIDE, 13.0 * (k as f64 - middle))
    });
    let heights = [0.0, -AWAY, AWAY];
    let places = heights
        .iter()
        .flat_map(|up| sides.map(|(x, anchor)| ((x, y + up), anchor)));
    canvas.words(written.collect(), places.collect());
}

/// Above a symbol that lies, or below it; what controls it on the other side.
pub(super) fn lying_words(canvas: &mut Canvas, part: &Part, (x, y): (f64, f64)) {
    let above = y - 4.0 - symbol::beside(part.symbol).max(14.0);
    let both = format!("{} {}", part.name, part.value);
    let lines: Vec<Option<Line>> = if both.chars().count() <= ABOVE {
        vec![words_in(both.trim_end(), (TEXT, INK), ABOVE, 0.0)]
    } else {
        vec![
            words_in(&part.name, (TEXT, INK), ABOVE, -13.0),
            words_in(&part.value, (TEXT, FAINT), ABOVE, 0.0),
        ]
    };
    let lines: Vec<Line> = lines.into_iter().flatten().collect();
    let lower = y + 18.0 + 13.0 * (lines.len() as f64 - 1.0);
    let middle = |y: f64| ((x, y), Anchor::Middle);
    let beside = |y: f64| [((x + 6.0, y), Anchor::Start), ((x - 6.0, y), Anchor::End)];
    let mut places = vec![middle(above)];
    places.extend(beside(above));
    places.extend([middle(above - AWAY), middle(lower), middle(lower + AWAY)]);
    canvas.words(lines, places);
    let control = words_in(&part.control, (TEXT, FAINT), ABOVE, 0.0);
    let mut places = vec![middle(y + 18.0)];
    places.extend(beside(y + 18.0));
    places.extend([middle(y + 18.0 + AWAY), middle(above - AWAY)]);
    canvas.words(control.into_iter().collect(), places);
}

/// The name of a net, at one of some places.
pub(super) fn named(canvas: &mut Canvas, net: &str, places: Vec<Place>) {
    let longest = match places.first() {
        Some((_, Anchor::Middle)) => ABOVE,
        _ => BESIDE,
    };
    let line = words_in(net, (SMALL, NET), longest, 0.0);
    canvas.words(line.into_iter().collect(), places);
}

/// The words of a box, at one of some places.
pub(super) fn headed(canvas: &mut Canvas, words: &str, places: Vec<Place>) {
    let line = words_in(words, (TEXT, INK), ABOVE, 0.0);
    canvas.words(line.into_iter().collect(), places);
}

/// Words in a colour, shortened to what has room; whole where a pointer rests on them.
pub(super) fn written(
    canvas: &mut Canvas,
    words: &str,
    at: (f64, f64),
    look: (f64, &'static str),
    anchor: Anchor,
) {
    let longest = if anchor == Anchor::Middle {
        ABOVE
    } else {
        BESIDE
    };
    let line = words_in(words, look, longest, 0.0);
    canvas.words(line.into_iter().collect(), vec![(at, anchor)]);
}

fn words_in(
    words: &str,
    (size, colour): (f64, &'static str),
    longest: usize,
    down: f64,
) -> Option<Line> {
    (!words.is_empty()).then(|| Line {
        text: brief(words, longest),
        whole: words.to_owned(),
        size,
        colour,
        down,
    })
}
