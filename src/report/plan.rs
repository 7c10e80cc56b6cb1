//! Plans of measurements: rows of scene and map, methods, devices, and durations.

use std::path::PathBuf;

use serde::Serialize;

use crate::environment::{EnvironmentOptions, TableKind};
use crate::light_grid::DistributionOptions;
use crate::path::PathLimits;
use crate::render::filter::PixelFilter;
use crate::render::{Gi, Sampling, Sharing, View};
use crate::sampler::Points;
use crate::scene::Camera;

/// Minimum number of pictures of a reference, whose spread estimates its noise.
pub(super) const MIN_PICTURES: u32 = 8;

/// A device to measure on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Device {
    /// All threads.
    Cpu,
    /// The best adapter, which may be a software one.
    Gpu,
}

impl Device {
    /// `CPU` or `GPU`.
    pub fn title(self) -> &'static str {
        if self == Self::Cpu { "CPU" } else { "GPU" }
    }
}

with_defaults! {
    /// Settings that change how fast a picture converges, but not its limit (except a cache's bias).
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct Settings {
        /// How the map is sampled.
        pub sampling: Sampling = Sampling::default(),
        /// How counters become distributions in [`Sampling::Adaptive`].
        pub distributions: DistributionOptions = DistributionOptions::ADAPTIVE,
        /// Importance table.
        pub table: TableKind = TableKind::default(),
        /// Columns and rows of tiles.
        pub tiles: (u32, u32) =
            (EnvironmentOptions::default().tile_columns, EnvironmentOptions::default().tile_rows),
        /// Light Grid cells around the horizon.
        pub grid_columns: u32 = 64,
        /// Whether pixels share their second vertices.
        pub sharing: Sharing = Sharing::default(),
        /// How indirect light is found.
        pub gi: Gi = Gi::default(),
        /// Camera paths to learn from; `None` for the default of the picture's size.
        pub learning_paths: Option<u64> = None,
        /// Point set of the samples.
        pub points: Points = Points::default(),
        /// Whether Russian roulette ends dim paths.
        pub russian_roulette: bool = true,
    }
}

impl Settings {
    /// The settings of `lightgrid render --sampling`.
    pub fn of(sampling: Sampling) -> Self {
        Self { sampling, ..Self::default() }
    }

    /// Options of the map's importance table.
    pub(super) fn environment(&self) -> EnvironmentOptions {
        EnvironmentOptions {
            table: self.table,
            tile_columns: self.tiles.0,
            tile_rows: self.tiles.1,
            ..EnvironmentOptions::default()
        }
    }

    /// The view of a picture of this size.
    pub(super) fn view(&self, camera: &Camera, frame: &Frame, seed: u32) -> View {
        let (width, height) = frame.size;
        View {
            filter: PixelFilter::Box,
            sampling: self.sampling,
            limits: PathLimits { bounces: frame.bounces, russian_roulette: self.russian_roulette },
            seed,
            points: self.points,
            grid_columns: self.grid_columns,
            sharing: self.sharing,
            gi: self.gi,
            learning_paths: self.learning_paths.unwrap_or_else(|| {
                View::suitable_learning_paths(self.sampling, [width, height], None)
            }),
            distributions: self.distributions,
            // The denoiser reads them.
            layers: true,
            ..View::new(camera.clone(), [width, height])
        }
    }
}

/// A named method of rendering.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Method {
    /// Short, unique within its row.
    pub name: String,
    /// Its group in a table of ablations.
    pub group: Option<&'static str>,
    /// The settings.
    pub settings: Settings,
}

impl Method {
    /// A sampling mode with its name on the command line.
    pub fn of(sampling: Sampling) -> Self {
        Self { name: sampling.to_string(), group: None, settings: Settings::of(sampling) }
    }

    /// The same method with this way of finding indirect light.
    pub fn with_gi(self, gi: Gi) -> Self {
        let name = if gi == Gi::Cached { format!("{} cached", self.name) } else { self.name };
        Self { name, settings: Settings { gi, ..self.settings }, ..self }
    }
}

/// The picture's size and bounces, the same for all methods.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Frame {
    /// Pixels per row, and rows.
    pub size: (u32, u32),
    /// Maximum number of vertices, on surfaces or in a medium, that scatter light; 1 is direct light only.
    pub bounces: u32,
}

/// A scene under a map.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Row {
    /// Its title.
    pub title: String,
    /// A file or a built-in.
    pub scene: String,
    /// A file or a built-in sky.
    pub map: String,
    /// Speed-up in the talk on CPU and GPU.
    pub published: Option<[f64; 2]>,
    /// Target for the speed-up of `adaptive` over `plain`.
    pub target: Option<f64>,
}

impl Row {
    /// A row without published figures or a target.
    pub fn new(scene: &str, map: &str) -> Self {
        Self {
            title: format!("{scene} / {map}"),
            scene: scene.to_owned(),
            map: map.to_owned(),
            ..Self::default()
        }
    }

    /// Speed-up in the talk on a device.
    pub(super) fn published_on(&self, device: Device) -> Option<f64> {
        self.published.map(|of_devices| of_devices[device as usize])
    }
}

/// How much work goes into a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effort {
    /// The devices.
    pub devices: Vec<Device>,
    /// The picture's size and bounces.
    pub frame: Frame,
    /// Seconds of tables, learning and rendering of one run.
    pub seconds: f64,
    /// Independent runs of every combination.
    pub seeds: u32,
    /// Maximum noise of the reference, as a share of the smallest error.
    pub reference_noise: f64,
}

impl Effort {
    /// The devices in words.
    pub(super) fn device_names(&self) -> String {
        self.devices.iter().map(|d| d.title()).collect::<Vec<_>>().join(" and ")
    }
}

/// A whole report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Title of the page.
    pub title: &'static str,
    /// Introduction of the page, by paragraph.
    pub introduction: &'static [&'static str],
    /// Differences between the published measurements and ours.
    pub differences: &'static [&'static str],
    /// Scenes and maps.
    pub rows: Vec<Row>,
    /// The methods that are compared on every row.
    pub methods: Vec<Method>,
    /// Indices of the methods that the others are compared with, each in a column of its own.
    pub baselines: Vec<usize>,
    /// Devices, durations and numbers of runs.
    pub effort: Effort,
    /// A picture to be taken as the reference of the only row.
    pub reference: Option<PathBuf>,
    /// The command line that makes this report.
    pub command: String,
}

impl Plan {
    /// Expected seconds of the whole plan: runs, references, sources of error, overhead.
    pub fn expected_seconds(&self) -> f64 {
        self.rows.len() as f64 * self.expected_row_seconds()
    }

    /// Expected seconds of a row.
    pub(super) fn expected_row_seconds(&self) -> f64 {
        let runs = self.methods.len() * self.effort.devices.len() * self.effort.seeds as usize;
        let pictures = (1.0 / self.effort.reference_noise).max(f64::from(MIN_PICTURES));
        let reference = if self.reference.is_some() { 0.0 } else { pictures };
        let shares = SHARE_RUNS * self.compared().len() as f64;
        (runs as f64 + reference + shares) * self.effort.seconds * OVERHEAD
    }

    /// Methods whose error is split by its sources: the sampling modes with default settings.
    pub(super) fn compared(&self) -> Vec<&Method> {
        let is_mode = |m: &&Method| m.settings == Settings::of(m.settings.sampling);
        self.methods.iter().filter(is_mode).collect()
    }
}

/// Duration of splitting one method's error by its sources, in durations of a run.
pub(super) const SHARE_RUNS: f64 = 1.5;

/// Ratio of the total time to that of runs: loading, building, denoising, comparing, writing, and passes that end late.
/// *Measured* on two cores.
const OVERHEAD: f64 = 1.25;
