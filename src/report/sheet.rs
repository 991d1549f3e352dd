//! A sheet of SVG: lines, curves and text at coordinates in CSS pixels, x to the right and y down.

use std::fmt::{self, Display, Formatter, Write};

/// Parts of a pixel in which curves are written, as whole numbers under one scale: small files, and no visible steps.
const FINE: f64 = 10.0;
/// The largest width of a letter, in parts of the size of its font: what is written never needs more.
const LETTER: f64 = 0.66;

/// The colour of text and axes.
pub(super) const INK: &str = "#282828";
/// The colour of grid lines.
pub(super) const GRID: &str = "#e1e1e1";

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008), darker ones first.
const COLOURS: [&str; 8] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5a5a5a", "#8c564b",
];
/// Dashes, px: a round of colours each.
const DASHES: [&[f64]; 4] = [&[], &[7.0, 3.0], &[2.0, 2.5], &[9.0, 3.0, 2.0, 3.0]];

/// Stops of a scale for more runs in their order than there are colours, from Matplotlib's plasma (van der Walt and Smith 2015) as far as it is seen
/// on white: red, green, blue.
const SCALE: [[u8; 3]; 6] = [
    [0x0d, 0x08, 0x87],
    [0x54, 0x02, 0xa3],
    [0x8b, 0x0a, 0xa5],
    [0xb9, 0x32, 0x89],
    [0xdb, 0x5c, 0x68],
    [0xf4, 0x88, 0x49],
];

/// The colour of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Colour {
    /// As SVG writes it.
    Fixed(&'static str),
    /// The k-th of several places along [`SCALE`], the last at its end.
    Along(usize, usize),
}

impl Display for Colour {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let (k, last) = match *self {
            Self::Fixed(colour) => return to.write_str(colour),
            Self::Along(k, count) => (k, count.saturating_sub(1).max(1)),
        };
        let stretches = SCALE.len() - 1;
        let stop = (k * stretches / last).min(stretches - 1);
        let part = (k * stretches) as f64 / last as f64 - stop as f64;
        let ends = SCALE[stop].iter().zip(SCALE[stop + 1]);
        let mix =
            |(one, other): (&u8, u8)| f64::from(*one) + part * (f64::from(other) - f64::from(*one));
        to.write_str("#")?;
        ends.map(mix)
            .try_for_each(|mixed| write!(to, "{:02x}", mixed.round() as u8))
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub(super) colour: Colour,
    /// px.
    pub(super) width: f64,
    /// Lengths of strokes and gaps, px.
    pub(super) dash: &'static [f64],
    /// What is beneath shows through.
    pub(super) pale: bool,
}

impl Stroke {
    /// An unbroken line.
    pub(super) const fn plain(colour: &'static str, width: f64) -> Self {
        Self {
            colour: Colour::Fixed(colour),
            width,
            dash: &[],
            pale: false,
        }
    }

    /// The k-th of several curves: 32 are told apart by colour and dash.
    pub(super) const fn curve(k: usize) -> Self {
        let colours = COLOURS.len();
        Self::of_run((k % colours, colours), k / colours)
    }

    /// The k-th curve of one of so many runs: runs are told apart by colour, more than there are colours along a scale; their curves by dash.
    pub(super) const fn of_run((run, runs): (usize, usize), k: usize) -> Self {
        Self {
            colour: if runs > COLOURS.len() {
                Colour::Along(run, runs)
            } else {
                Colour::Fixed(COLOURS[run])
            },
            width: 1.5,
            dash: DASHES[k % DASHES.len()],
            pale: false,
        }
    }

    /// As attributes, lengths multiplied by `scale`.
    fn attributes(&self, scale: f64) -> String {
        let mut text = format!(
            "stroke=\"{}\" stroke-width=\"{}\"",
            self.colour,
            short(self.width * scale)
        );
        if !self.dash.is_empty() {
            let dash: Vec<String> = self.dash.iter().map(|d| short(d * scale)).collect();
            text.push_str(&format!(" stroke-dasharray=\"{}\"", dash.join(" ")));
        }
        if self.pale {
            text.push_str(" stroke-opacity=\"0.35\"");
        }
        text
    }
}

/// Where a text stands by its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// A drawing that grows, on white.
#[derive(Debug)]
pub(super) struct Sheet {
    text: String,
}

impl Sheet {
    /// An empty sheet of this size, px; `title` is what a reader's program calls it.
    pub(super) fn new(width: f64, height: f64, title: &str) -> Self {
        let (width, height) = (short(width.ceil()), short(height.ceil()));
        Self {
            text: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
                 font-family=\"sans-serif\" fill=\"{INK}\">\n<title>{}</title>\n\
                 <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n",
                escaped(title)
            ),
        }
    }

    /// SVG as it is.
    pub(super) fn raw(&mut self, svg: &str) {
        self.text.push_str(svg);
        self.text.push('\n');
    }

    /// A straight line.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), stroke: Stroke) {
        self.raw(&format!(
            "<path fill=\"none\" d=\"M{} {}L{} {}\" {}/>",
            short(from.0),
            short(from.1),
            short(to.0),
            short(to.1),
            stroke.attributes(1.0)
        ));
    }

    /// A curve through points; those that add nothing at a tenth of a pixel are left out.
    pub(super) fn curve(&mut self, points: impl Iterator<Item = (f64, f64)>, stroke: Stroke) {
        let path =
            relative(points.map(|(x, y)| ((x * FINE).round() as i64, (y * FINE).round() as i64)));
        self.raw(&format!(
            "<path fill=\"none\" stroke-linejoin=\"round\" transform=\"scale({})\" d=\"{path}\" {}/>",
            1.0 / FINE,
            stroke.attributes(FINE)
        ));
    }

    /// The box of a part, between two corners.
    pub(super) fn boxed(&mut self, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) {
        self.raw(&format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\" fill=\"#fafafa\" stroke=\"{INK}\" stroke-width=\"1.4\"/>",
            short(x0),
            short(y0),
            short(x1 - x0),
            short(y1 - y0)
        ));
    }

    /// A disc.
    pub(super) fn dot(&mut self, at: (f64, f64), radius: f64, colour: impl Display) {
        self.raw(&format!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{colour}\"/>",
            short(at.0),
            short(at.1),
            short(radius)
        ));
    }

    /// A line of text, its middle at the height of the point.
    pub(super) fn text(&mut self, text: &str, at: (f64, f64), size: f64, anchor: Anchor) {
        self.raw(&format!(
            "<text x=\"{}\" y=\"{}\" font-size=\"{size}\" text-anchor=\"{}\">{}</text>",
            short(at.0),
            short(at.1 + 0.35 * size),
            anchor.name(),
            escaped(text)
        ));
    }

    /// The same in a colour; a reader's program shows `whole` where a pointer rests on it.
    pub(super) fn coloured(
        &mut self,
        text: &str,
        whole: &str,
        at: (f64, f64),
        size: f64,
        (anchor, colour): (Anchor, &str),
    ) {
        let title = if text == whole {
            String::new()
        } else {
            format!("<title>{}</title>", escaped(whole))
        };
        self.raw(&format!(
            "<text x=\"{}\" y=\"{}\" font-size=\"{size}\" text-anchor=\"{}\" fill=\"{colour}\">{}{title}</text>",
            short(at.0),
            short(at.1 + 0.35 * size),
            anchor.name(),
            escaped(text)
        ));
    }

    /// A line of text that is read upwards, its middle at the point.
    pub(super) fn upwards(&mut self, text: &str, (x, y): (f64, f64), size: f64) {
        self.raw(&format!(
            "<text transform=\"translate({} {}) rotate(-90)\" font-size=\"{size}\" text-anchor=\"middle\">{}</text>",
            short(x + 0.35 * size),
            short(y),
            escaped(text)
        ));
    }

    /// The document.
    pub(super) fn finish(self) -> String {
        self.text + "</svg>\n"
    }
}

/// Room for a text, px.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    LETTER * size * text.chars().count() as f64
}

/// A text that fits, with `…` where it was longer.
pub(super) fn shortened(text: &str, width: f64, size: f64) -> String {
    let limit = (width / (LETTER * size)) as usize;
    if text.chars().count() <= limit {
        return text.into();
    }
    let kept = text.chars().take(limit.saturating_sub(1));
    kept.chain(['…']).collect()
}

/// The commands of a path through points, each relative to the one before; points on the straight way to the next are left out.
fn relative(points: impl Iterator<Item = (i64, i64)>) -> String {
    let mut path = String::new();
    let mut at: Option<(i64, i64)> = None;
    let mut step = (0, 0);
    let mut write = |(dx, dy): (i64, i64)| {
        // Writing to a string does not fail.
        let _ = match (dx, dy) {
            (0, 0) => Ok(()),
            (0, _) => write!(path, "v{dy}"),
            (_, 0) => write!(path, "h{dx}"),
            (_, 0..) => write!(path, "l{dx} {dy}"),
            _ => write!(path, "l{dx}{dy}"),
        };
    };
    let mut start = None;
    for (x, y) in points {
        let Some((x0, y0)) = at.replace((x, y)) else {
            start = Some((x, y));
            continue;
        };
        let next = (x - x0, y - y0);
        let straight = step.0 * next.1 == step.1 * next.0 && step.0 * next.0 + step.1 * next.1 >= 0;
        if straight {
            step = (step.0 + next.0, step.1 + next.1);
        } else {
            write(step);
            step = next;
        }
    }
    write(step);
    start.map_or(String::new(), |(x, y)| format!("M{x} {y}{path}"))
}

/// A coordinate to a hundredth of a pixel.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

/// Text as SVG and HTML take it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_written_in_steps_and_straight_ways_in_one() {
        let path = |points: &[(i64, i64)]| relative(points.iter().copied());
        assert_eq!(path(&[]), "");
        assert_eq!(path(&[(3, -4)]), "M3 -4");
        assert_eq!(path(&[(0, 0), (1, 2), (2, 4), (2, 4), (3, 6)]), "M0 0l3 6");
        assert_eq!(
            path(&[(0, 0), (5, 0), (5, 9), (5, 2), (6, 1)]),
            "M0 0h5v9v-7l1-1"
        );
    }

    #[test]
    fn thirty_two_curves_are_told_apart() {
        let looks: Vec<Stroke> = (0..32).map(Stroke::curve).collect();
        for (k, a) in looks.iter().enumerate() {
            assert!(looks[..k].iter().all(|b| a != b), "{k}");
        }
    }

    #[test]
    fn numbers_are_short_and_text_fits() {
        assert_eq!(
            [1.0, 2.345, -0.001, 10.5].map(short),
            ["1", "2.35", "0", "10.5"]
        );
        assert_eq!(shortened("voltage", 40.0, 10.0), "volta…");
        assert_eq!(shortened("voltage", 47.0, 10.0), "voltage");
    }
}
