//! Summaries as JSON.

use serde::Serialize;
use serde_json::Value;

use super::text;
use crate::analysis::{Measurements, Table, Worst};
use crate::integrate::{Energy, Impulse, Orbit, Places, Run, StateJump, StatedError, Verified};

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
    energy: Balance,
    error: StatedError,
    notes: Vec<String>,
    impulses: &'a [Impulse],
    state_jumps: &'a [StateJump],
    state_jumps_total: Total,
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    verified: Option<&'a Verified>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pss: Option<&'a Orbit>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    measurements: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fourier: Vec<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<&'a Table>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    worst: &'a [Worst],
}

/// Of all jumps, those that are not listed included.
#[derive(Serialize)]
struct Total {
    count: u64,
    loss: f64,
}

/// What a run did, as one JSON object on one line: method, plan, counters, energy balance, stated error, notes, impulses, jumps of the
/// state, what was measured, and the orbit that it is a period of.
#[must_use]
pub fn summary(run: &Run, found: &Measurements, places: Places<'_>) -> String {
    line(&Summary::of(run, found, places))
}

/// The same as an object to add to.
#[must_use]
pub(super) fn summary_object(
    run: &Run,
    found: &Measurements,
    places: Places<'_>,
) -> serde_json::Map<String, Value> {
    match serde_json::to_value(Summary::of(run, found, places)) {
        Ok(Value::Object(object)) => object,
        _ => serde_json::Map::new(),
    }
}

impl<'a> Summary<'a> {
    fn of(run: &'a Run, found: &'a Measurements, places: Places<'_>) -> Self {
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
            energy: Balance::of(run),
            error: run.error,
            notes: std::iter::once(&run.notes)
                .chain(found.table.iter().map(|table| &table.notes))
                .chain(found.worst.iter().map(|worst| &worst.notes))
                .flat_map(|notes| places.all(notes))
                .collect(),
            impulses: &run.impulses,
            state_jumps: &run.state_jumps.first,
            state_jumps_total: Total {
                count: run.state_jumps.all.0,
                loss: run.state_jumps.all.1,
            },
            warnings: places.all(&text::warnings(run)),
            verified: run.verified.as_ref(),
            pss: run.orbit.as_ref(),
            measurements,
            fourier,
            table: found.table.as_ref(),
            worst: &found.worst,
        }
    }
}

/// The energy balance.
#[derive(Serialize)]
#[serde(untagged)]
enum Balance {
    Known(Energy),
    /// Null by each key.
    Unknown(Value),
}

impl Balance {
    fn of(run: &Run) -> Self {
        if run.balanced {
            return Self::Known(run.energy);
        }
        let mut energy = serde_json::to_value(run.energy).unwrap_or_default();
        if let Value::Object(keys) = &mut energy {
            keys.values_mut().for_each(|value| *value = Value::Null);
        }
        Self::Unknown(energy)
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
    use crate::integrate::{JumpReason, StateJumps, Stats};

    #[test]
    fn the_summary_has_the_promised_keys() {
        let mut state_jumps = StateJumps::default();
        state_jumps.add(StateJump {
            t: 1e-3,
            elements: vec!["l1".into()],
            loss: 0.25,
            reason: JumpReason::Switch("s1".into()),
            destroys: true,
            change: 0.0,
        });
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
                stored: 0.25,
                jumps: 0.25,
                ..Energy::default()
            },
            balanced: true,
            error: StatedError {
                max: Some(1e-4),
                rms: None,
                event_time: None,
            },
            impulses: vec![Impulse {
                t: 0.001,
                name: "i(d1)".into(),
                area: -2e-6,
            }],
            state_jumps,
            ..Run::default()
        };
        assert_eq!(
            summary(&run, &Measurements::default(), Places::default()),
            "{\"method\":\"exact\",\"plan\":[\"piecewise linear\"],\"steps\":7,\"rejected\":0,\"events\":2,\"jumps\":0,\
             \"modes\":0,\"lcp_solves\":0,\"pivotings\":0,\"factorisations\":0,\"cpu_seconds\":0.0,\
             \"energy\":{\"source\":1.5,\"dissipated\":1.0,\"stored\":0.25,\"jumps\":0.25,\"numerical\":0.0,\"residual\":0.0,\
             \"residual_relative\":0.0},\"error\":{\"max\":0.0001,\"rms\":null,\"event_time\":null},\"notes\":[],\
             \"impulses\":[{\"t\":0.001,\"name\":\"i(d1)\",\"area\":-2e-6}],\
             \"state_jumps\":[{\"t\":0.001,\"elements\":[\"l1\"],\"loss\":0.25,\"reason\":\"switch s1\"}],\
             \"state_jumps_total\":{\"count\":1,\"loss\":0.25},\
             \"warnings\":[\"l1 jumps at 1 ms (switch s1): a current or charge is destroyed, and 250 mJ with it\"]}"
        );
    }
}
