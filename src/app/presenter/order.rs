//! What is to be shown, and what there is to show.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::app::comparison::Comparison;
use crate::app::document::Look;
use crate::app::overlays::{Overlay, Painted};
use crate::app::worker::{Activity, Request, Snapshot};
use crate::denoise::Denoiser;
use crate::develop::{Developer, LinearPicture, OverlayTexture};
use crate::environment::sun::Sun;
use crate::image::Image;
use crate::tone::{Tone, WhiteBalance};

/// What is to be shown.
#[derive(Clone)]
pub(crate) struct Order {
    /// What pictures are developed by, hence the device they are to be on.
    pub(in crate::app) developer: Arc<Developer>,
    /// The film.
    pub snapshot: Arc<Snapshot>,
    /// The latest request, if something of it may be shown before it is rendered.
    pub ahead: Option<Arc<Request>>,
    /// What takes noise out, if anything shall.
    pub denoiser: Option<Denoiser>,
    /// The white balance the exposure is to be measured under, if it shall be.
    pub metered: Option<WhiteBalance>,
    /// What is drawn over it.
    pub overlay: Option<Overlay>,
    /// How the overlay is developed, if it shows light.
    pub look: Option<(Look, Tone)>,
    /// The tile chosen on the map.
    pub tile: Option<u32>,
    /// The sun of the map, if the overlay asks for it.
    pub sun: Option<Sun>,
    /// Kept pictures that are compared.
    pub compared: Option<Comparison>,
}

impl PartialEq for Order {
    fn eq(&self, other: &Self) -> bool {
        let ahead = |of: &Self| of.ahead.as_ref().map(Arc::as_ptr);
        let settings = |of: &Self| (of.denoiser, of.metered, of.overlay, of.tile, of.sun);
        Arc::ptr_eq(&self.developer, &other.developer)
            && self.snapshot.key() == other.snapshot.key()
            && ahead(self) == ahead(other)
            && settings(self) == settings(other)
            && self.look == other.look
            && self.compared == other.compared
    }
}

impl Order {
    /// It once its picture is made: the film beside the picture's own is large, and serves no more.
    pub(super) fn presented(&self) -> Self {
        let mut snapshot = (*self.snapshot).clone();
        snapshot.backdrop.iter_mut().for_each(|backdrop| backdrop.film = Arc::default());
        snapshot.groups = Arc::default();
        Self { snapshot: Arc::new(snapshot), ..self.clone() }
    }

    /// What the picture is to be of.
    pub(in crate::app) fn latest(&self) -> &Arc<Request> {
        self.ahead.as_ref().unwrap_or(&self.snapshot.request)
    }

    /// The request ahead, unless the camera moves.
    pub(super) fn still_ahead(&self) -> Option<&Arc<Request>> {
        self.ahead.as_ref().filter(|ahead| !ahead.moving)
    }

    /// Whether what is kept is shown where the picture that is rendered would be.
    pub(in crate::app) fn covers_now(&self) -> bool {
        self.compared.as_ref().is_some_and(|it| it.is_difference || it.right.is_some())
    }

    /// What is to be shown, made on the host.
    pub(in crate::app) fn image(&self) -> Image {
        let film = &self.snapshot.main.film;
        let never = AtomicBool::new(false);
        let filtered =
            self.denoiser.and_then(|it| it.preview(film, None, None, &never).ok().flatten());
        filtered.unwrap_or_else(|| film.image())
    }

    /// Whether it is of the work of an order before it, or of the same movement.
    pub(super) fn is_same_work(&self, before: &Self) -> bool {
        let [request, old] = [self, before].map(Self::viewed);
        Arc::ptr_eq(request, old) || (request.moving && old.moving)
    }

    /// Whether the camera, or the size, is another one by now than that of the rendered picture. Where light changes,
    /// pictures of the light before are shown all the same.
    pub(super) fn is_left(&self) -> bool {
        let request = &self.snapshot.request;
        let is_elsewhere =
            |ahead: &Arc<Request>| ahead.view != request.view && request.is_seen_like(ahead);
        self.ahead.as_ref().is_some_and(is_elsewhere)
    }

    /// The request whose view is shown.
    fn viewed(&self) -> &Arc<Request> {
        self.ahead.as_ref().filter(|_| self.is_left()).unwrap_or(&self.snapshot.request)
    }

    /// Whether it asks for the same of a later picture of the same work, which may wait; the first one with a
    /// sample in every pixel does not.
    pub(super) fn only_follows(&self, before: &Self) -> bool {
        let is_over = matches!(self.snapshot.activity, Activity::Done | Activity::Paused);
        let has_plain =
            |snapshot: &Snapshot| snapshot.plain.as_ref().is_some_and(|p| p.samples > 0);
        let (now, then) = (&self.snapshot, &before.snapshot);
        let is_first = now.is_whole() && !then.is_whole() || has_plain(now) && !has_plain(then);
        let snapshot = Arc::clone(&before.snapshot);
        self.is_same_work(before)
            && !is_over
            && !is_first
            && now.learning_step == then.learning_step
            && Self { snapshot, ..self.clone() } == *before
    }
}

/// What the screen is developed from.
pub(crate) struct Shown {
    /// What was ordered.
    pub order: Order,
    /// The picture.
    pub(in crate::app) picture: LinearPicture,
    /// It as it was made on the host, unless it was made on the device.
    pub(in crate::app) image: Option<Arc<Image>>,
    /// Whether light that was seen from elsewhere, or in another size, is in it.
    pub(in crate::app) is_carried: bool,
    /// Whether a finer one follows.
    pub(in crate::app) is_coarse: bool,
    /// What the wipe uncovers: the plain picture or one of the history.
    pub(in crate::app) other: Option<LinearPicture>,
    /// Stops that bring the picture to middle grey; 0 unless measured.
    pub automatic_ev: f32,
    /// The overlay on the device.
    pub(in crate::app) painted: Option<Painted<OverlayTexture>>,
    /// Why the denoiser did not do its work.
    pub failure: Option<String>,
    /// How far apart the pictures are whose difference is shown: [`crate::metrics::relative_rms_error`].
    pub difference: Option<f64>,
    /// Why two pictures cannot be compared.
    pub uncompared: Option<String>,
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::app::presenter::source::tests::{film, session};
    use crate::app::worker::SessionSnapshot;
    use crate::app::worker::tests::{request_of, snapshot_of};
    use crate::develop::tests::developer;

    pub(in crate::app::presenter) fn order_of(
        developer: &Arc<Developer>,
        snapshot: Snapshot,
    ) -> Order {
        Order {
            developer: Arc::clone(developer),
            snapshot: Arc::new(snapshot),
            ahead: None,
            denoiser: None,
            metered: None,
            overlay: None,
            look: None,
            tile: None,
            sun: None,
            compared: None,
        }
    }

    #[test]
    fn a_movement_does_not_wait_for_the_picture_before_it() {
        let Some(developer) = developer().map(Arc::new) else { return };
        let still = Arc::new(request_of("open", [12, 8]));
        let order = |request: &Arc<Request>, samples| {
            order_of(
                &developer,
                snapshot_of(request, SessionSnapshot { samples, ..session(film(12, 1, 1)) }),
            )
        };
        let [moving, later] =
            [(); 2].map(|()| Arc::new(Request { moving: true, ..(*still).clone() }));
        assert!(order(&still, 2).only_follows(&order(&still, 1)), "more of the same");
        assert!(!order(&still, 1).only_follows(&order(&still, 0)), "the first with all pixels");
        assert!(!order(&moving, 1).only_follows(&order(&still, 1)), "off it goes");
        assert!(order(&later, 1).only_follows(&order(&moving, 1)), "on it goes");
        assert!(!order(&still, 1).only_follows(&order(&later, 1)), "there it stays");

        // What is asked for by now, though it is not rendered yet.
        let mut other = (*still).clone();
        other.view.camera.world_from_camera.translation.x += 1.0;
        let ahead = |request| Order { ahead: Some(Arc::new(request)), ..order(&still, 2) };
        let elsewhere = ahead(other);
        assert!(elsewhere.is_left() && !elsewhere.is_same_work(&order(&still, 2)));
        let relit = ahead(Request { run: 1, ..(*still).clone() });
        assert!(!relit.is_left() && relit.is_same_work(&order(&still, 2)), "it is seen meanwhile");
        let mut bounced = (*still).clone();
        bounced.view.limits.bounces += 1;
        assert!(!ahead(bounced).is_left(), "as it is while a slider is dragged");
    }
}
