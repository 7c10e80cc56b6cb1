//! What comes back from a device.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use super::buffer::buffer;
use super::device::Gpu;
use crate::error::{Error, Result};
use crate::image::Rgb8;

/// Time between two looks at whether the device has done its work.
const LOOK_GAP: Duration = Duration::from_micros(100);

impl Gpu {
    /// Reads the first `bytes` bytes of a buffer back, once what was submitted has been done.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(crate) fn read_back(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>> {
        let mut commands = self.device.create_command_encoder(&Default::default());
        let staging = self.make(|_| self.staging(bytes))?;
        commands.copy_buffer_to_buffer(source, 0, &staging, 0, bytes);
        self.read_staged(&staging, bytes, commands, <[u8]>::to_vec)
    }

    /// Reads a texture of 8-bit levels back, without its opacity.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(crate) fn read_texture(&self, texture: &wgpu::Texture) -> Result<Rgb8> {
        let (width, height) = (texture.width(), texture.height());
        let row_bytes = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = u64::from(row_bytes) * u64::from(height);
        let staging = self.make(|_| self.staging(bytes))?;
        let mut commands = self.device.create_command_encoder(&Default::default());
        let bytes_per_row = Some(row_bytes);
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row, ..Default::default() };
        commands.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &staging, layout },
            texture.size(),
        );
        let opaque = |bytes: &[u8]| {
            let rows = bytes.chunks_exact(row_bytes as usize);
            let texels = rows.flat_map(|row| row[..4 * width as usize].chunks_exact(4));
            texels.map(|texel| [texel[0], texel[1], texel[2]]).collect()
        };
        Ok(Rgb8 { width, height, pixels: self.read_staged(&staging, bytes, commands, opaque)? })
    }

    /// A buffer of so many bytes for [`Self::read_staged`].
    pub(crate) fn staging(&self, bytes: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        buffer(&self.device, Some("staging"), bytes, usage)
    }

    /// Hands the first `bytes` bytes of a staging buffer to `take` after `commands`, which are submitted.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(super) fn read_staged<R>(
        &self,
        staging: &wgpu::Buffer,
        bytes: u64,
        commands: wgpu::CommandEncoder,
        take: impl FnOnce(&[u8]) -> R,
    ) -> Result<R> {
        let failed = |e: &dyn std::fmt::Display| {
            Error::new(format!("{}: results cannot be read back: {e}", self.facts().name))
        };
        self.submit([commands.finish()]);
        let (sender, receiver) = channel();
        staging.map_async(wgpu::MapMode::Read, ..bytes, move |result| {
            // The receiver waits below, unless the device has failed.
            let _ = sender.send(result);
        });
        if !self.has_window {
            self.wait_for(None)?;
        }
        // While wgpu 30 waits, it holds a lock that presenting a frame takes too: so with a window this
        // looks now and then, for others may have long work under way.
        let mapped = loop {
            match receiver.recv_timeout(LOOK_GAP) {
                Err(RecvTimeoutError::Timeout) => {
                    let _ = self.device.poll(wgpu::PollType::Poll);
                    self.check()?;
                }
                other => break other,
            }
        };
        mapped.map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let taken = take(&staging.get_mapped_range(..bytes).map_err(|e| failed(&e))?);
        staging.unmap();
        Ok(taken)
    }
}
