//! `lightgrid render`.

mod frames;
mod outputs;
mod share;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

use super::device;
use super::interrupt::Interrupt;
use super::picture::PictureArguments;
use super::progress::Progress;
use super::values;
use crate::alarm::Alarm;
use crate::environment::{Environment, EnvironmentOptions, TableKind};
use crate::error::{Error, Notices, Result};
use crate::light_grid::DistributionOptions;
use crate::memory;
use crate::output::film_file::Part;
use crate::output::record::{Phases, Record};
use crate::output::{self, Exposure};
use crate::path::{Background, PathLimits, World, framing};
use crate::render::filter::PixelFilter;
use crate::render::gpu::{DeviceChoice, Gpu, RayChoice, Schedule};
use crate::render::{Crop, Gi, Sampling, Session, Sharing, StopRule, View};
use crate::sampler::Points;
use crate::scene::{Camera, Medium, Projection, Scene, SceneOptions, builtin};
use crate::terminal::notice;
use frames::{Frames, Reel};
use share::Share;

/// Arguments of `render`.
#[derive(Debug, Clone, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Ctrl-C ends the work early, writes the pictures and counts as success; a second one, or one before there
is a picture, leaves at once with status 130.

Examples:
  lightgrid render kitchen.glb --env meadow.hdr --noise 0.05 -o kitchen.exr -o kitchen.png
  lightgrid render office --spp 4096 --checkpoint office.checkpoint -o office.exr
  lightgrid render office --spp 4096 --part 2/8 -o office.2.part
  lightgrid render car.glb --turntable 48 --spp 64 --denoise -o car.####.png -o car.mp4"
)]
pub(super) struct RenderArguments {
    /// A glTF file (.gltf, .glb) or a built-in scene.
    #[arg(default_value = builtin::DEFAULT_SCENE)]
    scene: String,
    /// The picture to write: .png or .exr; may be given twice. With --part, one .part.
    #[arg(short, long = "output", required = true, value_name = "FILE")]
    outputs: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) of_scene: SceneOptions,

    /// The map: .exr, .hdr, an 8-bit picture, or a built-in sky (sky:day, sky:sunset, sky:night,
    /// sky:overcast, sky:hallway, each with @WIDTHxHEIGHT if wanted). Without it, sky:day, or the sky of a
    /// built-in scene.
    #[arg(long, value_name = "MAP", help_heading = "Environment")]
    env: Option<String>,
    /// Turns the map about the vertical, in degrees.
    #[arg(long, default_value = "0", value_parser = values::finite, value_name = "DEG", help_heading = "Environment")]
    env_rotation: f64,
    /// What the camera sees of the map: `map`, `blur:DEGREES`, or a colour R,G,B (linear radiance).
    #[arg(long, value_parser = values::background, allow_hyphen_values = true, value_name = "WHAT", help_heading = "Environment")]
    background: Option<Background>,
    /// Multiplies the map's radiance.
    #[arg(long, default_value = "1", value_parser = values::not_negative, value_name = "X", help_heading = "Environment")]
    env_intensity: f32,

    /// Fog: scattering per metre, one number or R,G,B; 0.02 halves what is seen over 35 metres. In
    /// place of the scene's own fog; 0 clears the air.
    #[arg(long, value_parser = values::coefficient, allow_hyphen_values = true, value_name = "S", help_heading = "Fog")]
    fog: Option<Vec3>,
    /// Absorption of the fog per metre, one number or R,G,B.
    #[arg(long, value_parser = values::coefficient, allow_hyphen_values = true, value_name = "A", help_heading = "Fog")]
    fog_absorption: Option<Vec3>,
    /// Mean cosine of scattering, -1 to 1: 0 to all sides alike, mist and haze 0.6 to 0.9.
    #[arg(long, value_parser = values::mean_cosine, allow_hyphen_values = true, value_name = "G", help_heading = "Fog")]
    fog_anisotropy: Option<f32>,
    /// Lower and upper corner of the fog in metres; without it, the fog fills the scene's own box.
    #[arg(long, value_parser = values::corners, allow_hyphen_values = true, value_name = "X,Y,Z,X,Y,Z", help_heading = "Fog")]
    fog_box: Option<[Vec3; 2]>,

    /// Which of the file's cameras, counted from 0.
    #[arg(long, value_name = "N", help_heading = "Camera")]
    camera: Option<usize>,
    /// Camera position in metres, instead of a camera of the file.
    #[arg(long, value_parser = values::vector, requires = "target", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    eye: Option<Vec3>,
    /// What the camera at --eye looks at.
    #[arg(long, value_parser = values::vector, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    target: Option<Vec3>,
    /// Vertical field of view in degrees.
    #[arg(long, value_parser = values::positive, value_name = "DEG", help_heading = "Camera")]
    fov: Option<f64>,
    /// Radius of a thin lens in metres; 0 keeps everything sharp.
    #[arg(long, value_parser = values::not_negative, value_name = "M", help_heading = "Camera")]
    lens_radius: Option<f32>,
    /// Distance at which the picture is sharp, in metres.
    #[arg(long, value_parser = values::positive, value_name = "M", help_heading = "Camera")]
    focus: Option<f64>,

    /// Picture size in pixels.
    #[arg(long, default_value = "1280x720", value_parser = values::size, allow_hyphen_values = true, value_name = "WxH", help_heading = "Picture")]
    size: (u32, u32),
    /// Renders only this part of the picture: its left and top, width and height in pixels.
    #[arg(long, value_parser = values::region, allow_hyphen_values = true, value_name = "X,Y,W,H", help_heading = "Picture")]
    region: Option<[u32; 4]>,
    /// Pixel filter.
    #[arg(long, default_value = "blackman-harris", value_enum, help_heading = "Picture")]
    filter: PixelFilter,
    #[command(flatten)]
    picture: PictureArguments,

    /// Stop at this many samples per pixel (256 if no stop rule is given).
    #[arg(long, visible_alias = "samples", value_parser = clap::value_parser!(u32).range(1..), value_name = "N", help_heading = "Stop")]
    spp: Option<u32>,
    /// Stop after this many seconds of learning and rendering.
    #[arg(long, value_parser = values::positive, value_name = "S", help_heading = "Stop")]
    seconds: Option<f64>,
    /// Stop when the estimated relative RMS error falls below this, e.g. 0.05.
    #[arg(long, value_parser = values::positive, value_name = "E", help_heading = "Stop")]
    noise: Option<f64>,

    /// How the map is sampled.
    #[arg(long, default_value = "adaptive", value_enum, help_heading = "Light")]
    sampling: Sampling,
    /// Whether the pixels of a tile share what their paths find behind the second vertex: less noise at
    /// each pixel, but coarser. `auto` is 8x8 for adaptive sampling in clear air from 64x64 pixels on
    /// that are not denoised.
    #[arg(
        long,
        default_value = "auto",
        value_enum,
        value_name = "off|4x4|8x8|auto",
        help_heading = "Light"
    )]
    sharing: Sharing,
    /// What becomes of light that has met several surfaces.
    #[arg(
        long,
        default_value = "exact",
        value_enum,
        value_name = "exact|cached",
        help_heading = "Light"
    )]
    gi: Gi,
    /// Importance table of the map: tile-local, u32, f32, f64.
    #[arg(long, default_value = "tile-local", value_name = "KIND", help_heading = "Light")]
    table: TableKind,
    /// Surface vertices at which a path gathers light; 1 is direct light only.
    #[arg(long, default_value = "8", value_parser = clap::value_parser!(u32).range(0..=100_000), value_name = "N", help_heading = "Light")]
    bounces: u32,
    /// Never end dim paths at random.
    #[arg(long, help_heading = "Light")]
    no_russian_roulette: bool,
    /// Tiles of the map, columns x rows.
    #[arg(long, default_value = "16x8", value_parser = tile_grid, allow_hyphen_values = true, value_name = "CxR", help_heading = "Light")]
    tiles: (u32, u32),
    /// Light Grid cells around the horizon; half as many from top to bottom.
    #[arg(long, default_value = "64", value_parser = clap::value_parser!(u32).range(2..=512), value_name = "N", help_heading = "Light")]
    grid: u32,
    /// Camera paths to learn from before rendering, which goes on learning; without it, as many as
    /// suit the picture.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000), value_name = "N", help_heading = "Light")]
    learning_paths: Option<u64>,

    /// Seed of the random numbers; the same seed gives the same picture.
    #[arg(long, default_value = "0", value_name = "N", help_heading = "Run")]
    seed: u32,
    /// Where to render: auto takes a GPU if there is a real one and everything fits on it.
    #[arg(long, default_value = "auto", value_enum, help_heading = "Run")]
    device: DeviceChoice,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME", help_heading = "Run")]
    adapter: Option<String>,
    /// What finds the surfaces that rays hit on a GPU.
    #[arg(long, default_value = "auto", value_enum, help_heading = "Run")]
    rays: RayChoice,
    /// How a GPU's kernels share the work: one does all, or three take turns; without it, what suits the
    /// scene. The picture is the same.
    #[arg(long, value_enum, help_heading = "Run")]
    schedule: Option<Schedule>,
    /// Threads; 0 uses every core.
    #[arg(long, default_value = "0", value_parser = clap::value_parser!(u16).range(0..=1024), value_name = "N", help_heading = "Run")]
    threads: u16,
    /// Leaves times out of what pictures say about themselves: equal pictures are equal files.
    #[arg(long, help_heading = "Run")]
    reproducible: bool,
    /// Writes the run's figures as JSON.
    #[arg(long, value_name = "FILE", help_heading = "Run")]
    json: Option<PathBuf>,
    /// Writes what was learned, each cell's probability of each tile: .csv, .json or .exr.
    #[arg(long, alias = "laws", value_name = "FILE", help_heading = "Run")]
    distributions: Option<PathBuf>,

    /// Renders only this share of every pixel's samples, such as 2/8, into a .part for `lightgrid
    /// merge`. All parts take the same options, of which those for .png and .exr are for merge.
    #[arg(long, value_parser = values::part, conflicts_with_all = ["seconds", "noise"], value_name = "I/N", help_heading = "Farm")]
    part: Option<Part>,
    /// Keeps what is done in this file; the same command goes on from it, should this one be killed.
    #[arg(long, value_name = "FILE", help_heading = "Farm")]
    checkpoint: Option<PathBuf>,
    /// Seconds between two writings of the checkpoint.
    #[arg(long, requires = "checkpoint", default_value = "60", value_parser = values::positive, value_name = "S", help_heading = "Farm")]
    checkpoint_every: f64,

    /// Renders these frames of the camera's movement in the file, or of a turn: 0..47, or one number.
    /// Outputs are out.####.png, or .mp4, .webm and .gif by ffmpeg. Frame N is at N / fps seconds.
    #[arg(long, value_parser = values::frames, value_name = "A..B", help_heading = "Frames")]
    frames: Option<RangeInclusive<u32>>,
    /// Turns the camera once in so many frames about the vertical through --target; without it, through
    /// what the middle of the picture shows or, in a room, the camera itself.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=100_000), value_name = "N", help_heading = "Frames")]
    turntable: Option<u32>,
    /// Frames per second.
    #[arg(long, default_value = "24", value_parser = values::positive, value_name = "F", help_heading = "Frames")]
    fps: f64,
    /// A frame of a video, which nobody asked for by name.
    #[arg(skip)]
    frame_of_video: Option<PathBuf>,
}

fn tile_grid(text: &str) -> std::result::Result<(u32, u32), String> {
    let (columns, rows) = values::pair(text)?;
    if columns > 256 || rows > 256 {
        return Err("at most 256x256 tiles".to_owned());
    }
    Ok((columns, rows))
}

impl RenderArguments {
    /// Name of the map.
    pub(super) fn map(&self) -> &str {
        self.env.as_deref().unwrap_or_else(|| builtin::sky(&self.scene))
    }

    /// Defaults but for scene, map, picture, sampling, (size, samples, seconds) and (device,
    /// adapter, rays).
    pub(super) fn for_picture(
        scene: &str,
        map: &str,
        picture: &Path,
        sampling: Sampling,
        (size, samples, seconds): (Option<(u32, u32)>, Option<u32>, Option<f64>),
        (device, adapter, rays): (DeviceChoice, Option<String>, RayChoice),
    ) -> Self {
        Self {
            scene: scene.to_owned(),
            of_scene: SceneOptions::default(),
            outputs: vec![picture.to_owned()],
            env: Some(map.to_owned()),
            env_rotation: 0.0,
            env_intensity: 1.0,
            background: None,
            region: None,
            fog: None,
            fog_absorption: None,
            fog_anisotropy: None,
            fog_box: None,
            camera: None,
            eye: None,
            target: None,
            fov: None,
            lens_radius: None,
            focus: None,
            size: size.unwrap_or((1280, 720)),
            filter: PixelFilter::default(),
            picture: PictureArguments::default(),
            spp: samples,
            seconds,
            noise: None,
            sampling,
            sharing: Sharing::Auto,
            gi: Gi::Exact,
            table: TableKind::default(),
            bounces: 8,
            no_russian_roulette: false,
            tiles: (16, 8),
            grid: 64,
            learning_paths: None,
            seed: 0,
            device,
            adapter,
            rays,
            schedule: None,
            threads: 0,
            reproducible: false,
            json: None,
            distributions: None,
            part: None,
            checkpoint: None,
            checkpoint_every: 60.0,
            frames: None,
            turntable: None,
            fps: 24.0,
            frame_of_video: None,
        }
    }
}

/// Bytes of a pixel in the film and in what is made of it to be written; and with layers.
const BYTES_OF_PIXEL: u64 = 72;
const BYTES_WITH_LAYERS: u64 = 140;

/// Loads, learns, renders, writes.
pub(super) fn run(arguments: &RenderArguments) -> Result<()> {
    outputs::check(arguments)?;
    start_threads(arguments.threads)?;
    let interrupt = Interrupt::watch("stopping after this pass and writing the picture");
    let progress = Progress::start("loading the scene and the map");
    // Side by side: a large scene and a large map take seconds each.
    let (world, light) = rayon::join(|| load_world(arguments), || load_environment(arguments));
    let (world, load_scene_seconds, build_bvh_seconds) = world?;
    let (environment, map_notices, load_map_seconds, build_table_seconds) = light?;
    let phases =
        Phases { load_scene_seconds, build_bvh_seconds, load_map_seconds, build_table_seconds };

    let mut notices = world.scene.notices.clone();
    notices.extend(&map_notices);
    let camera = camera(arguments, &world, &mut notices)?;
    let frames = Frames::plan(arguments, &world, &camera)?;
    let ([width, height], has_layers) = (size(arguments), arguments.picture.wants_surfaces());
    let bytes = if has_layers { BYTES_WITH_LAYERS } else { BYTES_OF_PIXEL };
    memory::check(u64::from(width) * u64::from(height) * bytes)
        .map_err(|cause| Error::new(format!("a picture of this size {cause}")))?;
    progress.finish();
    notices.iter().for_each(notice);
    let gpu = device::open(
        arguments.device,
        arguments.adapter.as_deref(),
        (arguments.rays, arguments.schedule),
        &mut notices,
    )?;
    let job = Job { world: &world, environment: &environment, phases, notices, gpu, interrupt };
    match frames {
        None => job.render(arguments, camera, &Progress::start("learning")).map(|_| ()),
        Some(frames) => job.render_frames(arguments, &frames, &camera),
    }
}

/// What all pictures of a command have in common.
struct Job<'a> {
    world: &'a World,
    environment: &'a Environment,
    phases: Phases,
    notices: Notices,
    gpu: Option<Gpu>,
    interrupt: Interrupt,
}

impl Job<'_> {
    /// Renders and writes one picture; returns the exposure that suits the next, if there may be one.
    fn render(
        &self,
        arguments: &RenderArguments,
        camera: Camera,
        progress: &Progress,
    ) -> Result<Exposure> {
        let Self { world, environment, .. } = *self;
        let mut notices = self.notices.clone();
        let view = view(arguments, world, camera);
        let rule = stop_rule(arguments);
        let mut share = Share::open(arguments, rule, (world, environment), &view)?;
        share.say(&mut notices);
        let gpu = self.gpu.as_ref();
        let mut session =
            device::start(arguments.device, gpu, world, environment, view, &mut notices)?;
        let outcome =
            work(&mut session, &mut share, &self.interrupt, progress, arguments, &mut notices);
        progress.finish();
        if !share.has_samples(&session) {
            outcome?;
            return Ok(Exposure::Auto);
        }
        let film = share.film(&session);
        let remarks = output::remarks(&film, environment);
        remarks.iter().for_each(|sentence| notices.add(sentence));

        let record = Record {
            scene: &arguments.scene,
            map: arguments.map(),
            world,
            environment,
            film: &film,
            figures: &session.figures(),
            gpu: session.gpu_figures(),
            phases: &self.phases,
            notices: &notices,
            with_times: !arguments.reproducible,
            options: outputs::settings(arguments, world, session.view()),
        };
        let mut failures = outputs::write(arguments, &share, &record, session.grid());
        failures.extend(share.keep(&session).err());
        remarks.iter().for_each(notice);
        failures.extend(outcome.err());
        Error::all(failures)?;
        Ok(arguments.picture.exposure_of(&film))
    }

    /// Renders one picture after another, each with what it learned itself: cells lie around the camera.
    /// The first one's exposure is that of all.
    fn render_frames(
        &self,
        arguments: &RenderArguments,
        frames: &Frames<'_>,
        camera: &Camera,
    ) -> Result<()> {
        let mut of_frame = arguments.clone();
        let (videos, pictures): (Vec<_>, Vec<_>) =
            arguments.outputs.iter().partition(|path| frames::is_video(path));
        let mut reel = if videos.is_empty() { None } else { Some(Reel::new()?) };
        let mut failures = Vec::new();
        for number in frames.numbers() {
            let name = |path: &PathBuf| frames::numbered(path, number);
            of_frame.outputs = pictures.iter().map(|path| name(path)).collect();
            of_frame.json = arguments.json.as_ref().map(name);
            of_frame.distributions = arguments.distributions.as_ref().map(name);
            of_frame.frame_of_video = reel.as_mut().map(Reel::next);
            self.interrupt.go_on();
            let progress = Progress::of_frame(number, *frames.numbers().end());
            match self.render(&of_frame, frames.camera(number, camera), &progress) {
                Ok(exposure) => of_frame.picture.set_exposure(exposure),
                Err(failure) => {
                    failures.push(failure);
                    break;
                }
            }
            if self.interrupt.was_signalled() {
                notice(format_args!("frame {number} was ended early and is the last"));
                break;
            }
        }
        // What there is of them, should a frame have failed.
        let reel = reel.as_ref().filter(|reel| reel.has_frames());
        let write = |video: &PathBuf| reel.and_then(|reel| reel.write(video, arguments.fps).err());
        failures.extend(videos.into_iter().filter_map(write));
        Error::all(failures)
    }
}

/// The scene made ready for rays, and the seconds of loading and of building.
fn load_world(arguments: &RenderArguments) -> Result<(World, f64, f64)> {
    let start = Instant::now();
    let scene = crate::sources::scene_with(&arguments.scene, &arguments.of_scene)?;
    let load_seconds = lap(start);
    let start = Instant::now();
    let world = World::new(scene);
    Ok((world, load_seconds, lap(start)))
}

/// The map made ready to be sampled, what was repaired in it, and the seconds of loading and of
/// building.
fn load_environment(arguments: &RenderArguments) -> Result<(Environment, Notices, f64, f64)> {
    let start = Instant::now();
    let (map, notices) = crate::sources::map(arguments.map())?;
    let load_seconds = lap(start);
    let start = Instant::now();
    let environment = Environment::new(map, &environment_options(arguments))
        .map_err(|e| Error::at(arguments.map(), e))?;
    Ok((environment, notices, load_seconds, lap(start)))
}

fn lap(start: Instant) -> f64 {
    start.elapsed().as_secs_f64()
}

pub(super) fn start_threads(threads: u16) -> Result<()> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads))
        .thread_name(|i| format!("render {i}"))
        .build_global()
        .map_err(|e| Error::new(format!("{threads} threads cannot be started: {e}")))
}

fn environment_options(arguments: &RenderArguments) -> EnvironmentOptions {
    EnvironmentOptions {
        table: arguments.table,
        tile_columns: arguments.tiles.0,
        tile_rows: arguments.tiles.1,
        rotation_radians: arguments.env_rotation.to_radians() as f32,
        intensity: arguments.env_intensity,
        ..EnvironmentOptions::default()
    }
}

fn stop_rule(arguments: &RenderArguments) -> StopRule {
    let none = arguments.spp.is_none() && arguments.seconds.is_none() && arguments.noise.is_none();
    StopRule {
        samples: arguments.spp.or(none.then_some(256)),
        seconds: arguments.seconds,
        noise: arguments.noise,
    }
}

/// A picture to be denoised gains nothing from noise that neighbours share, which filters keep.
fn sharing(arguments: &RenderArguments) -> Sharing {
    match arguments.sharing {
        Sharing::Auto if arguments.picture.denoise.is_some() => Sharing::Off,
        asked => asked,
    }
}

/// Width and height of what is rendered.
fn size(arguments: &RenderArguments) -> [u32; 2] {
    arguments.region.map_or(arguments.size.into(), |[_, _, width, height]| [width, height])
}

fn view(arguments: &RenderArguments, world: &World, camera: Camera) -> View {
    let [width, height] = size(arguments);
    View {
        camera,
        width,
        height,
        filter: arguments.filter,
        sampling: arguments.sampling,
        limits: PathLimits {
            bounces: arguments.bounces,
            russian_roulette: !arguments.no_russian_roulette,
        },
        seed: arguments.seed,
        points: Points::Sobol,
        grid_columns: arguments.grid,
        sharing: sharing(arguments),
        gi: arguments.gi,
        learning_paths: arguments.learning_paths.unwrap_or_else(|| {
            View::suitable_learning_paths(arguments.sampling, [width, height], arguments.spp)
        }),
        distributions: DistributionOptions::ADAPTIVE,
        medium: medium(arguments, &world.scene),
        background: arguments.background.unwrap_or_default(),
        crop: arguments.region.map(|[left, top, ..]| Crop {
            corner: [left, top],
            whole: [arguments.size.0, arguments.size.1],
        }),
        layers: arguments.picture.wants_surfaces(),
    }
}

/// The medium the options ask for: what they leave out is the scene's.
fn medium(arguments: &RenderArguments, scene: &Scene) -> Option<Medium> {
    let RenderArguments { fog, fog_absorption, fog_anisotropy, fog_box, .. } = arguments;
    if fog.is_none() && fog_absorption.is_none() && fog_anisotropy.is_none() && fog_box.is_none() {
        return None;
    }
    let of_scene = scene.medium.unwrap_or_default();
    let cleared = *fog == Some(Vec3::ZERO) && fog_absorption.is_none();
    Some(Medium {
        scattering: fog.unwrap_or(of_scene.scattering),
        absorption: fog_absorption.unwrap_or(if cleared {
            Vec3::ZERO
        } else {
            of_scene.absorption
        }),
        anisotropy: fog_anisotropy.unwrap_or(of_scene.anisotropy),
        bounds: fog_box.or(of_scene.bounds),
    })
}

fn camera(arguments: &RenderArguments, world: &World, notices: &mut Notices) -> Result<Camera> {
    let cameras = &world.scene.cameras;
    let mut camera = if let (Some(eye), Some(target)) = (arguments.eye, arguments.target) {
        if eye == target {
            return Err(Error::new("--eye and --target are the same point"));
        }
        Camera::look_at(eye, target, 0.9)
    } else if let Some(index) = arguments.camera {
        cameras.get(index).cloned().ok_or_else(|| {
            let there_are = match cameras.len() {
                0 => "no camera".to_owned(),
                1 => "one camera, number 0".to_owned(),
                count => format!("cameras 0 to {}", count - 1),
            };
            Error::new(format!("--camera {index}: {} has {there_are}", arguments.scene))
        })?
    } else if let Some(camera) = cameras.first() {
        camera.clone()
    } else {
        let chosen = framing::frame(world, arguments.size.0 as f32 / arguments.size.1 as f32);
        let eye = chosen.world_from_camera.translation;
        let target = eye - chosen.world_from_camera.matrix3.z_axis * chosen.focus_distance;
        notices.add(format!(
            "{} has no camera; the view is --eye {},{},{} --target {},{},{} --fov {:.1}",
            arguments.scene,
            eye.x,
            eye.y,
            eye.z,
            target.x,
            target.y,
            target.z,
            framing::FOV_Y_RADIANS.to_degrees(),
        ));
        chosen
    };
    if let Some(degrees) = arguments.fov {
        if degrees >= 179.0 {
            return Err(Error::new(format!("--fov {degrees}: must be below 179 degrees")));
        }
        camera.projection = Projection::Perspective { fov_y_radians: degrees.to_radians() as f32 };
    }
    camera.lens_radius = arguments.lens_radius.unwrap_or(camera.lens_radius);
    camera.focus_distance = arguments.focus.map_or(camera.focus_distance, |f| f as f32);
    Ok(camera)
}

/// Runs the session until a rule or the user says stop; at least one sample is taken. When the seconds
/// are over, the pass under way ends with what it has. If a GPU that was not asked for by name fails,
/// the CPU takes over.
fn work(
    session: &mut Session<'_>,
    share: &mut Share,
    interrupt: &Interrupt,
    progress: &Progress,
    arguments: &RenderArguments,
    notices: &mut Notices,
) -> Result<()> {
    let alarm = Alarm::start(Arc::clone(interrupt.asked()));
    loop {
        progress.show(session, share.rule());
        match share.step(session, interrupt, &alarm, notices) {
            Ok(true) => return Ok(()),
            Ok(false) => {}
            Err(failure) if arguments.device != DeviceChoice::Auto => return Err(failure),
            Err(failure) => {
                device::say(notices, format!("{failure}; the CPU goes on"));
                session.continue_on_cpu();
            }
        }
    }
}
