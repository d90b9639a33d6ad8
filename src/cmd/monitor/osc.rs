//! Statuses as Open Sound Control: a bundle of messages by UDP to whoever listens.
//!
//! ```text
//!   /whippen/missed i   /whippen/core/0/ticks i   /whippen/core/0/gains/3 f   /whippen/live/volume f   /whippen/fault s
//! ```
//!
//! Whole numbers are `i` (32 bits, so ticks wrap to negative ones after half their range), others
//! `f`, texts `s`; a live value is a number in SI units where it has one. Nobody answers, and
//! nobody need listen.

use std::net::{ToSocketAddrs, UdpSocket};

use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType, encoder};
use serde_json::Value;
use whippen_compiler::units::{Quantity, parse_quantity};

use crate::exit::Failure;

/// Where statuses go.
pub struct Osc {
    socket: UdpSocket,
    address: String,
}

impl Osc {
    /// Sends to an address such as `localhost:9000`.
    ///
    /// # Errors
    /// There is no such address.
    pub fn to(address: &str) -> Result<Osc, Failure> {
        let wrong = |why: String| Failure::Usage(format!("--osc {address}: {why}"));
        let mut found = address
            .to_socket_addrs()
            .map_err(|e| wrong(format!("{e}; write it as localhost:9000")))?;
        let to = found.next().ok_or_else(|| wrong("has no address".into()))?;
        let any = if to.is_ipv6() { "[::]:0" } else { "0.0.0.0:0" };
        let socket = UdpSocket::bind(any).map_err(|e| wrong(e.to_string()))?;
        socket.connect(to).map_err(|e| wrong(e.to_string()))?;
        Ok(Osc {
            socket,
            address: address.to_string(),
        })
    }

    /// Sends a status, as its JSON has it.
    ///
    /// # Errors
    /// The system does not send it. That nobody listens is none.
    pub fn send(&self, status: &Value) -> Result<(), Failure> {
        let wrong = |why: String| Failure::Usage(format!("--osc {}: {why}", self.address));
        let bytes = bundle(status).map_err(wrong)?;
        match self.socket.send(&bytes) {
            Err(error) if error.kind() != std::io::ErrorKind::ConnectionRefused => {
                Err(wrong(error.to_string()))
            }
            _ => Ok(()),
        }
    }
}

/// The bytes of a status.
fn bundle(status: &Value) -> Result<Vec<u8>, String> {
    let mut content = Vec::new();
    for (name, value) in status.as_object().into_iter().flatten() {
        match (name.as_str(), value) {
            ("kind", _) => {}
            ("cores", Value::Array(cores)) => {
                for (number, core) in cores.iter().enumerate() {
                    put(&mut content, format!("/whippen/core/{number}"), core);
                }
            }
            ("faults", Value::Array(faults)) => {
                for fault in faults {
                    put(&mut content, "/whippen/fault".to_string(), fault);
                }
            }
            _ => put(&mut content, format!("/whippen/{name}"), value),
        }
    }
    // "At once", as the specification writes it.
    let timetag = OscTime {
        seconds: 0,
        fractional: 1,
    };
    encoder::encode(&OscPacket::Bundle(OscBundle { timetag, content })).map_err(|e| e.to_string())
}

/// A value below an address; what is in it below that.
fn put(into: &mut Vec<OscPacket>, address: String, value: &Value) {
    let argument = match value {
        Value::Null => return,
        Value::Bool(on) => OscType::Int(i32::from(*on)),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => OscType::Int(whole as i32),
            None => OscType::Float(number.as_f64().unwrap_or_default() as f32),
        },
        Value::String(text) => match parse_quantity(text) {
            Ok(Quantity::Real { value, .. }) => OscType::Float(value as f32),
            _ => OscType::String(text.clone()),
        },
        Value::Array(all) => {
            for (at, one) in all.iter().enumerate() {
                put(into, format!("{address}/{at}"), one);
            }
            return;
        }
        Value::Object(all) => {
            for (name, one) in all {
                put(into, format!("{address}/{}", part(name)), one);
            }
            return;
        }
    };
    into.push(OscPacket::Message(OscMessage {
        addr: address,
        args: vec![argument],
    }));
}

/// A name as a part of an address, which has neither blanks nor the signs of patterns.
fn part(name: &str) -> String {
    let plain = |letter: char| match letter {
        '[' | '.' => '/',
        letter => letter,
    };
    let kept = name.chars().filter(|letter| !" #*,?{}]".contains(*letter));
    kept.map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::bundle;
    use serde_json::json;
    use std::io::Write;
    use std::process::{Command, Stdio};

    const JUDGE: &str = "
import sys, json
from pythonosc.osc_bundle import OscBundle
bundle = OscBundle(sys.stdin.buffer.read())
print(json.dumps([[message.address, *message.params] for message in bundle]))
";

    #[test]
    fn another_library_reads_a_status() {
        let Some(python) = whippen_need::python("pythonosc") else {
            return;
        };
        let status = json!({
            "kind": "status", "missed": 2, "faults": ["a motor is warm"],
            "cores": [{ "ticks": 44_100, "faulty_key": null, "gains": [1.0, 0.5] }],
            "live": { "volume": "0.25", "strings[2].pitch": "440 Hz", "feel": "on" },
        });
        let mut child = Command::new(python)
            .args(["-c", JUDGE])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python starts");
        let bytes = bundle(&status).expect("is encoded");
        let mut input = child.stdin.take().expect("piped");
        input.write_all(&bytes).expect("python reads");
        drop(input);
        let done = child.wait_with_output().expect("python ends");
        let mut told: Vec<serde_json::Value> = serde_json::from_slice(&done.stdout).expect("JSON");
        told.sort_by_key(|one| one[0].to_string());
        let wanted = json!([
            ["/whippen/core/0/gains/0", 1.0],
            ["/whippen/core/0/gains/1", 0.5],
            ["/whippen/core/0/ticks", 44_100],
            ["/whippen/fault", "a motor is warm"],
            ["/whippen/live/feel", "on"],
            ["/whippen/live/strings/2/pitch", 440.0],
            ["/whippen/live/volume", 0.25],
            ["/whippen/missed", 2],
        ]);
        assert_eq!(json!(told), wanted);
    }
}
