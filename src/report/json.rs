//! Summaries as JSON.

use serde::Serialize;
use serde_json::Value;

use super::measured::Measurements;
use crate::integrate::{Energy, Impulse, Run};

#[derive(Serialize)]
struct Summary<'a> {
    method: &'a str,
    plan: &'a [String],
    steps: u64,
    rejected: u64,
    events: u64,
    jumps: u64,
    modes: u64,
    lcp_solves: u64,
    pivotings: u64,
    factorisations: u64,
    cpu_seconds: f64,
    energy: Energy,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_estimate: Option<f64>,
    notes: &'a [String],
    impulses: &'a [Impulse],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    measurements: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fourier: Vec<Value>,
}

/// What a run did, as one JSON object on one line: method, plan, counters, energy balance, notes, impulses, and what was
/// measured.
#[must_use]
pub fn summary(run: &Run, found: &Measurements) -> String {
    line(&Summary::of(run, found))
}

/// The same as an object to add to.
#[must_use]
pub(super) fn summary_object(run: &Run, found: &Measurements) -> serde_json::Map<String, Value> {
    match serde_json::to_value(Summary::of(run, found)) {
        Ok(Value::Object(object)) => object,
        _ => serde_json::Map::new(),
    }
}

impl<'a> Summary<'a> {
    fn of(run: &'a Run, found: &Measurements) -> Self {
        let stats = &run.stats;
        let (measurements, fourier) = found.json();
        Self {
            method: &run.method,
            plan: &run.plan,
            steps: stats.steps,
            rejected: stats.rejected,
            events: stats.events,
            jumps: stats.jumps,
            modes: stats.modes,
            lcp_solves: stats.lcp_solves,
            pivotings: stats.pivotings,
            factorisations: stats.factorisations,
            cpu_seconds: stats.cpu_seconds,
            energy: run.energy,
            error_estimate: run.error_estimate,
            notes: &run.notes,
            impulses: &run.impulses,
            measurements,
            fourier,
        }
    }
}

/// Any report as JSON on one line; plain data always serialises.
#[must_use]
pub fn line(report: &impl Serialize) -> String {
    serde_json::to_string(report).unwrap_or_else(|e| format!("{{\"error\":\"{e}\"}}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Stats;

    #[test]
    fn the_summary_has_the_promised_keys() {
        let run = Run {
            method: "exact".into(),
            plan: vec!["piecewise linear".into()],
            stats: Stats {
                steps: 7,
                events: 2,
                ..Stats::default()
            },
            energy: Energy {
                source: 1.5,
                dissipated: 1.0,
                stored: 0.5,
                residual_relative: 0.0,
            },
            impulses: vec![Impulse {
                t: 0.001,
                name: "i(d1)".into(),
                area: -2e-6,
            }],
            ..Run::default()
        };
        assert_eq!(
            summary(&run, &Measurements::default()),
            "{\"method\":\"exact\",\"plan\":[\"piecewise linear\"],\"steps\":7,\"rejected\":0,\"events\":2,\"jumps\":0,\
             \"modes\":0,\"lcp_solves\":0,\"pivotings\":0,\"factorisations\":0,\"cpu_seconds\":0.0,\
             \"energy\":{\"source\":1.5,\"dissipated\":1.0,\"stored\":0.5,\"residual_relative\":0.0},\"notes\":[],\
             \"impulses\":[{\"t\":0.001,\"name\":\"i(d1)\",\"area\":-2e-6}]}"
        );
    }
}
