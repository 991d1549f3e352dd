//! Charges and fluxes: where they stand, how large they have been, and their energy.

use nalgebra::DMatrix;

use super::mode::Mode;
use super::travel::Travel;
use crate::integrate::energy::Balance;
use crate::integrate::log::Log;
use crate::integrate::stats::{JumpReason, StateJump};
use crate::lcs::Lcs;
use crate::linalg::refill::refill;
use crate::settings::tolerances::exponentials::SLAVED;
use crate::settings::tolerances::jumps::NO_JUMP;

/// The storage vector s of a run.
pub(super) struct Storage {
    /// s before the start or at the last change.
    pub(super) values: Vec<f64>,
    /// Largest values so far, those of one kind levelled.
    pub(super) scale: Vec<f64>,
    /// The same of what the present values were rounded from: a current that leaks through an enormous resistance has forgotten what it was.
    pub(super) known: Vec<f64>,
    /// ½ sᵀ M s of the largest values, J.
    pub(super) capacity: f64,
    /// M by what is not zero in it.
    metric: Vec<(usize, usize, f64)>,
    /// By element: a voltage.
    volts: Vec<bool>,
    /// By element: its name, and the unit of its state.
    elements: Vec<String>,
    units: Vec<&'static str>,
    /// Whether the balance is asked for.
    balanced: bool,
    pub(super) balance: Balance,
    /// Work space: how large w and s can have been since the last event.
    reach: Vec<f64>,
    largest: Vec<f64>,
}

/// ½ sᵀ M s, J.
fn stored(metric: &[(usize, usize, f64)], s: &[f64]) -> f64 {
    let terms = metric.iter().map(|&(i, j, m)| m * s[i] * s[j]);
    0.5 * terms.sum::<f64>()
}

/// What is not zero in a matrix.
fn entries(matrix: &DMatrix<f64>) -> Vec<(usize, usize, f64)> {
    let columns = (0..matrix.ncols()).flat_map(|j| (0..matrix.nrows()).map(move |i| (i, j)));
    let entries = columns.map(|(i, j)| (i, j, matrix[(i, j)]));
    entries.filter(|(.., m)| *m != 0.0).collect()
}

impl Storage {
    /// The largest current and the largest voltage so far, A and V.
    pub(super) fn amplitudes(&self) -> [f64; 2] {
        [false, true].map(|volts| {
            let kind = self.scale.iter().zip(&self.volts);
            let kind = kind.filter(|(_, v)| **v == volts);
            kind.fold(0.0, |a, (scale, _)| scale.max(a))
        })
    }

    /// Of a system that starts from s; `balanced` asks for the energy balance.
    pub(super) fn new(lcs: &Lcs, s: &[f64], balanced: bool) -> Self {
        let metric = entries(&lcs.storage.metric);
        let mut storage = Self {
            values: s.to_vec(),
            scale: vec![0.0; s.len()],
            known: Vec::new(),
            capacity: 0.0,
            volts: lcs.storage.units.iter().map(|unit| *unit == "V").collect(),
            elements: lcs.storage.elements.clone(),
            units: lcs.storage.units.clone(),
            balanced,
            balance: Balance::new(stored(&metric, s)),
            metric,
            reach: Vec::new(),
            largest: Vec::new(),
        };
        storage.rescale();
        storage
    }

    /// ½ sᵀ M s of another s, J.
    pub(super) fn stored(&self, s: &[f64]) -> f64 {
        stored(&self.metric, s)
    }

    /// Raises the amplitudes to the present values; elements of one kind share the largest.
    pub(super) fn rescale(&mut self) {
        let mut largest = [0.0_f64; 2];
        for ((&volts, s), &scale) in self.volts.iter().zip(&self.values).zip(&self.scale) {
            let largest = &mut largest[usize::from(volts)];
            *largest = largest.max(s.abs()).max(scale);
        }
        let mut raised = false;
        for (&volts, scale) in self.volts.iter().zip(&mut self.scale) {
            let largest = largest[usize::from(volts)];
            raised |= *scale != largest;
            *scale = largest;
        }
        if raised {
            self.capacity = stored(&self.metric, &self.scale);
        }
        refill(&mut self.known, &self.scale);
    }

    /// Reads s and the energy spent where the run stands in this mode.
    pub(super) fn take(&mut self, mode: &mut Mode, travel: &mut Travel) {
        let [source, dissipated] = travel.take_energy(&mut mode.flow);
        self.balance.add((source, dissipated));
        mode.storage_at(&travel.now, &mut self.values);
        // An event often finds a current at zero: its size is what it was on the way.
        if mode.keeps {
            refill(&mut self.largest, travel.peak());
        } else {
            travel.reach(&mut self.reach);
            mode.sizes_of_storage(&self.reach, &mut self.largest);
        }
        for (scale, largest) in self.scale.iter_mut().zip(&self.largest) {
            *scale = scale.max(*largest);
        }
        self.rescale();
        if travel.known(&mut self.reach) {
            mode.sizes_of_storage(&self.reach, &mut self.largest);
            for (known, largest) in self.known.iter_mut().zip(&self.largest) {
                if *largest <= SLAVED * *known {
                    *known = *largest;
                }
            }
        }
        self.note_stored();
    }

    /// Stands where it stood before.
    pub(super) fn restore(&mut self, values: Vec<f64>, scale: Vec<f64>, known: Vec<f64>) {
        self.capacity = stored(&self.metric, &scale);
        (self.values, self.scale, self.known) = (values, scale, known);
    }

    /// Takes over the values of another method.
    pub(super) fn set(&mut self, s: &[f64]) {
        self.values.copy_from_slice(s);
        self.rescale();
    }

    /// Notes the stored energy.
    pub(super) fn note_stored(&mut self) {
        if self.balanced {
            self.balance.note(self.stored(&self.values));
        }
    }

    /// Notes what the storage could hold at its amplitudes, of which energies that cancel over a run leave rounding.
    pub(super) fn note_capacity(&mut self) {
        let of = self.stored(&self.scale);
        self.balance.note_rounding(of);
    }

    /// The power that energies of a run of `duration` seconds are measured by, W; 0 where no balance is asked for.
    pub(super) fn power(&self, duration: f64) -> f64 {
        if self.balanced {
            self.capacity.max(self.balance.largest()) / duration
        } else {
            0.0
        }
    }

    /// Writes down that s jumped at t from `before`, losing so much, J, if it did by more than rounding.
    pub(super) fn note_jump(
        &self,
        t: f64,
        before: &[f64],
        loss: f64,
        reason: JumpReason,
        log: &mut Log,
    ) {
        let moved = |k: usize| {
            let (a, b) = (self.values[k], before[k]);
            (a - b).abs() > NO_JUMP * self.scale[k].max(b.abs())
        };
        let jumped: Vec<usize> = (0..before.len()).filter(|&k| moved(k)).collect();
        if !jumped.is_empty() {
            let storage = (&*self.elements, &*self.units);
            let change: Vec<f64> = self.values.iter().zip(before).map(|(a, b)| a - b).collect();
            let sizes = (loss, self.stored(&change), self.capacity);
            log.state_jump(StateJump::new(t, storage, &jumped, sizes, reason));
        }
    }
}
