//! Deterministic hashes and smooth noise for procedural textures and skies.

use glam::{IVec2, Vec2, Vec3};

use crate::sampler::{hash, unit_from_bits};

/// Hash of `seed` as a number in `[0,1)`.
pub fn unit(seed: u32) -> f32 {
    unit_from_bits(hash(seed))
}

/// A reproducible stream of numbers.
#[derive(Debug, Clone)]
pub struct Stream {
    seed: u32,
    index: u32,
}

impl Stream {
    /// The stream of one seed.
    pub fn new(seed: u32) -> Self {
        Self { seed: hash(seed), index: 0 }
    }

    /// The next number, uniform in `[low, high)`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        self.index = self.index.wrapping_add(1);
        low + (high - low) * unit(self.seed ^ self.index.wrapping_mul(0x9e37_79b9))
    }

    /// The next index below `count` (at least 1).
    pub fn index(&mut self, count: usize) -> usize {
        (self.between(0.0, count as f32) as usize).min(count.max(1) - 1)
    }
}

/// Hermite ramp of `x` from 0 at `low` to 1 at `high`.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Value noise in the plane with mean 1/2 in `[0,1]`, which repeats every `period` lattice cells.
pub fn tiling(p: Vec2, period: IVec2, seed: u32) -> f32 {
    let cell = p.floor();
    let t = p - cell;
    let t = t * t * (Vec2::splat(3.0) - 2.0 * t);
    let c = cell.as_ivec2();
    // The lattice line after `a`, which has been wrapped already.
    let after = |a: u32, period: i32| if a + 1 == period as u32 { 0 } else { a + 1 };
    let (x0, y0) = (c.x.rem_euclid(period.x) as u32, c.y.rem_euclid(period.y) as u32);
    let x1 = after(x0, period.x);
    let row = |y: u32| {
        let y = hash(y ^ seed.rotate_left(16));
        let (a, b) =
            (unit(y ^ x0.wrapping_mul(0x9e37_79b9)), unit(y ^ x1.wrapping_mul(0x9e37_79b9)));
        a + (b - a) * t.x
    };
    let (a, b) = (row(y0), row(after(y0, period.y)));
    a + (b - a) * t.y
}

/// Sum of `octaves` of [`tiling`], each at twice the frequency and half the weight; in `[0,1]`.
pub fn tiling_fbm(p: Vec2, period: IVec2, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        let scale = 1 << octave;
        sum += weight * tiling(p * scale as f32, period * scale, seed.wrapping_add(octave * 101));
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// Value noise in space with mean 1/2, in `[0,1]`.
pub fn solid(p: Vec3, seed: u32) -> f32 {
    let cell = p.floor();
    let t = p - cell;
    let t = t * t * (Vec3::splat(3.0) - 2.0 * t);
    let c = cell.as_ivec3();
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    // What corners side by side have in common is hashed once.
    let columns = [0, 1].map(|x| {
        let x = hash((c.x + x) as u32 ^ seed);
        [0, 1].map(|y| hash(x.wrapping_add((c.y + y) as u32)))
    });
    let face = |z: i32| {
        let corner = |x: usize, y: usize| unit(columns[x][y].wrapping_add((c.z + z) as u32));
        mix(mix(corner(0, 0), corner(1, 0), t.x), mix(corner(0, 1), corner(1, 1), t.x), t.y)
    };
    mix(face(0), face(1), t.z)
}

/// Sum of `octaves` of [`solid`], each at about twice the frequency and half the weight; in `[0,1]`.
pub fn solid_fbm(p: Vec3, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..octaves {
        sum += weight * solid(p * scale, seed.wrapping_add(octave * 101));
        total += weight;
        weight *= 0.5;
        scale *= 2.03;
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiling_noise_repeats_and_varies() {
        let period = IVec2::new(4, 6);
        let mut spread: f32 = 0.0;
        for i in 0..50 {
            let p = Vec2::new(0.37 * i as f32, 0.21 * i as f32);
            let here = tiling_fbm(p, period, 3, 7);
            assert!((here - tiling_fbm(p + Vec2::new(4.0, -6.0), period, 3, 7)).abs() < 1e-4);
            assert!((0.0..=1.0).contains(&here));
            spread = spread.max((here - 0.5).abs());
        }
        assert!(spread > 0.1);
    }

    #[test]
    fn a_stream_is_uniform() {
        let mut stream = Stream::new(1);
        let mean: f32 = (0..10_000).map(|_| stream.between(0.0, 1.0)).sum::<f32>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!((0..100).all(|_| stream.index(3) < 3));
    }
}
