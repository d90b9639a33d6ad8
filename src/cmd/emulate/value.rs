//! Numbers, addresses and bytes as the command line writes them.

use whippen_emulator::elf::{Elf, Symbol};

/// A count, such as 1000, 1_000, 1e9, 500k or 150M.
pub fn count(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is no count; write 1000000, 1e6 or 1M");
    let plain = text.replace('_', "");
    let (digits, factor) = match plain.char_indices().next_back() {
        Some((at, 'k' | 'K')) => (&plain[..at], 1_000),
        Some((at, 'M')) => (&plain[..at], 1_000_000),
        Some((at, 'G')) => (&plain[..at], 1_000_000_000),
        _ => (plain.as_str(), 1),
    };
    let value = match digits.split_once(['e', 'E']) {
        Some((mantissa, exponent)) if !digits.starts_with("0x") => {
            let power = exponent.parse().ok().and_then(|e| 10_u64.checked_pow(e));
            mantissa
                .parse::<u64>()
                .ok()
                .zip(power)
                .and_then(|(m, p)| m.checked_mul(p))
        }
        _ => unsigned(digits),
    };
    value
        .and_then(|v| v.checked_mul(factor))
        .filter(|v| *v > 0)
        .ok_or_else(wrong)
}

/// A size in bytes, such as 4096, 0x1000, 64K or 2M (powers of 1024).
pub fn size(text: &str) -> Option<u32> {
    let (digits, shift) = match text.char_indices().next_back()? {
        (at, 'k' | 'K') => (&text[..at], 10),
        (at, 'M' | 'm') => (&text[..at], 20),
        _ => (text, 0),
    };
    let bytes = unsigned(digits)?.checked_mul(1 << shift)?;
    u32::try_from(bytes).ok()
}

/// A decimal or hexadecimal number without sign.
pub fn unsigned(text: &str) -> Option<u64> {
    let plain = text.replace('_', "");
    match plain
        .strip_prefix("0x")
        .or_else(|| plain.strip_prefix("0X"))
    {
        Some(digits) if digits.starts_with('+') => None,
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None if plain.starts_with('+') => None,
        None => plain.parse().ok(),
    }
}

/// A 32-bit word: a number, signed or not, that fits; or an address.
pub fn word(text: &str, elf: &Elf) -> Result<u32, String> {
    let text = text.trim();
    let fits = |value: i64| {
        (i64::from(i32::MIN)..=i64::from(u32::MAX))
            .contains(&value)
            .then_some(value as u32)
    };
    let (negative, digits) = text
        .strip_prefix('-')
        .map_or((false, text), |rest| (true, rest));
    match unsigned(digits) {
        Some(magnitude) => i64::try_from(magnitude)
            .ok()
            .and_then(|m| fits(if negative { -m } else { m }))
            .ok_or_else(|| format!("`{text}` does not fit into 32 bits")),
        None if digits.starts_with(|c: char| c.is_ascii_digit()) && !digits.contains('+') => {
            Err(format!("`{text}` is no number"))
        }
        None => place(text, elf).map(|p| p.address),
    }
}

/// A place in memory.
pub struct MemoryPlace<'e> {
    /// Its address.
    pub address: u32,
    /// The symbol that names it, when no offset is added.
    pub symbol: Option<&'e Symbol>,
}

/// A number, a symbol, or either with `+offset`.
pub fn place<'e>(text: &str, elf: &'e Elf) -> Result<MemoryPlace<'e>, String> {
    let text = text.trim();
    if let Some(number) = unsigned(text) {
        let address =
            u32::try_from(number).map_err(|_| format!("`{text}` is no 32-bit address"))?;
        return Ok(MemoryPlace {
            address,
            symbol: None,
        });
    }
    // A name may contain a plus sign, as the operators of C++ do.
    let named = elf.symbols.named(text);
    if let (Err(_), Some((base, offset))) = (&named, text.rsplit_once('+'))
        && let Some(offset) = unsigned(offset.trim()).and_then(|o| u32::try_from(o).ok())
    {
        let address = place(base, elf)?.address.wrapping_add(offset);
        return Ok(MemoryPlace {
            address,
            symbol: None,
        });
    }
    match named {
        Ok(symbol) => Ok(MemoryPlace {
            address: symbol.address,
            symbol: Some(symbol),
        }),
        Err(_) if elf.symbols.is_empty() => Err(format!(
            "the image has no symbols (it is stripped), so `{text}` must be a number"
        )),
        Err(error) => Err(error.to_string()),
    }
}

/// Bytes in hexadecimal, in the order of memory; blanks and underscores between them are allowed.
pub fn bytes(text: &str) -> Result<Vec<u8>, String> {
    let text = text.strip_prefix("0x").unwrap_or(text);
    let digits: Vec<char> = text
        .chars()
        .filter(|c| !c.is_whitespace() && *c != '_')
        .collect();
    if !digits.len().is_multiple_of(2) {
        return Err(format!(
            "`{text}` has half a byte: two digits each, in the order of memory"
        ));
    }
    let byte = |pair: &[char]| Some((pair[0].to_digit(16)? << 4 | pair[1].to_digit(16)?) as u8);
    let bytes: Option<Vec<u8>> = digits.chunks_exact(2).map(byte).collect();
    bytes.ok_or_else(|| format!("`{text}` is not hexadecimal"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_emulator::elf::Symbols;

    fn elf() -> Elf {
        let symbol = |name: &str, address| Symbol {
            name: name.into(),
            address,
            bytes: 8,
            function: true,
            global: true,
        };
        let symbols = Symbols::new(vec![symbol("fir", 0x100), symbol("operator+", 0x200)]);
        Elf {
            entry: 0,
            arch: None,
            segments: Vec::new(),
            symbols,
            undefined: Vec::new(),
            unproven: None,
        }
    }

    #[test]
    fn counts_and_sizes() {
        for (text, value) in [
            ("1000", 1000),
            ("1_000", 1000),
            ("2e3", 2000),
            ("7k", 7000),
            ("0x1e3", 0x1e3),
            ("3M", 3_000_000),
        ] {
            assert_eq!(count(text), Ok(value));
        }
        for text in [
            "",
            "0",
            "-1",
            "1e99",
            "99999999999999999999",
            "k",
            "1.5e3",
            "many",
        ] {
            assert!(count(text).is_err(), "{text}");
        }
        assert_eq!(size("64K"), Some(65536));
        assert_eq!(size("0x1000"), Some(4096));
        assert_eq!(size("8M"), Some(8 << 20));
        assert_eq!([size("5000M"), size(""), size("K"), size("x")], [None; 4]);
    }

    #[test]
    fn words_are_numbers_or_symbols() {
        let value = |text: &str| word(text, &elf());
        assert_eq!(value("-1"), Ok(u32::MAX));
        assert_eq!(value("0xffffffff"), Ok(u32::MAX));
        assert_eq!(value("-2147483648"), Ok(1 << 31));
        assert_eq!(value(" fir+0x10 "), Ok(0x110));
        assert_eq!(value("operator+"), Ok(0x200));
        assert_eq!(value("operator++4"), Ok(0x204));
        assert_eq!(value("0x100+4"), Ok(0x104));
        assert_eq!(
            value("4294967296"),
            Err("`4294967296` does not fit into 32 bits".into())
        );
        assert_eq!(value("12cm"), Err("`12cm` is no number".into()));
        assert_eq!(
            value("fri"),
            Err("there is no symbol `fri`; did you mean `fir`?".into())
        );
    }

    #[test]
    fn bytes_are_pairs_of_digits() {
        assert_eq!(bytes("0102 fF_00"), Ok(vec![1, 2, 255, 0]));
        assert_eq!(bytes(""), Ok(vec![]));
        assert!(bytes("012").unwrap_err().contains("half a byte"));
        assert!(bytes("0g").unwrap_err().contains("not hexadecimal"));
        assert!(bytes("é1").is_err());
    }
}
