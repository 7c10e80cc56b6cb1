//! Accessors: typed elements in a buffer, checked once, then read at random without copying.

use std::borrow::Cow;

use gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::Checked;

use super::buffers::File;
use super::limits::Fallible;

/// Which accessor of the file.
pub(super) type AccessorIndex = json::Index<json::Accessor>;

/// The elements of one accessor. All reads are in bounds once this is built, and nothing is
/// allocated but the indices of sparse accessors.
pub(super) struct Elements<'a> {
    /// How many elements there are.
    pub(super) count: usize,
    /// Components of one element.
    pub(super) components: usize,
    component: ComponentType,
    normalized: bool,
    /// `None` is all zeros.
    base: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements `stride` bytes apart.
struct Strided<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

/// Replacements of a sparse accessor: element numbers in rising order with their row of values.
struct Sparse<'a> {
    elements: Vec<(u32, u32)>,
    values: Strided<'a>,
}

impl<'a> Elements<'a> {
    /// Checks an accessor against its buffers and the element types its user can read.
    pub(super) fn open(file: &'a File<'_>, index: AccessorIndex, types: &[Type]) -> Fallible<Self> {
        let accessor = file.document.accessors.get(index)?;
        Self::of(file, &accessor, types).map_err(|cause| format!("accessor {index}: {cause}"))
    }

    fn of(file: &'a File<'_>, accessor: &json::Accessor, types: &[Type]) -> Fallible<Self> {
        let (Checked::Valid(component), Checked::Valid(kind)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err("its type is unknown to glTF 2.0".into());
        };
        if !types.contains(&kind) {
            return Err(format!("its type {kind:?} does not fit its use"));
        }
        let count = usize::try_from(accessor.count.0).map_err(|_| "its count is too large")?;
        let (component, components) = (component.0, kind.multiplicity());
        let size = component.size() * components;
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let open = |view| Strided::open(file, view, offset, size, count);
        let base = accessor.buffer_view.map(open).transpose()?;
        // Zeros cost no bytes, so a count of them must be held against something that does.
        if base.is_none() && count > file.total_bytes() {
            return Err(format!("{count} elements are claimed without any data"));
        }
        let sparse = accessor.sparse.as_ref();
        let sparse = sparse.map(|it| Sparse::open(file, it, size, count)).transpose()?;
        Ok(Self { count, components, component, normalized: accessor.normalized, base, sparse })
    }

    /// Elements that were unpacked, one after another.
    pub(super) fn unpacked(
        bytes: Vec<u8>,
        component: ComponentType,
        kind: Type,
        normalized: bool,
    ) -> Self {
        let components = kind.multiplicity();
        let stride = component.size() * components;
        let count = bytes.len() / stride;
        let base = Some(Strided { bytes: Cow::Owned(bytes), stride });
        Self { count, components, component, normalized, base, sparse: None }
    }

    /// Reads integers as fractions of their largest value even if the file forgets to say so.
    pub(super) fn with_fractions(self) -> Self {
        Self { normalized: true, ..self }
    }

    /// Whether components are unsigned integers.
    pub(super) fn is_unsigned(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// The first `N` components of an element, zeros where it has fewer or does not exist.
    pub(super) fn floats<const N: usize>(&self, element: usize) -> [f32; N] {
        self.read(element, |bytes| self.float(bytes))
    }

    /// The first `N` components of an element as unsigned integers.
    pub(super) fn integers<const N: usize>(&self, element: usize) -> [u32; N] {
        self.read(element, integer)
    }

    #[inline]
    fn read<T: Default, const N: usize>(&self, element: usize, of: impl Fn(&[u8]) -> T) -> [T; N] {
        let bytes = self.bytes(element).unwrap_or_default();
        let mut values = bytes.chunks(self.component.size()).map(of);
        std::array::from_fn(|_| values.next().unwrap_or_default())
    }

    fn bytes(&self, element: usize) -> Option<&[u8]> {
        if element >= self.count {
            return None;
        }
        let size = self.component.size() * self.components;
        if let Some(sparse) = &self.sparse
            && let Ok(found) =
                sparse.elements.binary_search_by_key(&element, |&(element, _)| element as usize)
        {
            return Some(sparse.values.row(sparse.elements[found].1 as usize, size));
        }
        self.base.as_ref().map(|base| base.row(element, size))
    }

    /// One component; integers by section 3.6.2.2 of the specification when normalized.
    fn float(&self, bytes: &[u8]) -> f32 {
        let (value, largest) = match (self.component, bytes) {
            (ComponentType::I8, &[a]) => (f32::from(a.cast_signed()), 127.0),
            (ComponentType::U8, &[a]) => (f32::from(a), 255.0),
            (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32_767.0),
            (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65_535.0),
            (ComponentType::U32, &[a, b, c, d]) => {
                (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32)
            }
            (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
            _ => return 0.0,
        };
        if self.normalized { (value / largest).max(-1.0) } else { value }
    }
}

/// An unsigned integer of as many bytes, the lowest first.
fn integer(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |word, &byte| word << 8 | u32::from(byte))
}

impl<'a> Strided<'a> {
    /// `count` elements of `size` bytes each from `offset` of a view on.
    fn open(
        file: &'a File<'_>,
        view: json::Index<json::buffer::View>,
        offset: u64,
        size: usize,
        count: usize,
    ) -> Fallible<Self> {
        let (bytes, stride) = file.view(view)?;
        let stride = stride.unwrap_or(size);
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |gaps| gaps.checked_mul(stride)?.checked_add(size));
        let bytes = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if needed <= bytes.len() => {
                Ok(Self { bytes: Cow::Borrowed(bytes), stride })
            }
            _ => Err(format!(
                "{count} elements from byte {offset} on are more than buffer view {view} holds"
            )),
        }
    }

    fn row(&self, element: usize, size: usize) -> &[u8] {
        let begin = element * self.stride;
        &self.bytes[begin..begin + size]
    }
}

impl<'a> Sparse<'a> {
    fn open(
        file: &'a File<'_>,
        sparse: &json::accessor::sparse::Sparse,
        size: usize,
        count: usize,
    ) -> Fallible<Self> {
        let rows = usize::try_from(sparse.count.0)
            .map_err(|_| "its count of sparse elements is too large")?;
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err("the type of its sparse indices is unknown to glTF 2.0".into());
        };
        let width = component.0.size();
        let (indices, values) = (&sparse.indices, &sparse.values);
        let offset = indices.byte_offset.0;
        let indices = Strided::open(file, indices.buffer_view, offset, width, rows)?;
        let values = Strided::open(file, values.buffer_view, values.byte_offset.0, size, rows)?;
        let mut elements = Vec::with_capacity(rows);
        for row in 0..rows {
            let element = integer(indices.row(row, width));
            if element as usize >= count {
                return Err(format!("its sparse element {element} is beyond its {count} elements"));
            }
            elements.push((element, row as u32));
        }
        // Rising by the specification; files that differ are sorted, the last of equals wins.
        elements.sort_by_key(|&(element, row)| (element, std::cmp::Reverse(row)));
        elements.dedup_by_key(|&mut (element, _)| element);
        Ok(Self { elements, values })
    }
}
