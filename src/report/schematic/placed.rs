//! A schematic as its own sheet has it: wires, symbols and labels where they were drawn.

use super::super::sheet::{Anchor, INK, width_of};
use super::super::svg::titled;
use super::canvas::Canvas;
use super::cards::pin_of;
use super::drawing::{States, drawn_symbol};
use super::part::{Part, Parts, Symbol};
use super::symbol::{self, GATE, beside};
use super::words::{
    FAINT, SMALL, TEXT, WIRE, ground, headed, lying_words, named, upright_words, written,
};
use crate::netlist::ast::{self, Spot};

/// px for a unit of a sheet: words of neighbours 96 units apart have room.
const SCALE: f64 = 1.25;
const MARGIN: f64 = 24.0;
/// Above the highest and below the lowest point.
const HEAD: f64 = 76.0;
const FOOT: f64 = 48.0;
/// Left and right of what stands at the edge, for words.
const ASIDE: f64 = 96.0;
/// Units between a box and the ends of its pins, and around pins at its sides.
const LEAD: i64 = 12;

/// A part with the places of its pins.
type PlacedPart<'a> = (&'a Part, &'a ast::PlacedSymbol);

/// Draws the parts of a circuit as its sheet places them; those that are not on it are named below.
pub(super) fn draw(all: &Parts, sheet: &ast::Sheet, states: States<'_>, title: &str) -> String {
    let part = |name: &str| all.parts.iter().find(|part| part.name == name);
    let placed: Vec<PlacedPart<'_>> = (sheet.symbols.iter())
        .filter_map(|own| Some((part(&own.name)?, own)))
        .collect();
    let view = View::of(sheet, &placed);
    let room = (width_of(title, 15.0) + MARGIN).min(1200.0);
    let mut drawing = Canvas::on(titled(view.size.0.max(room), view.size.1, title));
    for (from, to) in &sheet.wires {
        drawing.line(view.at(*from), view.at(*to), WIRE);
    }
    for joint in joints(sheet, &placed) {
        drawing.sheet.dot(view.at(joint), 3.2, INK);
    }
    for own in &placed {
        view.part(&mut drawing, own, states);
    }
    for (at, name) in &sheet.labels {
        let (x, y) = view.at(*at);
        match name.as_str() {
            "0" | "gnd" => ground(&mut drawing, (x, y)),
            name => {
                let beside = |down: f64| {
                    [
                        ((x + 4.0, y + down), Anchor::Start),
                        ((x - 4.0, y + down), Anchor::End),
                    ]
                };
                // Beside a wire that goes up from there, not on it.
                let middle = ((x, y - 7.0), Anchor::Middle);
                let mut places = beside(-7.0).to_vec();
                places.insert(if goes_up(sheet, *at) { 2 } else { 0 }, middle);
                places.extend(beside(9.0));
                named(&mut drawing, name, places);
            }
        }
    }
    let coupled = all
        .couplings
        .iter()
        .map(|(a, b, words)| format!("{words}: {}, {}", all.parts[*a].name, all.parts[*b].name));
    let elsewhere = (all.parts.iter())
        .filter(|part| !placed.iter().any(|own| own.0.name == part.name))
        .map(|part| {
            let nets = part.nets.iter().map(|net| all.nets[*net].as_str());
            let nets: Vec<&str> = nets.collect();
            format!("{} {}: {}", part.name, part.value, nets.join(", "))
        });
    let below: Vec<String> = coupled.chain(elsewhere).collect();
    let at = (MARGIN, view.size.1 - 10.0);
    drawing
        .sheet
        .text(&below.join("   "), at, SMALL, Anchor::Start);
    drawing.finish()
}

fn spots(own: &ast::PlacedSymbol) -> impl Iterator<Item = Spot> {
    own.pins.iter().map(|pin| pin.1)
}

/// Where wires and pins meet that a dot has to tell apart from a crossing.
fn joints(sheet: &ast::Sheet, placed: &[PlacedPart<'_>]) -> Vec<Spot> {
    let ends = sheet.wires.iter().flat_map(|(a, b)| [*a, *b]);
    let pins = placed.iter().flat_map(|own| spots(own.1));
    let mut spots: Vec<Spot> = ends.chain(pins).collect();
    spots.sort_unstable();
    let ways = |run: &[Spot]| {
        let through = sheet.wires.iter().filter(|wire| passes(**wire, run[0]));
        run.len() + 2 * through.count()
    };
    let runs = spots.chunk_by(|a, b| a == b);
    runs.filter(|run| ways(run) > 2).map(|run| run[0]).collect()
}

/// Whether a wire goes on at both sides of a spot.
fn passes(((ax, ay), (bx, by)): (Spot, Spot), (x, y): Spot) -> bool {
    let is_between = |a: i64, b: i64, v: i64| v > a.min(b) && v < a.max(b);
    (ax == bx && x == ax && is_between(ay, by, y)) || (ay == by && y == ay && is_between(ax, bx, x))
}

/// Whether a wire goes up from a spot.
fn goes_up(sheet: &ast::Sheet, (x, y): Spot) -> bool {
    let covers =
        |(a, b): &(Spot, Spot)| a.0 == x && b.0 == x && a.1.min(b.1) < y && y <= a.1.max(b.1);
    sheet.wires.iter().any(covers)
}

/// How units of the sheet become pixels.
struct View {
    corner: Spot,
    size: (f64, f64),
}

impl View {
    fn of(sheet: &ast::Sheet, placed: &[PlacedPart<'_>]) -> Self {
        let wires = sheet.wires.iter().flat_map(|(a, b)| [*a, *b]);
        let labels = sheet.labels.iter().map(|label| label.0);
        let pins = placed.iter().flat_map(|own| spots(own.1));
        let (mut low, mut high) = ((i64::MAX, i64::MAX), (i64::MIN, i64::MIN));
        for (x, y) in wires.chain(labels).chain(pins) {
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        if low.0 > high.0 {
            (low, high) = ((0, 0), (0, 0));
        }
        let across = (high.0 - low.0) as f64 * SCALE + 2.0 * MARGIN + 2.0 * ASIDE;
        let up = (high.1 - low.1) as f64 * SCALE + HEAD + FOOT;
        Self {
            corner: low,
            size: (across, up),
        }
    }

    fn at(&self, (x, y): Spot) -> (f64, f64) {
        (
            MARGIN + ASIDE + (x - self.corner.0) as f64 * SCALE,
            HEAD + (y - self.corner.1) as f64 * SCALE,
        )
    }

    fn part(&self, drawing: &mut Canvas, (part, own): &PlacedPart<'_>, states: States<'_>) {
        let has_gate = matches!(
            part.symbol,
            Symbol::Transistor(_) | Symbol::Thyristor | Symbol::Triac
        );
        let pins: Vec<Spot> = spots(own).collect();
        match &pins[..] {
            _ if part.symbol == Symbol::Box => self.boxed(drawing, part, own),
            // Drain, gate, source: the gate stands in the middle on the card.
            [first, gate, second, ..] if has_gate => {
                self.along(drawing, part, (*first, *second), &[*gate], states);
            }
            [first, second, others @ ..] => {
                self.along(drawing, part, (*first, *second), others, states);
            }
            _ => {}
        }
    }

    /// A symbol on the line between its two main pins, with leads to the pins beside it: a gate, or what controls it.
    fn along(
        &self,
        drawing: &mut Canvas,
        part: &Part,
        (first, second): (Spot, Spot),
        others: &[Spot],
        states: States<'_>,
    ) {
        let (a, b) = (self.at(first), self.at(second));
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        if length == 0.0 {
            return;
        }
        let centre = (f64::midpoint(a.0, b.0), f64::midpoint(a.1, b.1));
        // Local axes: along the symbol, and to the side its gate is at; without one to the left, or down.
        let u = ((b.0 - a.0) / length, (b.1 - a.1) / length);
        let is_upright = u.1.abs() > u.0.abs();
        let aside = |v: (f64, f64), spot: Spot| {
            let (x, y) = self.at(spot);
            (x - centre.0) * v.0 + (y - centre.1) * v.1
        };
        let turned = (-u.1, u.0);
        let is_there = match others.first() {
            Some(spot) => aside(turned, *spot) >= 0.0,
            None if is_upright => turned.0 < 0.0,
            None => turned.1 > 0.0,
        };
        let v = if is_there {
            turned
        } else {
            (-turned.0, -turned.1)
        };
        let turn = format!("{:.0} {:.0} {:.0} {:.0}", u.0, u.1, v.0, v.1);
        let half = length / 2.0;
        drawn_symbol(drawing, states, part, (&turn, centre), (-half, half));
        let place =
            |(x, y): (f64, f64)| (centre.0 + x * u.0 + y * v.0, centre.1 + x * u.1 + y * v.1);
        let controls = matches!(part.symbol, Symbol::Controlled(_) | Symbol::Switch);
        for (k, spot) in others.iter().enumerate() {
            let (x, y) = (aside(u, *spot), aside(v, *spot));
            if controls {
                let inner = beside(part.symbol).min(y);
                drawing.line(place((x, y)), place((x, inner)), WIRE);
                let sign = if k == 0 { "+" } else { "−" };
                let (cx, cy) = place((x, inner - 8.0));
                written(drawing, sign, (cx, cy + 4.0), (TEXT, INK), Anchor::Middle);
            } else if k == 0 {
                let from = (symbol::gate_along(part.symbol), GATE);
                drawing.line(place(from), place((x, GATE)), WIRE);
                drawing.line(place((x, GATE)), place((x, y)), WIRE);
            }
        }
        if is_upright {
            upright_words(drawing, part, centre, v.0 > 0.5);
        } else {
            lying_words(drawing, part, centre);
        }
    }

    /// A box with a lead to each pin.
    fn boxed(&self, drawing: &mut Canvas, part: &Part, own: &ast::PlacedSymbol) {
        let pins: Vec<Spot> = spots(own).collect();
        let frame = Frame::of(&pins);
        let (x0, y0) = self.at(frame.low);
        let (x1, y1) = self.at(frame.high);
        drawing.boxed((x0, y0), (x1, y1));
        for (k, &pin) in pins.iter().enumerate() {
            let at = self.at(pin);
            let edge = (at.0.clamp(x0, x1), at.1.clamp(y0, y1));
            drawing.line(at, edge, WIRE);
            let name = match own.pins[k].0 {
                8 if part.name.starts_with('a') => "com".into(),
                terminal if part.name.starts_with('a') => {
                    pin_of(&part.value, &format!("p{terminal}")).to_owned()
                }
                _ => part.pins.get(k).cloned().unwrap_or_default(),
            };
            let (to, anchor) = match Side::of(pin, frame.outer) {
                Side::Left => ((edge.0 + 3.0, edge.1 + 3.0), Anchor::Start),
                Side::Right => ((edge.0 - 3.0, edge.1 + 3.0), Anchor::End),
                Side::Top => ((edge.0, edge.1 + 10.0), Anchor::Middle),
                Side::Bottom => ((edge.0, edge.1 - 4.0), Anchor::Middle),
            };
            written(drawing, &name, to, (8.0, FAINT), anchor);
        }
        let middle = f64::midpoint(x0, x1);
        let words = format!("{} {}", part.name, part.value);
        let places = [
            ((middle, y0 - 6.0), Anchor::Middle),
            ((x1, y0 - 6.0), Anchor::End),
            ((x0, y0 - 6.0), Anchor::Start),
            ((middle, y1 + 7.0), Anchor::Middle),
            ((middle, f64::midpoint(y0, y1)), Anchor::Middle),
        ];
        headed(drawing, words.trim_end(), places.to_vec());
    }
}

/// A side of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Top,
    Bottom,
}

impl Side {
    /// The side of the pins' frame (its least and greatest corner) that a pin is nearest to.
    fn of((x, y): Spot, (low, high): (Spot, Spot)) -> Self {
        let ways = [
            (x - low.0, Self::Left),
            (high.0 - x, Self::Right),
            (y - low.1, Self::Top),
            (high.1 - y, Self::Bottom),
        ];
        let nearest = ways.into_iter().min_by_key(|way| way.0);
        nearest.map_or(Self::Left, |way| way.1)
    }
}

/// A box among its pins.
#[derive(Debug)]
struct Frame {
    /// Of the pins.
    outer: (Spot, Spot),
    low: Spot,
    high: Spot,
}

impl Frame {
    fn of(pins: &[Spot]) -> Self {
        let xs = || pins.iter().map(|pin| pin.0);
        let ys = || pins.iter().map(|pin| pin.1);
        let low = (xs().min().unwrap_or(0), ys().min().unwrap_or(0));
        let high = (xs().max().unwrap_or(0), ys().max().unwrap_or(0));
        let outer = (low, high);
        let at = |side: Side| {
            pins.iter()
                .filter(move |pin| Side::of(**pin, outer) == side)
        };
        let flanks = || at(Side::Left).chain(at(Side::Right)).map(|pin| pin.1);
        let x0 = at(Side::Left)
            .map(|pin| pin.0)
            .max()
            .map_or(low.0 - LEAD, |x| x + LEAD);
        let x1 = at(Side::Right)
            .map(|pin| pin.0)
            .min()
            .map_or(high.0 + LEAD, |x| x - LEAD);
        let y0 = at(Side::Top)
            .map(|pin| pin.1)
            .max()
            .map_or(low.1 - LEAD, |y| y + LEAD);
        let y1 = at(Side::Bottom)
            .map(|pin| pin.1)
            .min()
            .map_or(high.1 + LEAD, |y| y - LEAD);
        let y0 = flanks().min().map_or(y0, |y| y0.min(y - LEAD));
        let y1 = flanks().max().map_or(y1, |y| y1.max(y + LEAD));
        // Pins on one line leave no room between them.
        Self {
            outer,
            low: (x0.min(x1 - 2 * LEAD), y0),
            high: (x1, y1.max(y0 + 2 * LEAD)),
        }
    }
}
