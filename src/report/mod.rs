//! From results to words and pictures; nothing is computed here.
//!
//! A [`Figure`](figure::Figure) says what is to be seen; [`svg`] draws it, [`png`] rasterises the drawing with an embedded
//! font, [`html`] puts it on a page. [`text`] and [`json`] are the summaries, [`terminal`] plots with characters.

pub mod json;
pub mod means;
pub mod measured;
pub mod sensitivity;
pub mod si;
pub mod steps;
pub mod table;
pub mod text;

#[cfg(feature = "plot")]
pub mod bode;
#[cfg(feature = "plot")]
pub mod figure;
#[cfg(feature = "plot")]
pub mod graph;
#[cfg(feature = "plot")]
pub mod html;
#[cfg(feature = "plot")]
pub mod png;
#[cfg(feature = "plot")]
pub mod svg;
#[cfg(feature = "plot")]
pub mod terminal;
#[cfg(feature = "plot")]
pub mod work;

/// Why a picture could not be made.
#[cfg(feature = "plot")]
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// There is nothing to show.
    #[error("nothing to draw: {0}")]
    Empty(&'static str),
    /// The drawing library refused.
    #[error("the picture could not be drawn: {0}")]
    Draw(String),
    /// The rasteriser refused.
    #[error("the picture could not be rasterised: {0}")]
    Raster(String),
}
