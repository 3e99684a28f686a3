// One picture's parameters: the same fields at the same places as `Frame` in src/frame.rs.

struct Frame {
    index_from_frame: array<vec4<f32>, 3>,
    domain_min: vec4<f32>,
    domain_max: vec4<f32>,
    voxel_share: vec4<f32>,
    brick_scale: vec4<f32>,
    brick_offset: vec4<f32>,
    rates: vec4<f32>,
    lengths: vec4<f32>,
    longest: vec4<f32>,
    limits: vec4<f32>,
    albedo: vec4<f32>,
    light_origin: vec4<f32>,
    light_origin_u: vec4<f32>,
    light_origin_v: vec4<f32>,
    light_direction: vec4<f32>,
    light_direction_u: vec4<f32>,
    light_direction_v: vec4<f32>,
    light_from_frame: array<vec4<f32>, 4>,
    light_position: vec4<f32>,
    light_axis: vec4<f32>,
    irradiance: vec4<f32>,
    ambient: vec4<f32>,
    view_origin: vec4<f32>,
    view_origin_x: vec4<f32>,
    view_origin_y: vec4<f32>,
    view_direction: vec4<f32>,
    view_direction_x: vec4<f32>,
    view_direction_y: vec4<f32>,
    ground: vec4<f32>,
    world_origin: vec4<f32>,
    background: vec4<f32>,
    thresholds: vec4<f32>,
    threshold_depths: vec4<f32>,
    slices: vec4<f32>,
    filtering: vec4<f32>,
    sizes: vec4<u32>,
    steps: vec4<u32>,
    methods: vec4<u32>,
    counts: vec4<u32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// True in pipelines for the usual settings alone (parallel light, bilinear filter, exact shadow tests,
// physical shading): the compiler leaves the rest out, and with fewer registers taken more threads run at once.
override USUAL: bool = false;
