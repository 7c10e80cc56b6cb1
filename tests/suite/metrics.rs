//! Tests of metrics.

use lightgrid::image::Image;
use lightgrid::metrics::compare;
use lightgrid::metrics::hypothesis::{chi_square_test, student_975, two_sided_p};
use lightgrid::sampler::SplitMix;

fn assert_relative(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance * want.abs(), "got {got:e}, want {want:e}");
}

/// Reference values from mpmath 1.3 and any table.
#[test]
fn tails_are_the_distributions() {
    for (z, want) in
        [(1.0, 0.317310507862914), (2.0, 0.0455002638963584), (20.0, 5.50724823721247e-89)]
    {
        assert_relative(two_sided_p(z), want, 1e-9);
    }
    assert_eq!((two_sided_p(0.0), two_sided_p(f64::NAN)), (1.0, 0.0));
    for (degrees, want) in [(1, 12.706), (2, 4.303), (9, 2.262), (30, 2.042), (1000, 1.962)] {
        assert_relative(student_975(degrees), want, 5e-4);
    }
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
