//! Pixel reconstruction filters.

use std::sync::LazyLock;

use glam::Vec2;

/// Pixel reconstruction filters, sampled in proportion to their weight so that every sample counts
/// one in its own pixel (filter importance sampling, Ernst et al. 2006).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelFilter {
    /// One pixel wide, constant: what metrics expect.
    Box,
    /// Gaussian of standard deviation 0.45 pixels, cut at 1.5.
    Gauss,
    /// Blackman-Harris window 3 pixels wide, Cycles' default shape.
    #[default]
    BlackmanHarris,
}

impl PixelFilter {
    /// Offset from the pixel's centre in pixels for a point of the unit square.
    pub fn sample(self, u: Vec2) -> Vec2 {
        self.cumulative().map_or(u - 0.5, |table| Vec2::new(invert(table, u.x), invert(table, u.y)))
    }

    /// Running integral over the filter's width, which [`Self::sample`] inverts; none for a box.
    pub(super) fn cumulative(self) -> Option<&'static Cumulative> {
        match self {
            Self::Box => None,
            Self::Gauss => Some(&GAUSS),
            Self::BlackmanHarris => Some(&BLACKMAN_HARRIS),
        }
    }
}

/// Half width of the wide filters in pixels.
pub(crate) const FILTER_RADIUS: f32 = 1.5;

fn gauss(x: f32) -> f32 {
    (-0.5 * (x / 0.45).powi(2)).exp()
}

/// Four-term Blackman-Harris window (Harris 1978) over `[-FILTER_RADIUS, FILTER_RADIUS]`.
fn blackman_harris(x: f32) -> f32 {
    let t = std::f32::consts::PI * (x / FILTER_RADIUS + 1.0);
    0.35875 - 0.48829 * t.cos() + 0.14128 * (2.0 * t).cos() - 0.01168 * (3.0 * t).cos()
}

pub(crate) const STEPS: usize = 256;

/// Running integral of a window over `[-FILTER_RADIUS, FILTER_RADIUS]`, from 0 to 1.
type Cumulative = [f32; STEPS + 1];

static GAUSS: LazyLock<Cumulative> = LazyLock::new(|| integrate(gauss));
static BLACKMAN_HARRIS: LazyLock<Cumulative> = LazyLock::new(|| integrate(blackman_harris));

fn integrate(window: fn(f32) -> f32) -> Cumulative {
    let x_of = |i: usize| FILTER_RADIUS * (2.0 * i as f32 / STEPS as f32 - 1.0);
    let mut sums = [0.0; STEPS + 1];
    for i in 0..STEPS {
        sums[i + 1] = sums[i] + 0.5 * (window(x_of(i)) + window(x_of(i + 1)));
    }
    let total = sums[STEPS];
    sums.map(|s| s / total)
}

fn invert(table: &Cumulative, u: f32) -> f32 {
    let upper = table.partition_point(|&s| s <= u).clamp(1, STEPS);
    let (low, high) = (table[upper - 1], table[upper]);
    let fraction = if high > low { (u - low) / (high - low) } else { 0.5 };
    FILTER_RADIUS * (2.0 * ((upper - 1) as f32 + fraction) / STEPS as f32 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Variances by hand: 1/12; a Gaussian cut at 3.3 standard deviations; the window's cosine series.
    #[test]
    fn filters_are_centred_and_as_wide_as_they_say() {
        for (filter, variance) in [
            (PixelFilter::Box, 1.0 / 12.0),
            (PixelFilter::Gauss, 0.2003),
            (PixelFilter::BlackmanHarris, 0.1726),
        ] {
            let count = 10_000;
            let xs: Vec<f32> = (0..count)
                .map(|i| filter.sample(Vec2::new((i as f32 + 0.5) / count as f32, 0.3)).x)
                .collect();
            let mean = xs.iter().sum::<f32>() / count as f32;
            let spread = xs.iter().map(|x| x * x).sum::<f32>() / count as f32;
            assert!(mean.abs() < 1e-3, "{filter:?}: {mean}");
            assert!((spread / variance - 1.0).abs() < 0.02, "{filter:?}: {spread}");
            assert!(xs.windows(2).all(|w| w[0] <= w[1]), "{filter:?} keeps the order");
        }
    }
}
