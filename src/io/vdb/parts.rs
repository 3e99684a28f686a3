//! Bytes of a file in the making, in pieces, so that what is there already is never moved. It knows
//! nothing of what they mean.

/// Pieces that follow one another; the last one is still growing.
#[derive(Default)]
pub(super) struct Parts {
    whole: Vec<Vec<u8>>,
    /// Bytes of the whole ones.
    length: usize,
    last: Vec<u8>,
}

impl Parts {
    /// Bytes in all.
    pub(super) fn len(&self) -> usize {
        self.length + self.last.len()
    }

    /// The end, to be added to.
    pub(super) fn last(&mut self) -> &mut Vec<u8> {
        &mut self.last
    }

    /// Adds a piece, and begins the next one behind it.
    pub(super) fn push(&mut self, part: Vec<u8>) {
        if !self.last.is_empty() {
            self.length += self.last.len();
            self.whole.push(std::mem::take(&mut self.last));
        }
        self.length += part.len();
        self.whole.push(part);
    }

    /// Puts `bytes` in the place of those from byte `at` on, which lie in one piece.
    pub(super) fn put(&mut self, mut at: usize, bytes: &[u8]) {
        for part in self.whole.iter_mut().chain([&mut self.last]) {
            if at < part.len() {
                let place = part[at..].iter_mut();
                place.zip(bytes).for_each(|(place, byte)| *place = *byte);
                return;
            }
            at -= part.len();
        }
    }

    /// All pieces.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.whole.iter().chain([&self.last]).map(Vec::as_slice)
    }

    pub(super) fn into_parts(mut self) -> Vec<Vec<u8>> {
        self.whole.push(self.last);
        self.whole
    }
}
