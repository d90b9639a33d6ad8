//! Messages from stdin. What is no message is reported and skipped: a server that dies of a stray
//! byte takes the editor's diagnostics with it.

use std::io::{BufRead, Read};

use lsp_server::Message;

/// Larger messages are not read.
const LONGEST: u64 = 64 << 20;

/// The next message, or what is wrong with it; `None` at the end of the input.
pub fn read(input: &mut impl BufRead) -> Option<Result<Message, String>> {
    let length = match header(input)? {
        Ok(length) => length,
        Err(why) => return Some(Err(why)),
    };
    let mut body = Vec::new();
    let read = input
        .take(length.min(LONGEST))
        .read_to_end(&mut body)
        .ok()?;
    if (read as u64) < length.min(LONGEST) {
        return None;
    }
    if length > LONGEST {
        std::io::copy(&mut input.take(length - LONGEST), &mut std::io::sink()).ok()?;
        return Some(Err(format!("a message of {length} bytes is too long")));
    }
    Some(serde_json::from_slice(&body).map_err(|e| format!("not a message: {e}")))
}

/// The length that a header announces, up to the blank line behind it.
fn header(input: &mut impl BufRead) -> Option<Result<u64, String>> {
    let mut length = None;
    loop {
        let mut line = Vec::new();
        if input.take(LONGEST).read_until(b'\n', &mut line).ok()? == 0 {
            return None;
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end();
        match (line.split_once(':'), length) {
            (None, Some(length)) if line.is_empty() => return Some(Ok(length)),
            (None, None) if line.is_empty() => {
                return Some(Err("a message without Content-Length".to_string()));
            }
            (Some((name, value)), _) if name.eq_ignore_ascii_case("Content-Length") => {
                match value.trim().parse() {
                    Ok(value) => length = Some(value),
                    Err(_) => return Some(Err(format!("`{}` is no length", value.trim()))),
                }
            }
            (Some(_), _) => {}
            (None, _) => return Some(Err("not a header of a message".to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_message_is_skipped() {
        let good = r#"{"jsonrpc":"2.0","method":"initialized","params":{}}"#;
        let framed = |body: &str| format!("Content-Length: {}\r\n\r\n{body}", body.len());
        let bad = [
            "rubbish\r\n",
            "Content-Length: many\r\n",
            "\r\n",
            &framed("{"),
            &framed("[1]"),
            &framed(""),
        ];
        for bad in bad {
            let text = format!("{}{bad}{}", framed(good), framed(good));
            let mut input = text.as_bytes();
            let read: Vec<bool> = std::iter::from_fn(|| read(&mut input))
                .map(|m| m.is_ok())
                .collect();
            assert!(
                read.len() >= 3 && read[0] && read[read.len() - 1],
                "{bad:?}: {read:?}"
            );
        }
        assert!(read(&mut "Content-Length: 9\r\n\r\n{".as_bytes()).is_none());
    }
}
