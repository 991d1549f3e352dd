//! A circuit made linear about its periodic steady state.
//!
//! Within a segment δx = p e^{jωt} + e^{A (t − t₀)} c with (jωI − A) p = E û, and
//!
//! ```text
//! ∫ δx e^{−jΩt} dt = p ∫ e^{−j(Ω−ω)t} dt + (jΩI − A)⁻¹ [c e^{−jΩt₀} − e^{A τ} c e^{−jΩ(t₀+τ)}].
//! ```

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::{Resolvent, resonance};
use crate::analysis::variation::{Saltation, System, Trajectory, shaped, times};
use crate::integrate::Error;

/// The orbit, its period, s, and its monodromy.
pub(super) struct Linear<'a> {
    trajectory: &'a Trajectory,
    period: f64,
    origin: f64,
    monodromy: DMatrix<f64>,
    /// By system: X, U, U' of the outputs.
    outputs: Vec<[DMatrix<f64>; 3]>,
}

/// What the solutions in a mode are made of at one frequency.
struct Forced<'a> {
    resolvent: Resolvent<'a>,
    /// What rounding may leave of its solutions.
    loss: f64,
    /// p.
    state: DVector<Complex<f64>>,
}

/// e^{jωt}.
fn turn(omega: f64, t: f64) -> Complex<f64> {
    Complex::from_polar(1.0, omega * t)
}

/// ∫ e^{−jωt} dt from a to b.
fn turned(omega: f64, a: f64, b: f64) -> Complex<f64> {
    let half = 0.5 * omega * (b - a);
    let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
    turn(-omega, 0.5 * (a + b)) * (sinc * (b - a))
}

impl<'a> Linear<'a> {
    /// With phases counted from the time `origin`, s.
    pub(super) fn of(trajectory: &'a Trajectory, period: f64, origin: f64) -> Self {
        let outputs = |system: &System| {
            let (rows, n, p) = (&system.lcs.outputs.rows, system.lcs.n(), system.lcs.p());
            let k = rows.one.len();
            [
                shaped(&rows.x, k, n),
                shaped(&rows.u, k, p),
                shaped(&rows.du, k, p),
            ]
        };
        Self {
            trajectory,
            period,
            origin,
            monodromy: trajectory.monodromy(),
            outputs: trajectory.systems.iter().map(outputs).collect(),
        }
    }

    /// Y_k(ω) of the outputs for û, sideband by sideband, and what rounding may leave of the solutions in the modes.
    pub(super) fn response(
        &self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
        bands: &[i32],
    ) -> Result<(Vec<Complex<f64>>, f64), Error> {
        let forced = self.forced(omega, drive)?;
        let start = self.start_of(omega, drive, &forced)?;
        let width = self.outputs.first().map_or(0, |[x, ..]| x.nrows());
        let mut sums = vec![DVector::<Complex<f64>>::zeros(width); bands.len()];
        let mut loss = 0.0_f64;
        self.pass(omega, drive, &forced, &start, |k, before, end, after| {
            // A forced part that is larger than what is left of it leaves its rounding.
            let forced = &forced[self.trajectory.segments[k].system];
            let size = |x: &DVector<Complex<f64>>| x.iter().fold(0.0, |m: f64, v| m.max(v.norm()));
            let part = size(&forced.state) / size(before).max(f64::MIN_POSITIVE);
            loss = loss.max(forced.loss * part.max(1.0));
            for (sum, band) in sums.iter_mut().zip(bands) {
                let sideband = omega + f64::from(*band) * TAU / self.period;
                *sum += self.over_segment(k, (omega, sideband), drive, forced, before)?;
                if let (Some(saltation), Some(after)) = (self.trajectory.saltations.get(k), after) {
                    *sum += self.at_event(saltation, (omega, sideband), drive, (end, after));
                }
            }
            Ok(())
        })?;
        let values = sums
            .iter()
            .flat_map(|sum| sum.iter().map(|v| v / self.period));
        Ok((values.collect(), loss))
    }

    /// δs₀ of the solution that repeats but for the factor e^{jωT}.
    pub(super) fn start(
        &self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
    ) -> Result<DVector<Complex<f64>>, Error> {
        self.start_of(omega, drive, &self.forced(omega, drive)?)
    }

    fn start_of(
        &self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
        forced: &[Forced<'_>],
    ) -> Result<DVector<Complex<f64>>, Error> {
        let still = DVector::zeros(self.monodromy.nrows());
        let after = self.pass(omega, drive, forced, &still, |_, _, _, _| Ok(()))?;
        if still.is_empty() {
            return Ok(still);
        }
        self.closed(omega, &after).ok_or_else(|| resonance(omega))
    }

    /// δs₀ = (e^{jωT} − M)⁻¹ Γ û.
    fn closed(&self, omega: f64, after: &DVector<Complex<f64>>) -> Option<DVector<Complex<f64>>> {
        let (q, round) = (after.len(), turn(omega, self.period));
        let closed = DMatrix::from_fn(q, q, |i, j| {
            let own = if i == j { round } else { Complex::default() };
            own - self.monodromy[(i, j)]
        });
        let start = closed.lu().solve(after)?;
        start.iter().all(|v| v.is_finite()).then_some(start)
    }

    /// By system.
    fn forced(&self, omega: f64, drive: &DVector<Complex<f64>>) -> Result<Vec<Forced<'_>>, Error> {
        let of = |system: &'a System| {
            let resolvent = Resolvent::of(&system.lcs.a, system.basis.as_ref(), omega);
            let state = resolvent.solve(times(&system.inputs, drive));
            Ok(Forced {
                loss: resolvent.loss(),
                state: state.ok_or_else(|| resonance(omega))?,
                resolvent,
            })
        };
        self.trajectory.systems.iter().map(of).collect()
    }

    fn time(&self, t: f64) -> f64 {
        t - self.origin
    }

    /// Goes round from δs at the start to δs a period later, δu included; `visit` gets each segment with its δx at the beginning and at the
    /// end, and the δx at the beginning of the next.
    fn pass(
        &self,
        omega: f64,
        drive: &DVector<Complex<f64>>,
        forced: &[Forced<'_>],
        start: &DVector<Complex<f64>>,
        mut visit: impl FnMut(
            usize,
            &DVector<Complex<f64>>,
            &DVector<Complex<f64>>,
            Option<&DVector<Complex<f64>>>,
        ) -> Result<(), Error>,
    ) -> Result<DVector<Complex<f64>>, Error> {
        let Trajectory {
            systems,
            segments,
            saltations,
            ..
        } = self.trajectory;
        let Some(first) = segments.first() else {
            return Ok(start.clone());
        };
        let mut x = times(&systems[first.system].lcs.storage.inject, start);
        for (k, segment) in segments.iter().enumerate() {
            let end = self.end(k, omega, &forced[segment.system], &x);
            let Some(saltation) = saltations.get(k) else {
                visit(k, &x, &end, None)?;
                let system = &systems[segment.system];
                let now = drive * turn(omega, self.time(segment.to));
                return Ok(times(&system.lcs.storage.x, &end) + times(&system.storage_inputs, &now));
            };
            let now = drive * turn(omega, self.time(saltation.t));
            let rates = &now * Complex::new(0.0, omega);
            let next = times(&saltation.x, &end)
                + times(&saltation.u, &now)
                + times(&saltation.du, &rates);
            visit(k, &x, &end, Some(&next))?;
            x = next;
        }
        Ok(start.clone())
    }

    /// δx at the end of a segment.
    fn end(
        &self,
        k: usize,
        omega: f64,
        forced: &Forced<'_>,
        start: &DVector<Complex<f64>>,
    ) -> DVector<Complex<f64>> {
        let segment = &self.trajectory.segments[k];
        let [from, to] = [segment.from, segment.to].map(|t| turn(omega, self.time(t)));
        times(&segment.propagator, &(start - &forced.state * from)) + &forced.state * to
    }

    /// ∫ δy e^{−jΩt} dt over a segment.
    fn over_segment(
        &self,
        k: usize,
        (omega, sideband): (f64, f64),
        drive: &DVector<Complex<f64>>,
        forced: &Forced<'_>,
        start: &DVector<Complex<f64>>,
    ) -> Result<DVector<Complex<f64>>, Error> {
        let segment = &self.trajectory.segments[k];
        let [from, to] = [segment.from, segment.to].map(|t| self.time(t));
        let [x, u, du] = &self.outputs[segment.system];
        let wave = turned(sideband - omega, from, to);
        let rates = times(du, drive) * Complex::new(0.0, omega);
        let direct = (times(u, drive) + rates + times(x, &forced.state)) * wave;
        let free = start - &forced.state * turn(omega, from);
        let left = times(&segment.propagator, &free) * turn(-sideband, to);
        let passed = free * turn(-sideband, from) - left;
        let system = &self.trajectory.systems[segment.system];
        let integral = if sideband == omega {
            forced.resolvent.solve(passed)
        } else {
            Resolvent::of(&system.lcs.a, system.basis.as_ref(), sideband).solve(passed)
        };
        Ok(direct + times(x, &integral.ok_or_else(|| resonance(sideband))?))
    }

    /// What the shift of an event adds: (y⁻ − y⁺) δt e^{−jΩt}, and of impulses of area a (δa − jΩ a δt) e^{−jΩt}.
    fn at_event(
        &self,
        saltation: &Saltation,
        (omega, sideband): (f64, f64),
        drive: &DVector<Complex<f64>>,
        (before, after): (&DVector<Complex<f64>>, &DVector<Complex<f64>>),
    ) -> DVector<Complex<f64>> {
        let t = self.time(saltation.t);
        let now = drive * turn(omega, t);
        let shift = saltation
            .timing
            .as_ref()
            .map_or(Complex::default(), |timing| {
                let rates = &now * Complex::new(0.0, omega);
                let parts = [(&timing.x, before), (&timing.u, &now), (&timing.du, &rates)];
                let terms = parts
                    .into_iter()
                    .flat_map(|(row, values)| row.iter().zip(values.iter()));
                terms.map(|(row, value)| value * *row).sum()
            });
        let mut all = saltation.step.map(|step| shift * step);
        if let Some(impulse) = &saltation.impulse {
            let areas = impulse.variation((before, after), &now, shift);
            all += areas
                - impulse
                    .areas
                    .map(|a| shift * Complex::new(0.0, sideband * a));
        }
        all * turn(-sideband, t)
    }
}
