//! The workspace of the muscles: which pulled, how hard, by which law, and how sure that is.

mod activations;
mod card;
mod ladder;
mod laws;
mod layers;
pub(super) mod maps;
mod profiles;
mod smallest_set;
mod subjects;
mod table;
mod toolbar;

use std::sync::Arc;

use egui::{Align2, CentralPanel, FontId, Frame, Panel, Ui, vec2};

use crate::draw::words::sentence;
use crate::fit::activations::Standing;
use crate::gui::action::Action;
use crate::gui::height_map::ink::Inks;
use crate::gui::height_map::{ColourRange, Exaggeration, MapOptions, RangeMode};
use crate::gui::muscle_work::MuscleWork;
use crate::gui::orbit_view::{OrbitView, Projection};
use crate::gui::panels::in_fixed_width;
use crate::gui::subjects_work::SubjectsWork;
use crate::gui::{Command, Focus, Scene};
use crate::muscle_field::profiles::{Part, Way};
use crate::muscle_field::subjects::Other;
use crate::muscle_field::{Analysis, Question};
use crate::project::PointId;

/// What the workspace of the muscles remembers about showing.
#[derive(Debug)]
pub struct MusclesView {
    /// What is asked of the forces.
    pub question: Question,
    /// What of the force is shown.
    pub part: Part,
    /// What the second map shows.
    pub second: Second,
    /// The law shown, by its place in the table; the best one while none is chosen.
    pub law: Option<usize>,
    /// The muscle chosen for profiles, by its index in the face; the strongest while none is.
    pub muscle: Option<usize>,
    /// What lies under the maps.
    pub tab: Tab,
    /// The other subject chosen, by its number; the first while none is.
    pub other: Option<u64>,
    /// Whether the table on it is shown where there is no room for table and profile.
    pub other_table: bool,
    /// Which way the profile on it runs.
    pub other_way: Way,
    /// Whether muscles are drawn over the maps.
    pub show_muscles: bool,
    /// How the maps are drawn.
    pub options: MapOptions,
    /// Where the eye stands, for both maps.
    pub orbit: OrbitView,
    shown: Option<(Projection, ColourRange)>,
    kept: maps::Kept,
    layers: Option<layers::Layers>,
}

impl Default for MusclesView {
    fn default() -> Self {
        Self {
            question: Question::default(),
            part: Part::default(),
            second: Second::default(),
            law: None,
            muscle: None,
            tab: Tab::default(),
            other: None,
            other_table: true,
            other_way: Way::Radial,
            show_muscles: true,
            options: maps::options(),
            orbit: maps::home(),
            shown: None,
            kept: maps::Kept::default(),
            layers: None,
        }
    }
}

/// What the second map shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Second {
    /// What the law says.
    Model,
    /// What it leaves: observed less said.
    #[default]
    Residual,
    /// The mean of all subjects.
    Mean,
    /// The standard deviation over all subjects.
    Spread,
    /// This subject less the other one that is chosen.
    Difference,
}

impl Second {
    /// Whether it speaks of several subjects.
    pub fn is_across(self) -> bool {
        matches!(self, Self::Mean | Self::Spread | Self::Difference)
    }
}

/// What lies under the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// Observed forces along and across a muscle, with every law's curve.
    #[default]
    Profiles,
    /// The laws side by side.
    Laws,
    /// How the smallest set was found.
    SmallestSet,
    /// The ladder of models.
    Ladder,
    /// The laws on other subjects.
    Subjects,
}

impl MusclesView {
    /// Does what a key or a menu entry names, if it means these maps; true when it did.
    pub fn act(&mut self, action: Action) -> bool {
        let Some((projection, _)) = self.shown else { return false };
        match action {
            Action::HideMarks => self.show_muscles = !self.show_muscles,
            Action::ShowWireframe => self.options.wireframe = !self.options.wireframe,
            Action::LockRange => self.toggle_lock(),
            Action::Nudge(..) => return false,
            _ => return self.orbit.act(action, &projection, false),
        }
        true
    }

    /// Whether the range of colours stays when the data change.
    pub fn range_is_locked(&self) -> bool {
        matches!(self.options.range, RangeMode::Locked(_))
    }

    /// Keeps the range that is shown, or lets it follow the data again.
    fn toggle_lock(&mut self) {
        self.options.range = match (self.options.range, self.shown) {
            (RangeMode::Locked(_), _) | (_, None) => RangeMode::Auto,
            (_, Some((_, range))) => RangeMode::Locked(range),
        };
    }
}

/// Shows the workspace in the whole of `ui`.
pub fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    work: &MuscleWork,
    subjects: &SubjectsWork,
    view: &mut MusclesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let analysis = match work.answer() {
        None => return waiting(ui, "Looking for the muscles behind the forces…"),
        Some(Err(nothing)) => return waiting(ui, &sentence(&nothing.to_string())),
        Some(Ok(analysis)) => Arc::clone(analysis),
    };
    // An answer to the face before cannot be laid on this one.
    if analysis.fibres.iter().any(|f| f.muscle >= scene.face.muscles().len())
        || analysis.samples.vertices.iter().any(|v| *v as usize >= scene.face.mesh().len())
    {
        return waiting(ui, "Looking for the muscles behind the forces…");
    }
    let shown = Shown::of(scene, work, subjects, &analysis, view);
    let layers = layers::Layers::of(&shown, view.part, view.layers.take());
    Panel::top("muscles toolbar").show(ui, |ui| toolbar::show(ui, &shown, view));
    Panel::left("muscles list").exact_size(292.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| activations::show(ui, &shown, view));
        });
    });
    Panel::right("muscles side").exact_size(262.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| card::show(ui, &shown, &layers, focus));
        });
    });
    Panel::bottom("muscles charts").resizable(true).default_size(250.0).min_size(140.0).show(ui, |ui| {
        // What says little must not make the panel small for what comes after it.
        ui.set_min_height(ui.available_height());
        match view.tab {
            Tab::Profiles => profiles::show(ui, &shown, view, focus, commands),
            Tab::Laws => laws::show(ui, &shown, view),
            Tab::SmallestSet => smallest_set::show(ui, &shown),
            Tab::Ladder => ladder::show(ui, &shown, work, commands),
            Tab::Subjects => subjects::show(ui, &shown, view, focus, commands),
        }
    });
    CentralPanel::default().frame(Frame::NONE).show(ui, |ui| both_maps(ui, &shown, &layers, view, focus, commands));
    view.layers = Some(layers);
}

/// What the parts of the workspace show in this frame.
struct Shown<'a> {
    scene: Scene<'a>,
    analysis: &'a Analysis,
    /// Whether a newer answer is on its way.
    looking: bool,
    /// Index of the law shown.
    law: usize,
    /// Index in the face of the muscle chosen.
    muscle: Option<usize>,
    unit: &'static str,
    /// The other subjects.
    subjects: &'a SubjectsWork,
    /// The one chosen, with its number.
    other: Option<(u64, &'a Other)>,
    /// The number of the answer about the muscles, while no other is on its way.
    answer: Option<u64>,
    /// Whether what is said of the others belongs to an answer before this one.
    old: bool,
    /// What the second map shows.
    second: Second,
}

impl<'a> Shown<'a> {
    fn of(
        scene: Scene<'a>,
        work: &MuscleWork,
        subjects: &'a SubjectsWork,
        analysis: &'a Analysis,
        view: &MusclesView,
    ) -> Self {
        let law = view.law.filter(|l| *l < analysis.laws.len()).or(analysis.best).unwrap_or(0);
        let there = |m: &usize| analysis.fibres.iter().any(|f| f.muscle == *m);
        let strongest = || {
            let of_set = analysis.set.iter().map(|&f| (f, analysis.activations.muscles[f].strength_n));
            of_set.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(f, _)| analysis.fibres[f].muscle)
        };
        let muscle = view.muscle.filter(there).or_else(strongest);
        let other = subjects.others().find(|(id, _)| Some(*id) == view.other).or_else(|| subjects.others().next());
        let answer = (!work.is_looking()).then(|| work.answered());
        // Without others there is nothing to put together.
        let second = if view.second.is_across() && other.is_none() { Second::Residual } else { view.second };
        Self {
            scene,
            analysis,
            looking: work.is_looking(),
            law,
            muscle,
            unit: scene.outcome.unit(),
            subjects,
            other,
            answer,
            old: subjects.is_old(answer),
            second,
        }
    }
}

/// A sentence in the middle, where there is nothing else to show.
fn waiting(ui: &mut Ui, words: &str) {
    CentralPanel::default().show(ui, |ui| {
        ui.centered_and_justified(|ui| ui.label(words));
    });
}

fn both_maps(
    ui: &mut Ui,
    shown: &Shown<'_>,
    layers: &layers::Layers,
    view: &mut MusclesView,
    focus: &mut Focus,
    commands: &mut Vec<Command>,
) {
    let scene = shown.scene;
    let ranges = layers.ranges(view.options.range);
    let strengths: Vec<f64> = shown.analysis.activations.muscles.iter().map(|m| m.strength_n).collect();
    let most = strengths.iter().copied().fold(1e-12, f64::max);
    let drawn: Vec<maps::Drawn> = shown
        .analysis
        .fibres
        .iter()
        .enumerate()
        .filter(|(f, of)| {
            // Of muscles without any measured force in their reach only the chosen one is drawn: it says nothing of them.
            let told = shown.analysis.activations.muscles[*f].standing != Standing::Silent;
            view.show_muscles && (told || shown.muscle == Some(of.muscle))
        })
        .map(|(f, of)| maps::Drawn {
            muscle: of.muscle,
            strength: shown.analysis.set.contains(&f).then(|| (strengths[f] / most).clamp(0.0, 1.0)),
        })
        .collect();
    let selected = focus.selected_vertex().map(|v| v as usize);
    let shared = |range| maps::Shared {
        scene,
        first: &layers.first,
        in_view: &layers.observed.values,
        options: &view.options,
        range,
        mm_per_unit: Exaggeration::Auto.mm_per_unit(range),
        fibres: &shown.analysis.fibres,
        muscles: &drawn,
        chosen: shown.muscle,
        selected,
    };
    let canvas = ui.available_rect_before_wrap();
    let own_bar = ranges[0] != ranges[1];
    let [left, right] = if own_bar { maps::halves_with_bars(canvas) } else { maps::halves(canvas) };
    let (mut orbit, mut kept) = (view.orbit, std::mem::take(&mut view.kept));
    let count = 1 + shown.subjects.others().count();
    let second_title = match shown.second {
        Second::Model => format!("{}, said", shown.analysis.laws[shown.law].label()),
        Second::Residual => format!("Left by {}", shown.analysis.laws[shown.law].label()),
        Second::Mean => format!("Mean of {count} subjects"),
        Second::Spread => format!("Spread over {count} subjects"),
        Second::Difference => format!("This less {}", shown.other.map_or("", |(_, other)| other.name.as_str())),
    };
    let pair = [
        (left, "Observed", Ok(&layers.observed), ranges[0]),
        (right, second_title.as_str(), layers.second.as_ref(), ranges[1]),
    ];
    let mut projection = None;
    for (rect, title, layer, range) in pair {
        let layer = match layer {
            Ok(layer) => layer,
            Err(why) => {
                no_map(ui, rect, title, why);
                continue;
            }
        };
        let map = maps::Map { title, layer };
        let (pointed, seen) = maps::show(ui, rect, &map, &shared(range), &mut orbit, &mut kept, focus);
        projection = projection.or(Some(seen));
        if pointed.clicked {
            match (pointed.muscle, pointed.vertex) {
                (Some(muscle), _) => view.muscle = Some(muscle),
                (None, Some(v)) => commands.push(Command::Select(Some(PointId::FeatureLast(v as u32)))),
                (None, None) => commands.push(Command::Select(None)),
            }
        }
    }
    if let (true, Ok(second)) = (own_bar, &layers.second) {
        let beside = |map: egui::Rect| map.with_max_x(map.right() + maps::BAR);
        maps::bar(ui, beside(left), &layers.observed, &view.options, ranges[0]);
        let automatic = MapOptions { range: RangeMode::Auto, ..view.options };
        maps::bar(ui, beside(right), second, &automatic, ranges[1]);
    } else {
        maps::bar(ui, canvas, &layers.observed, &view.options, ranges[0]);
    }
    (view.orbit, view.kept) = (orbit, kept);
    view.shown = projection.map(|p| (p, ranges[0]));
}

/// A sentence in the place of a map.
fn no_map(ui: &mut Ui, rect: egui::Rect, title: &str, why: &str) {
    let inks = Inks::new(ui.visuals(), false);
    ui.painter().rect_filled(rect, 0.0, inks.canvas);
    ui.painter().text(rect.min + vec2(12.0, 8.0), Align2::LEFT_TOP, title, FontId::proportional(13.5), inks.text);
    let inner = rect.shrink2(vec2(24.0, 40.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(inner), |ui| {
        ui.vertical_centered(|ui| {
            ui.add_space(0.4 * inner.height());
            ui.add(egui::Label::new(why).wrap());
        });
    });
}
