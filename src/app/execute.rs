//! Carrying out commands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;

use super::commands::Command;
use super::document::{Document, Viewpoint};
use super::dropped::Dropped;
use super::history;
use super::interface::{Chosen, Purpose, Tab};
use super::screen::color_image;
use super::settings_file::lasting_scene;
use super::threads::lock;
use super::worker::{Activity, Origin, Reference};
use super::{App, Later, convergence, save, surface_map, theme};
use crate::error::Result;
use crate::image::read_picture;
use crate::render::gpu::DeviceChoice;
use crate::scene::builtin;
use crate::sources;
use crate::tone::display_rgb8;

impl App {
    pub(super) fn execute(&mut self, command: Command, context: &egui::Context) {
        let interface = &mut self.interface;
        match command {
            Command::OpenScene(name) => self.open_scene(name),
            Command::OpenMap(name) if self.document.map == name => self.read_map_again(),
            Command::OpenMap(name) => {
                // The old one is not to be looked at for ever.
                interface.paused = false;
                self.document.map = name;
            }
            Command::ReadAgain => {
                self.read_scene_again();
                self.read_map_again();
            }
            Command::ChooseScene => self.ask(Purpose::Scene, String::new()),
            Command::ChooseMap => self.ask(Purpose::Map, String::new()),
            Command::ChooseSave => {
                let file = self.suggested_file();
                self.ask(Purpose::Picture, file);
            }
            Command::ChooseExport => {
                self.ask(Purpose::Distributions, "distributions.csv".to_owned());
            }
            Command::ChooseReference => self.ask(Purpose::Reference, String::new()),
            Command::OpenReference(path) => self.open_reference(path),
            Command::ForgetReference => self.reference = None,
            Command::Browse(purpose) => self.browse(purpose, true),
            Command::ShowMethod => self.show_method(),
            Command::Save(path) => self.save(path),
            Command::Export(path) => self.export(path),
            Command::Copy => self.copy(context),
            Command::LookFrom(viewpoint) => self.document.viewpoint = Some(viewpoint),
            Command::Bookmark => self.bookmark(),
            Command::ForgetBookmark(index) => {
                if index < self.document.bookmarks.len() {
                    self.document.bookmarks.remove(index);
                    self.has_news = true;
                }
            }
            Command::FrameAll => {
                let bounds = self.scene.as_ref().map(|scene| scene.world.bvh.bounds());
                self.frame(bounds);
            }
            Command::FrameSelected => {
                let bounds = self.selected_bounds();
                self.frame(bounds);
            }
            Command::TogglePause => interface.paused = !interface.paused,
            Command::Restart => {
                interface.run = interface.run.wrapping_add(1);
                interface.paused = false;
            }
            Command::ToggleRegion => {
                interface.is_marking = self.document.region.is_none() && !interface.is_marking;
                self.document.region = None;
                interface.pinned = None;
                // A part of what is rendered is marked there.
                (interface.compared.right, interface.compared.is_difference) = (None, false);
            }
            Command::Undo => {
                // What has just been changed may not have been noted as yet.
                self.undo.settle(&self.document);
                if let Some(document) = self.undo.undo() {
                    self.go_to(document);
                }
            }
            Command::Redo => {
                self.undo.settle(&self.document);
                if let Some(document) = self.undo.redo() {
                    self.go_to(document);
                }
            }
            Command::ToggleSplit => self.document.light.split = !self.document.light.split,
            Command::ToggleDevice => {
                let is_on_gpu = self.snapshot.as_ref().is_some_and(|s| s.main.gpu.is_some());
                let device = &mut self.document.light.device;
                let is_asked_for = match device {
                    DeviceChoice::Cpu => false,
                    DeviceChoice::Gpu => true,
                    DeviceChoice::Auto => is_on_gpu || self.worker.is_preparing(),
                };
                *device = if is_asked_for { DeviceChoice::Cpu } else { DeviceChoice::Gpu };
            }
            Command::ToggleDenoise => self.document.look.denoise = !self.document.look.denoise,
            Command::TogglePanels => interface.panels = !interface.panels,
            Command::ToggleDeveloper => interface.toggle_developer(),
            Command::ToggleShortcuts => interface.shortcuts = !interface.shortcuts,
            Command::CloseSheets => (interface.shortcuts, interface.is_marking) = (false, false),
            Command::KeepPicture => self.keep(),
            Command::SetAsKept(index) => self.set_as_kept(index),
            Command::ToggleZoom => {
                let size = self.document.size;
                interface.toggle_zoom(size);
            }
            Command::ToggleFullScreen => self.toggles_full_screen ^= true,
            Command::Quit => self.is_closing = true,
            Command::MeasureTruth => {
                if let Some(snapshot) = self.seen().cloned() {
                    self.inspector.measure(&snapshot);
                }
            }
        }
    }

    /// Takes the settings that a kept picture was made with.
    fn set_as_kept(&mut self, index: usize) {
        let Some(kept) = self.history.get(index) else { return };
        let mut document = kept.document.clone();
        // Those kept since are no part of the picture, and would be lost.
        document.bookmarks = self.viewpoints_of(&document.scene);
        // Pictures name a file by its whole path.
        if lasting_scene(&document.scene) == lasting_scene(&self.document.scene) {
            document.scene.clone_from(&self.document.scene);
        }
        // The room may have had another shape then.
        if let Some([left, top, right, bottom]) = document.seen_region()
            && let Ok(image) = kept.pixels.get()
        {
            let part = image.width as f32 / image.height as f32;
            let whole = part * (bottom - top) / (right - left);
            document.follow_room(whole / self.interface.aspect());
        }
        if self.history.is_of_other_options(kept) {
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
        let name = match &self.scene {
            Some(scene) if lasting_scene(&scene.name) == lasting_scene(&name) => scene.name.clone(),
            _ => name,
        };
        if self.scene.as_ref().is_some_and(|scene| scene.name == name) {
            self.interface.paused = false;
            if self.document.scene == name {
                self.read_scene_again();
            } else {
                // Another one was asked for, and is still being read.
                self.stay_in_scene();
            }
            return;
        }
        // Built-in scenes bring their own sky, unless another map was chosen.
        let is_own_sky = self.document.map == builtin::sky(&self.document.scene);
        if is_own_sky && sources::is_built_in_scene(&name) {
            builtin::sky(&name).clone_into(&mut self.document.map);
        }
        // A file that cannot be read must leave what is shown as it is.
        self.go_to(Document {
            viewpoint: None,
            bookmarks: self.viewpoints_of(&name),
            scene: name,
            materials: BTreeMap::new(),
            region: None,
            fog: None,
            ..self.document.clone()
        });
    }

    fn read_scene_again(&mut self) {
        if !sources::is_built_in_scene(&self.document.scene) {
            self.interface.paused = false;
            self.loader.load_scene(&self.document.scene);
        }
    }

    fn read_map_again(&mut self) {
        if !sources::is_built_in_map(&self.document.map) {
            self.interface.paused = false;
            self.loader.load_map(&self.document.map, self.document.sun);
        }
    }

    /// Takes all settings of a document. What was chosen in another scene is not in this one.
    fn go_to(&mut self, document: Document) {
        let is_as_before = (&document.scene, &document.map, document.sun)
            == (&self.document.scene, &self.document.map, self.document.sun);
        // The old one is not to be looked at for ever.
        self.interface.paused &= is_as_before;
        if document.scene != self.document.scene {
            self.give_up_saving("another scene was opened before its picture was there");
            self.settings.keep_viewpoints(&self.document);
            (self.interface.material, self.interface.pinned) = (None, None);
        }
        self.document = document;
    }

    /// Files dropped onto the window: one scene and one map of them are opened. With a scene come files that belong
    /// to it, pictures among them, of which none but those in linear radiance are taken for maps.
    pub(super) fn dropped_files(&mut self, context: &egui::Context) -> Vec<Command> {
        let paths: Vec<PathBuf> = context.input(|input| {
            input.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect()
        });
        if paths.is_empty() {
            return Vec::new();
        }
        // Or they would be opened behind it.
        self.interface.prompt = None;
        let chosen = Dropped::of(&paths);
        let left = chosen.left.iter().map(|name| theme::file_name(name)).collect::<Vec<_>>();
        if !left.is_empty() {
            self.messages.notice(format!("Not opened: {}", left.join(", ")));
        }
        chosen
            .scene
            .map(Command::OpenScene)
            .into_iter()
            .chain(chosen.map.map(Command::OpenMap))
            .collect()
    }

    /// Keeps what is on the screen, without overlays.
    fn keep(&mut self) {
        let Some(shown) = &self.shown else { return };
        let snapshot = &shown.order.snapshot;
        let view = &snapshot.request.view;
        // One that was resized is shown with it for a moment, and is none of it.
        let is_resized = snapshot.backdrop.as_ref().is_some_and(|b| b.origin == Origin::Resized);
        let of_size = shown.image.clone().filter(|_| !is_resized);
        let of_size =
            of_size.filter(|image| (image.width, image.height) == (view.width, view.height));
        // As long as a smaller picture says more, it is that which is shown.
        let is_small = shown.image.is_some()
            && of_size.is_none()
            && !is_resized
            && snapshot.activity != Activity::Done;
        if !snapshot.is_lasting() || is_small || !self.is_of_document(snapshot) {
            self.messages.notice("A picture can be kept once it has its full size");
            return;
        }
        let main = &snapshot.main;
        let image = of_size.unwrap_or_else(|| Arc::new(shown.order.image()));
        let samples = match main.film.min_samples() {
            0 => format!("{} samples", theme::samples(main.mean_samples())),
            1 => "1 sample".to_owned(),
            all => format!("{all} samples"),
        };
        let [scene, map] =
            [&self.document.scene, &self.document.map].map(|name| theme::file_name(name));
        let turned = match self.document.rotation_degrees {
            0.0 => String::new(),
            degrees => format!(" {degrees:.0}°"),
        };
        let method = convergence::name_of(main.sampling);
        let summary = format!("{method}, {samples}, {scene}, {map}{turned}");
        let look = &self.document.look;
        let small = look.white_balance.apply(image.shrunk(history::SMALL_WIDTH));
        let exposure_ev = self.exposure_ev().unwrap_or_default();
        let small = display_rgb8(&small, exposure_ev, look.curve);
        let (index, failure) = self.history.keep(summary, &image, self.document.clone(), &small);
        if let Err(error) = failure {
            self.messages.error(error.to_string());
        }
        self.interface.compared = Chosen { left: Some(index), ..Chosen::default() };
        self.interface.tab = Tab::Picture;
    }

    /// The viewpoints that were kept of a scene by now.
    fn viewpoints_of(&self, scene: &str) -> Vec<Viewpoint> {
        match lasting_scene(scene) == lasting_scene(&self.document.scene) {
            true => self.document.bookmarks.clone(),
            false => self.settings.viewpoints_of(scene),
        }
    }

    fn bookmark(&mut self) {
        let Some(viewpoint) = &self.document.viewpoint else { return };
        let bookmarks = &mut self.document.bookmarks;
        let is_new = |name: &String| bookmarks.iter().all(|kept| kept.name != *name);
        let name = (1..).map(|number| format!("View {number}")).find(is_new).unwrap_or_default();
        bookmarks.push(Viewpoint { name, ..viewpoint.clone() });
        self.has_news = true;
    }

    fn frame(&mut self, bounds: Option<(glam::Vec3, glam::Vec3)>) {
        let aspect = self.interface.aspect();
        if let (Some(bounds), Some(viewpoint)) = (bounds, &mut self.document.viewpoint) {
            viewpoint.frame(bounds, aspect);
        }
    }

    /// The box around all surfaces of the material that was chosen, or is at the pinned or pointed place.
    fn selected_bounds(&self) -> Option<(glam::Vec3, glam::Vec3)> {
        let pointed = || {
            let place = self.interface.inspected()?;
            let seen = self.seen()?;
            surface_map::look_at_place(&seen.request.world, &seen.view(), place)
        };
        let chosen = self.interface.material.or_else(|| Some(pointed()?.material))?;
        let scene = &self.scene_of_document()?.world.scene;
        let mut corners = scene.hull_points(|material| material == chosen);
        let first = corners.next()?;
        Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }

    fn suggested_file(&self) -> String {
        let stem = Path::new(&self.document.scene).file_stem();
        let stem = stem.map_or_else(|| "picture".into(), |s| s.to_string_lossy());
        let folder = self.settings.save_folder.clone().unwrap_or_default();
        folder.join(format!("{stem}.png")).display().to_string()
    }

    /// Writes the picture, or remembers to when there is none as yet or only a small one.
    pub(super) fn save(&mut self, path: PathBuf) {
        let folder = std::path::absolute(&path).ok();
        let folder = folder.and_then(|path| path.parent().map(Path::to_path_buf));
        self.settings.save_folder = folder.or(self.settings.save_folder.take());
        self.waiting_saves.push(path);
        if self.picture().is_none() {
            let paused =
                if self.interface.paused { ", for which it must go on (Space)" } else { "" };
            let sentence = format!("The picture will be saved once it has its full size{paused}");
            self.messages.notice(sentence);
        }
    }

    /// Writes the picture where it was asked for, if it is there now.
    pub(super) fn save_when_whole(&mut self) {
        if self.waiting_saves.is_empty() {
            return;
        }
        let Some(picture) = self.picture().map(Arc::new) else { return };
        for path in std::mem::take(&mut self.waiting_saves) {
            let picture = Arc::clone(&picture);
            let film = &picture.snapshot.main.film;
            let sentence =
                format!("Saved {}, {} x {} pixels", path.display(), film.width, film.height);
            self.write("save", move || {
                save::picture(&path, &picture)?;
                let remarks = save::remarks(&picture);
                Ok(remarks.iter().fold(sentence, |all, remark| format!("{all}; {remark}")))
            });
        }
    }

    /// Gives up what waits to be saved, and says why.
    pub(super) fn give_up_saving(&mut self, why: &str) {
        for path in std::mem::take(&mut self.waiting_saves) {
            self.messages.error(format!("{}: not saved: {why}", path.display()));
        }
    }

    /// The whole picture of what the document says, if it is there.
    fn picture(&self) -> Option<save::Picture> {
        let snapshot = self.snapshot.as_ref().filter(|snapshot| snapshot.is_lasting())?;
        // Its exposure is that of what is shown.
        let of_shown = &self.shown.as_ref()?.order.snapshot;
        if ![snapshot, of_shown].iter().all(|snapshot| self.is_of_document(snapshot)) {
            return None;
        }
        Some(save::Picture {
            snapshot: Arc::clone(snapshot),
            exposure_ev: self.exposure_ev()?,
            document: self.document.clone(),
            scene: self.scene.clone()?,
            map: self.map.clone()?,
        })
    }

    fn export(&mut self, path: PathBuf) {
        let grid = self.snapshot.as_ref().and_then(|s| s.main.grid.clone());
        let Some(grid) = grid else {
            self.messages.error(
                "there are no distributions to export: the map is sampled by the BSDF alone",
            );
            return;
        };
        let sentence =
            format!("Exported {} distributions to {}", grid.distributions().len(), path.display());
        self.write("export", move || {
            crate::output::distributions::write_distributions(&path, &grid).map(|()| sentence)
        });
    }

    /// Reads a reference on a thread; its arrival is a message.
    fn open_reference(&mut self, path: String) {
        let slot = Arc::clone(&self.arriving);
        self.do_later("reference", move || {
            let image = read_picture(Path::new(&path))?;
            let (width, height) = (image.width, image.height);
            let sentence = format!(
                "Errors are measured against {path}; the picture must be {width} x {height} pixels \
                 for that"
            );
            let name = path.clone();
            *lock(&slot) = Some(Arc::new(Reference { name, image }));
            Ok(Later::Done(sentence))
        });
    }

    /// Writes a file on a thread, for which the end of the window waits.
    fn write(&mut self, name: &str, work: impl FnOnce() -> Result<String> + Send + 'static) {
        self.write_later(name, || work().map(Later::Done));
    }

    /// The same of one that brings something else than a sentence.
    pub(super) fn write_later(
        &mut self,
        name: &str,
        work: impl FnOnce() -> Result<Later> + Send + 'static,
    ) {
        self.writing.retain(|thread| !thread.is_finished());
        let thread = self.do_later(name, work);
        self.writing.extend(thread);
    }

    /// Runs something slow on a thread; what fails becomes a message.
    pub(super) fn do_later(
        &mut self,
        name: &str,
        work: impl FnOnce() -> Result<Later> + Send + 'static,
    ) -> Option<JoinHandle<()>> {
        let (sender, wake) = (self.later.0.clone(), self.wake.clone());
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            let later = work().unwrap_or_else(|error| Later::Failed(error.to_string()));
            // The window may have gone meanwhile.
            let _ = sender.send(later);
            wake();
        });
        let failed = |error| self.messages.error(format!("no thread to {name}: {error}"));
        thread.map_err(failed).ok()
    }

    /// Copies the picture as it is on the screen, overlay included.
    fn copy(&mut self, context: &egui::Context) {
        let Some(developed) = self.textures.picture(self.shown.as_deref()) else { return };
        match self.screen.developer.read(&developed.display) {
            Ok(picture) => {
                context.copy_image(color_image(&picture));
                let (width, height) = (picture.width, picture.height);
                self.messages.notice(format!("Copied the picture, {width} x {height} pixels"));
            }
            Err(error) => self.messages.notice(format!("The picture cannot be copied: {error}")),
        }
    }
}
