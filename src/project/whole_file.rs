//! A file that appears whole or not at all: written beside its place under another name, then moved there.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What the names of files in the making begin and end with.
const PREFIX: &str = ".frontalis-";
const SUFFIX: &str = ".part";

/// A file in the making is done long before this, s.
pub const STALE: Duration = Duration::from_hours(1);

/// Whether the bytes must have reached the disk before the call returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durability {
    /// Survives a power cut: waits for the disk.
    Disk,
    /// Survives the end of this program; does not wait.
    Process,
}

/// Writes `bytes` to `path`: a reader sees what was there before or all of this, whatever moment the program dies at.
///
/// A link is followed, so that the file it names is replaced and not the link; permissions of a file that was there are kept.
pub fn write(path: &Path, bytes: &[u8], durability: Durability) -> io::Result<()> {
    let path = followed(path);
    let folder = folder_of(&path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any program creates a file; the user's mask takes away what it must.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut part = builder.tempfile_in(&folder)?;
    part.write_all(bytes)?;
    if let Ok(former) = fs::metadata(&path) {
        if former.permissions().readonly() {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is write-protected"));
        }
        part.as_file().set_permissions(former.permissions())?;
    }
    if durability == Durability::Disk {
        part.as_file().sync_all()?;
    }
    part.persist(&path).map_err(|e| e.error)?;
    if durability == Durability::Disk {
        sync_folder(&folder);
    }
    Ok(())
}

/// Removes what programs that were killed while they wrote have left in a folder, if it is older than this.
pub fn sweep(folder: &Path, older_than: Duration) {
    for entry in fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok) {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_part = name.starts_with(PREFIX) && name.ends_with(SUFFIX);
        let old =
            || entry.metadata().and_then(|m| m.modified()).is_ok_and(|at| at.elapsed().is_ok_and(|a| a >= older_than));
        if is_part && entry.file_type().is_ok_and(|t| t.is_file()) && old() {
            // One that cannot be removed harms nobody.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The folder that holds a path: `.` where it names none.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// `path` with `.ending` added to the whole name: `a.json` becomes `a.json.bak`.
pub fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    PathBuf::from(name)
}

fn followed(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(found) if found.file_type().is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()),
        _ => path.to_owned(),
    }
}

/// A renamed file is on the disk for certain only when its folder is. Not every system can say so, and none loses data by it.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = File::open(folder) {
        let _ = handle.sync_all();
    }
}

/// Gives a finished folder the permissions that any other would have: a working folder is the user's alone.
pub fn open_to_others(folder: &Path) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What the user's mask leaves is seen on a folder made without more ado.
        let probe = folder.join(".mask");
        fs::create_dir(&probe)?;
        let mode = fs::metadata(&probe)?.permissions().mode();
        fs::remove_dir(&probe)?;
        fs::set_permissions(folder, fs::Permissions::from_mode(mode & 0o777))?;
    }
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write(&path, b"one", Durability::Disk).unwrap();
        write(&path, b"two", Durability::Process).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_cannot_be_written_changes_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file.txt");
        fs::write(&file, b"kept").unwrap();
        assert!(write(&file.join("inside.txt"), b"new", Durability::Disk).is_err());
        assert_eq!(fs::read(&file).unwrap(), b"kept");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_goes_on_naming_its_file_and_a_protected_file_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        let (real, link) = (dir.path().join("real.txt"), dir.path().join("link.txt"));
        fs::write(&real, b"one").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write(&link, b"two", Durability::Disk).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().file_type().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"two");
        let mut protected = fs::metadata(&real).unwrap().permissions();
        protected.set_readonly(true);
        fs::set_permissions(&real, protected).unwrap();
        assert!(write(&real, b"three", Durability::Disk).is_err());
        assert_eq!(fs::read(&real).unwrap(), b"two");
    }

    #[test]
    fn an_ending_is_added_to_the_whole_name() {
        assert_eq!(with_ending(Path::new("d/a.frontalis.json"), "bak"), Path::new("d/a.frontalis.json.bak"));
        assert_eq!(folder_of(Path::new("a.json")), Path::new("."));
    }
}
