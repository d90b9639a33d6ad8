//! The memory of a running board, as a debugger sees it: symbols, words, the cores' blocks.

use whippen_compiler::firmware::{CORES, ZoneCode};

use super::Emulated;

impl Emulated {
    /// A word of a core's block, by its offset ([`whippen_compiler::firmware::core_block`]).
    pub(super) fn block(&self, core: usize, offset: u32) -> Result<u32, String> {
        self.word(self.symbol(CORES[core])? + offset)
    }

    /// So many words of a cell of the first key of whoever has a cell of this name.
    pub(crate) fn cell_words(&self, name: &str, count: usize) -> Result<Vec<i32>, String> {
        for core in self.cores() {
            for zone in self.zones(core) {
                let kernel = &self.kernels[self.program().instrument_of(zone).index()];
                let cell = kernel.cells.iter().position(|cell| cell.name == name);
                let Some(at) = cell.and_then(|cell| zone.layout().cell(0, cell)) else {
                    continue;
                };
                let mut bytes = vec![0; 4 * count];
                self.read(self.state_of(zone)? + at, &mut bytes)?;
                let word = |four: &[u8]| four.iter().rev().fold(0, |w, b| w << 8 | u32::from(*b));
                return Ok(bytes
                    .chunks_exact(4)
                    .map(|four| word(four) as i32)
                    .collect());
            }
        }
        Err(format!("the board has no cell `{name}`"))
    }

    /// Where the state of a zone's keys is.
    pub(super) fn state_of(&self, zone: &ZoneCode) -> Result<u32, String> {
        self.symbol(&format!("{}_state", zone.name))
    }

    /// The address of a symbol.
    pub(super) fn symbol(&self, name: &str) -> Result<u32, String> {
        let mut symbols = self.image.image.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == name);
        found
            .map(|symbol| symbol.address)
            .ok_or_else(|| format!("the image has no `{name}`"))
    }

    /// The word at an address.
    pub(super) fn word(&self, address: u32) -> Result<u32, String> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Reads from an address on.
    pub(super) fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), String> {
        let memory = &self.machine.bus.memory;
        memory.read(address, bytes).map_err(|e| e.to_string())
    }

    /// Writes from an address on.
    pub(super) fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), String> {
        let memory = &mut self.machine.bus.memory;
        memory.write(address, bytes).map_err(|e| e.to_string())
    }
}
