//! How counters become distributions.

use serde::{Deserialize, Serialize};

/// What one learning record holds. All but the last, divided by the tries, are visibility ratios
/// that do not depend on the map's radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recording {
    /// Visibility times cosine.
    VisibleCosine,
    /// Visibility alone.
    Visible,
    /// Visibility times squared cosine: the root of its mean is a root mean square, the weight of
    /// least variance where a tile's texels are chosen by energy (Rath et al. 2020).
    VisibleCosineSquared,
    /// The visible contribution, as in the talk.
    VisibleContribution,
}

impl Recording {
    /// Whether records are visibility ratios once they are divided by the tries.
    pub fn is_ratio(self) -> bool {
        self != Self::VisibleContribution
    }

    /// Power of the cosine in a visibility ratio.
    pub fn cosine_power(self) -> i32 {
        match self {
            Self::Visible | Self::VisibleContribution => 0,
            Self::VisibleCosine => 1,
            Self::VisibleCosineSquared => 2,
        }
    }
}

/// How counters become distributions. The defaults are *measured*: `lightgrid report ablations`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DistributionOptions {
    /// Whether cells are split six-fold by the direction a surface faces.
    pub faces: bool,
    /// What the counters hold.
    pub recording: Recording,
    /// Tries per tile that the pooled ratio of the 4x4 cells around is worth.
    pub pooling_tries: f64,
    /// Power of the visibility ratio: 1 weighs a tile by its mean visible energy, 1/2 by its root
    /// mean square, which is best where each point of a cell sees either all or nothing of it
    /// (Rath et al. 2020).
    pub ratio_exponent: f64,
    /// Share of samples, in 256ths, that follow the whole map's distribution whatever was learned; see
    /// [`super::LightGrid::sample`].
    pub whole_map_share: u32,
    /// How much of the diffuse BSDF's own density is subtracted from a distribution (MIS compensation,
    /// Karlik et al. 2019, on tiles).
    pub compensation: f64,
    /// Samples of the map that each vertex of a learning path tries: another shadow ray is cheaper
    /// than another path. A rendered path tries one, or three where pixels share what is behind.
    pub tries_per_vertex: u32,
    /// Where rendered paths count too, until the distributions hardly get better.
    pub rendered_paths: RenderedPaths,
}

/// Where rendered paths count as learning paths do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RenderedPaths {
    /// Nowhere: distributions are those of learning paths.
    Nowhere,
    /// Where what the camera sees is enclosed. Outside little is left to learn, and what better distributions
    /// gain is less than a new sequence of points costs: counting for four samples makes 1.09 times the
    /// error there (0.89 to 1.27), 0.96 times in rooms (0.79 to 1.07).
    InRooms,
    /// In every scene.
    Everywhere,
}

impl DistributionOptions {
    /// Our own distributions.
    pub const ADAPTIVE: Self = Self {
        faces: true,
        recording: Recording::VisibleCosine,
        pooling_tries: 16.0,
        ratio_exponent: 0.75,
        whole_map_share: 32,
        compensation: 0.5,
        tries_per_vertex: 8,
        rendered_paths: RenderedPaths::InRooms,
    };

    /// The talk's: proportional to the visible contribution, nothing else.
    pub const TALK: Self = Self {
        faces: false,
        recording: Recording::VisibleContribution,
        pooling_tries: 0.0,
        ratio_exponent: 1.0,
        whole_map_share: 0,
        compensation: 0.0,
        tries_per_vertex: 1,
        rendered_paths: RenderedPaths::Nowhere,
    };

    /// Whether rendered paths may count too. Their samples of the map follow the distributions, so only
    /// ratios can be counted.
    pub fn goes_on(&self) -> bool {
        self.rendered_paths != RenderedPaths::Nowhere && self.recording.is_ratio()
    }
}
