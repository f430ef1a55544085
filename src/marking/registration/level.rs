//! Two pictures of one size that are compared pixel by pixel through a motion: what they differ by, once light is taken out, and where it pulls.

#![expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched function is compiled for wide registers"
)]

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Point2, Vector2};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::gray::Spline;
use super::super::lanes::LANES;
use super::Field;
use super::lattice::{Lattice, REACH, Taps};
use super::skin::Skin;

/// Tiles that are compared at once.
const CHUNK: usize = 128;
/// Largest side of a tile, px.
const MOST_SIDE: usize = 4;

/// A picture pair at one size, and the skin in the first.
pub(super) struct Level<'a> {
    last: &'a Spline,
    /// Pixels of the pictures themselves along one of these.
    scale: f64,
    /// Tiles of so many pixels a side; their splines are taken at their middles.
    side: usize,
    columns: usize,
    rows: usize,
    tiles: Vec<Tile>,
    pixels: Vec<Pixel>,
}

/// A square of pixels, of one piece of skin.
struct Tile {
    /// The triangle that its first pixel shows.
    triangle: u32,
    /// Its middle, in pixels of the pictures themselves.
    middle: Point2<f64>,
    column: usize,
    row: usize,
    pixels: std::ops::Range<usize>,
}

/// A pixel of the first picture.
#[derive(Clone, Copy)]
struct Pixel {
    /// From the tile's middle, in pixels of the pictures themselves.
    offset: [f32; 2],
    value: f32,
    slope: [f32; 2],
}

/// What reaches the tiles.
pub(super) struct Reaches {
    /// The nodes that reach each tile; none for one beyond the lattice.
    pub(super) tiles: Vec<Option<Reach>>,
    /// Tiles that the same nodes reach.
    pub(super) cells: Vec<Vec<usize>>,
}

/// The nodes that reach a tile.
pub(super) struct Reach {
    pub(super) nodes: [usize; REACH],
    pub(super) values: [f64; REACH],
    taps: Taps,
}

/// What a tile says: ∑ w g gᵀ and ∑ w g r over its pixels, with g the slopes and r what the pictures differ by.
#[derive(Clone, Copy, Default)]
pub(super) struct Pull {
    pub(super) square: [f64; 3],
    pub(super) right: Vector2<f64>,
    /// ∑ r², the pixels, and ∑ w.
    pub(super) squares: f64,
    pub(super) count: f64,
    pub(super) weight: f64,
}

/// Variance of the mean of both pictures' slopes under B-splines, in variances of the difference of their pixels: ¼ · ∫β'² ∫β² = ¼ · 2/3
/// · 151/315.
pub(super) const SLOPE_NOISE: f64 = 0.0799;
/// Brightness and slopes found in the last picture, for every pixel of the first.
type Found = Vec<[f32; 3]>;

impl<'a> Level<'a> {
    /// The pixels of skin, in tiles no larger than two fifths of the spacing of the nodes. `scale`: pixels of the pictures themselves, of
    /// which there are `size`, along one of these.
    pub(super) fn new(
        [first, last]: [&'a Spline; 2],
        scale: usize,
        size: [usize; 2],
        spacing: f64,
        skin: &Skin,
    ) -> Self {
        let most = spacing / (2.5 * scale as f64);
        let side = if most >= MOST_SIDE as f64 {
            MOST_SIDE
        } else if most >= 2.0 {
            2
        } else {
            1
        };
        let small = size.map(|s| s.div_ceil(scale));
        let [columns, rows] = small.map(|s| s.div_ceil(side));
        let full = scale as f64;
        // The middle of pixel k of a smaller picture is that of pixel k · scale of the picture itself.
        let middle_of = |k: f64| (k - 0.5) * full + 0.5;
        let of_row = |row: usize| {
            let mut tiles = Vec::new();
            for column in 0..columns {
                let [x0, y0] = [column * side, row * side];
                let middle = [x0, y0].map(|k| middle_of(k as f64 + 0.5 * side as f64));
                let mut pieces: Vec<(u32, Vec<Pixel>)> = Vec::new();
                for y in y0..(y0 + side).min(small[1]) {
                    for x in x0..(x0 + side).min(small[0]) {
                        let shown = skin.shown((x * scale).min(size[0] - 1), (y * scale).min(size[1] - 1));
                        let Some(triangle) = shown else { continue };
                        let s = first.sample(&Point2::new(x as f64 + 0.5, y as f64 + 0.5));
                        let pixel = Pixel {
                            offset: [
                                (middle_of(x as f64 + 0.5) - middle[0]) as f32,
                                (middle_of(y as f64 + 0.5) - middle[1]) as f32,
                            ],
                            value: s.value as f32,
                            slope: s.slope.map(|v| (v / full) as f32),
                        };
                        match pieces.iter_mut().find(|(t, _)| *t == triangle || skin.touch(*t, triangle)) {
                            Some((_, pixels)) => pixels.push(pixel),
                            None => pieces.push((triangle, vec![pixel])),
                        }
                    }
                }
                tiles.extend(pieces.into_iter().map(|(t, pixels)| (Point2::from(middle), column, t, pixels)));
            }
            tiles
        };
        let lines: Vec<_> = (0..rows).into_par_iter().map(of_row).collect();
        let (mut tiles, mut all) = (Vec::new(), Vec::new());
        for (row, line) in lines.into_iter().enumerate() {
            for (middle, column, triangle, pixels) in line {
                let start = all.len();
                all.extend(pixels);
                tiles.push(Tile { triangle, middle, column, row, pixels: start..all.len() });
            }
        }
        Self { last, scale: full, side, columns, rows, tiles, pixels: all }
    }

    /// What of a lattice reaches the tiles.
    pub(super) fn reach(&self, lattice: &Lattice) -> Reaches {
        let of = |tile: &Tile| {
            let taps = lattice.taps(&tile.middle);
            lattice.reach(&taps, tile.triangle).map(|nodes| Reach { nodes, values: taps.values(), taps })
        };
        let tiles: Vec<Option<Reach>> = self.tiles.par_iter().map(of).collect();
        let mut cells: BTreeMap<[usize; REACH], Vec<usize>> = BTreeMap::new();
        for (k, reach) in tiles.iter().enumerate() {
            if let Some(reach) = reach {
                cells.entry(reach.nodes).or_default().push(k);
            }
        }
        Reaches { tiles, cells: cells.into_values().collect() }
    }

    /// Compares the pictures through a motion. Light may change over `light_px`; what the pictures
    /// differ by beyond `outlier` times its spread counts less and less (Cauchy). Gives each tile's pull and the variance of white noise
    /// of a pixel that would make that spread.
    pub(super) fn compare(&self, field: &Field, reach: &Reaches, light_px: f64, outlier: f64) -> (Vec<Pull>, f64) {
        let reach = &reach.tiles;
        let found = self.found(field, reach);
        let gains = self.gains(&found, reach, light_px);
        let left = |k: usize, gain: f32| found[k][0] - gain * self.pixels[k].value;
        let mut sizes: Vec<f32> = Vec::with_capacity(self.pixels.len() / 5 + 1);
        for ((tile, gain), _) in self.tiles.iter().zip(&gains).zip(reach).filter(|(_, r)| r.is_some()) {
            sizes.extend(tile.pixels.clone().filter(|k| k % 5 == 0).map(|k| left(k, *gain).abs()));
        }
        if sizes.is_empty() {
            return (vec![Pull::default(); self.tiles.len()], LEAST_SPREAD * LEAST_SPREAD * SHARED);
        }
        let middle = sizes.len() / 2;
        let (_, median, _) = sizes.select_nth_unstable_by(middle, f32::total_cmp);
        let spread = (MEDIAN_TO_SPREAD * f64::from(*median)).max(LEAST_SPREAD);
        let far = (1.0 / (outlier * spread).powi(2)) as f32;
        let pull = |(tile, gain): (&Tile, &f32)| {
            let (mut square, mut right, mut squares, mut weight) = ([0.0_f32; 3], [0.0_f32; 2], 0.0_f32, 0.0_f32);
            for k in tile.pixels.clone() {
                let r = left(k, *gain);
                let (p, f) = (&self.pixels[k], &found[k]);
                let g = [0.5 * (p.slope[0] + f[1]), 0.5 * (p.slope[1] + f[2])];
                let w = 1.0 / (1.0 + r * r * far);
                square[0] += w * g[0] * g[0];
                square[1] += w * g[0] * g[1];
                square[2] += w * g[1] * g[1];
                right[0] -= w * g[0] * r;
                right[1] -= w * g[1] * r;
                squares += r * r;
                weight += w;
            }
            Pull {
                square: square.map(f64::from),
                right: Vector2::new(f64::from(right[0]), f64::from(right[1])),
                squares: f64::from(squares),
                count: tile.pixels.len() as f64,
                weight: f64::from(weight),
            }
        };
        let pulls = self.tiles.par_iter().zip(&gains).with_min_len(CHUNK).map(pull).collect();
        (pulls, spread * spread * SHARED)
    }

    /// Samples the last picture where the motion takes every pixel.
    fn found(&self, field: &Field, reach: &[Option<Reach>]) -> Found {
        let parts: Vec<Found> = self
            .tiles
            .par_chunks(CHUNK)
            .zip(reach.par_chunks(CHUNK))
            .map(|(tiles, reach)| Arch::new().dispatch(Sampled { level: self, tiles, reach, field }))
            .collect();
        parts.concat()
    }

    /// By what factor the last picture is brighter about each tile: the ratio of both brightnesses about it.
    fn gains(&self, found: &Found, reach: &[Option<Reach>], light_px: f64) -> Vec<f32> {
        let mut sums = vec![[0.0_f32; 2]; self.columns * self.rows];
        for (tile, _) in self.tiles.iter().zip(reach).filter(|(_, r)| r.is_some()) {
            let sum = &mut sums[tile.row * self.columns + tile.column];
            for k in tile.pixels.clone() {
                sum[0] += self.pixels[k].value;
                sum[1] += found[k][0];
            }
        }
        let spread = (light_px / self.scale).max(LEAST_LIGHT_PX) / self.side as f64;
        let far = (2.5 * spread).ceil() as usize;
        let weights: Vec<f32> = (0..=far).map(|k| (-0.5 * (k as f64 / spread).powi(2)).exp() as f32).collect();
        let along_rows = blurred(&sums, self.columns, &weights);
        let turned = turned(&along_rows, self.columns, self.rows);
        let along_both = blurred(&turned, self.rows, &weights);
        let gain = |t: &Tile| {
            let [one, other] = along_both[t.column * self.rows + t.row];
            if one > 1.0 && other > 0.0 { other / one } else { 1.0 }
        };
        self.tiles.iter().map(gain).collect()
    }
}

/// Light is taken out over no less than so many pixels.
const LEAST_LIGHT_PX: f64 = 2.5;
/// The median of what normal errors are in size, to their standard deviation.
const MEDIAN_TO_SPREAD: f64 = 1.4826;
/// Least spread of what two pictures differ by, grey levels.
const LEAST_SPREAD: f64 = 0.3;
/// Area over which the pixels of a picture under B-splines share their noise, px²: 4π / 3.
pub(super) const SHARED: f64 = 4.19;

/// Weighted sums along the rows of so many columns.
fn blurred(sums: &[[f32; 2]], columns: usize, weights: &[f32]) -> Vec<[f32; 2]> {
    let line = |row: &[[f32; 2]]| -> Vec<[f32; 2]> {
        (0..columns)
            .map(|c| {
                let mut total = [0.0; 2];
                let (from, to) = (c.saturating_sub(weights.len() - 1), (c + weights.len()).min(columns));
                for (k, s) in row[from..to].iter().enumerate() {
                    let w = weights[(from + k).abs_diff(c)];
                    total[0] += w * s[0];
                    total[1] += w * s[1];
                }
                total
            })
            .collect()
    };
    sums.par_chunks(columns).flat_map_iter(line).collect()
}

/// Rows as columns.
fn turned(sums: &[[f32; 2]], columns: usize, rows: usize) -> Vec<[f32; 2]> {
    (0..columns).flat_map(|c| (0..rows).map(move |r| sums[r * columns + c])).collect()
}

struct Sampled<'a> {
    level: &'a Level<'a>,
    tiles: &'a [Tile],
    reach: &'a [Option<Reach>],
    field: &'a Field,
}

impl WithSimd for Sampled<'_> {
    type Output = Found;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Found {
        let level = self.level;
        let count = self.tiles.iter().map(|t| t.pixels.len()).sum();
        let mut found = Vec::with_capacity(count);
        let (mut x, mut y) = ([0.0_f32; LANES], [0.0_f32; LANES]);
        let mut lane = 0;
        let inverse = 1.0 / level.scale;
        // Places are counted from a tile near by, so that single precision is enough.
        let mut corner = [0_i32; 2];
        let scale = inverse as f32;
        for (tile, reach) in self.tiles.iter().zip(self.reach) {
            let (u, gradient) = match reach {
                Some(r) => {
                    let (u, gradient, _) = r.taps.motion(&r.nodes, &self.field.coefficients);
                    (u, gradient)
                }
                None => (Vector2::zeros(), Matrix2::zeros()),
            };
            let middle = (tile.middle + u).map(|c| (c - 0.5) * inverse + 0.5);
            let g = gradient.map(|v| v as f32);
            for pixel in &level.pixels[tile.pixels.clone()] {
                if lane == 0 {
                    corner = [middle.x, middle.y].map(|c| c.floor().clamp(-FAR, FAR) as i32);
                }
                let [ox, oy] = pixel.offset;
                x[lane] = (middle.x - f64::from(corner[0])) as f32 + scale * (ox + g[(0, 0)] * ox + g[(0, 1)] * oy);
                y[lane] = (middle.y - f64::from(corner[1])) as f32 + scale * (oy + g[(1, 0)] * ox + g[(1, 1)] * oy);
                lane += 1;
                if lane == LANES {
                    let [value, right, down] = level.last.sample_lanes(corner, &x, &y);
                    found.extend((0..LANES).map(|k| [value[k], scale * right[k], scale * down[k]]));
                    lane = 0;
                }
            }
        }
        if lane > 0 {
            let [value, right, down] = level.last.sample_lanes(corner, &x, &y);
            found.extend((0..lane).map(|k| [value[k], scale * right[k], scale * down[k]]));
        }
        found
    }
}

/// Beyond every picture, px.
const FAR: f64 = 1e6;
