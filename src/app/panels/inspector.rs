//! The map with its tiles, and what the cell under the pointer knows of them.

use egui::{Color32, Grid, RichText, Stroke, StrokeKind, Ui, Vec2};

use super::button::button;
use super::scope::Scope;
use super::{color_bar, map_view, overlay, pixel_light};
use crate::app::commands::Command;
use crate::app::inspect::{Inspected, Inspector};
use crate::app::interface::{Interface, Purpose, TileView};
use crate::app::learning_steps::LearningSteps;
use crate::app::loader::LoadedMap;
use crate::app::overlays::{length, palette};
use crate::app::rendering::Rendering;
use crate::app::theme;
use crate::app::worker::Snapshot;
use crate::environment::sun::Sun;
use crate::light_grid::counters::Tally;
use crate::math::balance_heuristic;

/// Axes that surfaces face.
const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];
/// Tiles listed in the table.
const LISTED: usize = 8;

/// Draws the map view and the inspector.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let Scope { interface, assets, rendering, commands, .. } = scope;
    let Rendering { inspector, snapshot, steps, .. } = &**rendering;
    let (Some(map), snapshot) = (&assets.map, snapshot.as_deref()) else { return };
    theme::section(ui, "TILES OF THE MAP");
    tile_views(ui, interface);
    let energies: Vec<f32> =
        map.environment.tile_energies().iter().map(|energy| *energy as f32).collect();
    let energies = shares(&energies);
    let shown = match interface.tiles {
        TileView::Learned => &shares(inspector.learned().unwrap_or_default()),
        TileView::Energy => &energies,
    };
    let most = largest(shown);
    tiles(ui, interface, map, (shown, most), map.sun.as_ref(), None);
    if !shown.is_empty() {
        color_bar::show(ui, (MIN_SHARE, most), true, theme::percent);
    }
    if interface.tiles == TileView::Learned && inspector.learned().is_none() {
        theme::note(ui, "Nothing has been learned yet.");
    }
    let turns = snapshot.map_or(0.0, |s| s.request.environment.rotation_and_intensity().0);
    if let Some(sun) = &map.sun {
        theme::note(ui, sun_sentence(sun, turns));
    }
    if let Some(tile) = interface.tile {
        chosen_tile(ui, interface, map, tile, &energies);
    } else {
        theme::note(ui, "Click a tile to see which cells sample it.");
    }
    let hint = "Keeps the learned distributions, around their old centre, when the camera or a setting changes";
    ui.checkbox(&mut interface.is_frozen, "Freeze learning").on_hover_text(hint);
    learning_steps(ui, interface, steps.as_ref(), commands);
    if let Some(snapshot) = snapshot {
        theme::section(ui, "PICTURE");
        picture(ui, snapshot);
    }
    theme::section(ui, "CELL UNDER THE POINTER");
    match &inspector.inspected {
        Some(inspected) => {
            measure(ui, interface, inspector, commands);
            if let Some(truth) = inspector.truth() {
                pixel_light::show(
                    ui,
                    truth,
                    inspected.cell.map(|_| misplaced(&truth.shares, inspected)),
                );
            }
            facts(ui, "cell", inspected);
            cached(ui, inspected, snapshot);
            cell(ui, interface, inspector, inspected, map);
            if let Some(kept) = &inspector.kept {
                theme::section(ui, "KEPT CELL");
                facts(ui, "kept cell", kept);
                let most = largest(&kept.probabilities);
                tiles(ui, interface, map, (&kept.probabilities, most), None, None);
                color_bar::show(ui, (MIN_SHARE, most), true, theme::percent);
                let elsewhere = theme::percent(misplaced(&kept.probabilities, inspected));
                theme::note(
                    ui,
                    format!("Total variation from the cell under the pointer: {elsewhere}"),
                );
            }
        }
        None if interface.pinned.is_some() => {
            theme::note(ui, "There is no surface here, only the map; click elsewhere.");
        }
        None => theme::note(ui, "Point at a surface; click to pin it."),
    }
    if snapshot.is_some_and(|s| s.main.grid.is_some()) {
        ui.add_space(4.0);
        let hint =
            "All distributions as .csv, .json or .exr (one row a distribution, one column a tile)";
        button(ui, ("Export distributions…", hint), commands, Command::Ask(Purpose::Distributions));
    }
}

/// Asks for the steps in which the picture has learned, and chooses one.
fn learning_steps(
    ui: &mut Ui,
    interface: &mut Interface,
    steps: Option<&LearningSteps>,
    commands: &mut Vec<Command>,
) {
    let (name, hint) = match steps {
        None => {
            ("Step through learning", "Learns once more, and keeps what is known after each pass")
        }
        Some(steps) if steps.is_busy() => ("Learning…", "Ends it"),
        Some(_) => ("Forget the steps", "Back to what is known by now"),
    };
    button(ui, (name, hint), commands, Command::ToggleLearningSteps);
    let Some(steps) = steps.filter(|steps| !steps.is_busy()) else { return };
    let last = steps.count();
    let mut step = interface.learning_step.unwrap_or(last);
    let paths = |step: f64, _| match steps.paths(step as usize) {
        Some(paths) => format!("{} paths", theme::count(paths)),
        None => "now".to_owned(),
    };
    let slider = theme::slider(&mut step, 0..=last).custom_formatter(paths);
    let hint = "Paths that are known: tiles, overlays and cells show what they have taught. The picture stays";
    theme::set(ui, "Learned from", hint, slider);
    interface.learning_step = Some(step).filter(|step| *step < last);
}

fn tile_views(ui: &mut Ui, interface: &mut Interface) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let hint = "Share of the map's energy in each tile";
        ui.selectable_value(&mut interface.tiles, TileView::Energy, "Energy").on_hover_text(hint);
        let hint = "Learned probability of each tile, summed over all cells";
        ui.selectable_value(&mut interface.tiles, TileView::Learned, "Learned").on_hover_text(hint);
    });
}

fn sun_sentence(sun: &Sun, rotation_turns: f32) -> String {
    let azimuth =
        (sun.azimuth_degrees + 360.0 * f64::from(rotation_turns) + 180.0).rem_euclid(360.0) - 180.0;
    let turned = match 360.0 * rotation_turns {
        0.0 => String::new(),
        degrees => format!("; the map is turned by {degrees:.0}°, but not here"),
    };
    format!(
        "Brightest at azimuth {azimuth:.0}° (0° is +X), elevation {:.0}°; {:.0}\u{a0}% of the energy \
         within 2.5° of it{turned}",
        sun.elevation_degrees,
        100.0 * sun.energy_share
    )
}

fn shares(values: &[f32]) -> Vec<f32> {
    let total: f32 = values.iter().sum();
    values.iter().map(|v| if total > 0.0 { v / total } else { 0.0 }).collect()
}

/// The map under a heatmap of logarithmic shares: 0.01 % is transparent, `most` opaque. Marks its sun and the chosen
/// tile, and names the one under the pointer, which a click chooses.
fn tiles(
    ui: &mut Ui,
    interface: &mut Interface,
    map: &LoadedMap,
    (shares, most): (&[f32], f32),
    sun: Option<&Sun>,
    of: Option<&Inspector>,
) {
    let (rect, response) = map_view::ground(ui, map);
    let (size, painter) = (map.environment.tile_grid(), ui.painter_at(rect));
    for (tile, share) in shares.iter().enumerate().filter(|(_, share)| **share > MIN_SHARE) {
        let t = (share / MIN_SHARE).ln() / (most / MIN_SHARE).ln();
        let [r, g, b] = palette::viridis(t);
        let color = Color32::from_rgba_unmultiplied(r, g, b, (90.0 + 150.0 * t) as u8);
        painter.rect_filled(map_view::tile_rect(rect, size, tile as u32), 0.0, color);
    }
    if let Some(sun) = sun {
        let image = map.environment.map();
        let scale = rect.size() / Vec2::new(image.width as f32, image.height as f32);
        let at = rect.min + Vec2::from(sun.texel.map(|texel| texel as f32 + 0.5)) * scale;
        painter.circle_stroke(at, 4.5, Stroke::new(1.2, Color32::WHITE));
    }
    let mark = |tile: u32, color: Color32| {
        let rect = map_view::tile_rect(rect, size, tile);
        ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.5, color), StrokeKind::Outside);
    };
    // A smaller map has fewer.
    if let Some(tile) = interface.tile.filter(|tile| *tile < size.0 * size.1) {
        mark(tile, theme::ACCENT);
    }
    let pointed = response.hover_pos().and_then(|at| map_view::tile_at(rect, size, at));
    if response.clicked() {
        interface.tile = if interface.tile == pointed { None } else { pointed };
    }
    if let Some(tile) = pointed {
        mark(tile, Color32::WHITE);
        let share = theme::percent(shares.get(tile as usize).copied().unwrap_or(0.0));
        let (row, column) = (tile / size.0, tile % size.0);
        let rect = map_view::tile_rect(rect, size, tile);
        let within = response.hover_pos().map(|at| (at - rect.min) / rect.size());
        let densities = within.and_then(|Vec2 { x, y }| of?.densities(tile, glam::Vec2::new(x, y)));
        let densities = densities.map_or(String::new(), |[light, bounce]| {
            let weight = theme::percent(balance_heuristic(light, bounce));
            let light = theme::figure(f64::from(light));
            format!("\npdf {light} / sr, MIS weight {weight} beside a diffuse bounce")
        });
        let text = format!("Tile {tile}: row {row}, column {column}\n{share}{densities}");
        response.on_hover_text(text);
    }
}

/// Shares up to this are not drawn.
const MIN_SHARE: f32 = 1e-4;

/// The largest share, for the upper end of a scale.
fn largest(shares: &[f32]) -> f32 {
    shares.iter().copied().fold(MIN_SHARE * 10.0, f32::max)
}

fn chosen_tile(ui: &mut Ui, interface: &mut Interface, map: &LoadedMap, tile: u32, shares: &[f32]) {
    let (columns, _) = map.environment.tile_grid();
    let share = shares.get(tile as usize).copied().unwrap_or(0.0);
    let place = format!("row {}, column {}", tile / columns, tile % columns);
    ui.label(format!("Tile {tile}, {place}: {} of the map", theme::percent(share)));
    let is_shown = interface.overlay == Some(crate::app::overlays::Overlay::Tile);
    if !is_shown && ui.button("Show which cells sample it").clicked() {
        interface.overlay = Some(crate::app::overlays::Overlay::Tile);
    }
}

/// Asks for what is true under the pointer.
fn measure(
    ui: &mut Ui,
    interface: &mut Interface,
    inspector: &Inspector,
    commands: &mut Vec<Command>,
) {
    ui.horizontal_wrapped(|ui| {
        let label = if inspector.busy { "Measuring…" } else { "Measure the truth" };
        let response = ui.add_enabled(!inspector.busy, egui::Button::new(label));
        let hint = "Shadow rays to every tile, 256 each, and 4096 paths: what arrives here, by which ways, and why it is dark or noisy";
        if response.on_hover_text(hint).clicked() {
            interface.pinned = interface.inspected();
            commands.push(Command::MeasureTruth);
        }
        if interface.pinned.is_some() && ui.button("Unpin").clicked() {
            interface.pinned = None;
        }
        let (name, hint) = match inspector.kept {
            None => ("Keep the cell", "Shows it below whatever cell is under the pointer"),
            Some(_) => ("Drop the kept cell", "Shows one cell alone"),
        };
        button(ui, (name, hint), commands, Command::ToggleKeptCell);
    });
}

/// Share of the learned probability that lies where another distribution has none.
fn misplaced(shares: &[f32], inspected: &Inspected) -> f32 {
    shares.iter().zip(&inspected.probabilities).map(|(a, b)| 0.5 * (a - b).abs()).sum()
}

fn cell(
    ui: &mut Ui,
    interface: &mut Interface,
    inspector: &Inspector,
    inspected: &Inspected,
    map: &LoadedMap,
) {
    let truth = inspector.truth();
    // One scale for both, so that they can be compared.
    let most = truth.map_or(0.0, |truth| largest(&truth.shares));
    let most = most.max(largest(&inspected.probabilities));
    if !inspected.probabilities.is_empty() {
        tiles(ui, interface, map, (&inspected.probabilities, most), None, Some(inspector));
        color_bar::show(ui, (MIN_SHARE, most), true, theme::percent);
        theme::note(ui, "Probability of each tile, learned");
    }
    if let Some(truth) = truth {
        tiles(ui, interface, map, (&truth.shares, most), None, None);
        ui.label(theme::quiet(if truth.shares.iter().all(|share| *share == 0.0) {
            "Ground truth: no part of the map is visible from this point".to_owned()
        } else {
            format!(
                "Ground truth (visible energy times cosine): {:.0} % of the learned probability lies elsewhere",
                100.0 * misplaced(&truth.shares, inspected)
            )
        }));
    }
    table(ui, inspected, inspector);
}

/// How far the picture is off, and what it takes.
fn picture(ui: &mut Ui, snapshot: &Snapshot) {
    let session = &snapshot.main;
    let percent = |share: f32| match share.is_finite() {
        true => format!("{:.1} %", 100.0 * share),
        false => "not known yet".to_owned(),
    };
    let grid = session.grid.as_ref().map_or(0, |grid| grid.memory_bytes());
    let map = snapshot.request.environment.memory_bytes();
    let [grid, table, pixels] = [grid, map.table, map.pixels].map(theme::bytes);
    in_rows(ui, "picture", |line| {
        let hint = "Estimated relative RMS error of the pixels by exact samples alone, before denoising; too small by half with two to four samples where light is hard to find";
        line("Noise", percent(session.noise as f32), hint);
        let left = snapshot.errors.map_or(f32::NAN, |errors| errors.left());
        let hint = "Estimated relative RMS error of means of 16x16 pixels, which a denoiser leaves";
        line("Error of areas", percent(left), hint);
        let share = snapshot.errors.map_or(0.0, |errors| errors.share());
        let hint = "Its share of the picture: less noise and an error of its own, for which the share falls as samples arrive";
        line("Cached light", percent(share), hint);
        let hint = format!("Light Grid {grid}, importance table {table}, map {pixels}");
        line("Memory", grid, &hint);
    });
}

fn facts(ui: &mut Ui, id: &str, inspected: &Inspected) {
    let p = inspected.in_file;
    let cell = match inspected.cell {
        Some((cell, [face, row, column])) => {
            let face = FACES.get(face as usize).copied().unwrap_or("all");
            format!("{cell}: row {row}, column {column}, face {face}")
        }
        None => "no grid: the whole map is sampled everywhere".to_owned(),
    };
    let distribution = match inspected.distribution {
        crate::light_grid::WHOLE_MAP => "the whole map's".to_owned(),
        distribution => distribution.to_string(),
    };
    let tries: f64 = inspected.tallies.iter().map(|t| t.tries).sum();
    in_rows(ui, id, |line| {
        let hint = "Cells of the Light Grid surround the camera: rows by elevation, columns by azimuth, one for each axis that a surface may face";
        line("Cell", cell, hint);
        let hint =
            "What the map is sampled by from here; a cell has its own once it has learned enough";
        line("Distribution", distribution, hint);
        let position = format!("{:.2}, {:.2}, {:.2} m", p.x, p.y, p.z);
        line("Position", position, "World position; y is up");
        line("Material", inspected.material.clone(), "Its name in the file");
        if !inspected.probabilities.is_empty() {
            let p = &inspected.probabilities;
            let entropy: f32 = p.iter().map(|p| if *p > 0.0 { -p * p.log2() } else { 0.0 }).sum();
            let support = p.iter().filter(|p| **p > 0.0).count();
            let hint =
                "Spread of the distribution: 0 bits is one tile, each bit doubles their number";
            line("Entropy", format!("{entropy:.2} bits over {support} tiles"), hint);
        }
        if tries > 0.0 {
            let hint = "Rays towards the map that learning has traced from this cell";
            line("Learned from", format!("{} shadow rays", theme::count(tries as u64)), hint);
        }
        if let Some(bytes) = inspected.memory_bytes {
            line("Memory", theme::bytes(bytes), "Memory of this distribution");
        }
    });
}

/// Facts in rows: each by its name, with a hint if that is not empty.
fn in_rows(ui: &mut Ui, id: &str, facts: impl FnOnce(&mut dyn FnMut(&str, String, &str))) {
    Grid::new(id).num_columns(2).spacing([12.0, 3.0]).show(ui, |ui| {
        facts(&mut |name, value, hint| {
            let both = ui.label(theme::quiet(name)) | ui.label(RichText::new(value).size(12.5));
            if !hint.is_empty() {
                both.on_hover_text(hint);
            }
            ui.end_row();
        });
    });
}

/// What the radiance cache knows there.
fn cached(ui: &mut Ui, inspected: &Inspected, snapshot: Option<&Snapshot>) {
    let Some(snapshot) = snapshot else { return };
    let cache = match &snapshot.cache {
        Ok(cache) => cache,
        Err(missing) => return theme::note(ui, overlay::no_cache(*missing)),
    };
    let Some(cell) = &inspected.cached else { return };
    let face = FACES.get(cell.face as usize).copied().unwrap_or("all");
    let (trained, radiance) = match (cell.samples, cell.samples_around) {
        // The albedo is not known, either.
        (0, 0) => ("untrained: the global mean is used".to_owned(), "unknown".to_owned()),
        (own, around) => (
            format!("{} samples, {} around", theme::count(own), theme::count(around)),
            cell.radiance.to_array().map(|light| theme::figure(f64::from(light))).join("  "),
        ),
    };
    in_rows(ui, "cached", |line| {
        let place = format!("level {}, edge {}, face {face}", cell.level, length(cell.edge));
        line("Cache cell", place, "");
        line("Trained by", trained, "");
        line("Radiance", radiance, "");
        line("Cache", overlay::cache_size(cache), "");
    });
}

/// The tiles that are listed: the likeliest ones, or those whose learned probability differs most from the truth.
fn listed(learned: &[f32], truth: Option<&[f32]>) -> Vec<usize> {
    let weight =
        |tile: &usize| truth.map_or(learned[*tile], |truth| (learned[*tile] - truth[*tile]).abs());
    let mut tiles: Vec<usize> = (0..learned.len()).filter(|tile| weight(tile) > 0.0).collect();
    tiles.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    tiles.truncate(LISTED);
    tiles
}

/// The likeliest tiles in numbers; once the truth is measured, those that are farthest from it.
fn table(ui: &mut Ui, inspected: &Inspected, inspector: &Inspector) {
    let truth = inspector.truth();
    let tiles = listed(&inspected.probabilities, truth.map(|truth| &truth.shares[..]));
    Grid::new("tiles").num_columns(5).spacing([14.0, 3.0]).striped(true).show(ui, |ui| {
        let names = ["Tile", "Share", "Tries", "Ratio"].into_iter().chain(truth.map(|_| "Truth"));
        names.for_each(|name| theme::note(ui, name));
        ui.end_row();
        for tile in tiles {
            let share = theme::percent(inspected.probabilities[tile]);
            let (tries, ratio) = match inspected.tallies.get(tile) {
                Some(Tally { tries, weight, .. }) if *tries > 0.0 => {
                    (theme::count(*tries as u64), format!("{:.3}", weight / tries))
                }
                _ => ("0".to_owned(), "pooled".to_owned()),
            };
            let truth = truth.map(|truth| theme::percent(truth.shares[tile]));
            for number in [tile.to_string(), share, tries, ratio].into_iter().chain(truth) {
                ui.label(RichText::new(number).size(12.5));
            }
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_learning_has_missed_is_listed_first() {
        let learned = [0.88, 0.0, 0.12, 0.0];
        assert_eq!(listed(&learned, None), [0, 2]);
        assert_eq!(listed(&learned, Some(&[0.42, 0.23, 0.12, 0.23])), [0, 1, 3]);
    }
}
