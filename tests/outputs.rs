//! Pictures as files: what every format holds, and how the program chooses it.

use std::fs;
use std::io::Cursor;

use deepshadow::image::{Image, srgb_from_linear};
use deepshadow::io::{PictureFormat, PictureOptions};
use exr::prelude::read_first_flat_layer_from_file;

use super::cli::{Folder, must_succeed, stderr};
use super::support::Random;

/// A picture with radiance from 0 to 4, some of it behind other pixels' alpha.
fn picture(is_opaque: bool) -> Image {
    let mut random = Random(7);
    let mut image = Image::filled(37, 11, [0.0; 4]);
    for (at, pixel) in image.pixels.iter_mut().enumerate() {
        let alpha = if is_opaque || at % 3 == 0 { 1.0 } else { random.unit() as f32 };
        let [r, g, b] = [0; 3].map(|_| (4.0 * random.unit().powi(3)) as f32 * alpha);
        *pixel = [r, g, b, alpha];
    }
    image
}

fn encode(image: &Image, format: PictureFormat, bits: u32) -> Vec<u8> {
    let options = PictureOptions::new(format).with(|options| {
        (options.bits, options.tone) = (Some(bits), 0.5.into());
    });
    options.encode(image).unwrap()
}

/// Pixels for screens at exposure 0.5, each channel 0..1, with as many channels as are needed.
fn on_screen(image: &Image, channels: usize) -> Vec<f64> {
    let mut values = Vec::new();
    for &[r, g, b, a] in &image.pixels {
        let [r, g, b] = [r, g, b].map(|c| f64::from(srgb_from_linear(0.5 * c / a)));
        values.extend([r, g, b, a.into()].into_iter().take(channels));
    }
    values
}

fn assert_near(found: &[f64], expected: &[f64], bound: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (at, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() <= bound, "{what}, {at}: {found} for {expected}");
    }
}

/// The numbers in a PNG, 0..1, and how many a pixel has.
fn png_values(bytes: &[u8]) -> (Vec<f64>, usize) {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut buffer).unwrap();
    let values = match info.bit_depth {
        png::BitDepth::Sixteen => {
            let words = buffer.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]]));
            words.map(|word| f64::from(word) / 65535.0).collect()
        }
        _ => buffer.iter().map(|&byte| f64::from(byte) / 255.0).collect(),
    };
    (values, info.color_type.samples())
}

/// The numbers in a TIFF, integers as 0..1, and how many a pixel has.
fn tiff_values(bytes: &[u8]) -> (Vec<f64>, usize) {
    use tiff::decoder::{Decoder, DecodingResult};

    let mut decoder = Decoder::new(Cursor::new(bytes)).unwrap();
    let (width, height) = decoder.dimensions().unwrap();
    let values: Vec<f64> = match decoder.read_image().unwrap() {
        DecodingResult::U8(values) => values.iter().map(|&v| f64::from(v) / 255.0).collect(),
        DecodingResult::U16(values) => values.iter().map(|&v| f64::from(v) / 65535.0).collect(),
        DecodingResult::F32(values) => values.iter().map(|&v| v.into()).collect(),
        _ => panic!("another type of numbers"),
    };
    let channels = values.len() / (width * height) as usize;
    (values, channels)
}

/// Rounding errs by half a step; the curve's two evaluations in f32 differ by less than 1e-6.
fn half_a_step(bits: u32) -> f64 {
    0.5 / (f64::exp2(bits.into()) - 1.0) + 1e-6
}

#[test]
fn files_for_screens_hold_the_encoded_picture_with_straight_alpha_if_it_has_any() {
    for is_opaque in [true, false] {
        let image = picture(is_opaque);
        let channels = if is_opaque { 3 } else { 4 };
        let expected = on_screen(&image, channels);
        for bits in [8, 16] {
            let found = png_values(&encode(&image, PictureFormat::Png, bits));
            assert_eq!(found.1, channels);
            assert_near(&found.0, &expected, half_a_step(bits), "png");
            let found = tiff_values(&encode(&image, PictureFormat::Tiff, bits));
            assert_eq!(found.1, channels);
            assert_near(&found.0, &expected, half_a_step(bits), "tiff");
        }
        let bytes = encode(&image, PictureFormat::WebP, 8);
        let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes)).unwrap();
        assert_eq!((decoder.dimensions(), decoder.has_alpha()), ((37, 11), !is_opaque));
        let mut found = vec![0; decoder.output_buffer_size().unwrap()];
        decoder.read_image(&mut found).unwrap();
        let found: Vec<f64> = found.iter().map(|&byte| f64::from(byte) / 255.0).collect();
        assert_near(&found, &expected, half_a_step(8), "webp");
    }
}

#[test]
fn linear_files_hold_radiance_as_it_is() {
    let image = picture(false);
    let all: Vec<f64> = image.pixels.as_flattened().iter().map(|&v| v.into()).collect();
    let (found, channels) = tiff_values(&encode(&image, PictureFormat::Tiff, 32));
    assert_eq!((channels, &found), (4, &all));
    let npy = encode(&image, PictureFormat::Npy, 32);
    let (head, values) = npy.split_at(npy.len() - 4 * all.len());
    assert!(
        String::from_utf8_lossy(head)
            .contains("'<f4', 'fortran_order': False, 'shape': (11, 37, 4)")
    );
    assert_eq!(head.len() % 64, 0);
    let values: Vec<f64> =
        values.chunks_exact(4).map(|v| f32::from_le_bytes(v.try_into().unwrap()).into()).collect();
    assert_eq!(values, all);
    let folder = Folder::new();
    // Half floats have eleven significant bits, of which rounding errs by half of the last.
    for (bits, share) in [(32, 0.0), (16, 1.0 / 2048.0)] {
        let path = folder.path().join("x.exr");
        fs::write(&path, encode(&image, PictureFormat::Exr, bits)).unwrap();
        let layer = read_first_flat_layer_from_file(&path).unwrap().layer_data;
        for (channel, c) in layer.channel_data.list.iter().zip([3, 2, 1, 0]) {
            let values = channel.sample_data.values_as_f32();
            for (found, pixel) in values.zip(&image.pixels) {
                let bound = share * f64::from(pixel[c]) + share * 1e-4;
                assert!(f64::from(found - pixel[c]).abs() <= bound, "{found} for {}", pixel[c]);
            }
        }
    }
}

/// Radiance's runs are unpacked as its documentation of the format says.
#[test]
fn hdr_files_hold_radiance_in_front_of_black_to_eight_bits() {
    let mut image = picture(false);
    image.pixels[40..70].fill([0.5, 0.25, 0.125, 1.0]);
    let bytes = encode(&image, PictureFormat::Hdr, 32);
    let head = b"\n\n-Y 11 +X 37\n";
    let at = bytes.windows(head.len()).position(|window| window == head).unwrap();
    assert!(bytes.starts_with(b"#?RADIANCE\n"));
    let mut rest = bytes[at + head.len()..].iter().copied();
    for row in image.pixels.chunks(37) {
        let start: Vec<u8> = rest.by_ref().take(4).collect();
        assert_eq!(start, [2, 2, 0, 37]);
        let mut channels = [const { Vec::new() }; 4];
        for channel in &mut channels {
            while channel.len() < 37 {
                let count = rest.next().unwrap();
                if count > 128 {
                    let value = rest.next().unwrap();
                    channel.extend(std::iter::repeat_n(value, usize::from(count - 128)));
                } else {
                    channel.extend(rest.by_ref().take(count.into()));
                }
            }
        }
        for (x, pixel) in row.iter().enumerate() {
            let scale = f64::exp2(f64::from(channels[3][x]) - 136.0);
            let largest = f64::from(pixel[0].max(pixel[1]).max(pixel[2]));
            for c in 0..3 {
                let found = f64::from(channels[c][x]) * scale;
                assert!((found - f64::from(pixel[c])).abs() <= largest / 256.0, "{x}: {found}");
            }
        }
    }
    assert_eq!(rest.next(), None);
}

/// Blocks of one colour have only the mean among JPEG's coefficients, in steps of two eighths of a
/// level at this quality, so that what errs is the rounding of three channels to levels: half a
/// level each, with weights of at most 1, 1.772 and 0.714.
#[test]
fn jpeg_files_hold_the_encoded_picture_in_front_of_black() {
    let mut random = Random(3);
    let colours = [0; 12].map(|_| [0; 4].map(|_| random.unit() as f32));
    let mut image = Image::filled(32, 24, [0.0; 4]);
    for (at, pixel) in image.pixels.iter_mut().enumerate() {
        let [r, g, b, a] = colours[at / 32 / 8 * 4 + at % 32 / 8];
        *pixel = [r * a, g * a, b * a, a];
    }
    let bytes = encode(&image, PictureFormat::Jpeg, 8);
    let options = zune_jpeg::zune_core::options::DecoderOptions::default();
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let found: Vec<f64> = decoder.decode().unwrap().into_iter().map(f64::from).collect();
    let expected: Vec<f64> = image
        .pixels
        .iter()
        .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
        .map(|c| f64::from(srgb_from_linear(0.5 * c)) * 255.0)
        .collect();
    assert_near(&found, &expected, 0.5 + 0.5 * (1.0 + 1.772 + 0.714) + 0.25, "jpeg");
}

const SMALL: &str = "--backend cpu --size 24x18 --map-size 16 --quiet";

/// How files of each format begin.
const BEGINNINGS: [(&str, &[u8]); 9] = [
    ("png", b"\x89PNG"),
    ("jpg", b"\xff\xd8\xff"),
    ("JPEG", b"\xff\xd8\xff"),
    ("tif", b"II*\0"),
    ("TIFF", b"II*\0"),
    ("WebP", b"RIFF"),
    ("exr", b"\x76\x2f\x31\x01"),
    ("HDR", b"#?RADIANCE"),
    ("Npy", b"\x93NUMPY"),
];

#[test]
fn the_ending_or_the_option_selects_the_format() {
    let folder = Folder::new();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    for (ending, beginning) in BEGINNINGS {
        must_succeed(&folder.run(&format!("render box {SMALL} -o x.{ending}")));
        assert!(read(&format!("x.{ending}")).starts_with(beginning), "{ending}");
        let name = ending.to_lowercase();
        must_succeed(&folder.run(&format!("render box {SMALL} --format {name} -o odd.txt")));
        assert!(read("odd.txt") == read(&format!("x.{ending}")), "{ending}");
        let output = folder.run(&format!("render box {SMALL} --format {name} -o -"));
        must_succeed(&output);
        assert!(output.stdout == read("odd.txt"), "{ending}");
    }
    must_succeed(&folder.run(&format!("render box {SMALL} --format deep-exr -o x.exr")));
    must_succeed(&folder.run(&format!("render box {SMALL} -o x.Deep.EXR")));
    assert!(read("x.exr") == read("x.Deep.EXR"));
    let before = folder.names();
    must_succeed(&folder.run(&format!("render box {SMALL} --format jpg")));
    must_succeed(&folder.run(&format!("render box {SMALL} --format deep-exr")));
    let mut after = before;
    after.extend(["box.deep.exr", "box.jpg"].map(str::to_owned));
    after.sort();
    assert_eq!(folder.names(), after);
    // PNG is the default, as it is for files.
    let output = folder.run(&format!("render box {SMALL} -o -"));
    assert!(output.stdout == read("x.png"));
    let output = folder.run("render box --backend cpu --size 8x8 --map-size 8 -o -");
    assert!(stderr(&output).contains("wrote to standard output: 8x8"), "{}", stderr(&output));
}

#[test]
fn the_help_tells_every_format() {
    let output = Folder::new().run("render --help");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for ending in [".deep.exr", "--format", "--bits", "--deep-z"] {
        assert!(text.contains(ending), "{ending}: {text}");
    }
    for format in PictureFormat::ALL {
        assert!(text.contains(&format!(".{}", format.name())), "{format:?}: {text}");
    }
}

#[test]
fn contradicting_options_on_a_file_are_wrong_usage() {
    let folder = Folder::new();
    for (options, named) in [
        ("-o x.bmp", ".webp"),
        ("-o x", ".deep.exr"),
        ("-o .png", ".png"),
        ("-o x.jpg --bits 16", "bits"),
        ("-o x.png --bits 32", "bits"),
        ("-o x.deep.exr --bits 16", "bits"),
        ("-o x.png --bits 12", "12"),
        ("-o x.png --format gif", "gif"),
        ("-o x.jpg --transparent", "jpg has no alpha"),
        ("--format hdr --transparent", "hdr has no alpha"),
        ("-o x.exr --deep-z ray", "deep images only"),
        ("-o x.deep.exr --deep-z z", "planar, ray"),
        ("-o x.deep.exr --samples 4", "one ray per pixel"),
    ] {
        let output = folder.run(&format!("render box {SMALL} {options}"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{options}: {said}");
        assert!(said.contains(named) && said.lines().count() == 1, "{options}: {said}");
    }
    assert!(folder.names().is_empty());
}
