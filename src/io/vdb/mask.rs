//! Bit masks over the slots of a node. They know nothing of the slots' contents.

/// One bit per slot, with the number of set bits in front of each word, so that the rank of a slot
/// among the set ones is found in constant time.
#[derive(Clone, Debug, Default)]
pub(super) struct SlotMask {
    words: Vec<u64>,
    before: Vec<u32>,
}

impl SlotMask {
    /// A mask from the file's words: little endian; bit i of the mask is bit i % 64 of word i / 64.
    pub(super) fn from_bytes(bytes: &[u8]) -> Self {
        Self::from_words(words(bytes).collect())
    }

    /// A mask of these words.
    pub(super) fn from_words(words: Vec<u64>) -> Self {
        let mut count = 0;
        let before = words
            .iter()
            .map(|word| {
                let before = count;
                count += word.count_ones();
                before
            })
            .collect();
        Self { words, before }
    }

    /// Number of set bits.
    pub(super) fn count(&self) -> usize {
        match (self.words.last(), self.before.last()) {
            (Some(word), Some(before)) => (word.count_ones() + before) as usize,
            _ => 0,
        }
    }

    /// Whether the slot's bit is set.
    pub(super) fn has(&self, slot: usize) -> bool {
        is_set(&self.words, slot)
    }

    /// Number of set bits in front of the slot.
    pub(super) fn rank(&self, slot: usize) -> usize {
        let (word, bit) = (slot / 64, slot % 64);
        let below = self.words[word] & ((1 << bit) - 1);
        (self.before[word] + below.count_ones()) as usize
    }

    /// Whether no slot is set in both masks.
    pub(super) fn is_disjoint(&self, other: &Self) -> bool {
        self.words.iter().zip(&other.words).all(|(a, b)| a & b == 0)
    }

    /// The words.
    pub(super) fn words(&self) -> &[u64] {
        &self.words
    }

    /// The set slots in ascending order.
    pub(super) fn slots(&self) -> impl Iterator<Item = usize> {
        set_bits(&self.words)
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> usize {
        self.words.len() * 8 + self.before.len() * 4
    }
}

/// The words of a mask's bytes.
pub(super) fn words(bytes: &[u8]) -> impl Iterator<Item = u64> {
    bytes.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes))
}

/// Number of set bits.
pub(super) fn count_ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

/// Whether bit `slot` is set.
pub(super) fn is_set(words: &[u64], slot: usize) -> bool {
    words[slot / 64] >> (slot % 64) & 1 == 1
}

/// The indices of the set bits, ascending.
pub(super) fn set_bits(words: &[u64]) -> impl Iterator<Item = usize> {
    words.iter().enumerate().flat_map(|(index, &word)| {
        std::iter::successors((word != 0).then_some(word), |word| {
            let rest = word & (word - 1);
            (rest != 0).then_some(rest)
        })
        .map(move |word| 64 * index + word.trailing_zeros() as usize)
    })
}

/// Sets or clears bit `slot`.
pub(super) fn put(words: &mut [u64], slot: usize, set: bool) {
    let bit = 1 << (slot % 64);
    if set {
        words[slot / 64] |= bit;
    } else {
        words[slot / 64] &= !bit;
    }
}
