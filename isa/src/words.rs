//! Splits the table's strings into words while the crate is compiled.

/// The end of the word that starts at `from`: the next blank or the end.
pub(crate) const fn word_end(text: &[u8], from: usize) -> usize {
    let mut end = from;
    while end < text.len() && text[end] != b' ' {
        end += 1;
    }
    end
}

/// The position of the first non-blank from `from` on.
pub(crate) const fn skip_blanks(text: &[u8], mut from: usize) -> usize {
    while from < text.len() && text[from] == b' ' {
        from += 1;
    }
    from
}

/// The index in `names` of `text[from..end]`.
pub(crate) const fn index_of(
    names: &[&str],
    text: &[u8],
    from: usize,
    end: usize,
) -> Option<usize> {
    let mut i = 0;
    while i < names.len() {
        if is_word(names[i].as_bytes(), text, from, end) {
            return Some(i);
        }
        i += 1;
    }
    None
}

const fn is_word(name: &[u8], text: &[u8], from: usize, end: usize) -> bool {
    if name.len() != end - from {
        return false;
    }
    let mut i = 0;
    while i < name.len() {
        if name[i] != text[from + i] {
            return false;
        }
        i += 1;
    }
    true
}
