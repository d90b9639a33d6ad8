//! Instructions and locals of one function.

use wasm_encoder::{BlockType, Function, Instruction, MemArg, MemArgTarget, ValType};

/// A local variable or a parameter, by its index.
pub(crate) type Local = u32;

/// A function in the making.
pub(crate) struct Body {
    params: u32,
    locals: Vec<ValType>,
    code: Vec<Instruction<'static>>,
}

impl Body {
    /// A function with so many parameters.
    pub fn new(params: usize) -> Body {
        Body {
            params: params as u32,
            locals: Vec::new(),
            code: Vec::new(),
        }
    }

    /// A new local.
    pub fn local(&mut self, ty: ValType) -> Local {
        self.locals.push(ty);
        self.params + self.locals.len() as u32 - 1
    }

    /// How many locals there are, without parameters.
    pub fn locals(&self) -> usize {
        self.locals.len()
    }

    /// The function with its end.
    pub fn finish(self) -> Function {
        let mut function = Function::new_with_locals_types(self.locals);
        for instruction in &self.code {
            function.instruction(instruction);
        }
        function.instruction(&Instruction::End);
        function
    }

    /// Adds instructions.
    pub fn code(&mut self, instructions: impl IntoIterator<Item = Instruction<'static>>) {
        self.code.extend(instructions);
    }

    /// Adds one.
    pub fn op(&mut self, instruction: Instruction<'static>) {
        self.code.push(instruction);
    }

    /// Puts a word on the stack.
    pub fn word(&mut self, value: i32) {
        self.op(Instruction::I32Const(value));
    }

    /// Puts a local on the stack.
    pub fn get(&mut self, local: Local) {
        self.op(Instruction::LocalGet(local));
    }

    /// Takes a local from the stack.
    pub fn set(&mut self, local: Local) {
        self.op(Instruction::LocalSet(local));
    }

    /// Takes it and leaves it there.
    pub fn tee(&mut self, local: Local) {
        self.op(Instruction::LocalTee(local));
    }

    /// Does something as long as what it leaves on the stack is not 0.
    pub fn repeat(&mut self, round: impl FnOnce(&mut Body)) {
        self.op(Instruction::Loop(BlockType::Empty));
        round(self);
        self.op(Instruction::BrIf(0));
        self.op(Instruction::End);
    }

    /// Of two values on the stack of a type, the one that a comparison of the second with the first
    /// says: the smaller one or the larger one.
    pub fn extreme(&mut self, ty: ValType, smaller: bool, [a, b]: [Local; 2]) {
        self.get(a);
        self.get(b);
        self.get(a);
        self.get(b);
        self.op(match (ty, smaller) {
            (ValType::I64, true) => Instruction::I64LtS,
            (ValType::I64, false) => Instruction::I64GtS,
            (_, true) => Instruction::I32LtS,
            (_, false) => Instruction::I32GtS,
        });
        self.op(Instruction::Select);
    }
}

/// An access at so many bytes behind the address, aligned to so many bytes as a power of two.
pub(crate) fn at(offset: u32, align: u32) -> MemArg {
    MemArg {
        offset: u64::from(offset),
        align,
        target: MemArgTarget::Memory(0),
        ordering: None,
    }
}
