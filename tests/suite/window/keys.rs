//! What keys do, and what they leave as it is.

use std::time::{Duration, Instant};

use lightgrid::app::document::PictureSize;
use lightgrid::app::settings_file::Settings;

use super::Desk;

/// How long nothing else is typed where a prompt is expected to go.
const PATIENCE: Duration = Duration::from_secs(20);

#[test]
fn sheets_prompts_and_panels_come_and_go_by_keys_and_the_film_stays() {
    let Some(mut desk) = Desk::open() else { return };
    // It is as large as the room that panels leave it.
    let settings = Settings { size: PictureSize::Viewport(4), ..Settings::default() };
    settings.write(&desk.path("w.json")).expect("written");
    // A browser, which writes down what it is to show.
    #[cfg(unix)]
    {
        let script = format!("echo \"$1\" > '{}'", desk.path("page.txt").display());
        crate::cli::install(&desk.path("programs"), "xdg-open", &script);
    }
    desk.start("view crack --env sky:day@64x32 --samples 2 --device cpu --settings w.json");
    let film = |what: &str| {
        desk.save_until(what, |now, of| {
            (of("samples_per_pixel") == "2").then(|| (now.pixels.clone(), of("seconds")))
        })
    };
    desk.save("first.exr");

    // The sheet of keys lies over some of the buttons.
    let buttons = || desk.levels(280..700, 5..36);
    let before = buttons();
    desk.xdotool("key question");
    desk.wait_for("sheet of keys", || (buttons() != before).then_some(()));
    desk.xdotool("key Escape");
    desk.wait_for("end of the sheet", || (buttons() == before).then_some(()));

    // Enter without a path leaves the prompt and its field as they are. What is typed in the same frame is lost.
    let level = desk.ask("ctrl+o");
    desk.xdotool("key Return");
    desk.wait_for("scene by its name", || {
        desk.type_anew("open");
        desk.xdotool("key Return");
        let typed = Instant::now();
        while !desk.is_answered(level) && typed.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(100));
        }
        desk.is_answered(level).then_some(())
    });
    desk.wait_for("new scene", || desk.title().starts_with("open").then_some(()));

    // Where no desktop fills the screen with it, the window goes on as it was.
    let kept = film("film of the scene");
    let tabs = || desk.levels(990..1090, 5..36);
    for key in ["F11", "F12", "F11", "F12"] {
        let before = tabs();
        desk.xdotool(&format!("key {key}"));
        if key == "F12" {
            desk.wait_for("developer's panel", || (tabs() != before).then_some(()));
        }
        assert!(film(key) == kept, "{key}: another film");
    }

    // What is known of the method lies one click away.
    #[cfg(unix)]
    {
        let before = tabs();
        desk.xdotool("key F12");
        desk.wait_for("developer's panel", || (tabs() != before).then_some(()));
        desk.xdotool("mousemove 862 160 sleep 1 click 1");
        let shown = || std::fs::read_to_string(desk.path("page.txt")).ok();
        let page = desk.wait_for("browser", || shown().filter(|page| page.ends_with('\n')));
        assert_eq!(page.trim(), "https://dl.acm.org/doi/10.1145/3214745.3214808");
    }

    desk.ask("ctrl+o");
    desk.type_anew("abc");
    desk.xdotool("key ctrl+q");
    desk.ends();
}

#[test]
fn a_window_closes_soon_though_a_gpu_is_being_prepared() {
    let Some(mut desk) = Desk::open() else { return };
    let start = Instant::now();
    desk.start(
        "view office --env sky:day@64x32 --size 96x64 --samples 2 --device cpu --settings w.json",
    );
    desk.save("first.exr");
    let patience = Duration::from_secs(60) + 10 * start.elapsed();
    let status = || desk.levels(5..150, 732..754);
    let before = status();
    desk.xdotool("key g");
    desk.wait_for("GPU on its way", || (status() != before).then_some(()));
    let asked = Instant::now();
    desk.xdotool("key ctrl+q");
    desk.ends();
    let elapsed = asked.elapsed();
    assert!(elapsed < patience, "it takes {elapsed:?}");
}
