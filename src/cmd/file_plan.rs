//! Files of a command line: what it reads and what it writes, judged before anything is read or
//! run.
//!
//! Every command that writes files named by its caller has one plan of them. An output is no input
//! and no other output, whatever names lead to it; its name ends as its contents ask; its folder is
//! there.
//!
//! Not here: how files are written (`whippen_runtime::files`).

use std::path::{Path, PathBuf};

use whippen_runtime::files::same_file;

use crate::exit::{Failure, Outcome};

/// The files of a command line.
#[derive(Debug, Default)]
pub struct FilePlan {
    inputs: Vec<PathBuf>,
    outputs: Vec<Written>,
}

/// A file that is to be written.
#[derive(Debug)]
struct Written {
    /// The option that names it.
    option: &'static str,
    path: PathBuf,
    /// How its name may end, without the dot; any way where there is none.
    endings: &'static [&'static str],
}

impl FilePlan {
    /// A command that reads these, and more.
    pub fn reads<'p>(mut self, paths: impl IntoIterator<Item = &'p PathBuf>) -> FilePlan {
        self.inputs.extend(paths.into_iter().cloned());
        self
    }

    /// And writes these, as an option says; their names have one of these endings, or any.
    pub fn writes<'p>(
        mut self,
        option: &'static str,
        paths: impl IntoIterator<Item = &'p PathBuf>,
        endings: &'static [&'static str],
    ) -> FilePlan {
        let output = |path: &PathBuf| Written {
            option,
            path: path.clone(),
            endings,
        };
        self.outputs.extend(paths.into_iter().map(output));
        self
    }

    /// Judges it.
    ///
    /// # Errors
    /// In words: an ending, a folder that is not there, a file that would be lost.
    pub fn check(&self) -> Outcome {
        for (number, output) in self.outputs.iter().enumerate() {
            output.has_its_ending()?;
            output.has_its_folder()?;
            let clashes = |path: &Path| same_file(path, &output.path);
            if let Some(input) = self.inputs.iter().find(|input| clashes(input)) {
                return Err(output.would_overwrite(input));
            }
            let earlier = &self.outputs[..number];
            if let Some(other) = earlier.iter().find(|other| clashes(&other.path)) {
                return Err(output.is_also(other));
            }
        }
        Ok(())
    }
}

impl Written {
    fn has_its_ending(&self) -> Outcome {
        let ending = self.path.extension().and_then(|e| e.to_str());
        let known = |known: &&str| ending.is_some_and(|e| e.eq_ignore_ascii_case(known));
        if self.endings.is_empty() || self.endings.iter().any(known) {
            return Ok(());
        }
        let all: Vec<String> = self.endings.iter().map(|e| format!("`.{e}`")).collect();
        Err(Failure::Usage(format!(
            "{} writes a file whose name ends in {}, not `{}`",
            self.option,
            all.join(" or "),
            self.path.display()
        )))
    }

    fn has_its_folder(&self) -> Outcome {
        match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
                Err(Failure::Usage(format!(
                    "there is no folder `{}` to write to; make it first",
                    folder.display()
                )))
            }
            _ => Ok(()),
        }
    }

    fn would_overwrite(&self, input: &Path) -> Failure {
        let other_name = if *input == self.path {
            String::new()
        } else {
            format!(" (as `{}`)", input.display())
        };
        Failure::Usage(format!(
            "{} would overwrite `{}`, which this command reads{other_name}; give it another name",
            self.option,
            self.path.display()
        ))
    }

    fn is_also(&self, other: &Written) -> Failure {
        let which = if self.option == other.option {
            format!("two files of {}", self.option)
        } else {
            format!("{} and {}", other.option, self.option)
        };
        Failure::Usage(format!(
            "{which} would both be written to `{}`; give each a name of its own",
            self.path.display()
        ))
    }
}
