//! Turns a drawing in SVG into pixels, with letters that need no installed font: a chart is drawn once and leaves as both.

use std::sync::{Arc, LazyLock};

use image::RgbImage;
use resvg::{tiny_skia, usvg};

/// The font family that drawings name.
pub const FONT_FAMILY: &str = "Ubuntu";

/// Largest picture made from a drawing, px along a side.
pub const MAX_SIDE_PX: u32 = 16_384;

/// Why a drawing did not become a picture.
#[derive(Debug, thiserror::Error)]
pub enum SvgError {
    /// The text is no SVG.
    #[error("the drawing is not valid SVG: {0}")]
    Parse(#[from] usvg::Error),
    /// It has no size, or too much of it.
    #[error("a drawing of {width} × {height} px cannot be painted; up to {MAX_SIDE_PX} px along a side can")]
    Size {
        /// Width asked for, px.
        width: f64,
        /// Height asked for, px.
        height: f64,
    },
}

/// Ubuntu Light, as in the window.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    // Has the arrows, subscripts and marks that Ubuntu lacks.
    fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
    Arc::new(fonts)
});

fn tree(svg: &str) -> Result<usvg::Tree, SvgError> {
    let options =
        usvg::Options { font_family: FONT_FAMILY.to_owned(), fontdb: Arc::clone(&FONTS), ..usvg::Options::default() };
    Ok(usvg::Tree::from_str(svg, &options)?)
}

/// Paints a drawing over white; `scale` pixels for one unit of the drawing.
///
/// # Errors
/// Text that is no SVG, and a size of nothing or beyond [`MAX_SIDE_PX`].
pub fn paint(svg: &str, scale: f64) -> Result<RgbImage, SvgError> {
    let tree = tree(svg)?;
    let (width, height) = (f64::from(tree.size().width()) * scale, f64::from(tree.size().height()) * scale);
    let limit = f64::from(MAX_SIDE_PX);
    if !(width >= 1.0 && height >= 1.0 && width <= limit && height <= limit) {
        return Err(SvgError::Size { width, height });
    }
    let mut picture = RgbImage::from_pixel(width.round() as u32, height.round() as u32, image::Rgb([255; 3]));
    paint_tree(&tree, scale, &mut picture)?;
    Ok(picture)
}

/// Paints a drawing over a picture, unit for pixel.
///
/// # Errors
/// As [`paint`].
pub fn paint_over(svg: &str, picture: &mut RgbImage) -> Result<(), SvgError> {
    paint_tree(&tree(svg)?, 1.0, picture)
}

fn paint_tree(tree: &usvg::Tree, scale: f64, picture: &mut RgbImage) -> Result<(), SvgError> {
    let (width, height) = picture.dimensions();
    let refused = SvgError::Size { width: f64::from(width), height: f64::from(height) };
    let mut layer = tiny_skia::Pixmap::new(width, height).ok_or(refused)?;
    resvg::render(tree, tiny_skia::Transform::from_scale(scale as f32, scale as f32), &mut layer.as_mut());
    for (under, over) in picture.pixels_mut().zip(layer.pixels()) {
        let cover = 255 - u32::from(over.alpha());
        // The layer's colours are already multiplied by their opacity.
        for (u, o) in under.0.iter_mut().zip([over.red(), over.green(), over.blue()]) {
            *u = (u32::from(o) + (u32::from(*u) * cover + 127) / 255).min(255) as u8;
        }
    }
    Ok(())
}

/// Text as it must stand between the tags of a drawing.
pub fn escape(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_painted_where_it_stands() {
        let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" width="10" height="6"><rect x="2" y="1" width="4" height="3" fill="#ff0000"/></svg>"##;
        let picture = paint(svg, 2.0).unwrap();
        assert_eq!(picture.dimensions(), (20, 12));
        assert_eq!(picture.get_pixel(4, 2).0, [255, 0, 0]);
        assert_eq!(picture.get_pixel(11, 7).0, [255, 0, 0]);
        assert_eq!(picture.get_pixel(3, 2).0, [255; 3]);
        assert_eq!(picture.get_pixel(12, 7).0, [255; 3]);
    }

    #[test]
    fn every_sign_of_the_charts_has_a_letter() {
        // A sign without a letter leaves no ink. Each is painted alone.
        for sign in "AzÅğµεσ±×·°−–…‖²³⁻¹½≤≥%→".chars() {
            let svg = format!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" width="40" height="40"><text x="8" y="30" font-family="{FONT_FAMILY}" font-size="24">{sign}</text></svg>"#
            );
            let ink = paint(&svg, 1.0).unwrap().pixels().filter(|p| p.0[0] < 128).count();
            assert!(ink > 2, "{sign}: {ink}");
        }
    }

    #[test]
    fn what_is_no_drawing_is_refused() {
        assert!(matches!(paint("<svg", 1.0), Err(SvgError::Parse(_))));
        let svg = r#"<svg xmlns="http://www.w3.org/2000/svg" width="10" height="6"/>"#;
        assert!(matches!(paint(svg, 1e9), Err(SvgError::Size { .. })));
        assert!(matches!(paint(svg, f64::NAN), Err(SvgError::Size { .. })));
        assert_eq!(escape("a<b & \"c\"\n"), "a&lt;b &amp; &quot;c&quot; ");
    }
}
