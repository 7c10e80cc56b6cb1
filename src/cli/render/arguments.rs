//! Arguments of `render`, and what they ask for.

use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Parser as _;
use glam::{DVec3, Vec2, Vec3};

use crate::cli::camera::CameraArguments;
use crate::cli::choices::SceneArguments;
use crate::cli::picture::PictureArguments;
use crate::cli::values;
use crate::environment::{EnvironmentOptions, TableKind};
use crate::error::{Error, Notices, Result};
use crate::output::film_file::Part;
use crate::path::{Background, PathLimits, World, framing};
use crate::render::filter::PixelFilter;
use crate::render::gpu::{DeviceChoice, RayChoice, Schedule};
use crate::render::{Crop, Gi, Sampling, Sharing, StopRule, View};
use crate::scene::camera_path::FRAMES_PER_SECOND;
use crate::scene::{Camera, Medium, Scene, builtin};

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
pub(in crate::cli) struct RenderArguments {
    /// A glTF file (.gltf, .glb) or a built-in scene.
    #[arg(default_value = builtin::DEFAULT_SCENE)]
    pub(super) scene: String,
    /// The picture to write: .png or .exr; may be given twice. With --part, one .part.
    #[arg(short, long = "output", required = true, value_name = "FILE")]
    pub(super) outputs: Vec<PathBuf>,
    #[command(flatten)]
    pub(in crate::cli) of_scene: SceneArguments,

    /// The map: .exr, .hdr, an 8-bit picture, or a built-in sky (sky:day, sky:sunset, sky:night,
    /// sky:overcast, sky:hallway, each with @WIDTHxHEIGHT if wanted). Without it, sky:day, or the sky of a
    /// built-in scene.
    #[arg(long, value_name = "MAP", help_heading = "Environment")]
    pub(super) env: Option<String>,
    /// Turns the map about the vertical, in degrees.
    #[arg(long, default_value = "0", value_parser = values::finite, value_name = "DEG", help_heading = "Environment")]
    pub(super) env_rotation: f64,
    /// Turns the map so that its sun shines on the surface at this place of the picture, X,Y in [0,1] from
    /// the left and the top, or on the nearest that it can reach.
    #[arg(long, value_parser = values::place, conflicts_with = "env_rotation", allow_hyphen_values = true, value_name = "X,Y", help_heading = "Environment")]
    pub(super) sun_at: Option<Vec2>,
    /// What the camera sees of the map: `map`, `none` (pictures have an alpha channel), `blur:DEGREES`, or a
    /// colour R,G,B (linear radiance).
    #[arg(long, value_parser = values::background, allow_hyphen_values = true, value_name = "WHAT", help_heading = "Environment")]
    pub(super) background: Option<Background>,
    /// Multiplies the map's radiance.
    #[arg(long, default_value = "1", value_parser = values::not_negative, value_name = "X", help_heading = "Environment")]
    pub(super) env_intensity: f32,
    /// Multiplies the light of the map's sun, and not its sky: what within 2.5 degrees of the brightest
    /// place is brighter than around.
    #[arg(long, default_value = "1", value_parser = values::not_negative, value_name = "X", help_heading = "Environment")]
    pub(super) env_sun: f32,

    /// Fog: scattering per metre, one number or R,G,B; 0.02 halves what is seen over 35 metres. In
    /// place of the scene's own fog; 0 clears the air.
    #[arg(long, value_parser = values::coefficient, allow_hyphen_values = true, value_name = "S", help_heading = "Fog")]
    pub(super) fog: Option<Vec3>,
    /// Absorption of the fog per metre, one number or R,G,B.
    #[arg(long, value_parser = values::coefficient, allow_hyphen_values = true, value_name = "A", help_heading = "Fog")]
    pub(super) fog_absorption: Option<Vec3>,
    /// Mean cosine of scattering, -1 to 1: 0 to all sides alike, mist and haze 0.6 to 0.9.
    #[arg(long, value_parser = values::mean_cosine, allow_hyphen_values = true, value_name = "G", help_heading = "Fog")]
    pub(super) fog_anisotropy: Option<f32>,
    /// Lower and upper corner of the fog in metres; without it, the fog fills the scene's own box.
    #[arg(long, value_parser = values::corners, allow_hyphen_values = true, value_name = "X,Y,Z,X,Y,Z", help_heading = "Fog")]
    pub(super) fog_box: Option<[Vec3; 2]>,

    #[command(flatten)]
    pub(in crate::cli) place: CameraArguments,
    /// Radius of a thin lens in metres; 0 keeps everything sharp.
    #[arg(long, value_parser = values::not_negative, value_name = "M", help_heading = "Camera")]
    pub(super) lens_radius: Option<f32>,
    /// Distance at which the picture is sharp, in metres.
    #[arg(long, value_parser = values::positive, value_name = "M", help_heading = "Camera")]
    pub(super) focus: Option<f64>,

    /// Picture size in pixels.
    #[arg(long, default_value = "1280x720", value_parser = values::size, allow_hyphen_values = true, value_name = "WxH", help_heading = "Picture")]
    pub(in crate::cli) size: (u32, u32),
    /// Renders only this part of the picture: its left and top, width and height in pixels.
    #[arg(long, value_parser = values::region, allow_hyphen_values = true, value_name = "X,Y,W,H", help_heading = "Picture")]
    pub(super) region: Option<[u32; 4]>,
    /// Pixel filter.
    #[arg(long, default_value = "blackman-harris", help_heading = "Picture")]
    pub(super) filter: PixelFilter,
    #[command(flatten)]
    pub(super) picture: PictureArguments,

    /// Stop at this many samples per pixel (256 if no stop rule is given).
    #[arg(long, visible_alias = "samples", value_parser = values::whole::<u32>(1..=u32::MAX), value_name = "N", help_heading = "Stop")]
    pub(in crate::cli) spp: Option<u32>,
    /// Stop after this many seconds of learning and rendering; if they do not suffice for a sample of every
    /// pixel, a CPU makes a coarser picture.
    #[arg(long, value_parser = values::positive, value_name = "S", help_heading = "Stop")]
    pub(in crate::cli) seconds: Option<f64>,
    /// Stop when the estimated relative RMS error falls below this, e.g. 0.05 or 5%; it is known from 16
    /// samples per pixel on.
    #[arg(long, value_parser = values::noise, value_name = "E", help_heading = "Stop")]
    pub(super) noise: Option<f64>,

    /// How the map is sampled.
    #[arg(long, default_value = "adaptive", help_heading = "Light")]
    pub(in crate::cli) sampling: Sampling,
    /// Whether the pixels of a tile share what their paths find behind the second vertex: less noise at
    /// each pixel, but coarser. `auto` shares with adaptive sampling, from 64x64 pixels on that are not
    /// denoised: 8x8 inside, 4x4 outside and in fog, nothing in the open.
    #[arg(long, default_value = "auto", value_name = "off|4x4|8x8|auto", help_heading = "Light")]
    pub(super) sharing: Sharing,
    /// Renders groups of light apart: sky, sun, each lamp or material that emits by its name. The picture is their sum,
    /// and an .exr has a layer of each (light.sky, light.sun, lamp.NAME, light.surfaces). Samples and noise are asked of
    /// each group; seconds are shared.
    #[arg(long, conflicts_with_all = ["part", "checkpoint", "distributions", "frames", "turntable"], help_heading = "Light")]
    pub(super) light_groups: bool,
    /// What becomes of light that has met several surfaces. Unless it is given: exact, with up to 16 samples of
    /// cached light beside it where a picture of a room is denoised, for as long as its own are few.
    #[arg(long, value_name = "exact|cached", help_heading = "Light")]
    pub(super) gi: Option<Gi>,
    /// Importance table of the map; all but tile-local are for the CPU alone.
    #[arg(long, default_value = "tile-local", value_name = "KIND", help_heading = "Light")]
    pub(super) table: TableKind,
    /// Vertices, on surfaces and in fog, at which a path gathers light; 1 is direct light only, 0 lamps
    /// and the map alone.
    #[arg(long, default_value_t = PathLimits::default().bounces, value_parser = values::whole::<u32>(0..=PathLimits::MAX_BOUNCES), value_name = "N", help_heading = "Light")]
    pub(super) bounces: u32,
    /// Never end dim paths at random.
    #[arg(long, help_heading = "Light")]
    pub(super) no_russian_roulette: bool,
    /// Tiles of the map, columns x rows.
    #[arg(long, default_value = "16x8", value_parser = tile_grid, allow_hyphen_values = true, value_name = "CxR", help_heading = "Light")]
    pub(super) tiles: (u32, u32),
    /// Light Grid cells around the horizon; half as many from top to bottom.
    #[arg(long, default_value = "64", value_parser = values::whole::<u32>(2..=256), value_name = "N", help_heading = "Light")]
    pub(super) grid: u32,
    /// Camera paths to learn from before rendering, which goes on learning; without it, as many as
    /// suit the picture.
    #[arg(long, value_parser = values::whole::<u64>(1..=1_000_000_000), value_name = "N", help_heading = "Light")]
    pub(super) learning_paths: Option<u64>,

    /// Seed of the random numbers; the same seed gives the same picture.
    #[arg(long, default_value = "0", value_parser = values::whole::<u32>(0..=u32::MAX), value_name = "N", help_heading = "Run")]
    pub(super) seed: u32,
    /// Where to render: auto takes a GPU if there is a real one and everything fits on it.
    #[arg(long, default_value = "auto", help_heading = "Run")]
    pub(in crate::cli) device: DeviceChoice,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME", help_heading = "Run")]
    pub(in crate::cli) adapter: Option<String>,
    /// What finds the surfaces that rays hit on a GPU.
    #[arg(long, default_value = "auto", help_heading = "Run")]
    pub(in crate::cli) rays: RayChoice,
    /// How a GPU's kernels share the work: one does all, or three take turns; without it, what suits the GPU.
    /// The picture is the same. Where pixels share vertices, kernels always take turns.
    #[arg(long, help_heading = "Run")]
    pub(super) schedule: Option<Schedule>,
    /// Threads; 0 uses every core.
    #[arg(long, default_value = "0", value_parser = values::whole::<u16>(0..=1024), value_name = "N", help_heading = "Run")]
    pub(super) threads: u16,
    /// For programs that start this one: says twice a second how far it is, and ends early, as by Ctrl-C, when standard
    /// input ends.
    #[arg(long, help_heading = "Run")]
    pub(super) watched: bool,
    /// Leaves times out of what pictures say about themselves: equal pictures are equal files.
    #[arg(long, help_heading = "Run")]
    pub(super) reproducible: bool,
    /// Writes the run's figures as JSON.
    #[arg(long, value_name = "FILE", help_heading = "Run")]
    pub(super) json: Option<PathBuf>,
    /// Writes what was learned, each cell's probability of each tile: .csv, .json or .exr.
    #[arg(long, value_name = "FILE", help_heading = "Run")]
    pub(super) distributions: Option<PathBuf>,

    /// Renders only this share of every pixel's samples, such as 2/8, into a .part for `lightgrid
    /// merge`. All parts take the same options, of which those for .png and .exr are for merge.
    #[arg(long, value_parser = values::part, conflicts_with_all = ["seconds", "noise"], value_name = "I/N", help_heading = "Farm")]
    pub(super) part: Option<Part>,
    /// Keeps what is done in this file; the same command goes on from it, should this one be killed. With
    /// more samples asked for it goes on, too, by what was learned for the first.
    #[arg(long, value_name = "FILE", help_heading = "Farm")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Seconds between two writings of the checkpoint.
    #[arg(long, requires = "checkpoint", default_value = "60", value_parser = values::positive, value_name = "S", help_heading = "Farm")]
    pub(super) checkpoint_every: f64,

    /// Renders these frames of the camera's movement in the file, or of a turn: 0..47, or one number.
    /// Outputs are out.####.png, or .mp4, .webm and .gif by ffmpeg. Frame N is at N / fps seconds.
    #[arg(long, value_parser = values::frames, value_name = "A..B", help_heading = "Frames")]
    pub(super) frames: Option<RangeInclusive<u32>>,
    /// Turns the camera once in N frames. The axis is the vertical through --about or --target; without them, through
    /// what the middle of the picture shows or, in a room, the camera itself.
    #[arg(long, value_parser = values::whole::<u32>(1..=100_000), value_name = "N", help_heading = "Frames")]
    pub(super) turntable: Option<u32>,
    /// The place that --turntable turns the camera about.
    #[arg(long, value_parser = values::vector, requires = "turntable", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Frames")]
    pub(super) about: Option<DVec3>,
    /// Frames per second.
    #[arg(long, default_value_t = FRAMES_PER_SECOND, value_parser = values::positive, value_name = "F", help_heading = "Frames")]
    pub(super) fps: f64,
    /// A frame of a video, which nobody asked for by name.
    #[arg(skip)]
    pub(super) frame_of_video: Option<PathBuf>,
}

fn tile_grid(text: &str) -> std::result::Result<(u32, u32), String> {
    let (columns, rows) = values::pair(text)
        .map_err(|_| "expected two positive whole numbers like 16x8".to_owned())?;
    if columns > 256 || rows > 256 {
        return Err("at most 256x256 tiles".to_owned());
    }
    Ok((columns, rows))
}

impl RenderArguments {
    /// Name of the map.
    pub(in crate::cli) fn map(&self) -> &str {
        self.env.as_deref().unwrap_or_else(|| builtin::sky(&self.scene))
    }

    /// Of this scene, map and picture; all else as where nothing is asked for.
    ///
    /// # Errors
    /// If nothing of the kind can be typed.
    pub(in crate::cli) fn of_picture(scene: &str, map: &str, picture: &Path) -> Result<Self> {
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            arguments: RenderArguments,
        }
        let words = ["render", "--env", map, "-o"].map(OsStr::new);
        let rest = [picture.as_os_str(), OsStr::new("--"), OsStr::new(scene)];
        let line = Line::try_parse_from(words.into_iter().chain(rest));
        line.map(|line| line.arguments).map_err(|error| Error::new(error.to_string()))
    }

    pub(super) fn environment_options(&self) -> EnvironmentOptions {
        EnvironmentOptions {
            table: self.table,
            tile_columns: self.tiles.0,
            tile_rows: self.tiles.1,
            rotation_radians: self.env_rotation.to_radians() as f32,
            intensity: self.env_intensity,
            sun: self.env_sun,
        }
    }

    pub(super) fn stop_rule(&self) -> StopRule {
        let none = self.spp.is_none() && self.seconds.is_none() && self.noise.is_none();
        StopRule {
            samples: self.spp.or(none.then_some(256)),
            seconds: self.seconds,
            noise: self.noise,
        }
    }

    /// A picture to be denoised gains nothing from noise that neighbours share, which filters keep.
    pub(super) fn sharing(&self) -> Sharing {
        match self.sharing {
            Sharing::Auto if self.picture.is_denoised(&self.pictures()) => Sharing::Off,
            asked => asked,
        }
    }

    /// Whether albedo, normal and depth are to be found.
    pub(super) fn wants_surfaces(&self) -> bool {
        self.background == Some(Background::None) || self.picture.wants_surfaces(&self.pictures())
    }

    pub(super) fn pictures(&self) -> Vec<PathBuf> {
        self.outputs.iter().chain(&self.frame_of_video).cloned().collect()
    }

    /// Width and height of what is rendered.
    pub(super) fn size(&self) -> [u32; 2] {
        self.region.map_or(self.size.into(), |[_, _, width, height]| [width, height])
    }

    pub(super) fn view(&self, world: &World, camera: Camera) -> View {
        let size = self.size();
        View {
            filter: self.filter,
            sampling: self.sampling,
            limits: PathLimits {
                bounces: self.bounces,
                russian_roulette: !self.no_russian_roulette,
            },
            seed: self.seed,
            grid_columns: self.grid,
            sharing: self.sharing(),
            gi: self.gi.unwrap_or_default(),
            learning_paths: self
                .learning_paths
                .unwrap_or_else(|| View::suitable_learning_paths(self.sampling, size, self.spp)),
            medium: self.medium(&world.scene),
            background: self.background.unwrap_or_default(),
            crop: self.region.map(|[left, top, ..]| Crop {
                corner: [left, top],
                whole: [self.size.0, self.size.1],
            }),
            layers: self.wants_surfaces(),
            ..View::new(camera, size)
        }
    }

    /// The medium the options ask for: what they leave out is the scene's.
    fn medium(&self, scene: &Scene) -> Option<Medium> {
        let Self { fog, fog_absorption, fog_anisotropy, fog_box, .. } = self;
        if (fog, fog_absorption, fog_anisotropy, fog_box) == (&None, &None, &None, &None) {
            return None;
        }
        let asked = scene.frame.medium(Medium {
            scattering: fog.unwrap_or_default(),
            absorption: fog_absorption.unwrap_or_default(),
            anisotropy: 0.0,
            bounds: *fog_box,
        });
        let of_scene = scene.medium.unwrap_or_default();
        let is_cleared = *fog == Some(Vec3::ZERO);
        let absorption = if is_cleared { Vec3::ZERO } else { of_scene.absorption };
        Some(Medium {
            scattering: fog.map_or(of_scene.scattering, |_| asked.scattering),
            absorption: fog_absorption.map_or(absorption, |_| asked.absorption),
            anisotropy: fog_anisotropy.unwrap_or(of_scene.anisotropy),
            bounds: asked.bounds.or(of_scene.bounds),
        })
    }

    /// Index of the camera that was asked for, else of the first.
    ///
    /// # Errors
    /// If the scene has no such camera.
    pub(super) fn camera_number(&self, world: &World) -> Result<usize> {
        let name = self.place.camera.as_ref();
        name.map_or(Ok(0), |name| world.scene.camera_number(name, &self.scene))
    }

    pub(super) fn camera(&self, world: &World, notices: &mut Notices) -> Result<Camera> {
        let cameras = &world.scene.cameras;
        let frame = world.scene.frame;
        let camera = if let Some(place) = self.place.placed()? {
            place.camera(frame)
        } else if let Some(camera) = cameras.get(self.camera_number(world)?) {
            camera.clone()
        } else {
            let chosen = framing::frame(world, self.size.0 as f32 / self.size.1 as f32);
            let in_words =
                |point| frame.point_in_file(point).to_array().map(|x| x.to_string()).join(",");
            notices.add(format!(
                "{} has no camera; the view is --eye {} --target {} --fov {}",
                self.scene,
                in_words(chosen.world_from_camera.translation.into()),
                in_words(chosen.target()),
                framing::FOV_Y_RADIANS.to_degrees(),
            ));
            chosen
        };
        let mut camera = self.place.with_fov(camera)?;
        let length = |metres: f32| frame.length(metres);
        camera.lens_radius = self.lens_radius.map_or(camera.lens_radius, length);
        camera.focus_distance = self.focus.map_or(camera.focus_distance, |f| length(f as f32));
        if self.focus.is_some() && camera.lens_radius == 0.0 {
            notices.add("--focus changes nothing: the lens has no radius (--lens-radius)");
        }
        Ok(camera)
    }

    /// Says what is asked of a fog that there is not.
    pub(super) fn check_fog(&self, scene: &Scene, notices: &mut Notices) {
        let is_shaped = self.fog_anisotropy.is_some() || self.fog_box.is_some();
        let is_clear = |air: Medium| (air.scattering, air.absorption) == Default::default();
        if is_shaped && self.medium(scene).is_some_and(is_clear) {
            notices.add("--fog-box and --fog-anisotropy change nothing: the air is clear (--fog, --fog-absorption)");
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::scene::Projection;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        arguments: RenderArguments,
    }

    #[test]
    fn a_denoised_picture_shares_nothing_unasked() {
        let sharing = |line: &str| {
            let words = format!("render office -o office.png {line}");
            let line = Line::try_parse_from(words.split_whitespace());
            line.map(|line| line.arguments.sharing()).ok()
        };
        assert_eq!(sharing("--denoise off"), Some(Sharing::Auto));
        assert_eq!(sharing(""), Some(Sharing::Off));
        assert_eq!(sharing("--denoise"), Some(Sharing::Off));
        for (name, asked) in
            [("off", Sharing::Off), ("4x4", Sharing::Small), ("8x8", Sharing::Large)]
        {
            assert_eq!(sharing(&format!("--sharing {name}")), Some(asked));
            assert_eq!(sharing(&format!("--sharing {name} --denoise")), Some(asked));
        }
        assert_eq!(sharing("--sharing 5x5"), None);
    }

    #[cfg(feature = "window")]
    mod of_window {
        use glam::{Quat, Vec3};

        use super::*;
        use crate::app::document::{Document, Light, Look, Viewpoint};
        use crate::app::final_render::{FinalRender, Motion};
        use crate::denoise::Denoiser;
        use crate::scene::{
            LampEdit, MaterialEdit, PunctualKind, PunctualLight, Scene, SceneOptions, named_lamps,
        };
        use crate::tone::{ToneCurve, WhiteBalance};

        /// The office with two lamps, two materials of one name, and axes of its own.
        fn world() -> World {
            let mut scene = builtin::build("office").expect("a scene");
            scene.frame.center = DVec3::new(1000.0, -20.0, 3.0);
            scene.frame.scale = 4.0;
            scene.materials[1].name = scene.materials[2].name.clone();
            scene.lights = ["Key", "it's: fill"].map(lamp).into();
            World::new(scene)
        }

        fn lamp(name: &str) -> PunctualLight {
            PunctualLight {
                name: name.to_owned(),
                kind: PunctualKind::Point,
                position: Vec3::Y,
                direction: Vec3::NEG_Z,
                intensity: Vec3::ONE,
                range: f32::INFINITY,
            }
        }

        fn document(world: &World) -> Document {
            let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.5, 1.0, -2.0), 0.7);
            let viewpoint = Viewpoint::of(&camera, 2.5);
            let rolled = viewpoint.rotation() * Quat::from_rotation_z(0.4);
            let fog = Medium {
                scattering: Vec3::new(0.1, 0.2, 0.3),
                absorption: Vec3::new(0.03, 0.02, 0.01),
                anisotropy: -0.5,
                bounds: Some([Vec3::splat(-3.0), Vec3::new(2.0, 1.5, 4.0)]),
            };
            let edit =
                |roughness| MaterialEdit { roughness: Some(roughness), ..Default::default() };
            let dim = LampEdit { factor: 0.25, ..LampEdit::default() };
            Document {
                scene: "office".to_owned(),
                map: "sky:night".to_owned(),
                rotation_degrees: 33.5,
                intensity: 0.5,
                sun: 2.0,
                lamps: 0.5,
                lamp_edits: [(world.scene.lights[1].name.clone(), dim)].into(),
                background: Background::Blurred(0.25),
                fog: Some(fog),
                viewpoint: Some(Viewpoint {
                    rotation: rolled.to_array(),
                    lens_radius: 0.0625,
                    focus_distance: 3.0,
                    ..viewpoint
                }),
                light: Light {
                    device: DeviceChoice::Cpu,
                    sampling: Sampling::Talk,
                    bounces: 5,
                    seed: 7,
                    split: false,
                },
                look: Look {
                    curve: ToneCurve::Neutral,
                    lut: Some("look:warm".to_owned()),
                    lut_strength: 0.5,
                    white_balance: WhiteBalance { kelvin: 4000.0, tint: -0.25 },
                    denoiser: Denoiser::ATrous,
                    ..Look::default()
                },
                region: Some([0.25, 0.5, 0.75, 1.0]),
                stop: StopRule { samples: None, seconds: Some(2.5), noise: Some(0.04) },
                materials: [(0, edit(0.25)), (2, edit(0.75))].into(),
                ..Document::default()
            }
        }

        fn arguments(
            final_render: FinalRender,
            document: &Document,
            world: &World,
            to: &str,
        ) -> RenderArguments {
            let options = SceneOptions { hide: vec!["a b".to_owned()], ..SceneOptions::default() };
            let to = Path::new(to);
            let Scene { lights, materials, .. } = &world.scene;
            let lamps = named_lamps(lights, materials);
            let of_file = (&options, &lamps[..]);
            let words = final_render.words(document, &world.scene, of_file, Some(-1.5), to);
            let line = Line::try_parse_from(&words).map_err(|error| format!("{words:?}: {error}"));
            line.expect("words that are understood").arguments
        }

        #[test]
        fn the_words_ask_for_what_the_window_shows() {
            let world = world();
            let document = document(&world);
            let still = FinalRender { size: [320, 180], ..FinalRender::default() };
            let asked = arguments(still, &document, &world, "a.png");
            let camera = asked.camera(&world, &mut Notices::default()).expect("sound");
            let shown = document.view(320, 180).expect("a viewpoint");
            let [of_asked, of_shown] = [&camera, &shown.camera].map(|it| it.world_from_camera);
            assert!(of_asked.abs_diff_eq(of_shown, 1e-4), "{of_asked:?} {of_shown:?}");
            assert_eq!(camera.lens_radius, 0.0625);
            assert!((camera.focus_distance - 3.0).abs() < 1e-5);
            let view = asked.view(&world, shown.camera.clone());
            let learning_paths = shown.learning_paths;
            let round = |medium: Option<Medium>| format!("{:.4?}", medium);
            assert_eq!(round(view.medium), round(shown.medium));
            let background = shown.background;
            assert!(View { learning_paths, background, medium: shown.medium, ..view } == shown);
            assert!(
                matches!(asked.background, Some(Background::Blurred(r)) if (r - 0.25).abs() < 1e-6)
            );
            let options = asked.environment_options();
            assert!((options.rotation_radians - 33.5_f32.to_radians()).abs() < 1e-6);
            assert_eq!((options.intensity, options.sun, asked.map()), (0.5, 2.0, "sky:night"));
            assert_eq!(asked.stop_rule(), document.stop);
            assert_eq!(asked.device, DeviceChoice::Cpu);
            let picture = format!("{:?}", asked.picture);
            for part in [
                "Stops(-1.5)",
                "Neutral",
                "Lut(look:warm)), look_strength: 0.5",
                "ATrous",
                "kelvin: 4000.0, tint: -0.25",
            ] {
                assert!(picture.contains(part), "{part}: {picture}");
            }
            let SceneOptions { hide, .. } = asked.of_scene.options();
            assert_eq!(hide, ["a b"]);
            let wall = &world.scene.materials[0].name;
            // Another material has the name of the second one.
            let edits = [format!("{wall}:roughness=0.25"), "2:roughness=0.75".to_owned()];
            assert_eq!(asked.of_scene.edits(), edits);
            let lamps = ["Key:factor=0.5", "it's: fill:factor=0.125"];
            assert_eq!(asked.of_scene.lamp_edits(), lamps);
        }

        #[test]
        fn cameras_turn_as_the_window_says() {
            let world = world();
            let viewpoint = Viewpoint {
                fov_y_degrees: None,
                half_height: 2.0,
                ..document(&world).viewpoint.expect("there is one")
            };
            let document = Document { viewpoint: Some(viewpoint), ..Document::default() };
            let of = |motion, to| {
                let render = FinalRender { motion, frames: 12, ..FinalRender::default() };
                arguments(render, &document, &world, to)
            };
            let orbit = of(Motion::Orbit, "a.png");
            assert_eq!((orbit.turntable, orbit.about), (Some(12), None));
            assert!(orbit.outputs[0].ends_with("a.####.png"), "{:?}", orbit.outputs);
            let camera = orbit.camera(&world, &mut Notices::default()).expect("sound");
            assert_eq!(camera.projection, Projection::Orthographic { half_height: 2.0 });
            let look = of(Motion::LookAround, "a.mp4");
            assert_eq!((look.turntable, look.about), (Some(12), look.place.eye));
            assert!(look.outputs[0].ends_with("a.mp4"), "{:?}", look.outputs);
            let still = of(Motion::Still, "a.exr");
            assert_eq!((still.turntable, still.about), (None, None));
        }
    }
}
