//! Seeded random numbers: the same seed gives the same points on every machine.

use glam::DVec3;

/// xorshift64* (Marsaglia 2003; Vigna 2016), initialised with SplitMix64 so that every seed is
/// valid.
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    /// The random numbers of `seed` for the purpose `stream`; streams of one seed are independent.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut z = seed ^ stream.wrapping_mul(0xA076_1D64_78BD_642F);
        z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Self((z ^ (z >> 31)).max(1))
    }

    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    /// Uniform, 0 <= x < 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in the unit cube.
    pub(crate) fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// Uniform integer from 0 to `count` - 1; 0 if `count` is 0.
    pub(crate) fn below(&mut self, count: u64) -> u64 {
        // The bias of the product's upper half is below count / 2^64.
        ((u128::from(self.bits()) * u128::from(count)) >> 64) as u64
    }
}
