//! Summaries of all runs of a row: the report's data.

use serde::Serialize;

use super::bias::Bias;
use super::measure::{Memory, Point, Run};
use super::plan::{Device, Method, Plan, Row};
use super::reference::{Noise, ReferenceFacts};
use super::shares::Shares;
use super::statistics::{Bundle, Curve, Estimate, SpeedUp, power_law_slope};
use crate::image::Image;

/// A measure of error that falls with time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Relative MSE without the worst 0.1 % of the pixels: speed-ups are computed from it.
    TrimmedRelMse,
    /// Relative mean squared error.
    RelMse,
    /// Mean squared error.
    Mse,
    /// Trimmed relMSE of the means of 8x8 pixels.
    Blocks,
    /// Mean LDR-FLIP.
    Flip,
    /// That of the denoised picture.
    DenoisedFlip,
}

impl Measure {
    /// All of them, the one of speed-ups first.
    pub const ALL: [Self; 6] = [
        Self::TrimmedRelMse,
        Self::RelMse,
        Self::Mse,
        Self::Blocks,
        Self::Flip,
        Self::DenoisedFlip,
    ];

    /// Its name on the page.
    pub fn title(self) -> &'static str {
        match self {
            Self::TrimmedRelMse => "trimmed relMSE",
            Self::RelMse => "relMSE",
            Self::Mse => "MSE",
            Self::Blocks => "8x8 blocks",
            Self::Flip => "FLIP",
            Self::DenoisedFlip => "denoised FLIP",
        }
    }

    /// Its value at a moment of a run; `None` before there is a reference.
    pub fn of(self, point: &Point) -> Option<f64> {
        let errors = point.errors?;
        match self {
            Self::TrimmedRelMse => Some(errors.trimmed_rel_mse),
            Self::RelMse => Some(errors.rel_mse),
            Self::Mse => Some(errors.mse),
            Self::Blocks => Some(errors.block_rel_mse),
            Self::Flip => errors.flip,
            Self::DenoisedFlip => point.denoised_flip,
        }
    }
}

/// Mean LDR-FLIP of denoised pictures that people call a draft, a preview and clean.
pub(super) const CLEAN_FLIP: [f64; 3] = [0.10, 0.07, 0.05];

/// A whole report so far.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The plan.
    pub plan: Plan,
    /// The machine.
    pub machine: super::machine::Machine,
    /// Rows in order, as far as they are begun.
    pub rows: Vec<RowReport>,
    /// Whether nothing is missing.
    pub is_finished: bool,
}

/// One scene under one map.
#[derive(Debug, Default, Serialize)]
pub struct RowReport {
    /// Scene and map.
    pub row: Row,
    /// Notices of loading.
    pub notices: Vec<String>,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Columns and rows of the map.
    pub map_size: (u32, u32),
    /// The reference that errors were computed against.
    pub reference: Option<ReferenceReport>,
    /// An entry for each device.
    pub devices: Vec<DeviceReport>,
    /// Sources of the remaining error, by method.
    pub shares: Vec<Shares>,
    /// Biases of the methods.
    pub biases: Vec<Bias>,
    /// The reference and, by device and method, pictures of the first seed at the end.
    #[serde(skip)]
    pub pictures: Pictures,
}

/// Pictures of a row.
#[derive(Debug, Default)]
pub struct Pictures {
    /// The reference.
    pub reference: Option<Image>,
    /// Device, method, picture.
    pub runs: Vec<(Device, String, Image)>,
}

/// How good the reference is.
#[derive(Debug, Clone, Serialize)]
pub struct ReferenceReport {
    /// The file, if it was given.
    pub file: Option<String>,
    /// How it was made, if it was made here.
    pub facts: Option<ReferenceFacts>,
    /// Its own expected squared error; unknown for a file and a single run.
    pub noise: Option<Noise>,
    /// That noise over the smallest mean error, both as trimmed relMSE.
    pub share: Option<f64>,
    /// Whether that is at most the share that was asked for.
    pub is_good: bool,
}

/// A row on one device.
#[derive(Debug, Serialize)]
pub struct DeviceReport {
    /// The device.
    pub device: Device,
    /// Processor or adapter.
    pub name: String,
    /// Why there are no figures.
    pub not_measured: Option<String>,
    /// An entry for each method.
    pub methods: Vec<MethodReport>,
}

/// A method on a row and device.
#[derive(Debug, Serialize)]
pub struct MethodReport {
    /// The method.
    pub method: Method,
    /// At the end, mean over runs with its standard error, by measure.
    pub errors: Vec<(Measure, Estimate)>,
    /// Seconds to denoised pictures of FLIP 0.10, 0.07 and 0.05, and whether the first picture was as good; `None`
    /// where the last one is not.
    pub clean_seconds: [Option<(f64, bool)>; 3],
    /// Mean of the picture over the reference's.
    pub mean_ratio: Option<Estimate>,
    /// Power of the rendering time that the error falls with, by measure; FLIP is no power law.
    pub slopes: Vec<(Measure, Estimate)>,
    /// Against each baseline of the plan, by measure.
    pub speed_ups: Vec<(String, Measure, SpeedUp)>,
    /// Ratio of error times rendering time over the first baseline, without the time of learning and tables.
    pub without_learning: Option<f64>,
    /// Durations and counts.
    pub costs: Costs,
    /// Maximum memory over the runs.
    pub memory: Memory,
    /// Every run.
    pub runs: Vec<Run>,
}

/// Means over runs.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Costs {
    /// Seconds of tracing learning paths.
    pub learn_seconds: f64,
    /// Seconds of building the map's table and the distributions.
    pub table_seconds: f64,
    /// Seconds of rendering spent on ray casts; unknown on a GPU.
    pub ray_seconds: Option<f64>,
    /// Seconds of rendering.
    pub render_seconds: f64,
    /// Rays per camera path, shadow rays included.
    pub rays_per_sample: f64,
    /// Samples per pixel at the end.
    pub samples: f64,
    /// Camera paths learned from.
    pub learning_paths: u64,
    /// Cells with a distribution of their own.
    pub learned_cells: f64,
}

/// With more methods than this a row shows ratios instead of curves and pictures.
const MAX_CURVES: usize = 7;

impl Report {
    /// Whether it has too many methods for curves.
    pub(super) fn is_long(&self) -> bool {
        self.plan.methods.len() > MAX_CURVES
    }

    /// Names of the methods that others are compared with.
    fn baselines(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.plan.baselines.iter().map(|index| self.plan.methods[*index].name.as_str())
    }

    /// The first baseline.
    pub(super) fn baseline(&self) -> &str {
        self.baselines().next().unwrap_or_default()
    }

    /// The last baseline, which ablations are compared with.
    pub(super) fn last_baseline(&self) -> &str {
        self.baselines().next_back().unwrap_or_default()
    }

    /// All baselines but the first.
    pub(super) fn other_baselines(&self) -> impl Iterator<Item = &str> {
        self.baselines().skip(1)
    }

    /// Names of all methods but the first baseline.
    pub(super) fn other_methods(&self) -> impl Iterator<Item = &str> {
        self.plan.methods.iter().map(|m| m.name.as_str()).filter(|name| *name != self.baseline())
    }

    /// The GPU's name, if one was measured.
    pub(super) fn gpu_name(&self) -> Option<&str> {
        let mut devices = self.rows.iter().flat_map(|row| &row.devices);
        devices.find(|device| device.device == Device::Gpu).map(|device| device.name.as_str())
    }

    /// Titles of the rows whose reference is too noisy.
    pub(super) fn noisy_references(&self) -> String {
        let is_noisy = |row: &&RowReport| row.reference.as_ref().is_some_and(|r| !r.is_good);
        let titles: Vec<&str> =
            self.rows.iter().filter(is_noisy).map(|row| row.row.title.as_str()).collect();
        titles.join("; ")
    }
}

impl RowReport {
    /// The speed-up of `adaptive`, and what it would be if its first vertex, or its later vertices, had
    /// no noise; `None` without the shares of its error.
    pub(super) fn bounds(&self, device: &DeviceReport, baseline: &str) -> Option<(f64, f64, f64)> {
        let shares = self.shares.iter().find(|s| s.method == "adaptive")?;
        let ratio = device.adaptive_speed_up(baseline)?.ratio;
        let total = shares.total;
        let without = |part: f64| ratio * total / (total - part).max(1e-3 * total);
        Some((ratio, without(shares.first_vertex), without(shares.later_vertices)))
    }
}

impl Costs {
    /// Million rays per second of rendering a picture of this size.
    pub(super) fn mega_rays_per_second(&self, (width, height): (u32, u32)) -> f64 {
        let rays = self.rays_per_sample * self.samples * f64::from(width) * f64::from(height);
        rays / self.render_seconds.max(1e-9) / 1e6
    }
}

impl MethodReport {
    /// Slope of the error over time.
    pub(super) fn slope(&self, measure: Measure) -> Option<Estimate> {
        self.slopes.iter().find(|(m, _)| *m == measure).map(|(_, slope)| *slope)
    }

    /// The last point of the first run.
    pub(super) fn last_point(&self) -> Option<&Point> {
        self.runs.first()?.points.last()
    }

    /// Mean error at the end.
    pub fn error(&self, measure: Measure) -> Option<Estimate> {
        self.errors.iter().find(|(m, _)| *m == measure).map(|(_, e)| *e)
    }

    /// Speed-up over a baseline.
    pub fn speed_up(&self, baseline: &str, measure: Measure) -> Option<SpeedUp> {
        let is_it = |(b, m, _): &&(String, Measure, SpeedUp)| b == baseline && *m == measure;
        self.speed_ups.iter().find(is_it).map(|(.., speed_up)| *speed_up)
    }
}

impl DeviceReport {
    /// A method by its name.
    pub fn method(&self, name: &str) -> Option<&MethodReport> {
        self.methods.iter().find(|m| m.method.name == name)
    }

    /// Methods with a run.
    pub(super) fn measured(&self) -> impl Iterator<Item = &MethodReport> {
        self.methods.iter().filter(|m| !m.runs.is_empty())
    }

    /// Whether the time of rays is known.
    pub(super) fn has_ray_seconds(&self) -> bool {
        self.methods.iter().any(|m| m.costs.ray_seconds.is_some())
    }

    /// Speed-up of `adaptive`, the method that targets are set for.
    pub(super) fn adaptive_speed_up(&self, baseline: &str) -> Option<SpeedUp> {
        self.method("adaptive")?.speed_up(baseline, Measure::TrimmedRelMse)
    }
}

/// Curves of error against time, of the runs whose errors are known.
pub(super) fn curves(runs: &[Run], measure: Measure) -> Vec<Curve> {
    let error = |run: &Run| {
        let point = |p: &Point| Some((p.seconds, measure.of(p)?));
        run.points.iter().map(point).collect::<Option<Vec<_>>>()
    };
    runs.iter().filter_map(error).map(|points| Curve { points }).collect()
}

/// Summaries of all methods of a row on one device; `runs` holds each method's runs.
pub(super) fn summarise(plan: &Plan, threads: usize, runs: Vec<Vec<Run>>) -> Vec<MethodReport> {
    let bundles: Vec<[Option<Bundle>; Measure::ALL.len()]> = runs
        .iter()
        .map(|runs| Measure::ALL.map(|m| Bundle::new(&curves(runs, m), plan.effort.seconds)))
        .collect();
    // Error times rendering time at the end.
    let product = |run: &Run| {
        let last = run.points.last()?;
        Some(last.errors?.trimmed_rel_mse * last.render_seconds)
    };
    let efficiencies: Vec<_> = runs.iter().map(|runs| estimate(runs, product)).collect();
    let speed_ups = |index: usize| {
        let mut found = Vec::new();
        for &baseline in plan.baselines.iter().filter(|b| **b != index) {
            for (m, measure) in Measure::ALL.into_iter().enumerate() {
                let pair = bundles[baseline][m].as_ref().zip(bundles[index][m].as_ref());
                if let Some(speed_up) = pair.and_then(|(b, a)| SpeedUp::new(b, a)) {
                    found.push((plan.methods[baseline].name.clone(), measure, speed_up));
                }
            }
        }
        found
    };
    let summary = |(index, (runs, method)): (usize, (Vec<Run>, &Method))| {
        let bundle = |measure: Measure| bundles[index][measure as usize].as_ref();
        let error = |m: Measure| Some((m, (*bundle(m)?.estimates().last()?)?));
        // FLIP has no power law.
        let power_laws = [Measure::TrimmedRelMse, Measure::RelMse, Measure::Mse, Measure::Blocks];
        let power = |m: Measure| Some((m, estimate(&runs, |run| slope(run, m))?));
        let clean = |denoised: &Bundle| CLEAN_FLIP.map(|flip| denoised.seconds_to(flip));
        let efficiency = efficiencies[plan.baselines[0]].zip(efficiencies[index]);
        MethodReport {
            method: method.clone(),
            errors: Measure::ALL.into_iter().filter_map(error).collect(),
            clean_seconds: bundle(Measure::DenoisedFlip).map_or([None; 3], clean),
            mean_ratio: estimate(&runs, |run| Some(run.points.last()?.errors?.mean_ratio)),
            slopes: power_laws.into_iter().filter_map(power).collect(),
            speed_ups: speed_ups(index),
            without_learning: efficiency.map(|(baseline, own)| baseline.mean / own.mean),
            costs: costs(&runs, threads),
            memory: max_memory(&runs),
            runs,
        }
    };
    runs.into_iter().zip(&plan.methods).enumerate().map(summary).collect()
}

fn estimate(runs: &[Run], value: impl Fn(&Run) -> Option<f64>) -> Option<Estimate> {
    Estimate::of(&runs.iter().filter_map(value).collect::<Vec<_>>())
}

/// A slope is fitted to the points from this share of the rendering time and this many samples on, where the
/// error follows a power law.
const SLOPE_FROM: (f64, u32) = (1.0 / 16.0, 4);

fn slope(run: &Run, measure: Measure) -> Option<f64> {
    let end = run.points.last()?.render_seconds;
    let is_late = |p: &&Point| p.samples >= SLOPE_FROM.1 && p.render_seconds >= SLOPE_FROM.0 * end;
    let place = |p: &Point| Some((p.render_seconds, measure.of(p)?));
    let points: Vec<(f64, f64)> = run.points.iter().filter(is_late).filter_map(place).collect();
    if points.len() < 3 { None } else { power_law_slope(&points) }
}

fn costs(runs: &[Run], threads: usize) -> Costs {
    let count = runs.len().max(1) as f64;
    let mean = |value: &dyn Fn(&Run) -> f64| runs.iter().map(value).sum::<f64>() / count;
    let nanoseconds = runs.iter().find_map(|run| run.nanoseconds_per_ray);
    let render_seconds = mean(&|r| r.figures.render_seconds);
    let rays = mean(&|r| r.figures.rays as f64);
    Costs {
        learn_seconds: mean(&|r| r.figures.learning_seconds - r.figures.distribution_seconds),
        table_seconds: mean(&|r| r.table_seconds + r.figures.distribution_seconds),
        ray_seconds: nanoseconds.map(|ns| (ns * 1e-9 * rays / threads as f64).min(render_seconds)),
        render_seconds,
        rays_per_sample: rays / mean(&|r| r.figures.samples as f64).max(1.0),
        samples: mean(&|r| r.points.last().map_or(0.0, |p| f64::from(p.samples))),
        learning_paths: runs.first().map_or(0, |r| r.figures.learning_paths),
        learned_cells: mean(&|r| r.figures.learned_cells as f64),
    }
}

fn max_memory(runs: &[Run]) -> Memory {
    runs.iter().fold(Memory::default(), |most, run| Memory {
        table_bytes: most.table_bytes.max(run.memory.table_bytes),
        bvh_bytes: most.bvh_bytes.max(run.memory.bvh_bytes),
        grid_peak_bytes: most.grid_peak_bytes.max(run.memory.grid_peak_bytes),
        grid_bytes: most.grid_bytes.max(run.memory.grid_bytes),
        device_bytes: most.device_bytes.max(run.memory.device_bytes),
    })
}
