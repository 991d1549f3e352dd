//! What a circuit needs and what is left out, in words, before anything runs.

use crate::integrate::step::Scheme;
use crate::integrate::{Method, SimOptions};
use crate::lcs::{Input, Lcs};
use crate::solve::lcp::Scaling;
use crate::solve::norm;

/// The machinery chosen for a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The method, never [`Method::Auto`].
    pub method: Method,
    /// θ and γ of the stepper (what the exact integrator falls back to).
    pub scheme: Scheme,
    /// The decisions, one sentence each; `circ sim -v` prints them.
    pub words: Vec<String>,
}

/// Decides for the system of the start position.
#[must_use]
pub fn plan(lcs: &Lcs, options: &SimOptions) -> Plan {
    let mut words = Vec::new();
    let (n, m, p) = (lcs.n(), lcs.m(), lcs.p());
    // What follows from the matrices holds until a switch moves.
    let (here, there) = if lcs.switches.is_empty() {
        ("", "")
    } else {
        (
            "in the start position of the switches: ",
            " until one moves",
        )
    };
    words.push(format!(
        "{here}{n} states, {m} complementarity pairs, {p} sources"
    ));
    let obstacle = not_exact(lcs);
    let method = match (options.method, &obstacle) {
        (Method::Auto, None) => {
            words.push(
                "all laws are piecewise linear and all sources exact: exact integration".into(),
            );
            Method::Exact
        }
        (Method::Auto, Some(what)) => {
            words.push(format!("{what}: time-stepping"));
            Method::Theta
        }
        (method, _) => method,
    };
    let scheme = scheme(options);
    if matches!(method, Method::Euler | Method::Theta) {
        let curved = lcs.ports.iter().any(|p| !p.law.is_piecewise_linear());
        let rule = match options.step {
            Some(_) if curved && scheme != Scheme::MOREAU => {
                "three implicit stages of order 3".to_string()
            }
            None if curved && scheme != Scheme::MOREAU => FIVE_STAGES.to_string(),
            _ => format!("θ = {}, γ = {}", scheme.theta, scheme.gamma),
        };
        words.push(steps_of(&rule, options));
    }
    if m == 0 {
        words.push(format!(
            "{here}no devices: linear propagation, no complementarity problem is built{there}"
        ));
    } else if is_positive_definite(lcs) {
        words.push(format!(
            "{here}D + Dᵀ is positive definite: no jump logic{there}"
        ));
    }
    if lcs.switches.is_empty() {
        words.push("no switches: one system for the whole run".into());
    }
    Plan {
        method,
        scheme,
        words,
    }
}

const FIVE_STAGES: &str = "five implicit stages of order 4";

/// θ and γ that are asked for.
pub(crate) fn scheme(options: &SimOptions) -> Scheme {
    match options.method {
        Method::Euler => Scheme::MOREAU,
        _ => Scheme {
            theta: options.theta.unwrap_or(Scheme::MIDPOINT.theta),
            gamma: options.gamma.unwrap_or(Scheme::MIDPOINT.gamma),
        },
    }
}

fn steps_of(rule: &str, options: &SimOptions) -> String {
    match options.step {
        Some(h) => format!("{rule}, fixed step {h:e} s"),
        None => format!(
            "{rule}, steps chosen for a tolerance of {:e}",
            options.settings.tol
        ),
    }
}

/// Decides for a circuit of so many storage elements and ideal pairs that its matrices are kept without their zeros.
pub(crate) fn plan_of_large((storage, pairs): (usize, usize), options: &SimOptions) -> Plan {
    let scheme = scheme(options);
    let rule = match options.step {
        None if scheme == Scheme::MIDPOINT => FIVE_STAGES.to_string(),
        _ => format!("θ = γ = {}", scheme.theta),
    };
    let method = match options.method {
        Method::Euler => Method::Euler,
        _ => Method::Theta,
    };
    let words = vec![
        format!(
            "{storage} capacitors and inductors, {pairs} complementarity pairs: steps on matrices without their zeros; dense matrices of exact integration would cost \
             the third power of that (--method exact)"
        ),
        steps_of(&rule, options),
    ];
    Plan {
        method,
        scheme,
        words,
    }
}

/// Decides for parts that share nothing but ground and sources, by the systems of their start positions, each of which can be integrated
/// exactly.
pub(crate) fn plan_of_parts<'a>(
    systems: impl Iterator<Item = &'a Lcs>,
    options: &SimOptions,
) -> Plan {
    let (mut count, mut largest): (usize, Option<&Lcs>) = (0, None);
    for lcs in systems {
        count += 1;
        if largest.is_none_or(|known| lcs.n() + lcs.m() > known.n() + known.m()) {
            largest = Some(lcs);
        }
    }
    let mut words = vec![format!(
        "{count} parts that share nothing but ground and sources: each has modes, events and steps of its own; parts that are alike share \
         their modes. The largest:"
    )];
    let of_one = largest.map(|lcs| plan(lcs, options));
    let scheme = of_one.as_ref().map_or(Scheme::MIDPOINT, |plan| plan.scheme);
    words.extend(of_one.into_iter().flat_map(|plan| plan.words));
    Plan {
        method: Method::Exact,
        scheme,
        words,
    }
}

/// What keeps a system from exact integration: the element and why.
#[must_use]
pub fn not_exact(lcs: &Lcs) -> Option<String> {
    if let Some(port) = lcs.ports.iter().find(|p| !p.law.is_piecewise_linear()) {
        return Some(format!(
            "the law of {} does not consist of straight pieces",
            port.device
        ));
    }
    // A source may lack a finite exosystem.
    let endless = |input: &&Input| input.source.piece(0.0).is_none();
    let source = lcs.inputs.iter().find(endless)?;
    if source.source.wave.is_arriving() {
        return Some(format!(
            "{} is a delayed wave on a transmission line, which no finite linear system makes",
            source.name
        ));
    }
    Some(format!(
        "the waveform of {} solves no linear equation of finite order",
        source.name
    ))
}

/// Whether no impulse can flow through the devices because each resists it.
fn is_positive_definite(lcs: &Lcs) -> bool {
    let symmetric = Scaling::of(&lcs.d).symmetric(&lcs.d);
    symmetric.clone().cholesky().is_some() && norm::kernel(&symmetric).ncols() == 0
}
