//! The random numbers of numpy's `default_rng(seed).standard_normal(dtype=float32)`, bit for bit,
//! so that the clouds equal those made in Python.
//!
//! Seeding: O'Neill's replacement of `seed_seq`, as numpy's `SeedSequence` uses it. Generator:
//! PCG64 XSL-RR (O'Neill 2014). Normals: the ziggurat of Marsaglia and Tsang (2000) with 256
//! strips.

/// A stream of standard normals.
pub(super) struct StandardNormal {
    state: u128,
    increment: u128,
    /// The unused upper half of the last 64 bits drawn.
    spare: Option<u32>,
    strips: Box<[Strip; 256]>,
}

/// One strip of the ziggurat.
#[derive(Clone, Copy, Default)]
struct Strip {
    /// A draw below this certainly lies under the curve.
    inside: u32,
    /// Width of a unit of the draw.
    width: f32,
    /// The curve at the strip's outer edge.
    height: f32,
}

const MULTIPLIER: u128 = 0x2360_ED05_1FC6_5DA4_4385_DF64_9FCC_F645;
/// Where the tail begins, and its inverse.
const TAIL: f64 = 3.654_152_885_361_009;
/// Area of each strip.
const AREA: f64 = 0.004_928_673_233_974_655;
const MANTISSA: f64 = 8_388_608.0;

impl StandardNormal {
    pub(super) fn seeded(seed: u32) -> Self {
        let words = seed_words(seed);
        let wide = |i: usize| u128::from(words[i]) << 64 | u128::from(words[i + 1]);
        let mut stream =
            Self { state: 0, increment: wide(2) << 1 | 1, spare: None, strips: Box::new(strips()) };
        stream.step();
        stream.state = stream.state.wrapping_add(wide(0));
        stream.step();
        stream
    }

    pub(super) fn next(&mut self) -> f32 {
        loop {
            let draw = self.next_u32();
            let index = (draw & 0xff) as usize;
            let magnitude = draw >> 9;
            let strip = self.strips[index];
            let x = magnitude as f32 * strip.width;
            let x = if draw >> 8 & 1 == 1 { -x } else { x };
            if magnitude < strip.inside {
                return x;
            }
            if index == 0 {
                return self.tail(magnitude);
            }
            let above = self.strips[index - 1].height - strip.height;
            // In numpy's precision: a single draw decided otherwise would shift all later ones.
            let height = f64::from(above * self.next_unit() + strip.height);
            if height < (-0.5 * f64::from(x) * f64::from(x)).exp() {
                return x;
            }
        }
    }

    fn tail(&mut self, magnitude: u32) -> f32 {
        loop {
            let xx = -(1.0 / TAIL) as f32 * (-self.next_unit()).ln_1p();
            let yy = -(-self.next_unit()).ln_1p();
            if yy + yy > xx * xx {
                let x = TAIL as f32 + xx;
                return if magnitude >> 8 & 1 == 1 { -x } else { x };
            }
        }
    }

    fn step(&mut self) {
        self.state = self.state.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
    }

    fn next_u32(&mut self) -> u32 {
        if let Some(upper) = self.spare.take() {
            return upper;
        }
        self.step();
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        let bits = folded.rotate_right((self.state >> 122) as u32);
        self.spare = Some((bits >> 32) as u32);
        bits as u32
    }

    /// Uniform in 0..1, 24 bits.
    fn next_unit(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 / 16_777_216.0
    }
}

/// Four 64-bit words from a small seed.
fn seed_words(seed: u32) -> [u64; 4] {
    let mut constant = 0x43b0_d7e5_u32;
    let mut hashed = |value: u32| {
        let value = value ^ constant;
        constant = constant.wrapping_mul(0x931e_8875);
        let value = value.wrapping_mul(constant);
        value ^ value >> 16
    };
    let mut pool = [seed, 0, 0, 0].map(&mut hashed);
    for from in 0..4 {
        for to in 0..4 {
            if from != to {
                let mixed = pool[to]
                    .wrapping_mul(0xca01_f9dd)
                    .wrapping_sub(hashed(pool[from]).wrapping_mul(0x4973_f715));
                pool[to] = mixed ^ mixed >> 16;
            }
        }
    }
    let mut constant = 0x8b51_f9dd_u32;
    let words: [u32; 8] = std::array::from_fn(|i| {
        let value = pool[i % 4] ^ constant;
        constant = constant.wrapping_mul(0x58f3_8ded);
        let value = value.wrapping_mul(constant);
        value ^ value >> 16
    });
    std::array::from_fn(|i| u64::from(words[2 * i + 1]) << 32 | u64::from(words[2 * i]))
}

fn strips() -> [Strip; 256] {
    let curve = |x: f64| (-0.5 * x * x).exp();
    let mut strips = [Strip::default(); 256];
    strips[0] = Strip {
        inside: (TAIL * curve(TAIL) / AREA * MANTISSA).round() as u32,
        width: (AREA / curve(TAIL) / MANTISSA) as f32,
        height: 1.0,
    };
    let mut outer = TAIL;
    strips[255].width = (outer / MANTISSA) as f32;
    strips[255].height = curve(outer) as f32;
    for i in (1..255).rev() {
        let x = (-2.0 * (AREA / outer + curve(outer)).ln()).sqrt();
        strips[i + 1].inside = (x / outer * MANTISSA).round() as u32;
        strips[i].width = (x / MANTISSA) as f32;
        strips[i].height = curve(x) as f32;
        outer = x;
    }
    strips
}

#[cfg(test)]
mod tests {
    use super::StandardNormal;

    /// Values from numpy 2, `default_rng(7).standard_normal(2**25, dtype=float32)`: the first five
    /// and the last one. A table strip that is off by one, or one comparison in another precision,
    /// would shift the rest.
    #[test]
    fn the_stream_is_numpys() {
        let mut normals = StandardNormal::seeded(7);
        let first: [f32; 5] = std::array::from_fn(|_| normals.next());
        assert_eq!(first, FIRST);
        let later = (5..1 << 25).map(|_| normals.next()).last();
        assert_eq!(later, Some(LAST));
    }

    const FIRST: [f32; 5] = [1.521_969_3, -1.144_105_8, 1.150_161_6, -1.784_653_2, -0.771_498_74];
    const LAST: f32 = -0.210_882_83;
}
