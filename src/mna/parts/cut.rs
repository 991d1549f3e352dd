//! The multiports of the parts.

use std::collections::{BTreeMap, BTreeSet};

use super::{Column, Columns, Part};
use crate::mna::{
    Coefficient, Equation, LatchPort, Observed, Pair, Power, SourcePort, StandardMultiport,
    StaticMultiport, StoragePort, SwitchPort,
};

/// What is cut into parts, and what belongs to which.
struct Whole<'a> {
    columns: Columns<'a>,
    /// By column: its part; of columns that no part moves the first.
    part: Vec<usize>,
    /// By told column: the parts that add to it.
    adding: Vec<BTreeSet<usize>>,
    /// By column that is the value, the rate or the other quantity of a source: the source.
    source: Vec<Option<usize>>,
    /// By part: its equations.
    equations: Vec<Vec<usize>>,
    /// By part: what is observed of it, and the parts that an observed quantity is the sum of.
    observed: Vec<Vec<usize>>,
    adds: Vec<BTreeSet<usize>>,
    powers: Vec<Vec<usize>>,
    /// By part: its storage, entries of the metric, pairs, switches, and edges of the graph.
    storage: Vec<Vec<usize>>,
    metric: Vec<Vec<usize>>,
    pairs: Vec<Vec<usize>>,
    switches: Vec<Vec<usize>>,
    edges: Vec<Vec<usize>>,
    /// By column that is a port of storage, a device or a switch: the part.
    owner: Vec<Option<usize>>,
}

/// The parts of a multiport whose columns are joined.
pub(super) fn parts(whole: &StandardMultiport, columns: Columns<'_>) -> Vec<Part> {
    let Some(whole) = Whole::new(whole, columns) else {
        return Vec::new();
    };
    let mut draft = Draft::new(&whole);
    (0..whole.equations.len()).map(|p| draft.part(p)).collect()
}

impl<'a> Whole<'a> {
    fn new(whole: &'a StaticMultiport, columns: Columns<'a>) -> Option<Self> {
        let count = whole.columns.len();
        let root: Vec<usize> = (0..count).map(|c| columns.joined.find(c)).collect();
        let moving = whole.storage.iter().map(|s| [s.state, s.flow]);
        let moving = moving.chain(whole.pairs.iter().map(|p| [p.reverse, p.forward]));
        let moving = moving.chain(whole.switches.iter().map(|s| [s.v, s.i]));
        let mut moves = vec![false; count];
        for c in moving.flatten().filter(|&c| columns.is_unknown(c)) {
            moves[root[c]] = true;
        }
        let (mut number, mut parts) = (vec![None; count], 0);
        let mut part = vec![0; count];
        for c in (0..count).filter(|&c| columns.is_unknown(c) && moves[root[c]]) {
            part[c] = *number[root[c]].get_or_insert_with(|| {
                parts += 1;
                parts - 1
            });
        }
        if parts < 2 {
            return None;
        }
        let mut source = vec![None; count];
        for (k, s) in whole.sources.iter().enumerate() {
            let own = [Some(s.value), Some(s.other), s.rate];
            own.into_iter().flatten().for_each(|c| source[c] = Some(k));
        }
        let mut out = Self {
            adding: vec![BTreeSet::new(); count],
            adds: vec![BTreeSet::new(); whole.observed.len()],
            source,
            equations: vec![Vec::new(); parts],
            observed: vec![Vec::new(); parts],
            powers: vec![Vec::new(); parts],
            storage: vec![Vec::new(); parts],
            metric: vec![Vec::new(); parts],
            pairs: vec![Vec::new(); parts],
            switches: vec![Vec::new(); parts],
            edges: vec![Vec::new(); parts],
            owner: vec![None; count],
            part,
            columns,
        };
        let controlled = out.share_ports();
        out.share_equations();
        out.share_observed(&controlled);
        out.share_edges();
        Some(out)
    }

    /// Gives every part its storage, pairs and switches; returns by observed quantity the part whose switch it controls.
    fn share_ports(&mut self) -> Vec<Option<usize>> {
        let whole = self.whole();
        let storage = whole.storage.iter().map(|s| [s.state, s.flow]);
        for (k, columns) in storage.enumerate() {
            let p = self.own(columns);
            self.storage[p].push(k);
        }
        for (k, (a, ..)) in whole.metric.iter().enumerate() {
            let p = self.owner[whole.storage[*a].state].unwrap_or(0);
            self.metric[p].push(k);
        }
        for (k, pair) in whole.pairs.iter().enumerate() {
            let p = self.own([pair.reverse, pair.forward]);
            self.pairs[p].push(k);
        }
        let mut controlled = vec![None; whole.observed.len()];
        for (k, switch) in whole.switches.iter().enumerate() {
            let p = self.own([switch.v, switch.i]);
            self.switches[p].push(k);
            controlled[switch.control] = Some(p);
        }
        controlled
    }

    /// The part that has these two columns as a port.
    fn own(&mut self, port: [Column; 2]) -> usize {
        let unknown = port.into_iter().find(|&c| self.columns.is_unknown(c));
        let p = unknown.map_or(0, |c| self.part[c]);
        port.into_iter().for_each(|c| self.owner[c] = Some(p));
        p
    }

    fn whole(&self) -> &'a StaticMultiport {
        self.columns.whole
    }

    /// The parts that a column is of, none where it is known.
    fn parts_of(&self, column: Column) -> impl Iterator<Item = usize> {
        let told = self.columns.told_by[column].is_some();
        let single = self.columns.is_unknown(column).then(|| self.part[column]);
        let several = told.then(|| self.adding[column].iter().copied());
        single.into_iter().chain(several.into_iter().flatten())
    }

    /// Gives every part its equations. What determines a known column is taken where it is needed; what sources tell each other belongs to
    /// the first.
    fn share_equations(&mut self) {
        let whole = self.whole();
        // The equation of a told column holds told columns that were found after it.
        for &told in self.columns.told.iter().rev() {
            let mut adding = BTreeSet::new();
            for &(_, c) in self.columns.told_by[told].map_or(&[][..], |e| &whole.equations[e]) {
                if c != told {
                    adding.extend(self.parts_of(c));
                    adding.extend(self.columns.known[c].then_some(0));
                }
            }
            self.adding[told] = adding;
        }
        for (e, equation) in whole.equations.iter().enumerate() {
            if self.columns.reads[e] {
                continue;
            }
            if let Some(told) = self.columns.tells[e] {
                for &p in &self.adding[told] {
                    self.equations[p].push(e);
                }
                continue;
            }
            let mut unknown = equation.iter().filter(|(_, c)| !self.columns.known[*c]);
            match unknown.next() {
                Some(&(_, c)) => self.equations[self.part[c]].push(e),
                None => {
                    let determines =
                        |&(_, c): &(Coefficient, Column)| self.columns.known_by[c] == Some(e);
                    if !equation.iter().any(determines) {
                        self.equations[0].push(e);
                    }
                }
            }
        }
    }

    /// Gives every part what is read of it.
    fn share_observed(&mut self, controlled: &[Option<usize>]) {
        let whole = self.whole();
        let read: Vec<BTreeSet<usize>> = (0..whole.observed.len())
            .map(|k| {
                let columns = self.columns.read_by(k).into_iter();
                columns
                    .flat_map(|c| self.parts_of(c).collect::<Vec<_>>())
                    .collect()
            })
            .collect();
        for (k, power) in whole.power.iter().enumerate() {
            let mut parts = &read[power.v] | &read[power.i];
            let vanishes = [power.v, power.i].iter().any(|&factor| {
                read[factor].is_empty()
                    && self
                        .columns
                        .terms(factor)
                        .all(|(_, c)| !self.columns.known[c])
            });
            if parts.is_empty() && !vanishes {
                parts.insert(0);
            }
            for &p in &parts {
                self.powers[p].push(k);
                self.observed[p].extend([power.v, power.i]);
                self.adds[power.v].insert(p);
                self.adds[power.i].insert(p);
            }
        }
        for (k, mut parts) in read.into_iter().enumerate() {
            if let Some(p) = controlled[k] {
                parts = BTreeSet::from([p]);
            } else if k >= whole.probes {
                continue;
            } else if parts.is_empty() {
                parts.insert(0);
            }
            for &p in &parts {
                self.observed[p].push(k);
            }
            self.adds[k].extend(parts);
        }
        for observed in &mut self.observed {
            observed.sort_unstable();
            observed.dedup();
        }
    }

    /// Gives every part the edges of its elements.
    fn share_edges(&mut self) {
        let whole = self.whole();
        let edges = whole.graph.iter().enumerate();
        let edges: BTreeMap<&str, usize> = edges.map(|(k, edge)| (&*edge.name, k)).collect();
        for p in 0..self.edges.len() {
            let storage = self.storage[p].iter().map(|&k| &whole.storage[k].element);
            let switches = self.switches[p].iter().map(|&k| &whole.switches[k].name);
            let powers = self.powers[p].iter().map(|&k| &whole.power[k].element);
            let names = storage.chain(switches).chain(powers);
            let found = names.filter_map(|name| edges.get(name.as_str()));
            let found: BTreeSet<usize> = found.copied().collect();
            self.edges[p] = found.into_iter().collect();
        }
    }

    /// What part `p` has of an equation that tells or reads: what it adds, and of what is known as much as is not the other parts'.
    fn added(&self, equation: &Equation, own: Column, p: usize, known: bool) -> Equation {
        let terms = equation.iter().filter(|&&(_, c)| {
            c == own
                || if self.columns.known[c] {
                    known
                } else {
                    self.parts_of(c).any(|q| q == p)
                }
        });
        terms.copied().collect()
    }
}

impl Columns<'_> {
    /// The terms of an observed quantity.
    fn terms(&self, observed: usize) -> impl Iterator<Item = (Coefficient, Column)> {
        let own = self.whole.observed[observed].column;
        let equation = &self.whole.equations[self.definition[observed]];
        equation.iter().copied().filter(move |&(_, c)| c != own)
    }
}

/// Parts as they are written, one after the other.
struct Draft<'w, 'a> {
    whole: &'w Whole<'a>,
    /// By column: the part that took it last.
    taken: Vec<usize>,
    /// Of the present part: its columns and, by their places, its equations.
    columns: Vec<Column>,
    equations: Vec<(usize, Equation)>,
    sources: Vec<usize>,
    /// Places of columns and observed quantities in the part.
    place: Vec<usize>,
    observed: Vec<usize>,
}

impl<'w, 'a> Draft<'w, 'a> {
    fn new(whole: &'w Whole<'a>) -> Self {
        let of = whole.whole();
        Self {
            whole,
            taken: vec![usize::MAX; of.columns.len()],
            columns: Vec::new(),
            equations: Vec::new(),
            sources: Vec::new(),
            place: vec![0; of.columns.len()],
            observed: vec![0; of.observed.len()],
        }
    }

    /// Takes these columns with what determines them and the sources that they are of.
    fn take(&mut self, p: usize, columns: impl IntoIterator<Item = Column>) {
        let (known, of) = (&self.whole.columns, self.whole.whole());
        let mut stack: Vec<Column> = columns.into_iter().collect();
        while let Some(c) = stack.pop() {
            if std::mem::replace(&mut self.taken[c], p) == p {
                continue;
            }
            self.columns.push(c);
            if let Some(e) = known.known_by[c] {
                self.equations.push((e, of.equations[e].clone()));
                stack.extend(of.equations[e].iter().map(|(_, c)| *c));
            }
            if let Some(k) = self.whole.source[c] {
                let source = &of.sources[k];
                self.sources.push(k);
                stack.extend(
                    [Some(source.value), Some(source.other), source.rate]
                        .into_iter()
                        .flatten(),
                );
            }
        }
    }

    /// Part `p`.
    fn part(&mut self, p: usize) -> Part {
        let (whole, of) = (self.whole, self.whole.whole());
        (self.columns, self.equations, self.sources) = Default::default();
        self.take(p, [StaticMultiport::ONE]);
        for &e in &whole.equations[p] {
            let equation = &of.equations[e];
            let own = match whole.columns.tells[e] {
                Some(told) => whole.added(equation, told, p, p == 0),
                None => equation.clone(),
            };
            self.take(p, own.iter().map(|(_, c)| *c));
            self.equations.push((e, own));
        }
        for &k in &whole.storage[p] {
            self.take(p, [of.storage[k].state, of.storage[k].flow]);
        }
        for &k in &whole.pairs[p] {
            self.take(p, [of.pairs[k].reverse, of.pairs[k].forward]);
        }
        for &k in &whole.switches[p] {
            self.take(p, [of.switches[k].v, of.switches[k].i]);
        }
        for &k in &whole.observed[p] {
            let column = of.observed[k].column;
            let e = whole.columns.definition[k];
            if !whole.columns.reads[e] {
                // The control of a switch: it stands among the equations, or is known.
                self.take(p, [column]);
                continue;
            }
            // Of a sum what is known is the first's; of a factor that all have, everyone's.
            let shared = whole.columns.read_by(k).is_empty();
            let first = whole.adds[k].first() == Some(&p);
            let own = whole.added(&of.equations[e], column, p, shared || first);
            self.take(p, own.iter().map(|(_, c)| *c));
            self.equations.push((e, own));
        }
        self.written(p)
    }

    fn written(&mut self, p: usize) -> Part {
        let (whole, of) = (self.whole, self.whole.whole());
        self.columns.sort_unstable();
        self.equations.sort_by_key(|(e, _)| *e);
        self.equations.dedup_by_key(|(e, _)| *e);
        self.sources.sort_unstable();
        self.sources.dedup();
        for (place, &c) in self.columns.iter().enumerate() {
            self.place[c] = place;
        }
        let observed = &whole.observed[p];
        for (place, &k) in observed.iter().enumerate() {
            self.observed[k] = place;
        }
        let at = |c: Column| self.place[c];
        let mut held = vec![false; self.columns.len()];
        for (_, equation) in &self.equations {
            equation.iter().for_each(|(_, c)| held[at(*c)] = true);
        }
        let renamed = |(_, equation): &(usize, Equation)| -> Equation {
            equation.iter().map(|&(x, c)| (x, at(c))).collect()
        };
        let mut equations: Vec<Equation> = self.equations.iter().map(renamed).collect();
        let sources: Vec<SourcePort> = self
            .sources
            .iter()
            .map(|&k| SourcePort {
                input: of.sources[k].input.clone(),
                value: at(of.sources[k].value),
                other: at(of.sources[k].other),
                rate: of.sources[k].rate.map(at),
            })
            .collect();
        // Nothing flows where a part only looks at a source.
        let unloaded = sources.iter().filter(|source| !held[source.other]);
        equations.extend(unloaded.map(|source| vec![(Coefficient::ONE, source.other)]));
        let is_here = |c: &Column| self.taken[*c] == p;
        let mut internal: Vec<Column> =
            of.internal.iter().filter(|c| is_here(c)).copied().collect();
        internal.extend(self.foreign(p));
        let multiport = StaticMultiport {
            title: of.title.clone(),
            columns: self
                .columns
                .iter()
                .map(|&c| of.columns[c].clone())
                .collect(),
            equations,
            internal: internal.into_iter().map(at).collect(),
            storage: (whole.storage[p].iter())
                .map(|&k| StoragePort {
                    state: at(of.storage[k].state),
                    flow: at(of.storage[k].flow),
                    ..of.storage[k].clone()
                })
                .collect(),
            metric: (whole.metric[p].iter())
                .map(|&k| {
                    let (a, b, x) = of.metric[k];
                    let at = |k: usize| place(&whole.storage[p], k);
                    (at(a), at(b), x)
                })
                .collect(),
            sources,
            pairs: (whole.pairs[p].iter())
                .map(|&k| Pair {
                    reverse: at(of.pairs[k].reverse),
                    forward: at(of.pairs[k].forward),
                    ..of.pairs[k].clone()
                })
                .collect(),
            switches: whole.switches[p]
                .iter()
                .map(|&k| self.switch(p, k))
                .collect(),
            observed: (observed.iter())
                .map(|&k| Observed {
                    column: at(of.observed[k].column),
                    ..of.observed[k].clone()
                })
                .collect(),
            probes: observed.partition_point(|&k| k < of.probes),
            power: (whole.powers[p].iter())
                .map(|&k| Power {
                    v: self.observed[of.power[k].v],
                    i: self.observed[of.power[k].i],
                    ..of.power[k].clone()
                })
                .collect(),
            inexact: of.inexact,
            graph: whole.edges[p]
                .iter()
                .map(|&k| of.graph[k].clone())
                .collect(),
            ..StaticMultiport::default()
        };
        Part {
            storage: whole.storage[p].clone(),
            pairs: whole.pairs[p].clone(),
            switches: whole.switches[p].clone(),
            probes: observed
                .iter()
                .copied()
                .take_while(|&k| k < of.probes)
                .collect(),
            multiport: StandardMultiport(multiport),
        }
    }

    /// Columns of this part that are ports of others: what determines them stands here too.
    fn foreign(&self, p: usize) -> impl Iterator<Item = Column> {
        let owner = move |c: &Column| self.whole.owner[*c].is_some_and(|owner| owner != p);
        self.columns.iter().copied().filter(owner)
    }

    fn switch(&self, p: usize, k: usize) -> SwitchPort {
        let switch = &self.whole.whole().switches[k];
        let at = |k: usize| place(&self.whole.switches[p], k);
        SwitchPort {
            v: self.place[switch.v],
            i: self.place[switch.i],
            control: self.observed[switch.control],
            latch: switch.latch.as_ref().map(|latch| match latch {
                LatchPort::Rest(other) => LatchPort::Rest(at(*other)),
                LatchPort::Hold { gates, valve } => LatchPort::Hold {
                    gates: gates.iter().map(|&k| at(k)).collect(),
                    valve: valve.clone(),
                },
            }),
            ..switch.clone()
        }
    }
}

/// The place of a number in an increasing list that has it.
fn place(list: &[usize], number: usize) -> usize {
    list.partition_point(|&k| k < number)
}
