//! Programs that tests may ask for: the table, and where they are on the search path.

use std::ffi::OsStr;
use std::path::PathBuf;

/// A line of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tool {
    /// Programs of which one is enough; the first gives the name.
    pub programs: Vec<&'static str>,
    /// Debian packages that bring it.
    pub packages: Vec<&'static str>,
}

/// What can be asked for, in the order of `tests/need/tools.txt`.
pub fn table() -> Vec<Tool> {
    include_str!("../tools.txt")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.trim().is_empty())
        .map(|line| {
            let mut words = line.split_whitespace();
            Tool {
                programs: words.next().unwrap_or_default().split('|').collect(),
                packages: words.collect(),
            }
        })
        .collect()
}

/// The tool of that name.
///
/// # Panics
///
/// Where the table has none: nobody would install it.
pub(crate) fn named(name: &str) -> Tool {
    table()
        .into_iter()
        .find(|tool| tool.name() == name)
        .unwrap_or_else(|| panic!("`{name}` is not in tests/need/tools.txt"))
}

impl Tool {
    /// What it is asked for by.
    pub fn name(&self) -> &'static str {
        self.programs.first().copied().unwrap_or_default()
    }

    /// What to install.
    pub fn advice(&self) -> String {
        format!("Debian: {}", self.packages.join(" "))
    }

    /// The first of its programs in a search path as `PATH` holds it.
    pub fn find(&self, search: &OsStr) -> Option<PathBuf> {
        self.programs.iter().find_map(|program| {
            std::env::split_paths(search)
                .map(|folder| folder.join(format!("{program}{}", std::env::consts::EXE_SUFFIX)))
                .find(|path| is_executable(path))
        })
    }
}

#[cfg(unix)]
fn is_executable(path: &std::path::Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata()
        .is_ok_and(|data| data.is_file() && data.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_executable(path: &std::path::Path) -> bool {
    path.is_file()
}
