//! Pictures over the picture: what the grid knows and how sure the samples are, with legends.

use rayon::prelude::*;

use crate::develop::DevelopSettings;
use crate::environment::sun::Sun;
use crate::image::Image;
use crate::light_grid::cells::SphericalGrid;
use crate::light_grid::{LightGrid, WHOLE_MAP};
use crate::metrics::{BLOCK, flip};
use crate::render::film::{Film, Pixel};
use crate::render::sun_placement::is_sunlit;
use crate::render::surface_map::{Spot, SurfaceMap};

use super::worker::{Backdrop, Request, Snapshot};

mod cache;
mod cell_facts;
mod labels;
mod overlay;
mod painted;
pub mod palette;

pub use cache::length;
pub use cell_facts::CellFacts;
pub use overlay::Overlay;
pub use painted::Legend;
pub(super) use painted::Painted;
use painted::{Range, scaled};

/// FLIP at the bright end of its scale.
const MAX_FLIP: f32 = 0.5;

/// What overlays are drawn from.
pub(super) struct Sources<'a> {
    /// The film, what was rendered with, and what was learned.
    pub(super) snapshot: &'a Snapshot,
    /// Surfaces behind the film's pixels; only for overlays that need them.
    pub(super) surfaces: Option<&'a SurfaceMap>,
    /// Facts of the cells of its grid.
    pub(super) facts: Option<&'a CellFacts>,
    /// The picture on the screen, for the overlay that compares it with the reference.
    pub(super) image: Option<&'a Image>,
    /// How light is developed.
    pub(super) settings: Option<DevelopSettings>,
    /// The tile chosen on the map.
    pub(super) tile: Option<u32>,
    /// The map's sun, unless the map is black.
    pub(super) sun: Option<&'a Sun>,
}

impl Sources<'_> {
    /// Draws; `None` while what it needs is not there.
    pub(super) fn paint(&self, overlay: Overlay) -> Option<Painted> {
        let pixels = self.snapshot.main.film.pixels().iter();
        let samples = |pixel: &Pixel| Some(pixel.samples() as f32);
        match overlay {
            Overlay::Samples => Some(scaled(pixels.map(samples), Range::Whole, "samples")),
            Overlay::Error => {
                Some(scaled(pixels.map(relative_error), Range::Logarithmic, "of the luminance"))
            }
            Overlay::Areas => Some(self.areas()),
            Overlay::Flip => self.flip(),
            Overlay::Sun => self.sunlit(),
            Overlay::Albedo | Overlay::Normal | Overlay::Depth => self.layer(overlay),
            _ if overlay.is_of_cache() => {
                let facts = self.snapshot.cache.as_ref().ok()?;
                Some(cache::paint(overlay, facts, self.surfaces?, self.settings.as_ref()))
            }
            _ => self.cells(overlay),
        }
    }

    /// Of the film that most of the picture comes from.
    fn areas(&self) -> Painted {
        let own = &self.snapshot.main.film;
        let is_more = |cached: &&Backdrop| cached.samples > own.total_samples();
        let film = self.snapshot.backdrop.as_ref().filter(is_more).map_or(own, |it| &it.film);
        let size = [film.width.div_ceil(BLOCK), film.height.div_ceil(BLOCK)];
        let of_area = |index: u32| error_of_area(film, [index % size[0], index / size[0]]);
        let errors: Vec<_> = (0..size[0] * size[1]).into_par_iter().map(of_area).collect();
        let places = (0..film.height).flat_map(|y| (0..film.width).map(move |x| [x, y]));
        let of_place = |[x, y]: [u32; 2]| errors[(y / BLOCK * size[0] + x / BLOCK) as usize];
        scaled(places.map(of_place), Range::Logarithmic, "of the luminance")
    }

    fn flip(&self) -> Option<Painted> {
        let reference = self.snapshot.request.reference.as_ref()?;
        let exposure_ev = self.settings.as_ref()?.exposure_ev;
        let (errors, mean) = flip::errors(self.image?, &reference.image, exposure_ev)?;
        let unit = format!("FLIP, mean {mean:.4}");
        Some(scaled(errors.into_iter().map(Some), Range::Fixed(0.0, MAX_FLIP), unit))
    }

    fn sunlit(&self) -> Option<Painted> {
        const SUNLIT: [u8; 3] = [255, 205, 70];
        let Request { world, environment, .. } = &*self.snapshot.request;
        let (turns, _) = environment.rotation_and_intensity();
        let (sun, degrees) = (self.sun?, 360.0 * f64::from(turns));
        let is_lit = |spot: &&Spot| is_sunlit(world, sun, spot, degrees);
        let color = |spot: &Option<Spot>| spot.as_ref().filter(is_lit).map(|_| SUNLIT);
        let colors: Vec<_> = self.surfaces?.spots.par_iter().map(color).collect();
        let percent = 100.0 * colors.iter().flatten().count() as f32 / colors.len().max(1) as f32;
        let name = format!("sunlit, {percent:.1} % of the pixels");
        Some(Painted::new(colors, Legend::Names(vec![(SUNLIT, name)])))
    }

    fn layer(&self, overlay: Overlay) -> Option<Painted> {
        let layers = self.snapshot.main.film.surface_layers()?;
        let srgb = |v: f32| (crate::color::srgb_from_linear(v.clamp(0.0, 1.0)) * 255.0) as u8;
        let is_hit = |normal: &[f32; 3]| *normal != [0.0; 3];
        Some(match overlay {
            Overlay::Albedo => {
                let albedos = layers.albedo.iter().zip(&layers.normal);
                let colors = albedos.map(|(albedo, n)| is_hit(n).then(|| albedo.map(srgb)));
                Painted::new(colors.collect(), Legend::None)
            }
            Overlay::Normal => {
                let byte = |v: f32| ((v * 0.5 + 0.5) * 255.0).round() as u8;
                let colors = layers.normal.iter().map(|n| is_hit(n).then(|| n.map(byte)));
                let axes =
                    [([255, 128, 128], "+X"), ([128, 255, 128], "+Y"), ([128, 128, 255], "+Z")];
                let names = axes.map(|(color, name)| (color, name.to_owned())).to_vec();
                Painted::new(colors.collect(), Legend::Names(names))
            }
            _ => {
                let depths = layers.depth.iter().zip(&layers.normal);
                scaled(depths.map(|(d, n)| is_hit(n).then_some(*d)), Range::Logarithmic, "m")
            }
        })
    }

    fn cells(&self, overlay: Overlay) -> Option<Painted> {
        let surfaces = self.surfaces?;
        let grid = self.snapshot.main.grid.as_ref()?;
        let environment = &self.snapshot.request.environment;
        let all = grid.grid()?;
        let facts = self.facts?;
        let cell_of = |spot: &Option<Spot>| spot.map(|s| all.cell_of(s.position, s.normal));
        let cells: Vec<Option<u32>> = surfaces.spots.iter().map(cell_of).collect();
        let distribution = |cell: u32| grid.distribution_of_cell(cell);
        // The map may have been another one, of more tiles.
        let tile = self.tile.filter(|tile| *tile < environment.tile_count());
        let value = |cell: u32| match overlay {
            Overlay::Visits => facts.visits(cell),
            Overlay::Sky => facts.visible_share(cell),
            Overlay::Entropy => Some(facts.entropy[distribution(cell) as usize]),
            Overlay::Distance => Some(facts.distance[distribution(cell) as usize]),
            _ => Some(grid.distributions().probability(distribution(cell), tile?))
                .filter(|p| *p > 0.0),
        };
        let (range, unit) = match overlay {
            Overlay::Cells => return Some(with_borders(&cells, surfaces.width, all)),
            Overlay::Faces => return Some(faces(&cells, all)),
            Overlay::Learned => return Some(learned(&cells, grid)),
            Overlay::BestTile => {
                let (columns, rows) = environment.tile_grid();
                let color = |cell| {
                    let tile = facts.best_tile[distribution(cell) as usize];
                    let u = (f64::from(tile % columns) + 0.5) / f64::from(columns);
                    let v = (f64::from(tile / columns) + 0.5) / f64::from(rows);
                    palette::of_map_place(u as f32, v as f32)
                };
                let colors = cells.iter().map(|cell| cell.map(color)).collect();
                return Some(Painted::new(colors, Legend::Map));
            }
            Overlay::Visits => (Range::Logarithmic, "tries a cell"),
            Overlay::Sky => (Range::Logarithmic, "visibility times cosine"),
            Overlay::Entropy => {
                let most = (environment.tile_count() as f32).log2();
                (Range::Fixed(0.0, most), "bits")
            }
            Overlay::Distance => (Range::Fixed(0.0, 1.0), "total variation"),
            _ => tile.map(|_| (Range::Logarithmic, "probability"))?,
        };
        Some(scaled(cells.into_iter().map(|cell| cell.and_then(value)), range, unit))
    }
}

/// What an overlay of the film says of a pixel; of those of cells the inspector tells more.
pub fn value_text(overlay: Overlay, film: &Film, index: usize) -> Option<String> {
    let three = |values: [f32; 3]| values.map(|value| format!("{value:.2}")).join("  ");
    Some(match overlay {
        Overlay::Error => {
            format!("error {:.1} %", 100.0 * relative_error(film.pixels().get(index)?)?)
        }
        Overlay::Albedo => format!("albedo {}", three(film.surface_of(index)?.0)),
        Overlay::Normal => format!("normal {}", three(film.surface_of(index)?.1)),
        Overlay::Depth => length(film.surface_of(index)?.2),
        _ => return None,
    })
}

fn relative_error(pixel: &Pixel) -> Option<f32> {
    let error = pixel.variance_of_mean().sqrt() / pixel.mean_luminance();
    (error.is_finite() && error > 0.0).then_some(error as f32)
}

/// Standard error over luminance of the mean of an area, by its number of column and row.
fn error_of_area(film: &Film, [column, row]: [u32; 2]) -> Option<f32> {
    let columns = column * BLOCK..((column + 1) * BLOCK).min(film.width);
    let rows = row * BLOCK..((row + 1) * BLOCK).min(film.height);
    let row = |y: u32| {
        let place = |x: u32| (y * film.width + x) as usize;
        &film.pixels()[place(columns.start)..place(columns.end)]
    };
    let pixels = || rows.clone().flat_map(row);
    let luminance: f64 = pixels().map(Pixel::mean_luminance).sum();
    let variance: f64 = pixels().map(Pixel::variance_of_mean).sum();
    let error = variance.sqrt() / luminance;
    (error.is_finite() && error > 0.0).then_some(error as f32)
}

fn with_borders(cells: &[Option<u32>], width: u32, grid: &SphericalGrid) -> Painted {
    const BORDER: [u8; 3] = [245, 245, 250];
    let labels = labels::of_cells(cells, width);
    let width = width as usize;
    let colors = cells.iter().enumerate().map(|(i, cell)| {
        let left = if i % width > 0 { cells[i - 1] } else { *cell };
        let above = if i >= width { cells[i - width] } else { *cell };
        cell.map(|own| {
            let is_border = left != *cell || above != *cell;
            if is_border { BORDER } else { palette::of_number(own) }
        })
    });
    let shown = cells.iter().flatten().collect::<std::collections::BTreeSet<_>>().len();
    let name = format!("{shown} of {} cells are in view", grid.cell_count());
    let legend = Legend::Names(vec![(BORDER, name)]);
    Painted { colors: colors.collect(), legend, labels }
}

const FACE_COLORS: [[u8; 3]; 6] =
    [[224, 92, 92], [132, 52, 60], [120, 205, 110], [48, 104, 62], [98, 140, 235], [50, 66, 140]];

fn faces(cells: &[Option<u32>], grid: &SphericalGrid) -> Painted {
    let color = |cell| FACE_COLORS[grid.coordinates(cell).0 as usize % 6];
    let colors = cells.iter().map(|cell| cell.map(color)).collect();
    let names = ["+X", "-X", "+Y (up)", "-Y (down)", "+Z", "-Z"];
    let count = grid.face_count() as usize;
    let legend = FACE_COLORS.into_iter().zip(names).take(count);
    Painted::new(colors, Legend::Names(legend.map(|(c, n)| (c, n.to_owned())).collect()))
}

fn learned(cells: &[Option<u32>], grid: &LightGrid) -> Painted {
    const OWN: [u8; 3] = [84, 190, 140];
    const NONE: [u8; 3] = [226, 120, 70];
    let color = |cell| if grid.distribution_of_cell(cell) == WHOLE_MAP { NONE } else { OWN };
    let colors: Vec<Option<[u8; 3]>> = cells.iter().map(|cell| cell.map(color)).collect();
    let pixels = colors.iter().flatten().count().max(1);
    let own = colors.iter().flatten().filter(|c| **c == OWN).count();
    let percent = 100.0 * own as f32 / pixels as f32;
    let legend = Legend::Names(vec![
        (OWN, format!("a distribution of its own, {percent:.1} % of the pixels")),
        (NONE, "the whole map's distribution".to_owned()),
    ]);
    Painted::new(colors, legend)
}
