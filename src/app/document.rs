//! What the window shows, as plain data: undo compares it, the settings file keeps part of it, the
//! worker's request follows from it.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::{Affine3A, Mat3A, Quat, Vec3};
use serde::{Deserialize, Serialize};

use crate::denoise::Denoiser;
use crate::path::{Background, PathLimits};
use crate::render::gpu::DeviceChoice;
use crate::render::light_groups::LightFactors;
use crate::render::{Crop, Sampling, Sharing, StopRule, View};
use crate::scene::{
    Camera, LampEdit, LampEdits, Material, MaterialEdit, Medium, Projection, builtin,
};
use crate::tone::{ToneCurve, WhiteBalance};

with_defaults! {
    /// Everything a person sets about the picture.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Document {
        /// Scene file or built-in scene.
        pub scene: String = builtin::DEFAULT_SCENE.to_owned(),
        /// Map file or built-in sky.
        pub map: String = "sky:day".to_owned(),
        /// Turn of the map in degrees, `[0, 360]`.
        pub rotation_degrees: f32 = 0.0,
        /// Factor on the map's radiance.
        pub intensity: f32 = 1.0,
        /// Factor on the radiance of the map's sun alone.
        pub sun: f32 = 1.0,
        /// Factor on the scene's point, spot and directional lights.
        pub lamps: f32 = 1.0,
        /// Changes to these lights one by one.
        pub lamp_edits: LampEdits = LampEdits::new(),
        /// Whether factors on light change the picture that there is, rather than begin a new one.
        pub light_mix: bool = false,
        /// What the camera sees of the map.
        pub background: Background = Background::default(),
        /// Fog in place of the scene's own; `None` keeps that.
        pub fog: Option<Medium> = None,
        /// Where from; `None` until the scene is loaded and says it.
        pub viewpoint: Option<Viewpoint> = None,
        /// How light is found.
        pub light: Light = Light::default(),
        /// How the picture is developed.
        pub look: Look = Look::default(),
        /// How large it is.
        pub size: PictureSize = PictureSize::Viewport(1),
        /// The part that is rendered: left, top, right, bottom as shares of the picture, which may have become narrower
        /// than that; `None` is all.
        pub region: Option<[f32; 4]> = None,
        /// When it is done: by default where other renderers end, too, for nobody wants a fan all night.
        pub stop: StopRule = StopRule { samples: Some(1024), ..StopRule::default() },
        /// Kept viewpoints of this scene.
        pub bookmarks: Vec<Viewpoint> = Vec::new(),
        /// Changes to this scene's materials, by their number.
        pub materials: BTreeMap<u32, MaterialEdit> = BTreeMap::new(),
    }
}

with_defaults! {
    /// How light is found.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    pub struct Light {
        /// Where the picture is rendered.
        #[serde(default)]
        pub device: DeviceChoice = DeviceChoice::Auto,
        /// How the map is sampled.
        pub sampling: Sampling = Sampling::Adaptive,
        /// Whether the plain method runs beside it for comparison.
        pub split: bool = false,
        /// Vertices, on surfaces and in media, at which a path gathers light.
        pub bounces: u32 = PathLimits::default().bounces,
        /// Seed of the random numbers.
        pub seed: u32 = 0,
    }
}

with_defaults! {
    /// How linear radiance becomes a picture; nothing of it restarts rendering.
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Look {
        /// Whether the exposure follows the picture; `exposure_ev` is added to it then.
        pub auto_exposure: bool = true,
        /// Stops.
        pub exposure_ev: f32 = 0.0,
        /// Tone curve.
        pub curve: ToneCurve = ToneCurve::Agx,
        /// Look over the tone curve: a `.cube` file or a built-in look.
        pub lut: Option<String> = None,
        /// Its share, `[0,1]`.
        pub lut_strength: f32 = 1.0,
        /// The light that looks white.
        pub white_balance: WhiteBalance = WhiteBalance::default(),
        /// Whether noise is filtered out for display and 8-bit pictures.
        pub denoise: bool = true,
        /// What filters it out.
        pub denoiser: Denoiser = Denoiser::default(),
    }
}

impl Look {
    /// Stops in all where so many would be automatic.
    pub(super) fn total_ev(&self, automatic_ev: f32) -> f32 {
        self.exposure_ev + if self.auto_exposure { automatic_ev } else { 0.0 }
    }
}

/// What a document changes of its scene's file.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneChanges {
    /// Changes to its materials, by their number.
    pub materials: BTreeMap<u32, MaterialEdit>,
    /// Factor on its point, spot and directional lights.
    pub lamps: f32,
    /// Changes to these lights one by one.
    pub lamp_edits: LampEdits,
}

/// Size of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PictureSize {
    /// As large as the viewport, divided by this.
    Viewport(u32),
    /// Pixels across and down.
    Fixed(u32, u32),
}

impl PictureSize {
    /// Pixels across and down; `None` if they depend on the room and there is none as yet.
    pub(super) fn pixels(self, room: Option<[u32; 2]>) -> Option<[u32; 2]> {
        match self {
            Self::Viewport(divisor) => Some(room?.map(|n| (n / divisor.max(1)).max(1))),
            Self::Fixed(width, height) => Some([width, height]),
        }
    }
}

/// Paths to learn from before the first sample.
const MAX_LEARNING_PATHS: u64 = 1 << 13;

impl Document {
    /// Whether all numbers of it that no settings file has are in range: it may come from a file.
    pub fn is_sound(&self) -> bool {
        let radiance = |x: &f32| x.is_finite() && *x >= 0.0;
        let background = match self.background {
            Background::Map | Background::None => true,
            Background::Blurred(radians) => radiance(&radians),
            Background::Color(color) => color.iter().all(radiance),
        };
        background
            && (0.0..=360.0).contains(&self.rotation_degrees)
            && [self.intensity, self.sun, self.lamps].iter().all(radiance)
            && self.fog.is_none_or(|fog| fog.is_sound())
            && self.viewpoint.iter().chain(&self.bookmarks).all(Viewpoint::is_sound)
            && self.region.iter().flatten().all(|share| (-MAX_ASIDE..=MAX_ASIDE).contains(share))
            && self.materials.values().all(MaterialEdit::is_sound)
            && self.lamp_edits.values().all(LampEdit::is_sound)
    }

    /// Whether both show the same from the same place, whatever is made of it.
    pub(super) fn shows_like(&self, other: &Self) -> bool {
        let light =
            |of: &Self| (of.rotation_degrees, of.intensity, of.sun, of.lamps, of.light.bounces);
        let things = |of: &Self| (of.background, of.fog);
        let cameras = [self, other].map(|of| of.viewpoint.as_ref().map(Viewpoint::camera));
        let is_seen_alike = match &cameras {
            [Some(one), Some(other)] => one.sees_like(other),
            [one, other] => one.is_none() && other.is_none(),
        };
        (&self.scene, &self.map) == (&other.scene, &other.map)
            && is_seen_alike
            && (&self.materials, &self.lamp_edits) == (&other.materials, &other.lamp_edits)
            && (light(self), things(self)) == (light(other), things(other))
    }

    /// The factors of its light mix, if it has one.
    pub(super) fn mix(&self) -> Option<LightFactors> {
        let Self { intensity, sun, lamps, ref lamp_edits, .. } = *self;
        let is_mixed = self.light_mix && !self.light.split;
        is_mixed.then(|| LightFactors { intensity, sun, lamps, lamp_edits: lamp_edits.clone() })
    }

    /// What is to be loaded and rendered: of a light mix all light as it is.
    pub(super) fn unmixed(&self) -> Cow<'_, Self> {
        if self.mix().is_none() {
            return Cow::Borrowed(self);
        }
        let mut document = self.clone();
        (document.intensity, document.sun, document.lamps) = (1.0, 1.0, 1.0);
        for edit in document.lamp_edits.values_mut() {
            *edit = LampEdit { color: edit.color, ..LampEdit::default() };
        }
        document.lamp_edits.retain(|_, edit| *edit != LampEdit::default());
        Cow::Owned(document)
    }

    /// What it changes of the scene's file.
    pub(super) fn changes(&self) -> SceneChanges {
        let Self { materials, lamps, lamp_edits, .. } = self;
        let (materials, lamp_edits) = (materials.clone(), lamp_edits.clone());
        SceneChanges { materials, lamps: *lamps, lamp_edits }
    }

    /// Whether these are its changes.
    pub(super) fn has_changes(&self, changes: &SceneChanges) -> bool {
        let SceneChanges { materials, lamps, lamp_edits } = changes;
        (&self.materials, &self.lamps, &self.lamp_edits) == (materials, lamps, lamp_edits)
    }

    /// Changes that of the scene's file, and nothing else.
    pub(super) fn set_changes(&mut self, changes: SceneChanges) {
        let SceneChanges { materials, lamps, lamp_edits } = changes;
        (self.materials, self.lamps, self.lamp_edits) = (materials, lamps, lamp_edits);
    }

    /// Keeps to the same materials, by their names, where a scene has come anew; those that lost theirs are told.
    pub(super) fn renumber(&mut self, before: &[Material], now: &[Material]) -> Vec<String> {
        let mut gone = Vec::new();
        let edits = std::mem::take(&mut self.materials);
        for (number, edit) in edits {
            match number_now(number, before, now) {
                Some(number) => drop(self.materials.insert(number, edit)),
                None => gone.push(called(number, before)),
            }
        }
        gone
    }

    /// Keeps the region on the same part of the scene where the room's aspect was so many times what it is now.
    pub(super) fn follow_room(&mut self, factor: f32) {
        if let (PictureSize::Viewport(_), Some([left, _, right, _])) = (self.size, &mut self.region)
        {
            for x in [left, right] {
                *x = in_other_shape(*x, factor).clamp(-MAX_ASIDE, MAX_ASIDE);
            }
        }
    }

    /// What of the region is in the picture, if anything.
    pub(super) fn seen_region(&self) -> Option<[f32; 4]> {
        let region = self.region?.map(|share| share.clamp(0.0, 1.0));
        let [left, top, right, bottom] = region;
        (left < right && top < bottom).then_some(region)
    }

    /// So few that the first picture does not wait for them: rendered paths teach the rest. Whatever ends the
    /// picture, for that may be changed while it is made.
    fn learning_paths(&self, size: [u32; 2]) -> u64 {
        let paths = View::suitable_learning_paths(self.light.sampling, size, None);
        match self.light.sampling {
            Sampling::Adaptive => paths.min(MAX_LEARNING_PATHS),
            _ => paths,
        }
    }

    /// The render settings that follow for a picture of this size; `None` without a viewpoint.
    pub fn view(&self, width: u32, height: u32) -> Option<View> {
        let whole = [width, height];
        let crop = self.seen_region().map(|region| pixels_of(region, whole));
        let [width, height] = crop.map_or(whole, |(_, size)| size);
        Some(View {
            sampling: self.light.sampling,
            limits: PathLimits { bounces: self.light.bounces, ..PathLimits::default() },
            seed: self.light.seed,
            // What neighbours share, denoising cannot tell from light.
            sharing: Sharing::Off,
            learning_paths: self.learning_paths([width, height]),
            medium: self.fog,
            background: self.background,
            crop: crop.map(|(corner, _)| Crop { corner, whole }),
            // The denoiser, focusing and the surface overlays need them.
            layers: true,
            ..View::new(self.viewpoint.as_ref()?.camera(), [width, height])
        })
    }
}

/// What a material is called in sentences.
pub(super) fn called(number: u32, materials: &[Material]) -> String {
    let name = materials.get(number as usize).map_or("", |material| &material.name);
    if name.is_empty() { format!("Material {}", number + 1) } else { name.to_owned() }
}

/// Which material has the name now that this one had: of several, the one of the same place among them.
pub(super) fn number_now(number: u32, before: &[Material], now: &[Material]) -> Option<u32> {
    let name = &before.get(number as usize)?.name;
    let alike = |all: &[Material]| -> Vec<u32> {
        let numbered = (0..).zip(all);
        numbered.filter(|(_, material)| material.name == *name).map(|(number, _)| number).collect()
    };
    let place = alike(before).iter().position(|other| *other == number)?;
    alike(now).get(place).copied()
}

/// A region may be marked where a wide window shows more than the one that is there now, but not farther aside.
const MAX_ASIDE: f32 = 100.0;

/// What a share of the width is where the aspect was so many times what it is now: pictures share their middle.
pub(super) fn in_other_shape(x: f32, factor: f32) -> f32 {
    0.5 + (x - 0.5) * factor
}

/// Corner and size in pixels of a part of a picture; at least one pixel.
fn pixels_of(
    [left, top, right, bottom]: [f32; 4],
    [width, height]: [u32; 2],
) -> ([u32; 2], [u32; 2]) {
    let span = |low: f32, high: f32, count: u32| {
        let at = |share: f32| (share.clamp(0.0, 1.0) * count as f32).round() as u32;
        let start = at(low).min(count - 1);
        (start, at(high).clamp(start + 1, count) - start)
    };
    let ((x, w), (y, h)) = (span(left, right, width), span(top, bottom, height));
    ([x, y], [w, h])
}

/// A camera with the point it turns around.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// What to call it.
    pub name: String,
    /// World position in metres.
    pub eye: [f32; 3],
    /// World from camera, a unit quaternion (x, y, z, w).
    pub rotation: [f32; 4],
    /// Metres along the view axis to the point that orbiting turns around.
    pub pivot_distance: f32,
    /// Vertical field of view in degrees; `None` for parallel projection.
    pub fov_y_degrees: Option<f32>,
    /// Half the picture's height in metres, for parallel projection.
    pub half_height: f32,
    /// Radius of the lens in metres; 0 keeps everything sharp.
    pub lens_radius: f32,
    /// Metres at which the picture is sharp.
    pub focus_distance: f32,
}

impl Viewpoint {
    /// Whether all numbers are in range.
    pub(super) fn is_sound(&self) -> bool {
        let lengths = [self.pivot_distance, self.half_height, self.focus_distance];
        self.eye.iter().all(|x| x.is_finite())
            && self.rotation().is_normalized()
            && lengths.iter().all(|length| *length > 0.0 && length.is_finite())
            && self.lens_radius >= 0.0
            && self.lens_radius.is_finite()
            && self.fov_y_degrees.is_none_or(|degrees| degrees > 0.0 && degrees < 180.0)
    }

    /// Of a scene's camera; `pivot_distance` in metres.
    pub fn of(camera: &Camera, pivot_distance: f32) -> Self {
        let axes = camera.world_from_camera.matrix3;
        // A node above may mirror or shear it.
        let back = axes.z_axis.normalize_or(glam::Vec3A::Z);
        let right = axes.y_axis.cross(back).normalize_or(back.any_orthonormal_vector());
        let rotation = Quat::from_mat3a(&Mat3A::from_cols(right, back.cross(right), back));
        let (fov_y_degrees, half_height) = match camera.projection {
            Projection::Perspective { fov_y_radians } => (Some(fov_y_radians.to_degrees()), 1.0),
            Projection::Orthographic { half_height } => (None, half_height),
        };
        Self {
            name: camera.name.clone(),
            eye: Vec3::from(camera.world_from_camera.translation).to_array(),
            rotation: rotation.to_array(),
            pivot_distance: pivot_distance.max(0.01),
            fov_y_degrees,
            half_height,
            lens_radius: camera.lens_radius,
            focus_distance: camera.focus_distance,
        }
    }

    /// The camera.
    pub fn camera(&self) -> Camera {
        Camera {
            name: self.name.clone(),
            world_from_camera: Affine3A::from_rotation_translation(self.rotation(), self.eye()),
            projection: match self.fov_y_degrees {
                Some(degrees) => Projection::Perspective { fov_y_radians: degrees.to_radians() },
                None => Projection::Orthographic { half_height: self.half_height },
            },
            lens_radius: self.lens_radius,
            focus_distance: self.focus_distance,
        }
    }

    /// World position in metres.
    pub fn eye(&self) -> Vec3 {
        Vec3::from(self.eye)
    }

    /// World from camera.
    pub fn rotation(&self) -> Quat {
        Quat::from_array(self.rotation)
    }

    /// Unit direction it looks in.
    pub fn forward(&self) -> Vec3 {
        self.rotation() * Vec3::NEG_Z
    }

    /// The point orbiting turns around.
    pub fn pivot(&self) -> Vec3 {
        self.eye() + self.forward() * self.pivot_distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_stay_with_the_names_of_materials() {
        let materials = |names: &[&str]| -> Vec<Material> {
            names
                .iter()
                .map(|name| Material { name: (*name).to_owned(), ..Material::default() })
                .collect()
        };
        let before = materials(&["wall", "oak", "", "oak", "gone"]);
        let now = materials(&["new", "", "oak", "wall", "oak"]);
        let edit =
            |roughness: f32| MaterialEdit { roughness: Some(roughness), ..Default::default() };
        let numbered = |list: &[(u32, f32)]| list.iter().map(|(n, r)| (*n, edit(*r))).collect();
        let mut document = Document {
            materials: numbered(&[(0, 0.1), (2, 0.2), (3, 0.3), (4, 0.4)]),
            ..Default::default()
        };
        assert_eq!(document.renumber(&before, &now), ["gone"]);
        assert_eq!(document.materials, numbered(&[(3, 0.1), (1, 0.2), (4, 0.3)]));
    }

    #[test]
    fn what_ends_a_picture_does_not_change_it() {
        let camera = Camera::look_at(Vec3::ONE, Vec3::ZERO, 0.7);
        let viewpoint = Some(Viewpoint::of(&camera, 1.0));
        let endless = Document { viewpoint, ..Document::default() };
        for sampling in [Sampling::Adaptive, Sampling::Talk] {
            let light = Light { sampling, ..endless.light };
            let view = |samples| {
                let stop = StopRule { samples, ..StopRule::default() };
                Document { stop, light, ..endless.clone() }.view(1280, 720)
            };
            assert!(view(None) == view(Some(4)) && view(None) == view(Some(1 << 20)));
        }
    }

    #[test]
    fn a_region_stays_on_its_part_of_the_scene_in_a_room_of_another_shape() {
        let mut document = Document { region: Some([0.25, 0.2, 0.5, 0.8]), ..Document::default() };
        let camera = Camera::look_at(Vec3::ONE, Vec3::ZERO, 0.7);
        document.viewpoint = Some(Viewpoint::of(&camera, 1.0));
        let spans = |document: &Document, width| {
            let view = document.view(width, 100).expect("a viewpoint");
            let from_middle = view.crop.expect("a region").corner[0] as i64 - i64::from(width / 2);
            (from_middle, view.width)
        };
        assert_eq!(spans(&document, 200), (-50, 50));
        document.follow_room(0.5);
        assert_eq!(spans(&document, 400), (-50, 50));
        document.follow_room(2.0);
        assert_eq!(document.region, Some([0.25, 0.2, 0.5, 0.8]));
        document.follow_room(4.0);
        assert_eq!(spans(&document, 50), (-25, 25));
        assert_eq!(document.seen_region(), Some([0.0, 0.2, 0.5, 0.8]));
        document.region = Some([0.0, 0.0, 0.1, 1.0]);
        document.follow_room(4.0);
        assert_eq!(document.seen_region(), None, "it is outside");
        document.follow_room(0.25);
        assert!(document.seen_region().is_some(), "and comes back");
    }

    #[test]
    fn regions_are_at_least_a_pixel_and_inside() {
        assert_eq!(pixels_of([0.25, 0.5, 0.75, 1.0], [100, 50]), ([25, 25], [50, 25]));
        assert_eq!(pixels_of([1.0, 1.0, 1.0, 1.0], [100, 50]), ([99, 49], [1, 1]));
        assert_eq!(pixels_of([-1.0, 0.0, 2.0, 0.0], [1, 1]), ([0, 0], [1, 1]));
    }

    #[test]
    fn a_viewpoint_is_the_camera_it_came_from() {
        let mut camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 0.5, 0.0), 0.7);
        camera.lens_radius = 0.03;
        let viewpoint = Viewpoint::of(&camera, camera.focus_distance);
        let again = viewpoint.camera();
        assert!(again.world_from_camera.abs_diff_eq(camera.world_from_camera, 1e-5));
        assert_eq!(again.lens_radius, 0.03);
        assert!((viewpoint.pivot() - Vec3::new(-1.0, 0.5, 0.0)).length() < 1e-5);
    }
}
