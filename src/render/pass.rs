//! What one pass of rendering adds.

use crate::sampler::Sequence;

/// A pass of rendering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pass {
    /// Samples that every pixel is to have after it.
    pub(super) target: u32,
    /// Which pixels it is about; on a GPU all.
    pub(super) coverage: Coverage,
    /// Of so many samples one is counted, lest a counter wrap.
    pub(super) stride: u32,
    /// Which points its samples are.
    pub(super) sequence: Sequence,
}

/// Which pixels a pass is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coverage {
    /// All: they share second vertices if the view says so.
    All,
    /// Every so-manyth pixel of every so-manyth row, each for itself.
    Every(u32),
}

/// What a call to render has set going.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Advance {
    /// Samples of all pixels together.
    pub(super) samples: u64,
    /// Fewest samples of any pixel from now on.
    pub(super) least: u32,
}

impl Coverage {
    /// Pixels and rows from one to the next.
    pub(super) fn step(self) -> u32 {
        match self {
            Self::All => 1,
            Self::Every(step) => step,
        }
    }
}

impl Pass {
    /// Brings all pixels to so many samples.
    #[cfg(test)]
    pub(super) fn to(target: u32) -> Self {
        Self { target, coverage: Coverage::All, stride: 1, sequence: Sequence::default() }
    }

    /// Whether sample `sample` of a pixel is counted.
    pub(super) fn counts(self, pixel: u32, sample: u32) -> bool {
        pixel.wrapping_add(sample).is_multiple_of(self.stride)
    }
}
