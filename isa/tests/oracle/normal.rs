//! Brings two notations of the same instruction to one.
//!
//! | we print | others print | both become |
//! | --- | --- | --- |
//! | `r9` to `r12`, `cs`, `cc` | `sb`, `sl`, `fp`, `ip`, `hs`, `lo` | ours |
//! | `#255` | `#0xff` | `#255` |
//! | `#4294967295` | `#-1` | the unsigned one |
//! | `.+8`, `.-8` | `#0x1008` at address 0x1000 | the address |
//! | `add r0, pc, #8` | `adr r0, #8` | ours |
//! | `nop {5}` | `hint #5` | ours |
//! | `dmb #11` | `dmb ish` | ours |
//! | `{s0-s2}` | `{s0, s1, s2}` | the list |
//! | `#0.5` | `#5.000000e-01` | the bits of the float |
//! | `[pc, #0]` | `[pc]` | theirs |

use std::fmt::Write;

/// The text of an instruction at `address` in one notation.
pub fn text(text: &str, address: u32) -> String {
    let text = text.trim().to_ascii_lowercase();
    let (mnemonic, operands) = text.split_once(char::is_whitespace).unwrap_or((&text, ""));
    let operands: String = operands.chars().filter(|c| !c.is_whitespace()).collect();
    let mnemonic = condition(mnemonic);
    let (mnemonic, operands) = synonym(&mnemonic, &operands);
    let operands: Vec<_> = split(&operands)
        .map(|operand| one(operand, address))
        .collect();
    format!("{mnemonic} {}", operands.join(",").replace(",#0]", "]"))
        .trim()
        .to_string()
}

/// `hs` and `lo` at the end of a mnemonic, before its types.
fn condition(mnemonic: &str) -> String {
    let (stem, types) = mnemonic
        .split_once('.')
        .map_or((mnemonic, String::new()), |(s, t)| (s, format!(".{t}")));
    let stem = match (stem.strip_suffix("hs"), stem.strip_suffix("lo")) {
        (Some(rest), _) => format!("{rest}cs"),
        (_, Some(rest)) => format!("{rest}cc"),
        _ => stem.to_string(),
    };
    stem + &types
}

/// Other mnemonics for the same.
fn synonym(mnemonic: &str, operands: &str) -> (String, String) {
    if let (Some(cond), Some((d, offset))) =
        (mnemonic.strip_prefix("adr"), operands.split_once(','))
    {
        return (format!("add{cond}"), format!("{d},pc,{offset}"));
    }
    if let (Some(rest), Some(number)) = (mnemonic.strip_prefix("hint"), operands.strip_prefix('#'))
    {
        return (format!("nop{rest}"), format!("{{{}}}", one(number, 0)));
    }
    if let Some(position) = BARRIERS
        .iter()
        .position(|b| *b == operands && !b.is_empty())
    {
        return (mnemonic.to_string(), format!("#{position}"));
    }
    if mnemonic.starts_with("vcmp") {
        return (mnemonic.to_string(), operands.replace("#0.0", "#0"));
    }
    (mnemonic.to_string(), operands.to_string())
}

/// The options of DMB by number; M profile has only `sy`.
const BARRIERS: [&str; 16] = [
    "", "oshld", "oshst", "osh", "", "nshld", "nshst", "nsh", "", "ishld", "ishst", "ish", "",
    "ld", "st", "",
];

/// Splits at commas.
fn split(operands: &str) -> impl Iterator<Item = &str> {
    operands.split(',').filter(|o| !o.is_empty())
}

/// One operand, perhaps with brackets on one side.
fn one(operand: &str, address: u32) -> String {
    if let Some(offset) = operand
        .strip_prefix(".+")
        .or(operand.strip_prefix('.'))
        .and_then(|o| o.parse::<i32>().ok())
    {
        return format!("#{}", address.wrapping_add_signed(offset));
    }
    if let Some(float) = operand
        .strip_prefix('#')
        .filter(|o| o.contains('.'))
        .and_then(|o| o.parse::<f32>().ok())
    {
        return format!("#{}", float.to_bits());
    }
    if let Some((first, last)) = operand
        .trim_matches(['{', '}'])
        .split_once('-')
        .and_then(|(a, b)| range(a, b))
    {
        let bank = operand
            .trim_start_matches('{')
            .chars()
            .next()
            .unwrap_or('?');
        let registers: Vec<_> = (first..=last).map(|n| format!("{bank}{n}")).collect();
        return format!("{{{}}}", registers.join(","));
    }
    words(operand)
}

fn range(first: &str, last: &str) -> Option<(u32, u32)> {
    let number = |register: &str| register.get(1..)?.parse().ok();
    first.starts_with(['s', 'd']).then_some(())?;
    Some((number(first)?, number(last)?))
}

/// Rewrites the words of an operand: numbers and second names of registers.
fn words(operand: &str) -> String {
    const NAMES: [(&str, &str); 6] = [
        ("sb", "r9"),
        ("sl", "r10"),
        ("fp", "r11"),
        ("ip", "r12"),
        ("hs", "cs"),
        ("lo", "cc"),
    ];
    let mut out = String::new();
    let mut word = String::new();
    for c in operand.chars().chain(['\0']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        match number(&word) {
            Some(value) if out.ends_with("#-") && value != 0 => {
                out.pop();
                let _ = write!(out, "{}", (value as u32).wrapping_neg());
            }
            Some(value) => {
                let _ = write!(out, "{value}");
            }
            None => out.push_str(NAMES.iter().find(|n| n.0 == word).map_or(&word, |n| n.1)),
        }
        word.clear();
        out.push(c);
    }
    out.trim_end_matches('\0').to_string()
}

fn number(word: &str) -> Option<u64> {
    match word.strip_prefix("0x") {
        Some(hex) => u64::from_str_radix(hex, 16).ok(),
        None => word.parse().ok(),
    }
}

#[test]
fn notations_meet() {
    for (ours, theirs) in [
        ("adccc r9, r0, #255", "adclo sb, r0, #0xff"),
        ("b .-6", "b #0xffa"),
        ("add r0, pc, #8", "adr r0, #8"),
        ("vldmia r0!, {s3-s5}", "vldmia r0!, {s3, s4, s5}"),
        ("vmov.f32 s0, #-0.5", "vmov.f32 s0, #-5.000000e-01"),
        ("dmb #11", "dmb ish"),
        ("it cs", "it hs"),
    ] {
        assert_eq!(text(ours, 0x1000), text(theirs, 0x1000));
    }
    assert_ne!(text("add r0, r1", 0), text("add r1, r0", 0));
    assert_ne!(text("ldr r0, [r1, #-0]", 0), text("ldr r0, [r1]", 0));
}
