//! A still life on a sideboard before a wall: each thing shows another kind of material.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;

use super::materials::{self, embossed, glass, matte, metal, textured, two_sided, varnished};
use super::mesh::{Builder, placed};
use super::{furniture, objects, plants, seating, tableware};
use crate::scene::{AlphaMode, Material, Scene};

/// Width, height and depth of the sideboard.
const BOARD: [f32; 3] = [2.05, 0.80, 0.50];
/// Degrees about +Y by which light from the end of the hallway rakes the wall.
const TURN: f32 = 20.0;

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("materials");
    b.standing(Vec3::ZERO, TURN, |b| {
        room(b);
        b.standing(Vec3::Y * BOARD[1], 0.0, |b| {
            tea(b);
            metals(b);
            glasses(b);
            cloths(b);
            translucent(b);
        });
    });
    let turn = glam::Quat::from_rotation_y(TURN.to_radians());
    let place = |p: [f32; 3]| (turn * Vec3::from(p)).to_array();
    b.camera("still life", place([0.16, 1.34, 2.78]), place([0.0, 0.97, 0.0]), 23.0);
    b.finish()
}

/// Wood and plaster, with normal maps.
fn room(b: &mut Builder) {
    let ([oak], grain) = materials::timber(b, [[0.42, 0.27, 0.145]]);
    let oak = b.material(embossed(varnished(textured("oak", oak, 0.55), 0.3, 0.25), grain));
    let ([plaster], trowel) = materials::plaster(b, 1.6, [([0.20, 0.29, 0.30], 0.22)]);
    let wall = b.material(embossed(textured("plaster", plaster, 0.8), trowel));
    let floor = b.material(matte("floor", [0.30, 0.21, 0.13], 0.5));
    let brass = b.material(materials::brass());
    b.quad(floor, Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0);
    b.slab(wall, [-1.9, -0.01, -0.50], [1.9, 2.2, -0.30], 0.0);
    b.standing(Vec3::ZERO, 0.0, |b| {
        furniture::drawers(b, oak, brass, [BOARD[0], BOARD[1] - 0.012, BOARD[2]], [4, 3]);
    });
    let (x, top, z) = (0.5 * BOARD[0], BOARD[1], 0.5 * BOARD[2]);
    b.slab(oak, [-x - 0.012, top - 0.024, -z - 0.01], [x + 0.012, top, z + 0.012], 0.004);
    let silver = b.material(metal("silvered glass", [0.93, 0.93, 0.91], 0.0));
    b.part(placed([-0.20, 1.22, -0.30], [90.0, 0.0, 0.0]), |b| {
        let r = 0.235;
        b.lathe(silver, 96, [(r, 0.012), (0.0, 0.012)]);
        let profile = [
            (r + 0.012, -0.004),
            (r + 0.012, 0.020),
            (r + 0.009, 0.023),
            (r, 0.023),
            (r - 0.003, 0.020),
            (r - 0.003, 0.008),
        ];
        b.lathe(brass, 96, profile);
    });
}

/// Lacquer and glaze, on a runner that is half transparent.
fn tea(b: &mut Builder) {
    let organza = b.material(Material {
        alpha_mode: AlphaMode::Blend,
        base_color: Vec3::new(0.78, 0.66, 0.42).extend(0.52),
        ..two_sided(matte("organza", [0.0; 3], 0.75))
    });
    let lacquer = b.material(varnished(matte("lacquer", [0.42, 0.022, 0.018], 0.55), 1.0, 0.03));
    let black = b.material(matte("ebony", [0.02, 0.018, 0.016], 0.3));
    let glaze = b.material(matte("blue glaze", [0.035, 0.13, 0.30], 0.12));
    let tea = b.material(matte("tea", [0.10, 0.045, 0.008], 0.02));
    b.standing([-0.24, 0.0, 0.0], 0.0, |b| {
        tableware::runner(b, organza, 0.56, [-0.20, 0.262], 0.30);
    });
    let on_cloth = 0.003;
    b.scaled([-0.30, on_cloth, 0.03], -24.0, 1.35, |b| tableware::teapot(b, lacquer, black));
    for (x, z) in [(-0.06, 0.08), (-0.04, 0.195)] {
        b.scaled([x, on_cloth, z], 0.0, 1.2, |b| {
            objects::bowl(b, glaze, 0.045, 0.048);
            b.lathe(tea, 40, [(0.0425, 0.036), (0.0, 0.036)]);
        });
    }
}

/// Brushed and anodised metal.
fn metals(b: &mut Builder) {
    let copper = b.material(Material {
        anisotropy: 0.85,
        anisotropy_rotation: FRAC_PI_2,
        ..metal("brushed copper", [0.90, 0.56, 0.42], 0.27)
    });
    let skin = b.material(varnished(matte("fruit", [0.95; 3], 0.5), 0.4, 0.25));
    let stalk = b.material(matte("bark", [0.22, 0.15, 0.10], 0.9));
    let titanium = b.material(Material {
        iridescence: 1.0,
        iridescence_ior: 1.8,
        iridescence_thickness: [0.0, 380.0],
        ..metal("anodised titanium", [0.54, 0.50, 0.45], 0.15)
    });
    b.scaled([0.37, 0.0, 0.02], 0.0, 1.15, |b| {
        objects::bowl(b, copper, 0.15, 0.085);
        objects::fruit(b, skin, stalk, 0.15, 0.010);
    });
    b.standing([0.60, 0.0, 0.15], 0.0, |b| b.ball(titanium, Vec3::Y * 0.048, 0.048));
}

/// Thin and solid glass.
fn glasses(b: &mut Builder) {
    let clear = b.material(glass("glass", [0.96, 0.98, 0.97]));
    let drink = b.material(Material {
        ior: 1.33,
        attenuation_color: Vec3::new(0.88, 0.42, 0.06),
        attenuation_distance: 0.16,
        ..materials::solid_glass("elderflower", 0.0)
    });
    let bubble = b.material(Material {
        iridescence: 1.0,
        iridescence_ior: 1.45,
        iridescence_thickness: [0.0, 520.0],
        ..glass("oiled glass", [0.97; 3])
    });
    let frosted =
        b.material(Material { roughness: 0.28, ..glass("frosted glass", [0.62, 0.80, 0.90]) });
    let pebble = b.material(Material {
        attenuation_color: Vec3::new(0.25, 0.70, 0.50),
        attenuation_distance: 0.03,
        ..materials::solid_glass("sea glass", 0.3)
    });
    let flint = materials::solid_glass("flint glass", 0.0);
    let flint = b.material(Material { ior: 1.8, dispersion: 4.0, ..flint });
    b.standing([0.10, 0.0, -0.11], 0.0, |b| tableware::carafe(b, clear, drink, 0.32));
    b.standing([-0.60, 0.0, -0.10], 0.0, |b| {
        let shape = [
            (0.0, 0.001),
            (0.045, 0.002),
            (0.05, 0.02),
            (0.05, 0.19),
            (0.018, 0.25),
            (0.016, 0.33),
            (0.021, 0.345),
        ];
        b.lathe(frosted, 64, tableware::smooth(&shape, 6));
    });
    b.scaled([-0.67, 0.0, 0.10], 0.0, 1.2, |b| {
        let shape = [
            (0.0, 0.001),
            (0.03, 0.003),
            (0.068, 0.04),
            (0.072, 0.075),
            (0.045, 0.115),
            (0.034, 0.125),
            (0.044, 0.145),
        ];
        b.lathe(bubble, 64, tableware::smooth(&shape, 8));
    });
    let radius = 0.08;
    b.part(placed([0.13, 0.609 * radius + 4e-4, 0.13], [0.0, 65.0, -35.75]), |b| {
        tableware::brilliant(b, flint, radius);
    });
    for (x, z, turn, half) in [
        (0.25, 0.205, 20.0, [0.036, 0.018, 0.025]),
        (0.32, 0.215, 75.0, [0.026, 0.014, 0.020]),
        (0.05, 0.225, 130.0, [0.027, 0.015, 0.021]),
    ] {
        b.standing([x, 0.0, z], turn, |b| {
            b.blob(pebble, Vec3::Y * half[1], Vec3::from(half), [2.4, 2.2], 12);
        });
    }
}

/// Velvet, and mother of pearl upon it.
fn cloths(b: &mut Builder) {
    let ([weave], threads) = materials::weave(b, 0.10, 40, [[0.30, 0.035, 0.10]]);
    let velvet = b.material(Material {
        sheen_color: Vec3::new(0.75, 0.45, 0.55),
        sheen_roughness: 0.35,
        ..embossed(textured("velvet", weave, 0.9), threads)
    });
    let nacre = b.material(Material {
        iridescence: 1.0,
        iridescence_ior: 1.6,
        iridescence_thickness: [0.0, 430.0],
        ..two_sided(metal("mother of pearl", [0.80, 0.76, 0.72], 0.2))
    });
    b.part(placed([0.835, 0.055, 0.05], [0.0, -14.0, 0.0]), |b| seating::pillow(b, velvet, 0.16));
    b.part(placed([0.835, 0.209, 0.05], [-28.0, -20.0, 15.0]), |b| {
        tableware::nautilus(b, nacre, 0.12);
    });
}

/// Leaves, wax and paper.
fn translucent(b: &mut Builder) {
    let leaf = b.material(Material {
        diffuse_transmission: 0.45,
        diffuse_transmission_color: Vec3::new(0.45, 0.75, 0.12),
        ..two_sided(matte("leaf", [0.09, 0.22, 0.06], 0.35))
    });
    let paper = b.material(Material {
        diffuse_transmission: 0.7,
        diffuse_transmission_color: Vec3::new(0.95, 0.80, 0.55),
        ..two_sided(matte("paper", [0.85, 0.8, 0.7], 0.9))
    });
    let wax = b.material(Material {
        diffuse_transmission: 1.0,
        thickness: 0.07,
        attenuation_color: Vec3::new(0.96, 0.78, 0.52),
        attenuation_distance: 0.15,
        scattering: Vec3::splat(80.0),
        ..matte("wax", [0.95, 0.92, 0.85], 0.45)
    });
    let black = b.material(matte("wick", [0.02; 3], 0.9));
    let ceramic = b.material(materials::ceramic());
    let soil = b.material(matte("soil", [0.06, 0.04, 0.03], 1.0));
    b.scaled([-0.85, 0.0, -0.05], 0.0, 1.1, |b| {
        let ground = plants::pot(b, ceramic, soil, 0.085, 0.14);
        b.standing(Vec3::Y * ground, 70.0, |b| plants::big_leaves(b, leaf, 11, 0.40, 6));
    });
    for (x, z, radius, height) in
        [(0.56, -0.16, 0.040, 0.22), (0.64, -0.14, 0.036, 0.14), (0.585, -0.07, 0.035, 0.085)]
    {
        b.standing([x, 0.0, z], 0.0, |b| tableware::candle(b, wax, black, radius, height));
    }
    b.standing([0.80, 0.40, -0.08], 0.0, |b| tableware::lantern(b, paper, 0.17));
    b.rod(black, Vec3::new(0.80, 0.66, -0.08), Vec3::new(0.80, 1.6, -0.08), 0.002);
}
