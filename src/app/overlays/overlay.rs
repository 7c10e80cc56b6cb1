//! What can be drawn over the picture.

/// What can be drawn over the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Overlay {
    /// Cells of the Light Grid.
    Cells,
    /// Six-fold split of cells by the direction a surface faces.
    Faces,
    /// Cells with distributions of their own.
    Learned,
    /// Learning visits of each cell.
    Visits,
    /// How much of the sky learning found visible.
    Sky,
    /// Each cell's most important tile.
    BestTile,
    /// Entropy of the cell's distribution.
    Entropy,
    /// Distance of the cell's distribution from the whole map's.
    Distance,
    /// Each cell's probability of the tile chosen on the map.
    Tile,
    /// Cells of the radiance cache.
    CacheCells,
    /// Radiance of the cache's cells.
    CacheRadiance,
    /// What has trained the cache's cells.
    CacheSamples,
    /// What the map's sun shines on.
    Sun,
    /// Samples of each pixel.
    Samples,
    /// Estimated error of each pixel.
    Error,
    /// Albedo of the first surface.
    Albedo,
    /// Normal of the first surface.
    Normal,
    /// Distance of the first surface.
    Depth,
}

impl Overlay {
    /// All of them, in the order they are offered.
    pub const ALL: [Self; 18] = [
        Self::Cells,
        Self::Faces,
        Self::Learned,
        Self::Visits,
        Self::Sky,
        Self::BestTile,
        Self::Entropy,
        Self::Distance,
        Self::Tile,
        Self::CacheCells,
        Self::CacheRadiance,
        Self::CacheSamples,
        Self::Sun,
        Self::Samples,
        Self::Error,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
    ];

    /// The overlay `step` places after this one in [`Self::ALL`]; no overlay comes before the first and after the last.
    pub fn beside(overlay: Option<Self>, step: isize) -> Option<Self> {
        let place = overlay.and_then(|own| Self::ALL.iter().position(|other| *other == own));
        let count = Self::ALL.len() as isize + 1;
        let place = place.map_or(0, |place| place as isize + 1) + step;
        let place = usize::try_from(place.rem_euclid(count) - 1).ok()?;
        Self::ALL.get(place).copied()
    }

    /// What to call it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Cells => "Cells",
            Self::Faces => "Faces",
            Self::Learned => "Learned cells",
            Self::Visits => "Learning visits",
            Self::Sky => "Visible sky",
            Self::BestTile => "Most important tile",
            Self::Entropy => "Entropy of the distribution",
            Self::Distance => "Distance from the whole map's distribution",
            Self::Tile => "Probability of the chosen tile",
            Self::CacheCells => "Cells of the radiance cache",
            Self::CacheRadiance => "Radiance of the cache",
            Self::CacheSamples => "Training of the cache",
            Self::Sun => "Sunlit surfaces",
            Self::Samples => "Samples",
            Self::Error => "Estimated error",
            Self::Albedo => "Albedo",
            Self::Normal => "Normal",
            Self::Depth => "Depth",
        }
    }

    /// What it shows, in a sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::Cells => {
                "Cells of the grid around the camera, with their numbers; borders are bright."
            }
            Self::Faces => "Cells are split by the axis that a surface's normal is nearest to.",
            Self::Learned => {
                "Cells with a distribution of their own; elsewhere the whole map is sampled."
            }
            Self::Visits => "Shadow rays that learning traced towards the map from each cell.",
            Self::Sky => {
                "Mean visibility times cosine over all tiles of the map, as learning found it."
            }
            Self::BestTile => {
                "The tile each cell samples most; hue is its azimuth, darker is lower on the map."
            }
            Self::Entropy => "0 bits: always the same tile. High: no preference.",
            Self::Distance => {
                "Total variation between the cell's distribution and the whole map's: 0 equal, 1 disjoint."
            }
            Self::Tile => "Probability with which each cell samples the tile chosen on the map.",
            Self::CacheCells => {
                "Cells of the radiance cache; hue is the level, each of twice the size; untrained cells, as on glossy surfaces, are dark."
            }
            Self::CacheRadiance => {
                "Reflected radiance of each cell of the cache at its mean albedo, developed as the picture is."
            }
            Self::CacheSamples => {
                "Samples that have trained each cell of the cache; dark where a larger cell or the global mean is used."
            }
            Self::Sun => {
                "Surfaces that see the brightest place of the map, through smooth glass, too."
            }
            Self::Samples => "Samples each pixel has.",
            Self::Error => "Standard error of a pixel's luminance over its luminance.",
            Self::Albedo => "Directional albedo of the first surface.",
            Self::Normal => "World shading normal, -1 to 1 as 0 to 255.",
            Self::Depth => "Metres from the camera to the first surface.",
        }
    }

    /// Whether it is about the Light Grid.
    pub fn is_of_grid(self) -> bool {
        self.needs_surfaces() && !self.is_of_cache() && self != Self::Sun
    }

    /// Whether it is about cells, hence needs the surfaces behind the pixels.
    pub fn needs_surfaces(self) -> bool {
        !matches!(self, Self::Samples | Self::Error | Self::Albedo | Self::Normal | Self::Depth)
    }

    /// Whether it replaces the picture rather than tinting it.
    pub fn is_opaque(self) -> bool {
        matches!(self, Self::CacheRadiance | Self::Albedo | Self::Normal | Self::Depth)
    }

    /// Whether it is about the radiance cache.
    pub fn is_of_cache(self) -> bool {
        matches!(self, Self::CacheCells | Self::CacheRadiance | Self::CacheSamples)
    }

    /// Whether it shows light, which is developed.
    pub fn is_developed(self) -> bool {
        self == Self::CacheRadiance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_go_through_all_overlays_and_none() {
        for step in [1, -1] {
            let mut seen = vec![None];
            loop {
                match Overlay::beside(*seen.last().expect("there is one"), step) {
                    None => break,
                    overlay => seen.push(overlay),
                }
            }
            assert_eq!(seen.len(), Overlay::ALL.len() + 1);
        }
    }
}
