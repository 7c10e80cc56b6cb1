//! Random numbers for measurements and tests of the renderer.

use glam::Vec3;

/// SplitMix64 (Steele, Lea, Flood, *Fast Splittable Pseudorandom Number Generators*, 2014), from its seed: the
/// same numbers on every machine, and independent of [`Sampler`](super::Sampler).
#[derive(Debug, Clone)]
pub struct SplitMix(pub u64);

impl SplitMix {
    /// The next 64 bits.
    pub fn next_bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number below `count`, which is not 0.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next_bits()) * count as u128) >> 64) as usize
    }

    /// The next f32 in `[0,1)`.
    pub fn next_f32(&mut self) -> f32 {
        (self.next_bits() >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// The next f64 in `[0,1)`.
    pub fn next_f64(&mut self) -> f64 {
        (self.next_bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next two 32-bit fractions of one.
    pub fn next_words(&mut self) -> [u32; 2] {
        let bits = self.next_bits();
        [bits as u32, (bits >> 32) as u32]
    }

    /// The next point of `[-1,1)^3`.
    pub fn next_in_cube(&mut self) -> Vec3 {
        Vec3::new(self.next_f32(), self.next_f32(), self.next_f32()) * 2.0 - 1.0
    }

    /// The next unit vector, uniform over the sphere.
    pub fn next_direction(&mut self) -> Vec3 {
        loop {
            let v = self.next_in_cube();
            if (1e-4..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}
