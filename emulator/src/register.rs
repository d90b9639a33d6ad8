//! Registers by name, for debuggers and reports.

use crate::cpu::Cpu;

/// A register of a core.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Register(u8);

const NAMES: [&str; 58] = [
    "r0",
    "r1",
    "r2",
    "r3",
    "r4",
    "r5",
    "r6",
    "r7",
    "r8",
    "r9",
    "r10",
    "r11",
    "r12",
    "sp",
    "lr",
    "pc",
    "xpsr",
    "msp",
    "psp",
    "primask",
    "basepri",
    "faultmask",
    "control",
    "msplim",
    "psplim",
    "fpscr",
    "s0",
    "s1",
    "s2",
    "s3",
    "s4",
    "s5",
    "s6",
    "s7",
    "s8",
    "s9",
    "s10",
    "s11",
    "s12",
    "s13",
    "s14",
    "s15",
    "s16",
    "s17",
    "s18",
    "s19",
    "s20",
    "s21",
    "s22",
    "s23",
    "s24",
    "s25",
    "s26",
    "s27",
    "s28",
    "s29",
    "s30",
    "s31",
];

impl Register {
    /// SP.
    pub const SP: Self = Self(13);
    /// LR.
    pub const LR: Self = Self(14);
    /// The address of the next instruction.
    pub const PC: Self = Self(15);
    /// Flags, IT state, exception number.
    pub const XPSR: Self = Self(16);
    /// FPSCR.
    pub const FPSCR: Self = Self(25);

    /// R`number`, 0 to 15; higher numbers wrap.
    pub const fn core(number: u8) -> Self {
        Self(number & 15)
    }

    /// S`number`, 0 to 31; higher numbers wrap.
    pub const fn single(number: u8) -> Self {
        Self(26 + (number & 31))
    }

    /// All of them: R0 to R12, SP, LR, PC, XPSR, the special registers, FPSCR, S0 to S31.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..NAMES.len() as u8).map(Self)
    }

    /// The register of that name, in lower case.
    pub fn named(name: &str) -> Option<Self> {
        NAMES.iter().position(|n| *n == name).map(|i| Self(i as u8))
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        NAMES[self.0 as usize]
    }
}

impl Cpu {
    /// The value of a register; 0 of one that the core does not have.
    pub fn get(&self, register: Register) -> u32 {
        match register.0 {
            15 => self.pc,
            n @ 0..15 => self.r[n as usize],
            16 => self.xpsr(),
            17 => self.msp(),
            18 => self.psp(),
            19 => u32::from(self.primask),
            20 => self.basepri,
            21 => u32::from(self.faultmask),
            22 => self.control,
            23 => self.msplim,
            24 => self.psplim,
            25 => self.fpscr,
            n => self.s[(n as usize - 26) & 31],
        }
    }

    /// Sets a register. XPSR keeps the number of the exception, stack pointers stay word aligned;
    /// PC loses bit 0.
    pub fn set(&mut self, register: Register, value: u32) {
        match register.0 {
            13 => self.r[13] = value & !3,
            15 => self.pc = value & !1,
            n @ 0..15 => self.r[n as usize] = value,
            16 => self.set_xpsr(value | 1 << 24),
            17 => self.set_msp(value),
            18 => self.set_psp(value),
            19 => self.primask = value & 1 != 0,
            20 => self.basepri = value & 0xff,
            21 => self.faultmask = value & 1 != 0,
            22 => self.change_mode(self.ipsr, value & 15),
            23 => self.msplim = value & !7,
            24 => self.psplim = value & !7,
            25 => self.fpscr = value & crate::float::FPSCR_BITS,
            n => self.s[(n as usize - 26) & 31] = value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::CoreKind;

    #[test]
    fn what_is_set_by_name_is_read_by_name() {
        let mut cpu = Cpu::new(CoreKind::CortexM33, 0, 8);
        for (i, register) in Register::all().enumerate() {
            let value = match register.name() {
                "primask" | "faultmask" => 1,
                "fpscr" => 0x0340_0010,
                "control" | "xpsr" => continue,
                _ => (i as u32 + 1) * 8,
            };
            cpu.set(register, value);
            assert_eq!(cpu.get(register), value, "{}", register.name());
            assert_eq!(Register::named(register.name()), Some(register));
        }
        cpu.set(Register::XPSR, 0xf80f_0000);
        assert_eq!(cpu.get(Register::XPSR), 0xf90f_0000);
    }
}
