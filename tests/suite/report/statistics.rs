//! Slopes, curves, speed-ups and intervals whose answers are known.

use lightgrid::report::statistics::{Bundle, Curve, Estimate, SpeedUp, bootstrap, power_law_slope};
use lightgrid::sampler::SplitMix;

fn curve(start: f64, end: f64, error: impl Fn(f64) -> f64) -> Curve {
    let points = (0..40).map(|i| start * (end / start).powf(f64::from(i) / 39.0));
    Curve { points: points.map(|t| (t, error(t))).collect() }
}

/// A standard normal number (Box and Muller).
fn normal(random: &mut SplitMix) -> f64 {
    let radius = (-2.0 * (1.0 - random.next_f64()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.next_f64()).cos()
}

#[test]
fn a_power_law_has_its_slope() {
    for power in [-1.0, -1.37, -0.5, 2.0] {
        let points: Vec<(f64, f64)> =
            (1..9).map(|i| (f64::from(i), 3e-4 * f64::from(i).powf(power))).collect();
        let slope = power_law_slope(&points).expect("points");
        assert!((slope - power).abs() < 1e-12, "{slope}");
    }
    assert_eq!(power_law_slope(&[(1.0, 2.0)]), None);
    assert_eq!(power_law_slope(&[(1.0, 2.0), (1.0, 3.0)]), None);
}

#[test]
fn estimates_are_the_textbooks() {
    let of = Estimate::of(&[2.0, 4.0, 4.0, 6.0]).expect("finite");
    assert_eq!(of.mean, 4.0);
    // Sample variance 8/3, of the mean 2/3.
    assert!((of.standard_error.expect("four") - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    assert_eq!(Estimate::of(&[3.0]), Some(Estimate { mean: 3.0, standard_error: None }));
    assert_eq!(Estimate::of(&[1.0, f64::NAN]), None);
    assert_eq!(Estimate::of(&[]), None);
}

#[test]
fn curves_are_power_laws_between_their_points() {
    let curve = Curve { points: vec![(1.0, 8.0), (4.0, 2.0), (8.0, 2.0)] };
    assert!((curve.at(2.0).expect("inside") - 4.0).abs() < 1e-12);
    assert_eq!(curve.at(4.0), Some(2.0));
    assert_eq!((curve.at(0.9), curve.at(8.1)), (None, None));
}

#[test]
fn speed_ups_count_learning() {
    // The method learns for a second, then is four times as good: 2/(t-1) against 8/t. At the end the
    // baseline is at 1/2, where the method is after 5 seconds.
    let baseline = Bundle::new(&[curve(0.1, 16.0, |t| 8.0 / t)], 16.0).expect("a curve");
    let method = Bundle::new(&[curve(1.01, 17.0, |t| 2.0 / (t - 1.0))], 16.0).expect("a curve");
    let found = SpeedUp::new(&baseline, &method).expect("a ratio");
    assert!((found.ratio - 3.2).abs() < 0.02, "{found:?}");
    assert!((found.error - 0.5).abs() < 1e-6 && !found.is_bound, "{found:?}");
    assert_eq!(found.interval, None, "one run has no interval");
    let reverse = SpeedUp::new(&method, &baseline).expect("a ratio");
    assert!((reverse.ratio * found.ratio - 1.0).abs() < 1e-9, "{reverse:?}");
}

#[test]
fn what_is_better_from_the_start_gives_a_bound() {
    let baseline = Bundle::new(&[curve(0.1, 10.0, |t| 1.0 / t)], 10.0).expect("a curve");
    let method = Bundle::new(&[curve(2.0, 10.0, |t| 0.01 / t)], 10.0).expect("a curve");
    let found = SpeedUp::new(&baseline, &method).expect("a ratio");
    assert!(found.is_bound, "{found:?}");
    assert!((found.ratio - 5.0).abs() < 1e-9, "{found:?}");
    let (seconds, is_bound) = baseline.seconds_to(0.2).expect("it falls to 0.1");
    assert!((seconds - 5.0).abs() < 1e-6 && !is_bound, "{seconds}");
    assert_eq!(baseline.seconds_to(0.05), None);
    assert!(baseline.seconds_to(20.0).is_some_and(|(_, is_bound)| is_bound));
    assert_eq!(Bundle::new(&[curve(11.0, 20.0, |t| 1.0 / t)], 10.0), None, "no picture in time");
}

/// 95 % intervals of the ratio of two means hold the truth in 95 % of all trials, for few runs of
/// skewed errors too: 600 trials, standard error 0.9 %, and a little slack for the skew.
#[test]
fn intervals_cover_what_they_say() {
    let mut random = SplitMix(7);
    for (runs, least) in [(4, 0.90), (10, 0.91)] {
        let mut covered = 0;
        let trials = 600;
        for _ in 0..trials {
            let mut group = |mean: f64| -> Vec<f64> {
                // Log-normal with mean 1.
                (0..runs).map(|_| mean * (0.4 * normal(&mut random) - 0.08).exp()).collect()
            };
            let (a, b) = (group(3.0), group(1.0));
            let mean = |values: &[f64], chosen: &[usize]| {
                chosen.iter().map(|i| values[*i]).sum::<f64>() / chosen.len() as f64
            };
            let interval = bootstrap([runs, runs], |[i, j]| mean(&a, i) / mean(&b, j));
            let interval = interval.expect("several runs");
            covered += i32::from(interval.low <= 3.0 && 3.0 <= interval.high);
        }
        let share = f64::from(covered) / f64::from(trials);
        eprintln!("{runs} runs: {share}");
        assert!((least..=0.995).contains(&share), "{runs} runs: {share}");
    }
}

#[test]
fn intervals_are_repeatable_and_need_two_runs() {
    let values = [1.0, 2.0, 4.0, 8.0];
    let mean = |[a, _]: [&[usize]; 2]| a.iter().map(|i| values[*i]).sum::<f64>() / a.len() as f64;
    assert_eq!(bootstrap([4, 4], mean), bootstrap([4, 4], mean));
    assert_eq!(bootstrap([4, 1], mean), None);
}
