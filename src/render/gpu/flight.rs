//! Work on its way: a few dispatches are queued, so that the device never waits for the host, and no
//! more, so that a cancelled render ends soon.

use std::collections::VecDeque;
use std::time::Instant;

use wgpu::{Buffer, BufferUsages};

use super::buffer::buffer;
use super::device::Gpu;
use super::kernel::Kernel;
use super::pacer::{LastUnits, Pacer, TARGET_SECONDS, WINDOW_TARGET_SECONDS};
use super::progress::GROUP;
use crate::error::{Error, Result};
use crate::render::gpu_facts::FlightFigures;

/// Words that the host reads of the work: pixels taken, slots that hold a path, samples, nothing.
pub(super) const REPORT_BYTES: u64 = 16;

/// Dispatches under way at a time: one runs, one waits, one is being made.
const MAX_IN_FLIGHT: usize = 3;
/// So many times the time a dispatch should take on the host's clock, and the device's is not believed.
const FAR_TOO_LONG: f64 = 10.0;
/// Waiting for something that has ended takes less.
const HAD_ENDED_SECONDS: f64 = 5e-5;
/// Bytes between a slot's timestamps on the device, as resolving them asks for.
const SLOT_BYTES: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;

/// The dispatches under way, oldest first, and how long those before them took.
pub(super) struct Flights {
    under_way: VecDeque<Flight>,
    target_seconds: f64,
    pacers: [Pacer; Kernel::COUNT],
    last_landing: Instant,
    clock: Option<Clock>,
    /// For words of a buffer that a job reports.
    staging: Option<[Buffer; MAX_IN_FLIGHT]>,
    /// What the last job to land that reports has reported.
    pub(super) report: Option<[u32; 4]>,
    started: usize,
    /// What the dispatches so far took.
    pub(super) figures: FlightFigures,
}

/// What a submission does.
pub(super) struct Job<'a> {
    /// By this one's speed it was sized.
    pub(super) kernel: Kernel,
    /// Kernels that run one after another, so many times.
    pub(super) kernels: &'a [(wgpu::ComputePipeline, wgpu::BindGroup)],
    pub(super) steps: u32,
    /// Workgroups of each.
    pub(super) groups: u32,
    pub(super) units: u64,
    /// A buffer whose first words are read afterwards; the second says how many lanes had work.
    pub(super) report: Option<&'a Buffer>,
}

struct Flight {
    submission: wgpu::SubmissionIndex,
    kernel: Kernel,
    units: u64,
    submitted: Instant,
    slot: usize,
    /// Lanes of a job that reports.
    lanes: Option<u32>,
}

impl Flights {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let target_seconds = if gpu.has_window { WINDOW_TARGET_SECONDS } else { TARGET_SECONDS };
        Self {
            under_way: VecDeque::new(),
            target_seconds,
            pacers: std::array::from_fn(|_| Pacer::new(target_seconds)),
            last_landing: Instant::now(),
            clock: Clock::new(gpu),
            staging: None,
            report: None,
            started: 0,
            figures: FlightFigures::default(),
        }
    }

    /// Units (workgroup samples) that the next dispatch of a kernel may hold.
    pub(super) fn units(&self, kernel: Kernel) -> u64 {
        self.pacers[kernel as usize].units()
    }

    /// Lets dispatches of a kernel begin with what other pictures know of its speed.
    pub(super) fn resume(&mut self, kernel: Kernel, last: &LastUnits) {
        self.pacers[kernel as usize].resume(last);
    }

    /// Submits a job, once there is room for it.
    pub(super) fn start(&mut self, gpu: &Gpu, job: &Job<'_>) -> Result<()> {
        while self.under_way.len() >= MAX_IN_FLIGHT {
            self.land(gpu)?;
        }
        let slot = self.started % MAX_IN_FLIGHT;
        self.started += 1;
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(job.kernel.name()),
                timestamp_writes: self.clock.as_ref().map(|clock| clock.writes(slot)),
            });
            for (pipeline, bind_group) in (0..job.steps).flat_map(|_| job.kernels) {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(job.groups, 1, 1);
            }
        }
        if let Some(clock) = &self.clock {
            clock.resolve(&mut commands, slot);
        }
        let staging = job.report.map(|source| {
            let buffers = || std::array::from_fn(|_| gpu.staging(REPORT_BYTES));
            let all = self.staging.get_or_insert_with(buffers);
            commands.copy_buffer_to_buffer(source, 0, &all[slot], 0, REPORT_BYTES);
            &all[slot]
        });
        let submitted = Instant::now();
        let submission = gpu.submit([commands.finish()]);
        // The times are there once the dispatch has landed.
        let times = self.clock.as_ref().map(|clock| &clock.staging[slot]);
        for staging in times.into_iter().chain(staging) {
            // Whether it worked shows when it is read.
            staging.map_async(wgpu::MapMode::Read, .., |_| {});
        }
        let (kernel, units) = (job.kernel, job.units);
        let lanes = staging.map(|_| job.groups * GROUP as u32);
        self.under_way.push_back(Flight { submission, kernel, units, submitted, slot, lanes });
        Ok(())
    }

    /// Waits for all of them.
    pub(super) fn land_all(&mut self, gpu: &Gpu) -> Result<()> {
        while !self.under_way.is_empty() {
            self.land(gpu)?;
        }
        Ok(())
    }

    /// Waits for the oldest one.
    fn land(&mut self, gpu: &Gpu) -> Result<()> {
        let Some(flight) = self.under_way.pop_front() else { return Ok(()) };
        let asked = Instant::now();
        gpu.wait_for(Some(flight.submission))?;
        let now = Instant::now();
        // What had ended before the host asked took less than the host saw.
        let had_ended = (now - asked).as_secs_f64() < HAD_ENDED_SECONDS;
        // It began when the one before it had ended.
        let seen = (now - flight.submitted.max(self.last_landing)).as_secs_f64();
        self.last_landing = now;
        let told = self.clock.as_mut().and_then(|clock| clock.seconds(flight.slot));
        let seconds = told.unwrap_or(seen);
        self.figures.dispatches += 1;
        self.figures.device_seconds += seconds;
        self.figures.has_timestamps = told.is_some();
        let units = match flight.lanes {
            Some(lanes) => {
                let left = self.read_report(gpu, flight.slot)?;
                // Lanes without work take no time. How long they had some is not known.
                if 2 * u64::from(left) < u64::from(lanes) {
                    return Ok(());
                }
                flight.units * u64::from(left) / u64::from(lanes)
            }
            None => flight.units,
        };
        // A clock that fixtures still must not let dispatches grow for ever.
        let is_far_too_long = !had_ended && seen > FAR_TOO_LONG * self.target_seconds;
        let paced = if is_far_too_long { seen } else { seconds };
        if told.is_some() || !had_ended || paced < self.target_seconds {
            self.pacers[flight.kernel as usize].record(units, paced);
        }
        Ok(())
    }

    /// Reads what a job in `slot` that has landed reports; returns how many lanes had work.
    fn read_report(&mut self, gpu: &Gpu, slot: usize) -> Result<u32> {
        let failed = |e: &dyn std::fmt::Display| {
            Error::new(format!("{}: a count cannot be read back: {e}", gpu.facts().name))
        };
        let staging = &self.staging.as_ref().ok_or_else(|| failed(&"no buffer"))?[slot];
        let report: [u32; 4] = {
            let view = staging.get_mapped_range(..).map_err(|e| failed(&e))?;
            bytemuck::pod_read_unaligned(&view)
        };
        staging.unmap();
        self.report = Some(report);
        Ok(report[1])
    }

    /// Lets dispatches begin as small as at first, so that tests can cut work short.
    #[cfg(test)]
    pub(super) fn forget_speed(&mut self) {
        self.pacers = std::array::from_fn(|_| Pacer::new(self.target_seconds));
    }
}

/// The device's own clock: when each dispatch began and ended.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: Buffer,
    staging: [Buffer; MAX_IN_FLIGHT],
    seconds_per_tick: f64,
}

impl Clock {
    /// `None` where the device has none that can be trusted: once it has drawn, llvmpipe stamps the
    /// beginning and the end of a dispatch alike.
    fn new(gpu: &Gpu) -> Option<Self> {
        let has_one = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        if !has_one || (gpu.has_window && gpu.facts().is_software()) {
            return None;
        }
        let seconds_per_tick = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        let bytes = SLOT_BYTES * MAX_IN_FLIGHT as u64;
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_IN_FLIGHT as u32,
            }),
            resolved: buffer(&gpu.device, Some("timestamps"), bytes, usage),
            staging: std::array::from_fn(|_| gpu.staging(16)),
            seconds_per_tick,
        })
    }

    fn writes(&self, slot: usize) -> wgpu::ComputePassTimestampWrites<'_> {
        let first = 2 * slot as u32;
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        }
    }

    fn resolve(&self, commands: &mut wgpu::CommandEncoder, slot: usize) {
        let (first, at) = (2 * slot as u32, slot as u64 * SLOT_BYTES);
        commands.resolve_query_set(&self.queries, first..first + 2, &self.resolved, at);
        commands.copy_buffer_to_buffer(&self.resolved, at, &self.staging[slot], 0, 16);
    }

    /// Seconds between a slot's timestamps; `None` where they make no sense.
    fn seconds(&mut self, slot: usize) -> Option<f64> {
        let staging = &self.staging[slot];
        let ticks = staging.get_mapped_range(..).ok().and_then(|view| {
            let times: &[u64] = bytemuck::try_cast_slice(&view).ok()?;
            times[1].checked_sub(times[0])
        });
        // Even where another thread that shares the device is about to map it.
        staging.unmap();
        ticks.filter(|ticks| *ticks > 0).map(|ticks| ticks as f64 * self.seconds_per_tick)
    }
}
