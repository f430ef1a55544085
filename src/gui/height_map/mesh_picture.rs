//! A mesh of the window painted into a picture by the processor: where there is no graphics card, what would be painted anew in every frame is painted once.
//!
//! The picture is what a card would show: the same triangles in the same order, each pixel that of its middle, colours mixed as the
//! window mixes them. It is painted from the front to the back, so that of a wood of needles only the foremost cost time.

use egui::epaint::Vertex;
use egui::{Color32, ColorImage, Mesh, Pos2, Rect, Vec2, vec2};
use rayon::prelude::*;

/// Rows painted together by one thread.
const BAND_ROWS: usize = 24;

/// Where a picture lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its upper left corner, ui space.
    pub corner: Pos2,
    /// Pixels in a point.
    pub pixels_per_point: f32,
    /// Columns and rows.
    pub size: [usize; 2],
}

/// The longest side of a picture: no screen is wider, and cards refuse textures that are.
const MOST_SIDE_PX: f32 = 8192.0;

impl Place {
    /// A picture that covers `rect` from its upper left corner on.
    pub fn over(rect: Rect, pixels_per_point: f32) -> Self {
        let size = (rect.size() * pixels_per_point).ceil().clamp(Vec2::ZERO, Vec2::splat(MOST_SIDE_PX));
        Self { corner: rect.min, pixels_per_point, size: [size.x as usize, size.y as usize] }
    }

    /// What it covers, ui space.
    pub fn rect(&self) -> Rect {
        let [wide, high] = self.size.map(|n| n as f32 / self.pixels_per_point);
        Rect::from_min_size(self.corner, vec2(wide, high))
    }

    /// The part of it in which `mesh` lies, out to whole pixels.
    fn around(&self, mesh: &Mesh) -> Self {
        let seen = mesh.calc_bounds().intersect(self.rect());
        if !seen.is_positive() {
            return Self { size: [0, 0], ..*self };
        }
        let first = ((seen.min - self.corner) * self.pixels_per_point).floor();
        let corner = self.corner + first / self.pixels_per_point;
        let part = Self::over(Rect::from_min_max(corner, seen.max), self.pixels_per_point);
        Self { size: [0, 1].map(|k| part.size[k].min(self.size[k].saturating_sub(first[k] as usize))), ..part }
    }
}

/// Paints `mesh` over nothing as [`paint`] does, on no more of `place` than it needs; gives where the picture lies.
pub fn paint_cropped(mesh: &Mesh, texture: &ColorImage, place: Place) -> (ColorImage, Place) {
    let place = place.around(mesh);
    (paint(mesh, texture, place), place)
}

/// Paints `mesh` over nothing, in the colours of its `texture`, which is read without blending between texels.
///
/// Triangles with a corner that is not finite, or that does not exist, are left out. The texture runs along u only within a triangle: of
/// its three v the first counts.
pub fn paint(mesh: &Mesh, texture: &ColorImage, place: Place) -> ColorImage {
    let [width, height] = place.size;
    let mut pixels = vec![Color32::TRANSPARENT; width * height];
    if pixels.is_empty() || texture.pixels.is_empty() {
        return ColorImage::new(place.size, pixels);
    }
    let corner = |v: &Vertex| Corner {
        x: f64::from((v.pos.x - place.corner.x) * place.pixels_per_point) - 0.5,
        y: f64::from((v.pos.y - place.corner.y) * place.pixels_per_point) - 0.5,
        u: f64::from(v.uv.x) * texture.width() as f64,
        colour: v.color,
    };
    let corners: Vec<Corner> = mesh.vertices.iter().map(corner).collect();
    let row_of_texture = |v: f32| ((v * texture.height() as f32) as usize).min(texture.height() - 1);
    // The triangles that touch each band, the last painted first.
    let mut bands: Vec<Vec<[u32; 3]>> = vec![Vec::new(); height.div_ceil(BAND_ROWS)];
    for t in mesh.indices.as_chunks::<3>().0.iter().rev() {
        if t.iter().any(|&v| v as usize >= corners.len()) {
            continue;
        }
        let [a, b, c] = t.map(|v| &corners[v as usize]);
        let (left, right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let (top, bottom) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        let seen = right > -1.0 && left < width as f64 && bottom > 0.0 && top < height as f64;
        if !seen || ![a, b, c].iter().all(|c| c.x.is_finite() && c.y.is_finite() && c.u.is_finite()) {
            continue;
        }
        let first = top.max(0.0) as usize / BAND_ROWS;
        let last = (bottom.min(height as f64 - 1.0) as usize / BAND_ROWS).min(bands.len() - 1);
        for band in &mut bands[first..=last] {
            band.push(*t);
        }
    }
    pixels.par_chunks_mut(width * BAND_ROWS).zip(&bands).enumerate().for_each(|(k, (pixels, triangles))| {
        let mut band = Band { pixels, width, first_row: k * BAND_ROWS };
        for t in triangles {
            let row = row_of_texture(mesh.vertices[t[0] as usize].uv.y);
            let texels = &texture.pixels[row * texture.width()..(row + 1) * texture.width()];
            band.triangle(t.map(|v| &corners[v as usize]), texels);
        }
    });
    ColorImage::new(place.size, pixels)
}

/// A corner in pixels of the picture, counted from the middle of its first one.
struct Corner {
    x: f64,
    y: f64,
    /// In texels.
    u: f64,
    colour: Color32,
}

/// An edge from its upper corner down.
struct Edge<'a> {
    from: &'a Corner,
    to: &'a Corner,
    per_row: f64,
}

impl<'a> Edge<'a> {
    fn new(from: &'a Corner, to: &'a Corner) -> Self {
        Self { from, to, per_row: 1.0 / (to.y - from.y) }
    }

    /// Column at which it meets a row. Both triangles at an edge ask for the same two corners in the same order, so that no pixel is
    /// painted by both or by neither.
    fn x_at(&self, y: f64) -> f64 {
        self.from.x + self.share(y) * (self.to.x - self.from.x)
    }

    fn share(&self, y: f64) -> f64 {
        (y - self.from.y) * self.per_row
    }

    /// Something that the corners have, where the edge meets a row.
    fn at(&self, y: f64, of: impl Fn(&Corner) -> f64) -> f64 {
        let (from, to) = (of(self.from), of(self.to));
        from + self.share(y) * (to - from)
    }
}

struct Band<'a> {
    pixels: &'a mut [Color32],
    width: usize,
    first_row: usize,
}

/// How the colours of a triangle run.
enum Run {
    /// Of one colour all over.
    Plain(Color32),
    /// Along the texture, lit by a grey.
    Lit,
    /// Along the texture, and every channel of the colour for itself.
    Free,
}

impl Run {
    fn of([a, b, c]: [&Corner; 3], texel: impl Fn(f64) -> Color32) -> Self {
        if a.colour == b.colour && b.colour == c.colour && a.u == b.u && b.u == c.u {
            return Self::Plain(multiply(a.colour, texel(a.u)));
        }
        let grey = |c: &Corner| c.colour == Color32::from_gray(c.colour.r());
        if grey(a) && grey(b) && grey(c) { Self::Lit } else { Self::Free }
    }
}

impl Band<'_> {
    fn triangle(&mut self, mut corners: [&Corner; 3], texels: &[Color32]) {
        corners.sort_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
        let [a, b, c] = corners;
        let rows = self.pixels.len() / self.width;
        let rows = |y: f64| whole_from(y - self.first_row as f64, rows);
        let last = texels.len() - 1;
        let texel = |u: f64| texels[(u.max(0.0) as usize).min(last)];
        let run = Run::of(corners, texel);
        if matches!(run, Run::Plain(Color32::TRANSPARENT)) {
            return;
        }
        let (long, upper, lower) = (Edge::new(a, c), Edge::new(a, b), Edge::new(b, c));
        for row in rows(a.y)..rows(c.y) {
            let y = (self.first_row + row) as f64;
            let short = if y < b.y { &upper } else { &lower };
            let (mut left, mut right) = ((long.x_at(y), &long), (short.x_at(y), short));
            if left.0 > right.0 {
                (left, right) = (right, left);
            }
            let (first, end) = (whole_from(left.0, self.width), whole_from(right.0, self.width));
            if first >= end {
                continue;
            }
            let pixels = &mut self.pixels[row * self.width + first..row * self.width + end];
            if let Run::Plain(colour) = run {
                for pixel in pixels {
                    put_under(pixel, colour);
                }
                continue;
            }
            if pixels.iter().all(|p| p.a() == 255) {
                continue;
            }
            let per_px = 1.0 / (right.0 - left.0).max(1e-9);
            let before = (first as f64 - left.0) * per_px;
            // Value at the first pixel, and from one pixel to the next.
            let along = |of: &dyn Fn(&Corner) -> f64| {
                let (from, to) = (left.1.at(y, of), right.1.at(y, of));
                (from + before * (to - from), (to - from) * per_px)
            };
            let (u, du) = along(&|c| c.u);
            let free = matches!(run, Run::Free);
            let channels: [(f64, f64); 4] =
                std::array::from_fn(|k| if k == 0 || free { along(&|c| f64::from(c.colour[k])) } else { (0.0, 0.0) });
            for (i, pixel) in pixels.iter_mut().enumerate().filter(|(_, p)| p.a() < 255) {
                let i = i as f64;
                let level = |k: usize| (channels[k].0 + i * channels[k].1 + 0.5) as u8;
                let colour = if free {
                    Color32::from_rgba_premultiplied(level(0), level(1), level(2), level(3))
                } else {
                    Color32::from_gray(level(0))
                };
                put_under(pixel, multiply(colour, texel(u + i * du)));
            }
        }
    }
}

/// The first whole number that is not below `x`, from 0 to `most`.
fn whole_from(x: f64, most: usize) -> usize {
    if x <= 0.0 {
        return 0;
    }
    let below = x as usize;
    (below + usize::from((below as f64) < x)).min(most)
}

/// What lies behind shows as far as what is before it is clear.
fn put_under(front: &mut Color32, behind: Color32) {
    let [fr, fg, fb, fa] = front.to_array();
    match fa {
        0 => *front = behind,
        255 => {}
        _ => {
            let [r, g, b, a] = behind.to_array().map(|c| share(c, 255 - fa));
            *front = Color32::from_rgba_premultiplied(
                fr.saturating_add(r),
                fg.saturating_add(g),
                fb.saturating_add(b),
                fa.saturating_add(a),
            );
        }
    }
}

fn multiply(a: Color32, b: Color32) -> Color32 {
    let [p, q] = [a, b].map(|c| c.to_array());
    let [r, g, b, a] = std::array::from_fn(|k| share(p[k], q[k]));
    Color32::from_rgba_premultiplied(r, g, b, a)
}

/// a · b / 255, rounded.
fn share(a: u8, b: u8) -> u8 {
    ((u32::from(a) * u32::from(b) + 127) / 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    const WHITE: [usize; 2] = [1, 1];

    fn white() -> ColorImage {
        ColorImage::new(WHITE, vec![Color32::WHITE])
    }

    fn place(side: usize) -> Place {
        Place { corner: Pos2::ZERO, pixels_per_point: 1.0, size: [side, side] }
    }

    fn corner(x: f32, y: f32, color: Color32) -> Vertex {
        Vertex { pos: pos2(x, y), uv: pos2(0.5, 0.5), color }
    }

    fn mesh(corners: &[Vertex], indices: &[u32]) -> Mesh {
        Mesh { indices: indices.to_vec(), vertices: corners.to_vec(), texture_id: egui::TextureId::default() }
    }

    #[test]
    fn a_fan_paints_every_pixel_once_wherever_its_middle_lies() {
        // A clear colour painted twice would be darker, and a pixel left out would be empty.
        let grey = Color32::from_rgba_premultiplied(60, 60, 60, 120);
        for (x, y) in [(3.5, 4.5), (7.3, 2.1), (6.0, 6.0), (0.51, 9.49)] {
            let at = [(x, y), (0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
            let corners = at.map(|(x, y)| corner(x, y, grey));
            let fan = mesh(&corners, &[0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1]);
            let picture = paint(&fan, &white(), place(12));
            for (k, p) in picture.pixels.iter().enumerate() {
                let inside = k % 12 < 10 && k / 12 < 10;
                assert_eq!(*p, if inside { grey } else { Color32::TRANSPARENT }, "{x} {y}: pixel {k}");
            }
        }
    }

    #[test]
    fn what_is_painted_later_lies_over_what_was_there_and_a_clear_colour_lets_it_through() {
        let square = |x: f32, color: Color32| {
            [(x, 0.0), (x + 4.0, 0.0), (x + 4.0, 8.0), (x, 8.0)].map(|(x, y)| corner(x, y, color))
        };
        let red = Color32::from_rgb(200, 0, 0);
        let half_blue = Color32::from_rgba_premultiplied(0, 0, 100, 128);
        let corners = [square(0.0, red), square(2.0, half_blue)].concat();
        let picture = paint(&mesh(&corners, &[0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]), &white(), place(8));
        assert_eq!(picture.pixels[0], red);
        // Blue, and of the red the 127/255 that shows through: 200 · 127 / 255 = 99.6.
        assert_eq!(picture.pixels[3], Color32::from_rgb(100, 0, 100));
        assert_eq!(picture.pixels[5], half_blue);
        assert_eq!(picture.pixels[7], Color32::TRANSPARENT);
    }

    #[test]
    fn values_run_along_the_texture_and_light_along_the_colours() {
        let ramp = ColorImage::new([256, 1], (0..=255).map(Color32::from_gray).collect());
        let corners = [(0.0, 0.0, 0.0), (512.0, 0.0, 2.0), (0.0, 8.0, 0.0), (512.0, 8.0, 2.0)]
            .map(|(x, y, u)| Vertex { pos: pos2(x, y), uv: pos2(u, 0.5), color: Color32::WHITE });
        let size = [512, 8];
        let picture = paint(&mesh(&corners, &[0, 1, 2, 2, 1, 3]), &ramp, Place { size, ..place(1) });
        for x in 0..512 {
            // u = (x + ½) / 256, and beyond 1 it stays at the end.
            assert_eq!(picture.pixels[3 * 512 + x], Color32::from_gray(x.min(255) as u8), "{x}");
        }
        // From black to white over 512 pixels: at pixel x, 255 (x + ½) / 512.
        let lit = corners.map(|c| Vertex { color: Color32::from_gray(if c.pos.x > 0.0 { 255 } else { 0 }), ..c });
        let picture = paint(&mesh(&lit, &[0, 1, 2, 2, 1, 3]), &white(), Place { size, ..place(1) });
        for x in (0..512).step_by(37) {
            let expected = 255.0 * (x as f32 + 0.5) / 512.0;
            assert!((f32::from(picture.pixels[512 + x].r()) - expected).abs() <= 0.51, "{x}");
        }
    }

    #[test]
    fn a_finer_screen_has_more_pixels_and_what_is_no_number_paints_nothing() {
        let corners = [(10.0, 20.0), (14.0, 20.0), (10.0, 24.0), (14.0, 24.0)].map(|(x, y)| corner(x, y, Color32::RED));
        let fine = Place { corner: pos2(10.0, 20.0), pixels_per_point: 2.0, size: [9, 9] };
        let picture = paint(&mesh(&corners, &[0, 1, 2, 2, 1, 3]), &white(), fine);
        assert_eq!(picture.pixels.iter().filter(|p| **p == Color32::RED).count(), 64, "4 points are 8 pixels");
        let mut bad = corners;
        bad[1].pos.x = f32::NAN;
        let picture = paint(&mesh(&bad, &[0, 1, 2, 2, 1, 900]), &white(), fine);
        assert!(picture.pixels.iter().all(|p| *p == Color32::TRANSPARENT));
        assert!(paint(&mesh(&corners, &[0, 1, 2]), &white(), Place { size: [0, 5], ..fine }).pixels.is_empty());
    }

    #[test]
    fn a_cropped_picture_has_the_pixels_of_the_whole_one() {
        let corners = [(3.2, 5.7), (9.1, 4.2), (6.0, 13.5)].map(|(x, y)| corner(x, y, Color32::RED));
        let triangle = mesh(&corners, &[0, 1, 2]);
        for pixels_per_point in [1.0, 1.7, 2.0] {
            let whole = Place::over(Rect::from_min_max(pos2(1.0, 2.0), pos2(8.0, 20.0)), pixels_per_point);
            let (part, place) = paint_cropped(&triangle, &white(), whole);
            let all = paint(&triangle, &white(), whole);
            assert!(part.pixels.len() < all.pixels.len());
            let [left, top] = [0, 1].map(|k| ((place.corner - whole.corner) * pixels_per_point)[k].round() as usize);
            for (k, p) in all.pixels.iter().enumerate() {
                let (x, y) = (k % whole.size[0], k / whole.size[0]);
                let within = (left..left + place.size[0]).contains(&x) && (top..top + place.size[1]).contains(&y);
                let in_part = within.then(|| part.pixels[(y - top) * place.size[0] + x - left]);
                assert_eq!(in_part.unwrap_or(Color32::TRANSPARENT), *p, "{x} {y}");
            }
        }
        let nowhere = Place { corner: pos2(100.0, 100.0), ..place(8) };
        assert_eq!(paint_cropped(&triangle, &white(), nowhere).1.size, [0, 0]);
    }
}
