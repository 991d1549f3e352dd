//! Nanoseconds per step of the fixed-step methods with a cached active set.
//!
//! `cargo bench --bench step` prints one line per system and method: median thread time of nine runs.
#![allow(clippy::print_stdout, missing_docs, reason = "a bench prints")]

#[path = "../systems/mod.rs"]
mod systems;

use circ::integrate::step::Scheme;
use circ::integrate::theta::{Setup, Start, Stepping, Theta};
use circ::integrate::{Log, Stepper};
use circ::lcs::Lcs;
use circ::settings::Settings;
use cpu_time::ThreadTime;
use nalgebra::{DVector, dvector};

fn nanoseconds(lcs: &Lcs, start: &DVector<f64>, scheme: Scheme, h: f64) -> (f64, u64) {
    let owned = lcs.clone();
    let mut theta = Theta::new(Setup {
        reduce: Box::new(move |_| Ok(owned.clone())),
        position: vec![],
        thresholds: vec![],
        t: 0.0,
        start: Start::State(start.clone()),
        scheme,
        stepping: Stepping::Fixed(h),
        longest: f64::INFINITY,
        settings: Settings::default(),
    })
    .expect("a system");
    let mut log = Log::new(lcs.outputs.names.len(), 0.0, false);
    let begin = ThreadTime::now();
    theta.advance(5e-3, &mut log).expect("a run");
    let steps = theta.stats().steps;
    (
        begin.elapsed().as_secs_f64() * 1e9 / steps as f64,
        theta.stats().pivotings,
    )
}

fn main() {
    let systems = [
        ("rlcd n=2 m=1", systems::rlcd(), dvector![10.0, 0.0]),
        ("bridge n=2 m=4", systems::bridge(), dvector![10.0, 0.0]),
        (
            "bridge+filter n=3 m=4",
            systems::bridge_cap_filter(),
            dvector![10.0, 0.0, 0.0],
        ),
    ];
    for (name, lcs, start) in &systems {
        for (method, scheme) in [("euler", Scheme::MOREAU), ("midpoint", Scheme::MIDPOINT)] {
            for h in [1e-6, 1e-8] {
                let mut times: Vec<(f64, u64)> =
                    (0..9).map(|_| nanoseconds(lcs, start, scheme, h)).collect();
                times.sort_by(|a, b| a.0.total_cmp(&b.0));
                let (ns, solves) = times[4];
                println!("{name:24} {method:9} h={h:e}: {ns:6.1} ns/step, {solves} solver calls");
            }
        }
    }
}
