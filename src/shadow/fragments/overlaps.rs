//! Fragments of one texel that overlap in depth, taken apart into pieces that do not.

use super::Fragment;
use crate::kernel::fragments::OPAQUE_OPTICAL_DEPTH;

/// Appends to `pieces` those of `fragments` in order of depth, of which none begins in front of the
/// end of the one before. Over any depth they have the optical depth of all fragments together.
/// `fragments` are sorted by their fronts; `open` is scratch memory. What lies behind an optical
/// depth at which nothing gets through is left out.
pub fn disjoint(fragments: &mut [Fragment], open: &mut Vec<Fragment>, pieces: &mut Vec<Fragment>) {
    fragments.sort_by(|a, b| a.front.total_cmp(&b.front));
    // Those that begin in front of `at` and end behind it are among `open`.
    open.clear();
    let (mut next, mut at) = (0, f32::NEG_INFINITY);
    let mut passed = 0.0;
    while passed < OPAQUE_OPTICAL_DEPTH {
        open.retain(|one| one.back > at);
        while let Some(one) = fragments.get(next).filter(|one| one.front <= at) {
            if one.back > one.front {
                open.push(*one);
            } else {
                passed += one.optical_depth;
                pieces.push(*one);
            }
            next += 1;
        }
        let begin = fragments.get(next).map_or(f32::INFINITY, |one| one.front);
        let end = open.iter().fold(begin, |end, one| end.min(one.back));
        if end == f32::INFINITY {
            return;
        }
        if !open.is_empty() {
            let slope: f32 =
                open.iter().map(|one| one.optical_depth / (one.back - one.front)).sum();
            let optical_depth = slope * (end - at);
            passed += optical_depth;
            pieces.push(Fragment { front: at, back: end, optical_depth });
        }
        at = end;
    }
}

/// Pieces in order of depth, of which some are passed already: adds them to what is marched through
/// in the same order.
#[derive(Clone, Debug)]
pub struct Merged<'a> {
    pieces: &'a [Fragment],
    /// Depth up to which the first piece is passed.
    passed: f32,
}

impl<'a> Merged<'a> {
    /// Those of a texel ([`disjoint`]).
    pub fn new(pieces: &'a [Fragment]) -> Self {
        Self { pieces, passed: f32::NEG_INFINITY }
    }

    /// Whether none begins in front of `depth`.
    #[inline]
    pub fn none_before(&self, depth: f32) -> bool {
        self.pieces.first().is_none_or(|piece| piece.front >= depth)
    }

    /// Passes to `add` what lies in front of `depth`.
    pub fn up_to(&mut self, depth: f32, mut add: impl FnMut([f32; 2], f32)) {
        self.through([f32::NEG_INFINITY, depth], 0.0, &mut add);
    }

    /// Passes to `add` the pieces between two depths, and the slab between them with the optical
    /// depth `optical_depth` cut where they begin and end. What lies in front was passed before.
    pub fn through(
        &mut self,
        [front, back]: [f32; 2],
        optical_depth: f32,
        add: &mut impl FnMut([f32; 2], f32),
    ) {
        let extinction = if optical_depth > 0.0 { optical_depth / (back - front) } else { 0.0 };
        let mut at = front;
        let mut slab = |from: f32, to: f32, own: f32| {
            let medium = if extinction > 0.0 { extinction * (to - from) } else { 0.0 };
            if medium + own > 0.0 {
                add([from, to], medium + own);
            }
        };
        while let Some(piece) = self.pieces.first().filter(|piece| piece.front < back) {
            let begin = piece.front.max(at).max(self.passed);
            if begin > at {
                slab(at, begin, 0.0);
                at = begin;
            }
            let end = piece.back.min(back).max(at);
            let share = if piece.back > piece.front {
                (end - begin) / (piece.back - piece.front)
            } else {
                1.0
            };
            slab(begin, end, piece.optical_depth * share);
            at = end;
            self.passed = end;
            if piece.back > back {
                break;
            }
            self.pieces = &self.pieces[1..];
        }
        if at < back {
            slab(at, back, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(front: f32, back: f32, optical_depth: f32) -> Fragment {
        Fragment { front, back, optical_depth }
    }

    #[test]
    fn overlapping_fragments_become_pieces_with_the_same_sum() {
        let mut fragments = [
            piece(2.0, 2.0, 0.5),
            piece(1.0, 3.0, 4.0),
            piece(0.0, 2.0, 1.0),
            piece(5.0, 6.0, 7.0),
        ];
        let (mut open, mut pieces) = (Vec::new(), Vec::new());
        disjoint(&mut fragments, &mut open, &mut pieces);
        let due = [
            piece(0.0, 1.0, 0.5),
            piece(1.0, 2.0, 2.5),
            piece(2.0, 2.0, 0.5),
            piece(2.0, 3.0, 2.0),
            piece(5.0, 6.0, 7.0),
        ];
        assert_eq!(pieces, due);
        disjoint(&mut [], &mut open, &mut pieces);
        assert_eq!(pieces.len(), due.len());
    }

    #[test]
    fn slabs_are_cut_at_the_pieces_among_them() {
        let pieces = [piece(1.0, 2.0, 1.0), piece(3.0, 3.0, 5.0), piece(3.5, 6.0, 2.5)];
        let mut merged = Merged::new(&pieces);
        let mut found = Vec::new();
        merged.up_to(0.5, |bounds, tau| found.push((bounds, tau)));
        assert!(found.is_empty() && merged.none_before(1.0) && !merged.none_before(1.1));
        merged.through([1.5, 4.0], 5.0, &mut |bounds, tau| found.push((bounds, tau)));
        let due = [
            ([1.5, 2.0], 1.5),
            ([2.0, 3.0], 2.0),
            ([3.0, 3.0], 5.0),
            ([3.0, 3.5], 1.0),
            ([3.5, 4.0], 1.5),
        ];
        assert_eq!(found, due);
        found.clear();
        merged.through([4.0, 5.0], 0.0, &mut |bounds, tau| found.push((bounds, tau)));
        merged.up_to(f32::INFINITY, |bounds, tau| found.push((bounds, tau)));
        assert_eq!(found, [([4.0, 5.0], 1.0), ([5.0, 6.0], 1.0)]);
    }
}
