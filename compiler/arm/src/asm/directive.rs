//! Directives.

use super::expr::Expr;
use super::item::{AssemblyUnit, What};
use crate::image::{SectionKind, SymbolKind};

/// More than any memory here.
const BYTES_MAX: i64 = 1 << 24;

impl AssemblyUnit {
    pub(super) fn directive(&mut self, name: &str, arguments: &str) -> Result<(), String> {
        match name {
            "syntax" | "thumb" | "cpu" | "file" => Ok(()),
            "text" => self.switch(".text"),
            "data" => self.switch(".data"),
            "bss" => self.switch(".bss"),
            "section" => self.section_directive(arguments),
            "align" | "p2align" => self.align(arguments, |n| {
                u32::try_from(n).ok().filter(|n| *n <= 16).map(|n| 1 << n)
            }),
            "balign" => self.align(arguments, |n| {
                u32::try_from(n).ok().filter(|n| n.is_power_of_two())
            }),
            "global" | "globl" => {
                self.globals
                    .extend(arguments.split(',').map(|name| name.trim().to_string()));
                Ok(())
            }
            "thumb_func" => {
                self.function_next = true;
                Ok(())
            }
            "type" => self.type_directive(arguments),
            "size" => self.size_directive(arguments),
            "word" | "long" | "4byte" => self.words(4, arguments),
            "short" | "hword" | "2byte" => self.words(2, arguments),
            "byte" => self.words(1, arguments),
            "space" | "skip" | "zero" => self.space(arguments),
            "ascii" => self.string(arguments, &[]),
            "asciz" => self.string(arguments, &[0]),
            "equ" | "set" => self.constant(arguments),
            "ltorg" | "pool" => {
                self.pool();
                Ok(())
            }
            _ => self.condition(name, arguments),
        }
    }

    fn condition(&mut self, name: &str, arguments: &str) -> Result<(), String> {
        let counts = self.counts();
        match name {
            "if" => {
                let holds = counts && self.number(arguments)? != 0;
                self.conditions.push(holds);
            }
            "ifdef" => {
                let known =
                    self.constants.contains_key(arguments) || self.labels.contains_key(arguments);
                self.conditions.push(known);
            }
            "else" => {
                let last = self.conditions.last_mut().ok_or("`.else` without `.if`")?;
                *last = !*last;
            }
            "endif" => drop(self.conditions.pop().ok_or("`.endif` without `.if`")?),
            _ => {
                return Err(format!(
                    "`.{name}` is unknown here; docs/firmware.md lists the directives"
                ));
            }
        }
        Ok(())
    }

    fn switch(&mut self, name: &str) -> Result<(), String> {
        self.enter(name, kind_of(name, ""));
        Ok(())
    }

    fn section_directive(&mut self, arguments: &str) -> Result<(), String> {
        let mut parts = arguments.splitn(2, ',').map(str::trim);
        let name = parts
            .next()
            .filter(|name| !name.is_empty())
            .ok_or("`.section` needs a name")?;
        self.enter(name, kind_of(name, parts.next().unwrap_or("")));
        Ok(())
    }

    fn align(&mut self, arguments: &str, bytes: impl Fn(i64) -> Option<u32>) -> Result<(), String> {
        let n = self.number(arguments)?;
        let bytes = bytes(n).ok_or_else(|| format!("`{n}` is no alignment"))?;
        let section = self.section();
        section.align = section.align.max(bytes);
        self.push(What::Align(bytes));
        Ok(())
    }

    fn type_directive(&mut self, arguments: &str) -> Result<(), String> {
        let (name, kind) = arguments
            .split_once(',')
            .ok_or("as in `.type tick, %function`")?;
        let kind = match kind.trim().trim_start_matches(['%', '@', '#']) {
            "function" => SymbolKind::Function,
            "object" => SymbolKind::Data,
            other => {
                return Err(format!(
                    "`{other}` is no type; write `%function` or `%object`"
                ));
            }
        };
        self.kinds.insert(name.trim().to_string(), kind);
        Ok(())
    }

    fn size_directive(&mut self, arguments: &str) -> Result<(), String> {
        let (name, size) = arguments
            .split_once(',')
            .ok_or("as in `.size tick, . - tick`")?;
        // `.` is the place here, which a label without a name keeps.
        let here = format!(" {}", name.trim());
        let place = (self.current, self.section().items.len());
        self.labels.insert(here.clone(), place);
        let size = Expr::parse(size)?.fold(&|name| (name == ".").then(|| Expr::Name(here.clone())));
        self.sizes.insert(name.trim().to_string(), size);
        Ok(())
    }

    fn words(&mut self, bytes: u32, arguments: &str) -> Result<(), String> {
        let values: Result<Vec<_>, _> = arguments.split(',').map(|text| self.expr(text)).collect();
        self.push(What::Words(bytes, values?));
        Ok(())
    }

    fn space(&mut self, arguments: &str) -> Result<(), String> {
        let (count, value) = arguments.split_once(',').unwrap_or((arguments, "0"));
        let (count, value) = (self.number(count)?, self.number(value)?);
        if !(0..=BYTES_MAX).contains(&count) {
            return Err(format!("{count} bytes cannot be; at most {BYTES_MAX}"));
        }
        self.push(What::Fill(count as u32, value as u8));
        Ok(())
    }

    fn string(&mut self, arguments: &str, end: &[u8]) -> Result<(), String> {
        let inside = arguments
            .strip_prefix('"')
            .and_then(|text| text.strip_suffix('"'));
        let mut bytes = Vec::new();
        let mut chars = inside.ok_or("as in `.ascii \"text\"`")?.chars();
        while let Some(c) = chars.next() {
            let c = if c == '\\' { escaped(chars.next())? } else { c };
            bytes.extend(c.encode_utf8(&mut [0; 4]).bytes());
        }
        bytes.extend(end);
        self.push(What::Bytes(bytes));
        Ok(())
    }

    fn constant(&mut self, arguments: &str) -> Result<(), String> {
        let (name, value) = arguments
            .split_once(',')
            .ok_or("as in `.equ SIO, 0xd0000000`")?;
        let value = self.expr(value)?;
        self.constants.insert(name.trim().to_string(), value);
        Ok(())
    }
}

fn escaped(c: Option<char>) -> Result<char, String> {
    match c {
        Some('n') => Ok('\n'),
        Some('r') => Ok('\r'),
        Some('t') => Ok('\t'),
        Some('0') => Ok('\0'),
        Some(c @ ('"' | '\\')) => Ok(c),
        _ => Err("after \\ there may be n, r, t, 0, \" and \\".to_string()),
    }
}

/// By the flags, or by the usual beginnings of names.
fn kind_of(name: &str, flags: &str) -> SectionKind {
    let (flags, kind) = flags.split_once(',').unwrap_or((flags, ""));
    if kind.trim().ends_with("nobits") || name.starts_with(".bss") {
        SectionKind::Zeroed
    } else if flags.contains('x') || name.starts_with(".text") {
        SectionKind::Code
    } else if flags.contains('w') || name.starts_with(".data") {
        SectionKind::Data
    } else {
        SectionKind::Constant
    }
}
