//! Nonlinear forms as files: read, refused, and run by `circ sim`.
#![allow(missing_docs, reason = "tests")]

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::process::Command;

use circ::forms::json::nonlinear::{self, NonlinearFile};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/forms/{name}.json"))
}

fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).expect("a form")
}

fn open(name: &str) -> NonlinearFile {
    nonlinear::read(&text(name))
        .expect("no fault")
        .expect("a nonlinear form")
}

#[test]
fn a_cubic_drift_between_pushes_has_its_closed_form() {
    // x is pushed along sin(2πt) until that falls faster than x' = −x³ would, at 2π cos θ = −sin³ θ; then it decays freely.
    let (mut low, mut high) = (0.25, 0.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let (sine, cosine) = (TAU * middle).sin_cos();
        if TAU * cosine > -sine.powi(3) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let leaves = (TAU * low).sin();
    let exact = |t: f64| {
        if t <= low {
            (TAU * t).sin()
        } else {
            (leaves.powi(-2) + 2.0 * (t - low)).sqrt().recip()
        }
    };
    let run = open("cubic").run(None, 2e-3).expect("a run");
    for (t, x) in run.trajectory.t.iter().zip(&run.trajectory.x) {
        assert!(
            (x[0] - exact(*t)).abs() < 4e-3,
            "{t}: {} {}",
            x[0],
            exact(*t)
        );
    }
    // Order one: the change by the last halving is the error that is left.
    let error = run.error.expect("an estimate");
    assert!(error <= 2e-3 && run.steps_per_row > 1, "{error}");
    let found = run.trajectory.last().expect("a state")[0];
    assert!((found - exact(1.0)).abs() < 3.0 * error, "{error}");
}

#[test]
fn a_rotation_in_a_disk_ends_on_the_circle() {
    let run = open("disk").run(Some(1e-3), 1e-4).expect("a run");
    // Free: r = exp(t)/2 and the angle t; on the circle from t = ln 2 on.
    let last = run.trajectory.last().expect("a state");
    assert!((last.norm() - 1.0).abs() < 1e-3, "{last}");
    assert!((last[1].atan2(last[0]) - 3.0).abs() < 3e-3, "{last}");
    // λ balances the outward push: x = −... + h'ᵀλ with h' = −2x, so λ = 1/2.
    let lambda = run.trajectory.lambda.last().expect("a λ")[0];
    assert!((lambda - 0.5).abs() < 1e-3, "{lambda}");
}

#[test]
fn a_descent_stops_at_the_edge() {
    // x₁' = −x₁ down to 1/2 at t = ln 4, then at rest; x₂ = exp(−t).
    let run = open("descent").run(None, 1e-3).expect("a run");
    let last = run.trajectory.last().expect("a state");
    assert!((last[0] - 0.5).abs() < 1e-9, "{last}");
    assert!((last[1] - (-2.0_f64).exp()).abs() < 2e-3, "{last}");
}

#[test]
fn mistakes_are_named() {
    let message = |from: &str, to: &str| {
        let text = text("cubic");
        assert!(text.contains(from), "{from}");
        nonlinear::read(&text.replace(from, to))
            .expect_err("a fault")
            .to_string()
    };
    assert!(message("-x1^3", "-x2^3").contains("unknown name `x2`"));
    assert!(message("\"c\": [\"x1\"]", "\"c\": [\"2*x1\"]").contains("∂c/∂x = BᵀV'' fails"));
    assert!(message("[[1]]", "[[1, 2]]").contains("does not fit"));
    assert!(message("\"tstop\": 1", "\"tstop\": -1").contains("`tstop`"));
    assert!(message("nonlinear_complementarity", "sweeping_process").contains("no nonlinear form"));
    // Every other file is none of these.
    assert!(nonlinear::read("{}").expect("no fault").is_none());
    assert!(nonlinear::read("title\n.end").expect("no fault").is_none());
}

#[test]
fn circ_sim_writes_their_states() {
    let out = tempfile::tempdir().expect("a folder");
    let file = out.path().join("disk.csv");
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_circ"))
            .arg("sim")
            .arg(path("disk"))
            .args(arguments)
            .output()
            .expect("circ runs")
    };
    let done = run(&["--step", "10m", "-o", &file.to_string_lossy()]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let csv = std::fs::read_to_string(&file).expect("a file");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("time,a,b,lambda(d1),y(d1)"));
    assert_eq!(lines.count(), 31);
    let picked = run(&["--step", "10m", "--probe", "b"]);
    assert!(String::from_utf8_lossy(&picked.stdout).starts_with("time,b\n"));
    for refused in [["--method", "exact"], ["--probe", "c"]] {
        assert_eq!(run(&refused).status.code(), Some(2), "{refused:?}");
    }
}
