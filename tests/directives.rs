//! Directives and waveforms that have no test of their own elsewhere, from text to values.

use std::io;
use std::path::Path;

use circ::circuit::source::Wave;
use circ::circuit::{Circuit, ElaborateOptions, Kind, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{SimOptions, Values, operating_point, simulate};
use circ::law::Law;
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::settings::Settings;

/// Elaborates a netlist beside which `points.txt` and `bad.csv` lie; (circuit, messages with severity and place).
fn read(text: &str) -> (Option<Circuit>, Vec<String>) {
    let mut sources = SourceMap::default();
    let root = sources.add("dir/a.cir", format!("title\n{text}\n.end\n"));
    let loader = |path: &Path| match path.to_str() {
        Some("dir/points.txt") => {
            Ok(b"* two lines\n0 0, 1m\t5\n\n// an edge\n1m;0 +1m 2.5k\r\n".to_vec())
        }
        Some("dir/Bad.csv") => Ok(b"time,volt\n0,1\n".to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    let (netlist, mut findings) = parse(&mut sources, root, &loader);
    let (circuit, more) = elaborate(&netlist, &ElaborateOptions::default());
    findings.extend(more);
    let messages = findings.iter().map(|finding| {
        let place = finding.span.map_or(String::new(), |span| {
            let file = &sources.files[span.file.0 as usize];
            format!("{}:{}", file.path, &file.text[span.start..span.end])
        });
        format!("{:?} {place} {}", finding.severity, finding.message)
    });
    (circuit, messages.collect())
}

fn circuit(text: &str) -> Circuit {
    let (circuit, messages) = read(text);
    circuit.unwrap_or_else(|| panic!("{messages:?}"))
}

fn wave(circuit: &Circuit, name: &str) -> Wave {
    match &circuit.elements[circuit.element(name).unwrap().index()].kind {
        Kind::VoltageSource(source) => source.wave.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn points_from_a_file() {
    for card in [
        "v1 a 0 pwl file=points.txt",
        "v1 a 0 PWL(FILE=\"points.txt\")",
    ] {
        let wave = wave(&circuit(&format!("{card}\nr1 a 0 1\n.tran 1m 4m")), "v1");
        let points = vec![(0.0, 0.0), (1e-3, 5.0), (1e-3, 0.0), (2e-3, 2500.0)];
        let expected = Wave::Pwl {
            points,
            repeat: None,
            delay: 0.0,
        };
        assert_eq!(wave, expected, "{card}");
    }
    let scaled = "v1 a 0 pwl file=points.txt time_scale_factor=2 value_scale_factor=-1 r=0";
    let wave = wave(&circuit(&format!("{scaled}\nr1 a 0 1\n.tran 1m 4m")), "v1");
    assert_eq!((wave.value(1e-3), wave.value(5e-3)), (-2.5, -2.5));
    for (card, message) in [
        (
            "pwl file=no.txt",
            "Error dir/a.cir:no.txt cannot read `no.txt`",
        ),
        (
            "pwl file=Bad.csv",
            "Error dir/Bad.csv:time `time` is not a number",
        ),
        (
            "pwl(0 1 2 3) file=points.txt",
            "Error dir/a.cir:points.txt a file besides the values",
        ),
    ] {
        let (circuit, messages) = read(&format!("v1 a 0 {card}\nr1 a 0 1\n.tran 1m 4m"));
        assert!(
            circuit.is_none() && messages.contains(&message.to_string()),
            "{messages:?}"
        );
    }
}

/// Two and a half cycles of a damped sine; after them the value at the phase.
#[test]
fn a_sine_of_so_many_cycles() {
    let wave = wave(
        &circuit("v1 a 0 sin(1 2 100 5m 10 90 2.5)\nr1 a 0 1\n.tran 1m 50m"),
        "v1",
    );
    assert_eq!((wave.value(0.0), wave.value(40e-3)), (3.0, 3.0));
    let end = wave.next_breakpoint(5e-3).unwrap();
    assert!((end - 30e-3).abs() < 1e-15);
    let inside = 1.0 - 2.0 * (-10.0 * 5e-3_f64).exp();
    assert!((wave.value(10e-3) - inside).abs() < 1e-12);
    assert!(wave.is_edge(end) && !wave.is_edge(5e-3));
}

#[test]
fn random_sources_are_refused_where_they_stand() {
    for kind in ["trnoise(20n 0.5n 0 0)", "trrandom(2 10m 0 1)"] {
        let (circuit, messages) = read(&format!("v1 a 0 {kind}\nr1 a 0 1\n.tran 1m 4m"));
        assert!(circuit.is_none());
        let name = kind.split('(').next().unwrap();
        let expected = format!(
            "Error dir/a.cir:{name} {} of `v1` is not supported",
            name.to_uppercase()
        );
        assert_eq!(messages, [expected]);
    }
}

/// A latch has two operating points (and switch by switch none is found); `.nodeset` chooses.
#[test]
fn nodeset_chooses_an_operating_point() {
    let latch = "v1 vcc 0 5\nr1 vcc a 1k\nr2 vcc b 1k\ns1 a 0 b 0 sm\ns2 b 0 a 0 sm
.model sm sw(ideal vt=2.5)\n.tran 1m 2m";
    let settings = Settings::default();
    let point = |nodeset: &str| {
        let circuit = circuit(&format!("{latch}\n{nodeset}"));
        operating_point(&circuit, Values::Dc, false, &settings)
            .map(|p| (p.nodes[1].1, p.nodes[2].1))
    };
    assert!(point("").is_err());
    assert_eq!(point(".nodeset v(a)=5 v(b)=0").unwrap(), (5.0, 0.0));
    assert_eq!(point(".nodeset v(a)=0 v(b)=5").unwrap(), (0.0, 5.0));
    let (_, messages) = read(&format!("{latch}\n.nodeset v(c)=1 i(r1)=2"));
    assert_eq!(
        messages,
        [
            "Warning dir/a.cir:c there is no node `c`: `.nodeset` is ignored",
            "Warning dir/a.cir:r1 a current: `.nodeset` is ignored"
        ]
    );
}

/// Two junctions across a source, without a resistance, carry so much that nothing is left of their voltages: 4.5 V each.
#[test]
fn an_operating_point_off_the_laws_of_its_devices_is_told() {
    let told = |rs: &str| {
        let text = format!(
            "vcc vcc 0 9\nvee vee 0 -9\nr1 n0 vee 522\nr3 n2 n1 78.7k\nr4 n2 vee 4.92k\nr5 vee n1 661
q0 n2 n0 n1 qn\nd0 n0 0 dz\nd1 vcc n0 dz
.model qn npn(is=4.9e-16 bf=110 br=4)\n.model dz d(is=1e-14 bv=5.1 ibv=20m {rs})\n.op"
        );
        let circuit = circuit(&text);
        let point = operating_point(&circuit, Values::Dc, false, &Settings::default());
        let point = point.expect("an operating point");
        let off = (point.nodes[2].1 - 4.5).abs();
        let told = point.notes.iter().any(|note| note.code == "cancellation");
        (told, off)
    };
    let (without, off) = told("");
    assert!(without && off > 1e-4, "{off:e}");
    let (with, off) = told("rs=1");
    assert!(!with && off < 0.1, "{off:e}");
}

#[test]
fn the_temperature_is_a_name_of_expressions() {
    let ohms = |cards: &str| {
        let circuit = circuit(&format!("v1 a 0 1\nr1 a 0 {{temp}}\n.tran 1 2\n{cards}"));
        match &circuit.elements[1].kind {
            Kind::Resistor(value) => value.f64,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(ohms(""), 27.0);
    assert_eq!(ohms(".temp 85"), 85.0);
    // The value that `.step temp` gives counts for more.
    let mut sources = SourceMap::default();
    let root = sources.add("a.cir", "t\nv1 a 0 1\nr1 a 0 {temp}\n.temp 85\n.end\n");
    let (netlist, _) = parse(&mut sources, root, &|_| Err(io::ErrorKind::NotFound.into()));
    let options = ElaborateOptions {
        temperature: Some(10.0),
        ..ElaborateOptions::default()
    };
    let swept = elaborate(&netlist, &options).0.unwrap();
    assert!(matches!(swept.elements[1].kind, Kind::Resistor(r) if r.f64 == 10.0));
    assert_eq!(
        ohms(".options reltol=1e-4 noacct temp={10*5} gmin=1e-12"),
        50.0
    );
    let notes = |options: &str| read(&format!("v1 a 0 1\nr1 a 0 1\n.tran 1 2\n{options}")).1;
    for read in [".options temp=50", ".options tnom=50"] {
        assert_eq!(notes(read), [""; 0]);
    }
    assert_eq!(
        notes(".options rshunt=1e9"),
        [
            "Warning dir/a.cir:rshunt the result is without `rshunt` of `.options`: a resistance from every node to ground"
        ]
    );
    for (options, skipped) in [
        (
            ".options temp=50 reltol=1e-4",
            ".options but for temp, tnom and gmin",
        ),
        (
            ".OPTIONS noacct GMIN=1p",
            ".options but for temp, tnom and gmin",
        ),
        (".options reltol=1e-4", ".options"),
        (".options temp", ".options"),
    ] {
        let notes = notes(options);
        assert!(
            notes.len() == 1 && notes[0].ends_with(&format!("transient: {skipped}")),
            "{notes:?}"
        );
    }
    let steps = circuit("v1 a 0 1\nr1 a 0 {temp}\n.tran 1 2\n.temp 0 25 100").steps;
    assert_eq!(steps[0].values, [0.0, 25.0, 100.0]);
}

#[test]
fn commands_that_batch_decks_use() {
    let (circuit, messages) = read(
        "v1 a 0 sin(0 1 50)\nr1 a b 1k\nr2 b 0 1k
.control
save v(b) @r1[i]
tran 1m 20m uic
meas tran top MAX v(b)
meas tran lost v(b) at=1m
fourier 50 v(b)
let y = 2*v(b)
plot v(b) y
run
.endc",
    );
    let circuit = circuit.unwrap();
    assert!(circuit.tran.is_some_and(|t| t.tstop == 20e-3 && t.uic));
    let names: Vec<String> = circuit.probes().into_iter().map(|p| p.name).collect();
    assert_eq!(names, ["v(b)", "i(r1)"]);
    assert_eq!((circuit.measurements.len(), circuit.fourier.len()), (1, 1));
    assert_eq!(
        messages,
        [
            "Warning dir/a.cir:v `v` is no kind of measurement; the command is left out",
            "Note dir/a.cir:let y = 2*v(b) skipped, as they do not change the transient: let (in .control), plot (in .control)"
        ]
    );
}

/// What LTspice writes into a netlist that it exports.
#[test]
fn an_export_of_ltspice() {
    let text = "V1 N001 0 SINE(0 10 1k 0 0 0 5) AC 1 Rser=0.1\nL§1 N001 N002 10µ Rser=5m Rpar=1k Cpar=1p
C1 N002 0 4.7µ V=25 Irms=0 Rser=5m Lser=1n mfg=\"KEMET\" type=\"X7R\"\nR§Load N002 0 4K7\nD§D1 N002 0 D
.model D D(Ron=0.1 Roff=1Meg Vfwd=0.6)\n.lib C:\\LTC\\standard.dio\n.tran 0 2m 0 1u startup\n.backanno";
    let (circuit, messages) = read(text);
    let circuit = circuit.unwrap();
    for name in [
        "v1.rser",
        "l§1",
        "l§1.rser",
        "l§1.rpar",
        "l§1.cpar",
        "c1.rser",
        "c1.lser",
        "r§load",
        "d§d1",
    ] {
        assert!(circuit.element(name).is_some(), "{name}");
    }
    assert!(
        messages.iter().all(|m| !m.starts_with("Error")),
        "{messages:?}"
    );
    let behaviour = behaviour(&circuit).unwrap();
    simulate(&circuit, &behaviour, SimOptions::default()).unwrap();
    assert!(circuit.probe("I(R§Load)").is_some());
}

/// LTspice takes expressions without braces as the values of passive elements.
#[test]
fn values_without_braces() {
    let of = |value: &str| {
        let text = format!("V1 a 0 5\n.param x=3 load=7\nR1 a 0 {value}\n.tran 1u 1m");
        circuit(&text).value("r1")
    };
    for (value, ohms) in [
        ("R=100*x", 300.0),
        ("R=x*100 tc1=1m", 300.0),
        ("R = 1k/(2 + x) tol=5", 200.0),
        ("R=if(x>2, 1, 1Meg)", 1.0),
        ("R=100 + x", 103.0),
        ("R=-(x) noiseless", -3.0),
        // As they ever were.
        ("R=load", 7.0),
        ("R=4k7", 4700.0),
        ("R={100*x} m=2", 150.0),
    ] {
        assert_eq!(of(value), Some(ohms), "{value}");
    }
    let (none, messages) = read("V1 a 0 5\nR1 a 0 R=100*y\n.tran 1u 1m");
    assert!(
        none.is_none() && messages[0].contains("unknown parameter `y`"),
        "{messages:?}"
    );
    let capacitor = circuit("V1 a 0 5\nC1 a 0 C=2*1u\n.tran 1u 1m");
    assert_eq!(capacitor.value("c1"), Some(2e-6));
}

/// Runs of `.step` that are all the same are not made without a word.
#[test]
fn a_step_of_what_nothing_uses() {
    let warned = |text: &str| {
        let (circuit, messages) = read(text);
        assert!(circuit.is_some(), "{messages:?}");
        let idle = messages.iter().filter(|m| m.contains("changes nothing"));
        idle.count()
    };
    let with = |card: &str, value: &str| {
        format!("V1 a 0 5\nR1 a 0 {value}\n{card}\n.step param x 1 3 1\n.tran 1u 1m")
    };
    assert_eq!(warned(&with(".param x=2", "1k")), 1);
    assert_eq!(warned(&with("* nothing", "1k")), 1);
    assert_eq!(warned(&with(".param x=2", "{x}")), 0);
    assert_eq!(warned(&with("* nothing", "{x}")), 0);
    assert_eq!(warned(&with(".param x=2 y={2*x}", "{y}")), 0);
    // A measurement may be all that depends on it.
    let measured = ".param x=2\n.meas tran top param 2*x";
    assert_eq!(warned(&with(measured, "1k")), 0);
}

#[test]
fn junctions_that_alone_hold_a_part_leak() {
    let leaks = |text: &str| -> Vec<f64> {
        let of = |kind: &Kind| match kind {
            Kind::Device(Law::Exponential(diode)) => Some(diode.leak),
            _ => None,
        };
        let elements = circuit(&format!("{text}\n.model d d\n.tran 1m 1")).elements;
        elements.iter().filter_map(|e| of(&e.kind)).collect()
    };
    let series = "v1 a 0 1\nd1 a b d\nd2 b c d\nr1 c 0 1k\nd3 c 0 d\n";
    assert_eq!(leaks(series), [1e-12, 1e-12, 0.0]);
    assert_eq!(
        leaks(&format!("{series}.options gmin=1n")),
        [1e-9, 1e-9, 0.0]
    );
    assert_eq!(leaks(&format!("{series}.options gmin=0")), [0.0; 3]);
    for tie in ["c1 b 0 1n", "l1 b 0 1", "s1 b 0 a 0 m\n.model m sw"] {
        assert_eq!(leaks(&format!("{series}{tie}")), [0.0; 3], "{tie}");
    }
    // What lets no current through, or any, holds nothing.
    for loose in [
        "i1 b 0 1",
        "s1 b 0 a 0 m\n.model m sw(roff=inf)",
        "d4 b 0 d",
        "g1 b 0 a 0 1",
    ] {
        assert!(leaks(&format!("{series}{loose}"))[0] > 0.0, "{loose}");
    }
    let (_, messages) = read(&format!(
        "{series}.model d d\n.tran 1m 1\n.options gmin=-1p"
    ));
    assert!(
        messages.iter().any(|m| m.contains("gmin is -1e-12 S")),
        "{messages:?}"
    );
    let (_, messages) = read(&format!("{series}.model d d\n.tran 1m 1"));
    assert!(
        messages
            .iter()
            .any(|m| m.contains("beside d1 and d2 decide its voltage")),
        "{messages:?}"
    );
}
