//! What is to be rendered into a file beside the window, as words of the command line.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::document::{Document, Viewpoint, called};
use crate::denoise::Denoiser;
use crate::image::extension;
use crate::path::{Background, PathLimits};
use crate::render::gpu::DeviceChoice;
use crate::scene::camera_path::FRAMES_PER_SECOND;
use crate::scene::{
    Camera, LampEdit, Lamps, NamedLamp, Outlines, Scene, SceneOptions, edit_of_lamp,
};
use crate::sources::{is_built_in_map, is_built_in_scene};
use crate::tone::{Lut, ToneCurve, WhiteBalance};

with_defaults! {
    /// Size and movement of a final render; all else is as in the window.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct FinalRender {
        /// Pixels across and down.
        pub size: [u32; 2] = [1920, 1080],
        /// What the camera does.
        pub motion: Motion = Motion::Still,
        /// Frames of a full turn.
        pub frames: u32 = 96,
    }
}

/// What the camera of a final render does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Nothing: it is one picture.
    Still,
    /// It turns around the point that dragging turns around.
    Orbit,
    /// It turns where it is.
    LookAround,
    /// It moves as in the file.
    Path,
}

impl FinalRender {
    /// Words after `lightgrid` that render the document's picture into a file. `exposure_ev` is in stops, automatic
    /// ones included; without it the file finds its own.
    pub(crate) fn words(
        &self,
        document: &Document,
        scene: &Scene,
        (of_scene, lamps): (&SceneOptions, &[NamedLamp]),
        exposure_ev: Option<f32>,
        output: &Path,
    ) -> Vec<String> {
        let Document { light, look, stop, .. } = document;
        let [width, height] = self.size;
        let is_still = self.motion == Motion::Still;
        let has_layers = extension(output).is_some_and(|extension| extension == "exr");
        let denoise = match look.denoiser {
            _ if !look.denoise => Some("off"),
            Denoiser::Best => None,
            Denoiser::ATrous => Some("a-trous"),
            Denoiser::Oidn => Some("oidn"),
        };
        let layers = if look.denoise { "all,denoised" } else { "all" };
        let region = document.view(width, height).and_then(|view| Some((view.crop?, view)));
        let region = region.map(|(crop, view)| {
            let [left, top] = crop.corner;
            format!("{left},{top},{},{}", view.width, view.height)
        });
        let whole = |path: &Path| std::path::absolute(path).unwrap_or(path.to_owned());
        let name = |name: &String, is_built_in: fn(&str) -> bool| match is_built_in(name) {
            true => name.clone(),
            false => whole(Path::new(name)).display().to_string(),
        };
        let mut words = vec!["render".to_owned(), name(&document.scene, is_built_in_scene)];
        let device = match light.device {
            DeviceChoice::Auto => None,
            DeviceChoice::Cpu => Some("cpu"),
            DeviceChoice::Gpu => Some("gpu"),
        };
        let white = look.white_balance;
        let lut = look.lut.as_ref().filter(|_| !has_layers);
        let options = [
            ("env", Some(name(&document.map, is_built_in_map))),
            ("env-rotation", unless(document.rotation_degrees, 0.0)),
            ("env-intensity", unless(document.intensity, 1.0)),
            ("env-sun", unless(document.sun, 1.0)),
            ("background", of_background(document.background)),
            ("size", Some(format!("{width}x{height}"))),
            ("region", region),
            ("spp", stop.samples.map(|samples| samples.to_string())),
            ("seconds", stop.seconds.map(|seconds| seconds.to_string())),
            ("noise", stop.noise.map(|noise| noise.to_string())),
            ("sampling", unless(light.sampling, Default::default())),
            ("bounces", unless(light.bounces, PathLimits::default().bounces)),
            ("seed", unless(light.seed, 0)),
            ("device", device.map(str::to_owned)),
            ("exposure", exposure_ev.filter(|_| !has_layers).map(|stops| stops.to_string())),
            ("tonemap", unless(look.curve, ToneCurve::default()).filter(|_| !has_layers)),
            ("look", lut.map(|lut| name(lut, Lut::is_built_in))),
            ("look-strength", lut.and_then(|_| unless(look.lut_strength, 1.0))),
            (
                "white",
                (white != WhiteBalance::default() && !has_layers)
                    .then(|| format!("{},{}", white.kelvin, white.tint)),
            ),
            ("denoise", denoise.map(str::to_owned).filter(|_| !has_layers || look.denoise)),
            ("layers", has_layers.then(|| layers.to_owned())),
        ];
        let mut add = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("--{name}={value}")));
        };
        options.into_iter().for_each(|(name, value)| add(name, value));
        of_file(document, scene, (of_scene, lamps), &mut add);
        of_fog(document, scene, &mut add);
        if let Some(viewpoint) = &document.viewpoint {
            self.of_camera(viewpoint, scene, &mut add);
        }
        if document.mix().is_some() && has_layers && is_still {
            words.push("--light-groups".to_owned());
        }
        if of_scene.allow_outside {
            words.push("--allow-outside".to_owned());
        }
        let output = whole(&self.numbered(output));
        words.extend(["-o".to_owned(), output.display().to_string()]);
        words
    }

    fn of_camera(
        &self,
        viewpoint: &Viewpoint,
        scene: &Scene,
        add: &mut impl FnMut(&str, Option<String>),
    ) {
        let frame = scene.frame;
        if let Some((number, seconds)) =
            moving_camera(scene, viewpoint).filter(|_| self.motion == Motion::Path)
        {
            add("camera", Some(number.to_string()));
            let last = (seconds * FRAMES_PER_SECOND).round();
            add("frames", Some(format!("0..{last}")));
        } else {
            let camera = viewpoint.camera();
            let (eye, pivot) = (viewpoint.eye(), viewpoint.pivot());
            add("eye", Some(list(frame.point_in_file(eye))));
            add("target", Some(list(frame.point_in_file(pivot))));
            let up = viewpoint.rotation() * Vec3::Y;
            let upright = Camera::look_at(eye, pivot, 1.0).world_from_camera.matrix3.y_axis;
            let is_upright = Vec3::from(upright).abs_diff_eq(up, 1e-4);
            add("up", (!is_upright).then(|| list(up.as_dvec3())));
            match viewpoint.fov_y_degrees {
                Some(degrees) => add("fov", Some(degrees.to_string())),
                None => {
                    let height = 2.0 * frame.length_in_file(viewpoint.half_height);
                    add("parallel", Some(height.to_string()));
                }
            }
            add("lens-radius", unless(frame.length_in_file(camera.lens_radius), 0.0));
            let focus = frame.length_in_file(camera.focus_distance);
            add("focus", (camera.lens_radius > 0.0).then(|| focus.to_string()));
            let turns = matches!(self.motion, Motion::Orbit | Motion::LookAround);
            add("turntable", turns.then(|| self.frames.to_string()));
            let about = (self.motion == Motion::LookAround).then(|| frame.point_in_file(eye));
            add("about", about.map(list));
        }
    }

    /// The file's name with a place for the number of a frame, if it is one of many pictures.
    fn numbered(&self, path: &Path) -> PathBuf {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        match extension(path).as_deref() {
            Some(extension @ ("png" | "exr"))
                if self.motion != Motion::Still && !stem.contains('#') =>
            {
                path.with_file_name(format!("{stem}.####.{extension}"))
            }
            _ => path.to_owned(),
        }
    }
}

/// Number of the file's camera that moves, and for how many seconds: the one that the viewpoint is named after, else
/// the first.
pub(super) fn moving_camera(scene: &Scene, viewpoint: &Viewpoint) -> Option<(usize, f64)> {
    let paths = scene.camera_paths.iter().enumerate();
    let moving = paths.filter_map(|(i, path)| Some((i, path.as_ref()?.seconds())));
    let is_looked_through = |i: usize| scene.cameras[i].name == viewpoint.name;
    moving.max_by_key(|(i, _)| (is_looked_through(*i), std::cmp::Reverse(*i)))
}

/// A value as text, unless it is the default.
fn unless<T: Copy + PartialEq + ToString>(value: T, default: T) -> Option<String> {
    (value != default).then(|| value.to_string())
}

fn list(numbers: DVec3) -> String {
    numbers.to_array().map(|number| number.to_string()).join(",")
}

fn of_background(background: Background) -> Option<String> {
    match background {
        Background::Map => None,
        Background::None => Some("none".to_owned()),
        Background::Blurred(radians) => Some(format!("blur:{}", radians.to_degrees())),
        Background::Color(color) => Some(list(Vec3::from(color).as_dvec3())),
    }
}

/// What is asked of the scene's file, and changes to its materials and lamps.
fn of_file(
    document: &Document,
    scene: &Scene,
    (of_scene, lamps_by_name): (&SceneOptions, &[NamedLamp]),
    add: &mut impl FnMut(&str, Option<String>),
) {
    let SceneOptions { variant, outlines, lamps, hide, edits, .. } = of_scene;
    add("variant", variant.clone());
    add("outlines", (*outlines == Outlines::Keep).then(|| "keep".to_owned()));
    let lamps = match lamps {
        Lamps::Auto => None,
        Lamps::Physical => Some("physical".to_owned()),
        Lamps::Watts => Some("watts".to_owned()),
        Lamps::Factor(factor) => Some(factor.to_string()),
    };
    add("lamps", lamps);
    hide.iter().for_each(|name| add("hide", Some(name.clone())));
    edits.iter().for_each(|(name, edit)| add("material", Some(edit.to_text(name))));
    for (number, edit) in &document.materials {
        let name = called(*number, &scene.materials);
        let of_name = scene.materials.iter().filter(|material| material.name == name);
        let name = if of_name.count() == 1 { name } else { number.to_string() };
        add("material", Some(edit.to_text(&name)));
    }
    for lamp in lamps_by_name {
        let edit = edit_of_lamp(&lamp.name, &document.lamp_edits, document.lamps);
        add("lamp", (edit != LampEdit::default()).then(|| edit.to_text(&lamp.name)));
    }
}

/// Fog in place of the scene's own, in metres of the file.
fn of_fog(document: &Document, scene: &Scene, add: &mut impl FnMut(&str, Option<String>)) {
    let Some(fog) = document.fog else { return };
    let per_metre = |coefficient: Vec3| list(coefficient.as_dvec3() * scene.frame.scale);
    add("fog", Some(per_metre(fog.scattering)));
    add("fog-absorption", Some(per_metre(fog.absorption)));
    add("fog-anisotropy", Some(fog.anisotropy.to_string()));
    let corners =
        |[low, high]: [Vec3; 2]| [low, high].map(|at| list(scene.frame.point_in_file(at)));
    add("fog-box", fog.bounds.map(|bounds| corners(bounds).join(",")));
}

/// Words as they are typed into a shell.
pub(super) fn command_line(words: &[String]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./:=,@%+#~".contains(c);
    let quoted = |word: &String| match word.chars().all(is_plain) {
        true => word.clone(),
        false if cfg!(windows) => format!("\"{word}\""),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    let words: Vec<String> = words.iter().map(quoted).collect();
    format!("lightgrid {}", words.join(" "))
}

#[cfg(test)]
mod tests {
    use super::command_line;

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_words_back() {
        let words = ["render", "a b.glb", "--lamp=it's $HOME:off", "-o", "größe.png"];
        let line = command_line(&words.map(str::to_owned));
        let script = format!("lightgrid() {{ printf '%s\\n' \"$@\"; }}; {line}");
        let output = std::process::Command::new("sh").args(["-c", &script]).output();
        let output = output.expect("there is a shell").stdout;
        assert_eq!(String::from_utf8_lossy(&output).lines().collect::<Vec<_>>(), words);
    }
}
