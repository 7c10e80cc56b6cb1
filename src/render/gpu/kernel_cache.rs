//! Kernels that a device has compiled, and those that threads compile for it.

use std::any::Any;
use std::sync::{Arc, Weak};

use super::pacer::LastUnits;
use super::shader::Program;
use crate::error::Error;

/// A kernel ready to run.
pub(super) struct Pipeline {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
    pub(super) program: Program,
    pub(super) last_units: LastUnits,
}

/// Most kernels that are kept for those who may want them again: those of some four scenes. Each is a megabyte
/// or so where software runs it.
pub(super) const MAX_KEPT_KERNELS: usize = 32;

/// Kernels that were compiled, and those that are to be compiled ahead.
#[derive(Default)]
pub(super) struct KernelCache {
    /// The last one used at the end.
    kept: Vec<Arc<Pipeline>>,
    /// The sources that threads compile, and what those hold.
    pub(super) under_way: Vec<(Vec<String>, Weak<CompileGuard>)>,
    /// Sources that were refused last, and why.
    pub(super) refused: Option<(Vec<String>, Error)>,
}

impl KernelCache {
    /// The kernel of this source, if there is one.
    pub(super) fn find(&mut self, source: &str) -> Option<Arc<Pipeline>> {
        let at = self.kept.iter().position(|pipeline| pipeline.program.source == source)?;
        let found = self.kept.remove(at);
        self.kept.push(Arc::clone(&found));
        Some(found)
    }

    /// Keeps another one in the place of that which nobody has asked for the longest.
    pub(super) fn keep(&mut self, pipeline: Arc<Pipeline>) {
        // Two may have compiled it at the same time.
        if self.find(&pipeline.program.source).is_some() {
            return;
        }
        if self.kept.len() == MAX_KEPT_KERNELS {
            self.kept.remove(0);
        }
        self.kept.push(pipeline);
    }

    /// What the thread holds that compiles these, maybe among others, if there is one.
    pub(super) fn holder_of(&mut self, sources: &[String]) -> Option<Weak<CompileGuard>> {
        self.under_way.retain(|(_, held)| held.strong_count() > 0);
        let has_all = |others: &[String]| sources.iter().all(|source| others.contains(source));
        let found = self.under_way.iter().find(|(others, _)| has_all(others));
        found.map(|(_, held)| Weak::clone(held))
    }
}

/// What is held for as long as a thread compiles.
pub(crate) type CompileGuard = dyn Any + Send + Sync;
