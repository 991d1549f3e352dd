//! A sheet that knows what is drawn on it, so that words find a free place.

use super::super::sheet::{Anchor, Sheet, Stroke, width_of};

/// The width of usual letters over that of the widest.
const USUAL: f64 = 0.88;
/// Half the height of letters over their size, above and below their middle.
const HALF: f64 = 0.4;

/// Part of a sheet, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    /// Left and right.
    pub(super) x: (f64, f64),
    /// Top and bottom.
    pub(super) y: (f64, f64),
}

impl Area {
    /// Between two corners, in any order.
    pub(super) const fn between(a: (f64, f64), b: (f64, f64)) -> Self {
        Self {
            x: (a.0.min(b.0), a.0.max(b.0)),
            y: (a.1.min(b.1), a.1.max(b.1)),
        }
    }

    /// What a line of text takes.
    pub(super) fn of_text(text: &str, size: f64, (x, y): (f64, f64), anchor: Anchor) -> Self {
        let width = USUAL * width_of(text, size);
        let left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - 0.5 * width,
            Anchor::End => x - width,
        };
        Self::between((left, y - HALF * size), (left + width, y + HALF * size))
    }

    /// How much of it another one covers; a line has no width, and covers as much as it is long.
    fn shared(&self, other: &Self) -> f64 {
        let over = |a: (f64, f64), b: (f64, f64)| a.1.min(b.1) - a.0.max(b.0);
        let (across, down) = (over(self.x, other.x), over(self.y, other.y));
        if across < 0.0 || down < 0.0 {
            0.0
        } else {
            across.max(1.0) * down.max(1.0)
        }
    }
}

/// Where words may stand.
pub(super) type Place = ((f64, f64), Anchor);

/// A line of words: as it is written, whole, the height of its letters, its colour, and how far below the place it stands.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) text: String,
    pub(super) whole: String,
    pub(super) size: f64,
    pub(super) colour: &'static str,
    pub(super) down: f64,
}

/// A circuit picture that grows: words come last, each where nothing is yet.
pub(super) struct Canvas {
    pub(super) sheet: Sheet,
    taken: Vec<Area>,
    words: Vec<(Vec<Line>, Vec<Place>)>,
}

impl Canvas {
    pub(super) const fn on(sheet: Sheet) -> Self {
        Self {
            sheet,
            taken: Vec::new(),
            words: Vec::new(),
        }
    }

    /// A wire.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), stroke: Stroke) {
        self.sheet.line(from, to, stroke);
        self.takes(Area::between(from, to));
    }

    /// The box of a part.
    pub(super) fn boxed(&mut self, a: (f64, f64), b: (f64, f64)) {
        self.sheet.boxed(a, b);
        let area = Area::between(a, b);
        // Words may stand inside, not across an edge.
        for (from, to) in [
            ((area.x.0, area.y.0), (area.x.1, area.y.0)),
            ((area.x.0, area.y.1), (area.x.1, area.y.1)),
            ((area.x.0, area.y.0), (area.x.0, area.y.1)),
            ((area.x.1, area.y.0), (area.x.1, area.y.1)),
        ] {
            self.takes(Area::between(from, to));
        }
    }

    /// Nothing else is to stand there.
    pub(super) fn takes(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Words at the first of some places at which they cover nothing, else at the one at which they cover least.
    pub(super) fn words(&mut self, lines: Vec<Line>, places: Vec<Place>) {
        self.words.push((lines, places));
    }

    /// The document.
    pub(super) fn finish(mut self) -> String {
        // Those without a choice come first.
        let mut words = std::mem::take(&mut self.words);
        words.sort_by_key(|(_, places)| places.len() > 1);
        for (lines, places) in words {
            let areas = |place: &Place| {
                let ((x, y), anchor) = *place;
                let area = move |line: &Line| {
                    Area::of_text(&line.text, line.size, (x, y + line.down), anchor)
                };
                lines.iter().map(area).collect::<Vec<_>>()
            };
            let covered = |place: &Place| {
                let own = areas(place);
                let pairs = own
                    .iter()
                    .flat_map(|a| self.taken.iter().map(|b| a.shared(b)));
                pairs.sum::<f64>()
            };
            let least = places.iter().map(|place| (covered(place), place));
            let Some((_, place)) = least.reduce(|a, b| if b.0 < a.0 { b } else { a }) else {
                continue;
            };
            let own = areas(place);
            let ((x, y), anchor) = *place;
            for line in &lines {
                let at = (x, y + line.down);
                let look = (anchor, line.colour);
                self.sheet
                    .coloured(&line.text, &line.whole, at, line.size, look);
            }
            self.taken.extend(own);
        }
        self.sheet.finish()
    }
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::super::super::svg::titled;
    use super::super::words::WIRE;
    use super::*;
    use crate::model::Model;

    fn line(text: &str) -> Vec<Line> {
        vec![Line {
            text: text.into(),
            whole: text.into(),
            size: 10.0,
            colour: "#000",
            down: 0.0,
        }]
    }

    /// The attribute of a tag of SVG.
    fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
        let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
        rest.split_once('"').map(|(value, _)| value)
    }

    /// The texts of a picture with what they take, without its title, and its straight lines.
    fn labels(svg: &str) -> (Vec<(String, Area)>, Vec<Area>) {
        let (mut texts, mut lines) = (Vec::new(), Vec::new());
        for tag in svg.lines() {
            let number = |name| attribute(tag, name)?.parse::<f64>().ok();
            if tag.starts_with("<text") && attribute(tag, "fill").is_some() {
                let (_, rest) = tag.split_once('>').expect("a text");
                let text = rest.split('<').next().unwrap_or_default().to_owned();
                let size = number("font-size").expect("a size");
                let at = (
                    number("x").expect("x"),
                    number("y").expect("y") - 0.35 * size,
                );
                let anchor = match attribute(tag, "text-anchor") {
                    Some("start") => Anchor::Start,
                    Some("end") => Anchor::End,
                    _ => Anchor::Middle,
                };
                let area = Area::of_text(&text, size, at, anchor);
                texts.push((text, area));
            } else if tag.starts_with("<path fill=\"none\" d=\"M") {
                let path = attribute(tag, "d").expect("a path");
                let numbers: Vec<f64> = path
                    .split(['M', 'L', ' '])
                    .filter_map(|n| n.parse().ok())
                    .collect();
                let &[a, b, c, d] = &numbers[..] else {
                    panic!("{path}")
                };
                lines.push(Area::between((a, b), (c, d)));
            }
        }
        (texts, lines)
    }

    fn files(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                if path.file_name().is_none_or(|name| name != "bad") {
                    files(&path, found);
                }
            } else if path
                .extension()
                .is_some_and(|ending| ending == "cir" || ending == "asc")
            {
                found.push(path);
            }
        }
    }

    /// In all pictures of `netlists/` no words are on others or on a wire; the signs of what controls a part stand at its leads.
    #[test]
    fn words_are_on_nothing_else() {
        let mut found = Vec::new();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists");
        files(&folder, &mut found);
        found.sort();
        let (mut pictures, mut faults) = (0, Vec::new());
        for file in found {
            let Ok(model) = Model::load(&file, crate::ElaborateOptions::default()) else {
                continue;
            };
            let Ok(svg) = super::super::svg(&model, &[]) else {
                continue;
            };
            pictures += 1;
            let (texts, lines) = labels(&svg);
            assert!(!texts.is_empty() && !lines.is_empty());
            let name = file.file_name().expect("a name").to_string_lossy();
            for (k, (text, area)) in texts.iter().enumerate() {
                let others = texts[..k]
                    .iter()
                    .filter(|(_, other)| area.shared(other) > 1.0);
                faults.extend(others.map(|(other, _)| format!("{name}: {text} on {other}")));
                let wires = lines.iter().filter(|line| area.shared(line) > 1.0);
                if !matches!(text.as_str(), "+" | "−") {
                    faults.extend(wires.map(|wire| format!("{name}: {text} on {wire:?}")));
                }
            }
        }
        assert!(pictures > 60, "{pictures}");
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    #[test]
    fn words_go_where_nothing_is() {
        let place = |blocked: &[f64]| {
            let mut canvas = Canvas::on(titled(100.0, 100.0, ""));
            let places = [10.0, 40.0, 70.0].map(|y| ((50.0, y), Anchor::Middle));
            canvas.words(line("word"), places.to_vec());
            for y in blocked {
                canvas.line((0.0, *y), (60.0, *y), WIRE);
            }
            let (texts, _) = labels(&canvas.finish());
            texts[0].1.y.0 + 4.0
        };
        let near = |y: f64, truth: f64| assert!((y - truth).abs() < 1e-9, "{y} {truth}");
        near(place(&[]), 10.0);
        near(place(&[11.0]), 40.0);
        near(place(&[11.0, 38.0]), 70.0);
        // Where all are taken, the one that covers least.
        near(place(&[11.0, 9.0, 38.0, 41.0, 70.0]), 70.0);
    }
}
