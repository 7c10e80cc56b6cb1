//! What is to be measured: rows of scene and map, methods, devices, and how long.

use std::path::PathBuf;

use serde::Serialize;

use crate::environment::{EnvironmentOptions, TableKind};
use crate::light_grid::DistributionOptions;
use crate::path::PathLimits;
use crate::render::filter::PixelFilter;
use crate::render::{Gi, Sampling, Sharing, View};
use crate::sampler::Points;
use crate::scene::Camera;

/// Fewest pictures: their spread must be worth something.
pub(super) const MIN_PICTURES: u32 = 8;

/// A device to measure on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Device {
    /// All threads.
    Cpu,
    /// The best adapter, be it a software one.
    Gpu,
}

impl Device {
    /// `CPU` or `GPU`.
    pub fn title(self) -> &'static str {
        match self {
            Self::Cpu => "CPU",
            Self::Gpu => "GPU",
        }
    }
}

/// All that a way of rendering may differ in without changing what the picture converges to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Settings {
    /// How the map is sampled.
    pub sampling: Sampling,
    /// How counters become distributions in [`Sampling::Adaptive`].
    pub distributions: DistributionOptions,
    /// Importance table.
    pub table: TableKind,
    /// Columns and rows of tiles.
    pub tiles: (u32, u32),
    /// Light Grid cells around the horizon.
    pub grid_columns: u32,
    /// Whether pixels share their second vertices.
    pub sharing: Sharing,
    /// How light that has met several surfaces is found.
    pub gi: Gi,
    /// Camera paths to learn from; `None` for as many as suit the picture.
    pub learning_paths: Option<u64>,
    /// Points samples are taken at.
    pub points: Points,
    /// Whether dim paths are ended at random.
    pub russian_roulette: bool,
}

impl Settings {
    /// What `lightgrid render --sampling` does.
    pub fn of(sampling: Sampling) -> Self {
        let environment = EnvironmentOptions::default();
        Self {
            sampling,
            distributions: DistributionOptions::ADAPTIVE,
            table: environment.table,
            tiles: (environment.tile_columns, environment.tile_rows),
            grid_columns: 64,
            sharing: Sharing::Auto,
            gi: Gi::Exact,
            learning_paths: None,
            points: Points::default(),
            russian_roulette: true,
        }
    }

    /// How the map is turned into a light.
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
            // For the denoiser.
            layers: true,
            ..View::new(camera.clone(), [width, height])
        }
    }
}

/// A named way of rendering.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Method {
    /// Short, unique within its row.
    pub name: String,
    /// What it belongs to in a table of ablations.
    pub group: Option<&'static str>,
    /// The settings.
    pub settings: Settings,
}

impl Method {
    /// One of the sampling modes, called as on the command line.
    pub fn of(sampling: Sampling) -> Self {
        Self { name: sampling.name().to_owned(), group: None, settings: Settings::of(sampling) }
    }

    /// The same with indirect light found like this.
    pub fn with_gi(self, gi: Gi) -> Self {
        let name = match gi {
            Gi::Exact => self.name,
            Gi::Cached => format!("{} cached", self.name),
        };
        Self { name, settings: Settings { gi, ..self.settings }, ..self }
    }
}

/// The picture, which is the same for all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Frame {
    /// Pixels per row, and rows.
    pub size: (u32, u32),
    /// Most vertices, on surfaces or in a medium, that scatter light; 1 is direct light only.
    pub bounces: u32,
}

/// A scene under a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What to call it.
    pub title: String,
    /// A file or a built-in.
    pub scene: String,
    /// A file or a built-in sky.
    pub map: String,
    /// Speed-up in the talk on CPU and GPU.
    pub published: Option<[f64; 2]>,
    /// Speed-up of `adaptive` over `plain` that is asked for.
    pub target: Option<f64>,
}

impl Row {
    /// A row without anything to compare it with.
    pub fn new(scene: &str, map: &str) -> Self {
        Self {
            title: format!("{scene} / {map}"),
            scene: scene.to_owned(),
            map: map.to_owned(),
            published: None,
            target: None,
        }
    }

    /// Speed-up in the talk on a device.
    pub(super) fn published_on(&self, device: Device) -> Option<f64> {
        let [cpu, gpu] = self.published?;
        Some(match device {
            Device::Cpu => cpu,
            Device::Gpu => gpu,
        })
    }
}

/// How much work goes into a plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effort {
    /// Where.
    pub devices: Vec<Device>,
    /// The picture.
    pub frame: Frame,
    /// Seconds of tables, learning and rendering of one run.
    pub seconds: f64,
    /// Independent runs of every combination.
    pub seeds: u32,
    /// The reference's noise may be this share of the smallest error.
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
    pub title: String,
    /// What it is about, paragraph by paragraph.
    pub introduction: Vec<String>,
    /// What must be known to read the published figures beside ours.
    pub differences: Vec<String>,
    /// Scenes and maps.
    pub rows: Vec<Row>,
    /// What is compared, on every row; the first is the baseline.
    pub methods: Vec<Method>,
    /// Methods (by index) that the others are held against, each in a column of its own.
    pub baselines: Vec<usize>,
    /// Where, how long, how often.
    pub effort: Effort,
    /// A picture to be taken as the reference of the only row.
    pub reference: Option<PathBuf>,
    /// How the command is repeated.
    pub command: String,
}

impl Plan {
    /// Seconds that all of it takes, about: runs, references, where error is left, overhead.
    pub fn expected_seconds(&self) -> f64 {
        self.rows.len() as f64 * self.expected_row_seconds()
    }

    /// The same for one row.
    pub(super) fn expected_row_seconds(&self) -> f64 {
        let runs = self.methods.len() * self.effort.devices.len() * self.effort.seeds as usize;
        let pictures = (1.0 / self.effort.reference_noise).max(f64::from(MIN_PICTURES));
        let reference = if self.reference.is_some() { 0.0 } else { pictures };
        let shares = SHARE_RUNS * self.compared().len() as f64;
        (runs as f64 + reference + shares) * self.effort.seconds * OVERHEAD
    }

    /// Methods whose error is taken apart: the sampling modes as they are.
    pub(super) fn compared(&self) -> Vec<&Method> {
        let is_mode = |m: &&Method| m.settings == Settings::of(m.settings.sampling);
        self.methods.iter().filter(is_mode).collect()
    }
}

/// Runs' worth of time that taking one method's error apart costs.
pub(super) const SHARE_RUNS: f64 = 1.5;

/// Loading, building, comparing, writing, and passes that end a little late. *Measured* on two cores.
const OVERHEAD: f64 = 1.1;
