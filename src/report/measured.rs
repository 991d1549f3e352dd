//! What `.meas` and `.four` found: in words as ngspice prints them, and for JSON.

use serde_json::{Map, Value, json};

use super::table;
use crate::analysis::Measurements;
use crate::circuit::{Harmonics, Measured};

impl Measurements {
    /// One line per measurement, a table per Fourier analysis; a measurement without a value says why.
    #[must_use]
    pub fn words(&self) -> String {
        let mut text = String::new();
        for Measured { name, result } in &self.measured {
            match result {
                Ok(found) => {
                    text.push_str(&format!("{name:<20}=  {}", exponent(found.value)));
                    for (what, t) in &found.at {
                        text.push_str(&format!(" {what}=  {}", exponent(*t)));
                    }
                }
                Err(why) => text.push_str(&format!("{name:<20} failed: {why}")),
            }
            text.push('\n');
        }
        for analysis in &self.harmonics {
            text.push_str(&harmonics(analysis));
        }
        if let Some(table) = &self.table {
            text.push_str(&table.words());
        }
        for worst in &self.worst {
            text.push_str(&worst.words());
        }
        text
    }

    /// `"measurements"` and `"fourier"` of a summary.
    #[must_use]
    pub fn json(&self) -> (Vec<Value>, Vec<Value>) {
        let measured = self.measured.iter().map(|Measured { name, result }| {
            let mut entry = Map::from_iter([("name".into(), Value::from(name.as_str()))]);
            match result {
                Ok(found) => {
                    entry.insert("value".into(), found.value.into());
                    entry.extend(found.at.iter().map(|&(k, t)| (k.to_string(), t.into())));
                }
                Err(why) => {
                    entry.insert("value".into(), Value::Null);
                    entry.insert("error".into(), why.to_string().into());
                }
            }
            Value::Object(entry)
        });
        let fourier = self.harmonics.iter().map(|analysis| {
            let Harmonics {
                signal, frequency, ..
            } = analysis;
            match &analysis.result {
                Ok(spectrum) => {
                    let harmonics = spectrum.harmonics.iter().map(|h| {
                        json!({"frequency": h.frequency, "magnitude": h.magnitude, "phase": h.phase})
                    });
                    json!({"signal": signal, "frequency": frequency, "mean": spectrum.mean,
                        "thd": spectrum.thd, "harmonics": harmonics.collect::<Vec<_>>()})
                }
                Err(why) => json!({"signal": signal, "frequency": frequency, "error": why.to_string()}),
            }
        });
        (measured.collect(), fourier.collect())
    }
}

/// ngspice's table of harmonics, and the total harmonic distortion.
fn harmonics(analysis: &Harmonics) -> String {
    let Harmonics {
        signal, frequency, ..
    } = analysis;
    let spectrum = match &analysis.result {
        Ok(spectrum) => spectrum,
        Err(why) => return format!("Fourier analysis for {signal} failed: {why}\n"),
    };
    let thd = match spectrum.thd {
        Some(thd) => format!("{:.6} %", 100.0 * thd),
        None => "none (no fundamental)".into(),
    };
    let first = spectrum.harmonics.first();
    let mut rows = vec![[0.0, spectrum.mean, 0.0, 0.0, 0.0]];
    for harmonic in &spectrum.harmonics {
        let (unit, zero) = first.map_or((0.0, 0.0), |first| (first.magnitude, first.phase));
        let relative = if unit > 0.0 {
            harmonic.magnitude / unit
        } else {
            0.0
        };
        rows.push([
            harmonic.frequency,
            harmonic.magnitude,
            harmonic.phase,
            relative,
            harmonic.phase - zero,
        ]);
    }
    let rows: Vec<Vec<String>> = (0..)
        .zip(rows)
        .map(|(k, row)| {
            let cells = row.map(|x| super::si::plain(x, 6));
            std::iter::once(k.to_string()).chain(cells).collect()
        })
        .collect();
    let header = [
        "harmonic",
        "frequency",
        "magnitude",
        "phase",
        "norm. mag",
        "norm. phase",
    ];
    format!(
        "Fourier analysis for {signal} at {frequency} Hz: THD {thd}\n{}",
        table::aligned(&header, &rows)
    )
}

/// 7 significant digits as C prints them: `1.234560e+00`.
fn exponent(x: f64) -> String {
    let text = format!("{x:.6e}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let (sign, digits) = match exponent.strip_prefix('-') {
                Some(digits) => ('-', digits),
                None => ('+', exponent),
            };
            format!("{mantissa}e{sign}{digits:0>2}")
        }
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Found, Harmonic, MeasureError, Spectrum};

    fn sample() -> Measurements {
        let found = Found {
            value: -2.5e-3,
            at: vec![("from", 0.0), ("to", 1e-3)],
        };
        let harmonic = |k: f64, magnitude| Harmonic {
            frequency: 50.0 * k,
            magnitude,
            phase: 10.0 * k,
        };
        Measurements {
            measured: vec![
                Measured {
                    name: "ripple".into(),
                    result: Ok(found),
                },
                Measured {
                    name: "late".into(),
                    result: Err(MeasureError::NoCrossing {
                        level: 5.0,
                        found: 0,
                    }),
                },
            ],
            harmonics: vec![Harmonics {
                signal: "v(out)".into(),
                frequency: 50.0,
                result: Ok(Spectrum {
                    mean: 1.0,
                    harmonics: vec![harmonic(1.0, 4.0), harmonic(2.0, 0.1)],
                    thd: Some(0.025),
                }),
            }],
            table: None,
            ..Measurements::default()
        }
    }

    #[test]
    fn words() {
        insta::assert_snapshot!(sample().words(), @r"
        ripple              =  -2.500000e-03 from=  0.000000e+00 to=  1.000000e-03
        late                 failed: the value 5 is not crossed
        Fourier analysis for v(out) at 50 Hz: THD 2.500000 %
        harmonic  frequency  magnitude  phase  norm. mag  norm. phase
        0                 0          1      0          0            0
        1                50          4     10          1            0
        2               100        0.1     20      0.025           10
        ");
    }

    #[test]
    fn json() {
        let (measured, fourier) = sample().json();
        insta::assert_snapshot!(super::super::json::line(&(measured, fourier)), @r#"[[{"from":0.0,"name":"ripple","to":0.001,"value":-0.0025},{"error":"the value 5 is not crossed","name":"late","value":null}],[{"frequency":50.0,"harmonics":[{"frequency":50.0,"magnitude":4.0,"phase":10.0},{"frequency":100.0,"magnitude":0.1,"phase":20.0}],"mean":1.0,"signal":"v(out)","thd":0.025}]]"#);
    }
}
