//! Several instruments on one keyboard, for another project: each zone plays what the reference
//! plays, as a relocatable file and as C text.

use whippen_compiler::check::Options;
use whippen_compiler::firmware::with_values_from;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::Interp;
use whippen_compiler::pipeline;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

use crate::one_interface::{STRICT, TARGET, ran};
use crate::tools::{Folder, WHIPPEN};

/// Ticks that are played.
const TICKS: u32 = 2000;

/// A spring below, another one whose weight differs key by key above, with events.
const PROGRAM: &str = "
instrument low {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    live param k = 80 N/m in 0 N/m .. 200 N/m
    force spring = k * x
}
instrument high {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    param weight = 0.1 N in 0 N .. 1 N
    states key { up -> down when x > 5 mm { emit note(speed: x') } down -> up when x < 4 mm { emit release() } }
    force weight = weight
    force push = if key is down then 0.5 N else 0 N
}
keyboard stage {
    board rp2350
    device mikey
    rate 44100 Hz
    keys C4 .. G4
    programs both
    zones both = { C4 .. E4: low, F4 .. G4: high }
    high.weight = { C4: 0.1 N, G4: 0.8 N }
}
";

const MAIN: &str = "
#include \"both.h\"
uint32_t sum = 2166136261u, events = 0;
static void mix(uint32_t word) { sum = (sum ^ word) * 16777619u; }
static uint16_t word(uint32_t tick, uint32_t key) {
    const uint32_t phase = (tick * (key + 5u) * 40u) % 131072u;
    return (uint16_t)(phase < 65536u ? phase : 131071u - phase);
}
static void feed(uint32_t tick) {
    for (uint32_t key = 0; key < LOW_KEYS; key++) low_state.inputs[key][LOW_INPUT_X] = word(tick, LOW_FIRST_KEY + key);
    for (uint32_t key = 0; key < HIGH_KEYS; key++) high_state.inputs[key][HIGH_INPUT_X] = word(tick, HIGH_FIRST_KEY + key);
}
void reset(void);
void reset(void) {
    struct high_event event;
    feed(0);
    low_init(&low_state);
    high_init(&high_state);
    for (uint32_t tick = 0; tick < 2000u; tick++) {
        feed(tick);
        low_tick(&low_state);
        high_tick(&high_state);
        for (uint32_t key = 0; key < LOW_KEYS; key++) mix((uint16_t)low_state.outputs[key][LOW_OUTPUT_DRIVE]);
        for (uint32_t key = 0; key < HIGH_KEYS; key++) mix((uint16_t)high_state.outputs[key][HIGH_OUTPUT_DRIVE]);
        while (high_read_event(&high_state, &event)) {
            events++;
            mix(event.tick); mix(event.key); mix(event.event);
            if (event.event == HIGH_EVENT_NOTE) mix((uint32_t)event.args[HIGH_NOTE_SPEED]);
        }
    }
    __asm__ volatile (\"movs r0, #0x18\\n ldr r1, =0x20026\\n bkpt #0xab\" ::: \"r0\", \"r1\");
    for (;;) {}
}
struct vectors { uint32_t stack; void (*reset)(void); };
extern const struct vectors vectors;
__attribute__((section(\".vectors\"), used)) const struct vectors vectors = {0x20080000u, reset};
";

/// What [`MAIN`] sums up, by the reference; and how many events.
fn reference() -> Vec<u32> {
    let mut map = SourceMap::default();
    map.add("both.whip", PROGRAM.to_string());
    let program = compile_front(&mut map, &Options::default())
        .0
        .expect("is right");
    let kernels = program.instruments.into_iter().map(|model| {
        let scales = Device::of(&model).scales();
        pipeline::compile(model, scales, false)
            .expect("compiles")
            .lowered
            .kernel
    });
    let zones = [(0, 5), (5, 3)];
    let kernels: Vec<_> = kernels
        .zip(zones)
        .map(|(own, (first, _))| with_values_from(&own, first))
        .collect();
    let mut players: Vec<Interp> = kernels
        .iter()
        .zip(zones)
        .map(|(kernel, (_, keys))| Interp::new(kernel, keys).expect("verifies"))
        .collect();
    let (mut sum, mut events) = (2_166_136_261u32, 0);
    let mut mix = |word: u32| sum = (sum ^ word).wrapping_mul(16_777_619);
    let word = |tick: u32, key: u32| {
        let phase = tick * (key + 5) * 40 % 131_072;
        if phase < 65_536 {
            phase as u16
        } else {
            (131_071 - phase) as u16
        }
    };
    for tick in 0..TICKS {
        for (player, (first, keys)) in players.iter_mut().zip(zones) {
            let words: Vec<u16> = (0..keys as u32)
                .map(|key| word(tick, first + key))
                .collect();
            if tick == 0 {
                player.init(&words);
            }
            let mut out = vec![0i16; keys];
            player.tick(&words, &mut out);
            out.iter().for_each(|word| mix(u32::from(*word as u16)));
        }
        for happened in players[1].drain_events() {
            events += 1;
            let all = [happened.tick as u32, happened.key + 5, happened.event];
            all.into_iter().for_each(&mut mix);
            happened.args.iter().for_each(|arg| mix(*arg as u32));
        }
    }
    vec![sum, events]
}

#[test]
fn zones_play_in_c_what_the_reference_plays() {
    let wanted = reference();
    assert!(wanted[1] > 10, "{wanted:?}");
    for file in ["both.o", "both.c"] {
        let folder = Folder::new();
        folder.write("both.whip", PROGRAM);
        folder
            .run(WHIPPEN, &["build", "both.whip", "both", "-o", file])
            .expect("is built");
        folder.write("main.c", MAIN);
        let rest = ["main.c", file, "-o", "out.elf", "-lgcc"];
        let Some(_) = folder.run("arm-none-eabi-gcc", &[STRICT, TARGET, &rest].concat()) else {
            return;
        };
        assert_eq!(
            ran(&folder, &["sum", "events"]).as_ref(),
            Some(&wanted),
            "{file}"
        );
    }
}
