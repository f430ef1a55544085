//! From the luma and chroma planes of a film to red, green and blue, by the matrix that the stream names (ITU-T H.273).

use image::{Rgb, RgbImage};

/// How colours are coded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coding {
    /// Share of red in luma.
    red: f32,
    /// Share of blue in luma.
    blue: f32,
    /// Whether 0 to 255 are used, rather than 16 to 235 (luma) and 16 to 240 (chroma).
    full_range: bool,
}

impl Coding {
    /// By the number of the matrix in H.273; unnamed ones are BT.709 from 720 lines up and BT.601 below, as players take them.
    pub(super) fn new(matrix: Option<u32>, full_range: bool, height: u32) -> Self {
        let (red, blue) = match matrix {
            Some(1) => (0.2126, 0.0722),
            Some(4..=6) => (0.299, 0.114),
            Some(7) => (0.212, 0.087),
            Some(9 | 10) => (0.2627, 0.0593),
            _ if height >= 720 => (0.2126, 0.0722),
            _ => (0.299, 0.114),
        };
        Self { red, blue, full_range }
    }

    /// One pixel; `u` and `v` count from their middle.
    fn rgb(&self, y: f32, u: f32, v: f32) -> Rgb<u8> {
        let (y, chroma) = if self.full_range { (y, 1.0) } else { ((y - 16.0) * (255.0 / 219.0), 255.0 / 224.0) };
        let r = y + 2.0 * (1.0 - self.red) * chroma * v;
        let b = y + 2.0 * (1.0 - self.blue) * chroma * u;
        let g = (y - self.red * r - self.blue * b) / (1.0 - self.red - self.blue);
        Rgb([r, g, b].map(|c| (c + 0.5).clamp(0.0, 255.0) as u8))
    }
}

/// The planes of a picture in 4:2:0: luma for every pixel, chroma for every second column and row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes<'a> {
    pub(super) y: &'a [u8],
    pub(super) u: &'a [u8],
    pub(super) v: &'a [u8],
    /// Bytes from a row to the next, of luma and chroma.
    pub(super) strides: [usize; 2],
    /// Size, px.
    pub(super) size: [usize; 2],
}

impl Planes<'_> {
    /// Chroma rows and columns that there are.
    fn chroma(&self) -> [usize; 2] {
        [self.size[0].div_ceil(2).min(self.strides[1]), self.size[1].div_ceil(2)]
    }

    /// The picture in full size. Chroma is interpolated: its samples lie on the left column of their pair, between its two rows, as
    /// H.264 has it unless it says otherwise.
    pub(super) fn full(&self, coding: &Coding) -> RgbImage {
        let [width, height] = self.size;
        let [cw, ch] = self.chroma();
        let mut image = RgbImage::new(width as u32, height as u32);
        if cw == 0 || ch == 0 {
            return image;
        }
        let row_of = |plane: &'_ [u8], row: usize| -> Vec<f32> {
            let from = row.min(ch - 1) * self.strides[1];
            let row = plane.get(from..from + cw).unwrap_or_default();
            row.iter().map(|c| f32::from(*c) - 128.0).collect()
        };
        for (y, row) in image.rows_mut().enumerate() {
            // Rows 2k and 2k+1 lie a quarter of a chroma row above and below row k.
            let (near, far) = (y / 2, if y % 2 == 0 { (y / 2).saturating_sub(1) } else { y / 2 + 1 });
            let mix = |plane| -> Vec<f32> {
                let (near, far) = (row_of(plane, near), row_of(plane, far));
                near.iter().zip(&far).map(|(n, f)| 0.75 * n + 0.25 * f).collect()
            };
            let (u, v) = (mix(self.u), mix(self.v));
            let luma = self.y.get(y * self.strides[0]..).unwrap_or_default();
            let at = |c: &[f32], x: usize| {
                let left = c.get(x / 2).copied().unwrap_or(0.0);
                if x.is_multiple_of(2) { left } else { 0.5 * (left + c.get(x / 2 + 1).copied().unwrap_or(left)) }
            };
            for (x, (pixel, &luma)) in row.zip(luma).enumerate() {
                *pixel = coding.rgb(f32::from(luma), at(&u, x), at(&v, x));
            }
        }
        image
    }

    /// The picture made smaller by a whole number: means of squares of pixels.
    pub(super) fn small(&self, coding: &Coding, by: usize) -> RgbImage {
        let by = by.max(1);
        let [width, height] = self.size.map(|s| (s / by).max(1));
        let mean = |plane: &[u8], stride: usize, size: [usize; 2], x: usize, y: usize, side: usize| {
            let (mut sum, mut count) = (0_u32, 0_u32);
            for row in y..(y + side).min(size[1]) {
                let from = row * stride + x;
                let to = row * stride + (x + side).min(size[0]);
                for c in plane.get(from..to.max(from)).unwrap_or_default() {
                    sum += u32::from(*c);
                    count += 1;
                }
            }
            sum as f32 / count.max(1) as f32
        };
        let chroma = self.chroma();
        let side = by.div_ceil(2);
        RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let (x, y) = (x as usize * by, y as usize * by);
            let luma = mean(self.y, self.strides[0], self.size, x, y, by);
            let u = mean(self.u, self.strides[1], chroma, x / 2, y / 2, side) - 128.0;
            let v = mean(self.v, self.strides[1], chroma, x / 2, y / 2, side) - 128.0;
            coding.rgb(luma, u, v)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers by hand from H.273: Y = 16 + 219 L with L = K_r R + K_g G + K_b B, and C_b = 128 + 224 (B − L) / (2 (1 − K_b)).
    #[test]
    fn red_comes_back_from_either_matrix() {
        // BT.601, red: L 0.299, so Y 81.5, U 90.2, V 240. BT.709: L 0.2126, so Y 62.6, U 102.3, V 240.
        for (matrix, y, u) in [(6, 81.5, 90.2), (1, 62.6, 102.3)] {
            let [r, g, b] = Coding::new(Some(matrix), false, 1080).rgb(y, u - 128.0, 112.0).0;
            assert!(r >= 253 && g <= 2 && b <= 2, "{matrix}: {r} {g} {b}");
        }
        let grey = Coding::new(None, true, 480).rgb(77.0, 0.0, 0.0);
        assert_eq!(grey, Rgb([77; 3]));
        assert_eq!(Coding::new(None, false, 720), Coding::new(Some(1), false, 480));
        assert_eq!(Coding::new(None, false, 719), Coding::new(Some(6), false, 1080));
    }

    #[test]
    fn a_ramp_of_chroma_is_a_ramp_of_colour_and_odd_sizes_have_all_their_pixels() {
        let y = [128; 5 * 3];
        let u = [128; 3 * 2];
        let v = [100, 120, 140, 100, 120, 140];
        let planes = Planes { y: &y, u: &u, v: &v, strides: [5, 3], size: [5, 3] };
        let image = planes.full(&Coding::new(Some(6), true, 480));
        // Full range, V − 128 = −28, −18, −8, 2, 12 along a row; R = Y + 1.402 V.
        let red: Vec<u8> = (0..5).map(|x| image.get_pixel(x, 1).0[0]).collect();
        assert_eq!(red, [-28.0, -18.0, -8.0, 2.0, 12.0].map(|v: f32| (128.0 + 1.402 * v + 0.5) as u8));
        assert_eq!(planes.small(&Coding::new(Some(6), true, 480), 2).dimensions(), (2, 1));
    }
}
