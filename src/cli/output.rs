//! Files of results: the ending chooses the format.

use std::fs::File;
use std::io::{self, BufWriter, Cursor, Write};
use std::path::Path;

use super::exit::Failure;
use crate::integrate::Run;
use crate::report::figure::Figure;
use crate::report::{PictureError, html, png, svg};
use crate::waveform::{csv, json, npz, raw};

/// Formats of a run's results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// ngspice's binary format.
    Raw,
    /// NumPy's archive.
    Npz,
    /// JSON.
    Json,
    /// A drawing.
    Svg,
    /// A picture.
    Png,
    /// A page.
    Html,
}

impl Format {
    /// The format that a file's ending names.
    ///
    /// # Errors
    /// A message that lists the known endings.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        Ok(match ending.as_deref() {
            Some("csv") => Self::Csv,
            Some("raw") => Self::Raw,
            Some("npz") => Self::Npz,
            Some("json") => Self::Json,
            Some("svg") => Self::Svg,
            Some("png") => Self::Png,
            Some("html" | "htm") => Self::Html,
            _ => {
                return Err(unknown_ending(
                    path,
                    "csv, raw, npz, json, svg, png or html",
                ));
            }
        })
    }
}

/// The failure that a file's ending chooses none of these formats.
pub(super) fn unknown_ending(path: &Path, known: &str) -> Failure {
    Failure::Message(format!(
        "{}: the ending chooses the format and must be {known}",
        path.display()
    ))
}

/// Writes a run to a file; pictures show `figure`.
///
/// # Errors
/// Those of the file, or of drawing a picture.
pub fn write(
    run: &Run,
    figure: &dyn Fn() -> Figure,
    format: Format,
    path: &Path,
) -> Result<(), Failure> {
    let waves = &run.waveforms;
    // A picture is made before its file, so that a failure leaves none behind.
    match format {
        Format::Csv => to_file(path, |file| csv::write(file, waves)),
        Format::Raw => to_file(path, |file| raw::write(file, waves)),
        Format::Json => to_file(path, |file| json::write(file, waves)),
        Format::Npz => {
            let mut bytes = Cursor::new(Vec::new());
            npz::write(&mut bytes, waves).map_err(|e| Failure::file(path, e))?;
            bytes_to_file(path, bytes.get_ref())
        }
        Format::Html => bytes_to_file(path, html::page(run, &figure())?.as_bytes()),
        Format::Svg => picture_to_file(path, &svg::draw(&figure())?),
        Format::Png => picture_to_file(path, &svg::draw(&figure())?),
    }
}

/// Writes a drawing as it is, or rasterised where the file's ending is `png`.
///
/// # Errors
/// Those of the file and of rasterising.
pub fn picture_to_file(path: &Path, drawing: &str) -> Result<(), Failure> {
    let is_png = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let rasterised: Result<Vec<u8>, PictureError> = if is_png {
        png::from_svg(drawing)
    } else {
        Ok(drawing.as_bytes().to_vec())
    };
    bytes_to_file(path, &rasterised?)
}

/// Writes bytes to a new file.
///
/// # Errors
/// Those of the file.
pub fn bytes_to_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    to_file(path, |file| file.write_all(bytes))
}

fn to_file(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Failure> {
    let write = || {
        let mut file = BufWriter::new(File::create(path)?);
        content(&mut file)?;
        file.flush()
    };
    write().map_err(|e| Failure::file(path, e))
}
