//! `lightgrid view`, and `lightgrid` alone.

use std::path::PathBuf;

use super::camera::CameraArguments;
use super::choices::SceneArguments;
use super::values;
use crate::app::Start;
use crate::app::document::{Document, PictureSize};
use crate::app::interface::Interface;
use crate::app::settings_file::Settings;
use crate::app::window;
use crate::error::Result;
use crate::memory;
use crate::render::gpu::{DeviceChoice, RayChoice};
use crate::render::{Sampling, StopRule};
use crate::scene::builtin;
use crate::sources::is_scene;
use crate::system;
use crate::terminal::tell;

/// Seconds of rendering when there is no display and nothing else says when to stop.
const HEADLESS_SECONDS: f64 = 60.0;

/// Arguments of `view`.
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct ViewArguments {
    /// A glTF file (.gltf, .glb) or a built-in scene; a map here lights the built-in living room.
    #[arg(default_value = builtin::DEFAULT_SCENE)]
    scene: String,
    #[command(flatten)]
    of_scene: SceneArguments,
    /// The map: .exr, .hdr, an 8-bit picture, or a built-in sky; without it, sky:day, or the sky of a
    /// built-in scene.
    #[arg(long, value_name = "MAP")]
    env: Option<String>,
    #[command(flatten)]
    place: CameraArguments,
    /// How the map is sampled.
    #[arg(long)]
    sampling: Option<Sampling>,
    /// Where to render: auto takes a GPU if there is a real one and everything fits on it.
    #[arg(long)]
    device: Option<DeviceChoice>,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// What finds the surfaces that rays hit on a GPU.
    #[arg(long, default_value = "auto")]
    rays: RayChoice,
    /// Picture size in pixels; without it, that of the viewport.
    #[arg(long, value_parser = values::size, allow_hyphen_values = true, value_name = "WxH")]
    size: Option<(u32, u32)>,
    /// Stop at this many samples per pixel.
    #[arg(long, visible_alias = "spp", value_parser = values::whole::<u32>(1..=u32::MAX), value_name = "N")]
    samples: Option<u32>,
    /// Settings file of the window, with its kept pictures beside it (FILE.pictures); without it, the user's own.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Where the picture is written if there is no display.
    #[arg(short, long, default_value = "lightgrid.png", value_name = "FILE")]
    output: PathBuf,
}

impl ViewArguments {
    /// The scene and the map: a file manager hands over maps as it does scenes.
    fn names(&self) -> [&str; 2] {
        match &self.env {
            Some(map) => [&self.scene, map],
            None if is_scene(&self.scene) => [&self.scene, builtin::sky(&self.scene)],
            None => [builtin::DEFAULT_SCENE, &self.scene],
        }
    }
}

/// Opens the window; without a display, says so and renders the picture into a file.
pub(super) fn run(arguments: &ViewArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let path = arguments.settings.clone().or_else(Settings::default_path);
    let (settings, notice) = path.as_deref().map(Settings::recover).unwrap_or_default();
    let (of_scene, lamp_edits) = arguments.of_scene.of_window(Vec::new());
    let start = Start {
        document: Document { lamp_edits, ..document(arguments, &settings) },
        place: arguments.place.start_view()?,
        interface: Interface { tab: settings.tab, dock: settings.dock, ..Interface::default() },
        settings,
        of_scene,
        adapter: arguments.adapter.clone(),
        rays: arguments.rays,
        pictures: Settings::pictures_folder(arguments.settings.as_deref()),
        program: std::env::current_exe().unwrap_or_else(|_| "lightgrid".into()),
        small_maps: Settings::small_maps_folder(arguments.settings.as_deref()),
        is_repeatable: false,
    };
    let is_double_clicked = system::leave_own_console();
    match window::run(start, notice.clone().into_iter().collect(), path) {
        Ok(closed_by) => closed_by.map_or(Ok(()), Err),
        // Nobody would find that picture.
        Err(error) if is_double_clicked => Err(error),
        Err(error) => {
            notice.iter().for_each(crate::terminal::notice);
            let picture = arguments.output.display();
            let error = error.to_string();
            let error = error.trim_end_matches('.');
            tell(format_args!("lightgrid: {error}; rendering into {picture} instead"));
            // As every other command does.
            memory::refusal_ends();
            super::render::run(&headless(arguments)?)
        }
    }
}

fn document(arguments: &ViewArguments, settings: &Settings) -> Document {
    let [scene, map] = arguments.names().map(str::to_owned);
    let bookmarks = settings.viewpoints_of(&scene);
    let mut document = Document { scene, map, bookmarks, ..settings.document() };
    let light = &mut document.light;
    light.sampling = arguments.sampling.unwrap_or(light.sampling);
    light.device = arguments.device.unwrap_or(light.device);
    let fixed = |(width, height)| PictureSize::Fixed(width, height);
    document.size = arguments.size.map_or(document.size, fixed);
    if let Some(samples) = arguments.samples {
        document.stop = StopRule { samples: Some(samples), ..StopRule::default() };
    }
    document
}

fn headless(arguments: &ViewArguments) -> Result<super::render::RenderArguments> {
    let [scene, map] = arguments.names();
    let mut headless = super::render::RenderArguments::of_picture(scene, map, &arguments.output)?;
    headless.of_scene = arguments.of_scene.clone();
    headless.place = arguments.place.clone();
    headless.size = arguments.size.unwrap_or(headless.size);
    headless.spp = arguments.samples;
    headless.seconds = arguments.samples.is_none().then_some(HEADLESS_SECONDS);
    headless.sampling = arguments.sampling.unwrap_or_default();
    headless.device = arguments.device.unwrap_or_default();
    headless.adapter.clone_from(&arguments.adapter);
    headless.rays = arguments.rays;
    Ok(headless)
}
