//! Runs of the project's netlists, for tests.
#![allow(dead_code, reason = "each test crate uses its part")]

use std::path::{Path, PathBuf};

use circ::circuit::ElaborateOptions;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::load;

/// The repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Names of all netlists in `netlists/`, sorted.
pub(crate) fn all() -> Vec<String> {
    let entries = std::fs::read_dir(root().join("netlists")).expect("the folder netlists");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let is_netlist = |path: &PathBuf| path.extension().is_some_and(|e| e == "cir");
    let mut names: Vec<String> = paths
        .filter(is_netlist)
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// The text of a netlist.
pub(crate) fn text(name: &str) -> String {
    std::fs::read_to_string(root().join(format!("netlists/{name}.cir"))).expect("a netlist")
}

/// Simulates `netlists/NAME.cir`.
pub(crate) fn run(name: &str, options: SimOptions<'_>) -> Run {
    let path = root().join(format!("netlists/{name}.cir"));
    let loaded = load(&path, &ElaborateOptions::default());
    let circuit = loaded
        .circuit
        .unwrap_or_else(|| panic!("{name}: {:?}", loaded.diagnostics));
    let behaviour = behaviour(&circuit).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// With events as rows, exactly.
pub(crate) fn exact(name: &str) -> Run {
    run(
        name,
        SimOptions {
            method: Method::Exact,
            events: true,
            ..SimOptions::default()
        },
    )
}

/// (θ, γ) with a fixed step.
pub(crate) fn fixed(name: &str, theta: f64, gamma: f64, step: f64) -> Run {
    let options = SimOptions {
        method: Method::Theta,
        theta: Some(theta),
        gamma: Some(gamma),
        step: Some(step),
        ..SimOptions::default()
    };
    run(name, options)
}

/// The column of a probe.
pub(crate) fn column(run: &Run, probe: &str) -> Vec<f64> {
    let j = run
        .waveforms
        .find(probe)
        .unwrap_or_else(|| panic!("no column {probe}"));
    run.waveforms.column(j).collect()
}

/// The value in the last row at time `t`.
pub(crate) fn at(run: &Run, probe: &str, t: f64) -> f64 {
    let close = |&time: &f64| (time - t).abs() <= 1e-12 * t.abs();
    let k = run
        .waveforms
        .time
        .iter()
        .rposition(close)
        .unwrap_or_else(|| panic!("no row at {t}"));
    column(run, probe)[k]
}

/// The value at `t` on the straight line between rows.
pub(crate) fn interpolate(time: &[f64], values: &[f64], t: f64) -> f64 {
    let k = time.partition_point(|&x| x <= t).clamp(1, time.len() - 1);
    let (a, b) = (time[k - 1], time[k]);
    if b > a {
        values[k - 1] + (values[k] - values[k - 1]) * ((t - a) / (b - a)).clamp(0.0, 1.0)
    } else {
        values[k]
    }
}
