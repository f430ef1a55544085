//! Where a picture lies in its pane: the way from pixels to the screen and back, zoom and pan.

use egui::{Pos2, Rect, Vec2};

/// Smallest and largest zoom, ui points per pixel.
const ZOOM_RANGE: (f64, f64) = (0.02, 64.0);

/// Which part of a picture a pane shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageView {
    /// The pixel in the middle of the pane.
    pub centre_in_image: [f64; 2],
    /// ui points per pixel.
    pub zoom: f64,
    /// Whether the whole picture is shown, whatever the size of the pane.
    pub fitted: bool,
}

impl Default for ImageView {
    fn default() -> Self {
        Self { centre_in_image: [0.0, 0.0], zoom: 1.0, fitted: true }
    }
}

impl ImageView {
    /// The view that shows the whole picture.
    pub fn fit(size_px: [u32; 2], pane: Rect) -> Self {
        let (w, h) = (f64::from(size_px[0].max(1)), f64::from(size_px[1].max(1)));
        let zoom = (f64::from(pane.width()) / w).min(f64::from(pane.height()) / h) * 0.98;
        Self { centre_in_image: [w / 2.0, h / 2.0], zoom: zoom.max(1e-3), fitted: true }
    }

    /// Zooms by a factor, so that the pixel under `fixed` stays there.
    pub fn zoom_at(&mut self, factor: f64, fixed: Pos2, pane: Rect) {
        let before = self.at(pane).image_from_ui(fixed);
        self.zoom = (self.zoom * factor).clamp(ZOOM_RANGE.0, ZOOM_RANGE.1);
        let after = self.at(pane).image_from_ui(fixed);
        for i in 0..2 {
            self.centre_in_image[i] += before[i] - after[i];
        }
        self.fitted = false;
    }

    /// Moves the picture with the hand.
    pub fn pan(&mut self, by: Vec2) {
        self.centre_in_image[0] -= f64::from(by.x) / self.zoom;
        self.centre_in_image[1] -= f64::from(by.y) / self.zoom;
        self.fitted = false;
    }

    /// The transform of this view in a pane.
    pub fn at(&self, pane: Rect) -> Transform {
        Transform { pane_centre: pane.center(), centre_in_image: self.centre_in_image, zoom: self.zoom }
    }
}

/// Pixels to the screen and back.
#[derive(Clone, Copy, Debug)]
pub struct Transform {
    /// Middle of the pane, ui points.
    pub pane_centre: Pos2,
    /// The pixel that lies there.
    pub centre_in_image: [f64; 2],
    /// ui points per pixel.
    pub zoom: f64,
}

impl Transform {
    /// Place of a pixel on the screen.
    pub fn ui_from_image(&self, p: [f64; 2]) -> Pos2 {
        Pos2::new(
            self.pane_centre.x + ((p[0] - self.centre_in_image[0]) * self.zoom) as f32,
            self.pane_centre.y + ((p[1] - self.centre_in_image[1]) * self.zoom) as f32,
        )
    }

    /// Pixel at a place on the screen.
    pub fn image_from_ui(&self, p: Pos2) -> [f64; 2] {
        [
            self.centre_in_image[0] + f64::from(p.x - self.pane_centre.x) / self.zoom,
            self.centre_in_image[1] + f64::from(p.y - self.pane_centre.y) / self.zoom,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pixel_under_the_pointer_stays_there_while_zooming() {
        let pane = Rect::from_min_max(Pos2::new(10.0, 20.0), Pos2::new(410.0, 320.0));
        let mut view = ImageView::fit([1036, 1036], pane);
        let pointer = Pos2::new(90.0, 250.0);
        let before = view.at(pane).image_from_ui(pointer);
        view.zoom_at(3.7, pointer, pane);
        let after = view.at(pane).image_from_ui(pointer);
        assert!((before[0] - after[0]).abs() < 1e-9 && (before[1] - after[1]).abs() < 1e-9);
        assert!((view.at(pane).ui_from_image(before) - pointer).length() < 1e-3);
    }
}
