//! What the workspace of the forces makes of an outcome, kept until the outcome or a choice changes: turning the map makes none of it anew.

use std::sync::Arc;

use nalgebra::Point3;

use crate::gui::face_drawing::levels::{Level, Levels};
use crate::gui::height_map::parts::{self, Parts};
use crate::gui::height_map::{Direction, Layer, MapOptions, Quantity, Relief, Surface};
use crate::gui::{Scene, Stamp};

/// The layer of an outcome, and where its vertices are.
#[derive(Debug)]
pub(super) struct Prepared {
    from: (Stamp, Quantity, Direction, Option<usize>),
    /// The values shown.
    pub(super) layer: Layer,
    /// The vertices from the eyes, mm.
    pub(super) first: Vec<Point3<f64>>,
    levels: Option<(u64, Arc<Levels>)>,
    raised: Option<Raised>,
}

/// The surface of a layer, and what of it is drawn.
#[derive(Debug)]
pub(super) struct Raised {
    from: (bool, u64, Relief),
    /// The layer without the border, if that is left out.
    pub(super) layer: Option<Layer>,
    /// The surface.
    pub(super) surface: Surface,
    /// Edges of the two levels that the parts were made of, mm.
    levels_mm: Option<[f64; 2]>,
    /// What of it is drawn.
    pub(super) parts: Parts,
}

/// Triangles with data are drawn from a level whose edges are at least so long on the screen, and flat ones, points.
const SHORTEST_RAISED: f64 = 2.5;
const SHORTEST_FLAT: f64 = 6.0;

impl Prepared {
    /// What was prepared before if it still holds, or anew.
    pub(super) fn of(scene: Scene<'_>, o: &MapOptions, before: Option<Self>) -> Self {
        let from = (scene.stamp, o.quantity, o.direction, o.muscle);
        let levels = match before {
            Some(before) if before.from == from => return before,
            Some(before) => before.levels.filter(|(face, _)| *face == scene.stamp.face),
            None => None,
        };
        Self {
            from,
            layer: Layer::new(scene.outcome, scene.face, o.quantity, o.direction, o.muscle),
            // The chain measures from the optical axis, people from the eyes.
            first: scene.outcome.first_from_eyes(scene.face),
            levels,
            raised: None,
        }
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
        Raised { from, layer, surface, levels_mm: None, parts: Parts::default() }
    }

    /// Chooses what is drawn at that size of a millimetre on the screen.
    pub(super) fn choose(&mut self, scene: Scene<'_>, raised: &mut Raised, points_per_mm: f64) {
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
        let [fine, flat]: [&Level; 2] = [SHORTEST_RAISED, SHORTEST_FLAT].map(|least| levels.at(points_per_mm, least));
        let from = Some([fine.spacing_mm, flat.spacing_mm]);
        if raised.levels_mm != from {
            let values = &raised.layer.as_ref().unwrap_or(&self.layer).values;
            raised.parts = Parts::reduced(mesh, &raised.surface, values, fine, flat);
            raised.levels_mm = from;
        }
    }

    /// Keeps the surface for the next frame.
    pub(super) fn keep(&mut self, raised: Raised) {
        self.raised = Some(raised);
    }
}
