//! Tests of image_files: maps and pictures in and out, tone curves.

use std::fs;
use std::path::{Path, PathBuf};

use lightgrid::color::luminance;
use lightgrid::image::{
    ExrPicture, Image, Layer, LoadedMap, Rgb8, encode_png, read_exr_metadata, read_map,
    read_picture, sanitise, write_beside_and_rename, write_exr, write_png,
};
use lightgrid::tone::{ToneCurve, auto_exposure_ev, display_rgb8};

use crate::shared::shared;

/// Mean luminance weighted by solid angle, and the largest luminance.
fn mean_and_max(image: &Image) -> (f64, f64) {
    let (mut sum, mut weights, mut largest) = (0.0, 0.0, 0.0f64);
    for (y, row) in image.pixels.chunks_exact(image.width as usize).enumerate() {
        let weight = ((y as f64 + 0.5) / f64::from(image.height) * std::f64::consts::PI).sin();
        for &rgb in row {
            let value = f64::from(luminance(rgb.into()));
            sum += weight * value;
            weights += weight;
            largest = largest.max(value);
        }
    }
    (sum / weights, largest)
}

fn notices(map: &LoadedMap) -> String {
    map.notices.iter().collect::<Vec<_>>().join("\n")
}

/// Size, mean and largest luminance as listed in the data's index, to the digits printed there; and
/// what a notice must contain (`""`: there is none but for the shape).
type Expected = (&'static str, [u32; 2], f64, f64, &'static str);

const MAPS: [Expected; 25] = [
    ("env/KernerEnvLatLong.exr", [1024, 512], 0.186, 1678.0, ""),
    ("env/autumn_field_puresky_4k.hdr", [4096, 2048], 1.02, 1.535e5, ""),
    ("env/blender-interior.exr", [1024, 512], 0.973, 3.184e4, "negative"),
    ("env/blender-sunset.exr", [1024, 512], 0.494, 1986.0, "negative"),
    ("env/dikhololo_night_1k.hdr", [1024, 512], 0.0842, 72.57, ""),
    ("env/kloppenheim_05_1k.hdr", [1024, 512], 0.804, 7.894e4, ""),
    ("env/modern_buildings_2_1k.hdr", [1024, 512], 0.863, 6.762e4, ""),
    ("env/narrow_moonlit_road_1k.hdr", [1024, 512], 0.334, 7.113e4, ""),
    ("env/noon_grass_1k.hdr", [1024, 512], 0.558, 6.372e4, ""),
    ("env/peppermint_powerplant_1k.hdr", [1024, 512], 0.355, 15.74, ""),
    ("env/st_fagans_interior_1k.hdr", [1024, 512], 0.826, 1111.0, ""),
    ("env/studio_small_05_1k.hdr", [1024, 512], 0.564, 86.5, ""),
    ("env/vestibule_1k.hdr", [1024, 512], 0.991, 195.2, ""),
    ("odd/Bonita.exr", [550, 832], 0.305, 81.33, "550 x 832"),
    ("odd/BrightRingsNanInf.exr", [800, 800], 29.7, 1025.0, "4 NaN (now 0), 4 infinite"),
    ("odd/Garden.exr", [874, 493], 0.453, 10.21, "'Y' is read as grey"),
    ("odd/GrayRampsDiagonal.exr", [800, 800], 0.562, 18.0, "'Y' is read as grey"),
    ("odd/WavyLinesSphere.exr", [480, 480], 0.131, 0.9814, "480 x 480"),
    ("odd/exrs-f32-b44a.exr", [109, 65], 138.0, 1.647e4, "109 x 65"),
    ("odd/flaga.exr", [128, 64], 1.0, 1.0, "layer 'Warstwa 1'"),
    ("odd/imagers_rgbr4x4.hdr", [4, 4], 0.468, 2.846, "4 x 4"),
    ("odd/imagers_scale.hdr", [256, 8], 2.74e35, 5.767e37, "256 x 8"),
    // Not in the index: an independent reading of its old run-length code is its own size.
    ("odd/imagers_old-rle.hdr", [551, 276], 0.2412, 0.2675, "551 x 276"),
    ("odd/rainbow.hdr", [16, 16], 0.76, 0.9961, "16 x 16"),
    ("odd/tiled_half_1x1_alpha.exr", [1, 1], 1.0, 1.0, "'A' is read as grey"),
];

#[test]
fn real_maps_have_the_size_and_light_of_the_index() {
    for (name, size, mean, largest, notice) in MAPS {
        let Some(path) = shared(&format!("data/{name}")) else { return };
        let map = read_map(&path).unwrap();
        assert_eq!([map.image.width, map.image.height], size, "{name}");
        let got = mean_and_max(&map.image);
        assert!((got.0 / mean - 1.0).abs() < 6e-3, "{name}: mean {} not {mean}", got.0);
        assert!((got.1 / largest - 1.0).abs() < 1e-3, "{name}: largest {} not {largest}", got.1);
        assert!(map.image.pixels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0));
        if notice.is_empty() {
            assert!(map.notices.is_empty(), "{name}: {}", notices(&map));
        } else {
            assert!(notices(&map).contains(notice), "{name}: {}", notices(&map));
        }
    }
}

#[test]
fn a_picture_is_not_repaired() {
    let Some(path) = shared("data/odd/BrightRingsNanInf.exr") else { return };
    let image = read_picture(&path).unwrap();
    assert_eq!(image.pixels.iter().filter(|p| !p.iter().all(|v| v.is_finite())).count(), 12);
}

#[test]
fn windows_parts_and_primaries_of_exr_files() {
    let Some(t08) = shared("data/odd/t08.exr") else { return };
    let map = read_map(&t08).unwrap();
    assert_eq!((map.image.width, map.image.height), (501, 401));
    assert!(notices(&map).contains("400 x 300 at 30, 40"), "{}", notices(&map));
    assert_eq!(map.image.at(29, 200), [0.0; 3]);
    assert_eq!(map.image.at(200, 39), [0.0; 3]);
    // The data alone: the index's mean, weighted as the index weighs it.
    let data = Image::from_fn(400, 300, |x, y| map.image.at(x + 30, y + 40));
    let (mean, largest) = mean_and_max(&data);
    assert!((mean / 0.0572 - 1.0).abs() < 2e-3 && largest == 2.0, "{mean} {largest}");

    let parts = read_map(&shared("data/odd/multipart.0001.exr").unwrap()).unwrap();
    assert!(notices(&parts).contains("of the 10 parts"), "{}", notices(&parts));
    let data = Image::from_fn(877, 876, |x, y| parts.image.at(x + 654, y + 245));
    let (mean, largest) = mean_and_max(&data);
    assert!((mean / 0.229 - 1.0).abs() < 3e-3 && largest == 0.5, "{mean} {largest}");

    // XYZ pixels: the largest value of the second channel is the largest luminance.
    let xyz = read_map(&shared("data/odd/XYZ.exr").unwrap()).unwrap();
    assert!(notices(&xyz).contains("converted to Rec.709"), "{}", notices(&xyz));
    assert!((mean_and_max(&xyz.image).1 / 4.918 - 1.0).abs() < 1e-3);
}

#[test]
fn what_cannot_be_read_is_said_in_one_sentence() {
    let sentences = [
        ("odd/KernerEnvCube.exr", "is a cube map, lightgrid reads lat-long maps"),
        ("odd/deep-Balls-lowres.exr", "holds deep data"),
        ("malformed/bomb-40000.hdr", "claims 40000 x 40000 pixels"),
        ("malformed/comp_early_eof_piz.exr", "is a damaged OpenEXR file"),
        ("malformed/comp_invalid_unknown.exr", "is cut short or damaged"),
        ("malformed/piz_short_code.exr", "is a damaged OpenEXR file"),
        ("malformed/tiled_with_scanlineimage_type.exr", "is a damaged OpenEXR file"),
        ("malformed/zero-tilesize.exr", "is a damaged OpenEXR file"),
        ("malformed/openexr-damaged/memory_DOS_1.exr", "claims 1 x 452984833 pixels"),
        ("malformed/openexr-damaged/oom_exr.exr", "is cut short or damaged"),
    ];
    for (name, sentence) in sentences {
        let Some(path) = shared(&format!("data/{name}")) else { return };
        let error = read_map(&path).unwrap_err().to_string();
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        assert!(error.contains(sentence) && !error.contains('\n'), "{error}");
    }
    let damaged = shared("data/malformed/openexr-damaged").unwrap();
    for entry in fs::read_dir(damaged).unwrap() {
        assert!(read_map(&entry.unwrap().path()).is_err());
    }
    let missing = read_map(Path::new("no-such.hdr")).unwrap_err().to_string();
    assert_eq!(missing, "no-such.hdr: there is no such file");
    let folder = read_map(Path::new("src")).unwrap_err().to_string();
    assert_eq!(folder, "src: is a folder, not a file");
}

/// A file in a folder of its own that lives as long as the test.
fn temporary(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("the system has a folder for such files");
    let path = folder.path().join(name);
    (folder, path)
}

fn read_hdr_bytes(bytes: &[u8]) -> Result<LoadedMap, String> {
    let (_folder, path) = temporary("map.hdr");
    fs::write(&path, bytes).expect("the folder was just made");
    read_map(&path).map_err(|e| e.to_string())
}

/// A 4 x 2 picture with flat pixels: mantissa `10 + i` in red, exponent 136 (a scale of 1).
fn flat_hdr(header: &str) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    (0..8u8).for_each(|i| bytes.extend([10 + i, 0, 0, 136]));
    bytes
}

fn reds(map: &LoadedMap) -> Vec<f32> {
    map.image.pixels.iter().map(|p| p[0]).collect()
}

#[test]
fn hdr_headers_of_many_programs_are_accepted() {
    let plain: Vec<f32> = (10..18).map(|v| v as f32).collect();
    for header in [
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n",
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n",
        "#?Any Program 1.0\n\n-Y 2 +X 4\n",
        "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 2 +X 4\r\n",
        "#?RADIANCE\n# a comment with EXPOSURE=7\noconv x.rad | rpict\n\nFORMAT\n-Y 2 +X 4\n",
        "#?RADIANCE\nGAMMA=1\nPRIMARIES=0 0 0 0 0 0 0 0\nformat= 32-bit_rle_rgbe \n\n-Y 2 +X 4\n",
    ] {
        let result = read_hdr_bytes(&flat_hdr(header));
        if header.contains("\n\nFORMAT") {
            assert!(result.unwrap_err().contains("has no resolution like"), "{header}");
        } else {
            assert_eq!(reds(&result.unwrap()), plain, "{header}");
        }
    }
    let exposed = flat_hdr("#?RADIANCE\nEXPOSURE=2\nEXPOSURE=4\nCOLORCORR=0.5 1 1\n\n-Y 2 +X 4\n");
    assert_eq!(reds(&read_hdr_bytes(&exposed).unwrap())[0], 10.0 / 4.0);
    let exposed = flat_hdr("#?RADIANCE\nEXPOSURE=8 (by me)\nEXPOSURE=soon\n\n-Y 2 +X 4\n");
    let exposed = read_hdr_bytes(&exposed).unwrap();
    assert_eq!(reds(&exposed)[0], 10.0 / 8.0);
    assert!(notices(&exposed).contains("EXPOSURE of the file makes no sense"));
    // Radiance's own primaries are taken for Rec.709, as everyone does; those of Rec.2020 are not.
    let of = |primaries: &str| {
        let header = format!("#?RADIANCE\nPRIMARIES={primaries}\n\n-Y 2 +X 4\n");
        read_hdr_bytes(&flat_hdr(&header)).unwrap()
    };
    assert_eq!(reds(&of(".64 .33 .29 .6 .15 .06 .333 .333")), plain);
    let wide = of("0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290");
    assert!(notices(&wide).contains("own primaries"), "{}", notices(&wide));
    let [r, g, b] = of(".64 .33 .29 .6 .15 .06 .333 .333").image.pixels[3];
    let expected = 1.6605 * r - 0.5876 * g - 0.0728 * b;
    assert!((wide.image.pixels[3][0] - expected).abs() < 0.01, "{:?}", wide.image.pixels[3]);
}

#[test]
fn hdr_orientations_turn_the_picture_upright() {
    let expect = |axes: &str, size: (u32, u32), want: [i32; 8]| {
        let map = read_hdr_bytes(&flat_hdr(&format!("#?RADIANCE\n\n{axes}\n"))).unwrap();
        assert_eq!((map.image.width, map.image.height), size, "{axes}");
        let want: Vec<f32> = want.iter().map(|v| (10 + v) as f32).collect();
        assert_eq!(reds(&map), want, "{axes}");
    };
    expect("-Y 2 +X 4", (4, 2), [0, 1, 2, 3, 4, 5, 6, 7]);
    expect("+Y 2 +X 4", (4, 2), [4, 5, 6, 7, 0, 1, 2, 3]);
    expect("-Y 2 -X 4", (4, 2), [3, 2, 1, 0, 7, 6, 5, 4]);
    expect("+X 4 -Y 2", (4, 2), [0, 2, 4, 6, 1, 3, 5, 7]);
    expect("+X 2 +Y 4", (2, 4), [3, 7, 2, 6, 1, 5, 0, 4]);
}

#[test]
fn hdr_run_lengths_xyz_and_truncation() {
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n".to_vec();
    // New: channel by channel, a run of 5 and 3 literals, then runs of 8.
    let new =
        [&header[..], &[2, 2, 0, 8, 133, 50, 3, 1, 2, 3], &[136, 0, 136, 0, 136, 136]].concat();
    let map = read_hdr_bytes(&new).unwrap();
    assert_eq!(reds(&map), [50.0, 50.0, 50.0, 50.0, 50.0, 1.0, 2.0, 3.0]);
    // Old: one pixel, repeated 7 times.
    let old = [&header[..], &[50, 0, 0, 136, 1, 1, 1, 7]].concat();
    assert_eq!(reds(&read_hdr_bytes(&old).unwrap()), [50.0; 8]);
    // A run past the end of the row.
    let past = [&header[..], &[2, 2, 0, 8, 140, 50, 0, 0, 0, 0]].concat();
    assert!(read_hdr_bytes(&past).unwrap_err().contains("has a damaged row"));

    // XYZ of D65 white is grey.
    let mut xyz = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n".to_vec();
    xyz.extend([190, 200, 218, 136].repeat(2));
    let white = read_hdr_bytes(&xyz).unwrap().image.at(0, 0);
    assert!(white.iter().all(|v| (v / 200.0 - 1.0).abs() < 0.01), "{white:?}");

    let mut short = flat_hdr("#?RADIANCE\n\n-Y 2 +X 4\n");
    short.truncate(short.len() - 5);
    let error = read_hdr_bytes(&short).unwrap_err();
    assert!(error.contains("only 1 of 2 rows can be read"), "{error}");
    let bomb = read_hdr_bytes(b"#?RADIANCE\n\n-Y 16384 +X 16384\n\x02\x02").unwrap_err();
    assert!(bomb.contains("2 bytes cannot hold 16384 x 16384 pixels"), "{bomb}");
    let none = read_hdr_bytes(b"no radiance here").unwrap_err();
    assert!(none.contains("does not begin with #?"), "{none}");
}

/// A 2 x 1 picture, red then mid grey, as an uncompressed TGA and as a BMP.
#[test]
fn ldr_maps_are_told_by_content_or_extension() {
    let pixels_bgr = [0, 0, 255, 128, 128, 128];
    let tga_header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0x20];
    let tga = [&tga_header[..], &pixels_bgr].concat();
    let mut bmp = b"BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x02\0\0\0\x01\0\0\0".to_vec();
    bmp.extend([1, 0, 24, 0, 0, 0, 0, 0, 8, 0, 0, 0]);
    bmp.extend([0; 16]);
    bmp.extend([&pixels_bgr[..], &[0, 0]].concat());
    let grey = lightgrid::color::linear_from_srgb(128.0 / 255.0);
    let png = encode_png(&Rgb8 { width: 2, height: 1, pixels: vec![[255, 0, 0], [128; 3]] });
    let png = png.unwrap();
    for (name, bytes) in [
        ("map.tga", &tga),
        ("map.bmp", &bmp),
        ("map.unknown", &bmp),
        ("map.hdr", &png),
        ("map.exr", &bmp),
    ] {
        let (_folder, path) = temporary(name);
        fs::write(&path, bytes).unwrap();
        let map = read_map(&path).unwrap();
        assert_eq!(map.image.pixels, [[1.0, 0.0, 0.0], [grey; 3]], "{name}");
        assert!(notices(&map).contains("8-bit sRGB"), "{name}: {}", notices(&map));
    }
    for (name, bytes, sentence) in [
        ("notes.txt", &b"no picture at all"[..], "is not a picture of a known format"),
        ("empty", b"", "is not a picture of a known format"),
        ("empty.exr", b"", "is cut short"),
        ("empty.hdr", b"", "is not a Radiance picture"),
        ("text.exr", b"no picture at all", "is not an OpenEXR file"),
        ("gif.hdr", b"GIF89a and more than that", "is of the format GIF, not one of EXR"),
        ("floats.exr", b"P6 2 1 255 and pixels", "is of the format PNM, not one of EXR"),
        ("half.png", b"\x89PNG\r\n\x1a\n\0\0", "cannot be decoded"),
    ] {
        let (_folder, path) = temporary(name);
        fs::write(&path, bytes).unwrap();
        let error = read_map(&path).unwrap_err().to_string();
        assert!(error.contains(sentence) && !error.contains('\n'), "{name}: {error}");
    }
}

#[test]
fn sanitise_repairs_and_counts() {
    let mut image = Image::filled(2, 2, [1.0, 2.0, 3.0]);
    assert!(sanitise(&mut image).is_empty());
    image.pixels[0] = [f32::NAN, -1.0, f32::NEG_INFINITY];
    image.pixels[1] = [f32::INFINITY, 9.0, 0.0];
    let notices = sanitise(&mut image);
    assert_eq!(image.pixels[..2], [[0.0; 3], [9.0, 9.0, 0.0]]);
    let sentence = notices.iter().next().unwrap();
    assert!(sentence.contains("1 NaN") && sentence.contains("1 infinite"), "{sentence}");
    assert!(sentence.contains("1 negative"), "{sentence}");
    let mut infinite = Image::filled(1, 1, [f32::INFINITY, f32::NEG_INFINITY, 0.0]);
    assert!(sanitise(&mut infinite).iter().next().unwrap().contains("65504"));
    assert_eq!(infinite.pixels[0], [65_504.0, 0.0, 0.0]);
}

/// HDR and negative values, and sides that are no multiple of a block.
fn test_picture() -> Image {
    Image::from_fn(37, 21, |x, y| [x as f32 * 1e3, y as f32 - 4.0, 1e-5 * (x * y) as f32])
}

#[test]
fn exr_round_trip_keeps_every_bit_and_word() {
    let (_folder, path) = temporary("out.exr");
    let image = test_picture();
    let depth: Vec<f32> = (0..image.pixels.len()).map(|i| i as f32).collect();
    let metadata = [
        ("lightgrid:scene".to_owned(), "Küche → 厨房.glb".to_owned()),
        ("seed".into(), "7".into()),
    ];
    let layers = vec![
        Layer { name: "depth".into(), channels: vec![("Z".into(), depth)] },
        Layer {
            name: "albedo".into(),
            channels: ["R", "G", "B"].map(|c| (c.into(), vec![0.5; 37 * 21])).into(),
        },
    ];
    write_exr(&path, ExrPicture { image: &image, layers, metadata: &metadata, preview: None })
        .unwrap();
    assert_eq!(read_picture(&path).unwrap(), image);
    assert_eq!(read_exr_metadata(&path).unwrap(), metadata);
    // The extra layers are channels of the same part, by the names other programs look for.
    let bytes = fs::read(&path).unwrap();
    for name in ["albedo.R\0", "albedo.G\0", "albedo.B\0", "depth.Z\0", "\0R\0", "software\0"] {
        assert!(bytes.windows(name.len()).any(|w| w == name.as_bytes()), "{name:?}");
    }
    let short = Layer { name: "depth".into(), channels: vec![("Z".into(), vec![0.0])] };
    let picture = ExrPicture { image: &image, layers: vec![short], metadata: &[], preview: None };
    let error = write_exr(&path, picture).unwrap_err().to_string();
    assert!(error.contains("depth.Z has 1 values for 777 pixels"), "{error}");
    assert_eq!(read_picture(&path).unwrap(), image);
}

#[test]
fn png_round_trip_keeps_levels_and_words() {
    let (_folder, path) = temporary("out.png");
    let pixels = (0..=255u8).map(|v| [v, 255 - v, v / 2]).collect::<Vec<_>>();
    let picture = Rgb8 { width: 64, height: 4, pixels };
    let metadata = [("Software".to_owned(), "lightgrid".into()), ("Title".into(), "厨房".into())];
    write_png(&path, &picture, None, &metadata).unwrap();
    let linear = read_picture(&path).unwrap();
    assert_eq!(display_rgb8(&linear, 0.0, ToneCurve::None), picture);
    let bytes = fs::read(&path).unwrap();
    for chunk in ["sRGB", "tEXtSoftware\0lightgrid", "iTXtTitle\0", "厨房"] {
        assert!(bytes.windows(chunk.len()).any(|w| w == chunk.as_bytes()), "{chunk:?}");
    }
    let map = read_map(&path).unwrap();
    assert!(notices(&map).contains("8-bit"), "{}", notices(&map));
    assert!(write_png(&path, &picture, None, &[(String::new(), "no name".into())]).is_err());
}

#[test]
fn an_interrupted_write_leaves_the_old_file_and_nothing_else() {
    let (folder, path) = temporary("picture.exr");
    fs::write(&path, "old").unwrap();
    let error = write_beside_and_rename(&path, |file| {
        use std::io::Write;
        file.write_all(b"half")?;
        file.flush()?;
        Err(std::io::Error::other("the lights went out"))
    })
    .unwrap_err();
    assert!(error.to_string().ends_with("cannot be written: the lights went out"), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn where_a_picture_cannot_be_written_is_said() {
    let (folder, path) = temporary("picture.png");
    let write = |path: &Path| {
        let picture = Rgb8 { width: 1, height: 1, pixels: vec![[0; 3]] };
        write_png(path, &picture, None, &[]).unwrap_err().to_string()
    };
    assert!(write(folder.path()).ends_with("it is a folder"));
    assert!(write(&folder.path().join("no/such.png")).contains("there is no folder"));
    fs::write(&path, "old").unwrap();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    assert!(write(&path).ends_with("it is read-only"));
    assert_eq!(fs::read(&path).unwrap(), b"old");
}

/// A byte of each file is changed, or its end is cut off, many times over: errors are fine, panics
/// and pixels that are no radiance are not.
#[test]
fn damaged_files_never_panic() {
    let (_folder, path) = temporary("damaged");
    let exr = path.with_extension("exr");
    write_exr(
        &exr,
        ExrPicture { image: &test_picture(), layers: vec![], metadata: &[], preview: None },
    )
    .unwrap();
    let mut originals = vec![fs::read(&exr).unwrap()];
    originals.push(flat_hdr("#?RADIANCE\nEXPOSURE=1\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n"));
    for name in [
        "odd/tiled_half_1x1_alpha.exr",
        "odd/exrs-f32-b44a.exr",
        "odd/flaga.exr",
        "odd/rainbow.hdr",
    ] {
        originals.extend(shared(&format!("data/{name}")).map(|p| fs::read(p).unwrap()));
    }
    let mut state = 1u64;
    let mut random = |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below
    };
    let mut refused = 0;
    for original in &originals {
        for i in 0..150 {
            let mut bytes = original.clone();
            if i % 10 == 0 {
                bytes.truncate(random(bytes.len()));
            } else {
                // The header is where most of the harm can be done.
                let place = random(if i % 2 == 0 { bytes.len().min(400) } else { bytes.len() });
                bytes[place] = random(256) as u8;
            }
            fs::write(&path, &bytes).unwrap();
            match read_map(&path) {
                Ok(map) => {
                    assert!(map.image.pixels.as_flattened().iter().all(|v| v.is_finite()));
                }
                Err(error) => {
                    assert!(!error.to_string().contains('\n'), "{error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > originals.len() * 20, "only {refused} were refused");
}

#[test]
fn tone_curves_have_their_known_values() {
    let apply = |curve: ToneCurve, v: f32| curve.apply(glam::Vec3::splat(v)).to_array();
    let near = |got: [f32; 3], want: f32, tolerance: f32| {
        assert!(got.iter().all(|v| (v - want).abs() < tolerance), "{got:?} is not {want}");
    };
    // From the specification: 1 - d^2 / (peak + d - s) with peak 0.96, s 0.76, d 0.24.
    near(apply(ToneCurve::Neutral, 1.0), 1.0 - 0.0576 / 0.44, 1e-6);
    near(apply(ToneCurve::Neutral, 0.5), 0.46, 1e-6);
    // Half of the four per cent reflection is gone where the least channel is 0.04.
    near(apply(ToneCurve::Neutral, 0.04), 6.25 * 0.04 * 0.04, 1e-6);
    near(apply(ToneCurve::Reinhard, 1.0), 0.5, 1e-6);
    near(apply(ToneCurve::None, 0.7), 0.7, 1e-7);
    // The fit's own formula at 1: 1.0244881 / 1.654761, times rows that sum to 1.
    near(apply(ToneCurve::Aces, 1.0), 0.6191, 1e-3);
    // Middle grey becomes half of the encoded range: Sobotka's pivot.
    near(apply(ToneCurve::Agx, 0.18), 0.5f32.powf(2.2), 0.005);
    for curve in ToneCurve::ALL {
        let mut last = -1.0;
        for i in 0..400 {
            let shown = luminance(curve.apply(glam::Vec3::splat((i as f32 / 20.0 - 12.0).exp2())));
            assert!(shown >= last - 1e-6, "{curve:?} falls at step {i}");
            last = shown;
        }
        near(apply(curve, 0.0), 0.0, 2e-4);
        near(apply(curve, 1e30), 1.0, 0.02);
    }
}

#[test]
fn any_pixel_is_shown_and_always_alike() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, 0.0, 1e-40];
    let image = Image::from_fn(7, 7, |x, y| [odd[x as usize], odd[y as usize], 0.5]);
    for curve in ToneCurve::ALL {
        assert!(curve.apply(glam::Vec3::from(image.at(0, 1))).is_finite());
        let shown = display_rgb8(&image, 3.0, curve);
        assert_eq!(shown, display_rgb8(&image, 3.0, curve));
        // NaN is black and infinity is as bright as it gets.
        let nan = Image::filled(1, 1, [f32::NAN; 3]);
        assert!(display_rgb8(&nan, 0.0, curve).pixels[0].iter().all(|v| *v <= 1));
        let infinite = Image::filled(1, 1, [f32::INFINITY; 3]);
        assert!(display_rgb8(&infinite, 0.0, curve).pixels[0].iter().all(|v| *v >= 253));
    }
}

#[test]
fn dither_keeps_the_mean_between_two_levels() {
    let level = lightgrid::color::linear_from_srgb(100.3 / 255.0);
    let shown = display_rgb8(&Image::filled(256, 256, [level; 3]), 0.0, ToneCurve::None);
    let mean = shown.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 65_536.0;
    assert!((mean - 100.3).abs() < 0.02, "{mean}");
}

#[test]
fn auto_exposure_brings_the_typical_pixel_to_middle_grey() {
    let mut image = Image::filled(40, 20, [0.045; 3]);
    assert!((auto_exposure_ev(&image) - 2.0).abs() < 1e-4);
    // A few lamps, black and NaN pixels change nothing.
    image.pixels[..30].fill([1e5; 3]);
    image.pixels[30] = [0.0; 3];
    image.pixels[31] = [f32::NAN; 3];
    assert!((auto_exposure_ev(&image) - 2.0).abs() < 1e-4);
    assert_eq!(auto_exposure_ev(&Image::filled(2, 2, [0.0; 3])), 0.0);
}
