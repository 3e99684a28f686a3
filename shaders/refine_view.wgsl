// Pass refine_view: marches all rays of those pixels where the picture of one ray each bends, and
// keeps the other pixels. One thread per pixel.
#import kernel/march

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;
// The picture of one ray each.
@group(0) @binding(29) var single: texture_2d<f32>;
// The 99.9th percentile of its radiance, from rank_radiance.
@group(0) @binding(30) var<storage, read> bright: array<f32>;

// The pixel at a distance from `place`, or the nearest in the picture.
fn near(place: vec2<u32>, dx: i32, dy: i32) -> vec4<f32> {
    let most = vec2<i32>(i32(frame.view.width), i32(frame.view.height)) - 1;
    return textureLoad(single, clamp(vec2<i32>(place) + vec2<i32>(dx, dy), vec2<i32>(0), most), 0);
}

// Whether a pixel differs from the mean of the two on either side, in any of four directions, by
// more than eight times the tolerance.
fn bends(place: vec2<u32>) -> bool {
    let level = 8.0 * frame.view.tolerance * vec4<f32>(vec3<f32>(bright[0]), 1.0);
    let twice = 2.0 * near(place, 0, 0);
    let across = abs(near(place, -1, 0) + near(place, 1, 0) - twice);
    let along = abs(near(place, 0, -1) + near(place, 0, 1) - twice);
    let falling = abs(near(place, -1, -1) + near(place, 1, 1) - twice);
    let rising = abs(near(place, -1, 1) + near(place, 1, -1) - twice);
    return any(max(max(across, along), max(falling, rising)) > level);
}

@compute @workgroup_size(8, 8)
fn refine_view(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = vec2<u32>(id.x, id.y + frame.view.first_row);
    if (place.x >= frame.view.width || place.y >= frame.view.height || !is_in_part(id.y)) {
        return;
    }
    var colour = near(place, 0, 0);
    if (bends(place) && !is_complete(place)) {
        colour = pixel(place, frame.view.samples);
    }
    textureStore(output, place, colour);
}
