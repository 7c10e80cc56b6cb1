//! The picture so far, where the device has it.

/// Sums of every pixel on the device, row after row; clones are the same film. The renderer adds to
/// them between submissions of the device's queue, so that they may be read at any moment.
#[derive(Clone, PartialEq)]
pub(crate) struct DeviceFilm {
    /// A `vec4f` a pixel: sum of radiance, sum of squared luminance.
    pub(crate) sum: wgpu::Buffer,
    /// A `vec4u` a pixel: samples, invalid ones among them, rays, 0.
    pub(crate) counts: wgpu::Buffer,
    /// A `FirstHit` a pixel, as in `path.wgsl`, if layers are asked for: sums over hits.
    pub(crate) surfaces: Option<wgpu::Buffer>,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
}
