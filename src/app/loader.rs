//! Reads scenes and maps beside the window: a large file never holds it up.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

use super::document::{Document, SceneChanges};
use super::threads::{Wake, lock, spawn};
use crate::environment::sun::{Sun, SunTexels};
use crate::environment::{Environment, EnvironmentOptions};
use crate::error::{At as _, Error, Notices, Result};
use crate::image::{Image, catch_panic};
use crate::memory;
use crate::path::World;
use crate::render::gpu::KernelFacts;
use crate::scene::needs::is_emitter;
use crate::scene::{Material, NamedLamp, PunctualLight, SceneOptions, edit_of_lamp, named_lamps};
use crate::sources;

/// A scene ready for rays.
#[derive(Clone)]
pub struct LoadedScene {
    /// What was asked for.
    pub name: String,
    /// The scene with `changes` applied.
    pub world: Arc<World>,
    /// Changes to the file's scene.
    pub changes: SceneChanges,
    /// Its materials without them.
    pub materials: Arc<[Material]>,
    /// Its point, spot and directional lights without them.
    lights: Arc<[PunctualLight]>,
    /// These and the materials that emit, in the file or once changed, by name.
    pub named_lamps: Arc<[NamedLamp]>,
    /// What a GPU's kernel for it holds.
    pub kernel: KernelFacts,
    /// Seconds of reading and of building the BVH.
    pub seconds: [f64; 2],
}

impl LoadedScene {
    /// What is to be said about it and was not said when it was read before.
    pub(super) fn new_notices(&self, before: Option<&Self>) -> Notices {
        let before = before.filter(|before| before.name == self.name);
        let said: Vec<&str> =
            before.iter().flat_map(|before| before.world.scene.notices.iter()).collect();
        let mut new = Notices::default();
        let notices = self.world.scene.notices.iter();
        notices.filter(|notice| !said.contains(notice)).for_each(|notice| new.add(notice));
        new
    }

    /// The same with these changes in place of those that there are.
    fn edited(self, changes: SceneChanges) -> Result<Self> {
        let mut materials = self.materials.to_vec();
        for (number, edit) in &changes.materials {
            if let Some(material) = materials.get_mut(*number as usize) {
                *material = edit.apply(material);
            }
        }
        let named_lamps = named_lamps(&self.lights, self.materials.iter().chain(&materials)).into();
        let edit = |name: &str| edit_of_lamp(name, &changes.lamp_edits, changes.lamps);
        for material in materials.iter_mut().filter(|material| is_emitter(material)) {
            *material = edit(&material.name).apply_to_material(material);
        }
        let changed = |light: &PunctualLight| edit(&light.name).apply(light);
        let world = self.world.with_looks(materials, self.lights.iter().map(changed).collect());
        let world =
            world.map_err(|cause| Error::at(&self.name, format!("to change it {cause}")))?;
        let world = Arc::new(world);
        let kernel = KernelFacts::of_scene(&world);
        Ok(Self { kernel, world, changes, named_lamps, ..self })
    }
}

/// A map ready to be sampled, not turned, at intensity 1.
#[derive(Clone)]
pub struct LoadedMap {
    /// What was asked for.
    pub name: String,
    /// Factor on its sun.
    pub sun_factor: f32,
    /// The map.
    pub environment: Arc<Environment>,
    /// A small copy for the panel.
    pub preview: Arc<Image>,
    /// Where it is brightest; `None` on a black map.
    pub sun: Option<Sun>,
    /// What was repaired or assumed.
    pub notices: Notices,
    /// Seconds of reading and of building the table.
    pub seconds: [f64; 2],
    /// Its sun at factor 1.
    sun_texels: Arc<SunTexels>,
}

impl LoadedMap {
    /// Reads a map.
    fn read(name: &str, sun_factor: f32, steps: &Steps) -> Result<Self> {
        let start = Instant::now();
        let (map, notices) = sources::map(name)?;
        steps.begin("building the table")?;
        let seconds = start.elapsed().as_secs_f64();
        let sun_texels = Arc::new(SunTexels::of(&map));
        Self::new(name, map, sun_texels, sun_factor, notices, seconds)
    }

    /// The same with another factor on its sun.
    fn with_sun(&self, sun_factor: f32) -> Result<Self> {
        let map = self.environment.map();
        // The table takes as much again.
        let bytes = 2 * map.pixels.len() * size_of::<[f32; 3]>();
        memory::check(bytes as u64)
            .map_err(|cause| Error::at(&self.name, format!("to change its sun {cause}")))?;
        let mut map = map.clone();
        self.sun_texels.put_back(&mut map);
        let (texels, notices) = (Arc::clone(&self.sun_texels), self.notices.clone());
        Self::new(&self.name, map, texels, sun_factor, notices, self.seconds[0])
    }

    /// Of a map with its sun at factor 1.
    fn new(
        name: &str,
        map: Image,
        sun_texels: Arc<SunTexels>,
        sun_factor: f32,
        notices: Notices,
        seconds_of_reading: f64,
    ) -> Result<Self> {
        let start = Instant::now();
        let options = EnvironmentOptions { sun: sun_factor, ..EnvironmentOptions::default() };
        let environment = Environment::new(map, &options).at(name)?;
        let seconds = [seconds_of_reading, start.elapsed().as_secs_f64()];
        let preview = Arc::new(environment.map().shrunk(256));
        let (name, sun) = (name.to_owned(), Sun::of(environment.map()));
        let environment = Arc::new(environment);
        Ok(Self { name, sun_factor, environment, preview, sun, notices, seconds, sun_texels })
    }
}

/// What is loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Scene,
    Map,
}

/// What loading came to.
pub enum Loaded {
    /// A scene, or why not.
    Scene(Result<LoadedScene>),
    /// The scene that is there with other materials, or why not.
    Edited(Result<LoadedScene>),
    /// A map, or why not.
    Map(Result<LoadedMap>),
}

/// What is under way.
struct InFlight {
    name: String,
    /// Whether the scene is there and only its materials change, or the map and only its sun.
    is_edit: bool,
    began: Instant,
    /// What its thread is doing.
    step: Arc<Mutex<&'static str>>,
}

/// Reports a thread's steps, and tells it whether its result is still wanted.
struct Steps(Weak<Mutex<&'static str>>);

impl Steps {
    /// Begins a step.
    ///
    /// # Errors
    /// If nobody waits for the result any more.
    fn begin(&self, step: &'static str) -> Result<()> {
        let wanted = self.0.upgrade().ok_or_else(|| Error::new("nobody waits for it any more"))?;
        *lock(&wanted) = step;
        Ok(())
    }
}

/// A file that is being read.
pub struct Loading<'a> {
    /// What was asked for.
    pub name: &'a str,
    /// What is done now, in a word or two.
    pub step: &'static str,
    /// Since it was asked for.
    pub seconds: f64,
}

/// Loads one scene and one map at a time; results are collected with [`Loader::take`].
pub struct Loader {
    /// Results with the steps of what was under way.
    sender: Sender<(Steps, Loaded)>,
    receiver: Receiver<(Steps, Loaded)>,
    wake: Wake,
    in_flight: [Option<InFlight>; 2],
    /// The scene that the window was opened with, and what is asked of it.
    first: (String, SceneOptions),
    /// One scene and one map at a time, side by side as on the command line: two large scenes together
    /// may not fit into memory.
    turns: [Arc<Mutex<()>>; 2],
}

impl Loader {
    /// Begins with what a window is opened with; `wake` is called when something has been loaded.
    pub fn start(document: &Document, options: SceneOptions, wake: Wake) -> Self {
        let (sender, receiver) = channel();
        let (in_flight, turns) = ([None, None], Default::default());
        let first = (document.scene.clone(), options);
        let mut loader = Self { sender, receiver, wake, in_flight, first, turns };
        loader.load_scene(&document.scene);
        loader.load_map(&document.map, document.sun);
        loader
    }

    /// Starts to load a scene unless it is being loaded; a change to its materials is given up.
    pub fn load_scene(&mut self, name: &str) {
        let (own, mut options) = (name.to_owned(), self.first.1.clone());
        if self.first.0 != name {
            // Its names are of another scene.
            (options.variant, options.hide, options.edits) = (None, Vec::new(), Vec::new());
        }
        self.spawn(Kind::Scene, name, false, move |steps| {
            Loaded::Scene(load_scene(&own, &options, steps))
        });
    }

    /// Starts to change the materials and lights of a scene that is there to what the document wants, unless something
    /// is being done to it.
    pub fn edit_scene(&mut self, scene: &LoadedScene, document: &Document) {
        let (own, changes) = (scene.clone(), document.changes());
        self.spawn(Kind::Scene, &scene.name, true, move |_| Loaded::Edited(own.edited(changes)));
    }

    /// Starts to load a map unless it is being loaded; a change to its sun is given up.
    pub fn load_map(&mut self, name: &str, sun_factor: f32) {
        let own = name.to_owned();
        self.spawn(Kind::Map, name, false, move |steps| {
            Loaded::Map(LoadedMap::read(&own, sun_factor, steps))
        });
    }

    /// Starts to change the sun of a map that is there, unless something is being done to it.
    pub fn edit_map(&mut self, map: &LoadedMap, sun_factor: f32) {
        let own = map.clone();
        self.spawn(Kind::Map, &map.name, true, move |_| Loaded::Map(own.with_sun(sun_factor)));
    }

    /// What is being loaded.
    pub fn busy_with(&self) -> impl Iterator<Item = Loading<'_>> {
        self.in_flight.iter().flatten().map(|InFlight { name, began, step, .. }| Loading {
            name,
            step: *lock(step),
            seconds: began.elapsed().as_secs_f64(),
        })
    }

    /// Gives up the scene or the map that is being loaded; whether there was one. Its thread ends with its step.
    pub(crate) fn stop(&mut self, kind: Kind) -> bool {
        self.in_flight[kind as usize].take().is_some()
    }

    /// What has been loaded since the last call, by name; results nobody waits for any more are dropped.
    pub fn take(&mut self) -> Vec<(String, Loaded)> {
        let wanted = |(Steps(step), loaded): (Steps, Loaded)| {
            let is_this = |of: &mut InFlight| Arc::as_ptr(&of.step) == step.as_ptr();
            let found = self.in_flight.iter_mut().find_map(|slot| slot.take_if(is_this));
            Some((found?.name, loaded))
        };
        self.receiver.try_iter().filter_map(wanted).collect()
    }

    fn spawn(
        &mut self,
        kind: Kind,
        name: &str,
        is_edit: bool,
        load: impl FnOnce(&Steps) -> Loaded + Send + 'static,
    ) {
        let in_flight = &mut self.in_flight[kind as usize];
        if in_flight.as_ref().is_some_and(|it| it.name == name && (is_edit || !it.is_edit)) {
            return;
        }
        let (began, step) = (Instant::now(), Arc::new(Mutex::new("waiting")));
        let steps = Steps(Arc::downgrade(&step));
        *in_flight = Some(InFlight { name: name.to_owned(), is_edit, began, step });
        let (sender, wake) = (self.sender.clone(), self.wake.clone());
        let turn = Arc::clone(&self.turns[kind as usize]);
        let name = name.to_owned();
        let thread = spawn("load", move || {
            let _turn = lock(&turn);
            if steps.begin(if is_edit { "changing" } else { "reading" }).is_err() {
                return;
            }
            // A panic must not leave the window waiting for ever.
            let failed = || Error::at(&name, "cannot be read: the program failed at it");
            let loaded = catch_panic(|| load(&steps)).unwrap_or_else(|| match kind {
                Kind::Scene => Loaded::Scene(Err(failed())),
                Kind::Map => Loaded::Map(Err(failed())),
            });
            // The window may have gone meanwhile.
            let _ = sender.send((steps, loaded));
            wake();
        });
        if thread.is_err() {
            *in_flight = None;
        }
    }
}

fn load_scene(name: &str, options: &SceneOptions, steps: &Steps) -> Result<LoadedScene> {
    let start = Instant::now();
    let scene = sources::scene_with(name, options)?;
    steps.begin("building the tree")?;
    let read = start.elapsed().as_secs_f64();
    let world = Arc::new(World::new(scene));
    let seconds = [read, start.elapsed().as_secs_f64() - read];
    let kernel = KernelFacts::of_scene(&world);
    let materials: Arc<[Material]> = world.scene.materials.clone().into();
    let lights: Arc<[PunctualLight]> = world.scene.lights.clone().into();
    let named_lamps = named_lamps(&lights, &materials[..]).into();
    let (name, changes) = (name.to_owned(), Document::default().changes());
    Ok(LoadedScene { name, world, changes, materials, lights, named_lamps, kernel, seconds })
}
