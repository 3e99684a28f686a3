// In the place of kernel/layers where there are no surfaces.

const AMONG_SURFACES: bool = false;

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

fn with_layers(scattered: vec4<f32>, ray: Ray, ground: f32) -> vec4<f32> {
    return scattered;
}

fn rays_of(place: vec2<u32>, samples: u32) -> PixelRays {
    return PixelRays(false, samples, 0u, 0u);
}

fn layers_of(pixel: PixelRays, i: u32, ray: Ray, farthest: f32) -> vec2<f32> {
    return vec2<f32>(farthest, 1.0);
}

fn is_in_part(row: u32) -> bool {
    return true;
}

fn is_complete(place: vec2<u32>) -> bool {
    return false;
}
