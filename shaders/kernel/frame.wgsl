// The parameters of one picture. Fields and offsets are those of src/frame/parts.rs, which
// documents them.

struct FrameMedia {
    index_from_frame: array<vec4<f32>, 3>,
    domain_min: vec3<f32>,
    extinction: f32,
    domain_max: vec3<f32>,
    largest: f32,
    voxel_share: vec3<f32>,
    most_voxels: f32,
    brick_scale: vec3<f32>,
    stored_one: f32,
    brick_offset: vec3<f32>,
    emits: u32,
    albedo: vec3<f32>,
    phase_g: f32,
    ratios: vec3<f32>,
    coloured: u32,
}

struct FrameLight {
    origin: vec4<f32>,
    origin_u: vec4<f32>,
    origin_v: vec4<f32>,
    direction: vec4<f32>,
    direction_u: vec4<f32>,
    direction_v: vec4<f32>,
    from_frame: array<vec4<f32>, 4>,
    position: vec3<f32>,
    spread: u32,
    axis: vec3<f32>,
    cone_inner: f32,
    irradiance: vec3<f32>,
    cone_outer: f32,
}

struct Marching {
    per_voxel: f32,
    rough: f32,
    longest: f32,
    limit: f32,
    least: u32,
    most: u32,
    hiding: f32,
    samples: f32,
}

struct FrameGround {
    height: f32,
    albedo: f32,
    half_extent: f32,
    exists: u32,
}

struct FrameView {
    origin: vec4<f32>,
    origin_x: vec4<f32>,
    origin_y: vec4<f32>,
    direction: vec4<f32>,
    direction_x: vec4<f32>,
    direction_y: vec4<f32>,
    world_origin: vec3<f32>,
    per_world: f32,
    ambient: vec3<f32>,
    octaves: u32,
    background: vec4<f32>,
    ground: FrameGround,
    width: u32,
    height: u32,
    samples: u32,
    shading: u32,
    light_samples: u32,
    opaque: f32,
    shared_weight: f32,
    shared_length: f32,
    tolerance: f32,
    spacing: u32,
    first_row: u32,
    unused: u32,
    march: Marching,
}

struct FrameMap {
    rays: Marching,
    slabs: Marching,
    thresholds: vec3<f32>,
    sharpness: f32,
    threshold_depths: vec3<f32>,
    surface_reach: f32,
    size: u32,
    crossing: u32,
    lookup: u32,
    window: u32,
    near: f32,
    far: f32,
    tolerance: f32,
    truncation: f32,
    planes: u32,
    follows_links: u32,
    bias: f32,
    covers: u32,
}

struct Frame {
    media: FrameMedia,
    light: FrameLight,
    view: FrameView,
    map: FrameMap,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// True in pipelines for the usual settings only: parallel light, bilinear filter, exact shadow
// tests, physical shading. The compiler then drops all other code, which takes fewer registers, so
// that more threads run at once.
override USUAL: bool = false;
// Whether the channels differ in extinction.
override COLOURED: bool = false;
// Whether wide filters follow links between the lists of neighbouring texels.
override LINKED: bool = false;
