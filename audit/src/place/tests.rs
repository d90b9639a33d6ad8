//! Where one claim about stack and pointers holds another.

use super::{Place, Tag};

#[test]
fn a_place_covers_whoever_claims_more() {
    let mut more = Place::entered();
    more.sp = -8;
    more.registers[4] = Some(Tag::Section(0x100));
    more.slots = vec![(-8, Tag::Section(0x200)), (-4, Tag::Return(0, 0))];
    let covers = |change: &dyn Fn(&mut Place)| {
        let mut own = more.clone();
        change(&mut own);
        own.covers(&more, |register| {
            (register == 5).then_some(Tag::Section(0x300))
        })
    };
    assert!(covers(&|_| ()));
    // Less of a register or a slot, and what else is known.
    assert!(covers(&|own| own.registers[4] = None));
    assert!(covers(&|own| own.slots.retain(|slot| slot.0 != -8)));
    assert!(covers(&|own| own.registers[5] = Some(Tag::Section(0x300))));
    // More than is known, or something else.
    assert!(!covers(&|own| own.registers[6] = Some(Tag::Section(0x300))));
    assert!(!covers(&|own| own.registers[5] = Some(Tag::Section(0x100))));
    assert!(!covers(&|own| own.registers[14] = Some(Tag::Return(1, 0))));
    assert!(!covers(&|own| own.slots[1].1 = Tag::Return(0, 4)));
    assert!(!covers(&|own| own.slots.push((-12, Tag::Section(0x200)))));
    assert!(!covers(&|own| own.sp = -4));
}
