//! Buffers on a device.

/// A buffer of `size` bytes without content.
pub(crate) fn buffer(
    device: &wgpu::Device,
    label: Option<&str>,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let mapped_at_creation = false;
    device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation })
}
