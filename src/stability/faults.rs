//! What goes wrong around a render: killed while saving, no room, no permission, files that vanish,
//! impatience, and a GPU that is lost or too small.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::Vec3;

use super::random::Random;
use super::scenes::{lambert, mean, room, sky, view};
use super::scratch::{Finished, Scratch, finish};
use super::{Case, On, Outcome, Setting};
use crate::error::{Error, Result};
use crate::image::{read_map, read_picture};
use crate::render::gpu::{Gpu, UploadedScene};
use crate::render::{Sampling, Session, View};
use crate::scene::{Camera, gltf};

const fn case(name: &'static str, on: On, run: fn(&Setting) -> Result<Outcome>) -> Case {
    Case { group: "faults", name, on, run }
}

pub(super) const CASES: &[Case] = &[
    case("killed-while-saving", On::Cpu, killed_while_saving),
    case("full-disk", On::Cpu, full_disk),
    case("read-only-folder", On::Cpu, read_only_folder),
    case("file-vanishes-while-loading", On::Cpu, vanishing_files),
    case("interrupted-twice", On::Cpu, interrupted_twice),
    case("device-lost", On::Gpu, device_lost),
    case("out-of-gpu-memory", On::Gpu, out_of_gpu_memory),
];

/// A quick render without learning; the picture is large enough to take a while to write.
const LINE: &str =
    "render open --env sky:overcast@64x32 --bounces 0 --sampling bsdf --device cpu --spp 1";

/// The picture from before, or all of a new one: never a part.
fn killed_while_saving(setting: &Setting) -> Result<Outcome> {
    if !cfg!(unix) {
        return Ok(Outcome::skipped("needs kill -9"));
    }
    let scratch = Scratch::new()?;
    let mut random = Random(3);
    let (mut spoilt, mut caught, mut finished) = (0_u32, 0_u32, 0_u32);
    for round in 0..setting.count(6, 100) {
        let picture = if round % 2 == 0 { "a.exr" } else { "a.png" };
        finish(&mut scratch.lightgrid(setting, &format!("{LINE} --size 16x9 -o {picture}")), 60)?;
        let before = scratch.read(picture)?;
        let line = format!("{LINE} --size 1024x768 --seed 1 -o {picture}");
        let mut child = scratch
            .lightgrid(setting, &line)
            .spawn()
            .map_err(|e| Error::new(format!("a process of lightgrid: {e}")))?;
        let delay = Duration::from_micros(random.below(8000) as u64);
        let is_saving = || {
            let parts = scratch.names();
            let sizes = parts.iter().filter(|name| name.ends_with(".part"));
            sizes.filter_map(|name| std::fs::metadata(scratch.path(name)).ok()).any(|m| m.len() > 0)
        };
        while child.try_wait().is_ok_and(|status| status.is_none()) && !is_saving() {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(delay);
        // SIGKILL, as kill -9.
        let _ = child.kill();
        let ended = child.wait().map_err(|e| Error::new(e.to_string()))?;
        let was_killed = ended.code().is_none();
        caught += u32::from(was_killed);
        finished += u32::from(!was_killed);
        let now = scratch.read(picture)?;
        let whole = read_picture(&scratch.path(picture)).is_ok_and(|image| image.width == 1024);
        spoilt += u32::from(now != before && !whole);
    }
    Ok(Outcome::new()
        .at_most("pictures that are neither the old nor the new one", f64::from(spoilt), 0.0)
        .at_least("processes killed while they wrote", f64::from(caught), 1.0)
        .told("processes that were quicker", f64::from(finished)))
}

/// No room after 64 KiB: the file limit of a shell stands for it.
fn full_disk(setting: &Setting) -> Result<Outcome> {
    #[cfg(unix)]
    {
        let scratch = Scratch::new()?;
        let (mut refused, mut intact, mut left) = (0, 0, 0);
        let pictures = ["a.exr", "a.png"];
        for picture in pictures {
            let small = format!("{LINE} --size 16x9 -o {picture}");
            finish(&mut scratch.lightgrid(setting, &small), 60)?;
            let before = scratch.read(picture)?;
            let line = format!("{LINE} --size 640x480 -o {picture}");
            // Ignored, the signal becomes an error of the write, as ENOSPC would be.
            let limits = "trap '' XFSZ; ulimit -f 64";
            let found = finish(&mut scratch.limited(setting, limits, &line), 60)?;
            refused += u32::from(found.refused() && found.says.contains("cannot be written"));
            intact += u32::from(scratch.read(picture)? == before);
            left += scratch.names().len() - 1;
            let _ = std::fs::remove_file(scratch.path(picture));
        }
        // The words for it, from the writer itself.
        let full = crate::image::write_beside_and_rename(&scratch.path("b"), |_| {
            Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
        });
        let said = full.is_err_and(|e| e.to_string().contains("the disk is full"));
        let all = pictures.len() as f64;
        Ok(Outcome::new()
            .at_least("refusals in one sentence", f64::from(refused), all)
            .at_least("pictures from before that are intact", f64::from(intact), all)
            .at_most("files left behind", left as f64, 0.0)
            .at_least("a full disk is called that", f64::from(u8::from(said)), 1.0))
    }
    #[cfg(not(unix))]
    {
        let _ = setting;
        Ok(Outcome::skipped("needs a shell's ulimit"))
    }
}

/// Refused before the work, not after it. The superuser may write anywhere, so it hands over to a
/// user who may not.
fn read_only_folder(setting: &Setting) -> Result<Outcome> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        use std::os::unix::process::CommandExt as _;
        const NOBODY: u32 = 65_534;
        let scratch = Scratch::new()?;
        let locked = std::fs::Permissions::from_mode(0o555);
        std::fs::set_permissions(scratch.folder(), locked)
            .map_err(|e| Error::new(e.to_string()))?;
        let may_write = std::fs::write(scratch.path("probe"), b"").is_ok();
        let line = format!("{LINE} --size 640x480 -o a.exr").replace("--spp 1", "--spp 1000000");
        let mut command = scratch.lightgrid(setting, &line);
        if may_write {
            let _ = std::fs::remove_file(scratch.path("probe"));
            let mut asking = scratch.lightgrid(setting, "--version");
            if !finish(asking.uid(NOBODY), 60).is_ok_and(|f| f.code == Some(0)) {
                let reason = "run as the superuser, and nobody else may run this binary";
                return Ok(Outcome::skipped(reason));
            }
            command.uid(NOBODY);
        }
        let start = Instant::now();
        let found = finish(&mut command, 60);
        let opened = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(scratch.folder(), opened)
            .map_err(|e| Error::new(e.to_string()))?;
        let Finished { says, .. } = &found.as_ref().map_err(Clone::clone)?;
        let refused = found.as_ref().is_ok_and(Finished::refused) && says.contains("a.exr");
        Ok(Outcome::new()
            .at_least("refused in one sentence", f64::from(u8::from(refused)), 1.0)
            .at_most("seconds until then", start.elapsed().as_secs_f64(), 10.0)
            .remark(says.trim().to_owned()))
    }
    #[cfg(not(unix))]
    {
        let _ = setting;
        Ok(Outcome::skipped("needs Unix permissions"))
    }
}

/// Files that are cut, emptied, removed and put back while they are read.
fn vanishing_files(setting: &Setting) -> Result<Outcome> {
    let scratch = Scratch::new()?;
    let map = crate::image::Image::filled(256, 128, [1.0; 3]);
    let picture = crate::image::ExrPicture { image: &map, layers: Vec::new(), metadata: &[] };
    crate::image::write_exr(&scratch.path("map.exr"), picture)?;
    let corners: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let json = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,
        "type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"uri":"scene.bin","byteLength":36}]}"#;
    scratch.write("scene.gltf", json)?;
    scratch.write("scene.bin", &corners)?;
    let sound = [scratch.read("map.exr")?, corners];
    let done = AtomicBool::new(false);
    let (mut read, mut refused, mut nameless) = (0, 0, 0);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut random = Random(9);
            while !done.load(Ordering::Relaxed) {
                for (name, bytes) in ["map.exr", "scene.bin"].into_iter().zip(&sound) {
                    let path = scratch.path(name);
                    let _ = match random.below(4) {
                        0 => std::fs::remove_file(path),
                        1 => std::fs::write(path, &bytes[..random.below(bytes.len())]),
                        _ => std::fs::write(path, bytes),
                    };
                }
                std::thread::sleep(Duration::from_micros(random.below(300) as u64));
            }
        });
        let start = Instant::now();
        let limit = Duration::from_secs(setting.count(2, 60));
        while start.elapsed() < limit {
            let loaded = gltf::load(&scratch.path("scene.gltf")).map(|_| ());
            for result in [loaded, read_map(&scratch.path("map.exr")).map(|_| ())] {
                match result {
                    Ok(()) => read += 1,
                    Err(error) => {
                        refused += 1;
                        let text = error.to_string();
                        let named = text.contains("map.exr") || text.contains("scene.gltf");
                        nameless += u32::from(!named || text.contains('\n'));
                    }
                }
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    Ok(Outcome::new()
        .at_most("refusals that do not name the file in a sentence", f64::from(nameless), 0.0)
        .at_least("reads that met a file in pieces or gone", f64::from(refused), 1.0)
        .at_least("reads that met a whole one", f64::from(read), 1.0))
}

/// The first interruption writes the picture, the second one leaves at once with status 130, the
/// picture from before intact.
fn interrupted_twice(setting: &Setting) -> Result<Outcome> {
    #[cfg(unix)]
    {
        let scratch = Scratch::new()?;
        finish(&mut scratch.lightgrid(setting, &format!("{LINE} --size 16x9 -o a.exr")), 60)?;
        let before = scratch.read("a.exr")?;
        let line = LINE.replace("--spp 1", "--spp 1000000");
        let interrupt = |id: u32| {
            let kill = format!("kill -INT {id}");
            std::process::Command::new("/bin/sh").args(["-c", &kill]).status()
        };
        let after = |size: &str, interruptions: u32| -> Result<(Option<i32>, f64)> {
            let failed = |e: std::io::Error| Error::new(format!("a process of lightgrid: {e}"));
            let line = format!("{line} --size {size} -o a.exr");
            let mut child = scratch.lightgrid(setting, &line).spawn().map_err(failed)?;
            // Past start-up and loading, where the handler is set.
            std::thread::sleep(Duration::from_millis(1500));
            let start = Instant::now();
            for _ in 0..interruptions {
                interrupt(child.id()).map_err(failed)?;
                std::thread::sleep(Duration::from_millis(100));
            }
            while child.try_wait().map_err(failed)?.is_none() {
                if start.elapsed() > Duration::from_secs(60) {
                    let _ = child.kill();
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            let status = child.wait().map_err(failed)?;
            Ok((status.code(), start.elapsed().as_secs_f64()))
        };
        // A pass of this size takes longer than the moment between the interruptions.
        let (twice, seconds) = after("6000x4000", 2)?;
        let intact = scratch.read("a.exr")? == before;
        let (once, _) = after("160x90", 1)?;
        let written = scratch.read("a.exr")? != before;
        let yes = |condition: bool| f64::from(u8::from(condition));
        Ok(Outcome::new()
            .at_least("twice: status 130", yes(twice == Some(130)), 1.0)
            .at_most("twice: seconds until it left", seconds, 5.0)
            .at_least("twice: the picture from before is intact", yes(intact), 1.0)
            .at_least("once: success", yes(once == Some(0)), 1.0)
            .at_least("once: the picture is written", yes(written), 1.0))
    }
    #[cfg(not(unix))]
    {
        let _ = setting;
        Ok(Outcome::skipped("needs Unix signals"))
    }
}

/// The work so far is kept and the CPU goes on. The device is one of its own: the others go on too.
fn device_lost(setting: &Setting) -> Result<Outcome> {
    let Some(known) = &setting.gpu else { return Ok(Outcome::skipped("needs --device gpu")) };
    let gpu = Gpu::open(Some(&known.facts().name))?;
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let (world, environment) = (builder.build(), sky("day")?);
    let never = AtomicBool::new(false);
    let on_gpu = UploadedScene::new(&gpu, &world, &environment)?;
    let view = view(camera, Sampling::Plain, 2);
    let mut session = Session::on_gpu(&world, &environment, view, &on_gpu)?;
    session.advance(4, &never)?;
    let before = session.film().clone();
    gpu.lose();
    let failure = session.advance(2, &never).err().map(|e| e.to_string()).unwrap_or_default();
    let kept = *session.film() == before;
    session.continue_on_cpu();
    session.advance(4, &never)?;
    let named = failure.contains(&gpu.facts().name) && !failure.contains('\n');
    let yes = |condition: bool| f64::from(u8::from(condition));
    let goes_on = session.samples() == 8 && mean(session.film()).luminance > 0.0;
    Ok(Outcome::new()
        .sound(session.film())
        .at_least("the loss is one sentence with the device's name", yes(named), 1.0)
        .at_least("what was rendered is kept", yes(kept), 1.0)
        .at_least("the CPU goes on", yes(goes_on), 1.0))
}

/// A picture that the device has no room for is refused with the numbers; a small one still works.
fn out_of_gpu_memory(setting: &Setting) -> Result<Outcome> {
    let Some(gpu) = &setting.gpu else { return Ok(Outcome::skipped("needs --device gpu")) };
    let allowed = gpu.facts().storage_binding_bytes.min(gpu.facts().buffer_bytes);
    // 16 bytes of a pixel in each of its buffers on the device, 48 in the film.
    let side = ((allowed / 16 + 1) as f64).sqrt().ceil() as u32 + 1;
    if side > 8192 {
        let gibibytes = allowed >> 30;
        return Ok(Outcome::skipped(format!(
            "the device takes {gibibytes} GiB in one piece: the film in main memory would not fit first"
        )));
    }
    let world =
        super::scenes::SceneBuilder::default().floor(&lambert(0.5), Vec3::ZERO, 1.0).build();
    let environment = sky("day")?;
    let uploaded = UploadedScene::new(gpu, &world, &environment)?;
    let camera = Camera::look_at(Vec3::ONE, Vec3::ZERO, 0.5);
    let small = view(camera, Sampling::Plain, 1);
    let large = View { width: side, height: side, ..small.clone() };
    let refusal = Session::on_gpu(&world, &environment, large, &uploaded).err();
    let refusal = refusal.map(|e| e.to_string()).unwrap_or_default();
    let clear = refusal.contains("MiB") && !refusal.contains('\n');
    let mut session = Session::on_gpu(&world, &environment, small, &uploaded)?;
    session.advance(1, &AtomicBool::new(false))?;
    Ok(Outcome::new()
        .at_least("refused with the numbers", f64::from(u8::from(clear)), 1.0)
        .at_least("a small picture afterwards", mean(session.film()).luminance, 1e-3)
        .remark(refusal))
}
