//! What comes up from the threads, and what is sent down to them.

use std::sync::Arc;
use std::time::Duration;

use super::application::App;
use super::assets::{Assets, first_viewpoint, start_viewpoint};
use super::comparison::Comparison;
use super::document::{Document, number_now};
use super::edited::Edited;
use super::interface::Chosen;
use super::library::Library;
use super::loader::{Kind, Loaded, LoadedMap, LoadedScene};
use super::messages::Messages;
use super::tasks::{TaskResult, read_reference};
use super::worker::{Request, Snapshot};
use crate::denoise::Denoiser;
use crate::error::Error;
use crate::render::gpu::DeviceChoice;
use crate::render::light_groups::MAX_LAMPS;
use crate::sources;

/// What helps where a room has no opening.
const DARK: &str = "No light reaches what the camera sees: no path has found the sky or a lamp. Hide a wall or an opaque \
                    pane (click it, then Hide under MATERIAL), add a lamp, or look from elsewhere";

impl App {
    /// Takes what the threads have ready.
    pub(super) fn collect(&mut self, context: &egui::Context) {
        for loaded in self.assets.take(&self.edited.document) {
            match loaded {
                Loaded::Scene(Ok(scene)) => self.take_scene(scene),
                Loaded::Scene(Err(error)) => self.refuse(Kind::Scene, &error),
                Loaded::Edited(Ok(scene)) => {
                    self.assets.scene = Some(scene);
                    self.rendering.inspector.forget();
                }
                Loaded::Edited(Err(error)) => {
                    self.messages.error(error.to_string());
                    if let Some(scene) = &self.assets.scene {
                        let changes = scene.changes.clone();
                        self.edited.put_back(|document| match document.mix() {
                            None => document.set_changes(changes),
                            // Factors of a mix are not the scene's.
                            Some(_) => document.materials = changes.materials,
                        });
                    }
                }
                Loaded::Map(Ok(map)) => self.take_map(map),
                Loaded::Map(Err(error)) => self.refuse(Kind::Map, &error),
            }
        }
        while let Ok(result) = self.tasks.receiver.try_recv() {
            self.take_result(result, context);
        }
        if let Some(read) = self.assets.looks.read(&self.edited.document.look) {
            self.tasks.run("look", || Ok(TaskResult::Look(read())));
        }
        for kind in self.assets.changed(&self.edited.document, self.library.settings.reloads) {
            self.interface.paused &= !self.assets.read_again(kind, &self.edited.document);
        }
        match self.renders.advance() {
            Some(Ok(sentence)) => self.messages.notice(sentence),
            Some(Err(sentence)) => self.messages.error(sentence),
            None => {}
        }
        if let Some((path, of)) = self.renders.take_reference() {
            self.tasks.run("reference", move || {
                let read = read_reference("a render of its own".to_owned(), &path, Some(of));
                // A temporary file that stays does no harm.
                let _ = std::fs::remove_file(&path);
                read
            });
        }
        self.take_render_failures();
        self.rendering.collect();
        if self.rendering.turns_out_dark() {
            self.messages.notice(DARK);
        }
        self.display.collect();
        if let Some(factor) = self.display.change_of_aspect() {
            self.interface.follow_shape(factor);
        }
        self.inspect();
        self.take_display_failures();
    }

    fn take_scene(&mut self, scene: LoadedScene) {
        self.messages.opened(Kind::Scene);
        self.messages.notices(&scene.new_notices(self.assets.scene.as_ref()));
        self.library.note_scene(&scene.name);
        let is_first = self.assets.scene.is_none();
        match self.assets.scene.take() {
            Some(before) if before.name == scene.name => self.renumber(&before, &scene),
            // Kept pictures of another scene would lie over this one.
            Some(_) => self.interface.compared = Chosen::default(),
            None => {}
        }
        forget_lamps(&mut self.edited, &scene, &mut self.messages);
        if scene.named_lamps.len() > MAX_LAMPS && self.edited.document.light_mix {
            self.messages.notice(format!("A light mix has room for {MAX_LAMPS} lamps; it is off"));
            self.edited.put_back(|document| document.light_mix = false);
        }
        self.assets.scene = Some(scene);
        fill_in_viewpoint(&mut self.edited, &self.assets, &mut self.messages);
        if is_first {
            // An empty window is nothing to go back to.
            self.edited.amend(|_| ());
        }
        self.rendering.inspector.forget();
    }

    /// Keeps to the same materials by their names, where a scene was read again.
    fn renumber(&mut self, before: &LoadedScene, now: &LoadedScene) {
        for material in self.edited.renumber(before, now) {
            let name = &now.name;
            let sentence = format!("{name}: {material}, which was changed, is no longer there");
            self.messages.notice(sentence);
        }
        self.assets.renumber_reference(before, now);
        let number_now = |number| number_now(number, &before.materials, &now.materials);
        self.interface.material = self.interface.material.and_then(number_now);
    }

    /// What is shown stays, and the document says so again.
    fn refuse(&mut self, kind: Kind, error: &Error) {
        let (is_shown, why) = match kind {
            Kind::Scene => (self.assets.scene.is_some(), "its scene cannot be read"),
            Kind::Map => (self.assets.map.is_some(), "there is no picture"),
        };
        match is_shown {
            true => self.messages.not_opened(kind, error.to_string()),
            false => self.messages.error(error.to_string()),
        }
        self.stay(kind, why);
    }

    /// Puts the scene or the map that is shown back into the document. Pictures of the other one that were to be saved
    /// are given up; `why` is the reason.
    pub(super) fn stay(&mut self, kind: Kind, why: &str) {
        let is_shown = match kind {
            // One that is read again is still shown.
            Kind::Scene => self.assets.scene_of(&self.edited.document).is_some(),
            Kind::Map => self.rendering.snapshot.is_some(),
        };
        if !is_shown {
            self.messages.errors(self.saves.give_up(why));
        }
        match kind {
            Kind::Scene => stay_in_scene(&mut self.edited, &self.assets, &self.library),
            Kind::Map => {
                let shown = self.assets.map.as_ref();
                let shown = shown.map(|map| (map.name.clone(), map.sun_factor));
                // At the start there is none: the built-in one is always there.
                let Document { map, sun, .. } = Document::default();
                let (map, sun) = shown.unwrap_or((map, sun));
                self.edited.put_back(|document| {
                    document.map = map;
                    // That of a mix is not the map's.
                    if document.mix().is_none() {
                        document.sun = sun;
                    }
                });
            }
        }
    }

    fn take_map(&mut self, map: LoadedMap) {
        if self.assets.map.as_ref().is_none_or(|old| old.name != map.name) {
            self.messages.notices(&map.notices);
        }
        self.messages.opened(Kind::Map);
        self.library.note_map(&map.name);
        // Not as it is with another sun.
        if map.sun_factor == 1.0 {
            let Library { settings, small_maps, .. } = &self.library;
            let preview = Arc::clone(&map.preview);
            let make = small_maps.make(&map.name, &settings.recent_maps, preview);
            self.tasks.write("small map", || Ok(TaskResult::SmallMaps(make())));
        }
        self.assets.map = Some(map);
        self.rendering.inspector.forget();
    }

    fn take_result(&mut self, result: TaskResult, context: &egui::Context) {
        match result {
            TaskResult::Chosen(number, path) => {
                let command = self.desktop.answer(number, path.as_deref(), &mut self.interface);
                if let Some(command) = command {
                    self.execute(command, context);
                }
            }
            TaskResult::CameraPicture(made) => self.rendering.camera_pictures.take(made, context),
            TaskResult::SmallMaps(found) => self.library.small_maps.take(found, context),
            TaskResult::LearningSteps(steps) => self.rendering.take_steps(steps),
            TaskResult::Truth(truth) => self.rendering.inspector.take(truth),
            TaskResult::Done(sentence) => self.messages.notice(sentence),
            TaskResult::Failed(sentence) => self.messages.error(sentence),
            TaskResult::KeptPictures(earlier) => {
                let count = self.library.history.take_over(earlier);
                self.interface.compared.shift(count);
            }
            TaskResult::Look(look) => {
                let name = look.name.clone();
                if let Err(error) = self.assets.looks.take(look) {
                    self.messages.error(error.to_string());
                    let last = self.assets.looks.last.clone();
                    self.edited.put_back(|document| {
                        if document.look.lut == Some(name) {
                            document.look.lut = last;
                        }
                    });
                }
            }
            TaskResult::Reference(reference, of) => {
                let (name, image) = (&reference.name, &reference.image);
                self.messages.notice(format!(
                    "Errors are measured against {name} in pictures of {} x {} pixels",
                    image.width, image.height
                ));
                self.assets.set_reference(Some(reference), of);
            }
        }
    }

    fn take_render_failures(&mut self) {
        if let Some(sentence) = self.rendering.worker.take_panic() {
            self.messages.error(sentence);
            // It would end so again.
            self.interface.paused = true;
        }
        for sentence in self.rendering.worker.take_failures() {
            self.messages.error(sentence);
            // Asked for again, it is tried again. The worker does without by itself where none was asked for.
            if self.edited.document.light.device == DeviceChoice::Gpu {
                self.edited.amend(|document| document.light.device = DeviceChoice::Cpu);
            }
        }
    }

    fn take_display_failures(&mut self) {
        let Some(shown) = self.display.shown.as_deref() else { return };
        if let Some(failure) = shown.failure.clone() {
            self.messages.error(failure);
            self.edited.amend(|document| document.look.denoiser = Denoiser::ATrous);
        }
        // Said once: what cannot be compared is compared no longer.
        let compared = Comparison::new(self.interface.compared, &self.library.history);
        let is_it = compared.is_some() && shown.order.compared == compared;
        if let Some(failure) = shown.uncompared.clone().filter(|_| is_it) {
            self.messages.error(failure);
            self.interface.compared = Chosen::default();
        }
    }

    /// Keeps a step for undo once nobody drags or types any more.
    pub(super) fn settle(&mut self, context: &egui::Context) {
        let busy = context.input(|i| i.pointer.any_down()) || context.text_edit_focused();
        // A file that is being read may turn out to be damaged: nothing has changed then.
        let is_there = self.assets.are_named_by(&self.edited.document);
        if !busy && is_there && !self.interface.is_moving(context.time()) {
            self.edited.settle();
        }
    }

    /// Whether a picture, which may be small, is of what the document says now.
    pub(super) fn is_of_document(&self, snapshot: &Snapshot) -> bool {
        self.assets.are_as_in(&self.edited.document) && self.rendering.worker.is_of_latest(snapshot)
    }

    /// Tells the loader, the worker and the presenter what is wanted now.
    pub(super) fn send_down(&mut self, context: &egui::Context) {
        fill_in_viewpoint(&mut self.edited, &self.assets, &mut self.messages);
        self.edited.follow_room(self.interface.viewport_pixels);
        self.assets.load(&self.edited.document);
        if let Some(request) = self.request(context.time()) {
            if request.moving {
                context.request_repaint_after(Duration::from_millis(60));
            }
            self.inspect();
            self.rendering.worker.submit(request);
        }
        if !self.saves.waiting.is_empty()
            && let Some(picture) = self.picture()
        {
            self.saves.write(picture, &mut self.tasks);
        }
        let snapshot = self.rendering.snapshot_at(self.interface.learning_step);
        if let Some(snapshot) = snapshot.as_ref().filter(|snapshot| snapshot.has_picture()) {
            let document = &self.edited.document;
            // Kept pictures are whole ones.
            let is_whole = document.region.is_none() && snapshot.request.view.crop.is_none();
            let compared = Comparison::new(self.interface.compared, &self.library.history);
            let compared = compared.filter(|_| is_whole);
            let latest = self.rendering.worker.latest();
            let overlay = self.interface.overlay_at(context.time());
            let sun = self.assets.map.as_ref().and_then(|map| map.sun);
            let drawn = (overlay, self.interface.tile, sun);
            let tone = self.assets.looks.tone(&document.look);
            self.display.order((snapshot, latest), document, drawn, tone, compared);
        }
    }

    fn request(&mut self, now: f64) -> Option<Request> {
        self.messages.failure(self.edited.check_size());
        let (document, interface) = (&self.edited.document, &self.interface);
        let reference = self.assets.reference_for(document);
        // Another scene would be seen from this one's viewpoint.
        let world = Arc::clone(&self.assets.scene_of(document)?.world);
        let environment = self.assets.environment(document)?;
        // With a mix on or off, other lights are loaded: until they are there the last picture goes on.
        let was_mix = self.rendering.worker.latest().is_some_and(|request| request.mix.is_some());
        if (was_mix || document.mix().is_some()) && !self.assets.are_as_in(document) {
            return None;
        }
        let [width, height] = document.size.pixels(interface.viewport_pixels)?;
        let mut view = document.view(width, height)?;
        let (moving, mix) = (interface.is_moving(now) && !self.is_repeatable, document.mix());
        if let Some(factors) = mix.as_ref().filter(|_| moving) {
            view.local_lights = factors.local_lights(&world);
        }
        Some(Request {
            world,
            environment,
            view,
            split: document.light.split,
            moving,
            previews: !self.is_repeatable,
            device: document.light.device,
            // What a mix trains is not kept.
            wants_cached: document.look.denoise && !(moving && mix.is_some()),
            mix,
            inspects_cache: interface.inspects_cache(),
            rule: document.stop,
            is_frozen: interface.is_frozen,
            reference,
            paused: interface.paused,
            run: interface.run,
        })
    }

    /// The picture on the screen or, before there is one, the newest.
    pub(super) fn seen(&self) -> Option<&Arc<Snapshot>> {
        let shown = self.display.shown.as_ref().map(|shown| &shown.order.snapshot);
        shown.or(self.rendering.snapshot.as_ref())
    }

    fn inspect(&mut self) {
        let seen = self.seen().cloned();
        self.rendering.inspector.update(&self.interface, seen.as_ref());
    }
}

/// Drops changes to lamps that a scene does not have, and says so.
fn forget_lamps(edited: &mut Edited, scene: &LoadedScene, messages: &mut Messages) {
    let has = |name: &String| scene.named_lamps.iter().any(|lamp| lamp.name == *name);
    let gone: Vec<_> =
        edited.document.lamp_edits.keys().filter(|name| !has(name)).cloned().collect();
    for name in gone {
        messages.notice(format!("{}: no lamp is called {name}, which was to change", scene.name));
        edited.put_back(|document| document.lamp_edits.retain(|other, _| *other != name));
    }
}

/// Looks from somewhere, where the document does not say from where.
fn fill_in_viewpoint(edited: &mut Edited, assets: &Assets, messages: &mut Messages) {
    if edited.document.viewpoint.is_none()
        && let Some(scene) = assets.scene_of(&edited.document)
    {
        let placed = edited.place.take().map(|from| start_viewpoint(scene, &from)).transpose();
        let placed = placed.unwrap_or_else(|error| {
            messages.error(error.to_string());
            None
        });
        let viewpoint = placed.unwrap_or_else(|| first_viewpoint(scene));
        edited.put_back(|document| document.viewpoint = Some(viewpoint));
    }
}

/// Gives the document what belongs to the scene that is shown, after another could not be read.
pub(super) fn stay_in_scene(edited: &mut Edited, assets: &Assets, library: &Library) {
    let before = edited.undo.present.clone();
    let document = &mut edited.document;
    let Some(scene) = &assets.scene else {
        // At the start there is none: the built-in one is always there.
        document.scene = Document::default().scene;
        document.viewpoint = None;
        document.bookmarks = library.settings.viewpoints_of(&document.scene);
        return;
    };
    if before.scene == scene.name {
        document.set_changes(before.changes());
        // The sky that came with the other one goes with it; a map that somebody chose stays.
        if sources::is_built_in_scene(&document.scene) {
            document.map = before.map;
        }
        document.scene = before.scene;
        document.viewpoint = before.viewpoint;
        document.bookmarks = before.bookmarks;
        (document.region, document.fog) = (before.region, before.fog);
    } else {
        // Somebody went back to a file that is no longer there.
        edited.amend(|document| {
            document.scene.clone_from(&scene.name);
            document.viewpoint = Some(first_viewpoint(scene));
            document.bookmarks = library.settings.viewpoints_of(&scene.name);
            document.set_changes(scene.changes.clone());
        });
    }
}
