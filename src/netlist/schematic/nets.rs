//! Wires to nets.

use std::collections::{BTreeMap, HashMap};

use super::sheet::{Flag, Point};

/// Which net every point of a sheet belongs to, by names.
#[derive(Debug, Default)]
pub(super) struct Nets {
    points: HashMap<Point, usize>,
    /// The representative of each point's set.
    parents: Vec<usize>,
    /// Of sets, by their representative.
    names: HashMap<usize, String>,
    numbered: usize,
    /// How many ends of wires and pins each set has.
    sizes: HashMap<usize, usize>,
}

/// Wires along one line: what they cover, and the points whose sets that belongs to.
type Covered = Vec<(i64, i64, usize)>;

impl Nets {
    /// The nets of wires, labels and pins: points of a wire are one net, also where something else ends on it; where wires cross they are not.
    /// Hands on each label that names a net which has another name.
    pub(super) fn of(
        wires: &[(Point, Point)],
        flags: &[Flag],
        pins: &[Point],
        mut second: impl FnMut(&Flag, &str),
    ) -> Self {
        let mut nets = Self::default();
        for (a, b) in wires {
            let (a, b) = (nets.point(*a), nets.point(*b));
            nets.join(a, b);
        }
        for at in pins.iter().copied().chain(flags.iter().map(|flag| flag.at)) {
            nets.point(at);
        }
        nets.join_on(wires, |p| p.0, |p| p.1);
        nets.join_on(wires, |p| p.1, |p| p.0);
        nets.join_on_slanted(wires);
        let ends = wires.iter().flat_map(|(a, b)| [*a, *b]);
        for at in ends.chain(pins.iter().copied()) {
            let point = nets.point(at);
            let set = nets.root(point);
            *nets.sizes.entry(set).or_default() += 1;
        }
        // Ground is ground whatever else a net is called.
        let is_ground = |flag: &&Flag| is_ground(&flag.name);
        let ordered = flags
            .iter()
            .filter(is_ground)
            .chain(flags.iter().filter(|f| !is_ground(f)));
        for flag in ordered {
            let point = nets.point(flag.at);
            let set = nets.root(point);
            let name = flag.name.replace(char::is_whitespace, "_").to_lowercase();
            let name = if is_ground_name(&name) {
                "0".to_owned()
            } else {
                name
            };
            match nets.names.get(&set) {
                Some(first) if *first != name => second(flag, first),
                Some(_) => {}
                None => {
                    nets.names.insert(set, name);
                }
            }
        }
        nets
    }

    /// The name of the net at a point; nets without a label are `n001`, `n002` and so on, in the order in which they are asked for.
    pub(super) fn name(&mut self, at: Point) -> String {
        let point = self.point(at);
        let set = self.root(point);
        if let Some(name) = self.names.get(&set) {
            return name.clone();
        }
        let taken: Vec<&String> = self.names.values().collect();
        let mut name;
        loop {
            self.numbered += 1;
            name = format!("n{:03}", self.numbered);
            if !taken.contains(&&name) {
                break;
            }
        }
        self.names.insert(set, name.clone());
        name
    }

    /// Whether nothing is at a pin but itself: no wire, label or other pin.
    pub(super) fn is_open(&mut self, at: Point) -> bool {
        let point = self.point(at);
        let set = self.root(point);
        self.sizes.get(&set) == Some(&1) && !self.names.contains_key(&set)
    }

    fn point(&mut self, at: Point) -> usize {
        let next = self.parents.len();
        let point = *self.points.entry(at).or_insert(next);
        if point == next {
            self.parents.push(next);
        }
        point
    }

    fn root(&mut self, mut point: usize) -> usize {
        while self.parents[point] != point {
            self.parents[point] = self.parents[self.parents[point]];
            point = self.parents[point];
        }
        point
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parents[high] = low;
    }

    /// Joins what lies on wires along lines of one coordinate, `across`.
    fn join_on(
        &mut self,
        wires: &[(Point, Point)],
        across: fn(Point) -> i64,
        along: fn(Point) -> i64,
    ) {
        let mut lines: BTreeMap<i64, Covered> = BTreeMap::new();
        for (a, b) in wires {
            if across(*a) == across(*b) {
                let (low, high) = (along(*a).min(along(*b)), along(*a).max(along(*b)));
                let point = self.point(*a);
                lines
                    .entry(across(*a))
                    .or_default()
                    .push((low, high, point));
            }
        }
        // Wires that overlap are one.
        for covered in lines.values_mut() {
            covered.sort_unstable();
            let mut merged: Covered = Vec::with_capacity(covered.len());
            for (low, high, point) in covered.drain(..) {
                match merged.last_mut() {
                    Some((_, end, first)) if low <= *end => {
                        *end = high.max(*end);
                        let first = *first;
                        self.join(first, point);
                    }
                    _ => merged.push((low, high, point)),
                }
            }
            *covered = merged;
        }
        let mut points: Vec<(Point, usize)> = self.points.iter().map(|(at, k)| (*at, *k)).collect();
        points.sort_unstable();
        for (at, point) in points {
            let Some(covered) = lines.get(&across(at)) else {
                continue;
            };
            let after = covered.partition_point(|(low, ..)| *low <= along(at));
            if let Some((_, high, first)) = after.checked_sub(1).map(|k| covered[k])
                && along(at) <= high
            {
                self.join(first, point);
            }
        }
    }

    /// The same for wires that are neither level nor upright, which are few.
    fn join_on_slanted(&mut self, wires: &[(Point, Point)]) {
        /// More are not looked at: every point is compared with every one.
        const MOST: usize = 200;
        let slanted = wires.iter().filter(|(a, b)| a.0 != b.0 && a.1 != b.1);
        let mut points: Vec<(Point, usize)> = self.points.iter().map(|(at, k)| (*at, *k)).collect();
        points.sort_unstable();
        for (a, b) in slanted.take(MOST) {
            let first = self.point(*a);
            let wide = |x: i64| i128::from(x);
            for (at, point) in &points {
                let cross = wide(b.0 - a.0) * wide(at.1 - a.1) - wide(b.1 - a.1) * wide(at.0 - a.0);
                let within = |p: i64, q: i64, r: i64| p.min(q) <= r && r <= p.max(q);
                if cross == 0 && within(a.0, b.0, at.0) && within(a.1, b.1, at.1) {
                    self.join(first, *point);
                }
            }
        }
    }
}

fn is_ground_name(name: &str) -> bool {
    matches!(name, "0" | "gnd")
}

fn is_ground(name: &str) -> bool {
    is_ground_name(&name.to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flag(at: Point, name: &str) -> Flag {
        Flag {
            at,
            name: name.into(),
            place: 0..0,
        }
    }

    #[test]
    fn what_ends_on_a_wire_joins_it_and_crossings_do_not() {
        let wires = [
            ((0, 0), (100, 0)),
            // Ends on the first.
            ((50, 0), (50, 40)),
            // Crosses the first.
            ((80, -20), (80, 20)),
            // Slanted, from the end of the second.
            ((50, 40), (60, 50)),
        ];
        let flags = [flag((0, 0), "a"), flag((80, 20), "B")];
        let pins = [(100, 0), (55, 45), (80, -20), (30, 0), (7, 7)];
        let mut nets = Nets::of(&wires, &flags, &pins, |_, _| panic!());
        let names = pins.map(|at| nets.name(at));
        assert_eq!(names, ["a", "a", "b", "a", "n001"]);
    }

    #[test]
    fn ground_is_ground_and_a_second_name_is_told() {
        let wires = [((0, 0), (100, 0)), ((90, 0), (200, 0))];
        let flags = [
            flag((0, 0), "shield"),
            flag((200, 0), "0"),
            flag((100, 0), "GND"),
        ];
        let mut told = Vec::new();
        let mut nets = Nets::of(&wires, &flags, &[(50, 0)], |flag, first| {
            told.push((flag.name.clone(), first.to_owned()));
        });
        assert_eq!(nets.name((50, 0)), "0");
        assert_eq!(told, [("shield".to_owned(), "0".to_owned())]);
    }

    #[test]
    fn a_pin_alone_is_open() {
        let wires = [((0, 0), (16, 0))];
        let pins = [(0, 0), (50, 50), (60, 60), (60, 60), (70, 70)];
        let mut nets = Nets::of(&wires, &[flag((70, 70), "x")], &pins, |_, _| panic!());
        assert_eq!(
            pins.map(|at| nets.is_open(at)),
            [false, true, false, false, false]
        );
    }

    #[test]
    fn numbers_pass_over_labels() {
        let mut nets = Nets::of(
            &[],
            &[flag((0, 0), "n001")],
            &[(0, 0), (5, 5)],
            |_, _| panic!(),
        );
        assert_eq!(
            (nets.name((5, 5)), nets.name((0, 0))),
            ("n002".into(), "n001".into())
        );
    }
}
