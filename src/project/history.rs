//! Unlimited, named undo and redo: snapshots of the project, one a gesture.

use super::document::Project;
use super::edit::{Edit, EditError};

/// A project with its past and its future.
#[derive(Clone, Debug, Default)]
pub struct History {
    present: Project,
    past: Vec<Step>,
    future: Vec<Step>,
    gesture: Option<Gesture>,
    revision: u64,
}

/// A named way from one state to the next; `project` is the state on the far side of it.
#[derive(Clone, Debug)]
struct Step {
    name: String,
    project: Project,
}

#[derive(Clone, Debug)]
struct Gesture {
    before: Project,
    name: Option<String>,
}

impl History {
    /// A history that begins with this project.
    pub fn new(project: Project) -> Self {
        Self { present: project, ..Self::default() }
    }

    /// The project as it is now.
    pub fn project(&self) -> &Project {
        &self.present
    }

    /// Grows with every change, so that a viewer can tell whether anything is new.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Applies an edit: an entry of its own, or part of the open gesture.
    ///
    /// # Errors
    /// Those of [`Edit::apply`]; nothing has changed then.
    pub fn apply(&mut self, edit: &Edit) -> Result<(), EditError> {
        let name = edit.name(self.gesture.as_ref().map_or(&self.present, |g| &g.before));
        let mut next = self.present.clone();
        edit.apply(&mut next)?;
        if next == self.present {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.present, next);
        self.revision += 1;
        match &mut self.gesture {
            Some(gesture) => gesture.name = Some(name),
            None => self.push(name, before),
        }
        Ok(())
    }

    /// Opens a gesture (a drag begins): what follows becomes one entry. An open one is committed first.
    pub fn begin_gesture(&mut self) {
        self.commit_gesture();
        self.gesture = Some(Gesture { before: self.present.clone(), name: None });
    }

    /// Closes the gesture (the button is released).
    pub fn commit_gesture(&mut self) {
        if let Some(Gesture { before, name: Some(name) }) = self.gesture.take()
            && before != self.present
        {
            self.push(name, before);
        }
    }

    /// Drops the gesture (Esc): the project is as it was when it began.
    pub fn cancel_gesture(&mut self) {
        if let Some(gesture) = self.gesture.take()
            && gesture.before != self.present
        {
            self.present = gesture.before;
            self.revision += 1;
        }
    }

    /// Makes an edit to every state, past and to come, that is no step of its own: paths after a save, which no hand chose.
    pub fn relocate(&mut self, edits_of: impl Fn(&Project) -> Vec<Edit>) {
        let steps = self.past.iter_mut().chain(&mut self.future).map(|step| &mut step.project);
        for project in steps.chain([&mut self.present]) {
            for edit in edits_of(project) {
                // A path is text like any other: such an edit is never refused.
                let _ = edit.apply(project);
            }
        }
        self.revision += 1;
    }

    /// Whether a gesture is open.
    pub fn in_gesture(&self) -> bool {
        self.gesture.is_some()
    }

    /// Goes back one step; false at the beginning.
    pub fn undo(&mut self) -> bool {
        self.commit_gesture();
        let Some(step) = self.past.pop() else { return false };
        let undone = std::mem::replace(&mut self.present, step.project);
        self.future.push(Step { name: step.name, project: undone });
        self.revision += 1;
        true
    }

    /// Goes forward one step; false at the end.
    pub fn redo(&mut self) -> bool {
        self.commit_gesture();
        let Some(step) = self.future.pop() else { return false };
        let before = std::mem::replace(&mut self.present, step.project);
        self.past.push(Step { name: step.name, project: before });
        self.revision += 1;
        true
    }

    /// Names of the steps done, oldest first.
    pub fn done(&self) -> impl ExactSizeIterator<Item = &str> {
        self.past.iter().map(|s| s.name.as_str())
    }

    /// Names of the steps undone, the next to redo first.
    pub fn undone(&self) -> impl ExactSizeIterator<Item = &str> {
        self.future.iter().rev().map(|s| s.name.as_str())
    }

    /// Goes to the state after the first `steps` steps of `done` followed by `undone`.
    pub fn go_to(&mut self, steps: usize) {
        while self.past.len() > steps && self.undo() {}
        while self.past.len() < steps && self.redo() {}
    }

    fn push(&mut self, name: String, before: Project) {
        self.past.push(Step { name, project: before });
        self.future.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::edit::PointId;
    use proptest::prelude::*;

    fn put(v: u32, x: f64) -> Edit {
        Edit::Put(PointId::FeatureLast(v), [x, 0.0])
    }

    #[test]
    fn a_drag_is_one_entry_and_escape_takes_it_back() {
        let mut h = History::default();
        h.apply(&put(1, 0.0)).unwrap();
        h.begin_gesture();
        for x in 1..50 {
            h.apply(&put(1, f64::from(x))).unwrap();
        }
        h.commit_gesture();
        assert_eq!(h.done().collect::<Vec<_>>(), ["Mark point 1", "Move point 1"]);
        let kept = h.project().clone();
        h.begin_gesture();
        h.apply(&put(1, 99.0)).unwrap();
        h.cancel_gesture();
        assert_eq!(h.project(), &kept);
        assert_eq!(h.done().len(), 2);
    }

    #[test]
    fn an_edit_that_changes_nothing_is_no_entry() {
        let mut h = History::default();
        h.apply(&Edit::Clear(PointId::FeatureLast(5))).unwrap();
        assert_eq!((h.done().len(), h.revision()), (0, 0));
    }

    proptest! {
        /// Any walk back and forth along the history comes back to the same states, bit for bit.
        #[test]
        fn undo_and_redo_return_every_state(edits in prop::collection::vec((0_u32..6, -1e3..1e3), 1..40), back in 0_usize..40) {
            let mut h = History::default();
            let mut states = vec![h.project().clone()];
            for (v, x) in edits {
                h.apply(&put(v, x)).unwrap();
                if h.project() != &states[states.len() - 1] {
                    states.push(h.project().clone());
                }
            }
            let last = states.len() - 1;
            let target = back.min(last);
            for expected in states[target..last].iter().rev() {
                prop_assert!(h.undo());
                prop_assert_eq!(h.project(), expected);
            }
            for expected in &states[target + 1..] {
                prop_assert!(h.redo());
                prop_assert_eq!(h.project(), expected);
            }
            prop_assert!(!h.redo());
            h.go_to(0);
            prop_assert_eq!(h.project(), &states[0]);
            h.go_to(last);
            prop_assert_eq!(h.project(), &states[last]);
        }
    }

    #[test]
    fn a_relocation_reaches_every_state_and_is_no_step() {
        let mut history = History::new(Project::default());
        history.apply(&Edit::Rename("a".into())).unwrap();
        history.apply(&Edit::Rename("b".into())).unwrap();
        assert!(history.undo());
        let steps = (history.done().len(), history.undone().len());
        history.relocate(|p| vec![Edit::Rename(format!("{}!", p.name))]);
        assert_eq!((history.done().len(), history.undone().len()), steps);
        assert_eq!(history.project().name, "a!");
        assert!(history.redo());
        assert_eq!(history.project().name, "b!");
        assert!(history.undo() && history.undo());
        assert_eq!(history.project().name, "!");
    }
}
