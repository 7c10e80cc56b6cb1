//! The application: its parts, its frames and its panels.

use std::path::PathBuf;

use super::album::Album;
use super::assets::Assets;
use super::commands::{self, Command};
use super::desktop::Desktop;
use super::display::Display;
use super::document::Document;
use super::dropped::dropped_files;
use super::edited::Edited;
use super::history::History;
use super::interface::{Dock, Interface, Tab};
use super::library::Library;
use super::loader::Loader;
use super::messages::Messages;
use super::panels::scope::Scope;
use super::reload::Reload;
use super::render_queue::RenderQueue;
use super::rendering::Rendering;
use super::save::Saves;
use super::screen::Screen;
use super::settings_file::Settings;
use super::small_maps::SmallMaps;
use super::tasks::{TaskResult, Tasks};
use super::threads::Wakes;
use super::{panels, theme};
use crate::error::{Error, Result};
use crate::render::gpu::RayChoice;
use crate::scene::StartView;

/// What is shown at the start.
#[derive(Debug, Clone, Default)]
pub struct Start {
    /// The picture.
    pub document: Document,
    /// Where it is taken from, in place of what the document says.
    pub place: Option<StartView>,
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
    pub pictures: Option<PathBuf>,
    /// Where small pictures of maps are kept.
    pub small_maps: Option<PathBuf>,
    /// The program whose `render` renders into files.
    pub program: PathBuf,
    /// For screenshots: no previews on the way, and no figures that depend on the clock.
    pub is_repeatable: bool,
}

/// The application. Its parts know nothing of each other.
pub struct App {
    /// What the picture is to be.
    pub(super) edited: Edited,
    /// What is open and pointed at.
    pub(super) interface: Interface,
    /// What outlasts the window.
    pub(super) library: Library,
    /// What is to be said.
    pub(super) messages: Messages,
    /// Scene, map and reference.
    pub(super) assets: Assets,
    /// The worker and its pictures.
    pub(super) rendering: Rendering,
    /// What is on the screen.
    pub(super) display: Display,
    /// Files being read and written.
    pub(super) tasks: Tasks,
    /// Where the picture is to be written once it has its full size.
    pub(super) saves: Saves,
    /// What is rendered into files.
    pub(super) renders: RenderQueue,
    /// The desktop's dialogues.
    pub(super) desktop: Desktop,
    /// See [`Start::is_repeatable`].
    pub(super) is_repeatable: bool,
    /// Whether the window is to fill the screen, or no longer.
    pub(super) toggles_full_screen: bool,
    /// Whether the window is to be closed.
    pub(super) is_closing: bool,
    /// Whether it was said that renders would be ended early.
    pub(super) is_warned: bool,
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
        theme::apply(context);
        let tasks = Tasks::new(wakes.draw.clone());
        let mut history = History { of_scene: start.of_scene, ..History::default() };
        if let Some(folder) = start.pictures {
            let report = tasks.reporter();
            let report = move |found: Result<_>| report(found.map(TaskResult::KeptPictures));
            history.album = Some(Album::open(folder, report)?);
        }
        let small_maps = SmallMaps::new(start.small_maps);
        let read = small_maps.read(start.settings.recent_maps.clone());
        tasks.run("small maps", || Ok(TaskResult::SmallMaps(read())));
        let gpu = (start.adapter, start.rays);
        let renders = RenderQueue::new(start.program, wakes.draw.clone());
        let is_watching = !start.is_repeatable;
        let reload = is_watching.then(|| Reload::start(wakes.draw.clone())).transpose()?;
        Ok(Self {
            edited: Edited::new(start.document, start.place),
            interface: start.interface,
            library: Library::new(start.settings, history, small_maps),
            messages: Messages::default(),
            assets: Assets::new(loader, reload),
            rendering: Rendering::start(wakes.relay, gpu, screen.gpu().clone())?,
            display: Display::start(screen, wakes.draw)?,
            tasks,
            saves: Saves::default(),
            renders,
            desktop: Desktop::default(),
            is_repeatable: start.is_repeatable,
            toggles_full_screen: false,
            is_closing: false,
            is_warned: false,
        })
    }

    /// One frame: collects, draws, carries out, sends down.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let context = ui.ctx().clone();
        self.collect(&context);
        let mut commands = commands::pressed(&context, self.interface.is_modal());
        commands.extend(dropped_files(&context, &mut self.interface, &mut self.messages));
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
        self.display.is_settled()
    }

    /// Goes on with another screen: the device of the one before was lost, and `why` says how.
    pub fn move_to(&mut self, screen: Screen, why: &Error) {
        let name = screen.gpu().facts().short_name();
        self.messages.notice(format!("{why}; the window goes on with {name}"));
        self.rendering.worker.move_to(screen.gpu().clone());
        self.display.move_to(screen);
    }

    /// Whether the picture asked for is done and on the screen.
    pub fn is_settled(&self) -> bool {
        self.assets.are_as_in(&self.edited.document)
            && self.rendering.is_done()
            && self.display.shown.is_some()
            && self.display.is_settled()
    }

    /// Whether the window may be closed: where files are being rendered it is asked for twice.
    pub fn may_close(&mut self) -> bool {
        let count = self.renders.unfinished();
        if count == 0 || std::mem::replace(&mut self.is_warned, true) {
            return true;
        }
        let files = if count == 1 { "1 file is" } else { &format!("{count} files are") };
        self.messages.error(format!("{files} not rendered yet: close again to end that early"));
        false
    }

    /// Waits until all files are written; what has failed of that and was not yet told.
    pub fn finish(&mut self) -> Vec<String> {
        self.library.history.album = None;
        let mut failures = self.tasks.finish();
        failures.extend(self.renders.finish());
        let why = "the window was closed before its picture was there";
        failures.extend(self.saves.give_up(why));
        failures
    }

    /// What is to be kept for the next window, on top of what the file holds by now, if that is understood: lists of
    /// files and viewpoints, and at the end what was set.
    pub fn settings(&mut self, found: Option<Settings>, is_end: bool) -> Settings {
        let Edited { document, start, .. } = &self.edited;
        let Library { settings: now, written, .. } = &mut self.library;
        let mut settings = found.unwrap_or_else(|| written.clone());
        let mut now = now.clone();
        now.keep_viewpoints(document);
        settings.take_lists(written, &now);
        // What is written now is what is changed from now on.
        *written = now;
        if is_end {
            settings.remember(document, start, &self.interface);
        }
        settings
    }

    fn panels(&mut self, ui: &mut egui::Ui, commands: &mut Vec<Command>) {
        let Edited { document, undo, .. } = &mut self.edited;
        let mut scope = Scope {
            document,
            interface: &mut self.interface,
            library: &mut self.library,
            assets: &self.assets,
            rendering: &mut self.rendering,
            display: &mut self.display,
            renders: &self.renders,
            is_repeatable: self.is_repeatable,
            commands,
        };
        if scope.interface.panels {
            let Scope { document, interface, rendering, commands, .. } = &mut scope;
            let is_on_gpu = rendering.is_on_gpu(document.light.device);
            panels::top::show(ui, document, interface, undo, is_on_gpu, commands);
            panels::status::show(ui, &mut scope);
            if !theme::is_small(ui) {
                panels::left::show(ui, &mut scope);
            }
            panels::right::show(ui, &mut scope, of_tab);
            panels::dock::show(ui, &mut scope, |ui, scope, dock| match dock {
                Dock::Convergence => panels::convergence::show(ui, scope),
                Dock::Needs => panels::needs::show(ui, scope.assets),
            });
        }
        let area = panels::viewport::show(ui, &mut scope);
        panels::prompt::show(ui.ctx(), scope.interface, scope.commands);
        panels::shortcuts::show(ui.ctx(), scope.interface);
        panels::messages::show(ui.ctx(), area, &mut self.messages);
    }
}

/// What the chosen tab of the right panel holds.
fn of_tab(ui: &mut egui::Ui, scope: &mut Scope<'_>) {
    match scope.interface.tab {
        Tab::Scene => panels::left::sections(ui, scope),
        Tab::Picture => {
            panels::picture::show(ui, scope);
            panels::final_render::show(ui, scope);
        }
        Tab::Compare => panels::history::show(ui, scope),
        Tab::Inspect => {
            panels::method::show(ui, scope);
            panels::overlay::show(ui, scope);
            panels::inspector::show(ui, scope);
        }
    }
}
