// Pass raster_slices: draws planes across the light's view as geometry. Each fragment integrates
// its slab along its texel's own ray and is pushed on the texel's linked list. There is no render
// target.
#import kernel/lists
#import kernel/slices
#import kernel/tile

struct Plane {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) index: u32,
}

// One triangle for each plane, which covers the whole tile.
@vertex
fn plane(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Plane {
    let x = select(-1.0, 3.0, corner == 1u);
    let y = select(-1.0, 3.0, corner == 2u);
    return Plane(vec4<f32>(x, y, 0.0, 1.0), index);
}

@fragment
fn raster_slices(plane: Plane) {
    let texel = vec2<u32>(plane.position.xy);
    let at = (vec2<f32>(tile.origin + texel) + 0.5) / f32(frame.map.size);
    let slabs = slabs_of(at.x, at.y);
    if (plane.index < slabs.first || plane.index >= slabs.last) {
        return;
    }
    let bounds = slab_bounds(slabs, plane.index);
    if (bounds.y <= bounds.x) {
        return;
    }
    let optical_depth = slab_optical_depth(slabs, plane.index);
    if (optical_depth > 0.0) {
        push_fragment(texel.y * tile.extent.x + texel.x, bounds, optical_depth);
    }
}
