//! The table of means, extrema and powers in words.

use super::{si, table};
use crate::analysis::{DeviceLosses, Mean, SignalMeans, Switching, Table, Throughput};

/// Digits shown.
const DIGITS: usize = 4;

/// Of the largest voltage or current of a table, what is shown as 0: the rounding of a difference.
const INVISIBLE: f64 = 1e-13;

impl Table {
    /// A table of the elements, one of the signals shown, and powers.
    #[must_use]
    pub fn words(&self) -> String {
        let largest = |means: &mut dyn Iterator<Item = &Mean>| {
            means.fold(0.0, |most: f64, mean| {
                most.max(mean.min.abs()).max(mean.max.abs())
            })
        };
        let volts = largest(&mut self.elements.iter().map(|element| &element.v));
        let amperes = largest(&mut self.elements.iter().map(|element| &element.i));
        let quantity = |x: f64, unit: &str| {
            let scale = match unit {
                "V" => volts,
                "A" => amperes,
                _ => volts * amperes,
            };
            let x = if x.abs() < INVISIBLE * scale { 0.0 } else { x };
            si::quantity(x, unit, DIGITS)
        };
        let cells = |mean: &Mean, unit: &str| {
            [mean.mean, mean.rms, mean.min, mean.max].map(|x| quantity(x, unit))
        };
        let elements = self.elements.iter().map(|element| {
            let mut row = vec![element.name.clone()];
            row.extend(cells(&element.i, "A"));
            row.extend(cells(&element.v, "V"));
            row.push(quantity(element.power, "W"));
            row
        });
        let header = [
            "element", "i mean", "i rms", "i min", "i max", "v mean", "v rms", "v min", "v max",
            "power",
        ];
        let rows: Vec<Vec<String>> = elements.collect();
        let mut text = format!(
            "from {} to {}{}:\n{}",
            si::quantity(self.span.from, "s", 6),
            si::quantity(self.span.to, "s", 6),
            if self.exact { "" } else { ", from steps" },
            table::aligned(&header, &rows)
        );
        let signals = self.signals.iter().map(|signal| {
            let SignalMeans {
                name,
                unit,
                value,
                ripple,
                thd,
            } = signal;
            let mut row = vec![name.clone()];
            row.extend(cells(value, unit));
            row.push(quantity(*ripple, unit));
            row.push(thd.map_or("-".into(), |thd| {
                format!("{} %", si::plain(100.0 * thd, DIGITS))
            }));
            row
        });
        let rows: Vec<Vec<String>> = signals.collect();
        let thd = self.fundamental.map_or("thd".into(), |f| {
            format!("thd at {}", si::quantity(f, "Hz", DIGITS))
        });
        let header = ["signal", "mean", "rms", "min", "max", "ripple", &thd];
        text.push_str(&table::aligned(&header, &rows));
        text.push_str(&self.losses());
        let Throughput {
            input,
            output,
            efficiency,
            inputs,
            outputs,
            switching,
            efficiency_with_switching,
        } = &self.power;
        let of = |names: &[String]| match names {
            [] => String::new(),
            names => format!(" ({})", names.join(", ")),
        };
        text.push_str(&format!(
            "power: input {}{}",
            si::quantity(*input, "W", DIGITS),
            of(inputs)
        ));
        if !outputs.is_empty() {
            let output = si::quantity(*output, "W", DIGITS);
            text.push_str(&format!(", output {output}{}", of(outputs)));
        }
        if let Some(efficiency) = efficiency {
            let percent = si::plain(100.0 * efficiency, DIGITS);
            text.push_str(&format!(", efficiency {percent} %"));
        } else if outputs.is_empty() {
            text.push_str("; `--out` with the names of loads adds output and efficiency");
        }
        if let Some(switching) = switching {
            let switching = si::quantity(*switching, "W", DIGITS);
            text.push_str(&format!("; switching {switching}"));
        }
        if let Some(efficiency) = efficiency_with_switching {
            let percent = si::plain(100.0 * efficiency, DIGITS);
            text.push_str(&format!(", efficiency with it {percent} %"));
        }
        text.push('\n');
        text
    }

    /// A table of the devices with losses of their own or a way of their heat, and one of the temperatures of the network.
    fn losses(&self) -> String {
        let devices = self.elements.iter();
        let devices: Vec<(&str, &DeviceLosses)> = devices
            .filter_map(|element| Some((element.name.as_str(), element.losses.as_ref()?)))
            .collect();
        if devices.is_empty() {
            return String::new();
        }
        let changes = |changes: &Option<Switching>| match changes {
            Some(Switching { count, energy }) => {
                format!(
                    "{count} · {}",
                    si::quantity(*energy / (*count).max(1) as f64, "J", DIGITS)
                )
            }
            None => "-".into(),
        };
        let watts = |power: f64| si::quantity(power, "W", DIGITS);
        let celsius = |t: f64| format!("{} °C", si::plain(t, DIGITS));
        let rows = devices.iter().map(|(name, losses)| {
            vec![
                (*name).to_owned(),
                changes(&losses.on),
                changes(&losses.off),
                changes(&losses.recovery),
                watts(losses.conduction),
                watts(losses.switching),
                watts(losses.total),
                losses.temperature.map_or("-".into(), celsius),
            ]
        });
        let rows: Vec<Vec<String>> = rows.collect();
        let header = [
            "device",
            "turns on",
            "turns off",
            "recovers",
            "conduction",
            "switching",
            "losses",
            "junction",
        ];
        let mut text = table::aligned(&header, &rows);
        if !self.temperatures.is_empty() {
            let nodes = self.temperatures.iter();
            let nodes: Vec<String> = nodes
                .map(|(node, t)| format!("{node} {}", celsius(*t)))
                .collect();
            text.push_str(&format!("thermal network: {}\n", nodes.join(", ")));
        }
        text
    }
}
