//! What a certificate does not say.

/// A line with another number in the place of one of its own, in the base that it is written in.
pub fn changed(line: &str, word: usize, other: impl Fn(i128) -> i128) -> Option<String> {
    let mut words: Vec<String> = line.split(' ').map(str::to_string).collect();
    let old = words.get(word)?;
    words[word] = match old.strip_prefix("0x") {
        Some(hex) => format!("{:#x}", other(i128::from_str_radix(hex, 16).ok()?)),
        None => other(old.parse().ok()?).to_string(),
    };
    Some(words.join(" ")).filter(|changed| changed != line)
}
