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
