//! The radiance cache's cells behind the pixels.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::overlay::Overlay;
use super::painted::{Legend, Painted, Range, scaled};
use super::palette;
use crate::develop::DevelopSettings;
use crate::radiance_cache::{CacheFacts, KnownCell};
use crate::render::surface_map::{Spot, SurfaceMap};

/// Draws one of the cache's overlays.
pub(super) fn paint(
    overlay: Overlay,
    cache: &CacheFacts,
    surfaces: &SurfaceMap,
    settings: Option<&DevelopSettings>,
) -> Painted {
    let of = |spot: &Option<Spot>| spot.map(|s| cache.cell_at(s.position, s.normal));
    let cells: Vec<Option<KnownCell>> = surfaces.spots.iter().map(of).collect();
    match overlay {
        Overlay::CacheCells => levels(&cells),
        Overlay::CacheSamples => {
            let samples = |cell: KnownCell| (cell.samples > 0).then_some(cell.samples as f32);
            let samples = cells.into_iter().map(|cell| cell.and_then(samples));
            scaled(samples, Range::Logarithmic, "samples a cell")
        }
        _ => {
            let developed = |cell: KnownCell| {
                let settings = settings.filter(|_| cell.samples_around > 0);
                settings.map(|settings| develop(cell.radiance, settings))
            };
            Painted::new(cells.into_iter().map(|c| c.and_then(developed)).collect(), Legend::None)
        }
    }
}

/// As the picture is developed: white balance, exposure, tone curve, look.
fn develop(radiance: Vec3, settings: &DevelopSettings) -> [u8; 3] {
    let balanced = (settings.white_balance.matrix() * radiance).max(Vec3::ZERO);
    let color = settings.tone.apply(balanced * settings.exposure_ev.exp2());
    color.to_array().map(|x| (255.0 * x).round() as u8)
}

fn levels(cells: &[Option<KnownCell>]) -> Painted {
    let trained = |cell: &&KnownCell| cell.samples > 0;
    let color = |cell: &KnownCell| palette::of_number_in_group(cell.number, cell.level);
    let colors = cells.iter().map(|cell| cell.as_ref().filter(trained).map(color)).collect();
    // Edge, and the cells in view.
    let mut levels: BTreeMap<u32, (f32, BTreeSet<u32>)> = BTreeMap::new();
    for cell in cells.iter().flatten().filter(trained) {
        levels.entry(cell.level).or_insert((cell.edge, BTreeSet::new())).1.insert(cell.number);
    }
    if levels.is_empty() {
        return Painted::new(colors, Legend::Empty);
    }
    let name = |(level, (edge, cells)): (&u32, &(f32, BTreeSet<u32>))| {
        let what = format!("level {level}, {}: {} in view", length(*edge), cells.len());
        (palette::of_group(*level), what)
    };
    Painted::new(colors, Legend::Names(levels.iter().map(name).collect()))
}

/// Metres in the unit that suits.
pub fn length(metres: f32) -> String {
    match metres {
        m if m < 0.01 => format!("{:.1} mm", 1000.0 * m),
        m if m < 1.0 => format!("{:.1} cm", 100.0 * m),
        m => format!("{m:.2} m"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::srgb_from_linear;
    use crate::radiance_cache::{CacheCells, RadianceSums};
    use crate::tone::{Grade, Lut, Tone, ToneCurve, WhiteBalance};

    /// Two trained cells, of different levels, one that leans on the first, the back of it, and no surface.
    fn known() -> (CacheFacts, SurfaceMap) {
        let cells = CacheCells { center: Vec3::ZERO, edge: 0.1, least_distance: 1.0 };
        let sums = RadianceSums::new(cells, 1.0);
        let at = |x: f32, normal: Vec3| {
            Some(Spot { position: Vec3::new(x, 0.0, 0.05), normal, material: 0 })
        };
        let spots = vec![
            at(0.05, Vec3::Y),
            at(2.5, Vec3::Y),
            at(0.15, Vec3::Y),
            at(0.05, Vec3::NEG_Y),
            None,
        ];
        for (spot, times) in spots.iter().flatten().zip([4096, 64]) {
            for _ in 0..times {
                sums.add(spot.position, spot.normal, Vec3::splat(0.18), Vec3::splat(0.6));
            }
        }
        (sums.facts().expect("trained"), SurfaceMap { width: 5, height: 1, spots })
    }

    #[test]
    fn cells_are_told_apart_by_level() {
        let (facts, surfaces) = known();
        let painted = paint(Overlay::CacheCells, &facts, &surfaces, None);
        let colors = painted.colors;
        assert!(colors[0].is_some() && colors[1].is_some() && colors[0] != colors[1]);
        assert_eq!(colors[2..], [None; 3], "nothing has trained these");
        let Legend::Names(names) = painted.legend else { panic!("levels have names") };
        let names: Vec<&str> = names.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(names, ["level 0, 10.0 cm: 1 in view", "level 1, 20.0 cm: 1 in view"]);
    }

    #[test]
    fn samples_are_counted() {
        let (facts, surfaces) = known();
        let painted = paint(Overlay::CacheSamples, &facts, &surfaces, None);
        assert_eq!(painted.colors[0], Some(palette::viridis(1.0)));
        assert_eq!(painted.colors[1], Some(palette::viridis(0.0)));
        assert_eq!(painted.colors[2..], [None; 3]);
        let Legend::Scale { low, high, .. } = painted.legend else { panic!("a scale") };
        assert_eq!((low, high), (64.0, 4096.0));
    }

    #[test]
    fn radiance_is_developed_as_the_picture_is() {
        let (facts, surfaces) = known();
        let painted = |settings: &DevelopSettings| {
            paint(Overlay::CacheRadiance, &facts, &surfaces, Some(settings)).colors
        };
        let grade =
            |strength| Grade { lut: Lut::read("look:black-and-white").expect("a look"), strength };
        let white_balance = WhiteBalance::default();
        for (exposure_ev, grade, expected) in
            [(1.0, None, 0.36), (2.0, None, 0.72), (1.0, Some(grade(0.0)), 0.36)]
        {
            let tone = Tone { curve: ToneCurve::None, grade };
            let expected = (255.0 * srgb_from_linear(expected)).round() as u8;
            let colors =
                painted(&DevelopSettings { white_balance, exposure_ev, tone, opacity: [0.0; 2] });
            for color in &colors[..3] {
                let color = color.expect("something speaks for it");
                assert!(color.iter().all(|level| level.abs_diff(expected) <= 1), "{color:?}");
            }
            assert_eq!(colors[3..], [None; 2]);
        }
    }
}
