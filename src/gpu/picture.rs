//! Whole pictures by one or more dispatches: in parts if they are large, so that no driver takes a
//! dispatch for a hung one, and with all rays of a pixel only where the picture of one ray each
//! bends (`rank_radiance`, `refine_view`).

use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{at, entry};
use super::link::MediaKind;
use super::lists::GpuLists;
use super::media::GpuMedia;
use super::passes::Pass;
use super::renderer::{GpuImage, Renderer};
use super::seen::{GpuLooks, PART_BYTES};
use super::shadow::GpuShadow;
use super::tile::Tile;
use super::tiles::{Room, filled};
use crate::error::Result;
use crate::frame::Frame;

/// Camera rays of a dispatch. Slow devices take up to a second for as many, and some drivers give
/// up after two.
const RAYS: u64 = 1 << 22;
/// Rows of a dispatch are a multiple of a workgroup's.
const ROWS: u32 = 8;

/// Initial capacity of what pixels see of surfaces, in parts per pixel.
const SEEN_PARTS: u64 = 2;

/// Surfaces that a picture shows.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    pub looks: &'a GpuLooks,
    /// The largest number of bytes to reserve for what pixels see of them.
    pub memory: u64,
}

/// What a picture is made of.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub media: &'a GpuMedia,
    pub shadow: GpuShadow<'a>,
    pub surfaces: Option<Shown<'a>>,
}

impl Subject<'_> {
    /// The pass that makes pictures of it.
    fn march(&self) -> Pass {
        if self.surfaces.is_some() { Pass::MarchSurfaces } else { self.shadow.march() }
    }

    /// The pass that gives more rays to some of their pixels.
    fn refine(&self) -> Pass {
        if self.surfaces.is_some() { Pass::RefineSurfaces } else { self.shadow.refine() }
    }
}

impl Renderer {
    /// Makes the picture of `frame` in `image`.
    ///
    /// # Errors
    /// If the device rejects a shader or has not enough memory.
    pub(super) async fn picture(
        &self,
        subject: &Subject<'_>,
        frame: &Frame,
        image: &GpuImage,
    ) -> Result<()> {
        let mut room = Room { rows: frame.view.height, elements: 0 };
        if frame.view.samples == 1 || frame.view.tolerance <= 0.0 {
            return self.rows(subject.march(), subject, frame, (&[], image), &mut room).await;
        }
        let mut first = *frame;
        first.view.samples = 1;
        let [width, height] = image.size();
        let single = self.image(width, height)?;
        self.rows(subject.march(), subject, &first, (&[], &single), &mut room).await?;
        let bright = self.storage("bright", 4);
        let single = entry(at::SINGLE, BindingResource::TextureView(single.view()));
        let more = [single, entry(at::BRIGHT, bright.as_entire_binding())];
        let rank = self.prepare(Pass::RankRadiance, MediaKind::Plain, None, more.to_vec(), [1, 1]);
        self.submit_async(|encoder| rank.record(encoder)).await?;
        self.rows(subject.refine(), subject, frame, (&more, image), &mut room).await
    }

    /// Runs a pass over all rows of a picture, with `more` bindings.
    async fn rows(
        &self,
        pass: Pass,
        subject: &Subject<'_>,
        frame: &Frame,
        (more, image): (&[BindGroupEntry<'_>], &GpuImage),
        room: &mut Room,
    ) -> Result<()> {
        let Subject { media, shadow, surfaces } = *subject;
        let [width, height] = image.size();
        // Pixels that see surfaces take all rays at once.
        let samples = surfaces.map_or(1, |shown| shown.looks.rays).max(frame.view.samples);
        let rays = u64::from(width) * u64::from(samples);
        let rows = u32::try_from(RAYS / rays).unwrap_or(height).max(1).next_multiple_of(ROWS);
        let camera = match surfaces {
            Some(_) => Some(self.frame(&frame.from_camera(), media)?),
            None => None,
        };
        let mut part = *frame;
        let mut first = 0;
        while first < height {
            let mut own = more.to_vec();
            let tile = Tile {
                origin: [0, first],
                extent: [width, rows.min(height - first)],
                ..Tile::rows(width, 0, 0, 0)
            };
            let lists = match (surfaces, &camera) {
                (Some(Shown { looks, memory }), Some(camera)) => {
                    let most = memory.min(self.largest_binding()) / PART_BYTES;
                    let make = |tile| self.seen(looks.over(tile));
                    let draw = |encoder: &mut wgpu::CommandEncoder, lists: &GpuLists| {
                        self.raster_view(encoder, looks, camera, lists)
                    };
                    let parts = (tile, SEEN_PARTS, PART_BYTES);
                    Some(filled(self, parts, most, room, make, draw).await?)
                }
                _ => None,
            };
            let extent = lists.as_ref().map_or(tile.extent, |lists| lists.tile().extent);
            if let (Some(lists), Some(shown)) = (&lists, surfaces) {
                own.extend(lists.seen_entries());
                own.push(shown.looks.entry());
            }
            part.view.first_row = first;
            let part = self.frame(&part, media)?;
            let prepared = self.prepare_rows(pass, (media, &part), shadow, (&own, image), extent);
            self.submit_async(|encoder| {
                lists.iter().try_for_each(|lists| self.sort_view(encoder, lists))?;
                prepared.record(encoder)
            })
            .await?;
            first += extent[1];
        }
        Ok(())
    }
}
