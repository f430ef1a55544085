//! The workspace of the muscles: which pulled, how hard, by which law, and how sure that is.

mod activations;
mod card;
mod ladder;
mod laws;
pub(super) mod maps;
mod profiles;
mod smallest_set;
mod table;
mod toolbar;

use std::sync::Arc;

use egui::{CentralPanel, Frame, Panel, Ui};
use nalgebra::Point3;

use crate::draw::words::sentence;
use crate::fit::activations::Standing;
use crate::gui::action::Action;
use crate::gui::height_map::{ColourRange, Exaggeration, Layer, MapOptions, RangeMode};
use crate::gui::muscle_work::MuscleWork;
use crate::gui::orbit_view::{OrbitView, Projection};
use crate::gui::panels::in_fixed_width;
use crate::gui::{Command, Focus, Scene, Stamp};
use crate::muscle_field::fields::fields;
use crate::muscle_field::profiles::Part;
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
    /// Whether muscles are drawn over the maps.
    pub show_muscles: bool,
    /// How the maps are drawn.
    pub options: MapOptions,
    /// Where the eye stands, for both maps.
    pub orbit: OrbitView,
    shown: Option<(Projection, ColourRange)>,
    kept: maps::Kept,
    layers: Option<Layers>,
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
}

/// The values of both maps, kept until the answer or a choice changes.
#[derive(Debug)]
struct Layers {
    from: (Stamp, *const Analysis, Part, Second, usize),
    observed: Layer,
    second: Layer,
    first: Vec<Point3<f64>>,
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
    let shown = Shown::of(scene, work, &analysis, view);
    Panel::top("muscles toolbar").show(ui, |ui| toolbar::show(ui, &shown, view));
    Panel::left("muscles list").exact_size(292.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| activations::show(ui, &shown, view));
        });
    });
    Panel::right("muscles side").exact_size(262.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| card::show(ui, &shown, focus));
        });
    });
    Panel::bottom("muscles charts").resizable(true).default_size(250.0).min_size(140.0).show(ui, |ui| match view.tab {
        Tab::Profiles => profiles::show(ui, &shown, view, focus, commands),
        Tab::Laws => laws::show(ui, &shown, view),
        Tab::SmallestSet => smallest_set::show(ui, &shown),
        Tab::Ladder => ladder::show(ui, &shown, work, commands),
    });
    CentralPanel::default().frame(Frame::NONE).show(ui, |ui| both_maps(ui, &shown, view, focus, commands));
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
}

impl<'a> Shown<'a> {
    fn of(scene: Scene<'a>, work: &MuscleWork, analysis: &'a Analysis, view: &MusclesView) -> Self {
        let law = view.law.filter(|l| *l < analysis.laws.len()).or(analysis.best).unwrap_or(0);
        let there = |m: &usize| analysis.fibres.iter().any(|f| f.muscle == *m);
        let strongest = || {
            let of_set = analysis.set.iter().map(|&f| (f, analysis.activations.muscles[f].strength_n));
            of_set.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(f, _)| analysis.fibres[f].muscle)
        };
        let muscle = view.muscle.filter(there).or_else(strongest);
        Self { scene, analysis, looking: work.is_looking(), law, muscle, unit: scene.outcome.unit() }
    }
}

/// A sentence in the middle, where there is nothing else to show.
fn waiting(ui: &mut Ui, words: &str) {
    CentralPanel::default().show(ui, |ui| {
        ui.centered_and_justified(|ui| ui.label(words));
    });
}

fn both_maps(ui: &mut Ui, shown: &Shown<'_>, view: &mut MusclesView, focus: &mut Focus, commands: &mut Vec<Command>) {
    let scene = shown.scene;
    let layers = Layers::of(shown, view);
    let range = match view.options.range {
        RangeMode::Locked(range) => range,
        // One range for both, so that what is left can be seen beside what there was.
        _ => crate::gui::height_map::range::range_of(RangeMode::Auto, &layers.observed, &|_| true),
    };
    let mm_per_unit = Exaggeration::Auto.mm_per_unit(range);
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
    let shared = maps::Shared {
        scene,
        first: &layers.first,
        options: &view.options,
        range,
        mm_per_unit,
        fibres: &shown.analysis.fibres,
        muscles: &drawn,
        chosen: shown.muscle,
        selected: focus.selected_vertex().map(|v| v as usize),
    };
    let canvas = ui.available_rect_before_wrap();
    let [left, right] = maps::halves(canvas);
    let (mut orbit, mut kept) = (view.orbit, std::mem::take(&mut view.kept));
    let second_title = match view.second {
        Second::Model => format!("{}, said", shown.analysis.laws[shown.law].label()),
        Second::Residual => format!("Left by {}", shown.analysis.laws[shown.law].label()),
    };
    let pair = [(left, "Observed", &layers.observed), (right, second_title.as_str(), &layers.second)];
    let mut projection = None;
    for (rect, title, layer) in pair {
        let map = maps::Map { title, layer };
        let (pointed, seen) = maps::show(ui, rect, &map, &shared, &mut orbit, &mut kept, focus);
        projection = projection.or(Some(seen));
        if pointed.clicked {
            match (pointed.muscle, pointed.vertex) {
                (Some(muscle), _) => view.muscle = Some(muscle),
                (None, Some(v)) => commands.push(Command::Select(Some(PointId::FeatureLast(v as u32)))),
                (None, None) => commands.push(Command::Select(None)),
            }
        }
    }
    maps::bar(ui, canvas, &layers.observed, &view.options, range);
    (view.orbit, view.kept) = (orbit, kept);
    view.shown = projection.map(|p| (p, range));
    view.layers = Some(layers);
}

impl Layers {
    fn of(shown: &Shown<'_>, view: &mut MusclesView) -> Self {
        let from = (shown.scene.stamp, std::ptr::from_ref(shown.analysis), view.part, view.second, shown.law);
        if let Some(layers) = view.layers.take().filter(|l| l.from == from) {
            return layers;
        }
        let (scene, analysis) = (shown.scene, shown.analysis);
        let outcome = scene.outcome;
        let fields = fields(outcome, scene.face, analysis, shown.law, view.part);
        let sets_range = fields.fitted;
        let second = match view.second {
            Second::Model => fields.said,
            Second::Residual => fields.left,
        };
        let layer = |title: &str, values: Vec<Option<f64>>| Layer {
            title: title.to_owned(),
            short: match view.part {
                Part::Magnitude => "Force",
                Part::AlongFibre => "Along fibres",
            },
            unit: outcome.unit(),
            signed: view.part == Part::AlongFibre,
            values,
            sigma: None,
            sets_range: sets_range.clone(),
        };
        Self {
            from,
            observed: layer("Observed", fields.observed),
            second: layer("Law", second),
            first: outcome.first_from_eyes(scene.face),
        }
    }
}
