//! A living room, 6 x 3 x 5 m: a 2.6 m window in the +X wall lets the suns of `sky:day` and
//! `sky:sunset` in, a round opening in the +Z wall does not. In the evening its lamps are lit.

use glam::{Vec2, Vec3};

use super::materials::{self, embossed, matte, palette, textured, two_sided, varnished};
use super::mesh::{Builder, LIFT, Mat, placed};
use super::room::{self, Hole};
use super::{fittings, furniture, lamps, objects, plants, reliefs, seating, textures};
use crate::scene::{Material, Scene};

const SIZE: [f32; 3] = [6.0, 3.0, 5.0];
const THICKNESS: f32 = 0.24;
const WINDOW: [f32; 4] = [1.2, 0.5, 3.8, 2.3];
const ROUND: [f32; 3] = [4.4, 1.9, 0.45];

palette! {
    new(b, lamps: [f32; 3]) {
        let size = Vec2::splat(1.9);
        let parquet = b.texture(textures::herringbone([0.46, 0.29, 0.16]), size);
        let blocks = b.data(reliefs::herringbone(size), size);
        let tones = [[0.50, 0.34, 0.19], [0.23, 0.13, 0.075]];
        let ([oak, walnut], grain) = materials::timber(b, tones);
        let tones = [([0.78, 0.75, 0.69], 0.10), ([0.24, 0.33, 0.30], 0.16)];
        let ([plaster, accent], trowel) = materials::plaster(b, 2.5, tones);
        let ([velvet], pile) = materials::weave(b, 0.20, 64, [[0.52, 0.20, 0.085]]);
        let ([boucle], loops) = materials::weave(b, 0.16, 32, [[0.74, 0.69, 0.60]]);
        let linen = b.texture(textures::weave([0.72, 0.66, 0.56], 128), Vec2::splat(0.30));
        let ochre = b.texture(textures::weave([0.58, 0.45, 0.27], 128), Vec2::splat(0.30));
        let rug = textures::rug([0.66, 0.60, 0.50], [0.09, 0.14, 0.22], [0.46, 0.17, 0.09]);
        let rug = b.texture(rug, Vec2::new(2.9, 2.0));
        let arts = [0, 1, 2].map(|seed| materials::painting(b, seed));
    }
    wall = embossed(textured("wall", plaster, 0.85), trowel),
    accent = embossed(textured("green wall", accent, 0.8), trowel),
    ceiling = matte("ceiling", [0.80, 0.79, 0.77], 0.9),
    parquet = embossed(varnished(textured("parquet", parquet, 0.55), 0.35, 0.22), blocks),
    white = matte("white paint", [0.78, 0.77, 0.74], 0.35),
    oak = embossed(textured("oak", oak, 0.5), grain),
    walnut = embossed(varnished(textured("walnut", walnut, 0.5), 0.6, 0.15), grain),
    velvet = embossed(textured("velvet", velvet, 0.9), pile),
    boucle = embossed(textured("boucle", boucle, 0.95), loops),
    linen = two_sided(textured("linen", linen, 0.9)),
    shade = Material {
        emissive: WARM * lamps[0],
        ..two_sided(textured("lampshade", linen, 0.9))
    },
    bulbs: [Mat; 2] = [("bulb", lamps[1]), ("bright bulb", lamps[2])].map(|(name, radiance)| {
        let white = matte(name, [0.78, 0.77, 0.74], 0.35);
        b.material(Material { emissive: WARM * radiance, ..white })
    }),
    cotton = embossed(textured("cotton", boucle, 0.9), loops),
    curtain = two_sided(textured("ochre linen", ochre, 0.9)),
    rug = two_sided(textured("rug", rug, 0.95)),
    brass = materials::brass(),
    copper = materials::copper(),
    steel = materials::steel(),
    ceramic = materials::ceramic(),
    stone = matte("marble", [0.70, 0.69, 0.67], 0.2),
    clay = matte("terracotta", [0.52, 0.24, 0.14], 0.8),
    soil = matte("soil", [0.06, 0.04, 0.03], 1.0),
    leaf = two_sided(matte("leaf", [0.10, 0.24, 0.07], 0.4)),
    bark = matte("bark", [0.22, 0.15, 0.10], 0.9),
    glass = materials::glass("vase glass", [0.86, 0.95, 0.93]),
    black = matte("black metal", [0.03, 0.03, 0.03], 0.45),
    book: [Mat; 2] = [matte("book cover", [0.95; 3], 0.7), matte("paper", [0.78, 0.75, 0.68], 0.9)]
        .map(|material| b.material(material)),
    skin = matte("fruit", [0.95; 3], 0.35),
    arts: [Mat; 3] = arts,
}

/// Linear colour of a warm lamp.
const WARM: Vec3 = Vec3::new(1.0, 0.62, 0.30);

/// Builds the room, its shades, bulbs and bright bulb shining with this radiance.
pub(super) fn build(name: &str, lamps: [f32; 3]) -> Scene {
    let b = &mut Builder::new(name);
    let m = &Palette::new(b, lamps);
    shell(b, m);
    window(b, m);
    pictures(b, m);
    seating(b, m);
    coffee_table(b, m);
    library(b, m);
    corners(b, m);
    b.camera("window", [-2.6, 1.35, 1.95], [0.5, 1.02, -0.55], 50.0);
    b.camera("sofa", [1.95, 1.35, 2.25], [-0.95, 0.88, -1.1], 50.0);
    b.camera("round window", [2.5, 1.42, -1.35], [-1.0, 1.15, 1.75], 54.0);
    b.finish()
}

fn shell(b: &mut Builder, m: &Palette) {
    let mats = [m.wall, m.wall, m.accent, m.wall, m.parquet, m.ceiling];
    let holes: [&[Hole]; 4] = [&[], &[Hole::Rectangle(WINDOW)], &[], &[Hole::Round(ROUND)]];
    room::room(b, mats, SIZE, THICKNESS, holes);
    let walls = room::walls(SIZE);
    fittings::edges(b, &walls, [m.white, m.ceiling], SIZE[1], [0.43, 1.47], [0.12, 0.10]);
    b.part(walls[2].frame(), |b| {
        for u in [0.25, 1.65, 3.05, 4.45] {
            fittings::panel_moulding(b, m.accent, [u, 0.30, u + 1.25, 1.02]);
            fittings::panel_moulding(b, m.accent, [u, 1.16, u + 1.25, 2.70]);
        }
        b.slab(m.accent, [0.0, 1.07, -0.01], [6.0, 1.11, 0.022], 0.008);
    });
    b.part(walls[3].frame(), |b| {
        fittings::door(b, m.white, m.brass, 0.5, [0.9, 2.1]);
        // A wooden ring around the round opening.
        b.part(placed([ROUND[0], ROUND[1], 0.0], [90.0, 0.0, 0.0]), |b| {
            let r = ROUND[2];
            let profile = [
                (r + 0.056, -0.005),
                (r + 0.056, 0.014),
                (r + 0.05, 0.02),
                (r - 0.014, 0.02),
                (r - 0.02, 0.014),
                (r - 0.02, -0.10),
            ];
            b.lathe(m.oak, 64, profile);
        });
    });
}

fn window(b: &mut Builder, m: &Palette) {
    b.part(room::walls(SIZE)[1].frame(), |b| {
        fittings::window_frame(b, m.white, WINDOW, 0.12, [3, 2], 0.004);
        fittings::window_board(b, m.white, WINDOW, THICKNESS);
        let [u0, v0, u1, _] = WINDOW;
        fittings::curtain(b, m.curtain, [u0 - 0.42, u0 + 0.06], [0.015, 2.47], 0.13, 6.0);
        fittings::curtain(b, m.curtain, [u1 - 0.06, u1 + 0.42], [0.015, 2.47], 0.13, 6.0);
        fittings::curtain_rod(b, m.brass, [u0 - 0.55, u1 + 0.55], 2.50, 0.13);
        let on_board = |u: f32| Vec3::new(u, v0 + 0.016, -0.03);
        b.standing(on_board(1.62), 0.0, |b| {
            let soil = plants::pot(b, m.ceramic, m.soil, 0.065, 0.11);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::blades(b, m.leaf, 9, 0.26, 4));
        });
        b.standing(on_board(2.72), 0.0, |b| {
            objects::vase(b, m.ceramic, 0.19, &[0.20, 0.33, 0.30, 0.13, 0.17]);
        });
        b.standing(on_board(3.36), 0.0, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.07, 0.12);
            b.standing(Vec3::Y * soil, 0.0, |b| plants::big_leaves(b, m.leaf, 9, 0.22, 9));
        });
    });
}

fn pictures(b: &mut Builder, m: &Palette) {
    b.part(room::walls(SIZE)[2].frame(), |b| {
        for (frame, art, [u, v, w, h]) in [
            (m.brass, m.arts[0], [1.80, 1.32, 0.72, 0.94]),
            (m.walnut, m.arts[1], [3.22, 1.62, 0.46, 0.60]),
            (m.walnut, m.arts[2], [3.76, 1.36, 0.40, 0.52]),
        ] {
            b.moved([u, v, 0.0], |b| objects::picture(b, [frame, m.white, art], [w, h], 0.07));
        }
    });
}

fn seating(b: &mut Builder, m: &Palette) {
    b.standing([-0.1, 0.0, 0.05], 0.0, |b| furniture::rug(b, m.rug, m.linen, [2.9, 2.0]));
    b.standing([-0.45, 0.0, -1.92], 0.0, |b| {
        seating::sofa(b, m.velvet, m.walnut, 2.35, 3);
        for (x, z, turn, tone) in [
            (-0.82, -0.02, -18.0, [0.95, 0.93, 0.88]),
            (-0.52, 0.06, 8.0, [0.20, 0.30, 0.30]),
            (0.80, -0.02, 20.0, [0.95, 0.72, 0.30]),
        ] {
            b.part(placed([x, 0.685, z], [68.0, turn, 0.0]), |b| {
                b.tinted(tone, |b| seating::pillow(b, m.cotton, 0.23));
            });
        }
    });
    b.standing([1.62, 0.0, -0.72], -72.0, |b| seating::armchair(b, m.boucle, m.oak));
    // A side table within reach of the armchair.
    b.standing([1.78, 0.0, -1.62], 0.0, |b| {
        b.drum(m.black, [0.0, 0.018], [0.15, 0.15], 0.006);
        b.drum(m.black, [0.01, 0.50], [0.012, 0.012], 0.002);
        b.drum(m.walnut, [0.49, 0.512], [0.21, 0.21], 0.006);
        b.standing([-0.05, 0.512, 0.02], 24.0, |b| objects::book_stack(b, m.book, 2, 8));
        b.standing([0.11, 0.512, 0.09], 140.0, |b| objects::mug(b, m.ceramic, m.soil));
    });
}

fn coffee_table(b: &mut Builder, m: &Palette) {
    b.standing([-0.35, 0.011, -0.10], 0.0, |b| {
        furniture::round_table(b, m.walnut, m.walnut, 0.52, 0.40);
        b.standing([-0.16, 0.40, -0.18], 0.0, |b| {
            objects::vase(b, m.glass, 0.24, &[0.19, 0.26, 0.24, 0.13, 0.15]);
            b.standing(Vec3::Y * 0.012, 0.0, |b| plants::twigs(b, m.bark, m.leaf, 0.50, 12));
        });
        b.standing([0.21, 0.40, -0.10], 0.0, |b| {
            objects::bowl(b, m.brass, 0.15, 0.075);
            objects::fruit(b, m.skin, m.bark, 0.15, 0.008);
        });
        b.standing([0.02, 0.40, 0.24], 12.0, |b| objects::book_stack(b, m.book, 3, 21));
        b.standing([-0.28, 0.40, 0.14], 200.0, |b| objects::mug(b, m.ceramic, m.soil));
    });
}

fn library(b: &mut Builder, m: &Palette) {
    b.standing([-2.83, 0.0, -0.45], 90.0, |b| {
        furniture::bookcase(b, m.oak, m.book, [2.1, 2.15, 0.30], 5, |b, row, free| match row {
            0 => b.standing(Vec3::ZERO, 0.0, |b| objects::basket(b, m.linen)),
            1 => objects::vase(b, m.ceramic, 0.26, &[0.18, 0.30, 0.36, 0.26, 0.12, 0.15]),
            2 => objects::book_stack(b, m.book, 4, 31),
            3 => b.ball(m.copper, Vec3::Y * (0.09 - LIFT), 0.09),
            _ if free > 0.2 => {
                let soil = plants::pot(b, m.clay, m.soil, 0.07, 0.11);
                b.standing(Vec3::Y * soil, 0.0, |b| plants::trailing(b, m.leaf, 0.07, 0.42, 2));
            }
            _ => objects::bowl(b, m.ceramic, 0.1, 0.06),
        });
    });
}

fn corners(b: &mut Builder, m: &Palette) {
    b.standing([-2.45, 0.0, -2.1], -20.0, |b| {
        lamps::arc_lamp(b, m.brass, [m.shade, m.bulbs[0]], m.stone);
    });
    b.standing([1.25, 0.0, -2.08], 0.0, |b| {
        let soil = plants::pot(b, m.clay, m.soil, 0.20, 0.36);
        b.standing(Vec3::Y * soil, 40.0, |b| plants::big_leaves(b, m.leaf, 17, 1.25, 3));
    });
    b.standing([2.45, 0.0, -2.05], 0.0, |b| {
        b.drum(m.steel, [0.0, 0.42], [0.17, 0.17], 0.01);
        b.standing(Vec3::Y * 0.42, 0.0, |b| {
            objects::vase(b, m.ceramic, 0.5, &[0.14, 0.22, 0.25, 0.18, 0.09, 0.12]);
        });
    });
    b.moved([-0.35, SIZE[1], -0.1], |b| {
        lamps::pendant(b, [m.copper, m.white, m.bulbs[1]], 0.95, 0.24);
    });
    b.standing([2.42, 0.0, 1.52], 0.0, |b| {
        let soil = plants::pot(b, m.ceramic, m.soil, 0.19, 0.40);
        b.standing(Vec3::Y * soil, 0.0, |b| plants::blades(b, m.leaf, 22, 0.95, 14));
    });
    // A console by the door with a lamp.
    b.standing([-1.4, 0.0, 2.28], 180.0, |b| {
        furniture::table(b, m.walnut, m.walnut, [1.2, 0.36, 0.78]);
        b.standing([-0.38, 0.78, 0.0], 0.0, |b| {
            objects::vase(b, m.ceramic, 0.30, &[0.22, 0.34, 0.30, 0.16, 0.06]);
            b.moved([0.0, 0.56, 0.0], |b| lamps::drum_shade(b, m.shade, 0.17, 0.13, 0.22));
            b.rod(m.brass, Vec3::Y * 0.28, Vec3::Y * 0.56, 0.006);
        });
        b.standing([0.30, 0.78, 0.02], 5.0, |b| objects::book_stack(b, m.book, 4, 3));
    });
}
