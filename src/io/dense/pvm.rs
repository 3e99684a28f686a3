//! The volumes of the Erlangen volume library (`.pvm`): a few lines of text and the voxels, with
//! or without the library's own compression around all of it.

use glam::{DMat4, DVec3};

use super::DenseHeader;
use super::input::Input;
use super::payload::Payload;
use super::pvm_stream::{self, Version};
use crate::error::{Result, memory};
use crate::io::number::{Endian, ValueType};

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let whole = input.whole()?;
    let packed = [(&b"DDS v3d\n"[..], Version::D), (b"DDS v3e\n", Version::E)];
    let found = packed.iter().find(|(mark, _)| whole.starts_with(mark));
    let mut bytes = match found {
        Some((mark, version)) => {
            pvm_stream::unpack(&whole[mark.len()..], *version, memory::count(input.max_bytes))
                .map_err(|why| input.bad(why))?
        }
        None => whole,
    };

    let mut at = 0;
    let mark = line(input, &bytes, &mut at)?;
    let spaced = match mark.as_str() {
        "PVM" => false,
        "PVM2" | "PVM3" => true,
        _ => return Err(input.bad(format!("'{mark}' is not one of PVM, PVM2, PVM3"))),
    };
    let mut metadata = Vec::new();
    let mut dims_line = line(input, &bytes, &mut at)?;
    while !spaced && dims_line.starts_with('#') {
        metadata.push(("comment".to_owned(), dims_line[1..].trim().to_owned()));
        dims_line = line(input, &bytes, &mut at)?;
    }
    let dims = input.dims(input.numbers::<i64, 3>("dims", &dims_line)?)?;
    let mut spacing = [1.0; 3];
    if spaced {
        spacing = input.numbers("spacing", &line(input, &bytes, &mut at)?)?;
    }
    let value_type = match line(input, &bytes, &mut at)?.trim() {
        "1" => ValueType::U8,
        "2" => ValueType::U16,
        other => return Err(input.bad(format!("{other} bytes per voxel, expected 1 or 2"))),
    };
    let mut header = DenseHeader::new(dims, value_type);
    header.endian = Endian::Big;
    header.world_from_index = DMat4::from_scale(DVec3::from(spacing));
    header.compression = if found.is_some() { "dds" } else { "none" };

    // PVM3 has four strings behind the voxels, each with a zero at its end.
    let voxels = usize::try_from(header.bytes()).unwrap_or(usize::MAX);
    let behind = at.checked_add(voxels).and_then(|end| bytes.get(end..)).unwrap_or_default();
    let names = ["description", "courtesy", "parameter", "comment"];
    for (name, text) in names.iter().zip(behind.split(|&byte| byte == 0)) {
        if mark == "PVM3" && !text.is_empty() {
            metadata.push(((*name).to_owned(), String::from_utf8_lossy(text).into_owned()));
        }
    }
    header.metadata = metadata;
    bytes.drain(..at);
    Ok((header, Payload::Unpacked(bytes)))
}

/// The next line of text, of at most a hundred bytes; only comments are longer.
fn line(input: &Input, bytes: &[u8], at: &mut usize) -> Result<String> {
    const LONGEST: usize = 4096;
    let rest = &bytes[*at..];
    let end = rest.iter().take(LONGEST).position(|&byte| byte == b'\n');
    let end = end.ok_or_else(|| input.bad(format!("its header has no line at byte {at}")))?;
    *at += end + 1;
    Ok(String::from_utf8_lossy(&rest[..end]).trim_end().to_owned())
}
