//! C text behind the interface: the kernel's functions, and around them what the header promises.
//!
//! ```text
//!   live values, words in -> kernel -> words out, events -> the ring
//! ```
//!
//! The ring is kept as machine code keeps it: where a tick's events may not fit, all of them are
//! counted as lost.

use std::fmt::Write;

use super::{Interface, Ring, safety};

/// The text to stand behind the header; nothing where the code is no C.
pub fn c_source(own: &Interface) -> Option<String> {
    let component = own.component.as_ref()?;
    let name = &own.name;
    let mut text = format!("{}\n", component.body.trim_end());
    let lives = own.lives.iter();
    let first: Vec<String> = lives
        .map(|live| {
            format!(
                ".live_{} = {}_{}_INIT",
                live.name,
                name.to_uppercase(),
                live.name.to_uppercase()
            )
        })
        .collect();
    let first = if first.is_empty() {
        "0".to_string()
    } else {
        first.join(", ")
    };
    let _ = writeln!(
        text,
        "\nstruct {name}_state {name}_state = {{ {first} }};\n"
    );
    let _ = writeln!(
        text,
        "static void {name}_take_lives(struct {name}_state *state)\n{{\n    (void)state;"
    );
    for (live, field) in own.lives.iter().zip(&component.lives) {
        let _ = writeln!(
            text,
            "    state->kernel.{field} = state->live_{};",
            live.name
        );
    }
    text.push_str("}\n");
    if let Some(ring) = own.ring {
        keep_events(&mut text, own, ring);
    }
    let keep = match own.ring {
        Some(_) => format!("    {name}_keep_events(state);\n"),
        None => String::new(),
    };
    let _ = write!(
        text,
        "\nvoid {name}_init(struct {name}_state *state)\n{{\n\
         \x20   {name}_kernel_defaults(&state->kernel);\n    {name}_take_lives(state);\n\
         \x20   {name}_kernel_init(&state->kernel, &state->inputs[0][0]);\n}}\n\n\
         void {name}_tick(struct {name}_state *state)\n{{\n\
         \x20   {name}_take_lives(state);\n\
         \x20   {name}_kernel_tick(&state->kernel, &state->inputs[0][0], &state->outputs[0][0]);\n\
         {keep}    state->tick = state->tick + 1u;\n}}\n"
    );
    if let Some(own) = safety::c_source(own) {
        let _ = write!(text, "\n{own}");
    }
    Some(text)
}

fn keep_events(text: &mut String, own: &Interface, ring: Ring) {
    let name = &own.name;
    let most = ring.bytes - ring.tick_bytes_max;
    let _ = write!(
        text,
        "\nstatic void {name}_keep_events(struct {name}_state *state)\n{{\n\
         \x20   const uint32_t count = state->kernel.events;\n\
         \x20   uint32_t head = state->event_head, used = head - state->event_tail, at = head % {bytes}u;\n\
         \x20   state->kernel.events = 0;\n\
         \x20   if (at > {most}u) {{\n\
         \x20       used += {bytes}u - at;\n\
         \x20       if (used <= {most}u) {{\n\
         \x20           /* A mark, no event: the ring goes on at its beginning. */\n\
         \x20           state->events[at / 4u + 1u] = -1;\n\
         \x20           head += {bytes}u - at;\n            at = 0;\n            state->event_head = head;\n        }}\n    }}\n\
         \x20   if (used > {most}u) {{\n        state->events_lost = state->events_lost + count;\n        return;\n    }}\n\
         \x20   for (uint32_t n = 0; n < count; n++) {{\n\
         \x20       const {name}_kernel_event *event = &state->kernel.event[n];\n\
         \x20       volatile int32_t *to = &state->events[at / 4u];\n\
         \x20       to[0] = (int32_t)state->tick;\n\
         \x20       to[1] = (int32_t)((event->key + {first}u) | event->event << 16);\n",
        bytes = ring.bytes,
        first = own.first_key,
    );
    for arg in 0..own.args_max() {
        let _ = writeln!(text, "        to[{}] = event->args[{arg}];", arg + 2);
    }
    let _ = write!(
        text,
        "        at += {record}u;\n    }}\n    state->event_head = head + count * {record}u;\n}}\n",
        record = ring.record_bytes
    );
}
