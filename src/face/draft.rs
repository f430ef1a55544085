//! A face model being made: a mesh whose landmarks and muscles are bound to vertices one after the other, with undo.

use std::sync::Arc;

use super::{FaceError, FaceModel, FaceParts, Landmark, Mesh, Muscle, MusclePreset, Region, Side};

/// A landmark, bound or not.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftLandmark {
    /// What it is; its `vertex` says nothing here.
    pub landmark: Landmark,
    /// The vertex that stands for it.
    pub vertex: Option<u32>,
}

/// A muscle, each end bound or not.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftMuscle {
    /// What it is; its `attachment` and `insertion` say nothing here.
    pub muscle: Muscle,
    /// Vertex at the bone.
    pub attachment: Option<u32>,
    /// Vertex in the skin.
    pub insertion: Option<u32>,
}

/// Something that can be bound to a vertex, by its place in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    /// A landmark.
    Landmark(usize),
    /// The bone end of a muscle.
    Attachment(usize),
    /// The skin end of a muscle.
    Insertion(usize),
}

/// Everything that an undo brings back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bindings {
    /// Name of the face, for people.
    pub name: String,
    /// The landmarks, in the order in which they are placed.
    pub landmarks: Vec<DraftLandmark>,
    /// The muscles.
    pub muscles: Vec<DraftMuscle>,
    /// Other choices of muscles; bound whole or not there.
    pub muscle_presets: Vec<MusclePreset>,
    /// Named sets of vertices.
    pub regions: Vec<Region>,
}

/// A change of a draft.
#[derive(Clone, Debug, PartialEq)]
pub enum DraftEdit {
    /// Names the face.
    Rename(String),
    /// Binds to a vertex, or to none.
    Bind {
        /// What.
        slot: Slot,
        /// The vertex.
        vertex: Option<u32>,
        /// Whether its partner goes to the vertex across the midline, where both exist.
        mirrored: bool,
    },
    /// Sets half the width of a muscle's band of fibres, mm.
    SetHalfWidth {
        /// The muscle.
        muscle: usize,
        /// More than 0.
        half_width_mm: f64,
        /// Whether its partner gets the same.
        mirrored: bool,
    },
    /// Takes all bindings and regions of another model of the same mesh, as a proposal to correct.
    Propose(Bindings),
}

/// A face model being made.
#[derive(Clone, Debug)]
pub struct FaceDraft {
    mesh: Arc<Mesh>,
    mirror: Arc<Vec<Option<u32>>>,
    now: Bindings,
    past: Vec<(String, Bindings)>,
    future: Vec<(String, Bindings)>,
    saved: Bindings,
    revision: u64,
}

impl Bindings {
    /// What a face model has.
    pub fn of(face: &FaceModel) -> Self {
        let landmark = |l: &Landmark| DraftLandmark { landmark: l.clone(), vertex: Some(l.vertex) };
        let muscle = |m: &Muscle| DraftMuscle {
            muscle: m.clone(),
            attachment: Some(m.attachment),
            insertion: Some(m.insertion),
        };
        Self {
            name: face.name().to_owned(),
            landmarks: face.landmarks().iter().map(landmark).collect(),
            muscles: face.muscles().iter().map(muscle).collect(),
            muscle_presets: face.muscle_presets().to_vec(),
            regions: face.regions().to_vec(),
        }
    }

    /// The same landmarks and muscles, none of them bound, without regions.
    #[must_use]
    pub fn unbound(mut self, name: &str) -> Self {
        name.clone_into(&mut self.name);
        self.landmarks.iter_mut().for_each(|l| l.vertex = None);
        self.muscles.iter_mut().for_each(|m| (m.attachment, m.insertion) = (None, None));
        self.muscle_presets.clear();
        self.regions.clear();
        self
    }

    /// The same in the order of `all`, with what these lack of it added unbound: a face read from a file can then be completed.
    #[must_use]
    pub fn completed_by(self, all: &Self) -> Self {
        let blank = all.clone().unbound("");
        let Self { name, landmarks: mut own_landmarks, muscles: mut own_muscles, muscle_presets, regions } = self;
        let mut landmarks = Vec::with_capacity(blank.landmarks.len());
        for l in blank.landmarks {
            let own = own_landmarks.iter().position(|own| own.landmark.id == l.landmark.id);
            landmarks.push(own.map_or(l, |i| own_landmarks.remove(i)));
        }
        let mut muscles = Vec::with_capacity(blank.muscles.len());
        for m in blank.muscles {
            let own = own_muscles.iter().position(|own| own.muscle.id == m.muscle.id);
            muscles.push(own.map_or(m, |i| own_muscles.remove(i)));
        }
        landmarks.extend(own_landmarks);
        muscles.extend(own_muscles);
        Self { name, landmarks, muscles, muscle_presets, regions }
    }

    /// The vertex that something is bound to.
    pub fn vertex(&self, slot: Slot) -> Option<u32> {
        match slot {
            Slot::Landmark(i) => self.landmarks.get(i)?.vertex,
            Slot::Attachment(i) => self.muscles.get(i)?.attachment,
            Slot::Insertion(i) => self.muscles.get(i)?.insertion,
        }
    }

    fn vertex_mut(&mut self, slot: Slot) -> Option<&mut Option<u32>> {
        match slot {
            Slot::Landmark(i) => self.landmarks.get_mut(i).map(|l| &mut l.vertex),
            Slot::Attachment(i) => self.muscles.get_mut(i).map(|m| &mut m.attachment),
            Slot::Insertion(i) => self.muscles.get_mut(i).map(|m| &mut m.insertion),
        }
    }

    /// "landmark nose_tip", "attachment of frontalis_medial_left".
    pub fn slot_name(&self, slot: Slot) -> String {
        let muscle = |i: usize| self.muscles.get(i).map_or("", |m| m.muscle.id.as_str());
        match slot {
            Slot::Landmark(i) => format!("landmark {}", self.landmarks.get(i).map_or("", |l| l.landmark.id.as_str())),
            Slot::Attachment(i) => format!("attachment of {}", muscle(i)),
            Slot::Insertion(i) => format!("insertion of {}", muscle(i)),
        }
    }

    /// What lies across the midline: the landmark that it names as its mirror, the muscle of the same name on the other side.
    pub fn partner(&self, slot: Slot) -> Option<Slot> {
        match slot {
            Slot::Landmark(i) => {
                let mirror = self.landmarks.get(i)?.landmark.mirror.as_ref()?;
                self.landmarks.iter().position(|l| &l.landmark.id == mirror).map(Slot::Landmark)
            }
            Slot::Attachment(i) => self.muscle_partner(i).map(Slot::Attachment),
            Slot::Insertion(i) => self.muscle_partner(i).map(Slot::Insertion),
        }
    }

    fn muscle_partner(&self, muscle: usize) -> Option<usize> {
        let own = &self.muscles.get(muscle)?.muscle;
        let (from, to) = if own.side == Side::Left { ("left", "right") } else { ("right", "left") };
        let id = own.id.strip_suffix(from).map(|base| format!("{base}{to}"))?;
        self.muscles.iter().position(|m| m.muscle.id == id && m.muscle.side != own.side)
    }

    /// How many landmarks, and how many muscles, are bound whole.
    pub fn bound(&self) -> [usize; 2] {
        let muscles = self.muscles.iter().filter(|m| m.attachment.is_some() && m.insertion.is_some());
        [self.landmarks.iter().filter(|l| l.vertex.is_some()).count(), muscles.count()]
    }
}

impl FaceDraft {
    /// Begins with a face model; `standard` are the landmarks and muscles that a whole one has.
    pub fn of(face: &FaceModel, standard: &Bindings) -> Self {
        let now = Bindings::of(face).completed_by(standard);
        Self {
            mesh: Arc::new(face.mesh().clone()),
            mirror: Arc::new(face.mirror().to_vec()),
            saved: now.clone(),
            now,
            past: Vec::new(),
            future: Vec::new(),
            revision: 0,
        }
    }

    /// Its mesh, mm.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// For each vertex the one across the midline, where there is one.
    pub fn mirror(&self) -> &[Option<u32>] {
        &self.mirror
    }

    /// What is bound now.
    pub fn bindings(&self) -> &Bindings {
        &self.now
    }

    /// Grows with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether it differs from what was last saved.
    pub fn unsaved(&self) -> bool {
        self.now != self.saved
    }

    /// Says that it has been saved as it is.
    pub fn mark_saved(&mut self) {
        self.saved = self.now.clone();
    }

    /// Makes a change: one step of the undo list. What makes no sense is refused with the reason.
    ///
    /// # Errors
    /// A vertex that the mesh does not have, a width that is none, a muscle whose ends would meet.
    pub fn apply(&mut self, edit: &DraftEdit) -> Result<(), String> {
        let mut next = self.now.clone();
        let name = match edit {
            DraftEdit::Rename(name) => {
                next.name.clone_from(name);
                "Rename face".to_owned()
            }
            DraftEdit::Bind { slot, vertex, mirrored } => {
                self.bind(&mut next, *slot, *vertex)?;
                if *mirrored && let Some(partner) = next.partner(*slot) {
                    match vertex {
                        // A vertex without a partner leaves the other side as it is.
                        Some(v) => {
                            if let Some(across) = self.mirror.get(*v as usize).copied().flatten() {
                                self.bind(&mut next, partner, Some(across))?;
                            }
                        }
                        None => self.bind(&mut next, partner, None)?,
                    }
                }
                format!("{} {}", if vertex.is_some() { "Bind" } else { "Unbind" }, next.slot_name(*slot))
            }
            DraftEdit::SetHalfWidth { muscle, half_width_mm, mirrored } => {
                if !(*half_width_mm > 0.0 && half_width_mm.is_finite()) {
                    return Err(format!("half a width must be greater than 0 mm, and it is {half_width_mm}"));
                }
                let partner = next.muscle_partner(*muscle).filter(|_| *mirrored);
                for m in [Some(*muscle), partner].into_iter().flatten() {
                    if let Some(m) = next.muscles.get_mut(m) {
                        m.muscle.half_width_mm = *half_width_mm;
                    }
                }
                "Set half width".to_owned()
            }
            DraftEdit::Propose(bindings) => {
                next = Bindings { name: next.name, ..bindings.clone() };
                "Transfer from the generic face".to_owned()
            }
        };
        if next != self.now {
            let before = std::mem::replace(&mut self.now, next);
            // One drag over a number is one step.
            let goes_on = matches!(edit, DraftEdit::SetHalfWidth { .. } | DraftEdit::Rename(_))
                && self.past.last().is_some_and(|(last, _)| *last == name);
            if !goes_on {
                self.past.push((name, before));
            }
            self.future.clear();
            self.revision += 1;
        }
        Ok(())
    }

    fn bind(&self, next: &mut Bindings, slot: Slot, vertex: Option<u32>) -> Result<(), String> {
        if let Some(v) = vertex.filter(|v| *v as usize >= self.mesh.len()) {
            return Err(format!("there is no vertex {v}; the mesh has {}", self.mesh.len()));
        }
        let other_end = match slot {
            Slot::Landmark(_) => None,
            Slot::Attachment(i) => next.vertex(Slot::Insertion(i)),
            Slot::Insertion(i) => next.vertex(Slot::Attachment(i)),
        };
        if vertex.is_some() && vertex == other_end {
            return Err("a muscle cannot begin and end at one vertex".to_owned());
        }
        if let Some(place) = next.vertex_mut(slot) {
            *place = vertex;
        }
        Ok(())
    }

    /// Takes what was proposed: `face` is this mesh, maybe moved to its place in face space, with other bindings. Undo takes the bindings
    /// back; where the mesh lies means nothing to them.
    ///
    /// # Errors
    /// A face of another mesh.
    pub fn take_proposal(&mut self, face: &FaceModel, standard: &Bindings) -> Result<(), String> {
        if face.mesh().triangles() != self.mesh.triangles() {
            return Err("the proposal was made for another mesh".to_owned());
        }
        (self.mesh, self.mirror) = (Arc::new(face.mesh().clone()), Arc::new(face.mirror().to_vec()));
        self.apply(&DraftEdit::Propose(Bindings::of(face).completed_by(standard)))
    }

    /// Takes back the last step; false at the beginning.
    pub fn undo(&mut self) -> bool {
        let Some((name, before)) = self.past.pop() else { return false };
        self.future.push((name, std::mem::replace(&mut self.now, before)));
        self.revision += 1;
        true
    }

    /// Does the step again; false at the end.
    pub fn redo(&mut self) -> bool {
        let Some((name, after)) = self.future.pop() else { return false };
        self.past.push((name, std::mem::replace(&mut self.now, after)));
        self.revision += 1;
        true
    }

    /// Names of the steps that undo and redo would take.
    pub fn steps(&self) -> [Option<&str>; 2] {
        [self.past.last().map(|(n, _)| n.as_str()), self.future.last().map(|(n, _)| n.as_str())]
    }

    /// The face model as far as it is bound: landmarks with a vertex, muscles with both ends.
    ///
    /// # Errors
    /// Those of [`FaceModel::new`].
    pub fn to_face(&self) -> Result<FaceModel, FaceError> {
        let bound: Vec<Landmark> = self
            .now
            .landmarks
            .iter()
            .filter_map(|l| Some(Landmark { vertex: l.vertex?, ..l.landmark.clone() }))
            .collect();
        let has = |id: &String| bound.iter().any(|l| &l.id == id);
        let landmarks =
            bound.iter().map(|l| Landmark { mirror: l.mirror.clone().filter(|id| has(id)), ..l.clone() }).collect();
        let muscle =
            |m: &DraftMuscle| Some(Muscle { attachment: m.attachment?, insertion: m.insertion?, ..m.muscle.clone() });
        let parts = FaceParts {
            name: self.now.name.clone(),
            landmarks,
            muscles: self.now.muscles.iter().filter_map(muscle).collect(),
            muscle_presets: self.now.muscle_presets.clone(),
            mirror: self.mirror.to_vec(),
            regions: self.now.regions.clone(),
        };
        FaceModel::new(Mesh::clone(&self.mesh), parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blank() -> FaceDraft {
        let generic = crate::face::generic();
        let parts = FaceParts { name: "Blank".into(), mirror: generic.mirror().to_vec(), ..FaceParts::default() };
        let face = FaceModel::new(generic.mesh().clone(), parts).unwrap();
        FaceDraft::of(&face, &Bindings::of(&generic))
    }

    fn landmark(draft: &FaceDraft, id: &str) -> Slot {
        Slot::Landmark(draft.bindings().landmarks.iter().position(|l| l.landmark.id == id).unwrap())
    }

    #[test]
    fn binding_one_side_by_side_makes_the_generic_face_again() {
        let generic = crate::face::generic();
        let mut draft = blank();
        assert_eq!(draft.bindings().bound(), [0, 0]);
        let bind = |draft: &mut FaceDraft, slot, vertex| {
            draft.apply(&DraftEdit::Bind { slot, vertex: Some(vertex), mirrored: true }).unwrap();
        };
        // The left side and the midline by hand; the right side follows.
        for l in generic.landmarks().iter().filter(|l| !l.id.ends_with("right")) {
            let slot = landmark(&draft, &l.id);
            bind(&mut draft, slot, l.vertex);
        }
        for (i, m) in generic.muscles().iter().enumerate().filter(|(_, m)| m.side == Side::Left) {
            bind(&mut draft, Slot::Attachment(i), m.attachment);
            bind(&mut draft, Slot::Insertion(i), m.insertion);
        }
        let made = draft.to_face().unwrap();
        assert_eq!(made.landmarks(), generic.landmarks());
        assert_eq!(made.muscles(), generic.muscles());
        assert!(draft.unsaved());
    }

    #[test]
    fn undo_goes_back_a_step_at_a_time_with_both_sides() {
        let mut draft = blank();
        let [left, right] = ["eye_inner_left", "eye_inner_right"].map(|id| landmark(&draft, id));
        let v = crate::face::generic().landmark("eye_inner_left").unwrap().vertex;
        draft.apply(&DraftEdit::Bind { slot: left, vertex: Some(v), mirrored: true }).unwrap();
        assert_eq!(draft.bindings().vertex(right), draft.mirror()[v as usize]);
        assert_eq!(draft.steps(), [Some("Bind landmark eye_inner_left"), None]);
        draft.apply(&DraftEdit::Bind { slot: left, vertex: Some(v + 1), mirrored: false }).unwrap();
        assert_eq!(draft.bindings().vertex(right), draft.mirror()[v as usize], "the switch is off");
        assert!(draft.undo() && draft.undo() && !draft.undo());
        assert_eq!([left, right].map(|s| draft.bindings().vertex(s)), [None; 2]);
        assert!(!draft.unsaved() && draft.redo());
        assert_eq!(draft.bindings().vertex(left), Some(v));
    }

    #[test]
    fn nonsense_is_refused_and_changes_nothing() {
        let mut draft = blank();
        let bind = |slot, v| DraftEdit::Bind { slot, vertex: Some(v), mirrored: false };
        assert!(draft.apply(&bind(Slot::Landmark(0), 612)).unwrap_err().contains("no vertex 612"));
        draft.apply(&bind(Slot::Attachment(3), 5)).unwrap();
        assert!(draft.apply(&bind(Slot::Insertion(3), 5)).unwrap_err().contains("at one vertex"));
        for half_width_mm in [0.0, -1.0, f64::NAN] {
            let width = DraftEdit::SetHalfWidth { muscle: 0, half_width_mm, mirrored: true };
            assert!(draft.apply(&width).is_err());
        }
        assert!(draft.steps()[0].unwrap().starts_with("Bind attachment of "));
        assert_eq!(draft.to_face().unwrap().muscles().len(), 0, "half a muscle is none yet");
    }
}
