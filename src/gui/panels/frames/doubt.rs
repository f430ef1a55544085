//! The tab of doubt: which point to mark next, which marks stand out, how well this hand marks, and how well another agrees.

use egui::{Button, RichText};

use super::FramesView;
use crate::doubt::agreement::{Agreement, NotComparable, compare};
use crate::doubt::gap::{Gap, gap, gaps};
use crate::doubt::repeats::{self, hand_error};
use crate::doubt::worth::{Worth, worth_marking};
use crate::gui::action_state::ActionState;
use crate::gui::height_map::options::{fixed, significant};
use crate::gui::{Action, Command, Scene, Stamp, keys, theme};
use crate::project::{Edit, PointId, Project, Which};

/// What the window remembers of doubt.
#[derive(Debug, Default)]
pub struct DoubtView {
    /// The points to be marked again, blind, while that runs.
    pub again: Option<Again>,
    /// The project compared with.
    pub other: Option<Other>,
    found: Option<(Stamp, Vec<u32>, Found)>,
}

/// Points being marked a second time, blind.
#[derive(Clone, Debug, PartialEq)]
pub struct Again {
    /// The vertices, in the order in which they are asked for.
    pub points: Vec<u32>,
    /// How many are done.
    pub done: usize,
}

impl Again {
    /// The vertex asked for.
    pub fn asked(&self) -> Option<u32> {
        self.points.get(self.done).copied()
    }
}

/// Another project on the same frames.
#[derive(Clone, Debug)]
pub struct Other {
    /// Name of its file.
    pub name: String,
    /// Its marks.
    pub project: Project,
}

/// What was found for one outcome.
#[derive(Debug, Default)]
struct Found {
    worth: Option<Vec<Worth>>,
    gaps: Option<Vec<Gap>>,
    agreement: Option<Result<Agreement, NotComparable>>,
}

/// More marks than this are not weighed against each other after every motion of the hand: that would take longer than a frame.
const MOST_MARKS: usize = 3000;

/// So many of a list are shown.
const SHOWN: usize = 8;

impl DoubtView {
    /// The vertex to be marked again, blind.
    pub fn asked(&self) -> Option<u32> {
        self.again.as_ref().and_then(Again::asked)
    }

    /// Forgets what was found: something that it depends on besides the outcome has changed.
    pub fn forget(&mut self) {
        self.found = None;
    }

    /// What was found for this outcome so far. Each part is made when it is first asked for: after every motion of the hand the table needs
    /// the gaps, and the rest only while it is shown.
    fn found(&mut self, scene: Scene<'_>, chosen: &[u32]) -> &mut Found {
        let before = self.found.take().filter(|(stamp, of, _)| *stamp == scene.stamp && of == chosen);
        &mut self.found.insert(before.unwrap_or_else(|| (scene.stamp, chosen.to_vec(), Found::default()))).2
    }

    /// Every mark of the last frame against its neighbours, the worst first.
    pub fn gaps(&mut self, scene: Scene<'_>, chosen: &[u32]) -> &[Gap] {
        self.found(scene, chosen).gaps.get_or_insert_with(|| match scene.skin {
            Some(skin) if scene.project.features.len() <= MOST_MARKS => {
                gaps(scene.project, scene.face, scene.outcome, skin)
            }
            _ => Vec::new(),
        })
    }

    /// The points worth marking, the worthiest first.
    pub fn worth(&mut self, scene: Scene<'_>, chosen: &[u32]) -> &[Worth] {
        self.found(scene, chosen).worth.get_or_insert_with(|| match scene.skin {
            Some(skin) => worth_marking(scene.project, scene.face, scene.outcome, skin, chosen),
            None => Vec::new(),
        })
    }

    /// How well the other project agrees, if there is one.
    fn agreement(&mut self, scene: Scene<'_>, chosen: &[u32]) -> Option<&Result<Agreement, NotComparable>> {
        let other = self.other.take();
        let found = self.found(scene, chosen);
        if let (None, Some(other)) = (&found.agreement, &other) {
            found.agreement = Some(compare(scene.project, &other.project));
        }
        self.other = other;
        self.found.as_ref()?.2.agreement.as_ref()
    }

    /// Begins anew: another project is open.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Goes on from what is marked again by now: an undo goes back to its point.
    pub fn follow(&mut self, project: &Project) {
        if let Some(again) = &mut self.again {
            again.done = again.points.iter().take_while(|v| project.repeats.contains_key(v)).count();
        }
    }

    /// The marks to blame for folded triangles of the last frame: of each, the corner that lies farthest from where its neighbours
    /// want it.
    pub fn guilty(&mut self, scene: Scene<'_>, chosen: &[u32]) -> Vec<u32> {
        let folded = &scene.outcome.field.folded;
        if folded.is_empty() {
            return Vec::new();
        }
        let gaps = self.gaps(scene, chosen);
        let triangles = scene.face.mesh().triangles();
        let guilty = folded.iter().filter_map(|&t| {
            let corners = triangles.get(t as usize)?;
            // The list begins with the worst.
            gaps.iter().find(|g| corners.contains(&g.vertex)).map(|g| g.vertex)
        });
        let mut guilty: Vec<u32> = guilty.collect();
        guilty.sort_unstable();
        guilty.dedup();
        guilty
    }
}

/// The gap of a point of the last frame, while it is in the hand or selected.
pub fn gap_of(scene: Scene<'_>, id: &PointId) -> Option<Gap> {
    let PointId::FeatureLast(v) = id else { return None };
    gap(scene.project, scene.face, scene.outcome, scene.skin?, *v)
}

/// "1.8 px, 0.12 N from where 6 neighbours lead".
pub fn gap_in_words(gap: &Gap, unit: &str) -> String {
    format!("{} px, {} {unit}", fixed(gap.px, 1), significant(gap.newton, 2))
}

/// Shows the tab.
pub fn show(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    crate::gui::panels::in_fixed_width(ui, |ui| {
        worth(ui, scene, chosen, view, state, commands);
        standing_out(ui, scene, chosen, view, commands);
        own_error(ui, scene, view, state, commands);
        other_hand(ui, scene, chosen, view, state, commands);
    });
}

fn heading(ui: &mut egui::Ui, text: &str, hint: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).strong()).on_hover_text(hint);
}

fn action_button(ui: &mut egui::Ui, action: Action, label: &str, state: &ActionState, commands: &mut Vec<Command>) {
    let button = ui.add_enabled(state.can(action), Button::new(label));
    if button.on_hover_text(keys::of(ui.ctx()).tooltip(action)).clicked() {
        commands.push(Command::Do(action));
    }
}

/// A row that goes to its point: the vertex, and words beside it.
fn row(ui: &mut egui::Ui, vertex: u32, words: String, commands: &mut Vec<Command>) {
    row_of(ui, &PointId::FeatureLast(vertex), vertex.to_string(), words, commands);
}

fn row_of(ui: &mut egui::Ui, id: &PointId, name: String, words: String, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        if ui.link(name).on_hover_text("Go to the point").clicked() {
            commands.push(Command::JumpTo(id.clone()));
        }
        ui.add(egui::Label::new(RichText::new(words).weak()).truncate());
    });
}

fn worth(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    let hint = "Points without a mark, or in doubt, by how much the forces change for one pixel of their error.";
    heading(ui, "Worth marking next", hint);
    let unit = scene.outcome.unit();
    let list = view.doubt.worth(scene, chosen);
    if list.is_empty() {
        ui.weak("Every chosen point is marked, and none in doubt.");
        return;
    }
    for w in list.iter().take(SHOWN) {
        let doubt = if w.uncertain { ", marked in doubt" } else { "" };
        row(ui, w.vertex, format!("{} {unit} a pixel{doubt}", significant(w.newton_per_px, 2)), commands);
    }
    let more = list.len().saturating_sub(SHOWN);
    ui.horizontal(|ui| {
        action_button(ui, Action::NextWorth, "Go to the first", state, commands);
        if more > 0 {
            ui.weak(format!("{more} more"));
        }
    });
}

fn standing_out(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    commands: &mut Vec<Command>,
) {
    let hint = "Marks that lie farther from where their neighbours lead than their own error, that of the neighbours and the bending of the skin about them explain. Look again.";
    heading(ui, "Marks that stand out", hint);
    let list: Vec<&Gap> = view.doubt.gaps(scene, chosen).iter().filter(|g| g.stands_out()).collect();
    if list.is_empty() {
        ui.weak("None: every mark goes with its neighbours.");
        return;
    }
    for g in list.iter().take(SHOWN) {
        row(ui, g.vertex, format!("{} from its neighbours", gap_in_words(g, scene.outcome.unit())), commands);
    }
    if list.len() > SHOWN {
        ui.weak(format!("{} more", list.len() - SHOWN));
    }
}

fn own_error(ui: &mut egui::Ui, scene: Scene<'_>, view: &FramesView, state: &ActionState, commands: &mut Vec<Command>) {
    let hint = "A few points are marked a second time without sight of the first mark: how far the two lie apart is the error of this hand, and the forces' ± follow from it.";
    heading(ui, "Your own error", hint);
    if let Some(again) = &view.doubt.again {
        let words = format!("Point {} of {}: press in the last frame where it is.", again.done + 1, again.points.len());
        ui.colored_label(theme::palette(ui.visuals()).accent, words);
        ui.weak("The first frame shows the point. All marks of the last frame are hidden.");
        action_button(ui, Action::Again, "Stop", state, commands);
        return;
    }
    if let Some(hand) = hand_error(scene.project) {
        let [low, high] = hand.interval_px.map(|p| fixed(p, 2));
        ui.label(format!("{} px along each axis ({low} to {high}, 95 %)", fixed(hand.sigma_px, 2)));
        let [x, y] = hand.shift_px.map(|p| fixed(p, 2));
        ui.weak(format!("From {} points marked twice; second less first {x}, {y} px.", hand.points));
        let rounded = (hand.sigma_px * 100.0).round() / 100.0;
        let settings = &scene.project.settings;
        ui.horizontal(|ui| {
            let used = settings.marking_sigma_px == rounded;
            let label = if used { "In use as marking error" } else { "Use as marking error" };
            let hint = "The standard error of every force is reckoned from the marking error.";
            if ui.add_enabled(!used, Button::new(label)).on_hover_text(hint).clicked() {
                let settings = crate::project::Settings { marking_sigma_px: rounded, ..settings.clone() };
                commands.push(Command::Edit(Edit::SetSettings(settings)));
            }
            if ui.button("Forget").on_hover_text("Forget the second marks. Can be undone.").clicked() {
                commands.push(Command::Edit(Edit::ClearRepeats));
            }
        });
    } else {
        let stated = fixed(scene.project.settings.marking_sigma_px, 2);
        ui.weak(format!("Not measured: {stated} px are assumed."));
    }
    let label = format!("Mark {} points again, blind", repeats::PROPOSED);
    action_button(ui, Action::Again, &label, state, commands);
}

fn other_hand(
    ui: &mut egui::Ui,
    scene: Scene<'_>,
    chosen: &[u32],
    view: &mut FramesView,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    heading(
        ui,
        "Another annotator",
        "A project on the same frames, point by point: differences are its marks less these.",
    );
    let Some(name) = view.doubt.other.as_ref().map(|o| o.name.clone()) else {
        action_button(ui, Action::Compare, "Compare with a project…", state, commands);
        return;
    };
    ui.label(name);
    match view.doubt.agreement(scene, chosen) {
        Some(Ok(agreement)) => agreement_in_numbers(ui, scene, agreement, commands),
        // A frame was changed since.
        Some(Err(why)) => _ = ui.colored_label(theme::palette(ui.visuals()).warn, why.to_string()),
        None => {}
    }
    action_button(ui, Action::Compare, "Stop comparing", state, commands);
}

fn agreement_in_numbers(ui: &mut egui::Ui, scene: Scene<'_>, agreement: &Agreement, commands: &mut Vec<Command>) {
    match &agreement.summary {
        Some(s) => {
            ui.weak(format!("{} points in both, median distance {} px", s.points, fixed(s.median_px, 2)));
            for (axis, bias, [low, high]) in [("x", s.bias_px[0], s.limits_x_px), ("y", s.bias_px[1], s.limits_y_px)] {
                let [bias, low, high] = [bias, low, high].map(|p| fixed(p, 2));
                ui.label(format!("{axis}: bias {bias} px, 95 % of {low} to {high}"));
            }
            let each = fixed(s.sigma_each_px, 2);
            ui.weak(format!("Each hand errs by {each} px along an axis, if both err alike."));
        }
        None => _ = ui.weak("Fewer than two points are marked in both."),
    }
    for d in agreement.differences.iter().take(SHOWN) {
        let name = match &d.id {
            PointId::Landmark(id) => scene.face.landmark(id).map_or_else(|| id.clone(), |l| l.name.clone()),
            PointId::FeatureFirst(v) => format!("{v} in the first frame"),
            PointId::FeatureLast(v) => v.to_string(),
        };
        row_of(ui, &d.id, name, format!("{} px apart", fixed(d.distance_px(), 1)), commands);
    }
    let (a, b) = (agreement.only_a.len(), agreement.only_b.len());
    if a + b > 0 {
        ui.weak(format!("{a} marked here alone, {b} there alone."));
    }
}

/// The marks of the other project in this frame, each with the own mark of the point if there is one, px.
pub fn others_in(scene: Scene<'_>, view: &DoubtView, which: Which) -> Vec<([f64; 2], Option<[f64; 2]>)> {
    let Some(other) = &view.other else { return Vec::new() };
    let own = |id: &PointId| crate::project::edit::mark(scene.project, id).map(|m| m.at_px);
    let landmarks = other.project.landmarks.iter().map(|(id, m)| (PointId::Landmark(id.clone()), *m));
    let first = other.project.features.iter().filter_map(|(&v, f)| Some((PointId::FeatureFirst(v), f.first?)));
    let last = other.project.features.iter().filter_map(|(&v, f)| Some((PointId::FeatureLast(v), f.last?)));
    let in_frame = |id: &PointId| matches!(id, PointId::FeatureLast(_)) == (which == Which::Last);
    let all = landmarks.chain(first).chain(last).filter(|(id, m)| in_frame(id) && m.state.is_data());
    all.map(|(id, m)| (m.at_px, own(&id))).collect()
}
