//! The pictures that were shown last: whoever comes back to one sees it at once, before it is filtered anew.

use std::collections::VecDeque;
use std::sync::Arc;

use super::order::Order;
use crate::app::worker::Request;
use crate::denoise::Denoiser;
use crate::image::Image;

/// So many are kept.
const COUNT: usize = 3;

/// The last pictures, the newest first.
#[derive(Default)]
pub(super) struct Recent(VecDeque<Picture>);

/// A picture that was shown.
pub(super) struct Picture {
    request: Arc<Request>,
    denoiser: Option<Denoiser>,
    pub(super) image: Arc<Image>,
    pub(super) is_carried: bool,
    pub(super) automatic_ev: f32,
}

impl Recent {
    /// Keeps what was shown for an order, in place of what there was of the same request; pictures of other scenes go.
    pub(super) fn keep(
        &mut self,
        order: &Order,
        image: &Arc<Image>,
        (is_carried, automatic_ev): (bool, f32),
    ) {
        let request = Arc::clone(&order.snapshot.request);
        self.0.retain(|kept| {
            Arc::ptr_eq(&kept.request.world, &request.world)
                && !kept.request.is_resumed_by(&request)
        });
        let (denoiser, image) = (order.denoiser, Arc::clone(image));
        self.0.push_front(Picture { request, denoiser, image, is_carried, automatic_ev });
        self.0.truncate(COUNT);
    }

    /// What was shown when an order's picture was left, if it is the first order since.
    pub(super) fn come_back(&self, order: &Order) -> Option<&Picture> {
        let request = Some(&order.snapshot.request).filter(|_| order.snapshot.is_lasting());
        self.of(request?, order.denoiser)
    }

    /// What was shown when the picture of the request ahead was left.
    pub(super) fn ahead(&self, order: &Order) -> Option<&Picture> {
        self.of(order.still_ahead()?, order.denoiser)
    }

    fn of(&self, request: &Arc<Request>, denoiser: Option<Denoiser>) -> Option<&Picture> {
        self.0.iter().find(|kept| {
            kept.request.is_resumed_by(request)
                && !Arc::ptr_eq(&kept.request, request)
                && kept.denoiser == denoiser
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::presenter::order::tests::order_of;
    use crate::app::presenter::source::tests::{film, session};
    use crate::app::worker::tests::{request_of, snapshot_of};
    use crate::develop::tests::developer;

    #[test]
    fn whoever_comes_back_finds_the_picture_that_was_left() {
        let Some(developer) = developer().map(Arc::new) else { return };
        let order = |request: &Arc<Request>| Order {
            denoiser: Some(Denoiser::ATrous),
            ..order_of(&developer, snapshot_of(request, session(film(12, 1, 1))))
        };
        let left = Arc::new(request_of("open", [12, 8]));
        let image = Arc::new(film(12, 1, 1).image());
        let mut recent = Recent::default();
        recent.keep(&order(&left), &image, (true, 2.0));
        assert!(recent.come_back(&order(&left)).is_none(), "it goes on");
        let again = Arc::new((*left).clone());
        let found = recent.come_back(&order(&again)).expect("it is the same picture");
        assert!(Arc::ptr_eq(&found.image, &image) && found.is_carried);
        // It is asked for, and not rendered yet.
        let mut elsewhere = (*left).clone();
        elsewhere.view.camera.world_from_camera.translation.x += 1.0;
        let ahead = |request: &Arc<Request>| Order {
            ahead: Some(Arc::clone(request)),
            ..order(&Arc::new(elsewhere.clone()))
        };
        let found = recent.ahead(&ahead(&again)).expect("it is asked for");
        assert!(Arc::ptr_eq(&found.image, &image) && found.automatic_ev == 2.0);
        assert!(recent.ahead(&order(&again)).is_none(), "it is there");
        let moving = Arc::new(Request { moving: true, ..(*left).clone() });
        assert!(recent.ahead(&ahead(&moving)).is_none(), "the camera goes on");
        let raw = Order { denoiser: None, ..order(&again) };
        assert!(recent.come_back(&raw).is_none(), "with its noise it is another");
        let mut moved = (*left).clone();
        moved.view.camera.world_from_camera.translation.x += 1.0;
        assert!(recent.come_back(&order(&Arc::new(moved))).is_none());
        recent.keep(&order(&again), &image, (false, 2.0));
        assert_eq!(recent.0.len(), 1, "one of each");
        // Another scene.
        recent.keep(&order(&Arc::new(request_of("crack", [12, 8]))), &image, (false, 2.0));
        assert_eq!(recent.0.len(), 1);
    }
}
