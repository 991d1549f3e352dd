//! ngspice's raw files: a text header, then doubles in binary (little endian) or as text.
//!
//! What [`write()`] writes loads in ngspice (`load run.raw`) and in the Python package `spicelib`. The header carries no date,
//! so equal runs are equal bytes. [`read`] takes the first transient plot of a file in either form, real values only.

use std::io::{Read, Write};

use super::{WaveformError, Waveforms};

const FORMAT: &str = "raw";
/// The plot name that marks a transient analysis.
const PLOT: &str = "Transient Analysis";
/// Readers that know several dialects (spicelib) look for the word `ngspice` here.
const COMMAND: &str = "circ, in the format of ngspice";

/// Characters of the title's line for a word on what is missing, and of the number of rows: a header keeps its length when they change.
const RESERVED: usize = 48;
const DIGITS: usize = 20;

/// Writes the header and all rows in binary.
///
/// # Errors
/// Those of `to`.
pub fn write(mut to: impl Write, waves: &Waveforms) -> std::io::Result<()> {
    let columns = (&waves.names[..], &waves.units[..]);
    header(&mut to, &waves.title, columns, waves.len() as u64, None)?;
    for (k, time) in waves.time.iter().enumerate() {
        row(&mut to, *time, waves.row(k))?;
    }
    Ok(())
}

/// Writes the header for so many rows of columns with these names and units. Headers that differ in the number of rows and in what
/// is said to be `incomplete` alone are of one length, so that one can be written in the place of the other.
///
/// # Errors
/// Those of `to`.
pub fn header(
    to: &mut impl Write,
    title: &str,
    (names, units): (&[String], &[&'static str]),
    rows: u64,
    incomplete: Option<&str>,
) -> std::io::Result<()> {
    let title = title.replace(char::is_control, " ");
    let note: String = incomplete
        .map_or(String::new(), |why| format!(" ({why})"))
        .chars()
        .filter(char::is_ascii)
        .take(RESERVED)
        .collect();
    let title = format!("{title}{note:RESERVED$}");
    plot_header(to, &title, (PLOT, "real", "time"), (names, units), rows)
}

/// Writes the header for so many rows of complex columns over frequency.
///
/// # Errors
/// Those of `to`.
pub(super) fn complex_header(
    to: &mut impl Write,
    title: &str,
    columns: (&[String], &[&'static str]),
    rows: u64,
) -> std::io::Result<()> {
    let title = title.replace(char::is_control, " ");
    plot_header(
        to,
        &title,
        ("AC Analysis", "complex", "frequency"),
        columns,
        rows,
    )
}

fn plot_header(
    to: &mut impl Write,
    title: &str,
    (plot, flags, axis): (&str, &str, &str),
    (names, units): (&[String], &[&'static str]),
    rows: u64,
) -> std::io::Result<()> {
    write!(
        to,
        "Title: {title}\nDate: \nCommand: {COMMAND}\nPlotname: {plot}\nFlags: {flags}\nNo. Variables: {}\n\
         No. Points: {rows:<DIGITS$}\nVariables:\n\t0\t{axis}\t{axis}\n",
        names.len() + 1,
    )?;
    for (j, (name, unit)) in names.iter().zip(units).enumerate() {
        let kind = if *unit == "A" { "current" } else { "voltage" };
        writeln!(to, "\t{}\t{name}\t{kind}", j + 1)?;
    }
    to.write_all(b"Binary:\n")
}

/// Writes one row in binary.
///
/// # Errors
/// Those of `to`.
pub fn row(to: &mut impl Write, time: f64, values: &[f64]) -> std::io::Result<()> {
    to.write_all(&time.to_le_bytes())?;
    for value in values {
        to.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

/// Reads the first plot whose name says transient (or whose first variable is time).
///
/// # Errors
/// [`WaveformError::Malformed`] when the header lacks a field, values are missing, complex or not finite, or no plot is over time.
pub fn read(mut from: impl Read) -> Result<Waveforms, WaveformError> {
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes)?;
    let mut rest = Bytes(&bytes);
    while let Some(header) = Header::read(&mut rest)? {
        let over_time = header.variables[0].eq_ignore_ascii_case("time");
        let values = header.values(&mut rest)?;
        if over_time {
            return header.waveforms(&values);
        }
    }
    Err(malformed("no plot has `time` as its first variable"))
}

fn malformed(reason: impl Into<String>) -> WaveformError {
    WaveformError::malformed(FORMAT, reason)
}

/// What is left of the file.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    /// The next line without its end; `None` at the end of the file.
    fn line(&mut self) -> Option<String> {
        if self.0.is_empty() {
            return None;
        }
        let end = self
            .0
            .iter()
            .position(|&b| b == b'\n')
            .unwrap_or(self.0.len());
        let line = String::from_utf8_lossy(&self.0[..end])
            .trim_end_matches('\r')
            .to_owned();
        self.0 = self.0.get(end + 1..).unwrap_or(&[]);
        Some(line)
    }

    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }
}

struct Header {
    title: String,
    variables: Vec<String>,
    points: usize,
    binary: bool,
}

impl Header {
    /// The next plot's header up to `Binary:` or `Values:`; `None` when only blank lines are left.
    fn read(from: &mut Bytes) -> Result<Option<Self>, WaveformError> {
        let (mut title, mut n_variables, mut points) = (String::new(), None, None);
        let mut variables = Vec::new();
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
                "title" => title = value.to_owned(),
                "flags" if value.to_ascii_lowercase().contains("complex") => {
                    return Err(malformed(
                        "complex values; a transient analysis has real ones",
                    ));
                }
                "no. variables" => n_variables = Some(count()?),
                "no. points" => points = Some(count()?),
                "variables" => {
                    for k in 0..n_variables
                        .ok_or_else(|| malformed("`Variables:` before `No. Variables:`"))?
                    {
                        let line = from
                            .line()
                            .ok_or_else(|| malformed(format!("variable {k} is missing")))?;
                        let name = line.split_whitespace().nth(1).ok_or_else(|| {
                            malformed(format!("variable {k}: `{}`", printable(&line)))
                        })?;
                        variables.push(name.to_owned());
                    }
                }
                end @ ("binary" | "values") => {
                    let points = points.ok_or_else(|| malformed("no `No. Points:`"))?;
                    if variables.is_empty() {
                        return Err(malformed("no variables"));
                    }
                    return Ok(Some(Self {
                        title,
                        variables,
                        points,
                        binary: end == "binary",
                    }));
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

    /// All values row by row.
    fn values(&self, from: &mut Bytes) -> Result<Vec<f64>, WaveformError> {
        let width = self.variables.len();
        let missing = |row: usize| malformed(format!("values end in row {row} of {}", self.points));
        let mut values = Vec::new();
        if self.binary {
            for row in 0..self.points {
                let bytes = from
                    .take(width * size_of::<f64>())
                    .ok_or_else(|| missing(row))?;
                values.extend(bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)));
            }
            return Ok(values);
        }
        for row in 0..self.points {
            // The row's number stands before its first value.
            let mut column = 0;
            while column < width {
                let line = from.line().ok_or_else(|| missing(row))?;
                let skip = usize::from(column == 0);
                for word in line.split_whitespace().skip(skip) {
                    values.push(word.parse().map_err(|_| {
                        malformed(format!("row {row}: `{}` is not a number", printable(word)))
                    })?);
                    column += 1;
                }
            }
        }
        Ok(values)
    }

    fn waveforms(self, values: &[f64]) -> Result<Waveforms, WaveformError> {
        let width = self.variables.len();
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            return Err(malformed(format!(
                "{} in row {} is {}",
                self.variables[k % width],
                k / width,
                values[k]
            )));
        }
        let columns: Vec<Vec<f64>> = (0..width)
            .map(|j| values.iter().skip(j).step_by(width).copied().collect())
            .collect();
        if !columns[0].is_sorted() {
            return Err(malformed("time runs backwards"));
        }
        let names = self.variables[1..].to_vec();
        Ok(Waveforms::from_columns(
            self.title,
            names,
            columns[0].clone(),
            &columns[1..],
        ))
    }
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
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn what_is_written_reads_back_to_the_same_doubles() {
        let mut bytes = Vec::new();
        write(&mut bytes, &sample()).unwrap();
        assert_eq!(read(&bytes[..]).unwrap(), sample());
    }

    #[test]
    fn text_values_and_an_earlier_plot_are_read() {
        let operating_point = "Title: t\nPlotname: Operating Point\nFlags: real\nNo. Variables: 1\nNo. Points: 1\n\
            Variables:\n\t0\tv(a)\tvoltage\nValues:\n 0\t4.0\n\n";
        let transient = "Title: t\nPlotname: Transient Analysis\nFlags: real\nNo. Variables: 2\nNo. Points: 2       \n\
            Variables:\n\t0\ttime\ttime\n\t1\tV1#branch\tcurrent\nValues:\n 0\t0.0\n\t-1.5\n\n 1\t1e-3\n\t2\n\n";
        let waves = read(format!("{operating_point}{transient}").as_bytes()).unwrap();
        assert_eq!(
            (waves.time, waves.values),
            (vec![0.0, 1e-3], vec![-1.5, 2.0])
        );
        assert_eq!(
            (waves.names, waves.units),
            (vec!["V1#branch".to_owned()], vec!["A"])
        );
        assert!(
            read(operating_point.as_bytes())
                .unwrap_err()
                .to_string()
                .contains("no plot has `time`")
        );
    }

    #[test]
    fn damaged_files_are_refused_with_a_reason() {
        let mut bytes = Vec::new();
        write(&mut bytes, &sample()).unwrap();
        let cut = read(&bytes[..bytes.len() - 1]).unwrap_err().to_string();
        assert_eq!(cut, "not a raw file of waveforms: values end in row 4 of 5");
        let text = "Title: t\nFlags: real\nNo. Variables: 2\nNo. Points: 1\nVariables:\n\t0\ttime\ttime\n\t1\tv(a)\tvoltage\n";
        for (tail, reason) in [
            ("", "the header ends without `Binary:` or `Values:`"),
            ("Values:\n 0\t0.0\n\tnan\n", "v(a) in row 0 is NaN"),
            ("Values:\n 0\t0.0\n\tx\n", "row 0: `x` is not a number"),
        ] {
            let error = read(format!("{text}{tail}").as_bytes())
                .unwrap_err()
                .to_string();
            assert_eq!(error, format!("not a raw file of waveforms: {reason}"));
        }
        assert!(read(text.replace("Flags: real", "Flags: complex").as_bytes()).is_err());
        assert!(
            read(
                text.replace("Variables: 2", "Variables: 99999999999")
                    .as_bytes()
            )
            .is_err()
        );
    }
}
