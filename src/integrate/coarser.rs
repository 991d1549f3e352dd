//! Which coarser runs go beside one in steps.

use crate::circuit::Tran;
use crate::integrate::companion::{Coarser, Share};
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
    COARSER, FIRST_ORDER, HIGHER_ORDER, HIGHER_ORDER_EVENTS, LOOSER, LOOSER_EMBEDDED,
    LOOSER_EMBEDDED_SHARE, LOOSER_SHARE, MANY_ROWS,
};
use crate::settings::tolerances::steps::{FIRST, HANDOVER_STEPS};

/// Odd, as an even number of rows would see a clock in one phase alone.
const FEWER: usize = 5;

/// Beside an exact run, from where steps take over; `make` makes one with so many steps between rows.
pub(super) fn coarser_handover<'a>(
    make: &'a dyn Fn(f64) -> Result<Box<dyn Stepper>, Error>,
) -> Vec<Coarser<'a>> {
    let companion = |(coarser, share): (f64, f64)| Coarser {
        make: Box::new(move || make(HANDOVER_STEPS / coarser)),
        stride: 1,
        start: 0.0,
        share: Share::always(share),
        steps: Some((coarser, 1)),
    };
    COARSER
        .into_iter()
        .zip(FIRST_ORDER)
        .map(companion)
        .collect()
}

impl Problem {
    /// Beside a run in steps of h, s; `large`: sparse ones.
    pub(super) fn coarser_fixed<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        (h, large): (f64, bool),
        settings: &'a Settings,
    ) -> Vec<Coarser<'a>> {
        // Rows are stops.
        let h = h.min(tran.tmax.unwrap_or(f64::INFINITY));
        let h = tran.tstep / (tran.tstep / h).ceil().max(1.0);
        let tran = Tran {
            tmax: None,
            ..*tran
        };
        let (smooth, events) = match scheme.order() {
            1 => (FIRST_ORDER, FIRST_ORDER),
            _ => (HIGHER_ORDER, HIGHER_ORDER_EVENTS),
        };
        let companion = |(coarser, (smooth, events)): (f64, (f64, f64))| {
            // An even number of rows would see a clock in one phase alone.
            let stride = (coarser * h / tran.tstep).ceil() as usize | 1;
            let longer = match stride {
                1 => coarser * h,
                _ => stride as f64 * tran.tstep,
            };
            Coarser {
                make: Box::new(move || {
                    let (start, stepping) = (self.start.clone(), Stepping::Fixed(longer));
                    if large {
                        let sparse = self.sparse(&tran, scheme, stepping, settings)?;
                        return Ok(Box::new(sparse) as Box<dyn Stepper>);
                    }
                    let mut theta = self.stepper(start, &tran, scheme, stepping, settings)?;
                    theta.keep_whole_steps();
                    theta.read_coarsely();
                    Ok(Box::new(theta))
                }),
                stride,
                start: h,
                share: Share { smooth, events }.times(coarser * h / longer),
                steps: Some((longer / h, scheme.order().min(2))),
            }
        };
        let shares = smooth.into_iter().zip(events);
        COARSER.into_iter().zip(shares).map(companion).collect()
    }

    /// Beside a run whose steps are chosen, by an embedded error or by halves.
    pub(super) fn coarser_controlled<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        amplitudes: Option<&'a Amplitudes>,
        settings: &Settings,
        embedded: bool,
    ) -> Vec<Coarser<'a>> {
        let tran = *tran;
        // Those that tell their error read rows between their steps.
        let many = !embedded && Grid::of(&tran).count() > MANY_ROWS;
        let (looser, share) = if embedded {
            (LOOSER_EMBEDDED, LOOSER_EMBEDDED_SHARE)
        } else {
            (LOOSER, LOOSER_SHARE)
        };
        let settings = Settings {
            tol: looser * settings.tol,
            ..settings.clone()
        };
        vec![Coarser {
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
            stride: if many { FEWER } else { 1 },
            start: FIRST * tran.tstep,
            share: Share::always(share),
            steps: None,
        }]
    }

    /// Beside a run in sparse steps whose lengths are chosen. It stops at some rows only: rows are stops, and would make its steps those of the run.
    pub(super) fn coarser_large<'a>(
        &'a self,
        tran: &Tran,
        scheme: Scheme,
        settings: &Settings,
    ) -> Vec<Coarser<'a>> {
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
        vec![Coarser {
            make: Box::new(move || {
                let stepper = self.sparse(&tran, scheme, controlled(&tran), &settings)?;
                Ok(Box::new(stepper))
            }),
            stride,
            start: FIRST * tran.tstep,
            share: Share::always(LOOSER_EMBEDDED_SHARE),
            steps: None,
        }]
    }
}
