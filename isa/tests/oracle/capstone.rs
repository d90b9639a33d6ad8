use crate::{normal, samples};
use capstone::prelude::*;
use capstone::arch::arm::{ArchExtraMode, ArchMode};
use std::collections::BTreeMap;
use whippen_isa::*;

fn open() -> Capstone {
    let extra = [ArchExtraMode::MClass, ArchExtraMode::V8];
    Capstone::new().arm().mode(ArchMode::Thumb).extra_mode(extra.into_iter()).build().expect("Capstone has Thumb")
}

#[test]
fn rows() {
    let cs = open();
    let mut bad: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut total = 0;
    for (i, e) in Encoding::all().enumerate() {
        let s = samples::of_encoding(e, 400, i as u64);
        if s.is_empty() { bad.entry(format!("{e}")).or_default().push("NO SAMPLES".into()); }
        for (word, inst) in s {
            total += 1;
            let mut code = Vec::new();
            let mut n = 1;
            if let (Some(c), false) = (inst.cond, e.op() == Op::B && matches!(e.form(), Form::T1 | Form::T3)) {
                code.extend(samples::it_block(c).0.to_le_bytes());
                n = 2;
            }
            code.extend(samples::bytes(word, e.size()));
            match inst.encode(Arch::V8M) {
                Ok(c) => { let (a,b)=c.halfwords(); let w = b.map_or(a as u32, |b| (a as u32) << 16 | b as u32); if w != word { bad.entry(format!("{e}")).or_default().push(format!("ENC {word:08x} {w:08x}")); } }
                Err(x) => bad.entry(format!("{e}")).or_default().push(format!("ENC {word:08x} {inst} {x:?}")),
            }
            let got = cs.disasm_count(&code, 0x1000, n).unwrap();
            let t = got.iter().nth(n-1).map(|i| format!("{} {}", i.mnemonic().unwrap_or(""), i.op_str().unwrap_or("")));
            let ours = normal::text(&inst.to_string());
            let theirs = t.as_deref().map(normal::text).unwrap_or("-".into());
            if ours != theirs.trim() { bad.entry(format!("{e}")).or_default().push(format!("{word:08x} ours `{ours}` theirs `{theirs}`")); }
        }
    }
    for (k, v) in &bad { println!("{k}: {}", v.len()); for x in v.iter().take(3) { println!("    {x}"); } }
    println!("total {total} bad {}", bad.values().map(|v| v.len()).sum::<usize>());
    assert!(bad.is_empty());
}

#[test]
fn random() {
    for (v8, arch) in [(true, Arch::V8M), (false, Arch::V7EM)] {
    let extra: &[_] = if v8 { &[ArchExtraMode::MClass, ArchExtraMode::V8] } else { &[ArchExtraMode::MClass] };
    let cs = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode(extra.iter().copied()).build().unwrap();
    let mut r = samples::Random::new(7);
    let mut over: BTreeMap<String, (u32, Vec<String>)> = BTreeMap::new();
    let mut under: BTreeMap<String, (u32, Vec<String>)> = BTreeMap::new();
    let mut test = |word: u32, size: u32| {
        let (a, b) = samples::halves(word, size);
        let code = samples::bytes(word, size);
        let got = cs.disasm_count(&code, 0x1000, 1).unwrap();
        let t = got.iter().next().map(|i| format!("{} {}", i.mnemonic().unwrap_or(""), i.op_str().unwrap_or("")));
        match (decode(a, b, arch, ItState::OUTSIDE), t) {
            (Ok(i), None) => { let e = over.entry(i.encoding.to_string()).or_default(); e.0 += 1; if e.1.len() < 3 { e.1.push(format!("{word:08x} {i}")) } }
            (Err(NotDecoded::Undefined), Some(t)) => { let e = under.entry(t.split(|c| c == ' ' || c == '.').next().unwrap().to_string()).or_default(); e.0 += 1; if e.1.len() < 3 { e.1.push(format!("{word:08x} {t}")) } }
            _ => {}
        }
    };
    for hw in 0..0xe800 { test(hw, 2); }
    for _ in 0..1_000_000 { let w = r.next(); if is_wide((w >> 16) as u16) { test(w, 4) } else { test(w | 0xe8000000, 4) } }
    println!("==== {arch:?}: we decode, they do not");
    for (k, v) in over { println!("{k}: {} {:?}", v.0, v.1); }
    println!("---- they decode, we say undefined");
    for (k, v) in under { println!("{k}: {} {:?}", v.0, v.1); }
    }
}
