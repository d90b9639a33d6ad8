//! Placement: what a core uses at every turn goes into the memory near it, beside its stack, so
//! that its fetches and its data are in different banks.
//!
//! ```text
//!   everything that keys and frame keep has room     data near, code in the group
//!   it has not, but all code of the ticks has        code near, data in the group
//!   neither                                          as much of the data as has room near
//! ```

use whippen_arm::image::{Board, Image, LinkError, Memory, Object, Section, SectionKind};
use whippen_arm::thumb::Built;
use whippen_keyboard::CoreId;

use super::CORES;
use super::code::ProgramCode;
use super::image::has_helper;
use super::tuning;

/// Bytes kept for the stack of a core: twice what the bound says that it needs.
pub(super) const STACK_BYTES: u32 = 256;

/// Moves what a core uses at every turn into the memory that is near it, as long as there is room.
pub(super) fn place_near(board: &Board, firmware: &mut [Object], programs: &mut [ProgramCode]) {
    let cores = (0..).map(CoreId).zip(CORES);
    let playing = programs.first().map_or(0, |program| program.cores.len());
    let playing = playing + usize::from(has_helper(programs));
    for (core, name) in cores.take(playing) {
        let Some(memory) = board.memory_for(&format!(".data.near.{name}")) else {
            continue;
        };
        let near = Near {
            board,
            memory,
            core,
            name,
        };
        let room = near.room(firmware, programs);
        if near.data_bytes(firmware, programs) <= room || !near.place_code(firmware, programs) {
            near.place_data(room, firmware, programs);
        }
    }
}

/// The memory near a core.
struct Near<'a> {
    board: &'a Board,
    memory: &'a Memory,
    core: CoreId,
    name: &'a str,
}

impl Near<'_> {
    /// What may move there: the keys' states, then their histories, then what the frame keeps of
    /// them.
    fn data<'s>(
        &self,
        firmware: &'s mut [Object],
        programs: &'s mut [ProgramCode],
    ) -> Vec<&'s mut Section> {
        let (mut states, mut histories) = (Vec::new(), Vec::new());
        for built in self.built(programs) {
            let sections = built.object.sections.iter_mut();
            let mut data = sections.filter(|section| section.kind == SectionKind::Data);
            states.extend(data.next());
            histories.extend(data.next());
        }
        let guards = firmware.iter_mut().flat_map(|object| &mut object.sections);
        let own = [
            format!(".bss.{}.guards", self.name),
            tuning::section(self.name),
        ];
        let guards = guards.filter(|section| own.contains(&section.name));
        states.into_iter().chain(histories).chain(guards).collect()
    }

    fn built<'s>(
        &self,
        programs: &'s mut [ProgramCode],
    ) -> impl Iterator<Item = &'s mut Built> + use<'s> {
        let core = self.core;
        programs.iter_mut().flat_map(move |own| own.built_mut(core))
    }

    /// The code that runs in ticks.
    fn code<'s>(
        &self,
        firmware: &'s mut [Object],
        programs: &'s mut [ProgramCode],
    ) -> Vec<&'s mut Section> {
        let own = format!(".text.{}", self.name);
        let is_of_tick = move |section: &&mut Section| {
            let part = section.name.rsplit('.').next().unwrap_or_default();
            section.name.starts_with(&own) && ["frame", "zones"].contains(&part)
        };
        let frames = firmware.iter_mut().flat_map(|object| &mut object.sections);
        let keys = self.built(programs);
        let keys = keys.flat_map(|built| &mut built.object.sections);
        let keys = keys.filter(|section| section.kind == SectionKind::Code);
        frames.filter(is_of_tick).chain(keys).collect()
    }

    /// Bytes of all that.
    fn data_bytes(&self, firmware: &mut [Object], programs: &mut [ProgramCode]) -> u32 {
        let data = self.data(firmware, programs);
        data.iter().map(|section| bytes(section)).sum()
    }

    /// Bytes that neither a stack nor what lies there already takes.
    fn room(&self, firmware: &[Object], programs: &[ProgramCode]) -> u32 {
        let stacks = &self.board.stacks;
        let has_stack = stacks.iter().any(|stack| grows_in(self.memory, *stack));
        let stack_bytes = if has_stack { STACK_BYTES } else { 0 };
        let built = programs.iter().flat_map(ProgramCode::built);
        let keys = built.map(|built| &built.object);
        let sections = firmware.iter().chain(keys).flat_map(|own| &own.sections);
        let inside = |section: &&Section| self.board.memory_for(&section.name) == Some(self.memory);
        let taken: u32 = sections.filter(inside).map(bytes).sum();
        self.memory
            .size
            .saturating_sub(stack_bytes)
            .saturating_sub(taken)
    }

    /// Moves the code near, and what lay there to the group; says whether it has room there. If
    /// not, nothing is moved.
    fn place_code(&self, firmware: &mut [Object], programs: &mut [ProgramCode]) -> bool {
        let mut moved = firmware.to_vec();
        let near = format!(".near.{}", self.name);
        for section in moved.iter_mut().flat_map(|object| &mut object.sections) {
            section.name = section.name.replacen(&near, &format!(".{}", self.name), 1);
        }
        let room = self.room(&moved, programs);
        let code = self.code(&mut moved, programs);
        let lies_near = |section: &&mut Section| {
            self.board.memory_for(&self.near(section)) == Some(self.memory)
        };
        let taken: u32 = code.iter().map(|section| bytes(section)).sum();
        if taken > room || !code.iter().all(lies_near) {
            return false;
        }
        code.into_iter()
            .for_each(|section| section.name = self.near(section));
        firmware.clone_from_slice(&moved);
        true
    }

    /// As much of the data as has room.
    fn place_data(&self, mut room: u32, firmware: &mut [Object], programs: &mut [ProgramCode]) {
        for section in self.data(firmware, programs) {
            let near = self.near(section);
            let bytes = bytes(section);
            if bytes <= room && self.board.memory_for(&near) == Some(self.memory) {
                room -= bytes;
                section.name = near;
            }
        }
    }

    /// What a section is called near the core.
    fn near(&self, section: &Section) -> String {
        let own = format!(".{}", self.name);
        section.name.replacen(&own, &format!(".near{own}"), 1)
    }
}

/// Bytes of a section, and what aligns the next one.
fn bytes(section: &Section) -> u32 {
    section.size.next_multiple_of(4)
}

/// Whether a stack that begins below an address grows in a memory.
fn grows_in(memory: &Memory, stack: u32) -> bool {
    (memory.base + 1..=memory.base + memory.size).contains(&stack)
}

/// That nothing lies where a stack grows down to.
pub(super) fn check_stack(image: &Image, board: &Board, stack: u32) -> Result<(), LinkError> {
    let memory = board.memory.iter().find(|memory| grows_in(memory, stack));
    let Some(memory) = memory else { return Ok(()) };
    let sections = image.sections.iter();
    let end = sections
        .filter(|section| section.memory == memory.name)
        .map(|section| section.run + section.size)
        .max()
        .unwrap_or(memory.base);
    if end + STACK_BYTES <= stack {
        return Ok(());
    }
    Err(LinkError::Full {
        memory: memory.name.clone(),
        wanted: u64::from(end - memory.base) + u64::from(STACK_BYTES),
        size: stack - memory.base,
    })
}
