//! A circuit picture on its sheet.

use super::super::sheet::{Anchor, INK, escaped, short, width_of};
use super::super::svg::titled;
use super::canvas::{Area, Canvas, Place};
use super::grid::{self, COLUMN, GROUND, Grid, LEVEL, Plan, Pose, Rise, Run};
use super::part::{Part, Parts, brief};
use super::words::{
    ABOVE, FAINT, SMALL, TEXT, WIRE, ground, lying_words, named, upright_words, written,
};
use super::{cost, symbol};

/// px across a grid step and up one.
const STEP: (f64, f64) = (28.0, 26.0);
const MARGIN: f64 = 24.0;
/// Below the title, and below the lowest level for ground.
const HEAD: f64 = 84.0;
const FOOT: f64 = 44.0;
/// Right of the last part, for its words.
const ASIDE: f64 = 96.0;
/// From the end of a lead to a ground symbol of its own.
const SHORT: f64 = 16.0;

/// What is coloured.
#[derive(Debug, Clone, Copy)]
pub(super) enum States<'a> {
    /// Elements of these names.
    Of(&'a [String]),
    /// What can conduct, twice.
    Both,
}

/// A picture that is being drawn.
pub(super) struct Drawing<'a> {
    parts: &'a Parts,
    plan: &'a Plan,
    grid: &'a Grid,
    states: States<'a>,
    /// Leftmost step and highest level.
    corner: (i32, i32),
    size: (f64, f64),
}

impl<'a> Drawing<'a> {
    pub(super) fn new(
        parts: &'a Parts,
        plan: &'a Plan,
        grid: &'a Grid,
        states: States<'a>,
    ) -> Self {
        let runs = || {
            grid.runs
                .iter()
                .map(|r| r.x)
                .chain(grid.rises.iter().map(|r| r.x))
        };
        let left = runs().map(|x| x.0).min().unwrap_or(0) - 1;
        let right = runs().map(|x| x.1).max().unwrap_or(0);
        let boxes = grid.poses.iter().map(|pose| match pose {
            Pose::Boxed { slot, .. } => slot + 1,
            _ => 0,
        });
        let top = plan.levels.iter().copied().chain(boxes).max().unwrap_or(0);
        let grounds = grid.grounds.iter().map(|g| g.1);
        let bottom = grid
            .runs
            .iter()
            .map(|r| r.level)
            .chain(grounds)
            .min()
            .unwrap_or(0);
        let across = f64::from(right - left) * STEP.0 + 2.0 * MARGIN + ASIDE;
        let up = f64::from(LEVEL * (top - bottom)) * STEP.1 + HEAD + FOOT;
        Self {
            parts,
            plan,
            grid,
            states,
            corner: (left, top),
            size: (across, up),
        }
    }

    /// The place of a grid step.
    fn at(&self, x: i32, y: i32) -> (f64, f64) {
        let down = f64::from(LEVEL * self.corner.1 - y);
        (
            MARGIN + f64::from(x - self.corner.0) * STEP.0,
            HEAD + down * STEP.1,
        )
    }

    pub(super) fn draw(&self, title: &str) -> String {
        let room = (width_of(title, 15.0) + MARGIN).min(1200.0);
        let mut sheet = Canvas::on(titled(self.size.0.max(room), self.size.1, title));
        self.wires(&mut sheet);
        for k in 0..self.parts.parts.len() {
            self.part(&mut sheet, k);
        }
        self.couplings(&mut sheet);
        self.nets(&mut sheet);
        sheet.finish()
    }

    fn wires(&self, sheet: &mut Canvas) {
        for run in self
            .grid
            .runs
            .iter()
            .filter(|run| run.net.is_some() && run.x.0 < run.x.1)
        {
            let y = LEVEL * run.level;
            sheet.line(self.at(run.x.0, y), self.at(run.x.1, y), WIRE);
        }
        for rise in self.grid.rises.iter().filter(|rise| rise.net.is_some()) {
            sheet.line(
                self.at(rise.x.0, rise.y.0),
                self.at(rise.x.0, rise.y.1),
                WIRE,
            );
        }
        for run in &self.grid.runs {
            let Some(net) = run.net else { continue };
            let mut places = self.grid.pins[net].clone();
            places.dedup();
            for x in places
                .into_iter()
                .filter(|&x| self.branches(net, run, x) > 2)
            {
                sheet.sheet.dot(self.at(x, LEVEL * run.level), 3.2, INK);
            }
        }
        if let Some(&x) = self.grid.pins[GROUND].first() {
            let (x, y) = self.at(x, 0);
            sheet.line((x, y), (x, y + SHORT), WIRE);
            ground(sheet, (x, y + SHORT));
        }
    }

    /// How many ways lead away from a point of a trunk.
    fn branches(&self, net: usize, run: &Run, x: i32) -> usize {
        let ways = usize::from(x > run.x.0) + usize::from(x < run.x.1);
        let pins = self.grid.pins[net].iter().filter(|own| **own == x).count();
        let is_grounded = net == GROUND && self.grid.pins[GROUND].first() == Some(&x);
        ways + pins + usize::from(is_grounded)
    }

    fn part(&self, sheet: &mut Canvas, k: usize) {
        let part = &self.parts.parts[k];
        let x = COLUMN * self.plan.columns[k];
        match self.grid.poses[k] {
            Pose::Boxed { slot, columns } => self.boxed(sheet, k, slot, columns),
            Pose::Lying { level, reversed } => {
                let at = self.at(x, LEVEL * level);
                let turn = if reversed { "-1 0 0 1" } else { "1 0 0 1" };
                let half = f64::from(COLUMN / 2) * STEP.0;
                drawn_symbol(sheet, self.states, part, (turn, at), (-half, half));
                lying_words(sheet, part, at);
                if part.nets.len() > 2 {
                    let gate = &self.parts.nets[part.nets[2]];
                    let at = (at.0 + gate_x(part, reversed), at.1 + symbol::GATE + 8.0);
                    let lower = (at.0, at.1 + 13.0);
                    let places = [at, lower].map(|at| (at, Anchor::Middle));
                    named(sheet, gate, places.to_vec());
                }
            }
            Pose::Upright { slot, reversed } => {
                let (cx, cy) = self.at(x, LEVEL * slot + LEVEL / 2);
                let is_right = self
                    .partner(k)
                    .is_some_and(|other| self.plan.columns[other] < self.plan.columns[k]);
                let is_left = self.partner(k).is_some() && !is_right;
                let turn = match (reversed, is_right) {
                    (false, false) => "0 1 -1 0",
                    (true, false) => "0 -1 -1 0",
                    (false, true) => "0 1 1 0",
                    (true, true) => "0 -1 1 0",
                };
                // The rest of the way belongs to wires.
                let half = f64::from(LEVEL / 2 - 1) * STEP.1;
                let is_grounded = self.grid.grounds.contains(&(x, slot));
                let foot = f64::from(LEVEL / 2) * STEP.1 - SHORT;
                let lower = if is_grounded { foot } else { half };
                let ends = if reversed {
                    (-lower, half)
                } else {
                    (-half, lower)
                };
                drawn_symbol(sheet, self.states, part, (turn, (cx, cy)), ends);
                if is_grounded {
                    ground(sheet, (cx, cy + foot));
                }
                upright_words(sheet, part, (cx, cy), is_left);
                if part.nets.len() > 2 && !grid::is_wired(part) {
                    let gate = &self.parts.nets[part.nets[2]];
                    let y = cy + gate_x(part, reversed);
                    let x = cx - symbol::GATE - 3.0;
                    let places = [0.0, -8.0, 8.0].map(|down| ((x, y + down), Anchor::End));
                    named(sheet, gate, places.to_vec());
                }
            }
        }
    }

    /// The inductor beside this one that it is coupled to.
    fn partner(&self, k: usize) -> Option<usize> {
        let pairs = self.parts.couplings.iter();
        let mut others = pairs.filter_map(|&(a, b, _)| match k {
            _ if k == a => Some(b),
            _ if k == b => Some(a),
            _ => None,
        });
        others.find(|&other| self.are_beside(k, other))
    }

    fn are_beside(&self, a: usize, b: usize) -> bool {
        let columns = (self.plan.columns[a] - self.plan.columns[b]).abs();
        columns == 1 && cost::same_slot(self.grid.poses[a], self.grid.poses[b])
    }

    fn boxed(&self, sheet: &mut Canvas, k: usize, slot: i32, columns: i32) {
        let part = &self.parts.parts[k];
        let left = COLUMN * self.plan.columns[k] - COLUMN / 2;
        let inset = (8.0, 22.0);
        let (x0, y1) = self.at(left, LEVEL * slot);
        let (x1, y0) = self.at(left + COLUMN * columns, LEVEL * (slot + 1));
        let inner = ((x0 + inset.0, y0 + inset.1), (x1 - inset.0, y1 - inset.1));
        sheet.boxed(inner.0, inner.1);
        let middle = (f64::midpoint(x0, x1), f64::midpoint(y0, y1));
        let words = format!("{} {}", part.name, brief(&part.value, ABOVE));
        sheet.sheet.text(&words, middle, TEXT, Anchor::Middle);
        for pin in self.grid.box_pins.iter().filter(|pin| pin.part == k) {
            let (x, _) = self.at(pin.x, 0);
            let (edge, end, inside) = if pin.is_top {
                (y0 + inset.1, y0, y0 + inset.1 + 8.0)
            } else {
                (y1 - inset.1, y1, y1 - inset.1 - 8.0)
            };
            let is_grounded = !pin.is_top && self.grid.grounds.contains(&(pin.x, slot));
            let end = if is_grounded { end - SHORT } else { end };
            sheet.line((x, edge), (x, end), WIRE);
            if is_grounded {
                ground(sheet, (x, end));
            }
            if let Some(name) = part.pins.get(pin.pin) {
                written(sheet, name, (x, inside), (8.0, FAINT), Anchor::Middle);
            }
        }
    }

    /// Cores between coupled inductors that stand side by side; the others' couplings in words.
    fn couplings(&self, sheet: &mut Canvas) {
        let mut words = Vec::new();
        for (a, b, name) in &self.parts.couplings {
            let (first, second) = (&self.parts.parts[*a], &self.parts.parts[*b]);
            let Pose::Upright { slot, .. } = self.grid.poses[*a] else {
                words.push(format!("{name}: {}, {}", first.name, second.name));
                continue;
            };
            if !self.are_beside(*a, *b) {
                words.push(format!("{name}: {}, {}", first.name, second.name));
                continue;
            }
            let column = self.plan.columns[*a].min(self.plan.columns[*b]);
            let (x, y) = self.at(COLUMN * column + COLUMN / 2, LEVEL * slot + LEVEL / 2);
            for x in [x - 2.5, x + 2.5] {
                sheet.line((x, y - 22.0), (x, y + 22.0), WIRE);
            }
            written(sheet, name, (x, y - 30.0), (SMALL, FAINT), Anchor::Middle);
        }
        let at = (MARGIN, self.size.1 - 8.0);
        sheet
            .sheet
            .text(&words.join("   "), at, SMALL, Anchor::Start);
    }

    /// Names of the nets, each above the widest gap of its trunk between what meets or crosses it, or where else there is room.
    fn nets(&self, sheet: &mut Canvas) {
        for run in &self.grid.runs {
            let Some(net) = run.net.filter(|net| *net != GROUND) else {
                continue;
            };
            let (level, inside) = (LEVEL * run.level, run.x.0 + 1..run.x.1);
            let crosses = |rise: &&Rise| {
                inside.contains(&rise.x.0) && (rise.y.0 + 1..rise.y.1).contains(&level)
            };
            let crossings = self.grid.rises.iter().filter(crosses).map(|rise| rise.x.0);
            let mut stops: Vec<i32> = crossings
                .chain(self.grid.pins[net].iter().copied())
                .collect();
            stops.sort_unstable();
            let mut gaps: Vec<[i32; 2]> = stops.windows(2).map(|gap| [gap[0], gap[1]]).collect();
            gaps.retain(|gap| gap[1] > gap[0]);
            gaps.sort_by_key(|gap| (gap[0] - gap[1], gap[0]));
            let point = |x: i32| self.at(x, LEVEL * run.level);
            let mut places: Vec<Place> = Vec::new();
            for down in [-8.0, 9.0] {
                places.extend(gaps.iter().map(|gap| {
                    let ((a, y), (b, _)) = (point(gap[0]), point(gap[1]));
                    ((f64::midpoint(a, b), y + down), Anchor::Middle)
                }));
                // Beside what ends there, or goes up from there.
                for (end, aside, anchor) in
                    [(run.x.0, 5.0, Anchor::Start), (run.x.1, -5.0, Anchor::End)]
                {
                    let (x, y) = point(end);
                    places.push(((x + aside, y + down), anchor));
                }
            }
            named(sheet, &self.parts.nets[net], places);
        }
    }
}

/// A part's symbol, turned and placed, with leads to `ends` on its axis.
pub(super) fn drawn_symbol(
    sheet: &mut Canvas,
    states: States<'_>,
    part: &Part,
    (turn, at): (&str, (f64, f64)),
    ends: (f64, f64),
) {
    let place = format!("{} {}", short(at.0), short(at.1));
    let has_gate = part.nets.len() > 2;
    let drawn = |conducts| symbol::drawn(part.symbol, ends, conducts, has_gate);
    let mut body = match states {
        States::Of(conducting) => drawn(conducting.contains(&part.name)),
        States::Both if symbol::can_conduct(part.symbol) => {
            let name = escaped(&part.name);
            let group = |on: u8, hidden| {
                let body = drawn(on == 1);
                format!(
                    "<g class=\"device\" data-device=\"{name}\" data-on=\"{on}\"{hidden}>{body}</g>"
                )
            };
            group(0, "") + &group(1, " display=\"none\"")
        }
        States::Both => drawn(false),
    };
    if part.is_wound {
        body.push_str(&format!(
            "<circle cx=\"-26\" cy=\"-9\" r=\"2.5\" fill=\"{INK}\"/>"
        ));
    }
    let glyph = symbol::glyph(part.symbol);
    // Its body, and the leads on its axis.
    let (half, across) = (20.0, symbol::beside(part.symbol) - 5.0);
    let is_upright = turn.starts_with('0');
    let spot = |x: f64, y: f64| {
        let (x, y) = if is_upright { (y, x) } else { (x, y) };
        (at.0 + x, at.1 + y)
    };
    sheet.takes(Area::between(spot(-half, -across), spot(half, across)));
    let reach = ends.0.abs().max(ends.1.abs());
    sheet.takes(Area::between(spot(-reach, 0.0), spot(reach, 0.0)));
    let sheet = &mut sheet.sheet;
    sheet.raw(&format!("<g transform=\"matrix({turn} {place})\" stroke-width=\"1.4\" stroke-linejoin=\"round\">{body}</g>"));
    if !glyph.is_empty() {
        sheet.raw(&format!("<path transform=\"translate({place})\" d=\"{glyph}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.4\"/>"));
    }
}

/// Where a gate's lead is along the axis of its symbol, as it is turned.
const fn gate_x(part: &Part, reversed: bool) -> f64 {
    let along = symbol::gate_along(part.symbol);
    if reversed { -along } else { along }
}
