//! What becomes of a change of one value: the variational equation with a column for it.
//!
//! ```text
//! δx' = A δx + E δu + A_p x + E_p u + e_p,     δt = −(γ_x δx⁻ + γ_u δu + γ_p)/γ̇,
//! δx⁺ = J⁺ (X⁻ (δx⁻ + f⁻ δt) + U⁻ (δu + u' δt)) − f⁺ δt + ∂_p [J⁺ (X⁻ x⁻ + U⁻ u + k⁻) + j⁺]
//! ```
//!
//! at the time at which the event was without the change; an edge of a source has the δt of that source. Matrices, guards and sources are
//! differentiated by extrapolated differences of the circuits with p (1 ± h) and p (1 ± 2h), which are reduced for the same modes: they are rational
//! functions of p, so that nothing of a run's events is in the differences.

use nalgebra::{DMatrix, DVector};

use super::flow::{Flow, Flows, Sources};
use super::instant::Inputs;
use super::linear::parts;
use super::moved::{Moved, Sight};
use super::saltation::{Side, Timing};
use super::{Saltation, System, Trajectory, not_smooth, shaped};
use crate::circuit::Source;
use crate::circuit::source::Piece;
use crate::integrate::exact::{Assembler, Exosystem, Owner, Shape, Spectrum};
use crate::integrate::switching::Threshold;
use crate::integrate::{Error, Simulation};
use crate::measure::INTERVALS;
use crate::settings::tolerances::events::SAME_TIMING;
use crate::settings::tolerances::periodic::VALUE_STEP;
use crate::settings::tolerances::times::SAME_LENGTH;

/// The circuits that are compared, in steps of p h.
pub(crate) const STEPS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// (8 (f(h) − f(−h)) − (f(2h) − f(−2h)))/12h
const WEIGHTS: [f64; 4] = [1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0];

/// The circuit with p a little aside, in the modes of a trajectory.
pub(crate) struct Near {
    systems: Vec<System>,
    thresholds: Vec<Threshold>,
    assembler: Assembler,
    /// Where its transient begins.
    pub(crate) state: Vec<f64>,
}

impl Near {
    /// Of its simulation.
    pub(crate) fn of(simulation: &mut Simulation, trajectory: &Trajectory) -> Result<Self, Error> {
        let ends = trajectory.segments.first().zip(trajectory.segments.last());
        let span = ends.map_or(1.0, |(first, last)| last.to - first.from);
        let state = simulation.state();
        let mut assembler = simulation.assembler(span);
        let mut systems = Vec::new();
        for system in &trajectory.systems {
            let near = System::of(&system.key, &mut assembler)?;
            let same = near.lcs.states == system.lcs.states && near.lcs.fast == system.lcs.fast;
            if !same {
                return Err(not_smooth(0.0, "another value makes other states"));
            }
            systems.push(near);
        }
        Ok(Self {
            thresholds: assembler.thresholds(),
            systems,
            assembler,
            state,
        })
    }
}

/// Σ weights · f over the circuits, over h: the derivative with ln p.
fn weighted(parts: [DVector<f64>; 4]) -> DVector<f64> {
    let [a, b, c, d] = parts;
    let sum = a * WEIGHTS[0] + b * WEIGHTS[1] + c * WEIGHTS[2] + d * WEIGHTS[3];
    sum / VALUE_STEP
}

/// The same of matrices.
fn weighted_matrix(parts: [DMatrix<f64>; 4]) -> DMatrix<f64> {
    let [a, b, c, d] = parts;
    let sum = a * WEIGHTS[0] + b * WEIGHTS[1] + c * WEIGHTS[2] + d * WEIGHTS[3];
    sum / VALUE_STEP
}

/// The sources on a segment: their closed forms, and those of the circuits that are compared.
struct Forms {
    own: Vec<Piece>,
    near: [Vec<Piece>; 4],
}

/// The sources on their way from t = 0. Those of the circuits that are compared stand on the pieces of the same number, wherever their edges have
/// moved to.
struct Walk<'a> {
    sources: Vec<[&'a Source; 5]>,
    own: Vec<Piece>,
    near: [Vec<Piece>; 4],
}

impl<'a> Walk<'a> {
    fn of(trajectory: &'a Trajectory, near: &'a [Near; 4]) -> Result<Self, Error> {
        let own = trajectory.systems.first().map(|system| &system.lcs.inputs);
        let near = near.each_ref().map(|near| near.systems.first());
        let sources = (0..own.map_or(0, Vec::len)).filter_map(|i| {
            let [a, b, c, d] = near.map(|system| Some(&system?.lcs.inputs[i].source));
            Some([&own?[i].source, a?, b?, c?, d?])
        });
        let sources: Vec<[&Source; 5]> = sources.collect();
        let at_start = |m: usize| -> Result<Vec<Piece>, Error> {
            let pieces = sources.iter().map(|source| piece(source[m], 0.0));
            pieces.collect()
        };
        Ok(Self {
            own: at_start(0)?,
            near: [at_start(1)?, at_start(2)?, at_start(3)?, at_start(4)?],
            sources,
        })
    }

    /// To the pieces at t, no earlier than the time before.
    fn advance(&mut self, t: f64) -> Result<(), Error> {
        for (i, sources) in self.sources.iter().enumerate() {
            while self.own[i].end <= t {
                let [a, b, c, d] = &mut self.near;
                let pieces = [&mut self.own[i], &mut a[i], &mut b[i], &mut c[i], &mut d[i]];
                for (source, standing) in sources.iter().zip(pieces) {
                    *standing = following(source, standing)?;
                }
            }
        }
        Ok(())
    }
}

fn piece(source: &Source, t: f64) -> Result<Piece, Error> {
    let piece = source.piece(t);
    piece.ok_or_else(|| not_smooth(t, "a source has no closed form"))
}

/// The piece after one: the last is followed by itself.
fn following(source: &Source, standing: &Piece) -> Result<Piece, Error> {
    let mut t = standing.end;
    while t.is_finite() {
        let next = piece(source, t)?;
        if next.end > standing.end {
            return Ok(next);
        }
        t = t.next_up();
    }
    Ok(*standing)
}

/// A trajectory and the circuits beside it.
pub(crate) struct Parameter<'a> {
    pub(crate) trajectory: &'a Trajectory,
    pub(crate) near: &'a [Near; 4],
    /// By segment.
    forms: Vec<Forms>,
}

/// Sees a segment from w on; whether that is all of it.
fn see(
    flow: &mut Flow,
    (begin, seconds): (f64, f64),
    w: &DVector<f64>,
    sight: Sight,
    (segment, moved): (usize, &mut Moved),
) -> Result<bool, Error> {
    let (mut w, spectrum) = (w.clone(), flow.spectrum.clone());
    for part in parts(&spectrum, sight.unit, (0.0, seconds)) {
        if moved.values() > sight.most {
            return Ok(false);
        }
        let mut samples = vec![flow.sample(&w)];
        for _ in 0..INTERVALS {
            flow.advance(&mut w, part.length / INTERVALS as f64, 0.0)?;
            samples.push(flow.sample(&w));
        }
        moved.push(segment, (begin, seconds), (part.age, part.length), &samples);
    }
    Ok(true)
}

impl<'a> Parameter<'a> {
    pub(crate) fn of(trajectory: &'a Trajectory, near: &'a [Near; 4]) -> Result<Self, Error> {
        let mut walk = Walk::of(trajectory, near)?;
        let forms = trajectory.segments.iter().map(|segment| {
            walk.advance(0.5 * (segment.from + segment.to))?;
            Ok(Forms {
                own: walk.own.clone(),
                near: walk.near.clone(),
            })
        });
        Ok(Self {
            forms: forms.collect::<Result<_, Error>>()?,
            trajectory,
            near,
        })
    }

    /// ∂s/∂ln p of where the transients of these circuits begin.
    pub(crate) fn weighted_states(near: &[Near; 4]) -> DVector<f64> {
        weighted(
            near.each_ref()
                .map(|near| DVector::from_column_slice(&near.state)),
        )
    }

    /// u and its rates at t, as segment k has them.
    fn inputs(pieces: &[Piece], t: f64) -> Inputs {
        let values = |value: fn(&Piece, f64) -> f64| {
            DVector::from_iterator(pieces.len(), pieces.iter().map(|piece| value(piece, t)))
        };
        Inputs {
            u: values(Piece::value),
            du: values(Piece::derivative),
            ddu: values(Piece::second_derivative),
        }
    }

    /// δx at the start of the first segment, where δs is that of the storage.
    fn start(&self, ds: &DVector<f64>) -> DVector<f64> {
        let first = &self.trajectory.segments[0];
        let system = &self.trajectory.systems[first.system];
        let inputs = Self::inputs(&self.forms[0].own, first.from);
        let storage = system.storage(&first.start, &inputs.u);
        let moved = self
            .near
            .each_ref()
            .map(|near| near.systems[first.system].state(storage.as_slice()));
        weighted(moved) + &system.lcs.storage.inject * ds
    }

    /// δs where δx is that of the state at the end.
    fn end(&self, dx: &DVector<f64>) -> DVector<f64> {
        let k = self.trajectory.segments.len() - 1;
        let last = &self.trajectory.segments[k];
        let system = &self.trajectory.systems[last.system];
        let parts = std::array::from_fn(|m| {
            let inputs = Self::inputs(&self.forms[k].near[m], last.to);
            self.near[m].systems[last.system].storage(&last.end, &inputs.u)
        });
        weighted(parts) + &system.lcs.storage.x * dx
    }

    /// The equation of segment k among those that are known, and w where it begins.
    fn enter(&self, flows: &mut Flows, k: usize, dx: &DVector<f64>) -> (usize, DVector<f64>) {
        let segment = &self.trajectory.segments[k];
        let forms = &self.forms[k];
        let (n, p) = (dx.len(), forms.own.len());
        // The sources that move have their closed forms beside them.
        let moving: Vec<usize> = (0..p)
            .filter(|&i| forms.near.iter().any(|near| near[i] != forms.own[i]))
            .collect();
        let beside = moving
            .iter()
            .flat_map(|&i| forms.near.iter().map(move |near| near[i]));
        let pieces: Vec<Piece> = forms.own.iter().copied().chain(beside).collect();
        let shapes: Vec<Shape> = pieces.iter().map(|piece| Shape::of([piece])).collect();
        let exosystem = Exosystem::new(&shapes, pieces);
        let dz = exosystem.dim();
        let own = exosystem.output().rows(0, p).into_owned();
        let mut change = DMatrix::zeros(p, dz);
        for (j, &i) in moving.iter().enumerate() {
            for (m, weight) in WEIGHTS.iter().enumerate() {
                let row = exosystem.output().row(p + 4 * j + m) * (weight / VALUE_STEP);
                let mut sum = change.row_mut(i);
                sum += row;
            }
        }
        let sources = Sources {
            own,
            change,
            generator: exosystem.generator().clone(),
        };
        let at = flows.place(segment.system, sources, |sources| {
            let (generator, rows) = self.equation(segment.system, sources);
            let a = &self.trajectory.systems[segment.system].lcs.a;
            (generator, rows, Spectrum::new(a, exosystem.rates()))
        });
        let mut w = DVector::zeros(2 * n + dz);
        w.rows_mut(0, n).copy_from(&segment.start);
        exosystem.write(segment.from, &mut w.as_mut_slice()[n..n + dz]);
        w.rows_mut(n + dz, n).copy_from(dx);
        (at, w)
    }

    /// 𝒢, and y and δy over w, in a mode with these sources.
    fn equation(&self, at: usize, sources: &Sources) -> (DMatrix<f64>, [DMatrix<f64>; 2]) {
        let system = &self.trajectory.systems[at];
        let (n, p) = (system.lcs.n(), sources.own.nrows());
        let (own, change, dz) = (&sources.own, &sources.change, sources.own.ncols());
        let of_near = |f: &dyn Fn(&System) -> DMatrix<f64>| {
            weighted_matrix(self.near.each_ref().map(|near| f(&near.systems[at])))
        };
        let constant = |system: &System| DMatrix::from_column_slice(n, 1, system.lcs.e0.as_slice());
        let dim = 2 * n + dz;
        let mut generator = DMatrix::zeros(dim, dim);
        let mut put = |i: usize, j: usize, block: &DMatrix<f64>| {
            let mut view = generator.view_mut((i, j), block.shape());
            view += block;
        };
        put(0, 0, &system.lcs.a);
        put(0, n, &(&system.inputs * own));
        put(0, n, &constant(system));
        put(n, n, &sources.generator);
        put(n + dz, 0, &of_near(&|s| s.lcs.a.clone()));
        put(n + dz, n, &(of_near(&|s| s.inputs.clone()) * own));
        put(n + dz, n, &(&system.inputs * change));
        put(n + dz, n, &of_near(&constant));
        put(n + dz, n + dz, &system.lcs.a);
        let outputs = &system.lcs.outputs.rows;
        let count = outputs.one.len();
        let over = |rows: &crate::lcs::Rows, h: &DMatrix<f64>, one: bool| {
            let mut out = DMatrix::zeros(count, n + dz);
            out.columns_mut(0, n).copy_from(&shaped(&rows.x, count, n));
            let slopes = shaped(&rows.du, count, p) * (h * &sources.generator);
            let mut z = out.columns_mut(n, dz);
            z += shaped(&rows.u, count, p) * h + slopes;
            if one {
                let mut ones = out.column_mut(n);
                ones += &rows.one;
            }
            out
        };
        let plain = over(outputs, own, true);
        let moved = weighted_matrix(
            self.near
                .each_ref()
                .map(|near| over(&near.systems[at].lcs.outputs.rows, own, true)),
        );
        let by_sources = over(outputs, change, false).columns(n, dz).into_owned();
        let mut rows = [DMatrix::zeros(count, dim), DMatrix::zeros(count, dim)];
        rows[0].columns_mut(0, n + dz).copy_from(&plain);
        rows[1].columns_mut(0, n + dz).copy_from(&moved);
        let mut z = rows[1].columns_mut(n, dz);
        z += by_sources;
        rows[1]
            .columns_mut(n + dz, n)
            .copy_from(&plain.columns(0, n));
        (generator, rows)
    }

    /// Goes along the trajectory from δs: what is seen of it, and δs at the end. Nothing where that takes too many values.
    ///
    /// # Errors
    /// The derivative does not exist.
    pub(crate) fn along(
        &self,
        ds: &DVector<f64>,
        sight: Option<Sight>,
    ) -> Result<Option<(Moved, DVector<f64>)>, Error> {
        let segments = &self.trajectory.segments;
        let outputs = self.trajectory.systems.first();
        let mut moved = Moved::of(outputs.map_or(0, |system| system.lcs.outputs.names.len()));
        let mut dx = self.start(ds);
        let (mut lengths, mut ends) = (Vec::new(), vec![0.0]);
        let mut flows = Flows::default();
        for (k, segment) in segments.iter().enumerate() {
            let (at, mut w) = self.enter(&mut flows, k, &dx);
            let flow = flows.at(at);
            let seconds = segment.to - segment.from;
            lengths.push(seconds);
            if let Some(sight) = sight.filter(|sight| segment.to > sight.from)
                && !see(flow, (segment.from, seconds), &w, sight, (k, &mut moved))?
            {
                return Ok(None);
            }
            flow.advance(&mut w, seconds, SAME_LENGTH * segment.to.abs())?;
            dx = w.rows(w.len() - dx.len(), dx.len()).into_owned();
            if sight.is_some() {
                self.stays(k, &dx)?;
            }
            let Some(saltation) = self.trajectory.saltations.get(k) else {
                ends.push(0.0);
                dx = self.end(&dx);
                break;
            };
            let dt = self.shift(k, saltation, &dx)?;
            ends.push(dt);
            dx = self.passed(k, saltation, &dx, dt);
        }
        moved.stretch(&lengths, &ends);
        Ok(Some((moved, dx)))
    }

    /// Whether what rests at its threshold in segment k stays there, so that both signs of a change have the same derivative.
    fn stays(&self, k: usize, dx: &DVector<f64>) -> Result<(), Error> {
        let segment = &self.trajectory.segments[k];
        let near = &self.near[0];
        for (owner, which) in &segment.resting {
            let system = &self.trajectory.systems[segment.system];
            let guards = system.guards(*owner, (&near.thresholds, |i| near.assembler.limits(i)));
            let Some(guard) = guards.get(*which) else {
                continue;
            };
            let inputs = Self::inputs(&self.forms[k].own, segment.to);
            let size = guard.value(&segment.end, &inputs).1;
            let change = self.guard_change(k, (*owner, *which), segment.to)? + guard.x.dot(dx);
            if change.abs() > SAME_TIMING * size {
                let name = match owner {
                    Owner::Device(pair) => near.assembler.device(*pair).unwrap_or_default(),
                    Owner::Switch(i) | Owner::Slide(i, _) => &near.thresholds[*i].name,
                };
                let what = format!(
                    "{name} rests at its threshold, which it leaves on one side of this value alone"
                );
                return Err(not_smooth(segment.to, what));
            }
        }
        Ok(())
    }

    /// δt of the event after segment k.
    fn shift(&self, k: usize, saltation: &Saltation, dx: &DVector<f64>) -> Result<f64, Error> {
        let (segment, t) = (&self.trajectory.segments[k], saltation.t);
        if let Some(timing) = &saltation.timing {
            let own = self.shift_of(k, (timing, t), dx)?;
            for other in &saltation.others {
                let apart = (self.shift_of(k, (other, t), dx)? - own).abs();
                if apart > SAME_TIMING * own.abs().max(segment.to - segment.from) {
                    let what = "two events coincide that part when the value is another";
                    return Err(not_smooth(t, what));
                }
            }
            return Ok(own);
        }
        self.edge(k, t)
    }

    /// The same by one of its guards.
    fn shift_of(
        &self,
        k: usize,
        (timing, t): (&Timing, f64),
        dx: &DVector<f64>,
    ) -> Result<f64, Error> {
        let change = self.guard_change(k, timing.guard, t)?;
        Ok((&timing.x * dx)[0] - change / timing.slope)
    }

    /// Derivative of a guard with ln p where the state stays as it is at the end of segment k.
    fn guard_change(&self, k: usize, (owner, which): (Owner, usize), t: f64) -> Result<f64, Error> {
        let segment = &self.trajectory.segments[k];
        let mut values = [0.0; 4];
        for (m, value) in values.iter_mut().enumerate() {
            let near = &self.near[m];
            let limits = |i| near.assembler.limits(i);
            let guards = near.systems[segment.system].guards(owner, (&near.thresholds, limits));
            let guard = guards
                .get(which)
                .ok_or_else(|| not_smooth(t, "an event has no guard where the value is another"))?;
            *value = guard
                .value(&segment.end, &Self::inputs(&self.forms[k].near[m], t))
                .0;
        }
        let change: f64 = values
            .iter()
            .zip(WEIGHTS)
            .map(|(value, weight)| value * weight)
            .sum();
        Ok(change / VALUE_STEP)
    }

    /// δt of the sources that jump after segment k.
    fn edge(&self, k: usize, t: f64) -> Result<f64, Error> {
        let segment = &self.trajectory.segments[k];
        let (own, after) = (&self.forms[k].own, &self.forms[k + 1].own);
        let jumps = |i: &usize| {
            let (left, right) = (own[*i].value(t), after[*i].value(t));
            (left - right).abs() > 64.0 * f64::EPSILON * left.abs().max(right.abs())
        };
        let mut found: Option<f64> = None;
        for i in (0..own.len()).filter(jumps) {
            let ends = self.forms[k].near.each_ref().map(|pieces| pieces[i].end);
            let change: f64 = ends
                .iter()
                .zip(WEIGHTS)
                .map(|(end, weight)| end * weight)
                .sum();
            let change = if change.is_finite() {
                change / VALUE_STEP
            } else {
                0.0
            };
            let length = segment.to - segment.from;
            match found {
                Some(other)
                    if (other - change).abs()
                        > SAME_TIMING * other.abs().max(change.abs()).max(SAME_TIMING * length) =>
                {
                    return Err(not_smooth(
                        t,
                        "edges of sources coincide that part when the value is another",
                    ));
                }
                _ => found = Some(change),
            }
        }
        Ok(found.unwrap_or(0.0))
    }

    /// δx after the event that follows segment k.
    fn passed(&self, k: usize, saltation: &Saltation, dx: &DVector<f64>, dt: f64) -> DVector<f64> {
        let segments = &self.trajectory.segments;
        let (from, to) = (segments[k].system, segments[k + 1].system);
        let (systems, t) = (&self.trajectory.systems, saltation.t);
        let side = |at: usize, x: &DVector<f64>, pieces: &[Piece]| Side {
            system: &systems[at],
            x: x.clone(),
            inputs: Self::inputs(pieces, t),
        };
        let before = side(from, &segments[k].end, &self.forms[k].own);
        let after = side(to, &segments[k + 1].start, &self.forms[k + 1].own);
        let parts = std::array::from_fn(|m| {
            let near = &self.near[m].systems;
            let [left, right] = [k, k + 1].map(|k| Self::inputs(&self.forms[k].near[m], t));
            let mut storage = near[from].storage(&segments[k].end, &left.u);
            if let Some(jump) = saltation.through {
                storage = near[jump].storage(&near[jump].state(storage.as_slice()), &right.u);
            }
            near[to].state(storage.as_slice())
        });
        let mut inject = systems[to].lcs.storage.inject.clone();
        let mut drift = DVector::zeros(inject.nrows());
        if let Some(jump) = saltation.through.map(|at| &systems[at]) {
            drift += &inject * (&jump.storage_inputs * &after.inputs.du);
            inject = inject * &jump.lcs.storage.x * &jump.lcs.storage.inject;
        }
        drift += &inject * before.storage_rate() - after.rate();
        weighted(parts) + &inject * (&systems[from].lcs.storage.x * dx) + drift * dt
    }
}
