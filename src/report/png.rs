//! Pictures as PNG: the SVG drawing rasterised, with the DejaVu font that the program carries.
//!
//! The rasteriser knows no text: before it sees the drawing, the outlines of its letters take the place of each text.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::roxmltree::{Document, Node};
use resvg::usvg::{Options, Tree};
use skrifa::outline::DrawSettings;
use skrifa::outline::pen::SvgPen;
use skrifa::prelude::{FontRef, GlyphId, LocationRef, MetadataProvider, Size};
use skrifa::raw::TableProvider;
use skrifa::raw::tables::kern::{Subtable0, SubtableKind};

use super::PictureError;

/// Pixels per CSS pixel of the drawing.
const SCALE: f32 = 2.0;
/// The size of a text that has none, px.
const FONT_SIZE: f32 = 12.0;

/// Rasterises an SVG document at twice its nominal size.
///
/// A text is a line at its `x` and `y`, in px as its `font-size` is, at the side that `text-anchor` says; its font is ours, in which what
/// it has no letter for is a box.
///
/// # Errors
/// [`PictureError::Raster`] when the text is not SVG or the picture is too large.
pub fn from_svg(svg: &str) -> Result<Vec<u8>, PictureError> {
    let tree = Tree::from_str(&outlined(svg)?, &Options::default()).map_err(failed)?;
    let size = tree.size();
    let pixels = |length: f32| (length * SCALE).ceil() as u32;
    let mut pixmap = Pixmap::new(pixels(size.width()), pixels(size.height()))
        .ok_or_else(|| failed(format!("{} × {} is no size", size.width(), size.height())))?;
    resvg::render(
        &tree,
        Transform::from_scale(SCALE, SCALE),
        &mut pixmap.as_mut(),
    );
    pixmap.encode_png().map_err(failed)
}

fn failed(reason: impl ToString) -> PictureError {
    PictureError::Raster(reason.to_string())
}

/// The document with outlines in place of its texts.
fn outlined(svg: &str) -> Result<String, PictureError> {
    let document = Document::parse(svg).map_err(failed)?;
    let font = FontRef::new(dejavu::sans::regular()).map_err(failed)?;
    let mut drawing = String::new();
    let mut done = 0;
    for text in document.descendants().filter(|n| n.has_tag_name("text")) {
        let place = text.range();
        drawing.push_str(&svg[done..place.start]);
        drawing.push_str(&outline(text, svg, &font)?);
        done = place.end;
    }
    drawing.push_str(&svg[done..]);
    Ok(drawing)
}

/// The letters of a text, in a group that has the attributes of the text: its colour and its turn hold for them.
fn outline(text: Node<'_, '_>, svg: &str, font: &FontRef<'_>) -> Result<String, PictureError> {
    let own = |name| text.attribute(name).and_then(|value| value.parse().ok());
    let (x, y): (f32, f32) = (own("x").unwrap_or(0.0), own("y").unwrap_or(0.0));
    let (letters, width) = letters(text.text().unwrap_or_default(), font)?;
    let before = match text.attribute("text-anchor") {
        Some("middle") => width / 2.0,
        Some("end") => width,
        _ => 0.0,
    };
    let metrics = font.metrics(Size::unscaled(), LocationRef::default());
    let scale = own("font-size").unwrap_or(FONT_SIZE) / f32::from(metrics.units_per_em);
    let attributes: Vec<&str> = text.attributes().map(|a| &svg[a.range()]).collect();
    Ok(format!(
        "<g {}><g transform=\"translate({x} {y}) scale({scale} -{scale}) translate(-{before})\">{letters}</g></g>",
        attributes.join(" ")
    ))
}

/// The outlines of letters side by side, and their width, in units of the font.
fn letters(text: &str, font: &FontRef<'_>) -> Result<(String, f32), PictureError> {
    let (size, location) = (Size::unscaled(), LocationRef::default());
    let (codes, shapes, pairs) = (font.charmap(), font.outline_glyphs(), pairs(font));
    let metrics = font.glyph_metrics(size, location);
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let mut outlines = String::new();
    let mut width = 0.0;
    let mut last = None;
    for letter in words.join(" ").chars() {
        let glyph = codes.map(letter).unwrap_or(GlyphId::NOTDEF);
        let closer = |last| pairs.iter().find_map(|pairs| pairs.kerning(last, glyph));
        width += last.and_then(closer).unwrap_or_default() as f32;
        let mut pen = SvgPen::new();
        if let Some(shape) = shapes.get(glyph) {
            let settings = DrawSettings::unhinted(size, location);
            shape.draw(settings, &mut pen).map_err(failed)?;
        }
        outlines.push_str(&format!(
            "<path transform=\"translate({width})\" d=\"{pen}\"/>"
        ));
        width += metrics.advance_width(glyph).unwrap_or_default();
        last = Some(glyph);
    }
    Ok((outlines, width))
}

/// The pairs of letters that stand closer than others, and how much.
fn pairs<'a>(font: &FontRef<'a>) -> Vec<Subtable0<'a>> {
    let tables = font.kern().into_iter().flat_map(|kern| kern.subtables());
    let kinds = tables.filter_map(|table| table.and_then(|table| table.kind()).ok());
    let lists = kinds.filter_map(|kind| match kind {
        SubtableKind::Format0(pairs) => Some(pairs),
        _ => None,
    });
    lists.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drawing of 40 × 20 px.
    fn picture(svg_body: &str) -> Pixmap {
        let svg = format!(
            "<svg width=\"40\" height=\"20\" xmlns=\"http://www.w3.org/2000/svg\">{svg_body}</svg>"
        );
        let png = from_svg(&svg).unwrap();
        let pixmap = Pixmap::decode_png(&png).unwrap();
        assert_eq!((pixmap.width(), pixmap.height()), (80, 40));
        pixmap
    }

    fn text(attributes: &str, content: &str) -> Pixmap {
        picture(&format!("<text {attributes}>{content}</text>"))
    }

    fn pixel_sum(svg_body: &str) -> u64 {
        let pixmap = picture(svg_body);
        pixmap.data().iter().map(|&b| u64::from(b)).sum()
    }

    /// The first and last px with ink, across and down.
    fn ink(picture: &Pixmap) -> [(f32, f32); 2] {
        let (width, pixels) = (picture.width() as usize, picture.pixels().iter());
        let places = pixels.enumerate().filter(|(_, pixel)| pixel.alpha() > 0);
        let places: Vec<_> = places.map(|(k, _)| [k % width, k / width]).collect();
        [0, 1].map(|axis| {
            let along = || places.iter().map(|place| place[axis] as f32);
            let first = along().fold(f32::INFINITY, f32::min);
            let last = along().fold(f32::NEG_INFINITY, f32::max);
            (first / SCALE, (last + 1.0) / SCALE)
        })
    }

    #[test]
    fn lines_and_letters_leave_ink_without_any_installed_font() {
        assert_eq!(pixel_sum(""), 0);
        assert!(pixel_sum("<line x1=\"0\" y1=\"0\" x2=\"40\" y2=\"20\" stroke=\"black\"/>") > 0);
        assert!(pixel_sum("<text x=\"5\" y=\"15\" font-family=\"sans-serif\">µV</text>") > 0);
        assert!(pixel_sum("<text x=\"5\" y=\"15\" font-family=\"Times New Roman\">µV</text>") > 0);
    }

    #[test]
    fn letters_stand_where_their_text_is() {
        // A capital letter is 0.73 of the font's size high; `H` has a tenth of it free at its sides.
        let near = |found: f32, wanted: f32| (found - wanted).abs() <= 0.5;
        let at = "x=\"20\" y=\"15\" font-size=\"10\"";
        let [start, middle, end] = ["start", "middle", "end"]
            .map(|anchor| ink(&text(&format!("{at} text-anchor=\"{anchor}\""), "HH")));
        for [_, (top, bottom)] in [start, middle, end] {
            assert!(near(top, 7.7) && near(bottom, 15.0), "{top} to {bottom}");
        }
        assert!(near(start[0].0, 21.0) && near(end[0].1, 19.0));
        assert!(near(middle[0].0 + middle[0].1, 40.0), "{middle:?}");
        assert_eq!(ink(&text(at, "HH")), start);
        assert_eq!(ink(&text(at, "HH<title>of the letters</title>")), start);
        // Pairs stand closer than letters alone: 27 px without that.
        let [(left, right), _] = ink(&text("y=\"15\" font-size=\"20\"", "AV"));
        assert!(near(right - left, 25.8), "{left} to {right}");
        // Upwards, from the foot of the sheet.
        let turned = "transform=\"translate(15 20) rotate(-90)\" font-size=\"10\"";
        let [(left, right), (_, bottom)] = ink(&text(turned, "HH"));
        assert!(near(left, 7.7) && near(right, 15.0) && near(bottom, 19.0));
    }

    #[test]
    fn letters_have_the_colour_of_their_text() {
        let red = text("y=\"15\" fill=\"#f00\"", "H");
        let inked = red.pixels().iter().filter(|pixel| pixel.alpha() > 0);
        assert!(inked.clone().count() > 0);
        assert!(
            inked
                .clone()
                .all(|pixel| pixel.red() == pixel.alpha() && pixel.blue() == 0)
        );
    }

    #[test]
    fn what_the_font_has_no_letter_for_is_a_box() {
        let letter = |content| text("x=\"5\" y=\"15\"", content);
        let unknown = letter("漢");
        assert!(unknown == letter("字") && unknown != letter(""));
        for known in ["µ", "Ω", "°", "–", "…", "&lt;"] {
            let drawn = letter(known);
            assert!(drawn != unknown && drawn != letter(""), "{known}");
        }
        assert_eq!(letter(" a\t b"), letter("a b"));
    }

    #[test]
    fn something_else_is_refused() {
        assert!(matches!(
            from_svg("time,v(a)"),
            Err(PictureError::Raster(_))
        ));
    }
}
