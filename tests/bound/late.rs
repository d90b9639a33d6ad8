//! Whether an image is late is found by the core that is: it must be what all bounds say.

use whippen_compiler::budget::Budget;
use whippen_compiler::pipeline::{Partitioned, prove_bounded};
use whippen_compiler::rate::Rate;

use crate::image::{Image, instruments};

/// With 5 and 4 keys on two cores, at periods by which no core is late, the one with a key more,
/// and both.
#[test]
fn an_image_is_late_where_its_bounds_say_so() {
    let names = ["virtual_spring", "harpsichord"];
    let known = |name: &str| names.contains(&name);
    for compiled in instruments() {
        if !known(&compiled.model.name) {
            continue;
        }
        let image = Image::new(compiled, 9);
        let board = &image.board;
        let cycles: Vec<u64> = (image.cores.iter())
            .map(|core| core.contended.cycles_max)
            .collect();
        let [more, fewer] = cycles[..] else {
            panic!("two cores: {cycles:?}");
        };
        assert!(more > fewer + 1, "{cycles:?}");
        let mut late = Vec::new();
        for period in [more + 9, (more + fewer) / 2, fewer - 9] {
            let rate = Rate::new(board.clock_hz, period as u32).expect("a rate");
            let mut made = Partitioned::from(image.whole.clone());
            late.push(made.is_late(board, rate));
            let budget = Budget::of(&image.cores, board, rate);
            assert_eq!(late.last(), Some(&!budget.fits()), "{period} cycles");
            let proof = prove_bounded(&mut made, board, rate).expect("bounded");
            let [program] = &proof.programs[..] else {
                panic!("one program");
            };
            assert_eq!(program.cores, image.cores, "{period} cycles");
        }
        assert_eq!(late, [false, true, true]);
    }
}
