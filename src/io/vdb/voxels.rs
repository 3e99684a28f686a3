//! Reads a grid's voxels, with or without keeping them, for every value type. Knows nothing of
//! headers.

use half::f16;

use super::fault::{Fault, Parsed};
use super::grid::Grid;
use super::grid_type::ValueType;
use super::header::GridHeader;
use super::index_box::IndexBox;
use super::leaves::{LEAVES, LeafFormat, LeafWorkspace};
use super::mask;
use super::source::{Reader, Source};
use super::statistics::{self, Findings, Statistics};
use super::topology::{self, Topology};
use super::tree::Tree;
use super::value::{AnyValue, Value};
use super::value_block::Encoding;
use crate::io::Histogram;
use crate::parallel;

/// Number of bytes to read at a time.
const CHUNK: usize = 256 << 10;

/// How much of a grid [`super::VdbFile::survey`] reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurveyDepth {
    /// The tree without the voxels' values: counts and bounds.
    Topology,
    /// All values, without keeping them: also statistics.
    Values,
    /// All values, read twice without keeping them: also a histogram with this many bins.
    Histogram(usize),
}

/// Measurements of a grid, made without keeping its voxels.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Survey {
    /// Number of active voxels, saturating at `u64::MAX`.
    pub active_voxels: u64,
    /// The smallest box around all active voxels; `None` if there are none.
    pub active_bounds: Option<IndexBox>,
    /// Statistics of the active values, one per component; empty without active voxels and with
    /// [`SurveyDepth::Topology`].
    pub statistics: Vec<Statistics>,
    /// Histogram of the active values as numbers for rendering (see [`Value::to_f32`]); `None`
    /// unless requested, and if no value is finite.
    pub histogram: Option<Histogram>,
    /// Number of leaves.
    pub leaf_count: u64,
    /// Number of active tiles.
    pub active_tile_count: u64,
    /// Bytes of memory that the grid takes once loaded.
    pub memory_bytes: u64,
}

/// Runs the expression with `$type` as an alias of the type of the grid's values.
macro_rules! for_value_type {
    ($header:expr, $type:ident => $result:expr) => {
        match &$header.value_type {
            ValueType::Float => {
                type $type = f32;
                $result
            }
            ValueType::Double => {
                type $type = f64;
                $result
            }
            ValueType::Half => {
                type $type = f16;
                $result
            }
            ValueType::Int32 => {
                type $type = i32;
                $result
            }
            ValueType::Int64 => {
                type $type = i64;
                $result
            }
            ValueType::Bool | ValueType::Mask => {
                type $type = bool;
                $result
            }
            ValueType::Vec3s => {
                type $type = [f32; 3];
                $result
            }
            ValueType::Vec3d => {
                type $type = [f64; 3];
                $result
            }
            ValueType::Vec3i => {
                type $type = [i32; 3];
                $result
            }
            ValueType::Unsupported(name) => {
                let why = format!("voxels of type {name:?} are not supported");
                Err(Fault::bad($header.place.topology, why))
            }
        }
    };
}

/// Reads the background; the reader is at the topology.
pub(super) fn background(reader: &mut Reader, header: &GridHeader) -> Parsed<AnyValue> {
    for_value_type!(header, T => reader.parse(topology::read_background::<T>).map(Value::any))
}

/// Loads the grid.
pub(super) fn load(source: &Source, header: &GridHeader) -> Parsed<Grid> {
    for_value_type!(header, T => {
        let (mut topology, format) = read_topology::<T>(source, header)?;
        let values = format.read_all(&mut block_reader(source, header), &mut topology)?;
        Ok(Tree::new(topology, values).into())
    })
}

/// Surveys the grid.
pub(super) fn survey(source: &Source, header: &GridHeader, depth: SurveyDepth) -> Parsed<Survey> {
    for_value_type!(header, T => {
        let (mut topology, format) = read_topology::<T>(source, header)?;
        let mut found = Findings::of_tiles(&topology);
        let reader = || block_reader(source, header);
        if depth != SurveyDepth::Topology {
            let each = Findings::of_leaf::<T>;
            visit_leaves(&format, &mut reader(), &mut topology, each, |leaf| found.merge(&leaf))?;
        }
        let mut survey = Survey {
            active_voxels: topology.active_voxel_count(),
            active_bounds: topology.active_bounds(),
            statistics: Vec::new(),
            histogram: None,
            leaf_count: topology.leaf_origins.len() as u64,
            active_tile_count: topology.tiles().filter(|tile| tile.active).count() as u64,
            memory_bytes: topology.memory_bytes() as u64,
        };
        let voxels = survey.leaf_count * format.shape.leaf_voxels() as u64;
        survey.memory_bytes += voxels * size_of::<T>() as u64;
        if depth != SurveyDepth::Topology {
            survey.statistics = found.statistics(T::COMPONENTS);
        }
        if let (SurveyDepth::Histogram(bins), Some(range)) = (depth, found.range()) {
            let mut all = statistics::tile_histogram(&topology, range, bins);
            let each = |values: &[T], active: &[u64]| {
                let mut histogram = Histogram::new(range, bins);
                for voxel in mask::set_bits(active) {
                    histogram.add(values[voxel].to_f32(), 1);
                }
                histogram
            };
            visit_leaves(&format, &mut reader(), &mut topology, each, |leaf| all.merge(&leaf))?;
            survey.histogram = Some(all);
        }
        Ok(survey)
    })
}

/// Skips the voxels of a grid in a stream, which is the only way to find its offsets: the reader
/// moves from the topology to the grid's end. Returns the offset of the leaf buffers, and the
/// background.
pub(super) fn step_over(reader: &mut Reader, header: &GridHeader) -> Parsed<(u64, AnyValue)> {
    for_value_type!(header, T => {
        let (topology, format) = read_topology_at::<T>(reader, header)?;
        let blocks = reader.position();
        format.for_each_batch(reader, topology.leaf_origins.len(), |_, _| Ok(()))?;
        Ok((blocks, topology.background.any()))
    })
}

fn read_topology<T: Value>(
    source: &Source,
    header: &GridHeader,
) -> Parsed<(Topology<T>, LeafFormat<T>)> {
    let place = &header.place;
    read_topology_at(&mut Reader::new(source, place.topology, place.blocks, CHUNK), header)
}

fn read_topology_at<T: Value>(
    reader: &mut Reader,
    header: &GridHeader,
) -> Parsed<(Topology<T>, LeafFormat<T>)> {
    let Some(shape) = header.place.shape else {
        let why = format!("unknown tree {:?}", header.type_name);
        return Err(Fault::bad(header.place.topology, why));
    };
    let mut encoding = Encoding {
        compression: header.compression,
        half: header.saved_as_half,
        background: T::default(),
    };
    let topology = topology::read(reader, shape, &mut encoding)?;
    Ok((topology, LeafFormat::new(&header.value_type, shape, encoding)))
}

fn block_reader<'a>(source: &'a Source, header: &GridHeader) -> Reader<'a> {
    Reader::new(source, header.place.blocks, header.place.end, CHUNK)
}

/// Applies `each` to each leaf's values and active mask, and passes the results to `take` in the
/// order of the leaves; keeps no values. Replaces the topology's masks by those of the buffers.
fn visit_leaves<T: Value, R: Send>(
    format: &LeafFormat<T>,
    reader: &mut Reader,
    topology: &mut Topology<T>,
    each: impl Fn(&[T], &[u64]) -> R + Sync,
    mut take: impl FnMut(R),
) -> Parsed<()> {
    let count = topology.leaf_origins.len();
    format.check_room(count, reader)?;
    let (voxels, words) = (format.shape.leaf_voxels(), format.shape.leaf_words());
    format.for_each_batch(reader, count, |first, batch| {
        let range = first * words..(first + batch.len()) * words;
        let masks = topology.leaf_active[range].chunks_mut(words * LEAVES);
        let of_batch = parallel::map(masks.zip(batch.chunks(LEAVES)), |(masks, leaves)| {
            let (mut workspace, mut values) =
                (LeafWorkspace::default(), vec![T::default(); voxels]);
            let leaves = masks.chunks_exact_mut(words).zip(leaves);
            let each = leaves.map(|(active, leaf)| {
                format.decode(leaf, &mut workspace, active, &mut values)?;
                Ok(each(&values, active))
            });
            each.collect::<Parsed<Vec<R>>>()
        });
        for of_leaves in of_batch {
            of_leaves?.into_iter().for_each(&mut take);
        }
        Ok(())
    })
}
