//! Taking out what noise is left, for looking at pictures, not for measuring them.

mod a_trous;
mod oidn;

use serde::{Deserialize, Serialize};

use crate::color::luminance;
use crate::error::Result;
use crate::image::Image;
use crate::render::film::Film;

/// What takes noise out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Denoiser {
    /// Our edge-avoiding filter over albedo, normal and depth: fast, always there.
    #[default]
    ATrous,
    /// Intel's Open Image Denoise, if its library is installed.
    Oidn,
}

impl Denoiser {
    /// What the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::ATrous => "a-trous",
            Self::Oidn => "oidn",
        }
    }

    /// Whether it can be used on this machine.
    ///
    /// # Errors
    /// One sentence that says why not.
    pub fn check(self) -> Result<()> {
        match self {
            Self::ATrous => Ok(()),
            Self::Oidn => oidn::check(),
        }
    }

    /// The film's picture without noise. Without layers on the film the à-trous filter leaves it as
    /// it is.
    ///
    /// # Errors
    /// If the library is missing or fails.
    pub fn denoise(self, film: &Film) -> Result<Image> {
        match self {
            Self::ATrous => Ok(quick(film)),
            Self::Oidn => oidn::denoise(film),
        }
    }
}

/// The film's picture through the filter that is always there.
pub fn quick(film: &Film) -> Image {
    a_trous::denoise(film)
}

/// A small picture to be looked at for a moment: filtered, and without lone pixels that the filter
/// could not compare with any other.
pub fn preview(film: &Film) -> Image {
    let image = quick(film);
    if film.min_samples() >= FEW_SAMPLES { image } else { without_lone_pixels(&image) }
}

/// Below this many samples a pixel, edges have pixels like no other.
const FEW_SAMPLES: u32 = 16;

/// Every pixel brought between the third darkest and third brightest of its neighbours, for those
/// outside are single dots or thin chains of them.
fn without_lone_pixels(image: &Image) -> Image {
    let (width, height) = (image.width, image.height);
    if width < 3 || height < 3 {
        return image.clone();
    }
    Image::from_fn(width, height, |x, y| {
        let (left, top) = (x.saturating_sub(1).min(width - 3), y.saturating_sub(1).min(height - 3));
        let mut around: [[f32; 3]; 9] =
            std::array::from_fn(|i| image.at(left + i as u32 % 3, top + i as u32 / 3));
        around.sort_unstable_by(|a, b| luminance_of(*a).total_cmp(&luminance_of(*b)));
        let own = image.at(x, y);
        let light = luminance_of(own);
        if light < luminance_of(around[2]) {
            around[2]
        } else if light > luminance_of(around[6]) {
            around[6]
        } else {
            own
        }
    })
}

fn luminance_of(rgb: [f32; 3]) -> f32 {
    luminance(glam::Vec3::from(rgb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lone_pixels_go_and_edges_stay() {
        let mut image = Image::from_fn(12, 9, |x, _| if x < 6 { [0.2; 3] } else { [0.8; 3] });
        let clean = image.clone();
        image.pixels[4 * 12 + 2] = [0.0; 3];
        image.pixels[5 * 12 + 2] = [0.0; 3];
        image.pixels[3 * 12 + 9] = [40.0; 3];
        assert_eq!(without_lone_pixels(&image).pixels, clean.pixels);
        let tiny = Image::filled(2, 9, [0.5; 3]);
        assert_eq!(without_lone_pixels(&tiny).pixels, tiny.pixels);
    }
}
