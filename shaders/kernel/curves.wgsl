// The buffers that hold the curves of a threshold map's texels, so that lookups need not derive
// them again.
#import kernel/threshold

// Row by row; first the first pieces of all texels, then all second pieces, and so on, so that
// lookups in neighbouring texels read neighbouring memory.
@group(0) @binding(23) var<storage, read_write> piece_ends: array<vec4<f32>>;
@group(0) @binding(24) var<storage, read_write> cubics: array<vec4<f32>>;

fn keep_curve(texel: vec2<u32>, c: Curve) {
    let size = frame.map.size;
    let at = texel.y * size + texel.x;
    piece_ends[at] = c.ends;
    // Unrolled: a dynamic index would put the curve in memory, which costs up to a fifth of the
    // pass's time.
    cubics[at] = c.cubics[0];
    cubics[size * size + at] = c.cubics[1];
    cubics[2u * size * size + at] = c.cubics[2];
    cubics[3u * size * size + at] = c.cubics[3];
}
