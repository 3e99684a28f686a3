//! Work for all threads, compiled once. rayon's own loops are compiled anew for every closure and
//! every type that they meet, which was a quarter of this crate's machine code. For pieces of some
//! microseconds and more; finer ones stay with rayon's iterators. It knows nothing of the work.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// `work` on each of the items, in any order.
pub fn for_each<I: Send>(items: impl IntoIterator<Item = I>, work: impl Fn(I) + Sync) {
    let items: Vec<_> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    run(items.len(), &|index| {
        let item = items[index].lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(item) = item {
            work(item);
        }
    });
}

/// What `work` makes of each item, in the items' order.
pub fn map<I: Send, R: Send>(
    items: impl IntoIterator<Item = I>,
    work: impl Fn(I) -> R + Sync,
) -> Vec<R> {
    let items: Vec<I> = items.into_iter().collect();
    let mut results: Vec<Option<R>> = Vec::new();
    results.resize_with(items.len(), || None);
    for_each(items.into_iter().zip(&mut results), |(item, result)| *result = Some(work(item)));
    results.into_iter().flatten().collect()
}

/// Runs `work` on every index below `count`.
fn run(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once_and_results_keep_their_order() {
        let mut values: Vec<u64> = (0..10_001).collect();
        for_each(values.chunks_mut(7).enumerate(), |(i, part)| {
            for value in part {
                *value += 1_000_000 * i as u64;
            }
        });
        let expected = (0..10_001).map(|i| i + 1_000_000 * (i / 7));
        assert!(values.iter().copied().eq(expected));
        let squares = map(0..1000_u64, |i| i * i);
        assert!(squares.into_iter().eq((0..1000).map(|i| i * i)));
        assert!(map(std::iter::empty::<u8>(), |i| i).is_empty());
    }
}
