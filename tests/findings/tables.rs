//! Means, powers and distortions of tables.

use circ::Model;
use circ::analysis::{PeriodicOptions, Table, TableOptions, periodic_table, table, transient};

use super::*;

/// The model of `tests/findings/NAME.cir` with text replaced.
fn model(name: &str, replacements: &[(&str, &str)]) -> Model {
    let mut text = std::fs::read_to_string(path(name)).expect("a netlist");
    for (from, to) in replacements {
        assert!(text.contains(from), "{name} has no `{from}`");
        text = text.replace(from, to);
    }
    Model::parse(&text, name).unwrap_or_else(|e| panic!("{name}: {e:?}"))
}

fn transient_of(model: &Model) -> Table {
    table(model, &TableOptions::default()).expect("a table")
}

fn orbit_of(model: &Model) -> Table {
    periodic_table(model, (&[], &[]), &PeriodicOptions::default()).expect("a table")
}

/// The distortion of a signal.
fn distortion(table: &Table, name: &str) -> Option<f64> {
    table.signal(name).expect(name).thd
}

/// A window of other than one period gave a sine 3 % and a constant 0 %.
#[test]
fn distortions_in_steps_are_those_of_one_period_whatever_the_print_step() {
    for step in ["10u", "1u", "0.1u"] {
        let model = model(
            "distortion_in_steps",
            &[(".tran 10u", &format!(".tran {step}"))],
        );
        let table = transient_of(&model);
        assert!(!table.exact);
        let fourier = transient(&model, SimOptions::default())
            .run
            .expect("a run")
            .1
            .harmonics;
        let of = |name: &str| {
            let found = fourier.iter().find(|found| found.signal == name);
            found.expect(name).result.as_ref().expect(name).thd
        };
        assert_eq!((distortion(&table, "v(five)"), of("v(five)")), (None, None));
        assert!(distortion(&table, "v(in)").expect("a sine") < 1e-4);
        // `.four` leaves out what is above its twentieth harmonic.
        let [all, some] = [distortion(&table, "v(a)"), of("v(a)")].map(|thd| thd.expect("v(a)"));
        assert!((all / some - 1.0).abs() < 3e-3, "{step}: {all} {some}");
    }
}

/// The table of a transient of these cards.
fn table_of(cards: &str) -> Table {
    let model = Model::parse(&format!("table\n{cards}"), "table.cir");
    transient_of(&model.expect("a circuit"))
}

/// A buck from 24 V, whose switch or choke is given.
fn buck(switch: &str, choke: &str, shown: &str) -> String {
    format!(
        "v1 in 0 24\nvg g sw pulse(0 10 0 0 0 4u 10u)\n{switch}\nd1 0 sw dd\n{choke}\nc1 out 0 10u ic=9.6 rpar=1meg\nr1 out 0 5\n\
         .model dd d(ron=10m vfwd=0.5)\n.tran 0.1u 100u uic\n.save v(out) {shown}\n"
    )
}

const LINEAR: &str = "l1 sw out 100u ic=2";
const MOSFET: &str = "m1 in g sw sw nm\n.model nm nmos(vto=2 ron=50m)";

fn near(found: f64, truth: f64) {
    assert!((found / truth - 1.0).abs() < 1e-9, "{found:e} {truth:e}");
}

/// A transistor, a saturable inductor and a leak of a capacitor took the output; a source kept what its resistance takes.
#[test]
fn powers_are_those_of_rows_and_loads_are_what_takes_power() {
    let saturable = "l1 sw out flux=pwl(x,-3,-210u,-2,-200u,2,200u,3,210u) ic=2";
    for (choke, shown) in [(LINEAR, "i(l1) i(m1)"), (saturable, "i(l1)"), (LINEAR, "")] {
        let table = table_of(&buck(MOSFET, choke, shown));
        assert_eq!(table.power.outputs, ["r1"], "{choke}");
        near(table.power.output, table.element("r1").expect("r1").power);
    }
    let switch = "s1 in sw g sw sm\n.model sm sw(vt=5 ron=10m roff=1meg vh=-2)";
    for cards in [
        buck(switch, LINEAR, "i(s1)"),
        "v1 in 0 10\nq1 in b out nq\nrb in b 100\nr1 out 0 5\n.model nq npn\n.tran 1m\n.save v(out) i(q1)\n".into(),
    ] {
        assert_eq!(table_of(&cards).power.outputs, ["r1"], "{cards}");
    }
    let source = table_of("v1 in 0 10 rser=1\nr1 in 0 4\n.tran 1m\n.save i(r1)\n");
    near(source.power.input, 16.0);
    near(source.power.efficiency.expect("a load"), 1.0);
    // Whoever names a transistor has all that it takes.
    let model = Model::parse(&format!("t\n{}", buck(MOSFET, LINEAR, "")), "t.cir");
    let options = TableOptions {
        outputs: vec!["m1".into()],
        ..TableOptions::default()
    };
    let table = table(&model.expect("a circuit"), &options).expect("a table");
    near(table.power.output, table.element("m1").expect("m1").power);
    assert!(table.power.output > 1e-3);
}

/// Beside the current of a thyristor's anode stood the voltage of its gate, beside that of a collector the base's.
#[test]
fn a_row_has_the_voltage_between_the_terminals_of_its_current() {
    let gated = "v1 in 0 sin(0 100 50)\nvg g k pulse(0 2 5m 0 0 1m 20m)\nx1 in g k q1\nr1 k 0 10\n.tran 10u 20m\n.save v(in,k)\n";
    let switched =
        "v1 in 0 10\nvg g 0 pulse(0 10 0 0 0 4u 10u)\nrl in d 10\n.tran 0.1u 100u\n.save v(d)\n";
    for (cards, device, across) in [
        (
            format!("{gated}.model q1 scr(vgt=0.7 igt=10m vfwd=1 ron=10m)\n"),
            "x1",
            "v(in,k)",
        ),
        (
            format!("{gated}.model q1 scr(vgt=0.7 igt=10m roff=1meg)\n"),
            "x1",
            "v(in,k)",
        ),
        (
            format!("{gated}.model q1 triac(vgt=0.7 igt=10m)\n"),
            "x1",
            "v(in,k)",
        ),
        (
            format!("{switched}q1 d b 0 nq\nrb g b 1k\n.model nq npn(bf=50 rc=1 re=1)\n"),
            "q1",
            "v(d)",
        ),
        (
            format!("{switched}z1 d g 0 nz\n.model nz nigbt(vto=5 ron=40m)\n"),
            "z1",
            "v(d)",
        ),
        (
            format!("{switched}m1 d g 0 0 nm\n.model nm nmos(vto=2 ron=50m)\n"),
            "m1",
            "v(d)",
        ),
        (
            format!("{switched}s1 d 0 g 0 sm\n.model sm sw(vt=5 ron=10m roff=1meg vh=-2)\n"),
            "s1",
            "v(d)",
        ),
    ] {
        let table = table_of(&cards);
        let (row, shown) = (
            table.element(device).expect(device),
            table.signal(across).expect(across),
        );
        assert_eq!(row.v, shown.value, "{cards}");
    }
}

/// A saturable inductor's auxiliary state stood for it.
#[test]
fn what_a_saturable_inductor_gives_is_stored_energy() {
    let table = table_of(
        "v1 in 0 24\nl1 in out flux=pwl(x,-3,-300u,-2,-200u,2,200u,3,210u) ic=50\nc1 out 0 10u ic=24\nr1 out 0 1\n.tran 0.1u 100u uic\n.save v(out)\n",
    );
    let power = |name: &str| table.element(name).expect(name).power;
    let share = (power("l1") + power("c1")) / table.power.input;
    assert!(share < -0.1, "{share}");
    let text = format!("{:.1} % of the input came out of", -100.0 * share);
    let told = |note: &circ::integrate::Note| note.text.starts_with(&text);
    assert!(table.notes.iter().any(told), "{text}: {:?}", table.notes);
}

/// The waves of a line counted as sources, and an amplifier did not.
#[test]
fn inputs_are_what_delivers_power() {
    let line = "v1 in 0 sin(0 10 1meg)\nrs in a 50\nt1 a 0 b 0 z0=50 td=100n\nrl b 0 50\n.tran 5n 20u 1u\n.save v(b)\n";
    let table = table_of(line);
    assert_eq!(table.power.inputs, ["v1"]);
    assert!((table.power.efficiency.expect("a load") - 0.5).abs() < 1e-3);
    let amplifier = "v1 in 0 sin(0 1 1k)\nr1 in 0 1k\ne1 out 0 in 0 10\nrl out 0 10\n.tran 1u 2m\n.save v(out) i(e1)\n";
    let table = table_of(amplifier);
    assert_eq!(table.power.inputs, ["v1", "e1"]);
    near(table.power.efficiency.expect("a load"), 5.0 / 5.0005);
    // An ideal transformer delivers what it takes, and a load is one.
    let transformer = "v1 in 0 sin(0 1 1k)\nf1 in 0 e1 -2\ne1 out 0 in 0 2\nrl out 0 10\n.tran 1u 2m\n.save v(out)\n";
    let table = table_of(transformer);
    assert_eq!(table.power.inputs, ["v1"]);
    near(table.power.efficiency.expect("a load"), 1.0);
}

/// √(π²/8 − 1) of a square wave, however small on its mean: the difference of squares left 0 % of 1 µV on 400 V, and 66 % of 10 µV.
#[test]
fn a_ripple_has_its_distortion_on_a_large_mean() {
    let truth = (std::f64::consts::PI.powi(2) / 8.0 - 1.0).sqrt();
    for volts in ["1u", "10u", "1m", "1"] {
        let cards = format!(
            "v0 a 0 400\nv1 b a pulse(-{volts} {volts} 0 0 0 5m 10m)\nr1 b 0 1k\n.tran 0.1m 50m\n.save v(b)\n"
        );
        let table = table_of(&cards);
        assert!(table.exact);
        let found = distortion(&table, "v(b)").expect("a fundamental");
        assert!(
            (found / truth - 1.0).abs() < 1e-6,
            "{volts}: {found} {truth}"
        );
    }
}

/// A charge pump's switch has impulses of current: `0 %`, as they are in the mean and not in the square.
#[test]
fn what_has_impulses_has_no_distortion() {
    let pump = "v1 in 0 5\nvg g 0 pulse(0 1 0 0 0 5u 10u)\neg gn 0 value={1-v(g)}\ns1 in a g 0 sp\ns2 a out gn 0 sp\nc1 a 0 1u\nc2 out 0 4.7u\nr1 out 0 100\n\
        .model sp sw(ideal vt=0.5)\n.tran 0.1u 100u\n.save v(out) i(s2)\n";
    let table = orbit_of(&Model::parse(&format!("pump\n{pump}"), "pump.cir").expect("a circuit"));
    assert_eq!(distortion(&table, "i(s2)"), None);
    assert!(distortion(&table, "v(out)").expect("a ripple") > 0.5);
    let note = table
        .notes
        .iter()
        .find(|note| note.code == "squares-of-impulses");
    assert!(
        note.expect("a note")
            .text
            .contains("no distortion of i(s2), ")
    );
}

/// Beyond 1000 % stood the `-` of what has no fundamental.
#[test]
fn short_pulses_have_a_distortion_of_more_than_1000_percent() {
    let table = table_of(
        "v1 in 0 pulse(0 10 0 10n 10n 37u 100u)\nc1 in sn 1n\nr1 sn 0 100\n.tran 1u 1m\n.save v(sn)\n",
    );
    let percent = 100.0 * distortion(&table, "v(sn)").expect("a fundamental");
    assert!(percent > 1000.0);
    assert!(
        table.words().contains(&format!(" {percent:.0} %\n")),
        "{}",
        table.words()
    );
}
