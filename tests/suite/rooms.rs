//! The walls of the house: which room may use which, and which crate is named where.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms by floor, from the ground up: each uses those below its own alone.
const FLOORS: [&[&str]; 14] = [
    &["alarm", "color", "error", "huge_pages", "math", "prefetch", "sampler"],
    &["bvh", "memory", "noise", "terminal"],
    &["image"],
    &["environment", "scene", "tone"],
    &["bsdf", "digest", "light_grid", "medium", "metrics", "sources"],
    &["radiance_cache"],
    &["path"],
    &["render"],
    &["denoise"],
    &["develop"],
    &["output"],
    &["app", "report"],
    &["bench", "stability"],
    &["cli"],
];

/// Crates and where alone they are named: rooms, or parts of one. Any other is named anywhere.
const CRATES: [(&str, &[&str]); 30] = [
    ("askama", &["report/pages"]),
    ("basisu", &["image/ktx2"]),
    ("bevy_mikktspace", &["scene/gltf/tangents"]),
    ("bitflags", &["render/gpu/features", "scene/needs"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli/generate"]),
    ("clap_mangen", &["cli/generate"]),
    ("draco_core", &["scene/gltf/draco"]),
    ("egui", &["app"]),
    ("egui_plot", &["app/panels/convergence"]),
    ("egui_wgpu", &["app"]),
    ("egui_winit", &["app/window"]),
    ("exr", &["image"]),
    ("gltf", &["scene/gltf"]),
    ("image", &["image"]),
    ("indicatif", &["cli/progress"]),
    ("libloading", &["denoise/oidn"]),
    ("meshopt", &["scene/gltf/meshopt"]),
    ("nv_flip", &["metrics/flip"]),
    ("obvhs", &["bvh"]),
    ("open", &["app/desktop"]),
    ("png", &["image"]),
    ("pollster", &["app", "render/gpu"]),
    ("pulp", &["denoise"]),
    ("rfd", &["app/desktop"]),
    ("ruzstd", &["image/ktx2"]),
    ("signal_hook", &["app/window", "terminal"]),
    ("statrs", &["metrics"]),
    ("wgpu", &["app", "develop", "render/gpu"]),
    ("winit", &["app/desktop", "app/window"]),
];

/// A file of the product: its place below `src` without the ending, and its code without tests.
struct Source {
    place: String,
    code: String,
}

impl Source {
    fn room(&self) -> &str {
        self.place.split('/').next().unwrap_or_default()
    }

    /// Whether it is this part of the house, or lies in it.
    fn is_in(&self, part: &str) -> bool {
        self.place.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}

/// All files but those that are tests alone.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let (mut sources, mut tests) = (Vec::new(), Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the project") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).expect("a source file");
                tests.extend(test_modules(&path, &text));
                let place = path.strip_prefix(&root).expect("below src").with_extension("");
                let place = place.to_str().expect("plain names").replace('\\', "/");
                let place = place.trim_end_matches("/mod").to_owned();
                sources.push((path, Source { place, code: without_tests(&text) }));
            }
        }
    }
    let is_test = |path: &Path| tests.iter().any(|test| path.with_extension("").starts_with(test));
    sources.into_iter().filter(|(path, _)| !is_test(path)).map(|(_, source)| source).collect()
}

/// Paths without endings of the modules that a file declares for tests.
fn test_modules(path: &Path, text: &str) -> Vec<PathBuf> {
    let stem = path.file_stem().expect("a name");
    let is_folder = ["mod", "lib", "main"].iter().any(|name| stem == *name);
    let folder = if is_folder { path.with_file_name("") } else { path.with_extension("") };
    let mut found = Vec::new();
    let mut is_for_tests = false;
    for line in text.lines().map(str::trim) {
        let declared = line.split("mod ").nth(1).and_then(|rest| rest.strip_suffix(';'));
        match declared {
            _ if line.starts_with("#[cfg(") && line.contains("test") => is_for_tests = true,
            _ if line.starts_with("#[") => {}
            Some(name) if is_for_tests => {
                found.push(folder.join(name));
                is_for_tests = false;
            }
            _ => is_for_tests = false,
        }
    }
    found
}

/// Lines of code: without comments, and without what follows `#[cfg(test)]` at the left edge.
fn without_tests(text: &str) -> String {
    let mut code = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" {
            let item = lines.find(|line| !line.starts_with("#["));
            if item.is_some_and(|line| line.ends_with('{')) {
                let _ = lines.find(|line| line.starts_with('}'));
            }
        } else if !line.trim_start().starts_with("//") {
            code += line;
            code.push('\n');
        }
    }
    code
}

/// First names of paths that begin with `prefix`.
fn named<'a>(code: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    code.split(prefix).skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

/// Whether a module of our own that is called as a crate is comes into scope.
fn imports_namesake(code: &str, name: &str) -> bool {
    if code.contains(&format!("\nmod {name};")) {
        return true;
    }
    let own = |import: &&str| import.starts_with("crate::") || import.starts_with("super::");
    let words = |c: char| !c.is_alphanumeric() && c != '_';
    let imports = code.split("use ").skip(1).filter_map(|rest| rest.split(';').next());
    imports.filter(own).any(|import| import.split(words).any(|word| word == name))
}

fn floor_of(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn rooms_use_what_is_below_them() {
    let mut wrong = BTreeSet::new();
    let mut rooms = BTreeSet::new();
    for source in sources() {
        let room = source.room();
        if ["lib", "main"].contains(&room) {
            continue;
        }
        rooms.insert(room.to_owned());
        let own = floor_of(room).unwrap_or_else(|| panic!("{room} is on no floor"));
        for used in named(&source.code, "crate::") {
            if used != room && floor_of(used).is_none_or(|floor| floor >= own) {
                wrong.insert(format!("{} uses {used}", source.place));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let all: BTreeSet<String> = FLOORS.concat().into_iter().map(str::to_owned).collect();
    assert_eq!(rooms, all, "rooms that there are, and that have a floor");
}

#[test]
fn crates_are_named_in_one_place() {
    let mut wrong = Vec::new();
    let mut unused: BTreeSet<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    for source in sources() {
        for (name, places) in CRATES {
            let path = format!("{name}::");
            let is_named = source.code.match_indices(&path).any(|(at, _)| {
                // `gpu::image::` and the like are no crates.
                let before = source.code[..at].chars().next_back();
                before.is_none_or(|c| !c.is_alphanumeric() && !"_:".contains(c))
            });
            if is_named && !imports_namesake(&source.code, name) {
                unused.remove(name);
                if !places.iter().any(|place| source.is_in(place)) {
                    wrong.push(format!("{} names {name}", source.place));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(unused.is_empty(), "named nowhere: {unused:?}");
}

/// The picture of the house in CONTRIBUTING.md has every room.
#[test]
fn every_room_is_drawn() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("CONTRIBUTING.md");
    let page = fs::read_to_string(page).expect("the page");
    let picture = page.split("```").nth(1).unwrap_or_default();
    let drawn: BTreeSet<&str> = picture.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let missing: Vec<&str> =
        FLOORS.concat().into_iter().filter(|room| !drawn.contains(room)).collect();
    assert!(missing.is_empty(), "{missing:?} are not in\n{picture}");
}
