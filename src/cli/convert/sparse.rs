//! Conversions from and to OpenVDB, whose grids stay sparse as long as possible.

use std::collections::BTreeMap;

use glam::{DMat4, IVec3};

use super::{Converted, Job};
use crate::error::{Error, ErrorKind, Result};
use crate::io::dense::{DenseFile, DenseGrid, PackedGrid, Space};
use crate::io::fog;
use crate::io::number::ValueType as Number;
use crate::io::output::{PendingFile, commit};
use crate::io::vdb::{
    Compression, Grid, GridHeader, IndexBox, MetaValue, Metadata, NewGrid, SurveyDepth, Transform,
    ValueType, VdbFile, VdbWriter,
};

/// Metadata that other fields of a dense grid hold, or that describe the input file.
const UNDERSTOOD: [&str; 4] = ["name", "class", "is_saved_as_half_float", SPACE];

/// The metadata key for the coordinate system of a grid's world, by NRRD's name.
const SPACE: &str = "space";

/// The name in OpenVDB files of a grid without a name, which programs look for.
const DENSITY: &str = "density";

impl Job<'_> {
    pub(super) fn vdb_to_vdb(
        &self,
        file: &VdbFile,
        output: PendingFile,
        compression: Compression,
    ) -> Result<Converted> {
        let chosen = self.chosen_grids(file)?;
        let headers: Vec<&GridHeader> = chosen.iter().map(|&index| &file.grids()[index]).collect();
        let names: Vec<&str> = headers.iter().map(|header| header.name.as_str()).collect();
        let mut writer = VdbWriter::new(&names, compression, file.metadata());
        self.progress.begin("convert", 2 * chosen.len() as u64);
        for (at, (&index, header)) in chosen.iter().zip(&headers).enumerate() {
            let parent = header
                .instance_of
                .as_ref()
                .and_then(|name| headers[..at].iter().position(|other| other.unique_name == *name));
            // Resampling also changes the transform.
            if let (Some(parent), None) = (parent, self.wanted.resample) {
                writer.add_instance(header, parent)?;
                self.progress.advance(2);
                continue;
            }
            let grid = self.sparsely_edited(self.loaded(file, index)?);
            let (grid, place) = self.sparsely_resampled(grid, file, header)?;
            let grid = self.retyped(grid)?;
            self.progress.advance(1);
            let mut new = NewGrid::like(header, grid);
            if let Some(place) = place {
                new = new.placed(&place);
            }
            let half = self.half(header.saved_as_half);
            writer.add(new.with_half(half))?;
            self.progress.advance(1);
        }
        let count = chosen.len();
        let grids = if count == 1 { "grid" } else { "grids" };
        self.vdb_file(writer, output, &format!("{count} {grids}, {compression}"))
    }

    pub(super) fn dense_to_vdb(
        &self,
        grid: DenseGrid,
        output: PendingFile,
        compression: Compression,
    ) -> Result<Converted> {
        let known = grid.without_bytes();
        let sparse = grid.active.is_some() || grid.background.is_some();
        self.note_numbers(&known);
        let grid = self.retyped(grid.into_vdb()?)?;
        self.progress.advance(1);
        let count = grid.active_voxel_count();
        let half = self.half(known.value_type == Number::F16);
        let new = NewGrid::new(grid, &known.world_from_index).with_half(half);
        let mut writer = vdb_writer(&known, compression);
        writer.add(described(new, &known))?;
        self.progress.advance(1);
        self.written(writer, output, &known, sparse.then_some(count), compression)
    }

    /// Packs a file's voxels into leaves as they are read, if no operation is requested.
    pub(super) fn packed_vdb(
        &self,
        file: &DenseFile,
        compression: Compression,
    ) -> Result<Option<(DenseGrid, PackedGrid)>> {
        if self.wanted.is_nothing() { file.packed_vdb(compression) } else { Ok(None) }
    }

    /// Like [`Self::dense_to_vdb`], for voxels that are already in leaves.
    pub(super) fn streamed_to_vdb(
        &self,
        (known, packed): (DenseGrid, PackedGrid),
        output: PendingFile,
        compression: Compression,
    ) -> Result<Converted> {
        self.note_numbers(&known);
        self.progress.advance(2);
        let count = known.background.is_some().then(|| packed.active_voxel_count());
        let new = described(NewGrid::described(&known.world_from_index), &known);
        let mut writer = vdb_writer(&known, compression);
        packed.write(&mut writer, new)?;
        self.progress.advance(1);
        self.written(writer, output, &known, count, compression)
    }

    /// Reports changes of a dense grid's numbers, and what is lost of it.
    fn note_numbers(&self, grid: &DenseGrid) {
        if let Some(up) = grid.up {
            self.note_lost(&[format!("that {} points up (render it with --up)", up.name())]);
        }
        let (from, to) = (grid.value_type, grid.vdb_type());
        if from != to && self.wanted.to_type.is_none() && from != Number::F16 {
            self.note(&format!(
                "{} numbers become {}, which holds them all",
                from.name(),
                to.name()
            ));
        }
    }

    /// Writes the file of a dense grid; `active` is the number of active voxels if not all are.
    fn written(
        &self,
        writer: VdbWriter,
        output: PendingFile,
        grid: &DenseGrid,
        active: Option<u64>,
        compression: Compression,
    ) -> Result<Converted> {
        let (name, [x, y, z]) = (vdb_name(grid), grid.dims);
        let what = active.map(|count| format!(", {count} of them active")).unwrap_or_default();
        self.vdb_file(
            writer,
            output,
            &format!("'{name}', {x} x {y} x {z} voxels{what}, {compression}"),
        )
    }

    /// The active bounding box of one grid, or the requested box, in the grid's own type.
    pub(super) fn dense_of_vdb(&self, file: &VdbFile) -> Result<DenseGrid> {
        let index = fog::chosen(file, self.options.grid.as_deref())?;
        let header = &file.grids()[index];
        let refused =
            |why: String| Error::contents(file.path(), format!("grid '{}': {why}", header.name));
        let others: Vec<String> = file
            .grids()
            .iter()
            .map(|grid| grid.name.clone())
            .enumerate()
            .filter(|(other, _)| *other != index)
            .map(|(_, name)| format!("'{name}'"))
            .collect();
        if !others.is_empty() && self.options.grid.is_none() {
            let others = others.join(", ");
            self.note(&format!("grid '{}' is converted, not {others} (--grid)", header.name));
        }
        let place = affine(header).map_err(refused)?;
        self.progress.begin("convert", 3);
        let grid = self.sparsely_edited(self.loaded(file, index)?);
        let bounds = self.wanted.crop.or_else(|| grid.active_bounds());
        let bounds = bounds.ok_or_else(|| refused("it has no active voxels".to_owned()))?;
        let mut dense = DenseGrid::of_vdb(&grid, bounds, place, self.max_bytes())
            .map_err(|error| with_advice(error, "--crop, --max-bytes"))?;
        self.progress.advance(1);
        let space = header.metadata.get(SPACE).map(ToString::to_string);
        if let Some((space, ours_from_its)) = space.and_then(|name| Space::named(&name)) {
            dense.space = Some(space);
            dense.world_from_index = ours_from_its * dense.world_from_index;
        }
        dense.name.clone_from(&header.name);
        dense.class = Some(header.class().to_owned());
        // The grid's metadata take precedence over the file's.
        let all = file.metadata().iter().chain(header.metadata.iter());
        let kept = all.filter(|(key, _)| !key.starts_with("file_") && !UNDERSTOOD.contains(key));
        let texts: BTreeMap<String, String> =
            kept.map(|(key, value)| (key.to_owned(), value.to_string())).collect();
        dense.metadata = texts.into_iter().collect();
        self.resampled(dense)
    }

    /// The grids to be written: the requested one, or all that can be read.
    fn chosen_grids(&self, file: &VdbFile) -> Result<Vec<usize>> {
        if let Some(name) = self.options.grid.as_deref() {
            return Ok(vec![fog::chosen(file, Some(name))?]);
        }
        let mut chosen = Vec::new();
        for (index, header) in file.grids().iter().enumerate() {
            match &header.refused {
                None => chosen.push(index),
                Some(why) => self.note(&format!("grid '{}' is left out: {why}", header.name)),
            }
        }
        if let Some(why) = file.unreachable() {
            self.note(why);
        }
        if chosen.is_empty() && !file.grids().is_empty() {
            return Err(Error::contents(file.path(), "it has no grid that can be read"));
        }
        Ok(chosen)
    }

    /// Loads a grid of a file, unless it takes more memory than allowed.
    fn loaded(&self, file: &VdbFile, index: usize) -> Result<Grid> {
        let needed = file.survey(index, SurveyDepth::Topology)?.memory_bytes;
        if needed > self.max_bytes() {
            let what = format!("{}: grid '{}'", file.path().display(), file.grids()[index].name);
            let (needed, limit) =
                (format!("{needed} bytes"), format!("{} bytes", self.max_bytes()));
            let limit = format!("{limit} (--max-bytes)");
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
        file.load(index)
    }

    fn sparsely_edited(&self, mut grid: Grid) -> Grid {
        if let Some(bounds) = self.wanted.crop {
            grid = grid.cropped(bounds);
        }
        if let Some(least) = self.wanted.threshold {
            grid = grid.without_below(least);
        }
        if self.wanted.magnitude { grid.magnitude() } else { grid }
    }

    /// The grid after resampling, with its new transform, if that was requested. It goes through a
    /// dense box around the active voxels.
    fn sparsely_resampled(
        &self,
        grid: Grid,
        file: &VdbFile,
        header: &GridHeader,
    ) -> Result<(Grid, Option<DMat4>)> {
        if self.wanted.resample.is_none() {
            return Ok((grid, None));
        }
        let refused = |why| Error::contents(file.path(), format!("grid '{}': {why}", header.name));
        let place = affine(header).map_err(refused)?;
        let boolean = matches!(grid, Grid::Bool(_));
        let Some(bounds) = grid.active_bounds() else {
            // There is only the background, at another place.
            let origin = IndexBox { min: IVec3::ZERO, max: IVec3::ZERO };
            let nowhere = DenseGrid::of_vdb(&grid, origin, place, self.max_bytes())?;
            let place = self.resampled(nowhere)?.world_from_index;
            return Ok((grid, Some(place)));
        };
        let dense = DenseGrid::of_vdb(&grid, bounds, place, self.max_bytes()).map_err(|error| {
            with_advice(error, "resampling goes through a dense box: --max-bytes")
        })?;
        drop(grid);
        let mut dense = self.resampled(dense)?;
        let place = dense.world_from_index;
        // Without marks, voxels with the background's value would become inactive.
        dense.active.get_or_insert_with(|| vec![true; dense.dims.iter().product()]);
        let grid = match dense.into_vdb()? {
            Grid::Float(tree) if boolean => tree.map(|value| value != 0.0).into(),
            other => other,
        };
        Ok((grid, Some(place)))
    }

    /// The grid with numbers of the requested type.
    fn retyped(&self, grid: Grid) -> Result<Grid> {
        let from = match grid.value_type() {
            ValueType::Float | ValueType::Vec3s => Number::F32,
            ValueType::Double | ValueType::Vec3d => Number::F64,
            ValueType::Half => Number::F16,
            ValueType::Int32 | ValueType::Vec3i => Number::I32,
            ValueType::Int64 => Number::I64,
            _ => Number::U8,
        };
        let to = match self.wanted.to_type {
            Some(to) => to,
            None if self.wanted.range.is_some() => from,
            None => {
                if self.wanted.half {
                    self.note_overflow(grid.span());
                }
                return Ok(grid);
            }
        };
        grid.check_type(to)?;
        let remap = self.remap(|| grid.span(), from, to);
        grid.retyped(to, remap)
    }

    /// Whether floating-point values are stored as half floats.
    fn half(&self, as_before: bool) -> bool {
        match self.wanted.to_type {
            _ if self.wanted.half => true,
            Some(to) => to == Number::F16,
            None => as_before,
        }
    }

    fn vdb_file(
        &self,
        writer: VdbWriter,
        mut output: PendingFile,
        what: &str,
    ) -> Result<Converted> {
        let mut length = 0;
        for part in writer.finish_parts()? {
            length += part.len();
            output.put(&part)?;
        }
        commit(vec![output])?;
        Ok((vec![self.output.to_owned()], format!("{what}, {length} bytes")))
    }
}

/// The name of a dense grid in OpenVDB files.
fn vdb_name(grid: &DenseGrid) -> &str {
    if grid.name.is_empty() { DENSITY } else { &grid.name }
}

/// A writer for the file of a dense grid.
fn vdb_writer(grid: &DenseGrid, compression: Compression) -> VdbWriter {
    let mut metadata = Metadata::default();
    let creator = concat!("deepshadow ", env!("CARGO_PKG_VERSION"));
    metadata.set("creator", MetaValue::String(creator.to_owned()));
    VdbWriter::new(&[vdb_name(grid)], compression, &metadata)
}

/// Adds the class and the metadata of a dense grid to a new grid.
fn described(new: NewGrid, grid: &DenseGrid) -> NewGrid {
    let scalar = if grid.components == 1 { "fog volume" } else { "unknown" };
    let mut new = new.with_class(grid.class.as_deref().unwrap_or(scalar));
    let space = grid.space.map(|space| (SPACE.to_owned(), space.name().to_owned()));
    for (key, text) in grid.metadata.iter().chain(&space) {
        new.metadata().set(key, MetaValue::String(text.clone()));
    }
    new
}

/// The transform of a grid, or why it cannot be used.
fn affine(header: &GridHeader) -> Result<DMat4, String> {
    match &header.transform {
        Transform::Affine(matrix) => Ok(*matrix),
        Transform::Refused(why) => Err(why.clone()),
    }
}

/// Adds advice to an error of too much memory.
fn with_advice(error: Error, advice: &str) -> Error {
    match error.kind() {
        ErrorKind::Limit { what, needed, limit } => ErrorKind::Limit {
            what: what.clone(),
            needed: needed.clone(),
            limit: format!("{limit} ({advice})"),
        }
        .into(),
        _ => error,
    }
}
