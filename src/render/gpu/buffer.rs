//! Buffers and textures on a device.

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

/// A texture of two dimensions and one level without content.
pub(crate) fn texture(
    device: &wgpu::Device,
    label: Option<&str>,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
