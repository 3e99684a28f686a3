// The code of a texel: nine knots of opacity over depth in four words. src/shadow/coded/nested
// explains it. A knot is (share of the way from the ray's entry to its exit, share of the ray's
// largest opacity).

// x clamped to 0..1; 0 for NaN.
fn unit(x: f32) -> f32 {
    return select(0.0, min(x, 1.0), x > 0.0);
}

// The share 0..1 stored in `bits` bits of a word, from bit `shift` on.
fn share(word: u32, shift: u32, bits: u32) -> f32 {
    let most = (1u << bits) - 1u;
    return f32((word >> shift) & most) / f32(most);
}

// Transmittance of a texel from the light to a depth. `extent` are the depths where its ray enters
// and leaves the media.
fn nested_transmittance(words: vec4<u32>, extent: vec2<f32>, depth: f32) -> f32 {
    let largest = share(words.x, 0u, 12u);
    if (depth <= extent.x) {
        return 1.0;
    }
    if (depth >= extent.y) {
        return 1.0 - largest;
    }
    let at = unit((depth - extent.x) / (extent.y - extent.x));
    let first = share(words.x, 12u, 10u);
    let last = max(share(words.x, 22u, 10u), first);
    if (at < first) {
        return 1.0;
    }
    if (at >= last) {
        return 1.0 - largest;
    }
    var a = vec2<f32>(first, 0.0);
    var b = vec2<f32>(last, 1.0);
    // The middle knot, and the word for the half that contains the depth.
    var knot = a + (b - a) * vec2<f32>(share(words.y, 0u, 8u), share(words.y, 8u, 8u));
    var behind = at >= knot.x;
    a = select(a, knot, behind);
    b = select(knot, b, behind);
    let half = select(words.z, words.w, behind);
    let quarter = select(16u, 24u, behind);
    // The quarter's knot, and the bit where the eighth between begins.
    knot = a + (b - a) * vec2<f32>(share(words.y, quarter, 8u), share(half, 0u, 6u));
    behind = at >= knot.x;
    a = select(a, knot, behind);
    b = select(knot, b, behind);
    let eighth = select(6u, 19u, behind);
    knot = a + (b - a) * vec2<f32>(share(half, eighth, 7u), share(half, eighth + 7u, 6u));
    behind = at >= knot.x;
    a = select(a, knot, behind);
    b = select(knot, b, behind);
    // Rounding may put b slightly in front of a; then it counts as being at a.
    let way = select(0.0, (at - a.x) / (b.x - a.x), b.x > a.x);
    return 1.0 - largest * unit(a.y + (b.y - a.y) * unit(way));
}
