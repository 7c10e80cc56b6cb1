//! What the render thread answers to what it is asked for.

use std::time::{Duration, Instant};

use super::preview::MAX_GAP;
use super::snapshot::PublishThrottle;
use super::*;
use crate::environment::{Environment, EnvironmentOptions, sky};
use crate::path::World;
use crate::render::gpu::DeviceChoice;
use crate::render::light_groups::LightFactors;
use crate::render::{StopRule, View};
use crate::scene::{LampEdits, builtin};

/// What a window asks for that has just opened.
pub(super) fn request(world: Arc<World>, environment: Arc<Environment>, size: [u32; 2]) -> Request {
    Request {
        view: View::new(world.scene.cameras[0].clone(), size),
        world,
        environment,
        split: false,
        moving: false,
        previews: true,
        device: DeviceChoice::Cpu,
        wants_cached: false,
        inspects_cache: false,
        rule: StopRule::default(),
        is_frozen: false,
        reference: None,
        mix: None,
        paused: false,
        run: 0,
    }
}

/// What is there of a session's picture.
pub(in crate::app) fn snapshot_of(request: &Arc<Request>, main: SessionSnapshot) -> Snapshot {
    Snapshot {
        number: main.figures.samples,
        learning_step: None,
        request: Arc::clone(request),
        activity: Activity::Rendering,
        now: main.figures,
        main,
        plain: None,
        counters: None,
        cache: Err(NoCache::Unasked),
        curves: [Vec::new(), Vec::new()],
        groups: Arc::default(),
        backdrop: None,
        cut_off: None,
        cached_seconds: 0.0,
        errors: None,
        rest: Arc::new(PublishThrottle::new()),
    }
}

/// The same for a built-in scene under a soft sky.
pub(in crate::app) fn request_of(scene: &str, size: [u32; 2]) -> Request {
    let map = sky::build("overcast", 64, 32).expect("a sky");
    let environment = Environment::new(map, &EnvironmentOptions::default());
    let world = World::new(builtin::build(scene).expect("built in"));
    request(Arc::new(world), Arc::new(environment.expect("a sound map")), size)
}

/// A worker beside a window; `None`, which is said, where none can be drawn.
fn worker() -> Option<Worker> {
    let gpu = Gpu::for_test()?;
    let worker = Worker::start(Arc::new(|| ()), (None, RayChoice::default()), gpu);
    Some(worker.expect("threads can be had"))
}

/// Waits until a snapshot is as it should be.
fn wait_for(worker: &Worker, is_right: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
    let start = Instant::now();
    loop {
        if let Some(snapshot) = worker.snapshot().filter(|snapshot| is_right(snapshot)) {
            return snapshot;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "it never comes");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn what_was_learned_outlives_a_change_of_colour() {
    let Some(worker) = worker() else { return };
    let request = Request {
        previews: false,
        rule: StopRule { samples: Some(2), ..StopRule::default() },
        ..request_of("crack", [32, 24])
    };
    let done = |world: &Arc<World>| {
        worker.submit(Request { world: Arc::clone(world), ..request.clone() });
        let is_done = |snapshot: &Snapshot| snapshot.activity == Activity::Done;
        wait_for(&worker, |now| is_done(now) && Arc::ptr_eq(&now.request.world, world))
    };
    let changed = |change: &dyn Fn(&mut crate::scene::Material)| {
        let mut materials = request.world.scene.materials.clone();
        materials.iter_mut().for_each(change);
        Arc::new(
            request
                .world
                .with_looks(materials, request.world.scene.lights.clone())
                .expect("there is memory"),
        )
    };
    assert!(done(&request.world).now.learning_paths > 0);
    let darker = changed(&|material| material.base_color *= glam::Vec4::new(0.5, 0.5, 0.5, 1.0));
    let after = done(&darker);
    assert_eq!(after.now.learning_paths, 0, "it goes on with what was learned");
    assert!(after.now.learned_cells > 0);
    let open = changed(&|material| material.transmission = 0.9);
    assert!(done(&open).now.learning_paths > 0, "more light comes in");
}

#[test]
fn whoever_comes_back_to_a_picture_finds_it_as_it_was() {
    let Some(worker) = worker() else { return };
    let request = request_of("office", [320, 240]);
    worker.submit(request.clone());
    let is_worth_it = |now: &Snapshot| now.now.samples > 16 * 320 * 240 && now.is_whole();
    let before = wait_for(&worker, is_worth_it).now.samples;
    let crop = crate::render::Crop { corner: [0, 0], whole: [320, 240] };
    let view = View { width: 80, height: 60, crop: Some(crop), ..request.view.clone() };
    worker.submit(Request { view, ..request.clone() });
    wait_for(&worker, |now| now.is_whole() && now.request.view.crop.is_some());
    // The map was turned and turned back.
    let environment = Arc::new((*request.environment).clone());
    worker.submit(Request { environment, ..request.clone() });
    let after = wait_for(&worker, |now| now.request.view.crop.is_none());
    assert!(after.now.samples >= before, "{} and then {}", before, after.now.samples);
    // Begun again by hand it is begun again.
    worker.submit(Request { run: 1, ..request });
    let again = wait_for(&worker, |now| now.request.run == 1);
    assert!(again.now.samples < before);
}

#[test]
fn whoever_comes_back_sees_the_cached_light_that_there_was() {
    let Some(worker) = worker() else { return };
    let request = Request { wants_cached: true, ..request_of("office", [640, 480]) };
    let of_cache = |now: &Snapshot| now.backdrop.clone();
    worker.submit(request.clone());
    wait_for(&worker, |now| of_cache(now).is_some() && now.seconds() > 1.5);
    let paused = Request { paused: true, ..request };
    worker.submit(paused.clone());
    let left = wait_for(&worker, |now| now.activity == Activity::Paused);
    let cached = of_cache(&left).expect("it is shown");
    assert!(cached.samples < 16 * 640 * 480, "it is under way");
    // Under another map, and under the same one read again.
    let lit = |sky| {
        let map = sky::build(sky, 64, 32).expect("a sky");
        Environment::new(map, &EnvironmentOptions::default()).expect("a sound map")
    };
    let other = Arc::new(lit("day"));
    worker.submit(Request { environment: Arc::clone(&other), ..paused.clone() });
    wait_for(&worker, |now| Arc::ptr_eq(&now.request.environment, &other));
    let again = Arc::new(lit("overcast"));
    worker.submit(Request { environment: Arc::clone(&again), ..paused.clone() });
    let back = wait_for(&worker, |now| Arc::ptr_eq(&now.request.environment, &again));
    let shown = of_cache(&back).expect("it is shown again");
    assert!(back.main.film == left.main.film && shown.film == cached.film, "the same picture");
    assert_eq!((shown.samples, shown.worth), (cached.samples, cached.worth));
    // It goes on.
    worker.submit(Request { environment: again, paused: false, ..paused });
    wait_for(&worker, |now| of_cache(now).is_some_and(|now| now.samples > cached.samples));
}

#[test]
fn whoever_comes_back_to_a_light_mix_finds_the_pictures_of_all_its_groups() {
    let Some(worker) = worker() else { return };
    let lamp_edits = LampEdits::new();
    let mix = Some(LightFactors { intensity: 1.0, sun: 1.0, lamps: 1.0, lamp_edits });
    let request = Request { mix, ..request_of("evening", [160, 120]) };
    worker.submit(request.clone());
    wait_for(&worker, |now| now.main.samples > 1 && now.seconds() > 1.5);
    let paused = Request { paused: true, ..request };
    worker.submit(paused.clone());
    let left = wait_for(&worker, |now| now.activity == Activity::Paused);
    assert!(left.groups.len() > 2);
    let mut moved = paused.clone();
    moved.view.camera.world_from_camera.translation.x += 1.0;
    worker.submit(moved.clone());
    wait_for(&worker, |now| now.request.view == moved.view);
    worker.submit(paused.clone());
    let back = wait_for(&worker, |now| now.request.view == paused.view);
    assert!(back.main.film == left.main.film, "the same picture");
}

#[test]
fn what_a_picture_begins_with_is_shown_when_it_is_everywhere() {
    let Some(worker) = worker() else { return };
    let before = request_of("office", [320, 240]);
    worker.submit(before.clone());
    wait_for(&worker, Snapshot::is_whole);
    // What there was is the middle of what is asked for now.
    let view = View { width: 4000, height: 1200, ..before.view.clone() };
    worker.submit(Request { view, wants_cached: true, ..before });
    let is_shown = |now: &Snapshot| now.request.view.width == 4000 && now.has_picture();
    let first = wait_for(&worker, is_shown);
    let cached = first.backdrop.as_ref().is_some_and(|backdrop| backdrop.film.is_begun());
    assert!(cached || first.main.film.is_begun(), "not in streaks");
}

#[test]
fn the_cpu_goes_on_until_a_gpu_is_ready() {
    let Some(worker) = worker() else { return };
    let request = Request { device: DeviceChoice::Gpu, ..request_of("office", [96, 72]) };
    worker.submit(request.clone());
    let (start, mut counts) = (Instant::now(), std::collections::BTreeSet::new());
    // When the first picture of the preparation was seen, and when it was last seen to go on.
    let (mut first, mut last) = (None, Instant::now());
    while worker.snapshot().is_none_or(|snapshot| snapshot.main.gpu.is_none()) {
        assert!(start.elapsed() < Duration::from_secs(120), "it is never ready");
        if let Some(snapshot) = worker.snapshot().filter(|_| worker.is_preparing()) {
            counts.insert(snapshot.now.samples);
            last = Instant::now();
            first = first.or(Some(last));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    // Caches of drivers may make it quick: there is a picture in each gap at least.
    let seconds = last - first.expect("there is a picture meanwhile");
    let least = (seconds.as_millis() / MAX_GAP.as_millis()).clamp(1, 3) as usize;
    assert!(counts.len() > least, "it stood still: {counts:?}");
    let now = worker.snapshot().expect("there was one").now;
    assert!(counts.iter().all(|count| *count <= now.samples), "nothing of it is lost");
    // The next moments of the same scene have their kernels.
    let view = View { seed: 7, ..request.view.clone() };
    worker.submit(Request { view, ..request });
    wait_for(&worker, |now| now.request.view.seed == 7 && now.main.gpu.is_some());
}

#[test]
fn a_picture_that_is_done_moves_to_the_gpu_that_is_asked_for() {
    let Some(worker) = worker() else { return };
    let rule = StopRule { samples: Some(2), ..StopRule::default() };
    let request = Request { rule, ..request_of("crack", [32, 24]) };
    let is_done = |now: &Snapshot| now.activity == Activity::Done;
    worker.submit(request.clone());
    let before = wait_for(&worker, is_done);
    let request = Request { device: DeviceChoice::Gpu, ..request };
    worker.submit(request.clone());
    let after = wait_for(&worker, |now| is_done(now) && now.main.gpu.is_some());
    assert_eq!(after.now.samples, before.now.samples);
    assert!(after.main.film == before.main.film, "the same picture");
    worker.submit(Request { device: DeviceChoice::Cpu, ..request });
    wait_for(&worker, |now| is_done(now) && now.main.gpu.is_none());
}

#[test]
fn nothing_is_left_under_way_when_the_window_closes() {
    let Some(worker) = worker() else { return };
    worker.submit(Request { device: DeviceChoice::Gpu, ..request_of("crack", [32, 24]) });
    let start = Instant::now();
    while !worker.is_preparing() {
        assert!(start.elapsed() < Duration::from_secs(120), "it is never prepared");
        std::thread::sleep(Duration::from_millis(1));
    }
    let shared = Arc::clone(&worker.shared);
    drop(worker);
    assert_eq!(shared.preparations.load(Ordering::Relaxed), 0);
}

#[test]
fn a_movement_is_seen_while_it_goes_on() {
    let Some(worker) = worker() else { return };
    let mut request = Request { moving: true, ..request_of("office", [640, 480]) };
    let (start, mut seen) = (Instant::now(), std::collections::BTreeSet::new());
    while seen.len() < 3 {
        assert!(start.elapsed() < Duration::from_secs(120), "pictures are ended by the next");
        request.view.camera.world_from_camera.translation.x += 1e-4;
        worker.submit(request.clone());
        std::thread::sleep(Duration::from_millis(2));
        seen.extend(worker.snapshot().map(|snapshot| {
            assert_eq!(snapshot.activity, Activity::Moving);
            snapshot.number
        }));
    }
    // Something else is not kept waiting, and nothing else is shown for it.
    assert!(!request.is_followed_by(&request_of("office", [640, 480])));
    let at_rest = Request { moving: false, ..request.clone() };
    assert!(!request.is_followed_by(&at_rest));
    // Its last picture is that of the view at rest.
    assert!(!request.is_left_for(&at_rest) && at_rest.is_left_for(&request));
    let mut elsewhere = at_rest.clone();
    elsewhere.view.camera.world_from_camera.translation.x += 0.05;
    assert!(request.is_left_for(&elsewhere) && !request.is_left_for(&request));
}

#[test]
fn a_split_view_goes_on_with_the_picture_that_there_is() {
    let Some(worker) = worker() else { return };
    let rule = StopRule { samples: Some(16), ..StopRule::default() };
    let request = Request { rule, ..request_of("open", [64, 48]) };
    worker.submit(request.clone());
    let is_done = |now: &Snapshot| now.activity == Activity::Done;
    let before = wait_for(&worker, is_done);
    worker.submit(Request { split: true, ..request });
    let after = wait_for(&worker, |now| is_done(now) && now.plain.is_some());
    assert_eq!(after.main.figures, before.main.figures, "nothing of it is done again");
    let plain = after.plain.as_ref().expect("there is one").figures;
    assert!(plain.elapsed_seconds() >= before.now.elapsed_seconds(), "at equal time");
}

#[test]
fn films_are_copied_when_they_are_wanted() {
    let Some(worker) = worker() else { return };
    let request = request_of("open", [64, 48]);
    worker.submit(request.clone());
    let first = wait_for(&worker, |snapshot| snapshot.main.samples > 1);
    first.rest.set_end(Instant::now() + Duration::from_secs(600));
    // One may have been under way.
    let number = worker.snapshot().expect("there was one").number + 1;
    let resting = wait_for(&worker, |snapshot| snapshot.number > number);
    let later = wait_for(&worker, |now| now.now.samples > 2 * resting.now.samples);
    assert!(Arc::ptr_eq(&later.main.film, &resting.main.film), "nobody wants another");
    assert_eq!(later.main.figures.samples, resting.main.figures.samples, "its own figures");
    first.rest.set_end(Instant::now());
    let awake = wait_for(&worker, |now| now.main.film.total_samples() >= later.now.samples);
    assert_eq!(awake.main.figures.samples, awake.main.film.total_samples());
    // Whoever pauses sees the last of it.
    awake.rest.set_end(Instant::now() + Duration::from_secs(600));
    worker.submit(Request { paused: true, ..request });
    let last = wait_for(&worker, |snapshot| snapshot.activity == Activity::Paused);
    assert_eq!(last.main.film.total_samples(), last.now.samples);
}
