//! What is written about a run: metadata in pictures, figures in JSON.

use std::io::Write as _;
use std::path::Path;

use glam::Vec3;
use serde::Serialize;
use serde_json::{Value, json};

use crate::environment::Environment;
use crate::error::{Error, Notices, Result};
use crate::image::write_beside_and_rename;
use crate::medium::Fog;
use crate::path::World;
use crate::render::film::Film;
use crate::render::gpu::GpuFigures;
use crate::render::{Figures, View};
use crate::scene::{Projection, in_digits};

/// Seconds before the session starts.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Phases {
    /// Reading the scene.
    pub load_scene_seconds: f64,
    /// Building its BVH and light tables.
    pub build_bvh_seconds: f64,
    /// Reading the map.
    pub load_map_seconds: f64,
    /// Building its importance table.
    pub build_table_seconds: f64,
}

/// Everything there is to say about a run.
pub struct Record<'a> {
    /// Name or path of the scene.
    pub scene: &'a str,
    /// Name or path of the map.
    pub map: &'a str,
    /// The scene.
    pub world: &'a World,
    /// The map.
    pub environment: &'a Environment,
    /// The picture.
    pub film: &'a Film,
    /// What was done for it.
    pub figures: &'a Figures,
    /// Seconds that a picture by cached light has taken beside it.
    pub cached_seconds: f64,
    /// The device, if it was not the CPU.
    pub gpu: Option<GpuFigures>,
    /// What was done before.
    pub phases: &'a Phases,
    /// What was said about it.
    pub notices: &'a Notices,
    /// Whether pictures say how long they took.
    pub with_times: bool,
    /// Settings by name.
    pub options: Vec<(&'static str, Value)>,
}

impl Record<'_> {
    /// Name of what rendered last.
    fn device(&self) -> &str {
        self.gpu.as_ref().map_or("CPU", |gpu| &gpu.adapter.name)
    }

    fn seconds(&self) -> f64 {
        self.figures.elapsed_seconds() + self.cached_seconds
    }

    /// Key and value pairs for pictures: scene, map, settings, samples, seconds.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let own = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", self.scene.to_owned()),
            ("map", self.map.to_owned()),
            ("samples_per_pixel", self.film.min_samples().to_string()),
            ("device", self.device().to_owned()),
        ];
        let seconds = self.with_times.then(|| ("seconds", format!("{:.3}", self.seconds())));
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let options = self.options.iter().map(|(key, value)| (*key, text(value)));
        let pairs = own.into_iter().chain(seconds).chain(options);
        // A prefix keeps clear of the names that OpenEXR reserves.
        pairs.map(|(key, text)| (format!("lightgrid.{key}"), text)).collect()
    }

    /// The figures of `--json`.
    pub fn to_json(&self) -> Value {
        let film = self.film;
        let figures = self.figures;
        let memory = self.environment.memory_bytes();
        let noise = figures.noise_of(film);
        json!({
            "software": concat!("lightgrid ", env!("CARGO_PKG_VERSION")),
            "scene": self.scene,
            "map": self.map,
            "size": [film.width, film.height],
            "settings": self.options.iter().cloned().map(|(k, v)| (k.to_owned(), v))
                .collect::<serde_json::Map<_, _>>(),
            "triangles": self.world.scene.shown_triangles(),
            "samples_per_pixel": film.min_samples(),
            "noise": noise.is_finite().then_some(noise),
            "invalid_samples": film.invalid_samples(),
            "phases": self.phases,
            "session": figures,
            "cached_seconds": self.cached_seconds,
            "seconds": self.seconds(),
            "rays_per_sample": figures.rays as f64 / figures.samples.max(1) as f64,
            "rays_per_second": figures.rays as f64 / figures.render_seconds.max(1e-9),
            "memory": {
                "map_pixels_bytes": memory.pixels,
                "map_table_bytes": memory.table,
                "bvh_bytes": self.world.bvh.memory_bytes(),
                "grid_bytes": figures.grid_bytes,
                "grid_peak_bytes": figures.grid_peak_bytes,
            },
            "threads": rayon::current_num_threads(),
            "simd": self.world.bvh.simd_name(),
            "device": self.device(),
            "gpu": self.gpu,
            "needs": self.world.needs.by_name(),
            "left_out": self.world.needs.left_out().collect::<Vec<_>>(),
            "notices": self.notices.iter().collect::<Vec<_>>(),
        })
    }
}

/// Settings of a view that belong into metadata and JSON, by name.
pub fn settings_of(view: &View, world: &World) -> Vec<(&'static str, Value)> {
    let camera = &view.camera;
    let frame = world.scene.frame;
    let point = |point: Vec3| json!(frame.point_in_file(point).to_array());
    let fov_degrees = match camera.projection {
        Projection::Perspective { fov_y_radians } => Some(in_digits(fov_y_radians.to_degrees())),
        Projection::Orthographic { .. } => None,
    };
    let fog = view.fog(world).map(|fog| {
        let Fog { interior, bounds: [low, high] } = fog;
        json!({
            // Of the file's metres.
            "scattering": interior.scattering.to_array().map(|it| frame.length(it)),
            "absorption":
                (interior.extinction - interior.scattering).to_array().map(|it| frame.length(it)),
            "anisotropy": interior.phase.mean_cosine(),
            "box": [point(low), point(high)],
        })
    });
    let region = view.crop.map(|crop| [crop.corner, [view.width, view.height]].concat());
    vec![
        ("eye", point(camera.world_from_camera.translation.into())),
        ("target", point(camera.target())),
        ("fov_degrees", json!(fov_degrees)),
        ("lens_radius", json!(in_digits(frame.length_in_file(camera.lens_radius)))),
        ("fog", json!(fog)),
        ("sampling", json!(view.sampling)),
        ("sharing", json!(view.sharing)),
        ("gi", json!(view.gi)),
        ("grid_columns", json!(view.grid_columns)),
        ("bounces", json!(view.limits.bounces)),
        ("russian_roulette", json!(view.limits.russian_roulette)),
        ("filter", json!(view.filter)),
        ("region", json!(region)),
        ("background", json!(view.background)),
        ("seed", json!(view.seed)),
    ]
}

/// Pretty JSON of anything serialisable.
///
/// # Errors
/// If a value has no JSON form.
pub fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(value).map_err(|e| Error::new(format!("JSON: {e}")))
}

/// A JSON value of anything serialisable.
///
/// # Errors
/// If a value has no JSON form.
pub fn to_value(value: &impl Serialize) -> Result<Value> {
    serde_json::to_value(value).map_err(|e| Error::new(format!("JSON: {e}")))
}

/// Writes JSON beside and renames.
///
/// # Errors
/// If the file cannot be written.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = to_json(&to_value(value)?)?;
    write_beside_and_rename(path, |file| writeln!(file, "{text}"))
}
