//! The static response of an orbit that is made of steps, by another way: orbits with sources that are a little higher and lower.

use nalgebra::{Complex, DVector};

use super::orbit::Linear;
use crate::analysis::periodic::{PeriodicOptions, Steady};
use crate::integrate::{Error, OrbitKind, Reason};
use crate::lcs::Input;
use crate::settings::tolerances::periodic::{
    LEAST_SHIFTED, SHIFTED, SHIFTED_OTHERWISE, SHIFTED_SOURCES, STATIC, TOO_SLOW,
};

/// Instants of a period at which the largest source is looked for.
const INSTANTS: u16 = 16;

/// By how much orbits beside this one move its state otherwise than its variational equation says, relative to that. `None` where that is not
/// known: nothing drives the orbit, a multiplier is 1 but for [`TOO_SLOW`], sources hardly move the state, or there is no orbit beside.
///
/// # Errors
/// [`Reason::NotSmooth`] where it is more than [`SHIFTED_OTHERWISE`].
pub(super) fn confirmed(
    found: &Steady,
    linear: &Linear<'_>,
    (inputs, drive): (&[Input], &DVector<Complex<f64>>),
    asked: &PeriodicOptions<'_>,
) -> Result<Option<f64>, Error> {
    let orbit = found.orbit();
    let slow = |&[re, im]: &[f64; 2]| (1.0 - re).hypot(im) < TOO_SLOW;
    if orbit.kind != OrbitKind::Driven || orbit.multipliers.iter().any(slow) {
        return Ok(None);
    }
    let direction = drive.map(|phasor| Complex::from(phasor.norm()));
    let omega = STATIC * std::f64::consts::TAU / orbit.period;
    let own = linear.start(omega, &direction)?.map(|moved| moved.re);
    let sizes = found.sizes();
    let size = |state: &DVector<f64>| {
        let parts = state.iter().zip(&sizes);
        parts.fold(0.0_f64, |m, (v, size)| m.max(v.abs() / size))
    };
    let times =
        (0..INSTANTS).map(|k| found.from() + orbit.period * f64::from(k) / f64::from(INSTANTS));
    let values = times.flat_map(|t| inputs.iter().map(move |input| input.source.value(t).abs()));
    let sources = SHIFTED_SOURCES * values.fold(0.0, f64::max) / drive.camax();
    let by = sources.min(SHIFTED / size(&own));
    let moves = by * size(&own);
    if moves.is_nan() || moves < LEAST_SHIFTED {
        return Ok(None);
    }
    let beside = |by: f64| {
        let shifts = inputs.iter().zip(drive.iter());
        let shifts: Vec<(&str, f64)> = shifts
            .map(|(input, phasor)| (input.name.as_str(), by * phasor.norm()))
            .collect();
        found.beside(&shifts, asked)
    };
    let (Some(high), Some(low)) = (beside(by)?, beside(-by)?) else {
        return Ok(None);
    };
    let moved = (DVector::from_vec(high) - DVector::from_vec(low)) / (2.0 * by);
    let off = size(&(moved - &own)) / size(&own);
    if off > SHIFTED_OTHERWISE {
        let what = format!(
            "orbits with sources a little higher and lower are {off:.0e} of the way between them from where tangents have them"
        );
        return Err(Error::at(found.from(), Reason::NotSmooth(what)));
    }
    Ok(Some(off))
}
