//! What a window takes of memory.

use std::time::Duration;

use super::Desk;

/// So much it may take in the end: a part more, and what the system gives and takes as it likes.
fn most(before: f64) -> f64 {
    1.3 * before + 40.0
}

/// What stayed of each round would be seen in the end, were it some 30 megabytes of about 300.
#[test]
fn scenes_cameras_and_devices_come_and_go_and_memory_stays_flat() {
    let Some(mut desk) = Desk::open() else { return };
    desk.start(
        "view office --env sky:day@64x32 --size 240x160 --samples 1 --device cpu --settings w.json",
    );
    if desk.megabytes().is_none() {
        eprintln!("SKIPPED: this system does not tell what a program takes");
        return;
    }
    let round = || {
        let mut least = f64::INFINITY;
        for (scene, is_on_gpu) in [("crack", false), ("office", true)] {
            desk.answer("ctrl+o", scene);
            desk.save_until("picture of the scene", |_, of| {
                least = least.min(desk.megabytes().expect("it was told before"));
                (of("scene") == scene && (of("device") != "CPU") == is_on_gpu).then_some(())
            });
            desk.drag((560, 400), (-120, 20), Duration::ZERO);
            desk.xdotool("key g");
        }
        least
    };
    let taken: Vec<f64> = (0..6).map(|_| round()).collect();
    println!("megabytes after each round: {taken:.0?}");
    assert!(taken[5] <= most(taken[1]), "it grows: {taken:.0?}");
}
