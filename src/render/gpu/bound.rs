//! Kernels and what they are bound to.

use std::sync::Arc;

use super::buffers::Buffers;
use super::device::Gpu;
use super::kernel_cache::Pipeline;
use super::shader::Binding;
use crate::error::{Error, Result};

/// A kernel and what it is bound to.
pub(super) struct Bound {
    pub(super) pipeline: Arc<Pipeline>,
    /// With the version of the buffers that it binds.
    bind_group: Option<(u64, wgpu::BindGroup)>,
}

impl Bound {
    pub(super) fn new(pipeline: Arc<Pipeline>) -> Self {
        Self { pipeline, bind_group: None }
    }

    /// The kernel and what binds the buffers as they are now; that is made anew when others have taken
    /// their place.
    pub(super) fn current(
        &mut self,
        gpu: &Gpu,
        buffers: &Buffers,
    ) -> Result<(wgpu::ComputePipeline, wgpu::BindGroup)> {
        let version = buffers.version;
        let kept = self.bind_group.take().filter(|(of, _)| *of == version);
        let bind = || self.bind(gpu, buffers).map(|bind_group| (version, bind_group));
        let current = kept.map_or_else(bind, Ok)?;
        Ok((self.pipeline.pipeline.clone(), self.bind_group.insert(current).1.clone()))
    }

    fn bind(&self, gpu: &Gpu, buffers: &Buffers) -> Result<wgpu::BindGroup> {
        let missing = |name: &str| Error::new(format!("the shader's {name} was not uploaded"));
        let mut entries = Vec::new();
        for (binding, index) in self.pipeline.program.bindings.iter().zip(0..) {
            let resource = match binding {
                Binding::Buffer { name, .. } => {
                    buffers.get(name).ok_or_else(|| missing(name))?.as_entire_binding()
                }
                Binding::Array(array) => wgpu::BindingResource::TextureView(
                    buffers.array(array.name).ok_or_else(|| missing(array.name))?,
                ),
                Binding::Tree => wgpu::BindingResource::AccelerationStructure(
                    buffers.tree.as_ref().ok_or_else(|| missing("tree"))?,
                ),
            };
            entries.push(wgpu::BindGroupEntry { binding: index, resource });
        }
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.layout,
            entries: &entries,
        }))
    }
}
