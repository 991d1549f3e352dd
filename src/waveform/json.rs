//! Waveforms as one JSON object: `{"schema":"circ-waveforms/1","title":…,"time":[…],"signals":[{"name","unit","values":[…]},…]}`.
//!
//! Numbers print in the shortest form that reads back to the same double.

use std::io::{Read, Write};

use serde::{Deserialize, Serialize};

use super::plot::runs;
use super::{Phasors, Plot, WaveformError, Waveforms, phasors};

const FORMAT: &str = "json";
const SCHEMA: &str = "circ-waveforms/1";

#[derive(Serialize, Deserialize)]
struct File {
    schema: String,
    title: String,
    time: Vec<f64>,
    signals: Vec<Signal>,
}

#[derive(Deserialize)]
struct Schema {
    schema: String,
}

#[derive(Serialize, Deserialize)]
struct Signal {
    name: String,
    unit: String,
    values: Vec<f64>,
}

/// Writes the object and a line end.
///
/// # Errors
/// Those of `to`.
pub fn write(mut to: impl Write, waves: &Waveforms) -> std::io::Result<()> {
    let signals = (0..waves.width())
        .map(|j| Signal {
            name: waves.names[j].clone(),
            unit: waves.units[j].to_owned(),
            values: waves.column(j).collect(),
        })
        .collect();
    let file = File {
        schema: SCHEMA.into(),
        title: waves.title.clone(),
        time: waves.time.clone(),
        signals,
    };
    serde_json::to_writer(&mut to, &file)?;
    to.write_all(b"\n")
}

/// Reads what [`write()`] wrote.
///
/// # Errors
/// [`WaveformError::Malformed`] when a key is missing, the schema is another, or the columns differ in length.
pub fn read(from: impl Read) -> Result<Waveforms, WaveformError> {
    let file: File = serde_json::from_reader(from).map_err(unreadable)?;
    if file.schema != SCHEMA {
        return Err(WaveformError::malformed(
            FORMAT,
            format!("schema `{}`, expected `{SCHEMA}`", file.schema),
        ));
    }
    for signal in &file.signals {
        if signal.values.len() != file.time.len() {
            let reason = format!(
                "{} has {} values for {} times",
                signal.name,
                signal.values.len(),
                file.time.len()
            );
            return Err(WaveformError::malformed(FORMAT, reason));
        }
    }
    let (names, columns): (Vec<_>, Vec<_>) =
        file.signals.into_iter().map(|s| (s.name, s.values)).unzip();
    Ok(Waveforms::from_columns(
        file.title, names, file.time, &columns,
    ))
}

/// Reads a file of waveforms or of phasors, as its schema says.
///
/// # Errors
/// See [`read`].
pub(super) fn plot(bytes: &[u8]) -> Result<Plot, WaveformError> {
    let schema: Schema = serde_json::from_slice(bytes).map_err(unreadable)?;
    if schema.schema == phasors::SCHEMA {
        return Phasors::read_json(bytes).map(Plot::Frequency);
    }
    read(bytes).map(|waves| Plot::Time(runs(&waves)))
}

pub(super) fn unreadable(error: serde_json::Error) -> WaveformError {
    WaveformError::malformed(FORMAT, error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn what_is_written_reads_back_to_the_same_doubles() {
        let mut text = Vec::new();
        write(&mut text, &sample()).unwrap();
        assert_eq!(read(&text[..]).unwrap(), sample());
    }

    #[test]
    fn columns_of_another_length_are_refused() {
        let text = r#"{"schema":"circ-waveforms/1","title":"","time":[0,1],"signals":[{"name":"v(a)","unit":"V","values":[1]}]}"#;
        let error = read(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            error,
            "not a json file of waveforms: v(a) has 1 values for 2 times"
        );
        assert!(read(text.replace("/1", "/2").as_bytes()).is_err());
    }
}
