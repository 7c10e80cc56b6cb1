//! The window: its content drawn offscreen against kept pictures, and a real window under Xvfb.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use glam::Vec2;
use lightgrid::app::Start;
use lightgrid::app::document::{Document, Light, Look, PictureSize};
use lightgrid::app::interface::{Dock, Interface, Tab, TileView};
use lightgrid::app::overlays::Overlay;
use lightgrid::app::screenshot::{Shot, Studio};
use lightgrid::image::{Rgb8, read_picture, write_png};
use lightgrid::render::StopRule;
use lightgrid::render::gpu::DeviceChoice;

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
    let shot = Shot { start, size, patience: Duration::from_secs(300) };
    match Studio::open(shot) {
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
        (
            "panel-tiles-equal-energy".to_owned(),
            Interface { tiles: TileView::EqualEnergy, ..inspect.clone() },
        ),
        ("panel-shortcuts".to_owned(), Interface { shortcuts: true, ..base.clone() }),
        ("panel-none".to_owned(), Interface { panels: false, ..base }),
    ];
    for overlay in Overlay::ALL {
        let name = format!("overlay-{}", overlay.title().to_lowercase().replace([' ', '\''], "-"));
        let state = Interface { overlay: Some(overlay), tile: Some(48), ..inspect.clone() };
        states.push((name, state));
    }
    // The sun's, which no cell sees.
    let state = Interface { overlay: Some(Overlay::Tile), tile: Some(41), ..inspect };
    states.push(("overlay-wish-for-a-hidden-tile".to_owned(), state));
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

/// What a cell knows and what is true there, in a window high enough for both.
#[test]
fn the_inspector_shows_law_and_truth() {
    let Some(mut studio) = studio(start(), (1000, 1200)) else { return };
    let pinned = Some(Vec2::new(0.45, 0.75));
    studio.arrange(Interface { tab: Tab::Inspect, pinned, ..Interface::default() });
    let before = studio.take().expect("drawn");
    studio.measure_truth().expect("measured");
    let picture = studio.take().expect("drawn");
    assert_ne!(before, picture, "the truth is shown");
    compare("panel-inspect-truth", &picture).expect("as it was");
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
        write_png(&path, &small, &[]).expect("written");
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
        write_png(&now, &small, &[]).expect("written");
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
        let line = format!(
            "screenshot crack --env sky:day@64x32 --size 640x400 --samples 1 {rest} -o a.png"
        );
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
}

#[test]
fn without_a_display_the_picture_is_rendered_into_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_lightgrid"))
        .current_dir(folder.path())
        .args("view crack --env sky:day@64x32 --size 32x18 --samples 1".split_whitespace())
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    if cfg!(target_os = "linux") {
        assert!(output.status.success(), "{message}");
        assert!(message.contains("no window can be opened"), "{message}");
        assert!(message.contains("rendering into lightgrid.png instead"), "{message}");
        let picture = read_picture(&folder.path().join("lightgrid.png")).expect("a picture");
        assert_eq!((picture.width, picture.height), (32, 18));
    }
}

/// An X server without a screen, and a window of ours in it.
struct Desk {
    server: Child,
    window: Option<Child>,
    display: String,
    /// What the window is called by the server.
    id: String,
    folder: tempfile::TempDir,
}

impl Drop for Desk {
    fn drop(&mut self) {
        for child in self.window.iter_mut().chain([&mut self.server]) {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Desk {
    const WIDTH: usize = 1100;
    const HEIGHT: usize = 760;

    /// `None`, said on stderr, where Xvfb or xdotool is not installed.
    fn open() -> Option<Self> {
        let is_there = |tool: &str| {
            let which = Command::new("which").arg(tool).stdout(Stdio::null()).status();
            which.is_ok_and(|status| status.success())
        };
        if let Some(tool) = ["Xvfb", "xdotool"].into_iter().find(|tool| !is_there(tool)) {
            eprintln!("SKIPPED: {tool} is not installed");
            return None;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let screen = format!("{}x{}x24", Self::WIDTH, Self::HEIGHT);
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-fbdir"])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("piped");
        std::io::BufRead::read_line(&mut std::io::BufReader::new(stdout), &mut number)
            .expect("Xvfb says its display");
        let display = format!(":{}", number.trim());
        Some(Self { server, window: None, display, id: String::new(), folder })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Starts the program and waits until its window shows its buttons and has the keyboard.
    fn start(&mut self, line: &str) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
        command.current_dir(self.folder.path()).args(line.split_whitespace());
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        command.stderr(std::fs::File::create(self.path("says.txt")).expect("a file"));
        self.window = Some(command.spawn().expect("the binary starts"));
        self.id = self.wait_for("window", || {
            let found = self.xdotool("search --onlyvisible --name lightgrid");
            found.lines().next().map(str::to_owned).filter(|id| !id.is_empty())
        });
        self.xdotool(&format!("windowfocus {}", self.id));
        self.wait_for("buttons", || (self.brightness() > 8.0).then_some(()));
    }

    fn xdotool(&self, line: &str) -> String {
        let output = Command::new("xdotool")
            .args(line.split_whitespace())
            .env("DISPLAY", &self.display)
            .output()
            .expect("xdotool starts");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    fn title(&self) -> String {
        self.xdotool(&format!("getwindowname {}", self.id))
    }

    fn says(&self) -> String {
        std::fs::read_to_string(self.path("says.txt")).unwrap_or_default()
    }

    /// Mean level, 0 to 255, of the corner with the first buttons, which are always there.
    fn brightness(&self) -> f64 {
        let (width, height) = (270, 36);
        let file = std::fs::read(self.path("Xvfb_screen0")).expect("the server's screen");
        let screen = &file[file.len() - 4 * Self::WIDTH * Self::HEIGHT..];
        let rows = screen.chunks_exact(4 * Self::WIDTH).take(height);
        let pixels = rows.flat_map(|row| row[..4 * width].chunks_exact(4));
        pixels.map(|p| f64::from(p[0].max(p[1]).max(p[2]))).sum::<f64>() / (width * height) as f64
    }

    /// Waits for something for at most ten minutes: software draws a frame in seconds when other
    /// tests keep all cores busy.
    fn wait_for<T>(&self, what: &str, mut ready: impl FnMut() -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(it) = ready() {
                return it;
            }
            assert!(start.elapsed() < Duration::from_secs(600), "no {what}: {}", self.says());
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Types a path into the prompt that a key opens. An open prompt darkens what is behind it;
    /// what is typed before is not meant for it.
    fn answer(&self, key: &str, path: &str) {
        let level = self.brightness();
        self.xdotool(&format!("key {key}"));
        self.wait_for("prompt", || (self.brightness() < 0.8 * level).then_some(()));
        self.xdotool("key ctrl+a");
        self.xdotool(&format!("type --delay 20 {path}"));
        self.xdotool("key Return");
        self.wait_for("end of the prompt", || (self.brightness() > 0.9 * level).then_some(()));
    }

    /// Saves a picture and waits until it is there.
    fn save(&self, name: &str) -> lightgrid::image::Image {
        let path = self.path(name);
        self.answer("ctrl+s", name);
        self.wait_for(name, || path.exists().then(|| read_picture(&path).expect("a picture")))
    }

    /// What a picture's file says of a key.
    fn metadata(&self, name: &str, key: &str) -> Option<String> {
        let metadata = lightgrid::image::read_exr_metadata(&self.path(name)).expect("metadata");
        let key = format!("lightgrid.{key}");
        metadata.into_iter().find(|(k, _)| *k == key).map(|(_, value)| value)
    }
}

#[test]
fn a_real_window_moves_opens_saves_and_remembers() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start("view open --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings window.json");
    let first = desk.save("first.exr");
    assert_eq!((first.width, first.height), (96, 64));
    let of = |key: &str| desk.metadata("first.exr", key);
    assert_eq!(of("scene").as_deref(), Some("open"));
    assert_eq!(of("sampling").as_deref(), Some("adaptive"));
    assert_eq!(of("device").as_deref(), Some("CPU"));

    // The other device goes on; software Vulkan takes seconds to compile for it.
    desk.xdotool("key g");
    desk.xdotool("key r");
    desk.wait_for("picture from the GPU", || {
        desk.save("gpu.exr");
        let device = desk.metadata("gpu.exr", "device");
        std::fs::remove_file(desk.path("gpu.exr")).expect("removed");
        device.filter(|name| name != "CPU")
    });
    desk.xdotool("key g");

    // A file that is not there changes nothing: the camera can still be turned.
    desk.answer("ctrl+o", "none.glb");
    desk.wait_for("old scene", || desk.title().starts_with("open").then_some(()));

    // A drag turns the camera: another picture. The slower the machine, the longer the drag has to
    // be: what happens within a frame is a click.
    let mut pause = Duration::from_millis(150);
    desk.wait_for("turned picture", || {
        desk.xdotool("mousemove 560 400 mousedown 1");
        for _ in 0..10 {
            std::thread::sleep(pause);
            desk.xdotool("mousemove_relative -- -12 2");
        }
        desk.xdotool("mouseup 1");
        pause *= 2;
        let turned = desk.save("turned.exr");
        std::fs::remove_file(desk.path("turned.exr")).expect("removed");
        (first.pixels != turned.pixels).then_some(())
    });

    // Another scene.
    desk.answer("ctrl+o", "crack");
    desk.wait_for("new scene", || desk.title().starts_with("crack").then_some(()));
    desk.save("crack.png");

    desk.xdotool("key ctrl+q");
    let mut child = desk.window.take().expect("started");
    let status = desk.wait_for("end", || child.try_wait().expect("asked"));
    assert!(status.success(), "{}", desk.says());
    assert!(!desk.says().contains("panicked"), "{}", desk.says());
    let settings = std::fs::read_to_string(desk.path("window.json")).expect("settings");
    assert!(settings.contains("window_size"), "{settings}");
}

#[cfg(unix)]
#[test]
fn a_request_to_end_closes_a_window_as_a_person_would() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view open --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings w.json",
    );
    let mut child = desk.window.take().expect("started");
    let kill = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(kill.expect("kill is there").success());
    let status = desk.wait_for("end", || child.try_wait().expect("asked"));
    assert!(status.success(), "{}", desk.says());
    assert!(desk.path("w.json").exists(), "the settings are kept");
}
