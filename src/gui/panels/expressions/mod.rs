//! The workspace of the expressions: muscles under sliders, the face that follows them, and the curves of what happens.

mod actuators;
mod canvas;
mod choices;
mod curves;
mod toolbar;
mod transport;

use std::collections::BTreeMap;

use egui::{CentralPanel, Frame, Panel, Pos2, ScrollArea, Ui};

use crate::expression::player::Pace;
use crate::expression::{Actuators, Basic, Expression, Setup, Shown};
use crate::gui::action::Action;
use crate::gui::action_state::ActionState;
use crate::gui::export_expression::Choice;
use crate::gui::expression_work::{Base, ExpressionWork};
use crate::gui::orbit_view::{OrbitView, Projection, StandardView};
use crate::gui::panels::face::look_from;
use crate::gui::panels::in_fixed_width;
use crate::gui::{Command, Focus};

/// What the workspace of the expressions remembers about showing.
#[derive(Debug)]
pub struct ExpressionsView {
    /// What the sliders say, before the intensity.
    pub expression: Expression,
    /// Which of the six it is, while no slider has been moved.
    pub basic: Option<Basic>,
    /// Factor on all activations and the jaw, 0 to 2.
    pub intensity: f64,
    /// Whether left and right move together.
    pub linked: bool,
    /// Which face is moved.
    pub base: Base,
    /// What it is built with.
    pub setup: Setup,
    /// How time is stepped.
    pub pace: Pace,
    /// Whether a person chose the step; else it is that which suits the face.
    pub step_chosen: bool,
    /// What is on the skin.
    pub paint: Paint,
    /// Whether edges are drawn.
    pub wireframe: bool,
    /// Which curve of the picked vertex is shown.
    pub curve: Curve,
    /// Where the eye stands.
    pub orbit: OrbitView,
    /// What is exported.
    pub export: Choice,
    /// The activations of the fit are wanted, as soon as they are known.
    pub wants_fit: bool,
    /// A basic expression that waits for its actuators.
    waiting: Option<Basic>,
    /// Largest value shown since the range last began, of that quantity.
    most: (Shown, f64),
    canvas_focused: bool,
    shown: Option<Projection>,
}

/// What is on the skin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Paint {
    /// The first frame, where there is one; clay elsewhere.
    #[default]
    Texture,
    /// Clay.
    Plain,
    /// A value in colours.
    Value(Shown),
}

/// Curves of the picked vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// How far it is from rest, mm.
    #[default]
    Displacement,
    /// How fast it moves, mm/s.
    Speed,
    /// The muscles' pull on it, N.
    Force,
}

impl Default for ExpressionsView {
    fn default() -> Self {
        Self {
            expression: Expression { name: "Neutral".to_owned(), ..Expression::default() },
            basic: None,
            intensity: 1.0,
            linked: true,
            base: Base::default(),
            setup: Setup::default(),
            pace: Pace::default(),
            step_chosen: false,
            paint: Paint::default(),
            wireframe: false,
            curve: Curve::default(),
            orbit: look_from(StandardView::Front),
            export: Choice::default(),
            wants_fit: false,
            waiting: None,
            most: (Shown::default(), 0.0),
            canvas_focused: false,
            shown: None,
        }
    }
}

impl ExpressionsView {
    /// What is to be played: the sliders times the intensity.
    pub fn wanted(&self) -> Expression {
        self.expression.times(self.intensity)
    }

    /// How the last frame was seen.
    pub fn projection(&self) -> Option<Projection> {
        self.shown
    }

    /// Takes one of the six, or waits with it until the face is there.
    pub(in crate::gui) fn choose(&mut self, basic: Basic, actuators: Option<&Actuators>) {
        match actuators {
            Some(actuators) => {
                self.expression = Expression::basic(basic, actuators);
                self.basic = Some(basic);
                self.waiting = None;
            }
            None => self.waiting = Some(basic),
        }
    }

    /// Another face is there: what waited for it is chosen.
    pub(in crate::gui) fn meet(&mut self, actuators: &Actuators) {
        self.most.1 = 0.0;
        if let Some(basic) = self.waiting.or(self.basic) {
            self.choose(basic, Some(actuators));
        }
    }

    /// Takes an expression from a file.
    pub(in crate::gui) fn open(&mut self, expression: Expression) {
        self.expression = expression;
        (self.basic, self.waiting) = (None, None);
    }

    /// Every slider at zero.
    pub(in crate::gui) fn clear(&mut self) {
        self.open(Expression { name: "Neutral".to_owned(), ..Expression::default() });
    }

    /// Takes the activations of a fit; what is to be said of them.
    pub(in crate::gui) fn take_fitted(&mut self, fitted: BTreeMap<String, f64>) -> String {
        let most = crate::expression::preset::LARGEST_ACTIVATION;
        let above = fitted.values().filter(|a| **a > most).count();
        let count = fitted.len();
        let activations = fitted.into_iter().map(|(id, a)| (id, a.clamp(0.0, most))).collect();
        self.open(Expression { name: "From the fit".to_owned(), activations, jaw_deg: 0.0 });
        self.intensity = 1.0;
        let cut = if above > 0 { format!("; {above} stronger than 200 % were cut there") } else { String::new() };
        format!("{count} muscles have the strength of the fit{cut}. The jaw is not fitted.")
    }

    /// Does what a key or a menu entry names, if it means the picture of the face; true when it did.
    pub(in crate::gui) fn act(&mut self, action: Action) -> bool {
        // Before the first picture arrows move nothing, least of all a mark.
        let Some(projection) = self.shown else { return matches!(action, Action::Nudge(..)) };
        if self.orbit.act(action, &projection, self.canvas_focused) {
            return true;
        }
        match action {
            Action::Look(view) => self.orbit = look_from(view),
            Action::Nudge(..) => {}
            Action::ShowWireframe => self.wireframe = !self.wireframe,
            _ => return false,
        }
        true
    }
}

/// Width of the panel of muscles, points.
const SIDE_WIDTH: f32 = 348.0;

/// Shows the workspace in the whole of `ui`. `places_in_first` are texture coordinates of the vertices in the first frame.
pub fn show(
    ui: &mut Ui,
    work: &ExpressionWork,
    places_in_first: Option<&[Pos2]>,
    view: &mut ExpressionsView,
    focus: &mut Focus,
    state: &ActionState,
    commands: &mut Vec<Command>,
) {
    Panel::top("expressions toolbar")
        .show(ui, |ui| toolbar::show(ui, work, places_in_first.is_some(), view, state, commands));
    let Some(ready) = work.ready() else {
        let words = work.refused().unwrap_or("Making the face ready to move…");
        CentralPanel::default().show(ui, |ui| {
            ui.centered_and_justified(|ui| ui.label(words));
        });
        return;
    };
    Panel::left("expressions muscles").exact_size(SIDE_WIDTH).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            in_fixed_width(ui, |ui| {
                choices::show(ui, view, state, commands);
                actuators::show(ui, ready, view);
                choices::model(ui, ready, view);
            });
        });
    });
    Panel::bottom("expressions curves").resizable(true).default_size(212.0).min_size(120.0).show(ui, |ui| {
        curves::show(ui, ready, view);
    });
    Panel::bottom("expressions transport").show(ui, |ui| transport::show(ui, work, ready, view, state, commands));
    CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
        canvas::show(ui, work, ready, places_in_first, view, focus, commands);
    });
}
