//! A real window under Xvfb.

mod desk;
mod hands;
mod keys;
mod memory;
mod watch;

use std::path::Path;
use std::time::Duration;

use lightgrid::app::document::Viewpoint;
use lightgrid::app::settings_file::{SceneViewpoints, Settings};
use lightgrid::image::read_picture;
use lightgrid::scene::builtin;
use lightgrid::tone::auto_exposure_ev;

use desk::Desk;

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
    desk.save_until("picture from the GPU", |_, of| (of("device") != "CPU").then_some(()));
    desk.xdotool("key g");

    // A file that is not there changes nothing: the path can be mended, or the camera still be turned.
    desk.answer_and("ctrl+o", "none.glb", "key --delay 300 Return Escape");
    desk.wait_for("old scene", || desk.title().starts_with("open").then_some(()));

    // A drag turns the camera: another picture. It is taken back, also after the list of keys was open.
    desk.drag((560, 400), (-120, 20), Duration::ZERO);
    desk.save_until("turned picture", |now, _| (now.pixels != first.pixels).then_some(()));
    desk.xdotool("key question");
    desk.xdotool("key Escape");
    desk.xdotool("key ctrl+z");
    let eye = of("eye").expect("it is said");
    desk.save_until("first camera", |_, of| (of("eye") == eye).then_some(()));

    // A part of it, marked by a drag so fast that it may fall into one frame; then the whole again.
    desk.xdotool("key x");
    desk.drag((450, 300), (150, 120), Duration::ZERO);
    desk.save_until("part", |now, _| (now.width < 60 && now.height < 50).then_some(()));
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
    let large = desk
        .save_until("triangle", |now, of| (of("scene") == "room.gltf").then(|| now.pixels.clone()));
    triangle(&desk.path("room.gltf"), 0.3);
    desk.xdotool("key F5");
    desk.save_until("small triangle", |now, _| (now.pixels != large).then_some(()));

    // Another scene.
    desk.answer("ctrl+o", "crack");
    desk.wait_for("new scene", || desk.title().starts_with("crack").then_some(()));
    desk.save("crack.png");

    desk.xdotool("key ctrl+q");
    desk.ends();
    let settings = std::fs::read_to_string(desk.path("window.json")).expect("settings");
    assert!(settings.contains("window_size"), "{settings}");
}

/// A file that another process renders is of what the window shows; a window that is closed ends it early, and it is
/// there all the same.
#[test]
fn files_are_rendered_beside_the_window() {
    let Some(mut desk) = Desk::open() else { return };
    let view = "view open --env sky:day@64x32 --size 96x64 --device cpu --settings window.json";
    desk.start(&format!("{view} --samples 2"));
    desk.save("window.exr");
    desk.answer("ctrl+r", "final.exr");
    let path = desk.path("final.exr");
    let picture = desk.wait_for("file", || path.exists().then(|| read_picture(&path)));
    let picture = picture.expect("a picture");
    assert_eq!((picture.width, picture.height), (1920, 1080));
    // What it looks at is named by another distance.
    for key in ["scene", "eye", "fov_degrees"] {
        let [window, file] = ["window.exr", "final.exr"].map(|name| desk.metadata(name, key));
        assert_eq!(window, file, "{key}");
    }
    // The one from the window may have been saved before it was done.
    assert_eq!(desk.metadata("final.exr", "samples_per_pixel").as_deref(), Some("2"));
    desk.xdotool("key ctrl+q");
    desk.ends();

    let path = desk.path("long.png");
    let is_there = [5, 30, 120].map(Duration::from_secs).into_iter().any(|wait| {
        desk.start(&format!("{view} --samples 1000000"));
        desk.save_until("picture", |_, _| Some(()));
        desk.answer("ctrl+r", "long.png");
        std::thread::sleep(wait);
        desk.xdotool("key ctrl+q");
        std::thread::sleep(Duration::from_secs(1));
        let window = desk.window.as_mut().expect("started");
        assert!(window.try_wait().expect("asked").is_none(), "it closes unasked");
        desk.xdotool("key ctrl+q");
        desk.ends();
        path.exists()
    });
    assert!(is_there, "nothing is written: {}", desk.says());
}

#[test]
fn a_window_whose_size_changes_keeps_the_gpu_that_renders() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start("view open --env sky:day@64x32 --size 96x64 --device gpu --settings window.json");
    desk.save_until("picture from the GPU", |_, of| (of("device") != "CPU").then_some(()));
    // Each has its surface made anew, while the GPU has work to do.
    for step in 0..12 {
        let (width, height) = (1000 - 20 * step, 700 - 10 * step);
        desk.xdotool(&format!("windowsize --sync {} {width} {height}", desk.id));
        std::thread::sleep(Duration::from_millis(150));
    }
    desk.save("resized.exr");
    let device = desk.metadata("resized.exr", "device");
    assert_ne!(device.as_deref(), Some("CPU"), "{}", desk.says());
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
    desk.ends();
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

#[cfg(unix)]
#[test]
fn a_request_to_end_closes_a_window_as_a_person_would() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view open --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings w.json",
    );
    crate::cli::send(desk.window.as_ref().expect("started"), "-TERM");
    desk.ends();
    assert!(desk.path("w.json").exists(), "the settings are kept");
}
