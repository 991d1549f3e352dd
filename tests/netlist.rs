//! What netlists are read as, and what is said about bad ones.
#![cfg(feature = "cli")]

use std::path::Path;

use circ::circuit::{Circuit, Diodes, ElaborateOptions, elaborate};
use circ::diagnostic::{Diagnostic, Severity, SourceMap};
use circ::netlist::{Netlist, load, parse};

fn read(path: &str) -> (Netlist, Vec<Diagnostic>) {
    let mut sources = SourceMap::default();
    let root = sources.add(path, std::fs::read_to_string(path).unwrap());
    parse(&mut sources, root, &|path| std::fs::read(path))
}

/// The circuit, one element a line.
fn summary(circuit: &Circuit) -> String {
    let mut lines = vec![
        format!("title {:?}", circuit.title),
        format!("nodes {}", circuit.nodes.join(" ")),
        format!("{:?}", circuit.tran),
    ];
    for e in &circuit.elements {
        let node = |id: circ::circuit::NodeId| &circuit.nodes[id.index()];
        let ic = e.ic.map_or(String::new(), |ic| format!(" ic={ic}"));
        lines.push(format!(
            "{} {} {}{ic}: {:?}",
            e.name,
            node(e.p),
            node(e.n),
            e.kind
        ));
    }
    for c in &circuit.couplings {
        lines.push(format!("{}: {:?} {:?} {:?}", c.name, c.a, c.b, c.k));
    }
    for (a, b, value) in &circuit.initial_voltages {
        lines.push(format!("ic {a:?} {b:?} {value}"));
    }
    for probe in circuit.probes() {
        lines.push(format!("{}: {:?}", probe.name, probe.what));
    }
    lines.join("\n")
}

#[test]
fn a_rectifier_as_cards() {
    let (netlist, findings) = read("tests/data/rectifier.cir");
    assert_eq!(findings, []);
    insta::assert_debug_snapshot!(netlist);
}

#[test]
fn a_rectifier_as_a_circuit() {
    let (netlist, _) = read("tests/data/rectifier.cir");
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    assert_eq!(findings, []);
    insta::assert_snapshot!(summary(&circuit.unwrap()));
}

#[test]
fn every_card_as_cards() {
    let (netlist, findings) = read("tests/data/everything.cir");
    assert!(
        findings.iter().all(|d| d.severity == Severity::Note),
        "{findings:?}"
    );
    insta::assert_debug_snapshot!(netlist);
}

#[test]
fn every_card_as_a_circuit() {
    let loaded = load(
        Path::new("tests/data/everything.cir"),
        &ElaborateOptions::default(),
    );
    let circuit = loaded
        .circuit
        .unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
    insta::assert_snapshot!(summary(&circuit));
}

#[test]
fn parameters_of_the_user_replace_those_of_the_netlist() {
    let (netlist, _) = read("tests/data/everything.cir");
    let options = ElaborateOptions {
        params: vec![("VIN".into(), 15.0)],
        ..ElaborateOptions::default()
    };
    let circuit = elaborate(&netlist, &options).0.unwrap();
    assert!(circuit.element("rmid").is_some() && circuit.element("rhi").is_none());

    let options = ElaborateOptions {
        params: vec![("vim".into(), 15.0)],
        ..ElaborateOptions::default()
    };
    let (circuit, findings) = elaborate(&netlist, &options);
    assert!(circuit.is_none());
    assert_eq!(
        findings
            .iter()
            .find(|d| d.code == "unknown-parameter")
            .unwrap()
            .help
            .as_deref(),
        Some("did you mean `vin`?")
    );
}

#[test]
fn exponential_diodes_are_ideal_when_asked_for() {
    let options = ElaborateOptions {
        diodes: Diodes::Ideal,
        ..ElaborateOptions::default()
    };
    let loaded = load(Path::new("netlists/bad/exponential-diode.cir"), &options);
    insta::assert_snapshot!(summary(&loaded.circuit.unwrap()));
}

#[test]
fn probes_by_name() {
    let circuit = load(
        Path::new("tests/data/everything.cir"),
        &ElaborateOptions::default(),
    )
    .circuit
    .unwrap();
    for (text, name) in [
        ("V(OUT)", "v(out)"),
        ("v( out , ac )", "v(out,ac)"),
        ("I(D1)", "i(d1)"),
        ("@d1[i]", "i(d1)"),
        ("vin#branch", "i(vin)"),
        ("out", "v(out)"),
        ("v(x1:m)", "v(x1.m)"),
        ("i(d.x1.df)", "i(x1.df)"),
        ("v(0)", "v(0)"),
    ] {
        assert_eq!(
            circuit.probe(text).map(|p| p.name).as_deref(),
            Some(name),
            "{text}"
        );
    }
    for text in ["v(nosuch)", "i(nosuch)", "v(out", "", "i(out)"] {
        assert_eq!(circuit.probe(text), None, "{text}");
    }
}

/// The example of `docs/netlist.md` is read without a word.
#[test]
fn the_example_is_read_without_findings() {
    let page = std::fs::read_to_string("docs/netlist.md").unwrap();
    let example = page
        .split("```spice title=buck.cir\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    let mut sources = SourceMap::default();
    let root = sources.add("example.cir", example);
    let (netlist, findings) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    assert_eq!(findings, []);
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    assert_eq!(findings, []);
    assert_eq!(circuit.unwrap().elements.len(), 7);
}

/// Each file has one fault; the whole message is the snapshot.
/// Codes and remedies of what is wrong with these cards.
fn mistakes(cards: &str) -> Vec<(&'static str, String)> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("t.cir");
    std::fs::write(&file, format!("t\n{cards}\n.end\n")).unwrap();
    let found = circ::netlist::load(&file, &ElaborateOptions::default()).diagnostics;
    let errors = found.into_iter().filter(|d| d.severity == Severity::Error);
    errors
        .map(|d| (d.code, d.help.unwrap_or_default()))
        .collect()
}

#[test]
fn what_a_refused_card_defines_is_not_called_unknown() {
    let rest = "v1 a 0 {d}\nr1 a 0 1\n.tran 1m";
    let comma = vec![("decimal-comma", "write `0.22`".to_owned())];
    assert_eq!(mistakes(&format!(".param d=0,22\n{rest}")), comma);
    let codes = |cards: &str| -> Vec<&str> { mistakes(cards).iter().map(|m| m.0).collect() };
    assert_eq!(
        codes(&format!(".param e=0,22\n{rest}")),
        ["decimal-comma", "unknown-parameter"]
    );
    assert_eq!(codes(rest), ["unknown-parameter"]);
}

#[test]
fn words_that_were_meant_otherwise_are_told() {
    let rest = "v1 a 0 1\nr1 a 0 1";
    for (card, meant) in [
        (".tran 3m uicc", "did you mean `uic`?"),
        (".tran 3m\nmeas tran x max v(a)", "did you mean `.meas`?"),
        (".tran 3m\nparam x=3", "did you mean `.param`?"),
        ("tran 3m", "did you mean `.tran`?"),
    ] {
        let found = mistakes(&format!("{rest}\n{card}"));
        assert_eq!(found.len(), 1, "{card}: {found:?}");
        assert!(found[0].1.contains(meant), "{card}: {found:?}");
    }
}

#[test]
fn bad_netlists() {
    let mut files: Vec<_> = std::fs::read_dir("netlists/bad")
        .unwrap()
        .map(|f| f.unwrap().path())
        .collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "cir"));
    files.sort();
    assert!(files.len() >= 40);
    for file in files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let loaded = load(&file, &ElaborateOptions::default());
        assert!(!loaded.diagnostics.is_empty(), "{name}: nothing to say");
        let verdict = if loaded.circuit.is_some() {
            "accepted"
        } else {
            "refused"
        };
        let text = circ::cli::render(&loaded.diagnostics, &loaded.sources, false);
        let text: Vec<&str> = text.lines().map(str::trim_end).collect();
        insta::with_settings!({ snapshot_path => "snapshots/bad", prepend_module_to_snapshot => false }, {
            insta::assert_snapshot!(name.as_str(), format!("{verdict}\n\n{}", text.join("\n")));
        });
    }
}
