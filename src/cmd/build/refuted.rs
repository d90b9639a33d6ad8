//! What is refuted is not written: what `build --validate` does with an image whose bytes do
//! something else than its modes. The compiler makes none, so it is changed behind the compiler.

use clap::Parser;
use whippen_compiler::validation::code_of;
use whippen_isa::{ItState, Op, decode, is_wide};

use super::Args;
use super::files::{BuiltImage, Files, put_built};
use crate::exit::{self, Failure};

/// The instruction that does nothing.
const NOP: [u8; 2] = 0xbf00_u16.to_le_bytes();

#[derive(Parser)]
struct Typed {
    #[command(flatten)]
    args: Args,
}

/// Leaves out the first store of 16 bits of mode 0.
fn leave_out_store(built: &mut BuiltImage) {
    let image = &built.whole.image;
    let mut symbols = image.symbols.iter();
    let mode = symbols.find(|symbol| symbol.name == "core0.mode.0");
    let from = mode.expect("a mode").address;
    let arch = image.arch;
    let code = code_of(&built.whole);
    let image = &mut built.whole.image;
    let mut at = from;
    let store = loop {
        let first = code.half(at).expect("code");
        let second = code.half(at + 2).filter(|_| is_wide(first)).unwrap_or(0);
        let inst = decode(first, second, arch, ItState::OUTSIDE).expect("an instruction");
        if inst.op() == Op::STR_immediate && inst.size() == 2 {
            break at;
        }
        at += inst.size();
    };
    let own = image.sections.iter_mut().find_map(|section| {
        let offset = store.checked_sub(section.run)? as usize;
        section.bytes.get_mut(offset..offset + 2)
    });
    own.expect("bytes of it").copy_from_slice(&NOP);
}

#[test]
fn a_refuted_image_is_not_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let elf = folder.path().join("a.elf");
    let hammond = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/hammond.whip");
    let output = elf.to_str().expect("a name");
    let line = ["build", hammond, "--keys", "2", "--validate", "-o", output];
    let args = Typed::parse_from(line).args;
    let opened = args.setup.open().expect("it opens");
    let setup = args.setup.all_programs(&opened).expect("it compiles");
    let instruments = setup.image_instruments().expect("it has instruments");
    let chip = Files { setup: &setup };
    for is_faulty in [true, false] {
        let mut built = chip.built(&instruments).expect("it builds");
        if is_faulty {
            leave_out_store(&mut built);
        }
        let outcome = put_built(&args, None, &[Files { setup: &setup }], vec![built]);
        if is_faulty {
            let Err(Failure::Defect(why)) = &outcome else {
                panic!("it is not refuted");
            };
            let begins = "the code does not do what it was made of: mode 0 of core0: ";
            assert!(why.starts_with(begins), "{why}");
        }
        let code = exit::code(outcome.map(|_| ()));
        assert_eq!(code, if is_faulty { 3 } else { 0 });
        assert_eq!(elf.exists(), !is_faulty);
    }
}
