//! Other subjects: which are open, how the laws found here do on the one chosen, beside the same laws fitted there, and its profile.

use egui::{Color32, Rect, Role, Sense, Stroke, Ui, UiBuilder, WidgetInfo, pos2, vec2};

use super::profiles::{Canvas, limits};
use super::{MusclesView, Shown, table};
use crate::export::muscle_tables;
use crate::gui::action::Action;
use crate::gui::subjects_work::Listed;
use crate::gui::{Command, Focus};
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::maps::same_topology;
use crate::muscle_field::profiles::Way;
use crate::muscle_field::subjects::{CURVES, Other};

/// Colours of the curves, in the order of [`CURVES`], that can be told apart without red-green vision (Okabe and Ito 2008).
const COLOURS: [Color32; 3] =
    [Color32::from_rgb(86, 180, 233), Color32::from_rgb(230, 159, 0), Color32::from_rgb(0, 158, 115)];
/// Table and profile stand side by side where the panel is at least so wide, points.
const BOTH: f32 = 1000.0;

/// Shows the list, and what is known of the one chosen.
pub(super) fn show(
    ui: &mut Ui,
    shown: &Shown<'_>,
    view: &mut MusclesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    if shown.subjects.listed().is_empty() {
        ui.add_space(8.0);
        ui.label("How do the laws found here do on another face? Open the projects of other subjects: every law is carried there with the shape found here, and fitted anew on equal terms. Mean, spread and difference of the forces then stand among the maps.");
        ui.add_space(6.0);
        open_button(ui, commands);
        return;
    }
    list(ui, shown, view, commands);
    let Some((_, other)) = shown.other else { return };
    let both = ui.available_width() >= BOTH;
    ui.horizontal_wrapped(|ui| choices(ui, view, both));
    ui.separator();
    let rect = ui.available_rect_before_wrap();
    let middle = if both { (rect.right() - 0.42 * rect.width()).floor() } else { rect.right() };
    if both || view.other_table {
        let left = Rect::from_min_max(rect.min, pos2(if both { middle - 10.0 } else { middle }, rect.bottom()));
        ui.scope_builder(UiBuilder::new().max_rect(left), |ui| laws(ui, shown, other, view));
    }
    if both || !view.other_table {
        let right = Rect::from_min_max(pos2(if both { middle } else { rect.left() }, rect.top()), rect.max);
        ui.scope_builder(UiBuilder::new().max_rect(right), |ui| profile(ui, shown, other, view, focus));
    }
    ui.advance_cursor_after_rect(rect);
}

/// Whether the table or the profile is shown, and which way that runs.
fn choices(ui: &mut Ui, view: &mut MusclesView, both: bool) {
    if !both && ui.selectable_label(view.other_table, "Table").clicked() {
        view.other_table = true;
    }
    for (way, words) in [(Way::Radial, "Along the muscle"), (Way::Lateral, "Across it")] {
        if ui.selectable_label((both || !view.other_table) && view.other_way == way, words).clicked() {
            (view.other_table, view.other_way) = (false, way);
        }
    }
    if !both && view.other_table {
        return;
    }
    for (words, colour) in CURVES.iter().zip(COLOURS) {
        let (rect, _) = ui.allocate_exact_size(vec2(18.0, 12.0), Sense::hover());
        ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.5, colour));
        ui.label(*words);
    }
}

/// Every law there, and in words what the table cannot show.
fn laws(ui: &mut Ui, shown: &Shown<'_>, other: &Other, view: &mut MusclesView) {
    egui::ScrollArea::vertical().id_salt("laws on another").auto_shrink(false).show(ui, |ui| {
        let table = muscle_tables::carried(&other.carried);
        if let Some(law) = table::show_whole(ui, "other subjects", &table, Some(shown.law)) {
            view.law = (shown.analysis.best != Some(law)).then_some(law);
        }
        for words in muscle_tables::carried_in_words(&other.carried) {
            ui.label(words);
        }
    });
}

fn open_button(ui: &mut Ui, commands: &mut Vec<Command>) {
    let action = Action::OtherSubjects;
    if ui.button(action.label()).on_hover_text(action.spec().map_or("", |s| s.tooltip)).clicked() {
        commands.push(Command::Do(action));
    }
}

/// The subjects, each with a switch that chooses it and one that takes it off the list.
fn list(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        for listed in shown.subjects.listed() {
            one(ui, shown, listed, view, commands);
        }
        open_button(ui, commands);
        if shown.subjects.is_stopped(shown.answer) {
            ui.weak("stopped; what is shown is older");
            if ui.button("Try the laws again").clicked() {
                commands.push(Command::TrySubjects);
            }
        } else if shown.old {
            ui.spinner();
            ui.weak("trying the laws anew…");
        }
    });
    for listed in shown.subjects.listed() {
        if let Some(Err(why)) = listed.found() {
            ui.colored_label(ui.visuals().warn_fg_color, format!("{}: {why}", listed.name));
        }
    }
}

fn one(ui: &mut Ui, shown: &Shown<'_>, listed: &Listed, view: &mut MusclesView, commands: &mut Vec<Command>) {
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        let chosen = shown.other.is_some_and(|(id, _)| id == listed.id);
        let there = listed.found().is_some_and(|found| found.is_ok());
        let label = egui::Button::selectable(chosen, listed.name.as_str());
        if ui.add_enabled(there, label).on_hover_text(listed.path.display().to_string()).clicked() {
            view.other = Some(listed.id);
        }
        let remove = ui.small_button("×").on_hover_text("Take it off the list; its file stays as it is");
        let words = format!("Remove {}", listed.name);
        remove.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
        if remove.clicked() {
            commands.push(Command::RemoveSubject(listed.id));
        }
    });
}

/// The forces seen on the other subject along or across the chosen muscle, with the chosen law's three curves (Thesis Fig. 5.8 and 5.9).
fn profile(ui: &mut Ui, shown: &Shown<'_>, other: &Other, view: &MusclesView, focus: &mut Focus) {
    let chosen = shown.muscle.and_then(|m| shown.scene.face.muscles().get(m));
    let fitted = chosen.filter(|m| other.carried.muscles.contains(&m.id));
    // A muscle that is not fitted has no curve: the first of those that are speaks for the law.
    let muscle = fitted.map(|m| m.id.as_str()).or(other.carried.muscles.first().map(String::as_str));
    let cut = muscle.and_then(|id| other.carried.profile(other.seen(), shown.law, id, view.other_way, view.part));
    let of = muscle.and_then(|id| other.face.muscles().iter().find(|m| m.id == id));
    let (Some(cut), Some(of)) = (cut, of) else {
        ui.weak("This muscle has no profile there.");
        return;
    };
    let mut canvas = Canvas::new(ui, view.part, other.outcome.unit(), Sense::hover(), focus);
    // On another face the numbers of vertices are other places.
    let same = same_topology(shown.scene.face.mesh(), other.face.mesh());
    if !same {
        canvas.lit = [None; 2];
    }
    let way = if view.other_way == Way::Radial { "Along" } else { "Across" };
    let name = muscle_name(of);
    let stroke = |curve: usize| Stroke::new(if curve == 1 { 3.0 } else { 1.8 }, COLOURS[curve % COLOURS.len()]);
    let pointed = canvas.profile(canvas.rect, &format!("{way} {name}"), &cut, limits(&[&cut]), &stroke);
    if let Some(v) = pointed.filter(|_| same) {
        focus.hover(v as u32);
    }
    let words = format!("{}: profile {} {name}", other.name, way.to_lowercase());
    canvas.is_called(&words);
}
