//! Procedural colour textures, deterministic and tileable.

use glam::{FloatExt, IVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::color::srgb_from_linear;
use crate::noise::{smoothstep, tiling, tiling_fbm, unit};
use crate::sampler::hash;
use crate::scene::TextureImage;

/// An image of linear colours that `f` makes of some tones at `(u, v)`, stored sRGB-encoded.
fn paint<const N: usize>(
    [width, height]: [u32; 2],
    tones: [[f32; 3]; N],
    f: impl Fn(Vec2, [Vec3; N]) -> Vec3 + Sync,
) -> TextureImage {
    const STEPS: usize = 4096;
    let encode: Vec<u8> = (0..=STEPS)
        .map(|i| (255.0 * srgb_from_linear(i as f32 / STEPS as f32) + 0.5) as u8)
        .collect();
    let byte = |x: f32| encode[(x.clamp(0.0, 1.0) * STEPS as f32) as usize];
    let tones = tones.map(Vec3::from);
    let texels = texel_by_texel([width, height], |uv, _| f(uv, tones).to_array().map(byte));
    TextureImage { width, height, texels: texels.into() }
}

/// What `f` says of each texel of an image: of the middle of it as (u, v), and of its column and row.
pub(super) fn texel_by_texel<T: Send>(
    [width, height]: [u32; 2],
    f: impl Fn(Vec2, [u32; 2]) -> T + Sync,
) -> Vec<T> {
    let size = Vec2::new(width as f32, height as f32);
    let row = |y: u32| {
        let f = &f;
        (0..width).map(move |x| f(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / size, [x, y]))
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

/// Seed of the wood of `timber`.
pub(super) const TIMBER: u32 = 11;

/// Strength of the fibres of wood along u, and of its pores, both in `[0,1]`.
pub(super) fn fibres(uv: Vec2, seed: u32) -> (f32, f32) {
    let shift = unit(seed) * 8.0;
    let fibre = tiling(uv * Vec2::new(20.0, 300.0) + shift, IVec2::new(20, 300), seed ^ 5);
    let pores =
        smoothstep(0.62, 0.8, tiling(uv * Vec2::new(40.0, 400.0), IVec2::new(40, 400), seed ^ 9));
    (fibre, pores)
}

/// Wood of base colour `tone` with its grain along u; each plank has a `seed` of its own.
fn grain(uv: Vec2, tone: Vec3, seed: u32) -> Vec3 {
    let shift = unit(seed) * 8.0;
    let warp = tiling_fbm(uv * Vec2::new(4.0, 8.0) + shift, IVec2::new(4, 8), 2, seed);
    let rings = uv.y * 14.0 + 3.2 * warp + shift;
    let ring = 0.5 + 0.5 * (rings * std::f32::consts::TAU).sin();
    let (fibre, pores) = fibres(uv, seed);
    let light = 0.80 + 0.13 * ring + 0.34 * (fibre - 0.5) - 0.12 * pores + 0.15 * (warp - 0.5);
    // Darker wood is also redder.
    tone * light * (Vec3::ONE + Vec3::new(0.2, 0.0, -0.25) * (1.0 - light))
}

/// Timber for furniture, grain along u.
pub(super) fn timber(tone: [f32; 3]) -> TextureImage {
    paint([512, 384], [tone], |uv, [tone]| grain(uv, tone, TIMBER))
}

/// A piece of a wooden floor at a place of it.
pub(super) struct Board {
    /// Seed of its grain.
    pub(super) seed: u32,
    /// Place in the wood that it is cut from.
    pub(super) wood: Vec2,
    /// 0 in the middle of a joint, 1 away from it.
    pub(super) top: f32,
    shade: f32,
}

impl Board {
    /// One of `rows` of boards along u, each of `boards` pieces, with staggered ends.
    pub(super) fn of_planks(uv: Vec2, rows: u32, boards: u32) -> Self {
        let v = uv.y * rows as f32;
        let row = v as u32;
        let u = (uv.x * boards as f32 + unit(row * 7 + 3)).rem_euclid(boards as f32);
        let id = hash(row * 131 + u as u32);
        let edge = (v.fract().min(1.0 - v.fract()) / rows as f32)
            .min(u.fract().min(1.0 - u.fract()) / boards as f32);
        Self {
            seed: id,
            wood: uv + Vec2::new(unit(id), unit(id ^ 1)),
            top: smoothstep(0.0004, 0.0022, edge),
            shade: 0.78 + 0.44 * unit(id),
        }
    }

    /// A block of herringbone: the texture covers 24 x 24 widths of blocks 1 x 6.
    pub(super) fn of_herringbone(uv: Vec2) -> Self {
        const LENGTH: i32 = 6;
        const CELLS: i32 = 24;
        let p = uv * CELLS as f32;
        let cell = p.as_ivec2();
        let d = (cell.x - cell.y).rem_euclid(2 * LENGTH);
        // Block's first cell, and the place within it along and across.
        let lying = d < LENGTH;
        let (start, along, across) = if lying {
            let start = IVec2::new(cell.x - d, cell.y);
            (start, p.x - start.x as f32, p.y.fract())
        } else {
            let start = IVec2::new(cell.x, cell.y - (2 * LENGTH - 1 - d));
            (start, p.y - start.y as f32, p.x.fract())
        };
        let start = start.rem_euclid(IVec2::splat(CELLS));
        let id = hash((start.x * 64 + start.y * 2 + i32::from(lying)) as u32);
        let edge = across.min(1.0 - across).min(along).min(LENGTH as f32 - along);
        Self {
            seed: 40 + (id & 7),
            wood: Vec2::new(along / 24.0 + unit(id), across / 24.0 + unit(id ^ 3)),
            top: smoothstep(0.0, 0.045, edge),
            shade: 0.76 + 0.42 * unit(id ^ 7),
        }
    }

    /// Its colour; joints are darker by this factor.
    fn color(&self, tone: Vec3, joint: f32) -> Vec3 {
        grain(self.wood, tone * self.shade, self.seed) * joint.lerp(1.0, self.top)
    }
}

/// Floor boards along u: `rows` of them, each of `boards` pieces.
pub(super) fn planks(tone: [f32; 3], rows: u32, boards: u32) -> TextureImage {
    paint([1024; 2], [tone], |uv, [tone]| Board::of_planks(uv, rows, boards).color(tone, 0.35))
}

/// Herringbone parquet, 24 widths of a block each way.
pub(super) fn herringbone(tone: [f32; 3]) -> TextureImage {
    paint([1024; 2], [tone], |uv, [tone]| Board::of_herringbone(uv).color(tone, 0.45))
}

/// Wall paint over plaster: nearly even, a little cloudy.
pub(super) fn plaster(tone: [f32; 3], roughness: f32) -> TextureImage {
    paint([256; 2], [tone], |uv, [tone]| {
        let cloud = tiling_fbm(uv * 4.0, IVec2::splat(4), 4, 21) - 0.5;
        let speck = tiling(uv * 120.0, IVec2::splat(120), 22) - 0.5;
        tone * (1.0 + roughness * (0.5 * cloud + 0.16 * speck))
    })
}

/// The thread of a plain weave that lies on top at a place.
pub(super) struct Thread {
    number: u32,
    /// Place across it in `[0,1)`.
    across: f32,
    /// Place in `[0,1)` along it between the two threads under which it goes.
    pub(super) along: f32,
}

impl Thread {
    /// The top thread of a weave with `threads` across the texture each way.
    pub(super) fn at(uv: Vec2, threads: i32) -> Self {
        let p = uv * threads as f32;
        let (x, y) = (p.x.fract(), p.y.fract());
        if (p.x as i32 + p.y as i32) & 1 == 0 {
            Self { number: p.y as u32, across: y, along: x }
        } else {
            Self { number: 977 + p.x as u32, across: x, along: y }
        }
    }

    /// 1 along its middle, 0 at its sides.
    pub(super) fn roundness(&self) -> f32 {
        1.0 - (2.0 * self.across - 1.0).powi(2)
    }
}

/// Plain weave with uneven threads, `threads` across the texture.
pub(super) fn weave(tone: [f32; 3], threads: i32) -> TextureImage {
    paint([256; 2], [tone], |uv, [tone]| {
        let thread = Thread::at(uv, threads);
        let slub = tiling_fbm(uv * Vec2::splat(12.0), IVec2::splat(12), 3, 31) - 0.5;
        let shade = 0.16 * (unit(thread.number) - 0.5) + 0.22 * slub;
        tone * (0.74 + 0.24 * thread.roundness() + shade)
    })
}

/// Running-bond bricks, `columns` x `rows` of them (`rows` even).
pub(super) fn bricks(tone: [f32; 3], mortar: [f32; 3], columns: u32, rows: u32) -> TextureImage {
    paint([768; 2], [tone, mortar], |uv, [tone, mortar]| {
        let v = uv.y * rows as f32;
        let row = v as u32;
        let u = (uv.x * columns as f32 + 0.5 * (row & 1) as f32).rem_euclid(columns as f32);
        let id = hash(row * 57 + u as u32);
        let wobble = 0.05 * (tiling(uv * 90.0, IVec2::splat(90), 41) - 0.5);
        let edge =
            (v.fract().min(1.0 - v.fract())).min(2.2 * u.fract().min(1.0 - u.fract())) + wobble;
        let rough = tiling_fbm(uv * 40.0, IVec2::splat(40), 3, 42);
        let hue = Vec3::new(1.0, 0.9 + 0.2 * unit(id ^ 1), 0.85 + 0.3 * unit(id ^ 2));
        let brick = tone * hue * (0.65 + 0.5 * unit(id)) * (0.75 + 0.5 * rough);
        mortar.lerp(brick, smoothstep(0.055, 0.10, edge)) * (0.9 + 0.2 * rough)
    })
}

/// Square-cut stones in rows of uneven lengths, for paving and ashlar: `rows` of them (even).
pub(super) fn stones(tone: [f32; 3], rows: u32, columns: u32, joint: f32) -> TextureImage {
    paint([768; 2], [tone], |uv, [tone]| {
        let v = uv.y * rows as f32;
        let row = v as u32;
        let bend = 0.25
            * (tiling(Vec2::new(uv.x * 16.0, row as f32), IVec2::new(16, rows as i32), 51) - 0.5);
        let u = (uv.x * columns as f32 + unit(row) + bend).rem_euclid(columns as f32);
        let id = hash(row * 91 + u as u32 + 17);
        let edge = (v.fract().min(1.0 - v.fract()))
            .min(u.fract().min(1.0 - u.fract()) * rows as f32 / columns as f32);
        let edge = edge + 0.06 * (tiling(uv * 120.0, IVec2::splat(120), 52) - 0.5);
        let rough = tiling_fbm(uv * 24.0, IVec2::splat(24), 3, 53);
        let dirt = tiling_fbm(uv * 3.0, IVec2::splat(3), 3, 54);
        let hue = Vec3::new(1.0, 0.97 + 0.05 * unit(id ^ 1), 0.90 + 0.16 * unit(id ^ 2));
        let stone = tone * hue * (0.8 + 0.35 * unit(id)) * (0.7 + 0.6 * rough) * (0.8 + 0.4 * dirt);
        stone * (0.4 + 0.6 * smoothstep(joint, joint * 2.2, edge))
    })
}

/// Woven rug: a field of diamonds in a double border. Covers the rug once.
pub(super) fn rug(ground: [f32; 3], figure: [f32; 3], accent: [f32; 3]) -> TextureImage {
    paint([768, 576], [ground, figure, accent], |uv, [ground, figure, accent]| {
        // Distances in units of the shorter side.
        let p = Vec2::new(uv.x * 4.0 / 3.0, uv.y);
        let inset = p.x.min(4.0 / 3.0 - p.x).min(p.y).min(1.0 - p.y);
        let cell = Vec2::new(p.x * 7.5, p.y * 6.0);
        let diamond = (cell.fract() - 0.5).abs().element_sum();
        let odd = (cell.x as i32 + cell.y as i32) & 1 == 1;
        let along = (p.x + p.y) * 18.0;
        let is_tooth = (along.fract() - 0.5).abs() * 0.11 > (inset - 0.0675).abs();
        let teeth = if is_tooth { accent } else { ground };
        let ring = if odd { ground } else { figure };
        let border = [(0.025, ground * 0.85), (0.04, figure), (0.095, teeth), (0.11, figure)];
        let field = [(0.14, accent), (0.30, ring), (0.36, figure)];
        let band = |bands: &[(f32, Vec3)], at: f32| bands.iter().find(|band| at < band.0).copied();
        let found = band(&border, inset).or_else(|| band(&field, diamond));
        let c = found.map_or(ground, |(_, color)| color);
        let tuft = tiling_fbm(uv * 180.0, IVec2::splat(180), 2, 61);
        let wear = tiling_fbm(uv * 5.0, IVec2::splat(5), 4, 62);
        let c = c.lerp(ground, 0.25 * wear);
        c * (0.72 + 0.5 * tuft) * (0.88 + 0.24 * wear)
    })
}

/// An abstract landscape in oils, one for each seed. Covers the canvas once.
pub(super) fn painting(seed: u32) -> TextureImage {
    const PALETTES: [[[f32; 3]; 5]; 3] = [
        [
            [0.75, 0.62, 0.45],
            [0.80, 0.35, 0.14],
            [0.42, 0.12, 0.08],
            [0.10, 0.13, 0.20],
            [0.85, 0.75, 0.55],
        ],
        [
            [0.55, 0.68, 0.74],
            [0.16, 0.34, 0.44],
            [0.05, 0.15, 0.22],
            [0.70, 0.62, 0.45],
            [0.88, 0.85, 0.76],
        ],
        [
            [0.80, 0.74, 0.60],
            [0.30, 0.38, 0.22],
            [0.12, 0.20, 0.13],
            [0.62, 0.44, 0.14],
            [0.86, 0.80, 0.68],
        ],
    ];
    paint([240, 320], PALETTES[seed as usize % PALETTES.len()], |uv, palette| {
        let brush = tiling_fbm(uv * Vec2::new(10.0, 60.0), IVec2::new(10, 60), 3, seed + 71) - 0.5;
        let mut c = palette[0].lerp(palette[4], smoothstep(0.0, 0.5, uv.y) + 0.4 * brush);
        let sun = uv.distance(Vec2::new(0.62, 0.27) + 0.006 * brush);
        c = c.lerp(palette[1].lerp(palette[4], 0.25), 1.0 - smoothstep(0.135, 0.14, sun));
        for layer in 0..4_u32 {
            let base = 0.44 + 0.13 * layer as f32;
            // Hills rise at most 0.14 above their base.
            if uv.y < base - 0.15 {
                break;
            }
            let place = Vec2::new(uv.x * 3.0, layer as f32);
            let hill = tiling_fbm(place, IVec2::new(3, 8), 4, seed * 31 + layer);
            let line = base + 0.28 * (hill - 0.5);
            let tone = palette[1 + layer as usize % 3].lerp(palette[0], 0.45 - 0.14 * layer as f32);
            c = c.lerp(tone * (1.0 + 0.5 * brush), smoothstep(0.0, 0.008, uv.y - line));
        }
        c * (0.95 + 0.35 * brush)
    })
}

/// Stripes along v, `count` pairs, for awnings.
pub(super) fn stripes(a: [f32; 3], b: [f32; 3], count: u32) -> TextureImage {
    paint([512, 64], [a, b], |uv, [a, b]| {
        let weave = tiling(uv * Vec2::new(256.0, 32.0), IVec2::new(256, 32), 81);
        let band = (uv.x * count as f32).fract();
        a.lerp(b, smoothstep(0.48, 0.5, band) - smoothstep(0.98, 1.0, band)) * (0.9 + 0.15 * weave)
    })
}
