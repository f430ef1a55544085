//! The row of choices above the height map.

use egui::{ComboBox, DragValue, Ui};

use super::prepared::Prepared;
use super::{ForcesView, Tab};
use crate::draw::colour_map::ColourMap;
use crate::gui::Scene;
use crate::gui::height_map::{
    ColourCurve, ColourRange, Direction, ErrorDisplay, Exaggeration, MapOptions, Quantity, RangeMode, Relief,
};
use crate::gui::orbit_view::StandardView;
use crate::gui::panels::name_combo;
use crate::muscle_field::fibres::muscle_name;

/// Shows the row; it wraps where the window is narrow.
pub(super) fn show(ui: &mut Ui, scene: Scene<'_>, view: &mut ForcesView, prepared: &Prepared) {
    ui.add_space(3.0);
    ui.horizontal_wrapped(|ui| {
        quantity(ui, scene, &mut view.options);
        ui.separator();
        for standard in StandardView::ALL {
            let chosen = view.orbit.is_standard(standard);
            if ui.selectable_label(chosen, standard.label()).on_hover_text(standard.hint()).clicked() {
                view.look(standard);
            }
        }
        ui.separator();
        range(ui, view);
        ui.separator();
        exaggeration(ui, &mut view.options, prepared);
        ui.separator();
        ui.menu_button("Show…", |ui| switches(ui, &mut view.options));
        ui.separator();
        ui.selectable_value(&mut view.tab, Tab::Profiles, "Profiles");
        ui.selectable_value(&mut view.tab, Tab::Table, "Table");
    });
    ui.add_space(3.0);
}

fn quantity(ui: &mut Ui, scene: Scene<'_>, options: &mut MapOptions) {
    let before = options.quantity;
    let shown =
        ComboBox::from_id_salt("quantity").width(150.0).selected_text(options.quantity.label()).show_ui(ui, |ui| {
            for quantity in Quantity::ALL {
                ui.selectable_value(&mut options.quantity, quantity, quantity.label()).on_hover_text(quantity.hint());
            }
        });
    name_combo(&shown.response, "Quantity", options.quantity.label());
    shown.response.on_hover_text(options.quantity.hint());
    if options.quantity != before {
        options.begin_quantity();
    }
    let muscle = options.muscle.and_then(|m| scene.face.muscles().get(m));
    if options.quantity == Quantity::Along {
        let along = |direction, muscle: Option<&crate::face::Muscle>| match (direction, muscle) {
            (Direction::Fibre, Some(muscle)) => format!("along {}", muscle_name(muscle)),
            (Direction::Fibre, None) => "along a fibre".to_owned(),
            (Direction::Up, _) => "upwards".to_owned(),
        };
        let text = along(options.direction, muscle);
        let shown = ComboBox::from_id_salt("direction").width(190.0).selected_text(&text).show_ui(ui, |ui| {
            ui.selectable_value(&mut options.direction, Direction::Up, "upwards");
            for (m, muscle) in scene.face.muscles().iter().enumerate() {
                let chosen = options.direction == Direction::Fibre && options.muscle == Some(m);
                if ui.selectable_label(chosen, along(Direction::Fibre, Some(muscle))).clicked() {
                    options.direction = Direction::Fibre;
                    options.muscle = Some(m);
                }
            }
        });
        name_combo(&shown.response, "Direction", &text);
    }
}

fn range(ui: &mut Ui, view: &mut ForcesView) {
    let locked = view.range_is_locked();
    ui.label("Range");
    if ui.selectable_label(view.options.range == RangeMode::Auto, "Auto").on_hover_text("Follows the data").clicked() {
        view.options.range = RangeMode::Auto;
    }
    let in_view = view.options.range == RangeMode::InView;
    if ui.selectable_label(in_view, "This view").on_hover_text("Follows the vertices inside the canvas").clicked() {
        view.options.range = RangeMode::InView;
    }
    let hint = "Keeps these ends when the data change, so that two results can be compared";
    if ui.selectable_label(locked, "Locked").on_hover_text(hint).clicked() {
        view.toggle_lock();
    }
    let options = &mut view.options;
    if let RangeMode::Locked(range) = options.range {
        let speed = (range.high - range.low) * 0.005;
        let (mut low, mut high) = (range.low, range.high);
        let ends = [("Lower end of the range", &mut low), ("Upper end of the range", &mut high)];
        for (words, end) in ends {
            let field = ui.add(DragValue::new(end).speed(speed).max_decimals(5)).on_hover_text(words);
            field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, words));
        }
        if low.is_finite() && high.is_finite() && (low, high) != (range.low, range.high) {
            options.range = RangeMode::Locked(ColourRange::new(low, high));
        }
    }
}

fn exaggeration(ui: &mut Ui, options: &mut MapOptions, prepared: &Prepared) {
    let layer = &prepared.layer;
    let automatic = options.exaggeration == Exaggeration::Auto;
    let mut mm = options.exaggeration.mm_per_unit(prepared.range(options.range));
    ui.label("Height ×");
    let unit = if layer.unit == "N" { " mm/N" } else { " mm/unit" };
    let speed = mm * 0.01;
    let field = ui.add(DragValue::new(&mut mm).speed(speed).range(1e-6..=1e7).suffix(unit).max_decimals(4));
    let field = field.on_hover_text("How high one unit stands; drag to change");
    field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, "Height exaggeration"));
    if field.changed() {
        options.exaggeration = Exaggeration::Fixed(mm);
    }
    if ui.selectable_label(automatic, "Auto height").on_hover_text("A round number that follows the range").clicked() {
        options.exaggeration = if automatic { Exaggeration::Fixed(mm) } else { Exaggeration::Auto };
    }
}

fn switches(ui: &mut Ui, options: &mut MapOptions) {
    ui.set_min_width(230.0);
    for (switch, words, hint) in [
        (&mut options.wireframe, "Wireframe", "Edges of the mesh"),
        (&mut options.contours, "Contour lines", "Lines of equal value at the ticks of the bar"),
        (&mut options.shading, "Shading", "Light from the upper left; without it colours are exactly the bar's"),
        (&mut options.markers, "Markers", "A sign on each known vertex: dot measured, ring inferred, square fixed"),
        (&mut options.border, "Border vertices", "They have an unmeasured neighbour and carry its reaction"),
        (&mut options.below_noise, "Hatch below 2 ±", "Where the force is less than two standard errors"),
        (&mut options.noise_floor, "Noise floor", "A plane at the median standard error"),
        (&mut options.arrows, "Arrows", "Forces as arrows"),
        (&mut options.fibre, "Fibre of the chosen muscle", "From its attachment to its insertion"),
        (&mut options.axes, "Grid and axes", "Millimetres of the face, and the height axis"),
        (&mut options.fit_known, "Fit what is known", "Fit the view to the known part rather than to the whole face"),
    ] {
        ui.checkbox(switch, words).on_hover_text(hint);
    }
    ui.separator();
    choice(ui, "Standing on", &mut options.relief, &Relief::ALL, Relief::label);
    choice(ui, "Standard error", &mut options.errors, &ErrorDisplay::ALL, ErrorDisplay::label);
    choice(ui, "Spread of colours", &mut options.curve, &ColourCurve::ALL, ColourCurve::label);
    choice(ui, "Colours", &mut options.colours, &[ColourMap::Viridis, ColourMap::Cividis], ColourMap::name);
}

fn choice<T: Copy + PartialEq>(ui: &mut Ui, title: &str, chosen: &mut T, all: &[T], label: fn(T) -> &'static str) {
    ui.weak(title);
    for &item in all {
        ui.radio_value(chosen, item, label(item));
    }
}
