//! How far films are off in what outlasts a denoiser: means over blocks of pixels.

use rayon::prelude::*;

use super::film::Film;

/// Edge of a block in pixels.
const BLOCK: usize = 16;
/// Fewest blocks that show an error.
const MIN_BLOCKS: usize = 16;
/// Share of the blocks that is left out: those with the most noise, which are as far apart as chance will have it.
const TRIMMED: f64 = 0.02;

/// Squared errors of block means, relative to the light there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockErrors {
    exact: f64,
    /// That of the cached film, if there is one: its noise and the error of its cache.
    cached: Option<f64>,
}

impl BlockErrors {
    /// Share of the cached film in the picture of both that has the least squared error; below 1.
    pub(crate) fn share(&self) -> f32 {
        let share = self.cached.map_or(0.0, |cached| self.exact / (self.exact + cached));
        (share as f32).min(1.0 - f32::EPSILON)
    }

    /// Root of the squared error of that picture.
    pub(crate) fn left(&self) -> f32 {
        (self.exact.sqrt() as f32) * (1.0 - self.share()).sqrt()
    }
}

/// Errors of a film and of one of the same view by cached light, by how their samples spread and how far their blocks
/// are apart. `None` while one of them does not show its noise: below two samples a pixel, or with too few blocks.
pub(crate) fn block_errors(exact: &Film, cached: Option<&Film>) -> Option<BlockErrors> {
    let (width, height) = (exact.width as usize, exact.height as usize);
    let size = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
    let other = cached.unwrap_or(exact);
    let of_block = |index: usize| {
        let (left, top) = (index % size[0] * BLOCK, index / size[0] * BLOCK);
        let columns = left..(left + BLOCK).min(width);
        let rows = top..(top + BLOCK).min(height);
        let share = 1.0 / (columns.len() * rows.len()) as f64;
        let mut means = [[0.0; 2]; 2];
        for place in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)) {
            for ([mean, variance], film) in means.iter_mut().zip([exact, other]) {
                *mean += share * film.pixels()[place].mean_luminance();
                *variance += share * share * film.pixels()[place].variance_of_mean();
            }
        }
        means
    };
    let means: Vec<_> = (0..size[0] * size[1]).into_par_iter().map(of_block).collect();
    let brightness = means.iter().map(|[exact, _]| exact[0]).sum::<f64>() / means.len() as f64;
    // A block's variance in the exact film, in the other one, and the cache's squared error: the squared difference
    // of both means less both variances.
    let of_means = |[[exact, noise], [other, other_noise]]: &[[f64; 2]; 2]| {
        let scale = (0.5 * (exact + other)).powi(2) + (0.05 * brightness).powi(2);
        let error = (exact - other).powi(2) - noise - other_noise;
        [*noise, *other_noise, error].map(|value| value / scale)
    };
    let mut errors: Vec<[f64; 3]> = means.iter().map(of_means).collect();
    errors.sort_unstable_by(|a, b| f64::total_cmp(&(a[0] + a[1]), &(b[0] + b[1])));
    errors.truncate(errors.len() - (TRIMMED * errors.len() as f64) as usize);
    let count = errors.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 3]) -> f64| errors.iter().map(of).sum::<f64>() / count;
    let [noise, other_noise, error] = [0, 1, 2].map(|at| mean(&|of_block| of_block[at]));
    let spread = mean(&|of_block| (of_block[2] - error).powi(2));
    // An error within chance is none.
    let error = (error - (spread / count).sqrt()).max(0.0);
    let is_known = errors.len() >= MIN_BLOCKS && noise > 0.0 && (noise + other_noise).is_finite();
    is_known.then(|| BlockErrors { exact: noise, cached: cached.map(|_| other_noise + error) })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::path::PathResult;
    use crate::render::cached_picture::worth;
    use crate::sampler::hash;

    /// A film of light around 1 that spreads by `spread`, and is off by `error` more or less in every other block.
    fn film(samples: u32, spread: f32, error: f32, seed: u32) -> Film {
        let size = 8 * BLOCK as u32;
        let mut film = Film::new(size, size, false);
        for index in 0..size * size * samples {
            let (x, y) = (index / samples % size, index / samples / size);
            let is_off = (x / BLOCK as u32 + y / BLOCK as u32).is_multiple_of(2);
            let chance = hash(index ^ hash(seed)) as f32 / u32::MAX as f32 - 0.5;
            // Of variance 1.
            let noise = spread * chance * 12.0_f32.sqrt();
            let radiance = Vec3::splat(1.0 + noise + if is_off { error } else { -error });
            film.add(x, y, &PathResult { radiance, ..PathResult::default() });
        }
        film
    }

    #[test]
    fn films_have_the_share_that_their_errors_leave_them() {
        let pixels = (BLOCK * BLOCK) as f32;
        let exact = film(4, 1.0, 0.0, 1);
        for error in [0.0, 0.02, 0.06, 0.2] {
            let cached = film(16, 0.5, error, 2);
            let [own, other] = [1.0 / 4.0, 0.25 / 16.0].map(|variance| variance / pixels);
            let best = own / (own + other + error * error);
            let errors = block_errors(&exact, Some(&cached)).expect("both have noise");
            let found = errors.share();
            // An error is taken to be what is sure of it.
            assert!((best - 0.02..best + 0.25).contains(&found), "{error}: {found} for {best}");
            let worth = worth(&exact, &cached, Some(&errors));
            assert!((worth * 16.0 / (worth * 16.0 + 4.0) - found).abs() < 1e-3, "{worth}");
        }
        // Of a single sample nobody knows how far it is off.
        assert!(block_errors(&film(1, 1.0, 0.0, 3), Some(&exact)).is_none());
        // The exact film takes over where both have many samples.
        let many = [film(256, 1.0, 0.0, 4), film(256, 0.5, 0.06, 5)];
        let errors = block_errors(&many[0], Some(&many[1])).expect("both have noise");
        assert!(errors.share() < 0.01, "{errors:?}");
        // Without another film the noise alone is left.
        let alone = block_errors(&exact, None).expect("it has noise");
        assert!((alone.exact * f64::from(pixels) * 4.0 - 1.0).abs() < 0.1, "{alone:?}");
        assert_eq!(alone.share(), 0.0);
    }
}
