//! Texels of pictures with 8 or 16 bits a channel.

use std::borrow::Cow;
use std::ops::Range;

/// Texels with the channels that a picture has: grey, grey and alpha, RGB, or RGBA; of 8 bits, or of 16
/// where it has more than 8.
///
/// Of 16 bits there are two planes, each as texels of 8 bits: first of all high bytes, then of all low ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texels {
    channels: usize,
    is_deep: bool,
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
        Self { channels, is_deep: false, bytes }
    }

    /// The same of 16 bits a channel; they are kept if one of them is not 8 bits written in 16.
    ///
    /// # Panics
    /// If a texel has no channels, more than four, or not all of them.
    pub fn deep(channels: usize, values: &[u16]) -> Self {
        let high = values.iter().map(|value| value.to_be_bytes()[0]);
        let is_deep = values.iter().any(|value| !value.is_multiple_of(257));
        let low = values.iter().map(|value| value.to_be_bytes()[1]).filter(|_| is_deep);
        // Asked for at once: a chain of iterators does not know its length.
        let mut bytes = Vec::with_capacity(values.len() << u32::from(is_deep));
        bytes.extend(high.chain(low));
        Self { is_deep, ..Self::new(channels, bytes) }
    }

    /// Without an alpha that is 1 everywhere.
    pub(crate) fn without_opaque_alpha(mut self) -> Self {
        let (count, channels, colors) = (self.stored_len(), self.channels, self.channels - 1);
        let is_opaque = |texel: &[u8]| texel[colors] == 255;
        if !matches!(channels, 2 | 4) || !self.bytes.chunks_exact(channels).all(is_opaque) {
            return self;
        }
        for i in 1..count {
            self.bytes.copy_within(i * channels..i * channels + colors, i * colors);
        }
        self.bytes.truncate(count * colors);
        self.bytes.shrink_to_fit();
        self.channels = colors;
        self
    }

    /// Grey made of what an opacity in `[0,1]` becomes, in as many bits; `None` if there is no alpha.
    pub(crate) fn map_alpha(&self, of: impl Fn(f32) -> f32) -> Option<Self> {
        if !matches!(self.channels, 2 | 4) {
            return None;
        }
        let turned = |alpha: f32, most: f32| (of(alpha / most).clamp(0.0, 1.0) * most).round();
        if self.is_deep {
            let alpha = (0..self.len()).map(|at| f32::from(self.deep_rgba(at)[3]));
            let values: Vec<u16> = alpha.map(|a| turned(a, f32::from(u16::MAX)) as u16).collect();
            return Some(Self::deep(1, &values));
        }
        let alpha = self.bytes.chunks_exact(self.channels).map(|t| f32::from(t[self.channels - 1]));
        Some(Self::new(1, alpha.map(|a| turned(a, 255.0) as u8).collect()))
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        self.stored_len() >> u32::from(self.is_deep)
    }

    /// Number of texels of 8 bits a channel that they are kept in.
    pub(crate) fn stored_len(&self) -> usize {
        self.bytes.len() / self.channels
    }

    /// Whether they have 16 bits a channel.
    pub fn is_deep(&self) -> bool {
        self.is_deep
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// One to four.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All channels of all texels, texel after texel; of 16 bits first all high bytes, then all low ones.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Texels of so many channels, if it is the number that they have; of 16 bits both planes.
    #[inline]
    pub(crate) fn chunks<const CHANNELS: usize>(&self) -> &[[u8; CHANNELS]] {
        self.bytes.as_chunks().0
    }

    /// A texel of 16 bits as RGBA.
    ///
    /// # Panics
    /// If there are not so many, or they have 8.
    pub(crate) fn deep_rgba(&self, index: usize) -> [u16; 4] {
        let channel = |channel| {
            let at = index * self.channels + channel;
            u16::from_be_bytes([self.bytes[at], self.bytes[self.bytes.len() / 2 + at]])
        };
        let (grey, alpha) = (channel(0), channel(self.channels - 1));
        match self.channels {
            1 => [grey, grey, grey, u16::MAX],
            2 => [grey, grey, grey, alpha],
            3 => [grey, channel(1), channel(2), u16::MAX],
            _ => [grey, channel(1), channel(2), alpha],
        }
    }

    /// All texels as RGBA of 8 bits; alpha is 255 where there is none. Of 16 bits they are the high ones.
    pub fn rgba(&self) -> Cow<'_, [[u8; 4]]> {
        self.rgba_of(0..self.len())
    }

    /// A range of texels as RGBA of 8 bits; of 16 bits the high ones are followed by the low ones.
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

    #[test]
    fn sixteen_bits_are_kept_where_they_say_more_than_eight() {
        let values = [[0x0102, 0xffff], [0x0304, 0xffff], [0x0506, 0xffff]];
        let both = Texels::deep(2, values.as_flattened());
        assert_eq!((both.len(), both.stored_len(), both.is_deep()), (3, 6, true));
        assert_eq!(both.deep_rgba(1), [0x0304, 0x0304, 0x0304, 0xffff]);
        let grey = both.clone().without_opaque_alpha();
        assert_eq!((grey.channels(), grey.bytes()), (1, &[1, 3, 5, 2, 4, 6][..]));
        assert!((0..3).all(|i| grey.deep_rgba(i) == both.deep_rgba(i)));
        // The device's array has the planes one after another, too.
        assert_eq!(both.rgba_of(2..4)[..], [[5, 5, 5, 255], [2, 2, 2, 255]]);

        let color = Texels::deep(3, &[1, 2, 3, 0x4000, 0x5000, 0xffff]);
        assert_eq!(color.deep_rgba(1), [0x4000, 0x5000, 0xffff, 0xffff]);
        let all = Texels::deep(4, &[1, 2, 3, 4]).without_opaque_alpha();
        assert_eq!((all.channels(), all.deep_rgba(0)), (4, [1, 2, 3, 4]));

        let written_wide = Texels::deep(1, &[0x0707, 0xffff, 0]);
        assert_eq!(written_wide, vec![[7], [255], [0]].into());
    }
}
