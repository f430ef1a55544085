//! The studies that there are: what each measures, its cases, and how its table is read.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::ladder::{self, Goals, Subject};
use super::runner::Plan;
use super::table::Run;
use super::{accuracy, scaling, stability};
use crate::face::FaceModel;

/// A study.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kind {
    /// How near every method comes to the truth, and how long it takes.
    #[default]
    Accuracy,
    /// Where each method stops being stable.
    Stability,
    /// How the work grows with the mesh and over the cores.
    Scaling,
    /// How much model a face needs, and which is chosen for an accuracy or a time.
    Ladder,
}

/// How much of a study is run, and on which face.
#[derive(Clone, Debug)]
pub struct Options {
    /// Coarser, with fewer seeds: for a first look.
    pub quick: bool,
    /// Seeds; the study's own number where absent.
    pub seeds: Option<u64>,
    /// The face that it is measured on.
    pub face: Arc<FaceModel>,
    /// The project that it is of, where it is of one: its marks, camera and stated marking error.
    pub subject: Option<Arc<Subject>>,
}

impl Options {
    /// The whole study on a face.
    pub fn on(face: Arc<FaceModel>) -> Self {
        Self { quick: false, seeds: None, face, subject: None }
    }

    /// Seeds, given the number of the whole and of the quick study.
    pub fn seeds(&self, whole: u64, quick: u64) -> u64 {
        self.seeds.unwrap_or(if self.quick { quick } else { whole }).clamp(1, 10_000)
    }

    /// What decides the rows, in words: for the heading of a journal.
    pub fn words(&self, seeds: u64) -> String {
        let mut hash = Sha256::new();
        for p in self.face.mesh().positions() {
            p.iter().for_each(|c| hash.update(c.to_le_bytes()));
        }
        let digest = hash.finalize();
        let size = if self.quick { "quick" } else { "whole" };
        let many = if seeds == 1 { "seed" } else { "seeds" };
        format!(
            "{size}, {seeds} {many}, face {} ({:02x}{:02x}{:02x})",
            self.face.name(),
            digest[0],
            digest[1],
            digest[2]
        )
    }
}

impl Kind {
    /// All.
    pub const ALL: [Self; 4] = [Self::Accuracy, Self::Stability, Self::Scaling, Self::Ladder];

    /// Its name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Accuracy => "accuracy",
            Self::Stability => "stability",
            Self::Scaling => "scaling",
            Self::Ladder => "ladder",
        }
    }

    /// Its name for people.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Accuracy => "Accuracy",
            Self::Stability => "Stability",
            Self::Scaling => "Scaling",
            Self::Ladder => "Ladder",
        }
    }

    /// The journal of a study in a folder, while it runs there or was stopped.
    pub fn journal_in(self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.journal", self.name()))
    }

    /// What it asks, in a sentence.
    pub const fn asks(self) -> &'static str {
        match self {
            Self::Accuracy => "How near does each method come, and how long does it take?",
            Self::Stability => "Where does each method fail, and what fails first?",
            Self::Scaling => "How does the work grow with the mesh, and over the cores?",
            Self::Ladder => "Which is the cheapest way that is accurate enough on this face?",
        }
    }

    /// The study of a table, by the name in its rows.
    pub fn of(runs: &[Run]) -> Option<Self> {
        let name = runs.first()?.study.as_str();
        Self::ALL.into_iter().find(|k| k.name() == name)
    }

    /// Its cases.
    pub fn plan(self, options: &Options) -> Plan {
        match self {
            Self::Accuracy => accuracy::plan(options),
            Self::Stability => stability::plan(options),
            Self::Scaling => scaling::plan(options),
            Self::Ladder => ladder::plan(options),
        }
    }

    /// The questions of its charts, in order, and the words above each.
    pub fn title(self, part: &str) -> String {
        match self {
            Self::Accuracy => accuracy::title(part).to_owned(),
            Self::Stability => stability::title(part).to_owned(),
            Self::Scaling => scaling::title(part).to_owned(),
            Self::Ladder => ladder::title(part).to_owned(),
        }
    }

    /// What its table says, in Markdown, from the rows alone; of a ladder, for these goals.
    pub fn reading(self, runs: &[Run], goals: Goals) -> String {
        match self {
            Self::Accuracy => accuracy::reading(runs),
            Self::Stability => stability::reading(runs),
            Self::Scaling => scaling::reading(runs),
            Self::Ladder => ladder::reading(runs, goals),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_cases_of_a_study_have_the_same_name() {
        let face = crate::face::generic();
        for kind in Kind::ALL {
            for quick in [true, false] {
                let plan = kind.plan(&Options { quick, ..Options::on(Arc::clone(&face)) });
                let names: BTreeSet<&str> = plan.cases.iter().map(|c| c.key.as_str()).collect();
                assert_eq!(names.len(), plan.cases.len(), "{}", kind.name());
                assert_eq!(plan.study, kind.name());
                assert!(plan.cases.len() > 10);
            }
        }
    }
}
