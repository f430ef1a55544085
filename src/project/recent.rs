//! The projects that were opened last, newest first: a short list kept beside the journals of unsaved work.

use std::fs;
use std::path::{Path, PathBuf};

use super::whole_file::{self, Durability};

/// Name of the list in the folder of the program's state.
const NAME: &str = "recent.json";

/// So many projects are remembered.
pub const MOST: usize = 10;

/// The list. Without a folder it is remembered while the window is open, and no longer.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    file: Option<PathBuf>,
    paths: Vec<PathBuf>,
}

impl Recent {
    /// Reads the list in that folder; one that is missing or damaged is empty, for nothing depends on it.
    pub fn read(folder: Option<&Path>) -> Self {
        let file = folder.map(|f| f.join(NAME));
        let paths = file.as_deref().map(listed).unwrap_or_default();
        Self { file, paths }
    }

    /// The projects, newest first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts a project at the head of the list and keeps the list. Other windows may have added to it meanwhile.
    pub fn add(&mut self, project: &Path) {
        let project = std::path::absolute(project).unwrap_or_else(|_| project.to_owned());
        if let Some(file) = &self.file {
            self.paths = listed(file);
        }
        self.paths.retain(|p| *p != project);
        self.paths.insert(0, project);
        self.paths.truncate(MOST);
        self.keep();
    }

    /// Forgets every project.
    pub fn clear(&mut self) {
        self.paths.clear();
        self.keep();
    }

    fn keep(&self) {
        let Some(file) = &self.file else { return };
        let names: Vec<&str> = self.paths.iter().filter_map(|p| p.to_str()).collect();
        if let Ok(text) = serde_json::to_string_pretty(&names) {
            // A list that cannot be kept is a comfort lost, and no work.
            let _ = fs::create_dir_all(whole_file::folder_of(file));
            let _ = whole_file::write(file, text.as_bytes(), Durability::Process);
        }
    }
}

fn listed(file: &Path) -> Vec<PathBuf> {
    let names: Vec<PathBuf> =
        fs::read(file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
    names.into_iter().take(MOST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_comes_first_once_and_is_there_at_the_next_start() {
        let dir = tempfile::tempdir().unwrap();
        let project = |n: usize| dir.path().join(format!("{n}.frontalis.json"));
        let mut recent = Recent::read(Some(dir.path()));
        assert!(recent.paths().is_empty());
        for n in 0..12 {
            recent.add(&project(n));
        }
        // Another window.
        Recent::read(Some(dir.path())).add(&project(99));
        recent.add(&project(7));
        let again = Recent::read(Some(dir.path()));
        assert_eq!(again.paths().len(), MOST);
        assert_eq!(again.paths()[..3], [project(7), project(99), project(11)]);
        fs::write(dir.path().join(NAME), "{").unwrap();
        assert!(Recent::read(Some(dir.path())).paths().is_empty());
        assert!(Recent::read(None).paths().is_empty());
    }
}
