//! What a picture is made from, and how.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Weak};

use super::order::Order;
use crate::app::worker::{Backdrop, SessionSnapshot};
use crate::denoise::{Denoiser, FineGuides};
use crate::develop::{Developer, LinearPicture};
use crate::image::Image;
use crate::render::film::Film;
use crate::render::gpu::{DeviceFilm, Gpu};

/// A picture on the device.
#[derive(Clone)]
pub(super) struct Prepared {
    pub(super) picture: LinearPicture,
    /// The same, if it was made on the host.
    pub(super) image: Option<Arc<Image>>,
    /// Whether something of it was seen from elsewhere, or in another size.
    pub(super) is_carried: bool,
    /// Why its noise was not taken out as was wished.
    pub(super) failure: Option<String>,
}

impl Prepared {
    pub(super) fn of(developer: &Developer, image: impl Into<Arc<Image>>) -> Self {
        let image = image.into();
        let picture = LinearPicture::of_image(&developer.gpu, &image);
        Self { picture, image: Some(image), is_carried: false, failure: None }
    }

    fn on_device(picture: LinearPicture) -> Self {
        Self { picture, image: None, is_carried: false, failure: None }
    }
}

/// Seconds of work on a view during which a device that can filter uses the built-in filter: it is the quickest.
const YOUNG_SECONDS: f64 = 1.0;

/// Most pixels of a picture that is made for a moment: software develops a million of them in a tenth of a second.
pub(super) fn max_pixels(developer: &Developer) -> u32 {
    if developer.gpu.facts().is_software() { 1 << 18 } else { 1 << 20 }
}

/// What a linear picture is made from.
pub(super) struct Source {
    pub(super) session: SessionSnapshot,
    backdrop: Option<Backdrop>,
    denoiser: Option<Denoiser>,
    /// Whether every pixel has a sample and the picture its full size.
    is_whole: bool,
    /// How many of its pixels are as wide as one that is made ready.
    pub(super) coarseness: u32,
    /// The surfaces of its view, where they are known in more detail.
    pub(super) fine: Option<Arc<FineGuides>>,
}

/// Tells sources apart: equal ones give the same picture. It keeps no film in memory.
#[derive(Clone, PartialEq)]
pub(super) struct SourceKey {
    film: Same,
    backdrop: Option<(Same, f32)>,
    denoiser: Option<Denoiser>,
    is_whole: bool,
    coarseness: u32,
}

/// The very same film.
#[derive(Clone)]
struct Same(Weak<Film>);

impl PartialEq for Same {
    fn eq(&self, other: &Self) -> bool {
        self.0.ptr_eq(&other.0)
    }
}

impl Source {
    pub(super) fn main(order: &Order) -> Self {
        let snapshot = &order.snapshot;
        let (session, backdrop) = (snapshot.main.clone(), snapshot.backdrop.clone());
        let Film { width, height, .. } = *session.film;
        let is_on_device =
            snapshot.seconds() < YOUNG_SECONDS && order.developer.can_denoise(width, height);
        let denoiser = order.denoiser.map(|it| if is_on_device { Denoiser::ATrous } else { it });
        let is_whole = snapshot.is_whole();
        Self { session, backdrop, denoiser, is_whole, coarseness: 1, fine: None }
    }

    pub(super) fn plain(order: &Order) -> Option<Self> {
        let session = order.snapshot.plain.clone().filter(SessionSnapshot::is_begun)?;
        let is_whole = session.samples > 0;
        let (backdrop, denoiser) = (None, order.denoiser);
        Some(Self { session, backdrop, denoiser, is_whole, coarseness: 1, fine: None })
    }

    pub(super) fn key(&self) -> SourceKey {
        let same = |film: &Arc<Film>| Same(Arc::downgrade(film));
        let of_backdrop = |it: &Backdrop| (same(&it.film), it.worth);
        let (film, backdrop) = (same(&self.session.film), self.backdrop.as_ref().map(of_backdrop));
        let Self { denoiser, is_whole, coarseness, .. } = *self;
        SourceKey { film, backdrop, denoiser, is_whole, coarseness }
    }

    /// Whether nothing that it is made from has light enough for an exposure; a film on the device is not
    /// asked.
    pub(super) fn is_dark(&self) -> bool {
        let is_dark = |backdrop: &Backdrop| backdrop.film.is_dark();
        self.session.on_device.is_none()
            && self.session.film.is_dark()
            && self.backdrop.as_ref().is_none_or(is_dark)
    }

    /// The picture on the device, without noise if that is asked for; `None` if that was cancelled.
    pub(super) fn prepare(&self, developer: &Developer, cancel: &AtomicBool) -> Option<Prepared> {
        let film = &self.session.film;
        if self.coarseness > 1 {
            let (every, size) = (self.coarseness, [film.width, film.height]);
            let coarse = |film: &Arc<Film>| Arc::new(film.in_larger_pixels(every));
            let session = SessionSnapshot { film: coarse(film), ..self.session.clone() };
            let with_film = |of: &Backdrop| Backdrop { film: coarse(&of.film), ..*of };
            let backdrop = self.backdrop.as_ref().map(with_film);
            let other = self.backdrop.as_ref().map(|backdrop| &*backdrop.film);
            let fine = FineGuides::of(film, other, max_pixels(developer)).map(Arc::new);
            let is_fine = fine.is_some();
            let small = Self { session, backdrop, is_whole: false, coarseness: 1, fine, ..*self };
            let small = small.prepare(developer, cancel)?;
            let image = small.image.as_ref().filter(|_| !is_fine);
            let enlarged = image.map(|image| Prepared::of(developer, image.enlarged(every, size)));
            return Some(enlarged.unwrap_or(small));
        }
        let gpu = &developer.gpu;
        let is_here = |(its, _): &&(Gpu, DeviceFilm)| {
            its.is_same(gpu) && LinearPicture::fits(gpu, film.width, film.height)
        };
        let noisy = |layers| match self.session.on_device.as_ref().filter(is_here) {
            Some((_, film)) => LinearPicture { film: film.clone(), is_live: true },
            None => LinearPicture::of_film(gpu, film, layers),
        };
        let other = self.backdrop.as_ref().map(|backdrop| (&*backdrop.film, backdrop.worth));
        let raw = || Prepared::of(developer, film.without_gaps().image());
        Some(match self.denoiser {
            None if self.is_whole => Prepared::on_device(noisy(false)),
            None => raw(),
            Some(Denoiser::ATrous)
                if self.is_whole
                    && other.is_none()
                    && developer.can_denoise(film.width, film.height) =>
            {
                Prepared::on_device(developer.denoised(&noisy(true)))
            }
            Some(denoiser) => match denoiser.preview(film, other, self.fine.as_deref(), cancel) {
                Ok(image) => Prepared::of(developer, image?),
                Err(failure) => Prepared { failure: Some(failure.to_string()), ..raw() },
            },
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec3;

    use super::*;
    use crate::denoise::quick;
    use crate::develop::tests::developer;
    use crate::path::{FirstHit, PathResult};
    use crate::render::{Figures, Sampling};

    pub(in crate::app::presenter) fn session(film: Film) -> SessionSnapshot {
        SessionSnapshot {
            samples: 1,
            sampling: Sampling::Plain,
            film: Arc::new(film),
            figures: Figures::default(),
            comparable_seconds: None,
            noise: 0.0,
            invalid_samples: 0,
            grid: None,
            gpu: None,
            on_device: None,
        }
    }

    /// A wall with light that is the pixel's own, in every so-manyth column.
    pub(in crate::app::presenter) fn film(width: u32, every: u32, samples: u32) -> Film {
        film_of([width, 8], every, samples)
    }

    fn film_of([width, height]: [u32; 2], every: u32, samples: u32) -> Film {
        let mut film = Film::new(width, height, true);
        for (y, x) in
            (0..height).flat_map(|y| (0..width).step_by(every as usize).map(move |x| (y, x)))
        {
            for sample in 0..samples {
                let radiance = Vec3::splat(((x * 7 + y * 5 + sample * 3) % 11) as f32);
                let (albedo, normal, depth) = (Vec3::splat(0.5), Vec3::Z, 1.0);
                let first_hit = Some(FirstHit { albedo, normal, depth });
                film.add(x, y, &PathResult { radiance, first_hit, ..PathResult::default() });
            }
        }
        film
    }

    #[test]
    fn a_cached_picture_of_all_pixels_is_filtered_with_what_there_is_of_the_exact_one() {
        let Some(developer) = developer() else { return };
        let never = AtomicBool::new(false);
        let prepared = |own: Film, other: Film, is_whole| {
            let (samples, film) = (other.total_samples(), Arc::new(other));
            let backdrop = Some(Backdrop { film, samples, worth: 4.0 });
            let (session, denoiser) = (session(own), Some(Denoiser::ATrous));
            let source =
                Source { session, backdrop, denoiser, is_whole, coarseness: 1, fine: None };
            let prepared = source.prepare(&developer, &never);
            let prepared = prepared.expect("not cancelled");
            prepared.image.expect("made on the host").pixels.clone()
        };
        let (holes, whole, cached) = (film(12, 2, 1), film(12, 1, 1), film(12, 1, 2));
        let filtered = |film, other| quick(film, Some((other, 4.0))).pixels;
        assert_eq!(prepared(whole.clone(), cached.clone(), true), filtered(&whole, &cached));
        assert_eq!(prepared(holes.clone(), cached.clone(), false), filtered(&holes, &cached));
        // The cached one has holes, too.
        let larger = holes.in_larger_pixels(2);
        let enlarged = quick(&larger, Some((&larger, 4.0))).enlarged(2, [12, 8]).pixels;
        assert_eq!(prepared(holes.clone(), holes.clone(), false), enlarged);
    }

    #[test]
    fn a_film_on_the_same_device_is_shown_as_it_is_and_others_are_uploaded() {
        let Some((developer, other)) = developer().zip(developer()) else { return };
        let mut session = session(Film::new(6, 4, true));
        let is_live = |developer: &Developer, session: &SessionSnapshot, denoiser| {
            let session = session.clone();
            let (backdrop, coarseness) = (None, 1);
            let source =
                Source { session, backdrop, denoiser, is_whole: true, coarseness, fine: None };
            let prepared = source.prepare(developer, &AtomicBool::new(false));
            prepared.expect("not cancelled").picture.is_live
        };
        assert!(!is_live(&developer, &session, None));
        let uploaded = LinearPicture::of_film(&developer.gpu, &session.film, true);
        session.on_device = Some((developer.gpu.clone(), uploaded.film.clone()));
        assert!(is_live(&developer, &session, None));
        assert!(!is_live(&other, &session, None));
        assert!(!is_live(&developer, &session, Some(Denoiser::ATrous)));
        developer.gpu.check().and(other.gpu.check()).expect("no buffer is used elsewhere");
    }
}
