//! The stepper of a simulation.

use super::SimulationOptions;
use crate::circuit::Tran;
use crate::integrate::Note;
use crate::integrate::control::Amplitudes;
use crate::integrate::energy::Balance;
use crate::integrate::error::{Error, Reason};
use crate::integrate::exact::Place;
use crate::integrate::handover::Handover;
use crate::integrate::log::Log;
use crate::integrate::problem::Problem;
use crate::integrate::run::Stepper;
use crate::integrate::simulate::{Method, controlled};
use crate::integrate::step::Scheme;
use crate::integrate::theta::{Stepping, Theta};
use crate::lcs::Lcs;
use crate::plan::{not_exact, plan};
use crate::settings::tolerances::steps::HANDOVER_STEPS;

/// What a simulation comes around to again and again: steps whose lengths are chosen keep the tolerance over it.
#[derive(Debug, Clone)]
pub(super) struct Lap {
    /// s.
    pub(super) span: f64,
    /// Steps on the way to a time at most.
    pub(super) most: u64,
    /// Those seen so far.
    pub(super) amplitudes: Option<Amplitudes>,
}

/// The stepper of a simulation.
pub(super) enum Way {
    Exact(Box<Handover>),
    Steps(Box<Theta>),
}

impl Way {
    /// The stepper that the plan chooses, at the start of the problem.
    pub(super) fn of(
        problem: &Problem,
        lcs: &Lcs,
        tran: &Tran,
        (options, lap): (&SimulationOptions, Option<&Lap>),
        notes: &mut Vec<Note>,
        log: &mut Log<'_>,
    ) -> Result<Self, Error> {
        let SimulationOptions {
            method, settings, ..
        } = options;
        if let (Method::Exact, Some(obstacle)) = (method, not_exact(lcs)) {
            let what = format!("no exact integration: {obstacle}");
            return Err(Error::before(Reason::Unsupported(what)));
        }
        let plan = plan(lcs, &options.as_asked());
        let start = problem.start.t;
        if plan.method == Method::Exact {
            let exact = problem.handover(tran, lcs, settings, HANDOVER_STEPS);
            match exact.and_then(|mut exact| exact.advance(start, log).map(|()| exact)) {
                Ok(exact) => return Ok(Self::Exact(Box::new(exact))),
                Err(error) if *method == Method::Exact => return Err(error),
                Err(error) => {
                    let text = format!("steps are made in place of exact integration: {error}");
                    notes.push(Note::run("steps-instead", text));
                }
            }
            *log = Log::default();
        }
        let mut theta = steps(problem, tran, plan.scheme, (options, lap))?;
        theta.advance(start, log)?;
        Ok(Self::Steps(Box::new(theta)))
    }

    pub(super) fn stepper(&mut self) -> &mut dyn Stepper {
        match self {
            Self::Exact(exact) => &mut **exact,
            Self::Steps(theta) => &mut **theta,
        }
    }

    pub(super) fn place(&mut self) -> Place {
        match self {
            Self::Exact(exact) => exact.place(),
            Self::Steps(theta) => theta.place(),
        }
    }

    pub(super) fn balance(&mut self) -> Balance {
        match self {
            Self::Exact(exact) => exact.balance(),
            Self::Steps(theta) => theta.balance(),
        }
    }

    /// The amplitudes that steps have seen so far.
    pub(super) fn amplitudes(&self) -> Option<Amplitudes> {
        match self {
            Self::Exact(_) => None,
            Self::Steps(theta) => Some(theta.amplitudes_of_ports()),
        }
    }

    /// Which ideal pairs conduct; empty where not known.
    pub(super) fn conducting(&self) -> Vec<bool> {
        match self {
            Self::Exact(exact) => exact.conducting().to_vec(),
            Self::Steps(_) => vec![],
        }
    }

    /// Steps of exact integration so far.
    pub(super) fn exact_steps(&self) -> u64 {
        match self {
            Self::Exact(exact) => exact.exact_steps(),
            Self::Steps(_) => 0,
        }
    }

    /// Goes on with the energy balance of another stepper that came to where this one starts, its first jump included.
    pub(super) fn carry_on(&mut self, mut balance: Balance) {
        balance.add_part(&self.balance().energy());
        self.start_balance(balance);
    }

    /// Has another balance from here on.
    pub(super) fn start_balance(&mut self, balance: Balance) {
        match self {
            Self::Exact(exact) => exact.set_balance(balance),
            Self::Steps(theta) => theta.set_balance(balance),
        }
    }
}

/// Steps from the start of a problem.
fn steps(
    problem: &Problem,
    tran: &Tran,
    scheme: Scheme,
    (options, lap): (&SimulationOptions, Option<&Lap>),
) -> Result<Theta, Error> {
    let settings = &options.settings;
    if let Some(Lap {
        span, amplitudes, ..
    }) = lap
    {
        let tran = Tran {
            tstop: *span,
            ..*tran
        };
        let start = problem.start.clone();
        let mut theta = problem.stepper(start, &tran, scheme, controlled(&tran), settings)?;
        if let Some(amplitudes) = amplitudes {
            theta.expect_amplitudes(amplitudes.clone());
        }
        return Ok(theta);
    }
    let stepping = options.step.map_or(controlled(tran), Stepping::Fixed);
    let mut theta = problem.stepper(problem.start.clone(), tran, scheme, stepping, settings)?;
    theta.move_by_hand();
    if options.step.is_none()
        && let Some(amplitudes) = problem.scout(tran, settings)
    {
        theta.expect_amplitudes(amplitudes);
    }
    Ok(theta)
}
