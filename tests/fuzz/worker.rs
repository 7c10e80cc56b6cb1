//! The process that reads spoilt input.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use lightgrid::cli::accepts;
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::image::Image;
use lightgrid::path::{PathLimits, World, framing};
use lightgrid::render::filter::PixelFilter;
use lightgrid::render::{Sampling, Session, View};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::{Scene, gltf};

use crate::read::{self, Found};
#[cfg(feature = "window")]
use crate::settings;
use crate::{ALLOWANCE_BYTES, Kind, Tally, bombs, corpus, kept, lists, mutate, targets};

/// Reads inputs `first..first + count`, printing each number before it is read; then the tally as JSON.
pub(crate) fn work(kind: Kind, first: u64, count: u64) {
    // The harness has begun a line.
    println!();
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let entries = match kind {
        Kind::Gltf => corpus::gltf().into_iter().map(corpus::gltf_file).collect(),
        #[cfg(feature = "window")]
        Kind::Settings => settings::corpus(),
        Kind::CommandLines => Vec::new(),
        Kind::Textures => corpus::textures(),
        Kind::Maps | Kind::Bombs | Kind::Kept => corpus::maps(),
        Kind::Lists => vec![corpus::gltf_file(corpus::gltf().swap_remove(0))],
    };
    // Sound input first: thread pools, tables and the allocator's own growth are no input's doing.
    for entry in &entries {
        if let Found::Refused(sentence) = read(kind, "warm", entry, folder) {
            panic!("the corpus is not sound: {sentence}");
        }
    }
    // Taken before anything is measured.
    let mut text = String::with_capacity(if kind == Kind::Lists { lists::MAX_BYTES } else { 0 });
    let mut tally = Tally { worst_excess_bytes: i64::MIN, ..Tally::default() };
    for number in first..first + count {
        println!("{number}");
        if kind == Kind::Lists {
            text.clear();
            lists::write(&mut text, lists::FILES[number as usize].1).expect("written");
        }
        let mut random = SplitMix(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
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
                let kind = match name {
                    _ if name.contains(".gl") => Kind::Gltf,
                    _ if name.ends_with(".ktx2") => Kind::Textures,
                    _ => Kind::Maps,
                };
                (bytes.len(), read(kind, name, &bytes, folder))
            }
            Kind::Lists => {
                let (name, _) = lists::FILES[number as usize];
                (text.len(), read(Kind::Gltf, name, text.as_bytes(), folder))
            }
            Kind::Kept => {
                let (target, bytes) = kept::all().swap_remove(number as usize);
                let nothing = || {
                    assert_eq!(target, "settings", "without a window there are none of them alone");
                    Found::Refused("no such target".to_owned())
                };
                let found = targets::read(target, bytes, folder).unwrap_or_else(nothing);
                (bytes.len(), found)
            }
            #[cfg(feature = "window")]
            Kind::Settings if random.below(4) > 0 => {
                let bytes = mutate::numbers(&entries[random.below(entries.len())], &mut random);
                (bytes.len(), read(kind, "spoilt", &bytes, folder))
            }
            Kind::Gltf if random.below(4) > 0 => {
                let sources = corpus::gltf();
                let source = &sources[random.below(sources.len())];
                let bytes = corpus::gltf_file(mutate::gltf(source, &mut random));
                (bytes.len(), read(kind, "spoilt", &bytes, folder))
            }
            _ => {
                let bytes = mutate::bytes(&entries, &mut random);
                (bytes.len(), read(kind, "spoilt", &bytes, folder))
            }
        };
        let grown = before.growth();
        if grown > ALLOWANCE_BYTES {
            eprintln!("input {number} took {grown} bytes");
        }
        count_in(&mut tally, number, grown, length as u64, &found);
    }
    println!("{}", serde_json::to_string(&tally).expect("JSON"));
}

fn count_in(tally: &mut Tally, number: u64, grown: u64, length: u64, found: &Found) {
    let honest = match found {
        Found::Accepted { honest_bytes, is_sound } => {
            tally.accepted += 1;
            tally.unsound += u64::from(!is_sound);
            if !is_sound {
                eprintln!("input {number} is out of bounds");
            }
            length.max(*honest_bytes)
        }
        Found::Refused(sentence) => {
            tally.refused += 1;
            if sentence.is_empty() || sentence.contains('\n') {
                tally.unclear += 1;
                eprintln!("input {number} is refused with {sentence:?}");
            }
            length
        }
    };
    let excess = grown as i64 - 4 * honest as i64;
    if excess > tally.worst_excess_bytes {
        (tally.worst_excess_bytes, tally.worst) = (excess, number);
    }
}

/// Reads one input as its kind is read.
fn read(kind: Kind, name: &str, bytes: &[u8], folder: &Path) -> Found {
    let written = |name: &str| {
        let path = folder.join(name);
        fs::write(&path, bytes).expect("written");
        path
    };
    match kind {
        Kind::Gltf | Kind::Lists => match gltf::load_slice(bytes, None, name) {
            Ok(scene) => of_scene(scene),
            Err(error) => Found::Refused(error.to_string()),
        },
        Kind::Textures => read::texture(bytes, name),
        #[cfg(feature = "window")]
        Kind::Settings => settings::read(&written("settings.json")),
        _ => read::map(&written(name)),
    }
}

/// A picture of it: whatever was loaded can be rendered.
fn of_scene(scene: Scene) -> Found {
    let Found::Accepted { honest_bytes, is_sound } = read::scene(&scene) else {
        unreachable!("it was loaded");
    };
    let camera = scene.cameras.first().cloned();
    let world = World::new(scene);
    let camera = camera.unwrap_or_else(|| framing::frame(&world, 1.0));
    let map = Image::filled(16, 8, [1.0; 3]);
    let environment = Environment::new(map, &EnvironmentOptions::default()).expect("a map");
    let view = View {
        filter: PixelFilter::Box,
        sampling: Sampling::Plain,
        limits: PathLimits { bounces: 4, russian_roulette: false },
        seed: 1,
        learning_paths: 1 << 13,
        ..View::new(camera, [4, 4])
    };
    let mut session = Session::new(&world, &environment, view);
    session.advance(1, &AtomicBool::new(false)).expect("a picture");
    let finite = session.film().pixels().iter().all(|p| p.mean().iter().all(|c| c.is_finite()));
    Found::Accepted { honest_bytes, is_sound: is_sound && finite }
}

/// Address space of this process, where the system tells: what is asked for counts, not only what is
/// touched.
struct Memory {
    now: u64,
    peak: u64,
}

impl Memory {
    fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
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
