//! Files as editors name them.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_types::Uri;

/// The file of a `file:` URI.
pub fn path(uri: &str) -> Option<PathBuf> {
    let rest = uri.strip_prefix("file://")?;
    let bytes = &rest.as_bytes()[rest.find('/')?..];
    let mut decoded = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let hex = bytes
            .get(at + 1..at + 3)
            .and_then(|h| std::str::from_utf8(h).ok());
        match (bytes[at], hex.and_then(|h| u8::from_str_radix(h, 16).ok())) {
            (b'%', Some(byte)) => {
                decoded.push(byte);
                at += 3;
            }
            (byte, _) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    let text = String::from_utf8(decoded).ok()?;
    // `/c:/folder` is a path of Windows.
    let drive = text.as_bytes().get(2) == Some(&b':');
    Some(PathBuf::from(if drive { &text[1..] } else { &text }))
}

/// The `file:` URI of an absolute path.
pub fn of(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._~/:".contains(&b);
    let encoded: String = text
        .bytes()
        .map(|b| {
            if plain(b) {
                char::from(b).to_string()
            } else {
                format!("%{b:02X}")
            }
        })
        .collect();
    format!(
        "file://{}{encoded}",
        if text.starts_with('/') { "" } else { "/" }
    )
}

/// The URI of the protocol; `None` where the text is none.
pub fn parse(uri: &str) -> Option<Uri> {
    Uri::from_str(uri).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_come_back() {
        for name in ["/a/b.whip", "/a b/\u{e9}#%25.whip", "/x+y/z(1).whip"] {
            let uri = of(Path::new(name));
            assert_eq!(path(&uri), Some(PathBuf::from(name)), "{uri}");
            assert!(parse(&uri).is_some(), "{uri}");
        }
        assert_eq!(
            path("file:///c%3A/x.whip"),
            Some(PathBuf::from("c:/x.whip"))
        );
        assert_eq!(path("untitled:one"), None);
    }
}
