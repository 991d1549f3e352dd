//! From results to words and pictures; nothing is computed here.
//!
//! A [`Figure`](figure::Figure) says what is to be seen; [`svg`] draws it, [`png`] rasterises the drawing with an embedded
//! font, [`html`] puts it on a page. [`schematic`] draws a circuit. [`text`] and [`json`] are the summaries, [`terminal`] plots with characters.

mod axis;
pub mod bode;
pub mod figure;
pub mod graph;
pub mod html;
pub mod json;
pub mod log;
pub mod means;
pub mod measured;
pub mod schematic;
pub mod sensitivity;
mod sheet;
pub mod si;
pub mod steps;
pub mod svg;
pub mod table;
pub mod terminal;
pub mod text;
pub mod work;

#[cfg(feature = "plot")]
pub mod png;

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// There is nothing to show.
    #[error("nothing to draw: {0}")]
    Empty(&'static str),
    /// A circuit of so many parts.
    #[error("a circuit of {0} elements is not drawn; its graph can be written as dot")]
    Large(usize),
    /// The data of a page are no JSON.
    #[error("the page could not be written: {0}")]
    Page(#[from] serde_json::Error),
    /// The rasteriser refused.
    #[error("the picture could not be rasterised: {0}")]
    Raster(String),
}
