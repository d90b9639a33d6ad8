//! Addresses of the studio: one that holds a program begins with it, and one that does not says so.

use std::path::{Path, PathBuf};

use super::{play, studio};
use crate::book::address;
use crate::cli::Shell;

/// What the studio says and shows that is opened at an address.
fn opened(tools: [&Path; 2], page: &Path, hash: &str, shell: &Shell) -> [String; 2] {
    let [node, chromium] = tools;
    let address = PathBuf::from(format!("{}#{hash}", page.display()));
    let value = play(node, chromium, &address, &shell.path("script.js"));
    let text = |name: &str| value[name].as_str().unwrap_or_default().to_string();
    [text("status"), text("text")]
}

const SCRIPT: &str = "\
const status = document.querySelector('#status');
for (let n = 0; n < 2400 && !status.textContent.startsWith('Up to date'); n++) await after(50);
const view = CodeMirror.EditorView.findFromDOM(document.querySelector('.cm-editor'));
return { status: status.textContent, text: view.state.doc.toString() };
";

const SPRING: &str = "\
instrument soft {
    sense x: length in 0 mm .. 10 mm
    force spring = 50 N/m * x
}
";

#[test]
fn an_address_holds_a_program_or_says_that_it_does_not() {
    let tools = ["node", "chromium"].map(whippen_need::tool);
    let ([Some(node), Some(chromium)], Some(module)) = (tools, whippen_need::module()) else {
        return;
    };
    let shell = Shell::new().with("script.js", SCRIPT);
    let page = studio(&shell, &module);
    let open = |hash: &str| opened([&node, &chromium], &page, hash, &shell);
    let [status, text] = open(&address::of("soft.whip", SPRING));
    assert_eq!((status.as_str(), text.as_str()), ("Up to date.", SPRING));
    // No letters of base64; no file that the studio would write.
    let wrong = ["!!", &address::of("../soft.whip", SPRING)];
    for hash in wrong {
        let [status, text] = open(hash);
        assert!(
            status.contains("The address holds no program that can be read"),
            "{hash}: {status}"
        );
        assert!(text.contains("instrument grand_piano"), "{hash}: {text}");
    }
}
