//! Expected tokens as a person would name them.

use crate::syntax::token::SOFT_KEYWORDS;

/// A kind of thing: it is expected if all of `needs` are, and stands for all of `covers`.
struct WordKind {
    name: &'static str,
    needs: &'static [&'static str],
    covers: &'static [&'static str],
    /// Whether it stands for every word that is a keyword in some places only.
    words: bool,
}

const KINDS: &[WordKind] = &[
    WordKind {
        name: "an expression",
        needs: &["number"],
        covers: &[
            "number", "word", "broken", "(", "-", "if", "not", "on", "off",
        ],
        words: true,
    },
    WordKind {
        name: "an instrument, a term or a keyboard",
        needs: &["instrument"],
        covers: &["instrument", "term", "keyboard"],
        words: false,
    },
    WordKind {
        name: "a declaration",
        needs: &["let"],
        covers: &[
            "sense", "live", "param", "let", "body", "states", "state", "next", "event", "pulse",
            "hold", "force", "torque", "noise", "delay", "feed", "sound", "string", "bank",
            "table", "defined",
        ],
        words: false,
    },
    WordKind {
        name: "a transition",
        needs: &["left"],
        covers: &["left"],
        words: false,
    },
    WordKind {
        name: "an action",
        needs: &["emit"],
        covers: &["emit", "fire", "assigned"],
        words: false,
    },
    WordKind {
        name: "a setting",
        needs: &["word", "board", "}"],
        covers: &["word"],
        words: true,
    },
    WordKind {
        name: "a note",
        needs: &["sharp"],
        covers: &["sharp", "word"],
        words: true,
    },
    WordKind {
        name: "a type",
        needs: &["word", "force"],
        covers: &["word", "force"],
        words: true,
    },
    WordKind {
        name: "a device",
        needs: &["word", "text"],
        covers: &["word", "text"],
        words: true,
    },
    WordKind {
        name: "a name",
        needs: &["word"],
        covers: &["word"],
        words: true,
    },
    WordKind {
        name: "a line of the body",
        needs: &["torque"],
        covers: &[
            "angle", "position", "inertia", "mass", "torque", "force", "friction",
        ],
        words: false,
    },
    WordKind {
        name: "a line of the string",
        needs: &["load"],
        covers: &[
            "position", "density", "load", "force", "ends", "tuned", "points", "friction",
        ],
        words: false,
    },
    WordKind {
        name: "an operator",
        needs: &["+"],
        covers: &[
            "+", "-", "*", "/", "^", "<", "<=", ">", ">=", "and", "or", "is", "'", ".", "(", "[",
        ],
        words: false,
    },
    WordKind {
        name: "`and`, `or`",
        needs: &["and", "or"],
        covers: &["and", "or"],
        words: false,
    },
];

/// The expected tokens in words: `a declaration or }`.
pub(super) fn of(expected: &[&str]) -> String {
    let mut left = expected.to_vec();
    let mut words = Vec::new();
    for kind in KINDS {
        if kind.needs.iter().all(|n| left.contains(n)) {
            words.push(kind.name.to_string());
            left.retain(|e| !(kind.covers.contains(e) || kind.words && SOFT_KEYWORDS.contains(e)));
        }
    }
    words.extend(left.iter().map(|token| {
        format!(
            "`{}`",
            token.trim_end_matches(|c: char| c.is_ascii_digit() || token.len() == 2 && c == 'b')
        )
    }));
    match words.pop() {
        None => "nothing more".to_string(),
        Some(last) if words.is_empty() => last,
        Some(last) => format!("{} or {last}", words.join(", ")),
    }
}
