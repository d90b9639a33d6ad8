//! Parts of random kernels against the whole, by the interpreter.

use super::*;
use whippen_kernel::random::{self, Rng};
use whippen_kernel::{CHANNEL, Interp, verify, without_probes};

fn random_kernel(seed: u64) -> Kernel {
    without_probes(&random::kernel(seed))
}

/// Runs a whole and its parts on the same words; all that can be seen of them is the same.
fn compare(kernel: &Kernel, parts: &Parts, rng: &mut Rng, told: &str) {
    for part in &parts.parts {
        if let Err(errors) = verify(&part.kernel) {
            panic!("{told}: {errors:#?}\n{}\nof\n{kernel}", part.kernel);
        }
    }
    let mut whole = Interp::checked(kernel, 1).expect("verifies");
    let mut running = Running::new(parts).expect("verifies");
    let first = random::inputs(rng, kernel, 1);
    whole.init(&first);
    running.init(&first);
    let mut out = [0, 1].map(|_| vec![0; kernel.outputs.len()]);
    for tick in 0..20 {
        for (at, live) in kernel.lives.iter().enumerate() {
            if rng.chance(1, 3) {
                let word = random::Draw::interesting(rng, live.range) as i32;
                whole.set_live(at, word).expect("in range");
                running.set_live(at, word).expect("in range");
            }
        }
        let words = random::inputs(rng, kernel, 1);
        whole.tick(&words, &mut out[0]);
        running.tick(&words, &mut out[1]).expect("in range");
        let told = || format!("{told}, tick {tick}\n{kernel}");
        assert_eq!(out[0], out[1], "{}", told());
        assert_eq!(whole.drain_events(), running.drain_events(), "{}", told());
        for (at, cell) in kernel.cells.iter().enumerate() {
            for word in 0..cell.len as usize {
                let (want, found) = (whole.cell(0, at, word), running.cell(at, word));
                assert_eq!(want, found, "{} {word}: {}", cell.name, told());
            }
        }
        assert_eq!(running.violation(), None, "{}", told());
    }
}

/// The cells of the tail, but for what it leaves.
fn cells_of_tail(parts: &Parts) -> Vec<String> {
    let cells = parts.parts.last().map(|tail| &tail.kernel.cells);
    let names = cells.into_iter().flatten().map(|cell| cell.name.clone());
    names.filter(|name| name != "wires").collect()
}

/// Random kernels, members around random instructions, apart and together.
#[test]
fn parts_of_random_kernels_do_what_the_whole_does() {
    let kernels = whippen_need::count("WHIPPEN_KERNELS", 3000);
    let (mut cuts, mut several, mut crossing, mut sooner) = (0, 0, 0_u64, 0);
    let mut beside_tail = 0;
    for seed in 0..kernels {
        let kernel = random_kernel(seed);
        let mut rng = Rng::new(seed ^ 0x5eed);
        let count = kernel.tick.insts.len() as u64;
        let wanted: Vec<usize> = (0..8).map(|_| rng.below(count.max(1)) as usize).collect();
        let mut tail = Vec::new();
        if let Some(parts) =
            split_around(&kernel, &wanted, |member| member as u32, Beside::default())
        {
            tail = cells_of_tail(&parts);
            cuts += 1;
            several += u64::from(parts.parts.len() > 3);
            crossing += u64::from(parts.wires.len() > 2);
            compare(&kernel, &parts, &mut rng, &format!("seed {seed}"));
        }
        let beside = Beside {
            early_cycles_min: rng.chance(1, 2).then_some(1),
            sound: false,
        };
        if let Some(parts) = split_around(&kernel, &wanted, |member| member as u32 % 2, beside) {
            let begins = usize::from(parts.parts[0].role == Role::Early);
            assert!(parts.parts.len() <= 4 + begins);
            sooner += begins;
            what_is_early_stands_alone(&parts);
            let cells = cells_of_tail(&parts);
            let is_there = |cell: &String| cells.contains(cell);
            assert!(
                begins > 0 || tail.iter().all(is_there),
                "seed {seed}: {tail:?}"
            );
            compare(&kernel, &parts, &mut rng, &format!("seed {seed}, together"));
        }
        if kernel.cells.is_empty() {
            continue;
        }
        let mut heard = kernel.clone();
        let channel = rng.below(kernel.cells.len() as u64) as usize;
        heard.cells[channel].name += CHANNEL;
        let beside = Beside {
            sound: true,
            ..beside
        };
        if let Some(parts) = split_around(&heard, &wanted, |member| member as u32 % 2, beside) {
            beside_tail += 1;
            what_is_heard_stands_alone(&parts);
            compare(&heard, &parts, &mut rng, &format!("seed {seed}, sound"));
        }
    }
    println!("{beside_tail} with sound");
    assert!(beside_tail > kernels / 50);
    println!("{cuts} of {kernels} cut, {several} with several members, {crossing} with wires");
    assert!(cuts > kernels / 2 && several > kernels / 4 && crossing > kernels / 10);
    println!("{sooner} with an early part");
    assert!(sooner as u64 > kernels / 50);
}

/// Random kernels without members, some of whose cells is heard.
#[test]
fn what_is_heard_apart_from_what_is_felt_does_what_the_whole_does() {
    let kernels = whippen_need::count("WHIPPEN_KERNELS", 3000);
    let (mut cuts, mut sooner, mut crossing) = (0, 0, 0);
    for seed in 0..kernels {
        let mut kernel = random_kernel(seed);
        let mut rng = Rng::new(seed ^ 0x50_0d);
        if kernel.cells.is_empty() {
            continue;
        }
        let channel = rng.below(kernel.cells.len() as u64) as usize;
        kernel.cells[channel].name += CHANNEL;
        let cycles_min = [1, if rng.chance(1, 2) { 1 } else { u64::MAX }];
        let Some(parts) = split_sound_from(&kernel, cycles_min) else {
            continue;
        };
        cuts += 1;
        sooner += u64::from(parts.parts[0].role == Role::Early);
        let to_sound = |wire: &Wire| wire.to.iter().any(|to| Some(to.part) == parts.heard());
        crossing += u64::from(parts.wires.iter().any(to_sound));
        assert!(!parts.has_members());
        what_is_early_stands_alone(&parts);
        what_is_heard_stands_alone(&parts);
        compare(&kernel, &parts, &mut rng, &format!("seed {seed}"));
    }
    println!("{cuts} of {kernels} cut, {sooner} with an early part, {crossing} with wires to it");
    assert!(cuts > kernels / 50 && sooner > kernels / 200 && crossing > kernels / 200);
}

/// It reads no sensor, and neither takes something of other parts nor leaves it for the head.
fn what_is_early_stands_alone(parts: &Parts) {
    if parts.parts[0].role != Role::Early {
        return;
    }
    let mut insts = parts.parts[0].kernel.tick.all_insts();
    assert!(!insts.any(|inst| matches!(inst.op, Op::In(_))));
    for wire in &parts.wires {
        let role = |of: &Of| parts.parts[of.part].role;
        assert!(wire.to.iter().all(|to| role(to) != Role::Early));
        let between = wire.from.part == 0 && wire.to.iter().any(|to| role(to) == Role::Head);
        assert!(!between);
    }
}

/// It has neither live values nor sensors, takes nothing of the tail and leaves nothing.
fn what_is_heard_stands_alone(parts: &Parts) {
    let heard = parts.heard().expect("a part");
    let part = &parts.parts[heard];
    assert_eq!(part.role, Role::Sound);
    assert_eq!(part.kernel.channels().len(), 1);
    assert!(parts.lives.iter().all(|live| live.part != heard));
    let goes =
        |inst: &whippen_kernel::Inst| matches!(inst.op, Op::In(_) | Op::Out(_) | Op::Emit(_));
    assert!(!part.kernel.tick.all_insts().any(goes));
    assert!(parts.wires.iter().all(|wire| wire.from.part < heard));
}
