//! Noise of means over blocks of pixels: what outlasts a denoiser.

use lightgrid::environment::sky;
use lightgrid::path::World;
use lightgrid::render::{Sampling, Sharing, View};
use lightgrid::sampler::Points;
use lightgrid::scene::builtin;

use super::{environment, render};

/// Edge of a block in pixels.
const BLOCK: usize = 16;

/// Relative variance of block means over seeds, without the tenth of the blocks that have most of it.
fn block_noise(scene: &str, points: Points) -> f64 {
    const SEEDS: u32 = 12;
    let world = World::new(builtin::build(scene).expect("built in"));
    let environment = environment(sky::build("overcast", 256, 128).expect("a sky"));
    let films = (0..SEEDS).map(|seed| {
        let view = View {
            sampling: Sampling::Plain,
            sharing: Sharing::Off,
            points,
            seed,
            ..View::new(world.scene.cameras[0].clone(), [128, 96])
        };
        render(&world, &environment, view, 1)
    });
    let [across, down] = [128 / BLOCK, 96 / BLOCK];
    let mut sums = vec![[0.0; 2]; across * down];
    for film in films {
        let mut means = vec![0.0; sums.len()];
        for (index, pixel) in film.pixels().iter().enumerate() {
            let (x, y) = (index % 128 / BLOCK, index / 128 / BLOCK);
            means[y * across + x] += pixel.mean_luminance() / (BLOCK * BLOCK) as f64;
        }
        for (sum, mean) in sums.iter_mut().zip(means) {
            *sum = [sum[0] + mean, sum[1] + mean * mean];
        }
    }
    let count = f64::from(SEEDS);
    let relative = |[sum, squares]: [f64; 2]| (count * squares / (sum * sum) - 1.0) / (count - 1.0);
    let mut noise: Vec<f64> = sums.into_iter().map(relative).collect();
    noise.sort_by(f64::total_cmp);
    noise.truncate(noise.len() * 9 / 10);
    noise.iter().sum::<f64>() * count / noise.len() as f64
}

/// Variances of the 43 blocks have 11 degrees of freedom each: their mean is good to a tenth.
#[test]
fn blocks_have_less_noise_than_those_of_independent_points() {
    for (scene, limit) in [("open", 0.5), ("exterior", 0.85)] {
        let [even, independent] =
            [Points::Sobol, Points::Independent].map(|points| block_noise(scene, points));
        eprintln!("{scene}: {even:.2e} over {independent:.2e} is {:.2}", even / independent);
        assert!(even < limit * independent, "{scene}: {even} for {independent}");
    }
}
