//! What each importance table keeps of a map.

use lightgrid::environment::{SatReport, SatReportRow, TableKind, sat_report};
use lightgrid::image::Image;
use lightgrid::sampler::SplitMix;

use super::sun;

fn row(report: &SatReport, table: TableKind) -> SatReportRow {
    *report.rows.iter().find(|row| row.table == table).expect("every kind is reported")
}

/// An outdoor map without a sun in the frame: a gradient with clouds and a dark, grainy ground.
fn cloudy(width: u32, height: u32) -> Image {
    let mut random = SplitMix(3);
    Image::from_fn(width, height, |x, y| {
        let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
        let cloud = (40.0 * u).sin() * (25.0 * v).cos();
        let ground = if v > 0.5 { 0.05 } else { 1.0 };
        [ground * (1.5 + cloud) * (0.9 + 0.2 * random.next_f32()); 3]
    })
}

#[test]
fn rounding_f64_sums_to_u32_beats_f32_sums_on_an_ordinary_map() {
    let report = sat_report(&cloudy(2048, 1024), 0).unwrap();
    let [rounded, single] = [TableKind::U32, TableKind::F32].map(|kind| row(&report, kind));
    assert!(rounded.mean_squared_error * 100.0 < single.mean_squared_error, "{report}");
    assert!(row(&report, TableKind::F64).mean_squared_error < 1e-12, "{report}");
}

#[test]
fn rounded_sums_lose_dim_texels_beside_a_sun_and_tile_local_ones_do_not() {
    let report = sat_report(&sun(1024, 512, 1e10), 0).unwrap();
    let rounded = row(&report, TableKind::U32);
    assert!(rounded.missed_share > 0.05, "{report}");
    assert!(rounded.missed_energy_share > 1e-6, "{report}");
    assert!(rounded.falling_share > 0.005, "{report}");
    assert!(rounded.misreported_share > 1e-8, "{report}");
    let local = row(&report, TableKind::TileLocal);
    assert!(local.mean_squared_error < 1e-6, "{report}");
    assert_eq!(local.missed_share, 0.0, "{report}");
    assert_eq!(local.missed_energy_share, 0.0, "{report}");
    assert_eq!(local.falling_share, 0.0, "{report}");
    assert_eq!(local.misreported_share, 0.0, "{report}");
}

#[test]
fn a_report_reads_back_and_takes_black_and_tiny_maps() {
    for map in [Image::filled(1, 1, [1.0; 3]), Image::filled(8, 4, [0.0; 3]), cloudy(64, 32)] {
        let report = sat_report(&map, 10).unwrap();
        assert_eq!(report.rows.len(), TableKind::ALL.len());
        for row in &report.rows {
            assert!(row.mean_squared_error.is_finite(), "{report}");
            assert!(row.misreported_share.is_finite(), "{report}");
            assert!(row.missed_energy_share < 1e-6, "{report}");
        }
        let json = serde_json::to_string(&report).unwrap();
        let back: SatReport = serde_json::from_str(&json).unwrap();
        assert_eq!(back.rows.len(), report.rows.len());
        assert!(report.to_string().contains("tile-local"));
    }
    assert!(sat_report(&Image::filled(0, 0, [0.0; 3]), 1).is_err());
}
