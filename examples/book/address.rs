//! A program as the part of the studio's address behind the `#`: JSON, deflated, base64url.
//!
//! The other side is `linked` in `runtime/src/studio/page.js`.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde_json::json;
use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS};
use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

/// The address of a program.
pub fn of(file: &str, text: &str) -> String {
    let mut packer = DeflateEncoder::new(Vec::new(), Compression::best());
    let object = json!({ "file": file, "text": text }).to_string();
    packer
        .write_all(object.as_bytes())
        .expect("memory takes it");
    URL_SAFE_NO_PAD.encode(packer.finish().expect("memory takes it"))
}

/// Whether a program has something to play and no error where the studio opens it: alone, or, as a
/// bundled keyboard, among the bundled instruments.
pub fn opens(file: &str, text: &str) -> bool {
    let mut map = SourceMap::default();
    map.add(file, text);
    if KEYBOARDS.contains(&(file, text)) {
        for (file, text) in INSTRUMENTS {
            map.add(*file, *text);
        }
    }
    let (program, _) = compile_front(&mut map, &Options::default());
    let lowers = |model: Model| {
        let scales = Device::of(&model).scales();
        compile(model, scales, true).is_ok()
    };
    program.is_some_and(|program| {
        !program.instruments.is_empty() && program.instruments.into_iter().all(lowers)
    })
}
