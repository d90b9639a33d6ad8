//! Parser of regions and instructions.

use super::lex::Token;
use super::{ParseError, Parser};
use crate::op::{self, Row, Sort};
use crate::verify::DEPTH_MAX;
use crate::{Immediate, Inst, Op, Range, Region, Type, Value, ValueInfo};

/// Largest number a value may have, so that a text cannot ask for gigabytes.
const VALUE_MAX: u32 = 999_999;

impl Parser {
    /// `init { .. }` or `tick { .. }`
    pub(super) fn outermost(&mut self, tick: bool) -> Result<(), ParseError> {
        let place = self.at;
        let region = self.skip().region(Vec::new(), 1)?;
        let slot = if tick {
            &mut self.kernel.tick
        } else {
            &mut self.kernel.init
        };
        if !slot.insts.is_empty() {
            return Err(self.error_at(place, "this region stands twice".to_string()));
        }
        *slot = region;
        Ok(())
    }

    fn region(&mut self, params: Vec<Value>, depth: usize) -> Result<Region, ParseError> {
        if depth > DEPTH_MAX {
            return Err(self.error_at(self.at, format!("regions nest deeper than {DEPTH_MAX}")));
        }
        self.sign(Token::Open)?;
        let mut region = Region {
            params,
            ..Region::default()
        };
        while !self.takes(Token::Close) {
            if self.peek().token == Token::Name("yield".to_string()) {
                let line = self.peek().line;
                region.yields = self.skip().operands(line)?;
                self.sign(Token::Close)?;
                break;
            }
            region.insts.push(self.inst(depth)?);
        }
        Ok(region)
    }

    fn inst(&mut self, depth: usize) -> Result<Inst, ParseError> {
        let results = if self.peek_value().is_some() {
            self.results()?
        } else {
            Vec::new()
        };
        let Token::Name(word) = self.peek().token.clone() else {
            return Err(self.expected("an operator"));
        };
        let Some(row) = op::named(&word) else {
            return Err(self.expected("an operator"));
        };
        let inst = match row.name {
            "if" => self.if_else(depth)?,
            "loop" => self.repeat(depth)?,
            _ => self.plain(row)?,
        };
        Ok(Inst { results, ..inst })
    }

    /// `v1: i32 [0..9], v2: i1 [0..1] =`
    fn results(&mut self) -> Result<Vec<Value>, ParseError> {
        let mut results = vec![self.definition()?];
        while self.takes(Token::Comma) {
            results.push(self.definition()?);
        }
        self.sign(Token::Equals)?;
        Ok(results)
    }

    fn plain(&mut self, row: &Row) -> Result<Inst, ParseError> {
        let (place, line) = (self.at, self.peek().line);
        self.skip();
        let mut immediates = Vec::new();
        for kind in row.immediates.iter().take_while(|kind| kind.is_declared()) {
            immediates.push(self.declared(*kind)?);
        }
        let args = self.operands(line)?;
        while immediates.len() < row.immediates.len() {
            immediates.push(self.number()?);
        }
        if row.args != [Sort::Args] && args.len() != row.args.len() {
            let message = format!(
                "`{}` takes {} operands, not {}",
                row.name,
                row.args.len(),
                args.len()
            );
            return Err(self.error_at(place, message));
        }
        let make = (row.make)(&immediates);
        let op =
            make.ok_or_else(|| self.error_at(place, "an immediate is out of bounds".to_string()))?;
        let origin = self.origin(line)?;
        Ok(Inst {
            op,
            args,
            results: Vec::new(),
            regions: Vec::new(),
            origin,
        })
    }

    fn declared(&mut self, kind: Immediate) -> Result<i64, ParseError> {
        let place = self.at;
        let name = self.name()?;
        let key = (std::mem::discriminant(&kind), name);
        let index = self.names.get(&key).copied();
        index
            .map(i64::from)
            .ok_or_else(|| self.error_at(place, format!("`{}` is not declared", key.1)))
    }

    /// `if v1 { .. } else { .. }`
    fn if_else(&mut self, depth: usize) -> Result<Inst, ParseError> {
        let line = self.peek().line;
        let args = vec![self.skip().value()?];
        let origin = self.origin(line)?;
        let then = self.region(Vec::new(), depth + 1)?;
        let has_else = self.takes(Token::Name("else".to_string()));
        let other = if has_else {
            self.region(Vec::new(), depth + 1)?
        } else {
            Region::default()
        };
        Ok(Inst {
            op: Op::If,
            args,
            results: Vec::new(),
            regions: vec![then, other],
            origin,
        })
    }

    /// `loop 3 (v1: i32 [0..2], v2: i32 [0..9] = v0) { .. }`
    fn repeat(&mut self, depth: usize) -> Result<Inst, ParseError> {
        let line = self.peek().line;
        let op = Op::Loop(self.skip().number()?);
        self.sign(Token::Left)?;
        let mut params = vec![self.definition()?];
        let mut args = Vec::new();
        while self.takes(Token::Comma) {
            params.push(self.definition()?);
            self.sign(Token::Equals)?;
            args.push(self.value()?);
        }
        self.sign(Token::Right)?;
        let origin = self.origin(line)?;
        let body = self.region(params, depth + 1)?;
        Ok(Inst {
            op,
            args,
            results: Vec::new(),
            regions: vec![body],
            origin,
        })
    }

    /// `@12`, if it follows on this line.
    fn origin(&mut self, line: usize) -> Result<Option<u32>, ParseError> {
        if self.peek().line != line || !self.takes(Token::At) {
            return Ok(None);
        }
        self.number().map(Some)
    }

    /// The values that follow on this line.
    fn operands(&mut self, line: usize) -> Result<Vec<Value>, ParseError> {
        let mut all = Vec::new();
        while self.peek().line == line && self.peek_value().is_some() {
            all.push(self.value()?);
        }
        Ok(all)
    }

    fn peek_value(&self) -> Option<&str> {
        let Token::Name(name) = &self.peek().token else {
            return None;
        };
        name.strip_prefix('v')
            .filter(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
    }

    fn value(&mut self) -> Result<Value, ParseError> {
        let digits = self.peek_value().ok_or_else(|| self.expected("a value"))?;
        let number = digits.parse().ok().filter(|number| *number <= VALUE_MAX);
        let message = || self.error_at(self.at, format!("values are numbered up to {VALUE_MAX}"));
        let value = Value(number.ok_or_else(message)?);
        self.skip();
        Ok(value)
    }

    /// `v1: i32 [0..9]`
    fn definition(&mut self) -> Result<Value, ParseError> {
        let value = self.value()?;
        self.sign(Token::Colon)?;
        let info = ValueInfo {
            ty: self.ty()?,
            range: self.range()?,
        };
        if self.kernel.values.get(value).is_none() {
            // Numbers in between that never come are values that are defined nowhere.
            self.kernel.values.resize(
                value.0 as usize + 1,
                ValueInfo {
                    ty: Type::I1,
                    range: Range::point(0),
                },
            );
        }
        self.kernel.values[value] = info;
        Ok(value)
    }
}
