//! What operations of p-code compute, as terms.

use whippen_smt::{Sort, Term};

/// The words an operation computes of; `bytes` is the width of its result.
pub fn computed(name: &str, args: &[Term], bytes: u32) -> Result<Term, String> {
    let bits = 8 * bytes;
    let truth = |term: Term| term.choose(Term::word(1, 8), Term::word(0, 8));
    let holds = |term: Term| term.equals(Term::word(0, term.bits())).negated();
    Ok(match (name, args) {
        ("COPY", [a]) => *a,
        ("INT_ZEXT", [a]) => a.widened(bits),
        ("INT_SEXT", [a]) => a.resized(bits),
        ("SUBPIECE", [a, low]) => {
            let low = 8 * low.number().ok_or("a piece from anywhere")? as u32;
            a.extract((low + bits - 1).min(a.bits() - 1), low)
        }
        ("PIECE", [a, b]) => a.concat(*b),
        ("INT_2COMP", [a]) => Term::apply("bvneg", &[*a]),
        ("INT_NEGATE", [a]) => Term::apply("bvnot", &[*a]),
        ("LZCOUNT", [a]) => a.leading_zeros().widened(bits.max(a.bits())),
        ("BOOL_NEGATE", [a]) => truth(holds(*a).negated()),
        ("BOOL_AND", [a, b]) => truth(holds(*a).and(holds(*b))),
        ("BOOL_OR", [a, b]) => truth(holds(*a).or(holds(*b))),
        ("BOOL_XOR", [a, b]) => truth(holds(*a).equals(holds(*b)).negated()),
        ("INT_CARRY", [a, b]) => {
            let sum = Term::apply("bvadd", &[*a, *b]);
            truth(Term::apply("bvult", &[sum, *a]))
        }
        ("INT_SCARRY", [a, b]) => truth(overflows("bvadd", *a, *b)),
        ("INT_SBORROW", [a, b]) => truth(overflows("bvsub", *a, *b)),
        ("INT_LEFT" | "INT_RIGHT" | "INT_SRIGHT", [a, by]) => shifted(name, *a, *by),
        ("INT_EQUAL", [a, b]) => truth(a.equals(*b)),
        ("INT_NOTEQUAL", [a, b]) => truth(a.equals(*b).negated()),
        ("INT_LESS" | "INT_LESSEQUAL" | "INT_SLESS" | "INT_SLESSEQUAL", [a, b]) => {
            let function = match name {
                "INT_LESS" => "bvult",
                "INT_LESSEQUAL" => "bvule",
                "INT_SLESS" => "bvslt",
                _ => "bvsle",
            };
            truth(Term::apply(function, &[*a, *b]))
        }
        // P-code says nothing of a quotient by 0; Arm's manual says that it is 0.
        ("INT_DIV" | "INT_SDIV", [a, b]) => {
            let function = if name == "INT_DIV" {
                "bvudiv"
            } else {
                "bvsdiv"
            };
            let zero = Term::word(0, b.bits());
            b.equals(zero)
                .choose(zero, Term::apply(function, &[*a, *b]))
        }
        (_, [a, b]) => Term::apply(plain(name).ok_or(format!("`{name}`"))?, &[*a, *b]),
        _ => return Err(format!("`{name}`")),
    })
}

/// Functions of two words of one width.
fn plain(name: &str) -> Option<&'static str> {
    Some(match name {
        "INT_ADD" => "bvadd",
        "INT_SUB" => "bvsub",
        "INT_MULT" => "bvmul",
        "INT_AND" => "bvand",
        "INT_OR" => "bvor",
        "INT_XOR" => "bvxor",
        _ => return None,
    })
}

/// Whether a signed sum or difference does not fit its width.
fn overflows(function: &'static str, a: Term, b: Term) -> Term {
    let bits = a.bits();
    let wide = Term::apply(function, &[a.resized(bits + 1), b.resized(bits + 1)]);
    let own = Term::apply(function, &[a, b]).resized(bits + 1);
    wide.equals(own).negated()
}

/// A shift by a word of any width: by more than there are bits it leaves zeros, or the sign.
fn shifted(name: &str, a: Term, by: Term) -> Term {
    let function = match name {
        "INT_LEFT" => "bvshl",
        "INT_RIGHT" => "bvlshr",
        _ => "bvashr",
    };
    let bits = a.bits();
    if by.bits() <= bits {
        return Term::apply(function, &[a, by.widened(bits)]);
    }
    let limit = Term::word(bits.into(), by.bits());
    let far = Term::apply("bvult", &[by, limit]).negated();
    let by = far.choose(limit, by).extract(bits - 1, 0);
    Term::apply(function, &[a, by])
}

/// What instructions call that p-code has no word for.
pub fn called(callee: &str, args: &[Term]) -> Result<Term, String> {
    let [a, to] = args else {
        return Err(format!("`{callee}`"));
    };
    let to = to.number().ok_or("saturates to any width")? as u32;
    let (low, high) = match callee {
        // Its width is named by the encoding of SSAT, which is one less.
        "SignedSaturate" | "SignedDoesSaturate" => (-(1_i128 << to), (1_i128 << to) - 1),
        "UnsignedSaturate" | "UnsignedDoesSaturate" => (0, (1_i128 << to) - 1),
        _ => return Err(format!("`{callee}`")),
    };
    let bits = a.bits() + 1;
    let wide = a.resized(bits);
    let [low, high] = [low, high].map(|end| Term::word(end, bits));
    let held = Term::apply("bvslt", &[wide, low]).choose(low, wide);
    let held = Term::apply("bvslt", &[high, wide]).choose(high, held);
    if callee.contains("Does") {
        let same = held.equals(wide);
        return Ok(same.choose(Term::word(0, 8), Term::word(1, 8)));
    }
    Ok(held.extract(a.bits() - 1, 0))
}

/// QADD and QSUB, of which Ghidra's description saturates the sum that has wrapped already: the
/// numbers of the result and the operands, and whether it subtracts.
pub fn saturating(code: &[u8]) -> Option<([u8; 3], bool)> {
    let [a, b, c, d] = *code else { return None };
    let (first, second) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
    if first & 0xfff0 != 0xfa80 || second & 0xf0d0 != 0xf080 {
        return None;
    }
    let registers = [second >> 8 & 15, second & 15, first & 15];
    Some((registers.map(|own| own as u8), second & 0x20 != 0))
}

/// `m + n` or `m - n`, as the nearest word.
pub fn saturated(m: Term, n: Term, subtracts: bool) -> Term {
    let function = if subtracts { "bvsub" } else { "bvadd" };
    let wide = Term::apply(function, &[m.resized(33), n.resized(33)]);
    let [low, high] = [i32::MIN, i32::MAX].map(|end| Term::word(end.into(), 33));
    let held = Term::apply("bvslt", &[wide, low]).choose(low, wide);
    let held = Term::apply("bvslt", &[high, wide]).choose(high, held);
    held.extract(31, 0)
}

/// Anything of so many bits.
pub fn any(what: &str, bits: u32) -> Term {
    Term::such_that(what, Sort::Word(bits), |_| Term::truth(true))
}
