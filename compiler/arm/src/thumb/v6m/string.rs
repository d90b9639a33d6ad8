//! The tick of a string on ARMv6-M: a loop, since top words are routines' work and code would not
//! fit.
//!
//! Coefficients and what is known of the point and the one before are on the stack; the slope
//! before the point and its rate are at R4 and R5, how many points are behind it is in R6, the sum
//! of products in R7. A top word is that of `mul_top`.

use crate::thumb::registers::RECORD;
use crate::thumb::wave::{LABEL, StringPlace};

/// Places on the stack, behind the four coefficients: the bend of the point, what the point before
/// does to it and then its whole sum, what it does to its neighbours, the new rate of the point
/// before.
const W: u32 = 16;
const Q: u32 = 20;
const P: u32 = 24;
const RATE: u32 = 28;
/// Bytes of them all, without the coefficients.
const FRAME: u32 = 16;

/// The text of a string's tick.
pub(in crate::thumb) fn string_loop(place: StringPlace) -> String {
    let StringPlace { at, count, .. } = place;
    let [e, v] = [(4, at[0]), (5, at[1])].map(|(reg, at)| address(reg, at));
    let (start, inside) = (start(place), inside(place.clamped[1]));
    format!(
        "\t.syntax unified\n\t.thumb\n\t.text\n\t.balign 4\n\t.type {LABEL}, %function\n\
{LABEL}:
\tpush {{r4, r5, r6, r7, lr}}
\tsub sp, sp, #{FRAME}
\tpush {{r0, r1, r2, r3}}
{e}{v}{start}@! rounds {count}
7:
{inside}\tadds r4, #4
\tadds r5, #4
\tsubs r6, #1
\tbcc 8f
\tb 7b
8:
\tldr r0, [sp, #{RATE}]
\tlsls r0, r0, #1
\tldr r1, [r4]
\tsubs r1, r1, r0
\tstr r1, [r4]
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
fn start(StringPlace { count, clamped, .. }: StringPlace) -> String {
    let behind = count - 1;
    let many = match behind {
        0..256 => format!("\tmovs r6, #{behind}\n"),
        _ => format!(
            "\tmovs r6, #{}\n\tlsls r6, r6, #8\n\tadds r6, #{}\n",
            behind >> 8,
            behind & 0xff
        ),
    };
    let end = match clamped[0] {
        false => "\tmovs r7, #0\n".to_owned(),
        true => {
            let product = product(1, None);
            format!("\tldr r0, [r4]\n{}{product}", doubled())
        }
    };
    let (saturated, beside) = (saturated(), beside("[r5]"));
    format!(
        "{many}{end}\tstr r7, [sp, #{Q}]
\tmovs r0, #0
\tstr r0, [sp, #{RATE}]
\tldr r1, [r4]
\tldr r0, [r4, #4]
\tsubs r0, r0, r1
{saturated}\tstr r0, [sp, #{W}]
{beside}\tstr r7, [sp, #{P}]
"
    )
}

/// A round: the point's sum but for what the one behind it does to it, then that, its rate and the
/// slope before it.
fn inside(clamped: bool) -> String {
    let own = product(0, Some(&format!("[sp, #{W}]"))) + &product(3, Some("[r5]"));
    let (saturated, beside) = (saturated(), beside("[r5, #4]"));
    let end = match clamped {
        false => "\tmovs r7, #0\n".to_owned(),
        true => format!(
            "\tldr r1, [r4, #4]\n\tmovs r0, #0\n\tsubs r0, r0, r1\n{saturated}{}{}",
            doubled(),
            product(1, None)
        ),
    };
    format!(
        "\tldr r7, [sp, #{Q}]
{own}\tstr r7, [sp, #{Q}]
\tcmp r6, #0
\tbeq 2f
\tldr r0, [r4, #8]
\tldr r1, [r4, #4]
\tsubs r0, r0, r1
{saturated}\tstr r0, [sp, #{W}]
{beside}\tb 3f
2:
{end}3:
\tldr r0, [sp, #{Q}]
\tldr r1, [sp, #{P}]
\tstr r1, [sp, #{Q}]
\tstr r7, [sp, #{P}]
\tadds r0, r0, r7
{saturated}\tldr r1, [r5]
\tadds r0, r0, r1
{saturated}\tstr r0, [r5]
\tldr r1, [sp, #{RATE}]
\tstr r0, [sp, #{RATE}]
\tsubs r0, r0, r1
\tlsls r0, r0, #1
\tldr r1, [r4]
\tadds r0, r0, r1
\tstr r0, [r4]
"
    )
}

/// What a point does to its neighbours into R7, of its bend in R0 and its rate at a place.
fn beside(rate: &str) -> String {
    product(1, None) + &product(2, Some(rate))
}

/// Twice R0, which saturates.
fn doubled() -> String {
    format!("\tadds r0, r0, r0\n{}", saturated())
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

/// The top word of a coefficient and what is in R0, which goes into R7, or what is at a place,
/// which is added there.
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
