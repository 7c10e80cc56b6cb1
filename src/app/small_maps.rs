//! Small pictures of maps, by which they are recognised in lists: kept in a folder for the next window.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use egui::{Context, TextureHandle, TextureOptions};

use super::dropped::is_map;
use super::screen::color_image;
use super::settings_file::lasting_map;
use crate::digest::Digest;
use crate::environment::sky;
use crate::image::ldr::decode_ldr;
use crate::image::{Image, Rgb8, read_file, read_map, write_png};
use crate::tone::{ToneCurve, auto_exposure_ev, display_rgb8};

/// Width in pixels; they are half as high.
const WIDTH: u32 = 96;
/// Most files kept.
const MAX_FILES: usize = 512;
/// Most maps of a folder that are listed.
const MAX_LISTED: usize = 256;
/// Larger files, in bytes, are not read for a small picture alone.
const MAX_READ: u64 = 200 << 20;

/// Small pictures that have been read or made.
#[derive(Default)]
pub(super) struct SmallMapsFound {
    /// Maps' lasting names and they in small.
    maps: Vec<(String, Rgb8)>,
    /// All maps of the folder of the map that was opened, if one was.
    listed: Option<Vec<String>>,
    /// Whether these were made for [`SmallMaps::make_next`].
    are_next: bool,
}

/// Small pictures of maps on the device, by their lasting names.
#[derive(Default)]
pub(super) struct SmallMaps {
    folder: Option<PathBuf>,
    pub(super) textures: BTreeMap<String, TextureHandle>,
    /// Maps in the folder of the one that was opened last.
    listed: Vec<String>,
    /// Maps of which a picture was tried to be made.
    tried: BTreeSet<String>,
    /// Whether one is being made.
    pub(super) is_busy: bool,
}

impl SmallMaps {
    /// None yet; `folder` is where they are kept, if anywhere.
    pub(super) fn new(folder: Option<PathBuf>) -> Self {
        Self { folder, ..Self::default() }
    }

    /// Reads the pictures of maps that were opened lately, and makes those of built-in skies.
    pub(super) fn read(&self, recent: Vec<String>) -> impl FnOnce() -> SmallMapsFound + use<> {
        let folder = self.folder.clone();
        move || {
            let skies = sky::names().iter().filter_map(|name| {
                let map = sky::build(name, WIDTH, WIDTH / 2).ok()?;
                Some((format!("sky:{name}"), in_small(&map)))
            });
            folder.iter().for_each(|folder| tidy(folder));
            let known = read_known(folder.as_deref(), &recent);
            SmallMapsFound { maps: known.chain(skies).collect(), ..SmallMapsFound::default() }
        }
    }

    /// All maps in the folder of a map of this lasting name, if it was opened last.
    pub(super) fn beside(&self, name: &str) -> &[String] {
        if self.listed.iter().any(|listed| listed == name) { &self.listed } else { &[] }
    }

    /// Takes pictures that are ready.
    pub(super) fn take(&mut self, found: SmallMapsFound, context: &Context) {
        for (name, small) in found.maps {
            let texture = context.load_texture(&name, color_image(&small), TextureOptions::LINEAR);
            self.textures.insert(name, texture);
        }
        self.is_busy &= !found.are_next;
        self.listed = found.listed.unwrap_or_else(|| std::mem::take(&mut self.listed));
    }

    /// Makes the picture of a map that was opened, of which `preview` is a smaller one, and writes it if that is a
    /// recent file. Lists the maps of its folder, too.
    pub(super) fn make(
        &self,
        name: &str,
        recent: &[String],
        preview: Arc<Image>,
    ) -> impl FnOnce() -> SmallMapsFound + use<> {
        let name = lasting_map(name);
        let folder = self.folder.clone();
        let is_kept = recent.contains(&name);
        move || {
            let small = in_small(&preview);
            write_small(folder.as_deref().filter(|_| is_kept), &name, &small);
            let listed = files_beside(&name, is_map);
            let known = read_known(folder.as_deref(), &listed).filter(|(known, _)| *known != name);
            let maps = known.chain([(name.clone(), small)]).collect();
            SmallMapsFound { maps, listed: Some(listed), are_next: false }
        }
    }

    /// Makes the picture of the next listed map that has none, unless one is being made.
    pub(super) fn make_next(&mut self) -> Option<impl FnOnce() -> SmallMapsFound + use<>> {
        let is_next =
            |name: &&String| !self.textures.contains_key(*name) && !self.tried.contains(*name);
        let name = self.listed.iter().filter(|_| !self.is_busy).find(is_next)?.clone();
        self.is_busy = true;
        self.tried.insert(name.clone());
        let folder = self.folder.clone();
        Some(move || {
            let path = Path::new(&name);
            let is_small = path.metadata().is_ok_and(|it| it.len() <= MAX_READ);
            // What cannot be read says so when it is opened.
            let map = is_small.then(|| read_map(path).ok()).flatten();
            let small = map.map(|map| in_small(&map.image));
            small.iter().for_each(|small| write_small(folder.as_deref(), &name, small));
            let maps = small.into_iter().map(|small| (name.clone(), small)).collect();
            SmallMapsFound { maps, listed: None, are_next: true }
        })
    }
}

/// Files of a kind in the folder of this one, by name.
pub(super) fn files_beside(name: &str, is_wanted: impl Fn(&str) -> bool) -> Vec<String> {
    let entries = Path::new(name).parent().map(std::fs::read_dir);
    let files = entries.into_iter().flatten().flatten().flatten().map(|entry| entry.path());
    let names = files.filter_map(|path| Some(path.to_str()?.to_owned()));
    let mut names: Vec<String> = names.filter(|name| is_wanted(name)).collect();
    names.sort_by_key(|name| name.to_lowercase());
    names.truncate(MAX_LISTED);
    names
}

/// Pictures of maps that were written earlier.
fn read_known(folder: Option<&Path>, names: &[String]) -> impl Iterator<Item = (String, Rgb8)> {
    names.iter().filter_map(move |name| Some((name.clone(), read_small(folder?, name)?)))
}

/// Keeps a small picture for the next window.
fn write_small(folder: Option<&Path>, name: &str, small: &Rgb8) {
    let Some(folder) = folder else { return };
    // Without it the list has no picture, and no more is lost.
    let _ = std::fs::create_dir_all(folder);
    let _ = write_png(&file_of(folder, name), small, None, &[]);
}

fn in_small(map: &Image) -> Rgb8 {
    displayed(&map.shrunk(WIDTH))
}

/// A map as panels and lists show it.
pub(super) fn displayed(map: &Image) -> Rgb8 {
    display_rgb8(map, auto_exposure_ev(map) + 0.5, ToneCurve::Agx)
}

fn file_of(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{}.png", Digest::new().bytes(name.as_bytes())))
}

fn read_small(folder: &Path, name: &str) -> Option<Rgb8> {
    let bytes = read_file(&file_of(folder, name)).ok()?;
    let picture = decode_ldr(&bytes, name).ok().filter(|picture| picture.width <= WIDTH)?;
    let pixels = picture.pixels.rgba().iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    Some(Rgb8 { width: picture.width, height: picture.height, pixels })
}

/// Removes the oldest files where there are too many.
fn tidy(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let is_ours = |path: &PathBuf| {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
        let is_digest = stem.len() == 16 && stem.chars().all(|digit| digit.is_ascii_hexdigit());
        is_digest && path.extension().is_some_and(|extension| extension == "png")
    };
    let ours = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_ours);
    let dated = |path: PathBuf| Some((path.metadata().ok()?.modified().ok()?, path));
    let mut files: Vec<(SystemTime, PathBuf)> = ours.filter_map(dated).collect();
    files.sort();
    for (_, path) in files.iter().rev().skip(MAX_FILES) {
        // It may have gone by itself.
        let _ = std::fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_found_in_small_by_their_names_and_the_oldest_go() {
        let folder = tempfile::tempdir().expect("a folder");
        let map = sky::build("day", 300, 150).expect("a sky");
        let small = in_small(&map);
        assert_eq!((small.width, small.height), (WIDTH, WIDTH / 2));
        let name = "/maps/day.exr";
        assert_eq!(read_small(folder.path(), name), None);
        write_png(&file_of(folder.path(), name), &small, None, &[]).expect("written");
        assert_eq!(read_small(folder.path(), name), Some(small.clone()));
        assert_eq!(read_small(folder.path(), "/maps/night.exr"), None);
        std::fs::write(file_of(folder.path(), name), "no picture").expect("written");
        assert_eq!(read_small(folder.path(), name), None);
        let start = SystemTime::now() - std::time::Duration::from_secs(1000);
        for age in 0..MAX_FILES as u64 + 2 {
            let path = folder.path().join(format!("{age:016x}.png"));
            let file = std::fs::File::create(path).expect("made");
            file.set_modified(start - std::time::Duration::from_secs(age)).expect("dated");
        }
        let other = folder.path().join("holiday.png");
        let file = std::fs::File::create(&other).expect("made");
        file.set_modified(SystemTime::UNIX_EPOCH).expect("dated");
        tidy(folder.path());
        assert!(other.exists(), "it is somebody's");
        let is_there = |age: usize| folder.path().join(format!("{age:016x}.png")).exists();
        assert!(file_of(folder.path(), name).exists(), "the newest");
        assert!(is_there(MAX_FILES - 2) && !is_there(MAX_FILES - 1) && !is_there(MAX_FILES + 1));
    }
}
