//! A picture on the graphics card: in tiles, so that no card's limit on the side of a texture matters, and uploaded one
//! tile a frame, so that no second whole copy of the picture is ever in memory.

use std::sync::Arc;

use egui::{Color32, ColorImage, Mesh, Pos2, Rect, TextureFilter, TextureHandle, TextureOptions, TextureWrapMode};
use image::RgbImage;

/// Side of a tile, px. Every card of the last fifteen years takes 4096; a quarter of that keeps the copy in flight at 4 MB.
const TILE_PX: u32 = 1024;

const OPTIONS: TextureOptions = TextureOptions {
    magnification: TextureFilter::Linear,
    minification: TextureFilter::Linear,
    wrap_mode: TextureWrapMode::ClampToEdge,
    // A painted grid shown small would otherwise turn into moiré. Blending between two sizes would double the work of a card that
    // is a program.
    mipmap_mode: Some(TextureFilter::Nearest),
};

/// A picture in tiles.
#[derive(Default)]
pub struct Tiles {
    name: String,
    size: [u32; 2],
    parts: Vec<Tile>,
    /// The pixels still to upload, and the next tile.
    pending: Option<(Arc<RgbImage>, usize)>,
}

/// Pixels `from..to` of the picture. The texture has one more on each inner side, so that neighbours blend without a seam.
struct Tile {
    from: [u32; 2],
    to: [u32; 2],
    padded_from: [u32; 2],
    padded_to: [u32; 2],
    handle: Option<TextureHandle>,
}

impl Tiles {
    /// An empty picture of that name, for the log of the graphics card.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Size of the picture, px.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Begins to show these pixels. What was shown stays until the new tiles are there, if the size is the same.
    pub fn set(&mut self, pixels: Arc<RgbImage>) {
        let size = [pixels.width(), pixels.height()];
        if size != self.size {
            self.size = size;
            self.parts = cut(size);
        }
        self.pending = Some((pixels, 0));
    }

    /// Uploads the next tile, if one waits; true while more are to come.
    pub fn upload_next(&mut self, ctx: &egui::Context) -> bool {
        let Some((pixels, next)) = self.pending.take() else { return false };
        let Some(tile) = self.parts.get_mut(next) else { return false };
        let part = part(&pixels, tile.padded_from, tile.padded_to);
        match &mut tile.handle {
            Some(texture) => texture.set(part, OPTIONS),
            None => tile.handle = Some(ctx.load_texture(format!("{} {next}", self.name), part, OPTIONS)),
        }
        if next + 1 < self.parts.len() {
            self.pending = Some((pixels, next + 1));
        }
        self.pending.is_some()
    }

    /// Draws the picture with `ui_from_image` giving the place of a pixel on the screen.
    pub fn paint(&self, painter: &egui::Painter, ui_from_image: impl Fn([f64; 2]) -> Pos2) {
        for tile in &self.parts {
            let Some(texture) = &tile.handle else { continue };
            let corner = |p: [u32; 2]| ui_from_image([f64::from(p[0]), f64::from(p[1])]);
            let rect = Rect::from_min_max(corner(tile.from), corner(tile.to));
            if !painter.clip_rect().intersects(rect) {
                continue;
            }
            let share = |p: [u32; 2]| {
                let along =
                    |i: usize| (p[i] - tile.padded_from[i]) as f32 / (tile.padded_to[i] - tile.padded_from[i]) as f32;
                Pos2::new(along(0), along(1))
            };
            let mut mesh = Mesh::with_texture(texture.id());
            mesh.add_rect_with_uv(rect, Rect::from_min_max(share(tile.from), share(tile.to)), Color32::WHITE);
            painter.add(mesh);
        }
    }
}

fn cut(size: [u32; 2]) -> Vec<Tile> {
    let mut tiles = Vec::new();
    for y in (0..size[1]).step_by(TILE_PX as usize) {
        for x in (0..size[0]).step_by(TILE_PX as usize) {
            let from = [x, y];
            let to = [(x + TILE_PX).min(size[0]), (y + TILE_PX).min(size[1])];
            tiles.push(Tile {
                from,
                to,
                padded_from: [x.saturating_sub(1), y.saturating_sub(1)],
                padded_to: [(to[0] + 1).min(size[0]), (to[1] + 1).min(size[1])],
                handle: None,
            });
        }
    }
    tiles
}

fn part(pixels: &RgbImage, from: [u32; 2], to: [u32; 2]) -> ColorImage {
    let size = [(to[0] - from[0]) as usize, (to[1] - from[1]) as usize];
    let mut colours = Vec::with_capacity(size[0] * size[1]);
    let row_px = pixels.width() as usize;
    for y in from[1] as usize..to[1] as usize {
        let row = &pixels.as_raw()[3 * (y * row_px + from[0] as usize)..3 * (y * row_px + to[0] as usize)];
        colours.extend(row.as_chunks::<3>().0.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)));
    }
    ColorImage::new(size, colours)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_a_large_picture_once_and_overlap_by_a_pixel() {
        let tiles = cut([5000, 2049]);
        let area: u64 = tiles.iter().map(|t| u64::from(t.to[0] - t.from[0]) * u64::from(t.to[1] - t.from[1])).sum();
        assert_eq!((tiles.len(), area), (15, 5000 * 2049));
        assert_eq!((tiles[1].padded_from, tiles[1].padded_to), ([1023, 0], [2049, 1025]));
    }

    #[test]
    fn a_part_of_a_picture_has_its_own_pixels() {
        let pixels = RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8, y as u8, 9]));
        let part = part(&pixels, [2, 1], [5, 4]);
        assert_eq!(part.size, [3, 3]);
        assert_eq!(part.pixels[0], Color32::from_rgb(2, 1, 9));
        assert_eq!(part.pixels[8], Color32::from_rgb(4, 3, 9));
    }
}
