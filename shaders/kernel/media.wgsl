// Light that arrives at a camera ray, for every kind of media.
#import kernel/light
#import kernel/medium

// Unshadowed light that arrives at a point of a camera ray.
struct Arriving {
    // Irradiance on a plane that faces the light.
    irradiance: vec3<f32>,
    // Cosine of the angle between the directions of light before and after it scatters towards the
    // camera.
    cosine: f32,
    // Light that a plain medium scatters to the camera, per unit of optical depth and albedo.
    scattered: vec3<f32>,
}

fn arriving(ray: Ray, point: vec3<f32>) -> Arriving {
    let cosine = -dot(ray.direction, light_direction_at(point));
    let irradiance = irradiance_at(point);
    return Arriving(irradiance, cosine, irradiance * phase(frame.media.phase_g, cosine));
}

// Unshadowed light that arrives over the piece of a ray within `reach` of distance `at`. It is that
// at the piece's middle, except for a light among the media: its squared distance may change much
// over the piece, so its irradiance is a mean.
fn arriving_over(ray: Ray, at: f32, reach: f32) -> Arriving {
    let middle = ray_at(ray, at);
    if (frame.light.spread < 2u) {
        return arriving(ray, middle);
    }
    let cosine = -dot(ray.direction, light_direction_at(middle));
    let irradiance = irradiance_over(ray_at(ray, at - reach), middle, ray_at(ray, at + reach));
    return Arriving(irradiance, cosine, irradiance * phase(frame.media.phase_g, cosine));
}
