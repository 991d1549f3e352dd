//! Where parts and wires are on the grid of a circuit picture.
//!
//! Every net is a horizontal wire, its trunk, at a level; ground's level is 0. A part between nets of different levels stands upright in a column, a
//! part between nets of one level lies on it. So every wire is horizontal or vertical, whatever the columns and levels are; how good
//! the picture is depends on them ([`super::search`]).

use super::part::{Part, Symbol, Transistor};

/// Grid steps across a column: trunks and gates reach parts of one.
pub(super) const COLUMN: i32 = 4;
/// Grid steps up a level: parts take the two in the middle, gates are half-way.
pub(super) const LEVEL: i32 = 4;
/// Net 0.
pub(super) const GROUND: usize = 0;

/// What is chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plan {
    /// By part.
    pub(super) columns: Vec<i32>,
    /// By net; 0 for ground alone.
    pub(super) levels: Vec<i32>,
    /// By part: the level below a box.
    pub(super) slots: Vec<i32>,
}

/// How a part is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pose {
    /// Between the level `slot` and the next; `reversed`: the first pin is below.
    Upright { slot: i32, reversed: bool },
    /// On a level; `reversed`: the first pin is on the right.
    Lying { level: i32, reversed: bool },
    /// A box over `columns` columns.
    Boxed { slot: i32, columns: i32 },
}

/// A vertical stretch of a wire (`net`) or of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rise {
    /// Leftmost and rightmost step.
    pub(super) x: (i32, i32),
    /// Lowest and highest step.
    pub(super) y: (i32, i32),
    pub(super) net: Option<usize>,
}

/// A horizontal stretch of a trunk or of a part that lies on its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) level: i32,
    pub(super) x: (i32, i32),
    pub(super) net: Option<usize>,
}

/// A pin of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BoxPin {
    pub(super) part: usize,
    pub(super) pin: usize,
    pub(super) x: i32,
    pub(super) is_top: bool,
}

/// A plan carried out.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    /// By part.
    pub(super) poses: Vec<Pose>,
    pub(super) rises: Vec<Rise>,
    pub(super) runs: Vec<Run>,
    /// Where something joins the trunk of a net: by net, in order.
    pub(super) pins: Vec<Vec<i32>>,
    pub(super) box_pins: Vec<BoxPin>,
    /// Ground symbols of their own: x and level.
    pub(super) grounds: Vec<(i32, i32)>,
}

impl Grid {
    pub(super) fn of(parts: &[Part], n_nets: usize, plan: &Plan) -> Self {
        let mut grid = Self {
            pins: vec![Vec::new(); n_nets],
            ..Self::default()
        };
        let centres = Centres::of(parts, n_nets, plan);
        for (k, part) in parts.iter().enumerate() {
            let pose = grid.place(k, part, plan, &centres);
            grid.poses.push(pose);
        }
        for (net, pins) in grid.pins.iter_mut().enumerate() {
            pins.sort_unstable();
            if let (Some(&first), Some(&last)) = (pins.first(), pins.last()) {
                grid.runs.push(Run {
                    level: plan.levels[net],
                    x: (first, last),
                    net: Some(net),
                });
            }
        }
        grid
    }

    fn place(&mut self, k: usize, part: &Part, plan: &Plan, centres: &Centres) -> Pose {
        let x = COLUMN * plan.columns[k];
        if part.symbol == Symbol::Box {
            return self.place_box(k, part, plan);
        }
        let (p, n) = (part.nets[0], part.nets[1]);
        let (high, low) = (plan.levels[p], plan.levels[n]);
        if high == low {
            let reversed = centres.is_right_of(p, n, x);
            let ends = if reversed { (n, p) } else { (p, n) };
            self.pins[ends.0].push(x - COLUMN / 2);
            self.pins[ends.1].push(x + COLUMN / 2);
            // The wire of a part that is shorted goes through it.
            if p != n {
                self.runs.push(Run {
                    level: high,
                    x: (x - COLUMN / 2, x + COLUMN / 2),
                    net: None,
                });
            }
            return Pose::Lying {
                level: high,
                reversed,
            };
        }
        let reversed = high < low;
        let (top, bottom) = if reversed { (n, p) } else { (p, n) };
        let slot = plan.levels[top] - 1;
        self.rises.push(Rise {
            x: (x, x),
            y: (LEVEL * slot + 1, LEVEL * (slot + 1) - 1),
            net: None,
        });
        self.ascend(x, slot, top, plan);
        self.descend(x, slot, bottom, plan);
        if is_wired(part) {
            let gate = part.nets[2];
            let (from, to) = (LEVEL * slot + LEVEL / 2, LEVEL * plan.levels[gate]);
            self.rises.push(Rise {
                x: (x - 1, x - 1),
                y: (from.min(to), from.max(to)),
                net: Some(gate),
            });
            self.pins[gate].push(x - 1);
        }
        Pose::Upright { slot, reversed }
    }

    /// From the upper end of a part up to a trunk.
    fn ascend(&mut self, x: i32, slot: i32, net: usize, plan: &Plan) {
        self.rises.push(Rise {
            x: (x, x),
            y: (LEVEL * (slot + 1) - 1, LEVEL * plan.levels[net]),
            net: Some(net),
        });
        self.pins[net].push(x);
    }

    /// From the lower end of a part down to a trunk, or to a ground symbol of its own where ground's is not at the next level.
    fn descend(&mut self, x: i32, slot: i32, net: usize, plan: &Plan) {
        if net == GROUND && slot > 0 {
            self.grounds.push((x, slot));
            return;
        }
        self.rises.push(Rise {
            x: (x, x),
            y: (LEVEL * plan.levels[net], LEVEL * slot + 1),
            net: Some(net),
        });
        self.pins[net].push(x);
    }

    fn place_box(&mut self, k: usize, part: &Part, plan: &Plan) -> Pose {
        let columns = (part.nets.len() as i32 + 1) / 2;
        let left = COLUMN * plan.columns[k] - COLUMN / 2;
        let slot = plan.slots[k];
        let mut places = [left + 1, left + 1];
        for (pin, &net) in part.nets.iter().enumerate() {
            let level = plan.levels[net];
            let is_top = level > slot;
            let x = places[usize::from(is_top)];
            places[usize::from(is_top)] += 2;
            self.box_pins.push(BoxPin {
                part: k,
                pin,
                x,
                is_top,
            });
            if is_top {
                self.ascend(x, slot, net, plan);
            } else {
                self.descend(x, slot, net, plan);
            }
        }
        self.rises.push(Rise {
            x: (left, left + COLUMN * columns),
            y: (LEVEL * slot + 1, LEVEL * (slot + 1) - 1),
            net: None,
        });
        Pose::Boxed { slot, columns }
    }
}

/// Whether a wire leads to the gate: a base, which carries a current. Others have the name of their net.
pub(super) fn is_wired(part: &Part) -> bool {
    matches!(part.symbol, Symbol::Transistor(Transistor::Bipolar { .. })) && part.nets.len() > 2
}

/// Sums of the places of the parts at every net.
struct Centres(Vec<(i64, i64)>);

impl Centres {
    fn of(parts: &[Part], n_nets: usize, plan: &Plan) -> Self {
        let mut sums = vec![(0, 0); n_nets];
        for (part, column) in parts.iter().zip(&plan.columns) {
            for &net in part.nets.iter().take(if part.symbol == Symbol::Box {
                usize::MAX
            } else {
                2
            }) {
                sums[net].0 += i64::from(COLUMN * column);
                sums[net].1 += 1;
            }
        }
        Self(sums)
    }

    /// Whether the other parts at net `p` are further right than those at `n`, for a part at `x`.
    fn is_right_of(&self, p: usize, n: usize, x: i32) -> bool {
        // A net with nothing else pulls nowhere.
        let offset = |net: usize| {
            let (sum, count) = self.0[net];
            let others = count - 1;
            if others < 1 {
                return (0, 1);
            }
            (sum - i64::from(x) * count, others)
        };
        let ((a, n_a), (b, n_b)) = (offset(p), offset(n));
        a * n_b > b * n_a
    }
}
