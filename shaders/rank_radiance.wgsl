// Pass rank_radiance: the 99.9th percentile of radiance over a picture's lit pixels, of which at
// most 256 x 256 are looked at. One workgroup.

@group(0) @binding(29) var single: texture_2d<f32>;
@group(0) @binding(30) var<storage, read_write> bright: array<f32>;

// Radiance is counted in eighths of octaves, from 2^-32 to 2^32.
const BINS: u32 = 512u;
const PER_OCTAVE: f32 = 8.0;
const LOWEST: f32 = -32.0;
// Pixels looked at along each axis.
const LOOKS: u32 = 256u;
// The share of lit pixels that are brighter than the result.
const BRIGHTER: f32 = 0.001;
const THREADS: u32 = 256u;

var<workgroup> counts: array<atomic<u32>, BINS>;

@compute @workgroup_size(16, 16)
fn rank_radiance(@builtin(local_invocation_index) index: u32) {
    let size = textureDimensions(single);
    let spacing = (max(size.x, size.y) + LOOKS - 1u) / LOOKS;
    let looks = (size + vec2<u32>(spacing - 1u)) / spacing;
    for (var i = index; i < looks.x * looks.y; i += THREADS) {
        let place = spacing * vec2<u32>(i % looks.x, i / looks.x);
        let colour = textureLoad(single, place, 0).xyz;
        let most = max(max(colour.x, colour.y), colour.z);
        if (most > 0.0) {
            let bin = (log2(most) - LOWEST) * PER_OCTAVE;
            atomicAdd(&counts[u32(clamp(bin, 0.0, f32(BINS - 1u)))], 1u);
        }
    }
    workgroupBarrier();
    if (index != 0u) {
        return;
    }
    var lit = 0u;
    for (var bin = 0u; bin < BINS; bin++) {
        lit += atomicLoad(&counts[bin]);
    }
    let allowed = u32(BRIGHTER * f32(lit));
    var brighter = 0u;
    var bin = BINS;
    while (bin > 0u && lit > 0u) {
        brighter += atomicLoad(&counts[bin - 1u]);
        if (brighter > allowed) {
            break;
        }
        bin--;
    }
    bright[0] = select(0.0, exp2(f32(bin) / PER_OCTAVE + LOWEST), lit > 0u);
}
