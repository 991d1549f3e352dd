//! Responses about the orbits of large circuits, in the steps of these: no matrix of a period is written down.
//!
//! ```text
//! (e^{jωT} − M) δs₀ = Γ(ω) û,      Y_k(ω) = (1/T) [∫ δy e^{−jΩt} dt + Σ (y⁻ − y⁺) δt e^{−jΩt}],      Ω = ω + 2πk/T,
//! ```
//!
//! with M and Γ by products, and the integrals as the steps have them ([`Returns::driven`]). The products that one frequency needs serve the next ones.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::{Error, Reason};
use crate::integrate::{Returns, Sine, Tape};
use crate::linalg::krylov::Recycled;
use crate::settings::tolerances::periodic::{LEAST_WEIGHT, MOST_RECYCLED, RESPONSE_CLOSED};

/// An orbit in steps, and what was multiplied with its derivative.
pub(super) struct Stepped {
    tape: Tape,
    period: f64,
    from: f64,
    recycled: Recycled,
    /// Roots of the energies of the storage quantities.
    weights: DVector<f64>,
}

impl Stepped {
    /// Of an orbit that begins at `from`, s.
    pub(super) fn of(returns: &Returns, tape: Tape, (period, from): (f64, f64)) -> Self {
        let weights = DVector::from_vec(returns.scale());
        let most = weights.amax();
        let least = if most > 0.0 { LEAST_WEIGHT * most } else { 1.0 };
        Self {
            tape,
            period,
            from,
            recycled: Recycled::new(),
            weights: weights.map(|weight| weight.max(least)),
        }
    }

    /// Y_k(ω) of the outputs for û, sideband by sideband.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`]: there is no derivative, or too many products do not tell the solution.
    pub(super) fn response(
        &mut self,
        returns: &mut Returns,
        omega: f64,
        (phasors, bands): (&[Complex<f64>], &[i32]),
    ) -> Result<Vec<Complex<f64>>, Error> {
        let (period, from) = (self.period, self.from);
        let sine = Sine {
            phasors,
            omega,
            origin: from,
        };
        let open = || {
            let what =
                "devices on the orbit share currents or voltages in a way that no derivative tells";
            Error::at(from, Reason::NotSmooth(what.into()))
        };
        let still = vec![Complex::default(); self.weights.len()];
        let forced = returns.driven(&self.tape, &still, (sine, &[]))?;
        let forced = DVector::from_vec(forced.ok_or_else(open)?.end);
        let right = forced.zip_map(&self.weights, |value, weight| value * weight);
        let (tape, weights) = (&self.tape, &self.weights);
        let mut product = |v: &DVector<f64>| {
            let change = v.component_div(weights);
            let image = returns.product(tape, change.as_slice()).ok_or_else(open)?;
            Ok::<_, Error>(DVector::from_vec(image).component_mul(weights))
        };
        let round = Complex::from_polar(1.0, omega * period);
        let limits = (RESPONSE_CLOSED, MOST_RECYCLED);
        let start = self.recycled.solve(&mut product, (round, &right), limits)?;
        let start = start.ok_or_else(|| {
            let f = omega / TAU;
            let what = format!("at {f:e} Hz {MOST_RECYCLED} products with the derivative of the orbit do not tell the response: the circuit resonates, or has as many slow modes");
            Error::at(from, Reason::NotSmooth(what))
        })?;
        let start = start.zip_map(&self.weights, |value, weight| value / weight);
        let bands = bands.iter().map(|k| omega + f64::from(*k) * TAU / period);
        let bands: Vec<f64> = bands.collect();
        let driven = returns.driven(&self.tape, start.as_slice(), (sine, &bands))?;
        let integrals = driven.ok_or_else(open)?.integrals;
        Ok(integrals.iter().flatten().map(|sum| sum / period).collect())
    }
}
