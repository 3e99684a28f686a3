// In the place of kernel/layers where there are no surfaces.

const AMONG_SURFACES: bool = false;

struct SeenPixel {
    exists: bool,
    colour: vec4<f32>,
}

fn lit_among_layers(
    ray: Ray,
    steps: Steps,
    lookups: Ray,
    arrives: Arriving,
    batch: Batch,
    added: Scattered,
    through: f32,
    emission: vec3<f32>,
) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn pixel_of_surfaces(place: vec2<u32>, samples: u32) -> SeenPixel {
    return SeenPixel(false, vec4<f32>(0.0));
}
