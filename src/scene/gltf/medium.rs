//! Media from `extras`, for glTF has none: a key `fog` on the shown scene, on a node or on a material.
//!
//! ```json
//! "extras": { "fog": { "scattering": 0.05, "absorption": [0.0, 0.001, 0.002], "anisotropy": 0.6,
//!                      "box": [[-5, 0, -5], [5, 3, 5]] } }
//! ```
//!
//! Coefficients are per metre, one number or linear RGB. On a scene `box` may be left out: then the
//! medium fills the scene's own box. On a node the box is the cube of side 2 around the origin as the
//! node places it (what an empty of cube shape shows in Blender), made axis-aligned. On a material
//! with `KHR_materials_volume`, `scattering` and `anisotropy` are those inside of the body.

use glam::{DVec3, Vec3};
use gltf::json;
use serde::Deserialize as _;
use serde_json::{Map, Value};

use super::document::Document;
use super::limits::Fallible;
use super::pose::{EXTRAS, Nodes, Tops};
use crate::error::Notices;
use crate::math::box_corners;
use crate::scene::{Frame, Medium};

/// The medium of the shown scene or, without one, of its first node that has one.
pub(super) fn medium(
    document: &Document<'_>,
    nodes: &Nodes,
    frame: Frame,
    notices: &mut Notices,
) -> Fallible<Option<Medium>> {
    let mut media = Vec::new();
    if document.scenes.len() > 0 {
        let scene: Tops = document.scenes.get_as(document.shown_scene())?;
        let medium = fog(&scene.extras).and_then(|keys| read(&keys, "the scene", notices));
        media.extend(medium.map(|medium| frame.medium(medium)));
    }
    for node in nodes.showing(EXTRAS) {
        let Some(keys) = fog(&document.nodes.get(node)?.extras) else { continue };
        let Some(medium) = read(&keys, &format!("node {node}"), notices) else { continue };
        let world = nodes.world(node);
        let corners = box_corners([DVec3::NEG_ONE, DVec3::ONE]);
        let corners = corners.map(|corner| world.transform_point3(corner).as_vec3());
        let low = corners.into_iter().fold(Vec3::MAX, Vec3::min);
        let high = corners.into_iter().fold(Vec3::MIN, Vec3::max);
        media.push(Medium { bounds: Some([low, high]), ..frame.thinned(medium) });
    }
    if media.len() > 1 {
        notices.add(format!("the file has {} media; only the first is rendered", media.len()));
    }
    Ok(media.first().copied())
}

/// Scattering coefficient and anisotropy inside of a material's body.
pub(super) fn inside(extras: &json::Extras, name: &str, notices: &mut Notices) -> (Vec3, f32) {
    let medium = fog(extras).and_then(|keys| read(&keys, &format!("material {name}"), notices));
    medium.map_or((Vec3::ZERO, 0.0), |medium| (medium.scattering, medium.anisotropy))
}

/// The object under the key `fog`.
fn fog(extras: &json::Extras) -> Option<Map<String, Value>> {
    let text = extras.as_ref()?.get();
    let Value::Object(mut keys) = serde_json::from_str(text).ok()? else { return None };
    let Value::Object(fog) = keys.remove("fog")? else { return None };
    Some(fog)
}

fn read(keys: &Map<String, Value>, place: &str, notices: &mut Notices) -> Option<Medium> {
    let medium = understood(keys);
    if medium.is_none() {
        notices.add(format!("the fog of {place} has values that make no sense; it is left out"));
    }
    medium
}

fn understood(keys: &Map<String, Value>) -> Option<Medium> {
    let coefficient = |key: &str| match keys.get(key) {
        None => Some(Vec3::ZERO),
        Some(Value::Number(number)) => Some(Vec3::splat(number.as_f64()? as f32)),
        Some(value) => Vec3::deserialize(value).ok(),
    };
    let bounds = keys.get("box").map(<[Vec3; 2]>::deserialize).transpose().ok()?;
    let medium = Medium {
        scattering: coefficient("scattering")?,
        absorption: coefficient("absorption")?,
        anisotropy: keys.get("anisotropy").map_or(Some(0.0), Value::as_f64)? as f32,
        bounds,
    };
    medium.is_sound().then_some(medium)
}
