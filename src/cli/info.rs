//! `lightgrid info`.

use serde_json::{Value, json};

use super::choices::SceneArguments;
use crate::environment::sun::Sun;
use crate::error::{Notices, Result};
use crate::image::Image;
use crate::path::World;
use crate::render::gpu::KernelFacts;
use crate::scene::{Projection, Scene};
use crate::terminal::{one_line, print};

/// Arguments of `info`.
#[derive(Debug, clap::Args)]
pub(super) struct InfoArguments {
    /// A glTF file, a map (.exr, .hdr, 8-bit picture), a built-in scene or a built-in sky.
    source: String,
    #[command(flatten)]
    of_scene: SceneArguments,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Prints what is in a scene or a map.
pub(super) fn run(arguments: &InfoArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let name = arguments.source.as_str();
    let facts = if crate::sources::is_scene(name) {
        scene_facts(name, crate::sources::scene_with(name, &arguments.of_scene.options())?)
    } else {
        let (map, notices) = crate::sources::map(name)?;
        map_facts(name, &map, &notices)
    };
    if arguments.json {
        print(crate::output::record::to_json(&facts)?)
    } else {
        let mut lines = Vec::new();
        list_facts(&facts, 0, &mut lines);
        print(lines.join("\n"))
    }
}

fn scene_facts(name: &str, scene: Scene) -> Value {
    let world = World::new(scene);
    let scene = &world.scene;
    let (low, high) = world.bvh.bounds();
    let textures: usize = scene.images.iter().map(|i| i.texels.bytes().len()).sum();
    json!({
        "scene": name,
        "notices": scene.notices.iter().collect::<Vec<_>>(),
        "triangles": scene.shown_triangles(),
        "triangles_in_memory": scene.triangles.len(),
        "instances": scene.instances.len(),
        "vertices": scene.positions.len(),
        "materials": scene.materials.len(),
        "material_names": scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(),
        "textures": scene.textures.len(),
        "texture_bytes": textures,
        "bvh_bytes": world.bvh.memory_bytes(),
        "emissive_triangles": world.lights.triangle_count(),
        "punctual_lights": scene.lights.len(),
        "punctual_light_names": scene.lights.iter().map(|light| light.name.as_str()).collect::<Vec<_>>(),
        "size_metres": (high - low).to_array().map(|length| scene.frame.length_in_file(length)),
        "cameras": scene.cameras.iter().enumerate().map(|(i, camera)| {
            let view = match camera.projection {
                Projection::Perspective { fov_y_radians } =>
                    format!("{:.1} degrees", fov_y_radians.to_degrees()),
                Projection::Orthographic { half_height } =>
                    format!(
                        "orthographic, {:.2} m high",
                        scene.frame.length_in_file(2.0 * half_height)
                    ),
            };
            format!("{i}: {} ({view})", camera.name)
        }).collect::<Vec<_>>(),
        "left_out": world.needs.left_out().collect::<Vec<_>>(),
        "gpu_kernel": KernelFacts::of_scene(&world),
    })
}

fn map_facts(name: &str, map: &Image, notices: &Notices) -> Value {
    let sun = Sun::of(map);
    let black = "sampling of the map and the Light Grid: the map is black";
    json!({
        "map": name,
        "notices": notices.iter().collect::<Vec<_>>(),
        "size": [map.width, map.height],
        "bytes": map.pixels.len() * 12,
        "mean_luminance": sun.map_or(0.0, |sun| sun.mean_luminance),
        "max_luminance": sun.map_or(0.0, |sun| sun.max_luminance),
        "brightest_pixel": sun.map(|sun| sun.texel),
        "brightest_direction_degrees": sun.map(|sun| json!({
            "azimuth_from_x_towards_z": sun.azimuth_degrees,
            "elevation": sun.elevation_degrees,
        })),
        "energy_within_2.5_degrees_of_it": sun.map(|sun| sun.energy_share),
        "left_out": sun.is_none().then_some(black).into_iter().collect::<Vec<_>>(),
    })
}

/// Nested facts as indented `name: value` lines.
fn list_facts(facts: &Value, indent: usize, lines: &mut Vec<String>) {
    let Some(map) = facts.as_object() else { return };
    for (key, value) in map {
        let label = match key.as_str() {
            "left_out" => "not needed, so left out of the program".to_owned(),
            key => key.replace('_', " "),
        };
        let is_names = key.ends_with("_names");
        match value {
            Value::Array(texts) if !is_names && texts.iter().any(Value::is_string) => {
                lines.push(format!("{:indent$}{label}:", ""));
                let texts = texts.iter().filter_map(Value::as_str);
                lines.extend(texts.map(|text| format!("{:indent$}  - {}", "", one_line(text))));
            }
            Value::Array(items) if is_names || !items.is_empty() => {
                let texts: Vec<String> = items.iter().map(number).collect();
                let separator = if key.starts_with("size") { " x " } else { ", " };
                lines.push(format!("{:indent$}{label}: {}", "", texts.join(separator)));
            }
            Value::Array(_) => {}
            Value::Object(_) => {
                lines.push(format!("{:indent$}{label}:", ""));
                list_facts(value, indent + 2, lines);
            }
            _ => lines.push(format!("{:indent$}{label}: {}", "", number(value))),
        }
    }
}

fn number(value: &Value) -> String {
    match (value.as_str(), value.as_u64(), value.as_f64()) {
        (Some(text), _, _) => one_line(text),
        (_, Some(whole), _) => whole.to_string(),
        (_, _, Some(x)) if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) => format!("{x:.4e}"),
        (_, _, Some(x)) => format!("{x:.4}"),
        _ => value.to_string(),
    }
}
