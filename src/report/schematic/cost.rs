//! How bad a plan for a circuit picture is.

use super::grid::{COLUMN, GROUND, Grid, LEVEL, Plan, Pose, Rise, Run};
use super::part::{Part, Parts, Symbol, Transistor};
use crate::circuit::Output;

/// What is wrong costs more than anything that is not nice.
pub(super) const WRONG: i64 = 5_000;
const CROSSING: i64 = 60;
/// A grid step of a trunk, of the ground rail, of a vertical wire.
const ACROSS: i64 = 2;
const RAIL: i64 = 1;
const UPWARDS: i64 = 4;
/// A column of the width, those from which on it costs its square, a level of the height, a level of a net.
const WIDTH: i64 = 4;
const WIDE: i64 = 10;
const HEIGHT: i64 = 45;
const RAISED: i64 = 8;
/// A ground symbol of its own, and one that stands on something else.
const GROUNDED: i64 = 8;
const CROWDED: i64 = 2_500;
/// A name that has no room.
const NAMELESS: i64 = 60;
/// A column that the first source, any other source is away from the left edge.
const LATE: (i64, i64) = (8, 0);
/// A part against its habit.
const AGAINST: i64 = 14;
/// Coupled inductors that do not stand side by side.
const APART: i64 = 400;

/// How bad a picture is.
pub(super) fn cost(all: &Parts, plan: &Plan) -> i64 {
    let grid = Grid::of(&all.parts, all.nets.len(), plan);
    let mut cost = lengths(plan, &grid);
    for (k, run) in grid.runs.iter().enumerate() {
        cost += grid.runs[..k]
            .iter()
            .map(|other| runs_meet(run, other))
            .sum::<i64>();
        cost += grid
            .rises
            .iter()
            .map(|rise| run_meets_rise(run, rise))
            .sum::<i64>();
    }
    for (k, rise) in grid.rises.iter().enumerate() {
        cost += grid.rises[..k]
            .iter()
            .map(|other| rises_meet(rise, other))
            .sum::<i64>();
    }
    let poses = all.parts.iter().zip(&grid.poses);
    cost += poses.map(|(part, pose)| habit(part, *pose)).sum::<i64>();
    let placed = all.parts.iter().zip(&plan.columns);
    let mut late = LATE.0;
    for (_, column) in placed.filter(|(part, _)| matches!(part.symbol, Symbol::Source(..))) {
        cost += late * i64::from(*column);
        late = LATE.1;
    }
    cost += grid
        .grounds
        .iter()
        .map(|own| crowd(*own, &grid))
        .sum::<i64>();
    for (a, b, _) in &all.couplings {
        let is_beside = (plan.columns[*a] - plan.columns[*b]).abs() == 1;
        let is_upright = matches!(grid.poses[*a], Pose::Upright { .. });
        if !(is_beside && is_upright && same_slot(grid.poses[*a], grid.poses[*b])) {
            cost += APART;
        }
    }
    cost
}

/// A ground symbol of its own, and what lies right under it.
fn crowd((x, level): (i32, i32), grid: &Grid) -> i64 {
    let is_under = |run: &&Run| run.level == level && run.x.0 < x + 2 && run.x.1 > x - 2;
    let under = grid.runs.iter().filter(is_under).map(|run| match run.net {
        None => CROWDED,
        // The name of its net.
        Some(_) if run.x.0 == run.x.1 => NAMELESS,
        Some(_) => GROUNDED,
    });
    GROUNDED + under.sum::<i64>()
}

/// Whether two parts stand at the same height.
pub(super) fn same_slot(a: Pose, b: Pose) -> bool {
    matches!((a, b), (Pose::Upright { slot: a, .. }, Pose::Upright { slot: b, .. }) if a == b)
}

/// What wires and the sheet cost by their size.
fn lengths(plan: &Plan, grid: &Grid) -> i64 {
    let mut cost = 0;
    let (mut low, mut high) = (i32::MAX, i32::MIN);
    for run in &grid.runs {
        let length = i64::from(run.x.1 - run.x.0);
        cost += match run.net {
            Some(GROUND) => RAIL * length,
            Some(_) => ACROSS * length,
            None => 0,
        };
        (low, high) = (low.min(run.x.0), high.max(run.x.1));
    }
    for rise in grid.rises.iter().filter(|rise| rise.net.is_some()) {
        cost += UPWARDS * i64::from(rise.y.1 - rise.y.0);
    }
    let tallest = plan.levels.iter().copied().max().unwrap_or(0);
    let width = i64::from((high - low).max(0) / COLUMN);
    let beyond = (width - WIDE).max(0);
    cost += i64::from(tallest) * HEIGHT + width * WIDTH + 2 * beyond * beyond;
    cost + plan
        .levels
        .iter()
        .map(|l| RAISED * i64::from((l - 1).max(0)))
        .sum::<i64>()
}

/// Two stretches of one level that are not the same wire have to stay apart; a part touches its own trunks.
fn runs_meet(a: &Run, b: &Run) -> i64 {
    if a.level != b.level {
        return 0;
    }
    let shared = a.x.1.min(b.x.1) - a.x.0.max(b.x.0);
    let overlaps = a.x.0 < b.x.1 && b.x.0 < a.x.1;
    let touches = shared == 0 && a.net.is_some() && b.net.is_some();
    if overlaps || touches {
        return WRONG + i64::from(shared) * 50;
    }
    0
}

fn run_meets_rise(run: &Run, rise: &Rise) -> i64 {
    let level = LEVEL * run.level;
    if level <= rise.y.0 || level >= rise.y.1 || rise.x.1 < run.x.0 || rise.x.0 > run.x.1 {
        return 0;
    }
    match (run.net, rise.net) {
        (Some(a), Some(b)) if a == b => CROSSING / 2,
        (Some(_), Some(_)) if rise.x.0 > run.x.0 && rise.x.0 < run.x.1 => CROSSING,
        _ => WRONG,
    }
}

fn rises_meet(a: &Rise, b: &Rise) -> i64 {
    let is_apart = a.x.1 < b.x.0 || b.x.1 < a.x.0;
    let shared = a.y.1.min(b.y.1) - a.y.0.max(b.y.0);
    if is_apart || shared <= 0 {
        return 0;
    }
    match (a.net, b.net) {
        (Some(a), Some(b)) if a == b => CROSSING / 2,
        _ => WRONG + i64::from(shared) * 50,
    }
}

/// What a reader expects: sources with + above, valves that point up or right, transistors upright.
fn habit(part: &Part, pose: Pose) -> i64 {
    let (is_upright, reversed) = match pose {
        Pose::Upright { reversed, .. } => (true, reversed),
        Pose::Lying { reversed, .. } => (false, reversed),
        Pose::Boxed { slot, .. } => return 2 * AGAINST * i64::from(slot),
    };
    match part.symbol {
        Symbol::Source(Output::Voltage, _) => match (is_upright, reversed) {
            (true, false) => 0,
            (true, true) => 2 * AGAINST,
            (false, _) => AGAINST,
        },
        // The arrow of an anode first: up is its second pin above.
        Symbol::Diode | Symbol::Thyristor | Symbol::Triac | Symbol::Zener => {
            if is_upright == reversed { 0 } else { AGAINST }
        }
        Symbol::Source(..) | Symbol::Controlled(_) => {
            AGAINST / 2 * i64::from(!is_upright || reversed)
        }
        Symbol::Transistor(kind) => match (is_upright, reversed == kind.is_p()) {
            (true, true) => 0,
            (true, false) => 2 * AGAINST,
            // Only upright ones have a wire to their base.
            (false, _) if part.nets.len() > 2 && matches!(kind, Transistor::Bipolar { .. }) => {
                20 * AGAINST
            }
            (false, _) => AGAINST,
        },
        Symbol::Inductor if !part.is_wound => AGAINST / 3 * i64::from(is_upright),
        _ => 0,
    }
}
