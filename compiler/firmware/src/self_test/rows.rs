//! The tables of a self-test: what each program is, needs and is expected to take.

use std::fmt::Write;

use whippen_isa::timing::{APSR, CODE, Core, DATA, Program};

/// A program to be run.
pub(super) struct TestRow {
    /// How sure the expected cycles are, and what it shows.
    title: String,
    /// What the expected cycles are made of.
    paper: String,
    expected: u64,
    /// Where it comes out.
    end: u32,
    /// R0 to R12, LR, then the flags.
    registers: [u32; 15],
    memory: Vec<(u32, u32)>,
    /// Pieces of code by their addresses.
    code: Vec<(u32, Vec<u16>)>,
}

/// Of LR in a row, and of the flags.
const LR: usize = 13;
const FLAGS: usize = 14;

impl TestRow {
    /// Of a program, with what the table of a core says of it.
    pub fn new(program: &Program, core: &Core) -> TestRow {
        let run = program.run(core);
        let mut registers = [DATA; 15];
        registers[FLAGS] = 0;
        for &(number, value) in &program.registers {
            match number {
                APSR => registers[FLAGS] = value,
                14 => registers[LR] = value,
                low => registers[usize::from(low)] = value,
            }
        }
        let mut code: Vec<(u32, Vec<u16>)> = Vec::new();
        for (address, halfwords) in program.code() {
            match code.last_mut() {
                Some((at, piece)) if *at + 2 * piece.len() as u32 == address => {
                    piece.extend(halfwords);
                }
                _ => code.push((address, halfwords.to_vec())),
            }
        }
        TestRow {
            title: format!(" {:8} {}", run.evidence, program.title),
            paper: format!("  ({})", program.paper),
            expected: run.cycles,
            end: run.end,
            registers,
            memory: program.memory.clone(),
            code,
        }
    }

    /// Nothing at all, to be subtracted.
    fn empty() -> TestRow {
        TestRow {
            title: String::new(),
            paper: String::new(),
            expected: 0,
            end: CODE,
            registers: [0; 15],
            memory: Vec::new(),
            code: Vec::new(),
        }
    }

    /// Its row, and what that refers to by this number.
    fn put(&self, number: usize, rows: &mut String, rest: &mut String) {
        let [all @ .., flags] = &self.registers;
        let registers: Vec<String> = all.iter().map(|word| place(*word)).collect();
        let _ = writeln!(
            rows,
            "        .word   {}, {}, blocks{number}, words{number}, title{number}, paper{number}, {flags}, {}",
            self.expected,
            place(self.end),
            registers.join(", ")
        );
        let mut blocks = String::new();
        for (at, (address, halfwords)) in self.code.iter().enumerate() {
            let bytes = 2 * halfwords.len();
            let _ = write!(blocks, "{}, {bytes}, code{number}_{at}, ", place(*address));
            let words: Vec<String> = halfwords.iter().map(u16::to_string).collect();
            let _ = writeln!(rest, "code{number}_{at}: .short {}", words.join(", "));
        }
        let words = self.memory.iter();
        let words: String = words
            .map(|(at, word)| format!("{}, {}, ", place(*at), place(*word)))
            .collect();
        let _ = writeln!(
            rest,
            "        .balign 4\nblocks{number}: .word {blocks}0\nwords{number}: .word {words}0\n\
             title{number}: .asciz {:?}\npaper{number}: .asciz {:?}\n        .balign 4",
            self.title, self.paper
        );
    }
}

/// A word that is an address of a program, where that lies on a board.
fn place(word: u32) -> String {
    match word {
        _ if word.wrapping_sub(CODE) < 0x1000 => format!("self_test_code + {}", word - CODE),
        _ if word.wrapping_sub(DATA) < 0x1000 => format!("self_test_data + {}", word - DATA),
        _ => word.to_string(),
    }
}

/// All tables.
pub(super) fn as_assembly(
    rows: &[TestRow],
    (motion, ticks): (&[u16], &[u32]),
    banner: &str,
    [sum, ticks_sum]: &[String; 2],
) -> String {
    let (mut table, mut rest) = (String::from("self_test_rows:\n"), String::new());
    for (number, row) in rows.iter().enumerate() {
        row.put(number, &mut table, &mut rest);
    }
    table.push_str("self_test_empty:\n");
    TestRow::empty().put(rows.len(), &mut table, &mut rest);
    let list = |words: Vec<String>, directive: &str| -> String {
        let lines = words.chunks(16);
        lines
            .map(|line| format!("        {directive}   {}\n", line.join(", ")))
            .collect()
    };
    let expected = (0..motion.len()).map(|at| ticks.get(at).copied().unwrap_or(0).to_string());
    let motion = motion.iter().map(u16::to_string);
    format!(
        "        .section .rodata.self_test, \"a\"\n        .balign 4\n        .global self_test_rows, \
         self_test_empty, self_test_banner, self_test_sum\n        .global self_test_ticks_sum, \
         self_test_motion, self_test_ticks_expected\n{table}{rest}self_test_ticks_expected:\n{}\
         self_test_motion:\n{}self_test_banner: .asciz \"{banner}\"\nself_test_sum: .asciz \"{sum}\"\n\
         self_test_ticks_sum: .asciz \"{ticks_sum}\"\n",
        list(expected.collect(), ".word"),
        list(motion.collect(), ".short"),
    )
}
