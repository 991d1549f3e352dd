use std::collections::BTreeMap;
use std::path::Path;

use super::grid::{Grid, LEVEL, Plan};
use super::part::{Parts, Symbol, Transistor};
use super::{cards, search, symbol};
use crate::model::Model;

fn model(name: &str) -> Model {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("netlists")
        .join(name);
    Model::load(file, crate::ElaborateOptions::default()).unwrap()
}

fn parts(model: &Model) -> Parts {
    cards::parts(model.netlist().unwrap(), model.sources(), model.circuit())
}

fn drawn(model: &Model) -> (Parts, Plan, Grid) {
    let parts = parts(model);
    let plan = search::plan(&parts);
    let grid = Grid::of(&parts.parts, parts.nets.len(), &plan);
    (parts, plan, grid)
}

/// The grid points of every wire, by net; those that lie inside a stretch without an end or a branch apart.
fn points(grid: &Grid) -> BTreeMap<(i32, i32), Vec<(usize, bool)>> {
    let mut points: BTreeMap<(i32, i32), Vec<(usize, bool)>> = BTreeMap::new();
    for run in &grid.runs {
        let Some(net) = run.net else { continue };
        for x in run.x.0..=run.x.1 {
            let is_inside = x > run.x.0 && x < run.x.1 && !grid.pins[net].contains(&x);
            points
                .entry((x, LEVEL * run.level))
                .or_default()
                .push((net, is_inside));
        }
    }
    for rise in &grid.rises {
        let Some(net) = rise.net else { continue };
        for y in rise.y.0..=rise.y.1 {
            let is_inside = y > rise.y.0 && y < rise.y.1;
            points
                .entry((rise.x.0, y))
                .or_default()
                .push((net, is_inside));
        }
    }
    points
}

/// Counts crossings; two nets meet nowhere else.
fn crossings(grid: &Grid) -> usize {
    let mut crossings = 0;
    for (at, nets) in points(grid) {
        let first = nets[0].0;
        if nets.iter().any(|(net, _)| *net != first) {
            assert!(
                nets.iter().all(|(_, is_inside)| *is_inside),
                "nets {nets:?} touch at {at:?}"
            );
            crossings += 1;
        }
    }
    crossings
}

#[test]
fn an_igbt_has_an_insulated_gate_beside_a_bipolar_transistors_lines() {
    let text = "z\nv1 c 0 400\nr1 c d 10\nvg g 0 15\nz1 d g 0 NI\nj1 d g 0 NJ\n\
                .model NI NIGBT\n.model NJ NJF\n.tran 1u 1m\n";
    let model = Model::parse(text, "z.cir").unwrap();
    let all = parts(&model).parts;
    let of = |name: &str| all.iter().find(|part| part.name == name).unwrap().symbol;
    let drawn = |symbol| symbol::drawn(symbol, (-30.0, 30.0), false, true);
    let igbt = Symbol::Transistor(Transistor::Igbt);
    assert_eq!(of("z1"), igbt);
    assert_ne!(drawn(of("z1")), drawn(of("j1")));
    let bipolar = drawn(Symbol::Transistor(Transistor::Bipolar { p: false }));
    let lines = "M-13 9H13M-20 0L-7 9M20 0L7 9";
    assert!(bipolar.contains(&format!("{lines}M0 9V28")), "{bipolar}");
    // The lead of the gate ends at its own line.
    assert!(drawn(igbt).contains(&format!("{lines}M-13 14H13M0 14V28")));
}

#[test]
fn converters_look_as_in_textbooks() {
    for name in ["buck.cir", "boost.cir", "cuk.cir"] {
        let (parts, plan, grid) = drawn(&model(name));
        assert_eq!(crossings(&grid), 0, "{name}");
        assert!(
            plan.levels.iter().all(|level| *level <= 1),
            "{name}: one line above ground"
        );
        let column = |wanted: &str| {
            let k = parts.parts.iter().position(|p| p.name == wanted);
            plan.columns[k.unwrap()]
        };
        assert!(
            column("vin") < column("l1") && column("l1") < column("rload"),
            "{name}: from left to right"
        );
    }
}

#[test]
fn wires_of_different_nets_only_cross() {
    for name in [
        "bridge-resistor.cir",
        "flyback.cir",
        "common-emitter.cir",
        "line-rectifier.cir",
    ] {
        let (parts, plan, grid) = drawn(&model(name));
        assert!(crossings(&grid) <= 1, "{name}");
        // Every pin is on its net.
        let points = points(&grid);
        for (part, pose) in parts.parts.iter().zip(&grid.poses) {
            assert!(
                part.nets
                    .iter()
                    .take(2)
                    .all(|net| !grid.pins[*net].is_empty() || *net == 0),
                "{name} {pose:?}"
            );
        }
        for (net, pins) in grid.pins.iter().enumerate() {
            for x in pins {
                let here = &points[&(*x, LEVEL * plan.levels[net])];
                assert!(here.iter().any(|(own, _)| *own == net), "{name}");
            }
        }
    }
}

#[test]
fn what_cannot_be_placed_well_is_still_no_short() {
    // Every node of six tied to every other one: no plane drawing.
    let names = ["0", "a", "b", "c", "d", "e"];
    let mut text = String::from("k6\nv1 a 0 1\n");
    for (i, a) in names.iter().enumerate() {
        for b in &names[..i] {
            text.push_str(&format!("r{a}{b} {a} {b} 1k\n"));
        }
    }
    let model = Model::parse(&(text + ".end\n"), "k6.cir").unwrap();
    let (_, _, grid) = drawn(&model);
    assert!(crossings(&grid) > 0, "K6 is not planar");
}

#[test]
fn cards_are_parts_with_their_own_words() {
    let text = "words\n.param big=1\nv1 a 0 sin(0 10 50)\n.if (big==1)\nr1 a b 4k7\n.else\nr1 a b 9k\nr9 a b 1\n.endif\n\
        x1 b c twoport\ns1 c gnd a b sw1\nq1 c b 0 qp\nd1 b 0 z\ne1 f 0 a b 10\nr3 f 0 1\n\
        .subckt twoport in out\nr1 in out 1k\nc1 out 0 1u\n.ends\n\
        .model sw1 sw(vt=0.5)\n.model qp pnp\n.model z d(bv=5)\n.tran 1u 1m\n.end\n";
    let model = Model::parse(text, "words.cir").unwrap();
    let parts = parts(&model);
    let part = |name: &str| {
        parts
            .parts
            .iter()
            .filter(|p| p.name == name)
            .collect::<Vec<_>>()
    };
    assert_eq!(part("v1")[0].value, "10 50Hz");
    assert_eq!(
        part("r1")
            .iter()
            .map(|p| p.value.as_str())
            .collect::<Vec<_>>(),
        ["4k7"]
    );
    assert!(part("r9").is_empty());
    assert_eq!(
        (part("x1")[0].symbol, part("x1")[0].pins.join(" ")),
        (Symbol::Box, "in out".into())
    );
    assert_eq!(
        (part("s1")[0].control.as_str(), part("s1")[0].nets[1]),
        ("v(a,b)", 0)
    );
    assert!(matches!(part("q1")[0].symbol, Symbol::Transistor(kind) if kind.is_p()));
    assert_eq!(part("d1")[0].symbol, Symbol::Zener);
    assert_eq!(part("e1")[0].control, "10·v(a,b)");
    let svg = super::svg(&model, &["d1".into()]).unwrap();
    assert!(svg.contains(super::symbol::LIVE) && svg.contains(">v(a,b)<"));
    assert_eq!(svg, super::svg(&model, &["d1".into()]).unwrap());
    assert!(
        !super::svg(&model, &[])
            .unwrap()
            .contains(super::symbol::LIVE)
    );
}

#[test]
fn circuits_without_a_netlist_and_shorted_elements_are_drawn() {
    let model = Model::parse(
        "t\nv1 a 0 1\nr1 a a 1k\nl1 a 0 1m\nl2 b 0 1m\nk1 l1 l2 0.5\nr2 b 0 1\n.end\n",
        "t.cir",
    )
    .unwrap();
    let built = Model::of_circuit(model.circuit().clone()).unwrap();
    let svg = super::svg(&built, &[]).unwrap();
    for words in [">r1 1 kΩ<", ">1 mH<", ">k1 0.5<"] {
        assert!(svg.contains(words), "{words} in {svg}");
    }
}

#[test]
fn a_long_ladder_is_drawn_and_more_than_anyone_reads_is_not() {
    let ladder = |n: usize| {
        let mut text = String::from("ladder\nv1 1 0 1\n");
        for k in 1..=n {
            text.push_str(&format!("r{k} {k} {} 1\nc{k} {} 0 1u\n", k + 1, k + 1));
        }
        Model::parse(&(text + ".end\n"), "ladder.cir").unwrap()
    };
    assert!(super::svg(&ladder(70), &[]).unwrap().contains(">71<"));
    assert!(matches!(
        super::svg(&ladder(1001), &[]),
        Err(super::PictureError::Large(_))
    ));
}

/// A sheet's picture: everything between the marks of one tag.
fn tags<'a>(svg: &'a str, tag: &'a str) -> impl Iterator<Item = &'a str> {
    svg.split('<').filter(move |own| own.starts_with(tag))
}

#[test]
fn a_schematic_is_drawn_where_it_stands_on_its_sheet() {
    let buck = model("schematics/buck.asc");
    let svg = super::svg(&buck, &[]).unwrap();
    let sheet = buck.netlist().unwrap().sheet.clone().unwrap();
    // Every wire of the sheet is a line of its length, and the first one is where the corner says.
    let lines: Vec<[f64; 4]> = tags(&svg, "path fill=\"none\" d=\"M")
        .filter_map(|path| {
            let numbers = path.split('"').nth(3)?.replace(['M', 'L'], " ");
            let numbers: Vec<f64> = numbers.split(' ').filter_map(|n| n.parse().ok()).collect();
            numbers.try_into().ok()
        })
        .collect();
    let all = sheet.wires.iter().flat_map(|(a, b)| [*a, *b]);
    let all = all.chain(sheet.labels.iter().map(|l| l.0));
    let pins = sheet
        .symbols
        .iter()
        .flat_map(|s| s.pins.iter().map(|p| p.1));
    let spots: Vec<(i64, i64)> = all.chain(pins).collect();
    let corner = |k: fn(&(i64, i64)) -> i64| spots.iter().map(k).min().unwrap();
    let (left, top) = (corner(|p| p.0), corner(|p| p.1));
    let at = |(x, y): (i64, i64)| {
        [
            120.0 + 1.25 * (x - left) as f64,
            76.0 + 1.25 * (y - top) as f64,
        ]
    };
    assert!(sheet.wires.len() > 3);
    for (a, b) in &sheet.wires {
        let [a, b] = [at(*a), at(*b)];
        assert!(lines.contains(&[a[0], a[1], b[0], b[1]]), "{a:?} {b:?}");
    }
    // Of a symbol between two pins the middle is half-way.
    let l1 = sheet.symbols.iter().find(|s| s.name == "l1").unwrap();
    let [a, b] = [at(l1.pins[0].1), at(l1.pins[1].1)];
    let middle = format!(
        "{} {})\"",
        f64::midpoint(a[0], b[0]),
        f64::midpoint(a[1], b[1])
    );
    assert!(svg.contains(&middle), "{middle}");
    assert!(svg.contains(">l1") && svg.contains(">out<"));
    // The same circuit without a sheet has its places found.
    assert_ne!(svg, super::svg(&model("schematics/buck.cir"), &[]).unwrap());
}

#[test]
fn every_schematic_shows_all_its_parts_and_states() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists/schematics");
    let mut n_sheets = 0;
    for file in std::fs::read_dir(folder).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        if !name.ends_with(".asc") || name == "stage.asc" {
            continue;
        }
        n_sheets += 1;
        let model = model(&format!("schematics/{name}"));
        let svg = super::with_both_states(&model).unwrap();
        for part in &parts(&model).parts {
            assert!(svg.contains(&format!(">{}", part.name)), "{name} {part:?}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("built-in"), "{name}");
    }
    assert!(n_sheets >= 10);
}

#[test]
fn devices_have_their_own_names() {
    let drawn = |name: &str| super::svg(&model(name), &[]).unwrap();
    let control = drawn("peak-current.cir");
    for words in [">a1 schmitt<", ">a2 srflop<", ">a3 buf<", ">s<", ">q<"] {
        assert!(control.contains(words), "{words}");
    }
    assert!(!control.contains("built-in"));
    let models = drawn("xspice.cir");
    assert!(models.contains(">again gain<") && !models.contains("built-in"));
}
