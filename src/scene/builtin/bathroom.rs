//! A bathroom, 4.4 x 2.7 x 3.2 m: the suns of `sky:day` and `sky:sunset` come through double glazing in the +X wall.
//! Panes, the screen of the shower, a vase and the globes around two bulbs are solid glass. A mirror shows the window.

use std::f32::consts::PI;

use glam::{Affine3A, Vec2, Vec3};

use super::materials::{self, embossed, matte, metal, palette, solid_glass, textured, two_sided};
use super::mesh::{Builder, Mat};
use super::room::{self, Hole};
use super::{fittings, furniture, lamps, objects, plants, tableware, textures};
use crate::scene::{Material, Scene};

const SIZE: [f32; 3] = [4.4, 2.7, 3.2];
const THICKNESS: f32 = 0.25;
const WINDOW: [f32; 4] = [1.42, 0.92, 2.86, 2.32];
/// Where along X the screen of the shower stands.
const SHOWER: f32 = 1.30;

/// Colour of cloth beside the cream of towels.
const CLAY: [f32; 3] = [0.78, 0.42, 0.30];

palette! {
    new(b) {
        let size = Vec2::splat(1.2);
        let tile = b.texture(textures::bricks([0.34, 0.46, 0.39], [0.42, 0.48, 0.41], 6, 18), size);
        let slabs = b.texture(textures::stones([0.64, 0.60, 0.53], 8, 4, 0.030), Vec2::splat(2.4));
        let ([oak], grain) = materials::timber(b, [[0.50, 0.33, 0.19]]);
        let ([plaster], trowel) = materials::plaster(b, 2.5, [([0.78, 0.74, 0.67], 0.10)]);
        let ([terry], loops) = materials::weave(b, 0.20, 48, [[0.80, 0.76, 0.69]]);
    }
    tiles = textured("tiles", tile, 0.15),
    floor = textured("floor slabs", slabs, 0.35),
    wall = embossed(textured("wall", plaster, 0.85), trowel),
    ceiling = matte("ceiling", [0.80, 0.79, 0.77], 0.9),
    white = matte("white paint", [0.78, 0.77, 0.74], 0.35),
    oak = embossed(textured("oak", oak, 0.45), grain),
    ceramic = materials::ceramic(),
    brass = materials::brass(),
    silver = metal("silvered glass", [0.93, 0.93, 0.91], 0.0),
    glass = solid_glass("glass", 0.0),
    bulb = Material { emissive: Vec3::new(60.0, 40.0, 22.0), ..matte("bulb", [0.8; 3], 0.5) },
    terry = embossed(two_sided(textured("terry", terry, 0.95)), loops),
    clay = matte("terracotta", [0.52, 0.24, 0.14], 0.8),
    soil = matte("soil", [0.06, 0.04, 0.03], 1.0),
    leaf = two_sided(matte("leaf", [0.10, 0.24, 0.07], 0.4)),
    art: Mat = materials::painting(b, 1),
}

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("bathroom");
    let m = &Palette::new(b);
    let mats = [m.wall, m.wall, m.tiles, m.wall, m.floor, m.ceiling];
    room::room(b, mats, SIZE, THICKNESS, [&[], &[Hole::Rectangle(WINDOW)], &[], &[]]);
    let walls = room::walls(SIZE);
    b.part(walls[1].frame(), |b| {
        let [u0, v0, u1, v1] = WINDOW;
        let (rebate, middle) = (0.04, 0.5 * (u0 + u1));
        fittings::window_frame(b, m.white, WINDOW, 0.10, [2, 1], 0.004);
        fittings::window_board(b, m.ceramic, WINDOW, THICKNESS);
        for (left, right) in [(u0 + rebate, middle - 0.01), (middle + 0.01, u1 - rebate)] {
            for z in [-0.137, -0.117] {
                b.slab(m.glass, [left, v0 + rebate, z], [right, v1 - rebate, z + 0.004], 0.0);
            }
        }
        b.moved(Vec3::Z * 0.012, |b| {
            let [left, right, top] = [-0.01, SIZE[2] + 0.01, SIZE[1] + 0.01];
            let plastered = Hole::Rectangle([1.06, v0 - 0.02, right, top]);
            room::pierced(b, m.tiles, [left, left, right, top], 0.02, &[plastered]);
        });
        b.standing([u1 - 0.25, v0 + 0.015, -0.02], 0.0, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.06, 0.10);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::trailing(b, m.leaf, 0.06, 0.3, 2));
        });
    });
    b.part(walls[3].frame(), |b| {
        fittings::door(b, m.white, m.brass, 2.9, [0.85, 2.05]);
        let hung = [m.oak, m.white, m.art];
        b.moved([0.5, 1.25, 0.0], |b| objects::picture(b, hung, [0.62, 0.82], 0.06));
    });
    washstand(b, m);
    shower(b, m);
    bath(b, m);
    b.camera("mirror", [-2.0, 1.45, 1.35], [0.36, 1.08, -0.52], 50.0);
    b.camera("bath", [-1.5, 1.45, -0.75], [1.6, 0.85, 0.35], 50.0);
    b.finish()
}

/// A cabinet with a basin, below a mirror between two lamps.
fn washstand(b: &mut Builder, m: &Palette) {
    b.standing([0.12, 0.0, -1.34], 0.0, |b| {
        furniture::drawers(b, m.oak, m.brass, [1.5, 0.78, 0.5], [3, 2]);
        b.slab(m.ceramic, [-0.77, 0.779, -0.26], [0.77, 0.81, 0.27], 0.004);
        b.standing([0.0, 0.81, 0.02], 0.0, |b| objects::bowl(b, m.ceramic, 0.22, 0.13));
        b.standing([0.0, 0.81, -0.215], 0.0, |b| tap(b, m.brass, 0.24, 0.16));
        b.standing([-0.56, 0.81, -0.06], 0.0, |b| {
            objects::vase(b, m.glass, 0.22, &[0.19, 0.26, 0.24, 0.13, 0.15]);
            b.standing(Vec3::Y * 0.014, 0.0, |b| plants::twigs(b, m.soil, m.leaf, 0.42, 12));
        });
    });
    b.part(room::walls(SIZE)[2].frame(), |b| {
        let mirror = [m.brass, m.brass, m.silver];
        b.moved([1.62, 1.14, 0.0], |b| objects::picture(b, mirror, [1.40, 0.92], 0.0));
        for u in [1.44, 3.20] {
            b.moved([u, 1.55, 0.0], |b| lamps::globe_lamp(b, m.brass, [m.glass, m.bulb], 0.12));
        }
    });
    b.standing([-1.1, 0.0, -1.6], 0.0, |b| {
        furniture::radiator(b, m.white, 0.5, 1.15);
        b.standing([0.02, 1.155, 0.0], 0.0, |b| {
            b.tinted(CLAY, |b| tableware::runner(b, m.terry, 0.36, [0.02, 0.11], 0.5));
        });
    });
}

/// A spout of brass, `height` to where it bends towards +Z over `reach`.
fn tap(b: &mut Builder, metal: Mat, height: f32, reach: f32) {
    let bend = (0..=12).map(|k| {
        let (s, c) = (PI * k as f32 / 12.0).sin_cos();
        (Vec3::new(0.0, height + 0.5 * reach * s, 0.5 * reach * (1.0 - c)), 0.011)
    });
    b.tube(metal, 16, std::iter::once((Vec3::ZERO, 0.011)).chain(bend));
    b.drum(metal, [0.0, 0.014], [0.030, 0.028], 0.003);
    b.rod(metal, Vec3::Y * (height - 0.05), Vec3::new(0.07, height - 0.03, 0.0), 0.006);
}

fn shower(b: &mut Builder, m: &Palette) {
    let (x, end, top) = (SHOWER, -0.55, 2.05);
    b.slab(m.ceramic, [x - 0.03, -0.01, -1.61], [2.2, 0.03, end + 0.03], 0.006);
    b.slab(m.glass, [x, 0.036, -1.59], [x + 0.01, top, end], 0.0);
    b.slab(m.brass, [x - 0.006, 0.028, -1.598], [x + 0.016, 0.042, end + 0.002], 0.001);
    b.slab(m.brass, [x - 0.007, 0.03, -1.605], [x + 0.017, top + 0.002, -1.582], 0.001);
    b.slab(m.brass, [x - 0.012, top - 0.012, end - 0.06], [2.195, top + 0.008, end - 0.04], 0.002);
    let riser = Vec3::new(1.72, 1.05, -1.54);
    let head = riser + Vec3::new(0.0, 1.1, 0.4);
    b.rod(m.brass, riser, head - Vec3::Z * 0.4, 0.010);
    b.rod(m.brass, head - Vec3::Z * 0.47, head + Vec3::Z * 0.01, 0.010);
    b.rod(m.brass, riser - Vec3::X * 0.12, riser + Vec3::X * 0.12, 0.02);
    b.rod(m.brass, riser, riser - Vec3::Z * 0.07, 0.014);
    b.moved(head, |b| b.drum(m.brass, [-0.025, -0.008], [0.125, 0.12], 0.003));
}

/// A free-standing tub before the window, with a mat, and a stool.
fn bath(b: &mut Builder, m: &Palette) {
    b.standing([1.62, 0.0, 0.48], 0.0, |b| {
        b.part(Affine3A::from_scale(Vec3::new(0.37, 1.0, 0.82)), |b| {
            let outside = [(0.72, 0.0), (0.76, 0.004), (0.79, 0.05), (0.88, 0.30), (1.0, 0.57)];
            let inside = [(0.95, 0.57), (0.84, 0.30), (0.68, 0.13), (0.5, 0.11), (0.0, 0.105)];
            b.lathe(m.ceramic, 96, tableware::smooth(&[outside, inside].concat(), 8));
        });
        b.slab(m.oak, [-0.42, 0.604, 0.10], [0.42, 0.622, 0.28], 0.004);
    });
    b.standing([1.12, 0.0, -0.05], 90.0, |b| tap(b, m.brass, 0.80, 0.24));
    b.standing([0.72, 0.0, 0.95], 0.0, |b| {
        furniture::round_table(b, m.oak, m.oak, 0.19, 0.45);
        for (y, turn) in [(0.45, 8.0), (0.505, 4.0), (0.56, 11.0)] {
            b.standing([0.0, y, 0.0], turn, |b| {
                b.slab(m.terry, [-0.15, 0.0, -0.11], [0.15, 0.054, 0.11], 0.022);
            });
        }
    });
    b.standing([0.45, 0.0, 0.25], 90.0, |b| {
        b.tinted(CLAY, |b| furniture::rug(b, m.terry, m.terry, [0.9, 0.6]));
    });
}
