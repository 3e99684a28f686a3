// Pass march_view: marches from the camera through the volume, lights each step through the shadow
// map, and continues to the ground or the background. One thread per pixel.
#import kernel/march

@group(0) @binding(4) var output: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn march_view(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = vec2<u32>(id.x, id.y + frame.view.first_row);
    if (place.x >= frame.view.width || place.y >= frame.view.height || !is_in_part(id.y)) {
        return;
    }
    textureStore(output, place, pixel(place, frame.view.samples));
}
