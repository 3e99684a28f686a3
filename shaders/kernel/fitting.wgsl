// Turns fragments into nodes (depth, optical depth): keeps all of them, or as few as a tolerance on
// transmittance allows. src/kernel/fitting.rs explains the method and its error bound. A root that
// imports this defines `keep_node(node: vec2<f32>)`, which stores each node once it is final, and
// `kept_node(k: u32)`, which returns the k-th stored node.

const POINT_SPACING: f32 = 0.25;
const FIT_SHARE: f32 = 0.82;
const LEAST_ROOM: f32 = 0.25;
const BEND: f32 = 0.125;
const LOWEST_SHARE: f32 = 0.25;
const LOWEST_DEPTH: f32 = 1.3862944;
const DARK_SHARE: f32 = 0.1;
const STEEPEST: f32 = 3.4028234663852886e38;
const SMALLEST: f32 = 1e-30;

struct Fitter {
    // Largest error of transmittance at the points; 0 keeps every fragment.
    tolerance: f32,
    // Optical depth beyond which nothing matters.
    dark: f32,
    begun: bool,
    // The last node kept.
    anchor: vec2<f32>,
    // The range of slopes, optical depth over depth, of lines from the anchor that pass within the
    // tolerance of all points since.
    slopes: vec2<f32>,
    // The last point, on the exact function.
    last: vec2<f32>,
    // Extinction of the last fragment.
    extinction: f32,
    // The error in optical depth that the last fragment may have itself.
    bend: f32,
}

var<private> fitter: Fitter;

fn fitter_start(tolerance: f32) {
    let slopes = vec2<f32>(0.0, STEEPEST);
    let held = tolerance * FIT_SHARE;
    let dark = -log(max(held * DARK_SHARE, SMALLEST));
    fitter = Fitter(held, dark, false, vec2<f32>(0.0), slopes, vec2<f32>(0.0), 0.0, 0.0);
}

// Adds a slab from depth bounds.x to bounds.y, which does not begin in front of the one before.
fn fitter_add(bounds: vec2<f32>, optical_depth: f32) {
    fitter_add_fragment(bounds, optical_depth, true);
}

// Adds a slab of a medium, or what a surface leaves, which is linear between its depths.
fn fitter_add_fragment(bounds: vec2<f32>, optical_depth: f32, of_medium: bool) {
    if (!fitter.begun) {
        fitter.begun = true;
        fitter.anchor = vec2<f32>(bounds.x, 0.0);
        fitter.last = fitter.anchor;
        keep_node(fitter.anchor);
    } else if (bounds.x > fitter.last.x) {
        // There is nothing between two fragments, so optical depth stays the same.
        fitter_point(vec2<f32>(bounds.x, fitter.last.y));
        fitter.extinction = 0.0;
    }
    let start = fitter.last;
    let across = vec2<f32>(max(bounds.y - start.x, 0.0), optical_depth);
    fitter.bend = 0.0;
    if (across.x > 0.0 && of_medium) {
        let extinction = optical_depth / max(across.x, SMALLEST);
        fitter.bend = abs(extinction - fitter.extinction) * across.x * BEND;
        fitter.extinction = extinction;
    }
    if (optical_depth > POINT_SPACING && fitter.tolerance > 0.0 && across.x > 0.0) {
        let pieces = ceil(optical_depth / POINT_SPACING);
        for (var i: f32 = 1.0; i < pieces; i += 1.0) {
            let inner = start + across * (i / pieces);
            if (inner.y >= fitter.dark) {
                break;
            }
            fitter_point(inner);
        }
    }
    fitter_point(vec2<f32>(max(bounds.y, start.x), start.y + optical_depth));
}

// Passes the last node to keep_node.
fn fitter_finish() {
    if (fitter.begun && any(fitter.last != fitter.anchor)) {
        fitter_close();
    }
}

// Whether so little light is left that later fragments do not matter to a fit.
fn fitter_is_dark() -> bool {
    return fitter.tolerance > 0.0 && fitter.last.y > fitter.dark;
}

// The range of optical depth in which a line may pass a point, within the tolerance of
// transmittance. With the tolerance as a share s of transmittance the exact range is -log(1 + s) to
// -log(1 - s) around the point. 2 s / (2 + s) and 2 s / (2 - s) are within it, close to it where s
// is small, and need no logarithm.
fn fitter_range(optical_depth: f32) -> vec2<f32> {
    let through = exp(-optical_depth);
    let room = max(fitter.tolerance - fitter.bend * through, fitter.tolerance * LEAST_ROOM);
    let share = room / max(through, SMALLEST);
    let below = 2.0 * share / (2.0 + share);
    let above = select(LOWEST_DEPTH, 2.0 * share / (2.0 - share), share < 1.0 - LOWEST_SHARE);
    return vec2<f32>(max(optical_depth - below, 0.0), optical_depth + above);
}

// Slopes of lines from the last kept node that pass between two optical depths at a depth.
fn fitter_slopes(depth: f32, range: vec2<f32>) -> vec2<f32> {
    return (range - fitter.anchor.y) * (1.0 / (depth - fitter.anchor.x));
}

// Requires the line from the last kept node to pass near a point.
fn fitter_point(point: vec2<f32>) {
    if (fitter.tolerance == 0.0) {
        fitter.last = point;
        fitter.anchor = point;
        keep_node(point);
        return;
    }
    let range = fitter_range(point.y);
    if (point.x > fitter.anchor.x) {
        let allowed = fitter_slopes(point.x, range);
        let slopes = vec2<f32>(max(fitter.slopes.x, allowed.x), min(fitter.slopes.y, allowed.y));
        if (slopes.x <= slopes.y) {
            fitter.slopes = slopes;
            fitter.last = point;
            return;
        }
        fitter_close();
    }
    if (point.x > fitter.anchor.x) {
        let allowed = fitter_slopes(point.x, range);
        fitter.slopes = vec2<f32>(max(0.0, allowed.x), min(STEEPEST, allowed.y));
    } else {
        // The surface is too opaque to be part of a line.
        keep_node(point);
        fitter.anchor = point;
        fitter.slopes = vec2<f32>(0.0, STEEPEST);
    }
    fitter.last = point;
}

// Ends the line at the last point: through it if the tolerance allows, else as near to it as
// possible.
fn fitter_close() {
    if (fitter.tolerance == 0.0) {
        return;
    }
    let across = fitter.last - fitter.anchor;
    let slope = min(max(across.y / max(across.x, SMALLEST), fitter.slopes.x), fitter.slopes.y);
    fitter.anchor = vec2<f32>(fitter.last.x, fitter.anchor.y + slope * across.x);
    fitter.slopes = vec2<f32>(0.0, STEEPEST);
    keep_node(fitter.anchor);
}

// How many of `count` raw nodes to keep so that one line to the last node can replace the rest: the
// nodes left out lie where transmittance minus its final value is below `truncation`.
fn truncated(count: u32, truncation: f32) -> u32 {
    let end = exp(-kept_node(count - 1u).y);
    var low: u32 = 0u;
    var high = count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (exp(-kept_node(middle).y) - end >= truncation) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low + 1u;
}
