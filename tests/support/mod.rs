//! Shared by many tests: small scenes, seeded random numbers, error measures.

pub mod answers;
pub mod backends;
pub mod data;
pub mod scenes;

/// The project's folder, also if the tests run from an archive on another machine.
pub fn project() -> std::path::PathBuf {
    let folder = std::env::var("CARGO_MANIFEST_DIR");
    folder.as_deref().unwrap_or(env!("CARGO_MANIFEST_DIR")).into()
}

/// A file of `tests/fixtures`.
pub fn fixture(name: &str) -> std::path::PathBuf {
    project().join("tests/fixtures").join(name)
}

/// xorshift64*: seeded numbers for tests.
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Root mean square.
pub fn rms(errors: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) =
        errors.into_iter().fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}

/// A decoded PNG: pixels of 3 or 4 channels, row by row.
pub struct Picture {
    pub size: [u32; 2],
    pub channels: usize,
    pub bytes: Vec<u8>,
}

impl Picture {
    pub fn open(path: impl AsRef<std::path::Path>) -> Self {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!(info.bit_depth, png::BitDepth::Eight);
        let channels = info.color_type.samples();
        Self { size: [info.width, info.height], channels, bytes }
    }

    pub fn pixels(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes.chunks_exact(self.channels)
    }
}
