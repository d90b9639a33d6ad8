//! Banks against the same written out.

use super::check_text;
use crate::check::Options;
use crate::syntax::layout;

const SENSE: &str = "sense x: length in 0 mm .. 10 mm over 1 ms";

/// What a member declares, with its name before each of its own names.
fn member(own: &str, number: usize) -> String {
    let text = "live param @k = 30 N/m in 0 N/m .. 100 N/m glide 20 ms
        let @pull = @k * max(x - # * 2 mm, 0 mm)
        body @weight {
            position @u in -5 mm .. 5 mm, rate in -1 m/s .. 1 m/s
            mass 10 g
            force @pull - 400 N/m * @u
            friction @rubs(v) against 0 m/s = 0.01 N * tanh(v * 100 s/m)
        }
        noise @hiss
        delay @line: force in -1 N .. 1 N lasting 10 ms
        feed @line = clamp(@pull + 0.1 N * @hiss, -1 N, 1 N)
        state @ticks: number in 0 .. 1000
        next @ticks = @ticks + 1
        event @over when x > 1 mm + # * 1 mm { @ticks := 0 }
        let @late = @line(3 ms + # * 1 ms)
";
    text.replace('@', own).replace('#', &number.to_string())
}

fn text_of(program: &str) -> String {
    let (_, program, diagnostics) = check_text(program, &Options::default());
    let program = program.unwrap_or_else(|| panic!("{diagnostics:?}"));
    program.instruments[0].to_string()
}

#[test]
fn a_bank_is_its_members_written_out() {
    let inner = member("", 0)
        .replace("x - 0", "x - i")
        .replace("0 * 1 ms", "i * 1 ms");
    let inner = inner.replace("+ 0 * 1 mm", "+ i * 1 mm");
    let bank = format!(
        "instrument a {{ {SENSE} bank b over i in 0 .. 3 {{ {inner} }} force f = sum(b.late) }}"
    );
    let members: String = (0..4).map(|n| member(&format!("m{n}_"), n)).collect();
    let written = format!(
        "instrument a {{ {SENSE} {members} force f = m0_late + m1_late + m2_late + m3_late }}"
    );
    let mut written = text_of(&written);
    for n in 0..4 {
        written = written.replace(&format!("m{n}_"), &format!("b[{n}]."));
    }
    let sorted = |text: &str| {
        let mut lines: Vec<String> = text
            .lines()
            .filter(|line| !line.starts_with("noise"))
            .map(str::to_string)
            .collect();
        lines.sort();
        lines
    };
    assert_eq!(sorted(&text_of(&bank)), sorted(&written));
}

#[test]
fn a_member_is_set_by_its_name() {
    let bank = format!(
        "instrument a {{ {SENSE} bank b over i in 0 .. 1 {{ param p = 1 N in 0 N .. 9 N \
         let q = p + i * 1 N }} force f = sum(b.q) }}"
    );
    let set = |name: &str| Options {
        sets: vec![(name.into(), "3 N".into())],
        ..Options::default()
    };
    let force = |options: &Options| {
        let (_, program, diagnostics) = check_text(&bank, options);
        let model = &program
            .unwrap_or_else(|| panic!("{diagnostics:?}"))
            .instruments[0];
        model.dag.real(model.forces[0].value)
    };
    assert_eq!(force(&Options::default()), Some(3.0));
    assert_eq!(force(&set("b[1].p")), Some(5.0));
    assert_eq!(force(&set("a.b[0].p")), Some(5.0));
}

#[test]
fn a_missing_brace_in_a_bank_is_found_there() {
    let text = "instrument a {
    sense x: length in 0 mm .. 10 mm over 1 ms
    bank b over i in 0 .. 3 {
        states s { up -> down when x > 1 mm
        let y = x
    force f = 1 N/m * sum(b.y)
}
";
    let (_, _, diagnostics) = check_text(text, &Options::default());
    let codes: Vec<&str> = diagnostics.iter().map(|d| d.code.number()).collect();
    // The machine and the bank; what stands behind them is understood.
    assert_eq!(codes, ["WH0106", "WH0106"], "{diagnostics:?}");
}

#[test]
fn a_bank_is_laid_out_once() {
    let text = "instrument a { sense x: length in 0 mm .. 1 mm bank b over i in 0 .. 1 {\n\
                let y = each( x , 2*x )\n param k = 1 } force f = 1 N/m * b[ 1 ].y }";
    let once = layout(0, text).unwrap_or_else(|e| panic!("{e:?}"));
    assert!(
        once.contains("    bank b over i in 0 .. 1 {\n        let y = each(x, 2 * x)\n"),
        "{once}"
    );
    assert!(once.contains("b[1].y"), "{once}");
    assert_eq!(layout(0, &once).ok(), Some(once));
}
