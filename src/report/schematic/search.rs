//! Columns and levels for a circuit picture: from the sources outwards, then changed as long as the picture gets better.
//!
//! The search is threshold accepting (G. Dueck and T. Scheuer, J. Comput. Phys. 90, 1990) in whole numbers with a fixed sequence of
//! trials, so that a circuit has the same picture everywhere.

use super::cost::{WRONG, cost};
use super::grid::{GROUND, Grid, Plan};
use super::part::{Part, Parts, Symbol};
use crate::circuit::Output;

/// Pairs of stretches that one search may look at.
const WORK: usize = 60_000_000;
/// Trials, at most.
const TRIALS: usize = 60_000;
/// Searches from the same start, of which the best counts.
const SEARCHES: u64 = 3;
/// One trial of so many reads the picture from right to left.
const MIRRORED: usize = 300;
/// What a trial may lose at first.
const HOT: i64 = 150;
/// Levels that are tried.
const HIGHEST: i32 = 5;

/// The best plan that is found; in every one wires of different nets meet at crossings alone.
pub(super) fn plan(parts: &Parts) -> Plan {
    let start = first(parts);
    let pairs = parts.parts.len() * (parts.parts.len() + parts.nets.len());
    let trials = (WORK / pairs.max(1)).min(TRIALS);
    let found = (1..=SEARCHES).map(|seed| searched(parts, &start, trials, seed));
    let best = found.min_by_key(|(price, _)| *price);
    let (price, mut plan) = best.unwrap_or((WRONG, start));
    if price >= WRONG {
        plan = searched(parts, &apart(parts), trials, 1).1;
    }
    tight(parts, plan)
}

/// A level for every net and a column for every part: nothing can overlap.
fn apart(all: &Parts) -> Plan {
    let mut next = 0;
    let columns = all.parts.iter().map(|part| {
        next += width(part);
        next - width(part)
    });
    Plan {
        columns: columns.collect(),
        levels: (0..all.nets.len() as i32).collect(),
        slots: vec![0; all.parts.len()],
    }
}

/// The best of so many trials, with its cost.
fn searched(parts: &Parts, start: &Plan, trials: usize, seed: u64) -> (i64, Plan) {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let mut now = (cost(parts, start), start.clone());
    let mut best = now.clone();
    for trial in 0..trials {
        let allowed = HOT * (trials - trial) as i64 / trials as i64;
        // Quadratic: most trials are made when little is lost any more.
        let allowed = allowed * allowed / HOT;
        let tried = changed(parts, &now.1, &mut random);
        let price = cost(parts, &tried);
        if price <= now.0 + allowed {
            now = (price, tried);
            if now.0 < best.0 {
                best = now.clone();
            }
        }
    }
    best
}

/// Nets outwards from the first source, all at one level: a chain of sections is then drawn as such.
fn first(all: &Parts) -> Plan {
    let parts = &all.parts;
    let mut columns: Vec<Option<i32>> = vec![None; parts.len()];
    let mut next = 0;
    let mut queue: Vec<usize> = Vec::new();
    let source = |p: &Part| matches!(p.symbol, Symbol::Source(Output::Voltage, _));
    let begin = parts.iter().find(|p| source(p)).or(parts.first());
    queue.extend(
        begin
            .into_iter()
            .flat_map(|p| &p.nets)
            .filter(|n| **n != GROUND),
    );
    let mut seen = vec![false; all.nets.len()];
    seen[GROUND] = true;
    let mut unseen = 0;
    loop {
        while let Some(net) = (!queue.is_empty()).then(|| queue.remove(0)) {
            if std::mem::replace(&mut seen[net], true) {
                continue;
            }
            // What leads to ground first, then what leads on.
            for leads_on in [false, true] {
                for (k, part) in parts.iter().enumerate() {
                    let is_here = part.nets.contains(&net) && columns[k].is_none();
                    let others = part.nets.iter().any(|n| *n != net && *n != GROUND);
                    if is_here && others == leads_on {
                        columns[k] = Some(next);
                        next += width(part);
                        queue.extend(part.nets.iter().filter(|n| !seen[**n]));
                    }
                }
            }
        }
        // Another island.
        while unseen < seen.len() && seen[unseen] {
            unseen += 1;
        }
        if unseen == seen.len() {
            break;
        }
        queue.push(unseen);
    }
    Plan {
        columns: columns.into_iter().map(|c| c.unwrap_or(0)).collect(),
        levels: (0..all.nets.len())
            .map(|net| i32::from(net != GROUND))
            .collect(),
        slots: vec![0; parts.len()],
    }
}

const fn width(part: &Part) -> i32 {
    match part.symbol {
        Symbol::Box => (part.nets.len() as i32 + 1) / 2,
        _ => 1,
    }
}

/// A plan with one thing changed.
fn changed(parts: &Parts, plan: &Plan, random: &mut Random) -> Plan {
    let mut plan = plan.clone();
    let n_parts = parts.parts.len();
    let last = plan.columns.iter().copied().max().unwrap_or(0);
    let part = random.below(n_parts);
    let column = random.below(last as usize + 2) as i32;
    let net = random.below(parts.nets.len());
    if random.below(MIRRORED) == 0 {
        for (own, part) in plan.columns.iter_mut().zip(&parts.parts) {
            *own = (last + 1 - *own - width(part)).max(0);
        }
        return plan;
    }
    match random.below(8) {
        0 | 1 => plan.columns[part] = column,
        2 => {
            let other = random.below(n_parts);
            plan.columns.swap(part, other);
        }
        3 => {
            // Room for a part, or the room of one taken away.
            let by = if random.below(2) == 0 { 1 } else { -1 };
            for own in plan
                .columns
                .iter_mut()
                .filter(|own| **own >= column && **own > 0)
            {
                *own += by;
            }
            if random.below(2) == 0 {
                plan.columns[part] = column;
            }
        }
        4 | 5 if net != GROUND => plan.levels[net] = 1 + random.below(HIGHEST as usize) as i32,
        6 if net != GROUND => {
            let other = random.below(parts.nets.len());
            if other != GROUND {
                plan.levels.swap(net, other);
            }
        }
        _ => {
            // A part elsewhere, one of its nets with it.
            plan.columns[part] = column;
            let nets = &parts.parts[part].nets;
            let net = nets[random.below(nets.len())];
            if net != GROUND {
                plan.levels[net] = 1 + random.below(HIGHEST as usize) as i32;
            }
            plan.slots[part] = random.below(HIGHEST as usize) as i32;
        }
    }
    plan
}

/// Without the columns and levels that nothing needs.
fn tight(parts: &Parts, mut plan: Plan) -> Plan {
    let taken: Vec<i32> = parts
        .parts
        .iter()
        .zip(&plan.columns)
        .flat_map(|(part, column)| *column..column + width(part))
        .collect();
    let rank = |of: &[i32], value: i32| {
        let mut below: Vec<i32> = of.iter().copied().filter(|o| *o < value).collect();
        below.sort_unstable();
        below.dedup();
        below.len() as i32
    };
    plan.columns = plan.columns.iter().map(|c| rank(&taken, *c)).collect();
    let boxes = parts
        .parts
        .iter()
        .zip(&plan.slots)
        .filter(|(part, _)| part.symbol == Symbol::Box);
    let mut levels: Vec<i32> = boxes.flat_map(|(_, slot)| [*slot, slot + 1]).collect();
    levels.extend(&plan.levels);
    let grid = Grid::of(&parts.parts, parts.nets.len(), &plan);
    levels.extend(grid.grounds.iter().map(|ground| ground.1));
    levels.push(0);
    plan.slots = plan.slots.iter().map(|s| rank(&levels, *s)).collect();
    plan.levels = plan.levels.iter().map(|l| rank(&levels, *l)).collect();
    plan
}

/// A fixed sequence (xorshift: G. Marsaglia, J. Stat. Softw. 8, 2003).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % bound.max(1)
    }
}
