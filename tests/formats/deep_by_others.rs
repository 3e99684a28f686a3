//! Deep images of the OpenEXR library, `tests/fixtures/make_dense.py`, hold what its formulas say.

use deepshadow::io::deep_exr::{Compression, DeepFile, DeepImage, DeepStatistics, PixelType};

use crate::support::fixture;

pub const FILES: [(&str, Compression); 3] = [
    ("deep/none.exr", Compression::None),
    ("deep/rle.exr", Compression::Rle),
    ("deep/zips.exr", Compression::Zips),
];

/// Samples of a pixel.
fn count(x: usize, y: usize) -> usize {
    (x + 2 * y) % 4
}

/// Sample `k` of a pixel: A, Z, ZBack, id.
fn sample(x: usize, y: usize, k: usize) -> [f32; 4] {
    let front = 1.0 + x as f32 + 0.5 * k as f32;
    let id = (1_000_000 * y + 1000 * x + k) as f32;
    [(k + 1) as f32 / 8.0, front, front + 0.25, id]
}

fn check(image: &DeepImage, name: &str) {
    let channels: Vec<_> =
        image.header.channels.iter().map(|c| (c.name.as_str(), c.pixel_type)).collect();
    let due = [
        ("A", PixelType::Half),
        ("Z", PixelType::Float),
        ("ZBack", PixelType::Float),
        ("id", PixelType::Uint),
    ];
    assert_eq!(channels, due, "{name}");
    let flat = image.flatten().unwrap();
    for (y, row) in image.rows.iter().enumerate() {
        for x in 0..6 {
            let mut clear = 1.0;
            assert_eq!(row.pixel(x).len(), count(x, y), "{name} at {x}, {y}");
            for (k, at) in row.pixel(x).enumerate() {
                let found = [0, 1, 2, 3].map(|channel| row.channels[channel].get(at).unwrap());
                assert_eq!(found, sample(x, y, k), "{name}, sample {k} of {x}, {y}");
                clear *= 1.0 - found[0];
            }
            // Eighths: nothing is rounded.
            assert_eq!(flat.pixel(x as u32, y as u32)[3], 1.0 - clear, "{name} at {x}, {y}");
        }
    }
}

#[test]
fn deep_images_of_the_openexr_library_hold_their_formulas() {
    for (name, compression) in FILES {
        let mut file = DeepFile::open(fixture(name), 1 << 20).unwrap();
        assert_eq!((file.size(), file.header().compression), ([6, 5], compression), "{name}");
        let image = file.read().unwrap();
        assert_eq!(image.rows.len(), 5);
        check(&image, name);
        let DeepStatistics { pixels, empty_pixels, samples, fewest, most, depth, .. } =
            file.statistics().unwrap();
        // Even lines have 0, 1, 2, 3, 0, 1 samples, odd lines 2, 3, 0, 1, 2, 3.
        assert_eq!((pixels, empty_pixels, samples), (30, 3 * 2 + 2, 3 * 7 + 2 * 11));
        assert_eq!((fewest, most), (0, 3), "{name}");
        // From the first pixel of an odd line to the back of the third sample of its last one.
        assert_eq!(depth, Some([1.0, 7.25]), "{name}");
        let again = DeepFile::from_bytes("again", image.encode().unwrap(), 1 << 20);
        check(&again.unwrap().read().unwrap(), name);
    }
}
