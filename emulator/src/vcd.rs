//! What a logic analyser would see of pins, as a Value Change Dump (IEEE 1364): every change at its
//! cycle.
//!
//! Times are picoseconds, rounded; with a clock below 500 GHz the cycle is found again.

use std::fmt::Write as _;

use crate::pins::PinChange;

const PICOSECONDS: u128 = 1_000_000_000_000;

/// A dump of the pins in the mask, from the first of the changes on until cycle `end`.
pub fn vcd(changes: &[PinChange], mask: u64, clock_hz: u32, end: u64) -> String {
    let pins: Vec<u32> = (0..64).filter(|pin| mask >> pin & 1 != 0).collect();
    let mut text = String::from("$version Whippen $end\n$timescale 1 ps $end\n");
    let _ = writeln!(text, "$comment {clock_hz} cycles per second $end");
    text.push_str("$scope module chip $end\n");
    for pin in &pins {
        let _ = writeln!(text, "$var wire 1 {} gpio{pin} $end", identifier(*pin));
    }
    text.push_str("$upscope $end\n$enddefinitions $end\n");
    let time = |cycle: u64| {
        let clock = u128::from(clock_hz.max(1));
        (u128::from(cycle) * PICOSECONDS + clock / 2) / clock
    };
    let mut before = None;
    for change in changes {
        let changed = before.map_or(mask, |old: u64| (old ^ change.levels) & mask);
        if changed != 0 {
            let _ = writeln!(text, "#{}", time(change.cycle));
        }
        for pin in pins.iter().filter(|pin| changed >> **pin & 1 != 0) {
            let _ = writeln!(text, "{}{}", change.levels >> pin & 1, identifier(*pin));
        }
        before = Some(change.levels);
    }
    let _ = writeln!(text, "#{}", time(end));
    text
}

/// One printable character for each pin.
fn identifier(pin: u32) -> char {
    char::from(b'!' + pin as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::vcd::{Command, Parser, Value};

    #[test]
    fn another_reader_finds_every_change_at_its_cycle() {
        let clock_hz = 133_000_000;
        let changes: Vec<PinChange> = [
            (0, 0b0100),
            (7, 0b0101),
            (1_000_003, 0b1101),
            (1_000_004, 0b0001),
        ]
        .map(|(cycle, levels)| PinChange { cycle, levels })
        .to_vec();
        let text = vcd(&changes, 0b0101, clock_hz, 2_000_000);
        let mut parser = Parser::new(text.as_bytes());
        let header = parser.parse_header().expect("a header");
        let codes = ["gpio0", "gpio2"].map(|name| {
            let wire = header.find_var(&["chip", name]);
            wire.expect("a wire").code
        });
        let (mut cycle, mut found) = (0, Vec::new());
        for command in parser {
            match command.expect("a command") {
                Command::Timestamp(ps) => {
                    let cycles = u128::from(ps) * u128::from(clock_hz) + PICOSECONDS / 2;
                    cycle = (cycles / PICOSECONDS) as u64;
                }
                Command::ChangeScalar(code, value) => {
                    let pin = if code == codes[0] { 0 } else { 2 };
                    found.push((cycle, pin, value == Value::V1));
                }
                _ => {}
            }
        }
        let expected = [
            (0, 0, false),
            (0, 2, true),
            (7, 0, true),
            (1_000_004, 2, false),
        ];
        assert_eq!((found.as_slice(), cycle), (&expected[..], 2_000_000));
        assert!(header.find_var(&["chip", "gpio3"]).is_none());
    }
}
