// Where the curves of a threshold map's texels are written, so that lookups need not work them out
// again.
#import kernel/threshold

// Row by row, and for all texels the first pieces, the second ones, ...: lookups of neighbours lie
// next to each other.
@group(0) @binding(23) var<storage, read_write> piece_ends: array<vec4<f32>>;
@group(0) @binding(24) var<storage, read_write> cubics: array<vec4<f32>>;

fn keep_curve(texel: vec2<u32>, c: Curve) {
    let size = frame.map.size;
    let at = texel.y * size + texel.x;
    piece_ends[at] = c.ends;
    // Written out: a place that is not constant puts the curve in memory, for up to a fifth of the
    // pass.
    cubics[at] = c.cubics[0];
    cubics[size * size + at] = c.cubics[1];
    cubics[2u * size * size + at] = c.cubics[2];
    cubics[3u * size * size + at] = c.cubics[3];
}
