//! Makes ready what the screen is developed from, on its own threads: pictures on the device, their
//! exposure, overlays. The window never waits for a filter or an overlay, and develops by itself.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Wake;
use super::comparison::{Compared, Comparison};
use super::document::Look;
use super::overlays::{CellFacts, Label, Legend, Overlay, Sources};
use super::surface_map::SurfaceMap;
use super::worker::{Activity, Backdrop, Request, SessionSnapshot, Snapshot};
use crate::denoise::{Denoiser, blend};
use crate::develop::{Developer, LinearPicture, OverlayTexture};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::light_grid::LightGrid;
use crate::memory;
use crate::render::film::Film;
use crate::render::gpu::{DeviceFilm, Gpu};
use crate::tone::WhiteBalance;

/// What is to be shown.
#[derive(Clone)]
pub struct Order {
    /// What pictures are developed by, hence the device they are to be on.
    pub(super) developer: Arc<Developer>,
    /// The film.
    pub snapshot: Arc<Snapshot>,
    /// What takes noise out, if anything shall.
    pub denoiser: Option<Denoiser>,
    /// The white balance the exposure is to be measured under, if it shall be.
    pub metered: Option<WhiteBalance>,
    /// What is drawn over it.
    pub overlay: Option<Overlay>,
    /// How the overlay is developed, if it shows light.
    pub look: Option<Look>,
    /// The tile chosen on the map.
    pub tile: Option<u32>,
    /// Kept pictures that are compared.
    pub compared: Option<Comparison>,
}

impl PartialEq for Order {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.developer, &other.developer)
            && self.snapshot.number == other.snapshot.number
            && self.denoiser == other.denoiser
            && self.metered == other.metered
            && self.overlay == other.overlay
            && self.look == other.look
            && self.tile == other.tile
            && self.compared == other.compared
    }
}

impl Order {
    /// Whether it asks for the same of a later picture of the same work, which may wait; the first one with a
    /// sample in every pixel does not.
    fn only_follows(&self, before: &Self) -> bool {
        let is_over = matches!(self.snapshot.activity, Activity::Done | Activity::Paused);
        let is_first = self.snapshot.is_whole() && !before.snapshot.is_whole();
        let (request, old) = (&self.snapshot.request, &before.snapshot.request);
        let is_same_work = Arc::ptr_eq(request, old) || (request.moving && old.moving);
        let snapshot = Arc::clone(&before.snapshot);
        is_same_work && !is_over && !is_first && Self { snapshot, ..self.clone() } == *before
    }
}

/// After a picture of work that goes on it rests so many times as long as that took: little at first, when each
/// is much better than the last, and most after [`MOST_AFTER`]. With half of the cores it then takes a
/// twenty-sixth of the machine, and in the first minute less than a tenth.
const REST: [f64; 2] = [3.0, 12.0];
/// Seconds of work on a view after which pictures change slowly.
const MOST_AFTER: f64 = 12.0;

/// For how long it rests after a picture that took so long, of so many seconds of work.
fn rest_after(took: Duration, seconds: f64) -> Duration {
    let [least, most] = REST;
    took.mul_f64(least + (most - least) * (seconds / MOST_AFTER).clamp(0.0, 1.0))
}

/// What a picture took, for its rest. By the clock that would be far too long where other programs take the
/// cores (a picture stood still for half a minute), by this thread's time at work far too short for the
/// renderer, which gets as little: it is the geometric mean of both.
struct Work(Option<Duration>);

impl Work {
    fn start() -> Self {
        Self(time_at_work())
    }

    /// What it took, of so much by the clock.
    fn time(&self, elapsed: Duration) -> Duration {
        let worked = time_at_work().zip(self.0).map(|(now, start)| now.saturating_sub(start));
        worked.map_or(elapsed, |worked| between(worked.min(elapsed), elapsed))
    }
}

fn between(worked: Duration, elapsed: Duration) -> Duration {
    Duration::from_secs_f64((worked.as_secs_f64() * elapsed.as_secs_f64()).sqrt())
}

/// Of this thread, where the system tells.
fn time_at_work() -> Option<Duration> {
    #[cfg(target_os = "linux")]
    {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: plain system call, which writes into what it is given.
        let outcome = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
        let seconds = u64::try_from(time.tv_sec).ok().filter(|_| outcome == 0)?;
        Some(Duration::new(seconds, u32::try_from(time.tv_nsec).ok()?))
    }
    #[cfg(not(target_os = "linux"))]
    None
}

/// No picture takes longer to be made ready.
const LONGEST: Duration = Duration::from_secs(60);

/// Memory that was freed is given back so often, while pictures come: old ones, and their scenes, are gone then.
const RETURN: Duration = Duration::from_secs(10);

/// What the screen is developed from.
pub struct Shown {
    /// What was ordered.
    pub order: Order,
    /// The picture.
    pub(super) picture: LinearPicture,
    /// It as it was made on the host, unless it was made on the device.
    pub(super) image: Option<Arc<Image>>,
    /// What the wipe uncovers: the plain picture or one of the history.
    pub(super) other: Option<LinearPicture>,
    /// Stops that bring the picture to middle grey; 0 unless measured.
    pub automatic_ev: f32,
    /// The overlay's colours, one a pixel of `picture`.
    pub(super) overlay: Option<OverlayTexture>,
    /// What they mean.
    pub legend: Option<Legend>,
    /// What the overlay writes on the picture.
    pub labels: Vec<Label>,
    /// Why the denoiser did not do its work.
    pub failure: Option<String>,
    /// Why two pictures cannot be compared.
    pub uncompared: Option<String>,
    /// Facts about the grid's cells, when the overlay asked for them.
    pub facts: Option<Arc<CellFacts>>,
}

#[derive(Default)]
struct Slot {
    order: Option<Order>,
    quit: bool,
}

struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
    shown: Mutex<Option<Arc<Shown>>>,
    wake: Wake,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The handle of the presenting thread; it ends when dropped.
pub struct Presenter {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    ordered: Option<Order>,
}

impl Presenter {
    /// Starts the thread; `wake` is called when there is something new to show.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(wake: Wake) -> Result<Self> {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        // Not the render threads: those are busy for as long as a pass takes.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads((cores / 2).max(1))
            .thread_name(|i| format!("present {i}"))
            .build()
            .map_err(|e| Error::new(format!("the display threads cannot be started: {e}")))?;
        let shared = Arc::new(Shared {
            slot: Mutex::default(),
            changed: Condvar::new(),
            shown: Mutex::default(),
            wake,
        });
        let inside = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("presenter".to_owned())
            .spawn(move || pool.install(|| run(&inside)))
            .map_err(|e| Error::new(format!("the display thread cannot be started: {e}")))?;
        Ok(Self { shared, thread: Some(thread), ordered: None })
    }

    /// Orders a picture; the latest order counts.
    pub fn order(&mut self, order: Order) {
        if self.ordered.as_ref() == Some(&order) {
            return;
        }
        self.ordered = Some(order.clone());
        lock(&self.shared.slot).order = Some(order);
        self.shared.changed.notify_all();
    }

    /// What there is to show.
    pub fn shown(&self) -> Option<Arc<Shown>> {
        lock(&self.shared.shown).clone()
    }

    /// Whether the last order is what is shown.
    pub fn is_settled(&self) -> bool {
        let shown = self.shown();
        shown.as_ref().map(|s| &s.order) == self.ordered.as_ref()
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        lock(&self.shared.slot).quit = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared) {
    let mut memory = Memory::default();
    // The last order, and until when one that only follows it waits.
    let mut last: Option<(Order, Instant)> = None;
    let mut returned = Instant::now();
    loop {
        let order = {
            let mut slot = lock(&shared.slot);
            loop {
                if slot.quit {
                    return;
                }
                let rest = match (&slot.order, &last) {
                    (Some(order), Some((before, until))) if order.only_follows(before) => {
                        until.saturating_duration_since(Instant::now())
                    }
                    (Some(_), _) => Duration::ZERO,
                    (None, _) => Duration::MAX,
                };
                if rest.is_zero()
                    && let Some(order) = slot.order.take()
                {
                    break order;
                }
                slot = if rest == Duration::MAX {
                    shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner)
                } else {
                    let waited = shared.changed.wait_timeout(slot, rest);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                };
            }
        };
        let (start, kept) = (Instant::now(), order.clone());
        let work = Work::start();
        order.snapshot.rest.set_end(start + LONGEST);
        // Where the device is lost, the window orders again on another.
        if let Ok(shown) = memory.present(order) {
            *lock(&shared.shown) = Some(Arc::new(shown));
        }
        let rest = rest_after(work.time(start.elapsed()), kept.snapshot.seconds());
        let end = Instant::now() + rest;
        kept.snapshot.rest.set_end(end);
        last = Some((kept, end));
        (shared.wake)();
        if returned.elapsed() > RETURN {
            memory::return_freed();
            returned = Instant::now();
        }
    }
}

/// The last result and what it was made for.
struct Last<K, V>(Option<(K, V)>);

impl<K, V> Default for Last<K, V> {
    fn default() -> Self {
        Self(None)
    }
}

impl<K: PartialEq, V: Clone> Last<K, V> {
    fn or_make(&mut self, key: K, make: impl FnOnce() -> Result<V>) -> Result<V> {
        if let Some((_, value)) = self.0.as_ref().filter(|(last, _)| *last == key) {
            return Ok(value.clone());
        }
        let value = make()?;
        self.0 = Some((key, value.clone()));
        Ok(value)
    }
}

/// A picture on the device.
#[derive(Clone)]
struct Prepared {
    picture: LinearPicture,
    /// The same, if it was made on the host.
    image: Option<Arc<Image>>,
    /// Why its noise was not taken out as was wished.
    failure: Option<String>,
}

impl Prepared {
    fn of(developer: &Developer, image: Image) -> Self {
        let picture = developer.upload_image(&image);
        Self { picture, image: Some(Arc::new(image)), failure: None }
    }

    fn on_device(picture: LinearPicture) -> Self {
        Self { picture, image: None, failure: None }
    }
}

/// The exposure of the last whole picture.
struct Metered {
    environment: Arc<Environment>,
    white_balance: WhiteBalance,
    ev: f32,
}

/// What can be used again for the next order.
#[derive(Default)]
struct Memory {
    whole: Option<Metered>,
    surfaces: Option<(Arc<Request>, SurfaceMap)>,
    facts: Option<(Arc<LightGrid>, bool, Arc<CellFacts>)>,
    uploads: Uploads,
}

/// Snapshot, overlay, tile, and how light is developed: what an overlay is painted from.
type OverlayKey = (u64, Overlay, Option<u32>, Option<(Look, f32)>);

/// What is on one device.
#[derive(Default)]
struct Uploads {
    developer: Option<Arc<Developer>>,
    picture: Last<Source, Prepared>,
    plain: Last<Source, Prepared>,
    /// By the picture that is rendered, too, where that is compared.
    compared: Last<(Comparison, Option<Source>), Compared>,
    metered: Last<(Source, WhiteBalance), f32>,
    overlay: Last<OverlayKey, Option<Painted>>,
}

/// An overlay on the device.
#[derive(Clone)]
struct Painted {
    colors: OverlayTexture,
    legend: Legend,
    labels: Vec<Label>,
}

impl Memory {
    /// Fails only if the device does.
    fn present(&mut self, order: Order) -> Result<Shown> {
        let developer = Arc::clone(&order.developer);
        if self.uploads.developer.as_ref().is_none_or(|old| !Arc::ptr_eq(old, &developer)) {
            let developer = Some(Arc::clone(&developer));
            self.uploads = Uploads { developer, ..Uploads::default() };
        }
        self.leave_what_is_not_in(&order);
        let source = Source::main(&order);
        let prepare = || Ok(source.prepare(&developer));
        let Prepared { mut picture, image, mut failure } =
            self.uploads.picture.or_make(source.clone(), prepare)?;
        let automatic_ev = order.metered.map_or(Ok(0.0), |white_balance| {
            if let Some(ev) = self.whole_ev(&order) {
                return Ok(ev);
            }
            let meter = || developer.auto_exposure_ev(&picture, white_balance);
            self.uploads.metered.or_make((source.clone(), white_balance), meter)
        })?;
        if order.snapshot.request.view.crop.is_none() {
            self.whole = order.metered.map(|white_balance| Metered {
                environment: Arc::clone(&order.snapshot.request.environment),
                white_balance,
                ev: automatic_ev,
            });
        }
        let painted = order.overlay.map_or(Ok(None), |overlay| {
            let mut last = std::mem::take(&mut self.uploads.overlay);
            let look = order.look.map(|look| (look, automatic_ev));
            let key = (order.snapshot.number, overlay, order.tile, look);
            let painted = last.or_make(key, || Ok(self.paint(&order, overlay, look, &picture)));
            self.uploads.overlay = last;
            painted
        })?;
        let (mut other, mut uncompared) = (None, None);
        if let Some(comparison) = &order.compared {
            let now = || image.clone().unwrap_or_else(|| Arc::new(source.session.film.image()));
            let of = comparison.shows_now().then(|| source.clone());
            let compare = || Ok(comparison.prepare(&developer, now));
            let compared = self.uploads.compared.or_make((comparison.clone(), of), compare)?;
            picture = compared.picture.unwrap_or(picture);
            (other, uncompared) = (compared.other, compared.failure);
        } else if let Some(source) = Source::plain(&order) {
            let prepare = || Ok(source.prepare(&developer));
            let plain = self.uploads.plain.or_make(source.clone(), prepare)?;
            (other, failure) = (Some(plain.picture), failure.or(plain.failure));
        }
        developer.gpu().check()?;
        let facts = self.facts.as_ref().map(|(_, _, facts)| Arc::clone(facts));
        let (overlay, words) =
            painted.map(|painted| (painted.colors, (painted.legend, painted.labels))).unzip();
        let (legend, labels) = words.unzip();
        Ok(Shown {
            order,
            picture,
            image,
            other,
            uncompared,
            automatic_ev,
            overlay,
            legend,
            labels: labels.unwrap_or_default(),
            failure,
            facts,
        })
    }

    /// The exposure a part of a picture has from the whole one it lies on: it does not become brighter or
    /// darker because less is rendered. Under another map it is measured.
    fn whole_ev(&self, order: &Order) -> Option<f32> {
        let (request, whole) = (&order.snapshot.request, self.whole.as_ref()?);
        request.view.crop?;
        let is_alike = whole.environment.shares_map_with(&request.environment)
            && Some(whole.white_balance) == order.metered;
        is_alike.then_some(whole.ev)
    }

    /// Lets go of what the order does not ask for: each holds a film, or a scene.
    fn leave_what_is_not_in(&mut self, order: &Order) {
        if order.compared.is_none() {
            self.uploads.compared = Last::default();
        }
        if order.compared.is_some() || order.snapshot.plain.is_none() {
            self.uploads.plain = Last::default();
        }
        if order.metered.is_none() {
            self.uploads.metered = Last::default();
        }
        if order.overlay.is_none() {
            (self.uploads.overlay, self.surfaces, self.facts) = (Last::default(), None, None);
        }
    }

    fn paint(
        &mut self,
        order: &Order,
        overlay: Overlay,
        look: Option<(Look, f32)>,
        picture: &LinearPicture,
    ) -> Option<Painted> {
        let snapshot = &order.snapshot;
        let session = &snapshot.main;
        if overlay.needs_surfaces() {
            self.prepare(snapshot);
        }
        let sources = Sources {
            film: &session.film,
            environment: &snapshot.request.environment,
            grid: session.grid.as_ref(),
            counters: snapshot.counters.as_deref(),
            surfaces: self.surfaces.as_ref().map(|(_, surfaces)| surfaces),
            facts: self.facts.as_ref().map(|(_, _, facts)| &**facts),
            cache: snapshot.cache.as_deref().ok(),
            look,
            tile: order.tile,
        };
        let painted = sources.paint(overlay)?;
        let colors = order.developer.upload_overlay(&painted.colors, session.film.width, picture);
        Some(Painted { colors, legend: painted.legend, labels: painted.labels })
    }

    /// Brings surfaces and facts up to date with the snapshot.
    fn prepare(&mut self, snapshot: &Arc<Snapshot>) {
        let film = &snapshot.main.film;
        let is_current = self.surfaces.as_ref().is_some_and(|(old, surfaces)| {
            Arc::ptr_eq(&old.world, &snapshot.request.world)
                && old.view.camera == snapshot.request.view.camera
                && (surfaces.width, surfaces.height) == (film.width, film.height)
        });
        if !is_current {
            let mut view = snapshot.request.view.clone();
            (view.width, view.height) = (film.width, film.height);
            let surfaces = SurfaceMap::of(&snapshot.request.world, &view);
            self.surfaces = Some((Arc::clone(&snapshot.request), surfaces));
        }
        let Some(grid) = &snapshot.main.grid else {
            self.facts = None;
            return;
        };
        let counted = snapshot.counters.is_some();
        let is_current = self
            .facts
            .as_ref()
            .is_some_and(|(old, with, _)| Arc::ptr_eq(old, grid) && *with == counted);
        if !is_current {
            let environment = &snapshot.request.environment;
            let facts = CellFacts::of(grid, snapshot.counters.as_deref(), environment);
            self.facts = Some((Arc::clone(grid), counted, Arc::new(facts)));
        }
    }
}

/// A filtered picture is as good as the blend of so many times its samples.
const FILTER_WORTH: u64 = 4;

/// What a linear picture is made from; equal ones give the same picture.
#[derive(Clone)]
struct Source {
    session: SessionSnapshot,
    backdrop: Option<Backdrop>,
    denoiser: Option<Denoiser>,
    /// Whether every pixel has a sample and the picture its full size.
    is_whole: bool,
}

impl PartialEq for Source {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.session.film, &other.session.film)
            && self.backdrop == other.backdrop
            && (self.denoiser, self.is_whole) == (other.denoiser, other.is_whole)
    }
}

impl Source {
    fn main(order: &Order) -> Self {
        let snapshot = &order.snapshot;
        // Where there are no samples, the film is that from before.
        let backdrop = snapshot.backdrop.clone();
        let backdrop =
            backdrop.filter(|backdrop| !Arc::ptr_eq(&backdrop.film, &snapshot.main.film));
        let session = snapshot.main.clone();
        Self { session, backdrop, denoiser: order.denoiser, is_whole: snapshot.is_whole() }
    }

    fn plain(order: &Order) -> Option<Self> {
        let session = order.snapshot.plain.clone()?;
        let is_whole = session.samples > 0;
        Some(Self { session, backdrop: None, denoiser: order.denoiser, is_whole })
    }

    /// The picture on the device, without noise if that is asked for.
    fn prepare(&self, developer: &Developer) -> Prepared {
        let film = &self.session.film;
        let is_here = |(gpu, _): &&(Gpu, DeviceFilm)| gpu.is_same(developer.gpu());
        let noisy = |layers| match self.session.on_device.as_ref().filter(is_here) {
            Some((_, on_device)) => LinearPicture::live(on_device.clone()),
            None => developer.upload_film(film, layers),
        };
        let backdrop = self.backdrop.as_ref().map(|backdrop| (&*backdrop.film, backdrop.worth));
        let blended = || Prepared::of(developer, blend(film, backdrop));
        // Filters take whole films of one size.
        let other = backdrop.filter(|(other, worth)| {
            film.is_alike(other) && other.min_samples() > 0 && *worth > 0.0
        });
        let is_calmed = other.is_some() && self.backdrop.as_ref().is_some_and(|b| b.is_cached);
        let is_surpassed =
            |(other, _): (&Film, f32)| other.total_samples() <= FILTER_WORTH * film.total_samples();
        let can_filter = other.is_some() || (self.is_whole && backdrop.is_none_or(is_surpassed));
        match self.denoiser {
            None if self.is_whole => Prepared::on_device(noisy(false)),
            Some(Denoiser::ATrous)
                if self.is_whole
                    && !is_calmed
                    && developer.can_denoise(film.width, film.height) =>
            {
                Prepared::on_device(developer.denoised(&noisy(true)))
            }
            // A picture with holes or in other pixels is there to see where one is going.
            None => blended(),
            Some(_) if !can_filter => blended(),
            Some(denoiser) => match denoiser.denoise(film, other) {
                Ok(image) => Prepared::of(developer, image),
                Err(failure) => Prepared { failure: Some(failure.to_string()), ..blended() },
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::app::worker::tests::{request_of, snapshot_of};
    use crate::denoise::quick;
    use crate::path::{FirstHit, PathResult};
    use crate::render::{Figures, Sampling};

    #[test]
    fn a_rest_is_shorter_at_first_and_where_others_take_the_cores() {
        let seconds = Duration::from_secs_f64;
        assert_eq!(between(seconds(0.5), seconds(0.5)), seconds(0.5));
        assert_eq!(between(seconds(0.25), seconds(4.0)), seconds(1.0));
        assert_eq!(rest_after(seconds(0.5), 0.0), seconds(1.5));
        assert_eq!(rest_after(seconds(0.5), 1e9), seconds(6.0));
        // Who sleeps is not at work.
        if let Some(before) = time_at_work() {
            std::thread::sleep(Duration::from_millis(200));
            let worked = time_at_work().expect("it told before") - before;
            assert!(worked < Duration::from_millis(200), "{worked:?}");
        }
    }

    fn session(film: Film) -> SessionSnapshot {
        SessionSnapshot {
            samples: 1,
            sampling: Sampling::Plain,
            film: Arc::new(film),
            figures: Figures::default(),
            noise: 0.0,
            grid: None,
            gpu: None,
            on_device: None,
        }
    }

    /// A wall with light that is the pixel's own, in every so-manyth column.
    fn film(width: u32, every: u32, samples: u32) -> Film {
        let mut film = Film::new(width, 8, true);
        for (y, x) in (0..8).flat_map(|y| (0..width).step_by(every as usize).map(move |x| (y, x))) {
            for sample in 0..samples {
                let radiance = Vec3::splat(((x * 7 + y * 5 + sample * 3) % 11) as f32);
                let (albedo, normal, depth) = (Vec3::splat(0.5), Vec3::Z, 1.0);
                let first_hit = Some(FirstHit { albedo, normal, depth });
                film.add(x, y, &PathResult { radiance, first_hit, ..PathResult::default() });
            }
        }
        film
    }

    #[test]
    fn a_movement_does_not_wait_for_the_picture_before_it() {
        let developer = match Gpu::open(None).and_then(|gpu| Developer::new(&gpu)) {
            Ok(developer) => Arc::new(developer),
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let still = Arc::new(request_of("open", [12, 8]));
        let order = |request: &Arc<Request>, samples| Order {
            developer: Arc::clone(&developer),
            snapshot: Arc::new(snapshot_of(
                request,
                SessionSnapshot { samples, ..session(film(12, 1, 1)) },
            )),
            denoiser: None,
            metered: None,
            overlay: None,
            look: None,
            tile: None,
            compared: None,
        };
        let [moving, later] =
            [(); 2].map(|()| Arc::new(Request { moving: true, ..(*still).clone() }));
        assert!(order(&still, 2).only_follows(&order(&still, 1)), "more of the same");
        assert!(!order(&still, 1).only_follows(&order(&still, 0)), "the first with all pixels");
        assert!(!order(&moving, 1).only_follows(&order(&still, 1)), "off it goes");
        assert!(order(&later, 1).only_follows(&order(&moving, 1)), "on it goes");
        assert!(!order(&still, 1).only_follows(&order(&later, 1)), "there it stays");
    }

    #[test]
    fn a_calm_picture_of_all_pixels_is_filtered_with_what_there_is_of_the_exact_one() {
        let developer = match Gpu::open(None).and_then(|gpu| Developer::new(&gpu)) {
            Ok(developer) => developer,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let prepared = |own: Film, other: Film, is_whole| {
            let backdrop = Some(Backdrop { film: Arc::new(other), worth: 4.0, is_cached: true });
            let (session, denoiser) = (session(own), Some(Denoiser::ATrous));
            let prepared = Source { session, backdrop, denoiser, is_whole }.prepare(&developer);
            prepared.image.expect("made on the host").pixels.clone()
        };
        let (holes, whole, calm, large) =
            (film(12, 2, 1), film(12, 1, 1), film(12, 1, 2), film(16, 1, 9));
        let filtered = |film, other| quick(film, Some((other, 4.0))).pixels;
        let blended = |film, other| blend(film, Some((other, 4.0))).pixels;
        assert_eq!(prepared(whole.clone(), calm.clone(), true), filtered(&whole, &calm));
        assert_eq!(prepared(holes.clone(), calm.clone(), false), filtered(&holes, &calm));
        // The calm one has holes, is larger and says more.
        assert_eq!(prepared(holes.clone(), holes.clone(), false), blended(&holes, &holes));
        assert_eq!(prepared(whole.clone(), large.clone(), true), blended(&whole, &large));
    }

    #[test]
    fn a_film_on_the_same_device_is_shown_as_it_is_and_others_are_uploaded() {
        let opened = || Gpu::open(None).and_then(|gpu| Developer::new(&gpu));
        let (developer, other) = match opened().and_then(|one| Ok((one, opened()?))) {
            Ok(both) => both,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let mut session = session(Film::new(6, 4, true));
        let is_live = |developer: &Developer, session: &SessionSnapshot, denoiser| {
            let session = session.clone();
            let source = Source { session, backdrop: None, denoiser, is_whole: true };
            source.prepare(developer).picture.is_live()
        };
        assert!(!is_live(&developer, &session, None));
        let uploaded = developer.upload_film(&session.film, true);
        session.on_device = Some((developer.gpu().clone(), uploaded.film().clone()));
        assert!(is_live(&developer, &session, None));
        assert!(!is_live(&other, &session, None));
        assert!(!is_live(&developer, &session, Some(Denoiser::ATrous)));
        developer.gpu().check().and(other.gpu().check()).expect("no buffer is used elsewhere");
    }
}
