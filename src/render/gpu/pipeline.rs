//! Compiling kernels.

use std::borrow::Cow;
use std::sync::{Arc, MutexGuard, PoisonError};
use std::thread::ScopedJoinHandle;

use super::device::Gpu;
use super::kernel::Kernel;
use super::kernel_cache::{KernelCache, Pipeline};
use super::pacer::LastUnits;
use super::shader::{Binding, Program};
use crate::error::{Error, Result};

/// What naga adds to the kernels so that they cannot do harm, whatever they read. Counters that end
/// loops and guards of divisions, of which there are many, cost registers and up to a third of the
/// instructions. Checked indices stay: drivers check those of buffers themselves, and without the others
/// kernels for a Radeon have 0.1 % fewer instructions and as many registers.
const RUNTIME_CHECKS: wgpu::ShaderRuntimeChecks = wgpu::ShaderRuntimeChecks {
    force_loop_bounding: false,
    int_div_checks: false,
    ..wgpu::ShaderRuntimeChecks::checked()
};

impl Pipeline {
    /// Compiles a program; this can take seconds.
    ///
    /// # Errors
    /// If the driver refuses it.
    pub(super) fn new(gpu: &Gpu, entry: &str, program: Program) -> Result<Arc<Self>> {
        let entry_of = |(of, binding): (&Binding, u32)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: binding_type(of),
            count: None,
        };
        let entries: Vec<_> = program.bindings.iter().zip(0..).map(entry_of).collect();
        let (layout, pipeline) = gpu.make(|device| {
            let label = Some(entry);
            let descriptor = wgpu::BindGroupLayoutDescriptor { label, entries: &entries };
            let layout = device.create_bind_group_layout(&descriptor);
            let source = wgpu::ShaderSource::Wgsl(Cow::Borrowed(&program.source));
            let source = wgpu::ShaderModuleDescriptor { label, source };
            // SAFETY: indices are checked as ever. All loops end: walks take each group of a finite tree
            // once, searches halve what is left, paths are bounded by bounces and passes, slots take
            // each pixel once, all others count or clear bits. No divisor is zero: see `no_integer_is_divided_by_zero`.
            let module = unsafe { device.create_shader_module_trusted(source, RUNTIME_CHECKS) };
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // No walk reads of its stack what it has not written.
                    zero_initialize_workgroup_memory: false,
                    ..wgpu::PipelineCompilationOptions::default()
                },
                cache: None,
            });
            (layout, pipeline)
        })?;
        Ok(Arc::new(Self { pipeline, layout, program, last_units: LastUnits::default() }))
    }
}

/// Kernels to be compiled.
pub(super) type Programs = Vec<(Kernel, Program)>;

impl Gpu {
    pub(super) fn kernel_cache(&self) -> MutexGuard<'_, KernelCache> {
        self.kernels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A kernel, compiled unless this device ran it lately.
    fn pipeline(&self, kernel: Kernel, program: Program) -> Result<Arc<Pipeline>> {
        let known = self.kernel_cache().find(&program.source);
        if let Some(pipeline) = known {
            return Ok(pipeline);
        }
        let pipeline = Pipeline::new(self, kernel.name(), program)?;
        self.kernel_cache().keep(Arc::clone(&pipeline));
        Ok(pipeline)
    }

    /// Kernels; those that this device did not run lately are compiled, all at the same time.
    ///
    /// # Errors
    /// If the driver refuses one.
    pub(super) fn pipelines(&self, programs: Programs) -> Result<Vec<Arc<Pipeline>>> {
        std::thread::scope(|scope| {
            let compile = |(kernel, program): (Kernel, Program)| {
                std::thread::Builder::new()
                    .name(kernel.name().to_owned())
                    .spawn_scoped(scope, move || self.pipeline(kernel, program))
                    .map_err(|error| no_thread(&error))
            };
            let compiling = programs.into_iter().map(compile).collect::<Result<Vec<_>>>()?;
            let wait = |thread: ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            compiling.into_iter().map(wait).collect()
        })
    }
}

pub(super) fn no_thread(error: &std::io::Error) -> Error {
    Error::new(format!("a kernel cannot be compiled: {error}"))
}

fn binding_type(binding: &Binding) -> wgpu::BindingType {
    match binding {
        Binding::Buffer { is_written, .. } => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: !is_written },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        Binding::Tree => wgpu::BindingType::AccelerationStructure { vertex_return: false },
        Binding::Array(array) => wgpu::BindingType::Texture {
            sample_type: if array.is_float() {
                wgpu::TextureSampleType::Float { filterable: false }
            } else {
                wgpu::TextureSampleType::Uint
            },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel_cache::MAX_KEPT_KERNELS;
    use super::*;

    #[test]
    fn the_last_kernels_are_kept() {
        let Some(gpu) = Gpu::for_test() else { return };
        let kernel = |number: usize| {
            let source =
                format!("// {number}\n@compute @workgroup_size(1) fn render() {{ return; }}");
            let program = Program { source, bindings: Vec::new() };
            gpu.pipeline(Kernel::Render, program).expect("compiled")
        };
        let [first, second] = [kernel(0), kernel(1)].map(|kernel| Arc::downgrade(&kernel));
        (2..MAX_KEPT_KERNELS).for_each(|number| drop(kernel(number)));
        let again = kernel(0);
        assert!(first.upgrade().is_some_and(|first| Arc::ptr_eq(&first, &again)), "not compiled");
        drop(kernel(MAX_KEPT_KERNELS));
        assert!(second.upgrade().is_none() && first.upgrade().is_some(), "the longest unused goes");
    }
}
