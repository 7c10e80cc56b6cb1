//! The last whole picture, carried to where the camera goes: it is shown until that view is rendered.

use std::sync::Arc;

use rayon::prelude::*;

use super::order::Order;
use super::source::{Prepared, max_pixels};
use crate::app::worker::{Activity, Request, Snapshot};
use crate::color::luminance;
use crate::denoise::FineGuides;
use crate::image::Image;
use crate::render::View;
use crate::render::keyframe::Keyframe;

/// Most pixels that are carried for each picture of a movement.
const MAX_PIXELS: u64 = 1 << 20;
/// Weight of a carried picture in samples a pixel. It falls to zero while the new picture takes four times as many.
const WORTH: f64 = 4.0;
/// Largest weight of a picture of another size through the same camera; smaller if that has fewer samples.
const MAX_WORTH: f64 = 64.0;
/// Width in pixels of a picture that only gives colours.
const BLURRED_WIDTH: u32 = 8;
/// Pixels along an edge of the blocks whose light is compared.
const BLOCK: usize = 16;
/// By what share of their light blocks may differ before what is carried counts less, and where it counts nothing, once
/// pixels have a sample. With fewer samples noise alone makes larger differences.
const DIFFERENCES: [f32; 2] = [0.06, 0.2];

/// The last whole picture, and that of the view before, which it takes the place of.
#[derive(Default)]
pub(super) struct Carried {
    last: Option<Whole>,
    before: Option<Whole>,
    /// The surfaces of the last whole picture, and what it was rendered for. They are the same in another light.
    fine: Option<(Arc<Request>, Arc<FineGuides>)>,
    /// The last small picture of the movement that goes on.
    small: Option<Arc<Image>>,
}

/// A whole picture.
struct Whole {
    /// What it was rendered for.
    request: Arc<Request>,
    keyframe: Keyframe,
    /// The picture with a few pixels: colours for what it does not show.
    blurred: Image,
    /// A pixel, in the mean.
    samples: f64,
}

impl Whole {
    fn new(snapshot: &Snapshot, image: Arc<Image>) -> Option<Self> {
        let (request, film) = (&snapshot.request, &snapshot.main.film);
        let blurred = image.shrunk(BLURRED_WIDTH);
        let keyframe = Keyframe::new(&request.world, &request.view, film, image)?;
        let samples = snapshot.film_samples();
        Some(Self { request: Arc::clone(request), keyframe, blurred, samples })
    }

    /// Its weight in samples a pixel beside a picture of `view` with `samples` of its own.
    fn worth(&self, view: &View, samples: f64) -> f64 {
        let is_resized = self.request.view.camera == view.camera;
        let worth = if is_resized { self.samples.min(MAX_WORTH) } else { WORTH };
        (worth - samples / 4.0).max(0.0)
    }
}

impl Carried {
    /// Adds what was seen before to a picture, and keeps the result for the next ones.
    pub(super) fn carry(&mut self, order: &Order, own: Prepared) -> Prepared {
        if !order.latest().previews {
            return own;
        }
        self.leave_others(order.latest());
        self.small = own.image.clone().filter(|_| order.latest().moving);
        let completed = self.complete(order, own);
        if order.ahead.is_none() {
            self.keep(order, completed.image.as_ref());
        }
        completed
    }

    /// What the last picture shows of the view of the request ahead; `None` if that is less than half. In a movement its
    /// small picture shows the rest.
    pub(super) fn ahead(&self, order: &Order) -> Option<Image> {
        let request = order.ahead.as_ref()?;
        let is_of_use =
            |last: &&Whole| last.request.is_seen_like(request) && last.request.view != request.view;
        let last = self.last.as_ref().filter(is_of_use)?;
        let view = carried_view(&request.view);
        let seen = last.keyframe.seen_in(&view, None);
        let is_half = 2 * seen.iter().flatten().count() >= seen.len();
        let unseen = self.small.as_deref().unwrap_or(&last.blurred);
        is_half.then(|| under(&seen, unseen, [view.width, view.height]))
    }

    /// The surfaces of a picture that has fewer pixels than its view, if they were seen before.
    pub(super) fn fine_of(&self, order: &Order) -> Option<Arc<FineGuides>> {
        let (of, fine) = self.fine.as_ref()?;
        let is_of_use = !order.snapshot.is_whole() && of.has_surfaces_of(&order.snapshot.request);
        is_of_use.then(|| Arc::clone(fine))
    }

    /// Keeps what is seen, if it is a whole picture at rest.
    fn keep(&mut self, order: &Order, image: Option<&Arc<Image>>) {
        let snapshot = &*order.snapshot;
        let (request, film) = (&snapshot.request, &snapshot.main.film);
        let is_part = request.view.crop.is_some();
        if is_part || !snapshot.is_lasting() || film.min_samples() == 0 {
            return;
        }
        let other = snapshot.backdrop.as_ref().map(|backdrop| &*backdrop.film);
        let fine = FineGuides::of(film, other, max_pixels(&order.developer));
        self.fine = fine.map(|fine| (Arc::clone(request), Arc::new(fine)));
        let image = image.cloned().unwrap_or_else(|| Arc::new(film.image()));
        if self.last.as_ref().is_some_and(|last| last.request.view != request.view) {
            self.before = self.last.take();
        }
        self.before.take_if(|before| before.worth(&request.view, snapshot.film_samples()) == 0.0);
        self.last = Whole::new(snapshot, image);
    }

    /// Lets go of pictures of another scene, or under another light, and of surfaces that are not seen any more.
    fn leave_others(&mut self, request: &Request) {
        for whole in [&mut self.last, &mut self.before] {
            whole.take_if(|whole| !whole.request.is_seen_like(request));
        }
        self.fine.take_if(|(of, _)| !of.has_surfaces_of(request));
    }

    /// A picture with what was seen before from elsewhere. A small one of a movement shows only what was not seen, in the
    /// view of `ahead` if that is newer; one at rest takes the place of what was seen as it gets samples.
    fn complete(&self, order: &Order, own: Prepared) -> Prepared {
        let (snapshot, film) = (&order.snapshot, &order.snapshot.main.film);
        let request = order.latest();
        let view = &request.view;
        let is_of_view = |last: &&Whole| last.request.view == *view;
        let shown = self.last.as_ref().filter(|last| request.moving || !is_of_view(last));
        let shown = shown.or(self.before.as_ref());
        let (Some(whole), Some(image)) = (shown, &own.image) else { return own };
        let is_complete = (image.width, image.height) == (view.width, view.height);
        let completed = if request.moving || !is_complete {
            let view = carried_view(view);
            let met = Some(&**film).filter(|_| order.ahead.is_none());
            under(&whole.keyframe.seen_in(&view, met), image, [view.width, view.height])
        } else {
            let samples = snapshot.film_samples();
            let worth = whole.worth(view, samples);
            let is_compared = order.compared.is_some() || snapshot.plain.is_some();
            let is_raw = order.denoiser.is_none() && snapshot.is_whole();
            let is_over = worth == 0.0 || snapshot.activity == Activity::Done;
            if is_over || is_raw || is_compared || is_of_view(&whole) {
                return own;
            }
            faded(&whole.keyframe.seen_in(view, Some(film)), image, samples as f32, worth as f32)
        };
        Prepared {
            is_carried: true,
            failure: own.failure,
            ..Prepared::of(&order.developer, completed)
        }
    }
}

/// A movement's view in the size in which pictures are carried.
fn carried_view(view: &View) -> View {
    let shrink = (view.pixels() as f64 / MAX_PIXELS as f64).sqrt().ceil().max(1.0) as u32;
    view.of_size(view.width / shrink, view.height / shrink)
}

/// What is seen, and a smaller picture of the same view where there is nothing.
fn under(seen: &[Option<[f32; 3]>], small: &Image, [width, height]: [u32; 2]) -> Image {
    let scale = [small.width as f32 / width as f32, small.height as f32 / height as f32];
    let color = |(at, seen): (usize, &Option<[f32; 3]>)| {
        seen.unwrap_or_else(|| {
            let place = [at % width as usize, at / width as usize];
            small.between([0, 1].map(|i| (place[i] as f32 + 0.5) * scale[i] - 0.5))
        })
    };
    let pixels = seen.par_iter().enumerate().map(color).collect();
    Image { width, height, pixels }
}

/// The weighted mean of a picture and of what is seen, where both agree. Weights are samples a pixel: `samples` of the
/// picture, `worth` of what is seen.
fn faded(seen: &[Option<[f32; 3]>], own: &Image, samples: f32, worth: f32) -> Image {
    let noise = samples.min(1.0).sqrt().recip();
    let agreement = agreement(seen, own, DIFFERENCES.map(|difference| noise * difference));
    let color = |((at, seen), own_): ((usize, &Option<[f32; 3]>), &[f32; 3])| {
        let Some(seen) = seen else { return *own_ };
        let place = [at % own.width as usize, at / own.width as usize];
        let in_blocks = place.map(|place| (place as f32 + 0.5) / BLOCK as f32 - 0.5);
        let worth = worth * agreement.between(in_blocks)[0];
        let share = if worth > 0.0 { worth / (worth + samples) } else { 0.0 };
        std::array::from_fn(|i| own_[i] + share * (seen[i] - own_[i]))
    };
    let pixels = seen.par_iter().enumerate().zip(&own.pixels).map(color).collect();
    Image { width: own.width, height: own.height, pixels }
}

/// How far blocks of a picture agree with what is seen there, 0 to 1 in all channels: 1 up to the first of two relative
/// differences, 0 from the second on.
fn agreement(seen: &[Option<[f32; 3]>], own: &Image, [least, most]: [f32; 2]) -> Image {
    let (width, height) = (own.width as usize, own.height as usize);
    let count = [width.div_ceil(BLOCK), height.div_ceil(BLOCK)];
    let of_block = |block: usize| {
        let [left, top] = [block % count[0] * BLOCK, block / count[0] * BLOCK];
        let (mut lights, mut apart) = (0.0_f32, 0.0_f32);
        for y in top..(top + BLOCK).min(height) {
            for at in y * width + left..y * width + (left + BLOCK).min(width) {
                if let Some(seen) = seen[at] {
                    let [seen, own] = [seen, own.pixels[at]].map(|color| luminance(color.into()));
                    lights += own.max(seen);
                    apart += own - seen;
                }
            }
        }
        // Where nothing is seen, blocks beside this one count less.
        let difference = if lights > 0.0 { apart.abs() / lights } else { 1.0 };
        [1.0 - ((difference - least) / (most - least)).clamp(0.0, 1.0); 3]
    };
    let pixels = (0..count[0] * count[1]).into_par_iter().map(of_block).collect();
    Image { width: count[0] as u32, height: count[1] as u32, pixels }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::app::presenter::order::tests::order_of;
    use crate::app::presenter::source::Source;
    use crate::app::presenter::source::tests::session;
    use crate::app::worker::SessionSnapshot;
    use crate::app::worker::tests::{request_of, snapshot_of};
    use crate::denoise::{Denoiser, quick};
    use crate::develop::tests::developer;
    use crate::render::film::Film;
    use crate::render::{Figures, Session};

    fn rendered(request: &Request, size: [u32; 2], samples: u32) -> Film {
        let view = View { layers: true, ..request.view.of_size(size[0], size[1]) };
        let mut session = Session::new(&request.world, &request.environment, view);
        session.finish_learning();
        session.advance(samples, &AtomicBool::new(false)).expect("rendered");
        session.film().clone()
    }

    #[test]
    fn a_moving_camera_takes_the_last_picture_along() {
        let Some(developer) = developer().map(Arc::new) else { return };
        let still = request_of("office", [48, 36]);
        let film = rendered(&still, [48, 36], 4);
        let snapshot = |request: &Request, film: &Film| {
            let figures = Figures { samples: film.total_samples(), ..Figures::default() };
            let session = SessionSnapshot { figures, ..session(film.clone()) };
            snapshot_of(&Arc::new(request.clone()), session)
        };
        let mut carried = Carried::default();
        let own = |film: &Film| {
            let grey = Image { pixels: vec![[0.5; 3]; film.pixels().len()], ..film.image() };
            Prepared::of(&developer, grey)
        };
        let image_of = |prepared: Prepared| prepared.image.expect("made on the host");
        let order = |request: &Request, film: &Film| Order {
            denoiser: Some(Denoiser::ATrous),
            ..order_of(&developer, snapshot(request, film))
        };
        let complete = |carried: &Carried, request: &Request, film: &Film| {
            image_of(carried.complete(&order(request, film), own(film)))
        };

        let mut moving = Request { moving: true, previews: true, ..still.clone() };
        let small = rendered(&moving, [12, 9], 1);
        let alone = complete(&carried, &moving, &small);
        assert_eq!((alone.width, alone.pixels[0]), (12, [0.5; 3]), "nothing is known yet");
        carried.keep(&order(&moving, &small), None);
        assert!(carried.last.is_none(), "a small picture is not kept");
        carried.keep(&order(&still, &film), None);

        // A step to the side.
        moving.view.camera.world_from_camera.translation.x += 0.05;
        let small = rendered(&moving, [12, 9], 1);
        let along = complete(&carried, &moving, &small);
        let share = |image: &Image| {
            let own = image.pixels.iter().filter(|pixel| **pixel == [0.5; 3]).count();
            own as f64 / image.pixels.len() as f64
        };
        assert_eq!((along.width, along.height), (48, 36));
        assert!(share(&along) < 0.2, "{}", share(&along));

        // The window has moved on: what was seen is where it will be.
        let mut later = moving.clone();
        later.view.camera.world_from_camera.translation.x += 0.05;
        let ahead = Some(Arc::new(later.clone()));
        let onward = carried.complete(&Order { ahead, ..order(&moving, &small) }, own(&small));
        let there = carried.complete(&order(&later, &rendered(&later, [12, 9], 1)), own(&small));
        let apart = |a: &Image, b: &Image| {
            a.pixels.iter().zip(&b.pixels).filter(|(a, b)| a != b).count() as f64 / 1728.0
        };
        let (onward, there) = (image_of(onward), image_of(there));
        let (same, other) = (apart(&onward, &there), apart(&onward, &along));
        assert!(same < 0.1 && other > 0.5, "{same}, {other}");
        // The small picture shows what is not seen, as soon as there is one.
        let turned = glam::Affine3A::from_rotation_y(0.3);
        later.view.camera.world_from_camera.matrix3 *= turned.matrix3;
        let seen = |carried: &Carried| {
            let ahead = Some(Arc::new(later.clone()));
            carried.ahead(&Order { ahead, ..order(&moving, &small) }).expect("most is seen")
        };
        let before = seen(&carried);
        carried.carry(&order(&moving, &small), own(&small));
        let changed = apart(&seen(&carried), &before);
        assert!(changed > 0.1 && changed < 0.5, "{changed}");

        // At rest the new picture takes its place, where it differs at once.
        let rest = Request { moving: false, ..moving.clone() };
        let of_truth = |carried: &Carried, film: &Film| {
            let prepared = Prepared::of(&developer, film.image());
            image_of(carried.complete(&order(&rest, film), prepared))
        };
        let (few, many) = (rendered(&rest, [48, 36], 1), rendered(&rest, [48, 36], 16));
        assert_ne!(*of_truth(&carried, &few), few.image());
        assert_eq!(*of_truth(&carried, &many), many.image());
        assert!(share(&complete(&carried, &rest, &few)) > 0.8, "it agrees nowhere");
        assert!(!carried.complete(&order(&rest, &many), own(&many)).is_carried, "it may be kept");
        // It fades out, though the new picture is kept by now.
        carried.keep(&order(&rest, &few), None);
        assert_ne!(*of_truth(&carried, &few), few.image());
        carried.keep(&order(&rest, &many), None);
        assert_eq!(*of_truth(&carried, &few), few.image());
        // A camera that jumps: what it will see is known, unless it turns away.
        let mut carried = Carried::default();
        carried.keep(&order(&still, &film), None);
        let ahead = |change: &dyn Fn(&mut View)| {
            let mut request = still.clone();
            change(&mut request.view);
            let ahead = Some(Arc::new(request));
            carried.ahead(&Order { ahead, ..order(&still, &film) })
        };
        let aside = ahead(&|view| view.camera.world_from_camera.translation.x += 0.1);
        let aside = aside.expect("most is seen");
        assert_eq!((aside.width, aside.height), (48, 36));
        assert!(aside.pixels.as_flattened().iter().all(|value| value.is_finite()));
        let turned = glam::Affine3A::from_rotation_y(3.0);
        let away = ahead(&|view| view.camera.world_from_camera.matrix3 *= turned.matrix3);
        assert!(away.is_none() && ahead(&|_| ()).is_none(), "nothing of it is seen, or all");
        // A window of another size.
        let mut carried = Carried::default();
        carried.keep(&order(&still, &film), None);
        let mut wide = still.clone();
        (wide.view.width, wide.view.height) = (64, 36);
        let begun = complete(&carried, &wide, &small);
        assert_eq!((begun.width, begun.pixels[0]), (64, [0.5; 3]), "the sides are not known");
        let middle = begun.at(32, 18);
        let before = film.image().at(24, 18);
        let apart = middle.iter().zip(before).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 0.05, "{middle:?}, {before:?}");

        let other = Request { environment: request_of("open", [4, 4]).environment, ..still };
        carried.leave_others(&other);
        assert!(carried.last.is_none() && carried.before.is_none(), "the light is another");
    }

    /// The first picture in another light has an eighth of the pixels along each side.
    #[test]
    fn in_another_light_outlines_and_patterns_are_those_of_the_last_whole_picture() {
        let Some(developer) = developer().map(Arc::new) else { return };
        let still = request_of("office", [192, 144]);
        let order = |request: &Request, film: Film| {
            let session = session(film);
            let snapshot = snapshot_of(&Arc::new(request.clone()), session);
            Order { denoiser: Some(Denoiser::ATrous), ..order_of(&developer, snapshot) }
        };
        let mut carried = Carried::default();
        carried.keep(&order(&still, rendered(&still, [192, 144], 4)), None);
        let mut environment = (*still.environment).clone();
        environment.set_rotation(2.0);
        let turned = Request { environment: Arc::new(environment), moving: true, ..still.clone() };
        let truth = quick(&rendered(&turned, [192, 144], 32), None);
        let small = order(&turned, rendered(&turned, [24, 18], 16));
        let fine = carried.fine_of(&small).expect("its surfaces are known");
        let shown = |fine| {
            let mut source = Source::main(&small);
            source.fine = fine;
            source.prepare(&developer, &AtomicBool::new(false)).expect("not cancelled").image
        };
        // How far luminances are apart within the small picture's pixels: light as a whole is left out.
        let error = |image: &Image| {
            let ratio = |x: u32, y: u32| {
                let scale = [image.width as f32 / 192.0, image.height as f32 / 144.0];
                let place = [x, y].map(|at| at as f32 + 0.5);
                let own = image.between([0, 1].map(|i| place[i] * scale[i] - 0.5));
                let [own, truth] = [own, truth.at(x, y)].map(|color| luminance(color.into()));
                f64::from(own.max(1e-9) / truth.max(1e-9)).ln()
            };
            let of_block = |block: u32| {
                let [left, top] = [block % 24 * 8, block / 24 * 8];
                let pixels = (0..64).map(|at| ratio(left + at % 8, top + at / 8));
                let ratios: Vec<f64> = pixels.collect();
                let mean = ratios.iter().sum::<f64>() / 64.0;
                ratios.iter().map(|ratio| (ratio - mean).abs()).sum::<f64>() / 64.0
            };
            (0..432).map(of_block).sum::<f64>() / 432.0
        };
        let [plain, fine] = [None, Some(fine)].map(|fine| shown(fine).expect("on the host"));
        assert_eq!(
            ([plain.width, plain.height], [fine.width, fine.height]),
            ([24, 18], [192, 144])
        );
        let [plain, fine] = [plain, fine].map(|image| error(&image));
        eprintln!("errors of luminance: {plain:.3} enlarged, {fine:.3} in its surfaces");
        assert!(fine < 0.85 * plain, "{fine}, {plain}");

        let is_known = |request: &Request, size| {
            carried.fine_of(&order(request, rendered(request, size, 1))).is_some()
        };
        let mut aside = turned.clone();
        aside.view.camera.world_from_camera.translation.x += 0.1;
        assert!(!is_known(&aside, [24, 18]), "other surfaces are seen");
        assert!(!is_known(&still, [192, 144]), "it has its own");
        assert!(
            !is_known(&request_of("office", [192, 144]), [24, 18]),
            "nobody knows that it is the same"
        );
    }
}
