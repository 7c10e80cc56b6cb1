//! What the presenter keeps from one order to the next.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::carried::Carried;
use super::order::{Order, Shown};
use super::recent::Recent;
use super::source::{Prepared, Source, SourceKey};
use crate::app::comparison::{Compared, Comparison};
use crate::app::overlays::{CellFacts, Overlay, Painted, Sources};
use crate::app::worker::{Request, Snapshot};
use crate::develop::{DevelopSettings, Developer, OverlayTexture};
use crate::environment::Environment;
use crate::error::Result;
use crate::image::Image;
use crate::light_grid::LightGrid;
use crate::render::light_groups::LightFactors;
use crate::render::surface_map::SurfaceMap;
use crate::tone::WhiteBalance;

/// How many pixels are as wide as one of the picture that is shown at once where factors on light change.
const REMIXED_COARSENESS: u32 = 3;

/// The last result and what it was made for.
struct Last<K, V>(Option<(K, V)>);

impl<K, V> Default for Last<K, V> {
    fn default() -> Self {
        Self(None)
    }
}

impl<K: PartialEq, V: Clone> Last<K, V> {
    fn is_of(&self, key: &K) -> bool {
        self.0.as_ref().is_some_and(|(last, _)| last == key)
    }

    fn or_make(&mut self, key: K, make: impl FnOnce() -> Result<V>) -> Result<V> {
        self.or_try(key, || make().map(Some)).map(|made| made.expect("it was made"))
    }

    /// The same where nothing may be made.
    fn or_try(&mut self, key: K, make: impl FnOnce() -> Result<Option<V>>) -> Result<Option<V>> {
        if !self.is_of(&key) {
            let Some(value) = make()? else { return Ok(None) };
            self.0 = Some((key, value));
        }
        Ok(self.0.as_ref().map(|(_, value)| value.clone()))
    }
}

/// The exposure of the last whole picture.
struct Metered {
    environment: Arc<Environment>,
    /// Of the scene.
    geometry: Arc<()>,
    white_balance: WhiteBalance,
    ev: f32,
}

/// What can be used again for the next order.
#[derive(Default)]
pub(super) struct Memory {
    whole: Option<Metered>,
    surfaces: Option<(Arc<Request>, SurfaceMap)>,
    facts: Option<(Arc<LightGrid>, bool, Arc<CellFacts>)>,
    carried: Carried,
    /// The last view of a movement; how many pixels wide its picture was, and of how many samples.
    moved: Option<(Arc<Request>, u32, u64)>,
    recent: Recent,
    /// Automatic stops of the picture that was shown last.
    automatic_ev: f32,
    /// The factors of its light mix.
    mix: Option<LightFactors>,
    uploads: Uploads,
}

/// Snapshot, overlay, tile, and how light is developed: what an overlay is painted from.
type OverlayKey = ((u64, Option<usize>), Overlay, Option<u32>, Option<DevelopSettings>);

/// What is on one device.
#[derive(Default)]
struct Uploads {
    developer: Option<Arc<Developer>>,
    picture: Last<SourceKey, Prepared>,
    /// It together with what is carried, in the view of a request that is ahead.
    completed: Last<(SourceKey, Option<usize>), Prepared>,
    plain: Last<SourceKey, Prepared>,
    /// By the picture that is rendered, too, where that is compared.
    compared: Last<(Comparison, Option<SourceKey>), Compared>,
    metered: Last<(SourceKey, WhiteBalance), f32>,
    overlay: Last<OverlayKey, Option<Painted<OverlayTexture>>>,
}

/// A picture with nothing beside or over it.
fn shown(order: &Order, prepared: Prepared, automatic_ev: f32) -> Shown {
    let Prepared { picture, image, is_carried, failure } = prepared;
    Shown {
        order: order.presented(),
        picture,
        image,
        is_carried,
        is_coarse: false,
        other: None,
        automatic_ev,
        painted: None,
        failure,
        difference: None,
        uncompared: None,
    }
}

impl Memory {
    /// Fails only if the device does; `None` if it was cancelled, or what is shown is better.
    pub(super) fn present(&mut self, order: &Order, cancel: &AtomicBool) -> Result<Option<Shown>> {
        let developer = Arc::clone(&order.developer);
        if self.uploads.developer.as_ref().is_none_or(|old| !Arc::ptr_eq(old, &developer)) {
            let developer = Some(Arc::clone(&developer));
            self.uploads = Uploads { developer, ..Uploads::default() };
        }
        self.leave_what_is_not_in(order);
        if order.latest().moving {
            let film = &order.snapshot.main.film;
            self.moved = Some((Arc::clone(order.latest()), film.width, film.total_samples()));
        } else if order.ahead.is_none() && self.is_coarse(&order.snapshot) {
            return Ok(None);
        }
        let mut source = Source::main(order);
        source.fine = self.carried.fine_of(order);
        let mix = &order.snapshot.request.mix;
        // Other factors are to be seen at once.
        let is_remixed = mix.is_some() && self.mix.is_some() && *mix != self.mix;
        let is_coarse = is_remixed && order.denoiser.is_some();
        if is_coarse {
            source.coarseness = REMIXED_COARSENESS;
        }
        if let Some((image, automatic_ev)) = self.ahead(order, &source) {
            // It has no samples of the request's own.
            let prepared = Prepared { is_carried: true, ..Prepared::of(&developer, image) };
            developer.gpu.check()?;
            let automatic_ev = order.metered.map_or(0.0, |_| automatic_ev);
            return Ok(Some(shown(order, prepared, automatic_ev)));
        }
        if order.still_ahead().is_some() && order.is_left() {
            return Ok(None);
        }
        let prepare = || match self.recent.come_back(order).filter(|_| mix.is_none()) {
            Some(kept) => {
                let prepared = Prepared::of(&developer, Arc::clone(&kept.image));
                Ok(Some(Prepared { is_carried: kept.is_carried, ..prepared }))
            }
            None => Ok(source.prepare(&developer, cancel)),
        };
        let own = self.uploads.picture.or_try(source.key(), prepare)?;
        let Some(own) = own else { return Ok(None) };
        let key = (source.key(), order.ahead.as_ref().map(|ahead| Arc::as_ptr(ahead) as usize));
        let complete = || Ok(self.carried.carry(order, own));
        let completed = self.uploads.completed.or_make(key, complete)?;
        let automatic_ev = order.metered.map_or(Ok(0.0), |white_balance| {
            if let Some(ev) = self.whole_ev(order) {
                return Ok(ev);
            }
            let meter = || match source.is_dark() {
                true => Ok(0.0),
                false => developer.auto_exposure_ev(&completed.picture, white_balance),
            };
            self.uploads.metered.or_make((source.key(), white_balance), meter)
        })?;
        self.automatic_ev = automatic_ev;
        let is_own = order.ahead.is_none() && order.snapshot.is_lasting() && !is_coarse;
        if let Some(image) = completed.image.as_ref().filter(|_| is_own) {
            self.recent.keep(order, image, (completed.is_carried, automatic_ev));
        }
        if order.snapshot.request.view.crop.is_none() {
            self.whole = order.metered.map(|white_balance| Metered {
                environment: Arc::clone(&order.snapshot.request.environment),
                geometry: Arc::clone(&order.snapshot.request.world.geometry),
                white_balance,
                ev: automatic_ev,
            });
        }
        // What is kept has no overlays.
        let overlay = order.overlay.filter(|_| !order.covers_now());
        let painted = overlay.map_or(Ok(None), |overlay| {
            let mut last = std::mem::take(&mut self.uploads.overlay);
            let settings = order.look.as_ref().map(|(look, tone)| DevelopSettings {
                white_balance: look.white_balance,
                exposure_ev: look.total_ev(automatic_ev),
                tone: tone.clone(),
                opacity: [0.0; 2],
            });
            let key = (order.snapshot.key(), overlay, order.tile, settings.clone());
            let paint = || Ok(self.paint(order, overlay, settings, &completed));
            let painted = last.or_make(key, paint);
            self.uploads.overlay = last;
            painted
        })?;
        let mut shown = Shown { painted, ..shown(order, completed, automatic_ev) };
        if let Some(comparison) = &order.compared {
            let own = shown.image.clone().filter(|_| !shown.is_carried);
            let now = || own.unwrap_or_else(|| Arc::new(source.session.film.image()));
            let shows_now = comparison.is_difference && comparison.right.is_none();
            let of = shows_now.then(|| source.key());
            let compare = || Ok(comparison.prepare(&developer.gpu, now));
            let compared = self.uploads.compared.or_make((comparison.clone(), of), compare)?;
            shown.picture = compared.picture.unwrap_or(shown.picture);
            (shown.other, shown.difference) = (compared.other, compared.difference);
            // The small picture of a movement has another size for a moment.
            let view = &order.snapshot.request.view;
            let is_of_size =
                |image: &Arc<Image>| (image.width, image.height) == (view.width, view.height);
            let is_final = order.snapshot.is_whole() && shown.image.as_ref().is_none_or(is_of_size);
            shown.uncompared = compared.failure.filter(|_| is_final);
        } else if let Some(source) = Source::plain(order) {
            let prepare = || Ok(source.prepare(&developer, cancel));
            let plain = self.uploads.plain.or_try(source.key(), prepare)?;
            let Some(plain) = plain else { return Ok(None) };
            (shown.other, shown.failure) = (Some(plain.picture), shown.failure.or(plain.failure));
        }
        developer.gpu.check()?;
        self.mix.clone_from(mix);
        Ok(Some(Shown { is_coarse, ..shown }))
    }

    /// The request ahead as it was left, else what the last picture shows of its view; and the automatic stops of that
    /// picture. `None` for a movement whose first picture is ready: with it more is seen.
    fn ahead(&self, order: &Order, source: &Source) -> Option<(Arc<Image>, f32)> {
        if order.latest().moving && self.uploads.picture.is_of(&source.key()) {
            return None;
        }
        let carried = || Some((Arc::new(self.carried.ahead(order)?), self.automatic_ev));
        let kept = self.recent.ahead(order);
        kept.map(|kept| (Arc::clone(&kept.image), kept.automatic_ev)).or_else(carried)
    }

    /// The exposure a part of a picture has from the whole one it lies on: it does not become brighter or
    /// darker because less is rendered. In another scene and under another map it is measured.
    fn whole_ev(&self, order: &Order) -> Option<f32> {
        let (request, whole) = (&order.snapshot.request, self.whole.as_ref()?);
        request.view.crop?;
        let is_alike = whole.environment.shares_map_with(&request.environment)
            && Arc::ptr_eq(&whole.geometry, &request.world.geometry)
            && Some(whole.white_balance) == order.metered;
        is_alike.then_some(whole.ev)
    }

    /// Whether a picture shows less yet than the last one of a movement that ended in its view: no smaller pixels, or
    /// fewer samples.
    fn is_coarse(&self, snapshot: &Snapshot) -> bool {
        let (request, film) = (&snapshot.request, &snapshot.main.film);
        let Some((moved, width, samples)) = &self.moved else { return false };
        let films = || snapshot.backdrop.iter().map(|backdrop| &backdrop.film).chain([film]);
        let every = films().filter_map(|film| film.whole_pixels()).min().unwrap_or(film.width);
        let own: u64 = films().map(|film| film.total_samples()).sum();
        every > 1
            && moved.view.camera == request.view.camera
            && moved.is_seen_like(request)
            && (film.width / every <= *width || own < *samples)
    }

    /// Lets go of what the order does not ask for: each holds a film, or a scene.
    fn leave_what_is_not_in(&mut self, order: &Order) {
        let world = &order.snapshot.request.world;
        self.moved.take_if(|(moved, ..)| !Arc::ptr_eq(&moved.world, world));
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
        settings: Option<DevelopSettings>,
        shown: &Prepared,
    ) -> Option<Painted<OverlayTexture>> {
        if overlay.needs_surfaces() {
            self.prepare(&order.snapshot);
        }
        let image = || shown.image.clone().unwrap_or_else(|| Arc::new(order.image()));
        let image = (overlay == Overlay::Flip).then(image);
        let sources = Sources {
            snapshot: &order.snapshot,
            image: image.as_deref(),
            surfaces: self.surfaces.as_ref().map(|(_, surfaces)| surfaces),
            facts: self.facts.as_ref().map(|(_, _, facts)| &**facts),
            settings,
            tile: order.tile,
            sun: order.sun.as_ref(),
        };
        let painted = sources.paint(overlay)?;
        let (gpu, width) = (&order.developer.gpu, order.snapshot.main.film.width);
        let colors = OverlayTexture::of_colors(gpu, &painted.colors, width, &shown.picture);
        Some(Painted { colors, legend: painted.legend, labels: painted.labels })
    }

    /// Brings surfaces and facts up to date with the snapshot.
    fn prepare(&mut self, snapshot: &Arc<Snapshot>) {
        let film = &snapshot.main.film;
        let request = &snapshot.request;
        self.surfaces.take_if(|(old, surfaces)| {
            !Arc::ptr_eq(&old.world, &request.world)
                || (&old.view.camera, old.view.crop) != (&request.view.camera, request.view.crop)
                || (surfaces.width, surfaces.height) != (film.width, film.height)
        });
        self.surfaces.get_or_insert_with(|| {
            let view = request.view.of_size(film.width, film.height);
            (Arc::clone(request), SurfaceMap::of(&request.world, &view))
        });
        let Some(grid) = &snapshot.main.grid else {
            self.facts = None;
            return;
        };
        let counted = snapshot.counters.is_some();
        self.facts.take_if(|(old, with, _)| !Arc::ptr_eq(old, grid) || *with != counted);
        self.facts.get_or_insert_with(|| {
            let facts = CellFacts::of(grid, snapshot.counters.as_deref(), &request.environment);
            (Arc::clone(grid), counted, Arc::new(facts))
        });
    }
}
