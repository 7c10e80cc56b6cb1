//! Directional albedo of the GGX reflection lobe, tabulated once.
//!
//! With Schlick's Fresnel the albedo is linear in F0 and F90: `E = F0 * A + F90 * B`, where `A` and
//! `B` depend on the cosine and the roughness only (the split sum of Karis, *Real Shading in Unreal
//! Engine 4*, 2013). A diffuse base under the lobe gets what is left of both directions,
//! `(1 - E(o)) (1 - E(i)) / (1 - E_mean)`, which is reciprocal and loses nothing (Kelemen and
//! Szirmay-Kalos 2001; Kulla and Conty 2017). glTF's own mix by the half vector's Fresnel gains
//! energy at grazing angles.

use std::array;
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_8};
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::fresnel::{reflect, schlick_weight};
use super::microfacet::Ggx;

pub(crate) const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
/// Visible normals per entry. With it the table is within 0.008 of its limit, between nodes too.
const SAMPLES: u32 = 1024;

/// One roughness: `(A, B)` at uniformly spaced square roots of the cosine (narrow lobes change fast at
/// grazing angles), and their cosine-weighted means.
struct Row {
    terms: [Vec2; COSINES],
    mean: Vec2,
}

static ROWS: LazyLock<[Row; ROUGHNESSES]> = LazyLock::new(|| array::from_fn(row));

/// The albedo terms of a GGX.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AlbedoTerms {
    ggx: Ggx,
    rows: RowPair,
}

impl AlbedoTerms {
    /// `roughness` is perceptual, in `[0,1]`; that of `ggx` across its axis.
    pub(crate) fn of(ggx: Ggx, roughness: f32) -> Self {
        Self { ggx, rows: RowPair::of(roughness) }
    }

    /// `(A, B)` towards a unit `v` above the surface, each in `[0,1]`.
    ///
    /// A stretched GGX is taken from those of one width: `B` of one that masks as much towards `v`,
    /// `A`, which hardly depends on the azimuth, of one between the two widths. Measured for all
    /// widths and strengths: `0.04 A + B` is at most 0.01 too small.
    pub(crate) fn at(self, v: Vec3) -> Vec2 {
        if !self.ggx.is_stretched() {
            return self.rows.at(v.z);
        }
        let towards = RowPair::of(self.ggx.roughness_towards(v)).at(v.z);
        self.stretched(self.diagonal().at(v.z), towards)
    }

    /// Cosine-weighted mean of [`Self::at`] over the hemisphere; of a stretched GGX over two azimuths.
    pub(crate) fn mean(self) -> Vec2 {
        if !self.ggx.is_stretched() {
            return self.rows.mean();
        }
        let off_axis = |cos, sin| RowPair::of(self.ggx.roughness_off_axis(cos, sin)).mean();
        let (sin, cos) = FRAC_PI_8.sin_cos();
        let towards = 0.5 * (off_axis(cos, sin) + off_axis(sin, cos));
        self.stretched(self.diagonal().mean(), towards)
    }

    fn diagonal(self) -> RowPair {
        RowPair::of(self.ggx.roughness_off_axis(FRAC_1_SQRT_2, FRAC_1_SQRT_2))
    }

    /// `A` is raised by as much as it may be too small where the interface reflects white.
    fn stretched(self, diagonal: Vec2, towards: Vec2) -> Vec2 {
        let a = diagonal.x + 0.3 * self.ggx.stretch() * (1.0 - diagonal.x);
        Vec2::new(a.min(1.0 - towards.y), towards.y)
    }
}

/// One roughness, interpolated between two rows.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RowPair {
    row: u32,
    fraction: f32,
}

impl RowPair {
    fn of(roughness: f32) -> Self {
        let (row, fraction) = split(roughness * (ROUGHNESSES - 1) as f32, ROUGHNESSES - 2);
        Self { row: row as u32, fraction }
    }

    /// `(A, B)` at a cosine in `[0,1]`.
    fn at(self, cos: f32) -> Vec2 {
        let x = cos.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f32;
        let (column, fraction) = split(x, COSINES - 2);
        let in_row = |row: &Row| row.terms[column].lerp(row.terms[column + 1], fraction);
        self.between(in_row)
    }

    fn mean(self) -> Vec2 {
        self.between(|row| row.mean)
    }

    fn between(self, of: impl Fn(&Row) -> Vec2) -> Vec2 {
        let row = self.row as usize;
        of(&ROWS[row]).lerp(of(&ROWS[row + 1]), self.fraction)
    }
}

/// A place between two nodes of a table: whole part, at most `most`, and the rest.
#[inline]
pub(super) fn split(x: f32, most: usize) -> (usize, f32) {
    let whole = (x as usize).min(most);
    (whole, x - whole as f32)
}

/// The table as `shaders/albedo.wgsl` reads it: row by row the terms and their mean, each with those of
/// the row after it.
pub(crate) fn texels() -> Vec<[f32; 4]> {
    let entries = |row: &'static Row| row.terms.iter().chain([&row.mean]);
    let pairs = ROWS.windows(2).flat_map(|rows| entries(&rows[0]).zip(entries(&rows[1])));
    pairs.map(|(here, next)| [here.x, here.y, next.x, next.y]).collect()
}

fn row(index: usize) -> Row {
    let ggx = Ggx::from_roughness(index as f32 / (ROUGHNESSES - 1) as f32);
    let step = 1.0 / (COSINES - 1) as f32;
    let root = |i: usize| i as f32 * step;
    let terms = array::from_fn(|i| entry(ggx, root(i).powi(2).max(1e-5), SAMPLES));
    // The integral of 2 cos E over each piece, linear in x = sqrt(cos), so that mean and pieces agree
    // exactly: 4 x^3 (offset + slope x).
    let of_piece = |i: usize| {
        let (x0, x1) = (root(i), root(i + 1));
        let slope: Vec2 = (terms[i + 1] - terms[i]) / step;
        let offset: Vec2 = terms[i] - slope * x0;
        offset * (x1.powi(4) - x0.powi(4)) + slope * (0.8 * (x1.powi(5) - x0.powi(5)))
    };
    let mean = (0..COSINES - 1).map(of_piece).sum();
    Row { terms, mean }
}

/// `(A, B)` from so many visible normals, at the points of the R2 sequence (Roberts, *The Unreasonable
/// Effectiveness of Quasirandom Sequences*, 2018).
fn entry(ggx: Ggx, cos: f32, samples: u32) -> Vec2 {
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    if ggx.is_smooth() {
        let w = schlick_weight(cos);
        return Vec2::new(1.0 - w, w);
    }
    let mut sum = Vec2::ZERO;
    let mut u = Vec2::splat(0.5);
    for _ in 0..samples {
        u = (u + Vec2::new(0.754_877_7, 0.569_840_3)).fract();
        let h = ggx.sample_visible_normal(wo, u);
        let wi = reflect(wo, h);
        if wi.z > 0.0 {
            let masking = 2.0 * wi.z * ggx.visibility(wi);
            let w = schlick_weight(wo.dot(h));
            sum += masking * Vec2::new(1.0 - w, w);
        }
    }
    sum / samples as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_close_to_fine_quadrature_between_its_nodes() {
        let mut worst = 0.0_f32;
        for r in 0..20 {
            for c in 0..20 {
                let (roughness, cos) = ((r as f32 + 0.37) / 20.0, (c as f32 + 0.43) / 20.0);
                let exact = entry(Ggx::from_roughness(roughness), cos, 1 << 16);
                let error = RowPair::of(roughness).at(cos) - exact;
                worst = worst.max(error.abs().max_element());
            }
        }
        assert!(worst < 0.008, "{worst}");
    }
}
