//! A light mix: films of each group of light add up to the picture, so a finished one is lit anew by factors.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::View;
use super::film::{Film, Pixel, Surface};
use crate::environment::Environment;
use crate::image::Image;
use crate::path::{Background, LightChoice, Lit, World};
use crate::scene::needs::SceneFeatures;
use crate::scene::{LampEdit, LampEdits, NamedLamp, Scene, named_lamps};

/// Most lamps, by the names of lights and of materials that emit, that a mix has room for: each has a film.
pub(crate) const MAX_LAMPS: usize = 16;

/// What shines in one film alone.
pub(crate) struct LightGroup {
    /// Its layer's.
    pub(crate) name: String,
    source: Source,
    /// Its map, which is black but for sky and sun.
    pub(crate) environment: Environment,
}

enum Source {
    /// The map without its sun.
    Sky,
    Sun,
    /// Point, spot and directional lights, and surfaces that emit, of a name.
    Lamp(String),
    /// What other surfaces emit or show unlit, and a colour behind them; all lamps but those of these names.
    Rest(Vec<String>),
}

/// Factors on light, as a person sets them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LightFactors {
    /// On the map.
    pub(crate) intensity: f32,
    /// On the map's sun, beside that.
    pub(crate) sun: f32,
    /// On all lamps.
    pub(crate) lamps: f32,
    /// Beside that by their names; colours are of no account.
    pub(crate) lamp_edits: LampEdits,
}

impl LightFactors {
    fn of_lamp(&self, name: &str) -> f32 {
        self.lamps * self.lamp_edits.get(name).map_or(1.0, LampEdit::brightness)
    }

    /// All lights inside a scene times their factors.
    pub(crate) fn local_lights(&self, world: &World) -> LightChoice {
        let of_lamp = |lamp: NamedLamp| (lamp.name.clone(), self.of_lamp(&lamp.name));
        let lamps: BTreeMap<_, _> = named_lamps(&world.scene.lights, &world.scene.materials)
            .into_iter()
            .map(of_lamp)
            .collect();
        match lamps.values().all(|factor| *factor == 1.0) {
            true => LightChoice::All,
            false => LightChoice::Some { surfaces: true, lamps: Arc::new(lamps) },
        }
    }
}

impl LightGroup {
    /// The groups of a scene and its map, whose factors are all 1; at least one. `parted` is that map without its sun, and
    /// with nothing else ([`Environment::parted`]).
    pub(crate) fn all_of(
        (world, environment): Lit<'_>,
        parted: [Environment; 2],
        view: &View,
    ) -> Vec<Self> {
        let mut black = environment.clone();
        black.set_intensity(0.0);
        let [sky, sun] = parted;
        let of_map = [("light.sky", Source::Sky, sky), ("light.sun", Source::Sun, sun)]
            .map(|(name, source, environment)| Self { name: name.to_owned(), source, environment });
        let mut groups: Vec<Self> =
            of_map.into_iter().filter(|group| !group.environment.is_black()).collect();
        let Scene { lights, materials, .. } = &world.scene;
        let shining: Vec<_> =
            lights.iter().filter(|it| it.intensity != Vec3::ZERO).cloned().collect();
        let mut lamps = named_lamps(&shining, materials);
        let are_all = lamps.len() <= MAX_LAMPS;
        if !are_all {
            lamps = named_lamps(&shining, &[]);
        }
        let mut names: Vec<String> = lamps.into_iter().map(|lamp| lamp.name).collect();
        names.sort_unstable();
        groups.extend(names.iter().map(|name| Self {
            name: format!("lamp.{name}"),
            source: Source::Lamp(name.clone()),
            environment: black.clone(),
        }));
        // A colour behind the scene has no factor either.
        let has_color = matches!(view.background, Background::Color(_));
        let (needs, emitters) = (world.needs, SceneFeatures::EMITTERS);
        let shines = needs.has(SceneFeatures::UNLIT) || needs.has(emitters) && !are_all;
        if shines || has_color || groups.is_empty() {
            let (name, source) = ("light.surfaces".to_owned(), Source::Rest(names));
            groups.push(Self { name, source, environment: black });
        }
        groups
    }

    /// The group's factor among these.
    pub(crate) fn factor(&self, factors: &LightFactors) -> f32 {
        match &self.source {
            Source::Sky => factors.intensity,
            Source::Sun => factors.intensity * factors.sun,
            Source::Lamp(name) => factors.of_lamp(name),
            Source::Rest(_) => 1.0,
        }
    }

    /// The view by its light alone, with layers if it is the first of all, and random numbers of its own: noise of
    /// groups must not be alike.
    pub(crate) fn view(&self, view: &View, number: u32) -> View {
        let lamps = match &self.source {
            Source::Lamp(name) => BTreeMap::from([(name.clone(), 1.0)]),
            Source::Rest(others) => others.iter().map(|name| (name.clone(), 0.0)).collect(),
            Source::Sky | Source::Sun => BTreeMap::new(),
        };
        let surfaces = matches!(self.source, Source::Rest(_));
        let background = match view.background {
            Background::Color(_) if !surfaces => Background::Color([0.0; 3]),
            background => background,
        };
        let local_lights = LightChoice::Some { surfaces, lamps: Arc::new(lamps) };
        let (seed, layers) =
            (view.seed ^ number.wrapping_mul(0x9e37_79b9), view.layers && number == 0);
        View { local_lights, background, seed, layers, ..view.clone() }
    }
}

/// What one group of light makes of a picture.
#[derive(Debug, Clone)]
pub struct GroupImage {
    /// What its layer is called.
    pub name: String,
    /// How much of it is in the picture.
    pub factor: f32,
    /// Mean radiance at factor 1.
    pub image: Image,
}

/// The sum of films of the same size, each times its factor, with as many samples as all have. Layers are the first's.
pub(crate) fn mixed(films: &[(&Film, f32)]) -> Film {
    let Some((first, _)) = films.first() else { return Film::default() };
    let of_pixel = |index: usize| {
        let (mut mean, mut variance, mut samples, mut invalid) = (DVec3::ZERO, 0.0, u32::MAX, 0);
        for (film, factor) in films {
            let (pixel, factor) = (&film.pixels()[index], f64::from(*factor));
            mean += factor * DVec3::from(pixel.mean());
            // One that is off tells nothing of the noise.
            variance += if factor > 0.0 { factor * factor * pixel.variance_of_mean() } else { 0.0 };
            samples = samples.min(pixel.samples());
            invalid += pixel.invalid;
        }
        Pixel::of_mean(mean, variance, samples, invalid)
    };
    let pixels: Vec<Pixel> = (0..first.pixels().len()).into_par_iter().map(of_pixel).collect();
    let scaled = |((surface, mixed), own): ((&Surface, &Pixel), &Pixel)| {
        let share = f64::from(mixed.samples()) / f64::from(own.samples().max(1));
        Surface::of_sums(surface.sums().map(|sum| sum * share))
    };
    let surfaces = first.surfaces.par_iter().zip(&pixels).zip(first.pixels()).map(scaled);
    let surfaces = surfaces.collect();
    Film { width: first.width, height: first.height, pixels, surfaces }
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::render::gpu::{Gpu, UploadedScene};
    use crate::render::{Phase, Session, Sharing};
    use crate::scene::{PunctualKind, PunctualLight, builtin};

    /// A room with emissive surfaces, a lamp of one name and two of another, under a sky with a sun.
    fn room() -> (World, Environment) {
        let mut scene = builtin::build("evening").expect("built in");
        // Seen as it is, one shines, too.
        let dark = scene.materials.iter_mut().find(|material| material.emissive == Vec3::ZERO);
        dark.expect("there is one").unlit = true;
        let camera = scene.cameras[0].world_from_camera;
        let eye = Vec3::from(camera.translation);
        let light = |name: &str, aside: f32| PunctualLight {
            name: name.to_owned(),
            kind: PunctualKind::Point,
            position: eye + Vec3::from(camera.matrix3.x_axis) * aside,
            direction: Vec3::NEG_Y,
            intensity: Vec3::new(0.3, 0.2, 0.1),
            range: f32::INFINITY,
        };
        scene.lights = vec![light("key", 0.5), light("fill", -0.3), light("key", 0.2)];
        let map = sky::build("day", 64, 32).expect("a sky");
        (World::new(scene), Environment::new(map, &EnvironmentOptions::default()).expect("sound"))
    }

    /// At least so many samples of each pixel.
    pub(in crate::render) fn rendered(
        lit: Lit<'_>,
        view: View,
        samples: u32,
        gpu: Option<&Gpu>,
    ) -> Film {
        let uploaded = gpu.map(|gpu| UploadedScene::new(gpu, lit.0, lit.1).expect("uploaded"));
        let mut session = Session::on(lit, view, uploaded.as_ref()).expect("begun");
        while session.phase() == Phase::Learning || session.samples() < samples {
            session.advance(16, &AtomicBool::new(false)).expect("rendered");
        }
        session.film().clone()
    }

    /// Mean luminance and its variance.
    pub(in crate::render) fn mean(film: &Film) -> [f64; 2] {
        let count = film.pixels().len() as f64;
        let sum = |of: &dyn Fn(&Pixel) -> f64| film.pixels().iter().map(of).sum::<f64>();
        [sum(&Pixel::mean_luminance) / count, sum(&Pixel::variance_of_mean) / (count * count)]
    }

    fn assert_agree(a: &Film, b: &Film, what: &str) {
        let [[a, variance], [b, other]] = [mean(a), mean(b)];
        let z = (a - b) / (variance + other).sqrt();
        assert!(z.abs() < 4.0, "{what}: {a} and {b}, {z} standard errors");
    }

    #[test]
    fn groups_add_up_to_the_picture_on_both_devices() {
        let (world, environment) = room();
        let camera = world.scene.cameras[0].clone();
        let (sharing, background) = (Sharing::Off, Background::Color([0.1; 3]));
        let view = View { sharing, background, layers: true, ..View::new(camera, [48, 32]) };
        let parted = environment.parted().expect("sound maps");
        let groups = LightGroup::all_of((&world, &environment), parted, &view);
        let names: Vec<&str> = groups.iter().map(|group| &*group.name).collect();
        let lamps = ["bright bulb", "bulb", "fill", "key", "lampshade"];
        let lamps = lamps.map(|name| format!("lamp.{name}"));
        assert_eq!(names[..2], ["light.sky", "light.sun"]);
        assert_eq!(names[2..7], lamps);
        assert_eq!(names[7..], ["light.surfaces"]);
        let all = |gpu: Option<&Gpu>| -> Vec<Film> {
            let of_group = |(number, group): (u32, &LightGroup)| {
                rendered((&world, &group.environment), group.view(&view, number), 64, gpu)
            };
            (0..).zip(&groups).map(of_group).collect()
        };
        let films = all(None);
        for (film, name) in films.iter().zip(&names) {
            assert!(mean(film)[0] > 0.0, "{name} shines");
        }
        let picture = rendered((&world, &environment), View { seed: 1, ..view.clone() }, 64, None);
        let sum = mixed(&films.iter().map(|film| (film, 1.0)).collect::<Vec<_>>());
        assert_agree(&sum, &picture, "the sum");
        assert_eq!(sum.surface_of(700), films[0].surface_of(700), "layers are the first's");
        // By other factors it is the picture of another light.
        let edits = [("key", 0.25, false), ("fill", 1.0, true), ("bulb", 0.5, false)];
        let edit = |(name, factor, off): (&str, f32, bool)| {
            (name.to_owned(), LampEdit { factor, off, ..LampEdit::default() })
        };
        let lamp_edits = edits.map(edit).into();
        let factors = LightFactors { intensity: 2.0, sun: 0.5, lamps: 3.0, lamp_edits };
        let weighted: Vec<_> =
            films.iter().zip(&groups).map(|(film, group)| (film, group.factor(&factors))).collect();
        assert_eq!(
            weighted.iter().map(|(_, factor)| *factor).collect::<Vec<_>>(),
            [2.0, 1.0, 3.0, 1.5, 0.0, 0.75, 3.0, 1.0]
        );
        let mut lit = environment.with_sun(factors.sun).expect("a sound map");
        lit.set_intensity(factors.intensity);
        let view_of_mix = View { local_lights: factors.local_lights(&world), ..view.clone() };
        let seed = 2;
        let picture = rendered((&world, &lit), View { seed, ..view_of_mix }, 64, None);
        assert_agree(&mixed(&weighted), &picture, "the mix");
        #[cfg(feature = "gpu")]
        if let Some(gpu) = Gpu::for_test() {
            for ((on_cpu, on_gpu), name) in films.iter().zip(&all(Some(&gpu))).zip(&names) {
                assert_agree(on_cpu, on_gpu, name);
            }
        }
    }

    #[test]
    fn a_mix_has_the_mean_and_the_variance_of_its_films() {
        let film = |radiance: &[f32]| {
            let mut film = Film::new(1, 1, false);
            for &x in radiance {
                let radiance = Vec3::new(x, 2.0 * x, 0.0);
                film.add(0, 0, &crate::path::PathResult { radiance, ..Default::default() });
            }
            film
        };
        let (a, b) = (film(&[1.0, 2.0, 6.0]), film(&[0.5, 1.5]));
        let mix = mixed(&[(&a, 2.0), (&b, 3.0)]);
        let [a, b, mix] = [&a, &b, &mix].map(|film| film.pixels()[0]);
        assert_eq!((mix.mean(), mix.samples()), ([9.0, 18.0, 0.0], 2));
        let variance = 4.0 * a.variance_of_mean() + 9.0 * b.variance_of_mean();
        assert!((mix.variance_of_mean() / variance - 1.0).abs() < 1e-12);
        let none = mixed(&[(&film(&[1.0, 2.0]), 1.0), (&film(&[]), 0.0)]);
        assert_eq!(none.pixels()[0].samples(), 0, "not all groups are there");
    }
}
