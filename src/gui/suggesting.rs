//! Places for the points that are not marked yet: asked for in the background whenever marks have changed, and shown until a hand
//! has marked the point or accepted them. Never data.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point2;

use super::app::App;
use super::jobs::{About, Finished, Progress};
use super::panels::frames::{Tool, points};
use super::pictures::{Source, file_name};
use crate::face::FaceModel;
use crate::frames::Way;
use crate::marking::Gray;
use crate::marking::tracking::Prepared;
use crate::pipeline::Outcome;
use crate::project::edit::Accepted;
use crate::project::{Edit, MarkState, PointId, Role, Which};
use crate::suggest::still::{self, StillProposal};
use crate::suggest::{self, Followed, Found, GridCrossing, Suggestion};

/// So long nothing may change before places are asked for anew, s: a hand that marks quickly is not interrupted.
const PAUSE_S: f64 = 0.25;

/// A vertex that has moved farther than this in the first frame since it was asked for is another point of skin, px.
const SAME_SKIN_PX: f64 = 0.1;

/// A suggestion less sure than this becomes an uncertain mark: as likely as not it is more than a pixel off.
pub const UNCERTAIN_BELOW: f64 = 0.5;

/// Largest picture that is prepared, million px: a prepared one takes 9 bytes a pixel.
const MOST_MEGAPIXELS: f64 = 40.0;

/// Largest face whose points are looked for: every point is led by those near it, and the time grows with the square of their number.
const MOST_VERTICES: usize = 5000;

/// How suggestions are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuggestStyle {
    /// Whether places are suggested.
    pub on: bool,
    /// The confidence from which *Accept sure suggestions* takes them, 0 to 1.
    pub least: f64,
}

impl Default for SuggestStyle {
    fn default() -> Self {
        Self { on: true, least: 0.9 }
    }
}

/// The places suggested now.
#[derive(Clone, Debug, Default)]
pub struct Suggested {
    /// By vertex, each with where the vertex lay in the first frame when it was asked for.
    places: BTreeMap<u32, (Suggestion, Point2<f64>)>,
    /// Read from a file, by vertex: what another hand has said goes before what was found.
    imported: BTreeMap<u32, Suggestion>,
    /// What is to be said of them.
    pub status: Status,
    /// Crossings of the painted grid that were found in both frames.
    crossings: Vec<GridCrossing>,
    /// Standard error that the frames' compression adds to every place, px.
    pub compressed_px: f64,
    /// Whether the motion was followed through a film.
    pub through: Through,
    /// Which of the suggestions for still points move as one head.
    pub still: StillProposal,
    /// The frames that are shown, prepared for finding points in them.
    prepared: [Option<Arc<Prepared>>; 2],
}

/// What is to be said of the suggestions.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Status {
    /// They are switched off.
    #[default]
    Off,
    /// Something is missing: a few words.
    Needs(&'static str),
    /// They are being made.
    Looking,
    /// They are there.
    There,
    /// They cannot be made: one line.
    Failed(String),
}

/// Whether the motion was followed through the frames between the first and the last: one line to show.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Through {
    /// From the first frame to the last at once.
    #[default]
    Directly,
    /// Through so many frames of a film.
    Frames(usize, String),
    /// At once, because the film is not found or cannot be used: why.
    Not(String),
}

impl Suggested {
    /// A frame prepared for finding points in it, once it is.
    pub fn prepared(&self, which: Which) -> Option<&Arc<Prepared>> {
        self.prepared[which as usize].as_ref()
    }

    /// The crossing of the painted grid within `reach_px` of a place in a frame, the nearest.
    pub fn crossing_at(&self, which: Which, at: [f64; 2], reach_px: f64) -> Option<&GridCrossing> {
        let away = |c: &GridCrossing| {
            let place = if which == Which::First { c.first } else { c.last };
            (place - Point2::from(at)).norm()
        };
        let near = self.crossings.iter().map(|c| (away(c), c)).filter(|(d, _)| *d <= reach_px);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, c)| c)
    }

    /// The suggestion for a vertex that lies here in the first frame.
    pub fn of(&self, vertex: u32, first: Point2<f64>) -> Option<&Suggestion> {
        if let Some(imported) = self.imported.get(&vertex) {
            return Some(imported);
        }
        let (suggestion, asked) = self.places.get(&vertex)?;
        ((asked - first).norm() <= SAME_SKIN_PX).then_some(suggestion)
    }
}

/// A frame prepared for finding points in it.
#[derive(Clone, Debug)]
pub struct Ready {
    sha256: String,
    prepared: Arc<Prepared>,
}

/// Why a frame is not prepared.
#[derive(Clone, Debug)]
pub struct Failure {
    sha256: String,
    /// One line.
    why: String,
}

/// What suggestions are made of.
#[derive(Clone, Debug, PartialEq)]
struct Question {
    pictures: [String; 2],
    first: Vec<Point2<f64>>,
    known: Vec<(u32, [f64; 2], MarkState)>,
}

/// What the way between the frames depends on: their hashes, and where the vertices lie in the first.
#[derive(Clone, Debug, PartialEq)]
struct Ends {
    pictures: [String; 2],
    first: Vec<Point2<f64>>,
}

impl Ends {
    fn of(question: &Question) -> Self {
        Self { pictures: question.pictures.clone(), first: question.first.clone() }
    }
}

/// The motion between the frames, which holds while only marks of the last frame change.
#[derive(Debug)]
pub struct Walked {
    ends: Ends,
    followed: Followed,
    through: Through,
}

/// What a search has brought back.
#[derive(Debug)]
pub struct Answer {
    question: Question,
    found: Found,
    walked: Arc<Walked>,
}

/// Asks for suggestions.
#[derive(Default)]
pub(super) struct Suggesting {
    /// What is shown.
    pub(super) shown: Suggested,
    /// The frames, or why they cannot be prepared, with their hashes.
    ready: [Option<Result<Ready, Failure>>; 2],
    preparing: [bool; 2],
    /// What would be asked for now, of which state of the project that was read, and since when it is so.
    now: Option<Question>,
    read_at: Option<u64>,
    changed_at: f64,
    answered: Option<Question>,
    /// What is being looked for.
    looking: Option<Ends>,
    /// Films and folders that were opened in this window: frames may come from them.
    films: Vec<PathBuf>,
    walked: Option<Arc<Walked>>,
    /// What the proposal of still points was made of: the outcome, the number of the answer, the least confidence.
    still_of: Option<(u64, u64, u64)>,
    answers: u64,
}

impl Suggesting {
    /// A frame prepared for finding points in it, if it is the one with this hash.
    pub(super) fn prepared(&self, which: Which, sha256: &str) -> Option<&Arc<Prepared>> {
        match &self.ready[which as usize] {
            Some(Ok(ready)) if ready.sha256 == sha256 => Some(&ready.prepared),
            _ => None,
        }
    }

    fn failure(&self, which: Which, sha256: &str) -> Option<&str> {
        match &self.ready[which as usize] {
            Some(Err(failure)) if failure.sha256 == sha256 => Some(&failure.why),
            _ => None,
        }
    }

    /// Takes a frame that was prepared, or the reason why it could not be.
    pub(super) fn take_prepared(&mut self, which: Which, result: Result<Ready, Failure>) {
        self.preparing[which as usize] = false;
        self.ready[which as usize] = Some(result);
    }

    /// Takes places that were found. They hold for the skin that was asked for, whatever was marked meanwhile, and for these pictures.
    pub(super) fn take(&mut self, answer: Answer) {
        self.looking = None;
        self.answers += 1;
        let Answer { question, found, walked } = answer;
        self.shown.through = walked.through.clone();
        self.walked = Some(walked);
        if self.now.as_ref().is_none_or(|now| now.pictures != question.pictures) {
            return;
        }
        let first = |v: u32| question.first.get(v as usize).copied();
        self.shown.places =
            found.suggestions.into_iter().filter_map(|s| Some((s.vertex, (s, first(s.vertex)?)))).collect();
        self.shown.crossings = found.crossings;
        self.shown.compressed_px = found.compressed_px;
        self.answered = Some(question);
    }

    /// The search was stopped by the person.
    pub(super) fn stopped(&mut self) {
        self.looking = None;
    }

    /// A film or a folder was opened; what was searched without it is searched anew.
    pub(super) fn know_film(&mut self, film: &Path) {
        if !self.films.iter().any(|f| f == film) {
            self.films.push(film.to_owned());
            self.walked = None;
            self.answered = None;
        }
    }

    /// The preparation of this frame was stopped by the person; it is not begun again unless asked for.
    pub(super) fn preparation_stopped(&mut self, which: Which, sha256: &str) {
        let why =
            "The preparation of a frame was stopped. Switch the suggestions off and on to begin it again.".to_owned();
        self.take_prepared(which, Err(Failure { sha256: sha256.to_owned(), why }));
    }

    /// Takes suggestions from a file in the place of those from another one.
    pub(super) fn import(&mut self, read: impl Iterator<Item = Suggestion>) {
        self.shown.imported = read.map(|s| (s.vertex, s)).collect();
    }

    /// Another project is open: the points of a file were for the one before.
    pub(super) fn forget_imported(&mut self) {
        self.shown.imported.clear();
    }

    /// Forgets what could not be prepared, so that it is tried again.
    pub(super) fn retry(&mut self) {
        for ready in &mut self.ready {
            ready.take_if(|r| r.is_err());
        }
    }

    fn hush(&mut self, status: Status) {
        if self.shown.status != status || !self.shown.places.is_empty() {
            (self.shown.status, self.shown.places) = (status, BTreeMap::new());
            (self.shown.still, self.still_of) = (StillProposal::default(), None);
            self.answered = None;
        }
    }
}

impl App {
    /// Asks for suggestions when something has changed, and prepares the frames for whoever needs them.
    pub(super) fn follow_suggestions(&mut self, ctx: &egui::Context) {
        let pictures = [Which::First, Which::Last]
            .map(|which| self.pictures.get(which).source().map(|(source, sha256)| (source.clone(), sha256.to_owned())));
        let wanted = self.view.frames.suggest.on;
        let missing = self.missing_for_suggestions(&pictures);
        if wanted && missing.is_none() || self.snapping_needs_pictures() {
            for (which, picture) in [Which::First, Which::Last].into_iter().zip(&pictures) {
                if let Some((source, sha256)) = picture {
                    self.prepare(which, source, sha256, ctx);
                }
            }
        }
        for (which, picture) in [Which::First, Which::Last].into_iter().zip(&pictures) {
            let sha256 = picture.as_ref().map_or("", |(_, sha256)| sha256);
            self.suggesting.shown.prepared[which as usize] = self.suggesting.prepared(which, sha256).cloned();
        }
        if !wanted || missing.is_some() {
            self.stop_search();
        }
        match (wanted, missing) {
            (false, _) => return self.suggesting.hush(Status::Off),
            (true, Some(what)) => return self.suggesting.hush(Status::Needs(what)),
            (true, None) => {}
        }
        let [Some((_, first)), Some((_, last))] = &pictures else { return };
        let s = &self.suggesting;
        if let Some(why) = s.failure(Which::First, first).or_else(|| s.failure(Which::Last, last)) {
            let status = Status::Failed(why.to_owned());
            return self.suggesting.hush(status);
        }
        self.ask(&[first.clone(), last.clone()], ctx);
        self.propose_still();
    }

    /// A search whose answer nobody waits for any more is stopped.
    fn stop_search(&mut self) {
        if self.suggesting.looking.take().is_some()
            && let Some(id) = self.jobs.running().iter().find(|j| j.about == About::Suggestions).map(|j| j.id)
        {
            self.jobs.cancel(id);
        }
    }

    /// Says which of the suggestions for still points move as one head, when anything that it follows from has changed.
    fn propose_still(&mut self) {
        let least = self.view.frames.suggest.least;
        let of = Some((self.stamp.outcome, self.suggesting.answers, least.to_bits()));
        if self.suggesting.still_of == of {
            return;
        }
        let scene = self.scene();
        let still = |v: &u32| points::kind_of(scene, *v) == points::Kind::Still;
        let candidates: Vec<Suggestion> = (0..scene.face.mesh().len() as u32)
            .filter(still)
            .filter_map(|v| points::suggestion(scene, v))
            .copied()
            .collect();
        let proposal = still::propose(scene.project, scene.outcome, &candidates, least);
        (self.suggesting.shown.still, self.suggesting.still_of) = (proposal, of);
    }

    /// Accepts the still points that move as one head, in one step.
    pub(super) fn accept_still(&mut self, ctx: &egui::Context) {
        let places: Vec<Accepted> = self.suggesting.shown.still.points.iter().map(|s| accepted(s, true)).collect();
        if places.is_empty() {
            return;
        }
        let count = places.len();
        self.in_step_with_guide(|app| app.edit(&Edit::Accept(places), ctx));
        let text = format!("{count} still points are marked. Undo takes all of them back.");
        self.tell(super::view_state::NoticeKind::Done, text, ctx);
    }

    /// What is missing before anything can be suggested: a few words.
    fn missing_for_suggestions(&self, pictures: &[Option<(Source, String)>; 2]) -> Option<&'static str> {
        let scene = self.scene();
        let open = |v: &u32| scene.project.features.get(v).is_none_or(|f| f.last.is_none());
        if pictures.iter().any(Option::is_none) {
            Some("Needs both frames.")
        } else if scene.project.landmarks.len() < points::LANDMARKS_TO_PREDICT {
            Some("Needs landmarks.")
        } else if scene.face.mesh().len() > MOST_VERTICES {
            Some("Only for faces of at most 5000 vertices.")
        } else if !points::chosen_vertices(scene, &self.view.frames.regions).iter().any(open) {
            Some("Every chosen point is marked.")
        } else {
            None
        }
    }

    fn prepare(&mut self, which: Which, source: &Source, sha256: &str, ctx: &egui::Context) {
        let s = &mut self.suggesting;
        if s.preparing[which as usize] || s.prepared(which, sha256).is_some() || s.failure(which, sha256).is_some() {
            return;
        }
        s.preparing[which as usize] = true;
        let (source, sha256) = (source.clone(), sha256.to_owned());
        let name = format!("Preparing the {} frame", which.word());
        self.jobs.start(ctx, name, About::Preparation(which), move |progress| {
            let result = prepared(&source, &sha256).map_err(|why| Failure { sha256, why });
            (!progress.is_cancelled()).then_some(Finished::Prepared(which, result))
        });
    }

    /// Asks for places, once nothing has changed for a moment.
    fn ask(&mut self, pictures: &[String; 2], ctx: &egui::Context) {
        // A hand in motion is not interrupted.
        if self.document.history.in_gesture() {
            return;
        }
        let time = ctx.input(|i| i.time);
        let stamp = self.stamp.outcome;
        let s = &mut self.suggesting;
        if s.read_at != Some(stamp) || s.now.as_ref().is_none_or(|q| q.pictures != *pictures) {
            let mark = |(v, f): (&u32, &crate::project::Feature)| f.last.map(|m| (*v, m.at_px, m.state));
            let question = Question {
                pictures: pictures.clone(),
                first: self.outcome.first_in_image.clone(),
                known: self.document.history.project().features.iter().filter_map(mark).collect(),
            };
            s.read_at = Some(stamp);
            if s.now.as_ref().is_none_or(|q| q.pictures != question.pictures) {
                s.shown.places.clear();
                s.shown.crossings.clear();
            }
            if s.now.as_ref() != Some(&question) {
                // The first question is asked at once.
                s.changed_at = if s.now.is_none() { f64::NEG_INFINITY } else { time };
                s.now = Some(question);
            }
        }
        let Some(question) = s.now.clone() else { return };
        let ends = Ends::of(&question);
        // More marks are no reason to begin anew; other pictures, or another place of the face in the first, are.
        if s.looking.as_ref().is_some_and(|l| *l != ends) {
            self.stop_search();
        }
        let s = &mut self.suggesting;
        if s.answered == s.now {
            s.shown.status = Status::There;
            return;
        }
        s.shown.status = Status::Looking;
        let wait = s.changed_at + PAUSE_S - time;
        if s.looking.is_some() {
            return;
        }
        if wait > 0.0 {
            ctx.request_repaint_after_secs(wait as f32);
            return;
        }
        let [first, last] = [Which::First, Which::Last].map(|w| s.prepared(w, &pictures[w as usize]).cloned());
        let (Some(first), Some(last)) = (first, last) else { return };
        let walked = s.walked.clone().filter(|w| w.ends == ends);
        s.looking = Some(ends.clone());
        let sources =
            [Which::First, Which::Last].map(|w| self.pictures.get(w).source().map(|(source, _)| source.clone()));
        let way = match (&walked, &sources) {
            (None, [Some(Source::File(first)), Some(Source::File(last))]) => Way::of([first, last], &s.films),
            _ => Way::None,
        };
        let name = match &way {
            Way::Through(between) => format!("Following the skin through {}", file_name(&between.film)),
            _ => "Looking for the points".to_owned(),
        };
        let (project, face) = (self.document.history.project().clone(), Arc::clone(&self.face));
        let outcome = self.outcome.clone();
        self.jobs.start(ctx, name, About::Suggestions, move |progress| {
            let walked = walked.unwrap_or_else(|| {
                let source = sources.into_iter().next().flatten();
                let (followed, through) = walk(&way, source.as_ref(), &face, &outcome, &first, progress);
                Arc::new(Walked { ends, followed, through })
            });
            // The rest takes a moment; a search that nobody waits for ends here.
            let found = (!progress.is_cancelled())
                .then(|| suggest::found_after(&project, &face, &outcome, &first, &walked.followed, &last))?;
            (!progress.is_cancelled()).then_some(Finished::Suggested(Answer { question, found, walked }))
        });
    }

    /// Accepts every suggestion that is as sure as was asked for, in one step.
    pub(super) fn accept_sure(&mut self, ctx: &egui::Context) {
        let scene = self.scene();
        let chosen = points::chosen_vertices(scene, &self.view.frames.regions);
        let sure = points::sure_suggestions(scene, &chosen, self.view.frames.suggest.least);
        if sure.is_empty() {
            return;
        }
        let count = sure.len();
        self.in_step_with_guide(|app| app.edit(&Edit::Accept(sure), ctx));
        let text = format!("{count} suggestions are marks now. Undo takes all of them back.");
        self.tell(super::view_state::NoticeKind::Done, text, ctx);
    }
}

/// What the mark of an accepted suggestion is.
pub fn accepted(suggestion: &Suggestion, still: bool) -> Accepted {
    let Suggestion { vertex, at, confidence, .. } = *suggestion;
    let state = if confidence < UNCERTAIN_BELOW { MarkState::Uncertain } else { MarkState::Marked };
    Accepted { vertex, at_px: [at.x, at.y], state, role: if still { Role::Still } else { Role::Skin } }
}

/// A mark this near to a crossing is on it, px.
pub const ON_CROSSING_PX: f64 = 1.0;

/// How a crossing is called: "row 3, column 5".
pub fn crossing_words(crossing: &GridCrossing) -> String {
    format!("row {}, column {}", crossing.row, crossing.column)
}

/// The point whose suggested or predicted place *Accept* takes: the one the guide asks for, or the selected one, or else the
/// suggestion under the pointer.
pub(super) fn to_accept(scene: super::Scene<'_>, view: &super::ViewState, asked: Option<PointId>) -> Option<PointId> {
    let open = |id: &PointId| {
        points::of(scene, id).is_some_and(|(look, _)| matches!(look, points::Look::Predicted | points::Look::Suggested))
    };
    if matches!(view.frames.tool, Tool::Landmarks | Tool::Features) {
        return asked.filter(open);
    }
    let pointed = view.focus.hovered().filter(|v| points::suggestion(scene, *v).is_some()).map(PointId::FeatureLast);
    view.focus.selected.clone().filter(open).or(pointed)
}

/// Follows the skin through the frames on the way; long work, which stops at the next frame where nobody waits for it.
fn walk(
    way: &Way,
    source: Option<&Source>,
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    progress: &Progress,
) -> (Followed, Through) {
    let (between, source) = match (way, source) {
        (Way::Through(between), Some(source)) => (between, source),
        (Way::Missing(film), _) => {
            let why =
                format!("The film {film}, from which the frames come, is not beside them; open it, and it is used");
            return (Followed::default(), Through::Not(why));
        }
        _ => return (Followed::default(), Through::Directly),
    };
    let picture = match source.read() {
        Ok(frame) => frame.image().clone(),
        Err(why) => return (Followed::default(), Through::Not(why)),
    };
    let (stop, mut seen) = (|| progress.is_cancelled(), 0);
    let told = |count| {
        seen = count;
        progress.set(count as f64 / (between.count() + 1) as f64);
    };
    match suggest::follow_film(between, &picture, face, outcome, first, &stop, told) {
        Ok(followed) => (followed, Through::Frames(seen, file_name(&between.film))),
        Err(e) => (Followed::default(), Through::Not(e.to_string())),
    }
}

fn prepared(source: &Source, sha256: &str) -> Result<Ready, String> {
    let frame = source.read()?;
    if frame.sha256() != sha256 {
        return Err(format!("{}: was replaced by another picture meanwhile; open it again", source.path().display()));
    }
    let megapixels = f64::from(frame.width()) * f64::from(frame.height()) * 1e-6;
    if megapixels > MOST_MEGAPIXELS {
        let name = file_name(source.path());
        return Err(format!(
            "{name} has {megapixels:.0} million pixels; points are looked for in pictures of at most {MOST_MEGAPIXELS:.0} million"
        ));
    }
    let gray = Gray::of(frame.image()).ok_or_else(|| format!("{}: has no pixels", source.path().display()))?;
    let prepared = Prepared::of(gray).compressed(frame.compression());
    Ok(Ready { sha256: sha256.to_owned(), prepared: Arc::new(prepared) })
}
