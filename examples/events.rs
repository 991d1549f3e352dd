//! A simulation that stops at events: how long each diode of a bridge conducts.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::collections::BTreeMap;

use circ::{Change, Model, SimulationOptions, StopReason};

const BRIDGE: &str = "bridge
v1 a b sin(0 325 50)
rs a p 0.5
d1 p out d
d2 b out d
d3 0 p d
d4 0 b d
c1 out 0 470u
r1 out 0 100
.model d d(ideal)
.tran 100u 100m uic
.end
";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut simulation =
        Model::parse(BRIDGE, "bridge.cir")?.simulation(SimulationOptions::default())?;
    let mut since: BTreeMap<String, f64> = BTreeMap::new();
    let mut conducted: BTreeMap<String, f64> = BTreeMap::new();
    loop {
        let stop = simulation.advance_to_event(0.1)?;
        for event in &stop.events {
            for change in event.changes.iter() {
                match change {
                    Change::Device {
                        name,
                        conducts: true,
                    } => {
                        since.insert(name.to_string(), event.t);
                    }
                    Change::Device {
                        name,
                        conducts: false,
                    } => {
                        if let Some(begin) = since.remove(&**name) {
                            *conducted.entry(name.to_string()).or_default() += event.t - begin;
                        }
                    }
                    other => println!("{other}"),
                }
            }
        }
        if stop.reason == StopReason::Time {
            break;
        }
    }
    for (diode, seconds) in &conducted {
        println!("{diode} conducts for {:.3} ms", seconds * 1e3);
    }
    assert_eq!(conducted.len(), 4);
    Ok(())
}
