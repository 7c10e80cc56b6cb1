//! `lightgrid screenshot`.

use std::path::PathBuf;
use std::time::Duration;

use glam::Vec2;

use super::camera::CameraArguments;
use super::choices::SceneArguments;
use super::picture::{check_output, parse_exposure, say_written};
use super::values;
use crate::app::Start;
use crate::app::document::{Document, Light, Look};
use crate::app::interface::{Dock, Interface, Tab, TileView};
use crate::app::overlays::Overlay;
use crate::app::screenshot::Studio;
use crate::error::{Error, Result};
use crate::image::write_png;
use crate::output::Exposure;
use crate::render::gpu::DeviceChoice;
use crate::render::{Sampling, StopRule};
use crate::scene::builtin;

/// A part of the window that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PanelName {
    /// Settings of the picture, which are open anyway.
    Picture,
    /// Overlays, map view and inspector.
    Inspect,
    /// Error against samples.
    Convergence,
    /// What the scene needs.
    Needs,
    /// Keys and gestures.
    Shortcuts,
    /// No panel: the viewport alone.
    None,
}

/// Arguments of `screenshot`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Figures that depend on the clock are left out, but for --split's: a seed gives the same \
                        screenshot on the same machine. No display is needed, but a graphics \
                        device is; software Vulkan will do."
)]
pub(super) struct ScreenshotArguments {
    /// A glTF file (.gltf, .glb) or a built-in scene.
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
    /// Exposure in stops, or `auto`.
    #[arg(long, default_value = "auto", value_parser = parse_exposure, allow_hyphen_values = true, value_name = "EV|auto")]
    exposure: Exposure,
    /// What is drawn over the picture.
    #[arg(long, value_name = "NAME")]
    overlay: Option<Overlay>,
    /// A linear picture of this view without noise, .exr or .hdr, of the size of the picture in the window, that errors
    /// are measured against.
    #[arg(long, value_name = "FILE")]
    reference: Option<String>,
    /// What else is open; may be given several times.
    #[arg(long, value_name = "NAME")]
    panel: Vec<PanelName>,
    /// Samples per pixel.
    #[arg(long, visible_alias = "spp", default_value = "16", value_parser = values::whole::<u32>(1..=u32::MAX), value_name = "N")]
    samples: u32,
    /// Size of the window in pixels.
    #[arg(long, default_value = "1440x900", value_parser = values::size, allow_hyphen_values = true, value_name = "WxH")]
    size: (u32, u32),
    /// How large everything but the picture is drawn, from 0.5 to 4: at 2 as a 4K display shows it.
    #[arg(long, default_value = "1", value_parser = scale, allow_hyphen_values = true, value_name = "FACTOR")]
    scale: f32,
    /// How the map is sampled.
    #[arg(long, default_value = "adaptive")]
    sampling: Sampling,
    /// Where to render the picture; the window itself is always drawn by a graphics device.
    #[arg(long, default_value = "cpu")]
    device: DeviceChoice,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Plain on the left, the chosen sampling on the right; not repeatable, for it is by time.
    #[arg(long)]
    split: bool,
    /// Filter noise out.
    #[arg(long)]
    denoise: bool,
    /// The place to inspect, X,Y in [0,1] of the picture, with its brute-force truth.
    #[arg(long, value_parser = values::place, allow_hyphen_values = true, value_name = "X,Y")]
    inspect: Option<Vec2>,
    /// Shows the distributions after learning pass N in place of the present ones; 0 is before all passes.
    #[arg(long, value_name = "N")]
    learning_step: Option<usize>,
    /// The material whose settings are shown, by its name.
    #[arg(long, value_name = "MATERIAL")]
    select: Option<String>,
    /// The tile chosen on the map, for the overlay `tile`.
    #[arg(long, value_parser = values::whole::<u32>(0..=u32::MAX), value_name = "N")]
    tile: Option<u32>,
    /// What the map of tiles shows.
    #[arg(long, value_name = "WHAT")]
    tiles: Option<TileView>,
    /// Turns the map about the vertical, in degrees.
    #[arg(long, default_value = "0", value_parser = values::finite, value_name = "DEG")]
    env_rotation: f64,
    /// Turns the map so that its sun shines on this place of the picture, X,Y in [0,1], or near it.
    #[arg(long, value_parser = values::place, conflicts_with = "env_rotation", allow_hyphen_values = true, value_name = "X,Y")]
    sun_at: Option<Vec2>,
    /// Multiplies the light of the map's sun, and not its sky.
    #[arg(long, default_value = "1", value_parser = values::not_negative, value_name = "X")]
    env_sun: f32,
    /// Seed of the random numbers.
    #[arg(long, default_value = "0", value_parser = values::whole::<u32>(0..=u32::MAX), value_name = "N")]
    seed: u32,
    /// Give up after this many seconds.
    #[arg(long, default_value = "600", value_parser = values::positive, value_name = "S")]
    patience: f64,
    /// The picture to write, .png.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

fn scale(text: &str) -> std::result::Result<f32, String> {
    let factor = values::finite(text)? as f32;
    let is_usual = (0.5..=4.0).contains(&factor);
    is_usual.then_some(factor).ok_or_else(|| "must be from 0.5 to 4".to_owned())
}

/// Draws the window's content and writes it.
pub(super) fn run(arguments: &ScreenshotArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let path = &arguments.output;
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Error::at(path, "screenshots are written as .png"));
    }
    check_output(path, [&arguments.scene].into_iter().chain(&arguments.env))?;
    let shows_cache = arguments.overlay.is_some_and(Overlay::is_of_cache);
    if shows_cache && (!arguments.denoise || arguments.split) {
        return Err(Error::new(
            "the radiance cache is trained for cached light: overlays of it need --denoise, and no --split",
        ));
    }
    let learns = matches!(arguments.sampling, Sampling::Adaptive | Sampling::Talk);
    if arguments.overlay.is_some_and(Overlay::is_of_grid) && !learns {
        return Err(Error::new(format!(
            "--sampling {} learns nothing that this overlay could show",
            arguments.sampling
        )));
    }
    if arguments.overlay == Some(Overlay::Tile) && arguments.tile.is_none() {
        return Err(Error::new("the overlay of a tile wants one: --tile N"));
    }
    if arguments.overlay == Some(Overlay::Flip) && arguments.reference.is_none() {
        return Err(Error::new("the overlay flip wants a picture without noise: --reference FILE"));
    }
    if arguments.panel.len() > 1 && arguments.panel.contains(&PanelName::None) {
        return Err(Error::new("--panel none and other panels exclude each other"));
    }
    let defaults = Document::default();
    let (auto_exposure, exposure_ev) = match arguments.exposure {
        Exposure::Auto => (true, 0.0),
        Exposure::Stops(stops) => (false, stops),
    };
    let (of_scene, lamp_edits) = arguments.of_scene.of_window(vec![arguments.output.clone()]);
    let document = Document {
        lamp_edits,
        scene: arguments.scene.clone(),
        map: arguments.env.clone().unwrap_or_else(|| builtin::sky(&arguments.scene).to_owned()),
        rotation_degrees: arguments.env_rotation.rem_euclid(360.0) as f32,
        sun: arguments.env_sun,
        light: Light {
            device: arguments.device,
            sampling: arguments.sampling,
            split: arguments.split,
            seed: arguments.seed,
            ..defaults.light
        },
        look: Look { auto_exposure, exposure_ev, denoise: arguments.denoise, ..defaults.look },
        stop: StopRule { samples: Some(arguments.samples), ..StopRule::default() },
        ..defaults
    };
    let start = Start {
        document,
        place: arguments.place.start_view()?,
        interface: interface(arguments),
        of_scene,
        adapter: arguments.adapter.clone(),
        ..Start::default()
    };
    let patience = Duration::from_secs_f64(arguments.patience.min(1e9));
    let mut studio = Studio::open(start, arguments.size, patience)?.at_scale(arguments.scale);
    if let Some(material) = &arguments.select {
        studio.choose_material(material)?;
    }
    if let Some(place) = arguments.sun_at {
        studio.put_sun(place)?;
    }
    if let Some(tile) = arguments.tile {
        studio.check_tile(tile)?;
    }
    if let Some(reference) = &arguments.reference {
        studio.open_reference(reference)?;
    }
    if let Some(step) = arguments.learning_step {
        studio.show_learning_step(step)?;
    }
    if arguments.inspect.is_some() {
        studio.measure_truth()?;
    }
    write_png(path, &studio.take()?, None, &[])?;
    say_written(path);
    Ok(())
}

fn interface(arguments: &ScreenshotArguments) -> Interface {
    let has = |panel| arguments.panel.contains(&panel);
    let is_inspecting = has(PanelName::Inspect)
        || arguments.overlay.is_some()
        || arguments.inspect.is_some()
        || arguments.tile.is_some()
        || arguments.tiles.is_some();
    let docks = [(PanelName::Convergence, Dock::Convergence), (PanelName::Needs, Dock::Needs)];
    Interface {
        panels: !has(PanelName::None),
        tab: if is_inspecting { Tab::Inspect } else { Tab::Picture },
        dock: docks.into_iter().find(|(panel, _)| has(*panel)).map(|(_, dock)| dock),
        shortcuts: has(PanelName::Shortcuts),
        overlay: arguments.overlay,
        tile: arguments.tile,
        tiles: arguments.tiles.unwrap_or(TileView::Energy),
        pinned: arguments.inspect,
        ..Interface::default()
    }
}
