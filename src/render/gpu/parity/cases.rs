//! Random and edge cases.

use glam::{Vec2, Vec3, Vec4};

use crate::sampler::{hash, unit_from_bits};

/// Random cases of a probe.
pub(super) const COUNT: usize = 3000;

/// Something a case holds.
pub(super) trait Part {
    /// Appends its words.
    fn push_to(&self, words: &mut Vec<u32>);
}

impl Part for u32 {
    fn push_to(&self, words: &mut Vec<u32>) {
        words.push(*self);
    }
}

impl Part for bool {
    fn push_to(&self, words: &mut Vec<u32>) {
        words.push((*self).into());
    }
}

impl Part for f32 {
    fn push_to(&self, words: &mut Vec<u32>) {
        words.push(self.to_bits());
    }
}

macro_rules! vector_parts {
    ($($vector:ty),*) => {$(
        impl Part for $vector {
            fn push_to(&self, words: &mut Vec<u32>) {
                words.extend(self.to_array().map(f32::to_bits));
            }
        }
    )*};
}

vector_parts!(Vec2, Vec3, Vec4);

/// The words of a case.
pub(super) fn case(parts: &[&dyn Part]) -> Vec<u32> {
    let mut words = Vec::new();
    parts.iter().for_each(|part| part.push_to(&mut words));
    words
}

/// Edge cases, then [`COUNT`] random ones.
pub(super) fn cases(
    edges: impl IntoIterator<Item = Vec<u32>>,
    mut random: impl FnMut(&mut Random) -> Vec<u32>,
) -> Vec<Vec<u32>> {
    let mut numbers = Random::default();
    edges.into_iter().chain((0..COUNT).map(|_| random(&mut numbers))).collect()
}

/// Random numbers, the same in every run.
#[derive(Debug, Default)]
pub(super) struct Random(u32);

impl Random {
    pub(super) fn word(&mut self) -> u32 {
        self.0 += 1;
        hash(hash(self.0) ^ 0x9e37_79b9)
    }

    /// Less than `count`.
    pub(super) fn below(&mut self, count: u32) -> u32 {
        self.word() % count
    }

    /// In `[0,1)`.
    pub(super) fn unit(&mut self) -> f32 {
        unit_from_bits(self.word())
    }

    pub(super) fn unit2(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    pub(super) fn unit3(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// In `[low, high)`.
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Of any magnitude between, evenly in its logarithm.
    pub(super) fn magnitude(&mut self, low: f32, high: f32) -> f32 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// The same with either sign.
    pub(super) fn signed(&mut self, low: f32, high: f32) -> f32 {
        let sign = if self.word() & 1 == 0 { 1.0 } else { -1.0 };
        sign * self.magnitude(low, high)
    }

    /// In the cube from -1 to 1.
    pub(super) fn in_cube(&mut self) -> Vec3 {
        2.0 * self.unit3() - 1.0
    }

    /// Unit.
    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if (1e-4..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// Unit, in the plane.
    pub(super) fn axis(&mut self) -> Vec2 {
        Vec2::from_angle(self.between(-4.0, 4.0))
    }

    /// Unit with `z > 0`; one in four is close to grazing.
    pub(super) fn upper_direction(&mut self) -> Vec3 {
        let mut v = self.direction();
        if self.below(4) == 0 {
            v.z *= self.magnitude(1e-4, 1.0);
        }
        v.z = v.z.abs().max(1e-6);
        v.normalize()
    }
}

/// Unit directions at which formulas for directions change: axes, the seam, diagonals, nearly the
/// poles.
pub(super) fn edge_directions() -> Vec<Vec3> {
    let mut directions = vec![
        Vec3::new(-1.0, 0.0, -0.0),
        Vec3::new(-1.0, 0.0, 1e-30),
        Vec3::new(-1.0, 0.0, -1e-30),
        Vec3::new(-1.0, 0.0, -1e-7),
        Vec3::new(-1.0, -0.0, 1e-7),
        Vec3::new(1e-30, 1.0, 1e-30),
        Vec3::new(-1e-20, -1.0, 1e-20),
        Vec3::new(1e-5, 1.0, -1e-5),
        Vec3::new(0.0, 1e-40, -1.0),
        Vec3::new(1e-40, -1.0, 0.0),
    ];
    for axis in Vec3::AXES {
        directions.extend([axis, -axis]);
    }
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { 1.0 } else { -1.0_f32 };
        let corner = Vec3::new(sign(0), sign(1), sign(2));
        directions.extend([corner.normalize(), corner.with_y(0.0).normalize()]);
    }
    directions
}

/// Numbers of the unit interval at its ends and where tables and octants begin.
pub(super) const EDGE_UNITS: [f32; 9] =
    [0.0, 5.960_464_5e-8, 1e-3, 0.125, 0.25, 0.5, 0.75, 0.999_999, 1.0 - f32::EPSILON / 2.0];

/// All pairs of [`EDGE_UNITS`].
pub(super) fn edge_squares() -> Vec<Vec2> {
    let units = EDGE_UNITS.into_iter();
    units.flat_map(|x| EDGE_UNITS.map(|y| Vec2::new(x, y))).collect()
}

/// The same as 32-bit fractions of one.
pub(super) fn edge_words() -> impl Iterator<Item = [u32; 2]> {
    edge_squares().into_iter().map(|u| u.to_array().map(|x| (x * 4_294_967_296.0) as u32))
}
