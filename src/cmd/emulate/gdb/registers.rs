//! The registers as gdb numbers them, and the description that tells it so.
//!
//! Feature names and numbers are gdb's (its manual, "ARM Features"): `m-profile` has R0 to R12, SP,
//! LR, PC and XPSR; the FPU and the special registers follow. The numbers are the order of the
//! list, which the description states.

use gdbstub::arch::{Arch, Registers};
use whippen_emulator::{CoreKind, Cpu, Register};

/// A Cortex-M for gdbstub.
pub enum CortexM {}

impl Arch for CortexM {
    type Usize = u32;
    type Registers = Words;
    type BreakpointKind = usize;
    // gdb reads and writes them all at once.
    type RegId = ();
}

/// All registers of a core in the order of the description, as words.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Words(pub Vec<u32>);

impl Registers for Words {
    type ProgramCounter = u32;

    fn pc(&self) -> u32 {
        self.0.get(15).copied().unwrap_or(0)
    }

    fn gdb_serialize(&self, mut write_byte: impl FnMut(Option<u8>)) {
        self.0
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .for_each(|byte| write_byte(Some(byte)));
    }

    fn gdb_deserialize(&mut self, bytes: &[u8]) -> Result<(), ()> {
        let (words, rest) = bytes.as_chunks::<4>();
        self.0 = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
        if rest.is_empty() { Ok(()) } else { Err(()) }
    }
}

impl Words {
    /// Of a core.
    pub fn of(cpu: &Cpu) -> Self {
        Self(all(cpu.kind()).map(|register| cpu.get(register)).collect())
    }

    /// Into a core, those that differ.
    pub fn write(&self, cpu: &mut Cpu) {
        for (register, value) in all(cpu.kind()).zip(&self.0) {
            if cpu.get(register) != *value {
                cpu.set(register, *value);
            }
        }
    }
}

/// How many registers the feature `m-profile` has.
const CORE: usize = 17;

/// The registers of a core in gdb's order. A pair of single-precision registers is a double one,
/// low half first.
fn all(kind: CoreKind) -> impl Iterator<Item = Register> {
    let float = if has_float(kind) { 32 } else { 0 };
    let singles = (0..float).map(Register::single);
    let fpscr = has_float(kind).then_some(Register::FPSCR);
    Register::all()
        .take(CORE)
        .chain(singles)
        .chain(fpscr)
        .chain(special())
}

fn special() -> impl Iterator<Item = Register> {
    Register::all()
        .skip(CORE)
        .filter(|r| *r != Register::FPSCR && !r.name().starts_with('s'))
}

fn has_float(kind: CoreKind) -> bool {
    kind != CoreKind::CortexM0Plus
}

/// The description of a core for gdb.
pub fn description(kind: CoreKind) -> String {
    let mut number = 0;
    let mut list = |registers: Vec<(String, u32, &str)>| -> String {
        let one = |(name, bits, kind): (String, u32, &str)| {
            number += 1;
            format!(
                "<reg name=\"{name}\" bitsize=\"{bits}\" type=\"{kind}\" regnum=\"{}\"/>",
                number - 1
            )
        };
        registers.into_iter().map(one).collect()
    };
    let pointer = |register: Register| match register.name() {
        "sp" => "data_ptr",
        "pc" => "code_ptr",
        _ => "int",
    };
    let word = |register: Register| (register.name().to_string(), 32, pointer(register));
    let core = list(Register::all().take(CORE).map(word).collect());
    let mut xml = format!(
        "<?xml version=\"1.0\"?><!DOCTYPE target SYSTEM \"gdb-target.dtd\"><target version=\"1.0\">\
         <architecture>arm</architecture><feature name=\"org.gnu.gdb.arm.m-profile\">{core}</feature>",
    );
    if has_float(kind) {
        let doubles = (0..16).map(|n| (format!("d{n}"), 64, "ieee_double"));
        let float = list(doubles.chain([word(Register::FPSCR)]).collect());
        xml.push_str(&format!(
            "<feature name=\"org.gnu.gdb.arm.vfp\">{float}</feature>"
        ));
    }
    let system = list(special().map(word).collect());
    xml + &format!("<feature name=\"org.gnu.gdb.arm.m-system\">{system}</feature></target>")
}
