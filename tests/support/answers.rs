//! What backends answer, and how far their answers may be apart. Every bound follows from how the
//! scene is drawn: rounding, the weights of texture units, the tolerance of fits.

use deepshadow::backend::Backend;
use deepshadow::progress::Silent;
use deepshadow::scene::Scene;
use deepshadow::settings::{Crossing, Lookup, MapKind, Settings};
use glam::Vec3;

use super::backends::Bent;
use super::{Random, rms};

/// Rounding in f32, of sums over some hundred steps and of where a jump over empty bricks ends,
/// which may be a step earlier or later and moves where lookups are.
const MAP_ROUNDING: Bound = Bound { largest: 2e-5, rms: 1e-6 };
const PICTURE_ROUNDING: Bound = Bound { largest: 1e-4, rms: 4e-6 };
/// Mixtures read means from tables of integrals, whose differences keep fewer digits.
const TABLES: f64 = 4.0;

/// Graphics hardware weighs voxels with 8 bits, which moves a sample by up to 1/512 of a voxel
/// along each axis.
const WEIGHT: f32 = 1.0 / 512.0;
/// The coarsest voxel of a tested mixture in voxels of its index space, which is as fine as the
/// finest.
const COARSEST: f32 = 2.0;

/// Two fits of a function lie within the tolerance of it, so within two of each other. Errors that
/// are spread evenly within the tolerance differ by the root of two thirds of it in the mean square.
const FIT_RMS: f64 = 0.82;

/// The share of places that may be anywhere where answers jump. The paper's lookup does where a
/// depth moves by one bit, and a bucket's depth moves by a whole step: one of three levels lies as
/// near to the end of one of some thirty steps as rounding (2e-5 of opacity) is large in one texel
/// of five hundred, as 8-bit weights (some 1e-3) in one of ten.
const JUMPS: [(Weights, f64); 2] = [(Weights::F32, 0.005), (Weights::EightBit, 0.1)];

/// How a backend's textures weigh voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weights {
    F32,
    EightBit,
}

/// How large differences may be, or are.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    pub largest: f64,
    pub rms: f64,
}

impl Bound {
    /// Of differences, without the share of them that is the largest.
    pub fn of(a: &[f64], b: &[f64], spared: f64) -> Self {
        let mut differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect();
        differences.sort_by(f64::total_cmp);
        let spared = (differences.len() as f64 * spared) as usize;
        let kept = &differences[..differences.len() - spared];
        Self { largest: kept.last().copied().unwrap(), rms: rms(kept.iter().copied()) }
    }

    fn plus(self, other: Self) -> Self {
        Self { largest: self.largest + other.largest, rms: self.rms + other.rms }
    }

    /// Of samples that may be as far off along each axis as these differences tell. Rounded weights
    /// are spread evenly within that, and those of one axis have nothing to do with another's.
    fn of_weights(along: [Self; 3]) -> Self {
        let largest = along.iter().map(|axis| axis.largest).sum();
        let squares: f64 = along.iter().map(|axis| axis.rms * axis.rms).sum();
        Self { largest, rms: (squares / 3.0).sqrt() }
    }

    fn or(self, other: Self) -> Self {
        Self { largest: self.largest.max(other.largest), rms: self.rms.max(other.rms) }
    }

    fn times(self, factor: f64) -> Self {
        Self { largest: self.largest * factor, rms: self.rms * factor }
    }

    /// Whether differences keep it; NaN does not.
    pub fn holds(self, found: Self) -> bool {
        found.largest <= self.largest && found.rms <= self.rms
    }
}

/// What a backend makes of a scene: transmittances at random places of the first light's map, and
/// the numbers of the picture.
pub struct Answers([Vec<f64>; 2]);

impl Answers {
    pub fn of(backend: &dyn Backend, scene: &Scene, settings: &Settings) -> Self {
        let beams = scene.beams().unwrap();
        let map = backend.map(&beams[0], settings, &Silent).unwrap();
        let farthest = map.view().position.map_or(2.0, |_| 4.0);
        let mut random = Random(7);
        let texels = map.texels().unwrap();
        let n = f64::from(texels.size());
        let transmittance = |_| {
            let (x, y) = ((random.unit() * n) as u32, (random.unit() * n) as u32);
            let depth = random.unit() as f32 * farthest;
            f64::from(texels.texel_transmittance(x, y, depth))
        };
        let lookups = (0..20_000).map(transmittance).collect();
        let image = backend.render(scene, settings, &Silent).unwrap();
        Self([lookups, image.pixels.iter().flatten().map(|&v| f64::from(v)).collect()])
    }

    /// The differences of maps and of pictures, without a share of the largest.
    pub fn differences(&self, other: &Self, spared: f64) -> [Bound; 2] {
        [0, 1].map(|i| Bound::of(&self.0[i], &other.0[i], spared))
    }
}

/// How far the numbers of a picture through a given map may be from the CPU's `own`, where `view` gives
/// those of a bent CPU.
#[cfg(feature = "gpu")]
pub fn picture_bound(own: &[f64], weights: Weights, view: impl Fn(&Bent) -> Vec<f64>) -> Bound {
    if weights == Weights::F32 {
        return PICTURE_ROUNDING;
    }
    let along = Vec3::AXES.map(|axis| {
        let moved = |by: Vec3| Bound::of(own, &view(&Bent::Moved(by)), 0.0);
        moved(WEIGHT * axis).or(moved(-WEIGHT * axis))
    });
    PICTURE_ROUNDING.plus(Bound::of_weights(along))
}

/// How far a backend's map and picture may be from those of the CPU, and which share of jumps is
/// spared.
pub fn bounds(
    scene: &Scene,
    settings: &Settings,
    cpu: &Answers,
    weights: Weights,
) -> ([Bound; 2], f64) {
    let jumps = settings.map.threshold.lookup == Lookup::Paper
        || settings.map.threshold.crossing == Crossing::Bucket;
    let spared = JUMPS.iter().find(|(one, _)| jumps && *one == weights).map_or(0.0, |(_, s)| *s);
    let mixed = scene.media.plain().is_none();
    let digits = if mixed { TABLES } else { 1.0 };
    let mut bounds = [MAP_ROUNDING, PICTURE_ROUNDING].map(|bound| bound.times(digits));
    if weights == Weights::EightBit {
        // What the CPU says where all samples are moved as far as that, to either side.
        let by = WEIGHT * if mixed { COARSEST } else { 1.0 };
        let along = Vec3::AXES.map(|axis| {
            let [up, down] = [axis, -axis].map(|axis| {
                let moved = Answers::of(&Bent::Moved(by * axis), scene, settings);
                cpu.differences(&moved, spared)
            });
            [0, 1].map(|i| up[i].or(down[i]))
        });
        bounds = [0, 1].map(|i| bounds[i].plus(Bound::of_weights(along.map(|axis| axis[i]))));
    }
    let tolerance = settings.map.fragments.tolerance;
    if settings.map.kind == Some(MapKind::Fragments) && tolerance > 0.0 {
        let fits = Bound { largest: 2.0 * tolerance, rms: FIT_RMS * tolerance };
        // A picture is linear in transmittance.
        let thresholds = settings.with(|s| s.map.kind = Some(MapKind::Threshold));
        let lit = Bent::Lit.render(scene, &thresholds, &Silent).unwrap();
        let lit: Vec<f64> = lit.pixels.iter().flatten().map(|&v| f64::from(v)).collect();
        let lit = Bound::of(&lit, &vec![0.0; lit.len()], 0.0);
        let seen = Bound { largest: fits.largest * lit.largest, rms: fits.rms * lit.rms };
        bounds = [bounds[0].plus(fits), bounds[1].plus(seen)];
    }
    (bounds, spared)
}
