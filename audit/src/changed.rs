//! Files of small images with random changes: whatever they are, they are refused for a reason or
//! are the same image, and nothing panics.

use crate::certificate::Certificate;
use crate::elf::tests::{Section, file};
use crate::elf::{CERTIFICATE, Elf, KERNELS};
use crate::executed::Random;
use crate::made::Image;
use crate::{audit, check_ranges};

const KERNEL: &str = "kernel k @44100 {
  in x: u16 [0..9]
  out y: i16 [-9..18]
  cell z: i32 x 2 [0..18] = 0
  table t = { 1, 2 }
  tick {
    v0: i32 [0..9] = in x
    v1: i32 [0..18] = add v0 v0
    v2: i1 [0..1] = lt v0 v1
    v3: i32 [0..18] = if v2 {
      set z v1
      yield v1
    } else {
      yield v0
    }
    v4: i32 [0..18] = loop 2 (v5: i32 [0..1], v6: i32 [0..18] = v3) {
      v7: i32 [1..2] = lookup t v5 0
      yield v6
    }
    out y v4
  }
}
";

/// A handler with a loop, a division and a branch, in a file.
fn image() -> Vec<u8> {
    let texts = [
        "push {r4, lr}",
        "movs r0, #9",
        "udiv r2, r0, r1",
        "cbz r2, .+6",
        "subs r0, #1",
        "bne .-8",
        "pop {r4, pc}",
    ];
    let mut image = Image::new(&texts, &[], Vec::new());
    image.certificate.kernels = crate::number_of(KERNEL);
    let image = image.prove().expect("it is proven");
    let text = image.certificate.to_string();
    let of = |own: &crate::Section| {
        let flags = 2 | u32::from(own.writable) | u32::from(own.code) << 2;
        let bytes = (own.base..own.base + own.size).map(|at| image.elf.byte(at).unwrap_or(0));
        (
            own.name.clone(),
            flags,
            own.base,
            bytes.collect::<Vec<u8>>(),
        )
    };
    let all: Vec<_> = image.elf.sections.iter().map(of).collect();
    let mut sections: Vec<Section> = all
        .iter()
        .map(|(name, flags, base, bytes)| (name.as_str(), 1, *flags, *base, &bytes[..]))
        .collect();
    sections.push((CERTIFICATE, 1, 0, 0, text.as_bytes()));
    sections.push((KERNELS, 1, 0, 0, KERNEL.as_bytes()));
    file(&sections)
}

/// Code and constants, certificate, Kernels.
type Accepted = (Vec<(u32, u64)>, Certificate, Option<String>);

/// What is accepted of a file: its code and constants, its certificate, its Kernels.
fn accepted(file: &[u8]) -> Result<Accepted, String> {
    let elf = Elf::read(file)?;
    let certificate = Certificate::read(elf.certificate.as_deref().unwrap_or_default())?;
    audit(&elf, &certificate).map_err(|why| why.to_string())?;
    check_ranges(elf.kernels.as_deref().unwrap_or_default()).map_err(|why| why.to_string())?;
    Ok((elf.constants(), certificate, elf.kernels))
}

/// Looks at code and Kernels even where the certificate is of others.
fn follow(file: &[u8]) -> Option<()> {
    let elf = Elf::read(file).ok()?;
    let mut certificate = Certificate::read(elf.certificate.as_deref()?).ok()?;
    let kernels = elf.kernels.as_deref()?;
    certificate.kernels = crate::number_of(kernels);
    certificate.sections = elf.constants();
    let found = (audit(&elf, &certificate), check_ranges(kernels));
    found.0.ok().zip(found.1.ok()).map(|_| ())
}

/// A number that is read where another one was.
fn number(random: &mut Random) -> u32 {
    let power = 1_u32 << random.below(32);
    match random.below(4) {
        0 => power,
        1 => power.wrapping_sub(1),
        2 => power.wrapping_neg(),
        _ => random.below(64),
    }
}

/// Bytes, words and ends of a file that are others.
fn change(file: &mut Vec<u8>, random: &mut Random) {
    let length = file.len() as u32;
    for _ in 0..=random.below(3) {
        let at = random.below(length) as usize;
        match random.below(8) {
            0 => file.truncate(at.max(52)),
            1 | 2 if at + 4 <= file.len() => {
                let at = at & !3;
                file[at..at + 4].copy_from_slice(&number(random).to_le_bytes());
            }
            // In its header, in those of segments, or in the table of sections at its end.
            3 | 4 => {
                let headers = [52 + 32 * 6, 40 * 9][random.below(2) as usize];
                let nth = random.below(headers) as usize;
                let at = if headers == 40 * 9 {
                    file.len().saturating_sub(1 + nth)
                } else {
                    nth
                };
                if let Some(byte) = file.get_mut(at) {
                    *byte = number(random) as u8;
                }
            }
            5 => {
                if let Some(byte) = file.get_mut(at).filter(|byte| byte.is_ascii_digit()) {
                    *byte = b'0' + random.below(10) as u8;
                }
            }
            _ => {
                if let Some(byte) = file.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
        }
    }
}

/// The same, but for names and what nothing meets; more banks that are fetched from are true as
/// well.
fn without_unmet(mut certificate: Certificate, own: &Certificate) -> Certificate {
    certificate.deadline = own.deadline;
    certificate.memories.clone_from(&own.memories);
    certificate.buses.clone_from(&own.buses);
    let frames = certificate.frames.iter_mut().zip(&own.frames);
    for (function, own) in frames.flat_map(|(a, b)| a.functions.iter_mut().zip(&b.functions)) {
        if function.fetched & own.fetched == own.fetched {
            function.fetched = own.fetched;
        }
        function.name.clone_from(&own.name);
    }
    certificate
}

#[test]
fn a_file_with_random_changes_is_refused_or_the_same() {
    let whole = image();
    let own = accepted(&whole).expect("it is accepted");
    let cases =
        std::env::var("WHIPPEN_CASES").map_or(4_000, |cases| cases.parse().expect("a number"));
    let (mut random, mut refused) = (Random(11), 0);
    for _ in 0..cases {
        let mut file = whole.clone();
        change(&mut file, &mut random);
        match accepted(&file) {
            Err(_) => {
                refused += 1;
                follow(&file);
            }
            Ok((constants, certificate, kernels)) => {
                let certificate = without_unmet(certificate, &own.1);
                let found = (&constants, &certificate, &kernels);
                assert_eq!(found, (&own.0, &own.1, &own.2));
            }
        }
    }
    println!("{refused} of {cases} refused");
    assert!(refused > cases / 2);
}
