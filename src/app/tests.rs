//! What a person does, one step after the other, and what must come of it.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use egui::Id;
use egui::containers::PanelState;
use glam::{Vec2, Vec3};

use super::application::Start;
use super::commands::Command;
use super::document::{Document, Light, Look, PictureSize};
use super::edited;
use super::final_render::FinalRender;
use super::interface::{Dock, Interface, Tab};
use super::loader::{Loaded, Loader};
use super::overlays::{Legend, Overlay};
use super::reload::Reload;
use super::screenshot::Studio;
use crate::environment::{Environment, EnvironmentOptions};
use crate::image::{ExrPicture, Image, read_picture, write_exr};
use crate::memory;
use crate::path::Background;
use crate::render::StopRule;
use crate::render::gpu::DeviceChoice;
use crate::scene::{LampEdit, MaterialEdit, Medium, SceneOptions};
use crate::tone::WhiteBalance;

fn studio(scene: &str) -> Option<Studio> {
    studio_of(scene, (800, 500))
}

fn studio_of(scene: &str, size: (u32, u32)) -> Option<Studio> {
    let defaults = Document::default();
    let document = Document {
        scene: scene.to_owned(),
        map: "sky:day@64x32".to_owned(),
        size: PictureSize::Fixed(48, 32),
        stop: StopRule { samples: Some(1), ..StopRule::default() },
        light: Light { device: DeviceChoice::Cpu, ..defaults.light },
        look: Look { denoise: false, ..defaults.look },
        ..defaults
    };
    let start = Start { document, ..Start::default() };
    let studio = Studio::open(start, size, Duration::from_secs(3000));
    let studio = studio.inspect_err(|error| crate::terminal::notice(format!("SKIPPED: {error}")));
    studio.ok()
}

fn write_picture(path: &Path, image: &Image) {
    let picture = ExrPicture { image, layers: Vec::new(), metadata: &[], preview: None };
    write_exr(path, picture).expect("written");
}

impl Studio {
    fn asks(&mut self, command: Command) {
        self.app.execute(command, &self.context);
    }
}

#[test]
fn what_is_saved_is_what_was_asked_for_and_not_what_was_there_before() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let [early, late] = ["early.exr", "late.exr"].map(|name| folder.path().join(name));
    studio.settle().expect("rendered");
    studio.asks(Command::OpenScene("crack".to_owned()));
    studio.asks(Command::Save(early.clone()));
    studio.asks(Command::Save(folder.path().join("another.png")));
    studio.asks(Command::KeepPicture);
    assert!(studio.app.library.history.list.is_empty(), "it is none of the document");
    studio.settle().expect("rendered");
    studio.frame().expect("drawn");
    studio.asks(Command::Save(late.clone()));
    studio.asks(Command::KeepPicture);
    assert_eq!(studio.app.library.history.list.len(), 1);
    studio.frame().expect("drawn");
    assert!(studio.app.finish().is_empty());
    let pixels = |path: &Path| read_picture(path).expect("written").pixels;
    assert_eq!(pixels(&early), pixels(&late));
    assert!(folder.path().join("another.png").exists());
    // One that is not there in time is not forgotten in silence.
    studio.asks(Command::OpenScene("open".to_owned()));
    studio.asks(Command::Save(late.clone()));
    let failures = studio.app.finish();
    assert!(failures.len() == 1 && failures[0].contains("late.exr: not saved"), "{failures:?}");
}

#[test]
fn all_of_a_room_is_framed_from_inside_and_of_an_object_from_outside() {
    for (scene, is_inside) in [("office", true), ("materials", false)] {
        let Some(mut studio) = studio(scene) else { return };
        studio.settle().expect("rendered");
        let document = &mut studio.app.edited.document;
        document.viewpoint.as_mut().expect("a camera").fly(Vec3::new(0.0, 0.0, -1.0));
        studio.asks(Command::FrameAll);
        let eye = studio.app.edited.document.viewpoint.as_ref().expect("framed").eye();
        let (low, high) = studio.app.assets.scene.as_ref().expect("read").world.bvh.bounds();
        assert_eq!((eye.cmpge(low) & eye.cmple(high)).all(), is_inside, "{scene}: {eye}");
    }
}

#[test]
fn a_size_without_memory_is_refused_and_undo_goes_on() {
    const HUGE: PictureSize = PictureSize::Fixed(16_384, 8_192);
    if memory::check((16_384 * 8_192) * edited::BYTES_PER_PIXEL).is_ok() {
        crate::terminal::notice("SKIPPED: there is memory for everything");
        return;
    }
    let Some(mut studio) = studio("open") else { return };
    studio.settle().expect("rendered");
    let small = studio.app.edited.document.size;
    studio.app.edited.document.rotation_degrees = 30.0;
    studio.settle().expect("rendered");
    let frames = |studio: &mut Studio| (0..3).for_each(|_| studio.frame().expect("drawn"));
    studio.app.edited.document.size = HUGE;
    frames(&mut studio);
    assert_eq!(studio.app.edited.document.size, small);
    assert!(studio.app.messages.first_error().is_some_and(|said| said.contains("16384 x 8192")));
    // Of a part there may be as much as one likes, of the whole not.
    studio.app.edited.document.region = Some([0.0, 0.0, 0.002, 0.002]);
    studio.app.edited.document.size = HUGE;
    frames(&mut studio);
    assert_eq!(studio.app.edited.document.size, HUGE);
    studio.asks(Command::ToggleRegion);
    frames(&mut studio);
    assert!(studio.app.edited.document.size == HUGE && studio.app.edited.document.region.is_some());
    studio.asks(Command::Undo);
    frames(&mut studio);
    assert_eq!((studio.app.edited.document.size, studio.app.edited.document.region), (small, None));
    assert_eq!(studio.app.edited.document.rotation_degrees, 30.0);
    studio.asks(Command::Undo);
    assert_eq!(studio.app.edited.document.rotation_degrees, 0.0);
}

#[test]
fn a_map_that_has_gone_is_no_step_to_go_back_to() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let maps = ["one.exr", "two.exr"].map(|name| folder.path().join(name).display().to_string());
    studio.settle().expect("rendered");
    for map in &maps {
        write_picture(Path::new(map), &Image::filled(4, 2, [1.0; 3]));
        studio.asks(Command::OpenMap(map.clone()));
        studio.settle().expect("rendered");
    }
    std::fs::remove_file(&maps[0]).expect("removed");
    studio.asks(Command::Undo);
    while studio.app.messages.first_error().is_none() {
        studio.frame().expect("drawn");
    }
    assert_eq!(studio.app.edited.document.map, maps[1]);
    studio.frame().expect("drawn");
    studio.asks(Command::Undo);
    assert_eq!(studio.app.edited.document.map, "sky:day@64x32");
}

#[test]
fn what_is_being_loaded_can_be_given_up() {
    let Some(mut studio) = studio("open") else { return };
    until(&mut studio, |studio| studio.app.assets.are_named_by(&studio.app.edited.document));
    let before = studio.app.edited.document.clone();
    studio.asks(Command::OpenScene("exterior".into()));
    studio.asks(Command::OpenMap("sky:night".into()));
    studio.frame().expect("drawn");
    let loading: Vec<&str> =
        studio.app.assets.loader.busy_with().map(|loading| loading.name).collect();
    assert_eq!(loading, ["exterior", "sky:night"]);
    studio.asks(Command::StopLoading);
    assert_eq!(studio.app.edited.document, before, "all is as it was");
    studio.frame().expect("drawn");
    assert!(studio.app.assets.loader.busy_with().next().is_none());
    assert!(studio.app.assets.are_named_by(&before), "what was shown is still there");
}

#[test]
fn the_sun_is_changed_without_the_file_of_its_map() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("map.exr");
    let name = file.display().to_string();
    let mut pixels = vec![[0.25, 0.5, 1.0]; 64 * 32];
    pixels[8 * 64 + 20] = [900.0, 800.0, 700.0];
    let map = Image { width: 64, height: 32, pixels };
    write_picture(&file, &map);
    studio.app.edited.document.sun = 0.0;
    studio.asks(Command::OpenMap(name.clone()));
    studio.settle().expect("rendered");
    std::fs::remove_file(&file).expect("removed");
    for factor in [3.0, 0.5, 1.0] {
        studio.app.edited.document.sun = factor;
        studio.settle().expect("rendered");
        assert_eq!(studio.app.messages.first_error(), None);
        let loaded = studio.app.assets.map.as_ref().expect("it is there");
        let options = EnvironmentOptions { sun: factor, ..EnvironmentOptions::default() };
        let expected = Environment::new(map.clone(), &options).expect("sound");
        assert_eq!((loaded.sun_factor, loaded.environment.map()), (factor, expected.map()));
    }
    // Read again it has gone.
    studio.asks(Command::ReadAgain);
    while studio.app.messages.first_error().is_none() {
        studio.frame().expect("drawn");
    }
    assert_eq!((&studio.app.edited.document.map, studio.app.edited.document.sun), (&name, 1.0));
}

#[test]
fn a_paused_picture_goes_on_with_a_map_that_is_read_again() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("map.exr");
    let name = file.display().to_string();
    write_picture(&file, &Image::filled(4, 2, [1.0; 3]));
    studio.asks(Command::OpenMap(name.clone()));
    studio.settle().expect("rendered");
    for (asked, light) in [(Command::ReadAgain, 2.0), (Command::OpenMap(name), 4.0)] {
        studio.asks(Command::TogglePause);
        studio.frame().expect("drawn");
        write_picture(&file, &Image::filled(4, 2, [light; 3]));
        studio.asks(asked);
        // The picture of before may be done meanwhile.
        while studio.app.assets.loader.busy_with().next().is_some() {
            studio.frame().expect("drawn");
        }
        studio.settle().expect("rendered");
        let snapshot = studio.app.rendering.snapshot.as_ref().expect("it is there");
        assert_eq!(snapshot.request.environment.map().pixels[0], [light; 3]);
        assert!(snapshot.main.film.min_samples() > 0);
    }
}

#[test]
fn a_scene_is_looked_at_from_somewhere_and_known_by_any_of_its_paths() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("triangle.gltf");
    std::fs::write(&file, TRIANGLE).expect("written");
    let name = file.display().to_string();
    let Some(mut studio) = studio(&name) else { return };
    studio.settle().expect("rendered");
    studio.app.edited.document.viewpoint = None;
    studio.settle().expect("rendered");
    assert!(studio.app.edited.document.viewpoint.is_some());
    studio.asks(Command::Bookmark);
    studio.app.edited.document.rotation_degrees = 30.0;
    let before = studio.app.edited.document.clone();
    studio.asks(Command::OpenScene(folder.path().join("./triangle.gltf").display().to_string()));
    assert_eq!(studio.app.edited.document, before, "it is read again");
    // Paused, it would never be seen.
    studio.asks(Command::TogglePause);
    studio.asks(Command::OpenScene("open".to_owned()));
    studio.settle().expect("rendered");
}

#[test]
fn a_scene_is_read_again_while_a_material_of_it_changes() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("triangle.gltf");
    std::fs::write(&file, TRIANGLE).expect("written");
    let Some(mut studio) = studio(&file.display().to_string()) else { return };
    studio.settle().expect("rendered");
    let larger = TRIANGLE.replace(r#"{"mesh": 0}"#, r#"{"mesh": 0, "scale": [2, 2, 2]}"#);
    std::fs::write(&file, larger).expect("written");
    let edit = MaterialEdit { roughness: Some(0.25), ..MaterialEdit::default() };
    studio.app.edited.document.materials.insert(0, edit);
    studio.frame().expect("drawn");
    studio.asks(Command::ReadAgain);
    studio.settle().expect("rendered");
    let scene = &studio.app.assets.scene.as_ref().expect("it is there").world.scene;
    assert!(scene.positions.iter().any(|position| position.max_element() == 2.0));
    assert_eq!(scene.materials[0].roughness, 0.25);
}

/// Frames until something is so; it must be within a minute.
fn until(studio: &mut Studio, is_so: impl Fn(&Studio) -> bool) {
    let start = std::time::Instant::now();
    while !is_so(studio) {
        assert!(start.elapsed().as_secs() < 60, "never");
        studio.frame().expect("drawn");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn what_another_program_writes_is_read_once_it_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, data] = ["triangle.gltf", "corners.bin"].map(|name| folder.path().join(name));
    let corners = |size: f32| {
        let corners = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0];
        corners.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()
    };
    let begin = TRIANGLE.find("data:").expect("its data");
    let end = begin + TRIANGLE[begin..].find('"').expect("its end");
    let linked = format!("{}corners.bin{}", &TRIANGLE[..begin], &TRIANGLE[end..]);
    std::fs::write(&file, &linked).expect("written");
    std::fs::write(&data, corners(1.0)).expect("written");
    let Some(mut studio) = studio(&file.display().to_string()) else { return };
    studio.settle().expect("rendered");
    studio.app.assets.reload = Some(Reload::start(Arc::new(|| ())).expect("a thread"));
    studio.frame().expect("drawn");
    std::thread::sleep(Duration::from_millis(200));
    let size = |studio: &Studio| {
        let scene = &studio.app.assets.scene.as_ref().expect("it is there").world.scene;
        scene.positions.iter().map(|position| position.max_element()).fold(0.0, f32::max)
    };
    // Half of it, then all; then the file that names it.
    std::fs::write(&data, &corners(2.0)[..20]).expect("written");
    std::thread::sleep(Duration::from_millis(100));
    std::fs::write(&data, corners(2.0)).expect("written");
    until(&mut studio, |studio| size(studio) == 2.0);
    let scaled = linked.replace(r#"{"mesh": 0}"#, r#"{"mesh": 0, "scale": [2, 2, 2]}"#);
    std::fs::write(&file, &scaled).expect("written");
    until(&mut studio, |studio| size(studio) == 4.0);
    assert_eq!(studio.app.messages.first_error(), None, "nothing was read in part");

    studio.asks(Command::ToggleReloads);
    std::fs::write(&data, corners(3.0)).expect("written");
    let start = std::time::Instant::now();
    until(&mut studio, |_| start.elapsed().as_secs() >= 2);
    assert_eq!(size(&studio), 4.0, "it was not to be");
    studio.asks(Command::ToggleReloads);
    until(&mut studio, |studio| size(studio) == 6.0);
    studio.settle().expect("rendered");
}

#[test]
fn it_is_said_once_that_no_light_gets_in() {
    let Some(mut studio) = studio("open") else { return };
    let said = |studio: &mut Studio, intensity: f32| {
        let document = &mut studio.app.edited.document;
        (document.intensity, document.stop.samples) = (intensity, Some(4));
        studio.settle().expect("rendered");
        studio.frame().expect("drawn");
        let list = &studio.app.messages.list;
        list.iter().filter(|message| message.sentence.starts_with("No light")).count()
    };
    assert_eq!([1.0, 0.0, 1.0, 0.0].map(|intensity| said(&mut studio, intensity)), [0, 1, 1, 1]);
}

#[test]
fn the_sun_is_put_where_it_is_asked_for_and_marked_there() {
    let Some(mut studio) = studio("living-room") else { return };
    let sunlit = |studio: &mut Studio| -> f32 {
        studio.settle().expect("rendered");
        let legend = studio
            .app
            .display
            .shown
            .as_ref()
            .and_then(|shown| Some(shown.painted.as_ref()?.legend.clone()));
        let Some(Legend::Names(names)) = legend else { panic!("no names: {legend:?}") };
        let percent = names[0].1.strip_prefix("sunlit, ").and_then(|it| it.split_once(' '));
        percent.expect("a share").0.parse().expect("a number")
    };
    studio.arrange(Interface { overlay: Some(Overlay::Sun), ..Interface::default() });
    studio.app.edited.document.rotation_degrees = 180.0;
    assert_eq!(sunlit(&mut studio), 0.0);
    let place = Vec2::new(0.9, 0.9);
    studio.asks(Command::PutSun { place, is_last: true });
    assert!(sunlit(&mut studio) > 1.0);
    assert!(studio.app.messages.list.is_empty(), "{:?}", studio.app.messages.list);
    // The sun cannot reach the ceiling; the notice comes when the pointer is let go.
    let place = Vec2::new(0.5, 0.02);
    studio.asks(Command::PutSun { place, is_last: false });
    assert!(studio.app.messages.list.is_empty());
    studio.asks(Command::PutSun { place, is_last: true });
    let said: Vec<_> = studio.app.messages.list.iter().map(|it| &*it.sentence).collect();
    assert!(said.len() == 1 && said[0].contains("cannot reach this place"), "{said:?}");
}

#[test]
fn lamps_are_scaled_apart_from_the_map() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("lit.gltf");
    let lit = TRIANGLE.replace(
        r#"{"mesh": 0}"#,
        r#"{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}"#,
    );
    let light = r#""extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 8}]}}, "#;
    std::fs::write(&file, lit.replacen(r#""asset""#, &format!(r#"{light}"asset""#), 1))
        .expect("written");
    let Some(mut studio) = studio(&file.display().to_string()) else { return };
    let candela = |studio: &mut Studio, lamps: f32| {
        studio.app.edited.document.lamps = lamps;
        studio.settle().expect("rendered");
        let scene = &studio.app.assets.scene.as_ref().expect("it is there").world.scene;
        scene.lights[0].intensity.x
    };
    assert_eq!([1.0, 0.25, 2.0].map(|lamps| candela(&mut studio, lamps)), [8.0, 2.0, 16.0]);
    // Its own change multiplies that, and the list has its name.
    let own = LampEdit { factor: 0.5, ..LampEdit::default() };
    let name = studio.app.assets.scene.as_ref().expect("it is there").named_lamps[0].name.clone();
    studio.app.edited.document.lamp_edits.insert(name.clone(), own);
    assert_eq!(candela(&mut studio, 2.0), 8.0);
    let off = LampEdit { off: true, ..own };
    studio.app.edited.document.lamp_edits.insert(name.clone(), off);
    assert_eq!(candela(&mut studio, 2.0), 0.0);
    studio.app.edited.document.lamp_edits.remove(&name);
    // A change of a material keeps the factor.
    let edit = MaterialEdit { roughness: Some(0.25), ..MaterialEdit::default() };
    studio.app.edited.document.materials.insert(0, edit);
    assert_eq!(candela(&mut studio, 2.0), 16.0);
}

/// A material that emits is a lamp of its name: what a change to it does, changes of the material do as well.
#[test]
fn materials_that_emit_are_lamps() {
    let Some(mut studio) = studio("evening") else { return };
    studio.settle().expect("rendered");
    let loaded = studio.app.assets.scene.as_ref().expect("it is there");
    let names: Vec<&str> = loaded.named_lamps.iter().map(|lamp| &*lamp.name).collect();
    assert_eq!(names, ["lampshade", "bulb", "bright bulb"]);
    let number = loaded.materials.iter().position(|it| it.name == "bulb").expect("it is there");
    let own = loaded.materials[number].emissive;
    let emission = |studio: &mut Studio, edit: LampEdit| {
        studio.app.edited.document.lamp_edits.insert("bulb".to_owned(), edit);
        studio.settle().expect("rendered");
        let scene = &studio.app.assets.scene.as_ref().expect("it is there").world.scene;
        scene.materials[number].emissive
    };
    let none = LampEdit::default();
    assert_eq!(emission(&mut studio, LampEdit { factor: 0.5, ..none }), own * 0.5);
    // It stays in the list, and words for the command line switch it off, too.
    assert_eq!(emission(&mut studio, LampEdit { off: true, ..none }), Vec3::ZERO);
    assert_eq!(studio.app.assets.scene.as_ref().expect("there").named_lamps.len(), 3);
    let path = Path::new("a.png");
    let words = studio.app.render_words(FinalRender::default(), &studio.app.edited.document, path);
    assert!(
        words.expect("there is a picture").iter().any(|word| word.ends_with("bulb:factor=1,off"))
    );
}

/// Factors change the picture that there is, with the samples that it has, and are taken back like all else.
#[test]
fn a_light_mix_changes_the_picture_that_there_is() {
    let Some(mut studio) = studio("evening") else { return };
    studio.app.edited.document.stop.samples = Some(8);
    studio.app.edited.document.light_mix = true;
    studio.settle().expect("rendered");
    let snapshot =
        |studio: &Studio| Arc::clone(studio.app.rendering.snapshot.as_ref().expect("one"));
    let first = snapshot(&studio);
    let names: Vec<&str> = first.groups.iter().map(|group| &*group.name).collect();
    let all = ["light.sky", "light.sun", "lamp.bright bulb", "lamp.bulb", "lamp.lampshade"];
    assert_eq!(names, all);
    studio.app.edited.settle();
    (studio.app.edited.document.intensity, studio.app.edited.document.sun) = (3.0, 0.5);
    let dim = LampEdit { factor: 0.25, ..LampEdit::default() };
    studio.app.edited.document.lamp_edits.insert("bulb".to_owned(), dim);
    studio.settle().expect("rendered");
    let second = snapshot(&studio);
    let factors: Vec<f32> = second.groups.iter().map(|group| group.factor).collect();
    assert_eq!(factors, [3.0, 1.5, 1.0, 0.25, 1.0]);
    assert!(Arc::ptr_eq(&first.request.world, &second.request.world));
    assert_eq!(first.main.figures, second.main.figures, "nothing was rendered");
    let (image, expected) = (second.main.film.image(), &second.groups);
    for (index, pixel) in image.pixels.iter().enumerate() {
        let sum = expected.iter().map(|it| it.factor * it.image.pixels[index][0]).sum::<f32>();
        assert!((pixel[0] - sum).abs() <= 1e-4 * sum, "{pixel:?} {sum}");
    }
    studio.asks(Command::Undo);
    studio.settle().expect("rendered");
    assert_eq!(snapshot(&studio).main.film.image().pixels, first.main.film.image().pixels);
    assert_eq!(studio.app.edited.document.intensity, 1.0);
    // What is saved has a layer of each.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("mix.exr");
    studio.asks(Command::Save(path.clone()));
    studio.frame().expect("drawn");
    while !path.exists() {
        studio.frame().expect("drawn");
    }
    let has = |name: &str| {
        let bytes = std::fs::read(&path).expect("written");
        bytes.windows(name.len()).any(|it| it == name.as_bytes())
    };
    assert!(has("light.sky.R") && has("lamp.bulb.B"));
    // Without it the same light begins anew.
    studio.app.edited.document.light_mix = false;
    studio.settle().expect("rendered");
    assert!(snapshot(&studio).groups.is_empty());
}

/// Restored settings and undo name looks, too, which are read when they are needed.
#[test]
fn a_look_is_read_when_it_is_named_and_taken_back_if_it_cannot_be() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let white = "1 1 1\n".repeat(8);
    std::fs::write(path("white.cube"), format!("LUT_3D_SIZE 2\n{white}")).expect("written");
    std::fs::write(path("worse.CUBE"), "LUT_3D_SIZE 2\n1 1 1\n").expect("written");
    studio.settle().expect("rendered");
    let levels = |studio: &mut Studio| {
        studio.settle().expect("rendered");
        while studio.app.assets.looks.last != studio.app.edited.document.look.lut {
            studio.frame().expect("drawn");
        }
        studio.frame().expect("drawn");
        studio.app.display.read().expect("a picture").expect("read").pixels
    };
    let before = levels(&mut studio);
    studio.asks(Command::OpenLook(path("white.cube")));
    assert!(levels(&mut studio).iter().all(|rgb| *rgb == [255; 3]));
    let names = &studio.app.assets.looks.listed;
    assert!(names.len() == 2 && names[1].ends_with("worse.CUBE"), "{names:?}");
    studio.asks(Command::Undo);
    assert!(levels(&mut studio) == before);
    studio.asks(Command::Redo);
    assert!(levels(&mut studio).iter().all(|rgb| *rgb == [255; 3]));
    studio.app.edited.document.look.lut = Some("look:night".to_owned());
    let night = levels(&mut studio);
    let sum = |all: &[[u8; 3]]| all.as_flattened().iter().map(|x| u64::from(*x)).sum::<u64>();
    assert!(sum(&night) < sum(&before));
    // What cannot be read leaves the one that is there.
    studio.asks(Command::OpenLook(path("worse.CUBE")));
    while studio.app.messages.first_error().is_none() {
        studio.frame().expect("drawn");
    }
    assert_eq!(studio.app.edited.document.look.lut.as_deref(), Some("look:night"));
    let said = studio.app.messages.first_error();
    assert!(said.is_some_and(|said| said.contains("1 colours in place of 8")), "{said:?}");
}

#[test]
fn a_tile_that_a_smaller_map_does_not_have_is_shown_nowhere() {
    let Some(mut studio) = studio("open") else { return };
    let interface =
        Interface { overlay: Some(Overlay::Tile), tile: Some(100), ..Interface::default() };
    studio.arrange(interface);
    studio.settle().expect("rendered");
    studio.asks(Command::OpenMap("sky:day@4x2".to_owned()));
    studio.settle().expect("rendered");
}

/// Values that no slider stands at stay as they are until one is moved.
#[test]
fn what_is_only_looked_at_stays_as_it_is() {
    let Some(mut studio) = studio("office") else { return };
    studio.settle().expect("rendered");
    let document = &mut studio.app.edited.document;
    let viewpoint = document.viewpoint.as_mut().expect("there is a camera");
    viewpoint.fov_y_degrees = Some(22.945);
    (viewpoint.lens_radius, viewpoint.focus_distance) = (0.000_437, 0.003);
    (document.rotation_degrees, document.intensity, document.sun) = (22.517, 0.123_456, 1.062_5);
    document.background = Background::Blurred(0.123_456);
    let scattering = Vec3::new(1.234e-7, 20.0, 0.123_456_7);
    document.fog = Some(Medium { scattering, anisotropy: 0.987_65, ..Medium::default() });
    document.look.exposure_ev = 9.126;
    (document.look.lut, document.look.lut_strength) = (Some("look:soft".to_owned()), 0.123_4);
    document.look.white_balance = WhiteBalance { kelvin: 5_003.7, tint: 0.123_4 };
    document.light.bounces = 70;
    document.stop = StopRule { samples: Some(2_000_000), noise: Some(1e-6), seconds: Some(0.05) };
    let edit = MaterialEdit { roughness: Some(0.437_5), ..MaterialEdit::default() };
    document.materials.insert(0, edit);
    let before = document.clone();
    for tab in [Tab::Picture, Tab::Inspect, Tab::Scene] {
        studio.arrange(Interface { tab, material: Some(0), ..Interface::default() });
        (0..4).for_each(|_| studio.frame().expect("drawn"));
        assert_eq!(studio.app.edited.document, before, "{tab:?}");
    }
    // One that has not been changed is not changed by being chosen, either.
    studio.arrange(Interface { material: Some(1), ..Interface::default() });
    (0..4).for_each(|_| studio.frame().expect("drawn"));
    assert_eq!(studio.app.edited.document, before);
}

#[test]
fn errors_are_measured_against_a_reference_where_it_shows_the_same() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("reference.exr");
    write_picture(&file, &Image::filled(48, 32, [0.5; 3]));
    studio.asks(Command::OpenReference(file.display().to_string()));
    while studio.app.assets.reference.is_none() {
        studio.frame().expect("drawn");
        assert_eq!(studio.app.messages.first_error(), None);
    }
    // The light comes from elsewhere meanwhile.
    for (degrees, is_measured) in [(0.0, true), (30.0, false), (0.0, true)] {
        studio.app.edited.document.rotation_degrees = degrees;
        studio.settle().expect("rendered");
        let request = &studio.app.rendering.snapshot.as_ref().expect("it is there").request;
        assert_eq!(request.reference.is_some(), is_measured, "{degrees}");
    }
}

#[test]
fn the_truth_of_another_map_is_never_shown() {
    let Some(mut studio) = studio("open") else { return };
    studio.app.interface.tab = Tab::Inspect;
    studio.app.interface.pinned = Some(Vec2::new(0.5, 0.9));
    let measured = |studio: &mut Studio| {
        studio.measure_truth().expect("rendered");
        studio.settle().expect("measured");
        studio.app.rendering.inspector.truth().expect("there").shares.clone()
    };
    let day = measured(&mut studio);
    // One that is still being measured when the map changes, too.
    studio.asks(Command::MeasureTruth);
    studio.asks(Command::OpenMap("sky:overcast@64x32".to_owned()));
    studio.settle().expect("rendered");
    studio.frame().expect("drawn");
    assert!(studio.app.rendering.inspector.inspected.is_some());
    assert!(studio.app.rendering.inspector.truth().is_none(), "it is the old map's");
    assert_ne!(measured(&mut studio), day);
}

#[test]
fn maps_of_a_folder_are_listed_with_pictures() {
    let Some(mut studio) = studio("open") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    for name in ["b.exr", "a.exr"] {
        write_picture(Path::new(&path(name)), &Image::filled(16, 8, [0.5; 3]));
    }
    std::fs::write(path("c.hdr"), "no map").expect("written");
    std::fs::write(path("notes.txt"), "no map").expect("written");
    studio.asks(Command::OpenMap(path("b.exr")));
    let expected = ["a.exr", "b.exr", "c.hdr"].map(path);
    let until = |studio: &mut Studio, what: &dyn Fn(&Studio) -> bool| {
        for _ in 0..3000 {
            if what(studio) {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
            studio.frame().expect("drawn");
        }
        panic!("it never comes");
    };
    until(&mut studio, &|studio| studio.app.library.small_maps.beside(&expected[1]) == expected);
    let has = |studio: &Studio, i: usize| {
        studio.app.library.small_maps.textures.contains_key(&expected[i])
    };
    assert!(!has(&studio, 0) && has(&studio, 1), "that of the open one alone");
    studio.asks(Command::MakeSmallMap);
    until(&mut studio, &|studio| has(studio, 0));
    // What is no map is tried once.
    studio.asks(Command::MakeSmallMap);
    until(&mut studio, &|studio| !studio.app.library.small_maps.is_busy);
    assert!(!has(&studio, 2) && studio.app.library.small_maps.make_next().is_none());
    assert!(studio.app.messages.first_error().is_none());
    // A built-in one has no folder.
    assert!(studio.app.library.small_maps.beside("sky:day").is_empty());
}

/// A triangle, its positions in the file itself.
const TRIANGLE: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// As many messages as there can be, in long sentences, beside all that may be open.
#[test]
fn messages_lie_on_the_picture_alone() {
    for (size, scale) in
        [((720, 480), 1.0), ((1000, 650), 1.0), ((1440, 900), 1.0), ((3840, 2160), 2.0)]
    {
        let Some(studio) = studio_of("open", size) else { return };
        let mut studio = studio.at_scale(scale);
        studio.settle().expect("rendered");
        for dock in [None, Some(Dock::Needs), Some(Dock::Convergence)] {
            studio.arrange(Interface { dock, ..Interface::default() });
            for name in ["kitchen", "meadow", "bath", "hall", "attic"] {
                studio.app.messages.error(format!(
                    "/home/somebody/projects/an interior/{name}.glb: accessor 17 of the mesh \"curtain\" takes \
                     1234 bytes from buffer 0, which ends after 1230 of them"
                ));
                (0..4).for_each(|_| studio.frame().expect("drawn"));
            }
            let area = |memory: &egui::Memory| memory.area_rect(Id::unique("messages"));
            let messages = studio.context.memory(area).expect("they are drawn");
            let mut panels = Vec::new();
            let _ = studio.context.run_ui(egui::RawInput::default(), |ui| {
                for name in ["top", "left", "right", "status", "dock", "closed dock"] {
                    let state = PanelState::load(ui.ctx(), ui.make_persistent_id(name));
                    panels.extend(state.map(|state| (name, state.outer_rect)));
                }
            });
            println!("{size:?}, {dock:?}: {messages} {panels:?}");
            let of = |name: &str| panels.iter().find(|panel| panel.0 == name).map(|panel| panel.1);
            let has_dock = of("dock").is_some();
            assert!(panels.len() >= 3 && has_dock == dock.is_some(), "{panels:?}");
            let [Some(above), Some(below)] = [of("top"), of("dock").or(of("status"))] else {
                panic!("{panels:?}")
            };
            // Four of two lines, or as many as there is room for.
            let least = (below.top() - above.bottom() - 30.0).min(4.0 * 44.0);
            assert!(messages.height() > least, "{size:?}, {dock:?}: {messages}, {least}");
            for (name, panel) in panels {
                let is_apart = !panel.shrink(0.5).intersects(messages);
                assert!(is_apart, "{size:?}, {dock:?}: messages on {messages}, {name} on {panel}");
            }
            let screen = egui::Rect::from_min_size(
                egui::Pos2::ZERO,
                egui::vec2(size.0 as f32, size.1 as f32) / scale,
            );
            assert!(screen.contains_rect(messages), "{size:?}, {dock:?}: {messages}");
        }
    }
}

/// Names of materials and lamps on the command line are those of the scene there, and of no other one.
#[test]
fn what_is_asked_of_one_scene_is_not_asked_of_others() {
    let hide = vec!["no such material".to_owned()];
    let options = SceneOptions { hide, ..SceneOptions::default() };
    let document = Document { scene: "crack".to_owned(), ..Document::default() };
    let mut loader = Loader::start(&document, options, Arc::new(|| ()));
    let mut next = |name: &str| {
        loader.load_scene(name);
        loop {
            for (found, loaded) in loader.take() {
                if let Loaded::Scene(scene) = loaded
                    && found == name
                {
                    return scene.map(|scene| scene.name);
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    assert!(next("crack").is_err_and(|error| error.to_string().contains("no such material")));
    assert_eq!(next("open").ok(), Some("open".to_owned()));
}

#[test]
fn lamps_that_a_scene_does_not_have_are_said_and_forgotten() {
    let Some(mut studio) = studio("crack") else { return };
    let edit = LampEdit { off: true, ..LampEdit::default() };
    studio.app.edited.document.lamp_edits.insert("rim".to_owned(), edit);
    studio.app.assets.loader.load_scene("crack");
    studio.settle().expect("rendered");
    assert!(studio.app.edited.document.lamp_edits.is_empty());
    let said: Vec<_> = studio.app.messages.list.iter().map(|it| &*it.sentence).collect();
    assert!(said.iter().any(|it| it.contains("no lamp is called rim")), "{said:?}");
}
