//! Parses headers of deep files from bytes that may hold anything. Knows nothing of samples.

use super::attribute::Attribute;
use super::cursor::Cursor;
use super::header::{Channel, DeepHeader, OWN_ATTRIBUTES, PixelType, Window};
use super::pack::Compression;
use super::{DEEP_FLAG, LONG_NAMES_FLAG, MAGIC, MULTIPART_FLAG, VERSION};

/// The largest number of parts that are examined.
const MOST_PARTS: usize = 1024;

/// Everything in front of the lines.
pub(super) struct Start {
    pub header: DeepHeader,
    /// In a multi-part file, the number with which the part's chunks begin.
    pub part: Option<i32>,
    /// Offset of the part's table of offsets.
    pub table_at: u64,
    /// Name and type of the parts that are not read.
    pub other_parts: Vec<String>,
}

/// All attributes of a part.
struct Part(Vec<(String, Attribute)>);

/// Reads the headers at the beginning of a file and selects the first part with deep scanlines.
pub(super) fn read_start(head: &[u8]) -> Result<Start, String> {
    let mut cursor = Cursor::new(head);
    if cursor.take(MAGIC.len())? != MAGIC {
        return Err("not an OpenEXR file".to_owned());
    }
    let version = cursor.i32()? as u32;
    if version & 0xff != VERSION {
        return Err(format!("OpenEXR version {}; only {VERSION} is supported", version & 0xff));
    }
    let unknown = version & !0xff & !(DEEP_FLAG | LONG_NAMES_FLAG | MULTIPART_FLAG);
    if version & DEEP_FLAG == 0 || unknown != 0 {
        return Err(format!("not deep, or of an unknown kind (flags {version:#x})"));
    }
    let multipart = version & MULTIPART_FLAG != 0;
    let mut parts = Vec::new();
    while let Some(part) = Part::read(&mut cursor)? {
        parts.push(part);
        if parts.len() > MOST_PARTS {
            return Err(format!("more than {MOST_PARTS} parts"));
        }
        if !multipart {
            break;
        }
    }
    let found = parts.iter().position(|part| part.type_name() == "deepscanline");
    let types: Vec<String> = parts.iter().map(Part::description).collect();
    let Some(found) = found else {
        return Err(format!(
            "no part with deep scanlines, but {} (deep tiles are not supported)",
            { if types.is_empty() { "nothing".to_owned() } else { types.join(", ") } }
        ));
    };
    let mut table_at = (head.len() - cursor.left()) as u64;
    for part in &parts[..found] {
        let chunks = part.chunk_count()?.ok_or("a part without the attribute chunkCount")?;
        table_at += 8 * u64::from(chunks);
    }
    let header = parts[found].header()?;
    let other_parts = types.into_iter().enumerate().filter(|(at, _)| *at != found);
    Ok(Start {
        header,
        part: multipart.then_some(found as i32),
        table_at,
        other_parts: other_parts.map(|(_, name)| name).collect(),
    })
}

impl Part {
    /// The next header; `None` at the empty one that ends the list.
    fn read(cursor: &mut Cursor) -> Result<Option<Self>, String> {
        let mut attributes = Vec::new();
        loop {
            let name = cursor.name()?;
            if name.is_empty() {
                return Ok(if attributes.is_empty() { None } else { Some(Self(attributes)) });
            }
            let type_name = cursor.name()?;
            let failed = |why| format!("attribute '{}': {why}", name.escape_debug());
            let length = cursor.i32().map_err(failed)?;
            let length = usize::try_from(length).map_err(|_| failed(format!("{length} bytes")))?;
            let value = Attribute::from_bytes(&type_name, cursor.take(length).map_err(failed)?);
            attributes.push((name, value));
        }
    }

    fn get(&self, name: &str) -> Option<&Attribute> {
        self.0.iter().find(|(key, _)| key == name).map(|(_, value)| value)
    }

    fn type_name(&self) -> &str {
        match self.get("type") {
            Some(Attribute::Text(name)) => name,
            _ => "",
        }
    }

    fn description(&self) -> String {
        let name = match self.get("name") {
            Some(Attribute::Text(name)) => name,
            _ => "",
        };
        let short = |text: &str| -> String { text.chars().take(60).collect() };
        format!("'{}' of type '{}'", short(name), short(self.type_name()))
    }

    fn chunk_count(&self) -> Result<Option<u32>, String> {
        match self.get("chunkCount") {
            None => Ok(None),
            Some(Attribute::Int(count)) if *count > 0 => Ok(Some(*count as u32)),
            Some(_) => Err("chunkCount is not a number above 0".to_owned()),
        }
    }

    fn window(&self, name: &str) -> Result<Window, String> {
        match self.get(name) {
            Some(&Attribute::IntBox2(corners)) => Ok(Window::from_box(corners)),
            _ => Err(format!("the attribute {name} is missing")),
        }
    }

    /// The bytes of an attribute that must have one of the format's own types.
    fn bytes(&self, name: &str, of_type: &str) -> Result<&[u8], String> {
        match self.get(name) {
            Some(Attribute::Other { type_name, bytes }) if type_name == of_type => Ok(bytes),
            _ => Err(format!("the attribute {name} of type {of_type} is missing")),
        }
    }

    /// The header of a part with deep scanlines.
    fn header(&self) -> Result<DeepHeader, String> {
        if let Some(version) = self.get("version")
            && *version != Attribute::Int(1)
        {
            return Err(format!("deep data version {version:?}; only version 1 is supported"));
        }
        let code = *self.bytes("compression", "compression")?.first().ok_or("no compression")?;
        let data_window = self.window("dataWindow")?;
        let Window { min, max } = data_window;
        let size = data_window
            .size()
            .ok_or(format!("data window {min:?} to {max:?} is empty or too large"))?;
        if let Some(count) = self.chunk_count()?
            && count != size[1]
        {
            return Err(format!("chunkCount is {count}, the data window has {} lines", size[1]));
        }
        let named = |(name, _): &&(String, Attribute)| !OWN_ATTRIBUTES.contains(&name.as_str());
        Ok(DeepHeader {
            data_window,
            display_window: self.window("displayWindow")?,
            compression: Compression::from_code(code)?,
            channels: read_channels(self.bytes("channels", "chlist")?)?,
            attributes: self.0.iter().filter(named).cloned().collect(),
        })
    }
}

fn read_channels(list: &[u8]) -> Result<Vec<Channel>, String> {
    let mut cursor = Cursor::new(list);
    let mut channels: Vec<Channel> = Vec::new();
    loop {
        let name = cursor.name()?;
        if name.is_empty() {
            break;
        }
        let pixel_type = match cursor.i32()? {
            0 => PixelType::Uint,
            1 => PixelType::Half,
            2 => PixelType::Float,
            code => {
                return Err(format!(
                    "channel '{}' has the unknown type {code}",
                    name.escape_debug()
                ));
            }
        };
        let [linear, ..] = cursor.array::<4>()?;
        let steps: [i32; 2] = cursor.each(Cursor::i32)?;
        if steps != [1, 1] {
            let name = name.escape_debug();
            return Err(format!(
                "channel '{name}' is sampled at every {steps:?}th pixel, expected every one"
            ));
        }
        if channels.last().is_some_and(|before| before.name >= name) {
            return Err(format!("channel '{}' is out of order", name.escape_debug()));
        }
        channels.push(Channel { name, pixel_type, linear: linear != 0 });
    }
    if channels.is_empty() { Err("it has no channels".to_owned()) } else { Ok(channels) }
}
