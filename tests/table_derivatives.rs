//! Derivatives of the entries of tables: against differences of tables, which are made in another way.
#![allow(missing_docs, reason = "tests")]

use std::collections::BTreeMap;

use circ::Model;
use circ::analysis::{
    Mean, PeriodicOptions, Sensitivity, SensitivityOptions, Table, TableOptions, periodic_table,
    sensitivity, table,
};

/// The table of a model with one value changed, by the names that its entries have where they are differentiated.
fn entries(model: &Model, change: Option<(&str, f64)>, steady: bool) -> BTreeMap<String, f64> {
    let mut model = model.clone();
    if let Some((name, value)) = change {
        model.set(name, value).expect("a value");
    }
    let found = if steady {
        periodic_table(&model, (&[], &[]), &PeriodicOptions::default())
    } else {
        table(&model, &TableOptions::default())
    };
    let Table {
        elements,
        signals,
        power,
        exact,
        temperatures,
        ..
    } = found.expect("a table");
    assert!(exact);
    let mut all = BTreeMap::new();
    let mut mean = |name: String, of: Mean| {
        for (entry, value) in [
            ("mean", of.mean),
            ("rms", of.rms),
            ("min", of.min),
            ("max", of.max),
        ] {
            all.insert(format!("table.{name}.{entry}"), value);
        }
    };
    for element in &elements {
        mean(format!("{}.i", element.name), element.i);
        mean(format!("{}.v", element.name), element.v);
    }
    for signal in &signals {
        mean(format!("probes.{}", signal.name), signal.value);
    }
    for element in &elements {
        all.insert(format!("table.{}.power", element.name), element.power);
        if let Some(losses) = &element.losses {
            let name = format!("table.{}.losses", element.name);
            all.insert(format!("{name}.conduction"), losses.conduction);
            all.insert(format!("{name}.switching"), losses.switching);
            all.insert(format!("{name}.total"), losses.total);
            let temperature = losses
                .temperature
                .map(|t| (format!("{name}.temperature"), t));
            all.extend(temperature);
        }
    }
    for signal in &signals {
        let name = format!("table.probes.{}", signal.name);
        all.insert(format!("{name}.ripple"), signal.ripple);
        all.extend(signal.thd.map(|thd| (format!("{name}.thd"), thd)));
    }
    for (node, value) in temperatures {
        all.insert(format!("table.part.temperatures.{node}"), value);
    }
    for (name, value) in [
        ("input", Some(power.input)),
        ("output", Some(power.output)),
        ("efficiency", power.efficiency),
        ("switching", power.switching),
        ("efficiency_with_switching", power.efficiency_with_switching),
    ] {
        all.extend(value.map(|value| (format!("table.power.{name}"), value)));
    }
    all
}

fn found(text: &str, steady: bool, to: &[&str]) -> (Model, Sensitivity) {
    let model = Model::parse(text, "t.cir").expect("a circuit");
    let options = SensitivityOptions {
        table: true,
        steady,
        to: to.iter().map(|name| (*name).to_owned()).collect(),
        ..SensitivityOptions::default()
    };
    let found = sensitivity(&model, &options).expect("derivatives");
    (model, found)
}

/// All entries are there with their values, and p ∂J/∂p is the extrapolated difference of tables to 1e-6 of what is largest of the quantity.
fn agree(text: &str, steady: bool, to: &[&str]) {
    let (model, found) = found(text, steady, to);
    assert!(found.exact, "{:?}", found.notes);
    let own = entries(&model, None, steady);
    let names: Vec<&String> = own.keys().collect();
    let mut there: Vec<&String> = found.of.iter().map(|gradient| &gradient.name).collect();
    there.sort_unstable();
    assert_eq!(names, there);
    let sized = |name: &str| {
        let (whole, _) = name.rsplit_once('.').expect("an entry");
        let alike = own.iter().filter(|(other, _)| other.starts_with(whole));
        alike.fold(own[name].abs(), |m, (_, value)| m.max(value.abs()))
    };
    for gradient in &found.of {
        let value = gradient.value.as_ref().expect("a value");
        let size = sized(&gradient.name);
        let off = (value - own[&gradient.name]).abs();
        assert!(off <= 1e-9 * size, "{} {value:e}\n{text}", gradient.name);
    }
    for (k, (name, value)) in found.at.iter().enumerate() {
        let step = 1e-4;
        let at = |steps: f64| {
            let change = (name.as_str(), value * (1.0 + steps * step));
            entries(&model, Some(change), steady)
        };
        let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(at);
        for gradient in &found.of {
            let entry = &gradient.name;
            // The largest drop of a diode in series whose current is next to none is reached again and again.
            if entry.starts_with("table.z") && entry.ends_with(".v.max") {
                continue;
            }
            let truth = (8.0 * (c[entry] - b[entry]) - (d[entry] - a[entry])) / (12.0 * step);
            let (_, derivative) = &gradient.to[k];
            let derivative = derivative.expect("a derivative") * value;
            let size = sized(entry).max(truth.abs());
            assert!(
                (derivative - truth).abs() <= 1e-6 * size,
                "{entry} to {name}: {derivative:e}, by differences {truth:e}, of {size:e}\n{text}"
            );
        }
    }
}

const BUCK: &str = "buck\nvin in 0 24\ns1 in sw gate 0 gated\nd1 0 sw di\nl1 sw out 47u\nc1 out 0 5u\nrload out 0 LOAD\nvg gate 0 pulse(0 1 0 10n 10n 3.99u 10u)\n\
    .model gated sw(vt=0.5 vh=0 ron=50m roff=10meg)\n.model di d(ron=20m roff=1meg vfwd=0.5)\n.tran 1u 1m uic\n.save v(out) i(l1)\n.end\n";

#[test]
fn a_buck_that_repeats() {
    agree(&BUCK.replace("LOAD", "5"), true, &[]);
    agree(&BUCK.replace("LOAD", "20"), true, &[]);
}

/// Inputs with parts, and a controlled source among them.
#[test]
fn an_amplifier() {
    let text = "amplifier\nv1 in 0 sin(1 1 1k) rser=10\nr1 in 0 1k\ne1 out 0 in 0 10\nrl out o 10\nl1 o 0 10m\n.tran 1u 2m\n.save i(rl)\n.end\n";
    agree(text, false, &["r1", "rl"]);
}

#[test]
fn a_rectifier_that_starts() {
    let text = "rectifier\nv1 1 0 sin(0 20 1k)\nr1 1 2 0.5\nl1 2 3 100u\nd1 3 4 di\nd2 5 3 di\nd3 0 4 di\nd4 5 0 di\nc1 4 5 100u ic=5\nrl 4 5 10\n.model di d(ron=50m roff=1meg vfwd=0.6)\n\
        .tran 10u 2.7m 0.3m uic\n.save v(4,5) i(rl) v(2)\n.end\n";
    agree(text, false, &[]);
}

/// Losses of switching and temperatures come from tables beside; the rest does not.
#[test]
fn an_inverter_with_losses() {
    let text = include_str!("../netlists/inverter-losses.cir")
        .replace("-1 1 0 100u 99.9u 0.1u 200u", "-1 1 0 500u 499.9u 0.1u 1m");
    agree(&text, true, &["l1", "r1", "vp"]);
}

#[test]
fn names_that_are_no_entries() {
    let model = Model::parse(&BUCK.replace("LOAD", "5"), "t.cir").expect("a circuit");
    let refused = |of: &str, table: bool| {
        let options = SensitivityOptions {
            of: vec![of.into()],
            table,
            ..SensitivityOptions::default()
        };
        let refused = sensitivity(&model, &options).expect_err("no such entry");
        refused.to_string()
    };
    assert!(refused("table.l9.i.rms", true).contains("no entry of the table"));
    assert!(refused("table.l1.i.rms", false).contains("no measurement"));
}
