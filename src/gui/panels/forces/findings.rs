//! What there is to say of a field in numbers, found once for each outcome: on a large face every one is a walk over all vertices.

use crate::displacement::VertexState;
use crate::gui::Scene;
use crate::pipeline::Peak;

/// The numbers.
#[derive(Clone, Debug)]
pub(super) struct Findings {
    /// The largest force of those that stand above their error.
    pub(super) peak: Peak,
    /// The vertex to look at first.
    pub(super) look_at: Option<usize>,
    /// The largest force of all, and where it stands.
    pub(super) largest: Option<(usize, f64)>,
    /// The largest of all is larger than the peak, but is not to be believed.
    pub(super) larger: Option<(usize, f64)>,
    /// How many vertices are in each state that there is.
    pub(super) counts: Vec<(usize, VertexState)>,
    /// How many carry the border's reaction.
    pub(super) on_border: usize,
    /// Mean length of an edge of the face, mm.
    pub(super) mean_edge_mm: f64,
}

impl Findings {
    /// Walks over all vertices and edges.
    pub(super) fn of(scene: Scene<'_>) -> Self {
        let outcome = scene.outcome;
        let (peak, largest) = (outcome.peak(), outcome.field.largest(&outcome.states));
        let larger = largest.filter(|(v, f)| {
            let speaks = outcome.speaks().get(*v) == Some(&true) && outcome.stands_above_error(*v);
            peak.force().is_some_and(|peak| *f > peak) && !speaks
        });
        let count = |state: VertexState| (outcome.states.iter().filter(|s| **s == state).count(), state);
        let states = [VertexState::Measured, VertexState::Inferred, VertexState::Fixed, VertexState::Unmeasured];
        Self {
            peak,
            look_at: outcome.vertex_to_look_at(),
            largest,
            larger,
            counts: states.into_iter().map(count).filter(|(n, _)| *n > 0).collect(),
            on_border: outcome.border.iter().filter(|b| **b).count(),
            mean_edge_mm: scene.face.mesh().mean_edge_length(),
        }
    }

    /// Whether a vertex is in that state.
    pub(super) fn has(&self, state: VertexState) -> bool {
        self.counts.iter().any(|(_, s)| *s == state)
    }
}
