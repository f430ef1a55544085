//! What the workspace of the forces makes of an outcome, kept until the outcome or a choice changes: turning the map makes none of it anew.

use std::sync::Arc;

use egui::{Color32, ColorImage, Mesh, Painter, Rect, TextureHandle, TextureId, TextureOptions, pos2};
use nalgebra::Point3;

use super::findings::Findings;
use crate::gui::face_drawing::levels::{Level, Levels};
use crate::gui::height_map::axes::Ground;
use crate::gui::height_map::mesh_picture::{self, Place};
use crate::gui::height_map::palette::Palette;
use crate::gui::height_map::parts::{self, Parts};
use crate::gui::height_map::range::{ColourRange, RangeMode, range_of};
use crate::gui::height_map::scene::Projected;
use crate::gui::height_map::{Direction, Layer, MapOptions, Quantity, Relief, Surface};
use crate::gui::orbit_view::Projection;
use crate::gui::{Scene, Stamp};
use crate::muscle_field::section::Line;

/// The layer of an outcome, and where its vertices are.
#[derive(Debug)]
pub(super) struct Prepared {
    from: (Stamp, Quantity, Direction, Option<usize>),
    /// The values shown.
    pub(super) layer: Layer,
    /// The range of all its values.
    pub(super) all: ColourRange,
    /// The vertices from the eyes, mm.
    pub(super) first: Vec<Point3<f64>>,
    /// What there is to say of the field.
    pub(super) findings: Findings,
    levels: Option<(u64, Arc<Levels>)>,
    raised: Option<Raised>,
    drawn: Option<Drawn>,
}

/// A drawing of the surface, which holds until something that it depends on changes: it is not made anew while the pointer only moves over it.
#[derive(Debug)]
pub(super) struct Drawn {
    from: DrawnFrom,
    projected: Arc<Projected>,
    painted: Painted,
    /// How often it has been made, this time included.
    times: u64,
}

/// In what form a drawing goes to the screen.
enum Painted {
    /// As triangles, which a graphics card paints in every frame.
    Triangles(Arc<Mesh>),
    /// As a picture that the processor has painted once.
    Picture(TextureHandle, Rect),
}

impl std::fmt::Debug for Painted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Triangles(mesh) => write!(f, "{} triangles", mesh.indices.len() / 3),
            Self::Picture(_, place) => write!(f, "picture at {place:?}"),
        }
    }
}

/// What a drawing depends on besides the outcome.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DrawnFrom {
    pub(super) projection: Projection,
    pub(super) options: MapOptions,
    /// Its range may follow the view.
    pub(super) palette: Palette,
    pub(super) texture: TextureId,
    pub(super) surface: SurfaceFrom,
    pub(super) cuts: Vec<Line>,
    pub(super) dark: bool,
    pub(super) pixels_per_point: f32,
    pub(super) levels_mm: Option<[f64; 2]>,
    /// Where the picture lies, if it becomes one.
    pub(super) picture: Option<Place>,
}

/// What a surface depends on besides the outcome: whether the border is shown, the bits of mm per unit, what it stands on.
type SurfaceFrom = (bool, u64, Relief);

/// The surface of a layer, and what of it is drawn.
#[derive(Debug)]
pub(super) struct Raised {
    pub(super) from: SurfaceFrom,
    /// The layer without the border, if that is left out.
    pub(super) layer: Option<Layer>,
    /// The surface.
    pub(super) surface: Surface,
    /// Edges of the two levels that the parts were made of, mm.
    pub(super) levels_mm: Option<[f64; 2]>,
    /// What of it is drawn.
    pub(super) parts: Parts,
    sight: Option<Sight>,
}

/// What a view must hold.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    from: (bool, u64),
    /// The ground under it.
    pub(super) ground: Ground,
    /// Points that lie outermost.
    pub(super) outline: Arc<[Point3<f64>]>,
}

/// Triangles with data are drawn from a level whose edges are at least so long on the screen, and flat ones, points.
const SHORTEST: [f64; 2] = [2.5, 6.0];
/// The same while the map is being turned: a picture that follows the hand is worth more then than its last detail.
const SHORTEST_IN_MOTION: [f64; 2] = [5.0, 10.0];

impl Prepared {
    /// What was prepared before if it still holds, or anew.
    pub(super) fn of(scene: Scene<'_>, o: &MapOptions, before: Option<Self>) -> Self {
        let from = (scene.stamp, o.quantity, o.direction, o.muscle);
        let levels = match before {
            Some(before) if before.from == from => return before,
            Some(before) => before.levels.filter(|(face, _)| *face == scene.stamp.face),
            None => None,
        };
        let layer = Layer::new(scene.outcome, scene.face, o.quantity, o.direction, o.muscle);
        Self {
            from,
            all: range_of(RangeMode::Auto, &layer, &|_| true),
            layer,
            // The chain measures from the optical axis, people from the eyes.
            first: scene.outcome.first_from_eyes(scene.face),
            findings: Findings::of(scene),
            levels,
            raised: None,
            drawn: None,
        }
    }

    /// The range of the colours where it does not depend on the view.
    pub(super) fn range(&self, mode: RangeMode) -> ColourRange {
        if let RangeMode::Locked(range) = mode { range } else { self.all }
    }

    /// The surface for these heights: what was made before if it still holds, or anew.
    pub(super) fn raise(
        &mut self,
        scene: Scene<'_>,
        o: &MapOptions,
        mm_per_unit: f64,
        without_border: impl FnOnce(&Layer) -> Option<Layer>,
    ) -> Raised {
        let from = (o.border, mm_per_unit.to_bits(), o.relief);
        if let Some(raised) = self.raised.take().filter(|r| r.from == from) {
            return raised;
        }
        let layer = without_border(&self.layer);
        let values = &layer.as_ref().unwrap_or(&self.layer).values;
        let surface = Surface::new(scene.face.mesh(), &self.first, values, mm_per_unit, o.relief);
        Raised { from, layer, surface, levels_mm: None, parts: Parts::default(), sight: None }
    }

    /// Chooses what is drawn at that size of a millimetre on the screen.
    pub(super) fn choose(&mut self, scene: Scene<'_>, raised: &mut Raised, points_per_mm: f64, in_motion: bool) {
        let mesh = scene.face.mesh();
        if !parts::is_large(mesh) {
            if raised.levels_mm.is_none() {
                (raised.levels_mm, raised.parts) = (Some([0.0; 2]), Parts::whole(mesh, &raised.surface));
            }
            return;
        }
        let levels = match &self.levels {
            Some((_, levels)) => Arc::clone(levels),
            None => Arc::clone(&self.levels.insert((scene.stamp.face, Arc::new(Levels::new(mesh)))).1),
        };
        let shortest = if in_motion { SHORTEST_IN_MOTION } else { SHORTEST };
        let [fine, flat]: [&Level; 2] = shortest.map(|least| levels.at(points_per_mm, least));
        let from = Some([fine.spacing_mm, flat.spacing_mm]);
        if raised.levels_mm != from {
            let values = &raised.layer.as_ref().unwrap_or(&self.layer).values;
            raised.parts = Parts::reduced(mesh, &raised.surface, values, fine, flat);
            raised.levels_mm = from;
        }
    }

    /// How often the map has been painted since the outcome or what is shown of it changed.
    pub(super) fn paintings(&self) -> u64 {
        self.drawn.as_ref().map_or(0, |d| d.times)
    }

    /// The drawing of the last frame.
    pub(super) fn take_drawn(&mut self) -> Option<Drawn> {
        self.drawn.take()
    }

    /// Keeps the surface and its drawing for the next frame.
    pub(super) fn keep(&mut self, raised: Raised, drawn: Drawn) {
        (self.raised, self.drawn) = (Some(raised), Some(drawn));
    }
}

impl Raised {
    /// What a view must hold, with heights up to `most_mm`; what was found before if it still holds.
    pub(super) fn sight(&mut self, layer: &Layer, known_only: bool, most_mm: f64) -> Sight {
        let from = (known_only, most_mm.to_bits());
        if let Some(sight) = self.sight.as_ref().filter(|s| s.from == from) {
            return sight.clone();
        }
        let values = &self.layer.as_ref().unwrap_or(layer).values;
        let known: Vec<usize> = (0..values.len()).filter(|&v| values[v].is_some()).collect();
        let shown = if known_only && known.len() > 2 { known } else { (0..values.len()).collect() };
        let base = &self.surface.base;
        let ground = Ground::under(shown.iter().map(|&v| &base[v]), self.surface.relief == Relief::Plane);
        let outline = outermost(self.surface.extent(shown.iter().copied(), most_mm)).into();
        self.sight.insert(Sight { from, ground, outline }).clone()
    }
}

impl Drawn {
    /// The vertices of a surface on the screen: those of the drawing before if they still hold, or anew.
    pub(super) fn project(before: Option<&Self>, raised: &Raised, projection: &Projection) -> Arc<Projected> {
        match before {
            Some(d) if d.from.surface == raised.from && d.from.projection == *projection => Arc::clone(&d.projected),
            _ => Arc::new(Projected::new(&raised.surface, projection)),
        }
    }

    /// The drawing before if it still holds, or a new one.
    pub(super) fn draw(
        before: Option<Self>,
        from: DrawnFrom,
        projected: Arc<Projected>,
        ctx: &egui::Context,
        draw: impl FnOnce(&Projected) -> Mesh,
    ) -> Self {
        let (before, times) = match before {
            Some(drawn) if drawn.from == from => return drawn,
            Some(drawn) => (Some(drawn.painted), drawn.times),
            None => (None, 0),
        };
        let mesh = draw(&projected);
        let painted = match from.picture {
            None => Painted::Triangles(Arc::new(mesh)),
            Some(place) => {
                let own_size = from.pixels_per_point == place.pixels_per_point;
                match mesh_picture::paint_cropped(&mesh, &from.palette.texels(), place) {
                    // No card takes a texture without pixels.
                    (picture, _) if picture.pixels.is_empty() => Painted::Triangles(Arc::default()),
                    (picture, place) => Painted::Picture(uploaded(before, picture, own_size, ctx), place.rect()),
                }
            }
        };
        Self { from, projected, painted, times: times + 1 }
    }

    /// Shows it.
    pub(super) fn show(&self, painter: &Painter) {
        match &self.painted {
            Painted::Triangles(mesh) => _ = painter.add(egui::Shape::Mesh(Arc::clone(mesh))),
            Painted::Picture(texture, rect) => {
                let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                painter.image(texture.id(), *rect, whole, Color32::WHITE);
            }
        }
    }
}

/// The picture on its way to the screen, in the place of the one before; pixels of the screen's own size are shown as they are.
fn uploaded(before: Option<Painted>, picture: ColorImage, own_size: bool, ctx: &egui::Context) -> TextureHandle {
    let options = if own_size { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
    match before {
        Some(Painted::Picture(mut texture, _)) => {
            texture.set(picture, options);
            texture
        }
        _ => ctx.load_texture("height map", picture, options),
    }
}

/// The points that lie farthest in one of many directions; all of them where they are few.
fn outermost(points: impl Iterator<Item = Point3<f64>>) -> Vec<Point3<f64>> {
    const FEW: usize = 8000;
    /// Points along each direction of a sphere walked round in a spiral.
    const DIRECTIONS: usize = 64;
    let all: Vec<Point3<f64>> = points.collect();
    if all.len() <= FEW {
        return all;
    }
    // The golden angle spreads directions evenly.
    let direction = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / DIRECTIONS as f64;
        let (sin, cos) = (k as f64 * 2.399_963_229_728_653).sin_cos();
        nalgebra::Vector3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
    };
    let mut farthest = vec![(f64::NEG_INFINITY, Point3::origin()); DIRECTIONS];
    let directions: Vec<_> = (0..DIRECTIONS).map(direction).collect();
    // Every point is asked: of heads and feet that alternate a step over some would leave out all heads.
    for p in &all {
        for (best, d) in farthest.iter_mut().zip(&directions) {
            let along = d.dot(&p.coords);
            if along > best.0 {
                *best = (along, *p);
            }
        }
    }
    farthest.into_iter().map(|(_, p)| p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of feet 1 mm apart, each followed by its head; one head stands 50 mm high, the others lie on their feet.
    #[test]
    fn the_one_highest_point_of_very_many_is_held_in_view() {
        for count in [3000, 12_000, 30_000] {
            let foot = |k: u32| Point3::new(f64::from(k % 100), f64::from(k / 100), 0.0);
            let head = |k: u32| foot(k) + nalgebra::Vector3::new(0.0, 0.0, if k == count / 3 { 50.0 } else { 0.0 });
            let held = outermost((0..count).flat_map(|k| [foot(k), head(k)]));
            assert!(held.iter().any(|p| p.z == 50.0), "of {count}");
        }
    }
}
