//! The programs of the manual compile.

use whippen_compiler::check::Options;
use whippen_compiler::diag::render;
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::compile;
use whippen_compiler::scales::Scales;
use whippen_compiler::source::SourceMap;

const MANUAL: &str = include_str!("../../../docs/language.md");

/// The blocks of the manual in this language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    MANUAL
        .split(&fence)
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap())
        .collect()
}

#[test]
fn programs_of_the_manual_are_one_program_that_compiles() {
    let mut map = SourceMap::default();
    for (index, program) in blocks("whip").into_iter().enumerate() {
        map.add(format!("block {index}"), program);
    }
    assert!(map.files().len() >= 10);
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    let said: String = diagnostics.iter().map(|d| render(&map, d, false)).collect();
    let program = program.unwrap_or_else(|| panic!("{said}"));
    assert_eq!(said, "");
    let scales = Scales {
        sensor_zero: -0.5e-3,
        sensor_lsb: 11e-3 / 65535.0,
        drive_lsb: 20.0 / 32768.0,
        update_hz: None,
    };
    for model in program.instruments {
        let name = model.name.clone();
        compile(model, scales, false).unwrap_or_else(|error| panic!("{name}: {error:?}"));
    }
}
