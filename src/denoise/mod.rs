//! Taking out what noise is left, for looking at pictures, not for measuring them.

pub(crate) mod a_trous;
pub(crate) mod edges;
pub(crate) mod guides;
pub(crate) mod light;
#[cfg(any(unix, windows))]
mod oidn;
#[cfg(not(any(unix, windows)))]
#[path = "no_oidn.rs"]
mod oidn;
mod samples;
mod upsample;

use std::sync::atomic::AtomicBool;

use samples::{Quality, Samples};
use serde::{Deserialize, Serialize};
pub(crate) use upsample::FineGuides;

use crate::error::Result;
use crate::image::Image;
use crate::render::film::{BEGINNINGS, Film};

/// Fewest samples a pixel of a picture whose guides are filtered first.
const PREFILTERED_SAMPLES: u32 = 64;
/// For work that nobody cancels.
static NEVER: AtomicBool = AtomicBool::new(false);

/// What takes noise out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Denoiser {
    /// Open Image Denoise where its library is installed: it leaves less error in 28 of 32 measured pictures. Else our own
    /// filter.
    #[default]
    Best,
    /// Our edge-avoiding filter over albedo, normal and depth: always there.
    ATrous,
    /// Intel's Open Image Denoise, if its library is installed.
    Oidn,
}

impl Denoiser {
    /// The filter that is used on this machine.
    pub fn found(self) -> Self {
        match self {
            Self::Best if oidn::check().is_ok() => Self::Oidn,
            Self::Best => Self::ATrous,
            Self::ATrous | Self::Oidn => self,
        }
    }

    /// What the command line calls the filter that is used.
    pub fn name(self) -> &'static str {
        if self.found() == Self::Oidn { "oidn" } else { "a-trous" }
    }

    /// Whether it can be used on this machine.
    ///
    /// # Errors
    /// One sentence that says why not.
    pub fn check(self) -> Result<()> {
        if self == Self::Oidn { oidn::check() } else { Ok(()) }
    }

    /// The film's picture without noise, for the screen: Open Image Denoise takes half the time that it takes for a file,
    /// and leaves up to 7 % more error (FLIP). Samples of `other`, a film of the same view, size and layers, count as
    /// well, each as much as that many of the film's own. Without layers on the film the à-trous filter leaves it as it is.
    /// Until all pixels have a sample the picture is one of larger pixels, enlarged. It takes the size of `fine`, the
    /// surfaces of a larger picture of the same view. `None` if `cancel` is set meanwhile.
    ///
    /// # Errors
    /// If the library is missing or fails.
    pub(crate) fn preview(
        self,
        film: &Film,
        other: Option<(&Film, f32)>,
        fine: Option<&FineGuides>,
        cancel: &AtomicBool,
    ) -> Result<Option<Image>> {
        self.run(film, other, fine, (Quality::Fast, cancel))
    }

    /// The same for a file: Open Image Denoise takes noise out of albedo and normals first, where that is a tenth of the
    /// time at most that the samples took.
    ///
    /// # Errors
    /// If the library is missing or fails.
    pub fn finish(self, film: &Film, other: Option<(&Film, f32)>) -> Result<Image> {
        let samples = other.map_or(0, |(other, _)| other.min_samples()) + film.min_samples();
        let is_prefiltered = samples >= PREFILTERED_SAMPLES;
        let quality = if is_prefiltered { Quality::Prefiltered } else { Quality::High };
        self.run(film, other, None, (quality, &NEVER))
            .map(|image| image.expect("it is not cancelled"))
    }

    fn run(
        self,
        film: &Film,
        other: Option<(&Film, f32)>,
        fine: Option<&FineGuides>,
        (quality, cancel): (Quality, &AtomicBool),
    ) -> Result<Option<Image>> {
        let Film { width, height, .. } = *film;
        let size = [width, height].map(|side| side as f32);
        let filter = |film: &Film, other, every: u32| -> Result<Option<Image>> {
            let samples = &Samples::of(film, other);
            let fine = fine.filter(|fine| film.has_layers() && film.width < fine.width);
            let restored = |image| samples.restored(image);
            let image = match self.found() {
                Self::ATrous if !film.has_layers() => Some(film.image()),
                Self::ATrous => a_trous::denoise(samples, cancel).map(restored),
                _ => oidn::denoise(samples, quality, cancel)?.map(restored),
            };
            Ok(image.map(|image| match fine {
                Some(fine) => fine.upsampled(samples, &image, size.map(|side| side / every as f32)),
                None if every > 1 => image.enlarged(every, [width, height]),
                None => image,
            }))
        };
        let films = [Some(film), other.map(|(other, _)| other)].into_iter().flatten();
        let every = films.filter_map(Film::whole_pixels).min().unwrap_or(BEGINNINGS[0]);
        if every == 1 {
            return filter(film, other, 1);
        }
        let larger = film.in_larger_pixels(every);
        let other = other.map(|(other, worth)| (other.in_larger_pixels(every), worth));
        filter(&larger.without_gaps(), other.as_ref().map(|(other, worth)| (other, *worth)), every)
    }
}

/// The film's picture through the filter that is always there, for the screen.
pub fn quick(film: &Film, other: Option<(&Film, f32)>) -> Image {
    let image = Denoiser::ATrous.run(film, other, None, (Quality::Fast, &NEVER));
    image.ok().flatten().expect("it neither fails nor is cancelled")
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::path::{FirstHit, PathResult};

    /// Two walls, one eight times as bright, with noise of variance 1/3 in every so-manyth pixel of every so-manyth row.
    fn film(size: [u32; 2], every: u32) -> Film {
        let mut film = Film::new(size[0], size[1], true);
        for y in (0..size[1]).step_by(every as usize) {
            for x in (0..size[0]).step_by(every as usize) {
                let mut hash = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
                for _ in 0..3 {
                    hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
                }
                let noise = (hash >> 8) as f32 / (1 << 23) as f32;
                let (albedo, normal) = (Vec3::splat(0.5), if x < 32 { Vec3::Z } else { Vec3::X });
                let first_hit = Some(FirstHit { albedo, normal, depth: 1.0 });
                let radiance = Vec3::splat(truth(x) * noise);
                film.add(x, y, &PathResult { radiance, first_hit, ..PathResult::default() });
            }
        }
        film
    }

    fn truth(x: u32) -> f32 {
        if x < 32 { 0.5 } else { 4.0 }
    }

    fn all() -> impl Iterator<Item = Denoiser> {
        [Denoiser::ATrous, Denoiser::Oidn].into_iter().filter(|it| it.check().is_ok())
    }

    #[test]
    fn a_few_pixels_make_a_whole_picture_and_more_a_better_one() {
        for denoiser in all() {
            let mut last = f32::INFINITY;
            for every in [8, 4, 2, 1] {
                let film = film([64, 48], every);
                let image =
                    denoiser.preview(&film, None, None, &NEVER).expect("filtered").expect("whole");
                let squared = |at: usize| (image.pixels[at][1] - truth(at as u32 % 64)).powi(2);
                let error = ((0..64 * 48).map(squared).sum::<f32>() / (64.0 * 48.0)).sqrt();
                assert!(error < last, "{denoiser:?}, every {every}: {error} after {last}");
                last = error;
            }
            assert!(last < 0.3, "{denoiser:?}: {last}");
        }
    }

    #[test]
    fn what_has_no_samples_for_hundreds_of_pixels_is_not_black() {
        let mut film = Film::new(40, 600, true);
        let radiance = Vec3::splat(2.0);
        for x in (0..40).step_by(8) {
            film.add(x, 8, &PathResult { radiance, ..PathResult::default() });
        }
        for denoiser in all() {
            let image = denoiser.finish(&film, None).expect("filtered");
            assert!(image.pixels.iter().all(|pixel| pixel[0] > 1.5), "{denoiser:?}");
        }
        let nothing = Denoiser::ATrous.finish(&Film::new(7, 5, true), None).expect("filtered");
        assert!(nothing.pixels.iter().all(|pixel| *pixel == [0.0; 3]));
    }

    #[test]
    fn what_is_cancelled_gives_no_picture() {
        let cancelled = AtomicBool::new(true);
        for denoiser in all() {
            let image = denoiser.preview(&film([64, 48], 1), None, None, &cancelled);
            assert!(image.expect("no failure").is_none(), "{denoiser:?}");
        }
    }
}
