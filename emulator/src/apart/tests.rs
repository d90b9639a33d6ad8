//! Two cores that run apart do what they do by turns: random programs, cycle by cycle.
//!
//! A run whose instructions somebody observes never runs apart, so it is the judge.

mod devices;
mod programs;

use super::*;
use crate::boards::Ports;
use crate::bus::{Access, Bus, BusError, Device, DeviceId, Waits};
use crate::lines::Start;
use crate::observe::{Observer, Step};
use crate::register::Register;
use crate::stop::Stop;
use crate::system::nvic::FIRST;
use crate::translate::RunMode;

const PORT: u32 = 0x6000_0000;
const SHARED: u32 = 0x2003_0000;
/// By core: vectors, code, data and the end of the stack, each core in a group of banks of its own.
const GROUPS: [u32; 2] = [0x2000_0000, 0x2004_0000];
/// A bank of each core's own.
const NEAR: [u32; 2] = [0x2008_0800, 0x2008_1000];
const CODE: u32 = 0x400;
const DATA: u32 = 0x8000;
const STACK: u32 = 0x1_0000;
/// Where RAM begins, and how much there is.
const RAM: (u32, usize) = (0x2000_0000, 520 << 10);
/// The interrupts of alarms and the bell, the DMA, FIFOs, doorbells, a serial port, the converter.
const INTERRUPTS: [u32; 9] = [0, 1, 2, 3, 10, 25, 26, 33, 46];

struct Random(u64);

impl Random {
    fn word(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32) as u32
    }

    fn below(&mut self, n: u32) -> u32 {
        self.word() % n
    }
}

/// Answers with the cycle; every now and then writes to memory and interrupts a core.
struct Bell {
    due: u64,
    period: u64,
    asked: Vec<(usize, u64)>,
    /// As devices are whose accesses touch no memory: these do not.
    keeps_to_itself: bool,
}

impl Device for Bell {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        self.asked.push((access.core, access.cycle));
        Ok(access.cycle as u32)
    }

    fn write(&mut self, access: Access, _: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.asked.push((access.core, access.cycle));
        bus.lines.pulse(1 - access.core, 3);
        Ok(())
    }

    fn keeps_to_itself(&self, _: u32, _: bool) -> bool {
        self.keeps_to_itself
    }

    fn due(&self) -> u64 {
        self.due
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.due += self.period;
        let core = (cycle / self.period % 2) as usize;
        let word = GROUPS[core] + DATA + 4 * (cycle % 32) as u32;
        let _ = bus.write(word, 4, cycle as u32, cycle);
        bus.lines.pulse(core, 3);
    }
}

/// Notes exceptions, and ends a run behind some that were left. Nobody runs apart while it looks at
/// instructions.
struct Exceptions<const INSTRUCTIONS: bool> {
    /// What happened to which core: an exception taken, returned from, left; its number; the cycle.
    seen: Vec<(&'static str, usize, u32, u64)>,
    /// The run ends behind one of so many.
    rarely: u64,
    stops: bool,
}

impl<const INSTRUCTIONS: bool> Exceptions<INSTRUCTIONS> {
    fn new(rarely: u64) -> Self {
        Self {
            seen: Vec::new(),
            rarely,
            stops: false,
        }
    }
}

impl<const INSTRUCTIONS: bool> Observer for Exceptions<INSTRUCTIONS> {
    const INSTRUCTIONS: bool = INSTRUCTIONS;

    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, core: usize, number: u32, cycle: u64) {
        self.seen.push(("taken", core, number, cycle));
    }

    fn exception_return(&mut self, core: usize, number: u32, cycle: u64) {
        self.seen.push(("return", core, number, cycle));
    }

    fn resumed(&mut self, core: usize, cycle: u64) {
        self.seen.push(("left", core, 0, cycle));
        self.stops = cycle.is_multiple_of(self.rarely);
    }

    fn stops(&self) -> bool {
        self.stops
    }
}

fn write(m: &mut Machine, address: u32, halfwords: &[u16]) {
    let bytes: Vec<u8> = halfwords.iter().flat_map(|h| h.to_le_bytes()).collect();
    m.bus.memory.write(address, &bytes).unwrap();
}

/// A machine with its devices.
struct Bench {
    machine: Machine,
    bell: DeviceId,
    ports: Ports,
}

/// A chip whose cores run these programs.
fn ready(seed: u64, program: impl Fn(usize, &mut Random) -> Vec<u16>) -> Bench {
    let mut random = Random(seed);
    let (mut m, ports) = devices::chip(&mut random);
    let period = 50 + u64::from(random.below(5000));
    let of_bell = Bell {
        due: period,
        period,
        asked: Vec::new(),
        keeps_to_itself: !seed.is_multiple_of(4),
    };
    let waits = Waits { read: 1, write: 2 };
    let bell = m.bus.attach(PORT, 0x1000, waits, Box::new(of_bell));
    let equal = random.below(8) != 0;
    m.bus.fabric.set_priorities(if equal { 0 } else { 1 << 4 });
    let near = random.below(2) == 0;
    for (core, base) in GROUPS.into_iter().enumerate() {
        devices::write_handlers(&mut m, base, &mut random);
        write(&mut m, base + CODE, &program(core, &mut random));
        start(&mut m, core, near, &mut random);
    }
    Bench {
        machine: m,
        bell,
        ports,
    }
}

/// Starts a core, with registers that the programs expect, and with interrupts.
fn start(m: &mut Machine, core: usize, near: bool, random: &mut Random) {
    let base = GROUPS[core];
    let start = Start {
        vector_table: base,
        stack: base + STACK,
        address: base + CODE + 1,
    };
    m.start(core, start);
    let cpu = m.cpu_mut(core);
    cpu.system.cpacr = 0xf << 20;
    (cpu.system.demcr, cpu.system.dwt_control) = (1 << 24, 1);
    for number in INTERRUPTS.map(|number| FIRST + number) {
        cpu.system.nvic.enabled[number as usize / 64] |= 1 << (number % 64);
        cpu.system.nvic.priority[number as usize] = [0, 0x40, 0x80][random.below(3) as usize];
    }
    let registers = [
        (4, PORT),
        (5, SHARED + 4 * random.below(8)),
        (6, if near { NEAR[core] } else { base + DATA }),
        (8, GROUPS[1 - core] + DATA),
        (9, base + CODE),
        (10, 0xbf00),
        (11, GROUPS[1 - core] + CODE),
        (12, [0xbf00, 0x3001][random.below(2) as usize]),
        (14, base + CODE + 1),
    ];
    for (number, value) in registers {
        cpu.set(Register::core(number), value);
    }
}

impl Bench {
    /// Everything that can be seen of it but RAM.
    fn state(&self) -> impl PartialEq + std::fmt::Debug + use<> {
        let m = &self.machine;
        let cores = [0, 1].map(|index| {
            let (core, cpu) = (&m.cores[index], &m.cores[index].cpu);
            let registers: Vec<u32> = Register::all().map(|r| cpu.get(r)).collect();
            let (nvic, system) = (&cpu.system.nvic, &cpu.system);
            let counts = (core.cycle, core.instructions, core.pipe_state());
            let waits = (cpu.activity, cpu.event, m.bus.exclusives[index]);
            let exceptions = (
                nvic.pending,
                nvic.active,
                nvic.enabled,
                nvic.priority.clone(),
            );
            let float = (system.fpccr, system.fpcar);
            (
                counts,
                registers,
                waits,
                exceptions,
                system.systick.clone(),
                float,
            )
        });
        let now = m.now();
        let fabric = (m.bus.fabric.busy(now), m.bus.fabric.waited);
        let asked = m.bus.device::<Bell>(self.bell).unwrap().asked.clone();
        (cores, fabric, asked, devices::heard(m, &self.ports))
    }

    fn ram(&self) -> Vec<u8> {
        let mut bytes = vec![0; RAM.1];
        self.machine.bus.memory.read(RAM.0, &mut bytes).unwrap();
        bytes
    }
}

/// A bench that runs fast, and one that is its judge.
struct Both {
    seed: u64,
    fast: Bench,
    judge: Bench,
    of_fast: Exceptions<false>,
    of_judge: Exceptions<true>,
}

impl Both {
    fn ready(seed: u64, program: impl Fn(usize, &mut Random) -> Vec<u16>) -> Self {
        // Most runs end rarely before their time.
        let rarely = [u64::MAX, 1 << 20, 16, 3][seed as usize % 4];
        Self {
            seed,
            fast: ready(seed, &program),
            judge: ready(seed, &program),
            of_fast: Exceptions::new(rarely),
            of_judge: Exceptions::new(rarely),
        }
    }

    fn random(seed: u64) -> Self {
        Self::ready(seed, |_, random| programs::program(random))
    }

    /// Runs both, which must agree; whether they can go on.
    fn run(&mut self, until: u64) -> bool {
        (self.of_fast.stops, self.of_judge.stops) = (false, false);
        let fast = self.fast.machine.run_observed(until, &mut self.of_fast);
        let judge = self.judge.machine.run_observed(until, &mut self.of_judge);
        let seed = self.seed;
        assert_eq!(fast, judge, "seed {seed}, {until}");
        agree(&self.of_fast.seen, &self.of_judge.seen, seed, until);
        agree(&self.fast.state(), &self.judge.state(), seed, until);
        let looks = until.is_multiple_of(8);
        assert!(
            !looks || self.fast.ram() == self.judge.ram(),
            "seed {seed}, {until}: RAM"
        );
        fast == Stop::Limit
    }
}

/// Says where two differ, if they do.
fn agree<T: PartialEq + std::fmt::Debug>(fast: &T, judge: &T, seed: u64, until: u64) {
    if fast != judge {
        let (fast, judge) = (format!("{fast:?}"), format!("{judge:?}"));
        let same = fast.bytes().zip(judge.bytes()).take_while(|(a, b)| a == b);
        let from = same.count().saturating_sub(200);
        let part = |text: &str| text.chars().skip(from).take(400).collect::<String>();
        let (fast, judge) = (part(&fast), part(&judge));
        panic!("seed {seed}, up to {until}:\n{fast}\nand not\n{judge}");
    }
}

/// Where a run ends next: a few cycles on, or some thousand.
fn next(random: &mut Random, until: u64) -> u64 {
    let most = [40, 400, 4000][random.below(3) as usize];
    until + 1 + u64::from(random.below(most))
}

#[test]
fn random_programs_of_two_cores_agree_with_turns() {
    let programs = whippen_need::count("WHIPPEN_PROGRAMS", 60);
    let (mut stood, mut back, mut apart, mut deeds, mut translated) = (0, 0, 0, 0, 0);
    let (mut ends, mut exceptions) = (0, 0);
    for seed in 1..=programs {
        let mut both = Both::random(seed);
        let mut random = Random(seed * 91);
        let mut until = 0;
        while until < 40_000 {
            until = next(&mut random, until);
            // However long a window is, what comes of it is the same.
            both.fast.machine.apart.window = 1 << random.below(13);
            if !both.run(until) {
                ends += 1;
                break;
            }
        }
        let fast = &both.fast.machine;
        stood += fast.apart.stood;
        back += fast.apart.back;
        apart += fast.apart.cycles;
        deeds += fast.apart.deeds;
        exceptions += both.of_fast.seen.len();
        translated += count_translated(fast, RunMode::Apart);
        assert_eq!(both.judge.machine.apart.stood, 0);
    }
    // All ways were gone: windows that stand, those that are taken back, and most of the time.
    assert!(
        stood > 1000 && back > 100,
        "{stood} windows, {back} taken back"
    );
    assert!(deeds > 1000, "{deeds} deeds");
    assert!(apart > programs * 40_000 / 8, "{apart} cycles apart");
    assert!(ends < programs / 4, "{ends} programs ended");
    assert!(exceptions > 1000, "{exceptions} exceptions");
    if cfg!(any(target_arch = "x86_64", target_arch = "aarch64")) {
        assert!(translated > 100, "{translated} units");
    }
}

/// Units of all cores, as they are now.
fn count_translated(m: &Machine, mode: RunMode) -> usize {
    let blocks = m.cores.iter().flat_map(|core| &core.code.blocks);
    blocks.map(|block| block.translated.count(mode)).sum()
}

/// One core runs by blocks that are chained. In between it forgets its code, or gets other numbers
/// for states of the pipeline.
#[test]
fn random_programs_of_one_core_agree_with_single_steps() {
    let (mut links, mut longest, mut translated) = (0, 0, 0);
    for seed in 1..=60 {
        let mut both = Both::random(seed);
        both.fast.machine.halt(1);
        both.judge.machine.halt(1);
        let mut random = Random(seed * 57);
        let mut until = 0;
        while until < 40_000 {
            until = next(&mut random, until);
            if !both.run(until) {
                break;
            }
            let fast = &mut both.fast.machine;
            translated += count_translated(fast, RunMode::Alone);
            let core = &mut fast.cores[0];
            links += core.code.blocks.iter().filter(|b| b.is_linked()).count();
            match random.below(4) {
                0 => {
                    let pipe = core.pipe_state();
                    core.forget_numbers();
                    core.pipe = core.number(pipe);
                    assert!(core.code.blocks.iter().all(|b| !b.is_linked()));
                }
                1 => fast.forget_code(),
                _ => longest = longest.max(core.pipes.len()),
            }
        }
    }
    assert!(
        links > 1000 && longest > 4,
        "{links} chained blocks, {longest} states of the pipeline"
    );
    if cfg!(any(target_arch = "x86_64", target_arch = "aarch64")) {
        assert!(translated > 100, "{translated} units");
    }
}

/// A core sets its SysTick, after more and more instructions, in a window that ends before that is
/// due.
#[test]
fn a_timer_that_a_window_sets_is_due_in_the_next_one() {
    for nops in 0..40 {
        let program = |core: usize, _: &mut Random| {
            let sets = [vec![0xbf00; nops], devices::set_timer(150)].concat();
            let stays = vec![0xe7fe];
            [if core == 0 { sets } else { Vec::new() }, stays].concat()
        };
        let mut both = Both::ready(4, program);
        assert!(both.run(3000), "{nops}");
        let timer = both.of_fast.seen.iter().filter(|seen| seen.2 == 15);
        assert!(timer.count() > 20, "{nops}");
    }
}
