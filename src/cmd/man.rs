//! `whippen man`: the help as manual pages.

use std::path::{Path, PathBuf};

use clap::CommandFactory;
use clap_mangen::Man;
use whippen_runtime::files::write_whole;

use super::Cli;
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen man --dir ~/.local/share/man/man1, then man whippen-run")]
pub struct Args {
    /// Write a page per command into this folder, instead of the page of one command to stdout
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    dir: Option<PathBuf>,
    /// The command; without it the page of whippen itself
    #[arg(conflicts_with = "dir")]
    command: Option<String>,
}

pub fn run(args: &Args) -> Outcome {
    let pages = pages()?;
    let Some(dir) = &args.dir else {
        let name = args
            .command
            .as_ref()
            .map_or("whippen".to_string(), |command| {
                format!("whippen-{command}")
            });
        let Some((_, page)) = pages.iter().find(|(page, _)| *page == name) else {
            let known: Vec<&str> = pages
                .iter()
                .filter_map(|(page, _)| page.strip_prefix("whippen-"))
                .collect();
            return Err(Failure::Usage(format!(
                "there is no page `{name}`; commands are {}",
                known.join(", ")
            )));
        };
        say::whole(page);
        return Ok(());
    };
    std::fs::create_dir_all(dir)
        .map_err(|e| Failure::Usage(format!("cannot make the folder `{}`: {e}", dir.display())))?;
    pages
        .iter()
        .try_for_each(|(name, page)| write(dir, name, page))?;
    say!("{} pages in {}", pages.len(), dir.display());
    Ok(())
}

/// Name and text of every page.
fn pages() -> Result<Vec<(String, String)>, Failure> {
    let mut whole = Cli::command().disable_help_subcommand(true);
    whole.build();
    let subcommands = whole
        .get_subcommands()
        .filter(|c| !c.is_hide_set())
        .cloned();
    let named = subcommands.map(|c| (format!("whippen-{}", c.get_name()), c));
    let all = std::iter::once(("whippen".to_string(), whole.clone())).chain(named);
    all.map(|(name, command)| {
        let mut page = Vec::new();
        let manual = Man::new(command).title(name.clone());
        manual
            .render(&mut page)
            .map_err(|e| Failure::Defect(format!("the page `{name}`: {e}")))?;
        Ok((name, String::from_utf8_lossy(&page).into_owned()))
    })
    .collect()
}

fn write(dir: &Path, name: &str, page: &str) -> Outcome {
    let path = dir.join(format!("{name}.1"));
    write_whole(&path, |file| file.write_all(page.as_bytes()))
        .map_err(|e| Failure::Usage(e.to_string()))
}
