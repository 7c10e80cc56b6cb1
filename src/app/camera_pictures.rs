//! What cameras see, in small: shown beside their names.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Weak};

use egui::{Context, TextureHandle, TextureOptions};

use super::screen::color_image;
use super::worker::Request;
use crate::denoise::quick;
use crate::digest::Digest;
use crate::environment::Environment;
use crate::error::Result;
use crate::image::Rgb8;
use crate::path::World;
use crate::render::{Phase, Session, View};
use crate::scene::Camera;
use crate::tone::{ToneCurve, auto_exposure_ev, display_rgb8};

/// Pixels across and down.
const SIZE: [u32; 2] = [144, 90];
/// Samples a pixel.
const SAMPLES: u32 = 4;

/// Small pictures of one scene in one light.
#[derive(Default)]
pub(super) struct CameraPictures {
    lit: (Weak<World>, Weak<Environment>),
    /// By a digest of the camera; `None` while one is being made.
    textures: BTreeMap<u64, Option<TextureHandle>>,
}

/// A picture that was made.
pub(super) struct CameraPicture {
    lit: (Weak<World>, Weak<Environment>),
    key: u64,
    picture: Rgb8,
}

impl CameraPictures {
    /// The picture of a camera, if it is there.
    pub(super) fn of(&self, camera: &Camera) -> Option<&TextureHandle> {
        self.textures.get(&key(camera))?.as_ref()
    }

    /// What makes the picture of a camera in the light of a request, unless it is there or being made.
    pub(super) fn make(
        &mut self,
        request: &Arc<Request>,
        camera: Camera,
    ) -> Option<impl FnOnce() -> Result<CameraPicture> + use<>> {
        let lit = (Arc::downgrade(&request.world), Arc::downgrade(&request.environment));
        if !is_same(&self.lit, &lit) {
            *self = Self { lit: lit.clone(), textures: BTreeMap::new() };
        }
        let (request, key) = (Arc::clone(request), key(&camera));
        if self.textures.contains_key(&key) {
            return None;
        }
        self.textures.insert(key, None);
        Some(move || Ok(CameraPicture { lit, key, picture: picture(&request, camera)? }))
    }

    /// Takes a picture that was made.
    pub(super) fn take(&mut self, made: CameraPicture, context: &Context) {
        let CameraPicture { lit, key, picture } = made;
        if is_same(&self.lit, &lit) {
            let image = color_image(&picture);
            let texture = context.load_texture("camera", image, TextureOptions::LINEAR);
            self.textures.insert(key, Some(texture));
        }
    }
}

fn is_same(
    (world, environment): &(Weak<World>, Weak<Environment>),
    (other_world, other_environment): &(Weak<World>, Weak<Environment>),
) -> bool {
    world.ptr_eq(other_world) && environment.ptr_eq(other_environment)
}

fn key(camera: &Camera) -> u64 {
    Digest::new().debug(camera).value()
}

/// What a camera sees in the light of a request.
fn picture(request: &Request, camera: Camera) -> Result<Rgb8> {
    let sampling = request.view.sampling;
    let view = View {
        sampling,
        learning_paths: View::suitable_learning_paths(sampling, SIZE, Some(SAMPLES)),
        medium: request.view.medium,
        background: request.view.background,
        layers: true,
        ..View::new(camera, SIZE)
    };
    let mut session = Session::new(&request.world, &request.environment, view);
    while session.phase() == Phase::Learning || session.samples() < SAMPLES {
        session.advance(SAMPLES, &AtomicBool::new(false))?;
    }
    let image = quick(session.film(), None);
    Ok(display_rgb8(&image, auto_exposure_ev(&image), ToneCurve::default()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::worker::tests::request_of;

    #[test]
    fn each_camera_has_a_picture_in_the_light_that_there_is() {
        let request = Arc::new(request_of("office", [8, 8]));
        let cameras = &request.world.scene.cameras[..2];
        let mut pictures = CameraPictures::default();
        let make = |camera: &Camera| pictures.make(&request, camera.clone()).expect("it has none");
        let made = [&cameras[0], &cameras[1]].map(make);
        assert!(pictures.make(&request, cameras[0].clone()).is_none(), "it is being made");
        let [one, other] = made.map(|make| make().expect("the CPU does not fail"));
        assert!(one.picture != other.picture);
        let levels = one.picture.pixels.as_flattened();
        let mean = levels.iter().map(|level| f64::from(*level)).sum::<f64>() / levels.len() as f64;
        assert!((60.0..200.0).contains(&mean), "{mean}");
        let context = Context::default();
        pictures.take(one, &context);
        assert!(pictures.of(&cameras[0]).is_some() && pictures.of(&cameras[1]).is_none());
        // In another light there is none, and those that come late are of no use.
        let relit = Arc::new(request_of("office", [8, 8]));
        assert!(pictures.make(&relit, cameras[0].clone()).is_some());
        pictures.take(other, &context);
        assert!(cameras.iter().all(|camera| pictures.of(camera).is_none()));
    }
}
