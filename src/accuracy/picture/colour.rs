//! The colour spaces of FLIP, in f64.

/// From linear RGB with sRGB's primaries to XYZ, with the exact ratios in the paper's own code.
const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.241_003_232_976_359, -1.537_398_969_488_785_6, -0.498_615_881_996_363],
    [-0.969_224_252_202_516_5, 1.875_929_983_695_176, 0.041_554_226_340_084_724],
    [0.055_639_419_851_975_46, -0.204_011_206_123_91, 1.057_148_977_187_533],
];

fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ relative to that of white.
fn relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (times(&XYZ_FROM_RGB, rgb), times(&XYZ_FROM_RGB, [1.0; 3]));
    [xyz[0] / white[0], xyz[1] / white[1], xyz[2] / white[2]]
}

/// Y, Cx, Cz: linear opponent channels.
pub(super) fn opponent_from_linear(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`opponent_from_linear`].
pub(super) fn linear_from_opponent([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let relative = [cx / 500.0 + y, y, y - cz / 200.0];
    let white = times(&XYZ_FROM_RGB, [1.0; 3]);
    times(&RGB_FROM_XYZ, [0, 1, 2].map(|i| relative[i] * white[i]))
}

/// L*, a*, b* (CIE 1976) with Hunt's adjustment: dark colours look less colourful.
pub(super) fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    let knee: f64 = 6.0 / 29.0;
    let curve = |t: f64| {
        if t > knee.powi(3) { t.cbrt() } else { t / (3.0 * knee * knee) + 4.0 / 29.0 }
    };
    let [x, y, z] = relative_xyz(rgb).map(curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opponent_channels_lead_back_to_where_they_came_from() {
        for rgb in [[0.0; 3], [1.0; 3], [0.25, 0.5, 0.75], [1.0, 0.0, 0.3]] {
            let back = linear_from_opponent(opponent_from_linear(rgb));
            for (a, b) in rgb.iter().zip(back) {
                assert!((a - b).abs() < 1e-9, "{rgb:?} became {back:?}");
            }
        }
        let [l, a, b] = hunt_lab([1.0; 3]);
        assert!((l - 100.0).abs() < 1e-9 && a.abs() < 1e-9 && b.abs() < 1e-9, "white");
    }
}
