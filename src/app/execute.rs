//! Carrying out commands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::application::App;
use super::assets::room_viewpoint;
use super::commands::Command;
use super::document::{Document, Viewpoint};
use super::final_render::{FinalRender, Motion, command_line};
use super::interface::{Chosen, Purpose, Tab, Tool};
use super::kept_picture::SMALL_WIDTH;
use super::learning_steps::LearningSteps;
use super::loader::Kind;
use super::overlays::Overlay;
use super::screen::color_image;
use super::settings_file::{lasting, lasting_scene};
use super::sync::stay_in_scene;
use super::tasks::{TaskResult, read_reference};
use super::worker::{Activity, Snapshot};
use super::{convergence, desktop, save, theme};

use crate::error::Result;
use crate::image::Image;
use crate::render::gpu::DeviceChoice;
use crate::render::sun_placement::SunPlacement;
use crate::render::surface_map::look_at_place;
use crate::render::{Sampling, StopRule};
use crate::scene::{LampEdits, builtin};
use crate::sources;
use crate::tone::display_rgb8;

/// Why there is nothing to render.
const NOT_YET: &str = "The scene is still being read";

impl App {
    /// Carries out a command.
    pub(super) fn execute(&mut self, command: Command, context: &egui::Context) {
        let (interface, document) = (&mut self.interface, &mut self.edited.document);
        match command {
            Command::OpenScene(name) => self.open_scene(name),
            Command::OpenMap(name) if document.map == name => {
                interface.paused &= !self.assets.read_again(Kind::Map, document);
            }
            Command::OpenMap(name) => {
                // The old one is not to be looked at for ever.
                interface.paused = false;
                document.map = name;
            }
            Command::StopLoading => {
                for kind in [Kind::Scene, Kind::Map] {
                    if self.assets.loader.stop(kind) {
                        self.stay(kind, "loading was cancelled");
                    }
                }
            }
            Command::ReadAgain => {
                let mut read = |kind| self.assets.read_again(kind, document);
                interface.paused &= [read(Kind::Scene), read(Kind::Map)] == [false; 2];
            }
            Command::ToggleReloads => self.library.settings.reloads ^= true,
            Command::Ask(purpose) => self.ask(purpose),
            Command::OpenLook(name) => {
                let name = lasting(&name);
                self.assets.looks.forget(&name);
                document.look.lut = Some(name);
            }
            Command::OpenReference(name) => {
                let path = PathBuf::from(&name);
                self.tasks.run("reference", move || read_reference(name, &path, None));
            }
            Command::RenderReference => self.render_reference(),
            Command::ToggleKeptCell => self.rendering.inspector.toggle_kept(),
            Command::ForgetReference => self.assets.set_reference(None, None),
            Command::ShowMethod => self.messages.failure(desktop::show_method()),
            Command::Save(path) => self.save(path),
            Command::Export(path) => self.export(path),
            Command::Render(path) => {
                let (render, document) = (self.interface.final_render, &self.edited.document);
                match self.render_words(render, document, &path) {
                    Some(words) => {
                        self.library.note_save(&path);
                        self.renders.add(path, words, None);
                        self.is_warned = false;
                    }
                    None => self.messages.notice(NOT_YET),
                }
            }
            Command::EndRender(index) => self.renders.end(index),
            Command::CopyCommandLine => {
                let path = self.suggested_render();
                let (render, document) = (self.interface.final_render, &self.edited.document);
                let words = self.render_words(render, document, Path::new(&path));
                let copied = words.map(|words| context.copy_text(command_line(&words)));
                self.messages.notice(copied.map_or(NOT_YET, |()| "Copied the command"));
            }
            Command::Copy => self.copy(context),
            Command::LookFrom(viewpoint) => document.viewpoint = Some(viewpoint),
            Command::MakeCameraPicture(camera) => {
                let request = self.rendering.snapshot.as_ref().map(|it| &it.request);
                let pictures = &mut self.rendering.camera_pictures;
                if let Some(make) = request.and_then(|request| pictures.make(request, camera)) {
                    self.tasks.run("camera", || make().map(TaskResult::CameraPicture));
                }
            }
            Command::Bookmark => self.library.bookmark(document),
            Command::ForgetBookmark(index) => self.library.forget_bookmark(document, index),
            Command::FrameAll => {
                let scene = self.assets.scene.as_ref();
                // From outside, walls would hide a room.
                if let Some(inside) = scene.and_then(room_viewpoint) {
                    document.viewpoint = Some(inside);
                } else {
                    let bounds = scene.map(|scene| scene.world.bvh.bounds());
                    frame(&mut document.viewpoint, bounds, interface.aspect());
                }
            }
            Command::FrameSelected => {
                let bounds = self.selected_bounds();
                frame(&mut self.edited.document.viewpoint, bounds, self.interface.aspect());
            }
            Command::TogglePause => interface.paused = !interface.paused,
            Command::Restart => {
                interface.run = interface.run.wrapping_add(1);
                interface.paused = false;
            }
            Command::ToggleRegion => {
                let marks = document.region.is_none() && interface.tool != Some(Tool::Region);
                interface.tool = marks.then_some(Tool::Region);
                document.region = None;
                interface.pinned = None;
                // A part of what is rendered is marked there.
                (interface.compared.right, interface.compared.is_difference) = (None, false);
            }
            Command::ToggleSun => {
                let is_on = interface.tool == Some(Tool::Sun);
                interface.tool = (!is_on).then_some(Tool::Sun);
                // The sun falls into what is rendered.
                (interface.compared.right, interface.compared.is_difference) = (None, false);
            }
            Command::PutSun { place, is_last } => {
                let said = self.put_sun(place).unwrap_or_else(|cause| Some(cause.to_string()));
                let said = said.into_iter().filter(|_| is_last);
                said.for_each(|sentence| self.messages.notice(sentence));
            }
            Command::Undo | Command::Redo => {
                if let Some(document) = self.edited.step(command == Command::Redo) {
                    self.go_to(document);
                }
            }
            Command::ToggleSplit => document.light.split = !document.light.split,
            Command::ToggleDevice => {
                let device = &mut document.light.device;
                let is_gpu = match device {
                    DeviceChoice::Cpu => false,
                    DeviceChoice::Gpu => true,
                    DeviceChoice::Auto => self.rendering.is_on_gpu(DeviceChoice::Auto),
                };
                *device = if is_gpu { DeviceChoice::Cpu } else { DeviceChoice::Gpu };
            }
            Command::ToggleDenoise => document.look.denoise = !document.look.denoise,
            Command::TogglePanels => {
                interface.panels = !interface.panels;
                if !interface.panels {
                    self.messages.notice("H shows the panels again");
                }
            }
            Command::StepOverlay(step) => {
                interface.overlay = Overlay::beside(interface.overlay, step);
            }
            Command::ToggleDeveloper => interface.toggle_developer(),
            Command::ToggleShortcuts => interface.shortcuts = !interface.shortcuts,
            Command::CloseSheets => (interface.shortcuts, interface.tool) = (false, None),
            Command::KeepPicture => self.keep(),
            Command::SetAsKept(index) => self.set_as_kept(index),
            Command::RenameKept(index, name) => {
                self.messages.failure(self.library.history.rename(index, &name));
            }
            Command::ToggleZoom => interface.toggle_zoom(document.size),
            Command::ToggleFullScreen => self.toggles_full_screen ^= true,
            Command::Quit => self.is_closing = self.may_close(),
            Command::MakeSmallMap => {
                if let Some(make) = self.library.small_maps.make_next() {
                    self.tasks.run("small map", || Ok(TaskResult::SmallMaps(make())));
                }
            }
            Command::ToggleLearningSteps => {
                interface.learning_step = None;
                let steps = self.rendering.steps.take();
                let snapshot = self.rendering.snapshot.as_ref().filter(|_| steps.is_none());
                if let Some(of) = snapshot.map(|snapshot| Arc::clone(&snapshot.request)) {
                    self.rendering.steps = Some(LearningSteps::begun(&of));
                    let learn = || Ok(TaskResult::LearningSteps(LearningSteps::learn(of)));
                    self.tasks.run("learning steps", learn);
                }
            }
            Command::MeasureTruth => {
                let seen = self.seen().cloned();
                let measure = seen.and_then(|seen| self.rendering.inspector.measure(&seen));
                if let Some(measure) = measure {
                    self.tasks.run("truth", || Ok(TaskResult::Truth(measure())));
                }
            }
        }
    }

    /// Turns the map so that its sun shines on a place of the picture; what there is to say of it.
    ///
    /// # Errors
    /// As [`SunPlacement::find`].
    pub(super) fn put_sun(&mut self, place: Vec2) -> Result<Option<String>> {
        let Some(seen) = self.seen() else { return Ok(None) };
        let sun = self.assets.map.as_ref().and_then(|map| map.sun);
        let (world, view) = (&seen.request.world, seen.view());
        let degrees = self.edited.document.rotation_degrees;
        let found = SunPlacement::find(world, &view, sun.as_ref(), place, degrees)?;
        self.edited.document.rotation_degrees = found.rotation_degrees;
        Ok(found.notice())
    }

    /// Asks for a path: by a prompt, and by the system's dialogue before it where there is one.
    fn ask(&mut self, purpose: Purpose) {
        let is_still = self.interface.final_render.motion == Motion::Still;
        let purpose = match purpose {
            Purpose::Render if !is_still => Purpose::RenderFrames,
            purpose => purpose,
        };
        let path = match purpose {
            Purpose::Render | Purpose::RenderFrames => self.suggested_render(),
            Purpose::Picture => self.library.suggested_file(&self.edited.document.scene),
            Purpose::Distributions => "distributions.csv".to_owned(),
            _ => String::new(),
        };
        if !self.is_repeatable {
            self.desktop.ask(purpose, &path, &self.library.settings, &self.tasks);
        }
        self.interface.ask(purpose, path);
    }

    /// Takes the settings that a kept picture was made with.
    fn set_as_kept(&mut self, index: usize) {
        let Some(kept) = self.library.history.list.get(index) else { return };
        let mut document = kept.document.clone();
        let now = &self.edited.document;
        // Those kept since are no part of the picture, and would be lost.
        document.bookmarks = self.library.viewpoints_of(&document.scene, now);
        // Pictures name a file by its whole path.
        if lasting_scene(&document.scene) == lasting_scene(&now.scene) {
            document.scene.clone_from(&now.scene);
        }
        // The room may have had another shape then.
        if let Some([left, top, right, bottom]) = document.seen_region()
            && let Ok(image) = kept.pixels.get()
        {
            let part = image.width as f32 / image.height as f32;
            let whole = part * (bottom - top) / (right - left);
            document.follow_room(whole / self.interface.aspect());
        }
        if kept.of_scene != self.library.history.of_scene {
            self.messages.notice(format!(
                "{}: its scene was opened with other options than now (--variant, --outlines, \
                 --hide, --material), which only the command line gives",
                kept.name
            ));
        }
        self.go_to(document);
    }

    /// Goes over to another scene; one that is shown already is read again, for its file may have changed.
    fn open_scene(&mut self, name: String) {
        let shown = self.assets.scene.as_ref().map(|scene| scene.name.clone());
        let shown = shown.filter(|shown| lasting_scene(shown) == lasting_scene(&name));
        let document = &self.edited.document;
        if let Some(name) = shown {
            self.interface.paused = false;
            if document.scene == name {
                self.assets.read_again(Kind::Scene, document);
            } else {
                // Another one was asked for, and is still being read.
                stay_in_scene(&mut self.edited, &self.assets, &self.library);
            }
            return;
        }
        // Built-in scenes bring their own sky, unless another map was chosen.
        let is_own_sky = document.map == builtin::sky(&document.scene);
        let map = match is_own_sky && sources::is_built_in_scene(&name) {
            true => builtin::sky(&name).to_owned(),
            false => document.map.clone(),
        };
        // A file that cannot be read must leave what is shown as it is.
        self.go_to(Document {
            viewpoint: None,
            bookmarks: self.library.viewpoints_of(&name, document),
            scene: name,
            map,
            materials: BTreeMap::new(),
            lamps: 1.0,
            lamp_edits: LampEdits::new(),
            region: None,
            fog: None,
            ..document.clone()
        });
    }

    /// Takes all settings of a document. What was chosen in another scene is not in this one.
    fn go_to(&mut self, document: Document) {
        let now = &self.edited.document;
        let is_as_before =
            (&document.scene, &document.map, document.sun) == (&now.scene, &now.map, now.sun);
        // The old one is not to be looked at for ever.
        self.interface.paused &= is_as_before;
        if document.scene != now.scene {
            self.library.settings.keep_viewpoints(now);
            (self.interface.material, self.interface.pinned) = (None, None);
            let why = "another scene was opened before its picture was there";
            self.messages.errors(self.saves.give_up(why));
        }
        self.edited.document = document;
    }

    /// Keeps the picture on the screen, without overlays.
    fn keep(&mut self) {
        let Some(image) = self.image_to_keep() else {
            if self.display.shown.is_some() {
                self.messages
                    .notice("A picture can be kept once it is rendered at full resolution");
            }
            return;
        };
        let document = &self.edited.document;
        let summary = self.seen().map(|seen| summary(seen, document)).unwrap_or_default();
        let look = &document.look;
        let small = look.white_balance.apply(image.shrunk(SMALL_WIDTH));
        let exposure_ev = self.display.exposure_ev(document).unwrap_or_default();
        let small = display_rgb8(&small, exposure_ev, self.assets.looks.tone(look));
        let (index, failure) = self.library.history.keep(summary, &image, document.clone(), small);
        self.messages.failure(failure);
        self.interface.compared = Chosen { left: Some(index), ..Chosen::default() };
        self.interface.tab = Tab::Compare;
    }

    /// The picture on the screen, if it is of the document and whole.
    fn image_to_keep(&self) -> Option<Arc<Image>> {
        let shown = self.display.shown.as_ref()?;
        let snapshot = &shown.order.snapshot;
        let view = &snapshot.request.view;
        // What was seen from elsewhere is none of it.
        let image = shown.image.clone().filter(|_| !shown.is_carried && !shown.is_coarse);
        let has_image = image.is_some();
        let size = (view.width, view.height);
        let of_size = image.filter(|image| (image.width, image.height) == size);
        // As long as a smaller picture says more, it is that which is shown.
        let is_small = has_image && of_size.is_none() && snapshot.activity != Activity::Done;
        let is_whole = snapshot.is_lasting() && !is_small && self.is_of_document(snapshot);
        is_whole.then(|| of_size.unwrap_or_else(|| Arc::new(shown.order.image())))
    }

    /// The box around all surfaces of the material that was chosen, or is at the pinned or pointed place.
    fn selected_bounds(&self) -> Option<(Vec3, Vec3)> {
        let pointed = || {
            let place = self.interface.inspected()?;
            let seen = self.seen()?;
            look_at_place(&seen.request.world, &seen.view(), place)
        };
        let chosen = self.interface.material.or_else(|| Some(pointed()?.material))?;
        let scene = &self.assets.scene_of(&self.edited.document)?.world.scene;
        let mut corners = scene.hull_points(|material| material == chosen);
        let first = corners.next()?;
        Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }

    /// Writes the picture, or remembers to when there is none as yet or only a small one.
    pub(super) fn save(&mut self, path: PathBuf) {
        self.library.note_save(&path);
        self.saves.waiting.push(path);
        if self.picture().is_none() {
            let paused = match self.interface.paused {
                true => "; rendering is paused, press Space to resume",
                false => "",
            };
            self.messages.notice(format!("Will be saved at full resolution{paused}"));
        }
    }

    /// The whole picture of what the document says, if it is there.
    pub(super) fn picture(&self) -> Option<save::Picture> {
        let snapshot = self.rendering.snapshot.as_ref().filter(|s| s.is_lasting())?;
        // Its exposure is that of what is shown.
        let of_shown = &self.display.shown.as_ref()?.order.snapshot;
        if ![snapshot, of_shown].iter().all(|snapshot| self.is_of_document(snapshot)) {
            return None;
        }
        Some(save::Picture {
            tone: self.assets.looks.tone(&self.edited.document.look),
            snapshot: Arc::clone(snapshot),
            exposure_ev: self.display.exposure_ev(&self.edited.document)?,
            document: self.edited.document.clone(),
            scene: self.assets.scene.clone()?,
            map: self.assets.map.clone()?,
        })
    }

    /// Where a final render is likely to be written.
    fn suggested_render(&self) -> String {
        let path = self.library.suggested_file(&self.edited.document.scene);
        match self.interface.final_render.motion {
            Motion::Still => path,
            _ => Path::new(&path).with_extension("mp4").display().to_string(),
        }
    }

    /// Renders what is shown, with other random numbers, into a picture that errors are measured against.
    fn render_reference(&mut self) {
        let mut document = self.edited.document.clone();
        let of = Box::new(document.clone());
        document.stop = StopRule { samples: Some(4096), noise: Some(0.005), seconds: None };
        (document.look.denoise, document.light_mix) = (false, false);
        document.light.seed = document.light.seed.wrapping_add(1);
        document.light.sampling = Sampling::Adaptive;
        let name = format!("lightgrid-{}-reference.exr", std::process::id());
        let path = std::env::temp_dir().join(name);
        let words = self.rendering.snapshot.as_ref().and_then(|snapshot| {
            let size = snapshot.request.view.whole_size();
            let render = FinalRender { size, ..FinalRender::default() };
            self.render_words(render, &document, &path)
        });
        match words {
            Some(words) => self.renders.add(path, words, Some(of)),
            None => self.messages.notice(NOT_YET),
        }
    }

    /// Arguments of this program that render a document of the scene that is shown.
    pub(super) fn render_words(
        &self,
        render: FinalRender,
        document: &Document,
        path: &Path,
    ) -> Option<Vec<String>> {
        let loaded = self.assets.scene_of(document)?;
        let (scene, of_scene) = (&loaded.world.scene, &self.library.history.of_scene);
        let of_scene = (of_scene, &loaded.named_lamps[..]);
        let look = &document.look;
        let own_ev = (!look.auto_exposure).then_some(look.exposure_ev);
        let exposure_ev = self.display.exposure_ev(document).or(own_ev);
        Some(render.words(document, scene, of_scene, exposure_ev, path))
    }

    fn export(&mut self, path: PathBuf) {
        let grid = self.rendering.snapshot.as_ref().and_then(|s| s.main.grid.clone());
        let Some(grid) = grid else {
            self.messages.error("there are no distributions to export: BSDF sampling learns none");
            return;
        };
        self.tasks.write("export", move || {
            crate::output::distributions::write_distributions(&path, &grid)?;
            let (count, path) = (grid.distributions().len(), path.display());
            Ok(TaskResult::Done(format!("Exported {count} distributions to {path}")))
        });
    }

    /// Copies the picture as it is on the screen, overlay included.
    fn copy(&mut self, context: &egui::Context) {
        match self.display.read() {
            None => {}
            Some(Ok(picture)) => {
                context.copy_image(color_image(&picture));
                let (width, height) = (picture.width, picture.height);
                self.messages.notice(format!("Copied the picture, {width} x {height} pixels"));
            }
            Some(Err(error)) => {
                self.messages.notice(format!("The picture cannot be copied: {error}"));
            }
        }
    }
}

/// Looks at all of what is in a box.
fn frame(viewpoint: &mut Option<Viewpoint>, bounds: Option<(Vec3, Vec3)>, aspect: f32) {
    if let (Some(bounds), Some(viewpoint)) = (bounds, viewpoint) {
        viewpoint.frame(bounds, aspect);
    }
}

/// How a picture was made, in a line.
fn summary(snapshot: &Snapshot, document: &Document) -> String {
    let main = &snapshot.main;
    let cached = snapshot.backdrop.as_ref().map_or(0, |cached| cached.film.min_samples());
    let samples = match main.film.min_samples() + cached {
        0 => format!("{} samples", theme::samples(main.mean_samples())),
        1 => "1 sample".to_owned(),
        all => format!("{all} samples"),
    };
    let [scene, map] = [&document.scene, &document.map].map(|name| theme::file_name(name));
    let turned = match document.rotation_degrees {
        0.0 => String::new(),
        degrees => format!(" {degrees:.0}°"),
    };
    let method = convergence::name_of(main.sampling);
    format!("{method}, {samples}, {scene}, {map}{turned}")
}
