//! Wrap modes, filtering and colour decoding.

use glam::{Affine2, Vec2, Vec4};
use lightgrid::image::Texels;
use lightgrid::scene::texture::sample_texture;
use lightgrid::scene::{Scene, Texture, TextureImage, TextureRef, Wrap};

/// A row of texels with red 0, 100, 200 in a scene with one texture.
fn row(wrap: Wrap, nearest: bool) -> Scene {
    let texels = [0, 100, 200].map(|r| [r, 0, 0, 255]).to_vec().into();
    Scene {
        images: vec![TextureImage { width: 3, height: 1, texels }],
        textures: vec![Texture { image: 0, wrap_u: wrap, wrap_v: wrap, nearest, srgb: false }],
        ..Scene::default()
    }
}

const REFERENCE: TextureRef = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };

/// Red at texel coordinate `x` (texel centres at 0.5, 1.5, 2.5), in bytes.
fn red(scene: &Scene, x: f32) -> f32 {
    sample_texture(scene, &REFERENCE, Vec2::new(x / 3.0, 0.5)).x * 255.0
}

#[track_caller]
fn assert_close(a: f32, b: f32) {
    assert!((a - b).abs() < 1e-2, "{a} is not {b}");
}

#[test]
fn bilinear_hits_centres_and_mixes_between() {
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        let scene = row(wrap, false);
        assert_close(red(&scene, 0.5), 0.0);
        assert_close(red(&scene, 1.5), 100.0);
        assert_close(red(&scene, 1.25), 75.0);
        assert_close(red(&scene, 2.5), 200.0);
    }
}

#[test]
fn edges_follow_the_wrap_mode() {
    let repeat = row(Wrap::Repeat, false);
    assert_close(red(&repeat, 0.0), 100.0); // half of the last texel, half of the first
    assert_close(red(&repeat, 3.25), 50.0);
    assert_close(red(&repeat, -1.5), 100.0);
    assert_close(red(&repeat, 31.5), 100.0);
    let mirrored = row(Wrap::MirroredRepeat, false);
    assert_close(red(&mirrored, 0.0), 0.0);
    assert_close(red(&mirrored, 3.5), 200.0);
    assert_close(red(&mirrored, 5.5), 0.0);
    assert_close(red(&mirrored, -1.25), 75.0);
    assert_close(red(&mirrored, 7.5), 100.0);
    let clamped = row(Wrap::ClampToEdge, false);
    assert_close(red(&clamped, -7.0), 0.0);
    assert_close(red(&clamped, 2.9), 200.0);
    assert_close(red(&clamped, 1e9), 200.0);
}

#[test]
fn nearest_does_not_mix() {
    let scene = row(Wrap::Repeat, true);
    for (x, expected) in [(0.1, 0.0), (0.9, 0.0), (1.1, 100.0), (2.9, 200.0), (3.1, 0.0)] {
        assert_close(red(&scene, x), expected);
    }
}

#[test]
fn colours_are_decoded_before_filtering_and_alpha_is_not() {
    let mut scene = row(Wrap::ClampToEdge, false);
    scene.textures[0].srgb = true;
    scene.images[0].texels = vec![[0, 188, 255, 0], [255, 188, 0, 128], [0, 0, 0, 0]].into();
    let value = sample_texture(&scene, &REFERENCE, Vec2::new(1.0 / 3.0, 0.5));
    // 188 is half of white in linear light (within a byte).
    let expected = Vec4::new(0.5, 0.502_886_5, 0.5, 64.0 / 255.0);
    assert!((value - expected).abs().max_element() < 1e-5, "{value}");
}

#[test]
fn texels_of_fewer_channels_are_the_same_values() {
    for (srgb, nearest) in [(false, false), (true, false), (true, true)] {
        let mut scene = row(Wrap::Repeat, nearest);
        scene.textures[0].srgb = srgb;
        let grey_alpha = [[10, 77], [120, 0], [250, 255]];
        let grey = grey_alpha.map(|[l, _]| [l]);
        let rgb = [[10, 20, 30], [120, 0, 255], [250, 249, 248]];
        let pairs: [(Texels, Texels); 3] = [
            (grey.to_vec().into(), grey.map(|[l]| [l, l, l, 255]).to_vec().into()),
            (grey_alpha.to_vec().into(), grey_alpha.map(|[l, a]| [l, l, l, a]).to_vec().into()),
            (rgb.to_vec().into(), rgb.map(|[r, g, b]| [r, g, b, 255]).to_vec().into()),
        ];
        for both in pairs {
            for at in 0..40 {
                let uv = Vec2::new(at as f32 / 40.0, 0.5);
                let [own, whole] = [&both.0, &both.1].map(|texels| {
                    scene.images[0].texels = texels.clone();
                    sample_texture(&scene, &REFERENCE, uv)
                });
                assert_eq!(own, whole, "{} channels at {uv}", both.0.channels());
            }
        }
    }
}

#[test]
fn sixteen_bits_are_read_to_the_last() {
    let values = [[300_u16, 5], [25_900, 40_001], [65_535, 65_534]];
    let unit = |value: u16| f64::from(value) / 65_535.0;
    let linear = |value: u16| ((unit(value) + 0.055) / 1.055).powf(2.4);
    for srgb in [false, true] {
        let mut scene = row(Wrap::Repeat, false);
        scene.textures[0].srgb = srgb;
        scene.images[0].texels = Texels::deep(2, values.as_flattened());
        assert!(scene.images[0].texels.is_deep());
        let color = |value| match srgb {
            true if unit(value) <= 0.040_45 => unit(value) / 12.92,
            true => linear(value),
            false => unit(value),
        };
        for (at, low, high, share) in [(0.5, 0, 0, 0.0), (1.75, 1, 2, 0.25), (2.5, 2, 2, 0.0)] {
            let value = sample_texture(&scene, &REFERENCE, Vec2::new(at / 3.0, 0.5)).as_dvec4();
            let mix = |a: f64, b: f64| a + (b - a) * share;
            let [[grey, alpha], [next_grey, next_alpha]] = [values[low], values[high]];
            let expected = [mix(color(grey), color(next_grey)), mix(unit(alpha), unit(next_alpha))];
            let found = [value.x, value.w];
            // A level of 16 bits is 1.5e-5.
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{value} {at}");
            assert!(value.x == value.y && value.y == value.z, "grey");
        }
    }
}

#[test]
fn the_reference_moves_coordinates() {
    let scene = row(Wrap::Repeat, true);
    let transform =
        Affine2::from_scale_angle_translation(Vec2::splat(2.0), 0.0, Vec2::new(1.0 / 3.0, 0.0));
    let moved = TextureRef { transform, ..REFERENCE };
    let value = sample_texture(&scene, &moved, Vec2::new(0.25, 0.25));
    assert_close(value.x * 255.0, 200.0); // 2 * 0.25 + 1/3 = 5/6
}

#[test]
fn wild_coordinates_and_empty_images_are_harmless() {
    let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e20, -1e-30, -0.0];
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        for nearest in [false, true] {
            let mut scene = row(wrap, nearest);
            for (u, v) in wild.iter().flat_map(|u| wild.iter().map(move |v| (*u, *v))) {
                let value = sample_texture(&scene, &REFERENCE, Vec2::new(u, v));
                assert!(value.is_finite() && value.w == 1.0, "{u} {v}: {value}");
            }
            scene.images[0] =
                TextureImage { width: 0, height: 0, texels: Vec::<[u8; 4]>::new().into() };
            assert_eq!(sample_texture(&scene, &REFERENCE, Vec2::ZERO), Vec4::ONE);
        }
    }
}
