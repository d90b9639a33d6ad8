//! Which certificates are well formed.

use super::super::{CYCLES, Certificate, Dma, Helper, Memory, Neighbour};
use super::said;
use crate::made::{DEVICES, Image};

/// Why what a change makes is refused before any code is looked at.
fn refused(change: impl Fn(&mut Certificate)) -> String {
    let mut image = Image::new(&["bx lr"], &[], Vec::new())
        .prove()
        .expect("it is proven");
    change(&mut image.certificate);
    match image.certificate.is_well_formed() {
        Ok(()) => String::new(),
        Err(why) => why.to_string(),
    }
}

#[test]
fn memories_and_buses_lie_apart() {
    let overlap = "memories or buses overlap, or go beyond all addresses";
    assert_eq!(refused(|_| ()), "");
    assert_eq!(refused(|own| own.memories[0].size = 0x1_0000), "");
    assert_eq!(refused(|own| own.memories[0].size = 0x1_0001), overlap);
    assert_eq!(
        refused(|own| own.buses[0].base = own.memories[1].base),
        overlap
    );
    assert_eq!(
        refused(|own| own.memories.push(own.memories[0].clone())),
        overlap
    );
}

/// Nothing goes around the end of all addresses, and every word is in a bank.
#[test]
fn memories_have_banks_for_their_words() {
    let overlap = "memories or buses overlap, or go beyond all addresses";
    let around = |size| {
        refused(move |own| {
            own.buses[0].base = 0xffff_f000;
            own.buses[0].size = size;
        })
    };
    assert_eq!([around(0xfff), around(0x1000)], ["", overlap]);
    let memory = |change: &dyn Fn(&mut Memory)| refused(|own| change(&mut own.memories[1]));
    assert_eq!(memory(&|own| own.base = 0xffff_f000), overlap);
    let none = "a memory has no banks for all of its words";
    assert_eq!(memory(&|own| own.banks.clear()), none);
    assert_eq!(memory(&|own| own.banks[0] = 31), "");
    assert_eq!(memory(&|own| own.banks[0] = 32), none);
    assert_eq!(memory(&|own| own.banks = vec![4, 5, 6]), none);
    assert_eq!(memory(&|own| own.banks = vec![4, 5]), "");
    let striped = |own: &mut Memory| (own.striped, own.banks) = (true, vec![4, 5, 6]);
    assert_eq!(memory(&striped), "");
    let none_striped = |own: &mut Memory| (own.striped, own.banks) = (true, Vec::new());
    assert_eq!(memory(&none_striped), none);
    // What nobody knows the time of has none.
    let unknown = |access, fetch| {
        memory(&move |own| {
            own.banks.clear();
            (own.access, own.fetch) = (access, fetch);
        })
    };
    assert_eq!(
        [unknown(0, 0), unknown(1, 0), unknown(0, 1)],
        ["", none, none]
    );
}

/// Waiting is summed in 16 bits: no word takes longer than any could.
#[test]
fn words_take_few_cycles() {
    let with = |cycles: u16| {
        let changes: [&dyn Fn(&mut Certificate); 6] = [
            &|own| own.memories[1].access = cycles,
            &|own| own.memories[1].fetch = cycles,
            &|own| own.buses[0].read = cycles,
            &|own| own.buses[0].write = cycles,
            &|own| {
                own.dma = Some(Dma {
                    bus: DEVICES,
                    wait: cycles,
                    accesses: 1,
                });
            },
            &|own| {
                own.neighbour = Some(Neighbour {
                    bus: DEVICES,
                    waits: vec![cycles],
                });
            },
        ];
        changes.map(refused)
    };
    assert_eq!(with(255), [""; 6]);
    assert_eq!(with(256), ["a word takes more cycles than any does"; 6]);
}

#[test]
fn bridges_are_buses() {
    let dma = |more| {
        refused(move |own| {
            let bus = own.buses[0].base + more;
            own.dma = Some(Dma {
                bus,
                wait: 1,
                accesses: 1,
            });
        })
    };
    assert_eq!(dma(0), "");
    assert_eq!(dma(4), "a DMA is behind a bridge that is none");
    let met = |more, cores: usize| {
        refused(move |own| {
            let bus = own.buses[0].base + more;
            own.neighbour = Some(Neighbour {
                bus,
                waits: vec![1; cores],
            });
        })
    };
    let none = "cores meet at a bridge that is none, or others than there are";
    assert_eq!(met(0, 1), "");
    assert_eq!([met(4, 1), met(0, 2), met(0, 0)], [none; 3]);
}

#[test]
fn targets_are_told_once_in_order_at_even_addresses() {
    let with = |targets: &[(u32, &[u32])]| {
        let targets: Vec<_> = targets.iter().map(|(at, to)| (*at, to.to_vec())).collect();
        refused(move |own| own.targets = targets.clone())
    };
    let none = "a branch has targets that are none";
    assert_eq!(with(&[(2, &[4, 6]), (8, &[4])]), "");
    for targets in [
        &[(8, &[4][..]), (2, &[4])][..],
        &[(2, &[4]), (2, &[6])],
        &[(2, &[4, 4])],
        &[(3, &[4])],
        &[(2, &[4, 5])],
    ] {
        assert_eq!(with(targets), none, "{targets:?}");
    }
}

/// Every core that plays has a frame for every program; one that helps has none of its own.
#[test]
fn every_core_has_its_frames() {
    let with = |cores: u32, frames: &[(u32, u32, bool)]| {
        refused(|own| {
            own.cores = cores;
            let frame = |(core, program, helped): &(u32, u32, bool)| {
                let mut frame = own.frames[0].clone();
                (frame.core, frame.program) = (*core, *program);
                frame.helper = helped.then(Helper::default);
                frame
            };
            own.frames = frames.iter().map(frame).collect();
        })
    };
    let (missing, both) = (
        "not every core has a frame for every program",
        "a core both plays and helps",
    );
    for (cores, frames, why) in [
        (1, &[(0, 0, false)][..], ""),
        (1, &[(0, 0, false), (0, 1, false)], ""),
        (2, &[(0, 0, false), (1, 0, false)], ""),
        (2, &[(0, 0, true)], ""),
        (2, &[(0, 0, true), (0, 1, true)], ""),
        (1, &[], missing),
        (1, &[(0, 1, false)], missing),
        (1, &[(1, 0, false)], missing),
        (2, &[(0, 0, false)], missing),
        (2, &[(1, 0, false), (0, 0, false)], missing),
        (0, &[(0, 0, false)], missing),
        (2, &[(0, 0, true), (1, 0, false)], both),
        (1, &[(0, 0, true)], both),
        (2, &[(0, 0, true), (0, 1, false)], both),
    ] {
        assert_eq!(with(cores, frames), why, "{cores} {frames:?}");
    }
    // Sections are named after two cores.
    let three = [(0, 0, false), (1, 0, false), (2, 0, false)];
    let named = "there are more cores than sections are named after";
    assert_eq!(with(3, &three), named);
}

/// A core's stack ends where the first word of its vectors says: it has one table of them.
#[test]
fn a_core_has_one_table_of_vectors() {
    let with = |helped: bool, vectors: [u32; 2], others: [u32; 2]| {
        refused(move |own| {
            own.cores = if helped { 2 } else { 1 };
            let frame = |program: usize| {
                let mut frame = own.frames[0].clone();
                frame.program = program as u32;
                frame.vectors = vectors[program];
                frame.helper = helped.then(|| Helper {
                    vectors: others[program],
                    ..Helper::default()
                });
                frame
            };
            own.frames = [0, 1].map(frame).to_vec();
        })
    };
    let two = "a core has two tables of vectors";
    assert_eq!(with(false, [8, 8], [4, 4]), "");
    assert_eq!(with(false, [8, 12], [4, 4]), two);
    assert_eq!(with(true, [8, 8], [4, 4]), "");
    assert_eq!(with(true, [8, 8], [4, 12]), two);
    assert_eq!(with(true, [8, 12], [4, 4]), two);
}

/// A function says nothing twice, and where it ends where it is one that does.
#[test]
fn a_function_says_a_thing_once() {
    let twice = "a function says something twice, or what cannot be";
    let with = |lines: &[&str]| {
        let head = [
            "core c 0x0",
            "cores 1",
            "frame 0 0 0x10 0 0 0",
            "function a plain 0 0 0",
        ];
        let all = [&head, lines].concat();
        let certificate = said(&all);
        certificate.is_well_formed().err().unwrap_or_default()
    };
    assert_eq!(with(&[]), "");
    for [one, other, same] in [
        ["entered 0 1 2", "entered 1 1 2", "entered 0 3 4"],
        ["base 0 0x4", "base 1 0x4", "base 0 0x8"],
        ["loop 0x2 4", "loop 0x4 4", "loop 0x2 5"],
        [
            "context 0 0x0 0x2",
            "context 0 0x0 0x4",
            "context 0 0x0 0x2",
        ],
        [
            "call 0x2 0x4 never",
            "call 0x2 0x6 never",
            "call 0x2 0x4 costs 0 1",
        ],
        [
            "piece 0x2 1 0 0x0",
            "piece 0x4 1 0 0x0",
            "piece 0x2 2 0 0x0",
        ],
    ] {
        assert_eq!(with(&[one, other]), "");
        assert_eq!(with(&[one, same]), twice, "{one}");
    }
    // SP, PC and what is no register hold no words that are assumed; words are possible.
    for register in [0, 12, 14] {
        let [entered, base] = [
            format!("entered {register} 0 0"),
            format!("base {register} 0x4"),
        ];
        assert_eq!([with(&[&entered]), with(&[&base])], [""; 2], "{register}");
    }
    for register in [13, 15, 16, 255] {
        let [entered, base] = [
            format!("entered {register} 0 0"),
            format!("base {register} 0x4"),
        ];
        assert_eq!(
            [with(&[&entered]), with(&[&base])],
            [twice; 2],
            "{register}"
        );
    }
    assert_eq!(with(&["entered 0 -2147483648 2147483647"]), "");
    for words in ["1 0", "-2147483649 0", "0 2147483648"] {
        assert_eq!(with(&[&format!("entered 0 {words}")]), twice, "{words}");
    }
    assert_eq!([with(&["loop 0x2 1"]), with(&["loop 0x2 0"])], ["", twice]);
    let takes = |cycles: u64| with(&[&format!("piece 0x2 {cycles} 0 0x0")]);
    assert_eq!([takes(CYCLES), takes(CYCLES + 1)], ["", twice]);
    assert_eq!(with(&["until 0x2 0x0"]), twice);
    assert_eq!(with(&["function b until 0 0 0"]), twice);
    assert_eq!(with(&["function b until 0 0 0", "until 0x2 0x0"]), "");
    // Those of the core that helps, too.
    let helped = ["helper 0x20 1", "function b plain 0 0 0", "until 0x2 0x0"];
    assert_ne!(with(&helped), "");
}
