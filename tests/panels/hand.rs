//! What marking a pair of frames costs an annotator: the whole of it done by pointer, wheel and keys, with and without suggestions,
//! every action counted and priced by the keystroke-level model (Card, Moran and Newell 1980).

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use egui::accesskit::Role as Widget;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect};
use egui_kittest::kittest::{NodeT, Queryable};
use frontalis::doubt::agreement;
use frontalis::gui::panels::frames::{Tool, points};
use frontalis::gui::suggesting::Status;
use frontalis::gui::{App, files};
use frontalis::pipeline::{self, Workspace};
use frontalis::project::{PointId, Project, Which, edit, sample};
use frontalis::suggest::Suggestion;
use nalgebra::Vector2;

use crate::stage::{Person, Window, keys, on_screen, settle, show};

/// As large as a desk has it, so that the pictures are zoomed by a few notches.
const SIZE: [f32; 2] = [2560.0, 1440.0];

/// So far from where the hand would press a place is right, px.
const RIGHT_PX: f64 = 1.0;

/// A mark this near was pressed there: the screen knows places to a fraction of a pixel.
const PRESSED_PX: f64 = 0.001;

/// Where a mark lies that is not there.
const NOWHERE: [f64; 2] = [f64::INFINITY; 2];

/// The keystroke-level model, s: a key or a notch of the wheel, the way to a place, the button down or up, a decision.
const K: f64 = 0.28;
const P: f64 = 1.10;
const B: f64 = 0.10;
const M: f64 = 1.35;

/// What a hand has done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tally {
    keys: usize,
    clicks: usize,
    drags: usize,
    notches: usize,
    looks: usize,
    seconds: f64,
}

impl Tally {
    /// Everything that moves a finger.
    fn actions(&self) -> usize {
        self.keys + self.clicks + self.drags + self.notches
    }
}

/// Where the hand would press: the landmarks in the first frame, and how far the skin at each vertex moves to the last one, px.
#[derive(Default)]
struct Places {
    landmarks: BTreeMap<String, [f64; 2]>,
    motion: BTreeMap<u32, [f64; 2]>,
}

impl Places {
    /// Reads rows of `what,id,x,y`: `landmark` with its place, `motion` with that of the vertex.
    fn read(path: &Path) -> Self {
        let mut places = Self::default();
        for row in std::fs::read_to_string(path).unwrap().lines().skip(1).filter(|r| !r.trim().is_empty()) {
            let cells: Vec<&str> = row.split(',').map(str::trim).collect();
            let at = [cells[2].parse().unwrap(), cells[3].parse().unwrap()];
            match cells[0] {
                "landmark" => _ = places.landmarks.insert(cells[1].to_owned(), at),
                "motion" => _ = places.motion.insert(cells[1].parse().unwrap(), at),
                other => panic!("{other} is neither a landmark nor a motion"),
            }
        }
        places
    }

    fn count(&self) -> usize {
        self.landmarks.len() + self.motion.len()
    }

    /// Where the hand would press for this point now.
    fn of(&self, app: &App, id: &PointId) -> Option<[f64; 2]> {
        match id {
            PointId::Landmark(id) => self.landmarks.get(id).copied(),
            PointId::FeatureLast(v) => {
                let ([u, w], first) = (self.motion.get(v)?, app.outcome().first_in_image[*v as usize]);
                Some([first.x + u, first.y + w])
            }
            PointId::FeatureFirst(_) => None,
        }
    }

    /// Where every mark lies, from where the hand would press, px; infinitely far where there is none.
    fn errors(&self, app: &App) -> Vec<(PointId, Vector2<f64>)> {
        let landmarks = self.landmarks.keys().cloned().map(PointId::Landmark);
        let all = landmarks.chain(self.motion.keys().map(|v| PointId::FeatureLast(*v)));
        all.map(|id| (id.clone(), self.off(app, &id, mark(app, &id).unwrap_or(NOWHERE)))).collect()
    }

    /// Where a place lies from where the hand would press for this point, px.
    fn off(&self, app: &App, id: &PointId, at: [f64; 2]) -> Vector2<f64> {
        Vector2::from(at) - Vector2::from(self.of(app, id).unwrap())
    }
}

fn right(off: &Vector2<f64>) -> bool {
    off.norm() <= RIGHT_PX
}

fn mark(app: &App, id: &PointId) -> Option<[f64; 2]> {
    edit::mark(app.project(), id).map(|m| m.at_px)
}

/// An annotator at the window: reads what it shows, and does nothing but press, draw, turn the wheel and type.
struct Hand {
    window: Window,
    did: Tally,
}

impl Hand {
    fn on(app: App) -> Self {
        Self { window: show(app, SIZE, true), did: Tally::default() }
    }

    fn app(&self) -> &App {
        self.window.state()
    }

    /// Presses a key, with others held: each is a key.
    fn key(&mut self, held: Modifiers, key: Key) {
        keys(&mut self.window, held, key);
        let count = 1 + [held.ctrl || held.command, held.shift, held.alt].into_iter().filter(|h| *h).count();
        self.did.keys += count;
        self.did.seconds += M + K * count as f64;
    }

    /// Presses at a place of a frame, as quickly as a click. `held` keeps the mark from snapping, or nothing is held.
    fn press(&mut self, which: Which, at: [f64; 2], held: Modifiers) {
        let pos = self.in_view(which, at);
        self.window.hover_at(pos);
        self.window.step();
        let button = |pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: held };
        let (down, up) = (Event::ModifiersChanged(held), Event::ModifiersChanged(Modifiers::NONE));
        self.window.input_mut().events.extend([down, button(true), button(false), up]);
        self.window.run_steps(2);
        self.did.clicks += 1;
        self.did.keys += usize::from(held.any());
        self.did.seconds += M + P + 2.0 * B + if held.any() { K } else { 0.0 };
    }

    /// Marks a point by a press, and where the mark snaps to a wrong crossing, takes it back and presses with Alt.
    fn mark(&mut self, places: &Places, id: &PointId, to: [f64; 2]) {
        let which = if matches!(id, PointId::Landmark(_)) { Which::First } else { Which::Last };
        self.press(which, to, Modifiers::NONE);
        if mark(self.app(), id).is_some_and(|at| !right(&places.off(self.app(), id, at))) {
            self.key(Modifiers::COMMAND, Key::Z);
            self.press(which, to, Modifiers::ALT);
        }
    }

    /// Draws from one place of the screen to another.
    fn draw(&mut self, from: Pos2, to: Pos2) {
        crate::stage::drag(&mut self.window, &[from, from.lerp(to, 0.5), to]);
        self.did.drags += 1;
        self.did.seconds += 2.0 * (P + B);
    }

    fn look(&mut self) {
        self.did.looks += 1;
        self.did.seconds += M;
    }

    /// Where a pixel is on the screen; the hand can press nothing else.
    fn in_view(&self, which: Which, at: [f64; 2]) -> Pos2 {
        let place = on_screen(&self.window, which, at);
        assert!(self.app().view().frames.panes[which as usize].rect.contains(place), "{at:?} is out of view");
        place
    }

    /// Turns the wheel over the middle of the face until another notch would bring it to the edge of the pane.
    fn zoom_to_face(&mut self, places: &Places) {
        let face = places.landmarks.values().fold(Rect::NOTHING, |mut face, at| {
            face.extend_with(Pos2::new(at[0] as f32, at[1] as f32));
            face
        });
        // The skin reaches farther than the landmarks.
        let face = face.expand2(face.size() / 4.0);
        let middle = on_screen(&self.window, Which::First, [face.center().x, face.center().y].map(f64::from));
        self.window.hover_at(middle);
        self.window.step();
        self.did.seconds += P;
        while self.has_room(face, middle) {
            self.notch();
        }
    }

    /// Whether the face would still be within the pane after another notch.
    fn has_room(&self, face: Rect, fixed: Pos2) -> bool {
        let corner = |p: Pos2| on_screen(&self.window, Which::First, [p.x, p.y].map(f64::from));
        let next = |p: Pos2| fixed + 1.15 * (corner(p) - fixed);
        let pane = self.app().view().frames.panes[0].rect;
        pane.contains(next(face.min)) && pane.contains(next(face.max))
    }

    fn notch(&mut self) {
        self.window.event(Event::MouseWheel {
            unit: egui::MouseWheelUnit::Line,
            delta: egui::vec2(0.0, 1.0),
            modifiers: Modifiers::NONE,
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
        });
        self.window.run_steps(12);
        self.did.notches += 1;
        self.did.seconds += K;
    }

    /// Waits until no suggestion is on its way.
    fn wait(&mut self) {
        settle(&mut self.window);
        while self.app().suggestion_status() == &Status::Looking {
            settle(&mut self.window);
        }
    }

    /// The point that the guide asks for; none when it has put the tool down.
    fn asked(&self) -> Option<PointId> {
        let guided = matches!(self.app().view().frames.tool, Tool::Landmarks | Tool::Features);
        self.app().view().focus.selected.clone().filter(|_| guided)
    }

    /// The place that Enter would take for the point asked for: a landmark's predicted one, the suggested one of the others.
    fn offered(&self, id: &PointId) -> Option<[f64; 2]> {
        let app = self.app();
        match id {
            PointId::Landmark(_) if app.project().landmarks.len() < points::LANDMARKS_TO_PREDICT => None,
            PointId::Landmark(id) => {
                let p = app.outcome().first_in_image[app.face().landmark(id)?.vertex as usize];
                Some([p.x, p.y])
            }
            PointId::FeatureLast(v) => app.suggestions().into_iter().find(|s| s.vertex == *v).map(|s| [s.at.x, s.at.y]),
            PointId::FeatureFirst(_) => None,
        }
    }

    /// Goes with the guide to the end of its list. How many were taken by Enter, of how many.
    fn follow_guide(&mut self, places: &Places, offers: bool) -> Share {
        let mut share = Share::default();
        while let Some(id) = self.asked() {
            let Some(to) = places.of(self.app(), &id) else {
                self.key(Modifiers::NONE, Key::Period);
                continue;
            };
            share.of += 1;
            share.taken += usize::from(self.answer(places, &id, to, offers));
            if matches!(id, PointId::FeatureLast(_)) && offers {
                self.wait();
            }
        }
        share
    }

    /// Marks the point that the guide asks for: Enter where the place offered is right, a press where it is not. Whether it was Enter.
    fn answer(&mut self, places: &Places, id: &PointId, to: [f64; 2], offers: bool) -> bool {
        let offered = self.offered(id).filter(|_| offers);
        let taken = offered.is_some_and(|at| right(&places.off(self.app(), id, at)));
        if taken {
            self.key(Modifiers::NONE, Key::Enter);
        } else {
            self.mark(places, id, to);
        }
        assert!(mark(self.app(), id).is_some() && self.asked().as_ref() != Some(id), "{id} has no mark");
        taken
    }

    /// Draws the slider of *Sure from* to its left end.
    fn sure_from_half(&mut self) {
        let rail = self.window.get_by_role_and_label(Widget::Slider, "Sure from").rect();
        let share = (self.app().view().frames.suggest.least - 0.5) / 0.49;
        let handle = Pos2::new(rail.left() + rail.width() * share as f32, rail.center().y);
        self.draw(handle, rail.left_center());
        assert!((self.app().view().frames.suggest.least - 0.5).abs() < 1e-9);
    }

    /// Looks at every point accepted together, and draws those to their places that are wrong. How each was off, px.
    fn look_through(&mut self, places: &Places) -> Vec<Vector2<f64>> {
        let accepted: Vec<PointId> = self.app().project().features.keys().map(|v| PointId::FeatureLast(*v)).collect();
        let mut off = Vec::new();
        for id in accepted {
            let (Some(to), Some(from)) = (places.of(self.app(), &id), mark(self.app(), &id)) else { continue };
            self.look();
            off.push(places.off(self.app(), &id, from));
            if !right(&off[off.len() - 1]) {
                let [from, to] = [from, to].map(|at| self.in_view(Which::Last, at));
                self.draw(from, to);
            }
        }
        off
    }

    /// Every suggestion: how sure it is, and how it is off, px.
    fn said(&self, places: &Places) -> Vec<(f64, Vector2<f64>)> {
        let known = |s: &Suggestion| places.motion.contains_key(&s.vertex);
        let off = |s: &Suggestion| places.off(self.app(), &PointId::FeatureLast(s.vertex), [s.at.x, s.at.y]);
        self.app().suggestions().iter().filter(|s| known(s)).map(|s| (s.confidence, off(s))).collect()
    }

    /// What the guide says of the way through a film.
    fn way(&self) -> String {
        let said = self.window.query_by_label_contains("followed");
        said.and_then(|n| n.accesskit_node().value()).unwrap_or_else(|| "the frames are of no film".to_owned())
    }

    fn ended(&self, places: &Places) -> Run {
        let (project, errors) = (self.app().project().clone(), places.errors(self.app()));
        Run { did: self.did, project, errors, ..Run::default() }
    }
}

/// So many of so many.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    taken: usize,
    of: usize,
}

/// What came of a pair marked once.
#[derive(Default)]
struct Run {
    did: Tally,
    project: Project,
    errors: Vec<(PointId, Vector2<f64>)>,
    /// Predicted landmarks taken, of all; points of the last frame taken of those that the guide asked for.
    landmarks: Share,
    asked: Share,
    /// Still points accepted as one head.
    still: usize,
    /// How those accepted together were off, px, the still points among them.
    together: Vec<Vector2<f64>>,
    /// Confidence of every suggestion before any mark of the last frame, and how it was off, px.
    said: Vec<(f64, Vector2<f64>)>,
    /// What the guide says of the way through a film.
    way: String,
}

/// Every point is one press.
fn without(app: App, places: &Places) -> Run {
    let mut hand = Hand::on(app);
    hand.key(Modifiers::NONE, Key::H);
    hand.zoom_to_face(places);
    hand.key(Modifiers::COMMAND, Key::L);
    let landmarks = hand.follow_guide(places, false);
    hand.key(Modifiers::COMMAND, Key::M);
    hand.wait();
    let asked = hand.follow_guide(places, false);
    Run { landmarks, asked, ..hand.ended(places) }
}

/// Those that are sure are accepted together and looked at; the guide asks for the others.
fn with(app: App, places: &Places) -> Run {
    let mut hand = Hand::on(app);
    hand.zoom_to_face(places);
    hand.key(Modifiers::COMMAND, Key::L);
    let landmarks = hand.follow_guide(places, true);
    hand.wait();
    let (said, way) = (hand.said(places), hand.way());
    hand.key(Modifiers::SHIFT, Key::S);
    hand.wait();
    let still = hand.app().project().features.len();
    hand.sure_from_half();
    hand.key(Modifiers::SHIFT, Key::Enter);
    hand.wait();
    let together = hand.look_through(places);
    hand.key(Modifiers::COMMAND, Key::M);
    hand.wait();
    let asked = hand.follow_guide(places, true);
    Run { landmarks, asked, still, together, said, way, ..hand.ended(places) }
}

/// The columns of the table in the documentation: keys, clicks, drags, wheel, actions, seconds a point.
impl fmt::Display for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let did = &self.did;
        let each = did.seconds / self.errors.len() as f64;
        let Tally { keys, clicks, drags, notches, looks, .. } = did;
        write!(f, "{keys} | {clicks} | {drags} | {notches} | {} | {each:.2} s a point, {looks} looks", did.actions())
    }
}

impl Run {
    /// The marks that are not where the hand wanted them.
    fn wrong(&self) -> Vec<&(PointId, Vector2<f64>)> {
        self.errors.iter().filter(|(_, off)| !right(off)).collect()
    }

    fn wrong_together(&self) -> usize {
        self.together.iter().filter(|off| !right(off)).count()
    }
}

/// The sample without a mark, and where its marks were.
fn sample_without_marks() -> (App, Places) {
    let face = frontalis::face::generic();
    let mut project = sample::project().unwrap();
    let first = pipeline::solve(&project, &face, [1036; 2], &mut Workspace::default()).first_in_image;
    let moved = |(v, at): (u32, [f64; 2])| (v, [at[0] - first[v as usize].x, at[1] - first[v as usize].y]);
    let marks = project.features.iter().filter_map(|(v, f)| Some((*v, f.last?.at_px)));
    let places = Places {
        landmarks: project.landmarks.iter().map(|(id, m)| (id.clone(), m.at_px)).collect(),
        motion: marks.map(moved).collect(),
    };
    project.landmarks.clear();
    project.features.clear();
    (App::new(project, None, face, Box::new(Person::default())), places)
}

#[test]
fn without_suggestions_every_point_is_one_press() {
    let (app, places) = sample_without_marks();
    let run = without(app, &places);
    println!("without: {run}");
    assert!(run.wrong().is_empty(), "{:?}", run.wrong());
    assert!(run.did.drags == 0 && run.did.clicks <= places.count(), "{run}");
    assert!(run.did.actions() <= places.count() + 10, "{run}");
}

#[test]
fn with_suggestions_a_third_of_the_actions_do() {
    let (app, places) = sample_without_marks();
    let run = with(app, &places);
    println!("with: {run}");
    tell_what_was_taken(&run);
    assert!(run.wrong().is_empty(), "{:?}", run.wrong());
    assert!(run.still >= 4 && run.together.len() > run.still);
    assert!(3 * run.did.actions() <= places.count(), "{run}");
    assert!(run.did.seconds <= 2.0 * places.count() as f64, "{run}");
}

#[test]
fn the_guide_goes_from_suggestion_to_suggestion_by_one_key() {
    let (app, places) = sample_without_marks();
    let mut hand = Hand::on(app);
    hand.key(Modifiers::COMMAND, Key::L);
    hand.follow_guide(&places, true);
    hand.key(Modifiers::COMMAND, Key::M);
    hand.wait();
    let (before, mut taken) = (hand.did, 0);
    for _ in 0..20 {
        let id = hand.asked().unwrap();
        let to = places.of(hand.app(), &id).unwrap();
        taken += usize::from(hand.answer(&places, &id, to, true));
        assert!(right(&places.off(hand.app(), &id, mark(hand.app(), &id).unwrap())), "{id}");
    }
    assert!(taken >= 18 && hand.did.keys >= before.keys + taken, "{taken} taken by Enter");
}

/// Measures a pair of one's own: `FRONTALIS_PAIR` names a project with both frames and no marks, `FRONTALIS_HAND` the table of
/// where the hand would press.
#[test]
#[ignore = "wants a pair of frames and the places of its points"]
fn a_pair_of_ones_own() {
    let path =
        |name: &str| std::path::PathBuf::from(std::env::var_os(name).unwrap_or_else(|| panic!("{name} is unset")));
    let (pair, places) = (path("FRONTALIS_PAIR"), Places::read(&path("FRONTALIS_HAND")));
    let open = || {
        let (project, face) = files::read_project(&pair).unwrap();
        App::new(project, Some(pair.clone()), face, Box::new(Person::default()))
    };
    let (without, with) = (without(open(), &places), with(open(), &places));
    println!("{} points; keys | clicks | drags | wheel | actions | seconds", places.count());
    println!("without: {without}");
    let share = 100.0 * with.did.actions() as f64 / without.did.actions() as f64;
    println!("with:    {with}; {share:.0} % of the actions");
    tell_what_was_taken(&with);
    tell_confidence(&with.said);
    tell_agreement(&without, &with);
    tell_taken(&with);
    for (name, run) in [("without", &without), ("with", &with)] {
        println!("{name}: {} marks farther off than {RIGHT_PX} px: {:?}", run.wrong().len(), run.wrong());
    }
}

fn tell_what_was_taken(run: &Run) {
    println!("{}", run.way);
    let (together, wrong) = (run.together.len(), run.wrong_together());
    println!("accepted together: {together}, of these still points: {}, wrong: {wrong}", run.still);
    println!("asked for by the guide: {}, of these taken by Enter: {}", run.asked.of, run.asked.taken);
    println!("landmarks: {}, of these predicted right: {}", run.landmarks.of, run.landmarks.taken);
}

fn tell_confidence(said: &[(f64, Vector2<f64>)]) {
    println!("said | points | said, mean | within 1 px | bias x, y");
    for [low, high] in [[0.0, 0.3], [0.3, 0.5], [0.5, 0.7], [0.7, 0.9], [0.9, 1.1]] {
        let bin: Vec<_> = said.iter().filter(|(c, _)| (low..high).contains(c)).collect();
        let percent = |sum: f64| 100.0 * sum / bin.len() as f64;
        let (mean, within) = (percent(bin.iter().map(|s| s.0).sum()), bin.iter().filter(|s| right(&s.1)).count());
        let bias = bin.iter().map(|s| s.1).sum::<Vector2<f64>>() / bin.len() as f64;
        let name = format!("{:.0} – {:.0} %", 100.0 * low, f64::min(100.0, 100.0 * high));
        let right = percent(within as f64);
        println!("{name} | {} | {mean:.0} % | {right:.0} % | {:+.2}, {:+.2}", bin.len(), bias.x, bias.y);
    }
    let within = |px: f64| said.iter().filter(|(_, off)| off.norm() <= px).count();
    println!("all: {}, within 1 px {}, within 2 px {}", said.len(), within(1.0), within(2.0));
}

/// How the suggestions that became marks lie from where the hand would press.
fn tell_taken(run: &Run) {
    let of_last =
        run.errors.iter().filter(|(id, off)| matches!(id, PointId::FeatureLast(_)) && off.norm() > PRESSED_PX);
    let off: Vec<Vector2<f64>> = of_last.map(|(_, off)| *off).collect();
    let n = off.len() as f64;
    let bias = off.iter().sum::<Vector2<f64>>() / n;
    let squares = off.iter().map(|d| (d - bias).component_mul(&(d - bias))).sum::<Vector2<f64>>();
    let limits = 1.96 * (squares / (n - 1.0)).map(f64::sqrt);
    println!("suggestions taken: {n}; bias {:+.2}, {:+.2}; 95 % ± {:.2}, ± {:.2}", bias.x, bias.y, limits.x, limits.y);
}

fn tell_agreement(without: &Run, with: &Run) {
    let agreement = agreement::compare(&without.project, &with.project).unwrap();
    let (s, worst) = (agreement.summary.unwrap(), &agreement.differences[0]);
    let ([x, y], [xl, xh], [yl, yh]) = (s.bias_px, s.limits_x_px, s.limits_y_px);
    println!(
        "with − without, {} points: bias {x:+.2}, {y:+.2}; 95 % x {xl:+.2} … {xh:+.2}, y {yl:+.2} … {yh:+.2}",
        s.points
    );
    println!("distance: median {:.2}, worst {:.2} ({})", s.median_px, worst.distance_px(), worst.id);
}
