//! The process that reads spoilt input.

use std::sync::atomic::AtomicBool;

use super::{ALLOWANCE_BYTES, Kind, Tally, bombs, corpus, mutate};
use crate::app::document::PictureSize;
use crate::app::settings_file::Settings;
use crate::error::{Error, Result};
use crate::image::read_map;
use crate::path::{World, framing};
use crate::render::{Sampling, Session, View};
use crate::scene::{Scene, gltf};
use crate::stability::random::Random;
use crate::stability::scenes::{constant, view};
use crate::stability::scratch::Scratch;
use crate::terminal::{print, tell};

/// What an input turned out to be.
enum Found {
    /// Understood; it delivers this many bytes, and whether they are sound.
    Accepted { honest_bytes: u64, is_sound: bool },
    /// Refused with this sentence.
    Refused(String),
}

/// Reads inputs `first..first + count`, printing each number before it is read; then the tally as JSON.
///
/// # Errors
/// If the corpus or a scratch file cannot be made.
pub fn work(kind: Kind, first: u64, count: u64, accepts: fn(&[String]) -> bool) -> Result<()> {
    let scratch = Scratch::new()?;
    let entries = match kind {
        Kind::Gltf => corpus::gltf().into_iter().map(corpus::gltf_file).collect(),
        Kind::Maps => corpus::maps()?,
        Kind::Settings => corpus::settings()?,
        Kind::CommandLines => Vec::new(),
        Kind::Bombs => corpus::maps()?,
    };
    // Sound input first: thread pools, tables and the allocator's own growth are no input's doing.
    for entry in &entries {
        if let Found::Refused(sentence) = read(kind, "warm", entry, &scratch)? {
            return Err(Error::new(format!("the corpus is not sound: {sentence}")));
        }
    }
    let mut tally = Tally { worst_excess_bytes: i64::MIN, ..Tally::default() };
    for number in first..first + count {
        print(number)?;
        let mut random = Random(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let before = Memory::now();
        let (length, found) = match kind {
            Kind::CommandLines => {
                let words = mutate::words(&corpus::LINES, &mut random);
                let found = if accepts(&words) {
                    Found::Accepted { honest_bytes: 0, is_sound: true }
                } else {
                    Found::Refused("refused".to_owned())
                };
                (0, found)
            }
            Kind::Bombs => {
                let (name, bytes) = bombs::all().swap_remove(number as usize);
                let kind = if name.contains(".gl") { Kind::Gltf } else { Kind::Maps };
                (bytes.len(), read(kind, name, &bytes, &scratch)?)
            }
            Kind::Settings if random.below(4) > 0 => {
                let bytes = mutate::numbers(&entries[random.below(entries.len())], &mut random);
                (bytes.len(), read(kind, "spoilt", &bytes, &scratch)?)
            }
            Kind::Gltf if random.below(4) > 0 => {
                let sources = corpus::gltf();
                let source = &sources[random.below(sources.len())];
                let bytes = corpus::gltf_file(mutate::gltf(source, &mut random));
                (bytes.len(), read(kind, "spoilt", &bytes, &scratch)?)
            }
            _ => {
                let bytes = mutate::bytes(&entries, &mut random);
                (bytes.len(), read(kind, "spoilt", &bytes, &scratch)?)
            }
        };
        let grown = before.growth();
        if grown as f64 > ALLOWANCE_BYTES {
            tell(format_args!("input {number} took {grown} bytes"));
        }
        count_in(&mut tally, number, grown, length as u64, &found);
    }
    print(crate::output::record::to_value(&tally)?)
}

fn count_in(tally: &mut Tally, number: u64, grown: u64, length: u64, found: &Found) {
    let honest = match found {
        Found::Accepted { honest_bytes, is_sound } => {
            tally.accepted += 1;
            tally.unsound += u64::from(!is_sound);
            length.max(*honest_bytes)
        }
        Found::Refused(sentence) => {
            tally.refused += 1;
            tally.unclear += u64::from(sentence.is_empty() || sentence.contains('\n'));
            length
        }
    };
    let excess = grown as i64 - 4 * honest as i64;
    if excess > tally.worst_excess_bytes {
        (tally.worst_excess_bytes, tally.worst) = (excess, number);
    }
}

/// Reads one input as its kind is read.
fn read(kind: Kind, name: &str, bytes: &[u8], scratch: &Scratch) -> Result<Found> {
    Ok(match kind {
        Kind::Gltf => match gltf::load_slice(bytes, None, name) {
            Ok(scene) => of_scene(scene)?,
            Err(error) => Found::Refused(error.to_string()),
        },
        Kind::Settings => of_settings(&scratch.write("settings.json", bytes)?),
        _ => match read_map(&scratch.write(name, bytes)?) {
            Ok(map) => Found::Accepted {
                honest_bytes: map.image.pixels.len() as u64 * 12,
                is_sound: map
                    .image
                    .pixels
                    .as_flattened()
                    .iter()
                    .all(|v| v.is_finite() && *v >= 0.0),
            },
            Err(error) => Found::Refused(error.to_string()),
        },
    })
}

/// A picture of it: whatever was loaded can be rendered.
fn of_scene(scene: Scene) -> Result<Found> {
    let texels: usize = scene.images.iter().map(|image| image.texels.len()).sum();
    let honest_bytes =
        (scene.positions.len() * 64 + scene.triangles.len() * 128 + texels * 4) as u64;
    let is_sound = scene.positions.iter().all(|p| p.is_finite());
    let camera = scene.cameras.first().cloned();
    let world = World::new(scene);
    let camera = camera.unwrap_or_else(|| framing::frame(&world, 1.0));
    let environment = constant(1.0)?;
    let view = View { width: 4, height: 4, ..view(camera, Sampling::Plain, 4) };
    let mut session = Session::new(&world, &environment, view);
    session.advance(1, &AtomicBool::new(false))?;
    let finite = session.film().pixels().iter().all(|p| p.mean().iter().all(|c| c.is_finite()));
    Ok(Found::Accepted { honest_bytes, is_sound: is_sound && finite })
}

/// Settings must be such that a window can work with them.
fn of_settings(path: &std::path::Path) -> Found {
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

/// Address space of this process, where the system tells: what is asked for counts, not only what is
/// touched.
struct Memory {
    now: u64,
    peak: u64,
}

impl Memory {
    fn now() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let field = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            let kilobytes =
                line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
            kilobytes.unwrap_or(0) * 1024
        };
        Self { now: field("VmSize:"), peak: field("VmPeak:") }
    }

    /// By how much it was larger at its largest since then; 0 if an earlier peak hides that.
    fn growth(&self) -> u64 {
        let later = Self::now();
        if later.peak > self.peak {
            later.peak - self.now
        } else {
            later.now.saturating_sub(self.now)
        }
    }
}
