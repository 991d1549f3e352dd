//! A run that is exact throughout, to be differentiated.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix};

use super::survey::Grounds;
use super::{Beside, unsupported};
use crate::analysis::curves::{MOST_VALUES, laps};
use crate::analysis::periodic::steady;
use crate::analysis::variation::{
    Adjoint, Carried, Changes, Drawing, Forms, Lines, Parameter, Sight, Trajectory, Weighted, unit,
};
use crate::integrate::{Error, OrbitKind, Reason, Simulation};
use crate::measure::Curves;
use crate::mna::StandardMultiport;
use crate::model::Model;

/// A run that is differentiated, and which part of it measurements see.
pub(super) struct Base {
    pub(super) trajectory: Trajectory,
    pub(super) forms: Forms,
    pub(super) multiport: StandardMultiport,
    /// Where it begins.
    pub(super) positions: Vec<bool>,
    /// The storage there, and whether it is what `IC=` says.
    pub(super) state: Vec<f64>,
    pub(super) by_initial: bool,
    pub(super) sight: Sight,
    /// s.
    span: (f64, f64),
    pub(super) orbit: Option<Repeated>,
}

/// An orbit as measurements see it: repeated until the end of `.tran`.
pub(super) struct Repeated {
    monodromy: DMatrix<f64>,
    /// s.
    pub(super) period: f64,
    /// From when on it counts, s.
    from: f64,
    /// From when to when measurements see it, s.
    seen: (f64, f64),
}

/// Where a transient begins: whether with what `IC=` says, its storage, and its switches.
type Beginning = (bool, Vec<f64>, Vec<bool>);

pub(super) fn not_smooth(what: String) -> Error {
    Error::before(Reason::NotSmooth(what))
}

impl Base {
    /// `None` where an output has an impulse: of that the variation is not carried along.
    fn of(
        trajectory: Trajectory,
        (simulation, beginning): (&Simulation, Option<Beginning>),
        span: (f64, f64),
        orbit: Option<Repeated>,
    ) -> Result<Option<Self>, Error> {
        let impulses = trajectory
            .saltations
            .iter()
            .filter_map(|s| s.impulse.as_ref());
        let mut areas = impulses.flat_map(|impulse| impulse.areas.iter());
        if areas.any(|area| *area != 0.0) {
            return Ok(None);
        }
        let lengths = trajectory
            .segments
            .iter()
            .map(|segment| segment.to - segment.from);
        // The segment before moves into what is seen.
        let first = trajectory
            .segments
            .iter()
            .rev()
            .find(|segment| segment.to < span.0);
        let sight = Sight {
            from: first.map_or(f64::NEG_INFINITY, |segment| segment.from),
            unit: unit(lengths.fold(0.0, f64::max)),
            most: MOST_VALUES,
        };
        let multiport = simulation.assembler(1.0).multiport().clone();
        let (uic, state, positions) = beginning.unwrap_or_default();
        let initial = multiport.storage.iter().map(|s| s.initial.unwrap_or(0.0));
        Ok(Some(Self {
            forms: Forms::of(&trajectory)?,
            by_initial: uic && initial.eq(state.iter().copied()),
            state,
            multiport,
            trajectory,
            positions,
            sight,
            span,
            orbit,
        }))
    }

    /// What values are looked at beside.
    pub(super) fn grounds(&self) -> Grounds<'_> {
        Grounds {
            multiport: &self.multiport,
            period: self.orbit.as_ref().map(|orbit| orbit.period),
        }
    }

    /// The run as measurements see it.
    pub(super) fn seen(&self, curves: Curves) -> Curves {
        let orbit = self.orbit.as_ref();
        let orbit = orbit.map(|orbit| (orbit.period, orbit.from, orbit.seen));
        seen(curves, self.span, orbit)
    }

    /// δs where the run begins, forward: of an orbit (I − M) δs₀ = φ.
    pub(super) fn start(
        &self,
        changes: &Changes,
        parameter: &Parameter<'_>,
    ) -> Result<DVector<f64>, Error> {
        let Some(Repeated { monodromy: m, .. }) = &self.orbit else {
            return Ok(changes.start().clone());
        };
        let forced = parameter.along(&DVector::zeros(m.nrows()), None)?.1;
        solved(m.clone(), &forced)
    }

    /// Back along the run with what these weigh; of an orbit from λ = (I − Mᵀ)⁻¹ ψ₀ on, with ψ₀ from once around.
    pub(super) fn back(
        &self,
        lines: &Lines,
        drawing: &Drawing,
        weighted: &[&Weighted],
    ) -> Result<Carried, Error> {
        let adjoint = Adjoint {
            trajectory: &self.trajectory,
            forms: &self.forms,
            lines,
            drawing,
        };
        let mut motions = lines.motions(self.sight.unit);
        let last = match &self.orbit {
            Some(Repeated { monodromy: m, .. }) => {
                let start = adjoint.to_start(&mut motions, weighted)?;
                Some(solved(m.transpose(), &start)?)
            }
            None => None,
        };
        adjoint.back(&mut motions, weighted, last.as_ref())
    }
}

/// A run as measurements see it: an orbit (its period, when it counts from, and from when to when they see it, s) again and again, from its beginning, which is not that of the curves.
pub(super) fn seen(
    curves: Curves,
    span: (f64, f64),
    orbit: Option<(f64, f64, (f64, f64))>,
) -> Curves {
    let Some((period, from, asked)) = orbit else {
        return curves.within(span);
    };
    // What is left out of many laps is told where they are measured.
    let (laps, _) = laps(asked, period, curves.values());
    let [begin, end] = [laps.0, laps.1].map(|lap| lap as f64 * period);
    let all = curves.repeated((0, laps.1 - laps.0 + 1), period, from + period - begin);
    all.within((begin, end))
}

/// (I − M)⁻¹ b.
fn solved<C: Dim>(m: DMatrix<f64>, b: &OMatrix<f64, Dyn, C>) -> Result<OMatrix<f64, Dyn, C>, Error>
where
    DefaultAllocator: Allocator<Dyn, C>,
{
    if m.is_empty() {
        return Ok(b.clone());
    }
    let closed = DMatrix::identity(m.nrows(), m.nrows()) - m;
    closed.lu().solve(b).ok_or_else(|| {
        not_smooth("the orbit is one of a family: where it moves is not determined".into())
    })
}

impl Beside<'_> {
    /// The run, where it is exact throughout and nothing that is measured has an impulse.
    pub(super) fn base(&self, model: &Model) -> Result<Option<Base>, Error> {
        let circuit = model.circuit();
        if !self.options.steady {
            let Some(tran) = circuit.tran else {
                return Err(unsupported("the netlist asks for no .tran analysis".into()));
            };
            let mut simulation = self.simulation(model)?;
            let (state, positions) = (simulation.state(), simulation.positions());
            let place = (0.0, &state[..], &positions[..]);
            let cancel = self.options.cancel;
            if !simulation.is_exact() {
                return Ok(None);
            }
            let trajectory = Trajectory::by_chance(&mut simulation, place, tran.tstop, cancel)?;
            let Some(trajectory) = trajectory else {
                return Ok(None);
            };
            let span = (circuit.measured_from(&tran), tran.tstop);
            return Base::of(
                trajectory,
                (&simulation, Some((tran.uic, state, positions))),
                span,
                None,
            );
        }
        let mut found = steady(model, &self.periodic())?;
        let orbit = found.orbit();
        let driven = orbit.kind == OrbitKind::Driven;
        if !driven || !found.is_exact(self.options.cancel)? {
            return Ok(None);
        }
        let (trajectory, from) = found.trajectory(&[], self.options.cancel)?;
        let orbit = Repeated {
            monodromy: trajectory.monodromy(),
            period: orbit.period,
            from,
            seen: self.seen_span(circuit),
        };
        let always = (f64::NEG_INFINITY, f64::INFINITY);
        Base::of(trajectory, (&found.simulation, None), always, Some(orbit))
    }
}
