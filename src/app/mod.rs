//! The window: what a person sees and does, as plain data that is sent down.
//!
//! [`App`] holds a [`document::Document`] (what the picture is, undone by comparing snapshots) and an
//! [`interface::Interface`] (what is open and pointed at). Every frame panels draw from them and
//! change them or ask for a `commands::Command`; then the `worker` is told what to render and the
//! `presenter` what to make ready on the device. Both take the latest value and publish the latest
//! picture: nothing here waits. The viewport develops it on the device of the `screen` in the frame
//! that draws it. `window` shows it on a display, [`screenshot`] in a texture without one.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

mod album;
mod blit;
pub(crate) mod commands;
mod comparison;
mod completion;
pub(crate) mod convergence;
mod desktop;
pub mod document;
pub mod drag;
mod dropped;
mod execute;
pub(crate) mod history;
mod input_order;
mod inspect;
pub mod interface;
pub(crate) mod kept_picture;
pub(crate) mod loader;
pub(crate) mod messages;
mod navigation;
pub mod overlays;
mod panels;
pub(crate) mod presenter;
mod save;
pub(crate) mod screen;
pub mod screenshot;
pub mod settings_file;
mod small_maps;
mod speed_up;
pub(crate) mod surface_map;
mod sync;
#[cfg(test)]
mod tests;
mod theme;
pub mod threads;
mod undo;
pub(crate) mod window;
pub(crate) mod worker;
pub mod zoom;

use crate::develop::DevelopSettings;
use crate::error::{Error, Result};
use crate::render::gpu::{DeviceChoice, RayChoice};

use commands::Command;
use convergence::Convergence;
use desktop::Desktop;
use document::Document;
use history::History;
use inspect::Inspector;
use interface::Interface;
use kept_picture::KeptPicture;
use loader::{LoadedMap, LoadedScene, Loader};
use messages::Messages;
use presenter::{Presenter, Shown};
use screen::Screen;
use settings_file::Settings;
use small_maps::{SmallMap, SmallMaps};
use speed_up::SpeedUp;
use sync::TransformedMap;
use threads::{Wake, Wakes};
use undo::Undo;
use worker::{Activity, Reference, Snapshot, Worker};

/// What is shown at the start.
#[derive(Debug, Clone, Default)]
pub struct Start {
    /// The picture.
    pub document: Document,
    /// What is open.
    pub interface: Interface,
    /// What earlier windows left.
    pub settings: Settings,
    /// What is asked of the scenes' files.
    pub of_scene: crate::scene::SceneOptions,
    /// The GPU to take where one is wanted: part of its name or backend.
    pub adapter: Option<String>,
    /// What finds the surfaces that rays hit on it.
    pub rays: RayChoice,
    /// Where kept pictures are for the next window, if they are to be.
    pub pictures: Option<std::path::PathBuf>,
    /// Where small pictures of maps are kept.
    pub small_maps: Option<std::path::PathBuf>,
    /// For screenshots: no previews on the way, and no figures that depend on the clock.
    pub is_repeatable: bool,
}

/// The application.
pub struct App {
    document: Document,
    undo: Undo<Document>,
    /// What the window was opened with.
    start: Document,
    interface: Interface,
    settings: Settings,
    /// As they were when they were kept last.
    settings_before: Settings,
    /// Whether something came that is to be kept at once.
    has_news: bool,
    messages: Messages,
    history: History,
    convergence: Convergence,
    inspector: Inspector,
    loader: Loader,
    worker: Worker,
    presenter: Presenter,
    scene: Option<LoadedScene>,
    map: Option<LoadedMap>,
    /// The map turned and scaled as the document says.
    lit: Option<TransformedMap>,
    snapshot: Option<Arc<Snapshot>>,
    /// Of its two halves.
    speed_up: Option<SpeedUp>,
    shown: Option<Arc<Shown>>,
    screen: Screen,
    textures: panels::scope::Textures,
    /// What errors are measured against, and one that has just been read.
    reference: Option<Arc<Reference>>,
    /// What was shown when it came.
    reference_of: Option<Document>,
    arriving: Arc<Mutex<Option<Arc<Reference>>>>,
    /// Results of files being chosen and written.
    later: (Sender<Later>, Receiver<Later>),
    wake: Wake,
    /// Where the picture is to be written once it has its full size.
    waiting_saves: Vec<std::path::PathBuf>,
    desktop: Desktop,
    small_maps: SmallMaps,
    /// Threads that write files.
    writing: Vec<std::thread::JoinHandle<()>>,
    is_repeatable: bool,
    toggles_full_screen: bool,
    is_closing: bool,
    /// Pixels of the room that the picture has had last.
    room: Option<[u32; 2]>,
    /// Width over height of the whole picture that was shown last.
    shown_aspect: Option<f32>,
    /// The size of the picture for which there is memory, and the region.
    affordable: (document::PictureSize, Option<[f32; 4]>),
}

/// What comes back from a thread.
enum Later {
    /// Somebody chose a file in the dialogue of this number, or none.
    Chosen(u32, Option<String>),
    /// A file was written.
    Done(String),
    /// Something failed.
    Failed(String),
    /// Pictures that earlier windows kept.
    KeptPictures(Vec<KeptPicture>),
    /// Maps in small.
    SmallMaps(Vec<SmallMap>),
}

impl App {
    /// Starts the threads, which call `wakes`, but for the loader's, which is at work.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn new(
        start: Start,
        loader: Loader,
        screen: Screen,
        context: &egui::Context,
        wakes: Wakes,
    ) -> Result<Self> {
        let Wakes { draw: wake, relay } = wakes;
        theme::apply(context);
        let later = channel();
        let history = History::new(start.of_scene.clone());
        let history = match start.pictures {
            Some(folder) => {
                let (sender, wake): (Sender<Later>, _) = (later.0.clone(), wake.clone());
                history.of_folder(folder, move |found| {
                    let later =
                        found.map_or_else(|e| Later::Failed(e.to_string()), Later::KeptPictures);
                    // The window may have gone meanwhile.
                    let _ = sender.send(later);
                    wake();
                })?
            }
            None => history,
        };
        let mut app = Self {
            undo: Undo::new(start.document.clone()),
            start: start.document.clone(),
            document: start.document,
            interface: start.interface,
            settings_before: start.settings.clone(),
            settings: start.settings,
            has_news: false,
            messages: Messages::default(),
            history,
            convergence: Convergence::default(),
            inspector: Inspector::new(wake.clone()),
            loader,
            worker: Worker::start(relay, (start.adapter, start.rays), screen.gpu().clone())?,
            presenter: Presenter::start(wake.clone())?,
            scene: None,
            map: None,
            lit: None,
            snapshot: None,
            speed_up: None,
            shown: None,
            screen,
            textures: panels::scope::Textures::default(),
            reference: None,
            reference_of: None,
            arriving: Arc::default(),
            later,
            wake,
            waiting_saves: Vec::new(),
            desktop: Desktop::default(),
            small_maps: SmallMaps::default(),
            writing: Vec::new(),
            is_repeatable: start.is_repeatable,
            toggles_full_screen: false,
            is_closing: false,
            room: None,
            shown_aspect: None,
            affordable: (document::PictureSize::Viewport(1), None),
        };
        app.begin_small_maps(start.small_maps);
        Ok(app)
    }

    /// One frame: collects, draws, carries out, sends down.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        self.collect(&context);
        let mut commands = commands::pressed(&context, self.interface.is_modal());
        commands.extend(self.dropped_files(&context));
        self.panels(ui, &mut commands);
        for command in commands {
            self.execute(command, &context);
            // Each is a step of its own.
            self.settle(&context);
        }
        self.settle(&context);
        self.send_down(&context);
    }

    /// Passes what the worker has on to the presenter, without a frame; whether one is to be drawn all
    /// the same, for there is nothing to present.
    pub fn relay(&mut self, context: &egui::Context) -> bool {
        self.collect(context);
        self.send_down(context);
        self.presenter.is_settled()
    }

    /// Whether something lies over all else and has the keyboard.
    pub fn is_modal(&self) -> bool {
        self.interface.is_modal()
    }

    /// The screen that is drawn on.
    pub fn screen(&self) -> &Screen {
        &self.screen
    }

    /// Goes on with another screen: the device of the one before was lost, and `why` says how.
    pub fn move_to(&mut self, screen: Screen, why: &Error) {
        let name = screen.gpu().facts().short_name();
        self.messages.notice(format!("{why}; the window goes on with {name}"));
        self.worker.move_to(screen.gpu().clone());
        self.textures = panels::scope::Textures::default();
        // It is on the device that was lost.
        self.shown = None;
        self.screen = screen;
    }

    /// Adds a message from outside, such as what the settings file had wrong.
    pub fn say(&mut self, sentence: impl Into<String>) {
        self.messages.notice(sentence);
    }

    /// Whether the picture asked for is done and on the screen.
    pub fn is_settled(&self) -> bool {
        let is_done =
            |s: &Arc<Snapshot>| s.activity == Activity::Done && self.worker.has_answered(s);
        self.has_sources()
            && self.snapshot.as_ref().is_some_and(is_done)
            && self.shown.is_some()
            && self.presenter.is_settled()
            && !self.inspector.is_busy()
    }

    /// Whether somebody asked to fill the screen, or no longer, since this was asked last.
    pub fn toggles_full_screen(&mut self) -> bool {
        std::mem::take(&mut self.toggles_full_screen)
    }

    /// Whether somebody asked to close the window.
    pub fn is_closing(&self) -> bool {
        self.is_closing
    }

    /// The first thing that went wrong, if anything did.
    pub fn failure(&self) -> Option<&str> {
        self.messages.first_error()
    }

    /// Waits until all files are written; what has failed of that and was not yet told.
    pub fn finish(&mut self) -> Vec<String> {
        self.history.finish();
        for thread in self.writing.drain(..) {
            // What panics has said so.
            let _ = thread.join();
        }
        let failed = |later| match later {
            Later::Failed(sentence) => Some(sentence),
            _ => None,
        };
        let unsaved = |path: std::path::PathBuf| {
            format!(
                "{}: not saved: the window was closed before its picture was there",
                path.display()
            )
        };
        let failures = self.later.1.try_iter().filter_map(failed);
        failures.chain(self.waiting_saves.drain(..).map(unsaved)).collect()
    }

    /// What is to be kept for the next window, on top of what is kept by now, if that is understood: lists of files and
    /// viewpoints, and at the end what was set.
    pub fn settings(&mut self, kept: Option<Settings>, is_end: bool) -> Settings {
        let mut kept = kept.unwrap_or_else(|| self.settings_before.clone());
        let mut settings = self.settings.clone();
        settings.keep_viewpoints(&self.document);
        kept.take_lists(&self.settings_before, &settings);
        // What was kept now is what is changed from now on.
        self.settings_before = settings;
        if is_end {
            kept.remember(&self.document, &self.start, &self.interface);
        }
        kept
    }

    /// Whether viewpoints or files have come that are to be kept, since this was asked last: nobody knows whether
    /// there will be time for it at the end.
    pub fn has_news_to_keep(&mut self) -> bool {
        std::mem::take(&mut self.has_news)
    }

    /// Title of the window.
    pub fn title(&self) -> String {
        format!("{} - lightgrid", self.document.scene)
    }

    /// Seconds of work on what is shown.
    pub(super) fn seconds(&self) -> f64 {
        self.snapshot.as_ref().map_or(0.0, |snapshot| snapshot.seconds())
    }

    fn panels(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let snapshot = self.snapshot.as_deref();
        if self.interface.panels {
            let is_preparing = self.worker.is_preparing();
            let is_on_gpu = snapshot.is_some_and(|s| s.main.gpu.is_some())
                || is_preparing && self.document.light.device != DeviceChoice::Cpu;
            panels::top::show(
                ui,
                &mut self.document,
                &self.interface,
                &self.undo,
                is_on_gpu,
                commands,
            );
            let status = panels::status::Status {
                snapshot,
                shown: self.shown.as_ref().map(|shown| &*shown.order.snapshot),
                loading: self.loader.busy_with().collect(),
                threads: self.worker.threads(),
                is_preparing,
                overlay: self.interface.overlay,
                magnification: self.interface.magnification(self.document.size),
                pointed: self.interface.pointed.filter(|_| !self.is_repeatable),
                hides_clock: self.is_repeatable,
            };
            panels::status::show(ui, &status);
            self.sides(ui, commands);
            self.dock(ui, commands);
        }
        let area = self.viewport(ui, commands);
        let (settings, small_maps) = (&mut self.settings, &self.small_maps);
        panels::prompt::show(ui.ctx(), &mut self.interface, settings, small_maps, commands);
        panels::shortcuts::show(ui.ctx(), &mut self.interface);
        panels::messages::show(ui.ctx(), area, &mut self.messages);
    }

    /// Stops in all, once it is known what the automatic ones are.
    fn exposure_ev(&self) -> Option<f32> {
        let look = &self.document.look;
        let automatic_ev = self.shown.as_ref()?.automatic_ev;
        Some(look.exposure_ev + if look.auto_exposure { automatic_ev } else { 0.0 })
    }

    fn develop_settings(&self) -> Option<DevelopSettings> {
        let look = &self.document.look;
        let is_opaque = self.interface.overlay.is_some_and(overlays::Overlay::is_opaque);
        let opacity = if is_opaque { 1.0 } else { self.interface.overlay_opacity };
        Some(DevelopSettings {
            white_balance: look.white_balance,
            exposure_ev: self.exposure_ev()?,
            curve: look.curve,
            // What the overlay does not speak of steps back.
            opacity: [opacity, 0.6 * opacity],
        })
    }

    /// The panels beside the picture.
    fn sides(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        // While another one is read, nothing is to be chosen in the one that is shown.
        let scene = self.scene.as_ref().filter(|scene| scene.name == self.document.scene);
        let sources = panels::left::Sources {
            scene,
            map: self.map.as_ref(),
            settings: &self.settings,
            small_maps: &self.small_maps,
        };
        if !theme::is_small(ui) {
            let (document, interface) = (&mut self.document, &mut self.interface);
            panels::left::show(ui, document, interface, sources, commands);
        }
        let exposure_ev = self.exposure_ev();
        let shown = self.shown.as_deref();
        let snapshot = self.snapshot.as_deref();
        panels::right::show(ui, &mut self.interface, |ui, interface| match interface.tab {
            interface::Tab::Scene => {
                panels::left::sections(ui, &mut self.document, interface, sources, commands);
            }
            interface::Tab::Picture => {
                panels::picture::show(ui, &mut self.document, exposure_ev, commands);
                panels::history::show(ui, &mut self.history, &mut interface.compared, commands);
            }
            interface::Tab::Inspect => {
                panels::method::show(ui, &mut self.document.light, commands);
                panels::overlay::show(ui, interface, shown);
                panels::inspector::show(
                    ui,
                    interface,
                    &self.inspector,
                    self.map.as_ref(),
                    snapshot,
                    commands,
                );
            }
        });
    }

    fn dock(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let scene = self.scene.as_ref();
        let is_of_view = self.reference_of.is_none() || self.is_like_reference();
        panels::dock::show(ui, &mut self.interface, |ui, dock| match dock {
            interface::Dock::Convergence => {
                let reference = self.reference.as_deref().map(|it| (it, is_of_view));
                let hides_clock = self.is_repeatable;
                panels::convergence::show(
                    ui,
                    &mut self.convergence,
                    hides_clock,
                    reference,
                    commands,
                );
            }
            interface::Dock::Needs => panels::needs::show(ui, scene, self.map.as_ref()),
        });
    }

    fn viewport(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) -> egui::Rect {
        let settings = self.develop_settings();
        let scene = self.scene.as_ref().filter(|scene| scene.name == self.document.scene);
        let mut scope = panels::scope::Scope {
            document: &mut self.document,
            interface: &mut self.interface,
            textures: &mut self.textures,
            screen: &self.screen,
            shown: self.shown.as_deref(),
            settings,
            snapshot: self.snapshot.as_deref(),
            speed_up: self.speed_up,
            scene,
            loading: self.loader.busy_with().next().is_some(),
            commands,
        };
        panels::viewport::show(ui, &mut scope)
    }
}
