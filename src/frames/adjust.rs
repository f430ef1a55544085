//! How a frame is shown: brightness, contrast, gamma and local contrast (CLAHE). The frame itself is never changed.

use image::RgbImage;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Most tiles along a side; the 8 × 8 of Zuiderveld.
const TILES: usize = 8;

/// Fewest pixels along the side of a tile: a histogram of fewer says nothing.
const MIN_TILE_PX: usize = 16;

/// What is done to a frame before it is drawn. The default changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Adjustment {
    /// Added to every channel, as a share of white (−1 to 1, default 0).
    pub brightness: f64,
    /// Stretches every channel about middle grey (0 to 4, default 1: unchanged; 0 is plain grey).
    pub contrast: f64,
    /// Exponent 1/γ over every channel (0.2 to 5, default 1: unchanged; above 1 lifts the shadows).
    pub gamma: f64,
    /// Clip limit of contrast limited adaptive histogram equalisation, in multiples of an even histogram
    /// (1 to 8; 2 to 3 shows the grain of skin, higher shows noise). None (the default) leaves it out.
    pub clahe: Option<f64>,
}

impl Default for Adjustment {
    fn default() -> Self {
        Self { brightness: 0.0, contrast: 1.0, gamma: 1.0, clahe: None }
    }
}

impl Adjustment {
    /// Whether the frame is shown as it is.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    /// The frame as it is to be drawn: local contrast first, then the tone curve. Values outside their ranges are clamped.
    pub fn apply(&self, image: &RgbImage) -> RgbImage {
        let mut shown = image.clone();
        self.apply_in_place(&mut shown);
        shown
    }

    /// The same without a second picture in memory.
    pub fn apply_in_place(&self, shown: &mut RgbImage) {
        if self.is_identity() || shown.is_empty() {
            return;
        }
        let curve = self.tone_curve();
        let row_bytes = 3 * shown.width() as usize;
        let equaliser =
            self.clahe.filter(|c| c.is_finite()).map(|limit| LocalEqualiser::new(shown, limit.clamp(1.0, 8.0)));
        shown.par_chunks_mut(row_bytes).enumerate().for_each(|(y, row)| {
            if let Some(equaliser) = &equaliser {
                equaliser.apply_to_row(y, row);
            }
            for channel in row {
                *channel = curve[usize::from(*channel)];
            }
        });
    }

    /// v ↦ ((v − ½)·contrast + ½ + brightness)^(1/γ) on 0…1, for each of the 256 values.
    pub fn tone_curve(&self) -> [u8; 256] {
        let or = |value: f64, default: f64| if value.is_finite() { value } else { default };
        let contrast = or(self.contrast, 1.0).clamp(0.0, 4.0);
        let brightness = or(self.brightness, 0.0).clamp(-1.0, 1.0);
        let exponent = 1.0 / or(self.gamma, 1.0).clamp(0.2, 5.0);
        std::array::from_fn(|v| {
            let stretched = (v as f64 / 255.0 - 0.5) * contrast + 0.5 + brightness;
            (stretched.clamp(0.0, 1.0).powf(exponent) * 255.0).round() as u8
        })
    }
}

/// Contrast limited adaptive histogram equalisation of the brightness of a picture.
///
/// Each tile has the curve that would make its own histogram even, with the histogram first cut at the clip limit and the
/// cut part spread over all values; a pixel blends the curves of the four nearest tiles. The three channels are moved by
/// the same amount, which keeps the colour.
///
/// Source: K. Zuiderveld, "Contrast Limited Adaptive Histogram Equalization", Graphics Gems IV, 1994, pages 474–485.
struct LocalEqualiser {
    curves: Vec<[u8; 256]>,
    columns: Vec<Blend>,
    rows: Vec<Blend>,
    tiles_across: usize,
}

/// The two tiles that a column (or row) lies between, and the weight of the second in 256ths.
#[derive(Clone, Copy)]
struct Blend {
    tiles: [usize; 2],
    weight: u32,
}

impl LocalEqualiser {
    fn new(image: &RgbImage, clip_limit: f64) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let tiles_along = |side: usize| (side / MIN_TILE_PX).clamp(1, TILES);
        let (across, down) = (tiles_along(width), tiles_along(height));
        let pixels: &[u8] = image.as_raw();
        let curves = (0..across * down)
            .into_par_iter()
            .map(|tile| {
                let span = |t: usize, n: usize, side: usize| t * side / n..(t + 1) * side / n;
                let columns = span(tile % across, across, width);
                let mut histogram = [0_u32; 256];
                for y in span(tile / across, down, height) {
                    let row = &pixels[3 * (y * width + columns.start)..3 * (y * width + columns.end)];
                    for rgb in row.chunks_exact(3) {
                        histogram[brightness(rgb)] += 1;
                    }
                }
                equalising_curve(&histogram, clip_limit)
            })
            .collect();
        Self { curves, columns: blends(width, across), rows: blends(height, down), tiles_across: across }
    }

    fn apply_to_row(&self, y: usize, row: &mut [u8]) {
        let down = self.rows[y];
        let [above, below] = down.tiles.map(|t| &self.curves[t * self.tiles_across..(t + 1) * self.tiles_across]);
        for (rgb, across) in row.chunks_exact_mut(3).zip(&self.columns) {
            let old = brightness(rgb);
            let [left, right] = across.tiles;
            let blend = |curves: &[[u8; 256]]| {
                u32::from(curves[left][old]) * (256 - across.weight) + u32::from(curves[right][old]) * across.weight
            };
            let new = (blend(above) * (256 - down.weight) + blend(below) * down.weight + (1 << 15)) >> 16;
            for channel in rgb {
                *channel = (u32::from(*channel) + new).saturating_sub(old as u32).min(255) as u8;
            }
        }
    }
}

/// Brightness of a pixel, 0 to 255, with the weights of ITU-R BT.601 in 256ths.
fn brightness(rgb: &[u8]) -> usize {
    (77 * usize::from(rgb[0]) + 150 * usize::from(rgb[1]) + 29 * usize::from(rgb[2]) + 128) >> 8
}

/// Between the centres of which two of `tiles` tiles each of `side` pixels lies; beyond the outer centres one tile counts alone.
fn blends(side: usize, tiles: usize) -> Vec<Blend> {
    (0..side)
        .map(|i| {
            let at = ((i as f64 + 0.5) * tiles as f64 / side as f64 - 0.5).clamp(0.0, (tiles - 1) as f64);
            let first = at.floor() as usize;
            let second = (first + 1).min(tiles - 1);
            Blend { tiles: [first, second], weight: ((at - first as f64) * 256.0).round() as u32 }
        })
        .collect()
}

/// The rising curve that evens out a histogram clipped at `clip_limit` times its mean.
fn equalising_curve(histogram: &[u32; 256], clip_limit: f64) -> [u8; 256] {
    let total: u32 = histogram.iter().sum();
    let limit = clip_limit * f64::from(total) / 256.0;
    let cut: f64 = histogram.iter().map(|&n| (f64::from(n) - limit).max(0.0)).sum();
    let mut below = 0.0;
    std::array::from_fn(|v| {
        let count = f64::from(histogram[v]).min(limit) + cut / 256.0;
        // A value stands in the middle of its own share: an even histogram is then left as it is.
        let middle = below + count / 2.0;
        below += count;
        (middle / f64::from(total.max(1)) * 256.0 - 0.5).round().clamp(0.0, 255.0) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn noisy(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let v = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)).wrapping_mul(2_246_822_519) >> 26;
            Rgb([90 + v as u8, 80 + v as u8, 70 + v as u8])
        })
    }

    #[test]
    fn the_default_changes_nothing() {
        let image = noisy(33, 17);
        assert!(Adjustment::default().is_identity());
        assert_eq!(Adjustment::default().apply(&image), image);
        assert_eq!(Adjustment::default().tone_curve().to_vec(), (0..=255).collect::<Vec<u8>>());
    }

    #[test]
    fn the_tone_curve_is_the_formula_and_never_falls() {
        // Contrast 3 about ½ takes v to 3v − 255: 84 → −3, clamped; 100 → 45; 150 → 195; 171 → 258, clamped.
        let steep = Adjustment { contrast: 3.0, ..Adjustment::default() }.tone_curve();
        assert_eq!((steep[84], steep[100], steep[150], steep[171]), (0, 45, 195, 255));
        // γ = 2 is a square root: 64/255 → 0.50098 → 127.75.
        let gamma = Adjustment { gamma: 2.0, ..Adjustment::default() }.tone_curve();
        assert_eq!((gamma[0], gamma[64], gamma[255]), (0, 128, 255));
        let bright = Adjustment { brightness: 0.2, ..Adjustment::default() }.tone_curve();
        assert_eq!((bright[0], bright[100], bright[250]), (51, 151, 255));
        for curve in [steep, gamma, bright] {
            assert!(curve.windows(2).all(|w| w[0] <= w[1]));
        }
    }

    #[test]
    fn settings_that_are_no_numbers_fall_back() {
        let broken = Adjustment { brightness: f64::NAN, contrast: f64::INFINITY, gamma: 0.0, clahe: Some(f64::NAN) };
        assert_eq!(broken.apply(&noisy(20, 20)).dimensions(), (20, 20));
        assert!(Adjustment { clahe: Some(3.0), ..Adjustment::default() }.apply(&RgbImage::new(0, 0)).is_empty());
    }

    #[test]
    fn local_contrast_leaves_a_flat_picture_flat() {
        let clahe = Adjustment { clahe: Some(3.0), ..Adjustment::default() };
        for value in [0, 40, 128, 255] {
            let flat = RgbImage::from_pixel(100, 70, Rgb([value; 3]));
            let shown = clahe.apply(&flat);
            assert!(shown.pixels().all(|p| p == shown.get_pixel(0, 0)));
            // The clipped histogram is a spike of 3/256 on an even floor: the value moves by at most that share.
            assert!(shown.get_pixel(0, 0).0[0].abs_diff(value) <= 3, "{value}: {:?}", shown.get_pixel(0, 0));
        }
    }

    #[test]
    fn an_even_histogram_is_left_as_it_is_and_four_values_spread_as_computed_by_hand() {
        let even = equalising_curve(&[10; 256], 2.0);
        assert_eq!(even.to_vec(), (0..=255).collect::<Vec<u8>>());
        // Four values with a quarter each, not clipped: their middles stand at 1/8, 3/8, 5/8, 7/8 of 256, less a half.
        let mut histogram = [0; 256];
        for v in [100, 101, 102, 103] {
            histogram[v] = 64;
        }
        let curve = equalising_curve(&histogram, 1e9);
        assert_eq!([curve[100], curve[101], curve[102], curve[103]], [32, 96, 160, 224]);
        // Clip limit 1: everything over one count a value is spread evenly. 4 counts stay, 252/256 are added to each:
        // before value 100 lie 100 · 0.984375 = 98.4375; its middle 98.4375 + 1.984375/2 = 99.43, less a half: 98.9.
        assert_eq!(equalising_curve(&histogram, 1.0)[100], 99);
    }

    #[test]
    fn local_contrast_widens_a_narrow_range_and_keeps_the_colour() {
        let image = noisy(256, 256);
        let shown = Adjustment { clahe: Some(4.0), ..Adjustment::default() }.apply(&image);
        let spread = |i: &RgbImage| {
            let values: Vec<f64> = i.pixels().map(|p| f64::from(p.0[1])).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        assert!(spread(&shown) > 1.5 * spread(&image), "{} {}", spread(&shown), spread(&image));
        for (a, b) in image.pixels().zip(shown.pixels()) {
            if b.0.iter().all(|c| (1..255).contains(c)) {
                assert_eq!(i32::from(a.0[0]) - i32::from(a.0[2]), i32::from(b.0[0]) - i32::from(b.0[2]));
            }
        }
    }

    #[test]
    fn blends_meet_at_the_tile_centres() {
        // Eight tiles on 128 px: centres at 8, 24, …; pixel 7 (centre 7.5) is before the first one, pixel 15 at (15.5 − 8)/16.
        let b = blends(128, 8);
        assert_eq!((b[7].tiles, b[7].weight), ([0, 1], 0));
        assert_eq!((b[15].tiles, b[15].weight), ([0, 1], 120));
        assert_eq!((b[127].tiles, b[127].weight), ([7, 7], 0));
    }
}
