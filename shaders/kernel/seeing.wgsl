// Surfaces that a camera sees, and what each leaves in the pixels of a picture (src/cpu/raster_view.rs).
// The frame is that of the camera in the light's place.
#import kernel/seen
#import kernel/surfaces
#import kernel/view

const COUNTS_CELLS: bool = true;

fn point_of(i: u32) -> vec4<f32> {
    return point_look(i, 0u);
}

fn opacity_of(i: u32) -> f32 {
    return point_look(i, 1u).w;
}

fn corner_of(i: u32) -> vec4<f32> {
    return triangle_look(i / 3u, i % 3u);
}

// Which of a pixel's rays meet a triangle; `along` is 1 if the central one does.
fn meets(drawn: Drawn, texel: vec2<u32>) -> Left {
    let corner = vec2<f32>(texel);
    let sides = drawn.triangle.sides;
    let count = ray_count();
    var left: Left;
    for (var ray = 0u; ray < count; ray++) {
        if (triangle_holds(sides, corner + pixel_offset(ray, count))) {
            let bit = 1u << (ray & 31u);
            left.cells |= select(vec2<u32>(bit, 0u), vec2<u32>(0u, bit), ray > 31u);
        }
    }
    left.along = select(0.0, 1.0, triangle_holds(sides, corner + 0.5));
    left.exists = left.along > 0.0 || any(left.cells != vec2<u32>(0u));
    return left;
}

// Pushes a part, for which there is a place in the buffer, on a list of a pixel.
fn leave(at: u32, texel: vec2<u32>, drawn: Drawn, left: Left) {
    var part: SeenPart;
    var list = 2u * pixel_in_tile(texel);
    if (drawn.is_segment) {
        let alpha = alpha_of(left);
        part.depth = 0.5 * (left.front + left.back);
        if (!(alpha > 0.0 && part.depth >= 0.0)) {
            return;
        }
        let along = left.along / left.area;
        let first = drawn.segment & SEGMENT_POINT;
        let whole = min(u32(along), (segments[left.last] & SEGMENT_POINT) - first);
        part.what = first + whole;
        part.share = clamp(along - f32(whole), 0.0, 1.0);
        share_cells(&part, left, alpha);
    } else {
        list++;
        part.what = drawn.index - tile.segments;
        part.share = left.along;
        part.low_bits = left.cells.x;
        part.high_bits = left.cells.y;
    }
    if (at < tile.capacity) {
        part.next = atomicExchange(&heads[list], at + 1u);
        seen[at] = part;
    }
}

// The cells of a pixel that a part of a strand covers, and what it takes of each of them and of each
// of the others: together it takes what its area says. What is too thin to meet the cells' middles is
// spread over all.
fn share_cells(part: ptr<function, SeenPart>, left: Left, alpha: f32) {
    let met = f32(countOneBits(left.cells.x) + countOneBits(left.cells.y));
    if (2.0 * met < 64.0 * min(left.area, 1.0) || met == 0.0) {
        (*part).low_bits = 0xffffffffu;
        (*part).high_bits = 0xffffffffu;
        (*part).alpha = alpha;
        return;
    }
    let of_met = alpha * 64.0 / met;
    let rest = max(of_met - 1.0, 0.0) * met / max(64.0 - met, 1.0);
    (*part).low_bits = left.cells.x;
    (*part).high_bits = left.cells.y;
    (*part).alpha = min(of_met, 1.0);
    (*part).rest = min(rest, 1.0);
}
