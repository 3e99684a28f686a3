// Media that are one volume whose extinction is its density times a constant. They are sampled in
// texture coordinates, so `ray` is in texture coordinates too; a piece of it extends by `reach`
// before and behind the distance `at`.
#import density
#import kernel/media
#import kernel/ray

const MIXED: bool = false;

// A ray in voxel indices, in the space that media are sampled in.
fn media_ray_of(ray: Ray) -> Ray {
    let share = frame.media.voxel_share;
    return Ray(ray.origin * share + 0.5 * share, ray.direction * share);
}

// Mean density over a piece of a ray.
fn density_along(ray: Ray, at: f32, reach: f32) -> f32 {
    return sample_density(ray_at(ray, at));
}

// The same over four pieces; their samples are fetched at once.
fn four_along(ray: Ray, at: vec4<f32>, reach: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(
        sample_density(ray_at(ray, at.x)),
        sample_density(ray_at(ray, at.y)),
        sample_density(ray_at(ray, at.z)),
        sample_density(ray_at(ray, at.w)),
    );
}

// Radiance that a piece of a ray scatters towards the camera per unit of opacity, where the given
// transmittance of the light arrives.
fn source_along(ray: Ray, at: f32, reach: f32, light: Arriving, transmittance: f32) -> vec3<f32> {
    var lit: vec3<f32>;
    if (USUAL || frame.view.octaves == 0u) {
        lit = light.scattered * transmittance;
    } else {
        let more = frame.view.octaves;
        lit = light.irradiance * octaves(more, frame.media.phase_g, light.cosine, transmittance);
    }
    return frame.media.albedo * (lit + frame.view.ambient);
}

// Radiance that a piece of a ray emits per world length.
fn emission_along(ray: Ray, at: f32, reach: f32) -> vec3<f32> {
    return vec3<f32>(0.0);
}
