//! Buffers, buffer views and the objects around them: everything an index can point at.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use gltf::json::{self, Index};

use super::Fallible;
use super::meshopt::Packed;
use super::uri::{self, Folder, Place};

/// A parsed file with its binary data at hand.
pub(super) struct File<'a> {
    pub(super) root: json::Root,
    pub(super) folder: Folder<'a>,
    /// The binary chunk of a GLB.
    binary: Option<&'a [u8]>,
    /// What has been read so far: each buffer when it is used first, each file once.
    buffers: Vec<OnceLock<Fallible<Arc<Vec<u8>>>>>,
    files: Mutex<BTreeMap<PathBuf, Arc<Vec<u8>>>>,
    /// Buffer views that were packed.
    unpacked: Vec<OnceLock<Fallible<Vec<u8>>>>,
}

impl<'a> File<'a> {
    /// Nothing is read yet.
    pub(super) fn new(root: json::Root, binary: Option<&'a [u8]>, folder: Folder<'a>) -> Self {
        let buffers = root.buffers.iter().map(|_| OnceLock::new()).collect();
        let unpacked = root.buffer_views.iter().map(|_| OnceLock::new()).collect();
        Self { root, folder, binary, buffers, files: Mutex::default(), unpacked }
    }

    /// The bytes of a buffer.
    fn buffer(&self, index: usize) -> Fallible<&[u8]> {
        let buffer = &self.root.buffers[index];
        let Some(uri) = &buffer.uri else {
            // Without a URI, and not first, it is a placeholder that only an extension fills.
            return Ok(self.binary.filter(|_| index == 0).unwrap_or_default());
        };
        let read = self.buffers[index].get_or_init(|| self.read(uri));
        let bytes = read.as_ref().map_err(|cause| format!("buffer {index}: {cause}"))?;
        let promised = buffer.byte_length.0;
        if (bytes.len() as u64) < promised {
            return Err(format!(
                "buffer {index} ({}) is cut off: {promised} bytes are promised and there are {}",
                uri::shown(uri),
                bytes.len()
            ));
        }
        Ok(bytes)
    }

    /// The bytes of a URI; those of a file are read once, however many name it.
    fn read(&self, uri: &str) -> Fallible<Arc<Vec<u8>>> {
        let place = self.folder.place(uri)?;
        let Place::File(path) = &place else { return place.read().map(Arc::new) };
        let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = files.get(path) {
            return Ok(Arc::clone(known));
        }
        let bytes = Arc::new(place.read()?);
        files.insert(path.clone(), Arc::clone(&bytes));
        Ok(bytes)
    }

    /// Bytes of all buffers that can be read together.
    pub(super) fn total_bytes(&self) -> usize {
        (0..self.buffers.len()).filter_map(|index| self.buffer(index).ok()).map(<[u8]>::len).sum()
    }

    /// The bytes of a buffer view and its stride, if it gives one.
    pub(super) fn view(
        &self,
        index: Index<json::buffer::View>,
    ) -> Fallible<(&[u8], Option<usize>)> {
        let view = find(&self.root.buffer_views, index, "buffer view")?;
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        let named = |cause| format!("buffer view {index}: {cause}");
        if let Some(packed) = Packed::of(view).map_err(named)? {
            let unpacked = self.unpacked[index.value()].get_or_init(|| {
                let Packed { buffer, byte_offset, byte_length, .. } = packed;
                packed.unpacked(self.range(buffer, byte_offset, byte_length)?)
            });
            let bytes = unpacked.as_ref().map_err(|cause| named(cause.clone()))?;
            return Ok((bytes, stride));
        }
        let begin = view.byte_offset.map_or(0, |offset| offset.0);
        let bytes = self.range(view.buffer.value(), begin, view.byte_length.0).map_err(named)?;
        Ok((bytes, stride))
    }

    /// Some bytes of a buffer.
    fn range(&self, number: usize, begin: u64, length: u64) -> Fallible<&[u8]> {
        let index = Index::new(u32::try_from(number).unwrap_or(u32::MAX));
        find(&self.root.buffers, index, "buffer")?;
        let buffer = self.buffer(number)?;
        let end = begin.checked_add(length).and_then(|end| usize::try_from(end).ok());
        let range = usize::try_from(begin).ok().zip(end);
        range.and_then(|(begin, end)| buffer.get(begin..end)).ok_or_else(|| {
            let has = buffer.len();
            format!("takes {length} bytes from byte {begin} of buffer {number}, which has {has}")
        })
    }
}

/// The object an index points at, or a sentence that says it is not there.
pub(super) fn find<'a, T>(items: &'a [T], index: Index<T>, kind: &str) -> Fallible<&'a T> {
    items.get(index.value()).ok_or_else(|| {
        format!("{kind} {index} is referred to, but the file has {} of them", items.len())
    })
}
