//! A real window under Xvfb.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lightgrid::app::document::Viewpoint;
use lightgrid::app::settings_file::{SceneViewpoints, Settings};
use lightgrid::image::read_picture;
use lightgrid::scene::builtin;
use lightgrid::tone::auto_exposure_ev;

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
            .args([
                "-displayfd",
                "1",
                "-noreset",
                "-screen",
                "0",
                &screen,
                "-nolisten",
                "tcp",
                "-fbdir",
            ])
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
        let desk = Self { server, window: None, display, id: String::new(), folder };
        // It has been seen to refuse the first connection when all cores are busy. (Nor does it take any
        // while it starts anew after its last client, if it may.)
        desk.wait_for("display", || (!desk.xdotool("getdisplaygeometry").is_empty()).then_some(()));
        Some(desk)
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
        let mut window = command.spawn().expect("the binary starts");
        self.id = self.wait_for("window", || {
            let ended = window.try_wait().expect("asked");
            assert!(ended.is_none(), "it ends with {ended:?}: {}", self.says());
            let found = self.xdotool("search --onlyvisible --name lightgrid");
            found.lines().next().map(str::to_owned).filter(|id| !id.is_empty())
        });
        self.window = Some(window);
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

    /// Types a path into the prompt that a key opens, which takes it.
    fn answer(&self, key: &str, path: &str) {
        self.answer_and(key, path, "key Return");
    }

    /// Types a path into the prompt that a key opens, and what ends that. An open prompt darkens what is
    /// behind it; what is typed before is not meant for it.
    fn answer_and(&self, key: &str, path: &str, end: &str) {
        let level = self.brightness();
        self.xdotool(&format!("key {key}"));
        self.wait_for("prompt", || (self.brightness() < 0.8 * level).then_some(()));
        self.xdotool("key ctrl+a");
        self.xdotool(&format!("type --delay 20 {path}"));
        self.xdotool(end);
        self.wait_for("end of the prompt", || (self.brightness() > 0.9 * level).then_some(()));
    }

    /// Drags with the left button, in steps with pauses between them.
    fn drag(&self, (x, y): (i32, i32), (dx, dy): (i32, i32), pause: Duration) {
        self.xdotool(&format!("mousemove {x} {y} mousedown 1"));
        for _ in 0..10 {
            std::thread::sleep(pause);
            self.xdotool(&format!("mousemove_relative -- {} {}", dx / 10, dy / 10));
        }
        self.xdotool("mouseup 1");
    }

    /// The levels of the middle of the picture on the screen.
    fn picture(&self) -> Vec<u8> {
        let file = std::fs::read(self.path("Xvfb_screen0")).expect("the server's screen");
        let screen = &file[file.len() - 4 * Self::WIDTH * Self::HEIGHT..];
        let rows = screen.chunks_exact(4 * Self::WIDTH).skip(150).take(420);
        let columns = rows.flat_map(|row| row[4 * 300..4 * 780].chunks_exact(4));
        columns.flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    }

    /// Seconds that the program has been at work, all cores together; none where the system does not tell.
    fn work(&self) -> Option<f64> {
        let id = self.window.as_ref().expect("started").id();
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        let (_, numbers) = stat.rsplit_once(')')?;
        let ticks = numbers.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
        Some(ticks.sum::<Result<f64, _>>().ok()? / 100.0)
    }

    /// What is shown every half second, and the work done by then, until nothing has changed for a while: it
    /// is done then.
    fn watch(&self) -> Vec<(Vec<u8>, Option<f64>)> {
        let mut shown: Vec<(Vec<u8>, Option<f64>)> = Vec::new();
        let mut unchanged = 0;
        while unchanged < 20 || shown.len() < 30 {
            std::thread::sleep(Duration::from_millis(500));
            let now = (self.picture(), self.work());
            let is_same = shown.last().is_some_and(|(picture, _)| *picture == now.0);
            unchanged = if is_same { unchanged + 1 } else { 0 };
            shown.push(now);
            assert!(shown.len() < 1200, "it never ends");
        }
        shown.truncate(shown.len() - unchanged);
        shown
    }

    /// Saves a picture and waits until it is there.
    fn save(&self, name: &str) -> lightgrid::image::Image {
        let path = self.path(name);
        self.answer("ctrl+s", name);
        self.wait_for(name, || path.exists().then(|| read_picture(&path).expect("a picture")))
    }

    /// Stops that a saved `.png` was developed with.
    fn exposure_ev(&self, name: &str) -> f32 {
        let bytes = std::fs::read(self.path(name)).expect("a picture");
        let text = String::from_utf8_lossy(&bytes);
        let (_, said) = text.split_once("lightgrid.exposure_ev\0").expect("the stops");
        let said = said.trim_start_matches('\0');
        let is_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
        let end = said.find(|c| !is_number(c)).expect("an end");
        said[..end].parse().expect("a number")
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

    // A file that is not there changes nothing: the path can be mended, or the camera still be turned.
    desk.answer_and("ctrl+o", "none.glb", "key --delay 300 Return Escape");
    desk.wait_for("old scene", || desk.title().starts_with("open").then_some(()));

    // A drag turns the camera: another picture. It is taken back, also after the list of keys was open.
    desk.drag((560, 400), (-120, 20), Duration::ZERO);
    desk.wait_for("turned picture", || {
        let turned = desk.save("turned.exr");
        std::fs::remove_file(desk.path("turned.exr")).expect("removed");
        (first.pixels != turned.pixels).then_some(())
    });
    desk.xdotool("key question");
    desk.xdotool("key Escape");
    desk.xdotool("key ctrl+z");
    desk.wait_for("first camera", || {
        desk.save("again.exr");
        let eye = desk.metadata("again.exr", "eye");
        std::fs::remove_file(desk.path("again.exr")).expect("removed");
        (eye == of("eye")).then_some(())
    });

    // A part of it, marked by a drag so fast that it may fall into one frame; then the whole again.
    desk.xdotool("key x");
    desk.drag((450, 300), (150, 120), Duration::ZERO);
    desk.wait_for("part", || {
        let part = desk.save("part.exr");
        std::fs::remove_file(desk.path("part.exr")).expect("removed");
        (part.width < 60 && part.height < 50).then_some(())
    });
    // It is as bright as it was in the whole, whatever it would need by itself.
    let whole_ev = auto_exposure_ev(&first);
    let part = desk.save("part.exr");
    desk.save("part.png");
    let (own_ev, shown_ev) = (auto_exposure_ev(&part), desk.exposure_ev("part.png"));
    assert!((own_ev - whole_ev).abs() > 0.3, "a part like the whole: {own_ev} {whole_ev}");
    assert!((shown_ev - whole_ev).abs() < 0.2, "{shown_ev} in place of {whole_ev}");
    desk.xdotool("key x");

    // A file, which then is written anew and read again.
    triangle(&desk.path("room.gltf"), 1.0);
    desk.answer("ctrl+o", "room.gltf");
    desk.wait_for("file", || desk.title().starts_with("room.gltf").then_some(()));
    let large = desk.wait_for("triangle", || {
        let picture = desk.save("large.exr");
        let scene = desk.metadata("large.exr", "scene");
        std::fs::remove_file(desk.path("large.exr")).expect("removed");
        (scene.as_deref() == Some("room.gltf")).then_some(picture)
    });
    triangle(&desk.path("room.gltf"), 0.3);
    desk.xdotool("key F5");
    desk.wait_for("small triangle", || {
        let small = desk.save("small.exr");
        std::fs::remove_file(desk.path("small.exr")).expect("removed");
        (small.pixels != large.pixels).then_some(())
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

#[test]
fn a_window_whose_size_changes_keeps_the_gpu_that_renders() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start("view open --env sky:day@64x32 --size 96x64 --device gpu --settings window.json");
    let device = |name: &str| {
        desk.save(name);
        let device = desk.metadata(name, "device");
        std::fs::remove_file(desk.path(name)).expect("removed");
        device.filter(|device| device != "CPU")
    };
    desk.wait_for("picture from the GPU", || device("gpu.exr"));
    // Each has its surface made anew, while the GPU has work to do.
    for step in 0..12 {
        let (width, height) = (1000 - 20 * step, 700 - 10 * step);
        desk.xdotool(&format!("windowsize --sync {} {width} {height}", desk.id));
        std::thread::sleep(Duration::from_millis(150));
    }
    assert!(device("resized.exr").is_some(), "{}", desk.says());
}

#[test]
fn a_scene_shown_in_place_of_a_damaged_one_keeps_its_viewpoints() {
    let Some(mut desk) = Desk::open() else { return };
    std::fs::write(desk.path("bad.gltf"), "{").expect("written");
    let bad = std::path::absolute(desk.path("bad.gltf")).expect("a path");
    let view = |name: &str| {
        let camera = &builtin::build("office").expect("built in").cameras[0];
        Viewpoint { name: name.to_owned(), ..Viewpoint::of(camera, 3.0) }
    };
    let viewpoints =
        [("living-room", "a"), (bad.to_str().expect("text"), "b")].map(|(scene, name)| {
            SceneViewpoints { scene: scene.to_owned(), viewpoints: vec![view(name)] }
        });
    let settings = Settings { viewpoints: viewpoints.to_vec(), ..Settings::default() };
    settings.write(&desk.path("w.json")).expect("written");
    desk.start("view bad.gltf --size 96x64 --samples 1 --device cpu --settings w.json");
    desk.wait_for("scene", || desk.title().starts_with("living-room").then_some(()));
    desk.xdotool("key ctrl+q");
    let mut child = desk.window.take().expect("started");
    let status = desk.wait_for("end", || child.try_wait().expect("asked"));
    assert!(status.success(), "{}", desk.says());
    let kept = Settings::read(&desk.path("w.json")).expect("read").viewpoints;
    assert_eq!(kept, viewpoints);
}

/// Writes a scene of one triangle so large.
fn triangle(path: &Path, size: f32) {
    let corners = [[-size, -size, 0.0], [size, -size, 0.0], [0.0, size, 0.0]];
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(path.with_extension("bin"), bytes).expect("written");
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}], "scene": 0,
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [-{size}, -{size}, 0], "max": [{size}, {size}, 0]}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "buffers": [{{"uri": "room.bin", "byteLength": 36}}]}}"#
    );
    std::fs::write(path, text).expect("written");
}

/// Mean squared difference of levels.
fn error(a: &[u8], b: &[u8]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    sum / a.len() as f64
}

/// What is on the screen only gets better, and does not stand still while work goes on.
#[test]
fn the_picture_on_the_screen_never_gets_worse() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view office --env sky:day@256x128 --size 240x160 --samples 32 --device cpu --settings window.json",
    );
    check(&desk, "at the start").unwrap_or_else(|why| panic!("{why}"));
    // Where frames take a second it may have seemed to end under way; not twice.
    let moved = |way| {
        desk.drag((560, 400), way, Duration::from_millis(50));
        check(&desk, "after a move")
    };
    if let Err(why) = moved((60, 10)) {
        println!("once more: {why}");
        moved((-60, 10)).unwrap_or_else(|why| panic!("{why}"));
    }
}

/// Whether what is shown until the picture is done only gets better and never stands still.
fn check(desk: &Desk, when: &str) -> Result<(), String> {
    let shown = desk.watch();
    let (last, _) = shown.last().expect("something is shown");
    let errors: Vec<f64> = shown.iter().map(|(picture, _)| error(picture, last).sqrt()).collect();
    println!("{when}: {errors:.2?}");
    let first = errors[0];
    if !errors.iter().any(|error| *error < 0.5 * first) {
        return Err(format!("{when}: it got no better: {errors:.2?}"));
    }
    for (at, pair) in errors.windows(2).enumerate() {
        // Two per cent, and a fifth of a level for rounding.
        if pair[1] > 1.02 * pair[0] + 0.2 {
            return Err(format!("{when}: worse at {at}: {errors:.2?}"));
        }
    }
    // How long a picture is shown depends on how long it took: what counts is its share of the work, for at
    // least three seconds of clock. Without a clock of work, that of frames will do.
    let worked: Option<Vec<f64>> = shown.iter().map(|(_, work)| *work).collect();
    let works = worked.unwrap_or_else(|| (0..shown.len()).map(|at| at as f64).collect());
    let all = works[works.len() - 1] - works[0];
    if all <= 0.0 {
        return Err(format!("{when}: nothing is done"));
    }
    let is_begun = |at: usize| when != "at the start" || error(&shown[at].0, &shown[0].0) > 0.0;
    for begin in (0..shown.len()).filter(|at| is_begun(*at)) {
        let same = shown[begin..].iter().take_while(|(picture, _)| *picture == shown[begin].0);
        let end = begin + same.count() - 1;
        let share = (works[end] - works[begin]) / all;
        let stands = end - begin >= 6 && share > MOST_OF_THE_WORK;
        if stands {
            return Err(format!("{when}: the picture stands still, {share:.2}: {errors:.2?}"));
        }
    }
    Ok(())
}

/// Share of the work that may pass without another picture.
const MOST_OF_THE_WORK: f64 = 0.4;

#[cfg(unix)]
#[test]
fn a_request_to_end_closes_a_window_as_a_person_would() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view open --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings w.json",
    );
    let mut child = desk.window.take().expect("started");
    crate::cli::send(&child, "-TERM");
    let status = desk.wait_for("end", || child.try_wait().expect("asked"));
    assert!(status.success(), "{}", desk.says());
    assert!(desk.path("w.json").exists(), "the settings are kept");
}
