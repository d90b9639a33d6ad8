//! What is claimed of a whole image, and how a refusal reads.

use crate::made::{HANDLER, Image};
use crate::{Refusal, core_of, hash, number_of, table_of};

#[test]
fn a_core_is_found_by_its_name() {
    let names = ["cortex-m0plus", "cortex-m4", "cortex-m33"];
    let tables = names.map(|name| {
        let core = core_of(name).expect("a core");
        assert_eq!(core.name, name);
        table_of(&core)
    });
    assert!(tables[0] != tables[1] && tables[1] != tables[2] && tables[0] != tables[2]);
    assert!(core_of("cortex-m7").is_none() && core_of("").is_none());
    // Another number of the table, another number that stands for it.
    let mut other = core_of(names[2]).expect("a core");
    other.exceptions.entry.cycles += 1;
    assert_ne!(table_of(&other), tables[2]);
    // The numbers of FNV-1a.
    assert_eq!(hash(b""), 0xcbf2_9ce4_8422_2325);
    assert_eq!(number_of("a"), 0xaf63_dc4c_8601_ec8c);
    assert_eq!(number_of("foobar"), 0x8594_4171_f739_67e8);
}

#[test]
fn an_image_is_that_of_its_certificate() {
    let image = Image::new(&["bx lr"], &[], Vec::new());
    let image = image.prove().expect("it is proven");
    let with = |change: &dyn Fn(&mut Image)| {
        let mut other = image.clone();
        change(&mut other);
        other.why()
    };
    assert_eq!(with(&|_| ()), "");
    type Change = fn(&mut Image);
    let changes: [(Change, &str); 6] = [
        (
            |own| own.certificate.core = "cortex-m7".to_string(),
            "`cortex-m7` is no core",
        ),
        (
            |own| own.certificate.table += 1,
            "the cycles of the core are not those that it is proven with",
        ),
        (
            |own| own.certificate.sections[0].1 += 1,
            "code or constants are not those that the certificate is of",
        ),
        (
            |own| own.certificate.kernels += 1,
            "the Kernels are not those that the certificate is of",
        ),
        (
            |own| own.elf.kernels = Some("kernel".to_string()),
            "the Kernels are not those that the certificate is of",
        ),
        (
            |own| own.certificate.cores = 0,
            "not every core has a frame for every program",
        ),
    ];
    for (change, why) in changes {
        assert_eq!(with(&change), why);
    }
}

#[test]
fn a_refusal_says_where() {
    let why = Refusal::new("is wrong".to_string());
    assert_eq!(why.to_string(), "is wrong");
    let at = Refusal::at(HANDLER, "is wrong");
    assert_eq!(at.to_string(), "0x20000000 is wrong");
    // The innermost function is told.
    let within = at.in_function("a").in_function("b");
    assert_eq!(within.to_string(), "in `a`: 0x20000000 is wrong");
}
