//! A closed office, 6 x 3 x 4 m, lit softly: two windows of 1.0 x 0.9 m clear opening in the -X wall,
//! 3 % of the walls. The sun of `sky:day` stands on the +X side and never enters.

use glam::{Vec2, Vec3};

use super::materials::{self, embossed, matte, metal, palette, textured, two_sided, varnished};
use super::mesh::{Builder, Mat, placed};
use super::room::{self, Hole};
use super::{desktop, fittings, furniture, lamps, objects, plants, reliefs, seating, textures};
use crate::scene::Scene;

const SIZE: [f32; 3] = [6.0, 3.0, 4.0];
const THICKNESS: f32 = 0.2;
/// Holes of the windows: the frames leave 1.0 x 0.9 m.
const WINDOWS: [[f32; 4]; 2] = [[0.44, 1.14, 1.56, 2.16], [2.44, 1.14, 3.56, 2.16]];

palette! {
    new(b) {
        let size = Vec2::new(2.6, 1.6);
        let boards = b.texture(textures::planks([0.40, 0.27, 0.16], 10, 2), size);
        let joints = b.data(reliefs::planks(size, 10, 2), size);
        let ([oak], grain) = materials::timber(b, [[0.52, 0.36, 0.21]]);
        let tones = [([0.76, 0.74, 0.70], 0.10), ([0.60, 0.41, 0.31], 0.14)];
        let ([plaster, feature], trowel) = materials::plaster(b, 2.5, tones);
        let tones = [[0.16, 0.24, 0.36], [0.44, 0.43, 0.41]];
        let ([blue, grey], threads) = materials::weave(b, 0.19, 64, tones);
        let linen = b.texture(textures::weave([0.62, 0.55, 0.44], 128), Vec2::splat(0.3));
        let rug = textures::rug([0.55, 0.52, 0.47], [0.14, 0.20, 0.28], [0.62, 0.42, 0.16]);
        let rug = b.texture(rug, Vec2::new(2.6, 1.7));
        let arts = [1, 0].map(|seed| materials::painting(b, seed));
    }
    wall = embossed(textured("wall", plaster, 0.85), trowel),
    feature = embossed(textured("clay wall", feature, 0.85), trowel),
    ceiling = matte("ceiling", [0.80, 0.79, 0.78], 0.9),
    boards = embossed(varnished(textured("floor boards", boards, 0.55), 0.35, 0.25), joints),
    white = matte("white paint", [0.78, 0.77, 0.75], 0.35),
    oak = embossed(varnished(textured("oak", oak, 0.5), 0.4, 0.25), grain),
    cloth = embossed(two_sided(textured("blue cloth", blue, 0.9)), threads),
    sofa = embossed(textured("grey cloth", grey, 0.9), threads),
    curtain = two_sided(textured("curtain", linen, 0.9)),
    rug = two_sided(textured("rug", rug, 0.95)),
    fringe = matte("fringe", [0.62, 0.58, 0.5], 0.95),
    plastic = matte("black plastic", [0.035, 0.036, 0.04], 0.4),
    keys = matte("keys", [0.62, 0.62, 0.61], 0.45),
    screen = matte("screen", [0.012, 0.013, 0.016], 0.12),
    steel = materials::steel(),
    brass = materials::brass(),
    lamp = metal("green enamel", [0.10, 0.22, 0.17], 0.25),
    ceramic = materials::ceramic(),
    clay = matte("terracotta", [0.52, 0.24, 0.14], 0.8),
    soil = matte("soil", [0.06, 0.04, 0.03], 1.0),
    leaf = two_sided(matte("leaf", [0.10, 0.24, 0.07], 0.4)),
    book: [Mat; 2] = [matte("book cover", [0.95; 3], 0.7), matte("paper", [0.78, 0.76, 0.72], 0.9)]
        .map(|material| b.material(material)),
    arts: [Mat; 2] = arts,
}

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("office");
    let m = &Palette::new(b);
    shell(b, m);
    wall_things(b, m);
    for (x, yaw, seed) in [(-1.35, 168.0, 1), (0.95, 205.0, 2)] {
        desk(b, m, x, seed);
        b.standing([x + 0.1, 0.0, -0.62], yaw, |b| {
            seating::office_chair(b, m.cloth, m.plastic, m.steel);
        });
    }
    lounge(b, m);
    b.camera("desks", [2.65, 1.5, 1.62], [-1.0, 0.98, -0.92], 50.0);
    b.camera("windows", [2.3, 1.45, -0.1], [-2.9, 1.15, 0.05], 56.0);
    b.camera("door", [-2.5, 1.5, -0.9], [1.9, 1.0, 1.3], 56.0);
    b.finish()
}

fn shell(b: &mut Builder, m: &Palette) {
    let mats = [m.wall, m.wall, m.feature, m.wall, m.boards, m.ceiling];
    room::room(b, mats, SIZE, THICKNESS, [&WINDOWS.map(Hole::Rectangle), &[], &[], &[]]);
    let walls = room::walls(SIZE);
    fittings::edges(b, &walls, [m.white, m.ceiling], SIZE[1], [0.33, 1.37], [0.10, 0.07]);
    b.part(walls[0].frame(), |b| {
        for hole in WINDOWS {
            fittings::window_frame(b, m.white, hole, 0.09, [2, 1], 0.004);
            fittings::window_board(b, m.oak, hole, THICKNESS);
            let [u0, _, u1, _] = hole;
            fittings::curtain(b, m.curtain, [u0 - 0.30, u0 + 0.0], [0.95, 2.36], 0.10, 4.0);
            fittings::curtain(b, m.curtain, [u1 - 0.0, u1 + 0.30], [0.95, 2.36], 0.10, 4.0);
            fittings::curtain_rod(b, m.brass, [u0 - 0.36, u1 + 0.36], 2.38, 0.10);
            b.moved([0.5 * (u0 + u1), 0.0, 0.0], |b| furniture::radiator(b, m.white, 0.95, 0.78));
        }
        let [u0, v0, ..] = WINDOWS[1];
        b.standing([u0 + 0.24, v0 + 0.016, -0.02], 0.0, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.055, 0.10);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::blades(b, m.leaf, 8, 0.22, 6));
        });
    });
    b.part(walls[3].frame(), |b| fittings::door(b, m.white, m.steel, 0.4, [0.9, 2.1]));
    for x in [-1.35, 0.95] {
        b.moved([x, SIZE[1], -0.9], |b| lamps::pendant(b, [m.lamp, m.white, m.white], 0.85, 0.20));
    }
}

fn wall_things(b: &mut Builder, m: &Palette) {
    b.part(room::walls(SIZE)[2].frame(), |b| {
        let places = [[0.62, 1.38, 0.62, 0.82], [2.36, 1.46, 0.50, 0.66]];
        for (art, [u, v, w, h]) in m.arts.into_iter().zip(places) {
            b.moved([u, v, 0.0], |b| objects::picture(b, [m.oak, m.white, art], [w, h], 0.06));
        }
        b.moved([1.83, 1.95, 0.0], |b| objects::clock(b, m.steel, m.white, m.plastic, 0.16));
        for (y, seed) in [(1.52, 5), (1.92, 9)] {
            b.slab(m.oak, [3.15, y, -0.01], [5.25, y + 0.03, 0.25], 0.004);
            for u in [3.35, 5.05] {
                let (left, right) = (u - 0.012, u + 0.012);
                b.slab(m.steel, [left, y - 0.16, -0.008], [right, y + 0.002, 0.008], 0.002);
                b.slab(m.steel, [left, y - 0.012, -0.002], [right, y + 0.003, 0.20], 0.002);
            }
            b.standing([3.22, y + 0.03, 0.13], 0.0, |b| {
                objects::books(b, m.book, 1.25, 0.30, 0.22, seed);
            });
        }
        b.standing([4.85, 1.55, 0.12], 0.0, |b| {
            objects::vase(b, m.ceramic, 0.22, &[0.2, 0.33, 0.28, 0.12, 0.16]);
        });
        b.standing([4.85, 1.95, 0.12], 0.0, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.075, 0.12);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::trailing(b, m.leaf, 0.075, 0.5, 3));
        });
    });
}

fn desk(b: &mut Builder, m: &Palette, x: f32, seed: u32) {
    let height = 0.74;
    let mirror = if seed == 1 { 1.0 } else { -1.0 };
    b.standing([x, 0.0, -1.45], 0.0, |b| {
        furniture::table(b, m.oak, m.oak, [1.6, 0.8, height]);
        b.standing([0.52 * mirror, 0.0, -0.04], 0.0, |b| {
            furniture::drawers(b, m.white, m.steel, [0.36, 0.58, 0.52], [1, 3]);
        });
        let mut on_top = |x: f32, z: f32, yaw: f32, build: &mut dyn FnMut(&mut Builder)| {
            b.standing([x * mirror, height, z], yaw, |b| build(b));
        };
        on_top(0.05, -0.18, -4.0 * mirror, &mut |b| {
            desktop::monitor(b, m.plastic, m.screen, [0.60, 0.36]);
        });
        on_top(0.03, 0.16, 2.0, &mut |b| desktop::keyboard(b, m.plastic, m.keys));
        on_top(0.34 * mirror, 0.17, -6.0, &mut |b| desktop::mouse(b, m.plastic));
        on_top(-0.62, -0.22, 40.0 * mirror, &mut |b| lamps::desk_lamp(b, m.lamp, m.white));
        on_top(-0.48, 0.18, 14.0, &mut |b| desktop::papers(b, m.book[1], 5, seed));
        on_top(0.60, 0.10, 60.0, &mut |b| objects::mug(b, m.ceramic, m.soil));
        on_top(0.66, -0.24, 0.0, &mut |b| desktop::pencils(b, m.steel, m.book[0]));
        on_top(0.46, -0.26, 80.0, &mut |b| objects::book_stack(b, m.book, 3, seed + 40));
    });
    b.standing([x - 0.95 * mirror, 0.0, -1.35], 0.0, |b| objects::basket(b, m.steel));
}

fn lounge(b: &mut Builder, m: &Palette) {
    b.standing([-0.5, 0.0, 0.75], 0.0, |b| furniture::rug(b, m.rug, m.fringe, [2.6, 1.7]));
    b.standing([-0.2, 0.0, 1.48], 180.0, |b| {
        seating::sofa(b, m.sofa, m.oak, 1.9, 2);
        b.part(placed([-0.55, 0.69, 0.0], [68.0, -16.0, 0.0]), |b| {
            b.tinted([1.5, 0.95, 0.30], |b| seating::pillow(b, m.sofa, 0.21));
        });
    });
    b.standing([-1.75, 0.0, 1.25], 120.0, |b| seating::side_chair(b, m.oak, m.cloth));
    b.standing([2.82, 0.0, -0.85], -90.0, |b| {
        furniture::bookcase(b, m.oak, m.book, [1.9, 2.0, 0.32], 5, |b, row, _| match row {
            0 => objects::basket(b, m.fringe),
            2 => objects::vase(b, m.clay, 0.24, &[0.18, 0.30, 0.34, 0.2, 0.13]),
            4 => b.ball(m.brass, Vec3::Y * 0.08, 0.08),
            _ => objects::book_stack(b, m.book, 3, row + 60),
        });
    });
    b.standing([-2.58, 0.0, -1.55], 0.0, |b| {
        let soil = plants::pot(b, m.ceramic, m.soil, 0.19, 0.34);
        b.standing(Vec3::Y * soil, 0.0, |b| plants::big_leaves(b, m.leaf, 15, 1.15, 5));
    });
    b.standing([-2.70, 0.0, 0.0], 90.0, |b| {
        furniture::drawers(b, m.white, m.steel, [0.7, 0.95, 0.40], [1, 3]);
        b.standing([-0.15, 0.95, 0.0], 10.0, |b| desktop::papers(b, m.book[1], 4, 9));
        b.standing([0.18, 0.95, -0.02], 0.0, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.08, 0.13);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::big_leaves(b, m.leaf, 12, 0.3, 15));
        });
    });
}
