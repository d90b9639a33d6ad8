//! The queues of a state machine: four words each way, or eight one way.

/// Words in the order they came.
#[derive(Clone, Default, Debug)]
pub(super) struct Fifo {
    words: [u32; 8],
    first: usize,
    len: usize,
    /// How many fit: 0, 4 or 8.
    room: usize,
}

impl Fifo {
    pub(super) fn new(room: usize) -> Self {
        Self {
            room: room.min(8),
            ..Self::default()
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// One without room is full and empty.
    pub(super) fn is_full(&self) -> bool {
        self.len >= self.room
    }

    /// Whether the word went in.
    pub(super) fn push(&mut self, word: u32) -> bool {
        let fits = !self.is_full();
        if fits {
            self.words[(self.first + self.len) % 8] = word;
            self.len += 1;
        }
        fits
    }

    pub(super) fn pop(&mut self) -> Option<u32> {
        if self.is_empty() {
            return None;
        }
        let word = self.words[self.first];
        self.first = (self.first + 1) % 8;
        self.len -= 1;
        Some(word)
    }

    /// A word of its storage, where that serves as registers.
    pub(super) fn register(&mut self, index: u32) -> &mut u32 {
        &mut self.words[index as usize % 4]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_in_first_out_as_far_as_there_is_room() {
        let mut fifo = Fifo::new(4);
        assert!((0..4).all(|word| fifo.push(word)) && !fifo.push(4));
        assert_eq!((fifo.pop(), fifo.push(5), fifo.len()), (Some(0), true, 4));
        let rest: Vec<u32> = std::iter::from_fn(|| fifo.pop()).collect();
        assert_eq!(rest, [1, 2, 3, 5]);
        let none = Fifo::new(0);
        assert!(none.is_full() && none.is_empty());
    }
}
