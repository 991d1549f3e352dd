//! ngspice's raw files: a text header, then doubles in binary (little endian) or as text.
//!
//! What [`write()`] writes loads in ngspice (`load run.raw`) and in the Python package `spicelib`. The header carries no date,
//! so equal runs are equal bytes. [`read()`] takes the first transient of a file; [`super::plots`] takes everything over time, frequency or what was swept, and LTspice's files
//! too.

mod read;

use std::io::Write;

use super::Waveforms;

pub(super) use read::plots;
pub use read::read;

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
