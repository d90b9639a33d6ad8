//! File identity: whether two names mean one file, through symbolic and hard links.
//!
//! Not here: files that are compared by their contents.

use std::fs;
use std::path::{Path, PathBuf};

/// More links than this lead in a circle.
const LINKS_MAX: usize = 40;

/// Whether two names mean one regular file, or would if it were there: by their spelling once
/// symbolic links are followed, and by what the file system says (hard links). Devices and pipes
/// can be written twice and are never the same.
pub fn same_file(one: &Path, other: &Path) -> bool {
    if is_special(one) || is_special(other) {
        return false;
    }
    spelled(one) == spelled(other) || same_inode(one, other)
}

/// Where a name leads: behind all symbolic links, also where the last one points to nothing yet.
pub(super) fn link_target(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..LINKS_MAX {
        let Ok(to) = fs::read_link(&target) else {
            break;
        };
        target = match target.parent() {
            Some(folder) => folder.join(to),
            None => to,
        };
    }
    target
}

/// One spelling of a name, whether or not there is a file.
fn spelled(path: &Path) -> PathBuf {
    let target = link_target(path);
    let folder = target.parent().filter(|f| !f.as_os_str().is_empty());
    let folder = fs::canonicalize(folder.unwrap_or(Path::new(".")));
    match (folder, target.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => fs::canonicalize(&target).unwrap_or(target),
    }
}

/// Whether there is something that is neither a file nor a folder.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

#[cfg(unix)]
fn same_inode(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let inode = |path: &Path| fs::metadata(path).ok().map(|m| (m.dev(), m.ino()));
    inode(one).is_some_and(|found| inode(other) == Some(found))
}

#[cfg(not(unix))]
fn same_inode(one: &Path, other: &Path) -> bool {
    let whole = |path: &Path| fs::canonicalize(path).ok();
    whole(one).is_some_and(|found| whole(other) == Some(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_by_several_names() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("folder")).unwrap();
        fs::write(at("a.csv"), "").unwrap();
        fs::write(at("b.csv"), "").unwrap();
        assert!(same_file(&at("a.csv"), &at("folder/../a.csv")));
        assert!(same_file(&at("new.csv"), &at("./folder/../new.csv")));
        assert!(!same_file(&at("a.csv"), &at("b.csv")));
        assert!(!same_file(&at("new.csv"), &at("folder/new.csv")));
        assert!(!same_file(Path::new("/dev/null"), Path::new("/dev/null")));
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_to_one_file() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::write(at("a.csv"), "").unwrap();
        symlink("a.csv", at("soft.csv")).unwrap();
        symlink("soft.csv", at("softer.csv")).unwrap();
        symlink("nowhere.csv", at("hanging.csv")).unwrap();
        symlink("circle.csv", at("circle.csv")).unwrap();
        fs::hard_link(at("a.csv"), at("hard.csv")).unwrap();
        assert!(same_file(&at("a.csv"), &at("softer.csv")));
        assert!(same_file(&at("hard.csv"), &at("softer.csv")));
        assert!(same_file(&at("hanging.csv"), &at("nowhere.csv")));
        assert!(!same_file(&at("circle.csv"), &at("a.csv")));
    }
}
