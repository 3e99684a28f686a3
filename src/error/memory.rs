//! Memory whose amount a file or an option decides: asked for where the system may refuse it, so
//! that a refusal is an error of one line and no abort. It knows nothing of what is kept in it.

use super::{Error, ErrorKind, Result};

/// An empty vector with room for `count` items; `what` names them for people.
///
/// # Errors
/// [`ErrorKind::Limit`] if there is no memory for them.
pub fn room<T>(count: usize, what: &str) -> Result<Vec<T>> {
    let mut items = Vec::new();
    reserve(&mut items, count, what)?;
    Ok(items)
}

/// `count` times `value`.
///
/// # Errors
/// As [`room`].
pub fn filled<T: Clone>(count: usize, value: T, what: &str) -> Result<Vec<T>> {
    let mut items = room(count, what)?;
    items.resize(count, value);
    Ok(items)
}

/// The items of a slice.
///
/// # Errors
/// As [`room`].
pub fn copied<T: Clone>(items: &[T], what: &str) -> Result<Vec<T>> {
    let mut copy = room(items.len(), what)?;
    copy.extend_from_slice(items);
    Ok(copy)
}

/// What an iterator yields, of which it knows the number.
///
/// # Errors
/// As [`room`].
pub fn collected<T>(items: impl ExactSizeIterator<Item = T>, what: &str) -> Result<Vec<T>> {
    let mut all = room(items.len(), what)?;
    all.extend(items);
    Ok(all)
}

/// Makes room for `more` items behind those of `items`, no more than is needed.
///
/// # Errors
/// As [`room`].
pub fn reserve<T>(items: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    items.try_reserve_exact(more).map_err(|_| refused(items.len(), more, size_of::<T>(), what))
}

/// Makes room for `more` items behind those of a vector that goes on growing, so that all of its
/// moves together take no longer than it is.
///
/// # Errors
/// As [`room`].
pub fn grow<T>(items: &mut Vec<T>, more: usize, what: &str) -> Result<()> {
    if items.try_reserve(more).is_ok() {
        return Ok(());
    }
    // Twice as much may be too much where as much as is needed is not.
    reserve(items, more, what)
}

/// Makes sure that so many bytes could be had, for work that asks for them piece by piece and
/// cannot be refused any.
///
/// # Errors
/// As [`room`].
pub fn check(bytes: u64, what: &str) -> Result<()> {
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    room::<u8>(bytes, what).map(drop)
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
