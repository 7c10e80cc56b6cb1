//! The à-trous filter of [`crate::denoise`] as compute passes.

use super::passes::{dispatch, entry, filled, pipelines};
use crate::denoise::a_trous::STEPS;
use crate::denoise::{a_trous, edges, guides, light};
use crate::render::gpu::{DeviceFilm, Gpu, buffer, constants};

constants::constants! {
    ALBEDO_TOLERANCE: guides::ALBEDO_TOLERANCE,
    CHANCES: guides::CHANCES,
    CHANCE_SAMPLES: edges::CHANCE_SAMPLES,
    COVERAGE_TOLERANCE: guides::COVERAGE_TOLERANCE,
    DEPTH_GROWTH: guides::DEPTH_GROWTH,
    DEPTH_SCALE: edges::DEPTH_SCALE,
    DEPTH_TOLERANCE: guides::DEPTH_TOLERANCE,
    ERRORS_TOLERATED: light::ERRORS_TOLERATED,
    FEWER: a_trous::FEWER,
    MAX_LUMINANCE: light::MAX_LUMINANCE,
    MAX_VARIANCE: light::MAX_VARIANCE,
    MIN_ALBEDO: guides::MIN_ALBEDO,
    MIN_ALIKE: edges::MIN_ALIKE,
    MIN_LIKENESS: a_trous::MIN_LIKENESS,
    MIN_NEARNESS: guides::MIN_NEARNESS,
    MAX_MAP_NOISE: a_trous::MAX_MAP_NOISE,
    MIN_SPREAD: a_trous::MIN_SPREAD,
    MIN_VARIANCE: light::MIN_VARIANCE,
    NORMAL_TOLERANCE: guides::NORMAL_TOLERANCE,
    NORMAL_VARIANCES: guides::NORMAL_VARIANCES,
    RELATIVE_ERROR: edges::RELATIVE_ERROR,
    RIDGE: edges::RIDGE,
    SINGLE: a_trous::SINGLE,
    SLOPE_TOLERANCE: guides::SLOPE_TOLERANCE,
    WHOLE: edges::WHOLE,
}

/// Bytes of a pixel's `Guide`.
const GUIDE_BYTES: u64 = 48;
/// Bytes of a pixel's light.
const LIGHT_BYTES: u64 = 16;

/// Entry points of the shader, in the order in which they run.
const NAMES: [&str; 6] = ["undress", "survey", "share_errors", "smooth_light", "mend", "dress"];

/// A pipeline for each of [`NAMES`].
pub(super) struct Passes([wgpu::ComputePipeline; NAMES.len()]);

impl Passes {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let source = (shared() + include_str!("../../shaders/a_trous.wgsl")).into();
        Self(pipelines(gpu, "a-trous", source, NAMES))
    }

    /// Whether the guides of so many pixels fit into one binding.
    pub(super) fn fits(&self, gpu: &Gpu, width: u32, height: u32) -> bool {
        let most = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
        u64::from(width) * u64::from(height) * GUIDE_BYTES <= most
    }

    /// The film filtered, with one sample a pixel that has any; `None` without layers or where they
    /// or what the filter needs do not fit.
    pub(super) fn run(&self, gpu: &Gpu, film: &DeviceFilm) -> Option<DeviceFilm> {
        let surfaces = film.surfaces.as_ref()?;
        if !self.fits(gpu, film.width, film.height) {
            return None;
        }
        let Self([undress, survey, share_errors, smooth_light, mend, dress]) = self;
        let size = [film.width, film.height];
        // The film's own counts may have gone on when the result is looked at.
        let planes = [
            ("guides", GUIDE_BYTES),
            ("light", LIGHT_BYTES),
            ("light", LIGHT_BYTES),
            ("counts", LIGHT_BYTES),
        ];
        let pixels = u64::from(film.width) * u64::from(film.height);
        let usage = wgpu::BufferUsages::STORAGE;
        let made = gpu.make(|device| {
            planes.map(|(label, bytes)| buffer(device, Some(label), pixels * bytes, usage))
        });
        let [guides, mut light, mut result, counts] = made.ok()?;
        let settings = |step: u32| {
            let words = [film.width, film.height, step, film.scale.recip().to_bits()];
            filled(gpu, wgpu::BufferUsages::UNIFORM, &words)
        };
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let one = settings(1);
        let inputs = [&one, &film.sum, &film.counts, surfaces, &guides, &light];
        let entries: Vec<_> = (0..).zip(inputs).map(|(at, buffer)| entry(at, buffer)).collect();
        dispatch(gpu, &mut commands, undress, &entries, size);
        let entries = [entry(0, &one), entry(2, &film.counts), entry(4, &guides)];
        dispatch(gpu, &mut commands, survey, &entries, size);
        let mut pass = |pipeline, settings: &wgpu::Buffer, more: &[wgpu::BindGroupEntry<'_>]| {
            let always =
                [entry(0, settings), entry(4, &guides), entry(5, &light), entry(6, &result)];
            dispatch(gpu, &mut commands, pipeline, &[&always, more].concat(), size);
            std::mem::swap(&mut light, &mut result);
        };
        pass(share_errors, &one, &[entry(2, &film.counts)]);
        for step in STEPS {
            pass(smooth_light, &settings(step), &[]);
        }
        pass(mend, &one, &[]);
        pass(dress, &one, &[entry(2, &film.counts), entry(7, &counts)]);
        gpu.submit([commands.finish()]);
        let [width, height] = size;
        Some(DeviceFilm { sum: light, counts, surfaces: None, width, height, scale: 1.0 })
    }
}
