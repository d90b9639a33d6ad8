//! The canonical layout: it changes nothing but the layout, keeps every comment, and is what the
//! bundled programs have.

use super::random::Dice;
use super::spans::without;
use super::*;
use crate::syntax::layout;
use crate::syntax::pretty::print;
use crate::syntax::repair::types;
use crate::syntax::token::{Token, lex};

/// Lays a text out, and makes sure that nothing is lost and that doing it twice changes nothing.
#[track_caller]
fn laid(text: &str) -> String {
    let out = layout(0, text).unwrap_or_else(|d| panic!("{d:#?}\n{text}"));
    assert_eq!(
        without(tree(&out)),
        without(tree(text)),
        "another tree\n{text}\n{out}"
    );
    assert_eq!(
        comments(&out),
        comments(text),
        "other comments\n{text}\n{out}"
    );
    assert_eq!(
        layout(0, &out).as_deref(),
        Ok(&*out),
        "not stable\n{text}\n{out}"
    );
    out
}

fn comments(text: &str) -> Vec<String> {
    lex(0, text, &mut Vec::new())
        .comments
        .iter()
        .map(|c| c.node.to_string())
        .collect()
}

#[test]
fn bundled_programs_have_the_canonical_layout() {
    for (name, text) in programs() {
        assert_eq!(laid(text), *text, "{name}: run `whippen fmt`");
    }
}

/// A text as its tokens. A type that is written as units stands in one line, so it is one.
fn tokens(text: &str) -> Vec<(Token<'_>, &str)> {
    let slice = |s: whippen_source::Span| &text[s.start as usize..s.end as usize];
    let lexed = lex(0, text, &mut Vec::new());
    types::join(text, lexed.tokens)
        .iter()
        .map(|t| (t.node, slice(t.span)))
        .collect()
}

/// The tokens with other things between them. A unit would be read behind a number and one space.
fn joined(tokens: &[(Token, &str)], mut between: impl FnMut(usize) -> String) -> String {
    let mut text = String::new();
    for (n, (token, slice)) in tokens.iter().enumerate() {
        text += slice;
        let number = matches!(token, Token::Number(_));
        let space = between(n);
        text += if number && space.trim_matches(' ').is_empty() {
            "\n"
        } else {
            &space
        };
    }
    text
}

#[test]
fn comments_may_stand_anywhere() {
    let short = programs().filter(|(_, text)| text.len() < 1500);
    for (_, text) in short {
        let bare = tokens(text);
        for comment in [
            " // c\n",
            "\n// c\n",
            "\n\n// c\n\n// d\n\n",
            " // c\n// d\n",
            "\n/// c\n",
        ] {
            for gap in 0..bare.len() {
                let text = joined(&bare, |n| {
                    if n == gap {
                        comment.to_string()
                    } else {
                        " ".to_string()
                    }
                });
                laid(&text);
            }
        }
        laid(&joined(&bare, |n| format!(" // {n}\n // {n}\n\n")));
    }
}

#[test]
fn comments_may_stand_anywhere_in_programs_made_by_chance() {
    let mut dice = Dice(0xc0117);
    for _ in 0..1500 {
        let text = print(&File {
            items: dice.some(1, Dice::item),
        });
        let bare = tokens(&text);
        let spaces = [
            " ",
            "\n",
            "\n\n",
            "\r\n",
            " \t ",
            " // c\n",
            "\n// c\n",
            "\n\n// c\n\n",
            " // c\r\n",
            "\n///c\n\n",
        ];
        let often = 1 + dice.below(8);
        let mut space = |_| {
            let all = if dice.below(often) == 0 {
                spaces.len()
            } else {
                2
            };
            dice.pick(&spaces[..all]).to_string()
        };
        laid(&joined(&bare, &mut space));
    }
}

#[test]
fn where_lines_end_does_not_matter() {
    let mut dice = Dice(0x11fe);
    let plain = |text: &str| joined(&tokens(text), |_| " ".to_string());
    let mut texts: Vec<String> = programs().map(|(_, text)| plain(text)).collect();
    texts.extend((0..300).map(|_| {
        plain(&print(&File {
            items: dice.some(1, Dice::item),
        }))
    }));
    for text in texts {
        let once = laid(&text);
        let other = joined(&tokens(&text), |_| {
            dice.pick(&[" ", "\n", "  ", "\t\n "]).to_string()
        });
        assert_eq!(laid(&other), once);
    }
}

#[test]
fn line_ends_and_marks() {
    let text = "instrument i {\n    let a = 1 // c\n}\n";
    let windows = text.replace('\n', "\r\n");
    assert_eq!(laid(&windows), laid(text).replace('\n', "\r\n"));
    assert_eq!(laid(&format!("\u{feff}{}", text.trim_end())), laid(text));
    assert_eq!((laid(""), laid("\n\n \n")), (String::new(), String::new()));
    assert_eq!(laid("\n\n// alone\n\n\n// twice"), "// alone\n\n// twice\n");
}

#[test]
fn what_cannot_be_read_is_left_alone() {
    let mistakes = layout(3, "instrument i { let a = }").expect_err("a mistake");
    assert!(mistakes.iter().all(|d| d.span.file == 3) && !mistakes.is_empty());
}

#[test]
fn only_what_cannot_be_broken_is_wide() {
    let mut dice = Dice(0x51de);
    for _ in 0..400 {
        let text = laid(&print(&File {
            items: dice.some(1, Dice::item),
        }));
        let wide = text
            .lines()
            .filter(|l| l.chars().count() > crate::syntax::WIDTH && !l.trim().starts_with("///"));
        let wide: Vec<&str> = wide
            .filter(|l| l.matches(['(', '+', '*', ',']).count() > 2)
            .collect();
        assert!(wide.is_empty(), "{wide:#?}");
    }
}

#[test]
fn the_layout_in_short() {
    insta::assert_snapshot!("layout", laid(include_str!("messy.whip")));
}
