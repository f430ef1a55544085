//! Choosing the first and the last frame on the strip of a film or of a folder of numbered pictures.

use std::collections::BTreeMap;

use egui::{Align2, Color32, FontId, Key, Modifiers, Pos2, Rect, RichText, Sense, Shape, Stroke, TextureHandle, Vec2};
use image::RgbImage;

use super::super::film_work::{Known, Looking};
use crate::frames::Compression;
use crate::gui::pictures::file_name;
use crate::gui::{Command, theme};

const THUMBNAILS_HEIGHT: f32 = 64.0;
const CURVE_HEIGHT: f32 = 64.0;
/// Half the width within which the pointer takes a handle, points.
const GRIP: f32 = 7.0;
const WORDS: [&str; 2] = ["First", "Last"];

/// The choice while it is made.
pub struct FilmView {
    looking: Looking,
    chosen: [usize; 2],
    /// The handle that keys and clicks move.
    active: usize,
    /// A hand has chosen: the proposal does not overrule it.
    touched: bool,
    thumbnails: BTreeMap<usize, TextureHandle>,
    previews: BTreeMap<usize, TextureHandle>,
}

impl std::fmt::Debug for FilmView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "FilmView({:?}, {:?})", self.looking, self.chosen)
    }
}

impl Clone for FilmView {
    fn clone(&self) -> Self {
        let (thumbnails, previews) = (self.thumbnails.clone(), self.previews.clone());
        Self { looking: self.looking.clone(), thumbnails, previews, ..*self }
    }
}

impl PartialEq for FilmView {
    fn eq(&self, other: &Self) -> bool {
        self.looking == other.looking && self.chosen == other.chosen && self.active == other.active
    }
}

impl FilmView {
    /// Begins to choose.
    pub fn new(looking: Looking) -> Self {
        let chosen = looking.proposed_by_names().unwrap_or([0, 0]);
        let (thumbnails, previews) = (BTreeMap::new(), BTreeMap::new());
        Self { looking, chosen, active: 0, touched: false, thumbnails, previews }
    }

    /// The film.
    pub fn looking(&self) -> &Looking {
        &self.looking
    }

    /// Indices of the first and the last frame.
    pub fn chosen(&self) -> [usize; 2] {
        self.chosen
    }

    /// Takes what the motion proposes, unless a hand has chosen.
    fn propose(&mut self, known: &Known) {
        let ends = [0, known.count.saturating_sub(1)];
        if !self.touched && known.count > 0 {
            let by_names = self.looking.proposed_by_names();
            let by_motion = known.motion.as_ref().filter(|m| m.moved).map(|m| [m.first, m.last]);
            self.chosen = by_motion.or(by_names).unwrap_or(ends);
        }
        self.chosen = self.chosen.map(|i| i.min(ends[1]));
    }

    fn step(&mut self, by: isize, count: usize) {
        let to = self.chosen[self.active].saturating_add_signed(by).min(count.saturating_sub(1));
        self.set(to);
    }

    fn set(&mut self, to: usize) {
        self.chosen[self.active] = to;
        self.touched = true;
    }
}

/// Shows the choice; true when it is to be closed.
pub fn show(ui: &mut egui::Ui, view: &mut FilmView, commands: &mut Vec<Command>) -> bool {
    let looking = view.looking.clone();
    let mut known = looking.known();
    view.propose(&known);
    keys(ui, view, known.count, &known.keys);
    headline(ui, view, &known);
    ui.add_space(6.0);
    previews(ui, view, &mut known);
    ui.add_space(6.0);
    strip(ui, view, &known);
    ui.add_space(4.0);
    ui.label(RichText::new(words(view, &known)).weak());
    ui.add_space(8.0);
    known.wanted = view.chosen;
    let ready = known.count > 1 && view.chosen[0] != view.chosen[1];
    let (count, looked_through) = (known.count, known.motion.is_some());
    drop(known);
    let mut close = false;
    ui.horizontal(|ui| {
        let pressed = super::modals::primary_if(ui, ready, "Use these frames").clicked();
        // A key that is still held from typing the film's path is no answer to what is not proposed yet.
        let chosen = looked_through || view.touched;
        if pressed || (ready && chosen && super::modals::enter(ui)) {
            commands.push(Command::UseFilmFrames(looking.clone(), view.chosen));
            close = true;
        }
        close |= ui.button("Cancel").clicked();
        ui.add_space(16.0);
        let again = ui.add_enabled(view.touched && looked_through, egui::Button::new("Propose again"));
        if again.on_hover_text("Take the frames that the motion proposes.").clicked() {
            view.touched = false;
        }
        if count > 1 && !ready {
            ui.colored_label(ui.visuals().warn_fg_color, "The first and the last frame must be different.");
        }
    });
    close
}

fn keys(ui: &egui::Ui, view: &mut FilmView, count: usize, key_frames: &[usize]) {
    let pressed = |modifiers, key| ui.input_mut(|i| i.count_and_consume_key(modifiers, key)).cast_signed();
    // The more particular first: without modifiers a key would be taken for either.
    let here = view.chosen[view.active];
    if pressed(Modifiers::COMMAND, Key::ArrowRight) > 0
        && let Some(next) = key_frames.iter().find(|k| **k > here)
    {
        view.set(*next);
    }
    if pressed(Modifiers::COMMAND, Key::ArrowLeft) > 0
        && let Some(before) = key_frames.iter().rev().find(|k| **k < here)
    {
        view.set(*before);
    }
    let ten = pressed(Modifiers::SHIFT, Key::ArrowRight) - pressed(Modifiers::SHIFT, Key::ArrowLeft);
    let one = pressed(Modifiers::NONE, Key::ArrowRight) - pressed(Modifiers::NONE, Key::ArrowLeft);
    if ten != 0 || one != 0 {
        view.step(10 * ten + one, count);
    }
    for (handle, key) in [(0, Key::Num1), (1, Key::Num2)] {
        if pressed(Modifiers::NONE, key) > 0 {
            view.active = handle;
        }
    }
    if pressed(Modifiers::NONE, Key::Home) > 0 {
        view.set(0);
    }
    if pressed(Modifiers::NONE, Key::End) > 0 {
        view.set(count.saturating_sub(1));
    }
}

fn headline(ui: &mut egui::Ui, view: &FilmView, known: &Known) {
    ui.horizontal(|ui| {
        let name = file_name(view.looking.path());
        let Some([width, height]) = known.size else {
            ui.spinner();
            ui.label(format!("Opening {name}"));
            return;
        };
        let lasts = known.times_s.last().map(|t| format!(", {t:.2} s")).unwrap_or_default();
        let what = if view.looking.is_folder() { "pictures" } else { "frames" };
        ui.label(format!("{name}: {} {what} of {width} × {height} px{lasts}", known.count));
        if known.motion.is_none() {
            let share = known.seen as f32 / known.count.max(1) as f32;
            ui.add(egui::ProgressBar::new(share).desired_width(160.0).desired_height(8.0));
            ui.label(RichText::new(format!("looking through it: {:.0} %", 100.0 * share)).weak());
        }
    });
    if let Some(remark) = &known.remark {
        ui.colored_label(ui.visuals().warn_fg_color, format!("Note: {remark}"));
    }
}

/// What the motion says, and how to choose.
fn words(view: &FilmView, known: &Known) -> String {
    let how = "Drag the handles, or step with the left and right arrow keys (Shift: ten frames); 1 and 2 take a handle. Enter uses them.";
    let proposed = match &known.motion {
        None => "The curve shows what changes from frame to frame.",
        Some(m) if !m.moved => "Nothing lasting moves in it: choose by eye.",
        Some(_) if view.touched => "The curve shows how far each frame is from the neutral one proposed.",
        Some(_) => "Proposed by the motion: the quiet beginning, and the largest lasting change from it (the curve).",
    };
    let keys =
        if known.keys.is_empty() { "" } else { " Small marks over the curve are key frames (Ctrl and an arrow key)." };
    format!("{proposed} {how}{keys}")
}

/// Width of the mark of a key frame, ui points.
const KEY_MARK: f32 = 6.0;

/// What key frames are good for.
const KINDS: &str = "A film's coder carries the faint texture of skin from frame to frame: places found between predicted frames are less sure. A key \
                     frame is a picture of its own. Ctrl with the left and right arrow keys goes from key frame to key frame.";

/// Of which kind a frame is, in a film that has both.
fn kind(known: &Known, index: usize) -> Option<&'static str> {
    let compression = if known.keys.contains(&index) { Compression::Intra } else { Compression::Inter };
    (!known.keys.is_empty()).then(|| compression.words()).flatten()
}

/// Both frames, large.
fn previews(ui: &mut egui::Ui, view: &mut FilmView, known: &mut Known) {
    let p = theme::palette(ui.visuals());
    let gap = 10.0;
    let width = (ui.available_width() - gap) / 2.0;
    let room = ui.ctx().content_rect().height() - 380.0;
    let height = known.size.map_or(width * 0.6, |[w, h]| width * h as f32 / w as f32).min(room.max(120.0));
    let (place, _) = ui.allocate_exact_size(Vec2::new(2.0 * width + gap, height + 26.0), Sense::hover());
    for which in 0..2 {
        let left = place.left() + which as f32 * (width + gap);
        let title = Rect::from_min_size(Pos2::new(left, place.top()), Vec2::new(width, 24.0));
        let picture = Rect::from_min_size(Pos2::new(left, place.top() + 26.0), Vec2::new(width, height));
        let index = view.chosen[which];
        let time = known.times_s.get(index).map(|t| format!("   {t:.2} s")).unwrap_or_default();
        let name = ["First (neutral)", "Last (apex)"][which];
        let mut child = ui
            .new_child(egui::UiBuilder::new().max_rect(title).layout(egui::Layout::left_to_right(egui::Align::Center)));
        let kind = kind(known, index).map(|k| format!(", {k}")).unwrap_or_default();
        let text = RichText::new(format!("{name}: frame {}{time}{kind}", index + 1));
        let label = child.label(if view.active == which { text.strong().color(handle_colour(which)) } else { text });
        if !known.keys.is_empty() {
            label.on_hover_text(KINDS);
        }
        child.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (sign, label, tip) in [(1, ">", "One frame later"), (-1, "<", "One frame earlier")] {
                let button = ui.push_id((which, sign), |ui| ui.small_button(label)).inner;
                if button.on_hover_text(tip).clicked() {
                    view.active = which;
                    view.step(sign, known.count);
                }
            }
        });
        let response = ui.interact(picture, ui.scope_id().with(("preview", which)), Sense::click());
        if response.clicked() {
            view.active = which;
        }
        let painter = ui.painter_at(picture.expand(2.0));
        painter.rect_filled(picture, 4.0, p.canvas);
        let sharp = preview_texture(ui.ctx(), view, known, index);
        // Until the frame is read, the nearest small picture stands for it.
        let shown = sharp.or_else(|| nearest(&view.thumbnails, index).cloned());
        if let Some(texture) = &shown {
            paint_in(&painter, texture, picture);
        }
        if let Some(why) = known.unreadable.get(&index) {
            let at = picture.shrink(12.0);
            let galley = painter.layout(why.clone(), FontId::proportional(13.0), p.warn, at.width());
            painter.rect_filled(Rect::from_min_size(at.min, galley.size()).expand(6.0), 4.0, p.card);
            painter.galley(at.min, galley, p.warn);
        } else if !known.previews.contains_key(&index) && !view.previews.contains_key(&index) && known.count > 0 {
            ui.put(
                Rect::from_center_size(picture.right_top() + Vec2::new(-18.0, 18.0), Vec2::splat(18.0)),
                egui::Spinner::new(),
            );
        }
        let line = if view.active == which { Stroke::new(2.0, handle_colour(which)) } else { Stroke::new(1.0, p.line) };
        painter.rect_stroke(picture, 4.0, line, egui::StrokeKind::Middle);
        let said = format!("{name}, frame {} of {}", index + 1, known.count);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, said.clone()));
    }
}

/// The preview of a frame on the graphics card, if it is read.
fn preview_texture(ctx: &egui::Context, view: &mut FilmView, known: &Known, index: usize) -> Option<TextureHandle> {
    if let Some(texture) = view.previews.get(&index) {
        return Some(texture.clone());
    }
    let texture = upload(ctx, "preview", known.previews.get(&index)?);
    let chosen = view.chosen;
    view.previews.retain(|i, _| chosen.iter().any(|c| c.abs_diff(*i) <= 8));
    view.previews.insert(index, texture.clone());
    Some(texture)
}

fn upload(ctx: &egui::Context, name: &str, image: &RgbImage) -> TextureHandle {
    let size = [image.width() as usize, image.height() as usize];
    let image = egui::ColorImage::from_rgb(size, image.as_raw());
    let options =
        egui::TextureOptions { mipmap_mode: Some(egui::TextureFilter::Linear), ..egui::TextureOptions::LINEAR };
    ctx.load_texture(name, image, options)
}

/// The texture of the frame nearest to this one.
fn nearest(textures: &BTreeMap<usize, TextureHandle>, index: usize) -> Option<&TextureHandle> {
    let before = textures.range(..=index).next_back();
    let after = textures.range(index..).next();
    let of = |t: Option<(&usize, &TextureHandle)>| t.map_or(usize::MAX, |(i, _)| i.abs_diff(index));
    if of(before) <= of(after) { before.map(|b| b.1) } else { after.map(|a| a.1) }
}

/// Paints a texture as large as it goes into the place, with its own proportions.
fn paint_in(painter: &egui::Painter, texture: &TextureHandle, place: Rect) {
    let size = texture.size_vec2();
    let scale = (place.width() / size.x.max(1.0)).min(place.height() / size.y.max(1.0));
    let rect = Rect::from_center_size(place.center(), size * scale);
    painter.image(texture.id(), rect, Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0)), Color32::WHITE);
}

fn handle_colour(which: usize) -> Color32 {
    [theme::on_picture::LANDMARK, theme::on_picture::FEATURE][which]
}

/// Thumbnails, the curve of the motion, and the two handles.
fn strip(ui: &mut egui::Ui, view: &mut FilmView, known: &Known) {
    let p = theme::palette(ui.visuals());
    let height = THUMBNAILS_HEIGHT + CURVE_HEIGHT + 18.0;
    let (place, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), height), Sense::hover());
    // A name of its own: what comes and goes above it, while frames are read, must not end a drag.
    let response = ui.interact(place, ui.scope_id().with("strip"), Sense::click_and_drag());
    let place = place.shrink2(Vec2::new(GRIP, 0.0));
    let last = known.count.saturating_sub(1).max(1);
    let x_of = |index: usize| place.left() + place.width() * (index as f32 / last as f32).min(1.0);
    let index_at = |x: f32| (((x - place.left()) / place.width()).clamp(0.0, 1.0) * last as f32).round() as usize;
    for (index, image) in &known.thumbnails {
        if !view.thumbnails.contains_key(index) {
            view.thumbnails.insert(*index, upload(ui.ctx(), "thumbnail", image));
        }
    }
    let pointer = response.interact_pointer_pos();
    if let Some(at) = pointer.filter(|_| known.count > 0) {
        if response.drag_started() || response.clicked() {
            // A drag is known as one only once the pointer has left the place of the press.
            let pressed = ui.input(|i| i.pointer.press_origin()).unwrap_or(at);
            let near = |w: usize| (x_of(view.chosen[w]) - pressed.x).abs();
            // A handle under the pointer is taken; where both are, the active one.
            let under = [view.active, 1 - view.active].into_iter().find(|w| near(*w) <= GRIP);
            view.active = under.unwrap_or(view.active);
        }
        if response.dragged() || response.drag_stopped() || response.clicked() {
            view.set(index_at(at.x));
        }
    }

    let painter = ui.painter_at(place.expand2(Vec2::new(GRIP + 1.0, 1.0)));
    let row = Rect::from_min_size(place.min, Vec2::new(place.width(), THUMBNAILS_HEIGHT));
    painter.rect_filled(row, 3.0, p.canvas);
    let aspect = known.size.map_or(1.5, |[w, h]| w as f32 / h as f32);
    let wanted = (row.width() / (THUMBNAILS_HEIGHT * aspect).max(8.0)).ceil().max(1.0);
    let each = row.width() / wanted;
    let seen = known.seen;
    for i in 0..wanted as usize {
        let cell =
            Rect::from_min_size(Pos2::new(row.left() + i as f32 * each, row.top()), Vec2::new(each, row.height()));
        let index = index_at(cell.center().x);
        if let Some(texture) = nearest(&view.thumbnails, index).filter(|_| index < seen) {
            let size = texture.size_vec2();
            // Filled to its edges: what is wider or higher than the cell is cut.
            let scale = (cell.width() / size.x).max(cell.height() / size.y);
            let part = Vec2::new(cell.width() / (size.x * scale), cell.height() / (size.y * scale)) / 2.0;
            let uv = Rect::from_center_size(Pos2::new(0.5, 0.5), part * 2.0);
            painter.image(texture.id(), cell.shrink2(Vec2::new(0.5, 0.0)), uv, Color32::WHITE);
        }
    }
    let below =
        Rect::from_min_size(Pos2::new(place.left(), row.bottom() + 4.0), Vec2::new(place.width(), CURVE_HEIGHT));
    painter.rect_filled(below, 3.0, p.canvas);
    curve(&painter, below, known, &x_of, &p);
    let mut marked = f32::NEG_INFINITY;
    for x in known.keys.iter().map(|key| x_of(*key)) {
        // Of a long film as many as can be told apart.
        if x - marked < KEY_MARK {
            continue;
        }
        marked = x;
        let at = Pos2::new(x, below.top() + 1.0);
        let side = Vec2::new(KEY_MARK / 2.0, 0.0);
        let mark = vec![at - side, at + side, at + Vec2::new(0.0, KEY_MARK - 1.0)];
        painter.add(Shape::convex_polygon(mark, p.accent, Stroke::NONE));
    }
    let [a, b] = view.chosen.map(x_of);
    let between = Rect::from_x_y_ranges(a.min(b)..=a.max(b), below.y_range());
    painter.rect_filled(between, 0.0, p.accent.gamma_multiply(0.14));
    for (which, label) in WORDS.into_iter().enumerate() {
        let x = x_of(view.chosen[which]);
        let colour = handle_colour(which);
        let width = if view.active == which { 2.5 } else { 1.5 };
        painter.vline(x, row.top()..=below.bottom(), Stroke::new(width + 2.0, theme::on_picture::HALO));
        painter.vline(x, row.top()..=below.bottom(), Stroke::new(width, colour));
        let tip = Pos2::new(x, below.bottom());
        let triangle = vec![tip, tip + Vec2::new(-GRIP, 11.0), tip + Vec2::new(GRIP, 11.0)];
        painter.add(Shape::convex_polygon(triangle, colour, Stroke::new(1.0, theme::on_picture::HALO)));
        let side = if (which == 0) == (a <= b) { Align2::RIGHT_BOTTOM } else { Align2::LEFT_BOTTOM };
        let room = if side == Align2::RIGHT_BOTTOM { x - place.left() } else { place.right() - x };
        let side = if room < 34.0 && side == Align2::RIGHT_BOTTOM {
            Align2::LEFT_BOTTOM
        } else if room < 34.0 {
            Align2::RIGHT_BOTTOM
        } else {
            side
        };
        let offset = if side == Align2::RIGHT_BOTTOM { -9.0 } else { 9.0 };
        painter.text(tip + Vec2::new(offset, 13.0), side, label, FontId::proportional(11.0), ui.visuals().text_color());
    }
    let said =
        format!("Strip of {} frames, first at {}, last at {}", known.count, view.chosen[0] + 1, view.chosen[1] + 1);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, said.clone()));
    if let Some(at) = response.hover_pos().filter(|at| place.x_range().contains(at.x) && known.count > 0) {
        let index = index_at(at.x);
        let time = known.times_s.get(index).map(|t| format!(", {t:.2} s")).unwrap_or_default();
        let kind = kind(known, index).map(|k| format!(", {k}")).unwrap_or_default();
        painter.vline(at.x, below.y_range(), Stroke::new(1.0, ui.visuals().weak_text_color()));
        // Over the thumbnails: at the pointer it would cover the names of the handles.
        let words = painter.layout_no_wrap(
            format!("Frame {}{time}{kind}", index + 1),
            FontId::proportional(11.0),
            ui.visuals().strong_text_color(),
        );
        let size = words.size() + Vec2::new(10.0, 4.0);
        let left = (at.x - size.x / 2.0).clamp(place.left(), (place.right() - size.x).max(place.left()));
        let label = Rect::from_min_size(Pos2::new(left, row.top() + 3.0), size);
        painter.rect_filled(label, 3.0, ui.visuals().extreme_bg_color.gamma_multiply(0.9));
        painter.galley(label.min + Vec2::new(5.0, 2.0), words, ui.visuals().strong_text_color());
    }
}

/// The change from the neutral frame, once it is known; until then what changes from frame to frame.
fn curve(painter: &egui::Painter, place: Rect, known: &Known, x_of: &dyn Fn(usize) -> f32, p: &theme::Palette) {
    let values: Vec<(usize, f64)> = match &known.motion {
        Some(m) => m.change.iter().enumerate().map(|(i, v)| (i * m.step, *v)).collect(),
        None => known.speed.clone(),
    };
    let largest = values.iter().map(|v| v.1).fold(1.0, f64::max);
    let y_of = |v: f64| place.bottom() - 2.0 - (place.height() - 6.0) * (v / largest) as f32;
    // More values than points of the screen: the largest of each column.
    let mut line: Vec<Pos2> = Vec::new();
    for (index, value) in values {
        let at = Pos2::new(x_of(index), y_of(value));
        match line.last_mut() {
            Some(before) if at.x - before.x < 0.7 => before.y = before.y.min(at.y),
            _ => line.push(at),
        }
    }
    let fill = p.accent.gamma_multiply(0.25);
    for pair in line.windows(2) {
        let bottom = place.bottom() - 1.0;
        let corners = vec![pair[0], pair[1], Pos2::new(pair[1].x, bottom), Pos2::new(pair[0].x, bottom)];
        painter.add(Shape::convex_polygon(corners, fill, Stroke::NONE));
    }
    painter.add(Shape::line(line, Stroke::new(1.5, p.accent)));
}
