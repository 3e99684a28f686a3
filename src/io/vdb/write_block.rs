//! Encodes the values of one node as `value_block` reads them. Knows nothing of the node's
//! position.

use super::compression::put_run;
use super::mask;
use super::value::Value;
use super::value_block::Encoding;

/// Scratch memory, which one thread reuses.
#[derive(Default)]
pub(super) struct BlockWorkspace<T> {
    packed: Vec<T>,
    bytes: Vec<u8>,
    shuffled: Vec<u8>,
}

/// The inactive values of a node.
struct Inactive<T> {
    code: u8,
    /// Their values where the selection mask is off and where it is on.
    values: [T; 2],
}

impl<T: Value> Inactive<T> {
    /// Examines the slots that are neither in `active` nor in `children`.
    fn of(values: &[T], active: &[u64], children: &[u64], background: T) -> Self {
        let mut found = [background; 2];
        let mut count = 0;
        for (slot, &value) in values.iter().enumerate() {
            let is_child = children.get(slot / 64).is_some_and(|word| word >> (slot % 64) & 1 == 1);
            let known = found[..count].iter().any(|other| other.same_bits(value));
            if known || is_child || mask::is_set(active, slot) {
                continue;
            }
            if count == 2 {
                return Self { code: 6, values: found };
            }
            found[count] = value;
            count += 1;
        }
        let negative = background.negated();
        let [first, second] = found;
        let is = |value: T, other: T| value.same_bits(other);
        let (code, values) = match count {
            0 => (0, [background; 2]),
            1 if is(first, background) => (0, [background; 2]),
            1 if is(first, negative) => (1, [negative; 2]),
            1 => (2, [first; 2]),
            _ if is(first, negative) && is(second, background) => (3, [first, second]),
            _ if is(second, negative) && is(first, background) => (3, [second, first]),
            _ if is(second, background) => (4, [first, second]),
            _ if is(first, background) => (4, [second, first]),
            _ => (5, [first, second]),
        };
        Self { code, values }
    }
}

/// Appends the block of a node. `active` marks the active values; values in `children` (empty for
/// leaves) have no meaning.
pub(super) fn put_block<T: Value>(
    values: &[T],
    active: &[u64],
    children: &[u64],
    encoding: &Encoding<T>,
    workspace: &mut BlockWorkspace<T>,
    out: &mut Vec<u8>,
) {
    let Encoding { compression, background, .. } = *encoding;
    let inactive = if compression.active_mask {
        Inactive::of(values, active, children, background)
    } else {
        Inactive { code: 6, values: [background; 2] }
    };
    out.push(inactive.code);
    let stored = match inactive.code {
        2 | 4 => 1,
        5 => 2,
        _ => 0,
    };
    // These are at full precision even among half floats.
    T::encode(&inactive.values[..stored], out);
    if matches!(inactive.code, 3..=5) {
        let on = inactive.values[1];
        out.extend(values.chunks(8).map(|values| {
            let bits = values.iter().enumerate();
            bits.fold(0_u8, |byte, (bit, value)| byte | u8::from(value.same_bits(on)) << bit)
        }));
    }
    let BlockWorkspace { packed, bytes, shuffled } = workspace;
    packed.clear();
    if inactive.code == 6 {
        packed.extend_from_slice(values);
        for child in mask::set_bits(children) {
            packed[child] = T::default();
        }
    } else {
        packed.extend(mask::set_bits(active).map(|slot| values[slot]));
    }
    bytes.clear();
    let (_, half) = encoding.stored();
    if half {
        if packed.is_empty() {
            // A block of half floats without values has no framing.
            return;
        }
        T::encode_half(packed, bytes);
    } else {
        T::encode(packed, bytes);
    }
    put_run(bytes, compression, if half { 2 } else { T::PART_BYTES }, shuffled, out);
}
