//! How far a long search has come: `WHIPPEN_RESUME=FILE` keeps it there, and goes on from there.

use std::path::PathBuf;

use whippen_runtime::files::write_whole;

/// Programs that are done, and ticks of a key in them.
#[derive(Debug, Default)]
pub struct Progress {
    file: Option<PathBuf>,
    pub programs: u64,
    pub ticks: u64,
}

impl Progress {
    /// From the file, where there is one.
    ///
    /// # Panics
    /// It holds something else.
    pub fn resume() -> Progress {
        let file = std::env::var_os("WHIPPEN_RESUME").map(PathBuf::from);
        let text = file.as_ref().filter(|file| file.exists());
        let text = text.map(|file| std::fs::read_to_string(file).expect("is read"));
        let [programs, ticks] = text.map_or([0; 2], |text| {
            let words: Vec<&str> = text.split_whitespace().collect();
            let ["programs", programs, "ticks", ticks] = words[..] else {
                panic!("no progress of a search: {text}");
            };
            [programs, ticks].map(|word| word.parse().expect("a count"))
        });
        Progress {
            file,
            programs,
            ticks,
        }
    }

    /// So many more.
    pub fn add(&mut self, programs: u64, ticks: u64) {
        self.programs += programs;
        self.ticks += ticks;
        if let Some(file) = &self.file {
            let text = format!("programs {}\nticks {}\n", self.programs, self.ticks);
            write_whole(file, |w| w.write_all(text.as_bytes())).expect("is written");
        }
    }
}
