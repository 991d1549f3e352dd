//! Named complex columns over frequency, and the files they are written to.

use std::borrow::Cow;
use std::io::{Seek, Write};

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::{WaveformError, csv, json, npz, raw, unit_of};

/// Responses to small sines: one frequency column and one complex column per signal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Phasors {
    /// The netlist's title.
    pub title: String,
    /// Column names: `v(out)`, `v(out)@-1` of a sideband, `v(a)/v(b)`.
    pub names: Vec<String>,
    /// Column units: `V` or `A` for each of the sources' `AC` unit, empty for a ratio.
    pub units: Vec<&'static str>,
    /// Hz.
    pub frequency: Vec<f64>,
    /// Row-major values: `values[k * names.len() + j]` is column j at `frequency[k]`.
    pub values: Vec<Complex<f64>>,
}

pub(super) const SCHEMA: &str = "circ-phasors/1";

/// The object of [`Phasors::write_json`].
#[derive(Serialize, Deserialize)]
struct File<'a> {
    schema: Cow<'a, str>,
    title: Cow<'a, str>,
    frequency: Cow<'a, [f64]>,
    signals: Vec<Signal<'a>>,
}

#[derive(Serialize, Deserialize)]
struct Signal<'a> {
    name: Cow<'a, str>,
    unit: Cow<'a, str>,
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Phasors {
    /// Column j over frequency.
    pub fn column(&self, j: usize) -> impl ExactSizeIterator<Item = Complex<f64>> + Clone + '_ {
        let width = self.names.len();
        (0..self.frequency.len()).map(move |k| self.values[k * width + j])
    }

    /// The column of this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }

    /// The responses of several runs over the same frequencies beside each other, `v(out)[r=1000]` of the one whose label is `r=1000`; `None` where the
    /// frequencies differ.
    #[cfg(feature = "cli")]
    #[must_use]
    pub(crate) fn beside(runs: &[(String, Self)]) -> Option<Self> {
        let (_, first) = runs.first()?;
        if runs.iter().any(|(_, run)| run.frequency != first.frequency) {
            return None;
        }
        let of = |run: &(String, Self)| {
            let label = run.0.replace(' ', ",");
            let names = run.1.names.iter();
            names
                .map(|name| format!("{name}[{label}]"))
                .collect::<Vec<_>>()
        };
        let row = |k: usize| {
            runs.iter().flat_map(move |(_, run)| {
                let width = run.names.len();
                run.values[k * width..(k + 1) * width].iter().copied()
            })
        };
        Some(Self {
            title: first.title.clone(),
            names: runs.iter().flat_map(of).collect(),
            units: runs.iter().flat_map(|(_, run)| run.units.clone()).collect(),
            frequency: first.frequency.clone(),
            values: (0..first.frequency.len()).flat_map(row).collect(),
        })
    }

    /// Writes `frequency,re(v(out)),im(v(out)),…` with 17 significant digits.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn write_csv(&self, to: impl Write) -> std::io::Result<()> {
        let parts = |name: &String| [format!("re({name})"), format!("im({name})")];
        let names: Vec<String> = self.names.iter().flat_map(parts).collect();
        let mut writer = csv::Writer::over(to, "frequency", &names)?;
        let width = self.names.len().max(1);
        let mut row = Vec::with_capacity(2 * width);
        for (frequency, values) in self.frequency.iter().zip(self.values.chunks(width)) {
            row.clear();
            row.extend(values.iter().flat_map(|value| [value.re, value.im]));
            writer.row(*frequency, &row)?;
        }
        Ok(())
    }

    /// Writes ngspice's raw format: a complex plot over frequency.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn write_raw(&self, mut to: impl Write) -> std::io::Result<()> {
        let columns = (&self.names[..], &self.units[..]);
        raw::complex_header(&mut to, &self.title, columns, self.frequency.len() as u64)?;
        let width = self.names.len().max(1);
        for (frequency, values) in self.frequency.iter().zip(self.values.chunks(width)) {
            raw::row(&mut to, *frequency, &[0.0])?;
            for value in values {
                raw::row(&mut to, value.re, &[value.im])?;
            }
        }
        Ok(())
    }

    /// Writes NumPy's archive: `frequency` in doubles, every signal as a complex vector.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn write_npz(&self, to: impl Write + Seek) -> std::io::Result<()> {
        npz::write_phasors(to, self)
    }

    /// Writes one JSON object, `{"schema":"circ-phasors/1","title":…,"frequency":[…],"signals":[{"name","unit","re":[…],"im":[…]},…]}`.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn write_json(&self, mut to: impl Write) -> std::io::Result<()> {
        let signal = |j: usize| Signal {
            name: (&self.names[j]).into(),
            unit: self.units[j].into(),
            re: self.column(j).map(|value| value.re).collect(),
            im: self.column(j).map(|value| value.im).collect(),
        };
        let file = File {
            schema: SCHEMA.into(),
            title: (&self.title).into(),
            frequency: (&self.frequency).into(),
            signals: (0..self.names.len()).map(signal).collect(),
        };
        serde_json::to_writer(&mut to, &file)?;
        to.write_all(b"\n")
    }

    /// Reads what [`Self::write_json`] wrote.
    ///
    /// # Errors
    /// [`WaveformError::Malformed`] when a key is missing or the columns differ in length.
    pub(super) fn read_json(bytes: &[u8]) -> Result<Self, WaveformError> {
        let file: File<'_> = serde_json::from_slice(bytes).map_err(json::unreadable)?;
        let rows = file.frequency.len();
        let is_whole = |s: &Signal<'_>| (s.re.len(), s.im.len()) == (rows, rows);
        if let Some(signal) = file.signals.iter().find(|signal| !is_whole(signal)) {
            let reason = format!("{} has not {rows} values", signal.name);
            return Err(WaveformError::malformed("json", reason));
        }
        let value = |k: usize, signal: &Signal<'_>| Complex::new(signal.re[k], signal.im[k]);
        Ok(Self {
            title: file.title.into_owned(),
            units: file.signals.iter().map(|s| unit(&s.name)).collect(),
            names: file.signals.iter().map(|s| s.name.to_string()).collect(),
            values: (0..rows)
                .flat_map(|k| file.signals.iter().map(move |signal| value(k, signal)))
                .collect(),
            frequency: file.frequency.into_owned(),
        })
    }
}

/// The unit of a column by its name; none of a ratio.
pub(super) fn unit(name: &str) -> &'static str {
    if name.contains('/') {
        ""
    } else {
        unit_of(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Phasors {
        Phasors {
            title: "filter".into(),
            names: vec!["v(a,b)".into(), "i(v1)@-1".into()],
            units: vec!["V", "A"],
            frequency: vec![1.0, 10.0],
            values: [(1.0, -0.5), (0.0, 0.25), (0.1, -1.0 / 3.0), (-0.0, 1e-300)]
                .map(|(re, im)| Complex::new(re, im))
                .to_vec(),
        }
    }

    #[test]
    fn csv_has_two_columns_a_signal() {
        let mut text = Vec::new();
        sample().write_csv(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(
            lines.next(),
            Some("frequency,\"re(v(a,b))\",\"im(v(a,b))\",re(i(v1)@-1),im(i(v1)@-1)")
        );
        let first: Vec<f64> = lines
            .next()
            .unwrap()
            .split(',')
            .map(|v| v.parse().unwrap())
            .collect();
        assert_eq!(first, [1.0, 1.0, -0.5, 0.0, 0.25]);
        assert_eq!(lines.count(), 1);
    }

    #[test]
    fn raw_is_a_complex_plot() {
        let mut bytes = Vec::new();
        sample().write_raw(&mut bytes).unwrap();
        let at = bytes.windows(8).position(|w| w == b"Binary:\n").unwrap() + 8;
        let header = String::from_utf8(bytes[..at].to_vec()).unwrap();
        assert!(
            header.contains("Plotname: AC Analysis\nFlags: complex\n"),
            "{header}"
        );
        assert!(
            header.contains(
                "\t0\tfrequency\tfrequency\n\t1\tv(a,b)\tvoltage\n\t2\ti(v1)@-1\tcurrent\n"
            )
        );
        let values: Vec<f64> = bytes[at..]
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(values.len(), 2 * 3 * 2);
        assert_eq!(values[..6], [1.0, 0.0, 1.0, -0.5, 0.0, 0.25]);
    }
}
