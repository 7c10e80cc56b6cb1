//! A desk of its own for a real window.

use std::ffi::OsStr;
use std::ops::Range;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lightgrid::image::{Image, read_exr_metadata, read_picture};

/// An X server without a screen, and a window of ours in it.
pub(super) struct Desk {
    /// Pixels of the screen, which the window fills.
    width: usize,
    height: usize,
    server: Child,
    pub(super) window: Option<Child>,
    display: String,
    /// What the window is called by the server.
    pub(super) id: String,
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
    /// One of 1100x760 pixels. `None`, said on stderr, where Xvfb or xdotool is not installed.
    pub(super) fn open() -> Option<Self> {
        Self::of_size(1100, 760)
    }

    /// One of so many pixels, as [`Self::open`].
    pub(super) fn of_size(width: usize, height: usize) -> Option<Self> {
        let is_there = |tool: &str| {
            let which = Command::new("which").arg(tool).stdout(Stdio::null()).status();
            which.is_ok_and(|status| status.success())
        };
        if let Some(tool) = ["Xvfb", "xdotool"].into_iter().find(|tool| !is_there(tool)) {
            eprintln!("SKIPPED: {tool} is not installed");
            return None;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let screen = format!("{width}x{height}x24");
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
        let (window, id) = (None, String::new());
        let desk = Self { width, height, server, window, display, id, folder };
        // It has been seen to refuse the first connection when all cores are busy. (Nor does it take any
        // while it starts anew after its last client, if it may.)
        desk.wait_for("display", || (!desk.xdotool("getdisplaygeometry").is_empty()).then_some(()));
        Some(desk)
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Starts the program and waits until its window shows its buttons and has the keyboard.
    pub(super) fn start(&mut self, line: &str) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
        command.current_dir(self.folder.path()).args(line.split_whitespace());
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        // No file dialogue of the desktop that this runs on: of no portal, and of no program. Of those there is
        // what may be put into a folder.
        command.env("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nowhere");
        command.env("PATH", self.path("programs"));
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

    pub(super) fn xdotool(&self, line: &str) -> String {
        let output = Command::new("xdotool")
            .args(line.split_whitespace())
            .env("DISPLAY", &self.display)
            .output()
            .expect("xdotool starts");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    pub(super) fn title(&self) -> String {
        self.xdotool(&format!("getwindowname {}", self.id))
    }

    pub(super) fn says(&self) -> String {
        std::fs::read_to_string(self.path("says.txt")).unwrap_or_default()
    }

    /// Mean level, 0 to 255, of the corner with the first buttons, which are always there.
    fn brightness(&self) -> f64 {
        let levels = self.levels(0..270, 0..36);
        let brightest = levels.chunks_exact(3).map(|p| f64::from(p[0].max(p[1]).max(p[2])));
        brightest.sum::<f64>() / (levels.len() / 3) as f64
    }

    /// The levels of a part of the screen.
    pub(super) fn levels(&self, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
        let file = std::fs::read(self.path("Xvfb_screen0")).expect("the server's screen");
        let screen = &file[file.len() - 4 * self.width * self.height..];
        let rows = screen.chunks_exact(4 * self.width).skip(rows.start).take(rows.len());
        let pixels = rows.flat_map(|row| row[4 * columns.start..4 * columns.end].chunks_exact(4));
        pixels.flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    }

    /// Waits for something for at most ten minutes: software draws a frame in seconds when other
    /// tests keep all cores busy.
    pub(super) fn wait_for<T>(&self, what: &str, mut ready: impl FnMut() -> Option<T>) -> T {
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
    pub(super) fn answer(&self, key: &str, path: &str) {
        self.answer_and(key, path, "key Return");
    }

    /// Types a path into the prompt that a key opens, and what ends that.
    pub(super) fn answer_and(&self, key: &str, path: &str, end: &str) {
        let level = self.ask(key);
        self.type_anew(path);
        self.xdotool(end);
        self.wait_for("end of the prompt", || self.is_answered(level).then_some(()));
    }

    /// Opens the prompt of a key, and waits for it: what is typed before is not meant for it. An open prompt darkens
    /// what is behind it; how bright that was.
    pub(super) fn ask(&self, key: &str) -> f64 {
        let level = self.brightness();
        self.xdotool(&format!("key {key}"));
        self.wait_for("prompt", || (self.brightness() < 0.8 * level).then_some(()));
        level
    }

    /// Types in the place of what is in the prompt.
    pub(super) fn type_anew(&self, path: &str) {
        self.xdotool("key ctrl+a");
        self.xdotool(&format!("type --delay 20 {path}"));
    }

    /// Whether there is no prompt any more, before which it was so bright.
    pub(super) fn is_answered(&self, level: f64) -> bool {
        self.brightness() > 0.9 * level
    }

    /// Waits for the end that was asked for, which is to be a good one.
    pub(super) fn ends(&mut self) {
        let mut child = self.window.take().expect("started");
        let status = self.wait_for("end", || child.try_wait().expect("asked"));
        assert!(status.success(), "{}", self.says());
        assert!(!self.says().contains("panicked"), "{}", self.says());
    }

    /// Drags with the left button, in steps with pauses between them.
    pub(super) fn drag(&self, (x, y): (i32, i32), (dx, dy): (i32, i32), pause: Duration) {
        self.xdotool(&format!("mousemove {x} {y} mousedown 1"));
        for _ in 0..10 {
            std::thread::sleep(pause);
            self.xdotool(&format!("mousemove_relative -- {} {}", dx / 10, dy / 10));
        }
        self.xdotool("mouseup 1");
    }

    /// The levels of the middle of the picture on the screen.
    pub(super) fn picture(&self) -> Vec<u8> {
        self.levels(300..self.width - 320, 150..self.height - 190)
    }

    /// Where the system tells of the program.
    fn process(&self) -> PathBuf {
        let id = self.window.as_ref().expect("started").id();
        format!("/proc/{id}").into()
    }

    /// Megabytes of memory that the program has; none where the system does not tell.
    pub(super) fn megabytes(&self) -> Option<f64> {
        let status = std::fs::read_to_string(self.process().join("status")).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        Some(line.trim().trim_end_matches(" kB").parse::<f64>().ok()? / 1024.0)
    }

    /// Seconds that the program has been at work, all cores together; none where the system does not tell.
    pub(super) fn work(&self) -> Option<f64> {
        seconds(&std::fs::read_to_string(self.process().join("stat")).ok()?)
    }

    /// Seconds of those that it has spent on showing what there is: preparing pictures, and drawing with software.
    pub(super) fn work_for_showing(&self) -> Option<f64> {
        let process = self.process();
        let shows = |name: &str, thread: &OsStr| {
            let is_windows = process.file_name() == Some(thread);
            is_windows || name.starts_with("present") || name.starts_with("llvmpipe")
        };
        let of_thread = |path: PathBuf| {
            let stat = std::fs::read_to_string(path.join("stat")).ok()?;
            let name = stat.split_once('(')?.1.rsplit_once(')')?.0;
            shows(name, path.file_name()?).then(|| seconds(&stat)).flatten()
        };
        let threads = std::fs::read_dir(process.join("task")).ok()?;
        Some(threads.filter_map(|entry| of_thread(entry.ok()?.path())).sum())
    }

    /// Saves a picture and waits until it is there.
    pub(super) fn save(&self, name: &str) -> Image {
        let path = self.path(name);
        self.answer("ctrl+s", name);
        self.wait_for(name, || path.exists().then(|| read_picture(&path).expect("a picture")))
    }

    /// Saves pictures until one is as it should be; it is gone then, so that there can be another of its name.
    pub(super) fn save_until<T>(
        &self,
        what: &str,
        mut ready: impl FnMut(&Image, &dyn Fn(&str) -> String) -> Option<T>,
    ) -> T {
        self.wait_for(what, || {
            let image = self.save("now.exr");
            let found = ready(&image, &|key| self.metadata("now.exr", key).expect("it is said"));
            std::fs::remove_file(self.path("now.exr")).expect("removed");
            found
        })
    }

    /// Stops that a saved `.png` was developed with.
    pub(super) fn exposure_ev(&self, name: &str) -> f32 {
        let bytes = std::fs::read(self.path(name)).expect("a picture");
        let text = String::from_utf8_lossy(&bytes);
        let (_, said) = text.split_once("lightgrid.exposure_ev\0").expect("the stops");
        let said = said.trim_start_matches('\0');
        let is_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
        let end = said.find(|c| !is_number(c)).expect("an end");
        said[..end].parse().expect("a number")
    }

    /// What a picture's file says of a key.
    pub(super) fn metadata(&self, name: &str, key: &str) -> Option<String> {
        let metadata = read_exr_metadata(&self.path(name)).expect("metadata");
        let key = format!("lightgrid.{key}");
        metadata.into_iter().find(|(k, _)| *k == key).map(|(_, value)| value)
    }
}

/// Seconds at work that the system tells of a program or a thread (`man 5 proc_pid_stat`).
fn seconds(stat: &str) -> Option<f64> {
    let (_, numbers) = stat.rsplit_once(')')?;
    let ticks = numbers.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    Some(ticks.sum::<Result<f64, _>>().ok()? / 100.0)
}
