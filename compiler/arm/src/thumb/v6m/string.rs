//! The tick of a string on ARMv6-M: a loop, since top words are routines' work and code would not
//! fit.
//!
//! Coefficients and what is known of the point before are on the stack; U and v of the point are
//! at R4 and R5, how many points are behind it is in R6, the sum of products in R7. A top word is
//! that of `mul_top`.

use crate::thumb::registers::RECORD;
use crate::thumb::wave::{LABEL, StringPlace};

/// Places on the stack, behind the four coefficients.
const E: u32 = 16;
const W_BEFORE: u32 = 20;
const W: u32 = 24;
const V_BEFORE: u32 = 28;
const BENDS: u32 = 32;
/// Bytes of them all, without the coefficients.
const FRAME: u32 = 20;

/// The text of a string's tick.
pub(in crate::thumb) fn string_loop(place: StringPlace) -> String {
    let StringPlace { at, count, clamped } = place;
    let [u, v] = [(4, at[0]), (5, at[1])].map(|(reg, at)| address(reg, at));
    let w_first = if clamped[0] {
        &doubled()[..]
    } else {
        "\tmovs r0, #0\n"
    };
    let w_last = if clamped[1] { &doubled()[..] } else { "" };
    let (start, inside) = (start(count, w_first), neighbours(w_last));
    let products = [
        (2, None),
        (1, Some("[sp, #32]")),
        (0, Some("[sp, #20]")),
        (3, Some("[r5]")),
    ];
    let products: String = products.into_iter().map(|(k, x)| product(k, x)).collect();
    let saturated = saturated();
    format!(
        "\t.syntax unified\n\t.thumb\n\t.text\n\t.balign 4\n\t.type {LABEL}, %function\n\
{LABEL}:
\tpush {{r4, r5, r6, r7, lr}}
\tsub sp, sp, #{FRAME}
\tpush {{r0, r1, r2, r3}}
{u}{v}{start}@! rounds {count}
7:
{inside}{products}\tldr r0, [r5]
\tadds r0, r0, r7
{saturated}\tstr r0, [r5]
\tlsls r0, r0, #1
\tldr r1, [r4]
\tadds r0, r0, r1
\tstr r0, [r4]
\tadds r4, #4
\tadds r5, #4
\tsubs r6, #1
\tbcc 8f
\tb 7b
8:
\tadd sp, sp, #{}
\tpop {{r4, r5, r6, r7, pc}}
\t.size {LABEL}, . - {LABEL}
",
        FRAME + 16
    )
}

/// The address of a place in the record.
fn address(reg: u8, at: u32) -> String {
    let (high, low) = (at >> 8, at & 0xff);
    let constant = match high {
        0 => format!("\tmovs r{reg}, #{low}\n"),
        _ => format!("\tmovs r{reg}, #{high}\n\tlsls r{reg}, r{reg}, #8\n\tadds r{reg}, #{low}\n"),
    };
    format!("{constant}\tadds r{reg}, r{reg}, r{RECORD}\n")
}

/// What is known at the first point.
fn start(count: u32, w_before: &str) -> String {
    let behind = count - 1;
    let many = match behind {
        0..256 => format!("\tmovs r6, #{behind}\n"),
        _ => format!(
            "\tmovs r6, #{}\n\tlsls r6, r6, #8\n\tadds r6, #{}\n",
            behind >> 8,
            behind & 0xff
        ),
    };
    let saturated = saturated();
    format!(
        "{many}{w_before}\tstr r0, [sp, #{W_BEFORE}]
\tmovs r0, #0
\tstr r0, [sp, #{V_BEFORE}]
\tldr r1, [r4]
\tldr r0, [r4, #4]
\tsubs r0, r0, r1
\tstr r0, [sp, #{E}]
\tsubs r0, r0, r1
{saturated}\tstr r0, [sp, #{W}]
"
    )
}

/// The sum of the neighbours' bends in its place, that of their rates in R0; `w_last` puts the bend
/// of the last end into R0, where there is 0.
fn neighbours(w_last: &str) -> String {
    let saturated = saturated();
    format!(
        "\tmovs r0, #0
\tmovs r1, #0
\tcmp r6, #1
\tblo 2f
\tldr r1, [r5, #4]
\tbeq 1f
\tldr r0, [r4, #8]
1:
\tldr r2, [r4, #4]
\tsubs r0, r0, r2
\tldr r3, [sp, #{E}]
\tstr r0, [sp, #{E}]
\tsubs r0, r0, r3
{saturated}\tb 3f
2:
{w_last}3:
\tldr r2, [sp, #{W}]
\tstr r0, [sp, #{W}]
\tldr r3, [sp, #{W_BEFORE}]
\tstr r2, [sp, #{W_BEFORE}]
\tadds r0, r0, r3
{saturated}\tstr r0, [sp, #{BENDS}]
\tldr r0, [sp, #{V_BEFORE}]
\tldr r3, [r5]
\tstr r3, [sp, #{V_BEFORE}]
\tadds r0, r0, r1
{saturated}"
    )
}

/// Twice the outermost U, which saturates.
fn doubled() -> String {
    format!("\tldr r0, [r4]\n\tadds r0, r0, r0\n{}", saturated())
}

/// R0 where its sum did not overflow, else the end of the type on its other side.
fn saturated() -> &'static str {
    "\tbvc 9f
\tasrs r0, r0, #31
\tmovs r2, #1
\tlsls r2, r2, #31
\teors r0, r2
9:
"
}

/// The top word of a coefficient and what is in R0 or at a place: into R7 if it is the first, else
/// added.
fn product(k: u32, from: Option<&str>) -> String {
    let (load, add) = match from {
        Some(from) => (format!("\tldr r0, {from}\n"), "\tadds r7, r7, r0\n"),
        None => (String::new(), "\tmov r7, r0\n"),
    };
    format!(
        "{load}\tldr r1, [sp, #{}]
\tuxth r2, r0
\tuxth r3, r1
\tasrs r0, r0, #16
\tasrs r1, r1, #16
\tmov r12, r2
\tmuls r2, r3, r2
\tmuls r3, r0, r3
\tmuls r0, r1, r0
\tlsrs r2, r2, #16
\tadds r3, r3, r2
\tmov r2, r12
\tmuls r1, r2, r1
\tuxth r2, r3
\tadds r1, r1, r2
\tasrs r3, r3, #16
\tadds r0, r0, r3
\tasrs r1, r1, #16
\tadcs r0, r1
{add}",
        4 * k
    )
}
