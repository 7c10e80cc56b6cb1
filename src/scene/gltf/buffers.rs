//! Buffers, buffer views and the objects around them: everything an index can point at.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use gltf::json::buffer::View;
use gltf::json::validation::USize64;
use gltf::json::{self, Index};
use serde::Deserialize;
use serde_json::value::RawValue;

use super::document::Document;
use super::limits::Fallible;
use super::meshopt::Packed;
use super::objects::not_gltf;
use super::uri::{self, Folder, Place};

/// A parsed file with its binary data at hand.
pub(super) struct File<'a> {
    pub(super) document: Document<'a>,
    pub(super) folder: Folder<'a>,
    /// The binary chunk of a GLB.
    binary: Option<&'a [u8]>,
    /// What has been read so far: each buffer that has a URI when it is used first, each file once.
    buffers: Slots<Option<Arc<Vec<u8>>>>,
    files: Mutex<BTreeMap<PathBuf, Arc<Vec<u8>>>>,
    /// Buffer views that were packed.
    unpacked: Slots<Vec<u8>>,
}

/// What is made of some of the file's objects, each once. There is nothing until the first is asked for.
struct Slots<T>(OnceLock<Vec<Slot<T>>>);

/// Small where nothing is.
type Slot<T> = OnceLock<Box<Fallible<T>>>;

impl<T> Slots<T> {
    /// What there is of one of `count` objects.
    fn get(
        &self,
        index: usize,
        count: usize,
        make: impl FnOnce() -> Fallible<T>,
    ) -> Result<&T, &String> {
        let slots = self.0.get_or_init(|| (0..count).map(|_| OnceLock::new()).collect());
        slots[index].get_or_init(|| Box::new(make())).as_ref().as_ref()
    }
}

/// What a buffer promises, if it does.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Length {
    byte_length: Option<USize64>,
}

/// Where an object's data are.
#[derive(Deserialize)]
struct Named<'a> {
    #[serde(borrow)]
    uri: Option<&'a RawValue>,
}

/// The URI of an object, given its text; not copied unless it has escapes, for it may be all of its data.
pub(super) fn uri_of(object: &str) -> Fallible<Option<Cow<'_, str>>> {
    let mut reader = serde_json::Deserializer::from_str(object);
    let uri = Named::deserialize(&mut reader).and_then(|named| {
        let Some(uri) = named.uri.map(RawValue::get) else { return Ok(None) };
        let plain = serde_json::from_str(uri).map(Cow::Borrowed);
        plain.or_else(|_| serde_json::from_str(uri).map(Cow::Owned)).map(Some)
    });
    uri.map_err(|cause| not_gltf(&cause.to_string()))
}

impl<'a> File<'a> {
    /// Nothing is read yet.
    pub(super) fn new(
        document: Document<'a>,
        binary: Option<&'a [u8]>,
        folder: Folder<'a>,
    ) -> Self {
        let (buffers, unpacked) = (Slots(OnceLock::new()), Slots(OnceLock::new()));
        Self { document, folder, binary, buffers, files: Mutex::default(), unpacked }
    }

    /// Refuses to be read where one of the files that it names will be written, be it used or not.
    pub(super) fn check_outputs(&self, outputs: &[PathBuf]) -> Fallible<()> {
        let there: Vec<PathBuf> =
            outputs.iter().filter_map(|path| path.canonicalize().ok()).collect();
        if there.is_empty() {
            return Ok(());
        }
        let Document { buffers, images, .. } = &self.document;
        let texts = buffers.indices().map(|index| buffers.text(index));
        for text in texts.chain(images.indices().map(|index| images.text(index))) {
            // What cannot be found is nothing that could be lost.
            let Ok(Some(uri)) = uri_of(text?) else { continue };
            let Ok(Place::File(path)) = self.folder.place(uri) else { continue };
            if there.contains(&path) {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                return Err(format!("`{name}` is its data and would be written over"));
            }
        }
        Ok(())
    }

    /// The bytes of a buffer.
    fn buffer(&self, index: Index<json::Buffer>) -> Fallible<&[u8]> {
        let text = self.document.buffers.text(index)?;
        let count = self.document.buffers.len();
        let named = |cause: String| format!("buffer {index}: {cause}");
        let read = || {
            let length: Length = self.document.buffers.get_as(index).map_err(named)?;
            let Some(uri) = uri_of(text).map_err(named)? else { return Ok(None) };
            let bytes = self.read(&uri).map_err(named)?;
            let promised = length.byte_length.map_or(0, |length| length.0);
            if (bytes.len() as u64) < promised {
                return Err(format!(
                    "buffer {index} ({}) is cut off: {promised} bytes are promised and there are {}",
                    uri::shown(&uri),
                    bytes.len()
                ));
            }
            Ok(Some(bytes))
        };
        match self.buffers.get(index.value(), count, read) {
            Ok(Some(bytes)) => Ok(bytes),
            // Without a URI, and not first, it is a placeholder that only an extension fills.
            Ok(None) => Ok(self.binary.filter(|_| index.value() == 0).unwrap_or_default()),
            Err(cause) => Err(cause.clone()),
        }
    }

    /// The bytes of a URI; those of a file are read once, however many name it.
    fn read(&self, uri: &str) -> Fallible<Arc<Vec<u8>>> {
        let place = self.folder.place(uri.into())?;
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
        let buffers = self.document.buffers.indices().filter_map(|index| self.buffer(index).ok());
        // Several may be of one file.
        let lengths: BTreeMap<_, _> = buffers.map(|bytes| (bytes.as_ptr(), bytes.len())).collect();
        lengths.values().sum()
    }

    /// The bytes of a buffer view and its stride, if it gives one.
    pub(super) fn view(&self, index: Index<View>) -> Fallible<(&[u8], Option<usize>)> {
        let views = &self.document.buffer_views;
        let view = views.get(index)?;
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        let named = |cause: String| format!("buffer view {index}: {cause}");
        if let Some(packed) = Packed::of(&view).map_err(named)? {
            let unpacked = self.unpacked.get(index.value(), views.len(), || {
                let Packed { buffer, byte_offset, byte_length, .. } = packed;
                packed.unpacked(self.range(buffer, byte_offset, byte_length)?)
            });
            let bytes = unpacked.map_err(|cause| named(cause.clone()))?;
            return Ok((bytes, stride));
        }
        let begin = view.byte_offset.map_or(0, |offset| offset.0);
        let bytes = self.range(view.buffer.value(), begin, view.byte_length.0).map_err(named)?;
        Ok((bytes, stride))
    }

    /// Some bytes of a buffer.
    fn range(&self, number: usize, begin: u64, length: u64) -> Fallible<&[u8]> {
        let buffer = self.buffer(Index::new(u32::try_from(number).unwrap_or(u32::MAX)))?;
        let end = begin.checked_add(length).and_then(|end| usize::try_from(end).ok());
        let range = usize::try_from(begin).ok().zip(end);
        range.and_then(|(begin, end)| buffer.get(begin..end)).ok_or_else(|| {
            let has = buffer.len();
            format!("takes {length} bytes from byte {begin} of buffer {number}, which has {has}")
        })
    }
}
