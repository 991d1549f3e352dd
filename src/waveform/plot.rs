//! Files of waveforms whatever they are: over time, over frequency or over what was swept, of one run or of several.

use std::io::Cursor;

use super::{Phasors, WaveformError, Waveforms, csv, json, npz, raw};

/// Columns over one axis.
#[derive(Debug, Clone, PartialEq)]
pub enum Plot {
    /// Over time: a run, or those of `.step` under what tells them apart.
    Time(Vec<(String, Waveforms)>),
    /// Over frequency.
    Frequency(Phasors),
    /// Over what `.dc` swept, by its name: as over time, with its values in the place of times.
    Swept(String, Vec<(String, Waveforms)>),
}

/// Reads everything over time, frequency or what was swept that a file holds; what the file begins with says whether it is NPZ, JSON, raw or CSV.
///
/// # Errors
/// [`WaveformError::Malformed`] where the file is none of them or is damaged.
pub fn plots(bytes: &[u8]) -> Result<Vec<Plot>, WaveformError> {
    const TITLE: &[u8] = b"title:";
    let narrow: Vec<u8> = bytes
        .iter()
        .copied()
        .filter(|b| *b != 0)
        .take(TITLE.len())
        .collect();
    if bytes.starts_with(b"PK") {
        return npz::plot(Cursor::new(bytes)).map(|plot| vec![plot]);
    }
    if narrow.eq_ignore_ascii_case(TITLE) {
        return raw::plots(bytes);
    }
    if bytes.trim_ascii_start().starts_with(b"{") {
        return json::plot(bytes).map(|plot| vec![plot]);
    }
    csv::plot(bytes).map(|plot| vec![plot])
}

/// Runs that follow each other in one table: time begins anew with each. Columns that are no signals (`r1`, not `v(out)`) name the run.
pub(super) fn runs(waves: &Waveforms) -> Vec<(String, Waveforms)> {
    let rows: Vec<usize> = (0..waves.len()).collect();
    let parts: Vec<&[usize]> = rows
        .chunk_by(|a, b| waves.time[*a] <= waves.time[*b])
        .collect();
    let [_, _, ..] = parts[..] else {
        return vec![(String::new(), waves.clone())];
    };
    let is_value = |j: &usize| !waves.names[*j].contains(['(', '#', '@']);
    let (values, signals): (Vec<usize>, Vec<usize>) = (0..waves.width()).partition(is_value);
    // Bare words may be all there is.
    let (values, signals) = if signals.is_empty() {
        (Vec::new(), values)
    } else {
        (values, signals)
    };
    let run = |(number, rows): (usize, &&[usize])| {
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        let words = values
            .iter()
            .map(|&j| format!("{}={}", waves.names[j], waves.row(first)[j]));
        let label = if values.is_empty() {
            format!("run {}", number + 1)
        } else {
            words.collect::<Vec<_>>().join(" ")
        };
        let own = Waveforms {
            title: waves.title.clone(),
            names: signals.iter().map(|&j| waves.names[j].clone()).collect(),
            units: signals.iter().map(|&j| waves.units[j]).collect(),
            time: waves.time[first..=last].to_vec(),
            values: rows
                .iter()
                .flat_map(|&k| signals.iter().map(move |&j| waves.row(k)[j]))
                .collect(),
        };
        (label, own)
    };
    parts.iter().enumerate().map(run).collect()
}

/// The same of a sweep, whose values may fall.
pub(super) fn sweeps(waves: &Waveforms) -> Vec<(String, Waveforms)> {
    match waves.time[..] {
        [first, second, ..] if second < first => runs(&backwards(waves)),
        _ => runs(waves),
    }
}

fn backwards(waves: &Waveforms) -> Waveforms {
    let rows = (0..waves.len()).rev();
    Waveforms {
        time: waves.time.iter().rev().copied().collect(),
        values: rows.flat_map(|k| waves.row(k).to_vec()).collect(),
        ..waves.clone()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use nalgebra::Complex;

    use super::super::tests::sample;
    use super::*;

    fn phasors() -> Phasors {
        Phasors {
            title: "two".into(),
            names: vec!["v(a,b)".into(), "v(out)/i(v1)".into()],
            units: vec!["V", ""],
            frequency: vec![1.0, 1e3],
            values: [(0.1, -0.2), (1.0 / 3.0, 1e-300), (0.0, 5.0), (-7.0, 0.5)]
                .map(|(re, im)| Complex::new(re, im))
                .into(),
        }
    }

    /// The same numbers; titles and units are not in every format.
    fn same(plot: &Plot, expected: &Plot) {
        match (plot, expected) {
            (Plot::Time(a), Plot::Time(b)) => {
                let parts = |(label, w): &(String, Waveforms)| {
                    (
                        label.clone(),
                        w.names.clone(),
                        w.time.clone(),
                        w.values.clone(),
                    )
                };
                assert_eq!(
                    a.iter().map(parts).collect::<Vec<_>>(),
                    b.iter().map(parts).collect::<Vec<_>>()
                );
            }
            (Plot::Frequency(a), Plot::Frequency(b)) => assert_eq!(
                (&a.names, &a.frequency, &a.values),
                (&b.names, &b.frequency, &b.values)
            ),
            other => panic!("{other:?}"),
        }
    }

    fn written(write: impl FnOnce(&mut Cursor<Vec<u8>>) -> std::io::Result<()>) -> Vec<u8> {
        let mut to = Cursor::new(Vec::new());
        write(&mut to).unwrap();
        to.flush().unwrap();
        to.into_inner()
    }

    #[test]
    fn every_format_is_known_by_its_beginning_and_reads_back_to_the_same_doubles() {
        let waves = sample();
        let phasors = phasors();
        let over_time = Plot::Time(vec![(String::new(), waves.clone())]);
        for bytes in [
            written(|to| csv::write(to, &waves)),
            written(|to| raw::write(to, &waves)),
            written(|to| npz::write(to, &waves)),
            written(|to| json::write(to, &waves)),
        ] {
            same(&plots(&bytes).unwrap()[0], &over_time);
        }
        for bytes in [
            written(|to| phasors.write_csv(to)),
            written(|to| phasors.write_raw(to)),
            written(|to| phasors.write_npz(to)),
            written(|to| phasors.write_json(to)),
        ] {
            same(
                &plots(&bytes).unwrap()[0],
                &Plot::Frequency(phasors.clone()),
            );
        }
    }

    #[test]
    fn runs_that_follow_each_other_are_told_apart() {
        let text = "time,v(a),r1\n0,1,10\n1,2,10\n0,3,20\n1,4,20\n";
        let Plot::Time(runs) = &plots(text.as_bytes()).unwrap()[0] else {
            panic!()
        };
        let shown: Vec<_> = runs
            .iter()
            .map(|(label, w)| (label.as_str(), &w.names[..], &w.values[..]))
            .collect();
        let names = ["v(a)".to_owned()];
        assert_eq!(
            shown,
            [
                ("r1=10", &names[..], &[1.0, 2.0][..]),
                ("r1=20", &names[..], &[3.0, 4.0][..])
            ]
        );
    }

    #[test]
    fn sweeps_are_told_by_the_values_of_others_and_may_fall() {
        let rising = "v1,v(a),r1\n0,1,10\n2,2,10\n0,3,20\n2,4,20\n";
        let falling = "v1,v(a),r1\n2,4,20\n0,3,20\n2,2,10\n0,1,10\n";
        let raw = |rows: &str| {
            format!(
                "Title: t\nPlotname: DC transfer characteristic\nFlags: real\nNo. Variables: 2\nNo. Points: 2\nVariables:\n\
                 \t0\tv(v-sweep)\tvoltage\n\t1\tv(a)\tvoltage\nValues:\n{rows}"
            )
        };
        let shown = |text: &str| {
            let Plot::Swept(axis, runs) = plots(text.as_bytes()).unwrap().remove(0) else {
                panic!("{text}")
            };
            let runs = runs
                .into_iter()
                .map(|(label, w)| (label, w.names, w.time, w.values));
            (axis, runs.collect::<Vec<_>>())
        };
        let run = |label: &str, values: [f64; 2]| {
            (
                label.to_owned(),
                vec!["v(a)".to_owned()],
                vec![0.0, 2.0],
                values.to_vec(),
            )
        };
        let expected = [run("r1=10", [1.0, 2.0]), run("r1=20", [3.0, 4.0])];
        for text in [rising, falling] {
            assert_eq!(shown(text), ("v1".into(), expected.to_vec()));
        }
        for rows in ["0 0\n1\n1 2\n2\n", "0 2\n2\n1 0\n1\n"] {
            let expected = vec![run("", [1.0, 2.0])];
            assert_eq!(shown(&raw(rows)), ("v(v-sweep)".into(), expected));
        }
        // An operating point is no sweep.
        let point =
            raw("0 0\n1\n1 2\n2\n").replace("DC transfer characteristic", "Operating Point");
        assert_eq!(plots(point.as_bytes()).unwrap(), []);
    }

    #[test]
    fn what_is_nothing_of_all_is_refused() {
        for bytes in [
            &b""[..],
            b"\0\0\0",
            b"PK..",
            b"{}",
            b"Title: x\n",
            b"x,y\n1,2\n",
            &[255; 40],
        ] {
            assert!(plots(bytes).is_err(), "{bytes:?}");
        }
    }
}
