//! Colours of an overlay and their meaning.

use super::labels::Label;
use super::palette;

/// What the colours of an overlay mean.
#[derive(Debug, Clone, PartialEq)]
pub enum Legend {
    /// Viridis from `low` to `high`.
    Scale {
        /// Value of the darkest colour.
        low: f32,
        /// Value of the brightest.
        high: f32,
        /// Whether colours follow the logarithm.
        logarithmic: bool,
        /// Unit of the values.
        unit: String,
    },
    /// One colour, one meaning.
    Names(Vec<([u8; 3], String)>),
    /// Colours of places on the map.
    Map,
    /// Nothing to explain.
    None,
    /// No pixel has a value.
    Empty,
}

/// Colours of a picture's pixels in sRGB, `None` where there is nothing to say.
type Colors = Vec<Option<[u8; 3]>>;

/// An overlay's colours, one per pixel, and their meaning. On the device they are a texture.
#[derive(Clone)]
pub(in crate::app) struct Painted<C = Colors> {
    /// One a pixel, or a texture of them.
    pub(in crate::app) colors: C,
    /// What they mean.
    pub(in crate::app) legend: Legend,
    /// Words on the picture.
    pub(in crate::app) labels: Vec<Label>,
}

impl Painted {
    /// Without words.
    pub(super) fn new(colors: Colors, legend: Legend) -> Self {
        Self { colors, legend, labels: Vec::new() }
    }
}

/// What a scale spans.
#[derive(Clone, Copy)]
pub(super) enum Range {
    /// As given.
    Fixed(f32, f32),
    /// From 0 to the largest value.
    Whole,
    /// Between the 2nd and 98th percentile, by the logarithm.
    Logarithmic,
}

/// What a logarithmic scale spans at most: a few cells that see next to nothing must not take it all.
const MAX_RATIO: f32 = 1e4;

/// Values in viridis.
pub(super) fn scaled(
    values: impl Iterator<Item = Option<f32>>,
    range: Range,
    unit: impl Into<String>,
) -> Painted {
    let values: Vec<Option<f32>> = values.collect();
    let mut sorted: Vec<f32> = values.iter().flatten().copied().collect();
    sorted.sort_unstable_by(f32::total_cmp);
    if sorted.is_empty() {
        return Painted::new(values.iter().map(|_| None).collect(), Legend::Empty);
    }
    let percentile = |share: f32| sorted[(sorted.len() as f32 * share) as usize];
    let logarithmic = matches!(range, Range::Logarithmic);
    let (low, high) = match range {
        Range::Fixed(low, high) => (low, high),
        Range::Whole => (0.0, sorted[sorted.len() - 1].max(1.0)),
        Range::Logarithmic => {
            let high = percentile(0.98).max(f32::MIN_POSITIVE * MAX_RATIO);
            let low = percentile(0.02).max(high / MAX_RATIO);
            (low, high.max(low * 1.01))
        }
    };
    let position = |value: f32| {
        if logarithmic {
            (value / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low)
        }
    };
    let colors = values.iter().map(|v| v.map(|v| palette::viridis(position(v)))).collect();
    Painted::new(colors, Legend::Scale { low, high, logarithmic, unit: unit.into() })
}
