//! A problem whose start is known, whole or in parts: what plans and runs are made from.

use crate::circuit::Tran;
use crate::diagnostic::Internal;
use crate::integrate::error::{Error, Reason};
use crate::integrate::parts::Cut;
use crate::integrate::problem::{Problem, too_many_edges};
use crate::integrate::run::Stepper;
use crate::integrate::step::Scheme;
use crate::integrate::{Method, SimOptions};
use crate::lcs::{Input, Lcs};
use crate::plan::{Plan, not_exact, plan, plan_of_large, plan_of_parts, scheme};
use crate::settings::Settings;

/// See the [module](self).
pub(super) enum Ready {
    /// By the system of its start position.
    Whole(Box<Lcs>),
    /// In parts, each of which has an exact integration.
    Parts(Cut),
    /// By steps on matrices without their zeros; these are its sources.
    Large(Vec<Input>),
}

/// Decides whether a problem is solved whole or in parts.
///
/// # Errors
/// The reduction's for the start position.
pub(super) fn ready(
    problem: &mut Problem,
    tran: &Tran,
    options: &SimOptions<'_>,
) -> Result<Ready, Error> {
    if matches!(options.method, Method::Auto | Method::Exact) {
        let parts = problem.parts(tran, &options.settings);
        if !parts.is_empty() {
            let at_events = options.events || options.corners || !tran.prints;
            let multiport = &problem.systems.multiport;
            let probes = multiport.observed[..multiport.probes].iter();
            let is_volts = probes.map(|probe| probe.unit == "V").collect();
            let cut = Cut::new(parts, is_volts, *tran, at_events, &options.settings);
            return Ok(Ready::Parts(cut));
        }
    }
    if options.method != Method::Exact
        && let Some(inputs) = sources_of_large(problem, scheme(options), &options.settings)?
    {
        return Ok(Ready::Large(inputs));
    }
    let lcs = problem.prepare(tran, &options.settings)?;
    Ok(Ready::Whole(Box::new(lcs)))
}

/// The sources of a problem that is solved in sparse steps, whose start is then known; nothing of another.
///
/// # Errors
/// The reduction's for the start position.
pub(super) fn sources_of_large(
    problem: &mut Problem,
    scheme: Scheme,
    settings: &Settings,
) -> Result<Option<Vec<Input>>, Error> {
    if !problem.is_large(scheme, settings) {
        return Ok(None);
    }
    problem.prepare_large(settings)
}

impl Ready {
    /// Whether it is in parts.
    pub(super) const fn is_apart(&self) -> bool {
        matches!(self, Self::Parts(_))
    }

    /// Whether it is integrated in sparse steps.
    pub(super) const fn is_large(&self) -> bool {
        matches!(self, Self::Large(_))
    }

    /// See [`plan`].
    pub(super) fn plan(&self, problem: &Problem, options: &SimOptions<'_>) -> Plan {
        match self {
            Self::Whole(lcs) => plan(lcs, options),
            Self::Parts(cut) => plan_of_parts(cut.systems(), options),
            Self::Large(_) => plan_of_large(problem.size(), options),
        }
    }

    /// See [`not_exact`].
    pub(super) fn not_exact(&self) -> Option<String> {
        match self {
            Self::Whole(lcs) => not_exact(lcs),
            Self::Parts(_) | Self::Large(_) => None,
        }
    }

    /// See [`too_many_edges`].
    pub(super) fn too_many_edges(&self, tran: &Tran, settings: &Settings) -> Option<Error> {
        match self {
            Self::Whole(lcs) => too_many_edges(&lcs.inputs, tran, settings),
            Self::Large(inputs) => too_many_edges(inputs, tran, settings),
            Self::Parts(cut) => {
                let mut systems = cut.systems();
                systems.find_map(|lcs| too_many_edges(&lcs.inputs, tran, settings))
            }
        }
    }

    /// Exact integration alone.
    ///
    /// # Errors
    /// See [`Exact::new`](crate::integrate::exact::Exact::new).
    pub(super) fn exact(
        &self,
        problem: &Problem,
        tran: &Tran,
        settings: &Settings,
    ) -> Result<Box<dyn Stepper>, Error> {
        Ok(match self {
            Self::Whole(lcs) => Box::new(problem.exact(tran, lcs, settings)?),
            Self::Parts(cut) => Box::new(cut.exact()?),
            Self::Large(_) => return Err(no_exact_integration()),
        })
    }

    /// Exact integration with Moreau's steps, so many between rows, where it cannot go on.
    ///
    /// # Errors
    /// As [`Self::exact`].
    pub(super) fn handover(
        &self,
        problem: &Problem,
        tran: &Tran,
        settings: &Settings,
        steps: f64,
    ) -> Result<Box<dyn Stepper>, Error> {
        Ok(match self {
            Self::Whole(lcs) => Box::new(problem.handover(tran, lcs, settings, steps)?),
            Self::Parts(cut) => Box::new(cut.handover(steps)?),
            Self::Large(_) => return Err(no_exact_integration()),
        })
    }
}

/// Large circuits are planned in steps.
fn no_exact_integration() -> Error {
    let what = "exact integration of a circuit that is planned in sparse steps";
    Error::before(Reason::Internal(Internal::new("integrate::ready", what)))
}
