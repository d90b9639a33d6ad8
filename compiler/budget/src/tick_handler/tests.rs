//! What is around the handler, of a core without code, with cycles made up.

use super::*;
use crate::chip::board;
use crate::cores::tests::{section, whole};
use crate::memory::{Dma, Lies, Others};
use whippen_firmware::RUNNING;
use whippen_keyboard::{CoreId, KeyRange};

const STATE: u32 = 0x2000_0100;
const WORDS: u32 = 0x2000_0200;

/// Asked of core 0 of three keys, whose names are theirs but that have no code.
pub(crate) fn asked<R>(others: Others, ask: impl Fn(&OnCore) -> R) -> R {
    let sections = vec![
        section(".bss.state", STATE, 0x20),
        section(".bss.words", WORDS, 12),
    ];
    let mut program = Program::of(&whole(1, sections).image);
    for (name, at) in [("core0_state", STATE), (RUNNING[0].words, WORDS)] {
        program.symbols.insert(name.into(), at);
    }
    let board = board();
    let interference = Interference::new(&board, &program.sections, Lies::default(), others);
    let playing = CoreCode {
        name: "core0".into(),
        core: CoreId(0),
        keys: KeyRange::new(0, 3),
        zones: Vec::new(),
        cut: None,
    };
    ask(&OnCore {
        program: &program,
        core: &board.timing(),
        running: &RUNNING[0],
        number: 0,
        playing: &playing,
        programs: &[&playing],
        interference: &interference,
        helper: None,
    })
}

/// An instruction of ten cycles is interrupted; words on the stack wait for one cycle each.
fn around() -> Around {
    Around {
        idle: Idle {
            cycles_max: 10,
            stack_bytes_max: 0,
        },
        stacking: Waits {
            fetches: 1,
            ..Waits::default()
        },
        vector: Waits {
            others: 3,
            ..Waits::default()
        },
    }
}

/// The second halfword of the last word is the last one that a key may be entered with.
#[test]
fn keys_are_entered_with_their_state_a_word_and_their_number() {
    let entered = |name, keys| asked(Others::default(), |core| core.entered(name, keys));
    let (state, words) = ((0, [STATE, STATE]), (1, [WORDS, WORDS + 10]));
    assert_eq!(entered("core0", None), [state, words].into());
    assert_eq!(
        entered("core0", Some(3)),
        [state, words, (2, [0, 2])].into()
    );
    assert_eq!(
        entered("core0", Some(0)),
        [state, words, (2, [0, 0])].into()
    );
    assert_eq!(entered("other", None), [words].into());
}

/// Seven visits of a cycle, five accesses of a DMA that hold up a load and a fetch each; both come
/// in front of the handler's end and are told, where they are.
#[test]
fn visits_and_a_dma_take_time_of_a_frame() {
    let dma = Dma {
        device: 0x4000_0000,
        wait_cycles: 0,
        in_memory: 5,
    };
    let told = |others: Others| {
        asked(others, |core| {
            let parts = core.list_parts(&around(), vec![("the handler".into(), 100)]);
            (parts, core.cycles_before(&around()))
        })
    };
    let part = |name: &str, cycles| (name.to_string(), cycles);
    // 12 each, eight words, the vector.
    let mut parts = vec![
        part("the instruction in progress", 10),
        part("entry of the interrupt", 12 + 8 + 3),
        part("the handler", 100),
        part("return from the interrupt", 12 + 8),
    ];
    assert_eq!(told(Others::default()), (parts.clone(), 10 + 23));
    let others = Others {
        remote_accesses: 7,
        dma: Some(dma),
        ..Others::default()
    };
    parts.push(part("the other core's visits", 7));
    parts.push(part("the DMA at memory", 2 * 5));
    assert_eq!(told(others), (parts, 10 + 23 + 7 + 10));
}
