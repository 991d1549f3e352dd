//! Pages in the user's browser.

use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::Builder;

use super::exit::Failure;
use super::streams::Streams;

/// A new place for a page among temporary files, which stays.
///
/// # Errors
/// Those of the folder.
pub(super) fn place() -> Result<PathBuf, Failure> {
    let file = Builder::new().prefix("circ-").suffix(".html").tempfile()?;
    let (_, path) = file.keep().map_err(|e| Failure::Stream(e.error))?;
    Ok(path)
}

/// Writes a page to such a place.
///
/// # Errors
/// Those of the file.
pub(super) fn keep(page: &[u8]) -> Result<PathBuf, Failure> {
    let path = place()?;
    let written = std::fs::File::create(&path).and_then(|mut file| file.write_all(page));
    written.map_err(|error| Failure::file(&path, error))?;
    Ok(path)
}

/// Shows a page.
///
/// # Errors
/// [`Failure::Told`] where there is no browser; it says where the page is.
pub(super) fn show(path: &Path, streams: &Streams) -> Result<(), Failure> {
    let place = path.display();
    open::that_detached(path).map_err(|error| {
        Failure::told(
            "browser",
            format!("no browser could be opened ({error}); the page is {place}"),
        )
    })?;
    streams.say(format!("the page is {place}"));
    Ok(())
}
