//! Times of work that is compared with each other: measured in turns, because clock rates drift,
//! and all with the same method.

use std::time::Instant;

use wgpu::{BufferUsages, CommandEncoder, Features};

use crate::device::Gpu;

/// How often each subject is measured: on hardware, and on software, whose passes are slow.
const ROUNDS: usize = 9;
const SOFTWARE_ROUNDS: usize = 3;
/// Duration of a submission, in milliseconds, to which repetitions are added up.
const SUBMISSION_MS: f64 = 30.0;

/// Records one frame, or other work to be timed, into an encoder.
pub type Record<'a> = &'a dyn Fn(&mut CommandEncoder);

/// Measures with the device's timestamps around the passes of a submission, or with the wall clock
/// around the submission.
pub struct Clock<'a> {
    gpu: &'a Gpu,
    timestamps: Option<Timestamps>,
}

struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
}

impl<'a> Clock<'a> {
    /// Uses timestamps if hardware supports them between passes.
    pub fn new(gpu: &'a Gpu) -> Self {
        let able = gpu
            .device
            .features()
            .contains(Features::TIMESTAMP_QUERY | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
            && !gpu.is_software();
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        let timestamps = able.then(|| Timestamps {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            readback: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        });
        Self { gpu, timestamps }
    }

    /// The name of the method.
    pub fn method(&self) -> &'static str {
        match self.timestamps {
            Some(_) => "timestamps of the device around the passes of a submission",
            None => "wall clock from submission to its end",
        }
    }

    /// Milliseconds of each subject: medians of submissions in turns, each with as many repetitions
    /// as fill the submission's duration.
    pub fn interleaved<const N: usize>(&self, subjects: [Record<'_>; N]) -> [f64; N] {
        let repetitions = subjects.map(|record| {
            self.submission_ms(1, record);
            (SUBMISSION_MS / self.submission_ms(1, record)).ceil().clamp(1.0, 300.0) as u32
        });
        let rounds = if self.gpu.is_software() { SOFTWARE_ROUNDS } else { ROUNDS };
        let mut times = [const { Vec::new() }; N];
        for _ in 0..rounds {
            for i in 0..N {
                let ms = self.submission_ms(repetitions[i], subjects[i]);
                times[i].push(ms / f64::from(repetitions[i]));
            }
        }
        times.map(|mut own| {
            own.sort_by(f64::total_cmp);
            own[rounds / 2]
        })
    }

    /// Milliseconds of one submission, without the time for recording it.
    fn submission_ms(&self, repetitions: u32, record: Record<'_>) -> f64 {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        if let Some(own) = &self.timestamps {
            encoder.write_timestamp(&own.queries, 0);
        }
        for _ in 0..repetitions {
            record(&mut encoder);
        }
        if let Some(own) = &self.timestamps {
            encoder.write_timestamp(&own.queries, 1);
            encoder.resolve_query_set(&own.queries, 0..2, &own.resolved, 0);
            encoder.copy_buffer_to_buffer(&own.resolved, 0, &own.readback, 0, 16);
        }
        let commands = encoder.finish();
        let begun = Instant::now();
        self.gpu.queue.submit([commands]);
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let wall = begun.elapsed().as_secs_f64() * 1e3;
        self.timestamps.as_ref().map_or(wall, |own| own.elapsed_ms(self.gpu))
    }
}

impl Timestamps {
    fn elapsed_ms(&self, gpu: &Gpu) -> f64 {
        self.readback.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = self.readback.get_mapped_range(..).unwrap();
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        drop(bytes);
        self.readback.unmap();
        ticks[1].wrapping_sub(ticks[0]) as f64 * f64::from(gpu.queue.get_timestamp_period()) * 1e-6
    }
}
