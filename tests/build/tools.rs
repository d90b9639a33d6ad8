//! Programs that judge, and a folder for their files.

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// A folder of its own.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a folder"))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path().join(name), bytes).expect("written");
    }

    /// Runs a program in the folder, which must end well; what it printed, or none where it is
    /// absent and the test counts as skipped.
    pub fn run(&self, program: &str, args: &[&str]) -> Option<String> {
        let output = self.output(program, args)?;
        let (told, wrong) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{program} {args:?}: {told}{wrong}");
        Some(told + &wrong)
    }

    /// The same, however it ends.
    pub fn output(&self, program: &str, args: &[&str]) -> Option<Output> {
        let path = match program {
            // What was just made, or is under test.
            path if path.contains('/') => path.into(),
            _ => whippen_need::tool(program)?,
        };
        let output = Command::new(path)
            .args(args)
            .current_dir(self.path())
            .output();
        Some(output.unwrap_or_else(|e| panic!("{program}: {e}")))
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The command under test.
pub const WHIPPEN: &str = env!("CARGO_BIN_EXE_whippen");
