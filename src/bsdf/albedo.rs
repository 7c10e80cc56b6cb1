//! Directional albedo of the GGX reflection lobe, tabulated once.
//!
//! With Schlick's Fresnel the albedo is linear in F0 and F90: `E = F0 * A + F90 * B`, where `A` and
//! `B` depend on the cosine and the roughness only (the split sum of Karis, *Real Shading in Unreal
//! Engine 4*, 2013). A diffuse base under the lobe gets what is left of both directions,
//! `(1 - E(o)) (1 - E(i)) / (1 - E_mean)`, which is reciprocal and loses nothing (Kelemen and
//! Szirmay-Kalos 2001; Kulla and Conty 2017). glTF's own mix by the half vector's Fresnel gains
//! energy at grazing angles.

use std::array;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::fresnel::{reflect, schlick_weight};
use super::microfacet::Ggx;

const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
/// Visible normals per entry and axis; the table is then within 0.002 of its limit.
const SAMPLES: usize = 24;

/// One roughness: `(A, B)` at uniformly spaced cosines, and their cosine-weighted means.
struct Row {
    terms: [Vec2; COSINES],
    mean: Vec2,
}

static ROWS: LazyLock<[Row; ROUGHNESSES]> = LazyLock::new(|| array::from_fn(row));

/// The albedo terms of one roughness, interpolated between two rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct AlbedoTerms {
    row: u32,
    fraction: f32,
}

impl AlbedoTerms {
    /// `roughness` is perceptual, in `[0,1]`.
    pub(super) fn of(roughness: f32) -> Self {
        let x = roughness * (ROUGHNESSES - 1) as f32;
        let row = (x as usize).min(ROUGHNESSES - 2);
        Self { row: row as u32, fraction: x - row as f32 }
    }

    /// `(A, B)` seen from a direction of this cosine, in `[0,1]`.
    pub(super) fn at(self, cos: f32) -> Vec2 {
        let x = cos.clamp(0.0, 1.0) * (COSINES - 1) as f32;
        let column = (x as usize).min(COSINES - 2);
        let fraction = x - column as f32;
        let in_row = |row: &Row| row.terms[column].lerp(row.terms[column + 1], fraction);
        self.between(in_row)
    }

    /// Cosine-weighted mean of [`Self::at`] over the hemisphere.
    pub(super) fn mean(self) -> Vec2 {
        self.between(|row| row.mean)
    }

    fn between(self, of: impl Fn(&Row) -> Vec2) -> Vec2 {
        let row = self.row as usize;
        of(&ROWS[row]).lerp(of(&ROWS[row + 1]), self.fraction)
    }
}

fn row(index: usize) -> Row {
    let ggx = Ggx::from_roughness(index as f32 / (ROUGHNESSES - 1) as f32);
    let step = 1.0 / (COSINES - 1) as f32;
    let terms = array::from_fn(|i| entry(ggx, (i as f32 * step).max(1e-3)));
    // The integral of 2 cos E(cos) over each linear piece, so that mean and pieces agree exactly.
    let mean = (0..COSINES - 1)
        .map(|i| {
            let (c0, c1) = (i as f32 * step, (i + 1) as f32 * step);
            let (e0, e1): (Vec2, Vec2) = (terms[i], terms[i + 1]);
            (e0 * (2.0 * c0 + c1) + e1 * (c0 + 2.0 * c1)) * (step / 3.0)
        })
        .sum();
    Row { terms, mean }
}

fn entry(ggx: Ggx, cos: f32) -> Vec2 {
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    if ggx.is_smooth() {
        let w = schlick_weight(cos);
        return Vec2::new(1.0 - w, w);
    }
    let midpoint = |i: usize| (i as f32 + 0.5) / SAMPLES as f32;
    let mut sum = Vec2::ZERO;
    for y in 0..SAMPLES {
        for x in 0..SAMPLES {
            let h = ggx.sample_visible_normal(wo, Vec2::new(midpoint(x), midpoint(y)));
            let wi = reflect(wo, h);
            if wi.z > 0.0 {
                let masking = 2.0 * wi.z * ggx.visibility(wi.z);
                let w = schlick_weight(wo.dot(h));
                sum += masking * Vec2::new(1.0 - w, w);
            }
        }
    }
    sum / (SAMPLES * SAMPLES) as f32
}
