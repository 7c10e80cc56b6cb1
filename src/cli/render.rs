//! `lightgrid render`.

mod arguments;
mod beside;
mod frames;
mod outputs;
mod render_job;
mod traced;

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::device::TakeOver;
use super::interrupt::Interrupt;
use super::progress::Progress;
use crate::alarm::Alarm;
use crate::environment::Environment;
use crate::environment::sun::Sun;
use crate::error::{At as _, Error, Notices, Result};
use crate::image::exr_encoder_bytes;
use crate::light_grid::LearningGrid;
use crate::memory;
use crate::output::record::{Phases, Record};
use crate::output::{self, Exposure, Films};
use crate::path::{Lit, World};
use crate::render::film::Film;
use crate::render::gpu::UploadedScene;
use crate::render::light_groups::LightGroup;
use crate::render::sun_placement::SunPlacement;
use crate::render::{Driver, Figures, Session, View, cut_off_notice};
use crate::scene::Camera;
use crate::terminal::notice;
pub(super) use arguments::RenderArguments;
use beside::Beside;
use frames::{Frames, Reel};
use render_job::RenderJob;
use traced::{Sums, Traced};

/// Bytes of a pixel in the film, those by which noise is told among them, and in what is made of it to be written.
const BYTES_OF_PIXEL: [u64; 2] = [56, 40];
/// The same with layers.
const BYTES_WITH_LAYERS: [u64; 2] = [120, 72];
/// What takes noise out of a film with layers, or makes a part of it, takes.
const BYTES_OF_COPY: u64 = 136;

/// Most channels of a picture, and of one with layers.
const CHANNELS: [u64; 2] = [5, 15];

/// Bytes that the encoder of `.png` and the buffers of files take, and what is too small to be counted.
const BYTES_OF_ENCODERS: u64 = 16 << 20;

/// Loads, learns, renders, writes.
pub(super) fn run(arguments: &RenderArguments) -> Result<()> {
    outputs::check(arguments)?;
    super::device::check(arguments.device)?;
    start_threads(arguments.threads)?;
    let interrupt = Interrupt::watch("stopping after this pass and writing the picture");
    if arguments.watched {
        interrupt.follow_input();
    }
    let progress = Progress::start("loading the scene and the map");
    // Side by side: a large scene and a large map take seconds each.
    let (world, light) = rayon::join(|| load_world(arguments), || load_environment(arguments));
    let (world, load_scene_seconds, build_bvh_seconds) = world?;
    let (mut environment, map_notices, load_map_seconds, build_table_seconds) = light?;
    if let Some(path) = &arguments.distributions
        && environment.is_black()
    {
        return Err(outputs::without_distributions(path));
    }
    let phases =
        Phases { load_scene_seconds, build_bvh_seconds, load_map_seconds, build_table_seconds };

    let mut notices = world.scene.notices.clone();
    notices.extend(&map_notices);
    let camera = arguments.camera(&world, &mut notices)?;
    let mut arguments = Cow::Borrowed(arguments);
    if let Some(place) = arguments.sun_at {
        let view = View::new(camera.clone(), arguments.size.into());
        let sun = Sun::of(environment.map());
        let found = SunPlacement::find(&world, &view, sun.as_ref(), place, 0.0)
            .map_err(|cause| Error::new(format!("--sun-at {},{}: {cause}", place.x, place.y)))?;
        let degrees = found.rotation_degrees;
        environment.set_rotation(degrees.to_radians());
        notices
            .add(format!("--sun-at turns the map by {degrees} degrees, as --env-rotation would"));
        found.notice().into_iter().for_each(|sentence| notices.add(sentence));
        arguments.to_mut().env_rotation = f64::from(degrees);
    }
    let arguments = &*arguments;
    arguments.check_fog(&world.scene, &mut notices);
    let cut_off = cut_off_notice((&world, &environment), &arguments.view(&world, camera.clone()));
    cut_off.into_iter().for_each(|sentence| notices.add(sentence));
    let frames = Frames::plan(arguments, &world, &camera)?;
    let [of_film, of_writing] = needed_bytes(arguments);
    memory::check(of_film + of_writing).map_err(|cause| too_large(&cause))?;
    progress.finish();
    notices.iter().for_each(notice);
    let mut cpu = TakeOver { choice: arguments.device, notices: &mut notices };
    let gpu = cpu.open(arguments.adapter.as_deref(), arguments.rays)?;
    let gpu = gpu.map(|gpu| gpu.with_schedule(arguments.schedule));
    let on_gpu = gpu.map(|gpu| UploadedScene::new(&gpu, &world, &environment));
    let uploaded = cpu.renders_instead(on_gpu.transpose())?;
    let job =
        Job { world: &world, environment: &environment, phases, notices, uploaded, interrupt };
    match frames {
        None => {
            let progress = Progress::of_picture(arguments.watched);
            job.render(arguments, camera, None, &progress).and_then(Error::all)
        }
        Some(frames) => job.render_frames(arguments, &frames, &camera),
    }
}

/// What the film takes, and what writing it does: pixels and encoders.
fn needed_bytes(arguments: &RenderArguments) -> [u64; 2] {
    let [width, height] = arguments.size();
    let has_layers = arguments.wants_surfaces();
    let [film, mut writing] = if has_layers { BYTES_WITH_LAYERS } else { BYTES_OF_PIXEL };
    let is_denoised = arguments.picture.is_denoised(&arguments.pictures());
    if has_layers && (arguments.part.is_some() || is_denoised) {
        writing = BYTES_OF_COPY;
    }
    if arguments.seconds.is_some() {
        // Where pixels have no sample, a copy of the film has the mean of those around them.
        writing += film;
    }
    let [film, writing] = [film, writing].map(|bytes| u64::from(width) * u64::from(height) * bytes);
    let encoders = exr_encoder_bytes(width, CHANNELS[usize::from(has_layers)]) + BYTES_OF_ENCODERS;
    [film, writing + encoders]
}

fn too_large(cause: &str) -> Error {
    Error::new(format!("a picture of this size {cause}"))
}

/// What a picture leaves to the next.
#[derive(Default)]
struct Known {
    exposure: Option<Exposure>,
    /// What its paths have seen.
    counted: Option<LearningGrid>,
}

/// What all pictures of a command have in common.
struct Job<'a> {
    world: &'a World,
    environment: &'a Environment,
    phases: Phases,
    notices: Notices,
    uploaded: Option<UploadedScene>,
    interrupt: Interrupt,
}

impl Job<'_> {
    /// Renders and writes one picture; returns what could not be written. `known` is what those before it
    /// have left, and then what it leaves to the next, if there may be one.
    fn render(
        &self,
        arguments: &RenderArguments,
        camera: Camera,
        known: Option<&mut Known>,
        progress: &Progress,
    ) -> Result<Vec<Error>> {
        let Self { world, environment, .. } = *self;
        let mut notices = self.notices.clone();
        // Were there no memory any more when it is finished, the picture would be lost.
        let [film_bytes, spare_bytes] = needed_bytes(arguments);
        let spare: Vec<u8> = memory::reserved(spare_bytes).map_err(|cause| too_large(&cause))?;
        let view = arguments.view(world, camera);
        let mut groups = Vec::new();
        let mut each = vec![((world, environment), view.clone())];
        if arguments.light_groups {
            groups = LightGroup::all_of((world, environment), environment.parted()?, &view);
            let of_group = |(number, group)| LightGroup::view(group, &view, number);
            let views = (0..).zip(&groups).map(of_group);
            let lit = groups.iter().map(|group| (world, &group.environment));
            each = lit.zip(views).collect();
            // Each has a film, one of cached light, and a layer.
            memory::check(3 * groups.len() as u64 * film_bytes)
                .map_err(|cause| too_large(&cause))?;
        }
        let count = each.len();
        let seconds = arguments.seconds.map(|seconds| seconds / count as f64);
        let of_each = RenderArguments { seconds, ..arguments.clone() };
        let counted = known.as_ref().and_then(|known| known.counted.as_ref());
        let (mut assignments, mut pictures, mut outcome) = (Vec::new(), Vec::new(), Ok(()));
        for (lit, view) in each {
            // After a person's wish to end, each of the others gets a sample.
            if !pictures.is_empty() && !self.interrupt.was_signalled() {
                self.interrupt.go_on();
            }
            // A GPU need not hold what is done.
            pictures.iter_mut().for_each(|it: &mut Traced<'_>| it.driver.session.continue_on_cpu());
            let (assignment, picture, ended) =
                self.trace(&of_each, lit, view, counted, (&mut notices, progress))?;
            assignments.push(assignment);
            pictures.push(picture);
            outcome = ended;
            if outcome.is_err() {
                break;
            }
        }
        progress.finish();
        let is_whole = pictures.len() == count && pictures.iter().all(|it| it.driver.has_samples());
        let last = (assignments.last_mut(), pictures.last());
        let (Some(assignment), Some(Traced { driver, .. }), true) = (last.0, last.1, is_whole)
        else {
            return outcome.map(|()| Vec::new());
        };
        drop(spare);
        let sums = Sums::of(&pictures, &groups);
        let (film, cached) = (&*sums.film, sums.cached());
        let mut remarks = output::remarks(film, environment);
        remarks.extend(cached.map(|(cached, _)| {
            let [exact, cached] = [film, cached].map(Film::min_samples);
            format!(
                "denoised from {} samples a pixel: {exact} exact, {cached} of cached light (--gi exact: none)",
                exact + cached
            )
        }));
        remarks.iter().for_each(|sentence| notices.add(sentence));

        let (asked, mut arguments) = (arguments, Cow::Borrowed(arguments));
        if known.is_some() {
            // What the first frame has is what all have.
            arguments.to_mut().picture.take_exposure(film, &asked.pictures());
        }
        let done = (film, &sums.figures, sums.cached_seconds);
        let record = self.record(&arguments, &driver.session, done, &notices);
        let films = Films { film, cached, denoised: None, groups: &sums.groups };
        let mut failures = outputs::write(&arguments, assignment, driver, &record, films);
        // Another device may have taken over.
        assignment.facts.metadata = record.metadata();
        failures.extend(assignment.keep(driver).err());
        remarks.iter().for_each(notice);
        if let Err(failure) = outcome {
            failures.push(failure);
            return Error::all(failures).map(|()| Vec::new());
        }
        if let Some(known) = known {
            known.exposure = Some(arguments.picture.exposure);
            known.counted = driver.session.counters().map(LearningGrid::snapshot);
        }
        Ok(failures)
    }

    /// Renders one picture until a rule or the user says stop; how that ended.
    fn trace<'l>(
        &'l self,
        arguments: &RenderArguments,
        lit: Lit<'l>,
        view: View,
        counted: Option<&LearningGrid>,
        (notices, progress): (&mut Notices, &Progress),
    ) -> Result<(RenderJob, Traced<'l>, Result<()>)> {
        let mut assignment = RenderJob::open(arguments, lit, &view)?;
        assignment.say(notices);
        let mut beside = Beside::new(arguments, lit, &view, needed_bytes(arguments)[0]);
        let mut cpu = TakeOver { choice: arguments.device, notices };
        let start = |on: &UploadedScene| Session::on(lit, view.clone(), Some(&on.relit(lit.1)?));
        let on_gpu = cpu.renders_instead(self.uploaded.as_ref().map(start).transpose())?;
        let session = on_gpu.unwrap_or_else(|| Session::new(lit.0, lit.1, view));
        let mut driver = assignment.driver(session);
        let (nothing, not_yet) = (Film::new(0, 0, false), Figures::default());
        let record = self.record(arguments, &driver.session, (&nothing, &not_yet, 0.0), notices);
        assignment.facts.metadata = record.metadata();
        let mut cpu = TakeOver { choice: arguments.device, notices };
        let begun = counted.map_or(Ok(()), |counted| {
            let taken_up = driver.session.continue_learning(counted);
            cpu.goes_on(&mut driver.session, taken_up).map(|_| ())
        });
        let outcome = begun.and_then(|()| {
            work((&mut driver, &mut beside), &mut assignment, &self.interrupt, progress, &mut cpu)
        });
        Ok((assignment, Traced { driver, beside }, outcome))
    }

    /// What there is to say about a film of the session.
    fn record<'r>(
        &'r self,
        arguments: &'r RenderArguments,
        session: &Session<'_>,
        (film, figures, cached_seconds): (&'r Film, &'r Figures, f64),
        notices: &'r Notices,
    ) -> Record<'r> {
        Record {
            scene: &arguments.scene,
            map: arguments.map(),
            world: self.world,
            environment: self.environment,
            film,
            figures,
            cached_seconds,
            gpu: session.gpu_figures(),
            phases: &self.phases,
            notices,
            with_times: !arguments.reproducible,
            options: outputs::settings(arguments, self.world, session.view()),
        }
    }

    /// Renders one picture after another; while the camera stays near, they go on learning what those before
    /// them have learned. The first one's exposure is that of all.
    fn render_frames(
        &self,
        arguments: &RenderArguments,
        frames: &Frames<'_>,
        camera: &Camera,
    ) -> Result<()> {
        let mut of_frame = arguments.clone();
        let (videos, pictures): (Vec<_>, Vec<_>) =
            arguments.outputs.iter().partition(|path| frames::is_video(path));
        let mut reel = if videos.is_empty() { None } else { Some(Reel::new()?) };
        reel.iter().for_each(|reel| self.interrupt.has_frames_in(&reel.folder));
        let mut failures = Vec::new();
        let mut known = Known::default();
        let mut progress = Progress::of_picture(arguments.watched);
        for number in frames.numbers.clone() {
            let name = |path: &PathBuf| frames::numbered(path, number);
            of_frame.outputs = pictures.iter().map(|path| name(path)).collect();
            of_frame.json = arguments.json.as_ref().map(name);
            of_frame.distributions = arguments.distributions.as_ref().map(name);
            of_frame.frame_of_video = reel.as_mut().map(Reel::next);
            self.interrupt.go_on();
            progress = progress.of_frame(number, &frames.numbers);
            let camera = frames.camera(number, camera);
            // What one frame cannot be written to may take the next.
            match self.render(&of_frame, camera, Some(&mut known), &progress) {
                Ok(unwritten) => failures.extend(unwritten),
                Err(failure) => {
                    failures.push(failure);
                    break;
                }
            }
            of_frame.picture.exposure = known.exposure.take().unwrap_or(of_frame.picture.exposure);
            if self.interrupt.was_signalled() {
                notice(format_args!("frame {number} was ended early and is the last"));
                break;
            }
        }
        // What there is of them, should a frame have failed.
        if let Some(reel) = reel.filter(Reel::has_frames) {
            let write = |video: &PathBuf| reel.write(video, arguments.fps).err();
            let unwritten: Vec<Error> = videos.into_iter().filter_map(write).collect();
            if !unwritten.is_empty() {
                notice(format_args!("the frames are kept in {}", reel.keep().display()));
            }
            failures.extend(unwritten);
        }
        Error::all(failures)
    }
}

/// The scene made ready for rays, and the seconds of loading and of building.
fn load_world(arguments: &RenderArguments) -> Result<(World, f64, f64)> {
    let options = arguments.of_scene.options_beside(outputs::overwritten(arguments));
    let load = || crate::sources::scene_with(&arguments.scene, &options);
    let (scene, load_seconds) = timed(load)?;
    let (world, build_seconds) = timed(|| Ok(World::new(scene)))?;
    Ok((world, load_seconds, build_seconds))
}

/// The map made ready to be sampled, what was repaired in it, and the seconds of loading and of
/// building.
fn load_environment(arguments: &RenderArguments) -> Result<(Environment, Notices, f64, f64)> {
    let name = arguments.map();
    let ((map, notices), load_seconds) = timed(|| crate::sources::map(name))?;
    let build = || Environment::new(map, &arguments.environment_options()).at(name);
    let (environment, build_seconds) = timed(build)?;
    Ok((environment, notices, load_seconds, build_seconds))
}

/// What work makes, and the seconds it took.
fn timed<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, f64)> {
    let start = Instant::now();
    work().map(|made| (made, start.elapsed().as_secs_f64()))
}

/// What the standard library gives a thread for its stack.
const STACK_BYTES: u64 = 2 << 20;

/// Starts the threads that share all work, of which there are so many once and for all; 0 is one for each
/// core. Started when they are first needed, they would panic where the system gives none: each command that computes
/// starts them before.
pub(super) fn start_threads(threads: u16) -> Result<()> {
    static STARTED: AtomicBool = AtomicBool::new(false);
    if STARTED.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    let count = if threads == 0 { String::new() } else { format!("{threads} ") };
    let cannot = |cause: &dyn std::fmt::Display| {
        Error::new(format!("{count}threads cannot be started: {cause}"))
    };
    // A thread that finds no room for what comes with its stack aborts.
    memory::check(u64::from(threads) * STACK_BYTES).map_err(|cause| cannot(&cause))?;
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads))
        .thread_name(|i| format!("render {i}"))
        .build_global()
        .map_err(|e| cannot(&e))
}

/// Runs the session until a rule or the user says stop. When the seconds are over, the pass under way ends
/// with what it has.
fn work<'a>(
    (driver, beside): (&mut Driver<'a>, &mut Beside<'a>),
    assignment: &mut RenderJob,
    interrupt: &Interrupt,
    progress: &Progress,
    cpu: &mut TakeOver<'_>,
) -> Result<()> {
    let alarm = Alarm::start(Arc::clone(&interrupt.asked));
    loop {
        let (session, cached) = (&driver.session, (beside.counted(), beside.seconds));
        progress.show(session, &driver.rule, cached, || beside.error(session));
        if beside.advance(driver, &interrupt.asked)? {
            continue;
        }
        let step = assignment.step(driver, interrupt, &alarm, cpu.notices);
        if cpu.goes_on(&mut driver.session, step)? == Some(true) {
            return Ok(());
        }
    }
}
