//! Options of distributions: how they are computed from counters.

use serde::{Deserialize, Serialize};

/// The weight of one learning record. All but the last, divided by the tries, are visibility ratios
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

/// Options of distributions. The defaults are *measured*: `lightgrid report ablations`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DistributionOptions {
    /// Whether cells are split six-fold by the direction a surface faces.
    pub faces: bool,
    /// The weight that the counters sum.
    pub recording: Recording,
    /// Number of tries per tile that the pooled ratio of the block of 4x4 cells counts as.
    pub pooling_tries: f64,
    /// Power of the visibility ratio: 1 weights a tile by its mean visible energy, 1/2 by its root mean square.
    /// The latter is optimal if each point of a cell sees either all or nothing of the tile (Rath et al. 2020).
    pub ratio_exponent: f64,
    /// Share of samples, in 256ths, that follow the whole map's distribution whatever was learned; see
    /// [`super::LightGrid::sample`].
    pub whole_map_share: u32,
    /// Share of the diffuse BSDF's density that is subtracted from a distribution (MIS compensation, Karlik et
    /// al. 2019, on tiles).
    pub compensation: f64,
    /// Samples of the map at each vertex of a learning path: another shadow ray is cheaper than another path. A
    /// rendered path takes one, or three where pixels share second vertices.
    pub tries_per_vertex: u32,
    /// Scenes in which rendered paths are counted too, until the distributions converge.
    pub rendered_paths: RenderedPaths,
}

/// Scenes in which rendered paths are counted like learning paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RenderedPaths {
    /// In none: distributions come from learning paths only.
    Nowhere,
    /// In scenes whose visible part is enclosed. Outdoors, better distributions gain less than a new sequence of
    /// points costs: counting four samples multiplies the error by 1.09 there (0.89 to 1.27), and by 0.96 in
    /// rooms (0.79 to 1.07).
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

    /// Whether rendered paths may be counted too: only with ratios, since their samples of the map follow the
    /// distributions.
    pub fn goes_on(&self) -> bool {
        self.rendered_paths != RenderedPaths::Nowhere && self.recording.is_ratio()
    }
}
