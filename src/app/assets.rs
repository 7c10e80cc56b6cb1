//! Scene, map and reference: what is loaded, against what the document wants.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::document::{Document, Viewpoint};
use super::loader::{Kind, Loaded, LoadedMap, LoadedScene, Loader};
use super::looks::Looks;
use super::reload::Reload;
use super::worker::Reference;
use crate::environment::Environment;
use crate::error::Result;
use crate::path::framing;
use crate::render::surface_map;
use crate::scene::{Camera, StartView};
use crate::sources;

/// What is loaded.
pub(super) struct Assets {
    /// What reads files.
    pub(super) loader: Loader,
    /// What looks at their files.
    pub(super) reload: Option<Reload>,
    /// The scene that is shown.
    pub(super) scene: Option<LoadedScene>,
    /// The map in use.
    pub(super) map: Option<LoadedMap>,
    /// It, turned and scaled as the document says: what it was made from, rotation in degrees and intensity, and what
    /// that gave.
    transformed: Option<(Arc<Environment>, [f32; 2], Arc<Environment>)>,
    /// Looks that were read.
    pub(super) looks: Looks,
    /// What errors are measured against.
    pub(super) reference: Option<Arc<Reference>>,
    /// What was shown when it came.
    reference_of: Option<Document>,
}

impl Assets {
    /// Of a loader that is at work, and of what looks at files, if they are to be looked at.
    pub(super) fn new(loader: Loader, reload: Option<Reload>) -> Self {
        let (scene, map, transformed, looks) = (None, None, None, Looks::default());
        Self { loader, reload, scene, map, transformed, looks, reference: None, reference_of: None }
    }

    /// The scene that the document names, if it is there.
    pub(super) fn scene_of(&self, document: &Document) -> Option<&LoadedScene> {
        self.scene.as_ref().filter(|scene| scene.name == document.scene)
    }

    /// The map that the document names, if it is there.
    fn map_of(&self, document: &Document) -> Option<&LoadedMap> {
        self.map.as_ref().filter(|map| map.name == document.map)
    }

    /// Whether the scene and the map that the document names are there.
    pub(super) fn are_named_by(&self, document: &Document) -> bool {
        self.scene_of(document).is_some() && self.map_of(document).is_some()
    }

    /// Whether scene and map are there as the document wants them.
    pub(super) fn are_as_in(&self, document: &Document) -> bool {
        let document = &*document.unmixed();
        self.scene_of(document).is_some_and(|scene| document.has_changes(&scene.changes))
            && self.map_of(document).is_some_and(|map| map.sun_factor == document.sun)
    }

    /// What has been loaded since this was asked last and is still wanted.
    pub(super) fn take(&mut self, document: &Document) -> Vec<Loaded> {
        let wanted = [&document.scene, &document.map];
        let loaded = self.loader.take().into_iter().filter(|(name, _)| wanted.contains(&name));
        loaded.map(|(_, loaded)| loaded).collect()
    }

    /// Begins to load what the document wants and is not there.
    pub(super) fn load(&mut self, document: &Document) {
        let document = &*document.unmixed();
        match self.scene.as_ref().filter(|scene| scene.name == document.scene) {
            None => self.loader.load_scene(&document.scene),
            Some(scene) if !document.has_changes(&scene.changes) => {
                self.loader.edit_scene(scene, document);
            }
            Some(_) => {}
        }
        let sun = document.sun;
        match self.map.as_ref().filter(|map| map.name == document.map) {
            None => self.loader.load_map(&document.map, sun),
            Some(map) if map.sun_factor != sun => self.loader.edit_map(map, sun),
            Some(_) => {}
        }
        let others = self.scene_of(document).map(|scene| Arc::clone(&scene.world.scene.files));
        if let Some(reload) = &mut self.reload {
            let Document { scene, map, .. } = document;
            let scene = if sources::is_built_in_scene(scene) { "" } else { scene };
            let map = if sources::is_built_in_map(map) { "" } else { map };
            reload.watch(Kind::Scene, scene, &others.unwrap_or_default());
            reload.watch(Kind::Map, map, &Arc::default());
        }
    }

    /// What another program has written anew, once what was read before is there; nothing unless it is `wanted`.
    pub(super) fn changed(&self, document: &Document, wanted: bool) -> Vec<Kind> {
        let Some(reload) = self.reload.as_ref().filter(|_| wanted) else { return Vec::new() };
        let is_there = |name: &str| self.loader.busy_with().all(|busy| busy.name != name);
        let kinds = [(Kind::Scene, &document.scene), (Kind::Map, &document.map)];
        let changed = |(kind, name): &(Kind, &String)| is_there(name) && reload.takes(*kind);
        kinds.into_iter().filter(changed).map(|(kind, _)| kind).collect()
    }

    /// Begins to read a file of the document again; whether there is one.
    pub(super) fn read_again(&mut self, kind: Kind, document: &Document) -> bool {
        let Document { scene, map, sun, .. } = &*document.unmixed();
        self.reload.iter_mut().for_each(|reload| reload.forget(kind));
        match kind {
            Kind::Scene if !sources::is_built_in_scene(scene) => self.loader.load_scene(scene),
            Kind::Map if !sources::is_built_in_map(map) => self.loader.load_map(map, *sun),
            _ => return false,
        }
        true
    }

    /// The map as the document turns and scales it; made anew only when that changes.
    pub(super) fn environment(&mut self, document: &Document) -> Option<Arc<Environment>> {
        let document = &*document.unmixed();
        let map = &self.map.as_ref()?.environment;
        let asked = [document.rotation_degrees, document.intensity];
        self.transformed.take_if(|(of, was, _)| !Arc::ptr_eq(of, map) || *was != asked);
        let (_, _, transformed) = self.transformed.get_or_insert_with(|| {
            let mut environment = (**map).clone();
            environment.set_rotation(document.rotation_degrees.to_radians());
            environment.set_intensity(document.intensity);
            (Arc::clone(map), asked, Arc::new(environment))
        });
        Some(Arc::clone(transformed))
    }

    /// Measures errors against a picture from now on, or against none. Without a document it shows that of now.
    pub(super) fn set_reference(
        &mut self,
        reference: Option<Arc<Reference>>,
        of: Option<Box<Document>>,
    ) {
        (self.reference, self.reference_of) = (reference, of.map(|of| *of));
    }

    /// Keeps the reference with materials that were given other numbers.
    pub(super) fn renumber_reference(&mut self, before: &LoadedScene, now: &LoadedScene) {
        if let Some(of) = self.reference_of.as_mut().filter(|of| of.scene == now.name) {
            of.renumber(&before.materials, &now.materials);
        }
    }

    /// The reference, if it shows what the document does. One that has just come shows the document of now.
    pub(super) fn reference_for(&mut self, document: &Document) -> Option<Arc<Reference>> {
        let is_there = self.are_as_in(document);
        if self.reference.is_some() && self.reference_of.is_none() && is_there {
            self.reference_of = Some(document.clone());
        }
        self.reference.clone().filter(|_| is_there && self.is_like_reference(document))
    }

    /// The reference, and whether it shows what the document does, as far as is known.
    pub(super) fn reference(&self, document: &Document) -> Option<(&Reference, bool)> {
        let is_of_view = self.reference_of.is_none() || self.is_like_reference(document);
        self.reference.as_deref().map(|reference| (reference, is_of_view))
    }

    /// Whether the document shows what it did when the reference came.
    fn is_like_reference(&self, document: &Document) -> bool {
        self.reference_of.as_ref().is_some_and(|of| of.shows_like(document))
    }
}

/// From where it was asked for; a place is turned about what it looks at.
///
/// # Errors
/// If the scene has no such camera.
pub(super) fn start_viewpoint(scene: &LoadedScene, from: &StartView) -> Result<Viewpoint> {
    let of_file = &scene.world.scene;
    match from {
        StartView::Place(place) => {
            let camera = place.camera(of_file.frame);
            Ok(Viewpoint::of(&camera, camera.focus_distance))
        }
        StartView::Camera(name) => {
            let number = of_file.camera_number(name, &scene.name)?;
            Ok(viewpoint_through(scene, &of_file.cameras[number], false))
        }
    }
}

/// Through the scene's first camera, or of all of it where there is none.
pub(super) fn first_viewpoint(scene: &LoadedScene) -> Viewpoint {
    match scene.world.scene.cameras.first() {
        Some(own) => viewpoint_through(scene, own, false),
        None => viewpoint_through(scene, &framing::frame(&scene.world, 16.0 / 9.0), true),
    }
}

/// Of all of a room from inside; `None` if the scene is none.
pub(super) fn room_viewpoint(scene: &LoadedScene) -> Option<Viewpoint> {
    framing::frame_room(&scene.world).map(|camera| viewpoint_through(scene, &camera, true))
}

fn viewpoint_through(scene: &LoadedScene, camera: &Camera, is_framed: bool) -> Viewpoint {
    let (low, high) = scene.world.bvh.bounds();
    let eye = Vec3::from(camera.world_from_camera.translation);
    // What is framed from outside is turned about its middle, not about what is seen first or behind it.
    let is_outside = is_framed && !(eye.cmpge(low) & eye.cmple(high)).all();
    let distance = if is_outside { camera.focus_distance } else { pivot_distance(scene, camera) };
    let mut viewpoint = Viewpoint::of(camera, distance);
    if !(viewpoint.focus_distance.is_finite() && viewpoint.focus_distance > 0.0) {
        viewpoint.focus_distance = distance;
    }
    viewpoint
}

/// Metres to what is in the middle of a camera's picture.
fn pivot_distance(scene: &LoadedScene, camera: &Camera) -> f32 {
    let rays = crate::path::camera::CameraRays::new(camera, 16, 9);
    let ray = rays.ray(Vec2::new(8.0, 4.5), Vec2::splat(0.5));
    let (low, high) = scene.world.bvh.bounds();
    surface_map::look(&scene.world, ray)
        .map_or(0.5 * (high - low).length(), |spot| spot.position.distance(ray.origin))
        .max(0.05)
}
