//! The window's settings: sound files to spoil, and whether what was read can be worked with.

use std::path::Path;

use lightgrid::app::document::PictureSize;
use lightgrid::app::settings_file::Settings;
use lightgrid::output::record::to_json;

use crate::read::Found;

/// Those of a new window, and of one that was used.
pub(crate) fn corpus() -> Vec<Vec<u8>> {
    let mut settings = Settings::default();
    let plain = to_json(&settings).expect("JSON");
    settings.recent_scene("kitchen.glb");
    settings.recent_map("meadow.hdr");
    settings.stop.noise = Some(0.05);
    settings.stop.samples = Some(64);
    settings.size = PictureSize::Fixed(640, 360);
    vec![plain.into_bytes(), to_json(&settings).expect("JSON").into_bytes()]
}

/// Settings must be such that a window can work with them.
pub(crate) fn read(path: &Path) -> Found {
    match Settings::read(path) {
        Ok(settings) => {
            let size = match settings.size {
                PictureSize::Viewport(divisor) => (1..=64).contains(&divisor),
                PictureSize::Fixed(width, height) => {
                    width > 0 && height > 0 && u64::from(width) * u64::from(height) <= 1 << 27
                }
            };
            let look = settings.look.exposure_ev.is_finite()
                && settings.look.white_balance.kelvin.is_finite();
            let window = settings.window_size.iter().all(|side| (1.0..=1e5).contains(side));
            Found::Accepted {
                honest_bytes: 0,
                is_sound: size && look && window && settings.light.bounces <= 100_000,
            }
        }
        Err(error) => Found::Refused(error.to_string()),
    }
}
