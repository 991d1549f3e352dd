//! A system without its zeros, with what a run reads of it and its implicit steps.

use super::kernel::{Kernel, Step};
use super::tape::Reads;
use crate::integrate::error::{Error, Reason};
use crate::integrate::reading::{Point, sparse_value};
use crate::integrate::switching::{Part, Watched};
use crate::lcs::sparse::{Readings, SparseRows};
use crate::lcs::{Input, Port, Position, PowerKind, SparseLcs};
use crate::mna::StaticMultiport;
use crate::settings::Settings;

/// The largest values of each unit.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Largest {
    volts: f64,
    amperes: f64,
}

impl Largest {
    /// Of values with their units, none of them negative.
    pub(super) fn of<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let mut largest = Self::default();
        for (unit, value) in values {
            let side = match unit {
                "V" => &mut largest.volts,
                _ => &mut largest.amperes,
            };
            *side = side.max(value);
        }
        largest
    }

    /// The largest one of a unit.
    pub(super) fn among(&self, unit: &str) -> f64 {
        match unit {
            "V" => self.volts,
            _ => self.amperes,
        }
    }
}

/// See the [module](self).
#[derive(Debug)]
pub(super) struct System {
    pub(super) lcs: SparseLcs,
    pub(super) readings: Readings,
    pub(super) kernel: Kernel,
    /// The number of events when it was entered last.
    pub(super) entered: u64,
}

impl System {
    /// The system of a position of the switches, all devices free.
    ///
    /// # Errors
    /// The reduction's.
    pub(super) fn new(
        multiport: &StaticMultiport,
        position: &[bool],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let position = Position::free(multiport, position.to_vec());
        let (lcs, readings) =
            SparseLcs::with_readings(multiport, &position).map_err(|e| Error::before(e.into()))?;
        Ok(Self {
            kernel: Kernel::new(&lcs, settings),
            lcs,
            readings,
            entered: 0,
        })
    }

    pub(super) fn m(&self) -> usize {
        self.lcs.ports.len()
    }

    /// Of each state the storage element.
    pub(super) fn storage_of(&self) -> &[usize] {
        &self.readings.storage_of
    }

    /// Makes the implicit step of h from `step.x` with inputs u at its end; see [`Kernel::step`].
    ///
    /// # Errors
    /// The kernel's, at `t`.
    pub(super) fn implicit(
        &mut self,
        (t, h, slack): (f64, f64, f64),
        u: &[f64],
        step: &mut Step,
    ) -> Result<(), Error> {
        let lcs = &self.lcs;
        lcs.e.add_times(h, u, &mut step.x);
        for (x, e0) in step.x.iter_mut().zip(&lcs.e0) {
            *x += h * e0;
        }
        step.q.clone_from(&lcs.f);
        lcs.g.add_times(1.0, u, &mut step.q);
        let made = self.kernel.step(lcs, (h, slack), step);
        let made = made.and_then(|()| {
            let finite = step.x.iter().all(|x| x.is_finite());
            finite.then_some(()).ok_or((Reason::Overflow, None))
        });
        made.map_err(|(reason, port)| {
            let error = Error::at(t, reason);
            match port {
                Some(port) => error.device(lcs.ports[port].device.clone()),
                None => error,
            }
        })
    }

    /// Whether two states are closer than this part of the largest value of each unit.
    pub(super) fn are_within(&self, part: f64, a: &[f64], b: &[f64]) -> bool {
        let states = || self.lcs.states.iter().zip(a.iter().zip(b));
        let sizes = states().map(|(state, (a, b))| (state.unit, a.abs().max(b.abs())));
        let largest = Largest::of(sizes);
        states().all(|(state, (a, b))| (a - b).abs() <= part * largest.among(state.unit))
    }

    /// Probe values at a point.
    pub(super) fn read(&self, at: Point<'_>, row: &mut [f64]) {
        for (i, value) in row.iter_mut().enumerate() {
            *value = sparse_value(&self.lcs.output_rows, i, at);
        }
    }

    /// Appends what is read at a point and a slope of the states.
    pub(super) fn write(
        &self,
        reads: &Reads,
        (at, slope): (Point<'_>, &[f64]),
        rows: &mut Vec<f64>,
    ) {
        let outputs = &self.lcs.output_rows;
        rows.extend((0..outputs.one.len()).map(|i| sparse_value(outputs, i, at)));
        let powers = &self.readings.power_v;
        let count = powers.one.len();
        rows.extend((count - reads.last..count).map(|i| sparse_value(powers, i, at)));
        let rates = self.storage_rate(slope, at.du);
        rows.extend(reads.rates.iter().map(|&k| rates[k]));
        rows.push(1.0);
    }

    /// x' = A x + B λ + E u + e.
    pub(super) fn rate(&self, x: &[f64], lambda: &[f64], u: &[f64]) -> Vec<f64> {
        self.rate_from(self.lcs.e0.clone(), (x, lambda, u))
    }

    /// δx' = A δx + B δλ + E δu.
    pub(super) fn rate_of_change(&self, x: &[f64], lambda: &[f64], u: &[f64]) -> Vec<f64> {
        self.rate_from(vec![0.0; x.len()], (x, lambda, u))
    }

    fn rate_from(&self, mut rate: Vec<f64>, (x, lambda, u): (&[f64], &[f64], &[f64])) -> Vec<f64> {
        let lcs = &self.lcs;
        lcs.a.add_times(1.0, x, &mut rate);
        lcs.b.add_times(1.0, lambda, &mut rate);
        lcs.e.add_times(1.0, u, &mut rate);
        rate
    }

    /// δy of the outputs.
    pub(super) fn output_change(&self, at: Point<'_>) -> Vec<f64> {
        let rows = &self.lcs.output_rows;
        let mut y = vec![0.0; rows.one.len()];
        let parts = [
            (&rows.x, at.x),
            (&rows.lambda, at.lambda),
            (&rows.u, at.u),
            (&rows.du, at.du),
        ];
        for (matrix, values) in parts {
            matrix.add_times(1.0, values, &mut y);
        }
        y
    }

    /// s = X x + U u + k, all capacitor voltages and inductor currents.
    pub(super) fn storage(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let rows = &self.readings.storage;
        let mut s = rows.one.clone();
        rows.x.add_times(1.0, x, &mut s);
        rows.u.add_times(1.0, u, &mut s);
        s
    }

    /// s' = X x' + U u'.
    pub(super) fn storage_rate(&self, slope: &[f64], du: &[f64]) -> Vec<f64> {
        let rows = &self.readings.storage;
        let mut s = vec![0.0; rows.one.len()];
        rows.x.add_times(1.0, slope, &mut s);
        rows.u.add_times(1.0, du, &mut s);
        s
    }

    /// The states of storage quantities that change by s.
    pub(super) fn change_of_storage(&self, s: &[f64]) -> Vec<f64> {
        self.lcs.inject.times(s)
    }

    /// √M_ii of every storage quantity, with the metric M of stored energy; zero where there is none.
    pub(super) fn storage_scale(&self) -> Vec<f64> {
        let mut scale = vec![0.0; self.readings.storage.one.len()];
        for (i, j, value) in self.readings.metric.entries() {
            if i == j && value > 0.0 {
                scale[i] = value.sqrt();
            }
        }
        scale
    }

    /// aᵀ M b with the metric M of stored energy.
    pub(super) fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let entries = self.readings.metric.entries();
        entries.map(|(i, j, value)| a[i] * value * b[j]).sum()
    }

    /// (from sources, dissipated) at a point, W.
    pub(super) fn power(&self, at: Point<'_>) -> (f64, f64) {
        let Readings {
            power,
            power_v,
            power_i,
            ..
        } = &self.readings;
        let (mut source, mut dissipated) = (0.0, 0.0);
        for (i, kind) in power.iter().enumerate() {
            let product = sparse_value(power_v, i, at) * sparse_value(power_i, i, at);
            match kind {
                PowerKind::Source => source -= product,
                PowerKind::Dissipated => dissipated += product,
                PowerKind::Line | PowerKind::Logic => {}
            }
        }
        (source, dissipated)
    }

    /// The work out of the sources, J, in a jump by impulses p of the ports and a step of the inputs: the impulse of one factor times the mean of the other.
    pub(super) fn work_of_sources(
        &self,
        before: Point<'_>,
        after: Point<'_>,
        impulse: (&[f64], &[f64]),
    ) -> f64 {
        let mean =
            |kind| 0.5 * (self.work(kind, before, impulse) + self.work(kind, after, impulse));
        -mean(PowerKind::Source)
    }

    /// What forward drops take up of impulses p that end at a point, J: the work into devices less −(v − v_drop) i of ideal pairs, which is their part of pᵀy.
    pub(super) fn taken_by_drops(&self, after: Point<'_>, p: &[f64]) -> f64 {
        let still = vec![0.0; after.u.len()];
        let taken = self.work(PowerKind::Dissipated, after, (p, &still));
        let lcs = &self.lcs;
        let mut y = lcs.f.clone();
        lcs.c.add_times(1.0, after.x, &mut y);
        lcs.g.add_times(1.0, after.u, &mut y);
        taken + y.iter().zip(p).map(|(y, p)| y * p).sum::<f64>()
    }

    /// The work into the elements of a kind, J, by impulses where the other factor is that of a point.
    fn work(&self, kind: PowerKind, at: Point<'_>, (p, step): (&[f64], &[f64])) -> f64 {
        let Readings {
            power,
            power_v,
            power_i,
            ..
        } = &self.readings;
        let impulse = |rows: &SparseRows, i: usize| -> f64 {
            let of_ports = rows.lambda.row(i).map(|(j, w)| w * p[j]);
            let of_step = rows.du.row(i).map(|(j, w)| w * step[j]);
            of_ports.chain(of_step).sum()
        };
        let elements = (0..power.len()).filter(|&i| power[i] == kind);
        let work = elements.map(|i| {
            impulse(power_i, i) * sparse_value(power_v, i, at)
                + impulse(power_v, i) * sparse_value(power_i, i, at)
        });
        work.sum()
    }

    /// The control of switch i.
    pub(super) fn control(&self, i: usize, at: Point<'_>) -> f64 {
        sparse_value(&self.readings.controls, i, at)
    }
}

impl Watched for System {
    fn inputs(&self) -> &[Input] {
        &self.lcs.inputs
    }

    fn ports(&self) -> &[Port] {
        &self.lcs.ports
    }

    fn control_of_sources(&self, i: usize) -> (Vec<f64>, f64) {
        let SparseRows { u, one, .. } = &self.readings.controls;
        let mut gains = vec![0.0; u.shape[1]];
        u.row(i).for_each(|(j, gain)| gains[j] = gain);
        (gains, one[i])
    }

    fn control_is_free_of(&self, i: usize, of: Part) -> bool {
        let controls = &self.readings.controls;
        let block = match of {
            Part::States => &controls.x,
            Part::Devices => &controls.lambda,
            Part::Slopes => &controls.du,
        };
        block.row(i).next().is_none()
    }
}
