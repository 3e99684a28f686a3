// Light that arrives at a camera ray, for every kind of media.
#import kernel/light
#import kernel/medium

// Light that arrives at a point of a camera ray where nothing shadows it.
struct Arriving {
    // On a plane that faces the light.
    irradiance: vec3<f32>,
    // Between the ways of light before and after it is scattered to the camera.
    cosine: f32,
    // Scattered to the camera by a plain medium, per unit of optical depth and albedo.
    scattered: vec3<f32>,
}

fn arriving(ray: Ray, point: vec3<f32>) -> Arriving {
    let cosine = -dot(ray.direction, light_direction_at(point));
    let irradiance = irradiance_at(point);
    return Arriving(irradiance, cosine, irradiance * phase(frame.media.phase_g, cosine));
}

// Light that arrives over a piece of a ray, around a place and of half a length: that of its
// middle, but of a light that stands among the media, whose square of the distance may change by
// much over a piece.
fn arriving_over(ray: Ray, at: f32, reach: f32) -> Arriving {
    let middle = ray_at(ray, at);
    if (frame.light.spread < 2u) {
        return arriving(ray, middle);
    }
    let cosine = -dot(ray.direction, light_direction_at(middle));
    let irradiance = irradiance_over(ray_at(ray, at - reach), middle, ray_at(ray, at + reach));
    return Arriving(irradiance, cosine, irradiance * phase(frame.media.phase_g, cosine));
}
