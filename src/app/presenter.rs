//! Turns the latest film into what is on the screen, on its own threads: the window never waits for
//! a tone curve, a filter or an overlay.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use glam::{UVec2, Vec2, Vec3};

use super::Wake;
use super::document::Look;
use super::overlays::{CellFacts, Label, Legend, Overlay, Sources};
use super::surface_map::SurfaceMap;
use super::worker::{Request, Snapshot};
use crate::denoise::{preview, quick};
use crate::error::{Error, Result};
use crate::image::{Image, Rgb8};
use crate::light_grid::LightGrid;
use crate::render::film::Film;
use crate::tone::{auto_exposure_ev, display_rgb8};

/// What is to be shown.
#[derive(Clone)]
pub struct Order {
    /// The film.
    pub snapshot: Arc<Snapshot>,
    /// How it is developed.
    pub look: Look,
    /// What is drawn over it, with its opacity.
    pub overlay: Option<(Overlay, f32)>,
    /// The tile chosen on the map.
    pub tile: Option<u32>,
    /// A picture of the history to wipe against.
    pub past: Option<Arc<Image>>,
}

impl PartialEq for Order {
    fn eq(&self, other: &Self) -> bool {
        let past = |order: &Self| order.past.as_ref().map(|image| Arc::as_ptr(image).addr());
        self.snapshot.number == other.snapshot.number
            && self.look == other.look
            && self.overlay == other.overlay
            && self.tile == other.tile
            && past(self) == past(other)
    }
}

/// What is on the screen.
pub struct Shown {
    /// What was ordered.
    pub order: Order,
    /// The picture.
    pub picture: Arc<Rgb8>,
    /// What the wipe uncovers: the plain picture or one of the history.
    pub other: Option<Arc<Rgb8>>,
    /// Stops, automatic ones included.
    pub exposure_ev: f32,
    /// What the overlay's colours mean.
    pub legend: Option<Legend>,
    /// What it writes on the picture.
    pub labels: Vec<Label>,
    /// Why the denoiser did not do its work.
    pub failure: Option<String>,
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
    loop {
        let order = {
            let mut slot = lock(&shared.slot);
            loop {
                if slot.quit {
                    return;
                }
                if let Some(order) = slot.order.take() {
                    break order;
                }
                slot = shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
            }
        };
        let shown = Arc::new(memory.present(order));
        *lock(&shared.shown) = Some(shown);
        (shared.wake)();
    }
}

/// What can be used again for the next order.
#[derive(Default)]
struct Memory {
    surfaces: Option<(Arc<Request>, SurfaceMap)>,
    facts: Option<(Arc<LightGrid>, bool, Arc<CellFacts>)>,
}

impl Memory {
    fn present(&mut self, order: Order) -> Shown {
        let snapshot = Arc::clone(&order.snapshot);
        let mut filter = Filter { look: &order.look, failure: None };
        let linear = develop(&snapshot, &mut filter);
        let balanced = order.look.white_balance.apply(linear);
        let automatic = if order.look.auto_exposure {
            auto_exposure_ev(&balanced.shrunk(EXPOSURE_WIDTH))
        } else {
            0.0
        };
        let exposure_ev = automatic + order.look.exposure_ev;
        let mut picture = display_rgb8(&balanced, exposure_ev, order.look.curve);
        let other = other(&order, exposure_ev, &mut filter).map(Arc::new);
        let failure = filter.failure;
        let painted = order
            .overlay
            .and_then(|(overlay, opacity)| self.paint(&order, overlay, opacity, &mut picture));
        let (legend, labels) = painted.unzip();
        let labels = labels.unwrap_or_default();
        let facts = self.facts.as_ref().map(|(_, _, facts)| Arc::clone(facts));
        Shown {
            order,
            picture: Arc::new(picture),
            other,
            exposure_ev,
            legend,
            labels,
            failure,
            facts,
        }
    }

    fn paint(
        &mut self,
        order: &Order,
        overlay: Overlay,
        opacity: f32,
        picture: &mut Rgb8,
    ) -> Option<(Legend, Vec<Label>)> {
        let snapshot = &order.snapshot;
        let take = &snapshot.main;
        if overlay.needs_surfaces() {
            self.prepare(snapshot);
        }
        let sources = Sources {
            film: &take.film,
            environment: &snapshot.request.environment,
            grid: take.grid.as_ref(),
            counters: snapshot.counters.as_deref(),
            surfaces: self.surfaces.as_ref().map(|(_, surfaces)| surfaces),
            facts: self.facts.as_ref().map(|(_, _, facts)| &**facts),
            tile: order.tile,
        };
        let painted = sources.paint(overlay)?;
        let opacity = if overlay.is_opaque() { 1.0 } else { opacity };
        for (pixel, color) in picture.pixels.iter_mut().zip(&painted.colors) {
            match color {
                Some(color) => blend(pixel, *color, opacity),
                // What the overlay does not speak of steps back.
                None => blend(pixel, [24, 25, 28], 0.6 * opacity),
            }
        }
        Some((painted.legend, painted.labels))
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

/// Pixels across of the picture that the exposure is taken from: so coarse that noise averages out.
const EXPOSURE_WIDTH: u32 = 64;

/// The denoiser that is asked for, as long as it works.
struct Filter<'a> {
    look: &'a Look,
    failure: Option<String>,
}

impl Filter<'_> {
    /// The film's picture, denoised if that is asked for.
    fn image(&mut self, film: &Film) -> Image {
        if !self.look.denoise {
            return film.image();
        }
        self.look.denoiser.denoise(film).unwrap_or_else(|failure| {
            self.failure = Some(failure.to_string());
            quick(film)
        })
    }
}

/// What the wipe uncovers.
fn other(order: &Order, exposure_ev: f32, filter: &mut Filter<'_>) -> Option<Rgb8> {
    let look = &order.look;
    let linear = match (&order.past, &order.snapshot.plain) {
        (Some(past), _) => (**past).clone(),
        (None, Some(plain)) => filter.image(&plain.film),
        (None, None) => return None,
    };
    Some(display_rgb8(&look.white_balance.apply(linear), exposure_ev, look.curve))
}

/// The linear picture; pixels without samples show what there was before.
fn develop(snapshot: &Snapshot, filter: &mut Filter<'_>) -> Image {
    let film = &snapshot.main.film;
    // A small picture is there to see where one is going, not to judge noise.
    let mut image = if snapshot.is_small() { preview(film) } else { filter.image(film) };
    if let Some(under) = snapshot.under.as_ref().filter(|_| film.min_samples() == 0) {
        fill_from(&mut image, film, under);
    }
    image
}

fn blend(pixel: &mut [u8; 3], color: [u8; 3], opacity: f32) {
    for (under, over) in pixel.iter_mut().zip(color) {
        *under =
            (f32::from(*under) + (f32::from(over) - f32::from(*under)) * opacity).round() as u8;
    }
}

/// Gives pixels without samples the radiance at the same place of another picture, bilinear. The
/// field of view is vertical: pictures of different shapes share their middle.
fn fill_from(image: &mut Image, film: &Film, before: &Image) {
    let size = Vec2::new(image.width as f32, image.height as f32);
    let last = UVec2::new(before.width - 1, before.height - 1);
    let size_before = Vec2::new(before.width as f32, before.height as f32);
    let scale = size_before.y / size.y;
    let width = image.width;
    let at = |x: u32, y: u32| Vec3::from(before.at(x.min(last.x), y.min(last.y)));
    for (i, (rgb, pixel)) in image.pixels.iter_mut().zip(film.pixels()).enumerate() {
        if pixel.samples() > 0 {
            continue;
        }
        let place = Vec2::new((i as u32 % width) as f32, (i as u32 / width) as f32) + 0.5;
        let there = (place - 0.5 * size) * scale + 0.5 * size_before;
        let there = (there - 0.5).max(Vec2::ZERO);
        let (low, t) = (there.as_uvec2(), there.fract());
        let upper = at(low.x, low.y).lerp(at(low.x + 1, low.y), t.x);
        let lower = at(low.x, low.y + 1).lerp(at(low.x + 1, low.y + 1), t.x);
        *rgb = upper.lerp(lower, t.y).to_array();
    }
}
