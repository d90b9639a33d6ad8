//! The header.

use std::fmt::Write;

use super::{Holds, Interface, PortInterface, number, safety, unit_name};
use whippen_isa::Arch;

/// A header for C99 and C++.
pub fn c_header(own: &Interface) -> String {
    let name = own.name.as_str();
    let big = name.to_uppercase();
    let mut text = format!(
        "/* {name}: {keys} keys at {rate} ticks a second. Written by Whippen.\n\
         \x20*\n\
         \x20*   {name}_state.inputs   <- this tick's sensor words of all keys\n\
         \x20*   {name}_init(&{name}_state)      once, before the first tick, with its words\n\
         \x20*   {name}_tick(&{name}_state)      every tick\n\
         \x20*   {name}_state.outputs  -> drive words\n\
         \x20*\n\
         \x20* The functions keep the procedure call standard (AAPCS) and use no floating point. Live values may be set and\n\
         \x20* events taken at any time by one reader, also while a tick runs. */\n\
         #ifndef {big}_H\n#define {big}_H\n\n#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n\n\
         #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
         #define {big}_KEYS {keys}\n#define {big}_FIRST_KEY {first}\n#define {big}_RATE_HZ {rate_constant}\n#define {big}_STATE_BYTES {bytes}\n",
        keys = own.keys,
        first = own.first_key,
        rate = own.rate_hz,
        rate_constant = whippen_c99::rate_constant(own.rate_hz),
        bytes = match own.component {
            Some(_) => format!("sizeof(struct {name}_state)"),
            None => own.state_bytes.to_string(),
        },
    );
    refuse_older_cores(&mut text, own);
    ports(&mut text, &big, "INPUT", &own.inputs.1);
    ports(&mut text, &big, "OUTPUT", &own.outputs.1);
    live_constants(&mut text, &big, own);
    event_constants(&mut text, &big, own);
    state(&mut text, &big, own);
    let _ = writeln!(
        text,
        "/* All memory of the keys, with its values at the start. */\n\
         extern struct {name}_state {name}_state;\n\n\
         /* Prepares all keys for the first tick, whose words are in `inputs`. */\nvoid {name}_init(struct {name}_state *state);\n\n\
         /* One tick of all keys: reads `inputs`, writes `outputs`. */\nvoid {name}_tick(struct {name}_state *state);\n"
    );
    safety::c_header(&mut text, &big, own);
    setters(&mut text, &big, own);
    reader(&mut text, &big, own);
    text += "#ifdef __cplusplus\n}\n#endif\n\n#endif\n";
    text
}

/// Linkers join code for different cores in silence, so the header asks for which one it is
/// compiled (ACLE, `__ARM_ARCH` and `__ARM_FEATURE_DSP`).
fn refuse_older_cores(text: &mut String, own: &Interface) {
    let (needed, core) = match own.arch {
        None | Some(Arch::V6M) => return,
        Some(Arch::V7EM) => ("__ARM_ARCH < 7 || !defined(__ARM_FEATURE_DSP)", "Cortex-M4"),
        Some(Arch::V8M) => (
            "__ARM_ARCH < 8 || !defined(__ARM_FEATURE_DSP)",
            "Cortex-M33",
        ),
    };
    let _ = writeln!(
        text,
        "\n#if defined(__arm__) && ({needed})\n#error \"{} holds code for a {core}: compile with its -mcpu, or build for another board\"\n#endif",
        own.name
    );
}

fn ports(text: &mut String, big: &str, kind: &str, ports: &[PortInterface]) {
    for (index, port) in ports.iter().enumerate() {
        let (port_name, unit) = (
            port.name.to_uppercase(),
            unit_name(&port.unit).to_uppercase(),
        );
        let _ = writeln!(
            text,
            "\n/* `{}` is word {index} of a key: value = {} + word * {} {} */\n\
             #define {big}_{kind}_{port_name} {index}\n\
             #define {big}_{port_name}_LSB_{unit} {}\n#define {big}_{port_name}_ZERO_{unit} {}",
            port.name,
            number(port.zero),
            number(port.lsb),
            port.unit,
            number(port.lsb),
            number(port.zero)
        );
    }
}

fn live_constants(text: &mut String, big: &str, own: &Interface) {
    for live in &own.lives {
        let name = live.name.to_uppercase();
        let Some(unit) = &live.unit else {
            let _ = writeln!(
                text,
                "\n/* Live value `{}`, a switch. */\n#define {big}_{name}_INIT {}",
                live.name,
                live.init != 0
            );
            continue;
        };
        let _ = writeln!(
            text,
            "\n/* Live value `{}`, in {unit}: value = integer / 2^{} */\n\
             #define {big}_{name}_MIN {}\n#define {big}_{name}_MAX {}\n#define {big}_{name}_INIT {}\n\
             #define {big}_{name}_FRACTION_BITS {}",
            live.name,
            live.fraction_bits,
            literal(live.range.0),
            literal(live.range.1),
            literal(live.init),
            live.fraction_bits
        );
    }
}

fn event_constants(text: &mut String, big: &str, own: &Interface) {
    for (number, event) in own.events.iter().enumerate() {
        let name = event.name.to_uppercase();
        let _ = writeln!(
            text,
            "\n/* Event `{}`. */\n#define {big}_EVENT_{name} {number}",
            event.name
        );
        for (index, arg) in event.args.iter().enumerate() {
            let arg_name = arg.name.to_uppercase();
            let _ = writeln!(
                text,
                "/* args[{index}] is `{}` in {}: value = integer / 2^{bits} */\n#define {big}_{name}_{arg_name} {index}\n\
                 #define {big}_{name}_{arg_name}_FRACTION_BITS {bits}",
                arg.name,
                arg.unit,
                bits = arg.fraction_bits
            );
        }
    }
}

fn state(text: &mut String, big: &str, own: &Interface) {
    let name = &own.name;
    if let Some(component) = &own.component {
        let types = component.types.trim_end();
        let _ = write!(
            text,
            "\n/* What the code keeps: nobody else's. */\n{types}\n"
        );
    }
    let _ = writeln!(
        text,
        "\n/* Memory of all keys. What is `private` or `kernel` belongs to the code. */\nstruct {name}_state {{"
    );
    let fields = own.fields();
    for field in &fields {
        let Holds::Private(bytes) = field.holds else {
            let declared = match field.holds {
                Holds::Counter => format!("volatile uint32_t {}", field.name),
                Holds::Live => format!("volatile int32_t {}", field.name),
                Holds::Ring(words) => format!("volatile int32_t {}[{words}]", field.name),
                Holds::Inputs => format!("uint16_t {}[{big}_KEYS][{}]", field.name, own.row_words),
                Holds::Kernel => format!("{name}_kernel_state {}", field.name),
                _ => format!("int16_t {}[{big}_KEYS][{}]", field.name, own.row_words),
            };
            let _ = writeln!(text, "    {declared};");
            continue;
        };
        let kept = if bytes % 4 == 0 {
            format!("uint32_t {}[{}]", field.name, bytes / 4)
        } else {
            format!("uint8_t {}[{bytes}]", field.name)
        };
        let _ = writeln!(text, "    {kept};");
    }
    let _ = writeln!(text, "}};\n");
    let check = |what: &str, condition: String| {
        format!("typedef char {name}_check_{what}[{condition} ? 1 : -1];")
    };
    for field in own.public_fields() {
        let condition = format!(
            "offsetof(struct {name}_state, {}) == {}",
            field.name, field.at
        );
        let _ = writeln!(text, "{}", check(&field.name, condition));
    }
    let _ = writeln!(
        text,
        "{}\n",
        check(
            "size",
            format!("sizeof(struct {name}_state) == {big}_STATE_BYTES")
        )
    );
}

fn setters(text: &mut String, big: &str, own: &Interface) {
    let name = &own.name;
    for live in &own.lives {
        let (field, upper) = (&live.name, live.name.to_uppercase());
        if live.unit.is_none() {
            let _ = writeln!(
                text,
                "/* Sets `{field}` from the next tick on. */\n\
                 static inline void {name}_set_{field}(struct {name}_state *state, bool value)\n{{\n\
                 \x20   state->live_{field} = value;\n}}\n"
            );
            continue;
        }
        let _ = writeln!(
            text,
            "/* Sets `{field}` from the next tick on; false, and nothing is changed, if it is out of range. */\n\
             static inline bool {name}_set_{field}(struct {name}_state *state, int32_t value)\n{{\n\
             \x20   if (value < {big}_{upper}_MIN || value > {big}_{upper}_MAX) {{\n        return false;\n    }}\n\
             \x20   state->live_{field} = value;\n    return true;\n}}\n"
        );
    }
}

fn reader(text: &mut String, big: &str, own: &Interface) {
    let Some(ring) = own.ring else { return };
    let (name, args) = (&own.name, own.args_max());
    let _ = writeln!(
        text,
        "/* What happened to a key in a tick. */\n\
         struct {name}_event {{\n    uint32_t tick;\n    uint16_t key; /* from {big}_FIRST_KEY on */\n    uint16_t event; /* {big}_EVENT_.. */\n    int32_t args[{}];\n}};\n\n\
         /* Takes the oldest event; false if there is none. What found the ring full is counted in `events_lost`. */\n\
         static inline bool {name}_read_event(struct {name}_state *state, struct {name}_event *event)\n{{\n\
         \x20   uint32_t tail = state->event_tail;\n\
         \x20   if (state->event_head != tail && state->events[tail % {bytes}u / 4u + 1] == -1) {{\n\
         \x20       /* A mark, no event: the ring goes on at its beginning. */\n\
         \x20       tail = (tail | {mask}u) + 1u;\n\
         \x20       state->event_tail = tail;\n    }}\n\
         \x20   if (state->event_head == tail) {{\n        return false;\n    }}\n\
         \x20   const uint32_t at = tail % {bytes}u / 4u;\n\
         \x20   const uint32_t what = (uint32_t)state->events[at + 1];\n\
         \x20   event->tick = (uint32_t)state->events[at];\n\
         \x20   event->key = (uint16_t)what;\n    event->event = (uint16_t)(what >> 16);",
        args.max(1),
        bytes = ring.bytes,
        mask = ring.bytes - 1,
    );
    for index in 0..args {
        let _ = writeln!(
            text,
            "    event->args[{index}] = state->events[at + {}];",
            index + 2
        );
    }
    let _ = writeln!(
        text,
        "    state->event_tail = tail + {}u;\n    return true;\n}}\n",
        ring.record_bytes
    );
}

/// A constant: the smallest integer is no negated one.
fn literal(value: i32) -> String {
    if value == i32::MIN {
        "INT32_MIN".to_string()
    } else {
        format!("({value})")
    }
}
