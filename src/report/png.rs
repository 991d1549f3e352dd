//! Pictures as PNG: the SVG drawing rasterised, with the DejaVu font that the program carries.

use std::sync::Arc;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use super::PictureError;

/// Pixels per CSS pixel of the drawing.
const SCALE: f32 = 2.0;

/// Rasterises an SVG document at twice its nominal size.
///
/// # Errors
/// [`PictureError::Raster`] when the text is not SVG or the picture is too large.
pub fn from_svg(svg: &str) -> Result<Vec<u8>, PictureError> {
    let failed = |reason: String| PictureError::Raster(reason);
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    let family = "DejaVu Sans";
    fonts.set_sans_serif_family(family);
    fonts.set_serif_family(family);
    let options = Options {
        fontdb: Arc::new(fonts),
        font_family: family.into(),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options).map_err(|e| failed(e.to_string()))?;
    let size = tree.size();
    let pixels = |length: f32| (length * SCALE).ceil() as u32;
    let mut pixmap = Pixmap::new(pixels(size.width()), pixels(size.height()))
        .ok_or_else(|| failed(format!("{} × {} is no size", size.width(), size.height())))?;
    resvg::render(
        &tree,
        Transform::from_scale(SCALE, SCALE),
        &mut pixmap.as_mut(),
    );
    pixmap.encode_png().map_err(|e| failed(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel_sum(svg_body: &str) -> u64 {
        let svg = format!(
            "<svg width=\"40\" height=\"20\" xmlns=\"http://www.w3.org/2000/svg\">{svg_body}</svg>"
        );
        let png = from_svg(&svg).unwrap();
        let pixmap = Pixmap::decode_png(&png).unwrap();
        assert_eq!((pixmap.width(), pixmap.height()), (80, 40));
        pixmap.data().iter().map(|&b| u64::from(b)).sum()
    }

    #[test]
    fn lines_and_letters_leave_ink_without_any_installed_font() {
        assert_eq!(pixel_sum(""), 0);
        assert!(pixel_sum("<line x1=\"0\" y1=\"0\" x2=\"40\" y2=\"20\" stroke=\"black\"/>") > 0);
        assert!(pixel_sum("<text x=\"5\" y=\"15\" font-family=\"sans-serif\">µV</text>") > 0);
        assert!(pixel_sum("<text x=\"5\" y=\"15\" font-family=\"Times New Roman\">µV</text>") > 0);
    }

    #[test]
    fn something_else_is_refused() {
        assert!(matches!(
            from_svg("time,v(a)"),
            Err(PictureError::Raster(_))
        ));
    }
}
