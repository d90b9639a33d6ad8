//! The registers at 0xE0000000 by address: what a load reads and a store changes.

use super::nvic::{self, FIRST, NMI, PEND_SV, SV_CALL, SYS_TICK};
use super::{FPCCR_RESET, System};
use crate::board::CoreKind;
use crate::cpu::Cpu;

/// The key that AIRCR wants.
const VECTKEY: u32 = 0x05fa;

impl Cpu {
    /// A load. Without privilege nothing answers, nor does it below the system control space when
    /// narrower than a word.
    pub(crate) fn system_read(&mut self, address: u32, size: u32) -> Option<u32> {
        if !self.is_privileged() {
            return None;
        }
        let place = 8 * (address & 3);
        let word = self
            .system
            .read(canonical(address) & !3, self.now, self.ipsr);
        let mask = if size == 4 {
            u32::MAX
        } else {
            (1 << (8 * size)) - 1
        };
        Some(word >> place & mask)
    }

    /// A store.
    pub(crate) fn system_write(&mut self, address: u32, size: u32, value: u32) -> Option<()> {
        if !self.is_privileged() && canonical(address) != STIR {
            return None;
        }
        self.system.changed = true;
        self.float_ready = false;
        let address = canonical(address);
        if size == 4 {
            self.system.write(address, value, self.now);
        } else {
            self.system.write_part(address, size, value);
        }
        Some(())
    }
}

const STIR: u32 = 0xe000_ef00;

/// The Non-secure alias names the same registers.
fn canonical(address: u32) -> u32 {
    if address >> 16 == 0xe002 {
        address & !0x2_0000
    } else {
        address
    }
}

impl System {
    fn read(&mut self, address: u32, now: u64, ipsr: u32) -> u32 {
        match address {
            0xe000_1000 => self.dwt_control | 1 << 28,
            0xe000_1004 => self.cycle_count(now),
            0xe000_e004 => (self.nvic.count - FIRST).div_ceil(32).saturating_sub(1),
            0xe000_e010..=0xe000_e01c => self.systick.read(address & 15, now),
            0xe000_e100..=0xe000_e13c | 0xe000_e180..=0xe000_e1bc => {
                self.word(&self.nvic.enabled, address)
            }
            0xe000_e200..=0xe000_e23c | 0xe000_e280..=0xe000_e2bc => {
                self.word(&self.nvic.pending, address)
            }
            0xe000_e300..=0xe000_e33c => self.word(&self.nvic.active, address),
            0xe000_e400..=0xe000_e5ec => self.priorities(address - 0xe000_e400 + FIRST),
            0xe000_ed00..=0xe000_edfc => self.read_control(address, ipsr),
            _ => self.read_float(address),
        }
    }

    fn read_control(&self, address: u32, ipsr: u32) -> u32 {
        match address & 0xff {
            0x00 => self.kind.cpuid(),
            0x04 => self.icsr(ipsr),
            0x08 => self.vtor,
            0x0c => 0xfa05_0000 | self.priority_group << 8,
            0x10 => self.scr,
            0x14 => self.ccr,
            0x18..=0x20 => self.priorities(4 + (address & 0xff) - 0x18),
            0x24 => self.shcsr(),
            0x28 => self.cfsr,
            0x2c => self.hfsr,
            0x34 => self.mmfar,
            0x38 => self.bfar,
            0x88 => self.cpacr,
            0xfc => self.demcr,
            _ => 0,
        }
    }

    fn read_float(&self, address: u32) -> u32 {
        let has = self.kind != CoreKind::CortexM0Plus;
        match address & 0xffff {
            0xef34 if has => self.fpccr,
            0xef38 if has => self.fpcar,
            0xef3c if has => self.fpdscr,
            0xef40 if has => 0x1011_0021,
            0xef44 if has && self.kind == CoreKind::CortexM4 => 0x1100_0011,
            0xef44 if has => 0x1200_0011,
            0xef48 if has && self.kind == CoreKind::CortexM33 => 0x0000_0040,
            _ => 0,
        }
    }

    fn write(&mut self, address: u32, value: u32, now: u64) {
        match address {
            0xe000_1000 => self.change_counter(now, |s| s.dwt_control = value & 1),
            0xe000_1004 => {
                self.cyccnt = if self.counts_cycles() {
                    value.wrapping_sub(now as u32)
                } else {
                    value
                };
            }
            0xe000_e010..=0xe000_e01c => self.systick.write(address & 15, value, now),
            0xe000_e100..=0xe000_e13c => {
                self.change_bits(address, value, |nvic| &mut nvic.enabled, true)
            }
            0xe000_e180..=0xe000_e1bc => {
                self.change_bits(address, value, |nvic| &mut nvic.enabled, false)
            }
            0xe000_e200..=0xe000_e23c => {
                self.change_bits(address, value, |nvic| &mut nvic.pending, true)
            }
            0xe000_e280..=0xe000_e2bc => {
                self.change_bits(address, value, |nvic| &mut nvic.pending, false)
            }
            0xe000_edfc => self.change_counter(now, |s| s.demcr = value & 0x0100_07f1),
            0xe000_ef00 => self.nvic.set_pending(FIRST + (value & 0x1ff), true),
            _ => self.write_control(address, value),
        }
    }

    fn write_control(&mut self, address: u32, value: u32) {
        let v6 = self.kind == CoreKind::CortexM0Plus;
        match address {
            0xe000_e400..=0xe000_e5ec | 0xe000_ed18..=0xe000_ed20 => {
                self.write_part(address, 4, value)
            }
            0xe000_ed04 => self.write_icsr(value),
            0xe000_ed08 => self.vtor = value & if v6 { !0xff } else { !0x7f },
            0xe000_ed0c => self.write_aircr(value),
            0xe000_ed10 => self.scr = value & 0x1e,
            0xe000_ed14 if !v6 => {
                self.ccr =
                    value & 0x031b | self.ccr & 1 << 9 | u32::from(self.kind == CoreKind::CortexM33)
            }
            0xe000_ed24 => self.write_shcsr(value),
            0xe000_ed28 => self.cfsr &= !value,
            0xe000_ed2c => self.hfsr &= !value,
            0xe000_ed34 => self.mmfar = value,
            0xe000_ed38 => self.bfar = value,
            0xe000_ed88 if !v6 => self.cpacr = value & 0x00f0_ffff,
            0xe000_ef34 if !v6 => self.fpccr = value & (FPCCR_RESET | self.kind.fpccr_status()),
            0xe000_ef38 if !v6 => self.fpcar = value & !7,
            0xe000_ef3c if !v6 => self.fpdscr = value & 0x07c0_0000,
            _ => {}
        }
    }

    /// Bytes and halfwords exist for priorities and the fault status; elsewhere they are ignored.
    fn write_part(&mut self, address: u32, size: u32, value: u32) {
        let first = match address {
            0xe000_e400..=0xe000_e5ef => address - 0xe000_e400 + FIRST,
            0xe000_ed18..=0xe000_ed23 => address - 0xe000_ed18 + 4,
            0xe000_ed28..=0xe000_ed2b => {
                self.cfsr &= !(value << (8 * (address & 3)));
                return;
            }
            _ => return,
        };
        let mask = self.priority_mask() as u8;
        for i in 0..size {
            let number = (first + i) as usize;
            let can_be_set = number >= FIRST as usize || self.has_priority(number as u32);
            if let Some(priority) = self.nvic.priority.get_mut(number).filter(|_| can_be_set) {
                *priority = (value >> (8 * i)) as u8 & mask;
            }
        }
    }

    /// Whether a system exception's priority can be set.
    fn has_priority(&self, number: u32) -> bool {
        let faults = self.kind != CoreKind::CortexM0Plus && matches!(number, 4..=6 | 12);
        faults || matches!(number, SV_CALL | PEND_SV | SYS_TICK)
    }

    /// Four priorities from an exception on.
    fn priorities(&self, first: u32) -> u32 {
        let byte = |i: u32| {
            self.nvic
                .priority
                .get((first + i) as usize)
                .map_or(0, |p| u32::from(*p))
        };
        (0..4).fold(0, |word, i| word | byte(i) << (8 * i))
    }

    /// 32 interrupts of a set, by the register's address.
    fn word(&self, bits: &nvic::Bits, address: u32) -> u32 {
        let first = FIRST + (address & 0x3f) / 4 * 32;
        (0..32).fold(0, |word, i| {
            word | u32::from(nvic::get(bits, first + i)) << i
        })
    }

    fn change_bits(
        &mut self,
        address: u32,
        value: u32,
        set: fn(&mut super::Nvic) -> &mut nvic::Bits,
        to: bool,
    ) {
        let first = FIRST + (address & 0x3f) / 4 * 32;
        let count = self.nvic.count;
        for number in (0..32)
            .filter(|i| value >> i & 1 != 0)
            .map(|i| first + i)
            .filter(|n| *n < count)
        {
            let word = &mut set(&mut self.nvic)[number as usize / 64];
            *word = *word & !(1 << (number % 64)) | u64::from(to) << (number % 64);
        }
    }

    fn icsr(&self, ipsr: u32) -> u32 {
        let pending = |number: u32, place: u32| u32::from(self.nvic.is_pending(number)) << place;
        let interrupts = (FIRST..self.nvic.count).any(|n| self.nvic.is_pending(n));
        let next = self.nvic.next().map_or(0, |(number, _)| number);
        let only = self.nvic.active_priorities().count() <= 1;
        pending(NMI, 31)
            | pending(PEND_SV, 28)
            | pending(SYS_TICK, 26)
            | u32::from(interrupts) << 22
            | next << 12
            | u32::from(only) << 11
            | ipsr
    }

    fn write_icsr(&mut self, value: u32) {
        for (place, number, to) in [
            (31, NMI, true),
            (28, PEND_SV, true),
            (27, PEND_SV, false),
            (26, SYS_TICK, true),
            (25, SYS_TICK, false),
        ] {
            if value >> place & 1 != 0 {
                self.nvic.set_pending(number, to);
            }
        }
    }

    fn write_aircr(&mut self, value: u32) {
        if value >> 16 != VECTKEY {
            return;
        }
        if self.kind != CoreKind::CortexM0Plus {
            self.priority_group = value >> 8 & 7;
        }
        self.reset |= value & 4 != 0;
    }

    /// Active and pending bits of the system exceptions, and the enables.
    fn shcsr(&self) -> u32 {
        let active = SHCSR_ACTIVE.iter().fold(0, |w, (n, place)| {
            w | u32::from(self.nvic.is_active(*n)) << place
        });
        let pending = SHCSR_PENDING.iter().fold(0, |w, (n, place)| {
            w | u32::from(self.nvic.is_pending(*n)) << place
        });
        self.faults_enabled | active | pending
    }

    fn write_shcsr(&mut self, value: u32) {
        if self.kind != CoreKind::CortexM0Plus {
            self.faults_enabled = value & 7 << 16;
            SHCSR_ACTIVE
                .iter()
                .for_each(|(n, place)| self.nvic.set_active(*n, value >> place & 1 != 0));
        }
        SHCSR_PENDING
            .iter()
            .for_each(|(n, place)| self.nvic.set_pending(*n, value >> place & 1 != 0));
    }

    /// Whether a fault goes to its own handler rather than to HardFault.
    pub(crate) fn is_fault_enabled(&self, number: u32) -> bool {
        (4..=6).contains(&number) && self.faults_enabled >> (12 + number) & 1 != 0
    }
}

const SHCSR_ACTIVE: &[(u32, u32)] = &[
    (4, 0),
    (5, 1),
    (6, 3),
    (SV_CALL, 7),
    (PEND_SV, 10),
    (SYS_TICK, 11),
];
const SHCSR_PENDING: &[(u32, u32)] = &[(6, 12), (4, 13), (5, 14), (SV_CALL, 15)];
