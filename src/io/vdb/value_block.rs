//! The values of one node in the file: a code for the inactive values, then all values or only the
//! active ones, optionally as half floats, optionally compressed. Knows nothing of the node's
//! position.

use super::compression::{Compression, Run, Workspace, take_run};
use super::fault::{Fault, Parsed};
use super::mask;
use super::source::Bytes;
use super::value::Value;

/// The encoding of the values of a whole grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding<T> {
    pub(super) compression: Compression,
    /// Whether the type string says half; it applies to floating-point types only.
    pub(super) half: bool,
    pub(super) background: T,
}

impl<T: Value> Encoding<T> {
    /// Bytes of a stored value, and whether it is stored as half floats.
    pub(super) fn stored(&self) -> (usize, bool) {
        match T::HALF_BYTES {
            Some(bytes) if self.half => (bytes, true),
            _ => (T::BYTES, false),
        }
    }
}

/// A node's values as read from the file, not decompressed yet.
pub(super) struct ValueBlock<'a, T> {
    /// The inactive values, where the selection mask is off and where it is on.
    inactive: [T; 2],
    selection: Option<&'a [u8]>,
    /// Whether the run contains only the active values.
    masked: bool,
    count: usize,
    run: Run<'a>,
}

/// Reads one value at full precision.
pub(super) fn read_value<T: Value>(bytes: &mut Bytes) -> Parsed<T> {
    let mut value = [T::default()];
    T::decode(bytes.take(T::BYTES)?, &mut value);
    Ok(value[0])
}

impl<'a, T: Value> ValueBlock<'a, T> {
    /// Reads the block of a node with `count` slots, of which `active` are active.
    pub(super) fn take(
        bytes: &mut Bytes<'a>,
        encoding: &Encoding<T>,
        count: usize,
        active: usize,
    ) -> Parsed<Self> {
        let background = encoding.background;
        let at = bytes.position();
        let code = bytes.u8()?;
        let mut inactive = match code {
            0 | 6 => [background; 2],
            1..=5 => [background.negated(), background],
            _ => return Err(Fault::bad(at, format!("value block code {code}, expected 0 to 6"))),
        };
        if matches!(code, 2 | 4 | 5) {
            inactive[0] = read_value(bytes)?;
        }
        if code == 5 {
            inactive[1] = read_value(bytes)?;
        }
        let selection = if matches!(code, 3..=5) { Some(bytes.take(count / 8)?) } else { None };
        let masked = encoding.compression.active_mask && code != 6;
        let count = if masked { active } else { count };
        let (width, half) = encoding.stored();
        // Only a block of half floats without values has no framing.
        let run = if half && count == 0 {
            Run::Bare(&[])
        } else {
            take_run(bytes, encoding.compression, count * width)?
        };
        Ok(Self { inactive, selection, masked, count, run })
    }

    /// Fills the node's `values`; `active` tells which of them are active.
    pub(super) fn decode(
        &self,
        encoding: &Encoding<T>,
        active: &[u64],
        workspace: &mut Workspace,
        packed: &mut Vec<T>,
        values: &mut [T],
    ) -> Parsed<()> {
        let (width, half) = encoding.stored();
        let bytes = workspace.unpack(self.run, self.count * width)?;
        let decode = if half { T::decode_half } else { T::decode };
        if !self.masked || self.count == values.len() {
            decode(bytes, values);
            return Ok(());
        }
        packed.resize(self.count, T::default());
        decode(bytes, packed);
        self.fill_inactive(values);
        let mut next = packed.iter();
        for (word, values) in active.iter().zip(values.chunks_exact_mut(64)) {
            if *word == u64::MAX {
                let (run, rest) = next.as_slice().split_at(64.min(next.len()));
                values[..run.len()].copy_from_slice(run);
                next = rest.iter();
            } else {
                for (slot, value) in mask::set_bits(&[*word]).zip(&mut next) {
                    values[slot] = *value;
                }
            }
        }
        Ok(())
    }

    fn fill_inactive(&self, values: &mut [T]) {
        let [off, on] = self.inactive;
        let Some(selection) = self.selection else {
            values.fill(off);
            return;
        };
        for (word, values) in mask::words(selection).zip(values.chunks_exact_mut(64)) {
            for (bit, value) in values.iter_mut().enumerate() {
                *value = if word >> bit & 1 == 1 { on } else { off };
            }
        }
    }
}
