//! Rows to lines: which rows stand on one line, which columns they share, and what is broken.

use super::cells::{self, Cell, align, cells, join};
use super::lines::Line;
use super::pieces::{Note, Piece};
use super::rows::{Block, Row, RowKind};
use super::{INDENT, WIDTH, space};

/// How a row is written, from the shortest way on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// On one line, with its block if it has one.
    Flat,
    /// Its block on lines of its own.
    Open,
    /// On several lines, and its block on further ones.
    Broken,
}

/// Lines being written.
pub(super) struct Writer<'a> {
    pub pieces: &'a [Piece<'a>],
    pub lines: Vec<Line>,
    pub current: Line,
    /// The first piece of the row being written.
    pub row: usize,
}

/// The lines of a file.
pub(super) fn file(pieces: &[Piece], rows: &[Row], tail: &[Note]) -> Vec<Line> {
    let mut writer = Writer {
        pieces,
        lines: Vec::new(),
        current: Line::default(),
        row: 0,
    };
    writer.rows(rows, 0);
    writer.notes(tail, 0, rows.is_empty());
    writer.lines
}

impl Writer<'_> {
    /// Ends the line, if anything is on it, and begins another.
    pub fn newline(&mut self, indent: usize) {
        let line = std::mem::replace(
            &mut self.current,
            Line {
                indent,
                ..Line::default()
            },
        );
        if !line.is_empty() {
            self.lines.push(line);
        }
    }

    fn rows(&mut self, rows: &[Row], indent: usize) {
        let shaped = self.shaped(rows, indent);
        for (n, (row, (shape, cells))) in rows.iter().zip(shaped).enumerate() {
            let piece = &self.pieces[row.from];
            let item = row.kind == RowKind::Item;
            let documented = item
                && piece
                    .before
                    .last()
                    .is_some_and(|note| note.text.starts_with("///"));
            let apart = piece.before.iter().any(|note| note.blank) || (piece.blank && !documented);
            if item && n > 0 && !apart {
                self.lines.push(Line::default());
            }
            self.notes(&piece.before, indent, n == 0);
            if piece.blank && !documented && (n > 0 || !piece.before.is_empty()) {
                self.lines.push(Line::default());
            }
            self.row = row.from;
            self.newline(indent);
            self.write(row, shape, &cells, indent);
            self.newline(indent);
        }
    }

    /// Comments on lines of their own; blank lines before the first of a block are left out.
    fn notes(&mut self, notes: &[Note], indent: usize, first: bool) {
        for (n, note) in notes.iter().enumerate() {
            if note.blank && !(first && n == 0) {
                self.lines.push(Line::default());
            }
            self.lines.push(Line {
                indent,
                code: note.text.to_string(),
                comment: None,
            });
        }
    }

    /// Whether a blank line stands between a row and the one before it.
    fn is_apart(&self, row: &Row) -> bool {
        let piece = &self.pieces[row.from];
        piece.blank || piece.before.iter().any(|note| note.blank)
    }

    /// The shape of every row, and its cells in their columns. A row that turns out too wide takes
    /// the next shape.
    fn shaped(&self, rows: &[Row], indent: usize) -> Vec<(Shape, Vec<Cell>)> {
        let mut shapes: Vec<Shape> = rows.iter().map(|row| self.shape(row)).collect();
        loop {
            let aligned = self.aligned(rows, &shapes);
            let wide = |n: &usize| {
                let brace = if shapes[*n] == Shape::Open { 2 } else { 0 };
                let width = indent + join(&aligned[*n]).chars().count() + brace;
                shapes[*n] != Shape::Broken && width > WIDTH
            };
            let wide: Vec<usize> = (0..rows.len()).filter(wide).collect();
            if wide.is_empty() {
                return shapes.into_iter().zip(aligned).collect();
            }
            for n in wide {
                let opens = shapes[n] == Shape::Flat && rows[n].block.is_some();
                shapes[n] = if opens { Shape::Open } else { Shape::Broken };
            }
        }
    }

    /// The shortest shape that the row's comments and actions allow.
    fn shape(&self, row: &Row) -> Shape {
        let Some(block) = &row.block else {
            return if self.commented(row.from, row.to) {
                Shape::Broken
            } else {
                Shape::Flat
            };
        };
        let short = match block.rows.len() {
            0 => true,
            1 => matches!(row.kind, RowKind::Event | RowKind::Transition),
            _ => false,
        };
        if short && !self.commented(row.from, row.to) {
            Shape::Flat
        } else if self.commented(row.from, block.open + 1) {
            Shape::Broken
        } else {
            Shape::Open
        }
    }

    /// Whether comments stand between the pieces.
    pub fn commented(&self, from: usize, to: usize) -> bool {
        let inside = |i: usize| {
            (i > from && !self.pieces[i].before.is_empty())
                || (i + 1 < to && self.pieces[i].after.is_some())
        };
        (from..to).any(inside)
    }

    fn aligned(&self, rows: &[Row], shapes: &[Shape]) -> Vec<Vec<Cell>> {
        let mut all: Vec<Vec<Cell>> = rows
            .iter()
            .zip(shapes)
            .map(|(row, shape)| self.cut(row, *shape))
            .collect();
        let mut paired: Vec<(&Row, &mut Vec<Cell>)> = rows.iter().zip(&mut all).collect();
        for run in paired.chunk_by_mut(|a, b| a.0.kind == b.0.kind && !self.is_apart(b.0)) {
            let mut cells: Vec<&mut Vec<Cell>> =
                run.iter_mut().map(|(_, cells)| &mut **cells).collect();
            align(&mut cells, 0);
        }
        all
    }

    fn cut(&self, row: &Row, shape: Shape) -> Vec<Cell> {
        let mut cut = cells(
            self.pieces,
            row,
            if shape == Shape::Broken {
                self.kept(row)
            } else {
                usize::MAX
            },
        );
        if let (Shape::Flat, Some(block)) = (shape, &row.block) {
            let empty = block.rows.is_empty();
            let block = space::flat(self.pieces, row.from, block.open, row.to);
            match cut.last_mut() {
                // An empty block stands in no column.
                Some(last) if empty => {
                    *last = Cell::new(&last.key, format!("{} {block}", last.text))
                }
                _ => cut.push(Cell::new("{", block)),
            }
        }
        cut
    }

    /// At how many places a broken row is cut all the same: where it begins like its neighbours,
    /// unless comments are in the way.
    fn kept(&self, row: &Row) -> usize {
        let most = if row.kind == RowKind::Transition {
            2
        } else {
            1
        };
        let cuts = cells::cuts(self.pieces, row);
        let free = cuts
            .get(most - 1)
            .is_some_and(|(at, _)| !self.commented(row.from, at + 1));
        if free { most } else { 0 }
    }

    fn write(&mut self, row: &Row, shape: Shape, cells: &[Cell], indent: usize) {
        match (shape, &row.block) {
            (Shape::Flat, _) | (Shape::Open, None) => {
                self.current.code = join(cells);
                self.current.comment = self.pieces[row.to - 1].after.map(str::to_string);
            }
            (Shape::Open, Some(block)) => {
                self.current.code = join(cells) + " {";
                self.current.comment = self.pieces[block.open].after.map(str::to_string);
                self.block(row, block, indent);
            }
            (Shape::Broken, block) => {
                let end = block.as_ref().map_or(row.to, |b| b.open);
                let cut = cells.len() - 1;
                let from = if cut == 0 {
                    row.from
                } else {
                    cells::cuts(self.pieces, row)[cut - 1].0
                };
                self.current.code = join(&cells[..cut]);
                let padded = cells[..cut]
                    .iter()
                    .map(|cell| cell.width + 1)
                    .sum::<usize>();
                let before = self.lines.len();
                self.lay(from, end, indent + INDENT, padded.saturating_sub(1));
                if let Some(block) = block {
                    if self.lines.len() > before || self.current.comment.is_some() {
                        self.newline(indent);
                    }
                    self.put(block.open, indent);
                    self.block(row, block, indent);
                }
            }
        }
    }

    /// The rows of a block and its closing brace.
    fn block(&mut self, row: &Row, block: &Block, indent: usize) {
        self.newline(indent);
        self.rows(&block.rows, indent + INDENT);
        let close = &self.pieces[row.to - 1];
        self.notes(&close.before, indent + INDENT, block.rows.is_empty());
        self.newline(indent);
        self.current = Line {
            indent,
            code: close.text.to_string(),
            comment: close.after.map(str::to_string),
        };
    }
}
