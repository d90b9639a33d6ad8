//! Placement of data: what a core uses at every turn goes into the memory near it, as long as there
//! is room beside its stack.

use whippen_arm::image::{Board, Image, LinkError, Memory, Object, Section, SectionKind};
use whippen_keyboard::CoreId;

use super::CORES;
use super::code::{ProgramCode, ZoneCode};

/// Bytes kept for the stack of a core: twice what the bound says that it needs.
const STACK_BYTES: u32 = 512;

/// Moves what a core uses at every turn into the memory that is near it, as long as there is room:
/// there nobody fetches and the other core seldom looks, so nothing waits. First the keys' states,
/// then their histories, then what the frame keeps of them.
pub(super) fn place_near(board: &Board, firmware: &mut [Object], programs: &mut [ProgramCode]) {
    let cores = (0..).map(CoreId).zip(CORES);
    for (core, name) in cores.take(board.stacks.len()) {
        let Some(memory) = board.memory_for(&format!(".data.near.{name}")) else {
            continue;
        };
        let mut room = room_beside(board, memory, &board.stacks, firmware);
        let zones = programs
            .iter_mut()
            .flat_map(|program| &mut program.cores[core].zones);
        let (mut states, mut histories) = (Vec::new(), Vec::new());
        for ZoneCode { built, .. } in zones {
            let sections = built.object.sections.iter_mut();
            let mut data = sections.filter(|section| section.kind == SectionKind::Data);
            states.extend(data.next());
            histories.extend(data.next());
        }
        let guards = firmware.iter_mut().flat_map(|object| &mut object.sections);
        let guards = guards.filter(|section| section.name == format!(".bss.{name}.guards"));
        for section in states.into_iter().chain(histories).chain(guards) {
            let near = section
                .name
                .replacen(&format!(".{name}"), &format!(".near.{name}"), 1);
            let bytes = section.size.next_multiple_of(4);
            if bytes <= room && board.memory_for(&near) == Some(memory) {
                room -= bytes;
                section.name = near;
            }
        }
    }
}

/// Bytes of a memory that neither a stack nor what must lie there takes.
fn room_beside(board: &Board, memory: &Memory, stacks: &[u32], firmware: &[Object]) -> u32 {
    let has_stack = stacks.iter().any(|stack| grows_in(memory, *stack));
    let stack_bytes = if has_stack { STACK_BYTES } else { 0 };
    let inside = |section: &&Section| board.memory_for(&section.name) == Some(memory);
    let sections = firmware.iter().flat_map(|object| &object.sections);
    let taken: u32 = sections
        .filter(inside)
        .map(|section| section.size + 3)
        .sum();
    memory
        .size
        .saturating_sub(stack_bytes)
        .saturating_sub(taken)
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
