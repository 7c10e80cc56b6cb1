//! What one pass of rendering adds.

use crate::sampler::Sequence;

/// A pass of rendering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pass {
    /// Samples that every pixel is to have after it.
    pub(super) target: u32,
    /// It is about every so-manyth pixel of every so-manyth row; on a GPU about all.
    pub(super) every: u32,
    /// Whether pixels share second vertices if the view says so; on a GPU they do.
    pub(super) shares: bool,
    /// Of so many samples one is counted, lest a counter wrap.
    pub(super) stride: u32,
    /// Which points its samples are.
    pub(super) sequence: Sequence,
}

impl Pass {
    /// Whether sample `sample` of a pixel is counted.
    pub(super) fn counts(self, pixel: u32, sample: u32) -> bool {
        pixel.wrapping_add(sample).is_multiple_of(self.stride)
    }
}
