//! Which runs go beside one in steps to tell its error.

use crate::circuit::Tran;
use crate::integrate::companion::Beside;
use crate::integrate::control::Amplitudes;
use crate::integrate::error::Error;
use crate::integrate::grid::Grid;
use crate::integrate::problem::Problem;
use crate::integrate::run::Stepper;
use crate::integrate::simulate::controlled;
use crate::integrate::step::Scheme;
use crate::integrate::theta::Stepping;
use crate::settings::Settings;
use crate::settings::tolerances::stated::{
    FINER_AND_COARSER, FIRST_ORDER, HIGHER_ORDER, LOOSER, LOOSER_EMBEDDED, LOOSER_EMBEDDED_SHARE,
    LOOSER_SHARE,
};
use crate::settings::tolerances::steps::{FIRST, HANDOVER_STEPS};

/// Odd, as an even number of rows would see a clock in one phase alone.
const FEWER: usize = 5;

/// Beside an exact run, from where steps take over; `make` makes one with so many steps between rows.
pub(super) fn beside_handover<'a>(
    make: &'a dyn Fn(f64) -> Result<Box<dyn Stepper>, Error>,
) -> Vec<Beside<'a>> {
    let companion = |(ratio, share): (f64, f64)| Beside {
        make: Box::new(move || make(HANDOVER_STEPS / ratio)),
        stride: 1,
        start: 0.0,
        share,
    };
    FINER_AND_COARSER
        .into_iter()
        .zip(FIRST_ORDER)
        .map(companion)
        .collect()
}

impl Problem {
    /// Beside a run in steps of h, s; `large`: sparse ones.
    pub(super) fn beside_fixed<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        (h, large): (f64, bool),
        settings: &'a Settings,
    ) -> Vec<Beside<'a>> {
        // Rows are stops.
        let h = h.min(tran.tmax.unwrap_or(f64::INFINITY));
        let h = tran.tstep / (tran.tstep / h).ceil().max(1.0);
        let tran = Tran {
            tmax: None,
            ..*tran
        };
        let shares = match scheme.order() {
            1 => FIRST_ORDER,
            _ => HIGHER_ORDER,
        };
        let companion = |(ratio, share): (f64, f64)| {
            // An even number of rows would see a clock in one phase alone.
            let stride = (ratio * h / tran.tstep).ceil() as usize | 1;
            let length = match stride {
                1 => ratio * h,
                _ => stride as f64 * tran.tstep,
            };
            Beside {
                make: Box::new(move || {
                    let (start, stepping) = (self.start.clone(), Stepping::Fixed(length));
                    if large {
                        let sparse = self.sparse(&tran, scheme, stepping, settings)?;
                        return Ok(Box::new(sparse) as Box<dyn Stepper>);
                    }
                    let mut theta = self.stepper(start, &tran, scheme, stepping, settings)?;
                    if ratio > 1.0 {
                        theta.keep_whole_steps();
                    }
                    theta.read_coarsely();
                    Ok(Box::new(theta))
                }),
                stride,
                start: h,
                share: share * (ratio * h / length),
            }
        };
        FINER_AND_COARSER
            .into_iter()
            .zip(shares)
            .map(companion)
            .collect()
    }

    /// Beside a run whose steps are chosen, by an embedded error or by halves.
    pub(super) fn beside_controlled<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        amplitudes: Option<&'a Amplitudes>,
        settings: &Settings,
        embedded: bool,
    ) -> Vec<Beside<'a>> {
        let tran = *tran;
        let (looser, share) = if embedded {
            (LOOSER_EMBEDDED, LOOSER_EMBEDDED_SHARE)
        } else {
            (LOOSER, LOOSER_SHARE)
        };
        let settings = Settings {
            tol: looser * settings.tol,
            ..settings.clone()
        };
        vec![Beside {
            make: Box::new(move || {
                let start = self.start.clone();
                let mut theta = self.stepper(start, &tran, scheme, controlled(&tran), &settings)?;
                if let Some(amplitudes) = amplitudes {
                    theta.expect_amplitudes(amplitudes.clone());
                }
                theta.keep_whole_steps();
                theta.read_coarsely();
                theta.read_between_steps(tran.tstop);
                Ok(Box::new(theta))
            }),
            stride: 1,
            start: FIRST * tran.tstep,
            share,
        }]
    }

    /// Beside a run in sparse steps whose lengths are chosen. It stops at some rows only: rows are stops, and would make its steps those of the run.
    pub(super) fn beside_large<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        settings: &Settings,
    ) -> Vec<Beside<'a>> {
        let tran = *tran;
        let settings = Settings {
            tol: LOOSER_EMBEDDED * settings.tol,
            ..settings.clone()
        };
        let stride = if Grid::of(&tran).count() > FEWER as f64 {
            FEWER
        } else {
            1
        };
        vec![Beside {
            make: Box::new(move || {
                let stepper = self.sparse(&tran, scheme, controlled(&tran), &settings)?;
                Ok(Box::new(stepper))
            }),
            stride,
            start: FIRST * tran.tstep,
            share: LOOSER_EMBEDDED_SHARE,
        }]
    }
}
