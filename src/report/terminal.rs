//! Character plots, sized to a terminal.

use super::figure::{Figure, Panel};
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

/// The common axis of all charts: where it begins and ends, as a number and in words.
struct Across {
    range: (f64, f64),
    ends: [String; 2],
}

/// Curves that share a chart, by their names.
struct Chart {
    unit: &'static str,
    curves: Vec<(String, Vec<(f64, f64)>)>,
}

/// As many charts as fit into `lines` lines of `columns` characters; a last line counts the signals that have none.
///
/// With `colours`, signals of one unit share a chart, six at most. Without, each has its own, and the units take turns, so that a current is seen
/// below the first voltage. Empty when there is no row.
#[must_use]
pub fn plot(waves: &Waveforms, columns: usize, lines: usize, colours: bool) -> String {
    let (Some(start), Some(end)) = (waves.time.first(), waves.time.last()) else {
        return String::new();
    };
    let dots = width(columns) * DOTS.0;
    let chart = |signals: Vec<usize>| Chart {
        unit: waves.units[signals[0]],
        curves: (signals.into_iter())
            .map(|j| (waves.names[j].clone(), waves.thinned(j, dots)))
            .collect(),
    };
    let charts = charts(waves, if colours { COLOURS.len() } else { 1 });
    let charts: Vec<Chart> = charts.into_iter().map(chart).collect();
    let (factor, prefix) = si::prefix(start.abs().max(end.abs()));
    let across = Across {
        range: (*start, *end),
        ends: [start, end].map(|t| format!("{} {prefix}s", si::plain(t / factor, 5))),
    };
    drawn(&charts, &across, (columns, lines), colours)
}

/// The same of a response: gains above, phases below, over the logarithm of the frequency.
#[must_use]
pub fn response(figure: &Figure, columns: usize, lines: usize, colours: bool) -> String {
    let Some((start, end)) = figure.span() else {
        return String::new();
    };
    let together = if colours { COLOURS.len() } else { 1 };
    let of_panel = |panel: &Panel| -> Vec<Chart> {
        let curves = panel.series.iter().filter(|s| s.points.len() > 2);
        let curves: Vec<_> = curves.map(|s| (s.name.clone(), s.points.clone())).collect();
        let chart = |curves: &[_]| Chart {
            unit: panel.unit,
            curves: curves.to_vec(),
        };
        curves.chunks(together).map(chart).collect()
    };
    let panels: Vec<Vec<Chart>> = figure.panels.iter().map(of_panel).collect();
    let charts: Vec<Chart> = in_turns(panels);
    let across = Across {
        range: (start, end),
        ends: [start, end].map(|x| si::quantity(10_f64.powf(x), "Hz", 4)),
    };
    drawn(&charts, &across, (columns, lines), colours)
}

/// A value with its unit; decibels and degrees have no prefixes.
fn quantity(value: f64, unit: &str) -> String {
    match unit {
        "dB" | "°" => format!("{} {unit}", si::plain(value, 4)),
        _ => si::quantity(value, unit, 4),
    }
}

/// Characters across a chart.
fn width(columns: usize) -> usize {
    columns.saturating_sub(LABEL_WIDTH).max(MIN_WIDTH)
}

/// The first of each stack, then the second of each, …
fn in_turns<T>(stacks: Vec<Vec<T>>) -> Vec<T> {
    let most = stacks.iter().map(Vec::len).max().unwrap_or(0);
    let mut stacks: Vec<_> = stacks.into_iter().map(Vec::into_iter).collect();
    (0..most)
        .flat_map(|_| {
            stacks
                .iter_mut()
                .filter_map(Iterator::next)
                .collect::<Vec<_>>()
        })
        .collect()
}

/// The charts that fit.
fn drawn(
    charts: &[Chart],
    across: &Across,
    (columns, lines): (usize, usize),
    colours: bool,
) -> String {
    if charts.is_empty() {
        return String::new();
    }
    let shown = (lines / (CHART_LINES.0 + FRAME_LINES)).clamp(1, charts.len());
    let rows = (lines / shown)
        .saturating_sub(FRAME_LINES)
        .clamp(CHART_LINES.0, CHART_LINES.1);
    let width = width(columns);
    let mut text = String::new();
    for of in &charts[..shown] {
        let names = of.curves.iter().enumerate().map(|(k, (name, _))| {
            if colours {
                format!("{}{name}{RESET}", COLOURS[k])
            } else {
                name.clone()
            }
        });
        text.push_str(&names.collect::<Vec<_>>().join(" "));
        text.push('\n');
        text.push_str(&chart(of, across, (width, rows), colours));
        text.push('\n');
    }
    let rest = charts[shown..].iter().flat_map(|chart| &chart.curves);
    let rest: Vec<&str> = rest.map(|(name, _)| name.as_str()).collect();
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
    in_turns(units.into_iter().map(of).collect())
}

/// Curves over their common axis, with the lowest and the highest value beside them.
fn chart(of: &Chart, across: &Across, (width, rows): (usize, usize), colours: bool) -> String {
    let within = |&(x, y): &(f64, f64)| (x, y.clamp(-LARGEST, LARGEST));
    let curves = of.curves.iter();
    let curves: Vec<Vec<(f64, f64)>> = curves
        .map(|(_, points)| points.iter().map(within).collect())
        .collect();
    let (start, end) = across.range;
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
    let unit = of.unit;
    let label = |row: usize| match row {
        0 => format!(" {}", quantity(high, unit)),
        row if row + 1 == rows => format!(" {}", quantity(low, unit)),
        _ => String::new(),
    };
    let drawn = (0..rows).map(|row| canvas.row(row, colours) + &label(row) + "\n");
    let mut text: String = drawn.collect();
    let [first, last] = &across.ends;
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
    use super::super::figure::{Axis, Series};
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

    /// A pole at 1 kHz: −20 dB a decade behind it, and 90° over all.
    #[test]
    fn a_response_has_gain_above_and_phase_below() {
        let response = |k: i32| {
            let frequency = 10_f64.powf(1.0 + 0.1 * f64::from(k));
            (frequency.log10(), 1e3 / frequency)
        };
        let points =
            |value: fn(f64) -> f64| (0..=40).map(response).map(move |(x, r)| (x, value(r)));
        let series = |points: Vec<(f64, f64)>| Series {
            name: "v(out)".into(),
            run: String::new(),
            points,
        };
        let panel = |unit, points| Panel {
            quantity: String::new(),
            unit,
            series: vec![series(points)],
        };
        let gain = |r: f64| -10.0 * (1.0 + r.powi(-2)).log10();
        let phase = |r: f64| -(1.0 / r).atan().to_degrees();
        let figure = Figure {
            title: String::new(),
            axis: Axis::Frequency,
            panels: vec![
                panel("dB", points(gain).collect()),
                panel("°", points(phase).collect()),
            ],
        };
        let text = response_of(&figure);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(text.matches("v(out)").count(), 2, "{text}");
        assert!(
            text.contains("-40 dB") && text.contains("-89.43 °"),
            "{text}"
        );
        assert!(
            rows.iter()
                .any(|row| row.starts_with("10 Hz") && row.ends_with("100 kHz")),
            "{text}"
        );
    }

    fn response_of(figure: &Figure) -> String {
        super::response(figure, 60, 24, false)
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
