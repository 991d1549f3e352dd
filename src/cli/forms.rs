//! `circ sim` on nonlinear forms, which are no circuits.

use super::args::{Input, Method, SimArgs};
use super::exit::Failure;
use super::input;
use crate::forms::json::nonlinear::{self, NonlinearFile};
use crate::integrate::{Note, Run};
use crate::settings::Settings;
use crate::waveform::Waveforms;

/// Reads a nonlinear form; `None` for every other file, unreadable ones included.
///
/// # Errors
/// [`Failure::Told`] when it is one with a fault.
pub(super) fn open(input: &Input) -> Result<Option<NonlinearFile>, Failure> {
    let Ok(bytes) = input::bytes(input) else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(bytes);
    if !text.trim_start().starts_with('{') {
        return Ok(None);
    }
    nonlinear::read(&text)
        .map_err(|e| Failure::told("broken-system", format!("{}: {e}", input.file.display())))
}

/// Runs it by Moreau's scheme, the only one that these forms have.
///
/// # Errors
/// [`Failure::Told`] for another method, an unknown probe, or a step without solution.
pub(super) fn run(form: &NonlinearFile, args: &SimArgs) -> Result<Run, Failure> {
    let file = args.input.file.display();
    let fail = |code, reason: String| Failure::told(code, format!("{file}: {reason}"));
    if !matches!(args.method.method, Method::Auto | Method::Euler) {
        return Err(fail(
            "option-conflict",
            "nonlinear forms are stepped by `--method euler`".into(),
        ));
    }
    let (_, m) = form.size();
    let pairs = |what: &str| (1..=m).map(|j| format!("{what}(d{j})")).collect::<Vec<_>>();
    let names = [form.states.clone(), pairs("lambda"), pairs("y")].concat();
    let units = [form.units.clone(), vec!["A"; m], vec!["V"; m]].concat();
    let columns: Vec<usize> = if args.results.probes.is_empty() {
        (0..names.len()).collect()
    } else {
        let find = |probe: &String| {
            let unknown = || {
                let known = format!("--probe {probe}: the form has {}", names.join(" "));
                fail("unknown-signal", known)
            };
            let wanted = probe.to_lowercase();
            names.iter().position(|n| *n == wanted).ok_or_else(unknown)
        };
        args.results
            .probes
            .iter()
            .map(find)
            .collect::<Result<_, _>>()?
    };
    let tol = args.method.tol.unwrap_or(Settings::default().tol);
    let found = form
        .run(args.method.step, tol)
        .map_err(|e| fail("form", e.to_string()))?;
    let mut values = Vec::with_capacity(columns.len() * found.trajectory.t.len());
    for k in 0..found.trajectory.t.len() {
        let [x, lambda, y] = [
            &found.trajectory.x[k],
            &found.trajectory.lambda[k],
            &found.trajectory.y[k],
        ];
        let row: Vec<f64> = x.iter().chain(lambda).chain(y).copied().collect();
        values.extend(columns.iter().map(|&j| row[j]));
    }
    let mut run = Run {
        waveforms: Waveforms {
            title: form.title.clone(),
            units: columns.iter().map(|&j| units[j]).collect(),
            names: columns.iter().map(|&j| names[j].clone()).collect(),
            time: found.trajectory.t,
            values,
        },
        method: "euler".into(),
        plan: vec![format!(
            "a nonlinear form: Moreau's scheme, {} steps per row",
            found.steps_per_row
        )],
        ..Run::default()
    };
    run.stats.steps = found.steps as u64;
    run.notes = vec![Note::run(
        "not-balanced",
        "a form has no sources and no losses to balance: the energies are not computed",
    )];
    if let Some(error) = found.error {
        let text =
            format!("the last halving of the step changed the states by {error:.1e} of their size");
        run.notes.push(Note::run("form", text));
    }
    Ok(run)
}
