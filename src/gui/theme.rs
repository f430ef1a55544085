//! How the window looks: two quiet palettes, one spacing, and the colours of everything drawn on a picture.

use super::keyboard::OneTabAPass;
use egui::{Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, Style, TextStyle, Theme, Vec2, Visuals};

/// Colours of what is drawn on a picture. They lie on photographs of skin, so they are the same in light and dark.
pub mod on_picture {
    use egui::Color32;

    /// A landmark.
    pub const LANDMARK: Color32 = Color32::from_rgb(64, 224, 208);
    /// A feature point of ordinary skin.
    pub const FEATURE: Color32 = Color32::from_rgb(255, 190, 60);
    /// A still point.
    pub const STILL: Color32 = Color32::from_rgb(190, 150, 255);
    /// A fixed point.
    pub const FIXED: Color32 = Color32::from_rgb(200, 205, 212);
    /// A place that is suggested.
    pub const SUGGESTED: Color32 = Color32::from_rgb(110, 200, 255);
    /// The selected point, and the vertex under the pointer.
    pub const SELECTED: Color32 = Color32::from_rgb(255, 255, 255);
    /// The two points of the scale.
    pub const SCALE: Color32 = Color32::from_rgb(120, 220, 120);
    /// Around every mark, so that it can be seen on any skin.
    pub const HALO: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 150);
}

/// Colours that differ between light and dark and have no place in egui's own visuals.
#[derive(Clone, Copy, Debug)]
pub struct Palette {
    /// Behind a picture.
    pub canvas: Color32,
    /// What is active.
    pub accent: Color32,
    /// Text on the accent.
    pub on_accent: Color32,
    /// Something to heed.
    pub warn: Color32,
    /// Something done.
    pub good: Color32,
    /// A quiet surface that lies on a panel.
    pub card: Color32,
    /// The line around it.
    pub line: Color32,
}

/// The palette of the theme in use.
pub fn palette(visuals: &Visuals) -> Palette {
    if visuals.dark_mode {
        Palette {
            canvas: Color32::from_rgb(17, 18, 20),
            accent: Color32::from_rgb(76, 154, 214),
            on_accent: Color32::from_rgb(10, 16, 22),
            warn: Color32::from_rgb(240, 178, 82),
            good: Color32::from_rgb(108, 190, 132),
            card: Color32::from_rgb(42, 45, 50),
            line: Color32::from_rgb(58, 62, 69),
        }
    } else {
        Palette {
            canvas: Color32::from_rgb(214, 216, 219),
            accent: Color32::from_rgb(24, 104, 168),
            on_accent: Color32::WHITE,
            warn: Color32::from_rgb(158, 92, 0),
            good: Color32::from_rgb(28, 122, 62),
            card: Color32::WHITE,
            line: Color32::from_rgb(212, 215, 220),
        }
    }
}

/// Gives a context both styles.
pub fn install(ctx: &egui::Context) {
    ctx.add_plugin(OneTabAPass::default());
    ctx.set_style_of(Theme::Dark, style(Theme::Dark));
    ctx.set_style_of(Theme::Light, style(Theme::Light));
}

fn style(theme: Theme) -> Style {
    let mut visuals = match theme {
        Theme::Dark => Visuals::dark(),
        Theme::Light => Visuals::light(),
    };
    let p = palette(&visuals);
    let (panel, text, weak, faint, widget, hovered, active) = match theme {
        Theme::Dark => (
            Color32::from_rgb(31, 33, 37),
            Color32::from_rgb(218, 221, 226),
            Color32::from_rgb(154, 160, 168),
            Color32::from_rgb(36, 39, 43),
            Color32::from_rgb(50, 54, 60),
            Color32::from_rgb(62, 67, 75),
            Color32::from_rgb(72, 78, 87),
        ),
        Theme::Light => (
            Color32::from_rgb(243, 244, 246),
            Color32::from_rgb(32, 36, 42),
            Color32::from_rgb(92, 98, 107),
            Color32::from_rgb(234, 236, 239),
            Color32::from_rgb(226, 229, 233),
            Color32::from_rgb(214, 219, 225),
            Color32::from_rgb(200, 207, 215),
        ),
    };
    visuals.panel_fill = panel;
    visuals.window_fill = panel;
    visuals.faint_bg_color = faint;
    visuals.extreme_bg_color = if theme == Theme::Dark { Color32::from_rgb(22, 24, 27) } else { Color32::WHITE };
    visuals.window_stroke = Stroke::new(1.0, p.line);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.selection.bg_fill = p.accent.gamma_multiply(if theme == Theme::Dark { 0.45 } else { 0.28 });
    visuals.selection.stroke = Stroke::new(1.0, if theme == Theme::Dark { Color32::WHITE } else { text });
    visuals.hyperlink_color = p.accent;
    visuals.warn_fg_color = p.warn;
    visuals.weak_text_color = Some(weak);
    let w = &mut visuals.widgets;
    w.noninteractive.bg_stroke = Stroke::new(1.0, p.line);
    w.noninteractive.fg_stroke = Stroke::new(1.0, text);
    for (visual, fill) in
        [(&mut w.inactive, widget), (&mut w.hovered, hovered), (&mut w.active, active), (&mut w.open, hovered)]
    {
        visual.bg_fill = fill;
        visual.weak_bg_fill = fill;
        visual.bg_stroke = Stroke::NONE;
        visual.fg_stroke = Stroke::new(1.0, text);
        visual.expansion = 0.0;
    }
    w.hovered.bg_stroke = Stroke::new(1.0, p.accent.gamma_multiply(0.6));
    for visual in [&mut w.noninteractive, &mut w.inactive, &mut w.hovered, &mut w.active, &mut w.open] {
        visual.corner_radius = CornerRadius::same(5);
    }

    let mut style = Style { visuals, ..Style::default() };
    for (text_style, size, family) in [
        (TextStyle::Small, 11.0, FontFamily::Proportional),
        (TextStyle::Body, 13.0, FontFamily::Proportional),
        (TextStyle::Button, 13.0, FontFamily::Proportional),
        (TextStyle::Heading, 16.0, FontFamily::Proportional),
        (TextStyle::Monospace, 12.0, FontFamily::Monospace),
    ] {
        style.text_styles.insert(text_style, FontId::new(size, family));
    }
    style.spacing.item_spacing = Vec2::new(8.0, 6.0);
    style.spacing.button_padding = Vec2::new(8.0, 3.0);
    style.spacing.interact_size.y = 22.0;
    style.spacing.menu_margin = Margin::same(6);
    style.spacing.slider_width = 110.0;
    style.interaction.tooltip_delay = 0.4;
    style
}

/// The frame of a dialog inside the window.
pub fn dialog_frame(style: &Style) -> egui::Frame {
    egui::Frame::popup(style).inner_margin(Margin::same(16)).corner_radius(CornerRadius::same(10))
}
