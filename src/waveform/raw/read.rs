//! Raw files as ngspice and LTspice write them.
//!
//! LTspice's differ: the header may be UTF-16, real values but those of time are single precision unless the flags say `double`, `fastaccess` files hold
//! column after column, times may be negative where it left out points between (their absolute values are the times), and the runs of `.step` follow
//! each other in one plot.

use std::borrow::Cow;
use std::io::Read;

use nalgebra::Complex;

use super::super::plot::{runs, sweeps};
use super::super::{Phasors, Plot, WaveformError, Waveforms, phasors};

const FORMAT: &str = "raw";

/// Reads the first plot over time.
///
/// # Errors
/// As [`super::super::plots`], and [`WaveformError::Malformed`] where no plot is over time or the first one holds several runs.
pub fn read(from: impl Read) -> Result<Waveforms, WaveformError> {
    let runs = plots(from)?.into_iter().find_map(|plot| match plot {
        Plot::Time(runs) => Some(runs),
        Plot::Frequency(_) | Plot::Swept(..) => None,
    });
    let runs = runs.ok_or_else(|| malformed("no plot has `time` as its first variable"))?;
    match <[_; 1]>::try_from(runs) {
        Ok([(_, run)]) => Ok(run),
        Err(_) => Err(malformed("time runs backwards: there are several runs")),
    }
}

/// Reads the plots over time, over frequency and over what `.dc` swept; others (operating points) are passed over.
///
/// # Errors
/// [`WaveformError::Malformed`] when a header lacks a field, or values are missing or not finite.
pub(in super::super) fn plots(mut from: impl Read) -> Result<Vec<Plot>, WaveformError> {
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes)?;
    let wide = bytes.get(1) == Some(&0);
    let mut rest = Bytes { rest: &bytes, wide };
    let mut plots = Vec::new();
    while let Some(header) = Header::read(&mut rest)? {
        let values = header.values(&mut rest)?;
        plots.extend(header.plot(values)?);
    }
    Ok(plots)
}

fn malformed(reason: impl Into<String>) -> WaveformError {
    WaveformError::malformed(FORMAT, reason)
}

/// What is left of the file.
struct Bytes<'a> {
    rest: &'a [u8],
    /// Text is UTF-16, low byte first.
    wide: bool,
}

impl<'a> Bytes<'a> {
    /// The next line without its end; `None` at the end of the file.
    fn line(&mut self) -> Option<String> {
        if self.rest.is_empty() {
            return None;
        }
        let width = if self.wide { 2 } else { 1 };
        let ends = |unit: &[u8]| unit[0] == b'\n' && unit[1..].iter().all(|b| *b == 0);
        let mut units = self.rest.chunks_exact(width);
        let end = units.position(ends).map_or(self.rest.len(), |k| k * width);
        let bytes = &self.rest[..end];
        self.rest = self.rest.get(end + width..).unwrap_or(&[]);
        let text = if self.wide {
            let units = bytes.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b));
            let letters =
                char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
            Cow::Owned(letters.collect())
        } else {
            String::from_utf8_lossy(bytes)
        };
        Some(text.trim_end_matches('\r').to_owned())
    }

    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(taken)
    }
}

#[derive(Default)]
struct Header {
    title: String,
    variables: Vec<String>,
    points: usize,
    binary: bool,
    complex: bool,
    /// Times may have the other sign.
    ltspice: bool,
    /// Values but those of the first variable are single precision.
    single: bool,
    /// Column after column.
    by_column: bool,
    /// Of `.dc`: the first variable is what was swept.
    swept: bool,
}

impl Header {
    /// The next plot's header up to `Binary:` or `Values:`; `None` when only blank lines are left.
    fn read(from: &mut Bytes) -> Result<Option<Self>, WaveformError> {
        let mut header = Self::default();
        let (mut width, mut points) = (None, None);
        let (mut ltspice, mut double) = (from.wide, false);
        let mut started = false;
        while let Some(line) = from.line() {
            if line.trim().is_empty() {
                continue;
            }
            started = true;
            let (key, value) = line
                .split_once(':')
                .ok_or_else(|| malformed(format!("header line `{}`", printable(&line))))?;
            let value = value.trim();
            let count = || {
                value
                    .parse::<usize>()
                    .map_err(|_| malformed(format!("{key}: `{}` is not a count", printable(value))))
            };
            match key.trim().to_ascii_lowercase().as_str() {
                "title" => header.title = value.to_owned(),
                "plotname" => header.swept = value.to_ascii_lowercase().starts_with("dc transfer"),
                "command" => {
                    ltspice |= value.contains("LTspice") || value.contains("Linear Technology")
                }
                "flags" => {
                    let flags = value.to_ascii_lowercase();
                    let has = |flag| flags.split_whitespace().any(|own| own == flag);
                    header.complex = has("complex");
                    header.by_column = has("fastaccess");
                    double = has("double");
                }
                "no. variables" => width = Some(count()?),
                "no. points" => points = Some(count()?),
                "variables" => {
                    let width =
                        width.ok_or_else(|| malformed("`Variables:` before `No. Variables:`"))?;
                    header.variables = variables(from, width)?;
                }
                end @ ("binary" | "values") => {
                    header.points = points.ok_or_else(|| malformed("no `No. Points:`"))?;
                    if header.variables.is_empty() {
                        return Err(malformed("no variables"));
                    }
                    header.binary = end == "binary";
                    header.ltspice = ltspice;
                    header.single = ltspice && !double && !header.complex;
                    return Ok(Some(header));
                }
                _ => {}
            }
        }
        if started {
            Err(malformed("the header ends without `Binary:` or `Values:`"))
        } else {
            Ok(None)
        }
    }

    /// Doubles of a value.
    const fn parts(&self) -> usize {
        if self.complex { 2 } else { 1 }
    }

    /// All values row by row, of complex ones both parts.
    fn values(&self, from: &mut Bytes) -> Result<Vec<f64>, WaveformError> {
        if self.binary {
            self.binary_values(from)
        } else {
            self.text_values(from)
        }
    }

    fn missing(&self, row: usize) -> WaveformError {
        malformed(format!("values end in row {row} of {}", self.points))
    }

    fn binary_values(&self, from: &mut Bytes) -> Result<Vec<f64>, WaveformError> {
        let size = |column: usize| match column {
            0 => 8 * self.parts(),
            _ if self.single => 4,
            _ => 8 * self.parts(),
        };
        let width = self.variables.len();
        let row: usize = (0..width).map(size).sum();
        let whole = from.rest.len() / row;
        let taken = row
            .checked_mul(self.points)
            .and_then(|size| from.take(size));
        let bytes = taken.ok_or_else(|| self.missing(whole))?;
        let mut values = vec![0.0; self.points * width * self.parts()];
        let mut at = 0;
        let mut take = |k: usize, column: usize| {
            let cell = &bytes[at..at + size(column)];
            at += cell.len();
            let target = &mut values[(k * width + column) * self.parts()..];
            if let ([a, b, c, d], true) = (cell, self.single) {
                target[0] = f32::from_le_bytes([*a, *b, *c, *d]).into();
                return;
            }
            for (target, bytes) in target.iter_mut().zip(cell.as_chunks().0) {
                *target = f64::from_le_bytes(*bytes);
            }
        };
        if self.by_column {
            (0..width).for_each(|column| (0..self.points).for_each(|k| take(k, column)));
        } else {
            (0..self.points).for_each(|k| (0..width).for_each(|column| take(k, column)));
        }
        Ok(values)
    }

    fn text_values(&self, from: &mut Bytes) -> Result<Vec<f64>, WaveformError> {
        let width = self.variables.len();
        let mut values = Vec::new();
        for row in 0..self.points {
            // The row's number stands before its first value.
            let mut column = 0;
            while column < width {
                let line = from.line().ok_or_else(|| self.missing(row))?;
                let skip = usize::from(column == 0);
                for word in line.split_whitespace().skip(skip) {
                    let before = values.len();
                    for part in word.split(',') {
                        values.push(part.parse().map_err(|_| {
                            let word = printable(word);
                            malformed(format!("row {row}: `{word}` is not a number"))
                        })?);
                    }
                    // A real value in a complex plot.
                    values.resize(before + self.parts(), 0.0);
                    column += 1;
                }
            }
        }
        Ok(values)
    }

    /// What is over time, frequency or what was swept.
    fn plot(self, mut values: Vec<f64>) -> Result<Option<Plot>, WaveformError> {
        let (width, parts) = (self.variables.len(), self.parts());
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            let (row, column) = (k / (width * parts), k / parts % width);
            let (name, value) = (&self.variables[column], values[k]);
            return Err(malformed(format!("{name} in row {row} is {value}")));
        }
        match self.variables[0].to_ascii_lowercase().as_str() {
            "frequency" if self.complex => Ok(Some(Plot::Frequency(self.phasors(&values)))),
            "time" if self.complex => Err(malformed("complex values over time")),
            "time" => {
                if self.ltspice {
                    values.iter_mut().step_by(width).for_each(|t| *t = t.abs());
                }
                Ok(Some(Plot::Time(runs(&self.waveforms(&values)))))
            }
            _ if self.swept && !self.complex => {
                let axis = self.variables[0].clone();
                Ok(Some(Plot::Swept(axis, sweeps(&self.waveforms(&values)))))
            }
            _ => Ok(None),
        }
    }

    fn phasors(self, values: &[f64]) -> Phasors {
        let width = self.variables.len();
        let rows = values.chunks(2 * width);
        let complex = |part: &[f64]| Complex::new(part[0], part[1]);
        Phasors {
            title: self.title,
            units: self.variables[1..]
                .iter()
                .map(|n| phasors::unit(n))
                .collect(),
            names: self.variables[1..].to_vec(),
            frequency: rows.clone().map(|row| row[0]).collect(),
            values: rows
                .flat_map(|row| row[2..].chunks(2).map(complex))
                .collect(),
        }
    }

    fn waveforms(self, values: &[f64]) -> Waveforms {
        let column = |j: usize| {
            let width = self.variables.len();
            values.iter().skip(j).step_by(width).copied().collect()
        };
        let columns: Vec<Vec<f64>> = (1..self.variables.len()).map(column).collect();
        let (time, names) = (column(0), self.variables[1..].to_vec());
        Waveforms::from_columns(self.title, names, time, &columns)
    }
}

fn variables(from: &mut Bytes, count: usize) -> Result<Vec<String>, WaveformError> {
    let variable = |k| {
        let line = from.line();
        let line = line.ok_or_else(|| malformed(format!("variable {k} is missing")))?;
        let name = line.split_whitespace().nth(1);
        let name =
            name.ok_or_else(|| malformed(format!("variable {k}: `{}`", printable(&line))))?;
        Ok(name.to_owned())
    };
    (0..count).map(variable).collect()
}

/// The start of a piece of the file, for messages about files that may be anything.
fn printable(text: &str) -> String {
    text.chars()
        .take(40)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["time", "V(out)", "I(R1)"];
    /// Rows of two runs; the second time of the first one is stored with its sign changed.
    const ROWS: [[f64; 3]; 4] = [
        [0.0, 1.0, 0.5],
        [0.1, 2.0, -0.25],
        [0.0, 3.0, 0.125],
        [0.2, 4.0, 1.0],
    ];

    fn header(flags: &str, points: usize) -> String {
        let variables = NAMES.iter().enumerate();
        let variables: String = variables
            .map(|(k, n)| format!("\t{k}\t{n}\tvoltage\n"))
            .collect();
        format!(
            "Title: * a.asc\nPlotname: Transient Analysis\nFlags: {flags}\nNo. Variables: 3\nNo. Points: {points}\nOffset: 0\n\
             Command: Linear Technology Corporation LTspice XVII\nVariables:\n{variables}Binary:\n"
        )
    }

    fn wide(text: &str) -> Vec<u8> {
        text.encode_utf16().flat_map(u16::to_le_bytes).collect()
    }

    fn times(t: f64) -> [u8; 8] {
        (if t == 0.1 { -t } else { t }).to_le_bytes()
    }

    fn check(bytes: &[u8]) {
        let plots = plots(bytes).unwrap();
        let [Plot::Time(runs)] = &plots[..] else {
            panic!("{plots:?}")
        };
        assert_eq!(runs.len(), 2);
        assert_eq!(
            (&runs[0].1.time[..], &runs[1].1.time[..]),
            (&[0.0, 0.1][..], &[0.0, 0.2][..])
        );
        assert_eq!(
            (&runs[0].1.values[..], &runs[1].1.values[..]),
            (&[1.0, 0.5, 2.0, -0.25][..], &[3.0, 0.125, 4.0, 1.0][..])
        );
        assert_eq!(runs[0].1.units, ["V", "A"]);
    }

    #[test]
    fn ltspice_writes_single_precision_by_row_or_by_column_and_several_runs() {
        let mut by_row = wide(&header("real forward stepped", 4));
        for [t, a, b] in ROWS {
            by_row.extend(times(t));
            by_row.extend([a, b].map(|x| (x as f32).to_le_bytes()).as_flattened());
        }
        check(&by_row);
        let mut by_column = wide(&header("real forward stepped fastaccess", 4));
        by_column.extend(ROWS.iter().flat_map(|row| times(row[0])));
        for j in 1..3 {
            by_column.extend(ROWS.iter().flat_map(|row| (row[j] as f32).to_le_bytes()));
        }
        check(&by_column);
    }

    #[test]
    fn files_of_ltspice_in_doubles() {
        let mut bytes = header("real forward double", 2).into_bytes();
        bytes.extend(ROWS[..2].iter().flatten().flat_map(|x| x.to_le_bytes()));
        assert_eq!(read(&bytes[..]).unwrap().values, [1.0, 0.5, 2.0, -0.25]);
    }

    #[test]
    fn complex_plots_in_text_and_binary() {
        let head = "Title: t\nPlotname: AC Analysis\nFlags: complex\nNo. Variables: 2\nNo. Points: 1\nVariables:\n\t0\tfrequency\tfrequency\n\t1\tv(a)\tvoltage\n";
        let text = format!("{head}Values:\n 0\t1e3,0\n\t0.5,-0.25\n\n");
        let mut binary = format!("{head}Binary:\n").into_bytes();
        binary.extend([1e3, 0.0, 0.5, -0.25].map(f64::to_le_bytes).as_flattened());
        for bytes in [text.as_bytes(), &binary] {
            let plots = plots(bytes).unwrap();
            let [Plot::Frequency(phasors)] = &plots[..] else {
                panic!("{plots:?}")
            };
            assert_eq!(phasors.frequency, [1e3]);
            assert_eq!(phasors.values, [Complex::new(0.5, -0.25)]);
            assert!(
                read(bytes)
                    .unwrap_err()
                    .to_string()
                    .contains("no plot has `time`")
            );
        }
    }

    #[test]
    fn time_that_runs_backwards_in_a_file_of_ngspice_is_refused() {
        let text = "Title: t\nPlotname: Transient Analysis\nFlags: real\nNo. Variables: 2\nNo. Points: 2\nVariables:\n\t0\ttime\ttime\n\t1\ta\tvoltage\n\
                    Values:\n 0\t1\n\t2\n 1\t0\n\t3\n";
        assert!(
            read(text.as_bytes())
                .unwrap_err()
                .to_string()
                .contains("time runs backwards")
        );
    }
}
