//! Where a glTF document's bytes are: in the same file, in files beside it, or in its JSON. Knows
//! not what they mean.

use std::path::PathBuf;

use gltf::json::Root;

use super::input::Input;
use crate::error::Result;
use crate::error::memory;
use crate::io::base64;

/// The buffers of a document, read when they are asked for.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    /// The binary chunk, which is the first buffer if that has no URI.
    bin: Option<&'a [u8]>,
    read: Vec<Option<Vec<u8>>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(root: &'a Root, bin: Option<&'a [u8]>) -> Result<Self> {
        let nothing = root.buffers.iter().map(|_| None);
        Ok(Self { root, bin, read: memory::collected(nothing, "buffers")? })
    }

    /// The bytes of a buffer, as many as it says.
    pub(super) fn bytes(&mut self, input: &mut Input, index: usize) -> Result<&[u8]> {
        let count = self.read.len();
        let (Some(buffer), Some(read)) = (self.root.buffers.get(index), self.read.get_mut(index))
        else {
            return Err(input.bad(format!("buffer {index} of {count}")));
        };
        let bytes = match (&buffer.uri, self.bin) {
            (None, Some(bin)) if index == 0 => bin,
            (None, _) => return Err(input.bad(format!("buffer {index} has no bytes"))),
            (Some(uri), _) => {
                if read.is_none() {
                    *read = Some(bytes_of(input, index, uri)?);
                }
                read.as_deref().unwrap_or_default()
            }
        };
        let due = buffer.byte_length.0;
        let own = usize::try_from(due).ok().and_then(|due| bytes.get(..due));
        own.ok_or_else(|| {
            input.bad(format!("buffer {index} has {} bytes, expected {due}", bytes.len()))
        })
    }
}

/// The bytes that a URI holds or names.
fn bytes_of(input: &mut Input, index: usize, uri: &str) -> Result<Vec<u8>> {
    let Some(data) = uri.strip_prefix("data:") else {
        let file = file_of(input, uri)?;
        return input.whole(&file);
    };
    let Some((_, text)) = data.split_once(',').filter(|(kind, _)| kind.ends_with(";base64")) else {
        return Err(input.bad(format!("buffer {index} is data in its URI, but not in base64")));
    };
    input.take(text.len() as u64 / 4 * 3 + 3, "buffers")?;
    base64::decode(text.as_bytes()).map_err(|why| input.bad(format!("buffer {index}: {why}")))
}

/// The file that a URI names, beside the document.
pub(super) fn file_of(input: &Input, uri: &str) -> Result<PathBuf> {
    let is_scheme = |text: &str| {
        text.len() > 1 && text.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    };
    if uri.split_once(':').is_some_and(|(start, _)| is_scheme(start)) {
        return Err(input.bad(format!("its buffer '{uri}' is not a file beside it")));
    }
    let folder = input.path.parent().unwrap_or_else(|| "".as_ref());
    Ok(folder.join(decoded(uri)))
}

/// A URI with what its `%` stand for.
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, behind)) = rest.split_first() {
        let digits = behind.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        match digits.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(coded) if byte == b'%' => {
                bytes.push(coded);
                rest = &behind[2..];
            }
            _ => {
                bytes.push(byte);
                rest = behind;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
