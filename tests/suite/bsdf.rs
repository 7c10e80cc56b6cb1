//! Tests of bsdf, and of the surfaces and textures that feed it.

mod scattering;
mod surfaces;
mod textures;

use glam::{Vec2, Vec3};

/// SplitMix64: enough randomness for tests, the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn next_vec2(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    fn next_vec3(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    fn direction(&mut self) -> Vec3 {
        spherical(2.0 * self.next() - 1.0, std::f32::consts::TAU * self.next())
    }
}

fn spherical(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}
