//! The header and the module, judged by compilers.

use whippen_compiler::bindings::{
    Argument, EventInterface, Interface, LiveInterface, PortInterface, Ring, SafetyInterface,
    c_header, rust_module,
};

use whippen_isa::Arch;

use crate::tools::{Folder, text};

fn interface() -> Interface {
    let port = |name: &str, lsb, zero, unit: &str| PortInterface {
        name: name.into(),
        lsb,
        zero,
        unit: unit.into(),
    };
    let live = |name: &str, at, range, init, fraction_bits, unit: &str| LiveInterface {
        name: name.into(),
        at,
        range,
        init,
        fraction_bits,
        unit: Some(unit.into()),
    };
    let switch = LiveInterface {
        name: "Loud".into(),
        at: 28,
        range: (0, 1),
        init: 1,
        fraction_bits: 0,
        unit: None,
    };
    let speed = Argument {
        name: "speed".into(),
        fraction_bits: 28,
        unit: "m/s".into(),
    };
    Interface {
        name: "probe".into(),
        keys: 3,
        first_key: 0,
        rate_hz: 44_100.into(),
        state_bytes: 400,
        inputs: (320, vec![port("x", 1.678e-7, -5e-4, "m")]),
        outputs: (328, vec![port("drive", 9.765_625e-4, 0.0, "N")]),
        row_words: 1,
        lives: vec![
            live("weight", 20, (i32::MIN, 1 << 30), -7, 30, "N"),
            live("slow", 24, (0, 9), 1, -2, "N*s/m"),
            switch,
        ],
        events: vec![
            EventInterface {
                name: "note".into(),
                args: vec![speed],
            },
            EventInterface {
                name: "release".into(),
                args: Vec::new(),
            },
        ],
        ring: Some(Ring {
            at: 64,
            bytes: 256,
            record_bytes: 16,
            tick_bytes_max: 96,
        }),
        arch: Some(Arch::V8M),
        component: None,
        safety: Some(SafetyInterface::of_object()),
    }
}

const USE: &str = "#include \"probe.h\"
struct probe_state probe_state;
void probe_init(struct probe_state *state) { state->inputs[PROBE_KEYS - 1][PROBE_INPUT_X] = 7; }
void probe_tick(struct probe_state *state) { state->tick++; }
int main(void) {
    struct probe_event event;
    probe_init(&probe_state);
    probe_tick(&probe_state);
    if (!probe_set_weight(&probe_state, PROBE_WEIGHT_MIN) || probe_set_weight(&probe_state, PROBE_WEIGHT_MAX + 1)) return 1;
    if (probe_set_slow(&probe_state, -1) || probe_state.live_slow != 0 || probe_state.live_weight != INT32_MIN) return 2;
    if (probe_read_event(&probe_state, &event)) return 3;
    /* A record across the ring's end begins at its start again. */
    for (uint32_t n = 0; n < 40; n++) {
        const uint32_t at = probe_state.event_head % 256u / 4u;
        probe_state.events[at] = (int32_t)n;
        probe_state.events[at + 1] = PROBE_EVENT_RELEASE << 16 | 2;
        probe_state.events[at + 2] = -5;
        probe_state.event_head += 16u;
        if (!probe_read_event(&probe_state, &event)) return 4;
        if (event.tick != n || event.key != 2 || event.event != PROBE_EVENT_RELEASE) return 5;
        if (event.args[PROBE_NOTE_SPEED] != -5) return 6;
    }
    /* A mark is no event: the next one is at the ring's beginning. */
    probe_state.events[probe_state.event_head % 256u / 4u + 1u] = -1;
    probe_state.event_head = (probe_state.event_head | 255u) + 1u;
    if (probe_read_event(&probe_state, &event)) return 8;
    probe_state.events[0] = 77;
    probe_state.events[1] = PROBE_EVENT_NOTE << 16 | 1;
    probe_state.event_head += 16u;
    if (!probe_read_event(&probe_state, &event) || event.tick != 77 || event.key != 1) return 9;
    return probe_state.inputs[2][0] == 7 && probe_state.tick == 1 ? 0 : 7;
}
";

/// A folder with the header and a program that uses it.
fn used() -> Folder {
    let folder = Folder::new();
    folder.write("probe.h", c_header(&interface()));
    folder.write("use.c", USE);
    folder
}

/// Compiles the program by a compiler that takes no warning.
fn compile(folder: &Folder, compiler: &str, flags: &[&str]) -> Option<String> {
    let strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion"];
    folder.run(compiler, &[&strict, flags, &["use.c"]].concat())
}

/// Those of C that a compiler knows: older ones know the last by another name. None where the
/// compiler is absent.
fn standards(folder: &Folder, compiler: &str) -> Option<Vec<&'static str>> {
    let mut known = Vec::new();
    for std in ["-std=c99", "-std=c11", "-std=c23"] {
        let output = folder.output(compiler, &[std, "-E", "-x", "c", "/dev/null"])?;
        known.extend(output.status.success().then_some(std));
    }
    assert!(known.len() >= 2, "{known:?}");
    Some(known)
}

#[test]
fn the_header_reads_well() {
    insta::assert_snapshot!("header", c_header(&interface()));
}

#[test]
fn the_header_is_strict_c_and_works() {
    let folder = used();
    for std in standards(&folder, "gcc").unwrap_or_default() {
        compile(&folder, "gcc", &[std, "-o", "use"]).expect("is there");
        let path = folder.path().join("use");
        folder
            .run(path.to_str().expect("UTF-8"), &[])
            .expect("runs");
    }
}

#[test]
fn the_header_is_strict_c_for_the_target() {
    let folder = used();
    for std in standards(&folder, "arm-none-eabi-gcc").unwrap_or_default() {
        let flags = ["-mcpu=cortex-m33", std, "-c"];
        compile(&folder, "arm-none-eabi-gcc", &flags).expect("is there");
    }
}

/// Linkers say nothing where code for a larger core is joined with that of a smaller one.
#[test]
fn the_header_refuses_a_core_that_lacks_its_instructions() {
    let folder = used();
    for (core, taken) in [
        ("cortex-m0plus", false),
        ("cortex-m4", false),
        ("cortex-m33+nodsp", false),
        ("cortex-m33", true),
        ("cortex-m55", true),
    ] {
        let cpu = format!("-mcpu={core}");
        let Some(output) = folder.output("arm-none-eabi-gcc", &[&cpu, "-c", "use.c"]) else {
            return;
        };
        let told = text(&output.stderr);
        assert_eq!(output.status.success(), taken, "{core}: {told}");
        assert!(taken || told.contains("code for a Cortex-M33"), "{told}");
    }
}

const CPP: &[&str] = &["-std=c++17", "-x", "c++", "-c"];

#[test]
fn the_header_is_strict_cpp() {
    compile(&used(), "g++", CPP);
}

#[test]
fn the_header_is_strict_cpp_for_the_target() {
    let flags = [&["-mcpu=cortex-m33"], CPP].concat();
    compile(&used(), "arm-none-eabi-g++", &flags);
}

/// The module as it was last accepted; `WHIPPEN_BLESS=1` writes it anew.
#[allow(unreachable_pub, missing_docs, unsafe_code)]
#[rustfmt::skip]
mod probe_module;

#[test]
fn the_module_is_rust_over_fixed() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/build/bindings/probe_module.rs"
    );
    let made = rust_module(&interface());
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(path, &made).expect("written");
    }
    assert_eq!(std::fs::read_to_string(path).expect("there"), made);
    use probe_module::{SLOW_MAX, WEIGHT_INIT, WEIGHT_MIN, X_LSB_M};
    assert_eq!(
        (WEIGHT_MIN.to_num::<f64>(), WEIGHT_INIT.to_bits(), SLOW_MAX),
        (-2.0, -7, 9)
    );
    let event = probe_module::Event {
        tick: 1,
        key: 2,
        event: probe_module::EVENT_NOTE,
        args: [3 << 27],
    };
    assert_eq!(
        (event.note_speed().to_num::<f64>(), X_LSB_M),
        (1.5, 1.678e-7)
    );
}
