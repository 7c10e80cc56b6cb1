//! Rays alone on the device, without paths: what one walk of the tree takes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::layout::Work;
use super::shader::Kernel;
use super::{GROUP, MAX_GROUPS, Renderer};
use crate::bvh::Ray;
use crate::error::Result;

/// Twin of `CastRay` in `cast.wgsl`.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CastRay {
    pub(super) origin: Vec3,
    pub(super) t_max: f32,
    pub(super) direction: Vec3,
    pub(super) padding: u32,
}

/// What is asked of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Question {
    /// Where they end.
    ClosestHit,
    /// How much light comes along them.
    Transmittance,
}

impl Question {
    fn kernel(self) -> Kernel {
        match self {
            Self::ClosestHit => Kernel::ClosestHits,
            Self::Transmittance => Kernel::ShadowRays,
        }
    }
}

impl Renderer {
    /// Uploads rays to be traced; they begin where they say, whatever their `t_min`.
    pub(crate) fn put_rays(&mut self, rays: &[Ray]) -> Result<()> {
        let rays: Vec<CastRay> = rays
            .iter()
            .map(|ray| CastRay {
                origin: ray.origin,
                t_max: ray.t_max.min(f32::MAX),
                direction: ray.direction,
                padding: 0,
            })
            .collect();
        self.buffers.put("cast_rays", bytemuck::cast_slice(&rays), "the list of rays")?;
        self.buffers.make("cast_results", 8 * rays.len() as u64, "the list of hits")
    }

    /// Traces the first `count` of the uploaded rays; returns the seconds that took on the device.
    pub(crate) fn cast(&mut self, question: Question, count: u32) -> Result<f64> {
        let kernel = question.kernel();
        self.settle()?;
        let before = self.flights.figures().device_seconds;
        let mut first = 0;
        while first < count {
            let groups = self.flights.units(kernel).min(MAX_GROUPS);
            let groups = groups.min(u64::from(count - first).div_ceil(GROUP)) as u32;
            let work = Work { first, count, ..Work::default() };
            self.dispatch(kernel, &work, groups, u64::from(groups))?;
            first += groups * GROUP as u32;
        }
        self.settle()?;
        Ok(self.flights.figures().device_seconds - before)
    }

    /// What came of each of the first `count` rays: the distance (`f32::MAX` without a hit) and the
    /// triangle, or the share of light in `[0,1]` and nothing.
    pub(crate) fn cast_results(&self, count: usize) -> Result<Vec<(f32, u32)>> {
        let words = self.read_words("cast_results", 2 * count)?;
        Ok(words.as_chunks().0.iter().map(|&[x, i]| (f32::from_bits(x), i)).collect())
    }
}
