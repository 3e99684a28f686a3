// In the place of kernel/pieces where there are no surfaces.

fn begin_pieces(texel: u32) {}

fn add_between(front: f32, back: f32, optical_depth: f32) {
    add_fragment(front, back, optical_depth, true);
}

fn add_rest() {}
