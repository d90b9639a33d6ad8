//! `whippen explain`

use whippen_compiler::diag::Code;
use whippen_compiler::diag::explain::GROUPS;

use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen explain WH0203")]
pub struct Args {
    /// The code, such as WH0203, 203 or unknown-term; without it all codes are listed
    code: Option<String>,
}

pub fn run(args: &Args) -> Outcome {
    let Some(text) = &args.code else {
        list();
        return Ok(());
    };
    match Code::find(text) {
        Ok(code) => {
            say::whole(&code.plain_page(say::columns()));
            Ok(())
        }
        Err(Some(near)) => Err(Failure::Usage(format!(
            "there is no diagnostic `{text}`; did you mean {} ({})?",
            near.number(),
            near.name()
        ))),
        Err(None) => Err(Failure::Usage(format!(
            "there is no diagnostic `{text}`; `whippen explain` lists all"
        ))),
    }
}

fn list() {
    for (group, name) in GROUPS {
        say!("{name}");
        for code in Code::ALL
            .iter()
            .filter(|c| c.number()[2..].starts_with(group))
        {
            say!("  {}  {:<22} {}", code.number(), code.name(), code.title());
        }
        say!("");
    }
    say!("whippen explain CODE shows the page of one of them");
}
