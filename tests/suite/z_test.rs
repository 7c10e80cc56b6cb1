//! A Z-test of many means at once: do two noisy pictures agree?

use lightgrid::metrics::hypothesis::two_sided_p;
use lightgrid::render::film::Film;
use lightgrid::sampler::SplitMix;

/// A mean, and its variance: that of the values over their number.
pub(crate) type Mean = (f64, f64);

/// What [`z_test`] found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ZTest {
    /// Share of the quantities whose p-value is above [`Self::corrected_alpha`], in `[0,1]`.
    passing_share: f64,
    /// The smallest two-sided p-value.
    smallest_p: f64,
    /// The significance level of each quantity after Sidak's correction.
    corrected_alpha: f64,
}

impl ZTest {
    /// Whether no quantity differs significantly.
    pub(crate) fn passed(&self) -> bool {
        self.smallest_p > self.corrected_alpha
    }
}

/// Two-sample Z-test of every quantity (Welch's statistic with the normal distribution, so each mean should
/// come from some 30 samples or more), as in Mitsuba 3's `test_renders.py`.
///
/// `alpha` is the chance that equal estimates fail anywhere; each quantity is tested at the level
/// that Sidak's correction leaves it. A standard deviation below `1e-6` of the means counts as that
/// much: two sums of `f32` differ by rounding. A quantity that is NaN in either estimate fails.
pub(crate) fn z_test(a: &[Mean], b: &[Mean], alpha: f64) -> ZTest {
    assert!(a.len() == b.len() && !a.is_empty(), "{} means against {}", a.len(), b.len());
    let p_value = |((a, a_variance), (b, b_variance)): (&Mean, &Mean)| {
        let rounding = 1e-6 * a.abs().max(b.abs());
        let variance = a_variance + b_variance + rounding * rounding;
        if a == b { 1.0 } else { two_sided_p((a - b).abs() / variance.sqrt()) }
    };
    let p_values: Vec<f64> = a.iter().zip(b).map(p_value).collect();
    let corrected_alpha = sidak(alpha, a.len());
    let passing = p_values.iter().filter(|p| **p > corrected_alpha).count();
    let smallest_p = p_values.into_iter().fold(1.0, f64::min);
    ZTest { passing_share: passing as f64 / a.len() as f64, smallest_p, corrected_alpha }
}

/// Sidak's correction: the level for each of `tests` independent tests so that all of them together
/// fail by chance with probability `alpha`.
pub(crate) fn sidak(alpha: f64, tests: usize) -> f64 {
    -((-alpha).ln_1p() / tests as f64).exp_m1()
}

/// Mean luminance of each pixel. A pixel that has met none of its rare light yet knows nothing of its
/// variance: its standard error is at least a thousandth of the picture's mean.
pub(crate) fn pixels(film: &Film) -> Vec<Mean> {
    let of = |p: &lightgrid::render::film::Pixel| (p.mean_luminance(), p.variance_of_mean());
    let pixels: Vec<Mean> = film.pixels().iter().map(of).collect();
    let mean = pixels.iter().map(|(mean, _)| mean).sum::<f64>() / pixels.len() as f64;
    pixels.into_iter().map(|(pixel, variance)| (pixel, variance + (1e-3 * mean).powi(2))).collect()
}

/// Asserts that two films of independent samples have the same mean in every pixel.
pub(crate) fn expect_same_pixels(what: &str, a: &Film, b: &Film, alpha: f64) {
    let test = z_test(&pixels(a), &pixels(b), alpha);
    assert!(test.passed(), "{what}: {test:?}");
}

mod tests {
    use super::*;

    /// Means of 64 uniform variables each, shifted by `bias`.
    fn noisy_means(seed: u64, bias: f64) -> Vec<Mean> {
        let mut random = SplitMix(seed);
        let samples = 64;
        (0..10_000)
            .map(|_| {
                let values: Vec<f64> = (0..samples).map(|_| random.next_f64() + bias).collect();
                let mean = values.iter().sum::<f64>() / f64::from(samples);
                let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                (mean, squares / f64::from((samples - 1) * samples))
            })
            .collect()
    }

    #[test]
    fn it_passes_equal_and_fails_shifted_estimates() {
        let estimate = noisy_means(1, 0.0);
        let equal = z_test(&estimate, &noisy_means(2, 0.0), 0.001);
        assert!(equal.passed() && equal.passing_share == 1.0, "{equal:?}");
        assert!((equal.corrected_alpha / 1.0005e-7 - 1.0).abs() < 1e-3);
        // 0.25 is 4.9 standard deviations of the difference, Sidak's threshold 5.3.
        let shifted = z_test(&estimate, &noisy_means(3, 0.25), 0.001);
        assert!(!shifted.passed() && shifted.passing_share < 0.8, "{shifted:?}");
    }

    #[test]
    fn rounding_is_no_difference_and_what_is_no_number_fails() {
        let passed = |mean| z_test(&[(1.0, 0.0)], &[(mean, 0.0)], 0.01).passed();
        assert!(passed(1.0) && passed(1.0 + 1e-7));
        assert!(!passed(1.001) && !passed(f64::NAN));
    }
}
