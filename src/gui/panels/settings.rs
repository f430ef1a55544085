//! The choices of the chain: scale, camera, fit, displacement, skin, marking error.

use egui::{CollapsingHeader, DragValue, RichText};

use super::frames::{FramesView, Tool};
use super::skin_table::{self, SkinTableView};
use crate::camera::Scale;
use crate::customize::{AlignRule, MorphRule};
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::forces::{SkinModel, SpringRule};
use crate::gui::{Command, Scene};
use crate::project::{CameraSettings, Edit, Settings};

mod field_way;

/// What is being typed into the settings.
#[derive(Debug, Default)]
pub struct SettingsView {
    /// The skin table.
    pub skin: SkinTableView,
    /// Distance of the inner eye corners, while it is chosen but not yet typed: until then nothing is measured.
    eye_corners: Option<String>,
}

/// Shows the settings.
pub fn show(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut FramesView, commands: &mut Vec<Command>) {
    super::in_fixed_width(ui, |ui| sections(ui, scene, view, commands));
}

fn sections(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut FramesView, commands: &mut Vec<Command>) {
    section(ui, "Project", true, |ui| project(ui, scene, commands));
    section(ui, "Scale", true, |ui| scale(ui, scene, view, commands));
    section(ui, "Camera", true, |ui| camera(ui, scene, commands));
    section(ui, "Landmark fit", false, |ui| fit(ui, scene, commands));
    section(ui, "Displacement", true, |ui| displacement(ui, scene, commands));
    section(ui, "Way to the forces", true, |ui| field_way::show(ui, scene, commands));
    section(ui, "Skin", false, |ui| skin(ui, scene, &mut view.settings.skin, commands));
    section(ui, "Marking error", true, |ui| marking(ui, scene, commands));
}

fn section(ui: &mut egui::Ui, title: &str, open: bool, contents: impl FnOnce(&mut egui::Ui)) {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show_unindented(ui, |ui| {
        egui::Frame::NONE.inner_margin(egui::Margin { left: 4, right: 4, top: 2, bottom: 8 }).show(ui, contents);
    });
}

/// A number with its unit; a drag over it is one step of the history.
pub struct Number<'a> {
    /// What it is.
    pub label: &'a str,
    /// Its unit, with the space before it.
    pub unit: &'a str,
    /// What it does to the result.
    pub tooltip: &'a str,
    /// Least and greatest value.
    pub range: std::ops::RangeInclusive<f64>,
    /// Change a point of the pointer's way.
    pub speed: f64,
    /// Digits shown after the point.
    pub decimals: usize,
}

impl Number<'_> {
    /// Shows the number in a row; `edit` makes the change.
    pub fn show(&self, ui: &mut egui::Ui, value: f64, commands: &mut Vec<Command>, edit: impl FnOnce(f64) -> Edit) {
        let mut new = value;
        ui.horizontal(|ui| {
            let label = ui.label(self.label).on_hover_text(self.tooltip);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let drag = DragValue::new(&mut new)
                    .range(self.range.clone())
                    .speed(self.speed)
                    .max_decimals(self.decimals + 2)
                    .min_decimals(self.decimals.min(1))
                    .suffix(self.unit);
                let response = ui.add(drag).labelled_by(label.id).on_hover_text(self.tooltip);
                if response.drag_started() {
                    commands.push(Command::BeginGesture);
                }
                if response.changed() && new != value {
                    commands.push(Command::Edit(edit(new)));
                }
                if response.drag_stopped() {
                    commands.push(Command::CommitGesture);
                }
            });
        });
    }
}

fn project(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let mut name = scene.project.name.clone();
    ui.horizontal(|ui| {
        let label = ui.label("Name");
        let edit = egui::TextEdit::singleline(&mut name).hint_text("Untitled").desired_width(f32::INFINITY);
        typed(&ui.add(edit).labelled_by(label.id), commands, || Edit::Rename(name.clone()));
    });
    let mut notes = scene.project.notes.clone();
    let label = ui.label("Notes");
    let edit = egui::TextEdit::multiline(&mut notes).desired_rows(2).desired_width(f32::INFINITY);
    typed(&ui.add(edit).labelled_by(label.id), commands, || Edit::SetNotes(notes.clone()));
}

/// Typing is one step of the history, from the first key until the field is left.
fn typed(response: &egui::Response, commands: &mut Vec<Command>, edit: impl FnOnce() -> Edit) {
    if response.gained_focus() {
        commands.push(Command::BeginGesture);
    }
    if response.changed() {
        commands.push(Command::Edit(edit()));
    }
    if response.lost_focus() {
        commands.push(Command::CommitGesture);
    }
}

fn scale(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut FramesView, commands: &mut Vec<Command>) {
    let scale = scene.project.scale;
    let mm = Number {
        label: "Distance",
        unit: " mm",
        tooltip: "The true distance.",
        range: 0.1..=1000.0,
        speed: 0.1,
        decimals: 1,
    };
    let rows = [
        (
            "Assumed from the mean face",
            matches!(scale, Scale::Assumed),
            "Forces are relative until a scale is measured.",
        ),
        (
            "Two places a known distance apart",
            matches!(scale, Scale::TwoPoints { .. }),
            "Click two places of the first frame near the plane of the eyes, then type their distance.",
        ),
        (
            "Pitch of the painted grid",
            matches!(scale, Scale::GridPitch { .. }),
            "Click two crossings of the grid in the first frame, then type the cells between them and the pitch.",
        ),
        (
            "Distance of the inner eye corners",
            matches!(scale, Scale::InnerEyeCorners { .. }),
            "Type the person's own distance; the two landmarks must be placed.",
        ),
    ];
    let asked = view.settings.eye_corners.is_some();
    for (i, (label, on, tooltip)) in rows.into_iter().enumerate() {
        let on = if asked { i == 3 } else { on };
        if !ui.radio(on, label).on_hover_text(tooltip).clicked() {
            continue;
        }
        if i != 3 {
            view.settings.eye_corners = None;
        }
        match i {
            0 => commands.push(Command::Edit(Edit::SetScale(Scale::Assumed))),
            1 | 2 => view.tool = Tool::ScalePoints { grid: i == 2, first: None },
            _ if on => {}
            _ => view.settings.eye_corners = Some(String::new()),
        }
    }
    ui.add_space(2.0);
    match scale {
        _ if view.settings.eye_corners.is_some() => type_eye_corners(ui, &mut view.settings.eye_corners, commands),
        Scale::Assumed => {}
        Scale::TwoPoints { a_px, b_px, mm: value } => {
            mm.show(ui, value, commands, |mm| Edit::SetScale(Scale::TwoPoints { a_px, b_px, mm }));
        }
        Scale::GridPitch { a_px, b_px, cells, pitch_mm } => {
            let number = Number {
                label: "Cells between",
                unit: "",
                tooltip: "Cells between the two crossings.",
                range: 0.5..=200.0,
                speed: 0.05,
                decimals: 0,
            };
            number.show(ui, cells, commands, |cells| Edit::SetScale(Scale::GridPitch { a_px, b_px, cells, pitch_mm }));
            let number = Number { label: "Pitch", ..mm };
            number.show(ui, pitch_mm, commands, |pitch_mm| {
                Edit::SetScale(Scale::GridPitch { a_px, b_px, cells, pitch_mm })
            });
        }
        Scale::InnerEyeCorners { mm: value } => {
            mm.show(ui, value, commands, |mm| Edit::SetScale(Scale::InnerEyeCorners { mm }));
        }
    }
    let said = if scene.outcome.scale_measured { "measured" } else { "assumed" };
    ui.label(RichText::new(format!("{:.2} px/mm, {said}", scene.outcome.camera.px_per_mm)).weak());
}

/// A field for the person's own distance; the scale is set once it holds one.
fn type_eye_corners(ui: &mut egui::Ui, text: &mut Option<String>, commands: &mut Vec<Command>) {
    let Some(line) = text else { return };
    let mut done = false;
    ui.horizontal(|ui| {
        let label = ui.label("Distance");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label("mm");
            let edit = egui::TextEdit::singleline(line).desired_width(120.0).hint_text("type the distance");
            let response = ui.add(edit).labelled_by(label.id);
            let typed = line.trim().replace(',', ".").parse::<f64>().ok();
            if let Some(mm) = typed.filter(|mm| (0.1..=1000.0).contains(mm))
                && response.lost_focus()
            {
                commands.push(Command::Edit(Edit::SetScale(Scale::InnerEyeCorners { mm })));
                done = true;
            }
        });
    });
    if done {
        *text = None;
    }
}

fn camera(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let camera = scene.project.camera;
    let number = Number {
        label: "Distance",
        unit: " mm",
        tooltip: "From the face to the camera. Nearer cameras enlarge the nose and shrink the ears; forces change little beyond 600 mm.",
        range: 150.0..=20_000.0,
        speed: 5.0,
        decimals: 0,
    };
    number.show(ui, camera.distance_mm, commands, |distance_mm| {
        Edit::SetCamera(CameraSettings { distance_mm, ..camera })
    });
    let mut centred = camera.principal_point_px.is_none();
    let centre = scene.outcome.camera.principal_point_px;
    let tooltip = "Switch this off for a picture that was cut out of a larger one.";
    if ui.checkbox(&mut centred, "Optical axis in the middle of the picture").on_hover_text(tooltip).changed() {
        let principal_point_px = (!centred).then_some([centre.x, centre.y]);
        commands.push(Command::Edit(Edit::SetCamera(CameraSettings { principal_point_px, ..camera })));
    }
    if let Some([x, y]) = camera.principal_point_px {
        let number = Number {
            label: "Axis x",
            unit: " px",
            tooltip: "Where the optical axis meets the first frame.",
            range: -1e5..=1e5,
            speed: 1.0,
            decimals: 1,
        };
        number
            .show(ui, x, commands, |x| Edit::SetCamera(CameraSettings { principal_point_px: Some([x, y]), ..camera }));
        let number = Number { label: "Axis y", ..number };
        number
            .show(ui, y, commands, |y| Edit::SetCamera(CameraSettings { principal_point_px: Some([x, y]), ..camera }));
    }
}

/// The settings with one thing changed.
fn changed(settings: &Settings, change: impl FnOnce(&mut Settings)) -> Edit {
    let mut new = settings.clone();
    change(&mut new);
    Edit::SetSettings(new)
}

/// One of several rules, each with its words and what it means.
fn rules<T: Copy + PartialEq>(
    ui: &mut egui::Ui,
    settings: &Settings,
    now: T,
    all: &[(T, &str, &str)],
    commands: &mut Vec<Command>,
    set: impl Fn(&mut Settings, T),
) {
    for &(rule, label, tooltip) in all {
        if ui.radio(now == rule, label).on_hover_text(tooltip).clicked() {
            commands.push(Command::Edit(changed(settings, |s| set(s, rule))));
        }
    }
}

fn fit(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    rules(
        ui,
        settings,
        settings.customize.align,
        &[
            (
                AlignRule::Pose,
                "The head may turn",
                "Shift, size and turn of the head come from all landmarks together.",
            ),
            (AlignRule::Thesis, "The head is straight", "Shift and size alone, from the landmarks' ranges (thesis)."),
        ],
        commands,
        |s, rule| s.customize.align = rule,
    );
    let number = Number {
        label: "Depth over width",
        unit: "",
        tooltip: "How much deeper than wide the generic face is made. 1 keeps people's depth; the thesis takes 1.15.",
        range: 0.2..=3.0,
        speed: 0.005,
        decimals: 2,
    };
    number.show(ui, settings.customize.z_factor, commands, |v| changed(settings, |s| s.customize.z_factor = v));
    rules(
        ui,
        settings,
        settings.customize.morph,
        &[
            (
                MorphRule::Radial,
                "Smoothest way between landmarks",
                "Radial functions: lengths between landmarks come out truest.",
            ),
            (MorphRule::Nnwa, "Average of the landmarks", "Weighted by inverse distance (thesis)."),
        ],
        commands,
        |s, rule| s.customize.morph = rule,
    );
    if settings.customize.morph == MorphRule::Radial {
        let number = Number {
            label: "Landmarks may be missed by",
            unit: " mm",
            tooltip: "Standard deviation. Above 0 marks that contradict each other no longer fold the face.",
            range: 0.0..=10.0,
            speed: 0.01,
            decimals: 2,
        };
        let set = |v| changed(settings, |s| s.customize.smoothing_mm = v);
        number.show(ui, settings.customize.smoothing_mm, commands, set);
        return;
    }
    let number = Number {
        label: "Power of the distance",
        unit: "",
        tooltip: "How fast a landmark's pull fades with distance. Higher keeps it nearer to the landmark.",
        range: 0.5..=8.0,
        speed: 0.02,
        decimals: 1,
    };
    number.show(ui, settings.customize.power, commands, |v| changed(settings, |s| s.customize.power = v));
    let mut all = settings.customize.nearest.is_none();
    if ui.checkbox(&mut all, "Every landmark pulls every vertex").changed() {
        commands.push(Command::Edit(changed(settings, |s| s.customize.nearest = (!all).then_some(8))));
    }
    if let Some(n) = settings.customize.nearest {
        let number = Number {
            label: "Nearest landmarks",
            unit: "",
            tooltip: "Only so many of the nearest landmarks pull a vertex.",
            range: 1.0..=1000.0,
            speed: 0.05,
            decimals: 0,
        };
        let set = |v: f64| changed(settings, |s| s.customize.nearest = Some((v.round() as usize).max(1)));
        number.show(ui, n as f64, commands, set);
    }
}

fn displacement(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    ui.label("Depth of the last frame");
    let depths = [
        (
            DepthRule::FixedDepth,
            "As deep as in the first frame",
            "The thesis's rule. Skin that slides over a curve seems to stretch.",
        ),
        (
            DepthRule::SlideOnSurface,
            "Sliding on the first frame's surface",
            "Right where skin slides on a smooth skull; wrong where it bulges.",
        ),
        (
            DepthRule::KeepHeight,
            "Keeping its height above the skull",
            "Every point keeps its own height above a smooth surface: right where skin of any thickness slides on a smooth skull.",
        ),
        (
            DepthRule::HalfWay,
            "Half way to that height",
            "Between the first frame's depth and the kept height: never far from either truth.",
        ),
    ];
    rules(ui, settings, settings.depth, &depths, commands, |s, rule| s.depth = rule);
    ui.add_space(4.0);
    ui.label("Vertices that nobody marked");
    let held = settings.unmarked == UnmarkedRule::Held;
    let inferred = [(
        false,
        "Filled in between marks",
        "Vertices surrounded by marks are filled in from them; the others carry no force.",
    )];
    rules(ui, settings, held, &inferred, commands, |s, _| {
        if held {
            s.unmarked = UnmarkedRule::default();
        }
    });
    if let UnmarkedRule::Inferred { reach_mm } = settings.unmarked {
        let number = Number {
            label: "Reach",
            unit: " mm",
            tooltip: "How far a mark may lie to count as surrounding.",
            range: 1.0..=200.0,
            speed: 0.2,
            decimals: 0,
        };
        let set = |reach_mm| changed(settings, |s| s.unmarked = UnmarkedRule::Inferred { reach_mm });
        number.show(ui, reach_mm, commands, set);
    }
    let unmoved =
        [(true, "Held where they were", "The thesis's rule: the border of the marked skin then carries false forces.")];
    rules(ui, settings, held, &unmoved, commands, |s, _| s.unmarked = UnmarkedRule::Held);
    ui.add_space(4.0);
    let mut remove = settings.remove_head_motion;
    let tooltip = "Takes out the motion that the still points show, so that only the skin's own motion makes forces.";
    if ui.checkbox(&mut remove, "Remove the head's motion").on_hover_text(tooltip).changed() {
        commands.push(Command::Edit(changed(settings, |s| s.remove_head_motion = remove)));
    }
}

fn skin(ui: &mut egui::Ui, scene: Scene<'_>, view: &mut SkinTableView, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    let number = Number {
        label: "Thickness",
        unit: " mm",
        tooltip: "Thickness of the skin. Forces grow in proportion.",
        range: 0.05..=10.0,
        speed: 0.01,
        decimals: 2,
    };
    number.show(ui, settings.skin_thickness_mm, commands, |v| changed(settings, |s| s.skin_thickness_mm = v));
    ui.label("What resists between the points");
    let models = [
        (SkinModel::Springs, "Springs", "A spring along every edge of the mesh, as in the thesis."),
        (
            SkinModel::Membrane,
            "Membrane",
            "Every triangle is a piece of skin with fibres in all directions: the same table and thickness, and forces that depend less on how the mesh was drawn.",
        ),
    ];
    rules(ui, settings, settings.skin_model, &models, commands, |s, model| s.skin_model = model);
    if settings.skin_model == SkinModel::Membrane {
        ui.add_space(4.0);
        skin_table::show(ui, settings, view, commands);
        return;
    }
    ui.label("An edge of the mesh as a spring");
    let springs = [
        (SpringRule::Strip, "A strip of skin", "As wide as its triangles: the same skin on any mesh."),
        (SpringRule::Uniform, "One law for all edges", "The thesis's rule: forces then depend on the mesh."),
    ];
    rules(ui, settings, settings.springs, &springs, commands, |s, rule| s.springs = rule);
    ui.add_space(4.0);
    skin_table::show(ui, settings, view, commands);
}

fn marking(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    let number = Number {
        label: "Standard deviation",
        unit: " px",
        tooltip: "How far a mark of yours lies from the true place, along each axis. Two people on a painted grid agree to 1–2 px. The error of every force comes from it.",
        range: 0.0..=50.0,
        speed: 0.01,
        decimals: 2,
    };
    number.show(ui, settings.marking_sigma_px, commands, |v| changed(settings, |s| s.marking_sigma_px = v));
    scatter(ui, scene, commands);
}

/// What the still points say of the marking error, and a button that believes them.
pub fn scatter(ui: &mut egui::Ui, scene: Scene<'_>, commands: &mut Vec<Command>) {
    let settings = &scene.project.settings;
    let Some(noise_px) = scene.outcome.head.noise_floor_px else { return };
    // To the digits that a person would type. Marks without any scatter were computed, and tell nothing of a hand.
    let told = (noise_px * 100.0).round() / 100.0;
    if told < 0.01 || (told - settings.marking_sigma_px).abs() < 0.005 {
        return;
    }
    ui.label(format!("Still points scatter {told:.2} px; forces count with {} px.", settings.marking_sigma_px));
    let hint = "Marks that were smoothed, or predicted places that were only accepted, scatter less than hands err: this then flatters the ± of every force.";
    if ui.button("Use it as the marking error").on_hover_text(hint).clicked() {
        commands.push(Command::Edit(changed(settings, |s| s.marking_sigma_px = told)));
    }
    ui.label(RichText::new("It flatters marks that were smoothed or only accepted.").small().weak());
}
