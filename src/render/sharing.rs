//! Whether neighbouring pixels share second vertices, and how.

use super::view::{Gi, Sampling, Sharing, View};
use super::view_probe::{ROOM_ENCLOSURE, enclosure};
use crate::path::World;
use crate::path::sharing::SharedTile;

/// Least width and height of a picture whose pixels share unasked: in a smaller one a tile is much of
/// what is seen, and what its pixels have in common shows.
const MIN_SIZE: u32 = 64;
/// Least [`enclosure`] where pixels share unasked. At equal time and 32 samples small tiles have 0.76 to
/// 0.96 of the efficiency of paths of their own where it is 0.27 to 0.48, and 1.64 where it is 0.54.
const MIN_ENCLOSURE: f32 = 0.5;
/// The same for large tiles: small ones have 1.25 times their efficiency where it is 0.54 to 0.83, and 0.74
/// to 0.97 of it where it is 0.94 to 0.99.
const LARGE_ENCLOSURE: f32 = ROOM_ENCLOSURE;

impl Sharing {
    /// What this comes to for a view: nothing where paths end in the radiance cache.
    pub(super) fn decided(self, world: &World, view: &View) -> Self {
        let [width, height] = view.whole_size();
        let suits = view.sampling == Sampling::Adaptive
            && view.limits.bounces >= 2
            && width.min(height) >= MIN_SIZE;
        if view.gi == Gi::Cached || (self == Self::Auto && !suits) {
            return Self::Off;
        }
        if self != Self::Auto {
            return self;
        }
        match enclosure(world, view) {
            LARGE_ENCLOSURE.. => Self::Large,
            MIN_ENCLOSURE.. => Self::Small,
            // Light comes from all sides: 0.97 to 2 times the efficiency where it is 0.4, by how thick it is.
            _ if view.fog(world).is_some() => Self::Small,
            _ => Self::Off,
        }
    }
}

impl View {
    /// How pixels share second vertices; `None` if they do not, or if that is not yet decided.
    pub fn shared_tile(&self) -> Option<SharedTile> {
        match self.sharing {
            Sharing::Auto | Sharing::Off => None,
            Sharing::Small => Some(SharedTile::SMALL),
            Sharing::Large => Some(SharedTile::LARGE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::hypothesis::chi_square_test;
    use crate::scene::{Medium, builtin};

    /// What is left open comes to, for a view of a built-in scene.
    fn decided(name: &str, change: impl Fn(&mut View)) -> Sharing {
        let world = World::new(builtin::build(name).expect("built in"));
        let mut view = View::new(world.scene.cameras[0].clone(), [160, 90]);
        change(&mut view);
        view.sharing.decided(&world, &view)
    }

    #[test]
    fn rooms_share_most_streets_less_and_open_scenes_nothing() {
        for (name, sharing) in [
            ("office", Sharing::Large),
            ("living-room", Sharing::Large),
            ("exterior", Sharing::Small),
            ("open", Sharing::Off),
            ("materials", Sharing::Off),
            ("fog", Sharing::Small),
        ] {
            assert_eq!(decided(name, |_| ()), sharing, "{name}");
        }
    }

    #[test]
    fn what_suits_no_tiles_has_none_and_what_is_asked_for_is_done() {
        let off = |change: &dyn Fn(&mut View)| assert_eq!(decided("office", change), Sharing::Off);
        off(&|view| view.sampling = Sampling::Plain);
        off(&|view| view.limits.bounces = 1);
        off(&|view| view.height = 63);
        off(&|view| view.gi = Gi::Cached);
        off(&|view| view.sharing = Sharing::Off);
        let asked = |view: &mut View| {
            (view.sharing, view.sampling, view.height) = (Sharing::Small, Sampling::Plain, 16);
        };
        assert_eq!(decided("open", asked), Sharing::Small);
        let foggy = |view: &mut View| {
            view.medium = Some(Medium { scattering: glam::Vec3::ONE, ..Medium::default() });
        };
        assert_eq!(decided("open", foggy), Sharing::Small);
        assert_eq!(decided("office", foggy), Sharing::Large);
    }

    /// So no edge of a tile shows.
    #[test]
    fn tiles_begin_elsewhere_for_each_sample() {
        const SAMPLES: u32 = 1 << 14;
        for tile in [SharedTile::SMALL, SharedTile::LARGE] {
            let places = tile.side * tile.side;
            let mut counts = vec![0.0; places as usize];
            for sample in 0..SAMPLES {
                let [x, y] = tile.tiling([160, 90], 3, sample).before;
                counts[(y * tile.side + x) as usize] += 1.0;
            }
            let expected = vec![f64::from(SAMPLES / places); places as usize];
            let test = chi_square_test(&counts, &expected, 1e-3).expect("enough samples");
            assert!(test.passed, "{tile:?}: {test:?}");
        }
    }

    #[test]
    fn a_part_is_rendered_as_the_whole_is() {
        let part = |corner| {
            move |view: &mut View| {
                view.crop = Some(crate::render::Crop { corner, whole: [160, 90] });
                (view.width, view.height) = (16, 16);
            }
        };
        assert_eq!(decided("exterior", part([0, 0])), Sharing::Small);
        assert_eq!(decided("exterior", part([100, 70])), Sharing::Small);
    }
}
