//! Texels of pictures with 8 bits a channel.

use std::borrow::Cow;
use std::ops::Range;

/// 8-bit texels with the channels that a picture has: grey, grey and alpha, RGB, or RGBA.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texels {
    channels: usize,
    bytes: Vec<u8>,
}

impl<const CHANNELS: usize> From<Vec<[u8; CHANNELS]>> for Texels {
    fn from(texels: Vec<[u8; CHANNELS]>) -> Self {
        Self::new(CHANNELS, texels.into_flattened())
    }
}

impl Texels {
    /// Texels of one to four channels each, one after another.
    pub(crate) fn new(channels: usize, bytes: Vec<u8>) -> Self {
        assert!((1..=4).contains(&channels) && bytes.len().is_multiple_of(channels));
        Self { channels, bytes }
    }

    /// Without an alpha that is 255 everywhere.
    pub(crate) fn without_opaque_alpha(mut self) -> Self {
        match self.channels {
            2 => self.drop_opaque_alpha::<2>(),
            4 => self.drop_opaque_alpha::<4>(),
            _ => {}
        }
        self
    }

    fn drop_opaque_alpha<const CHANNELS: usize>(&mut self) {
        let is_opaque = |texel: &[u8; CHANNELS]| texel[CHANNELS - 1] == 255;
        if !self.chunks::<CHANNELS>().iter().all(is_opaque) {
            return;
        }
        let (count, colors) = (self.len(), CHANNELS - 1);
        for i in 1..count {
            self.bytes.copy_within(i * CHANNELS..i * CHANNELS + colors, i * colors);
        }
        self.bytes.truncate(count * colors);
        self.bytes.shrink_to_fit();
        self.channels = colors;
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.channels
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// One to four.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All channels of all texels, texel after texel.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Texels of so many channels, if it is the number that they have.
    #[inline]
    pub(crate) fn chunks<const CHANNELS: usize>(&self) -> &[[u8; CHANNELS]] {
        self.bytes.as_chunks().0
    }

    /// All texels as RGBA; alpha is 255 where there is none.
    pub fn rgba(&self) -> Cow<'_, [[u8; 4]]> {
        self.rgba_of(0..self.len())
    }

    /// A range of texels as RGBA.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn rgba_of(&self, range: Range<usize>) -> Cow<'_, [[u8; 4]]> {
        match self.channels {
            1 => self.chunks()[range].iter().map(|&[l]| [l, l, l, 255]).collect(),
            2 => self.chunks()[range].iter().map(|&[l, a]| [l, l, l, a]).collect(),
            3 => self.chunks()[range].iter().map(|&[r, g, b]| [r, g, b, 255]).collect(),
            _ => Cow::Borrowed(&self.chunks()[range]),
        }
    }

    /// The same in memory that `moved` gives.
    pub(crate) fn moved(self, moved: impl FnOnce(Vec<u8>) -> Vec<u8>) -> Self {
        Self { bytes: moved(self.bytes), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_of_any_channels_are_read_as_rgba() {
        let read = |texels: Texels| texels.rgba().into_owned();
        assert_eq!(read(vec![[7], [9]].into()), [[7, 7, 7, 255], [9, 9, 9, 255]]);
        assert_eq!(read(vec![[7, 1], [9, 2]].into()), [[7, 7, 7, 1], [9, 9, 9, 2]]);
        assert_eq!(read(vec![[1, 2, 3], [4, 5, 6]].into()), [[1, 2, 3, 255], [4, 5, 6, 255]]);
        assert_eq!(read(vec![[1, 2, 3, 4]].into()), [[1, 2, 3, 4]]);
        let texels = Texels::from(vec![[1, 2, 3], [4, 5, 6], [7, 8, 9]]);
        assert_eq!(*texels.rgba_of(1..2), [[4, 5, 6, 255]]);
    }

    #[test]
    fn only_an_alpha_that_says_nothing_is_left_out() {
        let opaque = Texels::from(vec![[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]]);
        let (before, after) = (opaque.rgba(), opaque.clone().without_opaque_alpha());
        assert_eq!((after.channels(), after.rgba()), (3, before));
        let grey = Texels::from(vec![[7, 255], [9, 255]]).without_opaque_alpha();
        assert_eq!((grey.channels(), grey.bytes()), (1, &[7, 9][..]));
        for some in [Texels::from(vec![[1, 2, 3, 255], [4, 5, 6, 254]]), vec![[1, 255, 255]].into()]
        {
            assert_eq!(some.clone().without_opaque_alpha(), some);
        }
        assert!(Texels::from(Vec::<[u8; 4]>::new()).without_opaque_alpha().is_empty());
    }
}
