use crate::samples;
use std::collections::BTreeMap;
use std::process::Command;
use whippen_isa::*;

fn lines_of(inst: &Inst) -> String {
    let own = matches!(inst.encoding.it_rule(), ItRule::Never);
    if inst.op() == Op::IT {
        return format!("{inst}{}\n\n", fill(inst));
    }
    match inst.cond {
        Some(c) if !own => format!("it {}\n{inst}\n", c.name()),
        _ => format!("{inst}\n\n"),
    }
}

fn fill(inst: &Inst) -> String {
    let mut it = ItState::after_it((inst.imm >> 4) as u8, (inst.imm & 15) as u8).unwrap();
    let mut s = String::new();
    while let Some(c) = it.cond() { s += &format!("; nop{c}"); it = it.advance(); }
    s
}

#[test]
fn gas() {
    let dir = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let mut all = Vec::new();
    for (i, e) in Encoding::all().enumerate() {
        for (word, inst) in samples::of_encoding(e, 200, 1000 + i as u64) { if inst.cond != Some(Cond::AL) && !inst.to_string().contains("#-0") { all.push((word, inst)); } }
    }
    let mut bad: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut dead = vec![false; all.len()];
    for pass in 0..2 {
        let mut src = String::from(".syntax unified\n.thumb\n");
        for (i, (_, inst)) in all.iter().enumerate() { if dead[i] { src.push_str("\n\n") } else { src.push_str(&lines_of(inst)) } }
        std::fs::write(dir.join("t.s"), src).unwrap();
        let out = Command::new("arm-none-eabi-as").args(["-mcpu=cortex-m33", "-mfpu=fpv5-sp-d16", "-W", "-o"]).arg(dir.join("t.o")).arg(dir.join("t.s")).output().unwrap();
        for l in String::from_utf8_lossy(&out.stderr).lines() {
            let mut p = l.splitn(4, ':');
            let (_, n, _, m) = (p.next(), p.next(), p.next(), p.next());
            if let (Some(n), Some(m)) = (n.and_then(|n| n.trim().parse::<usize>().ok()), m) {
                let i = (n - 3) / 2;
                if pass == 1 { println!("AGAIN {l}"); }
                dead[i] = true;
                bad.entry(all[i].1.encoding.to_string()).or_default().push(format!("{:08x} {} ({}): {m}", all[i].0, all[i].1, all[i].1.cond.is_some()));
            }
        }
    }
    let out = Command::new("arm-none-eabi-objcopy").args(["-O", "binary"]).arg(dir.join("t.o")).arg(dir.join("t.bin")).output().unwrap();
    assert!(out.status.success());
    let bin = std::fs::read(dir.join("t.bin")).unwrap();
    let mut at = 0;
    for (i, (word, inst)) in all.iter().enumerate() {
        if dead[i] { continue }
        if lines_of(inst).starts_with("it ") && inst.op() != Op::IT { at += 2; }
        let want = samples::bytes(*word, inst.size());
        // resynchronise on the size that the assembler chose
        let hw = u16::from_le_bytes([bin[at], bin[at + 1]]);
        let size = if is_wide(hw) { 4 } else { 2 };
        let got = &bin[at..at + size];
        if got != want { bad.entry(inst.encoding.to_string()).or_default().push(format!("{word:08x} {inst}: got {got:02x?}")); }
        at += size + if inst.op() == Op::IT { 2 * fill(inst).matches("nop").count() } else { 0 };
    }
    for (k, v) in &bad { println!("{k}: {}", v.len()); for x in v.iter().take(3) { println!("    {x}"); } }
}

#[test]
fn unpredictable() {
    let dir = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let mut all = Vec::new();
    for (i, e) in Encoding::all().enumerate() {
        let (mask, bits) = e.fixed_bits();
        let mut r = samples::Random::new(77 + i as u64);
        for _ in 0..300 {
            let word = bits | r.next() & r.next() & !mask & if e.size() == 4 { u32::MAX } else { 0xffff };
            let word = if r.next() & 1 == 0 { word } else { bits | (r.next() | r.next()) & !mask & if e.size() == 4 { u32::MAX } else { 0xffff } };
            let (a, b) = samples::halves(word, e.size());
            if let Err(NotDecoded::Unpredictable { reading, why }) = decode(a, b, Arch::V8M, ItState::OUTSIDE) {
                if reading.encoding == e && why != Why::ShouldBe { all.push((word, reading, why)); }
            }
        }
    }
    let mut src = String::from(".syntax unified\n.thumb\n");
    for (_, inst, _) in all.iter() { src.push_str(&format!("{inst}\n")); }
    std::fs::write(dir.join("u.s"), src).unwrap();
    let out = Command::new("arm-none-eabi-as").args(["-mcpu=cortex-m33", "-mfpu=fpv5-d16", "-o"]).arg(dir.join("u.o")).arg(dir.join("u.s")).output().unwrap();
    let mut ok = vec![true; all.len()];
    for l in String::from_utf8_lossy(&out.stderr).lines() {
        if let Some(n) = l.split(':').nth(1).and_then(|n| n.trim().parse::<usize>().ok()) { ok[n - 3] = false; }
    }
    let mut bad: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (i, (w, inst, why)) in all.iter().enumerate() {
        if ok[i] { bad.entry(format!("{} {why:?}", inst.encoding)).or_default().push(format!("{w:08x} {inst}")); }
    }
    println!("{} of {} accepted", ok.iter().filter(|x| **x).count(), ok.len());
    for (k, v) in &bad { println!("{k}: {} {:?}", v.len(), &v[..v.len().min(3)]); }
}
