//! What files let go over the window stand for.

use std::path::{Path, PathBuf};

use super::commands::Command;
use super::interface::Interface;
use super::messages::Messages;
use super::theme;
use crate::image::extension;
use crate::sources;

/// What of dropped files is opened, by name.
#[derive(Debug, PartialEq)]
pub(super) struct Dropped {
    pub(super) scene: Option<String>,
    pub(super) map: Option<String>,
    pub(super) look: Option<String>,
    /// Other scenes, maps and looks.
    pub(super) left: Vec<String>,
}

impl Dropped {
    /// What is not a scene is taken for a map; beside a scene only what is in linear radiance, for its textures and
    /// buffers may come along.
    pub(super) fn of(paths: &[PathBuf]) -> Self {
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        let (looks, names): (Vec<_>, Vec<_>) = names.into_iter().partition(|name| is_look(name));
        let (scenes, others): (Vec<_>, Vec<_>) =
            names.into_iter().partition(|name| sources::is_scene(name));
        let has_scene = !scenes.is_empty();
        // What else comes with a scene is read with it.
        let maps = others.into_iter().filter(|name| !has_scene || is_map(name));
        let (mut scenes, mut maps, mut looks) = (scenes.into_iter(), maps, looks.into_iter());
        let (scene, map, look) = (scenes.next(), maps.next(), looks.next());
        Self { scene, map, look, left: scenes.chain(maps).chain(looks).collect() }
    }
}

/// Whether a file is named as one of linear radiance, which can only be a map.
pub(super) fn is_map(name: &str) -> bool {
    matches!(extension(Path::new(name)).as_deref(), Some("exr" | "hdr"))
}

/// Whether a file is named as a look.
pub(super) fn is_look(name: &str) -> bool {
    extension(Path::new(name)).as_deref() == Some("cube")
}

/// Files dropped onto the window: one scene, one map and one look of them are opened. With a scene come files that belong
/// to it, pictures among them, of which none but those in linear radiance are taken for maps.
pub(super) fn dropped_files(
    context: &egui::Context,
    interface: &mut Interface,
    messages: &mut Messages,
) -> Vec<Command> {
    let paths: Vec<PathBuf> = context
        .input(|input| input.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect());
    if paths.is_empty() {
        return Vec::new();
    }
    // Or they would be opened behind it.
    interface.prompt = None;
    let chosen = Dropped::of(&paths);
    let left = chosen.left.iter().map(|name| theme::file_name(name)).collect::<Vec<_>>();
    if !left.is_empty() {
        messages.notice(format!("Not opened: {}", left.join(", ")));
    }
    let scene = chosen.scene.map(Command::OpenScene);
    let map = chosen.map.map(Command::OpenMap);
    scene.into_iter().chain(map).chain(chosen.look.map(Command::OpenLook)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_files_dropped_together_a_scene_and_its_light_are_opened() {
        let dropped =
            |names: &[&str]| Dropped::of(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        let some = |name: &str| Some(name.to_owned());
        let found = dropped(&["room.gltf", "room.bin", "oak.png", "sky.hdr", "Film.CUBE"]);
        let [scene, map, look] = ["room.gltf", "sky.hdr", "Film.CUBE"].map(some);
        assert_eq!(found, Dropped { scene, map, look, left: Vec::new() }, "textures are no skies");
        assert_eq!(dropped(&["street.jpg"]).map, some("street.jpg"));
        let two = dropped(&["a.exr", "b.exr"]);
        assert_eq!((two.map, two.left), (some("a.exr"), vec!["b.exr".to_owned()]));
    }
}
