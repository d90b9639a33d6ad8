//! A probe over TCP: what a Glasgow Interface Explorer with its applet `probe-rs` speaks, with an
//! emulated chip at its wires.
//!
//! Packets are COBS with a zero behind each; the first byte says to which part of the probe.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener};

use crate::chip::{Chip, NoAck};

/// The USB numbers of a Glasgow.
const NUMBERS: &str = "20b7:9db1";

/// A probe at which nobody is yet.
pub struct Glasgow(TcpListener);

impl Glasgow {
    pub fn new() -> Glasgow {
        Glasgow(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port"))
    }

    /// Its name, as `probe-rs` has it.
    pub fn name(&self) -> String {
        let port = self.0.local_addr().expect("it").port();
        format!("{NUMBERS}:tcp:127.0.0.1:{port}")
    }

    /// Serves one client, until he leaves.
    pub fn serve(&self, chip: &mut Chip) {
        let (mut stream, _) = self.0.accept().expect("somebody");
        stream.set_nodelay(true).expect("a socket");
        let (mut packet, mut bytes) = (Vec::new(), [0; 4096]);
        let mut asked = [Vec::new(), Vec::new()];
        while let Ok(count @ 1..) = stream.read(&mut bytes) {
            let mut answer = Vec::new();
            for &byte in &bytes[..count] {
                if byte != 0 {
                    packet.push(byte);
                    continue;
                }
                let said = unstuffed(&std::mem::take(&mut packet));
                let part = usize::from(said[0]);
                asked[part].extend_from_slice(&said[1..]);
                let told = match part {
                    0 => root(&mut asked[0], chip),
                    _ => swd(&mut asked[1], chip),
                };
                if !told.is_empty() {
                    answer.extend(stuffed(&[&[said[0]], &told[..]].concat()));
                    answer.push(0);
                }
            }
            if stream.write_all(&answer).is_err() {
                return;
            }
        }
    }
}

/// The probe itself: its name, its clock of 48 MHz and what that is divided by, the reset pin.
fn root(asked: &mut Vec<u8>, chip: &mut Chip) -> Vec<u8> {
    let mut told = Vec::new();
    while let Some(&command) = asked.first() {
        let length = if command == 0x12 { 3 } else { 1 };
        if asked.len() < length {
            break;
        }
        asked.drain(..length);
        match command {
            0x00 => told.extend(b"probe-rs,v01"),
            0x10 => told.extend(48_000_000_u32.to_le_bytes()),
            0x11 => told.extend(47_u16.to_le_bytes()),
            0x12 => {}
            other => chip.misdeeds.push(format!("the reset pin: {other:#x}")),
        }
    }
    told
}

/// Transfers and sequences.
fn swd(asked: &mut Vec<u8>, chip: &mut Chip) -> Vec<u8> {
    let mut told = Vec::new();
    while let Some(&command) = asked.first() {
        let is_sequence = command & 0x20 != 0;
        let is_read = !is_sequence && command & 2 != 0;
        let length = if is_read { 1 } else { 5 };
        if asked.len() < length {
            break;
        }
        let words: Vec<u8> = asked.drain(..length).skip(1).collect();
        let word = words.try_into().map(u32::from_le_bytes).unwrap_or(0);
        if is_sequence {
            let bits = usize::from(command & 0x1f);
            chip.sequence(word.into(), if bits == 0 { 32 } else { bits });
            continue;
        }
        let write = (!is_read).then_some(word);
        match chip.transfer(command & 1 != 0, u32::from(command & 0xc), write) {
            Ok(Some(word)) => {
                told.push(0x01);
                told.extend(word.to_le_bytes());
            }
            Ok(None) => told.push(0x11),
            Err(NoAck::Fault) => told.push(0x14),
            Err(NoAck::Silent) => told.push(0x20),
        }
    }
    told
}

/// COBS: each part has its length, and one more, before it in place of the zero behind it.
fn stuffed(bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    for part in bytes.split(|byte| *byte == 0) {
        let mut rest = part;
        while rest.len() >= 254 {
            all.push(255);
            all.extend_from_slice(&rest[..254]);
            rest = &rest[254..];
        }
        all.push(rest.len() as u8 + 1);
        all.extend_from_slice(rest);
    }
    all
}

fn unstuffed(mut bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::new();
    while let Some((&length, rest)) = bytes.split_first() {
        let (part, more) = rest.split_at(usize::from(length) - 1);
        all.extend_from_slice(part);
        if length < 255 && !more.is_empty() {
            all.push(0);
        }
        bytes = more;
    }
    all
}
