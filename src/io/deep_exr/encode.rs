//! Encodes deep images as OpenEXR: one scanline part, lines from top to bottom. The same image
//! gives the same bytes, however many threads pack it.

use super::attribute::Attribute;
use super::header::{Channel, DeepHeader, PixelType};
use super::row::{DeepImage, DeepRow, Samples};
use super::slab::Slab;
use super::{DEEP_FLAG, LONG_NAMES_FLAG, MAGIC, VERSION};
use crate::error::memory;
use crate::error::{Error, ErrorKind, Result};
use crate::parallel;

/// Number of lines that are packed at a time, which bounds the memory for packed lines.
const BATCH: usize = 64;
/// A longer name requires the flag for long names.
const SHORT_NAME: usize = 31;

/// A packed line.
struct Chunk {
    counts: Vec<u8>,
    samples: Vec<u8>,
    unpacked_samples: u64,
    most_samples: u32,
}

/// Encodes a deep image whose lines are made one by one. `fill` receives the number of a line, 0 on
/// top, and an empty line; it pushes the samples of each pixel, front to back, and ends each pixel.
/// All threads of rayon's current pool make lines, in any order; only a few are in memory at a
/// time.
///
/// # Errors
/// If `fill` fails, if a line does not have the header's width, or if a file cannot store the
/// header.
pub fn encode(
    header: &DeepHeader,
    fill: impl Fn(u32, &mut DeepRow) -> Result<()> + Sync,
) -> Result<Vec<u8>> {
    assemble(header, |y| {
        let mut row = DeepRow::new(&header.channels);
        fill(y, &mut row)?;
        pack(header, &row)
    })
}

/// Encodes a deep image of slabs of fog with the float channels A, Z and ZBack. `slabs(x, y)`
/// returns the slabs of the pixel in column `x` of row `y`, by rising depth and without overlap.
/// The channels of `header` are replaced.
///
/// Opacity over a share x of a slab is 1 - (1 - A)^x, so that optical depth is linear in depth. A
/// slab of more than [`Slab::MOST_OPTICAL_DEPTH`] is written as several, because an opacity close
/// to 1 does not preserve its optical depth.
///
/// # Errors
/// If a depth is not finite, if a slab ends before it begins or begins before the one in front of
/// it ends (by more than rounding), or if an optical depth is negative. As [`encode`].
pub fn encode_slabs<I: IntoIterator<Item = Slab>>(
    header: &DeepHeader,
    slabs: impl Fn(u32, u32) -> I + Sync,
) -> Result<Vec<u8>> {
    let header = DeepHeader { channels: Slab::channels(), ..header.clone() };
    let [width, _] = header.size()?;
    encode(&header, |y, row| {
        for x in 0..width {
            let mut last = f32::NEG_INFINITY;
            for slab in slabs(x, y) {
                let slab = slab
                    .behind(last)
                    .map_err(|why| Error::value("deep image", format!("pixel {x}, {y}: {why}")))?;
                last = slab.back;
                for part in slab.parts() {
                    row.push(&[part.alpha(), part.front, part.back]);
                }
            }
            row.end_pixel();
        }
        Ok(())
    })
}

impl DeepImage {
    /// Encodes this image as a file.
    ///
    /// # Errors
    /// If a line does not have the header's width and channels, or if a file cannot store the
    /// header.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let due = self.header.size()?[1] as usize;
        if self.rows.len() != due {
            let why = format!("{} lines, but the data window has {due}", self.rows.len());
            return Err(Error::value("deep image", why));
        }
        assemble(&self.header, |y| pack(&self.header, &self.rows[y as usize]))
    }
}

/// Bytes before the packed counts of a line.
const CHUNK_HEAD: usize = 28;

/// Assembles a file from its packed lines.
fn assemble(header: &DeepHeader, chunk: impl Fn(u32) -> Result<Chunk> + Sync) -> Result<Vec<u8>> {
    header.check_names()?;
    let [_, height] = header.size()?;
    let mut bytes = Vec::new();
    let most_samples_at = write_header(header, height, &mut bytes)?;
    let table_at = bytes.len();
    bytes.resize(table_at + 8 * height as usize, 0);
    let mut most_samples = 0;
    let lines: Vec<u32> = (0..height).collect();
    for batch in lines.chunks(BATCH) {
        let chunks = parallel::map(batch, |&y| chunk(y));
        for (&y, chunk) in batch.iter().zip(chunks) {
            let chunk = chunk?;
            let length = CHUNK_HEAD + chunk.counts.len() + chunk.samples.len();
            memory::grow(&mut bytes, length, "a deep image")?;
            let offset = bytes.len() as u64;
            let entry = table_at + 8 * y as usize;
            bytes[entry..entry + 8].copy_from_slice(&offset.to_le_bytes());
            bytes.extend(header.data_window.min[1].wrapping_add_unsigned(y).to_le_bytes());
            bytes.extend((chunk.counts.len() as u64).to_le_bytes());
            bytes.extend((chunk.samples.len() as u64).to_le_bytes());
            bytes.extend(chunk.unpacked_samples.to_le_bytes());
            bytes.extend(chunk.counts);
            bytes.extend(chunk.samples);
            most_samples = most_samples.max(chunk.most_samples);
        }
    }
    bytes[most_samples_at..most_samples_at + 4].copy_from_slice(&most_samples.to_le_bytes());
    Ok(bytes)
}

/// Packs a line.
fn pack(header: &DeepHeader, row: &DeepRow) -> Result<Chunk> {
    let bad = |why: String| Error::value("deep image", why);
    let [width, _] = header.size()?;
    if row.width() != width as usize {
        return Err(bad(format!("a line of {} pixels, expected {width}", row.width())));
    }
    let count = row.sample_count();
    if i32::try_from(count).is_err() {
        let (needed, limit) = (format!("{count} samples"), format!("{} samples", i32::MAX));
        let what = "a line of a deep image".to_owned();
        return Err(ErrorKind::Limit { what, needed, limit }.into());
    }
    if !row.ends.is_sorted() {
        return Err(bad("the sample counts of a line decrease".to_owned()));
    }
    let fits = |(samples, channel): (&Samples, &Channel)| {
        samples.len() == count && samples.pixel_type() == channel.pixel_type
    };
    let pairs = row.channels.iter().zip(&header.channels);
    if row.channels.len() != header.channels.len() || !pairs.into_iter().all(fits) {
        return Err(bad("the samples of a line do not match the header's channels".to_owned()));
    }
    let mut samples = Vec::with_capacity(count * header.sample_bytes());
    for at in sorted(header) {
        row.channels[at].write(&mut samples);
    }
    let counts = row.ends.iter().flat_map(|end| end.to_le_bytes()).collect();
    let unpacked_samples = samples.len() as u64;
    let packed = |block| header.compression.pack(block).map_err(|error| bad(error.to_string()));
    Ok(Chunk {
        counts: packed(counts)?,
        samples: packed(samples)?,
        unpacked_samples,
        most_samples: row.counts().max().unwrap_or(0),
    })
}

/// Indices of the header's channels in the order of a file, which is alphabetical.
fn sorted(header: &DeepHeader) -> Vec<usize> {
    let mut order: Vec<usize> = (0..header.channels.len()).collect();
    order.sort_by_key(|&at| &header.channels[at].name);
    order
}

/// Writes everything in front of the table of offsets. Returns the position for the largest number
/// of samples.
fn write_header(header: &DeepHeader, height: u32, bytes: &mut Vec<u8>) -> Result<usize> {
    const MOST_SAMPLES: &str = "maxSamplesPerPixel";
    let other = |type_name: &str, bytes| Attribute::Other { type_name: type_name.into(), bytes };
    let mut attributes = vec![
        ("channels", other("chlist", channel_list(header))),
        ("chunkCount", Attribute::Int(height as i32)),
        ("compression", other("compression", vec![header.compression.code()])),
        ("dataWindow", header.data_window.attribute()),
        ("displayWindow", header.display_window.attribute()),
        ("lineOrder", other("lineOrder", vec![0])),
        (MOST_SAMPLES, Attribute::Int(0)),
        ("type", Attribute::from("deepscanline")),
        ("version", Attribute::Int(1)),
    ];
    attributes.extend(header.attributes.iter().map(|(name, value)| (&**name, value.clone())));
    let software = concat!("deepshadow ", env!("CARGO_PKG_VERSION"));
    for (name, value) in [
        ("name", Attribute::from("deep")),
        ("pixelAspectRatio", Attribute::Float(1.0)),
        ("screenWindowCenter", Attribute::FloatVec2([0.0; 2])),
        ("screenWindowWidth", Attribute::Float(1.0)),
        ("software", Attribute::from(software)),
    ] {
        if header.attribute(name).is_none() {
            attributes.push((name, value));
        }
    }
    attributes.sort_by_key(|&(name, _)| name);

    let channels = header.channels.iter().map(|channel| channel.name.as_str());
    let types = attributes.iter().map(|(_, value)| value.type_name());
    let mut names = attributes.iter().map(|&(name, _)| name).chain(types).chain(channels);
    let long = names.any(|name| name.len() > SHORT_NAME);
    let flags = DEEP_FLAG | if long { LONG_NAMES_FLAG } else { 0 };
    bytes.extend(MAGIC);
    bytes.extend((VERSION | flags).to_le_bytes());
    let mut most_samples_at = 0;
    for (name, value) in &attributes {
        let contents = value.bytes();
        let length = i32::try_from(contents.len())
            .map_err(|_| Error::value(format!("attribute '{name}'"), "more than 2 GiB"))?;
        bytes.extend(name.bytes().chain([0]));
        bytes.extend(value.type_name().bytes().chain([0]));
        bytes.extend(length.to_le_bytes());
        if *name == MOST_SAMPLES {
            most_samples_at = bytes.len();
        }
        bytes.extend(contents);
    }
    bytes.push(0);
    Ok(most_samples_at)
}

fn channel_list(header: &DeepHeader) -> Vec<u8> {
    let mut list = Vec::new();
    for at in sorted(header) {
        let channel = &header.channels[at];
        let code = match channel.pixel_type {
            PixelType::Uint => 0_i32,
            PixelType::Half => 1,
            PixelType::Float => 2,
        };
        list.extend(channel.name.bytes().chain([0]));
        list.extend(code.to_le_bytes());
        list.extend([u8::from(channel.linear), 0, 0, 0]);
        // The sampling: one for every pixel.
        list.extend([1_i32, 1].map(i32::to_le_bytes).concat());
    }
    list.push(0);
    list
}
