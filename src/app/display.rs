//! What is on the screen, and what makes it ready.

use std::sync::Arc;

use super::comparison::Comparison;
use super::document::Document;
use super::overlays::Overlay;
use super::presenter::{Order, Presenter, Shown};
use super::screen::{Developed, Screen};
use super::threads::{Wake, lock};
use super::worker::{Request, Snapshot};
use crate::develop::DevelopSettings;
use crate::environment::sun::Sun;
use crate::error::Result;
use crate::image::Rgb8;
use crate::scene::Camera;
use crate::tone::Tone;

/// Developed pictures.
#[derive(Default)]
pub(super) struct Textures {
    /// The last whole picture.
    pub(super) main: Option<Developed>,
    /// What it is of, unless it is a kept one: the geometry, and from where.
    pub(super) main_of: Option<(Arc<()>, Camera)>,
    /// A part of it that is rendered alone.
    pub(super) part: Option<Developed>,
    pub(super) other: Option<Developed>,
}

/// The presenting thread and its results, on a device.
pub(super) struct Display {
    presenter: Presenter,
    /// What is ready to be developed.
    pub(super) shown: Option<Arc<Shown>>,
    /// Developed pictures.
    pub(super) textures: Textures,
    /// The device.
    pub(super) screen: Screen,
    /// Width over height of the whole picture that was shown last.
    aspect: Option<f32>,
}

impl Display {
    /// Starts the thread, which calls `wake` when there is something new to show.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(screen: Screen, wake: Wake) -> Result<Self> {
        let (presenter, textures) = (Presenter::start(wake)?, Textures::default());
        Ok(Self { presenter, shown: None, textures, screen, aspect: None })
    }

    /// Takes what is ready.
    pub(super) fn collect(&mut self) {
        // What is on a device that was lost cannot be drawn.
        let is_here =
            |shown: &Arc<Shown>| Arc::ptr_eq(&shown.order.developer, &self.screen.developer);
        // What was shown before is dropped when the lock is free again.
        let shown = lock(&self.presenter.shown).clone();
        self.shown = shown.filter(is_here);
    }

    /// The aspect before over the one of now, if another whole picture is shown since this was asked last.
    pub(super) fn change_of_aspect(&mut self) -> Option<f32> {
        let view = self.shown.as_ref()?.order.snapshot.view();
        if view.crop.is_some() {
            return None;
        }
        let aspect = view.width as f32 / view.height.max(1) as f32;
        let before = self.aspect.replace(aspect).filter(|before| *before != aspect);
        before.map(|before| before / aspect)
    }

    /// Has a picture made ready.
    pub(super) fn order(
        &mut self,
        (snapshot, latest): (&Arc<Snapshot>, Option<Arc<Request>>),
        document: &Document,
        (overlay, tile, sun): (Option<Overlay>, Option<u32>, Option<Sun>),
        tone: Tone,
        compared: Option<Comparison>,
    ) {
        let look = &document.look;
        let request = &snapshot.request;
        // Overlays and comparisons wait for the rendered picture.
        let is_alone = overlay.is_none() && compared.is_none() && snapshot.plain.is_none();
        let is_ahead = |latest: &Arc<Request>| match latest.moving {
            true => latest.view != request.view,
            false => is_alone && latest.previews && request.is_left_for(latest),
        };
        self.presenter.order(Order {
            developer: Arc::clone(&self.screen.developer),
            snapshot: Arc::clone(snapshot),
            ahead: latest.filter(is_ahead),
            denoiser: look.denoise.then(|| look.denoiser.found()),
            metered: look.auto_exposure.then_some(look.white_balance),
            overlay,
            look: overlay.filter(|o| o.is_developed()).map(|_| (look.clone(), tone)),
            tile,
            sun: sun.filter(|_| overlay == Some(Overlay::Sun)),
            compared,
        });
    }

    /// Whether what was ordered last is shown: what is ready since [`Self::collect`] is not.
    pub(super) fn is_settled(&self) -> bool {
        self.shown.as_ref().is_none_or(|shown| !shown.is_coarse)
            && self.shown.as_ref().map(|shown| &shown.order) == self.presenter.ordered.as_ref()
    }

    /// Stops in all, once the automatic ones are known.
    pub(super) fn exposure_ev(&self, document: &Document) -> Option<f32> {
        Some(document.look.total_ev(self.shown.as_ref()?.automatic_ev))
    }

    /// How the picture is developed under overlays of this opacity, once the exposure is known.
    pub(super) fn settings(
        &self,
        document: &Document,
        tone: Tone,
        opacity: f32,
    ) -> Option<DevelopSettings> {
        let white_balance = document.look.white_balance;
        let opacity = match self.shown.as_ref().and_then(|shown| shown.order.overlay) {
            Some(overlay) if overlay.is_opaque() => [1.0, 0.6],
            Some(Overlay::Sun) => [0.6 * opacity, 0.0],
            // What the overlay does not speak of steps back.
            _ => [opacity, 0.6 * opacity],
        };
        let exposure_ev = self.exposure_ev(document)?;
        Some(DevelopSettings { white_balance, exposure_ev, tone, opacity })
    }

    /// The picture as it is on the screen, overlay included, if there is one.
    pub(super) fn read(&self) -> Option<Result<Rgb8>> {
        let Textures { main, part, .. } = &self.textures;
        let is_part = self.shown.as_ref()?.order.snapshot.request.view.crop.is_some();
        let developed = if is_part { part } else { main };
        Some(self.screen.developer.read(&developed.as_ref()?.display))
    }

    /// Goes on with another device.
    pub(super) fn move_to(&mut self, screen: Screen) {
        // Both are on the device that was lost.
        (self.shown, self.textures) = (None, Textures::default());
        self.screen = screen;
    }
}
