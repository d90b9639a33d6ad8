//! Breaks what is too wide, or has comments inside, where it holds together most loosely.

use super::cells::{close, commas, deeper};
use super::write::Writer;
use super::{INDENT, WIDTH, space};
use crate::syntax::token::Token;

impl Writer<'_> {
    /// Writes `pieces[from..to]` behind what is on the line, in columns up to `width`; further
    /// lines begin at `indent`.
    pub fn lay(&mut self, from: usize, to: usize, indent: usize, width: usize) {
        self.pad(width);
        self.lay_out(from, to, indent);
    }

    fn pad(&mut self, width: usize) {
        let present = self.current.code.chars().count();
        self.current
            .code
            .extend(std::iter::repeat_n(' ', width.saturating_sub(present)));
    }

    fn lay_out(&mut self, from: usize, to: usize, indent: usize) {
        if from >= to {
            return;
        }
        if self.fits(from, to) {
            return (from..to).for_each(|at| self.put(at, indent));
        }
        let points = self.points(from, to);
        let lead = self.lead(from, to, points.is_empty());
        if lead > 0 {
            (from..from + lead).for_each(|at| self.put(at, indent));
            return self.lay_out(from + lead, to, indent);
        }
        if points.is_empty() {
            return self.bracketed(from, to, indent);
        }
        let ends = points.iter().copied().chain([to]);
        let starts = std::iter::once(from).chain(points.iter().copied());
        for (start, end) in starts.zip(ends) {
            if start > from {
                self.newline(indent);
            }
            self.lay_out(start, end, indent + INDENT);
        }
    }

    /// How many pieces lead what follows: signs and keywords before a value, the name of an
    /// argument.
    fn lead(&self, from: usize, to: usize, whole: bool) -> usize {
        let next = self.pieces[from + 1..to].first().map(|p| p.token);
        match (self.pieces[from].token, next) {
            (Token::If, _) => usize::from(whole),
            (token, _) if is_prefix(token) => 1,
            (_, Some(Token::Colon)) => 2,
            (_, Some(Token::If)) => 1,
            _ => 0,
        }
    }

    /// Whether the pieces fit on the line, with a comma or a brace behind them.
    fn fits(&self, from: usize, to: usize) -> bool {
        let flat = space::flat(self.pieces, self.row, from, to).chars().count();
        !self.commented(from, to) && self.current.width() + 2 + flat < WIDTH
    }

    /// Where the pieces hold together most loosely: every place before which a line may begin.
    fn points(&self, from: usize, to: usize) -> Vec<usize> {
        if self.pieces[from].token == Token::If {
            return self.branches(from, to);
        }
        let mut depth = 0;
        let mut found: Vec<(u8, usize)> = Vec::new();
        for at in from..to {
            depth = deeper(depth, self.pieces[at].token);
            let place = if self.pieces[at].token == Token::Comma {
                at + 1
            } else {
                at
            };
            if let Some(looseness) = self
                .looseness(at)
                .filter(|_| depth == 0 && place > from && place < to)
            {
                found.push((looseness, place));
            }
        }
        let loosest = found.iter().map(|(looseness, _)| *looseness).max();
        found
            .into_iter()
            .filter(|(looseness, _)| Some(*looseness) == loosest)
            .map(|(_, at)| at)
            .collect()
    }

    /// The `then` and `else` of an `if`, and those of every `else if` after it.
    fn branches(&self, from: usize, to: usize) -> Vec<usize> {
        let (mut depth, mut open) = (0, 0usize);
        let belongs = |at: &usize| {
            let token = self.pieces[*at].token;
            depth = deeper(depth, token);
            match token {
                _ if depth > 0 => false,
                Token::If => {
                    open += 1;
                    false
                }
                Token::Then => open == 1,
                Token::Else => {
                    open = open.saturating_sub(1);
                    open == 0
                }
                _ => false,
            }
        };
        (from..to).filter(belongs).collect()
    }

    /// How loosely what stands before a piece holds to it; `None` where no line may begin.
    fn looseness(&self, at: usize) -> Option<u8> {
        use Token::*;
        // A table's line goes on up to its braces.
        if self.pieces[self.row].token == Table && self.pieces[at].token == Over {
            return None;
        }
        let behind_value = at > self.row && space::ends_value(self.pieces, self.row, at - 1);
        match self.pieces[at].token {
            Arrow => Some(9),
            Comma => Some(8),
            In | Equals | Assign | When => Some(7),
            Slew | Over | Lasting | Glide | At | To if behind_value => Some(7),
            DotDot => Some(6),
            Or => Some(5),
            And => Some(4),
            Less | LessEqual | Greater | GreaterEqual => Some(3),
            Plus => Some(2),
            Minus if behind_value => Some(2),
            Star | Slash => Some(1),
            _ => None,
        }
    }

    /// What only holds together by brackets: the things between the first ones stand on lines of
    /// their own.
    fn bracketed(&mut self, from: usize, to: usize, indent: usize) {
        let opens =
            |at: &usize| matches!(self.pieces[*at].token, Token::LeftParen | Token::Open(_));
        let brackets = (from..to)
            .find(opens)
            .and_then(|open| Some((open, close(self.pieces, open, to)?)));
        let Some((open, close)) = brackets else {
            return (from..to).for_each(|at| self.put(at, indent));
        };
        (from..=open).for_each(|at| self.put(at, indent));
        let called = open > from && space::is_called(self.pieces, self.row, open - 1);
        let list = called || matches!(self.pieces[open].token, Token::Open(_));
        let commas = commas(self.pieces, open + 1, close);
        let starts = std::iter::once(open + 1).chain(commas.iter().map(|comma| comma + 1));
        for (start, end) in starts.zip(commas.iter().copied().chain([close])) {
            self.newline(indent);
            self.lay_out(start, end, indent + INDENT);
            if end < close {
                self.comma(end, indent);
            } else if list && start < end {
                self.current.code.push(',');
            }
        }
        self.newline(indent.saturating_sub(INDENT));
        self.put(close, indent.saturating_sub(INDENT));
        self.lay_out(close + 1, to, indent);
    }

    /// A comma right behind its thing, before the comment that ends the line.
    fn comma(&mut self, at: usize, indent: usize) {
        let piece = &self.pieces[at];
        match (&self.current.comment, piece.before.is_empty(), piece.after) {
            (None, true, _) | (Some(_), true, None) => {
                self.current.code.push(',');
                self.current.comment = self
                    .current
                    .comment
                    .take()
                    .or(piece.after.map(str::to_string));
            }
            _ => self.put(at, indent),
        }
    }

    /// Writes a piece with its comments. Those on lines of their own before the first piece of a
    /// row are written already.
    pub fn put(&mut self, at: usize, indent: usize) {
        let piece = &self.pieces[at];
        let notes = if at == self.row {
            &[][..]
        } else {
            &piece.before[..]
        };
        if !notes.is_empty() || self.current.comment.is_some() {
            self.fresh(indent);
        }
        for note in notes {
            self.current.code.push_str(note.text);
            self.newline(self.current.indent);
        }
        if !self.current.code.is_empty() && space::before(self.pieces, self.row, at) {
            self.current.code.push(' ');
        }
        self.current.code.push_str(piece.text);
        self.current.comment = piece.after.map(str::to_string);
    }

    /// Begins a line, unless nothing is on this one.
    fn fresh(&mut self, indent: usize) {
        if !self.current.is_empty() {
            self.newline(indent);
        }
    }
}

/// Whether a token leads what follows: it stands before a value or a name and belongs to it.
fn is_prefix(token: Token) -> bool {
    use Token::*;
    let sign = matches!(
        token,
        Equals | Assign | Arrow | DotDot | Plus | Minus | Star | Slash | Comma
    );
    let comparison = matches!(token, Less | LessEqual | Greater | GreaterEqual);
    sign || comparison || (token.is_hard_keyword() && !matches!(token, On | Off))
}
