//! What is to be rendered and how.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::filter::PixelFilter;
use crate::light_grid::{DistributionOptions, LightGrid};
use crate::medium::Fog;
use crate::path::camera::CameraRays;
use crate::path::{Background, LightChoice, Lit, LocalLights, PathLimits, PathTracer, World};
use crate::sampler::Points;
use crate::scene::{Camera, Medium};

/// How the environment map is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Learned tiles, our way: faces, cosine, pooling; with BSDF sampling.
    #[default]
    Adaptive,
    /// Learned tiles as the talk describes them; with BSDF sampling.
    Talk,
    /// The whole map; with BSDF sampling.
    Plain,
    /// BSDF sampling alone.
    Bsdf,
}

impl fmt::Display for Sampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// How light that has met several surfaces is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gi {
    /// Paths are followed to their end: no error but noise.
    #[default]
    Exact,
    /// Paths end where a radiance cache knows what they would find: less noise, and a few percent of error that stays.
    Cached,
}

/// Whether neighbouring pixels share their second vertices ([`crate::path::sharing`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sharing {
    /// As it suits the scene, the way the map is sampled and the size of the picture.
    #[default]
    Auto,
    /// Each path is one pixel's.
    Off,
    /// In tiles of 4x4 pixels, all of which keep their own: less of the noise is shared.
    #[serde(rename = "4x4")]
    Small,
    /// In tiles of 8x8 pixels, of which every fourth keeps its own.
    #[serde(rename = "8x8")]
    Large,
}

/// One learning path for this many paths rendered.
const LEARNING_SHARE: u64 = 64;
/// The same where each vertex tries several samples of the map: such a path takes four times as long.
const ADAPTIVE_LEARNING_SHARE: u64 = 96;

/// What is to be rendered and how. Equal views give equal pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Where from.
    pub camera: Camera,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixel filter.
    pub filter: PixelFilter,
    /// How the map is sampled.
    pub sampling: Sampling,
    /// When paths end.
    pub limits: PathLimits,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Whether pixels share their second vertices.
    pub sharing: Sharing,
    /// How light that has met several surfaces is found.
    pub gi: Gi,
    /// Which points samples are taken at; learning always takes [`Points::Sobol`].
    pub points: Points,
    /// Light Grid cells around the horizon; half as many from top to bottom.
    pub grid_columns: u32,
    /// Camera paths to learn from.
    pub learning_paths: u64,
    /// How counters become distributions in [`Sampling::Adaptive`].
    pub distributions: DistributionOptions,
    /// What fills the space between surfaces, in place of the scene's own medium; `None` keeps that,
    /// and a medium that is all zero is clear air.
    pub medium: Option<Medium>,
    /// Which lights inside the scene count.
    pub local_lights: LightChoice,
    /// What the camera sees where it sees no surface.
    pub background: Background,
    /// The part of a larger picture that this one is; `None` is the whole.
    pub crop: Option<Crop>,
    /// Whether albedo, normal and depth are kept.
    pub layers: bool,
}

/// Where a part lies in the whole picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crop {
    /// Column and row of the part's first pixel.
    pub corner: [u32; 2],
    /// Width and height of the whole.
    pub whole: [u32; 2],
}

impl View {
    /// Most pixels of a picture: 40 bytes each stay under 5.4 GB.
    pub const MAX_PIXELS: u64 = 1 << 27;

    /// How many pixels it has.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The same in so many pixels, at least one each way.
    pub fn of_size(&self, width: u32, height: u32) -> Self {
        let mut view = Self { width: width.max(1), height: height.max(1), ..self.clone() };
        let (new, old) = ([view.width, view.height], [self.width, self.height]);
        let scaled = |pixels: [u32; 2]| {
            [0, 1].map(|i| {
                (u64::from(pixels[i]) * u64::from(new[i]) / u64::from(old[i].max(1))) as u32
            })
        };
        if let Some(Crop { corner, whole }) = &mut view.crop {
            *corner = scaled(*corner);
            *whole = scaled(*whole).map(|pixels| pixels.max(1));
        }
        view
    }

    /// What `lightgrid render` takes where nothing else is asked for.
    pub fn new(camera: Camera, [width, height]: [u32; 2]) -> Self {
        let sampling = Sampling::default();
        Self {
            camera,
            width,
            height,
            filter: PixelFilter::default(),
            sampling,
            limits: PathLimits::default(),
            seed: 0,
            sharing: Sharing::default(),
            gi: Gi::default(),
            points: Points::Sobol,
            grid_columns: 64,
            learning_paths: Self::suitable_learning_paths(sampling, [width, height], None),
            distributions: DistributionOptions::ADAPTIVE,
            medium: None,
            local_lights: LightChoice::All,
            background: Background::default(),
            crop: None,
            layers: false,
        }
    }

    /// How counters become distributions; `None` if nothing is learned.
    pub fn distribution_options(&self) -> Option<DistributionOptions> {
        match self.sampling {
            Sampling::Adaptive => Some(self.distributions),
            Sampling::Talk => Some(DistributionOptions::TALK),
            Sampling::Plain | Sampling::Bsdf => None,
        }
    }

    /// Learning paths that suit a picture of this size and sample count: a twentieth of the time that
    /// rendering takes. Where rendered paths count too, and a vertex tries several samples, few are
    /// enough to begin with.
    pub fn suitable_learning_paths(
        sampling: Sampling,
        [width, height]: [u32; 2],
        samples: Option<u32>,
    ) -> u64 {
        let work = u64::from(width) * u64::from(height) * u64::from(samples.unwrap_or(256));
        if sampling == Sampling::Adaptive {
            (work / ADAPTIVE_LEARNING_SHARE).clamp(1 << 9, 1 << 16)
        } else {
            (work / LEARNING_SHARE).clamp(1 << 16, 1 << 20)
        }
    }

    /// Width and height of the picture that this one is a part of.
    pub fn whole_size(&self) -> [u32; 2] {
        self.crop.map_or([self.width, self.height], |crop| crop.whole)
    }

    /// The camera's rays through this picture.
    pub fn rays(&self) -> CameraRays {
        match self.crop {
            None => CameraRays::new(&self.camera, self.width, self.height),
            Some(Crop { corner, whole: [width, height] }) => {
                let whole = CameraRays::new(&self.camera, width, height);
                whole.cropped(corner, [self.width, self.height])
            }
        }
    }

    /// What follows its paths by these distributions; it counts nothing, and no path ends in a cache.
    pub(crate) fn tracer<'a>(&self, lit: Lit<'a>, grid: Option<&'a LightGrid>) -> PathTracer<'a> {
        let (world, environment) = lit;
        PathTracer {
            world,
            environment,
            lights: &world.lights,
            grid,
            counts: None,
            cache: None,
            fog: self.fog(world),
            background: self.background,
            limits: self.limits,
            layers: self.layers,
        }
    }

    /// The lights inside the scene that count; `None` are all.
    pub(crate) fn chosen_lights(&self, world: &World) -> Option<LocalLights> {
        let some = self.local_lights != LightChoice::All;
        some.then(|| LocalLights::new(&world.scene, world.bvh.bounds(), &self.local_lights))
    }

    /// The medium that is rendered, in its box; `None` in clear air.
    pub fn fog(&self, world: &World) -> Option<Fog> {
        Fog::new(&self.medium.or(world.scene.medium)?, world.bvh.bounds())
    }
}
