// From linear radiance to what a screen shows: exposure, a tone curve, and sRGB's transfer curve.
// `src/image/tone.rs` says who published the curves.

// The numbers of the curves, in the order of `ToneMap::ALL`.
const ACES: u32 = 1u;
const AGX: u32 = 2u;
const KHRONOS_NEUTRAL: u32 = 3u;

fn aces(color: vec3<f32>) -> vec3<f32> {
    let v = min(
        vec3<f32>(
            dot(vec3<f32>(0.59719, 0.35458, 0.04823), color),
            dot(vec3<f32>(0.07600, 0.90834, 0.01566), color),
            dot(vec3<f32>(0.02840, 0.13383, 0.83777), color),
        ),
        vec3<f32>(1e9),
    );
    let fit = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    return saturate(vec3<f32>(
        dot(vec3<f32>(1.60475, -0.53108, -0.07367), fit),
        dot(vec3<f32>(-0.10208, 1.10813, -0.00605), fit),
        dot(vec3<f32>(-0.00327, -0.07276, 1.07602), fit),
    ));
}

fn agx(color: vec3<f32>) -> vec3<f32> {
    let rec2020 = vec3<f32>(
        dot(vec3<f32>(0.6274, 0.3293, 0.0433), color),
        dot(vec3<f32>(0.0691, 0.9195, 0.0113), color),
        dot(vec3<f32>(0.0164, 0.0880, 0.8956), color),
    );
    let inset = vec3<f32>(
        dot(vec3<f32>(0.85662715, 0.09512124, 0.048251606), rec2020),
        dot(vec3<f32>(0.13731897, 0.761242, 0.10143904), rec2020),
        dot(vec3<f32>(0.111898210, 0.07679942, 0.8113024), rec2020),
    );
    let stops = log2(max(inset, vec3<f32>(1e-10)));
    let x = saturate((stops + 12.47393) / (4.026069 + 12.47393));
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2
        + 0.1191 * x - 0.00232;
    let outset = vec3<f32>(
        dot(vec3<f32>(1.1271006, -0.11060664, -0.016493939), curve),
        dot(vec3<f32>(-0.14132976, 1.1578237, -0.016493939), curve),
        dot(vec3<f32>(-0.14132976, -0.11060664, 1.2519364), curve),
    );
    let display = pow(max(outset, vec3<f32>()), vec3<f32>(2.2));
    return saturate(vec3<f32>(
        dot(vec3<f32>(1.6605, -0.5876, -0.0728), display),
        dot(vec3<f32>(-0.1246, 1.1329, -0.0083), display),
        dot(vec3<f32>(-0.0182, -0.1006, 1.1187), display),
    ));
}

fn khronos_neutral(color: vec3<f32>) -> vec3<f32> {
    let least = min(color.x, min(color.y, color.z));
    let offset = select(0.04, least - least * least / 0.16, least <= 0.08);
    let lower = color - offset;
    let peak = max(lower.x, max(lower.y, lower.z));
    if peak <= 0.76 {
        return lower;
    }
    let room = 1.0 - 0.76;
    let new_peak = 1.0 - room * room / (peak + room - 0.76);
    let kept = 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return min(mix(lower * (new_peak / peak), vec3<f32>(new_peak), 1.0 - kept), vec3<f32>(1.0));
}

// The colour on a screen, linear, of a colour that is not premultiplied. `curve` is the number of
// the tone curve.
fn shown(color: vec3<f32>, exposure: f32, curve: u32) -> vec3<f32> {
    let exposed = color * exposure;
    // NaN counts as 0.
    let whole = select(vec3<f32>(), min(exposed, vec3<f32>(1e30)), exposed > vec3<f32>());
    switch curve {
        case ACES: { return aces(whole); }
        case AGX: { return agx(whole); }
        case KHRONOS_NEUTRAL: { return khronos_neutral(whole); }
        default: { return exposed; }
    }
}

fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let c = select(vec3<f32>(), min(linear, vec3<f32>(1.0)), linear > vec3<f32>());
    let curved = 1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curved, c * 12.92, c <= vec3<f32>(0.0031308));
}
