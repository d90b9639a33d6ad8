//! How fast an image of `whippen build` runs on both cores of an emulated RP2350, fed with made-up
//! sensor words: keys that go up and down.
//!
//! `cargo bench -p whippen-emulator --bench board -- FILE.elf KEYS SECONDS..`; a run for each
//! number of seconds of the board, with what must not change between versions: instructions, cycles
//! waited, ticks, and a hash of RAM.

use whippen_emulator::{BoardKind, Converter, ConverterSetup, Machine, Ports, build, elf::Elf};

const RAM: u32 = 0x2000_0000;
const RAM_BYTES: usize = 520 * 1024;
const TICKS_PER_S: f64 = 44_100.0;

/// Seconds on a processor so far, of the whole process (Linux).
fn now() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let behind_name = stat.rsplit(')').next().unwrap_or_default();
    // User time and system time are the fields 14 and 15; the name is the second.
    let fields = behind_name.split_whitespace().skip(11).take(2);
    let ticks = fields.filter_map(|field| field.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

fn machine(elf: &Elf, keys: u32, ticks: u32) -> (Machine, Ports) {
    let kind = BoardKind::Rp2350;
    let mut board = kind.board();
    board.vector_table = 0x1000_0000;
    let setup = ConverterSetup {
        keys,
        ..ConverterSetup::default()
    };
    let (mut m, ports) = build(kind, board, setup).expect("a board");
    elf.load(&mut m.bus.memory, true)
        .expect("an image that fits");
    let converter: &mut Converter = m.bus.device_mut(ports.converter).expect("a converter");
    let mut noise = 12345_u32;
    for tick in 0..ticks {
        for key in 0..keys {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let phase = (tick + 137 * key) % 4000;
            let way = phase.min(4000 - phase);
            let word = 2000 + way * 25 + (noise >> 28);
            converter.samples.push_back(word as u16);
        }
    }
    m.reset();
    (m, ports)
}

fn hash(m: &Machine) -> u64 {
    let mut ram = vec![0; RAM_BYTES];
    m.bus.memory.read(RAM, &mut ram).expect("RAM");
    let mix = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    ram.iter().fold(0xcbf2_9ce4_8422_2325, mix)
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let [file, keys, runs @ ..] = &arguments[..] else {
        return println!("skipped: -- FILE.elf KEYS SECONDS.. says what runs");
    };
    let bytes = std::fs::read(file).expect("an image");
    let elf = Elf::parse(&bytes, false).expect("an ELF file");
    let keys = keys.parse().expect("how many keys");
    for seconds in runs.iter().map(|s| s.parse::<f64>().expect("seconds")) {
        let (mut m, ports) = machine(&elf, keys, (seconds * TICKS_PER_S * 1.02) as u32);
        let (start, clock) = (now(), std::time::Instant::now());
        let stop = m.run((seconds * f64::from(m.board().clock_hz)) as u64);
        let (busy, elapsed) = (now() - start, clock.elapsed().as_secs_f64());
        let converter: &Converter = m.bus.device(ports.converter).expect("a converter");
        println!(
            "{seconds} s of the board: {busy:.2} s ({elapsed:.2} s elapsed), {:.1} M instructions/s; \
             {stop:?}, {} instructions, waited {:?}, {} ticks, {} overruns, RAM {:016x}",
            m.instructions() as f64 / busy / 1e6,
            m.instructions(),
            m.waited_cycles(),
            converter.ticks(),
            converter.overruns(),
            hash(&m)
        );
    }
}
