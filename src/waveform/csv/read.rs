//! Reading of comma-separated values, and of what other programs export in their place.

use std::io::{BufRead, BufReader, Read};

use nalgebra::Complex;

use super::head::{above, delimiter, is_time, number, step, units};
use crate::waveform::plot::{runs, sweeps};
use crate::waveform::{Phasors, Plot, WaveformError, Waveforms, phasors};

const FORMAT: &str = "csv";

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
pub(in crate::waveform) fn plot(from: impl Read) -> Result<Plot, WaveformError> {
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
