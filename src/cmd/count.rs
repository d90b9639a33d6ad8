//! How many keys, in words.

/// `88 keys`, `1 key`; what is no instrument of a key is `played once`.
pub fn count_keys(keys: u32, is_once: bool) -> String {
    match keys {
        _ if is_once => "played once".to_string(),
        1 => "1 key".to_string(),
        keys => format!("{keys} keys"),
    }
}
