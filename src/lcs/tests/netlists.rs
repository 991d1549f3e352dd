//! The port behaviour of every netlist that ships, at both positions of its switches, against nodal analysis.

use super::nodal::Branch;
use super::papers::netlist;
use super::random::compare;
use super::*;
use crate::circuit::{Circuit, Kind};

fn shipped() -> Vec<(String, Circuit)> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".cir"))
        .collect();
    names.sort();
    names
        .into_iter()
        .map(|name| (name.clone(), netlist(&name)))
        .collect()
}

#[test]
fn every_netlist_agrees_with_nodal_analysis() {
    let mut compared = 0;
    let mut systems = 0;
    for (name, circuit) in shipped() {
        let behaviour = behaviour(&circuit).unwrap();
        for on in [false, true] {
            let position = Position::free(&behaviour, vec![on; behaviour.switches.len()]);
            let s = match reduce(&behaviour, &position) {
                Ok(s) => s,
                // All switches at once may short a source.
                Err(ReduceError::Sources { .. }) if !behaviour.switches.is_empty() => continue,
                Err(error) => panic!("{name}: {error}"),
            };
            systems += 1;
            let held = |element: &str| {
                let k = circuit.element(element).unwrap();
                match &circuit.elements[k.index()].kind {
                    Kind::Switch(switch) if on => Branch::Resistance(switch.ron.f64),
                    Kind::Switch(switch) => switch
                        .roff
                        .map_or(Branch::Current(0.0), |r| Branch::Resistance(r.f64)),
                    _ => Branch::Current(0.0),
                }
            };
            let count = compare(&circuit, &s, &held).unwrap_or_else(|e| panic!("{name}: {e}"));
            let columns = (s.m() + s.p()) * (s.m() + s.outputs.names.len());
            assert_eq!(count, columns, "{name}: nodal analysis was ill-conditioned");
            compared += count;
            if behaviour.switches.is_empty() {
                break;
            }
        }
    }
    assert!(
        systems >= 30 && compared > 800,
        "{systems} systems, {compared} numbers"
    );
}
