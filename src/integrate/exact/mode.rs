//! A mode: which devices conduct, where the switches stand, and the linear system that holds there.

mod guards;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

pub(crate) use guards::over_w;
use guards::{Guards, distinct, guards_of_sums, sizes_over_w};

use super::clock::Clock;
use super::energy_integral::Term;
use super::exosystem::Exosystem;
use super::flow::Flow;
use super::key::{Key, Owner, Trigger};
use super::magnitudes::{Magnitudes, ORDERS};
use super::map::{Map, Sizes};
use super::sampled::SampledRows;
use crate::integrate::switching::Threshold;
use crate::lcs::{Lcs, PowerKind};
use crate::linalg::decouple::decoupled;
use crate::linalg::kernel::Kernel;
use crate::linalg::refill::refill;
use crate::linalg::whole::{is_identity, magnitudes};
use crate::settings::tolerances::exponentials::FAST_ENTRY;

/// Successors of a mode that are remembered; the oldest goes first.
const MOST_SUCCESSORS: usize = 64;

/// What a mode's guards need to know of the switches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SwitchFacts<'a> {
    /// By switch.
    pub(crate) thresholds: &'a [Threshold],
    /// Ron and 1/Roff of each sliding switch.
    pub(crate) limits: &'a [(f64, f64)],
    /// Switches that straight sources alone control.
    pub(crate) clocks: &'a [Clock],
}

/// One mode over w = [x; z].
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    /// Its name.
    pub(crate) key: Arc<Key>,
    /// Number of states.
    pub(crate) n: usize,
    /// Its flow and guards: first those of devices, then those of switches.
    pub(crate) flow: Flow,
    /// Guards over w and below them their first three derivatives.
    pub(crate) jets: Map,
    /// Guards that belong to devices: the first pair of each.
    pub(crate) device_guards: Vec<usize>,
    /// Switch of each further guard; two guards for each sliding switch follow.
    pub(crate) guarded_switches: Vec<usize>,
    /// By guarded switch: whether sources alone control it.
    pub(crate) controlled_by_sources: Vec<bool>,
    /// By guarded switch: on, with one threshold for both directions, so that a control at rest on it turns it off.
    off_at_rest: Vec<bool>,
    /// What must vanish for the mode to exist, over w; with the first two derivatives below it.
    pub(crate) constraints: DMatrix<f64>,
    /// s = storage · w, q×dim.
    pub(crate) storage: Map,
    /// Whether storage or constraints follow the sources.
    pub(crate) driven: bool,
    /// Whether the states are the storage, s = x.
    pub(crate) keeps: bool,
    /// x = inject · s + inject_one, n×q.
    pub(crate) inject: Map,
    /// Whether states of different rates are [apart](crate::lcs::reduce): where the energy of the states is known, and the basis exists.
    is_apart: bool,
    /// w in the basis of the flow, where that is another one than [x; z].
    settled: Option<Kernel>,
    /// Its magnitudes.
    settled_sizes: Option<Kernel>,
    /// n.
    pub(crate) inject_one: DVector<f64>,
    /// Probe rows over w.
    pub(crate) outputs: Kernel,
    /// The rows that follow.
    pub(crate) rows: SampledRows,
    /// Pairs that share currents or voltages in a proportion that the ideal model does not determine.
    pub(crate) shared: Vec<usize>,
    /// Of the latest inspection.
    pub(crate) magnitudes: Magnitudes,
    /// What followed: why it was left and for which mode, the latest first.
    pub(crate) successors: Vec<(Trigger, usize)>,
}

impl Mode {
    /// The mode of a system in which every pair is held. `None` if its numbers are not finite or its guards are too many
    /// to describe.
    pub(crate) fn new(
        key: Key,
        lcs: &Lcs,
        exosystem: &Exosystem,
        switches: &SwitchFacts<'_>,
        h: f64,
        energy: bool,
    ) -> Option<Self> {
        let thresholds = switches.thresholds;
        let (n, dz) = (lcs.n(), exosystem.dim());
        let dim = n + dz;
        let mut generator = DMatrix::zeros(dim, dim);
        generator.view_mut((0, 0), (n, n)).copy_from(&lcs.a);
        // What symmetrical sources add up to nothing is rounding of each of them.
        let mut summed = DMatrix::zeros(dim, dim);
        let input = &lcs.e * exosystem.output();
        let inputs = magnitudes(&lcs.e) * magnitudes(exosystem.output());
        for j in 0..dz {
            for i in 0..n {
                let at = (i, n + j);
                (generator[at], summed[at]) = (input[(i, j)], inputs[(i, j)]);
                if j == 0 {
                    generator[at] += lcs.e0[i];
                    summed[at] += lcs.e0[i].abs();
                }
            }
        }
        generator
            .view_mut((n, n), (dz, dz))
            .copy_from(exosystem.generator());

        // The pairs of sliding switches come last; their currents have either sign.
        let slides = key.sliding_switches();
        let count = lcs.held.kernel.nrows().saturating_sub(slides.len());
        let mut held = over_w(&lcs.held.guard, n, exosystem);
        if held.nrows() != count {
            held = held.rows(0, count).into_owned();
        }
        let (shared, devices, device_sizes, device_guards) = if lcs.held.kernel.ncols() > 0 {
            let kernel = lcs.held.kernel.rows(0, count).into_owned();
            let (shared, devices, first) = guards_of_sums(&kernel, held)?;
            let sizes = magnitudes(&devices);
            (shared, devices, sizes, first)
        } else {
            let kept = distinct(&held);
            let sizes = sizes_over_w(&lcs.held.guard, n, exosystem).select_rows(&kept);
            (Vec::new(), held.select_rows(&kept), sizes, kept)
        };
        let Guards {
            rows: guards,
            sizes: mut guard_sizes,
            switches: guarded_switches,
            controlled_by_sources,
        } = if thresholds.is_empty() {
            Guards {
                rows: devices,
                sizes: device_sizes,
                switches: Vec::new(),
                controlled_by_sources: Vec::new(),
            }
        } else {
            Guards::of_switches((devices, device_sizes), &key, lcs, exosystem, switches)?
        };
        let decoupled = (!lcs.fast.is_empty())
            .then(|| decoupled(&generator, &lcs.fast))
            .flatten();
        let basis = |rows: DMatrix<f64>| match &decoupled {
            Some(decoupled) => rows * &decoupled.to,
            None => rows,
        };
        let mut fast: &[usize] = &[];
        if let Some(decoupled) = &decoupled {
            generator.copy_from(&decoupled.generator);
            summed = summed.sup(&decoupled.sizes);
            guard_sizes *= decoupled.to.abs();
            fast = &lcs.fast;
        }
        let guards = basis(guards);
        let sizes = Sizes {
            guards: guard_sizes,
            summed,
        };
        let (jets, jet_sizes) = sizes.jets(&guards, &generator, ORDERS);
        let mut flow = Flow::new(generator, n, fast, &guards, h, exosystem.rates())?;
        flow.set_sizes(sizes);
        if energy {
            let [v, i] = [&lcs.outputs.power_v, &lcs.outputs.power_i];
            let [v, i] = [v, i].map(|rows| basis(over_w(rows, n, exosystem)));
            flow.set_work(work(lcs, &v, &i));
        }

        let mut constraints = basis(over_w(&lcs.held.constraints, n, exosystem));
        let is_constrained = constraints.nrows() > 0;
        if is_constrained {
            constraints = with_derivatives(constraints, flow.generator());
        }

        let map = &lcs.storage;
        let mut storage = DMatrix::zeros(map.names.len(), dim);
        storage.columns_mut(0, n).copy_from(&map.x);
        storage
            .columns_mut(n, dz)
            .copy_from(&(&map.u * exosystem.output()));
        let mut ones = storage.column_mut(n);
        ones += &map.one;

        let storage = basis(storage);
        let driven = is_constrained || map.u.iter().any(|u| *u != 0.0);
        let shifted = map.one.iter().chain(&map.inject_one).any(|v| *v != 0.0);
        let keeps = !driven && !shifted && is_identity(&map.x, n) && is_identity(&map.inject, n);

        Some(Self {
            n,
            jets: Map::with_sizes(&jets, &jet_sizes),
            device_guards,
            controlled_by_sources,
            off_at_rest: guarded_switches
                .iter()
                .map(|&i| key.switches[i] && thresholds[i].is_sharp())
                .collect(),
            guarded_switches,
            key: Arc::new(key),
            constraints,
            driven,
            keeps,
            storage: Map::new(&storage),
            inject: Map::new(&map.inject),
            inject_one: map.inject_one.clone(),
            outputs: Kernel::new(&basis(over_w(&lcs.outputs.rows, n, exosystem))),
            is_apart: (0..n).all(|k| lcs.energy.get((k, k)).is_some_and(|e| *e > 0.0))
                && decoupled.is_some() != lcs.fast.is_empty(),
            settled_sizes: decoupled.as_ref().map(|d| Kernel::new(&d.from.abs())),
            settled: decoupled.map(|decoupled| Kernel::new(&decoupled.from)),
            rows: SampledRows::new(lcs.outputs.names.len(), dim),
            shared,
            magnitudes: Magnitudes::default(),
            successors: Vec::new(),
            flow,
        })
    }

    /// Remembers that mode `to` followed.
    pub(crate) fn remember(&mut self, trigger: Trigger, to: usize) {
        let step = (trigger, to);
        if let Some(k) = self.successors.iter().position(|s| *s == step) {
            self.successors.swap(k, 0);
        } else {
            self.successors.truncate(MOST_SUCCESSORS - 1);
            self.successors.insert(0, step);
        }
    }

    /// Who a guard belongs to.
    pub(crate) fn owner(&self, guard: usize) -> Owner {
        let Some(k) = guard.checked_sub(self.device_guards.len()) else {
            return Owner::Device(self.device_guards[guard]);
        };
        match k.checked_sub(self.guarded_switches.len()) {
            None => Owner::Switch(self.guarded_switches[k]),
            Some(k) => Owner::Slide(self.key.sliding[k / 2].0, k % 2 == 0),
        }
    }

    /// The fastest rate at which several states move each other, 1/s: their sum is fast, and what is slow stands in the difference of
    /// large entries. `None` where every fast state is fast by itself, or apart from the others.
    pub(crate) fn fast_sum(&self) -> Option<f64> {
        if self.is_apart {
            return None;
        }
        let a = self.flow.generator().view((0, 0), (self.n, self.n));
        let largest = a.amax();
        let several = |row: usize| {
            a.row(row)
                .iter()
                .filter(|v| v.abs() > FAST_ENTRY * largest)
                .count()
                > 1
        };
        (0..self.n).any(several).then_some(largest)
    }

    /// Whether a guard is that of a switch which does not stay on where the control rests on its threshold.
    pub(crate) fn is_off_at_rest(&self, guard: usize) -> bool {
        let k = guard.checked_sub(self.device_guards.len());
        k.is_some_and(|k| self.off_at_rest.get(k).copied().unwrap_or(false))
    }

    /// Takes w = [x; z] to the basis of the flow.
    pub(crate) fn settle(&self, w: &mut [f64], work: &mut Vec<f64>) {
        if let Some(settled) = &self.settled {
            refill(work, w);
            settled.apply(work, w);
        }
    }

    /// How large what w is summed from can be where it follows from storage s and the exosystem z: currents that a large resistance makes
    /// equal leave nothing but the rounding of each.
    pub(crate) fn sizes_from(
        &self,
        s: &[f64],
        z: &[f64],
        sizes: &mut Vec<f64>,
        work: &mut Vec<f64>,
    ) {
        work.clear();
        work.extend(s.iter().map(|v| v.abs()));
        self.inject.largest(work, sizes);
        for (size, one) in sizes.iter_mut().zip(self.inject_one.iter()) {
            *size += one.abs();
        }
        sizes.extend(z.iter().map(|v| v.abs()));
        if let Some(settled) = &self.settled_sizes {
            refill(work, sizes);
            settled.apply(work, sizes);
        }
    }

    /// The storage at w.
    pub(crate) fn storage_at(&self, w: &[f64], s: &mut Vec<f64>) {
        if self.keeps {
            refill(s, &w[..self.n]);
        } else {
            self.storage.values(w, s);
        }
    }

    /// How large the storage can be where w has these sizes.
    pub(crate) fn sizes_of_storage(&self, sizes: &[f64], largest: &mut Vec<f64>) {
        if self.keeps {
            refill(largest, &sizes[..self.n]);
        } else {
            self.storage.largest(sizes, largest);
        }
    }

    /// How large x can be where the storage has these sizes, but for what does not follow from it.
    pub(crate) fn sizes_of_state(&self, storage: &[f64], sizes: &mut Vec<f64>) {
        if self.keeps {
            refill(sizes, storage);
        } else {
            self.inject.largest(storage, sizes);
        }
    }

    /// How fast the storage moves at w.
    pub(crate) fn storage_rates(&self, w: &[f64], s: &mut Vec<f64>, work: &mut Vec<f64>) {
        self.flow.rates_of(w, work);
        self.storage_at(work, s);
    }

    /// w' where the storage moves as fast as this and the exosystem is at z.
    pub(crate) fn rates_from(
        &self,
        storage: &[f64],
        (exosystem, z): (&Exosystem, &[f64]),
        rates: &mut Vec<f64>,
        work: &mut Vec<f64>,
    ) {
        if self.keeps {
            refill(rates, storage);
        } else {
            self.inject.values(storage, rates);
        }
        exosystem.rates_at(z, rates);
        self.settle(rates, work);
    }

    /// The state that conserves charge and flux from storage s.
    pub(crate) fn state_from(&self, s: &[f64], x: &mut Vec<f64>) {
        self.state_from_part(s, 1.0, x);
    }

    /// The same where its constant counts so many times.
    pub(crate) fn state_from_part(&self, s: &[f64], constant: f64, x: &mut Vec<f64>) {
        if self.keeps {
            return refill(x, s);
        }
        self.inject.values(s, x);
        for (x, one) in x.iter_mut().zip(self.inject_one.iter()) {
            *x += constant * one;
        }
    }
}

/// Rows, and their first two derivatives below them.
#[inline(never)]
fn with_derivatives(rows: DMatrix<f64>, generator: &DMatrix<f64>) -> DMatrix<f64> {
    let (count, dim) = rows.shape();
    let first = &rows * generator;
    let second = &first * generator;
    let mut all = DMatrix::zeros(3 * count, dim);
    for (k, rows) in [rows, first, second].iter().enumerate() {
        all.rows_mut(k * count, count).copy_from(rows);
    }
    all
}

/// What sources deliver and what dissipates, of these rows of voltages and currents over w.
fn work(lcs: &Lcs, v: &DMatrix<f64>, i: &DMatrix<f64>) -> Vec<Term> {
    let row = |m: &DMatrix<f64>, k: usize| {
        let entries = m.row(k).into_iter().copied().enumerate();
        entries.filter(|(_, x)| *x != 0.0).collect::<Vec<_>>()
    };
    let terms = lcs.outputs.power.iter().enumerate();
    terms
        .filter(|(_, term)| matches!(term.kind, PowerKind::Source | PowerKind::Dissipated))
        .map(|(k, term)| Term {
            v: row(v, k),
            i: row(i, k),
            source: term.kind == PowerKind::Source,
        })
        .collect()
}
