//! Headers of deep files: windows, channels, attributes. Knows nothing of samples.

use super::attribute::Attribute;
use super::cursor::LONGEST_NAME;
use super::pack::Compression;
use crate::error::{Error, Result};

/// Attributes that are fields of [`DeepHeader`], or that follow from the samples.
pub(super) const OWN_ATTRIBUTES: [&str; 9] = [
    "channels",
    "chunkCount",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "maxSamplesPerPixel",
    "type",
    "version",
];

/// The number type of a channel's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelType {
    /// 32-bit integers, such as an object's number.
    Uint,
    /// 16-bit floating point.
    Half,
    /// 32-bit floating point.
    Float,
}

impl PixelType {
    /// The type's name, such as `half`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uint => "uint",
            Self::Half => "half",
            Self::Float => "float",
        }
    }

    /// Bytes per sample.
    pub fn size(self) -> usize {
        if self == Self::Half { 2 } else { 4 }
    }
}

/// A channel, such as Z.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The channel's name. These have a meaning here: `Z` and `ZBack` (distances where a sample
    /// begins and ends), `A` (opacity of the sample, 0..1) or `AR`, `AG`, `AB` (opacity per
    /// colour), and `R`, `G`, `B` (radiance, premultiplied by the sample's opacity).
    pub name: String,
    /// The number type of its samples.
    pub pixel_type: PixelType,
    /// `pLinear`: a hint for lossy compression, which deep files do not have.
    pub linear: bool,
}

impl Channel {
    /// A channel of 32-bit floating point.
    pub fn float(name: &str) -> Self {
        Self { name: name.to_owned(), pixel_type: PixelType::Float, linear: false }
    }

    /// A channel of 16-bit floating point.
    pub fn half(name: &str) -> Self {
        Self { pixel_type: PixelType::Half, ..Self::float(name) }
    }
}

/// A rectangle of pixels; y grows downwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Lowest x and y.
    pub min: [i32; 2],
    /// Highest x and y, inclusive.
    pub max: [i32; 2],
}

impl Window {
    /// The window of `width` x `height` pixels with its lowest corner at (0, 0).
    pub fn of_size([width, height]: [u32; 2]) -> Self {
        Self { min: [0; 2], max: [width, height].map(|n| n.wrapping_sub(1) as i32) }
    }

    /// Width and height in pixels; `None` if the window is empty or longer than [`i32::MAX`].
    pub fn size(&self) -> Option<[u32; 2]> {
        let length = |axis: usize| {
            let length = i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1;
            u32::try_from(length).ok().filter(|n| (1..=i32::MAX as u32).contains(n))
        };
        Some([length(0)?, length(1)?])
    }

    pub(super) fn from_box([x0, y0, x1, y1]: [i32; 4]) -> Self {
        Self { min: [x0, y0], max: [x1, y1] }
    }

    pub(super) fn attribute(&self) -> Attribute {
        Attribute::IntBox2([self.min[0], self.min[1], self.max[0], self.max[1]])
    }
}

/// The header of a deep image.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepHeader {
    /// The window of the pixels that are stored.
    pub data_window: Window,
    /// The window of the whole picture.
    pub display_window: Window,
    /// How the lines are packed.
    pub compression: Compression,
    /// The channels; in alphabetical order if read from a file, in any order for writing.
    pub channels: Vec<Channel>,
    /// All other attributes as (name, value).
    pub attributes: Vec<(String, Attribute)>,
}

impl DeepHeader {
    /// A header for an image of `size` (width, height) in pixels, packed with ZIPS.
    pub fn new(size: [u32; 2], channels: Vec<Channel>) -> Self {
        Self {
            data_window: Window::of_size(size),
            display_window: Window::of_size(size),
            compression: Compression::default(),
            channels,
            attributes: Vec::new(),
        }
    }

    /// The same header with one more attribute.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<Attribute>) -> Self {
        self.attributes.push((name.to_owned(), value.into()));
        self
    }

    /// The value of the attribute `name`.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value)
    }

    /// Index of the channel `name` in `channels`.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel.name == name)
    }

    /// Width and height in pixels.
    ///
    /// # Errors
    /// If the data window is empty or too large.
    pub fn size(&self) -> Result<[u32; 2]> {
        let Window { min, max } = self.data_window;
        let empty =
            || Error::value("data window", format!("{min:?} to {max:?} is empty or too large"));
        self.data_window.size().ok_or_else(empty)
    }

    /// Bytes of one sample over all channels.
    pub fn sample_bytes(&self) -> usize {
        self.channels.iter().map(|channel| channel.pixel_type.size()).sum()
    }

    /// Checks that a file can store all names.
    pub(super) fn check_names(&self) -> Result<()> {
        let attributes = self.attributes.iter().map(|(name, _)| name);
        let own = attributes.clone().find(|name| OWN_ATTRIBUTES.contains(&name.as_str()));
        if let Some(name) = own {
            return Err(Error::value(format!("attribute '{name}'"), "it is written automatically"));
        }
        let types = self.attributes.iter().map(|(_, value)| value.type_name());
        let channels = self.channels.iter().map(|channel| channel.name.as_str());
        for name in attributes.map(String::as_str).chain(types).chain(channels.clone()) {
            if name.is_empty() || name.len() > LONGEST_NAME || name.contains('\0') {
                let why = format!("a name must have 1 to {LONGEST_NAME} bytes and no zero byte");
                return Err(Error::value(format!("'{}'", name.escape_debug()), why));
            }
        }
        for names in [channels.collect(), self.attribute_names()] {
            let mut names: Vec<&str> = names;
            names.sort_unstable();
            if let Some([name, _]) = names.array_windows().find(|[one, other]| one == other) {
                return Err(Error::value(format!("'{name}'"), "it appears twice"));
            }
        }
        if self.channels.is_empty() {
            return Err(Error::value("channels", "there are none"));
        }
        Ok(())
    }

    fn attribute_names(&self) -> Vec<&str> {
        self.attributes.iter().map(|(name, _)| name.as_str()).collect()
    }
}
