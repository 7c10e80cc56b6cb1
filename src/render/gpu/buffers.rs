//! Buffers and arrays by name.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use wgpu::{Buffer, BufferUsages, TextureUsages as Usages};

use super::buffer::{buffer, texture};
use super::device::Gpu;
use super::shader::{ARRAYS, ArrayPlaces};
use crate::error::{Error, Result};

/// Everything the kernels bind, by the name of its variable. Clones share what was made before.
#[derive(Clone)]
pub(super) struct Buffers {
    pub(super) gpu: Gpu,
    by_name: BTreeMap<&'static str, Buffer>,
    /// With the bytes that each takes.
    arrays: BTreeMap<&'static str, (wgpu::TextureView, u64)>,
    /// The driver's tree of the scene, if rays are traced by the device's own queries.
    pub(super) tree: Option<wgpu::Tlas>,
    /// Texels of a row of every array, as a power of two.
    width_log2: u32,
    /// Changes whenever another buffer or array takes the place of one.
    pub(super) version: u64,
    staging: Arc<Mutex<Option<Buffer>>>,
    bytes_read: Arc<AtomicU64>,
}

/// Arrays of at most so many rows have a power of two of them.
const SMALL_ROWS: u64 = 64;

/// Most bytes written to the device at once: they are copied in host memory first.
pub(super) const PIECE_BYTES: usize = 16 << 20;

impl Buffers {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let width_log2 = gpu.limits.max_texture_dimension_2d.ilog2().min(14);
        Self {
            gpu: gpu.clone(),
            by_name: BTreeMap::new(),
            arrays: BTreeMap::new(),
            tree: None,
            width_log2,
            version: 0,
            staging: Arc::default(),
            bytes_read: Arc::default(),
        }
    }

    /// The same, with figures of its own.
    pub(super) fn for_renderer(&self) -> Self {
        Self { bytes_read: Arc::default(), ..self.clone() }
    }

    /// Where each array lies that is there, and where those will that are not.
    pub(super) fn array_places(&self) -> ArrayPlaces {
        let names = ARRAYS.into_iter().map(|kind| kind.name);
        let in_buffers =
            names.filter(|name| self.gpu.prefers_buffers && self.array(name).is_none());
        ArrayPlaces { width_log2: self.width_log2, in_buffers: in_buffers.collect() }
    }

    /// The buffer of a binding.
    pub(super) fn get(&self, name: &str) -> Option<&Buffer> {
        self.by_name.get(name)
    }

    /// The view of an array's texture.
    pub(super) fn array(&self, name: &str) -> Option<&wgpu::TextureView> {
        self.arrays.get(name).map(|(view, _)| view)
    }

    /// Bytes of all buffers and arrays.
    pub(super) fn bytes(&self) -> u64 {
        self.by_name.values().map(Buffer::size).sum::<u64>()
            + self.arrays.values().map(|(_, bytes)| bytes).sum::<u64>()
    }

    /// Makes an empty buffer, or an empty one in place of the one of this name. `what` is said if it
    /// does not fit.
    pub(super) fn make(&mut self, name: &'static str, bytes: u64, what: &str) -> Result<()> {
        if bytes > self.most_bytes() {
            return Err(Error::new(format!(
                "{what} takes {} MiB; {} allows {} MiB in one buffer",
                bytes.div_ceil(1 << 20),
                self.gpu.facts().name,
                self.most_bytes() >> 20
            )));
        }
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let size = bytes.next_multiple_of(16).max(16);
        let buffer = self.gpu.make(|device| buffer(device, Some(name), size, usage));
        self.by_name.insert(name, buffer.map_err(|e| for_want_of(bytes, what, &e))?);
        self.version += 1;
        Ok(())
    }

    /// Makes a buffer of these bytes, or reuses the one of this name if they fit into it.
    pub(super) fn put(&mut self, name: &'static str, bytes: &[u8], what: &str) -> Result<()> {
        if self.get(name).is_none_or(|buffer| buffer.size() < bytes.len() as u64) {
            self.make(name, bytes.len() as u64, what)?;
        }
        self.write(name, 0, bytes);
        self.gpu.check()
    }

    /// Makes one of [`ARRAYS`] of `texels` texels whose bytes `parts` yields one after another.
    pub(super) fn put_array<'b>(
        &mut self,
        name: &'static str,
        what: &str,
        texels: u64,
        parts: impl Iterator<Item = Cow<'b, [u8]>>,
    ) -> Result<()> {
        let Some(kind) = ARRAYS.into_iter().find(|kind| kind.name == name) else { return Ok(()) };
        let bytes = texels * kind.texel_bytes();
        // A kernel may have been made for distributions in a buffer.
        if self.gpu.prefers_buffers && (bytes <= self.most_bytes() || name == "distributions") {
            self.arrays.remove(name);
            // Never in place, for others may share the old one.
            self.make(name, bytes, what)?;
            let mut offset = 0;
            for part in parts {
                for piece in part.chunks(PIECE_BYTES) {
                    self.write(name, offset, piece);
                    offset += piece.len() as u64;
                    self.gpu.finish_copies()?;
                }
            }
            return Ok(());
        }
        let (width, most) = (1_u64 << self.width_log2, self.gpu.limits.max_texture_dimension_2d);
        let rows = texels.div_ceil(width).max(1);
        // Software Vulkan compiles a kernel anew where a texture's height becomes a power of two or
        // ceases to be one, as that of the distributions did while they grew.
        let rows = if rows <= SMALL_ROWS { rows.next_power_of_two() } else { rows };
        if rows > u64::from(most) {
            return Err(Error::new(format!(
                "{what} takes {} MiB; {} allows {} MiB for it",
                (texels * kind.texel_bytes()) >> 20,
                self.gpu.facts().name,
                (width * u64::from(most) * kind.texel_bytes()) >> 20
            )));
        }
        let bytes = rows * width * kind.texel_bytes();
        let (size, usage) =
            ([width as u32, rows as u32], Usages::TEXTURE_BINDING | Usages::COPY_DST);
        let texture = self.gpu.make(|device| texture(device, Some(name), size, kind.format, usage));
        let texture = texture.map_err(|e| for_want_of(bytes, what, &e))?;
        self.upload(&texture, kind.texel_bytes(), parts)?;
        self.by_name.remove(name);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        self.arrays.insert(name, (view, bytes));
        self.version += 1;
        Ok(())
    }

    /// Fills whole rows first; what is left of a part waits for the next.
    fn upload<'b>(
        &self,
        texture: &wgpu::Texture,
        texel_bytes: u64,
        parts: impl Iterator<Item = Cow<'b, [u8]>>,
    ) -> Result<()> {
        let row_bytes = (texel_bytes << self.width_log2) as usize;
        let piece = (PIECE_BYTES / row_bytes).max(1) * row_bytes;
        let (mut waiting, mut row) = (Vec::new(), 0);
        for part in parts {
            let mut rest = &part[..];
            while !rest.is_empty() {
                let taken = rest.len().min(piece - waiting.len());
                waiting.extend_from_slice(&rest[..taken]);
                rest = &rest[taken..];
                if waiting.len() == piece {
                    row += self.write_rows(texture, row, row_bytes, &waiting)?;
                    waiting.clear();
                }
            }
        }
        waiting.resize(waiting.len().next_multiple_of(row_bytes), 0);
        self.write_rows(texture, row, row_bytes, &waiting).map(|_| ())
    }

    /// Writes whole rows and waits for the copy; returns how many they were.
    fn write_rows(
        &self,
        texture: &wgpu::Texture,
        row: u32,
        row_bytes: usize,
        bytes: &[u8],
    ) -> Result<u32> {
        let rows = (bytes.len() / row_bytes) as u32;
        if rows == 0 {
            return Ok(0);
        }
        let mut place = texture.as_image_copy();
        place.origin.y = row;
        let bytes_per_row = Some(row_bytes as u32);
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row, ..Default::default() };
        let size =
            wgpu::Extent3d { width: 1 << self.width_log2, height: rows, ..Default::default() };
        self.gpu.queue.write_texture(place, bytes, layout, size);
        self.gpu.finish_copies()?;
        Ok(rows)
    }

    /// Fills a buffer that exists with zeros.
    pub(super) fn clear(&self, name: &str) {
        if let Some(buffer) = self.get(name) {
            let mut commands = self.gpu.device.create_command_encoder(&Default::default());
            commands.clear_buffer(buffer, 0, None);
            self.gpu.submit([commands.finish()]);
        }
    }

    /// Writes into a buffer that exists.
    pub(super) fn write(&self, name: &str, offset: u64, bytes: &[u8]) {
        if let Some(buffer) = self.get(name).filter(|_| !bytes.is_empty()) {
            self.gpu.queue.write_buffer(buffer, offset, bytes);
        }
    }

    /// Waits for the device, reads parts of buffers back (name, offset, bytes; all in fours) and hands
    /// them to `take`.
    pub(super) fn read<R>(
        &self,
        parts: &[(&str, u64, u64)],
        take: impl FnOnce(&[&[u8]]) -> R,
    ) -> Result<R> {
        self.gpu.check()?;
        let bytes = parts.iter().map(|(.., bytes)| bytes).sum();
        let staging = self.staging(bytes)?;
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        let mut at = 0;
        for &(name, offset, bytes) in parts {
            let missing = || Error::new(format!("there is no buffer {name} to be read back"));
            let source = self.get(name).ok_or_else(missing)?;
            commands.copy_buffer_to_buffer(source, offset, &staging, at, bytes);
            at += bytes;
        }
        let taken = self.gpu.read_staged(&staging, bytes, commands, |mut rest| {
            let part = |bytes: u64| rest.split_off(..bytes as usize).expect("all were copied");
            take(&parts.iter().map(|(.., bytes)| *bytes).map(part).collect::<Vec<_>>())
        })?;
        self.bytes_read.fetch_add(bytes, Ordering::Relaxed);
        *self.staging.lock().unwrap_or_else(PoisonError::into_inner) = Some(staging);
        Ok(taken)
    }

    /// A buffer the host can read, kept from one reading to the next. It is made anew after a failure.
    fn staging(&self, bytes: u64) -> Result<Buffer> {
        let kept = self.staging.lock().unwrap_or_else(PoisonError::into_inner).take();
        let kept = kept.filter(|kept| kept.size() >= bytes);
        kept.map_or_else(|| self.gpu.make(|_| self.gpu.staging(bytes)), Ok)
    }

    /// Bytes read back so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    fn most_bytes(&self) -> u64 {
        let limits = &self.gpu.limits;
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) & !0xf
    }
}

/// What is said if so many bytes could not be had.
fn for_want_of(bytes: u64, what: &str, error: &Error) -> Error {
    Error::new(format!("{error} ({what} takes {} MiB)", bytes.div_ceil(1 << 20)))
}
