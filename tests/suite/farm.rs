//! Pictures rendered in parts, and ones whose process was killed.

use std::fs;

use lightgrid::image::read_picture;

use crate::cli::{Bench, render_line, text};

#[test]
fn a_frame_that_cannot_be_written_takes_no_other_with_it() {
    let bench = Bench::new();
    fs::create_dir(bench.path("f.1.exr")).expect("made");
    let line = render_line("--turntable 3 -o f.#.exr --device cpu");
    let none = ["TMPDIR", "TMP"].map(|name| (name, bench.path("none")));
    let output = bench.command(&line).envs(none).output();
    let output = output.expect("the binary starts");
    let says = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{says}");
    assert!(bench.path("f.0.exr").is_file() && bench.path("f.2.exr").is_file(), "{says}");
    assert!(says.contains("f.1.exr: cannot be written: it is a folder"), "{says}");
    assert!(says.contains("nor can the picture be kept: "), "{says}");
}

/// Learned modes, too, render the very samples that one process would.
#[test]
fn parts_join_into_the_file_that_one_process_writes() {
    let bench = Bench::new();
    // The first three parts of seven lie where rendering still learns.
    for (count, rest) in [
        (2, "--sampling plain --spp 5"),
        (3, "--sampling talk --spp 8 --layers all"),
        (7, "--spp 9 --size 66x64"),
        (3, "--spp 9 --size 66x64 --sharing 4x4 --region 10,20,40,30"),
        (2, "--spp 6 --fog 0.05"),
    ] {
        let line = format!("{rest} --reproducible --device cpu");
        bench.render(&format!("{line} -o whole.exr"));
        let parts: Vec<String> = (1..=count).rev().map(|i| format!("{i}.part")).collect();
        for part in &parts {
            let number = part.strip_suffix(".part").expect("a number");
            bench.render(&format!("{line} --part {number}/{count} -o {part}"));
        }
        let layers = if rest.contains("--layers") { "--layers all" } else { "" };
        let merged = bench.run(&format!("merge {} -o joined.exr {layers}", parts.join(" ")));
        assert!(merged.status.success(), "{rest}: {}", text(&merged.stderr));
        let [whole, joined] =
            ["whole.exr", "joined.exr"].map(|name| fs::read(bench.path(name)).expect("written"));
        assert!(whole == joined, "{rest}");
    }
}

#[test]
fn parts_that_do_not_belong_together_are_refused_by_name() {
    let bench = Bench::new();
    let part = |rest: &str, name: &str| bench.render(&format!("{rest} -o {name}.part"));
    part("--part 1/2", "a");
    part("--part 2/2", "b");
    part("--part 2/2 --seed 1", "seed");
    part("--part 2/2 --size 18x32", "size");
    part("--part 2/2 --eye 1,1,1 --target 0,0,0", "camera");
    part("--part 2/2 --env-rotation 90", "settings");
    part("--part 2/3 --spp 3", "three");
    part("--part 2/2 --spp 3", "long");
    fs::copy(bench.path("b.part"), bench.path("again.part")).expect("copied");
    let whole = fs::read(bench.path("b.part")).expect("written");
    fs::write(bench.path("cut.part"), &whole[..whole.len() - 1]).expect("written");
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    fs::write(bench.path("damaged.part"), damaged).expect("written");
    for (names, sentence) in [
        ("seed.part", "seed.part: does not belong to a.part: another --seed"),
        ("size.part", "size.part: does not belong to a.part: another camera, size"),
        ("camera.part", "camera.part: does not belong to a.part: another camera"),
        ("settings.part", "settings.part: does not belong to a.part: another --env-rotation"),
        (
            "three.part",
            "three.part: is part 2 of 3 of 3 samples a pixel, but a.part is part 1 of 2",
        ),
        ("long.part", "long.part: is part 2 of 2 of 3 samples a pixel, but a.part is part 1 of 2"),
        ("b.part again.part", "again.part: is part 2 of 2, and so is b.part"),
        ("cut.part", "cut.part: is cut short"),
        ("damaged.part", "damaged.part: is damaged: its checksum does not fit"),
        ("map.exr", "map.exr: is neither a part of a picture nor a checkpoint"),
        ("nowhere.part", "nowhere.part: there is no such file"),
        ("", "the picture is not whole: part 2 of 2 is missing (--allow-missing"),
        ("b.part -o c.png --denoise", "a.part: has no albedo, normal and depth"),
    ] {
        let message = bench.refusal(&format!("merge a.part {names} -o c.exr"), 1);
        assert!(message.contains(sentence), "{names}: {message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
    // A built-in scene is known by its name, and by what was changed of it.
    let of_crack = |rest: &str, name: &str| {
        let size = "--size 16x9 --spp 2 --device cpu --learning-paths 100";
        let output = bench.run(&format!("render crack --env map.exr {size} {rest} -o {name}.part"));
        assert!(output.status.success(), "{rest}: {}", text(&output.stderr));
    };
    of_crack("--part 1/2", "crack");
    for change in ["--material brick:color=#f00000", "--hide pine"] {
        of_crack(&format!("--part 2/2 {change}"), "changed");
        let message = bench.refusal("merge crack.part changed.part -o c.exr", 1);
        assert!(message.contains("changed.part: does not belong to crack.part: another scene"));
    }
    let output = bench.run("merge a.part --allow-missing -o c.png");
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("part 2 of 2 is missing\n"));
    for (rest, status, sentence) in [
        ("--part 1/2 -o c.png", 1, "c.png: a part is written as .part"),
        ("--part 1/2 -o c.part -o d.part", 1, "--part writes one file"),
        ("--part 1/3 --spp 2 -o c.part", 1, "2 samples a pixel cannot be shared by so many"),
        ("--part 3/2 -o c.part", 2, "expected two numbers like 2/8"),
        ("--part 1/2 --seconds 1 -o c.part", 2, "cannot be used with"),
        ("--part 1/2 --gi cached -o c.part", 1, "they want --gi exact"),
        ("--checkpoint c.part --gi cached -o c.exr", 1, "they want --gi exact"),
        ("--part 1/2 --noise 0.1 -o c.part", 2, "cannot be used with"),
        ("-o c.part", 1, "c.part: pictures are written as .png or .exr"),
        ("-o c.exr --checkpoint a.part --spp 3", 1, "a.part: is the checkpoint of part 1 of 2"),
        ("-o c.exr --checkpoint c.png", 1, "c.png: is neither a part of a picture nor"),
        ("-o c.exr --checkpoint map.exr", 1, "map.exr: would be written over the scene or the map"),
        ("-o c.exr --checkpoint c.exr", 1, "two outputs would be written to this one file"),
    ] {
        let message = bench.refusal(&render_line(rest), status);
        assert!(message.contains(sentence), "{rest}: {message}");
    }
}

/// Made from a checkpoint, too; one that holds more samples than are asked for keeps them, and says so.
#[test]
fn a_picture_of_a_checkpoint_says_what_it_is_of() {
    let bench = Bench::new();
    bench.render("--spp 3 --checkpoint c.film -o a.exr --seed 77");
    assert!(bench.run("merge c.film --allow-missing -o b.exr").status.success());
    let [whole, merged] = ["a.exr", "b.exr"].map(|name| {
        let file = fs::read(bench.path(name)).expect("written");
        let names = file.windows(10).filter(|bytes| bytes == b"lightgrid.").count();
        (names, String::from_utf8_lossy(&file).contains("scene.gltf"))
    });
    assert!(whole.0 > 15 && whole.1, "{whole:?}");
    assert_eq!(merged, whole);
    let output = bench.render("--spp 2 --checkpoint c.film -o a.exr --seed 77");
    let says = text(&output.stderr);
    assert!(says.contains("goes on from 3 samples a pixel, which is more than is asked"), "{says}");
    // Nothing was learned for that, and nothing is forgotten by it.
    bench.render("--spp 6 --checkpoint c.film -o a.exr --seed 77 --json a.json");
    let file = fs::read(bench.path("a.json")).expect("written");
    let record = serde_json::from_slice::<serde_json::Value>(&file).expect("JSON");
    assert!(record["session"]["learned_cells"].as_u64() > Some(0), "{}", record["session"]);
}

#[cfg(unix)]
mod killed {
    use std::process::Stdio;
    use std::time::Duration;

    use super::*;

    /// Killed twice, at whatever it was doing.
    #[test]
    fn what_a_checkpoint_goes_on_from_ends_as_the_file_of_one_process() {
        for (output, rule) in [
            ("a.exr", "--spp 800 --size 66x64"),
            ("a.exr", "--noise 0.03 --spp 99999 --sampling talk"),
            ("a.part", "--spp 1000 --size 66x64 --part 2/2"),
        ] {
            let bench = Bench::new();
            let line = format!("{rule} --reproducible --device cpu");
            bench.render(&format!("{line} -o whole-{output}"));
            let command = format!("{line} --checkpoint film.checkpoint -o {output}");
            let checkpoint = bench.path("film.checkpoint");
            let written = || fs::metadata(&checkpoint).and_then(|facts| facts.modified()).ok();
            // On a busy machine one may end before this thread sees its checkpoint, which is then a whole
            // picture's: that is tried again from the one before.
            let is_killed = || {
                let (kept, before) = (fs::read(&checkpoint).ok(), written());
                let mut child = bench
                    .command(&render_line(&format!("{command} --checkpoint-every 0.03")))
                    .stderr(Stdio::null())
                    .spawn()
                    .expect("the binary starts");
                while written() == before && child.try_wait().expect("a child").is_none() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                child.kill().expect("killed");
                child.wait().expect("it ends");
                let was_done = fs::remove_file(bench.path(output)).is_ok();
                match kept {
                    _ if !was_done => {}
                    Some(bytes) => fs::write(&checkpoint, bytes).expect("put back"),
                    None => fs::remove_file(&checkpoint).expect("removed"),
                }
                !was_done
            };
            for _ in 0..2 {
                assert!((0..20).any(|_| is_killed()), "{rule}: always done before it is killed");
            }
            let says = text(&bench.render(&command).stderr);
            assert!(says.contains("film.checkpoint: goes on from "), "{rule}: {says}");
            let [whole, resumed] = [format!("whole-{output}"), output.to_owned()]
                .map(|name| fs::read(bench.path(&name)).expect("written"));
            match output {
                "a.exr" => assert!(whole == resumed, "{rule}"),
                // What was done differs, for some of it was done twice.
                _ => assert!(content(&whole) == content(&resumed), "{rule}"),
            }
            let message = bench.refusal(&render_line(&format!("{command} --seed 7")), 1);
            assert!(message.contains("of another picture, which differs in --seed"), "{message}");
        }
    }

    /// What follows the first line of a part, without the checksum.
    fn content(part: &[u8]) -> &[u8] {
        let line = part.iter().position(|byte| *byte == b'\n').expect("a line");
        &part[line..part.len() - 8]
    }
}

/// A camera on an arm that turns by a quarter in a second, above the square; 2 units of length away.
const MOVING: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"children": [2]},
        {"camera": 0, "translation": [0, 0.4, 2], "rotation": [0, 0, 0, 1]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "animations": [{"channels": [{"sampler": 0, "target": {"path": "pointer"}},
            {"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
        "samplers": [{"input": 1, "output": 2}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3",
            "min": [-1, 0, -1], "max": [1, 1, 1]},
        {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC4"}],
    "bufferViews": [{"buffer": 0, "byteLength": 108}, {"buffer": 1, "byteLength": 8},
        {"buffer": 1, "byteOffset": 8, "byteLength": 32}],
    "buffers": [{"uri": "scene.bin", "byteLength": 108}, {"uri": "keys.bin", "byteLength": 40}]
}"#;

/// Writes [`MOVING`] under this name.
pub(crate) fn put_moving_scene(bench: &Bench, name: &str) {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let keys = [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half];
    let bytes: Vec<u8> = keys.iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    fs::write(bench.path("keys.bin"), bytes).expect("written");
    fs::write(bench.path(name), MOVING).expect("written");
}

#[test]
fn frames_are_the_pictures_from_where_the_camera_is_then() {
    let bench = Bench::new();
    put_moving_scene(&bench, "moving.gltf");
    let common = "--env map.exr --size 32x18 --spp 4 --sampling plain --device cpu --fov 50";
    let run = |line: &str| {
        let output = bench.run(&format!("render {line} {common}"));
        assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    };
    let picture = |name: &str| read_picture(&bench.path(name)).expect("a picture");
    let difference = |a: &str, b: &str| {
        let (a, b) = (picture(a), picture(b));
        let pairs = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
        pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / f64::from(3 * 32 * 18)
    };
    // At 8 frames a second the first second ends with frame 8; frame 12 is after the last key.
    run("moving.gltf --frames 4..8 --fps 8 -o path.##.exr");
    run("moving.gltf --frames 12 --fps 8 -o path.##.exr");
    run("scene.gltf --eye 0,0.4,2 --target 0,0.4,0 --turntable 8 --frames 0..2 -o turn.##.exr");
    run("scene.gltf --eye 2,0.4,0 --target 0,0.4,0 -o side.exr");
    run(
        "scene.gltf --eye 0,0.4,2 --target 0,0.4,1 --about 0,0.4,0 --turntable 8 --frames 2 -o about.##.exr",
    );
    assert_eq!(
        bench.files().into_iter().filter(|name| name.starts_with("path")).collect::<Vec<_>>(),
        ["path.04.exr", "path.05.exr", "path.06.exr", "path.07.exr", "path.08.exr", "path.12.exr"]
    );
    for same in ["path.08", "path.12", "turn.02", "about.02"] {
        let found = difference(&format!("{same}.exr"), "side.exr");
        assert!(found < 1e-3, "{same} is the side: {found}");
    }
    assert!(difference("path.04.exr", "turn.01.exr") < 1e-3, "an eighth of a turn");
    assert!(difference("turn.00.exr", "side.exr") > 0.05);

    // What one frame learns the next one goes on from.
    let line =
        "scene.gltf --eye 0,0.4,2 --target 0,0.4,0 --turntable 400 --frames 0..1 -o near.#.exr";
    let learning =
        "--env map.exr --size 32x18 --spp 4 --learning-paths 500 --device cpu --json near.#.json";
    let output = bench.run(&format!("render {line} {learning}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    let session = |frame: u32| {
        let file = fs::read(bench.path(&format!("near.{frame}.json"))).expect("written");
        serde_json::from_slice::<serde_json::Value>(&file).expect("JSON")["session"].clone()
    };
    let [first, second] = [session(0), session(1)];
    assert_eq!((&first["learning_paths"], &second["learning_paths"]), (&500.into(), &0.into()));
    assert!(
        second["learned_cells"].as_u64() >= first["learned_cells"].as_u64(),
        "{first} {second}"
    );

    for (rest, status, sentence) in [
        (
            "moving.gltf --frames 0..1 -o a.png",
            1,
            "frames need a number in their names, as a.####.png",
        ),
        ("scene.gltf --frames 0..1 -o a.#.png", 1, "the camera does not move in scene.gltf"),
        ("scene.gltf --turntable 4 --frames 2..4 -o a.#.png", 1, "the last of a turn's 4 is 3"),
        ("moving.gltf --frames 3..1 -o a.#.png", 2, "the first one not after the last"),
        (
            "moving.gltf --frames 0..1 --part 1/2 -o a.part",
            1,
            "--part and --checkpoint are of one frame",
        ),
        ("moving.gltf -o a.mp4", 1, "pictures are written as .png or .exr"),
    ] {
        let message = bench.refusal(&format!("render {rest} {common}"), status);
        assert!(message.contains(sentence), "{rest}: {message}");
    }
}

#[test]
fn videos_need_ffmpeg_and_say_so() {
    let bench = Bench::new();
    let line = render_line("--turntable 3 -o a.mp4 -o b.gif -o c.webm --size 33x19 --device cpu");
    let without = bench.command(&line).env("PATH", "/nowhere").output().expect("the binary starts");
    assert_eq!(without.status.code(), Some(1));
    assert!(text(&without.stderr).contains("a.mp4: ffmpeg, which makes videos, is not found"));
    let is_there = std::process::Command::new("ffmpeg").arg("-version").output().is_ok();
    if !is_there {
        eprintln!("SKIPPED: ffmpeg is not there");
        return;
    }
    bench.render(line.strip_prefix("render scene.gltf --env map.exr ").expect("its beginning"));
    let start = |name: &str| fs::read(bench.path(name)).expect("written")[..12].to_vec();
    assert_eq!(&start("a.mp4")[4..8], b"ftyp");
    assert_eq!(&start("b.gif")[..6], b"GIF89a");
    assert_eq!(&start("c.webm")[..4], [0x1a, 0x45, 0xdf, 0xa3]);
}

/// ffmpeg as a script that fails where it says.
#[cfg(unix)]
fn with_ffmpeg(bench: &Bench, script: &str, line: &str) -> std::process::Output {
    let folder = bench.path("bin");
    crate::cli::install(&folder, "ffmpeg", script);
    fs::create_dir_all(bench.path("tmp")).expect("made");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut command = bench.command(&render_line(line));
    command.env("PATH", format!("{}:{path}", folder.display())).env("TMPDIR", bench.path("tmp"));
    command.output().expect("the binary starts")
}

/// Frames take hours: whatever becomes of their video, they are there.
#[cfg(unix)]
#[test]
fn frames_of_a_video_that_cannot_be_made_are_kept() {
    let bench = Bench::new();
    let line = "--turntable 2 -o a.mp4 --size 32x18 --device cpu";
    let cannot = with_ffmpeg(&bench, "echo 'Unknown encoder libx264' >&2; exit 1", line);
    let says = text(&cannot.stderr);
    assert!(says.contains("a.mp4: ffmpeg cannot make it: Unknown encoder libx264"), "{says}");
    let fails_later =
        "case \"$*\" in *null*) cat > /dev/null ;; *) echo 'no space' >&2; exit 1 ;; esac";
    let fails = with_ffmpeg(&bench, fails_later, line);
    let says = text(&fails.stderr);
    assert_eq!(fails.status.code(), Some(1), "{says}");
    assert!(says.contains("a.mp4: ffmpeg failed: no space"), "{says}");
    let folder = says.lines().find_map(|line| Some(line.split_once("the frames are kept in ")?.1));
    let folder = std::path::Path::new(folder.expect("it says where"));
    let frames = fs::read_dir(folder).expect("it is there").flatten();
    let frames = frames.filter(|file| file.path().extension().is_some_and(|end| end == "png"));
    assert_eq!(frames.count(), 2, "{says}");
}

/// The automatic exposure of the first frame is that of all, without noise, too.
#[test]
fn all_frames_have_one_exposure() {
    let bench = Bench::new();
    bench.render("--turntable 3 --denoise -o f.#.png --size 40x24 --device cpu");
    let exposure = |frame: u32| {
        let file = fs::read(bench.path(&format!("f.{frame}.png"))).expect("written");
        let at = file.windows(21).position(|bytes| bytes == b"lightgrid.exposure_ev");
        file[at.expect("it is said")..][22..].iter().copied().take(6).collect::<Vec<_>>()
    };
    assert_eq!([exposure(1), exposure(2)], [exposure(0), exposure(0)]);
}

#[test]
fn shells_and_man_know_every_command() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = bench.run(&format!("completions {shell}")).stdout;
        assert!(
            ["merge", "checkpoint-every", "turntable"]
                .iter()
                .all(|word| text(&script).contains(word))
        );
    }
    fs::create_dir(bench.path("man1")).expect("made");
    assert!(bench.run("man man1").status.success());
    let page = fs::read_to_string(bench.path("man1/lightgrid-render.1")).expect("written");
    assert!(page.contains(".TH lightgrid") && page.contains("turntable"), "{page}");
    for page in ["lightgrid", "lightgrid-merge", "lightgrid-view", "lightgrid-stability"] {
        assert!(bench.path(&format!("man1/{page}.1")).exists(), "{page}");
    }
    if cfg!(feature = "report") {
        assert!(bench.path("man1/lightgrid-report-talk.1").exists());
    }
    let says = bench.refusal("man nowhere", 1);
    assert_eq!(says, "lightgrid: nowhere: is no folder that exists\n");
    assert!(bench.refusal("render --sp 3 -o a.png", 2).contains("'--spp'"), "did you mean");
}

/// The scripts of `docs/farm.md` on a node of our own; needs Slurm and to be root.
#[cfg(target_os = "linux")]
mod slurm {
    use std::net::TcpListener;
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    use super::*;

    /// A controller, a node and what tells them who is who, until dropped.
    struct Cluster {
        folder: tempfile::TempDir,
        daemons: Vec<Child>,
    }

    impl Drop for Cluster {
        fn drop(&mut self) {
            // Jobs first: they are no children of ours.
            let _ = self.command("scancel --full --user=root").status();
            let waited = Instant::now();
            while !self.says("squeue -h").is_empty() && waited.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(200));
            }
            for daemon in self.daemons.iter_mut().rev() {
                let _ = daemon.kill();
                let _ = daemon.wait();
            }
        }
    }

    /// Longer than anything here takes.
    const PATIENCE: Duration = Duration::from_secs(300);

    impl Cluster {
        /// `None`, with a message, where there is no Slurm.
        fn start() -> Option<Self> {
            let is_there = |name: &&str| Command::new(name).arg("-V").output().is_ok();
            let is_there = ["munged", "slurmctld", "slurmd", "sbatch"].iter().all(is_there);
            let is_root =
                Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout == b"0\n");
            if !is_there || !is_root {
                eprintln!("SKIPPED: Slurm and munge are not there, or this is not root");
                return None;
            }
            let folder = tempfile::tempdir().expect("a temporary folder");
            let root = folder.path().display().to_string();
            let ports = [(); 2].map(|()| TcpListener::bind(("127.0.0.1", 0)).expect("a free port"));
            let [controller, node] =
                ports.map(|port| port.local_addr().expect("an address").port().to_string());
            for name in ["state", "spool"] {
                fs::create_dir(folder.path().join(name)).expect("made");
            }
            let configuration = CONFIGURATION
                .replace("ROOT", &root)
                .replace("CONTROLLER_PORT", &controller)
                .replace("NODE_PORT", &node);
            fs::write(folder.path().join("slurm.conf"), configuration).expect("written");
            fs::write(folder.path().join("munge.key"), [7; 128]).expect("written");
            let chmod =
                Command::new("chmod").arg("600").arg(folder.path().join("munge.key")).status();
            assert!(chmod.expect("chmod is there").success());
            let mut cluster = Self { folder, daemons: Vec::new() };
            for line in [
                "munged --foreground --force --key-file=ROOT/munge.key --socket=ROOT/munge.socket \
                 --pid-file=ROOT/munge.pid --log-file=ROOT/munge.log --seed-file=ROOT/munge.seed",
                "slurmctld -D -i -f ROOT/slurm.conf",
                "slurmd -D -f ROOT/slurm.conf -N localhost",
            ] {
                let mut daemon = cluster.command(&line.replace("ROOT", &root));
                daemon.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
                cluster.daemons.push(daemon.spawn().expect("it was there"));
                std::thread::sleep(Duration::from_secs(1));
            }
            cluster.wait("sinfo -h -o %t", |says| says.contains("idle"));
            Some(cluster)
        }

        fn command(&self, line: &str) -> Command {
            let mut words = line.split_whitespace();
            let mut command = Command::new(words.next().expect("a program"));
            command.args(words).env("SLURM_CONF", self.folder.path().join("slurm.conf"));
            command
        }

        fn says(&self, line: &str) -> String {
            text(&self.command(line).output().expect("Slurm is there").stdout)
        }

        fn wait(&self, line: &str, until: impl Fn(&str) -> bool) {
            let start = Instant::now();
            while !until(&self.says(line)) {
                assert!(start.elapsed() < PATIENCE, "{line}: {}", self.says(line));
                std::thread::sleep(Duration::from_millis(100));
            }
        }

        /// Submits a job from a folder, with our binary in reach; returns its number.
        fn submit(&self, folder: &Path, line: &str) -> String {
            let binaries = Path::new(env!("CARGO_BIN_EXE_lightgrid")).parent().expect("a folder");
            let path = std::env::var("PATH").unwrap_or_default();
            let output = self
                .command(&format!("sbatch --parsable {line}"))
                .current_dir(folder)
                .env("PATH", format!("{}:{path}", binaries.display()))
                .output()
                .expect("Slurm is there");
            assert!(output.status.success(), "{line}: {}", text(&output.stderr));
            text(&output.stdout).trim().to_owned()
        }
    }

    const CONFIGURATION: &str = "\
ClusterName=lightgrid
SlurmctldHost=localhost
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=ROOT/munge.socket
SlurmctldPort=CONTROLLER_PORT
SlurmdPort=NODE_PORT
StateSaveLocation=ROOT/state
SlurmdSpoolDir=ROOT/spool
SlurmctldPidFile=ROOT/slurmctld.pid
SlurmdPidFile=ROOT/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
ReturnToService=2
KillWait=5
SchedulerParameters=batch_sched_delay=0,sched_interval=2
NodeName=localhost CPUs=2 State=UNKNOWN
PartitionName=low Nodes=ALL Default=YES PriorityTier=1 State=UP
PartitionName=high Nodes=ALL PriorityTier=10 State=UP
";

    /// The script of `docs/farm.md` whose second line begins with its name.
    fn script(name: &str) -> &'static str {
        let page = include_str!("../../docs/farm.md");
        let mut blocks =
            page.split("```bash\n").skip(1).filter_map(|rest| rest.split("```").next());
        blocks.find(|block| block.contains(&format!("\n# {name}: "))).expect("a script")
    }

    #[test]
    fn arrays_of_parts_and_frames_survive_preemption() {
        let Some(cluster) = Cluster::start() else { return };
        let bench = Bench::new();
        for name in ["parts.sh", "frames.sh"] {
            fs::write(bench.path(name), script(name)).expect("written");
        }
        let folder = bench.path("");
        let options =
            "scene.gltf --env map.exr --size 128x72 --spp 600 --reproducible --device cpu";
        assert!(bench.run(&format!("render {options} -o whole.exr")).status.success());

        let rest = format!("--array=1-2 parts.sh {options} --checkpoint-every 0.3");
        let parts = cluster.submit(&folder, &rest);
        while !bench.path("1.checkpoint").exists() || !bench.path("2.checkpoint").exists() {
            std::thread::sleep(Duration::from_millis(50));
            assert!(!bench.path("part.1.part").exists(), "ended before it could be preempted");
        }
        let urgent = cluster.submit(&folder, "--partition=high --exclusive --wrap true");
        cluster.wait(&format!("squeue -h -j {urgent}"), str::is_empty);
        // Slurm would let them wait for two minutes.
        cluster.says(&format!("scontrol update jobid={parts} starttime=now"));
        let merge = "#!/bin/bash\nlightgrid merge part.*.part -o joined.exr\n";
        fs::write(bench.path("merge.sh"), merge).expect("written");
        cluster.submit(&folder, &format!("--dependency=afterok:{parts} merge.sh"));
        cluster.wait("squeue -h", str::is_empty);
        let logs = bench.files().into_iter().filter(|name| name.starts_with("slurm-"));
        let logs: String =
            logs.map(|name| fs::read_to_string(bench.path(&name)).expect("text")).collect();
        assert!(logs.contains("checkpoint: goes on from "), "it was preempted: {logs}");
        let [whole, joined] = ["whole.exr", "joined.exr"].map(|name| fs::read(bench.path(name)));
        assert!(whole.expect("written") == joined.expect(&logs), "the very file of one process");

        let options = options.replace("--spp 600", "--spp 4 --exposure 0 --turntable 3");
        cluster.submit(&folder, &format!("--array=0-2 frames.sh {options}"));
        cluster.wait("squeue -h", str::is_empty);
        assert!(bench.run(&format!("render {options} -o one.####.png")).status.success());
        for frame in 0..3 {
            let [alone, together] = ["frame", "one"].map(|name| {
                fs::read(bench.path(&format!("{name}.000{frame}.png"))).expect("written")
            });
            assert!(alone == together, "frame {frame}");
        }
    }
}
