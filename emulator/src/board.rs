//! A board as data: which core, how many, and what lies where.

use whippen_isa::Arch;

use crate::fabric::Banks;
use crate::lines::Start;

/// A core that the emulator knows.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum CoreKind {
    /// ARMv6-M, as in RP2040.
    CortexM0Plus,
    /// ARMv7E-M with FPv4-SP.
    CortexM4,
    /// ARMv8-M Mainline with the DSP extension and FPv5-SP, as in RP2350.
    CortexM33,
}

impl CoreKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::CortexM0Plus, Self::CortexM4, Self::CortexM33];

    /// The name that the command line uses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CortexM0Plus => "cortex-m0plus",
            Self::CortexM4 => "cortex-m4",
            Self::CortexM33 => "cortex-m33",
        }
    }

    /// The architecture it implements.
    pub const fn arch(self) -> Arch {
        match self {
            Self::CortexM0Plus => Arch::V6M,
            Self::CortexM4 => Arch::V7EM,
            Self::CortexM33 => Arch::V8M,
        }
    }

    /// Its cycles.
    pub(crate) fn timing(self) -> whippen_isa::timing::Core {
        use whippen_isa::timing::Core;
        match self {
            Self::CortexM0Plus => Core::cortex_m0plus(),
            Self::CortexM4 => Core::cortex_m4(),
            Self::CortexM33 => Core::cortex_m33(),
        }
    }

    /// The bits of FPCCR that entry to an exception sets or clears: LSPACT, USER, THREAD, HFRDY,
    /// MMRDY, BFRDY, MONRDY; in ARMv8-M S, SFRDY, SPLIMVIOL and UFRDY too.
    pub(crate) const fn fpccr_status(self) -> u32 {
        match self {
            Self::CortexM0Plus => 0,
            Self::CortexM4 => 0x17b,
            Self::CortexM33 => 0x7ff,
        }
    }

    /// CPUID: implementer Arm, and the revision that the boards have (r0p1, r0p1, r1p0).
    pub(crate) const fn cpuid(self) -> u32 {
        match self {
            Self::CortexM0Plus => 0x410c_c601,
            Self::CortexM4 => 0x410f_c241,
            Self::CortexM33 => 0x411f_d210,
        }
    }

    /// How many of a priority's 8 bits exist, from the top.
    pub(crate) const fn priority_bits(self) -> u32 {
        match self {
            Self::CortexM0Plus => 2,
            Self::CortexM4 | Self::CortexM33 => 4,
        }
    }
}

/// A run of plain memory.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Region {
    /// For messages.
    pub name: String,
    /// First address, a multiple of 4096.
    pub base: u32,
    /// Size, a multiple of 4096, not zero.
    pub bytes: u32,
    /// Whether the program may store there; else a store is a bus fault.
    pub writable: bool,
    /// Cycles that a data read takes beyond one.
    pub read_wait: u8,
    /// Cycles that a data write takes beyond one.
    pub write_wait: u8,
    /// The base of the region whose bytes these are, when this is an alias. That region comes first
    /// in the list.
    pub mirrors: Option<u32>,
}

impl Region {
    /// RAM without wait states.
    pub fn ram(name: &str, base: u32, bytes: u32) -> Self {
        Self {
            name: name.into(),
            base,
            bytes,
            writable: true,
            read_wait: 0,
            write_wait: 0,
            mirrors: None,
        }
    }

    /// Memory that a program cannot write, without wait states.
    pub fn rom(name: &str, base: u32, bytes: u32) -> Self {
        Self {
            writable: false,
            ..Self::ram(name, base, bytes)
        }
    }

    /// Whether the address lies inside.
    pub fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.base) < self.bytes
    }

    pub(crate) fn checked_pages(&self) -> Result<u32, BoardError> {
        let page = crate::memory::PAGE as u32;
        let inside = self.base.checked_add(self.bytes.wrapping_sub(1)).is_some();
        if self.bytes == 0
            || !self.bytes.is_multiple_of(page)
            || !self.base.is_multiple_of(page)
            || !inside
        {
            return Err(BoardError::Shape {
                region: self.name.clone(),
            });
        }
        Ok(self.bytes / page)
    }
}

/// A board: cores of one kind and plain memory. Devices are attached to the machine's bus.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Board {
    /// The cores.
    pub core: CoreKind,
    /// How many, 1 to 8.
    pub cores: usize,
    /// Cycles per second, for semihosting's clock; nothing else depends on it.
    pub clock_hz: u32,
    /// Interrupt lines per core, up to 480.
    pub interrupts: usize,
    /// Plain memory.
    pub regions: Vec<Region>,
    /// The ports of its memory, where several cores or a DMA may wait for each other; empty where
    /// they never do.
    pub banks: Vec<Banks>,
    /// Where the first core finds its vector table at reset.
    pub vector_table: u32,
    /// Where the other cores begin at reset; they halt when this is absent.
    pub others: Option<Start>,
}

impl Board {
    /// One core at 150 MHz with flash at 0x08000000 (and at 0) and RAM at 0x20000000, 1 MiB each,
    /// without wait states.
    pub fn generic(core: CoreKind) -> Self {
        let flash = Region::rom("flash", 0x0800_0000, 1 << 20);
        let boot = Region {
            name: "flash at 0".into(),
            base: 0,
            mirrors: Some(flash.base),
            ..flash.clone()
        };
        let regions = vec![flash, boot, Region::ram("ram", 0x2000_0000, 1 << 20)];
        Self {
            core,
            cores: 1,
            clock_hz: 150_000_000,
            interrupts: 64,
            regions,
            vector_table: 0x0800_0000,
            banks: Vec::new(),
            others: None,
        }
    }
}

/// Why a board cannot be.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum BoardError {
    /// A region's base or size is no multiple of 4096, it is empty, or it leaves the address space.
    Shape {
        /// Its name.
        region: String,
    },
    /// Two regions share addresses, or an alias is of something that is not memory.
    Overlap {
        /// The later one.
        region: String,
    },
    /// No core, or more than eight.
    Cores,
    /// More than 480 interrupts.
    Interrupts,
}

impl std::fmt::Display for BoardError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Shape { region } => write!(
                f,
                "{region}: base and size must be multiples of 4096 within 32 bits"
            ),
            Self::Overlap { region } => {
                write!(f, "{region}: overlaps another region, or mirrors no memory")
            }
            Self::Cores => f.write_str("a board has one to eight cores"),
            Self::Interrupts => f.write_str("a board has at most 480 interrupts"),
        }
    }
}

impl std::error::Error for BoardError {}
