//! Functions by a C compiler: loops, tables, calls, divisions, floating point. Without the compiler
//! the test says so.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use whippen_budget::{Annotations, Bound, Code, NotBounded};
use whippen_deterministic::Rng;
use whippen_emulator::elf::Elf;

use super::{CODE, DATA, bound_of, machine, observed, returning};

const SOURCE: &str = "
#include <stdint.h>
#define AWAY __attribute__((noinline))
int32_t dot(const int16_t *x) { int32_t s = 0; for (int i = 0; i < 12; i++) s += x[i] * x[i + 12]; return s; }
void sort(int32_t *x) {
    for (int i = 1; i < 8; i++) {
        int32_t v = x[i]; int j = i;
        while (j > 0 && x[j - 1] > v) { x[j] = x[j - 1]; j--; }
        x[j] = v;
    }
}
int32_t choose(const int32_t *x, uint32_t a, int32_t b) {
    switch (a & 15) {
    case 0: return b * 3; case 1: return b / 7; case 2: return x[1] - b; case 3: return b ^ x[3]; case 4: return b << 5;
    case 5: return x[0] / (b | 1); case 6: return -b; case 9: return x[2] * x[3] + b; case 10: return 12; default: return b;
    }
}
static AWAY int32_t clamp(int32_t v, int32_t low, int32_t high) { return v < low ? low : v > high ? high : v; }
static AWAY int32_t scaled(int32_t v) { return clamp(v / 3, -1000, 1000) + clamp(v >> 4, 0, 255); }
int32_t nested(const int32_t *x) { return scaled(x[0]) + scaled(x[1]) * clamp(x[2], -4, 4); }
uint32_t greatest(const uint32_t *x, uint32_t a, uint32_t b) {
    (void)x; a &= 255; b &= 255;
    for (int i = 0; i < 16 && b; i++) { uint32_t r = a % b; a = b; b = r; }
    return a;
}
float horner(const float *x) { float y = x[0]; for (int i = 1; i < 8; i++) y = y * 0.5f + x[i]; return y / (1.0f + y * y); }
uint32_t crc(const uint8_t *x) {
    uint32_t c = ~0u;
    for (int i = 0; i < 10; i++) { c ^= x[i]; for (int k = 0; k < 8; k++) c = c & 1 ? c >> 1 ^ 0xedb88320u : c >> 1; }
    return ~c;
}
int32_t modes(int32_t *x, int32_t a) {
    int32_t y = x[1] * 5 + a;
    if (x[0] == 0) { if (y > 100) x[0] = 1; y -= 3; } else if (x[0] == 1) { if (y > 200) x[0] = 2; else if (y < 50) x[0] = 0; y <<= 1; }
    if (y > 300 && a < 0) y += x[2] / 3;
    if (y < 0) y = x[3] / 5;
    return y;
}
";

/// Functions, and how often any of their loops' heads runs.
const FUNCTIONS: &[(&str, u32)] = &[
    ("dot", 12),
    ("sort", 8),
    ("choose", 1),
    ("nested", 1),
    ("greatest", 17),
    ("horner", 7),
    ("crc", 11),
    ("modes", 1),
];

/// Links the functions at the address where tests put programs; symbols and bytes.
fn linked(gcc: &Path, level: &str) -> (Vec<u8>, BTreeMap<String, u32>) {
    let folder = tempfile::tempdir().expect("a folder");
    let [source, linked] = ["f.c", "f.elf"].map(|name| folder.path().join(name));
    std::fs::write(&source, SOURCE).expect("the source");
    let options = [
        "-mcpu=cortex-m33",
        "-mthumb",
        "-mfloat-abi=hard",
        "-mfpu=fpv5-sp-d16",
        "-nostdlib",
        "-fno-math-errno",
        "-Wl,--entry=dot",
        "-Wl,-Ttext=0x20000100",
    ];
    let mut command = Command::new(gcc);
    command.args(options).arg(level);
    command.arg(source).arg("-o").arg(&linked);
    assert!(command.status().expect("the compiler starts").success());
    let elf = std::fs::read(linked).expect("the ELF file");
    let elf = Elf::parse(&elf, true).expect("an ELF file");
    let code = elf
        .segments
        .iter()
        .find(|segment| segment.contains(CODE))
        .expect("code");
    let from = (CODE - code.run) as usize;
    let symbols = elf
        .symbols
        .iter()
        .map(|symbol| (symbol.name.clone(), symbol.address & !1))
        .collect();
    (code.bytes[from..].to_vec(), symbols)
}

/// Gives every loop that has no bound the same.
fn bounded(code: &Code, entry: u32, rounds_max: u32) -> Bound {
    let mut annotations: Annotations = returning();
    loop {
        match bound_of(code, entry, &annotations) {
            Err(NotBounded::NoRounds { head }) => annotations.loops.insert(head, rounds_max),
            other => return other.expect("a bound"),
        };
    }
}

#[test]
fn functions_by_a_c_compiler_keep_their_bounds() {
    let Some(gcc) = whippen_need::tool("arm-none-eabi-gcc") else {
        return;
    };
    let mut rng = Rng::new(5);
    for level in ["-O1", "-Os", "-O2", "-O3"] {
        let (bytes, symbols) = linked(&gcc, level);
        let code = Code::new(CODE, bytes.clone());
        for &(name, rounds_max) in FUNCTIONS {
            let entry = symbols[name];
            let bound = bounded(&code, entry, rounds_max);
            let mut slowest = 0;
            let mut machine = machine(&bytes);
            for _ in 0..400 {
                let word = |rng: &mut Rng| {
                    if rng.chance(1, 2) {
                        rng.below(512) as u32
                    } else {
                        rng.next() as u32
                    }
                };
                let data: Vec<u8> = (0..24).flat_map(|_| word(&mut rng).to_le_bytes()).collect();
                machine.bus.memory.write(DATA, &data).expect("RAM");
                let registers =
                    BTreeMap::from([(0, DATA), (1, word(&mut rng)), (2, word(&mut rng))]);
                slowest = slowest.max(observed(&mut machine, entry, &registers));
            }
            println!(
                "{level} {name}: observed {slowest}, bound {}",
                bound.cycles_max
            );
            assert!(
                slowest <= bound.cycles_max,
                "{level} {name}: {slowest} > {}",
                bound.cycles_max
            );
            let exact = ["dot", "horner"].contains(&name);
            assert!(
                !exact || slowest == bound.cycles_max,
                "{level} {name}: {slowest} < {}",
                bound.cycles_max
            );
        }
    }
}
