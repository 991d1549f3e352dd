//! The table of means, extrema and powers in words.

use super::{si, table};
use crate::analysis::{Mean, SignalMeans, Table, Throughput};

/// Digits shown.
const DIGITS: usize = 4;

impl Table {
    /// A table of the elements, one of the signals shown, and powers.
    #[must_use]
    pub fn words(&self) -> String {
        let cells = |mean: &Mean, unit: &str| {
            [mean.mean, mean.rms, mean.min, mean.max].map(|x| si::quantity(x, unit, DIGITS))
        };
        let elements = self.elements.iter().map(|element| {
            let mut row = vec![element.name.clone()];
            row.extend(cells(&element.i, "A"));
            row.extend(cells(&element.v, "V"));
            row.push(si::quantity(element.power, "W", DIGITS));
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
            row.push(si::quantity(*ripple, unit, DIGITS));
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
        let Throughput {
            input,
            output,
            efficiency,
            inputs,
            outputs,
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
        }
        text.push('\n');
        text
    }
}
