//! The runs of `.step` together: one table of rows, one table of measurements, one summary.

use serde_json::{Map, Value};

use super::{json, si, table};
use crate::analysis::Measurements;
use crate::integrate::{Energy, Note, Places, Run, StatedError};
use crate::waveform::Waveforms;

/// One of the runs.
#[derive(Debug, Clone)]
pub struct Step {
    /// What is stepped and its value here.
    pub values: Vec<(String, f64)>,
    /// The run.
    pub run: Run,
    /// What was measured.
    pub found: Measurements,
}

impl Step {
    /// `r=1 c=2e-6`.
    #[must_use]
    pub fn label(&self) -> String {
        label(&self.values)
    }
}

/// `r=1 c=2e-6`.
#[must_use]
pub fn label(values: &[(String, f64)]) -> String {
    let words: Vec<String> = values
        .iter()
        .map(|(name, value)| format!("{name}={}", si::plain(*value, 9)))
        .collect();
    words.join(" ")
}

/// The rows of all runs, one run after another, with a column for every stepped quantity after the signals.
///
/// Time starts anew with every run.
#[must_use]
pub fn rows(steps: &[Step]) -> Waveforms {
    let Some(first) = steps.first() else {
        return Waveforms::default();
    };
    let mut all = Waveforms {
        title: first.run.waveforms.title.clone(),
        names: first.run.waveforms.names.clone(),
        units: first.run.waveforms.units.clone(),
        ..Waveforms::default()
    };
    for (name, _) in &first.values {
        all.names.push(name.clone());
        all.units.push("");
    }
    for Step { values, run, .. } in steps {
        for (k, &t) in run.waveforms.time.iter().enumerate() {
            all.time.push(t);
            all.values.extend_from_slice(run.waveforms.row(k));
            all.values.extend(values.iter().map(|(_, value)| value));
        }
    }
    all
}

/// A run that stands for all of them: counters and energies added up, each note once.
#[must_use]
pub fn total(steps: &[Step]) -> Run {
    let mut total = Run {
        balanced: steps.iter().all(|step| step.run.balanced),
        ..Run::default()
    };
    for Step { run, .. } in steps {
        if total.method.is_empty() {
            total.method.clone_from(&run.method);
            total.plan.clone_from(&run.plan);
        }
        total.stats.add(&run.stats);
        let (sum, own) = (&mut total.energy, &run.energy);
        *sum = Energy {
            source: sum.source + own.source,
            dissipated: sum.dissipated + own.dissipated,
            stored: sum.stored + own.stored,
            jumps: sum.jumps + own.jumps,
            numerical: sum.numerical + own.numerical,
            residual: sum.residual + own.residual,
            residual_relative: sum.residual_relative.max(own.residual_relative),
        };
        total.state_jumps.extend(&run.state_jumps);
        for note in &run.notes {
            if !total.notes.contains(note) {
                total.notes.push(note.clone());
            }
        }
    }
    // One run that does not know its error leaves that of all unknown.
    total.error = (steps.iter().map(|step| step.run.error))
        .reduce(StatedError::worse)
        .unwrap_or_default();
    total.waveforms = rows(steps);
    total.aliased = steps.iter().find_map(|step| step.run.aliased.clone());
    total.kinds = steps.iter().flat_map(|s| s.run.kinds.clone()).collect();
    total
}

/// What the tables of the runs note, each once.
#[must_use]
pub fn table_notes(steps: &[Step]) -> Vec<Note> {
    let mut notes = Vec::new();
    let tables = steps.iter().filter_map(|step| step.found.table.as_ref());
    for note in tables.flat_map(|table| &table.notes) {
        if !notes.contains(note) {
            notes.push(note.clone());
        }
    }
    notes
}

/// The results of `.meas` with a line per run, and those of `.four` and tables of elements below each other, each under the values of its run.
#[must_use]
pub fn measured(steps: &[Step]) -> String {
    let Some(first) = steps.first() else {
        return String::new();
    };
    let mut text = String::new();
    if !first.found.measured.is_empty() {
        let stepped = first.values.iter().map(|(name, _)| name.as_str());
        let names = first.found.measured.iter().map(|m| m.name.as_str());
        let header: Vec<&str> = stepped.chain(names).collect();
        let rows: Vec<Vec<String>> = steps
            .iter()
            .map(|step| {
                let values = step.values.iter().map(|(_, value)| si::plain(*value, 7));
                let found = step.found.measured.iter().map(|m| match &m.result {
                    Ok(found) => si::plain(found.value, 7),
                    Err(_) => "failed".into(),
                });
                values.chain(found).collect()
            })
            .collect();
        text.push_str(&table::aligned(&header, &rows));
    }
    for step in steps {
        for measured in &step.found.measured {
            if let Err(why) = &measured.result {
                text.push_str(&format!(
                    "{} failed at {}: {why}\n",
                    measured.name,
                    step.label()
                ));
            }
        }
    }
    for step in steps {
        let rest = Measurements {
            measured: Vec::new(),
            ..step.found.clone()
        };
        if !rest.is_empty() {
            text.push_str(&format!("{}\n{}", step.label(), rest.words()));
        }
    }
    text
}

/// The summary of all runs, with theirs as `"runs"`, each with its `"values"`.
#[must_use]
pub fn summary(steps: &[Step], places: Places<'_>) -> String {
    let mut all = json::summary_object(&total(steps), &Measurements::default(), places);
    let runs = steps.iter().map(|step| {
        let mut own = json::summary_object(&step.run, &step.found, places);
        let values = step.values.iter();
        let values: Map<String, Value> = values.map(|(n, v)| (n.clone(), (*v).into())).collect();
        own.insert("values".into(), Value::Object(values));
        Value::Object(own)
    });
    all.insert("runs".into(), runs.collect());
    json::line(&all)
}
