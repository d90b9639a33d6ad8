//! Brings two notations of the same instruction to one.

/// Other names of registers, as whole words.
const REGISTERS: [(&str, &str); 4] = [("sb", "r9"), ("sl", "r10"), ("fp", "r11"), ("ip", "r12")];

/// Lower case, one blank after the mnemonic and none elsewhere, numbers in decimal and as 32 bits without sign, `cs` and
/// `cc` rather than `hs` and `lo`, no second name for a register, ranges of registers spelled out.
pub fn text(text: &str) -> String {
    let text = text.trim().to_ascii_lowercase();
    let (mnemonic, operands) = text.split_once(char::is_whitespace).unwrap_or((&text, ""));
    let operands: String = operands.chars().filter(|c| !c.is_whitespace()).collect();
    format!("{} {}", condition(mnemonic), words(&operands)).trim().to_string()
}

fn condition(mnemonic: &str) -> String {
    let (stem, types) = mnemonic.split_once('.').map_or((mnemonic, String::new()), |(s, t)| (s, format!(".{t}")));
    let stem = match (stem.strip_suffix("hs"), stem.strip_suffix("lo")) {
        (Some(rest), _) => format!("{rest}cs"),
        (_, Some(rest)) => format!("{rest}cc"),
        _ => stem.to_string(),
    };
    stem + &types
}

/// Splits operands into words and what stands between, and rewrites each word.
fn words(operands: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for c in operands.chars().chain([' ']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
        } else {
            let negative = out.ends_with("#-");
            let value = number(&word);
            match value {
                Some(v) if negative && v != 0 => {
                    out.pop();
                    out.push_str(&(v as u32).wrapping_neg().to_string());
                }
                Some(v) => out.push_str(&v.to_string()),
                None => out.push_str(REGISTERS.iter().find(|r| r.0 == word).map_or(&word, |r| r.1)),
            }
            word.clear();
            out.push(c);
        }
    }
    out.trim_end().to_string()
}

fn number(word: &str) -> Option<u64> {
    match word.strip_prefix("0x") {
        Some(hex) => u64::from_str_radix(hex, 16).ok(),
        None => word.parse().ok(),
    }
}
