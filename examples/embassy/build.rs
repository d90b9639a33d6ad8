//! What the linker is given: memory, and the object that `whippen build` wrote.

use std::env::var;
use std::fs::copy;
use std::path::Path;

fn main() {
    let project = var("CARGO_MANIFEST_DIR").expect("cargo says");
    let out = var("OUT_DIR").expect("cargo says");
    let object = Path::new(&project).join("target/piano.o");
    assert!(object.is_file(), "first `whippen build`, as README.md says");
    // Linker scripts are looked for in folders.
    copy("memory.x", Path::new(&out).join("memory.x")).expect("the folder of this build");
    println!("cargo:rustc-link-search={out}");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins={}", object.display());
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=target/piano.o");
}
