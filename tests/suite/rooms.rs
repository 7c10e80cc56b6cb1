//! Which room uses which, where each crate is named, how the files of a room use each other, and how large types and
//! rooms are.

mod imports;
mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use imports::Imports;
use source::{files, lines, plain, sources};

/// Rooms by floor, from the ground up: each uses those below its own alone.
const FLOORS: [&[&str]; 15] = [
    &["system"],
    &["alarm", "color", "error", "huge_pages", "math", "prefetch", "sampler"],
    &["bvh", "memory", "noise", "terminal"],
    &["image"],
    &["environment", "out_of_memory", "scene", "tone"],
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
const CRATES: [(&str, &[&str]); 32] = [
    ("askama", &["bench/figures", "report/pages"]),
    ("basisu", &["image/ktx2"]),
    ("bevy_mikktspace", &["scene/gltf/tangents"]),
    ("bitflags", &["render/gpu/features", "render/gpu/layout", "scene/needs"]),
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
    ("libc", &["system/unix"]),
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
    ("signal_hook", &["system/unix"]),
    ("statrs", &["metrics"]),
    ("windows_sys", &["system/windows"]),
    ("wgpu", &["app", "develop", "render/gpu"]),
    ("winit", &["app/desktop", "app/window"]),
];

/// Most methods of a type, over all its `impl` blocks.
const MAX_METHODS: usize = 40;

/// Most lines of each room that are neither blank nor comments nor tests. Who raises one says why in the commit.
const BUDGETS: [(&str, usize); 37] = [
    ("alarm", 48),
    ("app", 12221),
    ("bench", 441),
    ("bsdf", 1446),
    ("bvh", 1339),
    ("cli", 3487),
    ("color", 27),
    ("denoise", 1209),
    ("develop", 415),
    ("digest", 89),
    ("environment", 1723),
    ("error", 65),
    ("huge_pages", 26),
    ("image", 2134),
    ("lib", 65),
    ("light_grid", 788),
    ("main", 6),
    ("math", 89),
    ("medium", 133),
    ("memory", 59),
    ("metrics", 190),
    ("noise", 79),
    ("out_of_memory", 78),
    ("output", 582),
    ("path", 3140),
    ("prefetch", 14),
    ("radiance_cache", 327),
    ("render", 6450),
    ("report", 2791),
    ("sampler", 170),
    ("scene", 9519),
    ("shaders", 6353),
    ("sources", 137),
    ("stability", 1716),
    ("system", 410),
    ("terminal", 45),
    ("tone", 379),
];

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

#[test]
fn files_of_a_room_do_not_use_each_other_in_circles() {
    let circles = Imports::of(sources()).circles();
    let place = |at: usize| sources()[at].place.as_str();
    let circles: Vec<Vec<&str>> =
        circles.into_iter().map(|circle| circle.into_iter().map(place).collect()).collect();
    assert!(circles.is_empty(), "{circles:#?}");
}

#[test]
fn files_do_not_use_items_that_the_module_above_declares() {
    let of_parents = Imports::of(sources()).of_parents.into_iter();
    let found: Vec<String> =
        of_parents.map(|(at, item)| format!("{} uses {item}", sources()[at].place)).collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn types_have_few_methods() {
    for (name, count) in imports::methods(sources()) {
        assert!(
            count <= MAX_METHODS,
            "{name} has {count} methods, {MAX_METHODS} are allowed: part it"
        );
    }
}

#[test]
fn rooms_keep_to_their_budgets() {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for source in sources() {
        *counts.entry(source.room().to_owned()).or_default() += lines(&source.code);
    }
    for path in files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), "wgsl") {
        let text = fs::read_to_string(path).expect("a shader");
        *counts.entry("shaders".to_owned()).or_default() += lines(&plain(&text));
    }
    let total: usize = counts.values().sum();
    let budgets: BTreeMap<&str, usize> = BUDGETS.into_iter().collect();
    for (room, count) in &counts {
        let budget = budgets.get(&**room).copied().unwrap_or(0);
        assert!(
            *count <= budget,
            "{room} has {count} lines of code, its budget is {budget}; all rooms together have {total}: {counts:#?}"
        );
    }
    let gone = BUDGETS.iter().find(|(room, _)| !counts.contains_key(*room));
    assert!(gone.is_none(), "there is no such room: {gone:?}");
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
