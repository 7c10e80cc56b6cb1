//! What a hand on the mouse does: changes a material, and walks about.

use std::time::Duration;

use glam::Vec3;
use lightgrid::app::document::Viewpoint;
use lightgrid::app::settings_file::Settings;
use lightgrid::image::Image;
use lightgrid::metrics::compare;

use super::Desk;

#[test]
fn a_material_is_hidden_and_comes_back_and_walls_stop_the_camera() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view office --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings w.json",
    );
    hide_and_undo(&desk);
    put_sun(&desk);
    desk.answer("ctrl+o", "crack");
    desk.save_until("closed room", |_, of| (of("scene") == "crack").then_some(()));
    orbit(&desk);
    desk.xdotool("key ctrl+q");
    desk.ends();
}

/// Hides what is clicked, and takes that back.
fn hide_and_undo(desk: &Desk) {
    let first = desk.save("first.exr");
    // Coarse differences: a few samples differ from pixel to pixel.
    let change = |now: &Image| compare(now, &first).expect("of a size").block_rel_mse;
    let panel = || desk.levels(0..250, 540..720);
    let before = panel();
    desk.xdotool("mousemove 560 500 click 1");
    desk.wait_for("material's settings", || (panel() != before).then_some(()));
    // They end above the line below; where they still move, the click is for nothing.
    let hidden = desk.wait_for("hidden material", || {
        desk.xdotool("mousemove 20 707 click 1");
        desk.save_until("picture", |now, of| {
            Some(of("materials").ends_with(":hidden\"]").then(|| change(now)))
        })
    });
    let back = desk.wait_for("material again", || {
        desk.xdotool("key ctrl+z");
        desk.save_until("picture", |now, of| Some((of("materials") == "[]").then(|| change(now))))
    });
    println!("changed by {hidden:.3}, and back by {back:.3}");
    assert!(back < 0.4 * hidden, "{back} of {hidden} is left");
}

/// Puts the sun on the floor by a click, and takes that back.
fn put_sun(desk: &Desk) {
    let turned = |is_so: fn(f64) -> bool| {
        desk.save_until("picture", |_, of| {
            let degrees: f64 = of("env_rotation_degrees").parse().expect("a number");
            Some(is_so(degrees).then_some(()))
        })
    };
    desk.wait_for("sun on the floor", || {
        desk.xdotool("key l mousemove 560 500 click 1");
        turned(|degrees| degrees > 0.0)
    });
    desk.wait_for("sun where it was", || {
        desk.xdotool("key ctrl+z");
        turned(|degrees| degrees == 0.0)
    });
}

/// Of the store room `crack`: 4 x 2.5 x 3 metres, with a slit that no camera comes through.
const ROOM: [Vec3; 2] = [Vec3::new(-2.0, 0.0, -1.5), Vec3::new(2.0, 2.5, 1.5)];

/// Drags on and on, and keeps where it came to.
fn orbit(desk: &Desk) {
    let ways = [(400, 0), (400, 0), (400, 100), (-400, -150), (0, 200), (400, -200), (-300, 200)];
    for (x, y) in ways {
        desk.drag((530 - x / 2, 400 - y / 2), (x, y), Duration::ZERO);
        desk.xdotool("key b");
    }
    let views: Vec<Viewpoint> = desk.wait_for("viewpoints", || {
        let settings = Settings::read(&desk.path("w.json")).ok()?;
        let kept = settings.viewpoints.into_iter().find(|kept| kept.scene == "crack")?;
        (kept.viewpoints.len() == ways.len()).then_some(kept.viewpoints)
    });
    for (view, before) in views.iter().skip(1).zip(&views) {
        assert_ne!(view.rotation, before.rotation, "it turns: {views:#?}");
    }
    // As far from its pivot as it is, it would be outside nearly everywhere.
    let (low, high) = (ROOM[0] - 0.01, ROOM[1] + 0.01);
    for view in &views {
        let eye = view.eye();
        let is_inside = eye.cmpge(low).all() && eye.cmple(high).all();
        assert!(is_inside && view.pivot_distance > 2.5, "outside: {view:#?}");
    }
}
