//! Cameras and punctual lights of the shown scene.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, Vec3};
use gltf::json;
use json::extensions::scene::khr_lights_punctual::{Light, Type};
use json::validation::Checked;

use super::animation::Channels;
use super::buffers::File;
use super::document::Document;
use super::limits::Fallible;
use super::materials::BRIGHTEST;
use super::pose::{CAMERA, LIGHT, Nodes, own_mirror};
use crate::error::Notices;
use crate::scene::camera_path::{CameraPath, unmirrored};
use crate::scene::{Camera, Frame, Projection, PunctualKind, PunctualLight};

/// Field of view where the file's is unusable.
const DEFAULT_FOV_Y_RADIANS: f32 = 0.8;

/// More moving cameras than any scene has: each keeps all keys of the nodes above it.
const MAX_MOVING: usize = 64;

/// Cameras of the shown nodes, in the order of the file's cameras, and how each moves.
pub(super) fn cameras(
    file: &File<'_>,
    nodes: &Nodes,
    frame: Frame,
    notices: &mut Notices,
) -> Fallible<(Vec<Camera>, Vec<Option<CameraPath>>)> {
    let document = &file.document;
    let mut channels = None;
    let mut cameras = Vec::new();
    for number in nodes.showing(CAMERA) {
        let node = document.nodes.get(number)?;
        let Some(index) = node.camera else { continue };
        let source = document.cameras.get(index)?;
        let name = source.name.clone().or_else(|| node.name.clone());
        let name = name.unwrap_or_else(|| format!("camera {index}"));
        let path = match cameras.len() < MAX_MOVING {
            true => channels
                .get_or_insert_with(|| Channels::new(file))
                .camera_path(nodes, frame, number),
            false => Ok(None),
        };
        let path = path.unwrap_or_else(|cause| {
            notices.add(format!("the movement of camera {name} is left out: {cause}"));
            None
        });
        let world_from_camera = unmirrored(nodes.world(number) * own_mirror(&node));
        let mut camera = camera(&source, name, world_from_camera, notices);
        if let Projection::Orthographic { half_height } = &mut camera.projection {
            *half_height = frame.length(*half_height);
        }
        camera.lens_radius = frame.length(camera.lens_radius);
        camera.focus_distance = frame.length(camera.focus_distance);
        cameras.push((index.value(), camera, path));
    }
    cameras.sort_by_key(|&(index, ..)| index);
    Ok(cameras.into_iter().map(|(_, camera, path)| (camera, path)).unzip())
}

fn camera(source: &json::Camera, name: String, world: DAffine3, notices: &mut Notices) -> Camera {
    let (size, projection) = match (&source.perspective, &source.orthographic) {
        (None, Some(parallel)) => {
            let height = Some(parallel.ymag.abs()).filter(|y| *y > 0.0 && y.is_finite());
            (height, Projection::Orthographic { half_height: height.unwrap_or(1.0) })
        }
        (perspective, _) => {
            let fov = perspective.as_ref().map(|it| it.yfov);
            let fov = fov.filter(|fov| *fov > 0.0 && *fov < PI);
            (fov, Projection::Perspective { fov_y_radians: fov.unwrap_or(DEFAULT_FOV_Y_RADIANS) })
        }
    };
    if size.is_none() || !world.is_finite() {
        notices.add(format!("camera {name} is damaged; the unusable values are replaced"));
    }
    let world = if world.is_finite() { world } else { DAffine3::IDENTITY };
    let [lens_radius, focus_distance] = lens(&source.extras).unwrap_or([0.0, 1.0]);
    let world_from_camera = world.as_affine3a();
    Camera { name, world_from_camera, projection, lens_radius, focus_distance }
}

/// Radius of the lens, and the distance at which the picture is sharp, in metres. glTF has neither, so they come from
/// `extras`: `{"lens": {"radius": 0.01, "focus": 2.5}}`.
fn lens(extras: &json::Extras) -> Option<[f32; 2]> {
    let keys: serde_json::Value = serde_json::from_str(extras.as_ref()?.get()).ok()?;
    let length = |key| keys["lens"][key].as_f64().map(|metres| metres as f32);
    let is_length = |metres: &f32| metres.is_finite() && *metres > 0.0;
    Some([length("radius").filter(is_length)?, length("focus").filter(is_length)?])
}

/// `KHR_lights_punctual` lights of the shown nodes. Candela and lux are taken as the renderer's
/// units: HDR maps are not calibrated either, so any other factor would be a guess.
pub(super) fn lights(
    document: &Document<'_>,
    nodes: &Nodes,
    notices: &mut Notices,
) -> Fallible<Vec<PunctualLight>> {
    let mut lights = Vec::new();
    for number in nodes.showing(LIGHT) {
        let node = document.nodes.get(number)?;
        let extension = node.extensions.as_ref();
        let Some(reference) = extension.and_then(|all| all.khr_lights_punctual.as_ref()) else {
            continue;
        };
        let source = document.lights.get(reference.light)?;
        let name = source.name.clone().or_else(|| node.name.clone());
        let name = name.unwrap_or_else(|| format!("light {}", reference.light));
        match light(&source, &name, nodes.world(number), notices) {
            Some(light) => lights.push(light),
            None => notices.add(format!("light {name} is damaged and left out")),
        }
    }
    Ok(lights)
}

/// A light that lights as much at another scale.
pub(super) fn placed(light: PunctualLight, frame: Frame) -> PunctualLight {
    let squared = match light.kind {
        PunctualKind::Directional => 1.0,
        PunctualKind::Point | PunctualKind::Spot { .. } => frame.scale * frame.scale,
    };
    PunctualLight {
        intensity: (light.intensity.as_dvec3() * squared).as_vec3(),
        range: frame.length(light.range),
        ..light
    }
}

fn light(
    source: &Light,
    name: &str,
    world_from_light: DAffine3,
    notices: &mut Notices,
) -> Option<PunctualLight> {
    let Checked::Valid(kind) = source.type_ else { return None };
    let mut is_sound = true;
    let mut within = |value: f32, least: f32, most: f32| {
        is_sound &= (least..=most).contains(&value);
        value.clamp(least, most)
    };
    let kind = match kind {
        Type::Directional => PunctualKind::Directional,
        Type::Point => PunctualKind::Point,
        Type::Spot => {
            let spot = source.spot.as_ref()?;
            let outer_radians = within(spot.outer_cone_angle, 0.0, FRAC_PI_2);
            let inner_radians = within(spot.inner_cone_angle, 0.0, outer_radians);
            PunctualKind::Spot { inner_radians, outer_radians }
        }
    };
    let color = source.color.map(|channel| within(channel, 0.0, BRIGHTEST));
    let intensity = Vec3::from_array(color) * within(source.intensity, 0.0, BRIGHTEST);
    let intensity = Vec3::from_array(intensity.to_array().map(|x| within(x, 0.0, BRIGHTEST)));
    let range = source.range.map(|range| within(range, f32::MIN_POSITIVE, f32::INFINITY));
    let direction = -world_from_light.matrix3.z_axis.as_vec3();
    let light = PunctualLight {
        name: name.to_owned(),
        kind,
        position: world_from_light.translation.as_vec3(),
        direction: direction.normalize_or(Vec3::NEG_Z),
        intensity,
        // Without one it reaches everything.
        range: range.filter(|&range| range > f32::MIN_POSITIVE).unwrap_or(f32::INFINITY),
    };
    if !(light.position.is_finite() && light.intensity.is_finite()) {
        return None;
    }
    if !is_sound {
        notices.add(format!("light {name} has values outside their range, which are replaced"));
    }
    Some(light)
}
