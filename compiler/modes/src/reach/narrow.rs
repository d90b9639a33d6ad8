//! Narrowing after the widening: each mode's entry ranges are cut to the union of what the leaves
//! that lead to it (or `init`) leave behind.
//!
//! What holds on entry of every mode holds after a tick as the leaves say, so the cut ranges hold
//! too. With trees grown again under them, the leaves say still less: a hammer that was low a tick
//! ago cannot be at the string now.

use std::rc::Rc;

use super::super::decision_tree::{Discrete, TooBig, Tree};
use super::super::facts::meet;
use super::{Reached, classes};
use crate::tuning;
use whippen_kernel::Range;

/// Modes with their classes, and where cells lie on their entry.
type Entries = Vec<(Vec<usize>, Vec<Range>)>;

/// Those modes that are entered at all, and with what; none if nothing is new.
pub(super) fn narrower(
    modes: &[Reached],
    discrete: &[Discrete],
    start: &[Range],
) -> Option<Entries> {
    let mut found: Vec<Option<Vec<Range>>> = vec![None; modes.len()];
    for ends in std::iter::once(start).chain(modes.iter().flat_map(|mode| mode.tree.ends())) {
        let at = place(modes, discrete, ends)?;
        let entry = found[at].get_or_insert_with(|| ends.to_vec());
        entry
            .iter_mut()
            .zip(ends)
            .for_each(|(all, end)| *all = all.union(*end));
    }
    let mut changed = false;
    let entries = modes.iter().zip(found).filter_map(|(mode, entry)| {
        let cells: Option<Vec<Range>> = entry.map(|entry| {
            entry
                .iter()
                .zip(&mode.cells)
                .map(|(new, old)| meet(*new, *old))
                .collect()
        });
        changed |= cells.as_ref() != Some(&mode.cells);
        Some((mode.classes.clone(), cells?))
    });
    let entries: Entries = entries.collect();
    changed.then_some(entries)
}

/// The modes with trees grown anew; none if their leaves would not keep to what the modes are
/// entered with: which decisions come first changes with what is known, and with it what leaves can
/// tell.
pub(super) fn regrown(
    entries: Entries,
    before: &[Reached],
    (discrete, start): (&[Discrete], &[Range]),
    mut grow: impl FnMut(&[Range]) -> Result<Option<Tree>, TooBig>,
) -> Option<Vec<Reached>> {
    let mut modes = Vec::new();
    for (classes, cells) in entries {
        // What is entered as before decides as before.
        let known = before
            .iter()
            .find(|mode| mode.classes == classes && mode.cells == cells);
        let tree = match known {
            Some(mode) => mode.tree.clone(),
            None => Rc::new(grow(&cells).ok()??),
        };
        modes.push(Reached {
            classes,
            cells,
            tree,
        });
    }
    for _ in 0..tuning::REGROWTHS {
        let mut wider: Vec<Vec<Range>> = modes.iter().map(|mode| mode.cells.clone()).collect();
        for ends in std::iter::once(start).chain(modes.iter().flat_map(|mode| mode.tree.ends())) {
            let entry = &mut wider[place(&modes, discrete, ends)?];
            entry
                .iter_mut()
                .zip(ends)
                .for_each(|(all, end)| *all = all.union(*end));
        }
        let mut closed = true;
        for (mode, cells) in modes
            .iter_mut()
            .zip(wider)
            .filter(|(mode, cells)| mode.cells != *cells)
        {
            mode.tree = Rc::new(grow(&cells).ok()??);
            mode.cells = cells;
            closed = false;
        }
        if closed {
            return Some(modes);
        }
    }
    None
}

fn place(modes: &[Reached], discrete: &[Discrete], ends: &[Range]) -> Option<usize> {
    let classes = classes(discrete, ends)?;
    modes.iter().position(|mode| mode.classes == classes)
}
