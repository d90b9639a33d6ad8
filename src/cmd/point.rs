//! A program compiled with other values of its parameters, without a word to anybody: a point of a
//! sweep or of a fit.

use whippen_compiler::check::Options;
use whippen_compiler::pipeline::{self, CompileError, Compiled};
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

use super::load;
use crate::table_text::BESIDE_FILES;

/// The instrument of a program at a point; or why there is none.
pub fn compiled(
    sources: &[(String, String)],
    name: Option<&str>,
    options: &Options,
    device: &Device,
) -> Result<Compiled, String> {
    let mut map = SourceMap::default();
    for (name, text) in sources {
        map.add(name, text);
    }
    let options = Options {
        read: BESIDE_FILES,
        ..options.clone()
    };
    let (program, found) = pipeline::front(&mut map, &options);
    let Some(program) = program else {
        let worst = found.iter().max_by_key(|d| d.severity());
        return Err(worst.map_or(String::new(), |d| d.message.clone()));
    };
    let model = load::one_key(&program, name, None);
    let model = model.map_err(|_| "there is no such instrument".to_string())?;
    pipeline::compile(model, device.scales(), true).map_err(|error| match error {
        CompileError::Program(found) => found.first().map_or(String::new(), |d| d.message.clone()),
        CompileError::Defect(why) => why,
    })
}
