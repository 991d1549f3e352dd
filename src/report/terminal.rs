//! Character plots, sized to a terminal.

use super::si;
use crate::waveform::Waveforms;

/// Dots per character across and down (braille).
const DOTS: (usize, usize) = (2, 4);
/// Characters right of a chart that its y labels take.
const LABEL_WIDTH: usize = 12;
/// The narrowest chart, in characters.
const MIN_WIDTH: usize = 24;
/// The lowest and the tallest chart, in lines.
const CHART_LINES: (usize, usize) = (4, 12);
/// Lines around a chart: its heading, the time axis, a blank.
const FRAME_LINES: usize = 3;
/// Values are drawn within ±this.
const LARGEST: f64 = 1e100;
/// Escape sequences of colours that are read on dark and on light: blue, yellow, green, magenta, cyan, red.
const COLOURS: [&str; 6] = [
    "\x1b[94m", "\x1b[33m", "\x1b[32m", "\x1b[35m", "\x1b[36m", "\x1b[31m",
];
const RESET: &str = "\x1b[0m";

/// As many charts as fit into `lines` lines of `columns` characters; a last line counts the signals that have none.
///
/// With `colours`, signals of one unit share a chart, six at most. Without, each has its own, and the units take turns, so that a current is seen
/// below the first voltage. Empty when there is no row.
#[must_use]
pub fn plot(waves: &Waveforms, columns: usize, lines: usize, colours: bool) -> String {
    if waves.time.is_empty() || waves.width() == 0 {
        return String::new();
    }
    let charts = charts(waves, if colours { COLOURS.len() } else { 1 });
    let shown = (lines / (CHART_LINES.0 + FRAME_LINES)).clamp(1, charts.len());
    let rows = (lines / shown)
        .saturating_sub(FRAME_LINES)
        .clamp(CHART_LINES.0, CHART_LINES.1);
    let width = columns.saturating_sub(LABEL_WIDTH).max(MIN_WIDTH);
    let mut text = String::new();
    for signals in &charts[..shown] {
        let names = signals.iter().enumerate().map(|(k, &j)| {
            let name = &waves.names[j];
            if colours {
                format!("{}{name}{RESET}", COLOURS[k])
            } else {
                name.clone()
            }
        });
        text.push_str(&names.collect::<Vec<_>>().join(" "));
        text.push('\n');
        text.push_str(&chart(waves, signals, (width, rows), colours));
        text.push('\n');
    }
    let rest: Vec<&str> = charts[shown..]
        .iter()
        .flatten()
        .map(|&j| waves.names[j].as_str())
        .collect();
    if !rest.is_empty() {
        text.push_str(&format!("not shown: {}\n", rest.join(" ")));
    }
    text
}

/// The columns of each chart: of one unit, at most so many together; the units take turns.
fn charts(waves: &Waveforms, together: usize) -> Vec<Vec<usize>> {
    let mut units: Vec<&str> = Vec::new();
    for unit in &waves.units {
        if !units.contains(unit) {
            units.push(unit);
        }
    }
    let of = |unit: &str| -> Vec<Vec<usize>> {
        let own: Vec<usize> = (0..waves.width())
            .filter(|&j| waves.units[j] == unit)
            .collect();
        own.chunks(together).map(<[usize]>::to_vec).collect()
    };
    let stacks: Vec<Vec<Vec<usize>>> = units.into_iter().map(of).collect();
    let most = stacks.iter().map(Vec::len).max().unwrap_or(0);
    (0..most)
        .flat_map(|k| stacks.iter().filter_map(move |s| s.get(k).cloned()))
        .collect()
}

/// Curves over the time axis, with the lowest and the highest value beside them.
fn chart(
    waves: &Waveforms,
    signals: &[usize],
    (width, rows): (usize, usize),
    colours: bool,
) -> String {
    let (start, end) = (waves.time[0], waves.time[waves.time.len() - 1]);
    let curves: Vec<Vec<(f64, f64)>> = signals
        .iter()
        .map(|&j| {
            let points = waves.thinned(j, width * DOTS.0).into_iter();
            points
                .map(|(t, y)| (t, y.clamp(-LARGEST, LARGEST)))
                .collect()
        })
        .collect();
    let values = || curves.iter().flatten().map(|p| p.1);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    // A chart needs a range: a constant stands in the middle of one.
    let half = if high > low {
        0.0
    } else {
        (0.5 * high.abs()).max(0.5)
    };
    let (low, high) = (low - half, high + half);
    let mut canvas = Canvas::new(width, rows);
    // What is dense would leave nothing to what is not: the shortest path comes first.
    let climb = |curve: &[(f64, f64)]| -> f64 {
        let steps = curve.windows(2);
        steps.map(|pair| (pair[1].1 - pair[0].1).abs()).sum()
    };
    let mut order: Vec<usize> = (0..curves.len()).collect();
    order.sort_by(|&a, &b| climb(&curves[a]).total_cmp(&climb(&curves[b])));
    for k in order {
        let curve = &curves[k];
        let span = if end > start { end - start } else { 1.0 };
        let at = |&(t, y): &(f64, f64)| {
            let x = (t - start) / span * (width * DOTS.0 - 1) as f64;
            let y = (high - y) / (high - low) * (rows * DOTS.1 - 1) as f64;
            (x.round() as i64, y.round() as i64)
        };
        let mut points = curve.iter().map(at);
        let mut last = points.next();
        while let Some(from) = last {
            let to = points.next();
            canvas.line(from, to.unwrap_or(from), k);
            last = to;
        }
    }
    let unit = waves.units[signals[0]];
    let label = |row: usize| match row {
        0 => format!(" {}", si::quantity(high, unit, 4)),
        row if row + 1 == rows => format!(" {}", si::quantity(low, unit, 4)),
        _ => String::new(),
    };
    let drawn = (0..rows).map(|row| canvas.row(row, colours) + &label(row) + "\n");
    let mut text: String = drawn.collect();
    let (factor, prefix) = si::prefix(start.abs().max(end.abs()));
    let [first, last] = [start, end].map(|t| format!("{} {prefix}s", si::plain(t / factor, 5)));
    let room = width.saturating_sub(first.chars().count());
    text.push_str(&format!("{first}{last:>room$}\n"));
    text
}

/// Characters of dots, each in the colour of the curve that came to it first.
struct Canvas {
    width: usize,
    cells: Vec<(u8, usize)>,
}

impl Canvas {
    fn new(width: usize, rows: usize) -> Self {
        Self {
            width,
            cells: vec![(0, 0); width * rows],
        }
    }

    /// The dots of curve `k` between two points.
    fn line(&mut self, (x0, y0): (i64, i64), (x1, y1): (i64, i64), k: usize) {
        let steps = (x1 - x0).abs().max((y1 - y0).abs()).max(1);
        for step in 0..=steps {
            let part = |from: i64, to: i64| {
                (from * steps + (to - from) * step + steps / 2).div_euclid(steps)
            };
            self.set(part(x0, x1) as usize, part(y0, y1) as usize, k);
        }
    }

    fn set(&mut self, x: usize, y: usize, k: usize) {
        // Unicode counts the dots of a braille letter down its columns, the fourth row last.
        const BITS: [[u8; DOTS.0]; DOTS.1] =
            [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        let at = y / DOTS.1 * self.width + x / DOTS.0;
        if let Some((dots, of)) = self.cells.get_mut(at) {
            if *dots == 0 {
                *of = k;
            }
            *dots |= BITS[y % DOTS.1][x % DOTS.0];
        }
    }

    fn row(&self, row: usize, colours: bool) -> String {
        let cells = &self.cells[row * self.width..(row + 1) * self.width];
        let runs =
            cells.chunk_by(|a, b| a.0 != 0 && b.0 != 0 && a.1 == b.1 || a.0 == 0 && b.0 == 0);
        let written = runs.map(|run| {
            let letters: String = run
                .iter()
                .filter_map(|c| char::from_u32(0x2800 + u32::from(c.0)))
                .collect();
            match run[0] {
                (0, _) => " ".repeat(run.len()),
                (_, k) if colours => format!("{}{letters}{RESET}", COLOURS[k]),
                _ => letters,
            }
        });
        written.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(n_signals: usize) -> Waveforms {
        let time: Vec<f64> = (0..=200).map(|k| f64::from(k) * 1e-4).collect();
        let values = time
            .iter()
            .flat_map(|t| (0..n_signals).map(move |j| (314.0 * t).sin() / (j + 1) as f64))
            .collect();
        Waveforms {
            title: String::new(),
            names: (0..n_signals).map(|j| format!("v({j})")).collect(),
            units: vec!["V"; n_signals],
            time,
            values,
        }
    }

    #[test]
    fn fits_the_terminal_and_counts_the_rest() {
        let text = plot(&waves(5), 80, 24, false);
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
        assert!(text.lines().count() <= 26, "{text}");
        assert!(text.contains("20 ms") && text.contains("1 V"), "{text}");
        assert!(text.ends_with("not shown: v(3) v(4)\n"), "{text}");
    }

    #[test]
    fn a_line_is_drawn_from_corner_to_corner() {
        let line = Waveforms {
            names: vec!["v(a)".into()],
            units: vec!["V"],
            time: vec![0.0, 1.0],
            values: vec![0.0, 1.0],
            ..Waveforms::default()
        };
        let text = plot(&line, 36, 7, false);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[1], format!("{}⢀⣀⠤⠔⠒⠉ 1 V", " ".repeat(18)));
        assert_eq!(rows[4], "⣀⠤⠔⠒⠉⠁                   0 V");
        assert_eq!(rows[5], format!("0 s{:>21}", "1 s"));
    }

    #[test]
    fn a_current_is_seen_below_the_first_voltage_and_colours_share_a_chart() {
        let mut waves = waves(5);
        waves.units[4] = "A";
        waves.names[4] = "i(l1)".into();
        let plain = plot(&waves, 80, 16, false);
        assert!(
            plain.contains("\ni(l1)\n") && plain.ends_with("not shown: v(1) v(2) v(3)\n"),
            "{plain}"
        );
        assert!(!plain.contains('\x1b'));
        let coloured = plot(&waves, 80, 16, true);
        for (name, colour) in [("v(0)", 0), ("v(3)", 3), ("i(l1)", 0)] {
            let name = format!("{}{name}{RESET}", COLOURS[colour]);
            assert!(coloured.contains(&name), "{coloured}");
        }
        assert!(!coloured.contains("not shown"));
    }

    #[test]
    fn what_is_dense_hides_nothing() {
        let time: Vec<f64> = (0..2000).map(f64::from).collect();
        let values = (0..2000).flat_map(|k| [12.0 * f64::from(k % 2), 5.0]);
        let waves = Waveforms {
            names: vec!["v(sw)".into(), "v(out)".into()],
            units: vec!["V"; 2],
            values: values.collect(),
            time,
            ..Waveforms::default()
        };
        let text = plot(&waves, 60, 16, true);
        let out = text.lines().skip(1).any(|line| line.contains(COLOURS[1]));
        assert!(out, "{text}");
    }

    #[test]
    fn nothing_and_constants_and_tiny_terminals_are_fine() {
        assert_eq!(plot(&Waveforms::default(), 80, 24, true), "");
        let constant = Waveforms {
            values: vec![0.0; 201],
            ..waves(1)
        };
        assert!(plot(&constant, 0, 0, false).contains("v(0)"));
        let huge = Waveforms {
            values: vec![f64::MAX; 201],
            ..waves(1)
        };
        assert!(plot(&huge, 80, 24, true).contains("v(0)"));
    }
}
