//! The workspace of the studies: begin one, watch it, stop it and take it up again; point at its charts, and see what a method would change here.

mod card;
mod choice;
mod maps;
mod plot;
mod shown;
mod side;
mod toolbar;

use std::collections::BTreeSet;

use egui::{CentralPanel, Frame, Panel, Ui};

use self::plot::{Plot, Seen, Tick};
use self::shown::{Asked, Look, Shown};
use crate::export::study_chart::LIVE_MS;
use crate::gui::action::Action;
use crate::gui::action_state::ActionState;
use crate::gui::height_map::MapOptions;
use crate::gui::orbit_view::OrbitView;
use crate::gui::panels::in_fixed_width;
use crate::gui::panels::muscles::maps as face_maps;
use crate::gui::study_work::StudyWork;
use crate::gui::{Command, Focus, Scene};
use crate::study::Kind;
use crate::study::accuracy::error_words;
use crate::study::ladder::Goals;

/// What the workspace of the studies remembers about showing.
pub struct StudyView {
    /// The study that is begun next.
    pub kind: Kind,
    /// Coarser, with fewer seeds.
    pub quick: bool,
    /// Seeds; the study's own number while absent.
    pub seeds: Option<u64>,
    /// On the project's face instead of the generic one.
    pub own_face: bool,
    /// The part of the table that is shown.
    pub part: String,
    /// The method and setting that are picked.
    pub picked: Option<Picked>,
    /// The accuracy and the time that a rung of the ladder is chosen for.
    pub goals: Goals,
    hidden: BTreeSet<String>,
    noise: Option<f64>,
    seen: Seen,
    map_zoom: f32,
    shown: Option<Shown>,
    orbit: OrbitView,
    options: MapOptions,
    kept: face_maps::Kept,
}

/// A method at a setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picked {
    /// The method.
    pub method: String,
    /// Its setting.
    pub setting: String,
}

impl Default for StudyView {
    fn default() -> Self {
        Self {
            kind: Kind::default(),
            quick: true,
            seeds: None,
            own_face: true,
            part: String::new(),
            picked: None,
            goals: Goals::default(),
            hidden: BTreeSet::new(),
            noise: None,
            seen: None,
            map_zoom: 1.0,
            shown: None,
            orbit: face_maps::home(),
            options: face_maps::options(),
            kept: face_maps::Kept::default(),
        }
    }
}

impl StudyView {
    /// Begins to look at another table.
    pub fn forget(&mut self) {
        (self.picked, self.noise, self.seen, self.map_zoom) = (None, None, None, 1.0);
        (self.part, self.hidden) = (String::new(), BTreeSet::new());
    }

    /// Does what a key or a menu entry names, if it means the charts; true when it did.
    pub fn act(&mut self, action: Action) -> bool {
        let maps = self.shown.as_ref().is_some_and(|s| s.look == Look::Maps);
        match action {
            Action::Fit => (self.seen, self.map_zoom) = (None, 1.0),
            Action::ZoomIn | Action::ZoomOut => {
                let factor = if action == Action::ZoomIn { 1.25 } else { 0.8 };
                match &self.shown {
                    Some(shown) if !maps => {
                        let live = (shown.look == Look::Accuracy).then_some(LIVE_MS);
                        plot::zoom_middle(&mut self.seen, plot::whole(&shown.lines, live), factor);
                    }
                    _ => self.map_zoom = (self.map_zoom * factor as f32).clamp(0.7, 4.0),
                }
            }
            _ => return false,
        }
        true
    }
}

/// Shows the workspace in the whole of `ui`.
pub fn show(
    ui: &mut Ui,
    scene: Scene<'_>,
    work: &StudyWork,
    view: &mut StudyView,
    focus: &mut Focus,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    Panel::top("study toolbar").show(ui, |ui| toolbar::show(ui, work, view, state, commands));
    let Some(table) = work.table() else {
        CentralPanel::default().show(ui, nothing_yet);
        return;
    };
    let asked =
        Asked { revision: table.revision, part: view.part.clone(), hidden: view.hidden.clone(), noise: view.noise };
    let shown = match view.shown.take().filter(|s| s.asked == asked) {
        Some(shown) => shown,
        None => Shown::of(table, asked),
    };
    (view.part, view.noise) = (shown.asked.part.clone(), shown.asked.noise);
    Panel::left("study list").exact_size(262.0).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| side::show(ui, table, &shown, view));
        });
    });
    if let Some(preview) = work.preview() {
        let height = (0.4 * ui.available_height()).max(220.0);
        Panel::bottom("study preview").resizable(true).default_size(height).min_size(160.0).show(ui, |ui| {
            card::maps(ui, scene, preview, view, focus);
        });
    }
    CentralPanel::default().frame(Frame::NONE.inner_margin(8.0)).show(ui, |ui| {
        choice::show(ui, scene, &shown, view, commands);
        card::line(ui, work, view, state, commands);
        chart(ui, &shown, view, commands);
    });
    view.shown = Some(shown);
}

fn nothing_yet(ui: &mut Ui) {
    ui.centered_and_justified(|ui| {
        ui.label("A study measures the methods of this program on this machine. Start one, or open the table of an earlier one.");
    });
}

fn chart(ui: &mut Ui, shown: &Shown, view: &mut StudyView, commands: &mut Vec<Command>) {
    let picked = view.picked.clone();
    let picked = picked.as_ref().map(|p| (p.method.as_str(), p.setting.as_str()));
    let title = shown.parts.iter().find(|p| p.0 == shown.asked.part).map_or("", |p| p.1.as_str());
    ui.strong(title);
    let (pointed, under) = if shown.look == Look::Maps {
        let zoomed = ui.input(egui::InputState::zoom_delta);
        view.map_zoom = (view.map_zoom * zoomed).clamp(0.7, 4.0);
        maps::show(ui, &shown.maps, &shown.causes, view.map_zoom, picked)
    } else {
        let (axes, ticks): ([&str; 2], [Tick; 2]) = match shown.look {
            Look::Accuracy if shown.rungs.is_empty() => {
                (["median time", error_words(&shown.asked.part)], [time, percent])
            }
            Look::Accuracy => (["median time after a drag", "95 % of twins err by less"], [time, percent]),
            Look::Growth => (["vertices", "ns a vertex"], [plain, plain]),
            _ => (["setting", "median time"], [plain, time]),
        };
        let live = (shown.look == Look::Accuracy).then_some((LIVE_MS, "16 ms: live while dragging"));
        let chosen = choice::chosen(shown, view.goals);
        let chart = Plot { title, axes, ticks, live, lines: &shown.lines, picked, chosen: &chosen };
        let rect = ui.available_rect_before_wrap();
        let pointed = plot::show(ui, rect, &chart, &mut view.seen);
        let of = |[l, d]: [usize; 2]| (shown.lines[l].method.clone(), shown.lines[l].dots[d].setting.clone());
        (pointed, pointed.dot.map(of))
    };
    if let Some((method, setting)) = under.filter(|_| pointed.clicked) {
        let now = Picked { method, setting };
        if pointed.twice && view.picked.as_ref() == Some(&now) {
            commands.push(Command::Do(Action::ApplyStudy));
        }
        view.picked = Some(now);
    }
}

fn time(power: i32) -> String {
    crate::export::study_chart::time_words(power)
}

fn percent(power: i32) -> String {
    crate::export::study_chart::percent_words(power)
}

fn plain(power: i32) -> String {
    let value = 10_f64.powi(power);
    if (-4..=6).contains(&power) { value.to_string() } else { format!("1e{power}").replace('-', "−") }
}
