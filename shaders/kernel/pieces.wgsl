// What surfaces leave on a texel's ray, merged into the slabs that are marched through
// (`Merged` in src/shadow/fragments/overlaps.rs).

@group(0) @binding(36) var<storage, read> piece_runs: array<vec2<u32>>;
// Front, back and optical depth of each.
@group(0) @binding(37) var<storage, read> pieces: array<vec3<f32>>;

const FARTHEST: f32 = 3.4028234663852886e38;

// The pieces that are not passed: the index of the first, and one past the last.
var<private> rest: vec2<u32>;
// The first of them, and the depth up to which it is passed.
var<private> piece: vec3<f32>;
var<private> passed: f32;

fn next_piece() {
    piece = vec3<f32>(FARTHEST, FARTHEST, 0.0);
    if (rest.x < rest.y) {
        piece = pieces[rest.x];
    }
}

// Begins with those of a texel of the tile.
fn begin_pieces(texel: u32) {
    let run = piece_runs[texel];
    rest = vec2<u32>(run.x, run.x + run.y);
    passed = -FARTHEST;
    next_piece();
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
        rest.x++;
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
    while (rest.x < rest.y) {
        let begin = max(piece.x, passed);
        var share = 1.0;
        if (piece.y > piece.x) {
            share = (piece.y - begin) / (piece.y - piece.x);
        }
        add_fragment(begin, max(piece.y, begin), piece.z * share, false);
        rest.x++;
        next_piece();
    }
}
