//! Buffers, buffer views and the objects around them: everything an index can point at.

use std::borrow::Cow;
use std::path::Path;

use gltf::json::{self, Index};

use super::{Fallible, uri};

/// A parsed file with its binary data at hand.
pub(super) struct File<'a> {
    pub(super) root: json::Root,
    pub(super) base_dir: Option<&'a Path>,
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> File<'a> {
    /// Reads all buffers of the file.
    pub(super) fn open(
        root: json::Root,
        binary: Option<&'a [u8]>,
        base_dir: Option<&'a Path>,
    ) -> Fallible<Self> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            let bytes = match (&buffer.uri, binary) {
                (Some(uri), _) => Cow::Owned(
                    uri::read(uri, base_dir).map_err(|cause| format!("buffer {index}: {cause}"))?,
                ),
                (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
                // A placeholder that only an extension fills; views into it are refused below.
                (None, _) => Cow::Borrowed(&[][..]),
            };
            let promised = buffer.byte_length.0;
            if buffer.uri.is_some() && (bytes.len() as u64) < promised {
                return Err(format!(
                    "buffer {index} ({}) is cut off: {promised} bytes are promised and there are {}",
                    uri::shown(buffer.uri.as_deref().unwrap_or_default()),
                    bytes.len()
                ));
            }
            buffers.push(bytes);
        }
        Ok(Self { root, base_dir, buffers })
    }

    /// Bytes of all buffers together.
    pub(super) fn total_bytes(&self) -> usize {
        self.buffers.iter().map(|buffer| buffer.len()).sum()
    }

    /// The bytes of a buffer view and its stride, if it gives one.
    pub(super) fn view(
        &self,
        index: Index<json::buffer::View>,
    ) -> Fallible<(&[u8], Option<usize>)> {
        let view = find(&self.root.buffer_views, index, "buffer view")?;
        find(&self.root.buffers, view.buffer, "buffer")?;
        let buffer = &self.buffers[view.buffer.value()];
        let begin = view.byte_offset.map_or(0, |offset| offset.0);
        let end = begin.checked_add(view.byte_length.0);
        let range = usize::try_from(begin).ok().zip(end.and_then(|end| usize::try_from(end).ok()));
        let bytes = range.and_then(|(begin, end)| buffer.get(begin..end)).ok_or_else(|| {
            format!(
                "buffer view {index} takes {} bytes from byte {begin} of buffer {}, which has {}",
                view.byte_length.0,
                view.buffer,
                buffer.len()
            )
        })?;
        Ok((bytes, view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0)))
    }
}

/// The object an index points at, or a sentence that says it is not there.
pub(super) fn find<'a, T>(items: &'a [T], index: Index<T>, kind: &str) -> Fallible<&'a T> {
    items.get(index.value()).ok_or_else(|| {
        format!("{kind} {index} is referred to, but the file has {} of them", items.len())
    })
}
