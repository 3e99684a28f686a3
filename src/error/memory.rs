//! Fallible allocation, for memory whose amount a file or an option determines. If the system
//! refuses it, the result is an error of one line and not an abort. Knows nothing of what the
//! memory is used for.

use super::{Error, ErrorKind, Result};

/// An empty vector with room for `count` items; `what` names them in the error.
///
/// # Errors
/// [`ErrorKind::Limit`] if there is not enough memory.
pub fn room<T>(count: usize, what: &str) -> Result<Vec<T>> {
    let mut items = Vec::new();
    reserve(&mut items, count, what)?;
    Ok(items)
}

/// A vector of `count` copies of `value`.
///
/// # Errors
/// As [`room`].
pub fn filled<T: Clone>(count: usize, value: T, what: &str) -> Result<Vec<T>> {
    let mut items = room(count, what)?;
    items.resize(count, value);
    Ok(items)
}

/// A vector with the items of a slice.
///
/// # Errors
/// As [`room`].
pub fn copied<T: Clone>(items: &[T], what: &str) -> Result<Vec<T>> {
    let mut copy = room(items.len(), what)?;
    copy.extend_from_slice(items);
    Ok(copy)
}

/// A vector with the items of an iterator of known length.
///
/// # Errors
/// As [`room`].
pub fn collected<T>(items: impl ExactSizeIterator<Item = T>, what: &str) -> Result<Vec<T>> {
    let mut all = room(items.len(), what)?;
    all.extend(items);
    Ok(all)
}

/// Reserves exactly enough room for `more` further items.
///
/// # Errors
/// As [`room`].
pub fn reserve<T>(items: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    items.try_reserve_exact(more).map_err(|_| refused(items.len(), more, size_of::<T>(), what))
}

/// Reserves room for `more` further items in a vector that keeps growing. The capacity at least
/// doubles where possible, so that all its moves together take linear time.
///
/// # Errors
/// As [`room`].
pub fn grow<T>(items: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    if items.try_reserve(more).is_ok() {
        return Ok(());
    }
    // Doubling may be too much where the required amount is not.
    reserve(items, more, what)
}

/// A number of bytes or items of a file as an amount of memory. What no address reaches, as on
/// systems of 32 bits, becomes more than can be allocated.
pub fn count(items: impl Into<u128>) -> usize {
    usize::try_from(items.into()).unwrap_or(usize::MAX)
}

/// Checks that `bytes` bytes could be allocated, for work that allocates piece by piece in ways
/// that cannot fail gracefully.
///
/// # Errors
/// As [`room`].
pub fn check(bytes: u64, what: &str) -> Result<()> {
    room::<u8>(count(bytes), what).map(drop)
}

fn refused(held: usize, more: usize, size: usize, what: &str) -> Error {
    let needed = (held as u128 + more as u128) * size as u128;
    let (needed, limit) = (format!("{needed} bytes"), "the memory that is left".to_owned());
    ErrorKind::Limit { what: what.to_owned(), needed, limit }.into()
}

#[cfg(test)]
mod tests {
    use super::{filled, grow, reserve, room};

    #[test]
    fn what_there_is_no_memory_for_is_an_error_with_the_number() {
        let most = usize::MAX / 64;
        for error in [
            room::<f64>(most, "voxels").err(),
            filled(most, 0.0_f64, "voxels").err(),
            reserve(&mut Vec::<f64>::new(), most, "voxels").err(),
            grow(&mut Vec::<f64>::new(), most, "voxels").err(),
        ] {
            let text = error.map(|error| error.to_string()).unwrap_or_default();
            let needed = most as u128 * 8;
            let due = format!("voxels: needs {needed} bytes, the limit is the memory that is left");
            assert_eq!(text, due);
        }
        assert_eq!(filled(3, 7_u8, "").ok(), Some(vec![7; 3]));
    }
}
