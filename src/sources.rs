//! Scenes and maps by name: a file, or something built in.

use std::io::Read as _;
use std::path::Path;
use std::slice;

use crate::environment::sky;
use crate::error::{At as _, Error, Notices, Result};
use crate::image::Image;
use crate::image::{extension, looks_like_picture, looks_like_scene, open_file, read_map};
use crate::memory;
use crate::scene::needs::is_emitter;
use crate::scene::{
    LampEdit, Material, MaterialEdit, PunctualLight, Scene, SceneOptions, builtin, gltf,
};

/// Size of a built-in sky when none is asked for.
const SKY_SIZE: (u32, u32) = (2048, 1024);
/// Largest built-in sky.
const MAX_SKY_SIZE: (u32, u32) = (16384, 8192);

/// The scene a name stands for: a built-in's name, or a glTF file.
///
/// # Errors
/// One sentence: the name is neither, or the file cannot be read.
pub fn scene(name: &str) -> Result<Scene> {
    scene_with(name, &SceneOptions::default())
}

/// As [`scene`], with what is asked of its file.
///
/// # Errors
/// As [`scene`].
pub fn scene_with(name: &str, options: &SceneOptions) -> Result<Scene> {
    check_scene(name)?;
    let mut scene = if is_built_in_scene(name) {
        if let Some(variant) = &options.variant {
            return Err(Error::at(name, format!("there is no variant {variant}: it has none")));
        }
        let mut scene = builtin::build(name)?;
        scene.hide(&options.hide).at(name)?;
        scene
    } else {
        gltf::load_with(Path::new(name), options)?
    };
    let is_called = |material: &Material, name: &str| material.name == name;
    change(&mut scene.materials, &options.edits, is_called, MaterialEdit::apply)
        .map_err(|missing| Error::at(name, scene.without_material(missing)))?;
    let is_called = |light: &PunctualLight, name: &str| light.name == name;
    for edit in &options.lamp_edits {
        let emitters = scene.materials.iter_mut().filter(|it| is_emitter(it) && it.name == edit.0);
        let count = emitters.map(|material| *material = edit.1.apply_to_material(material)).count();
        let lights = change(&mut scene.lights, slice::from_ref(edit), is_called, LampEdit::apply);
        if let (0, Err(missing)) = (count, lights) {
            return Err(Error::at(name, scene.without_lamp(missing)));
        }
    }
    if options.edits.iter().any(|(_, edit)| edit.hidden) {
        scene.check_shown().at(name)?;
    }
    Ok(scene)
}

/// Applies each edit to all things of its name or, where none has that, to the one of that number, in order.
///
/// # Errors
/// The first name that nothing has.
fn change<'n, Thing, Edit>(
    all: &mut [Thing],
    edits: &'n [(String, Edit)],
    is_called: impl Fn(&Thing, &str) -> bool,
    apply: impl Fn(&Edit, &Thing) -> Thing,
) -> std::result::Result<(), &'n str> {
    for (name, edit) in edits {
        let named: Vec<_> = (0..all.len()).filter(|i| is_called(&all[*i], name)).collect();
        let number = name.parse().ok().filter(|number| named.is_empty() && *number < all.len());
        if named.is_empty() && number.is_none() {
            return Err(name);
        }
        for i in named.into_iter().chain(number) {
            all[i] = apply(edit, &all[i]);
        }
    }
    Ok(())
}

/// Whether a name is that of a built-in scene and of no file.
pub(crate) fn is_built_in_scene(name: &str) -> bool {
    builtin::names().contains(&name)
}

/// Whether a name is that of a built-in sky and of no file.
pub(crate) fn is_built_in_map(name: &str) -> bool {
    name.starts_with("sky:")
}

/// Whether a name stands for a scene rather than a map: by how its file begins, else by the name.
pub(crate) fn is_scene(name: &str) -> bool {
    let mut start = [0; 64];
    let file = open_file(Path::new(name)).ok();
    let count = file.and_then(|(mut file, _)| file.read(&mut start).ok()).unwrap_or(0);
    if looks_like_scene(&start[..count]) {
        return true;
    }
    if looks_like_picture(&start[..count]) {
        return false;
    }
    let extension = extension(Path::new(name));
    is_built_in_scene(name)
        || matches!(extension.as_deref(), Some("gltf" | "glb"))
        || (extension.is_none() && !is_built_in_map(name))
}

/// Whether there is such a scene, without reading it.
///
/// # Errors
/// One sentence: the name is neither a file nor a built-in's.
pub fn check_scene(name: &str) -> Result<()> {
    match is_built_in_scene(name) || Path::new(name).exists() {
        true => Ok(()),
        false if is_built_in_map(name) => {
            Err(Error::new(format!("{name}: is a sky, which a scene gets by --env")))
        }
        false if name.contains(['.', '/', '\\']) => Err(Error::at(name, "there is no such file")),
        false => Err(Error::new(format!(
            "{name}: neither a file nor a built-in scene ({})",
            builtin::names().join(", ")
        ))),
    }
}

/// Whether there is such a map, without reading or making it.
///
/// # Errors
/// One sentence: there is no such file or sky, or it is too large.
pub fn check_map(name: &str) -> Result<()> {
    match name.strip_prefix("sky:") {
        Some(rest) => sky_and_size(name, rest).map(|_| ()),
        None if Path::new(name).exists() => Ok(()),
        None => Err(Error::at(name, "there is no such file")),
    }
}

/// The map a name stands for: `sky:NAME`, `sky:NAME@WIDTHxHEIGHT`, or a file; repaired and ready.
///
/// # Errors
/// One sentence: there is no such sky, its size is out of range, or the file cannot be read.
pub fn map(name: &str) -> Result<(Image, Notices)> {
    if let Some(rest) = name.strip_prefix("sky:") {
        let (sky_name, (width, height)) = sky_and_size(name, rest)?;
        memory::check(2 * u64::from(width) * u64::from(height) * size_of::<[f32; 3]>() as u64)
            .at(name)?;
        return Ok((sky::build(sky_name, width, height)?, Notices::default()));
    }
    let loaded = read_map(Path::new(name))?;
    // The tables made of it take as much again.
    let bytes = loaded.image.pixels.len() * size_of::<[f32; 3]>();
    memory::check(bytes as u64).at(name)?;
    Ok((loaded.image, loaded.notices))
}

/// Name and size of the sky that `rest` asks for.
fn sky_and_size<'a>(name: &str, rest: &'a str) -> Result<(&'a str, (u32, u32))> {
    let (sky_name, (width, height)) = match rest.split_once('@') {
        None => (rest, SKY_SIZE),
        Some((sky_name, size)) => (sky_name, size_pair(size).at(name)?),
    };
    if width > MAX_SKY_SIZE.0 || height > MAX_SKY_SIZE.1 {
        let (w, h) = MAX_SKY_SIZE;
        return Err(Error::at(name, format!("a sky can be at most {w}x{h}")));
    }
    if !sky::names().contains(&sky_name) {
        return Err(sky::unknown(sky_name));
    }
    Ok((sky_name, (width, height)))
}

/// Two positive whole numbers joined by `x`.
pub(crate) fn size_pair(text: &str) -> std::result::Result<(u32, u32), String> {
    let number = |t: &str| t.trim().parse::<u32>().ok().filter(|n| *n > 0);
    text.split_once(['x', 'X'])
        .and_then(|(a, b)| number(a).zip(number(b)))
        .ok_or_else(|| "expected two positive whole numbers like 1280x720".to_owned())
}
