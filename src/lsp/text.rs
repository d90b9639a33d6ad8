//! Places: bytes of a text on our side; lines and UTF-16 units on the editor's.

use lsp_types::{Position, Range, TextDocumentContentChangeEvent};
use whippen_compiler::source::Span;

/// The first byte of every line. Lines end with `\n`, `\r\n` or `\r`.
fn line_starts(text: &str) -> impl Iterator<Item = usize> {
    let bytes = text.as_bytes();
    let ends = move |&i: &usize| {
        bytes[i] == b'\n' || (bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'))
    };
    std::iter::once(0).chain((0..bytes.len()).filter(ends).map(|i| i + 1))
}

/// The place of a byte; of the nearest character before it where it lies inside one.
pub fn position(text: &str, byte: usize) -> Position {
    let byte = (0..=byte.min(text.len()))
        .rev()
        .find(|b| text.is_char_boundary(*b))
        .unwrap_or(0);
    let (line, start) = line_starts(text)
        .enumerate()
        .take_while(|(_, start)| *start <= byte)
        .last()
        .unwrap_or((0, 0));
    let character = text[start..byte].encode_utf16().count();
    Position {
        line: line as u32,
        character: character as u32,
    }
}

/// The byte of a place; places behind the end of a line or of the text are moved there.
pub fn byte(text: &str, position: Position) -> usize {
    let Some(start) = line_starts(text).nth(position.line as usize) else {
        return text.len();
    };
    let mut units = 0;
    for (at, c) in text[start..].char_indices() {
        if units >= position.character as usize || c == '\n' || c == '\r' {
            return start + at;
        }
        units += c.len_utf16();
    }
    text.len()
}

/// The place of a span.
pub fn range(text: &str, span: Span) -> Range {
    Range {
        start: position(text, span.start as usize),
        end: position(text, span.end as usize),
    }
}

/// All of a text.
pub fn whole(text: &str) -> Range {
    Range {
        start: Position::default(),
        end: position(text, text.len()),
    }
}

/// Takes over what was typed.
pub fn apply(text: &mut String, change: TextDocumentContentChangeEvent) {
    let Some(range) = change.range else {
        *text = change.text;
        return;
    };
    let start = byte(text, range.start);
    let end = byte(text, range.end).max(start);
    text.replace_range(start..end, &change.text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_utf16_units() {
        let text = "a\u{e9}\u{1d11e}b\r\n\u{6f22}x\rz";
        let places = [
            (0, 0, 0),
            (1, 0, 1),
            (3, 0, 2),
            (7, 0, 4),
            (8, 0, 5),
            (10, 1, 0),
            (13, 1, 1),
            (15, 2, 0),
            (16, 2, 1),
        ];
        for (at, line, character) in places {
            assert_eq!(position(text, at), Position { line, character }, "{at}");
            assert_eq!(
                byte(text, Position { line, character }),
                at,
                "{line}:{character}"
            );
        }
        assert_eq!(
            byte(
                text,
                Position {
                    line: 0,
                    character: 99
                }
            ),
            8
        );
        assert_eq!(
            byte(
                text,
                Position {
                    line: 9,
                    character: 0
                }
            ),
            text.len()
        );
        assert_eq!(
            position(text, 5),
            Position {
                line: 0,
                character: 2
            }
        );
    }

    #[test]
    fn changes_are_applied_where_they_were_made() {
        let mut text = "x = \u{1d11e} + 1\n".to_string();
        let at = |from, to| Range {
            start: Position {
                line: 0,
                character: from,
            },
            end: Position {
                line: 0,
                character: to,
            },
        };
        let change = |range, text: &str| TextDocumentContentChangeEvent {
            range,
            range_length: None,
            text: text.to_string(),
        };
        apply(&mut text, change(Some(at(4, 6)), "y"));
        assert_eq!(text, "x = y + 1\n");
        apply(&mut text, change(Some(at(8, 3)), "2 * "));
        assert_eq!(text, "x = y + 2 * 1\n");
        apply(&mut text, change(None, "new"));
        assert_eq!(text, "new");
    }
}
