//! Paths in a project: relative to its file where possible, with `/` between folders on every system.

use std::path::{Component, Path, PathBuf};

use super::document::{FaceSource, FrameRef, Project};
use super::edit::{Edit, Which};
use super::sample;
use super::whole_file::folder_of;

/// Where a frame lies on disk. A relative path begins at the project file's folder.
pub fn resolve(project_path: &Path, frame: &FrameRef) -> PathBuf {
    resolve_text(project_path, &frame.path)
}

/// Where a path of a project file lies on disk.
pub fn resolve_text(project_path: &Path, text: &str) -> PathBuf {
    folder_of(project_path).join(text.split('/').collect::<Vec<_>>().join(std::path::MAIN_SEPARATOR_STR))
}

/// Whether two paths name one file, links followed where the file is there.
pub fn same_file(a: &Path, b: &Path) -> bool {
    absolute(a) == absolute(b)
}

/// A path cannot be written as text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: the name is not Unicode and cannot be written in a project; rename it", .path.display())]
pub struct NotUnicode {
    /// The path.
    pub path: PathBuf,
}

/// A path as a project file at `project_path` holds it: relative where both share a root, otherwise absolute.
///
/// A project that has no file yet (`None`) holds absolute paths.
pub fn to_text(project_path: Option<&Path>, path: &Path) -> Result<String, NotUnicode> {
    let path = absolute(path);
    let found = project_path.and_then(|p| relative(&absolute(&folder_of(p)), &path)).unwrap_or(path);
    let text = found.to_str().ok_or_else(|| NotUnicode { path: found.clone() })?;
    Ok(if cfg!(windows) { text.replace('\\', "/") } else { text.to_owned() })
}

/// The edits that make a project's paths right after its file goes from one place to another (saved for the first
/// time, or under another name). Paths that cannot be written stay as they are, and so do the bare names of the sample's
/// frames while they lie in the program alone: they are written beside the file.
pub fn rebase(project: &Project, from: Option<&Path>, to: &Path) -> Vec<Edit> {
    let here = Path::new("unnamed");
    let moved = |text: &str| to_text(Some(to), &resolve_text(from.unwrap_or(here), text)).ok().filter(|t| t != text);
    let mut edits = Vec::new();
    for (which, frame) in [(Which::First, &project.frames.first), (Which::Last, &project.frames.last)] {
        if let Some(frame) = frame
            && (from.is_some() || sample::frame_bytes(frame).is_none())
            && let Some(path) = moved(&frame.path)
        {
            edits.push(Edit::SetFrame(which, Some(FrameRef { path, ..frame.clone() })));
        }
    }
    if let FaceSource::File { path, sha256 } = &project.face
        && let Some(path) = moved(path)
    {
        // The face is the same, so every mark stays.
        let landmark_ids = project.landmarks.keys().cloned().collect();
        let source = FaceSource::File { path, sha256: sha256.clone() };
        edits.push(Edit::SetFace { source, landmark_ids, vertices: u32::MAX });
    }
    edits
}

/// The absolute path without `.` and `..`; links on the way are followed where the path exists.
fn absolute(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        // Windows spells real paths in a way that few programs read.
        let text = real.to_str().and_then(|t| t.strip_prefix(r"\\?\")).map(PathBuf::from);
        return text.unwrap_or(real);
    }
    // What does not exist yet lies in a folder that often does.
    match (path.parent().filter(|p| !p.as_os_str().is_empty()), path.file_name()) {
        (Some(folder), Some(name)) => absolute(folder).join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// `path` seen from `folder`, both absolute; nothing where they lie on different drives.
fn relative(folder: &Path, path: &Path) -> Option<PathBuf> {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), path.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let rooted = |c: &Component<'_>| matches!(c, Component::Prefix(_));
    if shared == 0 || from[shared..].iter().chain(&to[shared..]).any(rooted) {
        return None;
    }
    let up = from[shared..].iter().map(|_| Component::ParentDir);
    Some(up.chain(to[shared..].iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative_to_the_project_and_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        std::fs::create_dir_all(root.join("a/b")).unwrap();
        std::fs::create_dir_all(root.join("c")).unwrap();
        std::fs::write(root.join("c/x.png"), "").unwrap();
        let project = root.join("a/b/p.frontalis.json");
        let text = to_text(Some(&project), &root.join("c/x.png")).unwrap();
        assert_eq!(text, "../../c/x.png");
        let frame = FrameRef { path: text, sha256: String::new(), width_px: 1, height_px: 1 };
        assert_eq!(resolve(&project, &frame).canonicalize().unwrap(), root.join("c/x.png"));
        // Beside the project: the bare name. Without a project: absolute, and it stays so when resolved.
        assert_eq!(to_text(Some(&root.join("c/p.json")), &root.join("c/x.png")).unwrap(), "x.png");
        let absolute = to_text(None, &root.join("c/x.png")).unwrap();
        assert_eq!(resolve_text(&project, &absolute), root.join("c/x.png"));
        assert!(same_file(&root.join("c/x.png"), &root.join("a/../c/x.png")));
        assert!(!same_file(&root.join("c/x.png"), &root.join("c/y.png")));
    }

    #[test]
    fn saving_elsewhere_keeps_the_frames_and_the_marks() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        std::fs::create_dir(root.join("new")).unwrap();
        let frame = |path: &str| FrameRef { path: path.into(), sha256: "0".repeat(64), width_px: 1, height_px: 1 };
        let mut p = Project::default();
        p.frames.first = Some(frame("x.png"));
        p.face = FaceSource::File { path: "face.json".into(), sha256: "0".repeat(64) };
        p.features.insert(900, crate::project::Feature { role: crate::project::Role::Still, ..Default::default() });
        let edits = rebase(&p, Some(&root.join("p.json")), &root.join("new/p.json"));
        let mut moved = p.clone();
        for edit in &edits {
            edit.apply(&mut moved).unwrap();
        }
        assert_eq!(moved.frames.first, Some(frame("../x.png")));
        assert_eq!(moved.face, FaceSource::File { path: "../face.json".into(), sha256: "0".repeat(64) });
        assert_eq!(moved.features, p.features);
        assert!(rebase(&moved, Some(&root.join("new/p.json")), &root.join("new/q.json")).is_empty());
    }
}
