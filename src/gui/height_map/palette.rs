//! Colours of values: a colour map, the curve by which low values are spread, and the texture that the surface is painted from.

use egui::{Color32, ColorImage, TextureHandle};

use super::ink::{self, TEXELS};
use super::range::ColourRange;
use crate::draw::colour_map::ColourMap;

/// How values are spread over the colours. Heights are never spread: they stay proportional.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColourCurve {
    /// In proportion.
    #[default]
    Linear,
    /// By the square root: low values get more of the colours.
    SquareRoot,
    /// By the logarithm over two decades below the end; what is smaller has the lowest colour.
    Logarithm,
}

impl ColourCurve {
    /// In the order of the chooser.
    pub const ALL: [Self; 3] = [Self::Linear, Self::SquareRoot, Self::Logarithm];

    /// Words of the chooser.
    pub fn label(self) -> &'static str {
        match self {
            Self::Linear => "Linear",
            Self::SquareRoot => "Square root",
            Self::Logarithm => "Logarithm",
        }
    }

    fn spread(self, share: f64) -> f64 {
        let share = share.clamp(0.0, 1.0);
        match self {
            Self::Linear => share,
            Self::SquareRoot => share.sqrt(),
            Self::Logarithm => (1.0 + share.max(1e-9).log10() / 2.0).max(0.0),
        }
    }
}

/// From a value to a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// The colour map.
    pub map: ColourMap,
    /// The values at its ends.
    pub range: ColourRange,
    /// How values are spread over it.
    pub curve: ColourCurve,
    /// Whether zero has the middle colour.
    pub signed: bool,
}

impl Palette {
    /// Place of a value in the colour map, 0–1. Of signed values zero is always 0.5, however the range lies.
    pub fn tone(&self, value: f64) -> f64 {
        if self.signed {
            let most = self.range.low.abs().max(self.range.high.abs());
            let value = value.clamp(self.range.low, self.range.high);
            0.5 + 0.5 * value.signum() * self.curve.spread(value.abs() / most)
        } else {
            self.curve.spread(self.range.position(value))
        }
    }

    /// Tone at the lower and the upper end of the range.
    pub fn tones(&self) -> [f64; 2] {
        [self.tone(self.range.low), self.tone(self.range.high)]
    }

    /// Colour of a value; beyond the ends the end's.
    pub fn colour(&self, value: f64) -> Color32 {
        let [r, g, b] = self.map.at(self.tone(value));
        Color32::from_rgb(r, g, b)
    }

    /// Texture coordinate of a value; it grows in proportion to the value, so that the graphics card can interpolate it.
    pub fn u(&self, value: f64) -> f32 {
        ((0.5 + self.range.position(value) * (TEXELS - 1) as f64) / TEXELS as f64) as f32
    }

    /// The texture that is drawn from. The context keeps those of the last palettes: maps that stand side by side have one each, and what is let
    /// go of in a frame is not drawn in it.
    pub fn texture(&self, ctx: &egui::Context) -> TextureHandle {
        const KEPT: usize = 6;
        let id = egui::Id::unique("height map palettes");
        let mut kept: Vec<(Self, TextureHandle)> = ctx.data(|d| d.get_temp(id)).unwrap_or_default();
        if let Some((_, texture)) = kept.iter().find(|(made_for, _)| made_for == self) {
            return texture.clone();
        }
        let texture = ink::texture(ctx, "height map palette", &self.row());
        kept.push((*self, texture.clone()));
        kept.drain(..kept.len().saturating_sub(KEPT));
        ctx.data_mut(|d| d.insert_temp(id, kept));
        texture
    }

    /// The pixels of that texture.
    pub fn texels(&self) -> ColorImage {
        ink::texels(&self.row())
    }

    fn row(&self) -> Vec<Color32> {
        let share = |k: usize| k as f64 / (TEXELS - 1) as f64;
        (0..TEXELS).map(|k| self.colour(self.range.low + share(k) * (self.range.high - self.range.low))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn palette(signed: bool, curve: ColourCurve, low: f64, high: f64) -> Palette {
        let map = if signed { ColourMap::CoolWarm } else { ColourMap::Viridis };
        Palette { map, range: ColourRange::new(low, high), curve, signed }
    }

    #[test]
    fn zero_has_the_middle_colour_of_a_signed_palette_however_the_range_is_locked() {
        for curve in ColourCurve::ALL {
            for (low, high) in [(-0.4, 0.4), (-0.1, 0.4), (-3.0, 0.5), (0.0, 2.0)] {
                let p = palette(true, curve, low, high);
                assert!((p.tone(0.0) - 0.5).abs() < 1e-12, "{curve:?} {low} {high}");
                assert_eq!(p.colour(0.0), {
                    let [r, g, b] = ColourMap::CoolWarm.at(0.5);
                    Color32::from_rgb(r, g, b)
                });
                // One newton is as strong a colour on either side.
                let reach = low.abs().min(high.abs());
                assert!((p.tone(reach) + p.tone(-reach) - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn curves_keep_the_ends_and_the_order_and_lift_low_values() {
        let tone = |curve, v| palette(false, curve, 0.0, 1.0).tone(v);
        for curve in ColourCurve::ALL {
            assert!(tone(curve, 0.0).abs() < 1e-12 && (tone(curve, 1.0) - 1.0).abs() < 1e-12);
            assert!((0..100).all(|k| tone(curve, f64::from(k) / 100.0) <= tone(curve, f64::from(k + 1) / 100.0)));
            assert_eq!(tone(curve, 7.0), 1.0, "clipped");
        }
        assert!((tone(ColourCurve::SquareRoot, 0.25) - 0.5).abs() < 1e-12);
        assert!((tone(ColourCurve::Logarithm, 0.1) - 0.5).abs() < 1e-12, "one of two decades");
    }
}
