//! Tests of metrics.

use lightgrid::image::Image;
use lightgrid::metrics::compare;
use lightgrid::metrics::hypothesis::{
    Means, chi_square_test, erfc, ln_gamma, sidak, upper_gamma, z_test,
};

use crate::shared::SplitMix;

fn assert_relative(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance * want.abs(), "got {got:e}, want {want:e}");
}

/// Reference values from mpmath 1.3 at 15 digits.
#[test]
fn special_functions_match_reference_values() {
    for (x, want) in [
        (0.1, 0.887537083981715),
        (0.5, 0.479500122186953),
        (1.0, 0.157299207050285),
        (2.0, 0.00467773498104727),
        (3.0, 2.20904969985854e-5),
        (5.0, 1.53745979442803e-12),
        (10.0, 2.08848758376254e-45),
        (20.0, 5.3958656116079e-176),
        (-1.0, 1.84270079294971),
    ] {
        assert_relative(erfc(x), want, 1e-12);
    }
    for (a, x, want) in [
        (0.5, 2.0, 0.0455002638963584),
        (3.0, 2.5, 0.54381311588333),
        (50.0, 60.0, 0.0844066810936918),
        (500.0, 450.0, 0.98928276190871),
        (5000.0, 5200.0, 0.00258481349535381),
    ] {
        assert_relative(upper_gamma(a, x), want, 1e-10);
    }
    for (x, want) in [
        (0.1, 2.25271265173421),
        (0.5, 0.5723649429247),
        (3.5, 1.20097360234707),
        (10.5, 13.9406252194038),
        (1000.0, 5905.22042320918),
    ] {
        assert_relative(ln_gamma(x), want, 1e-12);
    }
    assert_eq!(erfc(0.0), 1.0);
    assert_eq!(upper_gamma(2.0, f64::INFINITY), 0.0);
}

/// Means of 64 uniform variables per pixel, shifted by `bias`.
fn noisy_means(seed: u64, bias: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = SplitMix(seed);
    let samples = 64;
    (0..10_000)
        .map(|_| {
            let values: Vec<f64> = (0..samples).map(|_| random.next_f64() + bias).collect();
            let mean = values.iter().sum::<f64>() / samples as f64;
            let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            (mean, squares / ((samples - 1) * samples) as f64)
        })
        .unzip()
}

#[test]
fn z_test_passes_equal_and_fails_shifted_estimates() {
    let (mean, variance) = noisy_means(1, 0.0);
    let a = Means { mean: &mean, variance_of_mean: &variance };
    let (same_mean, same_variance) = noisy_means(2, 0.0);
    let same = Means { mean: &same_mean, variance_of_mean: &same_variance };
    let (other_mean, other_variance) = noisy_means(3, 0.25);
    let other = Means { mean: &other_mean, variance_of_mean: &other_variance };

    let equal = z_test(a, same, 0.001).unwrap();
    assert!(equal.passed() && equal.passing_share == 1.0, "{equal:?}");
    assert_relative(equal.corrected_alpha, 1.0005e-7, 1e-3);
    // 0.25 is 4.9 standard deviations of the difference, Sidak's threshold 5.3.
    let shifted = z_test(a, other, 0.001).unwrap();
    assert!(!shifted.passed() && shifted.passing_share < 0.8, "{shifted:?}");
}

#[test]
fn z_test_edges() {
    let estimate = |mean: &'static [f64]| Means { mean, variance_of_mean: &[0.0] };
    assert!(z_test(estimate(&[1.0]), estimate(&[1.0]), 0.01).unwrap().passed());
    assert!(z_test(estimate(&[1.0]), estimate(&[1.0 + 1e-7]), 0.01).unwrap().passed());
    assert!(!z_test(estimate(&[1.0]), estimate(&[1.001]), 0.01).unwrap().passed());
    assert!(!z_test(estimate(&[1.0]), estimate(&[f64::NAN]), 0.01).unwrap().passed());
    assert!(z_test(estimate(&[1.0]), estimate(&[1.0, 2.0]), 0.01).is_err());
    assert_relative(sidak(0.05, 1), 0.05, 1e-12);
}

#[test]
fn chi_square_known_answer_and_pooling() {
    // The textbook die: 60 throws, statistic 13.4, five degrees of freedom, p = 0.0199.
    let die = chi_square_test(&[5.0, 8.0, 9.0, 8.0, 10.0, 20.0], &[10.0; 6], 0.01).unwrap();
    assert_relative(die.statistic, 13.4, 1e-12);
    assert_eq!(die.degrees_of_freedom, 5);
    assert_relative(die.p_value, 0.019905, 1e-4);
    assert!(die.passed);

    // Cells of 1 pool in fives; the two left over join the last pool.
    let expected = [vec![1.0; 12], vec![50.0]].concat();
    let pooled = chi_square_test(&expected, &expected, 0.01).unwrap();
    assert_eq!((pooled.degrees_of_freedom, pooled.statistic), (2, 0.0));

    let impossible = chi_square_test(&[1.0, 50.0, 50.0], &[0.0, 50.0, 51.0], 0.01).unwrap();
    assert_eq!((impossible.p_value, impossible.passed), (0.0, false));
    assert!(chi_square_test(&[1.0], &[1.0, 2.0], 0.01).is_err());
    assert!(chi_square_test(&[1.0, 1.0], &[1.0, 1.0], 0.01).is_err());
}

#[test]
fn chi_square_tells_a_skewed_histogram_from_a_fair_one() {
    let histogram = |power: f64| {
        let mut random = SplitMix(7);
        let mut cells = vec![0.0; 64];
        for _ in 0..64_000 {
            cells[(random.next_f64().powf(power) * 64.0) as usize] += 1.0;
        }
        cells
    };
    assert!(chi_square_test(&histogram(1.0), &[1000.0; 64], 0.01).unwrap().passed);
    assert!(!chi_square_test(&histogram(1.05), &[1000.0; 64], 0.01).unwrap().passed);
}

/// A picture with some structure, 64 x 64, around 1.
fn structured() -> Image {
    Image::from_fn(64, 64, |x, y| {
        let v = 0.2 + (x / 8 % 2) as f32 + (y as f32) / 64.0;
        [v, 0.8 * v, 0.6 * v]
    })
}

#[test]
fn equal_pictures_compare_as_equal() {
    let result = compare(&structured(), &structured()).unwrap();
    assert_eq!(
        (result.mse, result.rel_mse, result.trimmed_rel_mse, result.mean_ratio),
        (0.0, 0.0, 0.0, 1.0)
    );
    assert_eq!(result.flip, cfg!(feature = "flip").then_some(0.0));
}

#[test]
fn errors_have_their_known_values_whatever_the_exposure() {
    for exposure in [1.0, 1e-4, 1e4] {
        let reference = Image::filled(50, 40, [exposure; 3]);
        let mut image = Image::filled(50, 40, [1.1 * exposure; 3]);
        // Two of 2000 pixels are fireflies: just what the trimmed mean drops.
        image.pixels[7] = [101.0 * exposure; 3];
        image.pixels[777] = [101.0 * exposure; 3];
        let result = compare(&image, &reference).unwrap();
        let mse = (0.01 * 1998.0 + 2.0 * 1e4) / 2000.0;
        assert_relative(result.mse, mse, 1e-5);
        assert_relative(result.rel_mse, mse / 1.01, 1e-5);
        assert_relative(result.trimmed_rel_mse, 0.01 / 1.01, 1e-5);
        assert_relative(result.mean_ratio, (1.1 * 1998.0 + 202.0) / 2000.0, 1e-6);
    }
}

#[test]
fn what_averages_out_in_a_block_is_no_error_of_blocks() {
    // Blocks at the right and at the bottom are smaller ones.
    let reference = Image::filled(50, 42, [1.0; 3]);
    let blocks = |value: fn(u32, u32) -> f32| {
        let image = Image::from_fn(50, 42, |x, y| [value(x, y); 3]);
        compare(&image, &reference).unwrap().block_rel_mse
    };
    assert_relative(blocks(|_, _| 1.1), 0.01 / 1.01, 1e-5);
    assert!(blocks(|x, y| if (x + y).is_multiple_of(2) { 1.1 } else { 0.9 }) < 1e-12);
    let every_other_block =
        |x: u32, y: u32| if (x / 8 + y / 8).is_multiple_of(2) { 1.1 } else { 0.9 };
    assert_relative(blocks(every_other_block), 0.01 / 1.01, 1e-5);
}

#[test]
#[cfg(feature = "flip")]
fn flip_grows_with_the_difference_and_is_free_of_exposure() {
    let reference = structured();
    let brighter = |gain: f32| {
        let mut image = structured();
        image.pixels.as_flattened_mut().iter_mut().for_each(|v| *v *= gain);
        image
    };
    let flip = |image: &Image| compare(image, &reference).unwrap().flip.unwrap();
    let (small, large) = (flip(&brighter(1.05)), flip(&brighter(2.0)));
    assert!(0.0 < small && small < 0.1 && small < large && large < 1.0, "{small} {large}");
    let scaled = compare(&brighter(200.0), &brighter(100.0)).unwrap().flip.unwrap();
    assert!((scaled - large).abs() < 0.01, "{scaled} {large}");
}

#[test]
fn what_cannot_be_compared_is_said() {
    let picture = structured();
    let sentence = |a: &Image, b: &Image| compare(a, b).unwrap_err().to_string();
    let small = Image::filled(2, 2, [1.0; 3]);
    assert_eq!(sentence(&small, &picture), "the pictures differ in size: 2 x 2 and 64 x 64");
    let mut broken = structured();
    broken.pixels[3][1] = f32::NAN;
    assert_eq!(sentence(&broken, &picture), "the picture has 1 pixels that are NaN or infinite");
    assert!(sentence(&picture, &broken).contains("the reference has 1"));
    let black = Image::filled(64, 64, [0.0; 3]);
    assert!(sentence(&picture, &black).contains("the reference is black"));
    assert_eq!(compare(&black, &picture).unwrap().mean_ratio, 0.0);
    let one = Image::filled(1, 1, [1.0; 3]);
    assert_eq!(compare(&one, &one).unwrap().trimmed_rel_mse, 0.0);
}
