//! NumPy's archive: `numpy.load("run.npz")["v(out)"]` is a vector of doubles, `["time"]` the times.
//!
//! Members are stored uncompressed with the archive format's earliest date, so that equal runs are equal bytes.

use std::io::{Read, Seek, Write};

use nalgebra::Complex;
use npyz::WriterBuilder;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::plot::runs;
use super::{Phasors, Plot, WaveformError, Waveforms, phasors};

const FORMAT: &str = "npz";
/// The archive's format has room for so many bytes.
const LONGEST_COMMENT: usize = u16::MAX as usize;

/// Writes one vector for `time` and one per name; the title is the archive's comment.
///
/// # Errors
/// Those of `to`.
pub fn write(to: impl Write + Seek, waves: &Waveforms) -> std::io::Result<()> {
    let mut archive = ZipWriter::new(to);
    member(&mut archive, "time", waves.time.iter().copied())?;
    for (j, name) in waves.names.iter().enumerate() {
        member(&mut archive, name, waves.column(j))?;
    }
    let mut comment = String::new();
    for c in waves.title.chars() {
        if comment.len() + c.len_utf8() <= LONGEST_COMMENT {
            comment.push(c);
        }
    }
    archive.set_comment(comment)?;
    archive.finish()?.flush()
}

/// Writes one vector of doubles per name.
///
/// # Errors
/// Those of `to`.
pub fn write_columns<'a>(
    to: impl Write + Seek,
    columns: impl IntoIterator<Item = (&'a str, &'a [f64])>,
) -> std::io::Result<()> {
    let mut archive = ZipWriter::new(to);
    for (name, values) in columns {
        member(&mut archive, name, values.iter().copied())?;
    }
    archive.finish()?.flush()
}

/// Writes one vector for `frequency` and a complex one per name.
pub(super) fn write_phasors(to: impl Write + Seek, phasors: &Phasors) -> std::io::Result<()> {
    let mut archive = ZipWriter::new(to);
    member(&mut archive, "frequency", phasors.frequency.iter().copied())?;
    for (j, name) in phasors.names.iter().enumerate() {
        member(&mut archive, name, phasors.column(j))?;
    }
    archive.finish()?.flush()
}

fn member<W: Write + Seek, T: npyz::AutoSerialize>(
    archive: &mut ZipWriter<W>,
    name: &str,
    values: impl ExactSizeIterator<Item = T>,
) -> std::io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::DEFAULT)
        .large_file(values.len() > (u32::MAX / 16) as usize);
    archive.start_file(format!("{name}.npy"), options)?;
    let mut array = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[values.len() as u64])
        .writer(archive)
        .begin_nd()?;
    array.extend(values)?;
    array.finish()
}

/// Reads an archive of vectors of doubles of one length, one of them `time`; columns keep the archive's order.
///
/// # Errors
/// [`WaveformError::Malformed`] when it is no archive, `time` is missing, or a member is not such a vector.
pub fn read(from: impl Read + Seek) -> Result<Waveforms, WaveformError> {
    let mut archive = ZipArchive::new(from).map_err(|e| malformed(e.to_string()))?;
    let (time, names, columns) = vectors::<_, f64>(&mut archive, "time")?;
    Ok(Waveforms::from_columns(
        String::new(),
        names,
        time,
        &columns,
    ))
}

/// Reads the same, or where there is a member `frequency` complex vectors over it.
///
/// # Errors
/// See [`read`].
pub(super) fn plot(mut from: impl Read + Seek) -> Result<Plot, WaveformError> {
    let mut archive = ZipArchive::new(&mut from).map_err(|e| malformed(e.to_string()))?;
    if archive.index_for_name("frequency.npy").is_none() {
        from.rewind()?;
        return read(from).map(|waves| Plot::Time(runs(&waves)));
    }
    let (frequency, names, columns) = vectors::<_, Complex<f64>>(&mut archive, "frequency")?;
    let rows = 0..frequency.len();
    Ok(Plot::Frequency(Phasors {
        title: String::new(),
        units: names.iter().map(|name| phasors::unit(name)).collect(),
        values: rows
            .flat_map(|k| columns.iter().map(move |column| column[k]))
            .collect(),
        names,
        frequency,
    }))
}

/// The vector of this axis, then names and vectors of all other members.
type Vectors<T> = (Vec<f64>, Vec<String>, Vec<Vec<T>>);

fn vectors<R: Read + Seek, T: npyz::Deserialize>(
    archive: &mut ZipArchive<R>,
    axis: &str,
) -> Result<Vectors<T>, WaveformError> {
    let mut along = None;
    let (mut names, mut columns) = (Vec::new(), Vec::new());
    for k in 0..archive.len() {
        let file = archive.by_index(k).map_err(|e| malformed(e.to_string()))?;
        let name = file.name().map_err(|e| malformed(e.to_string()))?;
        let name = name.trim_end_matches(".npy").to_owned();
        let wrong = |e: std::io::Error| malformed(format!("`{name}`: {e}"));
        let array = npyz::NpyFile::new(file).map_err(wrong)?;
        if name == axis {
            along = Some(array.into_vec().map_err(wrong)?);
        } else {
            columns.push(array.into_vec().map_err(wrong)?);
            names.push(name);
        }
    }
    let along: Vec<f64> = along.ok_or_else(|| malformed(format!("no member `{axis}`")))?;
    if let Some(j) = columns.iter().position(|c| c.len() != along.len()) {
        let (name, found, rows) = (&names[j], columns[j].len(), along.len());
        return Err(malformed(format!(
            "`{name}` has {found} values for {rows} rows of `{axis}`"
        )));
    }
    Ok((along, names, columns))
}

fn malformed(reason: impl Into<String>) -> WaveformError {
    WaveformError::malformed(FORMAT, reason)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::tests::sample;
    use super::*;

    #[test]
    fn what_is_written_reads_back_and_is_the_same_bytes_each_time() {
        let bytes = || {
            let mut to = Cursor::new(Vec::new());
            write(&mut to, &sample()).unwrap();
            to.into_inner()
        };
        let first = bytes();
        assert_eq!(
            read(Cursor::new(&first)).unwrap(),
            Waveforms {
                title: String::new(),
                ..sample()
            }
        );
        assert_eq!(first, bytes());
    }

    #[test]
    fn something_else_is_refused() {
        let error = read(Cursor::new(b"time,v(a)\n".as_slice()))
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("not a npz file of waveforms: "),
            "{error}"
        );
    }
}
