//! What one window leaves for the next.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::document::{Document, Light, Look, PictureSize, Viewpoint};
use super::interface::{Dock, Interface, Tab};
use crate::error::{At as _, Result};
use crate::image::{read_file, write_beside_and_rename};
use crate::path::PathLimits;
use crate::render::{StopRule, View};
use crate::sources;
use crate::tone::{KELVIN, TINT};

/// Recent files kept.
const MAX_RECENT: usize = 8;
/// Scenes whose viewpoints are kept.
const MAX_SCENES: usize = 100;

/// What was kept of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneViewpoints {
    /// Its file, or what it is called if it is built in.
    pub scene: String,
    /// Viewpoints, oldest first.
    pub viewpoints: Vec<Viewpoint>,
}

with_defaults! {
    /// Kept settings; what a file does not say stays at its default.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Settings {
        /// Scene files, latest first.
        pub recent_scenes: Vec<String> = Vec::new(),
        /// Map files, latest first.
        pub recent_maps: Vec<String> = Vec::new(),
        /// Kept viewpoints, by scene, that changed last first.
        pub viewpoints: Vec<SceneViewpoints> = Vec::new(),
        /// Where pictures were written last.
        pub save_folder: Option<PathBuf> = None,
        /// Size of the window in points.
        pub window_size: [f32; 2] = [1440.0, 900.0],
        /// How the picture is developed.
        pub look: Look = Look::default(),
        /// How light is found.
        pub light: Light = Light::default(),
        /// Size of the picture.
        pub size: PictureSize = Document::default().size,
        /// When to stop.
        pub stop: StopRule = Document::default().stop,
        /// Whether scene and map are read again when another program has written them.
        pub reloads: bool = true,
        /// What the right panel shows.
        pub tab: Tab = Tab::Picture,
        /// What is open below the picture.
        pub dock: Option<Dock> = None,
    }
}

impl Settings {
    /// Where they are kept: under the user's folder for configuration; `None` if there is none.
    pub fn default_path() -> Option<PathBuf> {
        Some(user_folder(CONFIG)?.join("window.json"))
    }

    /// Where kept pictures are: beside a settings file that was named, else under the user's folder for
    /// data; `None` if there is none.
    pub fn pictures_folder(file: Option<&Path>) -> Option<PathBuf> {
        let usual = || Some(user_folder(DATA)?.join("pictures"));
        file.map(|file| file.with_added_extension("pictures")).or_else(usual)
    }

    /// Where small pictures of maps are: beside a settings file that was named, else under the user's folder for
    /// what can be made again; `None` if there is none.
    pub fn small_maps_folder(file: Option<&Path>) -> Option<PathBuf> {
        let usual = || Some(user_folder(CACHE)?.join("maps"));
        file.map(|file| file.with_added_extension("maps")).or_else(usual)
    }

    /// Reads them; a file that is not there gives the defaults.
    ///
    /// # Errors
    /// If the file is there but cannot be read or understood.
    pub fn read(path: &Path) -> Result<Self> {
        let understood = |bytes: Vec<u8>| {
            let settings = serde_json::from_slice(&bytes).map(Self::within_bounds);
            settings.map_err(|e| format!("settings not understood: {e}"))
        };
        match std::fs::metadata(path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            _ => read_file(path).and_then(understood).at(path),
        }
    }

    /// Reads them; of a file that cannot be understood, what can be. It will be overwritten one day, so
    /// it is kept beside as `.bak`, which the second value says.
    pub fn recover(path: &Path) -> (Self, Option<String>) {
        let failure = match Self::read(path) {
            Ok(settings) => return (settings, None),
            Err(failure) => failure,
        };
        let aside = path.with_added_extension("bak");
        let notice = match std::fs::copy(path, &aside) {
            Ok(_) => format!("{failure}; it is kept as {}", aside.display()),
            Err(error) => format!("{failure}; it cannot be kept aside: {error}"),
        };
        let found = read_file(path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let settings = found.and_then(|found: Value| {
            let mut whole = serde_json::to_value(Self::default()).ok()?;
            take_over(&mut whole, "", &found);
            serde_json::from_value(whole).ok()
        });
        (settings.map(Self::within_bounds).unwrap_or_default(), Some(notice))
    }

    /// Values a window can work with: a file that was edited or damaged may hold anything.
    fn within_bounds(mut self) -> Self {
        let default = Self::default();
        let is_possible = |pixels: u64| (1..=View::MAX_PIXELS).contains(&pixels);
        self.size = match self.size {
            PictureSize::Viewport(divisor) => PictureSize::Viewport(divisor.clamp(1, 64)),
            PictureSize::Fixed(w, h) if is_possible(u64::from(w) * u64::from(h)) => self.size,
            PictureSize::Fixed(..) => default.size,
        };
        for (side, usual) in self.window_size.iter_mut().zip(default.window_size) {
            *side = if side.is_finite() { side.clamp(1.0, 16_384.0) } else { usual };
        }
        let finite = |x: f32, usual: f32| if x.is_finite() { x } else { usual };
        self.viewpoints.iter_mut().for_each(|of| of.viewpoints.retain(Viewpoint::is_sound));
        let (look, usual) = (&mut self.look, &default.look);
        look.exposure_ev = finite(look.exposure_ev, usual.exposure_ev).clamp(-64.0, 64.0);
        look.lut_strength = finite(look.lut_strength, usual.lut_strength).clamp(0.0, 1.0);
        let (balance, usual) = (&mut look.white_balance, &usual.white_balance);
        balance.kelvin = finite(balance.kelvin, usual.kelvin).clamp(*KELVIN.start(), *KELVIN.end());
        balance.tint = finite(balance.tint, usual.tint).clamp(*TINT.start(), *TINT.end());
        self.light.bounces = self.light.bounces.min(PathLimits::MAX_BOUNCES);
        let positive = |x: &f64| *x > 0.0 && x.is_finite();
        self.stop.seconds = self.stop.seconds.filter(positive);
        self.stop.noise = self.stop.noise.filter(positive);
        self.stop.samples = self.stop.samples.filter(|samples| *samples > 0);
        self
    }

    /// Writes them, making the folder if need be.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).at(folder)?;
        }
        let text = crate::output::record::to_json(self)?;
        write_beside_and_rename(path, |file| writeln!(file, "{text}"))
    }

    /// The document a new window starts from.
    pub fn document(&self) -> Document {
        let Self { look, light, size, stop, .. } = self.clone();
        Document { look, light, size, stop, ..Document::default() }
    }

    /// Takes over what was changed in a window since it was opened with `start`: what the command line
    /// said was for that window alone.
    pub fn remember(&mut self, document: &Document, start: &Document, interface: &Interface) {
        let shared = |of: &Document| {
            let Document { look, light, size, stop, .. } = of.clone();
            serde_json::to_value(Self { look, light, size, stop, ..Self::default() })
        };
        let values = shared(start).and_then(|before| Ok((before, shared(document)?)));
        if let (Ok((before, now)), Ok(mut kept)) = (values, serde_json::to_value(&*self)) {
            take_changes(&mut kept, &before, &now);
            *self = Self::deserialize(kept).unwrap_or_else(|_| self.clone());
        }
        self.tab = interface.tab;
        self.dock = interface.dock;
    }

    /// Takes over the lists that a window began with as `before` and left as `after`: another window may have
    /// changed these here meanwhile.
    pub(super) fn take_lists(&mut self, before: &Self, after: &Self) {
        let lists = [
            (&mut self.recent_scenes, &before.recent_scenes, &after.recent_scenes),
            (&mut self.recent_maps, &before.recent_maps, &after.recent_maps),
        ];
        for (kept, before, after) in lists {
            // What this window opened came to the front; the rest is what it found, in its order.
            let is_rest = |rest: &[String]| {
                let mut found = before.iter();
                rest.iter().all(|name| found.any(|other| other == name))
            };
            let opened = (0..after.len()).find(|count| is_rest(&after[*count..]));
            let opened = &after[..opened.unwrap_or(after.len())];
            opened.iter().rev().for_each(|name| put_first(kept, name));
        }
        if after.save_folder != before.save_folder {
            self.save_folder.clone_from(&after.save_folder);
        }
        for of in after.viewpoints.iter().rev().chain(&before.viewpoints) {
            let (then, now) = (before.viewpoints_of(&of.scene), after.viewpoints_of(&of.scene));
            let mut kept = self.viewpoints_of(&of.scene);
            kept.retain(|view| now.contains(view) || !then.contains(view));
            for view in now {
                if !(then.contains(&view) || kept.contains(&view)) {
                    kept.push(view);
                }
            }
            self.set_viewpoints(&of.scene, &kept);
        }
    }

    /// Takes over the viewpoints that a document has of its scene.
    pub(super) fn keep_viewpoints(&mut self, document: &Document) {
        self.set_viewpoints(&document.scene, &document.bookmarks);
    }

    fn set_viewpoints(&mut self, scene: &str, viewpoints: &[Viewpoint]) {
        if self.viewpoints_of(scene) == viewpoints {
            return;
        }
        let scene = lasting_scene(scene);
        self.viewpoints.retain(|other| other.scene != scene);
        if !viewpoints.is_empty() {
            let viewpoints = viewpoints.to_vec();
            self.viewpoints.insert(0, SceneViewpoints { scene, viewpoints });
            self.viewpoints.truncate(MAX_SCENES);
        }
    }

    /// The viewpoints that were kept of a scene.
    pub fn viewpoints_of(&self, scene: &str) -> Vec<Viewpoint> {
        let scene = lasting_scene(scene);
        let kept = self.viewpoints.iter().find(|kept| kept.scene == scene);
        kept.map(|kept| kept.viewpoints.clone()).unwrap_or_default()
    }

    /// Notes a scene that was opened; built-in ones are always offered.
    pub fn recent_scene(&mut self, name: &str) {
        if !sources::is_built_in_scene(name) {
            put_first(&mut self.recent_scenes, &lasting(name));
        }
    }

    /// Notes a map that was opened; built-in skies are always offered.
    pub fn recent_map(&mut self, name: &str) {
        if !sources::is_built_in_map(name) {
            put_first(&mut self.recent_maps, &lasting(name));
        }
    }
}

/// A path that means the same in another folder.
pub(super) fn lasting(path: &str) -> String {
    let absolute = || std::path::absolute(path).ok()?.to_str().map(str::to_owned);
    absolute().unwrap_or_else(|| path.to_owned())
}

/// The same for a scene, which may be built in.
pub(super) fn lasting_scene(name: &str) -> String {
    if sources::is_built_in_scene(name) { name.to_owned() } else { lasting(name) }
}

/// The same for a map.
pub(super) fn lasting_map(name: &str) -> String {
    if sources::is_built_in_map(name) { name.to_owned() } else { lasting(name) }
}

/// Kinds of the user's folders: the variable that names one and the one below the home folder where it is not set, that
/// on macOS, and the variable on Windows, where companies copy `APPDATA` over the network at each log-in.
const CONFIG: [&str; 4] = ["XDG_CONFIG_HOME", ".config", "Library/Application Support", "APPDATA"];
const DATA: [&str; 4] =
    ["XDG_DATA_HOME", ".local/share", "Library/Application Support", "LOCALAPPDATA"];
const CACHE: [&str; 4] = ["XDG_CACHE_HOME", ".cache", "Library/Caches", "LOCALAPPDATA"];

/// lightgrid's folder in one of the user's; `None` if there is none.
fn user_folder([variable, folder, on_macos, on_windows]: [&str; 4]) -> Option<PathBuf> {
    let named = |variable: &str| std::env::var_os(variable).map(PathBuf::from);
    let of_home = |folder: &str| named("HOME").map(|home| home.join(folder));
    let folder = if cfg!(windows) {
        named(on_windows)
    } else if cfg!(target_os = "macos") {
        of_home(on_macos)
    } else {
        named(variable).filter(|path| path.is_absolute()).or_else(|| of_home(folder))
    };
    Some(folder?.join("lightgrid"))
}

/// Whether what a document shares with the settings are values a window can work with.
pub(super) fn is_within_bounds(document: &Document) -> bool {
    let Document { look, light, size, stop, .. } = document.clone();
    let settings = Settings { look, light, size, stop, ..Settings::default() };
    settings == settings.clone().within_bounds()
}

/// Sets what differs between two values of one kind, field by field.
fn take_changes(kept: &mut Value, before: &Value, now: &Value) {
    match (&mut *kept, before, now) {
        _ if before == now => {}
        // Of a choice with fields, another one is taken whole.
        (Value::Object(kept), Value::Object(before), Value::Object(now))
            if before.keys().eq(now.keys()) && kept.keys().eq(now.keys()) =>
        {
            for (key, field) in kept {
                take_changes(field, &before[key], &now[key]);
            }
        }
        _ => kept.clone_from(now),
    }
}

/// Sets what of `found` fits into the settings below a place in them, field by field.
fn take_over(whole: &mut Value, place: &str, found: &Value) {
    for (key, value) in found.as_object().into_iter().flatten() {
        let place = format!("{place}/{key}");
        let Some(field) = whole.pointer_mut(&place) else { continue };
        let before = std::mem::replace(field, value.clone());
        if Settings::deserialize(&*whole).is_err() {
            if let Some(field) = whole.pointer_mut(&place) {
                *field = before;
            }
            take_over(whole, &place, value);
        }
    }
}

fn put_first(list: &mut Vec<String>, name: &str) {
    list.retain(|other| other != name);
    list.insert(0, name.to_owned());
    list.truncate(MAX_RECENT);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_command_line_said_is_not_kept_and_what_was_changed_is() {
        let mut settings = Settings::default();
        let mut document = settings.document();
        (document.stop.samples, document.look.curve) = (Some(2), crate::tone::ToneCurve::Aces);
        document.light.sampling = crate::render::Sampling::Plain;
        let start = document.clone();
        document.light.bounces = 3;
        (document.look.exposure_ev, document.stop.noise) = (1.0, Some(0.1));
        document.size = PictureSize::Fixed(64, 32);
        settings.remember(&document, &start, &Interface::default());
        let mut expected = Settings::default();
        (expected.light.bounces, expected.look.exposure_ev) = (3, 1.0);
        (expected.stop.noise, expected.size) = (Some(0.1), PictureSize::Fixed(64, 32));
        assert_eq!(settings, expected);
    }

    #[test]
    fn viewpoints_are_kept_of_each_scene() {
        let view = |name: &str| {
            let camera = &crate::scene::builtin::build("office").expect("built in").cameras[0];
            Viewpoint { name: name.to_owned(), ..Viewpoint::of(camera, 3.0) }
        };
        let document = |scene: &str, names: &[&str]| Document {
            scene: scene.to_owned(),
            bookmarks: names.iter().map(|name| view(name)).collect(),
            ..Document::default()
        };
        let mut settings = Settings::default();
        settings.keep_viewpoints(&document("office", &["a", "b"]));
        settings.keep_viewpoints(&document("room.glb", &["c"]));
        settings.keep_viewpoints(&document("crack", &[]));
        let text = serde_json::to_string(&settings).expect("written");
        let mut settings = serde_json::from_str::<Settings>(&text).expect("read").within_bounds();
        assert_eq!(settings.viewpoints_of("office"), [view("a"), view("b")]);
        assert_eq!(settings.viewpoints_of("./room.glb"), [view("c")]);
        assert_eq!(settings.viewpoints.len(), 2);
        settings.keep_viewpoints(&document("office", &[]));
        assert_eq!(settings.viewpoints_of("office"), []);
        settings.viewpoints[0].viewpoints[0].lens_radius = f32::NAN;
        assert_eq!(settings.within_bounds().viewpoints_of("room.glb"), []);
    }

    #[test]
    fn two_windows_keep_what_each_has_brought() {
        let lists = |recent: &[&str], views: &[(&str, &str)]| {
            let mut settings = Settings::default();
            recent.iter().rev().for_each(|name| settings.recent_map(name));
            for (scene, name) in views {
                let camera = &crate::scene::builtin::build("office").expect("built in").cameras[0];
                let view = Viewpoint { name: (*name).to_owned(), ..Viewpoint::of(camera, 3.0) };
                settings.set_viewpoints(scene, &[view]);
            }
            settings
        };
        let before = lists(&["/a.hdr", "/b.hdr"], &[("crack", "old")]);
        let mut kept = before.clone();
        let first = lists(&["/c.hdr", "/a.hdr", "/b.hdr"], &[("crack", "old"), ("office", "desk")]);
        let second = lists(&["/b.hdr", "/a.hdr"], &[("open", "hill")]);
        kept.take_lists(&before, &first);
        kept.take_lists(&before, &second);
        assert_eq!(kept.recent_maps, ["/b.hdr", "/c.hdr", "/a.hdr"].map(lasting));
        let names = |scene: &str| kept.viewpoints_of(scene).into_iter().map(|view| view.name);
        assert!(names("office").eq(["desk"]) && names("open").eq(["hill"]));
        assert_eq!(names("crack").len(), 0, "the second has forgotten it");
        // What one has kept meanwhile is no longer there if it takes it back.
        let mut kept = first.clone();
        kept.take_lists(&first, &before);
        assert!(kept.viewpoints_of("office").is_empty());
    }

    #[test]
    fn settings_read_back_and_old_files_are_understood() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("deep/window.json");
        assert_eq!(Settings::read(&path), Ok(Settings::default()));
        let mut settings = Settings { window_size: [800.0, 600.0], ..Settings::default() };
        settings.stop.noise = Some(0.05);
        for i in 0..20 {
            settings.recent_map(&format!("{i}.hdr"));
        }
        settings.recent_scene("office");
        settings.write(&path).expect("written");
        let again = Settings::read(&path).expect("read");
        assert_eq!(again, settings);
        assert_eq!((again.recent_maps.len(), &again.recent_maps[0]), (8, &lasting("19.hdr")));
        assert!(again.recent_scenes.is_empty());
        std::fs::write(&path, r#"{"window_size": [1, 2], "gone": 3}"#).expect("written");
        assert_eq!(Settings::read(&path).expect("read").window_size, [1.0, 2.0]);
        std::fs::write(&path, "{").expect("written");
        assert!(Settings::read(&path).expect_err("broken").to_string().contains("window.json"));
    }

    #[test]
    fn what_is_understood_of_a_damaged_file_is_used_and_the_file_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("window.json");
        let text = r#"{"recent_maps": ["a.hdr"], "window_size": "large", "tab": 7,
            "look": {"exposure_ev": 2.5, "curve": "gone"}, "stop": {"noise": 0.25, "samples": -1}}"#;
        std::fs::write(&path, text).expect("written");
        let (settings, notice) = Settings::recover(&path);
        let usual = Settings::default();
        assert_eq!(settings.recent_maps, ["a.hdr"]);
        assert_eq!((settings.window_size, settings.tab), (usual.window_size, usual.tab));
        assert_eq!((settings.look.exposure_ev, settings.look.curve), (2.5, usual.look.curve));
        assert_eq!((settings.stop.noise, settings.stop.samples), (Some(0.25), usual.stop.samples));
        assert!(notice.expect("it is said").contains("window.json.bak"));
        let kept = std::fs::read_to_string(folder.path().join("window.json.bak"));
        assert_eq!(kept.expect("kept"), text);
        std::fs::write(&path, "{\"recent_maps\": [").expect("written");
        assert_eq!(Settings::recover(&path).0, usual);
        settings.write(&path).expect("written");
        assert_eq!(Settings::recover(&path), (settings, None));
    }
}
