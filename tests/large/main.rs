//! Circuits that grow: what is set up, simulated and kept of them.
#![allow(missing_docs, reason = "tests")]

mod families;
mod parts;

use circ::Model;
use circ::integrate::{Method, Run, SimOptions, simulate, start};
use circ::lcs::{Csr, Position, SparseLcs, json, reduce, sparse_format};
use circ::settings::Settings;

fn model(text: &str) -> Model {
    Model::parse(text, "large.cir").unwrap_or_else(|e| panic!("{e:?}"))
}

fn run(text: &str, settings: Settings) -> Run {
    let model = model(text);
    let options = SimOptions {
        method: Method::Exact,
        settings,
        ..SimOptions::default()
    };
    simulate(model.circuit(), model.multiport(), options).unwrap_or_else(|e| panic!("{e}"))
}

/// The largest difference of two runs with equal rows, relative to each signal's amplitude.
fn difference(a: &Run, b: &Run) -> f64 {
    assert_eq!(a.waveforms.names, b.waveforms.names);
    let columns = 0..a.waveforms.names.len();
    let of = |j: usize| {
        let [a, b] = [a, b].map(|run| run.waveforms.column(j).collect::<Vec<f64>>());
        assert_eq!(a.len(), b.len(), "rows");
        let amplitude = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let largest = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
        largest.fold(0.0, f64::max) / amplitude.max(f64::MIN_POSITIVE)
    };
    columns.map(of).fold(0.0, f64::max)
}

#[test]
fn every_family_runs_exactly_and_balances_its_energy() {
    for family in families::FAMILIES {
        let size = match family.name {
            "ladder" => 12,
            "pv" => 1,
            _ => 3,
        };
        let run = run(&(family.netlist)(size), Settings::default());
        let residual = run.energy.residual_relative;
        let what = format!("{} of {size} {}", family.name, family.unit);
        assert!(residual < 1e-9, "{what}: {residual:e}");
        assert!(run.notes.is_empty(), "{what}: {:?}", run.notes);
        assert!(run.waveforms.time.len() > 10, "{what}");
    }
}

/// What can be made again may be given up at any time.
#[test]
fn what_is_kept_changes_no_answer() {
    for (name, size) in [("interleaved", 4), ("h-bridges", 3), ("pv", 1)] {
        let family = families::FAMILIES.iter().find(|f| f.name == name).unwrap();
        let text = (family.netlist)(size);
        let everything = run(&text, Settings::default());
        let nothing = Settings {
            max_kept: 0,
            ..Settings::default()
        };
        let nothing = run(&text, nothing);
        assert_eq!(everything.stats.events, nothing.stats.events, "{name}");
        let difference = difference(&everything, &nothing);
        assert!(difference < 1e-11, "{name}: {difference:e}");
        assert!(nothing.energy.residual_relative < 1e-9, "{name}");
    }
}

/// RC sections: v_k' = (v_{k−1} − 2 v_k + v_{k+1})/(R C).
#[test]
fn a_long_ladder_has_the_system_of_its_equations() {
    const SECTIONS: usize = 4000;
    let model = model(&families::ladder(SECTIONS));
    let behaviour = model.multiport();
    let position = Position::free(behaviour, Vec::new());
    let lcs = SparseLcs::of(behaviour, &position).expect("a system");
    assert_eq!((lcs.states.len(), lcs.ports.len()), (SECTIONS, 1));
    assert_eq!(lcs.imprecise, 0);
    let rate = 1.0 / (10.0 * 10e-9);
    // The diode's node has no capacitor: the first section hangs on the source through the diode.
    let mut entries = 0;
    for (i, j, value) in lcs.a.entries().filter(|(i, ..)| *i > 0) {
        let expected = match (i, j) {
            (i, j) if i == j && i + 1 == SECTIONS => -rate - 1.0 / (10e3 * 10e-9),
            (i, j) if i == j => -2.0 * rate,
            (i, j) if i.abs_diff(j) == 1 => rate,
            _ => panic!("A has an entry at {i}, {j}"),
        };
        assert!((value / expected - 1.0).abs() < 1e-14, "{i} {j} {value:e}");
        entries += 1;
    }
    assert_eq!(entries, 3 * (SECTIONS - 1) - 1);
}

/// v = V exp(−x) on a chain of R between nodes and G to ground, at rest: 2 cosh(x) = 2 + R G.
#[test]
fn the_operating_point_of_a_long_chain_is_its_closed_form() {
    const NODES: usize = 3000;
    let mut text = String::from("* chain\nv1 n0 0 1\n");
    for k in 0..NODES {
        text += &format!(
            "r{k} n{k} n{} 1\nc{k} n{} 0 1u\ng{k} n{} 0 1meg\n",
            k + 1,
            k + 1,
            k + 1
        )
        .replace(&format!("\ng{k} "), &format!("\nrg{k} "));
    }
    // The line goes on for ever behind the last node.
    let (r, g) = (1.0, 1e-6);
    let x = (1.0_f64 + r * g / 2.0).acosh();
    let rest = r / (1.0 - (-x).exp());
    text += &format!("rl n{NODES} 0 {rest:.17e}\n.op\n.end\n");
    let model = model(&text);
    let settings = Settings::default();
    let initial = start::initial(model.circuit(), model.multiport(), false, &settings);
    let storage = initial.expect("an operating point").storage;
    assert_eq!(storage.len(), NODES);
    for (k, v) in storage.iter().enumerate() {
        let exact = (-x * (k + 1) as f64).exp();
        assert!((v / exact - 1.0).abs() < 1e-9, "{k}: {v} {exact}");
    }
}

#[test]
fn a_sparse_file_is_the_system_that_was_written() {
    let text = families::interleaved(5);
    let model = model(&text);
    let behaviour = model.multiport();
    let position = Position::free(behaviour, vec![false; behaviour.switches.len()]);
    let dense = reduce(behaviour, &position).expect("a system");
    let sparse = SparseLcs::of(behaviour, &position).expect("a system");
    let x0 = vec![0.25; sparse.states.len()];
    let read = json::read(&json::write_sparse(&sparse, &x0, model.circuit().tran)).expect("a file");
    for (read, dense) in [
        (&read.lcs.a, &dense.a),
        (&read.lcs.b, &dense.b),
        (&read.lcs.c, &dense.c),
        (&read.lcs.d, &dense.d),
        (&read.lcs.e, &dense.e),
        (&read.lcs.g, &dense.g),
        (&read.lcs.energy, &dense.energy),
        (&read.lcs.outputs.rows.x, &dense.outputs.rows.x),
        (&read.lcs.outputs.rows.lambda, &dense.outputs.rows.lambda),
    ] {
        assert_eq!(read, dense);
    }
    assert_eq!(read.x0.as_slice(), x0);
    assert_eq!(read.tran, model.circuit().tran);
    // Matrix Market: a line for each entry, counted from 1.
    let matrices = sparse_format::matrix_market(&sparse);
    let (letter, a) = &matrices[0];
    let lines: Vec<&str> = a.lines().collect();
    assert_eq!(*letter, "A");
    assert_eq!(lines[0], "%%MatrixMarket matrix coordinate real general");
    let n = sparse.states.len();
    assert_eq!(lines[2], format!("{n} {n} {}", sparse.a.data.len()));
    for (line, (i, j, value)) in lines[3..].iter().zip(sparse.a.entries()) {
        assert_eq!(*line, format!("{} {} {value:?}", i + 1, j + 1));
    }
}

#[test]
fn unsound_compressed_rows_are_refused() {
    let sound = Csr {
        shape: [2, 2],
        indptr: vec![0, 1, 2],
        indices: vec![0, 1],
        data: vec![1.0, 2.0],
    };
    assert!(sound.is_sound());
    let broken = [
        Csr {
            indptr: vec![0, 2],
            ..sound.clone()
        },
        Csr {
            indptr: vec![0, 2, 1],
            ..sound.clone()
        },
        Csr {
            indices: vec![0, 2],
            ..sound.clone()
        },
        Csr {
            data: vec![1.0],
            ..sound.clone()
        },
    ];
    assert!(broken.iter().all(|csr| !csr.is_sound()));
    let file = |a: &str| {
        format!(r#"{{"schema":"circ-lcs/1","states":[{{"name":"x"}},{{"name":"y"}}],"A":{a}}}"#)
    };
    let good = r#"{"shape":[2,2],"indptr":[0,1,2],"indices":[0,1],"data":[-1.0,-2.0]}"#;
    assert_eq!(json::read(&file(good)).unwrap().lcs.a[(1, 1)], -2.0);
    for bad in [
        r#"{"shape":[2,2],"indptr":[0,1,9],"indices":[0,1],"data":[-1.0,-2.0]}"#,
        r#"{"shape":[2,3],"indptr":[0,1,2],"indices":[0,1],"data":[-1.0,-2.0]}"#,
        r#"{"shape":[2,2],"indptr":[0,1,2],"indices":[0,7],"data":[-1.0,-2.0]}"#,
    ] {
        assert!(json::read(&file(bad)).is_err(), "{bad}");
    }
}
