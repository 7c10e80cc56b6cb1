//! What comes up from the threads, and what is sent down to them.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::comparison::Comparison;
use super::document::{Document, PictureSize, Viewpoint, in_other_shape, number_now};
use super::interface::Chosen;
use super::loader::{Kind, Loaded, LoadedMap, LoadedScene};
use super::presenter::{Order, Shown};
use super::speed_up::SpeedUp;
use super::threads::lock;
use super::worker::{Request, Snapshot};
use super::{App, Later, surface_map};
use crate::denoise::Denoiser;
use crate::environment::Environment;
use crate::memory;
use crate::path::framing;
use crate::render::gpu::DeviceChoice;
use crate::sources;

/// What a pixel of the picture takes: films of its exact and of its cached light, copies of both that are shown
/// and that will be, and what takes noise out (measured: 630).
pub(super) const BYTES_PER_PIXEL: u64 = 640;

/// An environment and what it was made from.
pub(super) struct TransformedMap {
    map: Arc<Environment>,
    rotation_degrees: f32,
    intensity: f32,
    pub(super) environment: Arc<Environment>,
}

impl App {
    /// Takes what the threads have ready.
    pub(super) fn collect(&mut self, context: &egui::Context) {
        for loaded in self.loader.take() {
            match loaded {
                // Somebody has gone back meanwhile.
                Loaded::Scene(name, _) if name != self.document.scene => {}
                Loaded::Map(name, _) if name != self.document.map => {}
                Loaded::Scene(_, Ok(scene)) => self.take_scene(scene),
                Loaded::Edited(_, Ok(scene)) => {
                    self.scene = Some(scene);
                    self.inspector.forget();
                }
                Loaded::Edited(_, Err(error)) => {
                    self.messages.error(error.to_string());
                    let edits = self.scene.as_ref().map(|scene| scene.edits.clone());
                    self.put_back(|document| document.materials = edits.unwrap_or_default());
                }
                Loaded::Map(_, Ok(map)) => {
                    if self.map.as_ref().is_none_or(|old| old.name != map.name) {
                        self.messages.notices(&map.notices);
                    }
                    self.messages.opened(Kind::Map);
                    self.settings.recent_map(&map.name);
                    self.has_news |= self.settings.recent_maps != self.settings_before.recent_maps;
                    // Not as it is with another sun.
                    if map.sun_factor == 1.0 {
                        self.keep_small_map(&map.name, Arc::clone(&map.preview));
                    }
                    self.map = Some(map);
                    self.inspector.forget();
                }
                // What is shown stays, and the document says so again.
                Loaded::Scene(_, Err(error)) => {
                    match &self.scene {
                        Some(_) => self.messages.not_opened(Kind::Scene, error.to_string()),
                        None => self.messages.error(error.to_string()),
                    }
                    // One that is read again is still shown.
                    if self.scene_of_document().is_none() {
                        self.give_up_saving("its scene cannot be read");
                    }
                    self.stay_in_scene();
                }
                Loaded::Map(_, Err(error)) => {
                    let (map, sun) = match &self.map {
                        Some(map) => {
                            self.messages.not_opened(Kind::Map, error.to_string());
                            (map.name.clone(), map.sun_factor)
                        }
                        // At the start there is none: the built-in one is always there.
                        None => {
                            self.messages.error(error.to_string());
                            let Document { map, sun, .. } = Document::default();
                            (map, sun)
                        }
                    };
                    if self.snapshot.is_none() {
                        self.give_up_saving("there is no picture");
                    }
                    self.put_back(|document| (document.map, document.sun) = (map, sun));
                }
            }
        }
        while let Ok(later) = self.later.1.try_recv() {
            match later {
                Later::Chosen(number, path) => {
                    self.take_chosen(number, path.as_deref(), context);
                }
                Later::SmallMaps(maps) => {
                    maps.into_iter().for_each(|map| self.small_maps.take(map, context));
                }
                Later::Done(sentence) => self.messages.notice(sentence),
                Later::Failed(sentence) => self.messages.error(sentence),
                Later::KeptPictures(earlier) => {
                    let count = self.history.take_over(earlier);
                    self.interface.compared.shift(count);
                }
            }
        }
        let arrived = lock(&self.arriving).take();
        if arrived.is_some() {
            (self.reference, self.reference_of) = (arrived, None);
        }
        if let Some(sentence) = self.worker.take_panic() {
            self.messages.error(sentence);
            // It would end so again.
            self.interface.paused = true;
        }
        for sentence in self.worker.take_failures() {
            self.messages.error(sentence);
            // Asked for again, it is tried again. The worker does without by itself where none was asked for.
            if self.document.light.device == DeviceChoice::Gpu {
                self.document.light.device = DeviceChoice::Cpu;
                self.undo.amend(&self.document);
            }
        }
        self.inspector.collect();
        let snapshot = self.worker.snapshot();
        if let Some(snapshot) = snapshot
            && self.snapshot.as_ref().is_none_or(|old| old.number != snapshot.number)
        {
            self.convergence.add(snapshot.main.sampling, &snapshot.curves);
            let plain = snapshot.plain.as_ref();
            self.speed_up = plain.and_then(|plain| SpeedUp::of(&snapshot.main, plain));
            self.snapshot = Some(snapshot);
        }
        // What is on a device that was lost cannot be drawn.
        let is_here =
            |shown: &Arc<Shown>| Arc::ptr_eq(&shown.order.developer, &self.screen.developer);
        self.shown = self.presenter.shown().filter(is_here);
        self.follow_shape();
        self.inspect();
        let shown = self.shown.as_deref();
        if let Some(failure) = shown.and_then(|shown| shown.failure.clone()) {
            self.messages.error(failure);
            self.document.look.denoiser = Denoiser::default();
            self.undo.amend(&self.document);
        }
        // Said once: what cannot be compared is compared no longer.
        let compared = Comparison::new(self.interface.compared, &self.history);
        let shown = shown.filter(|shown| compared.is_some() && shown.order.compared == compared);
        if let Some(failure) = shown.and_then(|shown| shown.uncompared.clone()) {
            self.messages.error(failure);
            self.interface.compared = Chosen::default();
        }
    }

    fn take_scene(&mut self, scene: LoadedScene) {
        self.messages.opened(Kind::Scene);
        self.messages.notices(&scene.world.scene.notices);
        self.settings.recent_scene(&scene.name);
        self.has_news |= self.settings.recent_scenes != self.settings_before.recent_scenes;
        let is_first = self.scene.is_none();
        if let Some(before) = self.scene.take().filter(|before| before.name == scene.name) {
            self.renumber(&before, &scene);
        }
        self.scene = Some(scene);
        self.fill_in_viewpoint();
        if is_first {
            // An empty window is nothing to go back to.
            self.undo.amend(&self.document);
        }
        self.inspector.forget();
    }

    /// Keeps what was changed with the materials that have its name, where a scene was read again: another program
    /// may have put them in another order.
    fn renumber(&mut self, before: &LoadedScene, now: &LoadedScene) {
        let (before, now, name) = (&before.materials, &now.materials, &now.name);
        for material in self.document.renumber(before, now) {
            let sentence = format!("{name}: {material}, which was changed, is no longer there");
            self.messages.notice(sentence);
        }
        self.undo.change_all(|document| {
            if document.scene == *name {
                document.renumber(before, now);
            }
        });
        if let Some(of) = self.reference_of.as_mut().filter(|of| of.scene == *name) {
            of.renumber(before, now);
        }
        let material = self.interface.material;
        self.interface.material = material.and_then(|number| number_now(number, before, now));
    }

    /// Gives the document what belongs to the scene that is shown, after another could not be read.
    pub(super) fn stay_in_scene(&mut self) {
        let Some(scene) = &self.scene else {
            // At the start there is none: the built-in one is always there.
            self.document.scene = Document::default().scene;
            self.document.viewpoint = None;
            self.document.bookmarks = self.settings.viewpoints_of(&self.document.scene);
            return;
        };
        let before = self.undo.present();
        let brought_its_sky = sources::is_built_in_scene(&self.document.scene);
        if before.scene == scene.name {
            self.document.scene.clone_from(&before.scene);
            self.document.viewpoint.clone_from(&before.viewpoint);
            self.document.bookmarks.clone_from(&before.bookmarks);
            (self.document.region, self.document.fog) = (before.region, before.fog);
            self.document.materials.clone_from(&before.materials);
            // The sky that came with the other one goes with it; a map that somebody chose stays.
            if brought_its_sky {
                self.document.map.clone_from(&before.map);
            }
        } else {
            // Somebody went back to a file that is no longer there.
            self.document.scene.clone_from(&scene.name);
            self.document.viewpoint = Some(first_viewpoint(scene));
            self.document.bookmarks = self.settings.viewpoints_of(&scene.name);
            self.document.materials.clone_from(&scene.edits);
            self.undo.amend(&self.document);
        }
    }

    /// Keeps a step for undo once nobody drags or types any more.
    pub(super) fn settle(&mut self, context: &egui::Context) {
        let busy = context.input(|i| i.pointer.any_down()) || context.text_edit_focused();
        // A file that is being read may turn out to be damaged: nothing has changed then.
        let is_there = self.scene_of_document().is_some() && self.map_of_document().is_some();
        if !busy && is_there && !self.interface.is_moving(context.time()) {
            self.undo.settle(&self.document);
        }
    }

    /// The scene that the document names, if it is there.
    pub(super) fn scene_of_document(&self) -> Option<&LoadedScene> {
        self.scene.as_ref().filter(|scene| scene.name == self.document.scene)
    }

    /// The map that the document names, if it is there.
    fn map_of_document(&self) -> Option<&LoadedMap> {
        self.map.as_ref().filter(|map| map.name == self.document.map)
    }

    /// Whether scene and map are there as the document wants them.
    pub(super) fn has_sources(&self) -> bool {
        self.scene_of_document().is_some_and(|scene| scene.edits == self.document.materials)
            && self.map_of_document().is_some_and(|map| map.sun_factor == self.document.sun)
    }

    /// Whether a picture, which may be small, is of what the document says now.
    pub(super) fn is_of_document(&self, snapshot: &Snapshot) -> bool {
        self.has_sources() && self.worker.is_of_latest(snapshot)
    }

    /// Takes back what cannot be had; it was no step.
    fn put_back(&mut self, change: impl FnOnce(&mut Document)) {
        let refused = self.document.clone();
        change(&mut self.document);
        self.undo.correct(&refused, &self.document);
    }

    /// Looks from somewhere, where the document does not say from where.
    fn fill_in_viewpoint(&mut self) {
        if self.document.viewpoint.is_none()
            && let Some(viewpoint) = self.scene_of_document().map(first_viewpoint)
        {
            self.put_back(|document| document.viewpoint = Some(viewpoint));
        }
    }

    /// Tells the loader, the worker and the presenter what is wanted now.
    pub(super) fn send_down(&mut self, context: &egui::Context) {
        self.fill_in_viewpoint();
        self.follow_room();
        match self.scene.as_ref().filter(|scene| scene.name == self.document.scene) {
            None => self.loader.load_scene(&self.document.scene),
            Some(scene) if scene.edits != self.document.materials => {
                self.loader.edit_scene(scene, &self.document.materials);
            }
            Some(_) => {}
        }
        let sun = self.document.sun;
        match self.map.as_ref().filter(|map| map.name == self.document.map) {
            None => self.loader.load_map(&self.document.map, sun),
            Some(map) if map.sun_factor != sun => self.loader.edit_map(map, sun),
            Some(_) => {}
        }
        if let Some(request) = self.request(context.time()) {
            if request.moving {
                context.request_repaint_after(std::time::Duration::from_millis(60));
            }
            self.inspect();
            self.worker.submit(request);
        }
        self.save_when_whole();
        if let Some(snapshot) = self.snapshot.as_ref().filter(|s| s.has_picture()) {
            // Kept pictures are whole ones.
            let is_whole = self.document.region.is_none() && snapshot.request.view.crop.is_none();
            let compared = Comparison::new(self.interface.compared, &self.history);
            let look = &self.document.look;
            self.presenter.order(Order {
                developer: Arc::clone(&self.screen.developer),
                snapshot: Arc::clone(snapshot),
                denoiser: look.denoise.then_some(look.denoiser),
                metered: look.auto_exposure.then_some(look.white_balance),
                overlay: self.interface.overlay,
                look: self.interface.overlay.filter(|o| o.is_developed()).map(|_| *look),
                tile: self.interface.tile,
                compared: compared.filter(|_| is_whole),
            });
        }
    }

    /// Keeps the region on the same part of the scene where the room for the picture has got another shape: the field
    /// of view is vertical.
    fn follow_room(&mut self) {
        let Some(room) = self.interface.viewport_pixels else { return };
        let before = self.room.replace(room).filter(|before| *before != room);
        let Some(before) = before else { return };
        let aspect = |[width, height]: [u32; 2]| width as f32 / height as f32;
        let factor = aspect(before) / aspect(room);
        self.document.follow_room(factor);
        self.undo.change_all(|document| document.follow_room(factor));
    }

    /// Keeps the inspected place there, too, where another picture is shown.
    fn follow_shape(&mut self) {
        let Some(shown) = &self.shown else { return };
        let view = shown.order.snapshot.view();
        if view.crop.is_some() {
            return;
        }
        let aspect = view.width as f32 / view.height.max(1) as f32;
        let before = self.shown_aspect.replace(aspect).filter(|before| *before != aspect);
        if let Some((before, place)) = before.zip(self.interface.pinned) {
            let place = Vec2::new(in_other_shape(place.x, before / aspect), place.y);
            self.interface.pinned = Some(place).filter(|place| (0.0..=1.0).contains(&place.x));
        }
    }

    /// Takes back a size, or the whole in place of a region, for which there is no memory: the system would end
    /// the window.
    fn check_size(&mut self) {
        let asked = (self.document.size, self.document.region);
        if asked == self.affordable {
            return;
        }
        if let PictureSize::Fixed(width, height) = asked.0 {
            // A region of how many pixels is known once there is a camera.
            let Some(view) = self.document.view(width, height) else { return };
            let bytes = view.pixels() * BYTES_PER_PIXEL;
            if let Err(cause) = memory::check(bytes) {
                self.messages.error(format!("a picture of {width} x {height} pixels {cause}"));
                let (size, region) = self.affordable;
                self.put_back(|document| (document.size, document.region) = (size, region));
            }
        }
        self.affordable = (self.document.size, self.document.region);
    }

    fn request(&mut self, now: f64) -> Option<Request> {
        self.check_size();
        if self.reference.is_some() && self.reference_of.is_none() && self.has_sources() {
            self.reference_of = Some(self.document.clone());
        }
        // Another scene would be seen from this one's viewpoint.
        let world = Arc::clone(&self.scene_of_document()?.world);
        let environment = self.environment()?;
        let [width, height] = self.document.size.pixels(self.interface.viewport_pixels)?;
        Some(Request {
            world,
            environment,
            view: self.document.view(width, height)?,
            split: self.document.light.split,
            moving: self.interface.is_moving(now) && !self.is_repeatable,
            previews: !self.is_repeatable,
            device: self.document.light.device,
            wants_cached: self.document.look.denoise,
            inspects_cache: self.interface.inspects_cache(),
            rule: self.document.stop,
            is_frozen: self.interface.is_frozen,
            reference: self
                .reference
                .clone()
                .filter(|_| self.has_sources() && self.is_like_reference()),
            paused: self.interface.paused,
            run: self.interface.run,
        })
    }

    /// What the picture on the screen is of or, before there is one, the newest.
    pub(super) fn seen(&self) -> Option<&Arc<Snapshot>> {
        let shown = self.shown.as_ref().map(|shown| &shown.order.snapshot);
        shown.or(self.snapshot.as_ref())
    }

    fn inspect(&mut self) {
        let seen = self.seen().cloned();
        self.inspector.update(&self.interface, seen.as_ref());
    }

    /// Whether the document shows what it did when the reference came: that is of nothing else.
    pub(super) fn is_like_reference(&self) -> bool {
        self.reference_of.as_ref().is_some_and(|of| of.shows_like(&self.document))
    }

    /// The map as the document turns and scales it; made anew only when that changes.
    fn environment(&mut self) -> Option<Arc<Environment>> {
        let map = &self.map.as_ref()?.environment;
        let (rotation_degrees, intensity) =
            (self.document.rotation_degrees, self.document.intensity);
        let is_current = self.lit.as_ref().is_some_and(|lit| {
            Arc::ptr_eq(&lit.map, map)
                && lit.rotation_degrees == rotation_degrees
                && lit.intensity == intensity
        });
        if !is_current {
            let mut environment = (**map).clone();
            environment.set_rotation(rotation_degrees.to_radians());
            environment.set_intensity(intensity);
            let environment = Arc::new(environment);
            self.lit = Some(TransformedMap {
                map: Arc::clone(map),
                rotation_degrees,
                intensity,
                environment,
            });
        }
        self.lit.as_ref().map(|lit| Arc::clone(&lit.environment))
    }
}

/// Through the scene's first camera, or of all of it where there is none.
fn first_viewpoint(scene: &LoadedScene) -> Viewpoint {
    let own = scene.world.scene.cameras.first().cloned();
    let is_framed = own.is_none();
    let camera = own.unwrap_or_else(|| framing::frame(&scene.world, 16.0 / 9.0));
    let (low, high) = scene.world.bvh.bounds();
    let eye = Vec3::from(camera.world_from_camera.translation);
    let is_outside = !(eye.cmpge(low) & eye.cmple(high)).all();
    // What is framed from outside is turned about its middle, not about what is seen first or behind it.
    let distance = match is_framed && is_outside {
        true => camera.focus_distance,
        false => pivot_distance(scene, &camera),
    };
    let mut viewpoint = Viewpoint::of(&camera, distance);
    if !(viewpoint.focus_distance.is_finite() && viewpoint.focus_distance > 0.0) {
        viewpoint.focus_distance = distance;
    }
    viewpoint
}

/// Metres to what is in the middle of a camera's picture.
fn pivot_distance(scene: &LoadedScene, camera: &crate::scene::Camera) -> f32 {
    let rays = crate::path::camera::CameraRays::new(camera, 16, 9);
    let ray = rays.ray(Vec2::new(8.0, 4.5), Vec2::splat(0.5));
    let (low, high) = scene.world.bvh.bounds();
    surface_map::look(&scene.world, ray)
        .map_or(0.5 * (high - low).length(), |spot| spot.position.distance(ray.origin))
        .max(0.05)
}
