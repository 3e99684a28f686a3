//! A tiny writer of OpenVDB bytes, for tests of what no library writes. It knows nothing of the
//! reader.

/// The bytes of a file in the making.
#[derive(Default)]
pub struct Bytes(pub Vec<u8>);

impl Bytes {
    pub fn put(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    pub fn u32(&mut self, value: u32) -> &mut Self {
        self.put(&value.to_le_bytes())
    }

    pub fn i64(&mut self, value: i64) -> &mut Self {
        self.put(&value.to_le_bytes())
    }

    pub fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32).put(text.as_bytes())
    }
}

/// A file of one grid with a tree 2-2-2: 4^3 slots or voxels in every node, 64 voxels an upper
/// branch's edge. It has one leaf at the origin unless there are root tiles only.
#[derive(Clone)]
pub struct OneGrid {
    pub version: u32,
    pub flags: u32,
    pub type_name: &'static str,
    /// The background's bytes, full width.
    pub background: Vec<u8>,
    /// Origin, value bytes and activity.
    pub root_tiles: Vec<([i32; 3], Vec<u8>, bool)>,
    /// The value block of the upper and of the lower branch, each with one child at slot 0 and an
    /// active tile at slot 1 (slot 1 is next along z).
    pub branch_blocks: Option<[Vec<u8>; 2]>,
    pub leaf_mask: u64,
    /// What follows the mask in the leaf's buffer.
    pub leaf_rest: Vec<u8>,
    /// Name of the map and what follows it.
    pub map: (&'static str, Vec<u8>),
}

impl OneGrid {
    /// An uncompressed float grid with the active mask, background 0.25; branches as code 0, whose
    /// tile at slot 1 is 7.
    pub fn float(leaf_mask: u64, leaf_rest: Vec<u8>) -> Self {
        let block = [&[0][..], &7.0_f32.to_le_bytes()].concat();
        let scale = numbers(&[1.0; 15]);
        Self {
            version: 224,
            flags: 2,
            type_name: "Tree_float_2_2_2",
            background: 0.25_f32.to_le_bytes().to_vec(),
            root_tiles: Vec::new(),
            branch_blocks: Some([block.clone(), block]),
            leaf_mask,
            leaf_rest,
            map: ("UniformScaleMap", scale),
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut file = file_header(self.version, true, 1);
        file.text("density").text(self.type_name).text("");
        let offsets = file.0.len();
        file.i64(0).i64(0).i64(0);
        let grid = file.0.len();
        file.u32(self.flags).u32(0);
        file.text(self.map.0).put(&self.map.1);
        file.u32(1).put(&self.background);
        file.u32(self.root_tiles.len() as u32).u32(u32::from(self.branch_blocks.is_some()));
        for (origin, value, active) in &self.root_tiles {
            for index in origin {
                file.put(&index.to_le_bytes());
            }
            file.put(value).put(&[u8::from(*active)]);
        }
        if let Some(blocks) = &self.branch_blocks {
            file.put(&[0; 12]);
            for block in blocks {
                file.i64(1).i64(2).put(block);
            }
            file.put(&self.leaf_mask.to_le_bytes());
        }
        let blocks = file.0.len();
        if self.branch_blocks.is_some() {
            file.put(&self.leaf_mask.to_le_bytes()).put(&self.leaf_rest);
        }
        let end = file.0.len();
        for (place, offset) in [grid, blocks, end].into_iter().enumerate() {
            let at = offsets + 8 * place;
            file.0[at..at + 8].copy_from_slice(&(offset as i64).to_le_bytes());
        }
        file.0
    }
}

/// A file's header with no metadata.
pub fn file_header(version: u32, has_offsets: bool, grids: u32) -> Bytes {
    let mut file = Bytes::default();
    file.i64(0x5644_4220).u32(version).u32(10).u32(0).put(&[u8::from(has_offsets)]);
    file.put(b"00000000-0000-0000-0000-000000000000").u32(0).u32(grids);
    file
}

/// A descriptor.
pub fn descriptor(file: &mut Bytes, name: &str, type_name: &str, parent: &str, offsets: [i64; 3]) {
    file.text(name).text(type_name).text(parent);
    for offset in offsets {
        file.i64(offset);
    }
}

/// A zlib stream in its frame.
pub fn zip_frame(bytes: &[u8]) -> Vec<u8> {
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(bytes, 6);
    [&(packed.len() as i64).to_le_bytes()[..], &packed].concat()
}

/// A raw run in the frame of a compressed one.
pub fn raw_frame(bytes: &[u8]) -> Vec<u8> {
    [&(-(bytes.len() as i64)).to_le_bytes()[..], bytes].concat()
}

/// Numbers as the file has them.
pub fn numbers(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
