//! What has been read: sections of items, labels, constants.

use std::collections::{BTreeMap, BTreeSet};

use whippen_isa::Arch;

use super::expr::{Expr, Value};
use super::instruction::Instruction;
use super::line::Statement;
use crate::image::{SectionKind, SymbolKind};

/// One thing of a section.
#[derive(Debug)]
pub struct PlacedItem {
    /// Its line.
    pub line: usize,
    /// What it is.
    pub what: What,
    /// Where it lies, by the present layout.
    pub offset: u32,
    /// How many bytes it takes, by the present layout.
    pub size: u32,
}

/// What an item is.
#[derive(Debug)]
pub enum What {
    /// An instruction.
    Instruction(Instruction),
    /// Words of so many bytes.
    Words(u32, Vec<Expr>),
    /// Bytes as they are.
    Bytes(Vec<u8>),
    /// So many bytes of this value.
    Fill(u32, u8),
    /// As far as the next multiple of this power of two.
    Align(u32),
    /// The literals of loads before it.
    Pool(Vec<Expr>),
}

/// A section.
#[derive(Debug)]
pub struct AssemblySection {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: SectionKind,
    /// A power of two.
    pub align: u32,
    /// Its items.
    pub items: Vec<PlacedItem>,
    /// Literals that wait for a pool.
    pub literals: Vec<Expr>,
    /// How many pools there have been.
    pub pools: usize,
    /// For the item of that index: the loop that begins there runs so often, or the branch goes to
    /// these.
    pub notes: Vec<(usize, Note)>,
}

/// An annotation for static analysis.
#[derive(Debug, Clone)]
pub enum Note {
    /// The loop that begins here runs at most so often.
    Rounds(Expr),
    /// The indirect branch goes to one of these.
    Targets(Vec<String>),
}

/// A text, read.
pub struct AssemblyUnit {
    /// Whose instructions.
    pub arch: Arch,
    /// The present line.
    pub line: usize,
    /// All sections.
    pub sections: Vec<AssemblySection>,
    /// The present section.
    pub current: usize,
    /// Labels: section, and the item they stand before.
    pub labels: BTreeMap<String, (usize, usize)>,
    /// Constants.
    pub constants: BTreeMap<String, Expr>,
    /// Names that others see.
    pub globals: BTreeSet<String>,
    /// What names are, where it was said.
    pub kinds: BTreeMap<String, SymbolKind>,
    /// Sizes of names, where they were said.
    pub sizes: BTreeMap<String, Expr>,
    /// Conditions that are open: whether their text counts.
    pub conditions: Vec<bool>,
    /// The next label is a function.
    pub function_next: bool,
    /// How often each local label has been defined.
    locals: BTreeMap<String, usize>,
}

impl AssemblyUnit {
    pub fn new(constants: &BTreeMap<String, i64>, arch: Arch) -> AssemblyUnit {
        let mut unit = AssemblyUnit {
            arch,
            line: 1,
            sections: Vec::new(),
            current: 0,
            labels: BTreeMap::new(),
            constants: constants
                .iter()
                .map(|(name, n)| (name.clone(), Expr::Number(*n)))
                .collect(),
            globals: BTreeSet::new(),
            kinds: BTreeMap::new(),
            sizes: BTreeMap::new(),
            conditions: Vec::new(),
            function_next: false,
            locals: BTreeMap::new(),
        };
        unit.enter(".text", SectionKind::Code);
        unit
    }

    /// Takes the statements of a line.
    ///
    /// # Errors
    /// What is wrong with one of them.
    pub fn take(&mut self, statements: &[Statement]) -> Result<(), String> {
        for statement in statements {
            let counts = self.counts();
            match *statement {
                Statement::Directive(name, arguments)
                    if counts || matches!(name, "if" | "ifdef" | "else" | "endif") =>
                {
                    self.directive(name, arguments)?
                }
                _ if !counts => {}
                Statement::Directive(..) => {}
                Statement::Label(name) => self.label(name)?,
                Statement::Instruction(mnemonic, operands) => {
                    let instruction = Instruction::read(self, &mnemonic.to_lowercase(), operands)?;
                    self.push(What::Instruction(instruction));
                }
                Statement::Note(words) => self.note(words)?,
            }
        }
        Ok(())
    }

    /// Whether the text here counts, by all conditions that are open.
    pub fn counts(&self) -> bool {
        self.conditions.iter().all(|c| *c)
    }

    /// Ends the text: pools go where sections end.
    ///
    /// # Errors
    /// A condition is open.
    pub fn close(&mut self) -> Result<(), String> {
        if !self.conditions.is_empty() {
            return Err("`.endif` is missing".to_string());
        }
        for section in 0..self.sections.len() {
            self.current = section;
            self.pool();
        }
        Ok(())
    }

    /// Goes on in a section, which is made where it is not there.
    pub fn enter(&mut self, name: &str, kind: SectionKind) {
        self.current = self
            .sections
            .iter()
            .position(|s| s.name == name)
            .unwrap_or_else(|| {
                let (items, literals, notes) = (Vec::new(), Vec::new(), Vec::new());
                self.sections.push(AssemblySection {
                    name: name.to_string(),
                    kind,
                    align: if kind == SectionKind::Code { 2 } else { 1 },
                    items,
                    literals,
                    pools: 0,
                    notes,
                });
                self.sections.len() - 1
            });
    }

    pub fn section(&mut self) -> &mut AssemblySection {
        &mut self.sections[self.current]
    }

    /// Adds an item to the section.
    pub fn push(&mut self, what: What) {
        let line = self.line;
        let size = if let What::Instruction(_) = what {
            2
        } else {
            0
        };
        self.section().items.push(PlacedItem {
            line,
            what,
            offset: 0,
            size,
        });
    }

    /// Puts the waiting literals here.
    pub fn pool(&mut self) {
        let section = self.section();
        let literals = std::mem::take(&mut section.literals);
        if !literals.is_empty() {
            section.pools += 1;
            section.align = section.align.max(4);
            self.push(What::Pool(literals));
        }
    }

    /// Keeps a literal for the next pool; its number there and the number of the pool.
    pub fn literal(&mut self, value: Expr) -> (usize, usize) {
        let section = self.section();
        let at = section
            .literals
            .iter()
            .position(|known| *known == value)
            .unwrap_or_else(|| {
                section.literals.push(value);
                section.literals.len() - 1
            });
        (section.pools, at)
    }

    fn label(&mut self, name: &str) -> Result<(), String> {
        let place = (self.current, self.section().items.len());
        let name = match name.bytes().all(|b| b.is_ascii_digit()) {
            true => {
                let count = self.locals.entry(name.to_string()).or_default();
                *count += 1;
                local_name(name, *count)
            }
            false => name.to_string(),
        };
        if std::mem::take(&mut self.function_next) {
            self.kinds.insert(name.clone(), SymbolKind::Function);
        }
        if self.constants.contains_key(&name) || self.labels.insert(name.clone(), place).is_some() {
            return Err(format!(
                "`{name}` is defined twice; give one of them another name"
            ));
        }
        Ok(())
    }

    fn note(&mut self, words: &str) -> Result<(), String> {
        let (word, rest) = words.split_once(' ').unwrap_or((words, ""));
        let note = match word {
            "rounds" => Note::Rounds(self.expr(rest)?),
            "targets" => Note::Targets(rest.split_whitespace().map(str::to_string).collect()),
            _ => {
                return Err(format!(
                    "`@! {word}` is unknown; known are `@! rounds N` and `@! targets LABEL...`"
                ));
            }
        };
        let section = self.section();
        section.notes.push((section.items.len(), note));
        Ok(())
    }

    /// Reads an expression; constants that are known by now are put in, local labels get their
    /// names.
    ///
    /// # Errors
    /// It is no expression.
    pub fn expr(&self, text: &str) -> Result<Expr, String> {
        Ok(Expr::parse(text)?.fold(&|name| {
            if let Some(local) = self.local(name) {
                return Some(Expr::Name(local));
            }
            self.constants.get(name).cloned()
        }))
    }

    /// A number that must be known now.
    ///
    /// # Errors
    /// It is no number.
    pub fn number(&self, text: &str) -> Result<i64, String> {
        match self.expr(text)? {
            Expr::Number(n) => Ok(n),
            _ => Err(format!("`{text}` must be a number that is known here")),
        }
    }

    /// `1b` and `1f` by the names that local labels are kept under.
    fn local(&self, name: &str) -> Option<String> {
        if !super::expr::is_local(name) {
            return None;
        }
        let (digits, direction) = name.split_at(name.len() - 1);
        let count = self.locals.get(digits).copied().unwrap_or(0);
        Some(local_name(digits, count + usize::from(direction == "f")))
    }

    /// What a name is worth by the present layout, for the item of a section.
    pub fn find(&self, name: &str, section: usize, item: usize) -> Value {
        let place = if name == "." {
            Some((section, item))
        } else {
            self.labels.get(name).copied()
        };
        match place {
            Some((section, item)) => {
                let offset = i64::from(self.offset(section, item));
                Value::Place {
                    section,
                    offset,
                    label: name.to_string(),
                    addend: 0,
                }
            }
            None => match self.constants.get(name) {
                Some(Expr::Number(n)) => Value::Number(*n),
                _ => Value::Outside(name.to_string(), 0),
            },
        }
    }

    /// Where an item lies, or the end of its section.
    pub fn offset(&self, section: usize, item: usize) -> u32 {
        let items = &self.sections[section].items;
        items.get(item).or(items.last()).map_or(0, |i| {
            if item < items.len() {
                i.offset
            } else {
                i.offset + i.size
            }
        })
    }
}

/// No name that can be written.
fn local_name(digits: &str, count: usize) -> String {
    format!("{digits} {count}")
}
