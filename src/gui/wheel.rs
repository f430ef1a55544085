//! How far the wheel, a touchpad or a pinch zooms in one frame.

/// Zoom of one notch of a wheel: five of them double.
pub const PER_NOTCH: f64 = 1.15;

/// Factor by which this frame zooms. A notch of a wheel is spread over a few frames; a touchpad moves by as little as the fingers do.
pub fn zoom_factor(ui: &egui::Ui) -> f64 {
    let points_per_notch = ui.ctx().options(|o| f64::from(o.input_options.line_scroll_speed)).max(1.0);
    ui.input(|i| f64::from(i.zoom_delta()) * PER_NOTCH.powf(f64::from(i.smooth_scroll_delta().y) / points_per_notch))
}
