//! The binary as a person uses it: what it writes, says and refuses.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use lightgrid::image::{ExrPicture, Image, read_exr_metadata, read_picture, write_exr};
use serde_json::Value;

use crate::shared::shared;

/// A square of 2 m under a triangle 0.8 m high; no camera.
const SCENE: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3",
        "min": [-1, 0, -1], "max": [1, 1, 1]}],
    "bufferViews": [{"buffer": 0, "byteLength": 108}],
    "buffers": [{"uri": "scene.bin", "byteLength": 108}]
}"#;
const CORNERS: [[f32; 3]; 9] = [
    [-1.0, 0.0, -1.0],
    [-1.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, -1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [-0.4, 0.2, 0.0],
    [0.4, 0.2, 0.0],
    [0.0, 1.0, 0.0],
];

/// A folder with `scene.gltf` and `map.exr`, in which commands run.
pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let bytes: Vec<u8> = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        fs::write(folder.path().join("scene.bin"), bytes).expect("written");
        fs::write(folder.path().join("scene.gltf"), SCENE).expect("written");
        let mut map = Image::filled(32, 16, [0.5, 0.6, 0.8]);
        map.pixels[3 * 32 + 7] = [900.0, 800.0, 700.0];
        let picture = ExrPicture { image: &map, layers: vec![], metadata: &[], preview: None };
        write_exr(&folder.path().join("map.exr"), picture).expect("written");
        Self { folder }
    }

    pub(crate) fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
        command.current_dir(self.folder.path()).args(line.split_whitespace());
        command
    }

    pub(crate) fn run(&self, line: &str) -> Output {
        self.command(line).output().expect("the binary starts")
    }

    /// Renders 32x18 pixels with 2 samples unless `rest` says otherwise; must succeed.
    pub(crate) fn render(&self, rest: &str) -> Output {
        let output = self.run(&render_line(rest));
        assert!(output.status.success(), "{rest}: {}", text(&output.stderr));
        output
    }

    /// What a command that must fail says; it must leave no new file behind.
    pub(crate) fn refusal(&self, line: &str, status: i32) -> String {
        let before = self.files();
        let output = self.run(line);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{line}: {message}");
        assert!(output.stdout.is_empty(), "{line}: stdout is for results");
        assert!(!message.contains("panicked"), "{line}: {message}");
        assert_eq!(self.files(), before, "{line}");
        message
    }

    pub(crate) fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).expect("readable");
        let mut names: Vec<String> = entries
            .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&fs::read(self.path(name)).expect("written")).expect("JSON")
    }
}

pub(crate) fn render_line(rest: &str) -> String {
    let mut line = format!("render scene.gltf --env map.exr {rest}");
    for (option, value) in [("--size", "32x18"), ("--spp", "2"), ("--learning-paths", "500")] {
        if !rest.contains(option) {
            line += &format!(" {option} {value}");
        }
    }
    line
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Puts a program into a folder, which may not be there yet: a script of the shell.
#[cfg(unix)]
pub(crate) fn install(folder: &Path, name: &str, script: &str) {
    use std::os::unix::fs::PermissionsExt;
    fs::create_dir_all(folder).expect("made");
    let program = folder.join(name);
    fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("written");
    let mode = fs::Permissions::from_mode(0o755);
    fs::set_permissions(&program, mode).expect("allowed");
}

#[cfg(unix)]
pub(crate) fn send(child: &std::process::Child, signal: &str) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(sent.expect("kill is there").success());
}

/// What is changed on the command line is what is changed in the window.
#[test]
fn materials_are_changed_by_name() {
    let bench = Bench::new();
    let mean = |name: &str| {
        let picture = read_picture(&bench.path(name)).expect("a picture");
        let sum: Vec<f64> = picture.pixels.iter().fold(vec![0.0; 3], |sum, pixel| {
            sum.iter().zip(pixel).map(|(s, p)| s + f64::from(*p)).collect()
        });
        [sum[0], sum[1], sum[2]]
    };
    let line =
        |rest: &str| format!("render office --env sky:overcast@64x32 --size 32x18 --spp 4 {rest}");
    let run = |rest: &str| {
        let output = bench.run(&line(rest));
        assert!(output.status.success(), "{rest}: {}", text(&output.stderr));
    };
    run("-o plain.exr");
    run("-o red.exr --material wall:color=#ff0000,roughness=0.4 --json red.json");
    let ([r, _, b], [red, _, blue]) = (mean("plain.exr"), mean("red.exr"));
    assert!(red / blue > 1.05 * r / b, "{red} {blue} {r} {b}");
    assert_eq!(
        bench.json("red.json")["settings"]["materials"][0],
        "wall:color=#ff0000,roughness=0.4"
    );
    let office = lightgrid::scene::builtin::build("office").expect("built in");
    let number = office.materials.iter().position(|it| it.name == "wall").expect("it has walls");
    run(&format!("-o numbered.exr --material {number}:color=#ff0000,roughness=0.4"));
    assert_eq!(mean("numbered.exr"), mean("red.exr"));
    run("-o without.exr --material wall:hidden");
    let [without, ..] = mean("without.exr");
    assert!(without > 2.0 * r, "the sky comes in: {without} {r}");
    let refusal = |rest: &str, status| bench.refusal(&line(rest), status);
    let says = refusal("-o a.exr --material marble:roughness=1", 1);
    assert!(says.contains("office: no material is called \"marble\""), "{says}");
    let painted = SCENE.replace("\"POSITION\": 0}", "\"POSITION\": 0}, \"material\": 0");
    let painted = painted.replace("\"asset\"", "\"materials\": [{\"name\": \"paint\"}], \"asset\"");
    fs::write(bench.path("painted.gltf"), painted).expect("written");
    for options in ["--hide paint", "--material paint:hidden"] {
        let says = bench.refusal(&format!("render painted.gltf -o a.exr {options}"), 1);
        assert!(says.contains("all of it is hidden, so there is nothing to render"), "{says}");
    }
    let says = refusal("-o a.exr --material wall:shine=1", 2);
    assert!(
        says.contains(
            "shine is not color, roughness, metalness, opacity, emission, emission-color or hidden"
        ),
        "{says}"
    );
}

#[test]
fn distributions_are_exported_as_tables() {
    let bench = Bench::new();
    bench.render("-o a.exr --distributions distributions.csv");
    let csv = fs::read_to_string(bench.path("distributions.csv")).expect("written");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("cell,distribution,tile,probability"));
    let mut sums = std::collections::BTreeMap::new();
    for line in lines {
        let fields: Vec<f64> = line.split(',').map(|f| f.parse().expect("a number")).collect();
        *sums.entry(fields[0] as u32).or_insert(0.0) += fields[3];
    }
    assert!(!sums.is_empty());
    assert!(sums.values().all(|sum: &f64| (sum - 1.0).abs() < 1e-4), "{sums:?}");

    bench.render("-o a.exr --distributions distributions.json");
    let json = bench.json("distributions.json");
    assert_eq!(json["tiles"], 128);
    assert_eq!(json["distribution_of_cell"].as_object().expect("a map").len(), sums.len());
    bench.render("-o a.exr --distributions distributions.exr");
    let picture = read_picture(&bench.path("distributions.exr")).expect("a picture");
    assert_eq!(picture.width, 128);
    assert!(picture.height > 1);

    let message = bench.refusal("render scene.gltf -o b.exr --distributions distributions.txt", 1);
    assert!(
        message.contains("distributions.txt: distributions are written as .csv, .json or .exr"),
        "{message}"
    );
}

#[test]
fn help_names_every_command() {
    let help = text(&Bench::new().run("--help").stdout);
    for word in ["render", "merge", "compare", "info", "sat"] {
        assert!(help.contains(&format!("\n  {word} ")), "{help}");
    }
    let (window, report) = (cfg!(feature = "window"), cfg!(feature = "report"));
    for (word, is_built_in) in
        [("view", window), ("screenshot", window), ("report", report), ("stability", report)]
    {
        assert_eq!(help.contains(&format!("\n  {word} ")), is_built_in, "{help}");
    }
}

#[test]
fn a_render_writes_picture_figures_and_metadata() {
    let bench = Bench::new();
    let output = bench.render("-o a.png -o a.exr --json a.json --layers all --seed 7");
    assert!(output.stdout.is_empty());
    let says = text(&output.stderr);
    assert!(says.contains("has no camera"), "{says}");
    assert!(says.ends_with("\nwrote a.png\nwrote a.exr\nwrote a.json\n"), "{says}");
    assert_eq!(says.lines().count(), 4, "{says}");
    assert_eq!(
        bench.files(),
        ["a.exr", "a.json", "a.png", "map.exr", "scene.bin", "scene.gltf"],
        "nothing else is left behind"
    );

    let figures = bench.json("a.json");
    assert_eq!(figures["samples_per_pixel"], 2);
    assert_eq!(figures["session"]["samples"], 2 * 32 * 18);
    assert_eq!(figures["session"]["learning_paths"], 500);
    assert_eq!(figures["triangles"], 3);
    assert_eq!(figures["invalid_samples"], 0);
    assert_eq!(figures["settings"]["tiles"], "16x8");
    assert_eq!(figures["settings"]["filter"], "blackman-harris");
    assert!(figures["memory"]["grid_bytes"].as_u64().expect("bytes") < 10 << 20);

    let metadata = read_exr_metadata(&bench.path("a.exr")).expect("attributes");
    for (key, value) in [
        ("lightgrid.scene", "scene.gltf"),
        ("lightgrid.map", "map.exr"),
        ("lightgrid.samples_per_pixel", "2"),
        ("lightgrid.seed", "7"),
        ("lightgrid.sampling", "adaptive"),
    ] {
        let found = metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
        assert_eq!(found, Some(value), "{key}");
    }
    let png = fs::read(bench.path("a.png")).expect("written");
    for part in ["lightgrid.scene\0scene.gltf", "lightgrid.map\0map.exr", "lightgrid.seconds\0"] {
        assert!(png.windows(part.len()).any(|w| w == part.as_bytes()), "{part}");
    }
}

#[test]
fn a_built_in_scene_has_its_own_sky_unless_another_is_named() {
    let bench = Bench::new();
    for (rest, map) in [("evening", "sky:night"), ("evening --env sky:day", "sky:day")] {
        let line = format!("render {rest} --size 8x6 --spp 1 --device cpu -o evening.exr");
        assert!(bench.run(&line).status.success(), "{line}");
        let metadata = read_exr_metadata(&bench.path("evening.exr")).expect("attributes");
        assert!(metadata.contains(&("lightgrid.map".to_owned(), map.to_owned())), "{metadata:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_picture_whatever_the_threads() {
    let bench = Bench::new();
    for (name, rest) in [("a", "--threads 1"), ("b", "--threads 3"), ("c", "--seed 1")] {
        bench.render(&format!("-o {name}.exr {rest}"));
    }
    let [a, b, c] = ["a.exr", "b.exr", "c.exr"].map(|n| read_picture(&bench.path(n)).expect("it"));
    assert_eq!(a, b);
    assert_ne!(a, c);
}

#[test]
fn a_view_chosen_for_a_scene_without_camera_fills_the_picture() {
    let bench = Bench::new();
    for (width, height) in [(64, 36), (20, 60)] {
        // Without bounces surfaces are black and the sky is not.
        bench.render(&format!("-o a.exr --bounces 0 --filter box --size {width}x{height}"));
        let picture = read_picture(&bench.path("a.exr")).expect("it");
        let seen: Vec<(usize, usize)> = (0..width * height)
            .filter(|&i| picture.pixels[i] == [0.0; 3])
            .map(|i| (i % width, i / width))
            .collect();
        let columns = extent(seen.iter().map(|p| p.0)) as f32 / width as f32;
        let rows = extent(seen.iter().map(|p| p.1)) as f32 / height as f32;
        let fill = columns.max(rows);
        assert!((0.8..1.0).contains(&fill), "{width}x{height}: {columns} by {rows}");
    }
}

fn extent(numbers: impl Iterator<Item = usize> + Clone) -> usize {
    let (low, high) = (numbers.clone().min(), numbers.max());
    low.zip(high).map_or(0, |(low, high)| high - low + 1)
}

#[test]
fn layers_that_no_picture_holds_are_remarked() {
    let bench = Bench::new();
    let says = |rest: &str| text(&bench.render(rest).stderr).contains("--layers adds nothing");
    assert!(says("-o a.png --layers depth"));
    assert!(!says("-o a.png -o a.exr --layers depth"));
}

#[test]
fn a_black_map_has_no_tables_worth_reading_and_no_distributions() {
    let bench = Bench::new();
    let black = Image::filled(8, 4, [f32::NAN, 0.0, -1.0]);
    let picture = ExrPicture { image: &black, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("black.exr"), picture).expect("written");
    let says = text(&bench.run("sat black.exr").stderr);
    assert!(says.contains("notice: black.exr: pixels of the map were repaired"), "{says}");
    assert!(says.contains("notice: black.exr: the map is black"), "{says}");
    let says = bench.refusal("render open --env black.exr -o a.png --distributions d.csv", 1);
    assert!(says.contains("d.csv: not written: this map"), "{says}");
}

/// What is asked of pictures that a command does not write is said, and changes nothing in those it does.
#[test]
fn a_filter_for_pictures_that_are_not_written_changes_nothing() {
    let bench = Bench::new();
    bench.render("-o a.exr --size 64x64 --reproducible");
    let output = bench.render("-o b.exr --size 64x64 --reproducible --denoise");
    assert!(text(&output.stderr).contains("--denoise changes nothing"), "{}", text(&output.stderr));
    let [a, b] = ["a.exr", "b.exr"].map(|name| fs::read(bench.path(name)).expect("written"));
    assert!(a == b);
}

/// Red, green and blue of an 8-bit picture without alpha.
fn read_rgb(path: &Path) -> Vec<u8> {
    let file = BufReader::new(fs::File::open(path).expect("written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    assert_eq!(reader.info().color_type, png::ColorType::Rgb);
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    reader.next_frame(&mut bytes).expect("pixels");
    bytes
}

#[test]
fn a_denoised_room_is_cleaner_for_cached_light_beside_its_samples() {
    let bench = Bench::new();
    let says = |scene: &str, rest: &str| {
        let fixed = "--size 96x64 --device cpu --exposure 6.4 --denoise a-trous --reproducible";
        let output = bench.run(&format!("render {scene} {fixed} {rest}"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr).contains("of cached light")
    };
    assert!(says("office", "--spp 2 -o beside.png -o beside.exr"));
    assert!(!says("office", "--spp 2 --gi exact -o exact.png -o exact.exr"));
    let files = ["beside", "exact"].map(|name| {
        let of = |kind: &str| fs::read(bench.path(&format!("{name}.{kind}"))).expect("written");
        [of("png"), of("exr")]
    });
    assert!(files[0][1] == files[1][1], "linear pictures have exact samples alone");
    let names_it = |png: &[u8]| {
        let words = b"lightgrid.cached_samples_per_pixel\x0010";
        png.windows(words.len()).any(|bytes| bytes == words)
    };
    assert!(names_it(&files[0][0]) && !names_it(&files[1][0]));
    assert!(says("office", "--spp 2 --threads 1 -o again.png -o again.exr"));
    assert!(fs::read(bench.path("again.png")).expect("written") == files[0][0]);

    // Where exact samples are not wanted for themselves, both together are what was asked for.
    let output = bench.run("render office --spp 12 --size 96x64 --device cpu -o both.png");
    let words = "denoised from 12 samples a pixel: 2 exact, 10 of cached light";
    assert!(text(&output.stderr).contains(words), "{}", text(&output.stderr));

    assert!(!says("office", "--spp 256 --gi exact -o reference.png -o reference.exr"));
    let reference = read_rgb(&bench.path("reference.png"));
    let [beside, exact] = ["beside.png", "exact.png"].map(|name| {
        let levels = read_rgb(&bench.path(name));
        let pairs = levels.iter().zip(&reference);
        pairs.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>()
    });
    assert!(beside < 0.6 * exact, "squared error {} of without", beside / exact);

    // The same without noise in linear light, beside what was rendered.
    assert!(says("office", "--spp 2 --layers denoised -o layer.exr"));
    let layer = fs::read(bench.path("layer.exr")).expect("written");
    assert!(layer.windows(11).any(|bytes| bytes == b"denoised.R\0"));
    let picture = |name: &str| read_picture(&bench.path(name)).expect("written");
    assert_eq!(picture("layer.exr"), picture("exact.exr"));
    // And in place of what was rendered, which is a layer then.
    assert!(says("office", "--spp 4 --rgb denoised -o rgb.exr"));
    let rgb = fs::read(bench.path("rgb.exr")).expect("written");
    assert!(rgb.windows(11).any(|bytes| bytes == b"rendered.R\0"));
    let reference = picture("reference.exr");
    let [rgb, noisy] = ["rgb.exr", "exact.exr"].map(|name| {
        let picture = picture(name);
        let pairs = picture.pixels.as_flattened().iter().zip(reference.pixels.as_flattened());
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
    });
    assert!(rgb < 0.3 * noisy, "squared error {} of what was rendered", rgb / noisy);
    for option in ["--layers", "--rgb"] {
        let refused = bench.run(&format!("render office {option} denoised --denoise off -o a.exr"));
        assert!(text(&refused.stderr).contains("wants a denoiser"), "{}", text(&refused.stderr));
    }

    for rest in ["--spp 1 --part 1/1 -o a.part", "--spp 1 --sampling plain -o a.png"] {
        assert!(!says("office", rest), "{rest}");
    }
    assert!(!says("exterior", "--spp 1 -o a.png"), "outside it gains nothing");
}

#[test]
fn a_black_picture_is_remarked() {
    let output = Bench::new().render("-o a.png --env-intensity 0");
    assert!(text(&output.stderr).contains("the picture is black"), "{}", text(&output.stderr));
}

/// Where the time is over before every pixel has a sample, a few of them all over the picture have.
#[test]
fn a_moment_is_enough_for_a_whole_picture() {
    let bench = Bench::new();
    let output = bench.render("--size 640x360 --seconds 1e-6 --device cpu -o hasty.exr");
    assert!(
        text(&output.stderr).contains("of the pixels had a sample"),
        "{}",
        text(&output.stderr)
    );
    bench.render("--size 80x45 --spp 1 --sampling plain --device cpu -o small.exr");
    let [picture, small] =
        ["hasty.exr", "small.exr"].map(|name| read_picture(&bench.path(name)).expect("a picture"));
    // The map is bright everywhere, and the camera sees it or what it lights. Few samples find nothing: no
    // more of those it begins with, every eighth in each row and column, than of others while nothing is
    // learned.
    let [black, usual] = [&picture, &small].map(|picture| {
        let black = picture.pixels.iter().filter(|pixel| pixel[1] == 0.0).count();
        black as f64 / picture.pixels.len() as f64
    });
    let error = (usual * (1.0 - usual) / small.pixels.len() as f64).sqrt();
    assert!(usual < 0.1 && black < usual + 5.0 * error, "{black} of the pixels are black, {usual}");
    let of_lattice = |x: usize, y: usize| picture.pixels[(y - y % 8) * 640 + x - x % 8];
    let pixels = (0..360).flat_map(|y| (0..640).map(move |x| (x, y)));
    let alike = pixels.filter(|&(x, y)| picture.pixels[y * 640 + x] == of_lattice(x, y)).count();
    assert!(alike >= 640 * 360 / 2, "{alike} pixels show one of those it begins with");
}

#[test]
fn a_look_is_laid_over_pictures_for_a_display_alone() {
    let bench = Bench::new();
    let swapped = "# red and blue change places\nLUT_3D_SIZE 2\n0 0 0\n0 0 1\n0 1 0\n0 1 1\n1 0 0\n1 0 1\n1 1 0\n1 1 1\n";
    fs::write(bench.path("swap.cube"), swapped).expect("written");
    let rendered = |look: &str| {
        bench.render(&format!("-o a.png -o a.exr --reproducible {look}"));
        (read_rgb(&bench.path("a.png")), read_picture(&bench.path("a.exr")).expect("read").pixels)
    };
    let (plain, linear) = rendered("");
    let colors = |rgb: &[u8]| rgb.chunks(3).filter(|c| c[0] != c[2]).count();
    assert!(colors(&plain) > 100, "the map is blue");
    let (swapped, same) = rendered("--look swap.cube");
    assert!(same == linear, "linear radiance has no look");
    let differs = |(a, b): (&[u8], &[u8])| [0, 1, 2].iter().any(|c| a[2 - c].abs_diff(b[*c]) > 1);
    assert_eq!(plain.chunks(3).zip(swapped.chunks(3)).filter(|pair| differs(*pair)).count(), 0);
    let (grey, _) = rendered("--look look:black-and-white");
    assert_eq!(colors(&grey), 0);
    let (half, _) = rendered("--look look:black-and-white --look-strength 0");
    assert!(half == plain);
    let png = fs::read(bench.path("a.png")).expect("written");
    let words = b"look:black-and-white,0";
    assert!(png.windows(words.len()).any(|bytes| bytes == words));
}

#[test]
fn odd_but_sound_settings_render() {
    let bench = Bench::new();
    for rest in [
        "--size 1x1",
        "--tiles 1x1",
        "--tiles 256x256",
        "--grid 2",
        "--grid 256",
        "--bounces 0",
        "--sampling talk",
        "--sampling bsdf",
        "--table f32",
        "--table u32",
        "--env-rotation -90",
        "--exposure -2.5 --tonemap none",
        "--eye -1,2,-3 --target 0,0.5,0",
        "--lens-radius 0.1 --focus 2",
        "--seconds 0.05 --spp 1000000",
        "--noise 0.9 --spp 1000000",
        "--fog 0.1,0.2,0.3 --fog-anisotropy -0.5 --fog-box -1,-1,-1,1,2,3",
        "--fog 0",
    ] {
        bench.render(&format!("-o a.png {rest}"));
    }
}

#[test]
fn wrong_values_are_refused_with_the_reason() {
    let bench = Bench::new();
    for (rest, reason) in [
        ("--size 0x9", "two positive whole numbers"),
        ("--size 100000x100000", "more than"),
        ("--spp 0", "0 is not in 1.."),
        ("--spp -1", "-1 is not in 1.."),
        ("--seconds nan", "expected a number"),
        ("--noise -1", "must be above 0"),
        ("--env-intensity -1", "must not be negative"),
        ("--env-sun -1", "must not be negative"),
        ("--sun-at 0.5,1.1", "two numbers from 0 to 1"),
        ("--sun-at 0.5,0.5 --env-rotation 10", "cannot be used with"),
        ("--threads 1000000", "is not in 0..=1024"),
        ("--spp 1.5", "expected a whole number from 1 to 4294967295"),
        ("--camera 0 --eye 1,1,1 --target 0,0,0", "cannot be used with"),
        ("--seed 18446744073709551615", "18446744073709551615 is not in 0..=4294967295"),
        ("--tiles 257x1", "at most 256x256"),
        ("--grid 1", "1 is not in 2..=256"),
        ("--eye nan,0,0 --target 0,0,0", "three numbers"),
        ("--eye 0,0,0", "--target"),
        ("--layers foo", "albedo, normal, depth"),
        ("--table foo", "tile-local"),
        ("--tonemap filmic", "reinhard"),
        ("--look look:sepia", "there is no such look (look:punchy"),
        ("--look none.cube", "none.cube: there is no such file"),
        ("--look scene.gltf", "scene.gltf: line 1 is none of a .cube file"),
        ("--look look:warm --look-strength 1.5", "a share from 0 to 1"),
        ("--look-strength 0.5", "--look <"),
        ("--fog -1", "must not be negative"),
        ("--fog 1,2", "one number or three"),
        ("--fog-anisotropy 2", "between -1 and 1"),
        ("--fog-box 0,0,0,1,0,1", "the lower one"),
    ] {
        let message = bench.refusal(&render_line(&format!("-o a.png {rest}")), 2);
        assert!(message.contains(reason), "{rest}: {message}");
    }
}

#[test]
fn a_camera_goes_by_its_name_or_its_number() {
    let bench = Bench::new();
    let [named, counted, first] = ["round window", "2", "0"].map(|camera| {
        let mut command = bench.command(
            "render living-room --size 16x9 --spp 1 --gi exact --reproducible -o a.png --camera",
        );
        let output = command.arg(camera).output().expect("the binary starts");
        assert!(output.status.success(), "{}", text(&output.stderr));
        fs::read(bench.path("a.png")).expect("written")
    });
    assert_eq!(named, counted);
    assert_ne!(named, first);
}

#[test]
fn the_sun_is_put_somewhere_by_turning_the_map() {
    let bench = Bench::new();
    let render = |rest: &str| {
        let line = "render living-room --size 32x18 --spp 1 --gi exact -o a.exr";
        let output = bench.command(&format!("{line} {rest}")).output().expect("the binary starts");
        let said = text(&output.stderr);
        assert!(output.status.success(), "{said}");
        (said, read_picture(&bench.path("a.exr")).expect("a picture"))
    };
    let (said, put) = render("--sun-at 0.9,0.9");
    let degrees = said.split_once("turns the map by ").and_then(|(_, rest)| rest.split_once(' '));
    let (degrees, _) = degrees.expect("the notice names the rotation");
    let (_, turned) = render(&format!("--env-rotation {degrees}"));
    assert_eq!(put.pixels, turned.pixels);
    // The lower right corner is brighter by far than where the sun is elsewhere.
    let (_, elsewhere) = render("--env-rotation 180");
    let corner = |image: &Image| image.at(29, 16).iter().sum::<f32>();
    assert!(corner(&put) > 5.0 * corner(&elsewhere), "{} {}", corner(&put), corner(&elsewhere));
    // The sun comes through no window onto the ceiling.
    let (said, _) = render("--sun-at 0.5,0.02");
    assert!(said.contains("° above the horizon, cannot reach this place; it shines"), "{said}");
}

#[test]
fn what_cannot_be_done_is_one_sentence_and_status_1() {
    let bench = Bench::new();
    let line = render_line;
    for (line, reason) in [
        (line("-o a.png --camera 3"), "--camera 3: scene.gltf has no camera"),
        (line("-o a.png --fov 180"), "--fov 180"),
        (line("-o a.png --eye 1,1,1 --target 1,1,1"), "the same point"),
        (line("-o a.jpg"), "a.jpg: pictures are written as .png or .exr"),
        (line("-o none/a.png"), "there is no folder none"),
        (line("-o a.png -o ./a.png"), "./a.png: two outputs"),
        #[cfg(unix)]
        (line("-o a.png --json /dev/stdout"), "/dev/stdout: cannot be written: it is not an ord"),
        #[cfg(target_os = "linux")]
        (line("-o a.png --json /dev/fd/1"), "/dev/fd/1: cannot be written: it is not an ordinary"),
        (line("-o a.png/"), "a.png/: cannot be written: its name is that of a folder"),
        (
            line("-o a.png --sampling bsdf --distributions d.csv"),
            "d.csv: not written: this map and sampling have no distributions",
        ),
        (line("-o a.png --json a.png"), "a.png: two outputs"),
        ("render none.glb -o a.png".into(), "none.glb: there is no such file"),
        ("render none -o a.png".into(), "neither a file nor a built-in scene"),
        ("render sky:day -o a.png".into(), "sky:day: is a sky, which a scene gets by --env"),
        ("render map.exr -o a.png".into(), "map.exr: is a picture, where a scene is expected"),
        ("render scene.gltf -o a.png --env none.hdr".into(), "none.hdr: there is no such file"),
        (
            "render scene.gltf -o a.png --env scene.gltf".into(),
            "scene.gltf: is a glTF scene, where a map",
        ),
        ("render scene.gltf -o a.png --env sky:mars".into(), "no built-in sky called \"mars\""),
        (
            "render open -o a.png --camera sofa".into(),
            "--camera sofa: open has one camera, \"terrace\"",
        ),
        (
            "render office -o a.png --camera sofa".into(),
            "--camera sofa: office has cameras 0 to 2; `lightgrid info` names them",
        ),
        ("render open -o a.png --variant red".into(), "open: there is no variant red: it has none"),
        (
            "render open -o a.png --sun-at 0.5,0".into(),
            "--sun-at 0.5,0: there is no surface for the sun to shine on, only the map",
        ),
        ("compare map.exr none.exr".into(), "none.exr: there is no such file"),
        ("info none.exr".into(), "none.exr: there is no such file"),
    ] {
        let message = bench.refusal(&line, 1);
        assert!(message.contains(reason), "{line}: {message}");
        assert_eq!(message.lines().count(), 1, "{line}: {message}");
    }
}

#[test]
fn comparing_tells_equal_pictures_from_others() {
    let bench = Bench::new();
    bench.render("-o a.exr");
    bench.render("-o b.exr --seed 1");
    bench.render("-o c.exr --size 16x16");
    let figures = |line: &str| -> Value {
        serde_json::from_slice(&bench.run(line).stdout).expect("JSON on stdout")
    };
    assert_eq!(figures("compare a.exr a.exr --json")["mse"], 0.0);
    assert!(figures("compare a.exr b.exr --json")["mse"].as_f64().expect("a number") > 0.0);
    let message = bench.refusal("compare a.exr c.exr", 1);
    assert!(message.contains("differ in size: 32 x 18 and 16 x 16"), "{message}");
}

/// A part is compared as the picture that it is of, and told from scenes where no picture will do.
#[test]
fn a_part_is_compared_as_its_picture() {
    let bench = Bench::new();
    bench.render("-o a.exr --checkpoint c.film");
    bench.render("--part 1/1 -o a.part");
    for film in ["a.part", "c.film"] {
        let output = bench.run(&format!("compare {film} a.exr --json"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        let figures: Value = serde_json::from_slice(&output.stdout).expect("JSON on stdout");
        assert_eq!(figures["mse"], 0.0, "{film}");
    }
    let is_a_film = "a.part: is a part of a picture, or a checkpoint, of which `lightgrid merge`";
    for line in ["info a.part", "render open --env a.part -o b.png", "render a.part -o b.png"] {
        let says = bench.refusal(line, 1);
        assert!(says.contains(is_a_film), "{line}: {says}");
    }
    fs::write(bench.path("a.part"), r#"{"lightgrid_film":1,"si"#).unwrap();
    let says = bench.refusal("compare a.part a.exr", 1);
    assert!(says.contains("a.part: is cut short"), "{says}");
    fs::write(bench.path("a.txt"), "no picture").unwrap();
    let says = bench.refusal("compare a.txt a.exr", 1);
    assert!(says.contains("a.txt: is not a picture of a known format"), "{says}");
}

#[test]
fn info_and_sat_print_facts() {
    let bench = Bench::new();
    let map = text(&bench.run("info map.exr").stdout);
    assert!(map.contains("size: 32 x 16") && map.contains("brightest pixel: 7, 3"), "{map}");
    let scene = text(&bench.run("info scene.gltf").stdout);
    assert!(scene.contains("triangles: 3") && scene.contains("no material"), "{scene}");
    let sat = text(&bench.run("sat map.exr").stdout);
    for kind in ["tile-local", "u32", "f32", "f64"] {
        assert!(sat.contains(kind), "{sat}");
    }
}

/// Malformed files of others: one sentence that names the file, quickly, and no picture.
#[test]
fn malformed_files_are_refused_by_name() {
    let Some(folder) = shared("data/malformed") else { return };
    let bench = Bench::new();
    let mut refused = 0;
    for file in files_below(&folder) {
        let name = file.file_name().expect("a file").to_string_lossy().into_owned();
        let mut command = match file.extension().and_then(|e| e.to_str()) {
            // Reading these is sound: one lies in its normals only, one is part of another.
            _ if name.starts_with("BoxBadNormals") => continue,
            Some("gltf" | "glb") => bench.command("render --env map.exr -o a.png"),
            Some("exr" | "hdr") => bench.command("render scene.gltf -o a.png --env"),
            _ => continue,
        };
        let output = command.arg(&file).output().expect("the binary starts");
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {message}");
        assert!(message.lines().count() == 1 && message.contains(&name), "{message}");
        assert!(!bench.path("a.png").exists(), "{name}");
        refused += 1;
    }
    assert!(refused > 20, "{refused}");
}

fn files_below(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).expect("readable").map(|e| e.expect("an entry").path());
    entries.flat_map(|path| if path.is_dir() { files_below(&path) } else { vec![path] }).collect()
}

/// A program that starts a render hears how far it is, and ends it by closing its input.
#[test]
fn a_watched_render_says_how_far_it_is_and_ends_with_its_input() {
    let bench = Bench::new();
    let line = render_line("-o a.png --spp 100000000 --json a.json --watched");
    let mut command = bench.command(&line);
    let mut child =
        command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut lines =
        BufReader::new(child.stderr.take().expect("piped")).lines().map_while(Result::ok);
    // By the second one there are samples.
    for _ in 0..2 {
        let line = lines.find(|line| line.contains("% rendering, ")).expect("it is said");
        assert!(line.starts_with("lightgrid: 0.") && line.contains("/100000000 samples"), "{line}");
    }
    drop(child.stdin.take());
    let rest: Vec<String> = lines.collect();
    assert!(child.wait().expect("it ends").success(), "{rest:?}");
    assert!(rest.iter().any(|line| line.starts_with("wrote a.png")), "{rest:?}");
    assert!(bench.json("a.json")["samples_per_pixel"].as_u64().expect("a count") > 0);
}

#[cfg(unix)]
mod signals {
    use std::io::Read as _;
    use std::os::unix::process::ExitStatusExt as _;
    use std::time::Duration;

    use super::*;

    /// Starts a render to which a closed terminal does what is said, whatever it does to the tests.
    fn start_with(bench: &Bench, rest: &str, hang_up: libc::sighandler_t) -> std::process::Child {
        use std::os::unix::process::CommandExt as _;
        let mut command = bench.command(&render_line(rest));
        // SAFETY: setting a signal's disposition is allowed between fork and exec.
        unsafe {
            command.pre_exec(move || {
                libc::signal(libc::SIGHUP, hang_up);
                Ok(())
            });
        }
        let child = command.stderr(Stdio::piped()).spawn().expect("the binary starts");
        std::thread::sleep(Duration::from_millis(700));
        child
    }

    fn start(bench: &Bench, rest: &str) -> std::process::Child {
        start_with(bench, rest, libc::SIG_DFL)
    }

    #[test]
    fn an_interrupt_writes_the_picture_so_far() {
        let bench = Bench::new();
        bench.render("-o a.png");
        let before = fs::read(bench.path("a.png")).expect("written");
        // The first pass takes a moment, and a longer one where other tests keep all cores busy.
        let outputs = [0, 4, 20].map(Duration::from_secs).into_iter().map(|more| {
            let child = start(&bench, "-o a.png --spp 100000000 --json a.json");
            std::thread::sleep(more);
            send(&child, "-INT");
            child.wait_with_output().expect("it ends")
        });
        let too_early = |output: &Output| {
            output.status.code() == Some(130) || output.status.signal() == Some(libc::SIGINT)
        };
        let output = { outputs }.find(|output| !too_early(output)).expect("a first pass");
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(bench.json("a.json")["samples_per_pixel"].as_u64().expect("a count") > 0);
        assert!(fs::read(bench.path("a.png")).expect("written") != before);
        assert_eq!(
            bench.files(),
            ["a.json", "a.png", "map.exr", "scene.bin", "scene.gltf"],
            "no half-written file"
        );
    }

    /// The shell in it often tells its commands once more.
    #[test]
    fn a_closed_terminal_writes_the_picture_so_far_and_nohup_goes_on() {
        let bench = Bench::new();
        let outputs = [1, 4, 20].map(Duration::from_secs).into_iter().map(|more| {
            let child = start(&bench, "-o a.png --spp 100000000 --json a.json");
            std::thread::sleep(more);
            send(&child, "-HUP");
            std::thread::sleep(Duration::from_millis(60));
            // It may be done already.
            let _ = Command::new("kill").args(["-HUP", &child.id().to_string()]).output();
            child.wait_with_output().expect("it ends")
        });
        let too_early = |output: &Output| {
            output.status.code() == Some(129) || output.status.signal() == Some(libc::SIGHUP)
        };
        let output = { outputs }.find(|output| !too_early(output)).expect("a first pass");
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(bench.json("a.json")["samples_per_pixel"].as_u64().expect("a count") > 0);

        let child = start_with(&bench, "-o b.png --spp 1000000 --seconds 3", libc::SIG_IGN);
        send(&child, "-HUP");
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(text(&output.stderr).matches("stopping").count(), 0);
    }

    #[test]
    fn a_second_interrupt_leaves_at_once() {
        let bench = Bench::new();
        bench.render("-o a.png");
        let before = (bench.files(), fs::read(bench.path("a.png")).expect("written"));
        // Passes take longer than the moment between the two, after one of some seconds.
        let mut child = start(&bench, "-o a.png --size 2048x2048 --spp 100000000");
        std::thread::sleep(Duration::from_secs(8));
        send(&child, "-INT");
        let mut says = Vec::new();
        let mut stderr = BufReader::new(child.stderr.take().expect("piped"));
        for byte in stderr.by_ref().bytes() {
            says.push(byte.expect("readable"));
            if says.ends_with(b"stopping") {
                break;
            }
        }
        // SAFETY: plain system call; the child is not waited for yet.
        assert_eq!(unsafe { libc::kill(child.id() as i32, libc::SIGINT) }, 0);
        assert_eq!(child.wait().expect("it ends").code(), Some(130), "{}", text(&says));
        let after = (bench.files(), fs::read(bench.path("a.png")).expect("there"));
        assert!(after == before, "the picture from before is there, and no other file");
    }
}

#[test]
fn a_region_is_that_part_of_the_picture_and_the_background_is_the_cameras_alone() {
    let bench = Bench::new();
    let camera = "--eye 0,0.6,2.5 --target 0,0.6,0 --fov 60 --spp 64 --bounces 1";
    let render = |rest: &str, file: &str| {
        let output = bench.render(&format!("-o {file} --size 32x16 {camera} {rest}"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        read_picture(&bench.path(file)).expect("a picture")
    };
    let whole = render("--background 0.5,1,0.25", "whole.exr");
    let part = render("--background 0.5,1,0.25 --region 0,0,9,5", "part.exr");
    assert_eq!((part.width, part.height), (9, 5));
    assert_eq!(whole.at(0, 0), [0.5, 1.0, 0.25], "a corner sees past the scene");
    assert_eq!(part.at(0, 0), whole.at(0, 0));
    let map = render("--background map", "before-the-map.exr");
    assert_ne!(map.at(0, 0), whole.at(0, 0));
    // What surfaces reflect has not changed.
    let lit = (0..512).filter(|i| whole.pixels[*i] == map.pixels[*i]).count();
    assert!(lit > 8, "{lit} pixels see only surfaces");

    let says = bench.refusal(&render_line("-o a.png --size 32x16 --region 30,0,3,3"), 1);
    assert!(says.contains("not inside the picture"), "{says}");
    let says = bench.refusal(&render_line("-o a.png --background pink"), 2);
    assert!(says.contains("colour"), "{says}");
}

/// Red, green, blue and alpha of an 8-bit picture.
fn read_rgba(path: &Path) -> Vec<[u8; 4]> {
    let file = BufReader::new(fs::File::open(path).expect("written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    assert_eq!(reader.info().color_type, png::ColorType::Rgba);
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    reader.next_frame(&mut bytes).expect("pixels");
    bytes.as_chunks().0.to_vec()
}

#[test]
fn a_picture_without_a_background_is_transparent_where_nothing_is() {
    let bench = Bench::new();
    let place = "--eye 0,0.6,3 --target 0,0.4,0 --denoise off --seed 3";
    bench.render(&format!("{place} --background none -o none.png -o none.exr"));
    bench.render(&format!("{place} --background none --part 1/1 -o all.part"));
    assert!(bench.run("merge all.part -o merged.png --denoise off").status.success());
    bench.render(&format!("{place} --background map -o seen.exr"));
    let (pixels, merged) =
        (read_rgba(&bench.path("none.png")), read_rgba(&bench.path("merged.png")));
    assert_eq!(pixels, merged);
    let [seen, with_map] = ["none.exr", "seen.exr"]
        .map(|name| read_picture(&bench.path(name)).expect("written").pixels);
    let at = |x: usize, y: usize| x + 32 * y;
    let [sky, ground] = [at(3, 1), at(16, 12)];
    assert_eq!((pixels[sky][3], seen[sky]), (0, [0.0; 3]));
    assert_eq!(pixels[ground][3], 255);
    assert!(seen[ground] == with_map[ground] && seen[ground][0] > 0.0);
    assert!(pixels.iter().any(|rgba| (1..255).contains(&rgba[3])), "edges are soft");
    let exr = fs::read(bench.path("none.exr")).expect("written");
    assert!(exr.windows(3).any(|bytes| bytes == b"\0A\0"), "there is a channel A");
}

/// The same file, once where it is and once far away and a thousand times smaller.
#[test]
fn options_have_the_coordinates_of_the_file() {
    let bench = Bench::new();
    let moved = r#""nodes": [{"mesh": 0, "translation": [500000, 10, -4000000],
        "scale": [0.0009765625, 0.0009765625, 0.0009765625]}]"#;
    let far = SCENE.replace(r#""nodes": [{"mesh": 0}]"#, moved);
    assert_ne!(far, SCENE);
    fs::write(bench.path("far.gltf"), far).expect("written");
    let in_file = |p: [f64; 3]| {
        let [x, y, z] = p.map(|it| it / 1024.0);
        format!("{},{},{}", 500_000.0 + x, 10.0 + y, z - 4_000_000.0)
    };
    let (eye, target) = ([0.5, 0.6, 3.0], [0.0, 0.4, 0.0]);
    let rest = "--env map.exr --size 32x18 --spp 8 --learning-paths 500 --seed 2 --sharing off";
    let layers = "--layers depth --fov 40";
    let near = bench.run(&format!(
        "render scene.gltf {rest} {layers} --eye 0.5,0.6,3 --target 0,0.4,0 --fog 0.125 \
         --lens-radius 0.0625 --focus 2 -o near.exr"
    ));
    assert!(near.status.success(), "{}", text(&near.stderr));
    let far = bench.run(&format!(
        "render far.gltf {rest} {layers} --eye {} --target {} --fog 128 \
         --lens-radius 0.00006103515625 --focus 0.001953125 -o far.exr",
        in_file(eye),
        in_file(target)
    ));
    assert!(far.status.success(), "{}", text(&far.stderr));
    let [near, far] = ["near.exr", "far.exr"].map(|name| bench.path(name));
    let pictures = [&near, &far].map(|path| read_picture(path).expect("written").pixels);
    let is_off = |(a, b): (&[f32; 3], &[f32; 3])| (a[1] - b[1]).abs() > 0.1 * a[1];
    let off = pictures[0].iter().zip(&pictures[1]).filter(|pair| is_off(*pair)).count();
    assert!(off <= 6, "{off} of 576 pixels differ");
    let metadata = |path: &Path, key: &str| {
        let metadata = read_exr_metadata(path).expect("written");
        let value = metadata.into_iter().find(|(name, _)| name == key).expect("it is there").1;
        serde_json::from_str::<Value>(&value).expect("JSON")
    };
    let found = metadata(&far, "lightgrid.eye");
    for (axis, (center, eye)) in [500_000.0, 10.0, -4_000_000.0].into_iter().zip(eye).enumerate() {
        let found = found[axis].as_f64().expect("a number");
        assert!((found - center - eye / 1024.0).abs() < 1e-8, "{axis}: {found}");
    }
    assert_eq!(metadata(&far, "lightgrid.fog")["scattering"][0], 128.0);
}

/// As `| head` does.
#[test]
fn a_reader_who_has_seen_enough_is_no_reason_to_panic() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lightgrid"))
        .args(["completions", "bash"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    let says = String::from_utf8_lossy(&output.stderr);
    assert!(!says.contains("panicked"), "{says}");
}

/// Lamps are dimmed, coloured and switched off by name, and light adds up.
#[test]
fn lamps_are_changed_by_name() {
    let bench = Bench::new();
    let lit = SCENE.replace(
        r#"{"mesh": 0}"#,
        r#"{"mesh": 0}, {"translation": [0, 2, 0], "name": "key", "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"translation": [1, 2, 1], "extensions": {"KHR_lights_punctual": {"light": 1}}}"#,
    );
    let lit = lit.replace(r#""nodes": [0]"#, r#""nodes": [0, 1, 2]"#).replacen(
        r#""asset""#,
        r#""extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 8}, {"type": "point", "name": "fill:warm", "intensity": 4}]}}, "asset""#,
        1,
    );
    fs::write(bench.path("lit.gltf"), lit).expect("written");
    let line = |rest: &str| {
        format!(
            "render lit.gltf --eye 0,3,3 --target 0,0,0 --env-intensity 0 --size 16x16 --spp 256 {rest}"
        )
    };
    let mean = |rest: &str| {
        let output = bench.run(&line(&format!("{rest} -o a.exr --json a.json")));
        assert!(output.status.success(), "{rest}: {}", text(&output.stderr));
        let picture = read_picture(&bench.path("a.exr")).expect("a picture");
        [0, 2].map(|c| picture.pixels.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>())
    };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    let [all, _] = mean("");
    let [fill, blue] = mean("--lamp key:off");
    near(fill, blue);
    let [key, _] = mean("--lamp fill:warm:off");
    near(key + fill, all);
    let [dimmed, blue] = mean("--lamp fill:warm:off --lamp key:factor=0.5,color=#ff0000");
    near(2.0 * dimmed, key);
    assert_eq!(blue, 0.0);
    let settings = &bench.json("a.json")["settings"]["lamp_edits"];
    assert_eq!(settings[1], "key:factor=0.5,color=#ff0000");
    let says = bench.refusal(&line("-o b.exr --lamp rim:off"), 1);
    assert!(says.contains("no lamp is called \"rim\"; there are fill:warm, key"), "{says}");
    let says = bench.refusal("render office -o b.exr --lamp rim:off", 1);
    assert!(says.contains("no lamp is called \"rim\"; there are none"), "{says}");
    let says = bench.refusal("render evening -o b.exr --lamp rim:off", 1);
    assert!(says.contains("there are bright bulb, bulb, lampshade"), "{says}");
    let says = bench.refusal(&line("-o b.exr --lamp key:watts=3"), 2);
    assert!(says.contains("watts is not factor, color or off"), "{says}");
}

/// Groups of light are layers that add up to the picture.
#[test]
fn light_groups_add_up_in_layers() {
    let bench = Bench::new();
    let line = "render evening --size 64x36 --device cpu --light-groups";
    let output = bench.run(&format!("{line} --spp 2 -o g.exr -o g.png"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let read = |name: &str| {
        let image = exr::prelude::read_all_flat_layers_from_file(bench.path(name)).expect("read");
        let mut channels = std::collections::BTreeMap::new();
        for layer in image.layer_data {
            let before =
                layer.attributes.layer_name.map_or(String::new(), |name| format!("{name}."));
            for channel in layer.channel_data.list {
                let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
                channels.insert(format!("{before}{}", channel.name), values);
            }
        }
        channels
    };
    let groups = ["light.sky", "light.sun", "lamp.bright bulb", "lamp.bulb", "lamp.lampshade"];
    let adds_up = |name: &str| {
        let channels = read(name);
        for color in ["R", "G", "B"] {
            let of =
                |index: usize| groups.map(|group| channels[&format!("{group}.{color}")][index]);
            for (index, whole) in channels[color].iter().enumerate() {
                let sum: f32 = of(index).iter().sum();
                let near = (sum - whole).abs() <= 1e-5 * whole.max(1e-3);
                assert!(near, "{name} {index}: {sum} {whole}");
            }
        }
        channels
    };
    let channels = adds_up("g.exr");
    for group in groups {
        assert!(channels[&format!("{group}.R")].iter().any(|x| *x > 0.0), "{group}");
    }
    // Where time is too short for all pixels, no group's light is lost.
    let output = bench.run(&format!("{line} --seconds 0.001 -o h.exr"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    adds_up("h.exr");
    let says = text(&bench.run(&format!("{line} --spp 1 -o i.png")).stderr).to_owned();
    assert!(says.contains("--light-groups adds nothing"), "{says}");
    bench.refusal(&format!("{line} --part 1/2 -o a.part"), 2);
}
