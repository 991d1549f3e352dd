//! What `.meas` and `.four` found, in the form of LTspice's log, which spicelib and PyLTSpice read.
//!
//! One run: `top=1.5 FROM 0 TO 0.001`, `half=0.5 at 0.0007`. Runs of `.step`: a line `.step r=1000` for each, then a table for each measurement with
//! columns apart by tabs. Numbers are the shortest decimals that give the same doubles.

use super::steps::Step;
use crate::analysis::Measurements;
use crate::circuit::{Harmonics, Measured};
use crate::measure::{Found, Harmonic, Spectrum};

/// Of one run.
#[must_use]
pub fn run(found: &Measurements) -> String {
    let measured = found.measured.iter().map(line);
    let fourier = found.harmonics.iter().map(fourier);
    measured.chain(fourier).collect()
}

/// Of the runs of `.step`.
#[must_use]
pub fn steps(steps: &[Step]) -> String {
    let mut text = String::new();
    for step in steps {
        text += ".step";
        for (name, value) in &step.values {
            text += &format!(" {name}={value:e}");
        }
        text.push('\n');
        for analysis in &step.found.harmonics {
            text += &fourier(analysis);
        }
    }
    let names = steps.first().map_or(&[][..], |step| &step.found.measured);
    for (k, Measured { name, .. }) in names.iter().enumerate() {
        let rows = || {
            let number = steps.iter().zip(1..);
            number.map(|(step, number)| (number, &step.found.measured[k].result))
        };
        let found = rows().find_map(|(_, result)| result.as_ref().ok());
        let Some(places) = found.map(places) else {
            text += &format!("Measurement \"{name}\" FAIL'ed\n");
            continue;
        };
        let heads = places.iter().map(|(head, _)| format!("\t{head}"));
        text += &format!(
            "Measurement: {name}\n  step\t{name}{}\n",
            heads.collect::<String>()
        );
        for (number, result) in rows() {
            let cells = match result {
                Ok(found) => {
                    let at = self::places(found).into_iter().map(|(_, t)| t);
                    let cells = std::iter::once(found.value).chain(at);
                    cells.map(|x| format!("\t{x:e}")).collect::<String>()
                }
                Err(_) => "\tnan".repeat(1 + places.len()),
            };
            text += &format!("  {number:>4}{cells}\n");
        }
    }
    text
}

fn line(measured: &Measured) -> String {
    let name = &measured.name;
    match &measured.result {
        Ok(found) => {
            let places = places(found)
                .into_iter()
                .map(|(head, t)| format!(" {head} {t:e}"));
            format!("{name}={:e}{}\n", found.value, places.collect::<String>())
        }
        Err(why) => format!("Measurement \"{name}\" FAIL'ed: {why}\n"),
    }
}

/// The interval or the time under LTspice's names.
fn places(found: &Found) -> Vec<(&'static str, f64)> {
    let head = |name| match name {
        "from" | "trig" => "FROM",
        "to" | "targ" => "TO",
        other => other,
    };
    found.at.iter().map(|&(name, t)| (head(name), t)).collect()
}

fn fourier(analysis: &Harmonics) -> String {
    let Harmonics { signal, result, .. } = analysis;
    let Spectrum {
        mean,
        harmonics,
        thd,
    } = match result {
        Ok(spectrum) => spectrum,
        Err(why) => return format!("Fourier analysis of {signal} failed: {why}\n"),
    };
    let mut text = format!("N-Period=1\nFourier components of {signal}\nDC component:{mean:e}\n\n");
    text += "Harmonic\tFrequency\t Fourier \tNormalized\t Phase  \tNormalized\n";
    text += " Number \t  [Hz]   \tComponent\t Component\t[degree]\tPhase [deg]\n";
    let (unit, zero) = harmonics
        .first()
        .map_or((0.0, 0.0), |h| (h.magnitude, h.phase));
    for (number, harmonic) in (1..).zip(harmonics) {
        let Harmonic {
            frequency,
            magnitude,
            phase,
        } = harmonic;
        let relative = if unit > 0.0 { magnitude / unit } else { 0.0 };
        let shift = phase - zero;
        text += &format!(
            "{number:>5}\t{frequency:e}\t{magnitude:e}\t{relative:e}\t{phase:.6}°\t{shift:.6}°\n"
        );
    }
    if let Some(thd) = thd {
        text += &format!("Total Harmonic Distortion: {:.6}%\n", 100.0 * thd);
    }
    text + "\n"
}
