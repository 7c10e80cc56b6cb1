//! Buffers by name, large arrays in as many bindings as they need.

use std::collections::BTreeMap;

use wgpu::{Buffer, BufferDescriptor, BufferUsages};

use super::device::Gpu;
use super::shader::{SPLIT_ARRAYS, SplitArray, chunk_name};
use crate::error::{Error, Result};

/// Every buffer the kernels bind, by the name of its variable.
pub(super) struct Buffers<'a> {
    gpu: &'a Gpu,
    by_name: BTreeMap<String, Buffer>,
    splits: Vec<SplitArray>,
}

/// Most bytes written to the device at once: they are copied in host memory first.
const PIECE_BYTES: usize = 16 << 20;

impl<'a> Buffers<'a> {
    pub(super) fn new(gpu: &'a Gpu) -> Self {
        Self { gpu, by_name: BTreeMap::new(), splits: Vec::new() }
    }

    /// How large arrays are split.
    pub(super) fn splits(&self) -> &[SplitArray] {
        &self.splits
    }

    /// The buffer of a binding.
    pub(super) fn get(&self, name: &str) -> Option<&Buffer> {
        self.by_name.get(name)
    }

    /// Bytes of all buffers.
    pub(super) fn bytes(&self) -> u64 {
        self.by_name.values().map(Buffer::size).sum()
    }

    /// Makes an empty buffer, or an empty one in place of the one of this name. `what` is said if it
    /// does not fit.
    pub(super) fn make(&mut self, name: &str, bytes: u64, what: &str) -> Result<()> {
        self.fits(bytes, what)?;
        let buffer = self.create(name, bytes);
        self.by_name.insert(name.to_owned(), buffer);
        self.gpu.check()
    }

    /// Makes a buffer of these bytes, or reuses the one of this name if they fit into it.
    pub(super) fn put(&mut self, name: &str, bytes: &[u8], what: &str) -> Result<()> {
        if self.get(name).is_none_or(|buffer| buffer.size() < bytes.len() as u64) {
            self.make(name, bytes.len() as u64, what)?;
        }
        self.write(name, 0, bytes);
        self.gpu.check()
    }

    /// Makes one of [`SPLIT_ARRAYS`] out of `bytes` bytes that `parts` yields piece by piece.
    pub(super) fn put_split<'b>(
        &mut self,
        name: &'static str,
        what: &str,
        bytes: u64,
        parts: impl Iterator<Item = std::borrow::Cow<'b, [u8]>>,
    ) -> Result<()> {
        let element_bytes =
            SPLIT_ARRAYS.iter().find(|(n, ..)| *n == name).map_or(4, |(_, _, bytes)| *bytes) as u64;
        let most = self.most_bytes() / element_bytes * element_bytes;
        let bytes = bytes.max(element_bytes);
        let chunks = bytes.div_ceil(most);
        if chunks > MAX_CHUNKS {
            return Err(Error::new(format!(
                "{what} takes {} MiB; {} allows {MAX_CHUNKS} buffers of {} MiB for it",
                bytes >> 20,
                self.gpu.facts().name,
                most >> 20
            )));
        }
        for chunk in 0..chunks {
            let size = most.min(bytes - chunk * most);
            self.make(&chunk_name(name, chunk as u32), size, what)?;
        }
        let mut at = 0;
        for part in parts {
            for piece in part.chunks(PIECE_BYTES) {
                self.write_split(name, most, at, piece);
                at += piece.len() as u64;
                // Staging memory is given back once the device has copied it.
                self.gpu.queue.submit([]);
                self.gpu.wait_for(None)?;
            }
        }
        let chunk_elements = (most / element_bytes) as u32;
        self.splits.push(SplitArray { name, chunks: chunks as u32, chunk_elements });
        Ok(())
    }

    fn write_split(&self, name: &str, chunk_bytes: u64, at: u64, bytes: &[u8]) {
        let (mut at, mut rest) = (at, bytes);
        while !rest.is_empty() {
            let (chunk, offset) = (at / chunk_bytes, at % chunk_bytes);
            let length = (chunk_bytes - offset).min(rest.len() as u64) as usize;
            self.write(&chunk_name(name, chunk as u32), offset, &rest[..length]);
            at += length as u64;
            rest = &rest[length..];
        }
    }

    /// Writes into a buffer that exists.
    pub(super) fn write(&self, name: &str, offset: u64, bytes: &[u8]) {
        if let Some(buffer) = self.get(name).filter(|_| !bytes.is_empty()) {
            self.gpu.queue.write_buffer(buffer, offset, bytes);
        }
    }

    /// Reads the first `bytes` bytes of a buffer back.
    pub(super) fn read(&self, name: &str, bytes: u64) -> Result<Vec<u8>> {
        let failed = |e: &dyn std::fmt::Display| {
            Error::new(format!("{}: results cannot be read back: {e}", self.gpu.facts().name))
        };
        let Some(source) = self.get(name) else { return Err(failed(&"no such buffer")) };
        let device = &self.gpu.device;
        let staging = device.create_buffer(&BufferDescriptor {
            label: Some("staging"),
            size: bytes,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut commands = device.create_command_encoder(&Default::default());
        commands.copy_buffer_to_buffer(source, 0, &staging, 0, bytes);
        let submission = self.gpu.queue.submit([commands.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = sender.send(result);
        });
        self.gpu.wait_for(Some(submission))?;
        match receiver.recv() {
            Ok(Ok(())) => {}
            Ok(Err(e)) => return Err(failed(&e)),
            Err(e) => return Err(failed(&e)),
        }
        let view = staging.get_mapped_range(..).map_err(|e| failed(&e))?;
        Ok(view.to_vec())
    }

    fn most_bytes(&self) -> u64 {
        let limits = &self.gpu.limits;
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) & !0xf
    }

    fn fits(&self, bytes: u64, what: &str) -> Result<()> {
        if bytes <= self.most_bytes() {
            return Ok(());
        }
        Err(Error::new(format!(
            "{what} takes {} MiB; {} allows {} MiB in one buffer",
            bytes.div_ceil(1 << 20),
            self.gpu.facts().name,
            self.most_bytes() >> 20
        )))
    }

    fn create(&self, name: &str, bytes: u64) -> Buffer {
        self.gpu.device.create_buffer(&BufferDescriptor {
            label: Some(name),
            size: bytes.next_multiple_of(16).max(16),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    }
}

/// Bindings one array may take.
const MAX_CHUNKS: u64 = 16;
