//! The hardware that a keyboard names: its board, how many chips of that have the keys, its device.

use super::DeviceName;
use super::keyboard::Reader;
use crate::bundled::devices;
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::syntax::ast::Name;
use whippen_keyboard::CHIPS_MAX;

impl Reader<'_, '_, '_> {
    /// How many chips have the keys.
    pub(super) fn chips(&mut self, chips: &Name) {
        let count = chips.node.parse().ok();
        match count.filter(|count| (1..=CHIPS_MAX).contains(count)) {
            Some(count) => self.board.keyboard.chips = count,
            None => {
                let message = format!("`{}` is no number of chips", chips.node);
                let label = format!("a whole number from 1 to {CHIPS_MAX}");
                let diagnostic = Diagnostic::new(Code::UnknownHardware, chips.span, message, label);
                self.diags
                    .push(diagnostic.hint("write `board rp2350 * 2` for two"));
            }
        }
    }

    /// A device's file, which is looked for when the device is needed.
    pub(super) fn device_file(&mut self, file: &Name) {
        if !file.node.ends_with(".toml") {
            let message = format!("`{}` is no device file: its name ends in .toml", file.node);
            let diagnostic =
                Diagnostic::new(Code::UnknownHardware, file.span, message, "this name");
            self.diags.push(diagnostic.hint(format!(
                "a bundled device is named without quotes; they are {}",
                devices().join(", ")
            )));
        }
        self.board.keyboard.device = DeviceName::File(file.node.clone(), file.span);
    }

    /// Reports a board or device that is not there.
    pub(super) fn is_bundled(&mut self, what: &str, name: &Name, known: &[&str]) {
        if known.contains(&name.node.as_str()) {
            return;
        }
        let message = format!("there is no {what} `{}`", name.node);
        let label = format!("unknown {what}");
        let diagnostic = Diagnostic::new(Code::UnknownHardware, name.span, message, label);
        self.diags
            .push(match nearest(&name.node, known.iter().copied()) {
            Some(near) => diagnostic.hint(Advice::did_you_mean(near)),
            None if what == "device" => diagnostic.hint(format!(
                "it is one of {}; a file of your own stands in quotes: `device \"{}.toml\"`",
                known.join(", "),
                name.node
            )),
            None => diagnostic.hint(format!(
                "it is one of {}; leave the line away and give a file of your own with --{what}",
                known.join(", ")
            )),
        });
    }
}
