//! What is charged for addresses of a few, for buses, and for memory without a known time.

use super::*;
use whippen_board::{Bus, MemoryKind, Start};
use whippen_isa::{Arch, ItState, decode};

fn memory(name: &str, base: u32, size: u32, banks: Vec<u8>) -> Memory {
    Memory {
        name: name.into(),
        base,
        size,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        striped: banks.len() > 1,
        banks,
    }
}

/// Two striped groups, a bank for each core, flash, a bus.
fn board() -> Board {
    let flash = Memory {
        access: AccessTime::NotBounded,
        fetch: AccessTime::NotBounded,
        ..memory("flash", 0x1000_0000, 0x1_0000, Vec::new())
    };
    Board {
        name: "own".into(),
        arch: Arch::V8M,
        cores: 2,
        clock_hz: 150_000_000,
        start: Start::ImageDef,
        uf2_family: None,
        fetches_apart: true,
        banks: (0..10).map(|bank| format!("SRAM{bank}")).collect(),
        memory: vec![
            flash,
            memory("sram0", 0x2000_0000, 256 << 10, vec![0, 1, 2, 3]),
            memory("sram4", 0x2004_0000, 256 << 10, vec![4, 5, 6, 7]),
            memory("sram8", 0x2008_0000, 4 << 10, vec![8]),
            memory("sram9", 0x2008_1000, 4 << 10, vec![9]),
        ],
        buses: vec![Bus {
            name: "apb".into(),
            base: 0x4000_0000,
            size: 0x1000_0000,
            read_cycles: 3,
            write_cycles: 4,
        }],
        devices: Vec::new(),
        converter_interrupt: 46,
        stacks: vec![0x2008_1000, 0x2008_2000],
        places: Vec::new(),
    }
}

/// Of an instruction at an address whose R0 lies between two addresses, on core 0, while core 1
/// uses its own banks.
fn waits_at(word: u16, at: u32, r0: [u32; 2]) -> Result<u16, UnknownTime> {
    let inst = decode(word, 0, Arch::V8M, ItState::OUTSIDE).expect("an instruction");
    let board = board();
    let data = Reach {
        banks: 0b1111,
        unknown: None,
    };
    let others = Others {
        prefetch: true,
        contenders: vec![0b10_1111_0000],
        remote_accesses: 0,
    };
    let around = Interference::new(&board, &[], (0b1111, data), others);
    let facts = Facts::of_registers(&BTreeMap::from([(0, r0)]));
    around.waits(&inst, at, &facts, &Bases::default(), &Outcome::NEXT)
}

const LDR_R1_R0: u16 = 0x6801;
const STR_R1_R0: u16 = 0x6001;
const LDR_R1_R0_R2: u16 = 0x5881;

/// Of a load from 0x20000000 by R0.
fn waits(from: u32, to: u32) -> Result<u16, UnknownTime> {
    waits_at(LDR_R1_R0, 0x2000_0000, [from, to])
}

#[test]
fn an_address_of_a_few_waits_as_the_worst_of_them() {
    assert_eq!(
        waits(0x2008_0000, 0x2008_0800),
        Ok(0),
        "near core 0, where nobody fetches"
    );
    assert_eq!(
        waits(0x2008_0ff0, 0x2008_1000),
        Ok(1),
        "the last is near core 1"
    );
    assert_eq!(
        waits(0x2000_0000, 0x2000_0000),
        Ok(0),
        "the bank of the instruction, not of those behind it"
    );
    assert_eq!(
        waits(0x2000_0000, 0x2000_0010),
        Ok(1),
        "any bank of the code"
    );
    assert_eq!(
        waits(0x2000_0100, 0x2004_0100),
        Ok(1),
        "too many to be looked at"
    );
}

#[test]
fn a_bus_takes_its_own_time_for_reads_and_writes() {
    assert_eq!(waits(0x4000_0000, 0x4000_0000), Ok(2));
    assert_eq!(waits(0x4000_0000, 0x4000_0010), Ok(2), "one of some");
    let store = waits_at(STR_R1_R0, 0x2000_0000, [0x4000_0000; 2]);
    assert_eq!(store, Ok(3));
}

#[test]
fn memory_without_a_known_time_is_an_error_wherever_it_may_be_met() {
    let flash = Unknown::Memory {
        memory: "flash".into(),
        section: None,
    };
    let known = waits(0x1000_0100, 0x1000_0100).expect_err("in flash");
    assert_eq!((known.fetch, &known.what), (false, &flash));
    let some = waits(0x1000_fff0, 0x1001_0000).expect_err("one of them in flash");
    assert_eq!(some.what, flash);
    let table = waits_at(LDR_R1_R0_R2, 0x2000_0000, [0x1000_0100; 2]);
    assert_eq!(table.expect_err("a table in flash").what, flash);
    let fetched = waits_at(LDR_R1_R0, 0x1000_0000, [0x2000_0000; 2]);
    assert!(fetched.expect_err("code in flash").fetch);
    let nothing = waits(0x2008_1ff0, 0x2008_2010).expect_err("behind the memory");
    assert_eq!(
        nothing.what,
        Unknown::Nothing {
            target: 0x2008_2000
        }
    );
}
