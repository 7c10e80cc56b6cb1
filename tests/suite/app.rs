//! The window's content, drawn offscreen against kept pictures.

use std::ops::Range;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use glam::{Vec2, Vec3};
use lightgrid::app::Start;
use lightgrid::app::document::{Document, Light, Look, PictureSize};
use lightgrid::app::final_render::{FinalRender, Motion};
use lightgrid::app::interface::{Dock, Interface, Tab, TileView};
use lightgrid::app::overlays::Overlay;
use lightgrid::app::screenshot::Studio;
use lightgrid::image::{Rgb8, read_picture, write_png};
use lightgrid::render::StopRule;
use lightgrid::render::gpu::DeviceChoice;
use lightgrid::scene::{MaterialEdit, builtin};

/// Mean absolute difference of 8-bit levels that a snapshot may have: drivers and processors differ
/// in rounding, and samples of a path tracer with them.
const MEAN_ERROR: f64 = 2.5;

fn start() -> Start {
    let defaults = Document::default();
    let document = Document {
        light: Light { device: DeviceChoice::Cpu, ..defaults.light },
        // Less depends on the very random numbers, and the files are smaller.
        look: Look { denoise: true, ..defaults.look },
        scene: "office".to_owned(),
        map: "sky:day@256x128".to_owned(),
        size: PictureSize::Fixed(180, 120),
        stop: StopRule { samples: Some(4), ..StopRule::default() },
        ..defaults
    };
    Start { document, ..Start::default() }
}

fn studio(start: Start, size: (u32, u32)) -> Option<Studio> {
    match Studio::open(start, size, Duration::from_secs(3000)) {
        Ok(studio) => Some(studio),
        Err(error) => {
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}

/// Every overlay and panel of one picture, and the kept picture it must look like.
#[test]
fn overlays_and_panels_look_as_they_did() {
    let Some(mut studio) = studio(start(), (1000, 640)) else { return };
    let base = Interface::default();
    let inspect = Interface { tab: Tab::Inspect, ..base.clone() };
    let mut states = vec![
        ("panel-picture".to_owned(), base.clone()),
        ("panel-inspect".to_owned(), inspect.clone()),
        ("panel-needs".to_owned(), Interface { dock: Some(Dock::Needs), ..base.clone() }),
        (
            "panel-convergence".to_owned(),
            Interface { dock: Some(Dock::Convergence), ..inspect.clone() },
        ),
        (
            "panel-tiles-learned".to_owned(),
            Interface { tiles: TileView::Learned, ..inspect.clone() },
        ),
        ("panel-shortcuts".to_owned(), Interface { shortcuts: true, ..base.clone() }),
        ("panel-none".to_owned(), Interface { panels: false, ..base }),
    ];
    // Without a reference it is said what is missing.
    for overlay in Overlay::ALL {
        let name = format!("overlay-{}", overlay.title().to_lowercase().replace([' ', '\''], "-"));
        let state = Interface { overlay: Some(overlay), tile: Some(48), ..inspect.clone() };
        states.push((name, state));
    }
    // The sun's, which no cell sees.
    let state = Interface { overlay: Some(Overlay::Tile), tile: Some(41), ..inspect };
    states.push(("overlay-probability-of-a-hidden-tile".to_owned(), state));
    let mut different = Vec::new();
    let mut pictures: Vec<Rgb8> = Vec::new();
    for (name, interface) in states {
        studio.arrange(interface);
        let picture = studio.take().expect("drawn");
        if let Err(why) = compare(&name, &picture) {
            different.push(why);
        }
        assert!(!pictures.contains(&picture), "{name} looks like another state");
        pictures.push(picture);
    }
    assert!(different.is_empty(), "{different:#?}");
}

/// The walls painted red, their panel, and the room without them.
#[test]
fn a_material_is_changed_and_hidden() {
    let office = builtin::build("office").expect("built in");
    let number = office.materials.iter().position(|material| material.name == "wall");
    let number = number.expect("it has walls") as u32;
    let with = |edit: MaterialEdit| {
        let mut start = start();
        start.document.materials = [(number, edit)].into();
        start
    };
    let red = Some(Vec3::new(0.8, 0.05, 0.04));
    let painted = with(MaterialEdit { color: red, ..MaterialEdit::default() });
    let Some(mut studio) = studio(painted, (1000, 1000)) else { return };
    let panel = Interface { material: Some(number), ..Interface::default() };
    studio.arrange(panel.clone());
    let picture = studio.take().expect("drawn");
    compare("panel-material", &picture).expect("as it was");
    let hidden = with(MaterialEdit { hidden: true, ..MaterialEdit::default() });
    let mut studio = self::studio(hidden, (1000, 1000)).expect("as before");
    studio.arrange(panel);
    let without = studio.take().expect("drawn");
    compare("panel-material-hidden", &without).expect("as it was");
}

/// What is rendered into a file has a size of its own, and a camera that may turn.
#[test]
fn a_final_render_is_set_up() {
    let Some(mut studio) = studio(start(), (1000, 1000)) else { return };
    let final_render = FinalRender { motion: Motion::Orbit, ..FinalRender::default() };
    studio.arrange(Interface { final_render, ..Interface::default() });
    compare("panel-final-render", &studio.take().expect("drawn")).expect("as it was");
}

/// Where there is no room for two panels, the right one has what is in the left one elsewhere.
#[test]
fn a_small_window_has_one_panel() {
    let Some(mut studio) = studio(start(), (720, 480)) else { return };
    for (name, tab) in [("small-picture", Tab::Picture), ("small-scene", Tab::Scene)] {
        studio.arrange(Interface { tab, ..Interface::default() });
        compare(name, &studio.take().expect("drawn")).expect("as it was");
    }
    studio.arrange(Interface::default());
    studio.choose_material("wall").expect("the office has it");
    compare("small-material", &studio.take().expect("drawn"))
        .expect("its settings come into sight");
    let error = studio.choose_material("ivory").expect_err("the office has none").to_string();
    assert!(error.contains("office: no material is called \"ivory\"; there are "), "{error}");
}

/// On twice the pixels all lies where it did, and the picture has four times as many.
#[test]
fn a_screen_with_small_pixels_shows_the_same_with_more_of_them() {
    let of_viewport = || {
        let mut start = start();
        start.document.scene = "open".to_owned();
        start.document.size = PictureSize::Viewport(4);
        start.document.stop.samples = Some(1);
        start.document.look.denoise = false;
        start
    };
    let Some(mut studio) = studio(of_viewport(), (1000, 650)) else { return };
    let usual = studio.take().expect("drawn");
    let [width, height] = studio.picture_size().expect("rendered");
    let mut studio = self::studio(of_viewport(), (2000, 1300)).expect("as before").at_scale(2.0);
    let fine = studio.take().expect("drawn");
    let size = studio.picture_size().expect("rendered");
    let is_twice = |fine: u32, usual: u32| fine.abs_diff(2 * usual) <= 2;
    assert!(is_twice(size[0], width) && is_twice(size[1], height), "{size:?}, {width}x{height}");
    // Letters fall on pixels in another way, which is hardly seen in pixels of four points. Two of them would be.
    let (usual, fine) = (shrunk(&shrunk(&usual)), shrunk(&shrunk(&shrunk(&fine))));
    for columns in [0..61, 177..247] {
        let apart = |by| panels_apart(&usual, &fine, columns.clone(), by);
        let (found, displaced) = (apart(0), apart(2));
        println!("columns {columns:?}: {found:.2}; {displaced:.2} where they are displaced");
        assert!(found < 0.35 * displaced, "{columns:?}: {found} of {displaced}");
    }
}

/// Mean absolute difference of 8-bit levels between columns of one picture and those of another that lie so much
/// further to the right, above the line below.
fn panels_apart(a: &Rgb8, b: &Rgb8, columns: Range<u32>, by: u32) -> f64 {
    let at = |of: &Rgb8, x: u32, y: u32| of.pixels[(y * of.width + x) as usize];
    let pixels = (0..150).flat_map(|y| columns.clone().map(move |x| (x, y)));
    let apart: Vec<u64> = pixels
        .flat_map(|(x, y)| {
            let (a, b) = (at(a, x, y), at(b, x + by, y));
            [0, 1, 2].map(|c| u64::from(a[c].abs_diff(b[c])))
        })
        .collect();
    apart.iter().sum::<u64>() as f64 / apart.len() as f64
}

/// What a cell knows and what is true there, in a window high enough for both.
#[test]
fn the_inspector_shows_distribution_and_truth() {
    let Some(mut studio) = studio(start(), (1000, 1200)) else { return };
    let pinned = Some(Vec2::new(0.45, 0.75));
    studio.arrange(Interface { tab: Tab::Inspect, pinned, ..Interface::default() });
    let before = studio.take().expect("drawn");
    studio.measure_truth().expect("measured");
    let picture = studio.take().expect("drawn");
    assert_ne!(before, picture, "the truth is shown");
    compare("panel-inspect-truth", &picture).expect("as it was");
}

/// The reference that a window renders shows the same as a render on the command line with other random numbers.
#[test]
fn a_reference_is_rendered_beside_the_window() {
    let mut start = start();
    start.program = env!("CARGO_BIN_EXE_lightgrid").into();
    start.document.scene = "open".to_owned();
    start.document.size = PictureSize::Fixed(48, 32);
    let Some(mut studio) = studio(start, (800, 500)) else { return };
    let reference = studio.render_reference().expect("rendered");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.exr");
    let line = "render open --env sky:day@256x128 --size 48x32 --spp 256 --device cpu -o";
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
    let status = command.args(line.split_whitespace()).arg(&file).status().expect("started");
    assert!(status.success());
    let rendered = read_picture(&file).expect("written");
    assert_eq!((reference.width, reference.height), (48, 32));
    assert!(reference != rendered, "random numbers differ");
    let error = lightgrid::metrics::relative_rms_error(&rendered, &reference).expect("same size");
    assert!(error < 0.1, "{error}");
    // Against it the picture is not equal everywhere, and it is said how far apart they are.
    let overlay = |overlay| Interface { overlay, tab: Tab::Inspect, ..Interface::default() };
    studio.arrange(overlay(Some(Overlay::Areas)));
    let areas = studio.take().expect("drawn");
    studio.arrange(overlay(Some(Overlay::Flip)));
    let differences = studio.take().expect("drawn");
    assert!(areas != differences);
    // Another size cannot be compared.
    let other = folder.path().join("other.exr");
    let line = "render open --size 24x16 --spp 1 --device cpu -o";
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
    let status = command.args(line.split_whitespace()).arg(&other).status().expect("started");
    assert!(status.success());
    let said = studio.open_reference(&other.display().to_string()).expect_err("smaller");
    let sizes = "it has 24 x 16 pixels, the picture in the window 48 x 32";
    assert!(said.to_string().contains(sizes), "{said}");
    studio.arrange(overlay(None));
    let without = studio.take().expect("drawn");
    assert!(without != differences);
}

/// What was known after each pass of learning is shown again.
#[test]
fn learning_is_stepped_through() {
    let Some(mut studio) = studio(start(), (1000, 640)) else { return };
    let state = Interface {
        tab: Tab::Inspect,
        overlay: Some(Overlay::Learned),
        tiles: TileView::Learned,
        ..Interface::default()
    };
    let take = |step: Option<usize>| {
        studio.arrange(state.clone());
        step.into_iter().for_each(|step| studio.show_learning_step(step).expect("there is one"));
        studio.take().expect("drawn")
    };
    let pictures = [Some(1), Some(4), Some(7), None].map(take);
    let learned = |picture: &Rgb8| {
        let is_own = |[r, g, b]: &&[u8; 3]| *g > *r && *g > *b;
        picture.pixels.iter().filter(is_own).count()
    };
    let [first, middle, last, now] = &pictures;
    assert!(learned(first) < learned(middle) && learned(middle) < learned(last), "more is known");
    assert!(last != now, "the slider says so");
    let said = studio.show_learning_step(8).expect_err("there is none").to_string();
    assert!(said.contains("there is no learning step 8: it has 8, counted from 0"), "{said}");
}

/// A driver that resets takes the device with it; the window goes on with another, and nothing of
/// the picture is lost.
#[test]
fn a_lost_device_is_replaced_and_shows_the_same() {
    let Some(mut studio) = studio(start(), (800, 500)) else { return };
    let before = studio.take().expect("drawn");
    studio.lose_device();
    let after = studio.take().expect("drawn on another device");
    assert_ne!(before, after, "the loss is said");
    // Until the notice has gone.
    for _ in 0..8 {
        studio.take().expect("drawn");
    }
    assert!(before == studio.take().expect("drawn"), "the same again");
}

/// The renderer loses the device that it shares with the window: the CPU goes on.
#[test]
fn a_device_lost_while_it_renders_is_said_and_the_cpu_goes_on() {
    let mut start = start();
    start.document.light.device = DeviceChoice::Gpu;
    start.document.scene = "open".to_owned();
    start.document.size = PictureSize::Fixed(48, 32);
    let Some(mut studio) = studio(start, (800, 500)) else { return };
    studio.take().expect("drawn");
    studio.lose_device();
    studio.arrange(Interface { run: 1, ..Interface::default() });
    let said = studio.take().expect_err("a screenshot is of no use then").to_string();
    assert!(said.ends_with("the CPU renders"), "{said}");
    assert!(studio.is_on_cpu(), "the settings say so too");
}

/// Compares with `tests/snapshots/NAME.png`; with UPDATE_SNAPSHOTS set, writes it instead.
fn compare(name: &str, picture: &Rgb8) -> Result<(), String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    let path = folder.join(format!("{name}.png"));
    let small = shrunk(picture);
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        std::fs::create_dir_all(&folder).expect("a folder");
        write_png(&path, &small, None, &[]).expect("written");
        return Ok(());
    }
    let kept = image::open(&path).map_err(|e| format!("{name}: {e}"))?.into_rgb8();
    if kept.dimensions() != (small.width, small.height) {
        return Err(format!("{name}: the size changed from {:?}", kept.dimensions()));
    }
    let sum: u64 = kept
        .as_raw()
        .iter()
        .zip(small.pixels.as_flattened())
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    let mean = sum as f64 / kept.as_raw().len() as f64;
    if mean > MEAN_ERROR {
        let now = std::env::temp_dir().join(format!("lightgrid-{name}.png"));
        write_png(&now, &small, None, &[]).expect("written");
        return Err(format!("{name}: mean error {mean:.2}, see {}", now.display()));
    }
    Ok(())
}

/// Half the size, each pixel the mean of four: snapshots are kept small.
fn shrunk(picture: &Rgb8) -> Rgb8 {
    let (width, height) = (picture.width / 2, picture.height / 2);
    let at = |x: u32, y: u32| picture.pixels[(y * picture.width + x) as usize];
    let pixels = (0..width * height)
        .map(|i| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            std::array::from_fn(|c| (four.iter().map(|p| u32::from(p[c])).sum::<u32>() / 4) as u8)
        })
        .collect();
    Rgb8 { width, height, pixels }
}

#[test]
fn a_screenshot_is_repeatable_and_says_what_is_wrong() {
    let folder = tempfile::tempdir().expect("a folder");
    let shoot = |rest: &str| {
        let size = if rest.contains("--size") { "" } else { "--size 640x400" };
        let line =
            format!("screenshot crack --env sky:day@64x32 {size} --samples 1 {rest} -o a.png");
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
        let output = command.current_dir(folder.path()).args(line.split_whitespace()).output();
        output.expect("the binary starts")
    };
    let says = |output: &std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let first = shoot("--overlay cells");
    if says(&first).contains("no graphics device") {
        eprintln!("SKIPPED: {}", says(&first));
        return;
    }
    assert!(first.status.success(), "{}", says(&first));
    let path = folder.path().join("a.png");
    let one = std::fs::read(&path).expect("written");
    assert!(shoot("--overlay cells").status.success());
    assert_eq!(one, std::fs::read(&path).expect("written"), "the same again");
    assert!(shoot("--overlay cells --seed 1").status.success());
    assert_ne!(one, std::fs::read(&path).expect("written"));
    let missing = Command::new(env!("CARGO_BIN_EXE_lightgrid"))
        .current_dir(folder.path())
        .args("screenshot none.glb --size 640x400 -o a.png".split_whitespace())
        .output()
        .expect("the binary starts");
    assert_eq!(missing.status.code(), Some(1));
    assert!(says(&missing).contains("none.glb: there is no such file"), "{}", says(&missing));
    for (rest, reason) in [
        ("--tile 99999", "sky:day@64x32: there is no tile 99999: it has 128, counted from 0"),
        ("--size 200000x10", "a window of 200000x10 pixels cannot be drawn: "),
        ("--overlay visits --sampling plain", "--sampling plain learns nothing that"),
        ("--overlay tile", "the overlay of a tile wants one: --tile N"),
        ("--panel none --panel needs", "--panel none and other panels exclude each other"),
        ("--overlay cache-cells", "overlays of it need --denoise, and no --split"),
        (
            "--overlay cache-samples --denoise --split",
            "the radiance cache is trained for cached light",
        ),
    ] {
        let refused = shoot(rest);
        assert_eq!(refused.status.code(), Some(1), "{}", says(&refused));
        assert!(says(&refused).contains(reason), "{}", says(&refused));
    }
}

#[test]
#[cfg_attr(windows, ignore = "Windows always has a display")]
fn without_a_display_the_picture_is_rendered_into_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    // The second is lit by the first: a map in the place of a scene, as file managers hand it over.
    for (what, file) in
        [("crack --env sky:day@64x32", "lightgrid.png"), ("lightgrid.png -o lit.png", "lit.png")]
    {
        std::fs::write(folder.path().join("settings.json"), "garbage").expect("written");
        let line = format!("view {what} --size 32x18 --samples 1 --settings settings.json");
        let output = Command::new(env!("CARGO_BIN_EXE_lightgrid"))
            .current_dir(folder.path())
            .args(line.split_whitespace())
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .output()
            .expect("the binary starts");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        if cfg!(target_os = "linux") {
            assert!(output.status.success(), "{message}");
            assert!(message.contains("no window can be opened"), "{message}");
            assert!(message.contains(&format!("; rendering into {file} instead")), "{message}");
            assert!(!message.contains(".;"), "{message}");
            assert!(message.contains("settings.json.bak"), "{message}");
            let picture = read_picture(&folder.path().join(file)).expect("a picture");
            assert_eq!((picture.width, picture.height), (32, 18));
        }
    }
}
