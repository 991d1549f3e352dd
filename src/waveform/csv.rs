//! Comma-separated values: `time,v(out),…` with 17 significant digits.

mod head;

use std::io::{BufRead, BufReader, Read, Write};

use nalgebra::Complex;

use head::{above, delimiter, is_time, number, step, units};

use super::plot::{runs, sweeps};
use super::{Phasors, Plot, WaveformError, Waveforms, phasors};

const FORMAT: &str = "csv";

/// Writes rows as they come; names that hold a comma, such as `v(a,b)`, are quoted.
pub struct Writer<W: Write> {
    to: W,
}

impl<W: Write> Writer<W> {
    /// Writes the header `time,` and the names.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn new(to: W, names: &[String]) -> std::io::Result<Self> {
        Self::over(to, "time", names)
    }

    /// The same over another quantity than time, such as a swept voltage.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn over(mut to: W, axis: &str, names: &[String]) -> std::io::Result<Self> {
        header(&mut to, axis, names)?;
        Ok(Self { to })
    }

    /// Writes one row: time (or what stands in its place), then the values.
    ///
    /// # Errors
    /// Those of the target.
    pub fn row(&mut self, time: f64, values: &[f64]) -> std::io::Result<()> {
        row(&mut self.to, time, values)
    }
}

/// Writes the header: the axis, `time` or what stands in its place, then the names.
///
/// # Errors
/// Those of `to`.
pub fn header(to: &mut impl Write, axis: &str, names: &[String]) -> std::io::Result<()> {
    write!(to, "{axis}")?;
    for name in names {
        if name.contains([',', '"', '\n']) {
            write!(to, ",\"{}\"", name.replace('"', "\"\""))?;
        } else {
            write!(to, ",{name}")?;
        }
    }
    to.write_all(b"\n")
}

/// Writes one row: time (or what stands in its place), then the values.
///
/// # Errors
/// Those of `to`.
pub fn row(to: &mut impl Write, time: f64, values: &[f64]) -> std::io::Result<()> {
    let mut line = Vec::with_capacity((values.len() + 1) * LONGEST);
    cell(time, &mut line);
    for &value in values {
        line.push(b',');
        cell(value, &mut line);
    }
    line.push(b'\n');
    to.write_all(&line)
}

/// Significant digits of a cell.
const DIGITS: usize = 17;
/// Bytes of the longest cell and what follows it: a sign, digits with their point, and an exponent of three digits with its sign.
const LONGEST: usize = DIGITS + 8;

/// Appends a number as a cell, `-1.2500000000000000e-3`: the fewest digits that read back to the same double, and zeros up to [`DIGITS`] of
/// them.
pub(crate) fn cell(value: f64, text: &mut Vec<u8>) {
    let mut buffer = zmij::Buffer::new();
    let mut number = buffer.format(value).as_bytes();
    if !value.is_finite() {
        return text.extend_from_slice(number);
    }
    if let [b'-', rest @ ..] = number {
        text.push(b'-');
        number = rest;
    }
    // 12.5, 0.00125 or 1.25e-7; an exponent has three digits and a sign at most.
    let tail = number.len().saturating_sub(5);
    let e = number[tail..].iter().position(|byte| *byte == b'e');
    let (mantissa, exponent) = number.split_at(e.map_or(number.len(), |e| tail + e));
    let point = mantissa.iter().position(|byte| *byte == b'.');
    let (whole, part) = mantissa.split_at(point.unwrap_or(mantissa.len()));
    let part = part.get(1..).unwrap_or_default();
    let zeros = part.iter().take_while(|byte| **byte == b'0').count();
    let (first, rest, power) = match whole {
        [b'0', ..] if zeros == part.len() => (&whole[..1], part, 0),
        [b'0', ..] => {
            let (first, rest) = part[zeros..].split_at(1);
            (first, rest, -(zeros as i32) - 1)
        }
        _ => (whole, part, whole.len() as i32 - 1),
    };
    let from = text.len();
    text.push(first[0]);
    text.push(b'.');
    text.extend_from_slice(&first[1..]);
    text.extend_from_slice(rest);
    text.resize(from + DIGITS + 1, b'0');
    let written = std::str::from_utf8(exponent.get(1..).unwrap_or_default());
    let power = power + written.ok().and_then(|e| e.parse().ok()).unwrap_or(0);
    text.push(b'e');
    if power < 0 {
        text.push(b'-');
    }
    let power = power.unsigned_abs();
    for place in [100, 10, 1] {
        if power >= place || place == 1 {
            text.push(b'0' + (power / place % 10) as u8);
        }
    }
}

/// Writes all rows.
///
/// # Errors
/// Those of `to`.
///
/// # Example
/// ```
/// use circ::waveform::{Waveforms, csv};
/// let waves = Waveforms { names: vec!["v(a)".into()], units: vec!["V"], time: vec![0.5], values: vec![0.1], ..Default::default() };
/// let mut text = Vec::new();
/// csv::write(&mut text, &waves).unwrap();
/// assert_eq!(String::from_utf8(text).unwrap(), "time,v(a)\n5.0000000000000000e-1,1.0000000000000000e-1\n");
/// ```
pub fn write(to: impl Write, waves: &Waveforms) -> std::io::Result<()> {
    let mut writer = Writer::new(to, &waves.names)?;
    for (k, &time) in waves.time.iter().enumerate() {
        writer.row(time, waves.row(k))?;
    }
    Ok(())
}

/// Reads a file with a header whose first column is time (s); lines that start with `#` are skipped.
///
/// # Errors
/// [`WaveformError::Malformed`] with the line of the first cell that is not a finite number, of a row of another length, or
/// of a time that runs backwards.
pub fn read(from: impl Read) -> Result<Waveforms, WaveformError> {
    let table = Table::read(from)?.whole()?;
    let (axis, time) = (&table.names[0], &table.columns[0]);
    if !is_time(axis) {
        return Err(malformed(format!(
            "the first column must be `time`, found `{axis}`"
        )));
    }
    if let Some(k) = time.windows(2).position(|pair| pair[1] < pair[0]) {
        let line = table.lines[k + 1];
        return Err(malformed(format!("line {line}: time runs backwards")));
    }
    Ok(table.waveforms())
}

/// Reads the same, and files whose first column is frequency (Hz) before `re(…)` and `im(…)` of each signal, or what `.dc` swept before signals `v(…)`, `i(…)`.
///
/// # Errors
/// [`WaveformError::Malformed`] as in [`read`]; but a time that runs backwards, or LTspice's line `Step Information: …`, begins another run, and a cell over time that is empty, NaN or
/// infinite is a gap, NaN.
pub(super) fn plot(from: impl Read) -> Result<Plot, WaveformError> {
    let table = Table::read(from)?;
    match &table.names[0] {
        axis if is_time(axis) && table.steps.is_empty() => Ok(Plot::Time(runs(&table.waveforms()))),
        axis if is_time(axis) => Ok(Plot::Time(table.stepped())),
        axis if axis.eq_ignore_ascii_case("frequency") => {
            table.whole()?.phasors().map(Plot::Frequency)
        }
        axis if is_swept(axis, &table.names[1..]) => {
            let axis = axis.clone();
            Ok(Plot::Swept(axis, sweeps(&table.whole()?.waveforms())))
        }
        axis => Err(malformed(format!(
            "the first column must be `time` or `frequency`, found `{axis}`"
        ))),
    }
}

/// Whether the first column is what the signals of the others are over: a name without parentheses, as no signal has it.
fn is_swept(axis: &str, others: &[String]) -> bool {
    let is_signal = |name: &str| name.ends_with(')');
    !axis.is_empty() && !is_signal(axis) && others.iter().any(|name| is_signal(name))
}

fn malformed(reason: impl Into<String>) -> WaveformError {
    WaveformError::malformed(FORMAT, reason)
}

/// What a cell holds: a number, or nothing that can be drawn, as other programs write it; `None` for anything else.
fn value(cell: &str) -> Option<f64> {
    let value = match cell {
        "" => f64::NAN,
        _ => number(cell).ok()?,
    };
    Some(if value.is_finite() { value } else { f64::NAN })
}

/// Numbers under a header, those of the first column finite.
struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    /// Of each row.
    lines: Vec<u64>,
    /// The first cell that is empty or not finite, with its line.
    gap: Option<(u64, String)>,
    /// The rows at which runs of `.step` begin where lines say so, and what tells them apart.
    steps: Vec<(usize, String)>,
}

impl Table {
    fn read(from: impl Read) -> Result<Self, WaveformError> {
        let mut from = BufReader::new(from);
        let above = above(from.fill_buf().map_err(WaveformError::from)?);
        for _ in 0..above {
            from.skip_until(b'\n').map_err(WaveformError::from)?;
        }
        let start = from.fill_buf().map_err(WaveformError::from)?;
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(delimiter(start))
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(from);
        let header = reader.headers().map_err(unreadable)?;
        let mut names: Vec<String> = header.iter().map(str::to_owned).collect();
        if names.is_empty() {
            names.push(String::new());
        }
        let mut columns = vec![Vec::new(); names.len()];
        let (mut lines, mut gap, mut steps) = (Vec::new(), None, Vec::new());
        let mut scale: Option<Vec<f64>> = None;
        for record in reader.records() {
            let record = record.map_err(unreadable)?;
            let line = above + record.position().map_or(0, csv::Position::line);
            if let Some(label) = record.get(0).and_then(step) {
                steps.push((lines.len(), label.to_owned()));
                continue;
            }
            if lines.is_empty() && scale.is_none() && record.len() == names.len() {
                scale = units(record.iter());
                if scale.is_some() {
                    continue;
                }
            }
            if record.len() != names.len() {
                return Err(malformed(format!(
                    "line {line}: {} cells where the header has {}",
                    record.len(),
                    names.len()
                )));
            }
            for (j, (cell, column)) in record.iter().zip(&mut columns).enumerate() {
                let value = value(cell).filter(|value| j > 0 || value.is_finite());
                let value = value.ok_or_else(|| not_finite(line, cell))?;
                if value.is_nan() && gap.is_none() {
                    gap = Some((line, cell.to_owned()));
                }
                let factor = scale.as_ref().map_or(1.0, |scale| scale[j]);
                column.push(factor * value);
            }
            lines.push(line);
        }
        Ok(Self {
            names,
            columns,
            lines,
            gap,
            steps,
        })
    }

    /// Itself, without gaps.
    ///
    /// # Errors
    /// [`WaveformError::Malformed`] with the line of the first one.
    fn whole(self) -> Result<Self, WaveformError> {
        match &self.gap {
            Some((line, cell)) => Err(not_finite(*line, cell)),
            None => Ok(self),
        }
    }

    fn waveforms(mut self) -> Waveforms {
        let time = self.columns.remove(0);
        self.names.remove(0);
        Waveforms::from_columns(String::new(), self.names, time, &self.columns)
    }

    /// The runs that lines of [`Self::steps`] begin.
    fn stepped(self) -> Vec<(String, Waveforms)> {
        let steps = self.steps.clone();
        let all = self.waveforms();
        let ends = steps.iter().skip(1).map(|(row, _)| *row);
        let ends = ends.chain([all.len()]);
        let run = |((first, label), end): (&(usize, String), usize)| {
            let own = Waveforms {
                title: all.title.clone(),
                names: all.names.clone(),
                units: all.units.clone(),
                time: all.time[*first..end].to_vec(),
                values: (*first..end).flat_map(|k| all.row(k).to_vec()).collect(),
            };
            (label.clone(), own)
        };
        steps.iter().zip(ends).map(run).collect()
    }

    fn phasors(mut self) -> Result<Phasors, WaveformError> {
        let frequency = self.columns.remove(0);
        let name = |pair: &[String]| {
            let re = pair[0].strip_prefix("re(")?.strip_suffix(')')?;
            let im = pair.get(1)?.strip_prefix("im(")?.strip_suffix(')')?;
            (re == im).then(|| re.to_owned())
        };
        let pairs = self.names[1..].chunks(2);
        let names: Option<Vec<String>> = pairs.map(name).collect();
        let names = names.ok_or_else(|| {
            malformed("columns over frequency must be `re(signal)` and `im(signal)` in turn")
        })?;
        let value = |k: usize, pair: &[Vec<f64>]| Complex::new(pair[0][k], pair[1][k]);
        let values = (0..frequency.len())
            .flat_map(|k| self.columns.chunks(2).map(move |pair| value(k, pair)))
            .collect();
        Ok(Phasors {
            title: String::new(),
            units: names.iter().map(|name| phasors::unit(name)).collect(),
            names,
            frequency,
            values,
        })
    }
}

fn not_finite(line: u64, cell: &str) -> WaveformError {
    let hint = if cell.contains("dB") {
        "; of decibels and degrees export real and imaginary parts instead, or view the .raw file"
    } else {
        ""
    };
    malformed(format!(
        "line {line}: `{cell}` is not a finite number{hint}"
    ))
}

fn unreadable(error: csv::Error) -> WaveformError {
    match error.kind() {
        csv::ErrorKind::Utf8 { pos, .. } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            malformed(format!(
                "line {line}: a character that is not UTF-8; where it is the `°` of decibels and degrees export real and imaginary parts instead, or view the .raw file"
            ))
        }
        _ => malformed(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn a_tab_or_a_semicolon_stands_between_cells_and_a_comma_before_decimals() {
        for text in [
            "time\tV(a,b)\tI(L1)\n0\t1\t2\n1e-3\t3\t4\n",
            "time;v(a);i(l1)\n0;1;2\n1e-3;3;4\n",
            "Time;V(a,b);I(L1)\n0;1,0;2\n0,001;3,0E0;4\n",
        ] {
            let table = Table::read(text.as_bytes()).unwrap();
            assert_eq!(table.columns, [[0.0, 1e-3], [1.0, 3.0], [2.0, 4.0]]);
        }
    }

    #[test]
    fn what_is_written_reads_back_to_the_same_doubles() {
        let mut text = Vec::new();
        write(&mut text, &sample()).unwrap();
        let back = read(&text[..]).unwrap();
        assert_eq!(
            back,
            Waveforms {
                title: String::new(),
                ..sample()
            }
        );
        assert!(
            String::from_utf8(text)
                .unwrap()
                .starts_with("time,\"v(a,b)\",i(v1)\n0.0000000000000000e0,")
        );
    }

    #[test]
    fn cells_have_seventeen_digits_that_read_back() {
        let of = |value: f64| {
            let mut text = Vec::new();
            cell(value, &mut text);
            String::from_utf8(text).unwrap()
        };
        for (value, text) in [
            (0.0, "0.0000000000000000e0"),
            (-0.0, "-0.0000000000000000e0"),
            (0.1, "1.0000000000000000e-1"),
            (-12.5, "-1.2500000000000000e1"),
            (1e-7, "1.0000000000000000e-7"),
            (1e22, "1.0000000000000000e22"),
            (123_456_789_012_345_680_000.0, "1.2345678901234568e20"),
            (0.000_123_4, "1.2340000000000000e-4"),
            (f64::MAX, "1.7976931348623157e308"),
            (f64::from_bits(1), "5.0000000000000000e-324"),
        ] {
            assert_eq!(of(value), text);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert!(of(f64::NAN).parse::<f64>().unwrap().is_nan());
        assert_eq!(of(f64::NEG_INFINITY), "-inf");
        // Bits without a pattern.
        let mut bits = 0x0123_4567_89ab_cdef_u64;
        for _ in 0..10_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let value = f64::from_bits(bits);
            if value.is_finite() {
                let text = of(value);
                assert_eq!(text.parse::<f64>().unwrap().to_bits(), bits, "{text}");
                let digits = text.split('e').next().unwrap().bytes();
                assert_eq!(digits.filter(u8::is_ascii_digit).count(), DIGITS, "{text}");
            }
        }
    }

    #[test]
    fn time_may_have_its_unit() {
        for header in ["time", "Time (s)", "t[s]", "Second"] {
            let text = format!("{header},CH1\n0,1\n1e-3,2\n");
            let read = read(text.as_bytes());
            assert_eq!(
                read.map(|waves| waves.time).ok(),
                Some(vec![0.0, 1e-3]),
                "{header}"
            );
        }
        // In milliseconds it would be another file.
        assert!(read(&b"time (ms),CH1\n0,1\n1,2\n"[..]).is_err());
    }

    /// As Tektronix and Siglent write them; with their lines, and units that are none of seconds refused.
    #[test]
    fn what_oscilloscopes_tell_above_the_names_is_passed_over() {
        let above = "Model,MDO34\nSample Interval,1e-3\nRecord Length,2\n,\n";
        let waves = read(format!("{above}TIME,CH1\n0,1\n1e-3,2\n").as_bytes()).expect("waveforms");
        assert_eq!(
            (waves.names, waves.time),
            (vec!["CH1".to_owned()], vec![0.0, 1e-3])
        );
        let wrong = read(format!("{above}TIME,CH1\n0,1\n1e-3,x\n").as_bytes());
        assert!(
            wrong.unwrap_err().to_string().contains("line 7"),
            "its own line"
        );
        for header in ["(ms),(V)", "Time (ms),CH1"] {
            assert!(
                read(format!("{above}{header}\n0,1\n1,2\n").as_bytes()).is_err(),
                "{header}"
            );
        }
    }

    #[test]
    fn a_line_of_units_below_the_names_scales_the_columns() {
        for text in [
            "time,v(a),i(l1)\nms,mV,A\n0,1,2\n1,3,4\n",
            "Time;v(a);i(l1)\n(ms);(mV);(A)\n\n0;1;2\n1,0;3;4\n",
            "Model,5444B\nBits,12\nTime,v(a),i(l1)\n[ms],[mV],[A]\n0,1,2\n1,3,4\n",
        ] {
            let table = Table::read(text.as_bytes()).expect("a table");
            assert_eq!(table.names[1..], ["v(a)", "i(l1)"]);
            assert_eq!(
                table.columns,
                [[0.0, 1e-3], [1e-3, 3e-3], [2.0, 4.0]],
                "{text}"
            );
        }
        assert!(read(&b"time,v(a)\nminutes,V\n0,1\n"[..]).is_err());
    }

    #[test]
    fn lines_of_ltspice_begin_the_runs_of_a_step() {
        let text = "time\tV(out)\nStep Information: R=1K  (Run: 1/2)\n0\t1\n1e-3\t2\nStep Information: R=2K  (Run: 2/2)\n0\t3\n2e-3\t4\n";
        let Ok(Plot::Time(runs)) = plot(text.as_bytes()) else {
            panic!("a plot over time")
        };
        let of =
            |(label, w): &(String, Waveforms)| (label.clone(), w.time.clone(), w.values.clone());
        assert_eq!(
            runs.iter().map(of).collect::<Vec<_>>(),
            [
                ("R=1K".to_owned(), vec![0.0, 1e-3], vec![1.0, 2.0]),
                ("R=2K".to_owned(), vec![0.0, 2e-3], vec![3.0, 4.0]),
            ]
        );
    }

    #[test]
    fn what_is_no_number_is_a_gap_of_a_plot_but_not_of_its_axis() {
        let text = "time,v(a),v(b)\n0,nan,1\n1,2,\n2,-Inf,3\n";
        let Ok(Plot::Time(runs)) = plot(text.as_bytes()) else {
            panic!("a plot over time")
        };
        let (_, waves) = &runs[0];
        let column = |j| waves.column(j).map(|v| v.to_string()).collect::<Vec<_>>();
        assert_eq!(column(0), ["NaN", "2", "NaN"]);
        assert_eq!(column(1), ["1", "NaN", "3"]);
        assert_eq!(waves.gaps(), Some((3, 0, 0)));
        for text in [
            "time,v(a)\n,1\n",
            "time,v(a)\nnan,1\n",
            "time,v(a)\n0,none\n",
            "frequency,re(v(a)),im(v(a))\n1,1,\n",
        ] {
            assert!(plot(text.as_bytes()).is_err(), "{text}");
        }
    }

    #[test]
    fn an_export_with_degrees_in_another_encoding_is_told() {
        let text = b"Freq.\tV(a)\n1\t(-1dB,-2\xb0)\n";
        let error = plot(&text[..]).expect_err("no numbers").to_string();
        assert!(
            error.contains("line 2: a character that is not UTF-8"),
            "{error}"
        );
    }

    #[test]
    fn faults_are_named_with_their_line() {
        for (text, reason) in [
            (
                "x,v(a)\n0,1\n",
                "the first column must be `time`, found `x`",
            ),
            ("", "the first column must be `time`, found ``"),
            (
                "# by hand\ntime,v(a)\n0,1\n1,1v\n",
                "line 4: `1v` is not a finite number",
            ),
            ("time,v(a)\n0,nan\n", "line 2: `nan` is not a finite number"),
            ("time,v(a)\n0,\n", "line 2: `` is not a finite number"),
            (
                "time\tV(a)\n0\t(-1dB,-2°)\n",
                "line 2: `(-1dB,-2°)` is not a finite number; of decibels and degrees export real and imaginary parts instead, or view the .raw file",
            ),
            (
                "time,v(a)\n0,1,2\n",
                "line 2: 3 cells where the header has 2",
            ),
            ("time,v(a)\n1,1\n0,1\n", "line 3: time runs backwards"),
        ] {
            let error = read(text.as_bytes()).unwrap_err().to_string();
            assert_eq!(error, format!("not a csv file of waveforms: {reason}"));
        }
    }
}
