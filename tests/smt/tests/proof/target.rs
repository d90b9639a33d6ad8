//! One key of a kernel as code for a core, linked, and where its state keeps what.

use whippen_arm::image::{
    Board, Image, Input, Memory, MemoryKind, Placement, SectionKind, Start, link,
};
use whippen_arm::thumb::{Options, StateLayout, compile};
use whippen_board::AccessTime;
use whippen_isa::Arch;
use whippen_modes::Modes;

/// Where everything lies.
pub const RAM: u32 = 0x2000_0000;
const RAM_BYTES: u32 = 0x10_0000;
/// Where the stack ends.
pub const STACK: u32 = RAM + RAM_BYTES;
const STACK_BYTES: u32 = 0x1000;

/// The code of one key.
pub struct Target {
    pub layout: StateLayout,
    /// Where the state is.
    pub state: u32,
    /// Pieces of code and constants.
    pub code: Vec<(u32, Vec<u8>)>,
    /// What memory holds at first.
    pub data: Vec<(u32, Vec<u8>)>,
    image: Image,
}

impl Target {
    /// Code of modes for an architecture.
    ///
    /// # Errors
    /// What the compiler or the linker says.
    pub fn new(modes: &Modes, arch: Arch) -> Result<Target, String> {
        let options = Options {
            name: "k".into(),
            keys: 1,
            gain: false,
            probes: true,
            arch,
        };
        let built = compile(modes, &options).map_err(|error| error.to_string())?;
        let input = Input {
            object: &built.object,
            places: &[],
        };
        let image = link(&memory(arch), &[input], "k_tick").map_err(|error| error.to_string())?;
        let of = |is_data: bool| {
            let own = image.sections.iter();
            let own = own.filter(|section| (section.kind == SectionKind::Data) == is_data);
            own.map(|section| (section.run, section.bytes.clone()))
                .collect()
        };
        let (code, data) = (of(false), of(true));
        let mut target = Target {
            layout: built.layout,
            state: 0,
            code,
            data,
            image,
        };
        target.state = target.address("k_state").ok_or("no state")?;
        Ok(target)
    }

    /// Where a symbol is.
    pub fn address(&self, symbol: &str) -> Option<u32> {
        let mut symbols = self.image.symbols.iter();
        let found = symbols.find(|known| known.name == symbol)?;
        Some(found.address & !1)
    }
}

fn memory(arch: Arch) -> Board {
    let ram = Memory {
        name: "ram".to_string(),
        base: RAM,
        size: RAM_BYTES - STACK_BYTES,
        kind: MemoryKind::Ram,
        access: AccessTime::Cycles(1),
        fetch: AccessTime::Cycles(1),
        banks: vec![0],
        striped: false,
    };
    Board {
        name: "proof".to_string(),
        arch,
        cores: 1,
        clock_hz: 150_000_000,
        start: Start::Vectors,
        uf2_family: None,
        places: vec![Placement {
            pattern: "*".to_string(),
            memory: ram.name.clone(),
        }],
        knob: None,
        bench: None,
        columns: None,
        i2s: None,
        fetches_apart: arch != Arch::V6M,
        banks: vec!["RAM".to_string()],
        memory: vec![ram],
        buses: Vec::new(),
        devices: Vec::new(),
        converter_interrupt: 0,
        stacks: vec![STACK],
    }
}
