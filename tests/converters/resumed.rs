//! A run that is stopped, left, and taken up again where it stood.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::time::Duration;

use circ::settings::Settings;
use circ::{Checkpoint, Model, Simulation, SimulationOptions};

use crate::circuit::{Circuit, states};
use crate::compare::{MOST_STEPS, said};
use crate::random::Random;

/// It goes back so often.
const RETURNS: u64 = 3;
/// What it may take.
const LONGEST: Duration = Duration::from_secs(90);

/// The states at the rows of a circuit, by a simulation that stops between them too, and at times goes back to where it was left.
pub(crate) fn rows(circuit: &Circuit, seed: u64, tol: f64) -> Result<Vec<Vec<f64>>, String> {
    let (send, receive) = mpsc::channel();
    let circuit = circuit.clone();
    std::thread::spawn(move || {
        let guarded = catch_unwind(AssertUnwindSafe(|| driven(&circuit, seed, tol)));
        drop(send.send(guarded.unwrap_or_else(|e| Err(said(e.as_ref())))));
    });
    receive
        .recv_timeout(LONGEST)
        .unwrap_or_else(|_| Err("hang: no progress".into()))
}

fn driven(circuit: &Circuit, seed: u64, tol: f64) -> Result<Vec<Vec<f64>>, String> {
    let random = &mut Random::new(seed);
    let model = Model::parse(&circuit.text(), "random.cir").map_err(|e| e.to_string())?;
    let options = SimulationOptions {
        settings: Settings {
            tol,
            max_steps: (1 + RETURNS) * MOST_STEPS,
            ..Settings::default()
        },
        ..SimulationOptions::default()
    };
    let mut simulation = model.simulation(options).map_err(|e| e.to_string())?;
    let signals = states(circuit);
    let mut rows: Vec<Vec<f64>> = Vec::new();
    // The simulation as it was when so many rows were there.
    let mut left: Option<(usize, Checkpoint)> = None;
    let mut returns = RETURNS;
    while rows.len() < circuit.rows {
        let step = circuit.step();
        let (from, to) = (rows.len() as f64 * step, (rows.len() + 1) as f64 * step);
        if random.one_in(3) {
            let t = from + random.pick(&[0.1, 0.37, 0.5, 0.999]) * step;
            advance(&mut simulation, t)?;
        }
        advance(&mut simulation, to.min(circuit.stop))?;
        let values = signals.iter().map(|name| simulation.value(name));
        let row: Result<Vec<f64>, _> = values.collect();
        rows.push(row.map_err(|e| e.to_string())?);
        match &left {
            Some((there, checkpoint)) if returns > 0 && random.one_in(3) => {
                simulation.restore(checkpoint).map_err(|e| e.to_string())?;
                rows.truncate(*there);
                (left, returns) = (None, returns - 1);
            }
            None if random.one_in(3) => {
                let checkpoint = simulation.checkpoint().map_err(|e| e.to_string())?;
                left = Some((rows.len(), checkpoint));
            }
            _ => {}
        }
    }
    Ok(rows)
}

fn advance(simulation: &mut Simulation, t: f64) -> Result<(), String> {
    simulation
        .advance_to(t)
        .map(|_| ())
        .map_err(|e| e.to_string())
}
