//! What a picture is made from, and how.

use std::sync::{Arc, Weak};

use super::order::Order;
use crate::app::worker::{Backdrop, Origin, SessionSnapshot};
use crate::denoise::{Denoiser, blend};
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
    pub(super) fn of(developer: &Developer, image: Image) -> Self {
        let picture = developer.upload_image(&image);
        Self { picture, image: Some(Arc::new(image)), is_carried: false, failure: None }
    }

    fn on_device(picture: LinearPicture) -> Self {
        Self { picture, image: None, is_carried: false, failure: None }
    }
}

/// A filtered picture is as good as the blend of so many times its samples.
const FILTER_WORTH: u64 = 4;

/// A sample of a smaller picture says as much as so many of pixels here and there.
const DOTS_WORTH: u64 = 4;

/// A whole picture of n samples a pixel is as good as a smaller one of so many times n times its own samples: in
/// the office and the living room, at half the width, one sample as two to four, two as seven to twelve, and
/// four as thirty, for what is small is blurred.
const WHOLE_WORTH: f64 = 0.6;

/// What a linear picture is made from.
pub(super) struct Source {
    pub(super) session: SessionSnapshot,
    backdrop: Option<Backdrop>,
    denoiser: Option<Denoiser>,
    /// Whether every pixel has a sample and the picture its full size.
    is_whole: bool,
}

/// Tells sources apart: equal ones give the same picture. It keeps no film in memory.
#[derive(Clone)]
pub(super) struct SourceKey {
    film: Weak<Film>,
    backdrop: Option<(Weak<Film>, f32, Origin)>,
    denoiser: Option<Denoiser>,
    is_whole: bool,
}

impl PartialEq for SourceKey {
    fn eq(&self, other: &Self) -> bool {
        let is_alike = match (&self.backdrop, &other.backdrop) {
            (Some((film, worth, origin)), Some(other)) => {
                film.ptr_eq(&other.0) && (*worth, *origin) == (other.1, other.2)
            }
            (own, other) => own.is_none() && other.is_none(),
        };
        is_alike
            && self.film.ptr_eq(&other.film)
            && (self.denoiser, self.is_whole) == (other.denoiser, other.is_whole)
    }
}

impl Source {
    pub(super) fn main(order: &Order) -> Self {
        let snapshot = &order.snapshot;
        // Where there are no samples, the film is that from before.
        let backdrop = snapshot.backdrop.clone();
        let backdrop =
            backdrop.filter(|backdrop| !Arc::ptr_eq(&backdrop.film, &snapshot.main.film));
        let session = snapshot.main.clone();
        Self { session, backdrop, denoiser: order.denoiser, is_whole: snapshot.is_whole() }
    }

    pub(super) fn plain(order: &Order) -> Option<Self> {
        let session = order.snapshot.plain.clone().filter(SessionSnapshot::is_begun)?;
        let is_whole = session.samples > 0;
        Some(Self { session, backdrop: None, denoiser: order.denoiser, is_whole })
    }

    pub(super) fn key(&self) -> SourceKey {
        let of_backdrop = |it: &Backdrop| (Arc::downgrade(&it.film), it.worth, it.origin);
        SourceKey {
            film: Arc::downgrade(&self.session.film),
            backdrop: self.backdrop.as_ref().map(of_backdrop),
            denoiser: self.denoiser,
            is_whole: self.is_whole,
        }
    }

    /// Whether nothing that it is made from has light enough for an exposure; a film on the device is not
    /// asked.
    pub(super) fn is_dark(&self) -> bool {
        let is_dark = |backdrop: &Backdrop| backdrop.film.is_dark();
        self.session.on_device.is_none()
            && self.session.film.is_dark()
            && self.backdrop.as_ref().is_none_or(is_dark)
    }

    /// Whether the film has too few samples to be seen in place of a smaller picture of this view. As long as
    /// pixels have none, those that have one would be dots in it.
    fn is_behind(&self, before: &Film) -> bool {
        let film = &self.session.film;
        let shape = |film: &Film| f64::from(film.width) / f64::from(film.height);
        let is_alike = (shape(before) / shape(film) - 1.0).abs() < 0.05;
        let [own, other] = [film, before].map(Film::total_samples);
        before.width < film.width
            && before.min_samples() > 0
            && is_alike
            && if self.is_whole {
                let own = own as f64;
                WHOLE_WORTH * own * (own / film.pixels().len() as f64) < other as f64
            } else {
                own < DOTS_WORTH * other
            }
    }

    fn is_of(&self, origin: Origin) -> bool {
        self.backdrop.as_ref().is_some_and(|backdrop| backdrop.origin == origin)
    }

    /// The picture on the device, without noise if that is asked for.
    pub(super) fn prepare(&self, developer: &Developer) -> Prepared {
        let film = &self.session.film;
        let is_here = |(gpu, _): &&(Gpu, DeviceFilm)| gpu.is_same(developer.gpu());
        let noisy = |layers| match self.session.on_device.as_ref().filter(is_here) {
            Some((_, on_device)) if developer.can_show(film.width, film.height) => {
                LinearPicture::live(on_device.clone())
            }
            _ => developer.upload_film(film, layers),
        };
        let backdrop = self.backdrop.as_ref().map(|backdrop| (&*backdrop.film, backdrop.worth));
        let ahead = backdrop.filter(|(before, _)| self.is_behind(before));
        let (film, backdrop) = ahead.map_or((&**film, backdrop), |(before, _)| (before, None));
        let blended = || Prepared::of(developer, blend(film, backdrop));
        // Filters take whole films of one size.
        let has_all = film.min_samples() > 0;
        let other = backdrop.filter(|(other, worth)| {
            film.is_alike(other) && *worth > 0.0 && (has_all || other.min_samples() > 0)
        });
        let is_blended = other.is_some() && !self.is_of(Origin::Before);
        let is_surpassed =
            |(other, _): (&Film, f32)| other.total_samples() <= FILTER_WORTH * film.total_samples();
        let can_filter = other.is_some() || (has_all && backdrop.is_none_or(is_surpassed));
        match self.denoiser {
            None if self.is_whole => Prepared::on_device(noisy(false)),
            Some(Denoiser::ATrous)
                if self.is_whole
                    && ahead.is_none()
                    && !is_blended
                    && developer.can_denoise(film.width, film.height) =>
            {
                Prepared::on_device(developer.denoised(&noisy(true)))
            }
            // A picture with holes or in other pixels is there to see where one is going.
            None => blended(),
            Some(_) if !can_filter => blended(),
            Some(denoiser) => match denoiser.denoise(film, other) {
                Ok(image) => Prepared::of(developer, image),
                Err(failure) => Prepared { failure: Some(failure.to_string()), ..blended() },
            },
        }
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
        let prepared = |own: Film, other: Film, is_whole| {
            let (samples, film) = (other.total_samples(), Arc::new(other));
            let backdrop = Some(Backdrop { film, samples, worth: 4.0, origin: Origin::Cache });
            let (session, denoiser) = (session(own), Some(Denoiser::ATrous));
            let prepared = Source { session, backdrop, denoiser, is_whole }.prepare(&developer);
            prepared.image.expect("made on the host").pixels.clone()
        };
        let (holes, whole, cached, large) =
            (film(12, 2, 1), film(12, 1, 1), film(12, 1, 2), film(16, 1, 9));
        let filtered = |film, other| quick(film, Some((other, 4.0))).pixels;
        let blended = |film, other| blend(film, Some((other, 4.0))).pixels;
        assert_eq!(prepared(whole.clone(), cached.clone(), true), filtered(&whole, &cached));
        assert_eq!(prepared(holes.clone(), cached.clone(), false), filtered(&holes, &cached));
        // The cached one has holes, is larger and says more.
        assert_eq!(prepared(holes.clone(), holes.clone(), false), blended(&holes, &holes));
        assert_eq!(prepared(whole.clone(), large.clone(), true), blended(&whole, &large));
        // A smaller one with more samples is seen alone.
        let [small, many] = [9, 99].map(|samples| film_of([6, 4], 1, samples));
        assert_eq!(prepared(holes.clone(), small.clone(), false), quick(&small, None).pixels);
        assert_eq!(prepared(cached.clone(), many.clone(), true), quick(&many, None).pixels);
        let few = film_of([6, 4], 1, 3);
        assert_eq!(prepared(whole.clone(), few.clone(), true), quick(&few, None).pixels);
    }

    #[test]
    fn a_film_on_the_same_device_is_shown_as_it_is_and_others_are_uploaded() {
        let Some((developer, other)) = developer().zip(developer()) else { return };
        let mut session = session(Film::new(6, 4, true));
        let is_live = |developer: &Developer, session: &SessionSnapshot, denoiser| {
            let session = session.clone();
            let source = Source { session, backdrop: None, denoiser, is_whole: true };
            source.prepare(developer).picture.is_live()
        };
        assert!(!is_live(&developer, &session, None));
        let uploaded = developer.upload_film(&session.film, true);
        session.on_device = Some((developer.gpu().clone(), uploaded.film().clone()));
        assert!(is_live(&developer, &session, None));
        assert!(!is_live(&other, &session, None));
        assert!(!is_live(&developer, &session, Some(Denoiser::ATrous)));
        developer.gpu().check().and(other.gpu().check()).expect("no buffer is used elsewhere");
    }
}
