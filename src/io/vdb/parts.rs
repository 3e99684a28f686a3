//! The bytes of a file that is being assembled, in pieces, so that finished bytes are never moved.
//! Knows nothing of their meaning.

/// A sequence of pieces; the last one is still growing.
#[derive(Default)]
pub(super) struct Parts {
    whole: Vec<Vec<u8>>,
    /// Number of bytes in the finished pieces.
    length: usize,
    last: Vec<u8>,
}

impl Parts {
    /// Number of bytes in all pieces.
    pub(super) fn len(&self) -> usize {
        self.length + self.last.len()
    }

    /// The last piece, to be appended to.
    pub(super) fn last(&mut self) -> &mut Vec<u8> {
        &mut self.last
    }

    /// Appends a piece, and begins a new one behind it.
    pub(super) fn push(&mut self, part: Vec<u8>) {
        if !self.last.is_empty() {
            self.length += self.last.len();
            self.whole.push(std::mem::take(&mut self.last));
        }
        self.length += part.len();
        self.whole.push(part);
    }

    /// Overwrites the bytes from byte `at` on by `bytes`; they must lie in one piece.
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
