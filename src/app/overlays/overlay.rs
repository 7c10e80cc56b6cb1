//! What can be drawn over the picture.

/// Declares the overlays, each with its name, its title and what it shows in a sentence.
macro_rules! overlays {
    ($($(#[$doc:meta])+ $name:ident $word:literal = $title:literal: $description:literal)+) => {
        /// What can be drawn over the picture.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Overlay {
            $($(#[$doc])+ $name),+
        }

        impl Overlay {
            /// All of them, in the order they are offered.
            pub const ALL: [Self; [$($title),+].len()] = [$(Self::$name),+];

            /// Its name on the command line.
            pub fn name(self) -> &'static str {
                self.words()[0]
            }

            /// What to call it.
            pub fn title(self) -> &'static str {
                self.words()[1]
            }

            /// What it shows, in a sentence.
            pub fn description(self) -> &'static str {
                self.words()[2]
            }

            fn words(self) -> [&'static str; 3] {
                match self {
                    $(Self::$name => [$word, $title, $description]),+
                }
            }
        }
    };
}

overlays! {
    /// Cells of the Light Grid.
    Cells "cells" = "Cells": "Cells of the grid around the camera, with their numbers; borders are bright."
    /// Six-fold split of cells by the direction a surface faces.
    Faces "faces" = "Faces": "Cells are split by the axis that a surface's normal is nearest to."
    /// Cells with distributions of their own.
    Learned "learned" = "Learned cells":
        "Cells with a distribution of their own; elsewhere the whole map is sampled."
    /// Learning visits of each cell.
    Visits "visits" = "Learning visits": "Shadow rays that learning traced towards the map from each cell."
    /// How much of the sky learning found visible.
    Sky "sky" = "Visible sky":
        "Mean visibility times cosine over all tiles of the map, as learning found it."
    /// Each cell's most important tile.
    BestTile "best-tile" = "Most important tile":
        "The tile each cell samples most; hue is its azimuth, darker is lower on the map."
    /// Entropy of the cell's distribution.
    Entropy "entropy" = "Entropy of the distribution": "0 bits: always the same tile. High: no preference."
    /// Distance of the cell's distribution from the whole map's.
    Distance "distance" = "Distance from the whole map":
        "Total variation between the cell's distribution and the whole map's: 0 equal, 1 disjoint."
    /// Each cell's probability of the tile chosen on the map.
    Tile "tile" = "Probability of the chosen tile":
        "Probability with which each cell samples the tile chosen on the map."
    /// Cells of the radiance cache.
    CacheCells "cache-cells" = "Cells of the radiance cache":
        "Cells of the radiance cache; hue is the level, each of twice the size; untrained cells, as on glossy surfaces, are dark."
    /// Radiance of the cache's cells.
    CacheRadiance "cache-radiance" = "Radiance of the cache":
        "Reflected radiance of each cell of the cache at its mean albedo, developed as the picture is."
    /// What has trained the cache's cells.
    CacheSamples "cache-samples" = "Training of the cache":
        "Samples that have trained each cell of the cache; dark where a larger cell or the global mean is used."
    /// What the map's sun shines on.
    Sun "sun" = "Sunlit surfaces":
        "Surfaces that see the brightest place of the map, through smooth glass, too."
    /// Samples of each pixel.
    Samples "samples" = "Samples": "Samples each pixel has."
    /// Estimated error of each pixel.
    Error "error" = "Estimated error": "Standard error of a pixel's luminance over its luminance."
    /// The same of blocks of pixels.
    Areas "areas" = "Error of areas":
        "Standard error of the mean luminance of 8x8 pixels over it: noise that a denoiser leaves."
    /// FLIP of the picture on the screen.
    Flip "flip" = "Difference from the reference":
        "Perceptual difference (FLIP) of the picture on the screen from the reference: 0 equal, 1 most."
    /// Albedo of the first surface.
    Albedo "albedo" = "Albedo": "Directional albedo of the first surface."
    /// Normal of the first surface.
    Normal "normal" = "Normal": "World shading normal, -1 to 1 as 0 to 255."
    /// Distance of the first surface.
    Depth "depth" = "Depth": "Metres from the camera to the first surface."
}

impl Overlay {
    /// The overlay `step` places after this one in [`Self::ALL`]; no overlay comes before the first and after the last.
    pub fn beside(overlay: Option<Self>, step: isize) -> Option<Self> {
        let place = overlay.and_then(|own| Self::ALL.iter().position(|other| *other == own));
        let count = Self::ALL.len() as isize + 1;
        let place = place.map_or(0, |place| place as isize + 1) + step;
        let place = usize::try_from(place.rem_euclid(count) - 1).ok()?;
        Self::ALL.get(place).copied()
    }

    /// Whether it is about the Light Grid.
    pub fn is_of_grid(self) -> bool {
        self.needs_surfaces() && !self.is_of_cache() && self != Self::Sun
    }

    /// Whether it is about cells, hence needs the surfaces behind the pixels.
    pub fn needs_surfaces(self) -> bool {
        let is_error = matches!(self, Self::Samples | Self::Error | Self::Areas | Self::Flip);
        !is_error && !matches!(self, Self::Albedo | Self::Normal | Self::Depth)
    }

    /// Whether it replaces the picture rather than tinting it.
    pub fn is_opaque(self) -> bool {
        matches!(self, Self::CacheRadiance | Self::Flip | Self::Albedo | Self::Normal | Self::Depth)
    }

    /// Whether it is about the radiance cache.
    pub fn is_of_cache(self) -> bool {
        matches!(self, Self::CacheCells | Self::CacheRadiance | Self::CacheSamples)
    }

    /// Whether it depends on how light is developed.
    pub fn is_developed(self) -> bool {
        matches!(self, Self::CacheRadiance | Self::Flip)
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
