// What surfaces leave on a texel's ray: the sorted list of fragments, taken apart into pieces that do
// not overlap, and merged into the slabs that are marched through
// (src/shadow/fragments/overlaps.rs).
#import kernel/lists

const FARTHEST: f32 = 3.4028234663852886e38;

// The list of the fragments that begin behind `reached`, and of those that begin in front of it and
// may end behind it.
var<private> coming: u32;
var<private> open: u32;
// Up to where pieces are made, and their optical depth.
var<private> reached: f32;
var<private> taken: f32;
// The piece that is not passed yet: front, back, optical depth. Its front is FARTHEST behind all.
var<private> piece: vec3<f32>;
// The depth up to which it is passed.
var<private> passed: f32;

// Begins with the pieces of a texel of the tile.
fn begin_pieces(texel: u32) {
    coming = atomicLoad(&heads[texel]);
    open = 0u;
    reached = -FARTHEST;
    taken = 0.0;
    passed = -FARTHEST;
    next_piece();
}

// Makes the next piece. It relinks the lists.
fn next_piece() {
    piece = vec3<f32>(FARTHEST, FARTHEST, 0.0);
    // Behind this nothing gets through.
    if (taken >= OPAQUE_OPTICAL_DEPTH) {
        return;
    }
    loop {
        var end = FARTHEST;
        if (coming != 0u) {
            let own = coming;
            let one = elements[own - 1u];
            if (one.front <= reached) {
                coming = one.next;
                if (one.back > one.front) {
                    elements[own - 1u].next = open;
                    open = own;
                    continue;
                }
                piece = vec3<f32>(one.front, one.back, one.optical_depth);
                taken += one.optical_depth;
                return;
            }
            end = one.front;
        }
        // The extinction of those that overlap, up to the first end. Those that have ended leave.
        var extinction = 0.0;
        var before = 0u;
        var at = open;
        while (at != 0u) {
            let one = elements[at - 1u];
            if (one.back > reached) {
                extinction += one.optical_depth / (one.back - one.front);
                end = min(end, one.back);
                before = at;
            } else if (before == 0u) {
                open = one.next;
            } else {
                elements[before - 1u].next = one.next;
            }
            at = one.next;
        }
        if (end == FARTHEST) {
            return;
        }
        let begin = reached;
        reached = end;
        if (open != 0u) {
            piece = vec3<f32>(begin, end, extinction * (end - begin));
            taken += piece.z;
            return;
        }
    }
}

// Adds a slab, with the pieces in front of it and cut at those in it.
fn add_between(front: f32, back: f32, optical_depth: f32) {
    if (back <= front) {
        return;
    }
    if (piece.x < front) {
        add_merged(-FARTHEST, front, 0.0);
    }
    if (piece.x >= back) {
        add_fragment(front, back, optical_depth, true);
        return;
    }
    add_merged(front, back, optical_depth / (back - front));
}

// Adds the pieces between two depths, and a medium of the given extinction around them.
fn add_merged(front: f32, back: f32, extinction: f32) {
    var at = front;
    while (piece.x < back) {
        let begin = max(max(piece.x, at), passed);
        if (begin > at) {
            add_medium(at, begin, extinction);
            at = begin;
        }
        let end = max(min(piece.y, back), at);
        var share = 1.0;
        if (piece.y > piece.x) {
            share = (end - begin) / (piece.y - piece.x);
        }
        var medium = 0.0;
        if (extinction > 0.0) {
            medium = extinction * (end - begin);
        }
        add_fragment(begin, end, medium + piece.z * share, true);
        at = end;
        passed = end;
        if (piece.y > back) {
            break;
        }
        next_piece();
    }
    if (at < back) {
        add_medium(at, back, extinction);
    }
}

fn add_medium(front: f32, back: f32, extinction: f32) {
    if (extinction > 0.0) {
        add_fragment(front, back, extinction * (back - front), true);
    }
}

// Adds the pieces behind all slabs.
fn add_rest() {
    while (piece.x < FARTHEST && !fitter_is_dark()) {
        let begin = max(piece.x, passed);
        var share = 1.0;
        if (piece.y > piece.x) {
            share = (piece.y - begin) / (piece.y - piece.x);
        }
        add_fragment(begin, max(piece.y, begin), piece.z * share, false);
        next_piece();
    }
}
