//! Compute passes: their buffers, pipelines and dispatches.

use std::borrow::Cow;

use bytemuck::Pod;

use crate::render::gpu::{Gpu, buffer};

/// Pixels along a side of a workgroup's tile, as in the shaders.
const TILE: u32 = 8;

/// A storage buffer of this content.
pub(super) fn stored(gpu: &Gpu, content: &[impl Pod]) -> wgpu::Buffer {
    filled(gpu, wgpu::BufferUsages::STORAGE, content)
}

/// A buffer of this content. It is written by the queue, for mapping panics where the device is lost.
pub(super) fn filled(gpu: &Gpu, usage: wgpu::BufferUsages, content: &[impl Pod]) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(content);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let buffer = buffer(&gpu.device, None, bytes.len() as u64, usage);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

pub(super) fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}

/// Pipelines of the entry points `names` of a shader.
pub(super) fn pipelines<const N: usize>(
    gpu: &Gpu,
    label: &str,
    source: Cow<'_, str>,
    names: [&str; N],
) -> [wgpu::ComputePipeline; N] {
    let module = &gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source),
    });
    names.map(|name| {
        gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    })
}

/// One invocation for each pixel.
pub(super) fn dispatch(
    gpu: &Gpu,
    commands: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    entries: &[wgpu::BindGroupEntry<'_>],
    [width, height]: [u32; 2],
) {
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries,
    });
    let mut pass = commands.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(width.div_ceil(TILE), height.div_ceil(TILE), 1);
}
