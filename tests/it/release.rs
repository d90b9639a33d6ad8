//! What a release holds, made of the command as it is built here, unpacked and used
//! (`docs/release.md`).

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::cli::{Shell, bundled};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What a program prints that must do well.
#[track_caller]
fn told(command: &mut Command) -> String {
    let done = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    let wrong = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{command:?}\n{said}{wrong}");
    said
}

/// The command without symbols, as a release has it: most of what is built for tests are symbols.
fn stripped(strip: &Path, shell: &Shell) -> PathBuf {
    let binary = shell.path("whippen");
    let mut strip = Command::new(strip);
    told(
        strip
            .arg("-o")
            .arg(&binary)
            .arg(env!("CARGO_BIN_EXE_whippen")),
    );
    binary
}

#[test]
fn a_package_for_debian_is_unpacked_and_used() {
    let tools = ["dpkg-deb", "strip"].map(whippen_need::tool);
    let [Some(dpkg), Some(strip)] = tools else {
        return;
    };
    let shell = Shell::new();
    let (binary, package) = (stripped(&strip, &shell), shell.path("whippen.deb"));
    let mut make = Command::new(root().join("release/deb"));
    told(make.arg(binary).arg(&package).arg("-Znone"));
    let installed = shell.path("installed");
    told(Command::new(&dpkg).arg("-x").arg(&package).arg(&installed));

    let whippen = installed.join("usr/bin/whippen");
    let version = told(Command::new(&whippen).arg("--version"));
    let field = |name: &str| told(Command::new(&dpkg).arg("-f").arg(&package).arg(name));
    assert_eq!(version, format!("whippen {}", field("Version")));
    assert!(field("Depends").starts_with("libc6 (>= 2."));
    told(
        Command::new(&whippen)
            .arg("check")
            .arg(bundled("hammond.whip")),
    );

    let share = installed.join("usr/share");
    let page = fs::read(share.join("man/man1/whippen-check.1.gz")).expect("a manual page");
    assert_eq!(&page[..2], b"\x1f\x8b", "it is packed");
    for (file, says) in [
        ("bash-completion/completions/whippen", "complete -F"),
        ("zsh/vendor-completions/_whippen", "#compdef whippen"),
        (
            "fish/vendor_completions.d/whippen.fish",
            "complete -c whippen",
        ),
        ("doc/whippen/copyright", "Permission is hereby granted"),
    ] {
        let text = fs::read_to_string(share.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(text.contains(says), "{file}");
    }
    // Whoever installs it owns it, and everybody may read it.
    let listed = told(Command::new(&dpkg).arg("-c").arg(&package));
    let common = |line: &str| line.contains(" root/root ") && &line[7..8] == "r";
    assert!(listed.lines().all(common), "{listed}");
}

/// What the extension of a package says when an editor activates it; `settings` is `whippen.path`.
fn activated(node: &Path, package: &Path, folder: &Path, settings: &str) -> Value {
    let mut node = Command::new(node);
    node.arg(root().join("tests/it/release/extension.cjs"));
    let said = told(node.arg(package).arg(folder).arg(settings));
    serde_json::from_str(&said).unwrap_or_else(|e| panic!("{e}: {said}"))
}

#[test]
fn an_extension_of_vs_code_brings_its_server() {
    let tools = ["node", "strip"].map(whippen_need::tool);
    let packer = whippen_need::npm("@vscode/vsce/vsce");
    let ([Some(node), Some(strip)], Some(_), Some(modules)) =
        (tools, packer, whippen_need::extension_packages())
    else {
        return;
    };
    let shell = Shell::new();
    let (binary, package) = (stripped(&strip, &shell), shell.path("whippen.vsix"));
    let mut make = Command::new(root().join("release/vsix"));
    told(make.arg(binary).arg(&package).arg(modules));

    let folder = shell.path("extensions");
    let said = activated(&node, &package, &folder, "");
    let server = folder.join("extension/bin/whippen");
    assert_eq!(said["command"], server.to_str().expect("UTF-8"));
    let answer = &said["answer"];
    assert_eq!(answer["serverInfo"]["name"], "whippen", "{answer}");
    assert!(
        answer["capabilities"]["hoverProvider"].is_object()
            || answer["capabilities"]["hoverProvider"] == true
    );
    // A command that is told goes first.
    let said = activated(&node, &package, &folder, "no-such-command");
    let error = said["error"].as_str().expect("it does not start");
    assert!(error.contains("no-such-command"), "{error}");
}
