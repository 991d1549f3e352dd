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
use crate::settings::tolerances::periodic::{LEFT_OF_RESPONSE, MOST_RECYCLED, RESPONSE_CLOSED};

/// Corrections of the state that repeats, with the products of longer steps.
const CORRECTIONS: usize = 8;

/// An orbit in the steps that it was found in, and what was multiplied with its derivative.
pub(super) struct Stepped<'a> {
    tape: &'a Tape,
    period: f64,
    from: f64,
    recycled: Recycled,
    /// Roots of the energies of the storage quantities.
    weights: DVector<f64>,
}

impl<'a> Stepped<'a> {
    /// Of an orbit that begins at `from`, s.
    pub(super) fn of(returns: &Returns, tape: &'a Tape, (period, from): (f64, f64)) -> Self {
        Self {
            tape,
            period,
            from,
            recycled: Recycled::new(),
            weights: returns.weights(),
        }
    }

    /// Y_k(ω) of the outputs for û in the steps of a tape, sideband by sideband.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`]: there is no derivative, or too many products do not tell the solution.
    pub(super) fn response(
        &mut self,
        returns: &mut Returns,
        (tape, omega): (&Tape, f64),
        (phasors, bands): (&[Complex<f64>], &[i32]),
    ) -> Result<Vec<Complex<f64>>, Error> {
        let (period, from) = (self.period, self.from);
        let sine = Sine {
            phasors,
            omega,
            origin: from,
        };
        let bands = bands.iter().map(|k| omega + f64::from(*k) * TAU / period);
        let bands: Vec<f64> = bands.collect();
        let round = Complex::from_polar(1.0, omega * period);
        let (mut start, mut size) = (vec![Complex::default(); self.weights.len()], None);
        for _ in 0..CORRECTIONS {
            let driven = returns.driven(tape, &start, (sine, &bands))?;
            let driven = driven.ok_or_else(|| open(from))?;
            let left = driven.end.iter().zip(&start).zip(&self.weights);
            let left = left.map(|((end, start), weight)| (end - round * start) * *weight);
            let left = DVector::from_iterator(start.len(), left);
            let size = *size.get_or_insert_with(|| left.norm());
            if left.norm() <= RESPONSE_CLOSED * size {
                let sums = driven.integrals.iter().flatten();
                return Ok(sums.map(|sum| sum / period).collect());
            }
            let by = self
                .closed(returns, round, &left)?
                .ok_or_else(|| untold(omega, from))?;
            let weighed = by.iter().zip(&self.weights);
            for (start, (by, weight)) in start.iter_mut().zip(weighed) {
                *start += by / *weight;
            }
        }
        Err(untold(omega, from))
    }

    /// (e^{jωT} − M)⁻¹ r in roots of energies; `None` where the products that may be made do not tell it.
    fn closed(
        &mut self,
        returns: &mut Returns,
        round: Complex<f64>,
        right: &DVector<Complex<f64>>,
    ) -> Result<Option<DVector<Complex<f64>>>, Error> {
        let (tape, weights, from) = (self.tape, &self.weights, self.from);
        let mut product = |v: &DVector<f64>| {
            let change = v.component_div(weights);
            let image = returns.product(tape, change.as_slice());
            let image = image.ok_or_else(|| open(from))?;
            Ok(DVector::from_vec(image).component_mul(weights))
        };
        let limits = (LEFT_OF_RESPONSE, MOST_RECYCLED);
        self.recycled.solve(&mut product, (round, right), limits)
    }
}

fn open(from: f64) -> Error {
    let what = "devices on the orbit share currents or voltages in a way that no derivative tells";
    Error::at(from, Reason::NotSmooth(what.into()))
}

fn untold(omega: f64, from: f64) -> Error {
    let f = omega / TAU;
    let what = format!(
        "at {f:e} Hz {MOST_RECYCLED} products with the derivative of the orbit do not tell the response: the circuit resonates, or has as many slow modes"
    );
    Error::at(from, Reason::NotSmooth(what))
}
