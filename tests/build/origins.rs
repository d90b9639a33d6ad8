//! Why there is code: each instruction of a Kernel names a declaration, and a debugger shows a line
//! of the user's own.

use std::collections::BTreeSet;

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::image::places;
use whippen_compiler::kernel::Region;
use whippen_compiler::pipeline;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

const PROGRAM: &str = "term soft(x: length, k: stiffness) -> pull: force {
    pull = k * max(x, 0 mm)
}
instrument probe {
    sense x: length in 0 mm .. 10 mm over 1 ms
    live param B = 1 N*s/m in 0 N*s/m .. 2 N*s/m
    let near = soft(x - 2 mm, k: 50 N/m)
    let row = plectrum(x, row: on, touch: 3 mm, peak: 4 mm, pluck: 5 mm, height: 1 N)
    states side {
        out -> over when x > 6 mm { emit note(speed: x') }
        over -> out when x < 5 mm
    }
    force friction = B * x'
    force near = near
    force row = row.pull
}
";

fn origins(region: &Region, found: &mut BTreeSet<Option<u32>>) {
    for inst in &region.insts {
        found.insert(inst.origin);
        inst.regions.iter().for_each(|inner| origins(inner, found));
    }
}

#[test]
fn every_instruction_knows_its_declaration_and_its_line() {
    let mut map = SourceMap::default();
    map.add("probe.whip", PROGRAM);
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    let model = program
        .unwrap_or_else(|| panic!("{diagnostics:#?}"))
        .instruments
        .remove(0);
    let scales = Device::of(&model).scales();
    let lowered = pipeline::compile(model, scales, false)
        .expect("compiles")
        .lowered;
    let mut found = BTreeSet::new();
    origins(&lowered.kernel.tick, &mut found);
    let places = places(&lowered.origins, &map);
    let told: BTreeSet<String> = found
        .into_iter()
        .map(|origin| {
            let place = &places[origin.expect("made for something") as usize];
            format!("{:2}  {}", place.line, place.item)
        })
        .collect();
    assert!(
        places.iter().all(|place| place.file == "probe.whip"),
        "{places:?}"
    );
    insta::assert_snapshot!("origins", told.into_iter().collect::<Vec<_>>().join("\n"));
}
