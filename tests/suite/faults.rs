//! What must not cost a picture: nobody who listens, full disks, hostile and vanishing files, signals.

use std::fs;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lightgrid::image::{ExrPicture, Image, read_map, write_exr};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::gltf;

use crate::cli::{Bench, text};
use crate::shared::count;

/// As [`Bench::command`], a small picture of a built-in scene.
const SMALL: &str = "render open --env sky:overcast@64x32 --device cpu --size 16x9 --spp 1";

fn sentence(output: &Output) -> String {
    let says = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{says}");
    let failures = says.lines().filter(|line| !line.starts_with("wrote "));
    assert_eq!(failures.count(), 1, "{says}");
    says
}

/// Without learning, and so that a large picture takes a while to write.
#[cfg(unix)]
const QUICK: &str =
    "render open --env sky:overcast@64x32 --bounces 0 --sampling bsdf --device cpu --spp 1";

/// What a process says that is done within a minute.
#[cfg(unix)]
fn finished(command: &mut Command) -> Output {
    let command = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the process starts");
    let start = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("a child");
            panic!(
                "not done in 60 s: {}",
                text(&child.wait_with_output().expect("it ends").stderr)
            );
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    // What it says fits a pipe's buffer: a few sentences.
    child.wait_with_output().expect("it ends")
}

/// A small picture to be replaced; its bytes.
#[cfg(unix)]
fn picture_from_before(bench: &Bench, name: &str) -> Vec<u8> {
    let output = finished(&mut bench.command(&format!("{QUICK} --size 16x9 -o {name}")));
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::read(bench.path(name)).expect("written")
}

/// A triangle whose buffer is `uri`, with `rest` before its end.
fn scene(uri: &str, rest: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{
        "attributes":{{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":9,
        "type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":108}}],
        "buffers":[{{"uri":"{uri}","byteLength":108}}]{rest}}}"#
    )
}

#[test]
fn uris_stay_below_the_scenes_folder_unless_they_may_leave_it() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("sub/deep")).unwrap();
    fs::copy(bench.path("scene.bin"), bench.path("sub/deep/own.bin")).unwrap();
    let absolute = bench.path("scene.bin").display().to_string().replace('\\', "/");
    for (uri, reason) in [
        ("deep/own.bin", ""),
        ("./deep/../deep/own.bin", ""),
        (r"deep\/own\u002ebin", ""),
        ("../scene.bin", "`../scene.bin` lies outside of the scene's folder"),
        ("%2e%2e%2fscene.bin", "`../scene.bin` lies outside of the scene's folder"),
        (absolute.as_str(), "lies outside of the scene's folder"),
        (r"\\\\host\\share\\own.bin", "lies outside of the scene's folder"),
        ("deep/own.bin:x", "`deep/own.bin:x` names a device or a stream"),
        ("", "its URI is empty"),
        (r"deep\\own.bin?x", ""),
        ("deep", "`deep` is a folder, not a file"),
        (&"a".repeat(5000), "aaa...`: "),
    ] {
        fs::write(bench.path("sub/scene.gltf"), scene(uri, "")).unwrap();
        let output = bench.run("info sub/scene.gltf");
        if reason.is_empty() {
            assert!(output.status.success(), "{uri}: {}", text(&output.stderr));
        } else {
            let says = sentence(&output);
            assert!(says.contains(reason) && says.len() < 500, "{uri}: {says}");
        }
    }
    fs::write(bench.path("sub/scene.gltf"), scene("../scene.bin", "")).unwrap();
    assert!(bench.run("info sub/scene.gltf --allow-outside").status.success());
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_pipes_and_devices_are_not_read() {
    let bench = Bench::new();
    fs::create_dir(bench.path("sub")).unwrap();
    std::os::unix::fs::symlink("../scene.bin", bench.path("sub/link.bin")).unwrap();
    let made = Command::new("mkfifo").arg(bench.path("sub/pipe.hdr")).status();
    assert!(made.unwrap().success());
    for (uri, options, reason) in [
        ("link.bin", "", "`link.bin` lies outside"),
        ("pipe.hdr", "", "`pipe.hdr` is a device or a pipe"),
        ("/dev/zero", "", "`/dev/zero` lies outside"),
        ("/dev/zero", "--allow-outside", "`zero` is a device or a pipe"),
    ] {
        fs::write(bench.path("sub/scene.gltf"), scene(uri, "")).unwrap();
        let says = sentence(&bench.run(&format!("info sub/scene.gltf {options}")));
        assert!(says.contains(reason), "{uri}: {says}");
    }
    for map in ["sub/pipe.hdr", "/dev/zero"] {
        let says = sentence(&bench.run(&format!("render open -o a.png --env {map}")));
        assert!(says.contains("is a device or a pipe"), "{map}: {says}");
    }
}

#[test]
fn a_file_named_many_times_is_read_once_and_only_if_it_is_used() {
    let bench = Bench::new();
    let file = fs::File::create(bench.path("large.bin")).unwrap();
    file.set_len(64 << 20).unwrap();
    let more = r#",{"uri":"large.bin","byteLength":1}"#.repeat(4000) + r#",{"uri":"none.bin"}"#;
    let text = scene("scene.bin", "").replace("108}]}", &format!("108}}{more}]}}"));
    assert!(text.contains("large.bin"));
    fs::write(
        bench.path("scene.gltf"),
        text.replace(r#""none.bin""#, r#""none.bin","byteLength":1"#),
    )
    .unwrap();
    let start = Instant::now();
    let output = bench.run("info scene.gltf");
    assert!(output.status.success(), "{}", self::text(&output.stderr));
    assert!(start.elapsed() < Duration::from_secs(20));
}

#[test]
fn thousands_of_missing_images_are_ten_lines() {
    let bench = Bench::new();
    let images: Vec<String> = (0..2000).map(|i| format!(r#"{{"uri":"{i}.png"}}"#)).collect();
    let textures: Vec<String> = (0..2000).map(|i| format!(r#"{{"source":{i}}}"#)).collect();
    let materials: Vec<String> = (0..2000)
        .map(|i| format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#))
        .collect();
    let primitives: Vec<String> =
        (0..2000).map(|i| format!(r#"{{"attributes":{{"POSITION":0}},"material":{i}}}"#)).collect();
    let rest = format!(
        r#","images":[{}],"textures":[{}],"materials":[{}]"#,
        images.join(","),
        textures.join(","),
        materials.join(",")
    );
    let primitives = format!("\"primitives\":[{}]}}],\"acc", primitives.join(","));
    let text = scene("scene.bin", &rest);
    let (before, after) = text.split_once("\"primitives\"").unwrap();
    let after = after.split_once("}],\"acc").unwrap().1;
    fs::write(bench.path("scene.gltf"), format!("{before}{primitives}{after}")).unwrap();
    let start = Instant::now();
    let says = self::text(&bench.run("info scene.gltf").stdout);
    assert!(says.contains("1990 more images cannot be used"), "{says}");
    assert_eq!(says.matches("there is no such file").count(), 10, "{says}");
    assert!(start.elapsed() < Duration::from_secs(60));
}

#[test]
fn names_from_files_command_no_terminal() {
    let bench = Bench::new();
    let camera = r#","cameras":[{"name":"\u001b]0;owned\u0007","type":"perspective",
        "perspective":{"yfov":0.5,"znear":0.1}}]"#;
    let text = scene("scene.bin", camera).replace(r#"[{"mesh":0}]"#, r#"[{"mesh":0,"camera":0}]"#);
    fs::write(bench.path("scene.gltf"), text).unwrap();
    for options in ["", "--json"] {
        let output = bench.run(&format!("info scene.gltf {options}"));
        assert!(output.status.success());
        let says = self::text(&output.stdout);
        assert!(says.contains("owned") && !says.contains('\u{1b}'), "{says}");
    }
}

/// A name with a line break does not look like two things that are said.
#[test]
fn names_from_files_make_no_lines_of_their_own() {
    let bench = Bench::new();
    let camera = r#","cameras":[{"name":"a\nnotice: all is well","type":"perspective",
        "perspective":{"yfov":0,"znear":0.1}}]"#;
    let text = scene("scene.bin", camera).replace(r#"[{"mesh":0}]"#, r#"[{"mesh":0,"camera":0}]"#);
    fs::write(bench.path("scene.gltf"), text).unwrap();
    let info = self::text(&bench.run("info scene.gltf").stdout);
    let render = "render scene.gltf --env map.exr --size 8x8 --spp 1 --device cpu -o a.png";
    let render = self::text(&bench.run(render).stderr);
    let mut unknown = bench.command("info scene.gltf --variant");
    let unknown = self::text(&unknown.arg("a\nnotice: all is well").output().unwrap().stderr);
    for says in [info, render] {
        assert!(says.contains("a\\u000anotice: all is well"), "{says}");
        assert!(!says.contains("\nnotice: all is well"), "{says}");
    }
    assert_eq!(unknown.lines().count(), 1, "{unknown}");
}

#[cfg(target_os = "linux")]
#[test]
fn nobody_who_listens_costs_no_picture() {
    for to in ["2>/dev/full", "2>&-", "<&- >&- 2>&-"] {
        let bench = Bench::new();
        let binary = env!("CARGO_BIN_EXE_lightgrid");
        // Without light there is something to remark.
        let line = format!("exec {binary} {SMALL} --env-intensity 0 -o a.png {to}");
        let status = Command::new("sh").args(["-c", &line]).current_dir(bench.path("")).status();
        assert_eq!(status.unwrap().code(), Some(0), "{to}");
        assert!(bench.path("a.png").exists(), "{to}");
    }
}

#[test]
fn results_that_cannot_be_printed_are_a_sentence_or_silence() {
    let bench = Bench::new();
    let mut child = bench
        .command("info living-room")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    #[cfg(target_os = "linux")]
    {
        for line in ["info open", "--help"] {
            let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
            let output = bench.command(line).stdout(full).output().unwrap();
            assert!(sentence(&output).contains("cannot be printed"));
        }
    }
}

/// The folder of one output goes away while the others are rendered.
#[test]
fn every_output_is_tried_every_failure_told_and_the_picture_rescued() {
    let bench = Bench::new();
    fs::create_dir(bench.path("gone")).unwrap();
    fs::create_dir(bench.path("tmp")).unwrap();
    let line = SMALL.replace("--spp 1", "--seconds 8");
    let child = bench
        .command(&format!("{line} -o gone/a.exr -o b.png --json gone/c.json --distributions d.csv"))
        .envs(["TMPDIR", "TMP"].map(|name| (name, bench.path("tmp"))))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(4));
    fs::remove_dir_all(bench.path("gone")).unwrap();
    let says = sentence(&child.wait_with_output().unwrap());
    assert!(bench.path("b.png").exists() && bench.path("d.csv").exists(), "{says}");
    assert!(says.contains("gone/a.exr: ") && says.contains("gone/c.json: "), "{says}");
    let kept: Vec<_> =
        fs::read_dir(bench.path("tmp")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(kept.len(), 1);
    assert!(says.contains(&format!("kept as {}", kept[0].display())), "{says}");
    lightgrid::image::read_picture(&kept[0]).expect("a whole picture");
}

#[test]
fn what_is_rendered_is_not_written_over() {
    let bench = Bench::new();
    let before = ["scene.gltf", "map.exr"].map(|name| fs::read(bench.path(name)).expect("a file"));
    let render = "render scene.gltf --env map.exr --device cpu --size 16x9 --spp 1";
    let measure = "bench scene.gltf --env map.exr --device cpu --size 16x9 --seconds 0.1";
    for line in [
        format!("{render} -o a.png --json ./scene.gltf"),
        format!("{render} -o map.exr"),
        format!("{render} -o a.exr --distributions map.exr"),
        format!("{measure} --json ./scene.gltf"),
        format!("{measure} --json map.exr"),
    ] {
        let says = bench.refusal(&line, 1);
        assert!(says.ends_with(": would be written over the scene or the map\n"), "{says}");
    }
    let after = ["scene.gltf", "map.exr"].map(|name| fs::read(bench.path(name)).expect("a file"));
    assert!(before == after);
}

#[test]
fn what_a_scene_names_is_not_written_over() {
    let bench = Bench::new();
    // Used, not used, and by another way; frames, too.
    let more = r#","images":[{"uri":"unused.png"},{"uri":"sub/%74urn-3.png"},{"uri":"none.png"}]"#;
    fs::write(bench.path("scene.gltf"), scene("scene.bin", more)).unwrap();
    fs::create_dir(bench.path("sub")).unwrap();
    for name in ["unused.png", "sub/turn-3.png"] {
        fs::write(bench.path(name), "somebody's work").unwrap();
    }
    let render = "render scene.gltf --env map.exr --device cpu --size 16x9 --spp 1";
    for (outputs, name) in [
        ("-o a.png --json scene.bin", "scene.bin"),
        ("-o a.exr -o ./sub/../unused.png", "unused.png"),
        ("-o sub/turn-#.png --turntable 4", "turn-3.png"),
    ] {
        let says = bench.refusal(&format!("{render} {outputs}"), 1);
        let expected = format!("scene.gltf: `{name}` is its data and would be written over\n");
        assert!(says.ends_with(&expected), "{outputs}: {says}");
    }
    assert!(fs::read(bench.path("unused.png")).unwrap() == b"somebody's work");
    let output = bench.run(&format!("{render} -o none.png -o sub/turn-1.png"));
    assert!(output.status.success(), "what is not there is not lost: {}", text(&output.stderr));
}

#[cfg(unix)]
#[test]
fn a_file_written_anew_keeps_its_mode_and_long_names_are_written() {
    use std::os::unix::fs::PermissionsExt as _;
    let bench = Bench::new();
    fs::write(bench.path("a.png"), "old").unwrap();
    fs::set_permissions(bench.path("a.png"), fs::Permissions::from_mode(0o600)).unwrap();
    let long = "a".repeat(251) + ".png";
    let output = bench.run(&format!("{SMALL} -o a.png -o {long}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(fs::read(bench.path("a.png")).unwrap().starts_with(b"\x89PNG"));
    let mode = fs::metadata(bench.path("a.png")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    assert!(bench.path(&long).exists());
    let says = sentence(&bench.run(&format!("{SMALL} -o a{long}")));
    assert!(says.contains("cannot be written"), "{says}");
}

#[test]
fn what_killed_processes_left_is_removed_when_it_is_old() {
    let bench = Bench::new();
    for (name, hours) in [(".lightgrid-1-0.part", 2), (".lightgrid-1-1.part", 0), ("own.part", 2)] {
        let file = fs::File::create(bench.path(name)).unwrap();
        let age = Duration::from_secs(3600 * hours + 60);
        file.set_modified(std::time::SystemTime::now() - age).unwrap();
    }
    assert!(bench.run(&format!("{SMALL} -o a.png")).status.success());
    assert!(!bench.path(".lightgrid-1-0.part").exists());
    assert!(bench.path(".lightgrid-1-1.part").exists() && bench.path("own.part").exists());
}

/// As for one whose target is there, which is written anew.
#[cfg(unix)]
#[test]
fn a_link_to_what_is_not_there_yet_is_followed() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("store/deep")).unwrap();
    std::os::unix::fs::symlink("store/next.png", bench.path("a.png")).unwrap();
    std::os::unix::fs::symlink("deep/b.png", bench.path("store/next.png")).unwrap();
    for _ in 0..2 {
        let output = bench.run(&format!("{SMALL} -o a.png"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        for link in ["a.png", "store/next.png"] {
            assert!(fs::symlink_metadata(bench.path(link)).unwrap().is_symlink(), "{link}");
        }
        assert!(bench.path("store/deep/b.png").is_file());
    }
    let says = sentence(&bench.run(&format!("{SMALL} -o a.png -o store/deep/b.png")));
    assert!(says.contains("two outputs"), "{says}");
    fs::remove_file(bench.path("store/deep/b.png")).unwrap();
    let says = sentence(&bench.run(&format!("{SMALL} -o a.png -o store/deep/b.png")));
    assert!(says.contains("two outputs"), "{says}");
    std::os::unix::fs::symlink("gone/c.png", bench.path("c.png")).unwrap();
    let says = sentence(&bench.run(&format!("{SMALL} -o c.png")));
    assert!(says.contains("c.png: cannot be written: there is no folder gone"), "{says}");
    std::os::unix::fs::symlink("d.png", bench.path("d.png")).unwrap();
    let says = sentence(&bench.run(&format!("{SMALL} -o d.png")));
    assert!(says.contains("d.png: cannot be written"), "{says}");
}

/// A picture of a bit a pixel that is small as a file: the sizes are looked at first.
#[test]
fn a_bomb_of_a_picture_is_refused_before_it_goes_off() {
    let bench = Bench::new();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 32_767, 32_767);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    let mut stream = writer.stream_writer().unwrap();
    for _ in 0..32_767 {
        std::io::Write::write_all(&mut stream, &[0; 4096]).unwrap();
    }
    stream.finish().unwrap();
    drop(writer);
    fs::write(bench.path("bomb.png"), &bytes).unwrap();
    let start = Instant::now();
    let says = sentence(&bench.run("info bomb.png"));
    assert!(says.contains("32767 x 32767"), "{says}");
    let rest = r#","images":[{"uri":"bomb.png"}],"textures":[{"source":0}],
        "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}]"#;
    let text =
        scene("scene.bin", rest).replace("\"POSITION\":0}", "\"POSITION\":0},\"material\":0");
    fs::write(bench.path("scene.gltf"), text).unwrap();
    let says = self::text(&bench.run("info scene.gltf").stdout);
    assert!(says.contains("bomb.png) cannot be used: "), "{says}");
    assert!(start.elapsed() < Duration::from_secs(30));
}

/// Under a limit on the address space, which a machine without memory is like.
#[cfg(target_os = "linux")]
#[test]
fn short_memory_is_a_sentence_with_both_numbers() {
    for line in [
        "render open --env sky:overcast@64x32 --device cpu --size 11000x11000 --spp 1 -o a.png",
        "info sky:day@16384x8192",
    ] {
        let bench = Bench::new();
        let says = sentence(&with_memory(&bench, 1_500_000, line));
        assert!(says.contains(" needs ") && says.contains(" MB are left"), "{says}");
        assert!(!bench.path("a.png").exists());
    }
}

/// What runs under a limit on the address space, in kilobytes.
#[cfg(target_os = "linux")]
fn with_memory(bench: &Bench, kilobytes: u32, line: &str) -> Output {
    let binary = env!("CARGO_BIN_EXE_lightgrid");
    Command::new("sh")
        .args(["-c", &format!("ulimit -v {kilobytes}; exec {binary} {line}")])
        // Stacks take address space, too.
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(bench.path(""))
        .output()
        .expect("a shell")
}

/// What objects take is known before they are read.
#[cfg(target_os = "linux")]
#[test]
fn short_memory_for_objects_is_a_sentence_with_both_numbers() {
    let bench = Bench::new();
    let nodes = r#"{"children":[1]},"#.repeat(3_000_000);
    let text = format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}{{}}]}}"#);
    fs::write(bench.path("scene.gltf"), text).unwrap();
    let says = sentence(&with_memory(&bench, 250_000, "info scene.gltf"));
    assert!(says.contains("scene.gltf: needs ") && says.ends_with(" are left\n"), "{says}");
}

/// A scene of a triangle for each of many materials.
fn of_materials(count: usize) -> String {
    let list = |item: &dyn Fn(usize) -> String| (0..count).map(item).collect::<Vec<_>>().join(",");
    let primitive = |i| format!(r#"{{"attributes":{{"POSITION":0}},"material":{i}}}"#);
    let material =
        |i| format!(r#"{{"pbrMetallicRoughness":{{"roughnessFactor":{}}}}}"#, i as f32 / 1e6);
    let more = format!(r#","materials":[{}]"#, list(&material));
    let one = r#"{
        "attributes":{"POSITION":0}}"#;
    scene("scene.bin", &more).replace(one, &list(&primitive))
}

/// Where nobody has asked first, it is said all the same, and the process ends as for any other cause.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_refused_is_no_abort() {
    let bench = Bench::new();
    fs::write(bench.path("scene.gltf"), of_materials(100_000)).unwrap();
    let says = sentence(&with_memory(&bench, 90_000, "info scene.gltf"));
    assert!(says.starts_with("lightgrid: memory is short: "), "{says}");
    assert!(says.ends_with(" bytes more cannot be had\n"), "{says}");
}

/// From what the process needs to start to what a picture needs there is nothing between a sentence and the
/// picture: no panic of a library or of a thread without a stack, no words of the allocator, and no wait for
/// a lock under which a backtrace takes memory.
#[cfg(target_os = "linux")]
#[test]
fn short_memory_of_any_size_is_a_sentence_or_a_picture() {
    let bench = Bench::new();
    let binary = env!("CARGO_BIN_EXE_lightgrid");
    let line = SMALL.replace("open", "living-room --threads 2");
    let files = bench.files();
    // Below, what loads the libraries has no room.
    let starts = |kilobytes: &u32| with_memory(&bench, *kilobytes, "--version").status.success();
    let least = (20_000..).step_by(1_000).find(starts).expect("it starts");
    let (mut sentences, mut pictures) = (0, 0);
    for kilobytes in (least..1_000_000).step_by(12_000) {
        let line = format!("ulimit -v {kilobytes}; exec timeout 60 {binary} {line} -o a.png");
        let output = Command::new("sh")
            .current_dir(bench.path(""))
            .env("RUST_BACKTRACE", "1")
            .args(["-c", &line])
            .output()
            .expect("sh starts");
        let says = text(&output.stderr);
        let is_there = fs::remove_file(bench.path("a.png")).is_ok();
        match output.status.code() {
            Some(0) => {
                assert!(is_there, "{kilobytes}: {says}");
                pictures += 1;
                if pictures == 3 {
                    break;
                }
            }
            _ => {
                assert_eq!(output.status.code(), Some(1), "{kilobytes}: {says}");
                // The C library cannot be kept from its own words where it has no room for a thread.
                let others = ["notice: ", "Fatal glibc error: "];
                let is_ours = |line: &&str| !others.iter().any(|other| line.starts_with(other));
                let said: Vec<&str> = says.lines().filter(is_ours).collect();
                // Two threads may be refused at once: one of them says so.
                let are_ours = said.iter().all(|one| one.starts_with("lightgrid: "));
                assert!(are_ours && said.len() <= 1 && !says.is_empty(), "{kilobytes}: {says}");
                assert!(!is_there, "{kilobytes}");
                assert_eq!(bench.files(), files, "{kilobytes}");
                sentences += 1;
            }
        }
    }
    assert!(sentences > 0 && pictures == 3, "{sentences} sentences, {pictures} pictures");
}

/// A picture is rendered only where there is memory to write it, too: of two pictures both are there or none.
#[cfg(target_os = "linux")]
#[test]
fn a_finished_picture_is_not_lost_for_want_of_memory() {
    let bench = Bench::new();
    for picture in ["--layers all", "--denoise"] {
        of_two_pictures_both_or_none(&bench, picture);
    }
}

#[cfg(target_os = "linux")]
fn of_two_pictures_both_or_none(bench: &Bench, picture: &str) {
    let line = format!("{QUICK} --size 1200x800 {picture} --threads 2 -o a.png -o b.exr");
    let (mut refused, mut written) = (0, 0);
    for kilobytes in (200_000..2_000_000).step_by(20_000) {
        let output = with_memory(bench, kilobytes, &line);
        let says = text(&output.stderr);
        let are_there = ["a.png", "b.exr"].map(|name| fs::remove_file(bench.path(name)).is_ok());
        assert_eq!(are_there, [output.status.success(); 2], "{kilobytes}: {says}");
        *(if output.status.success() { &mut written } else { &mut refused }) += 1;
        if written == 3 {
            break;
        }
    }
    assert!(refused > 0 && written == 3, "{refused} refused, {written} written");
}

/// Threads that cannot be had are no panic.
#[cfg(target_os = "linux")]
#[test]
fn threads_that_are_refused_are_a_sentence() {
    let bench = Bench::new();
    let says =
        sentence(&with_memory(&bench, 1_500_000, &format!("{SMALL} --threads 1024 -o a.png")));
    assert!(says.contains("1024 threads cannot be started: "), "{says}");
}

/// The picture from before, or all of a new one: never a part.
#[cfg(unix)]
#[test]
fn killed_while_saving_there_is_the_old_picture_or_the_new_one() {
    let bench = Bench::new();
    let mut random = SplitMix(3);
    let (mut caught, rounds) = (0, count(6, 100));
    for round in 0..rounds {
        let picture = if round % 2 == 0 { "a.exr" } else { "a.png" };
        let before = picture_from_before(&bench, picture);
        let mut command = bench.command(&format!("{QUICK} --size 1024x768 --seed 1 -o {picture}"));
        let mut child = command.stdin(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let delay = Duration::from_micros(random.below(8000) as u64);
        let is_saving = || {
            let parts = bench.files().into_iter().filter(|name| name.ends_with(".part"));
            parts.filter_map(|name| fs::metadata(bench.path(&name)).ok()).any(|m| m.len() > 0)
        };
        while child.try_wait().unwrap().is_none() && !is_saving() {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(delay);
        // SIGKILL, as kill -9.
        let _ = child.kill();
        caught += u32::from(child.wait().unwrap().code().is_none());
        let is_whole = || {
            let new = lightgrid::image::read_picture(&bench.path(picture));
            new.is_ok_and(|new| new.width == 1024)
        };
        let is_old = fs::read(bench.path(picture)).unwrap() == before;
        assert!(is_old || is_whole(), "round {round}: neither the old nor the new one");
    }
    assert!(caught >= 1, "none of {rounds} processes was killed while it wrote");
}

/// No room after 64 KiB: the file limit of a shell stands for it.
#[cfg(unix)]
#[test]
fn a_full_disk_is_a_sentence_and_the_old_picture_stays() {
    for picture in ["a.exr", "a.png"] {
        let bench = Bench::new();
        let before = (picture_from_before(&bench, picture), bench.files());
        // Ignored, the signal becomes an error of the write, as ENOSPC would be.
        let binary = env!("CARGO_BIN_EXE_lightgrid");
        let line = format!("exec {binary} {QUICK} --size 640x480 -o {picture}");
        let mut command = Command::new("sh");
        command.args(["-c", &format!("trap '' XFSZ; ulimit -f 64; {line}")]);
        let says = sentence(&finished(command.current_dir(bench.path(""))));
        assert!(says.contains("cannot be written") && !says.contains("panicked"), "{says}");
        let after = (fs::read(bench.path(picture)).unwrap(), bench.files());
        assert!(after == before, "the picture from before is there, and no other file");
    }
    // The words for it, from the writer itself.
    let bench = Bench::new();
    let full = lightgrid::image::write_beside_and_rename(&bench.path("b"), |_| {
        Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
    });
    let says = full.unwrap_err().to_string();
    assert!(says.contains("the disk is full"), "{says}");
}

/// Refused before the work, not after it. The superuser may write anywhere, so it hands over to a user
/// who may not.
#[cfg(unix)]
#[test]
fn a_read_only_folder_is_refused_before_the_work() {
    use std::os::unix::fs::PermissionsExt as _;
    use std::os::unix::process::CommandExt as _;
    const NOBODY: u32 = 65_534;
    let bench = Bench::new();
    let allow = |mode: u32| {
        fs::set_permissions(bench.path(""), fs::Permissions::from_mode(mode)).unwrap();
    };
    allow(0o555);
    let line = format!("{QUICK} --size 640x480 -o a.exr").replace("--spp 1", "--spp 1000000");
    let mut command = bench.command(&line);
    if fs::write(bench.path("probe"), "").is_ok() {
        fs::remove_file(bench.path("probe")).unwrap();
        let asked = bench.command("--version").uid(NOBODY).output();
        if !asked.is_ok_and(|output| output.status.success()) {
            eprintln!("SKIPPED: run as the superuser, and nobody else may run this binary");
            return;
        }
        command.uid(NOBODY);
    }
    let start = Instant::now();
    let output = finished(&mut command);
    allow(0o755);
    let says = sentence(&output);
    assert!(says.contains("a.exr") && !says.contains("panicked"), "{says}");
    assert!(start.elapsed() < Duration::from_secs(50));
}

/// Files that are cut, emptied, removed and put back while they are read.
#[test]
fn files_that_vanish_while_they_are_read_are_refused_by_name() {
    let bench = Bench::new();
    let map = Image::filled(256, 128, [1.0; 3]);
    let picture = ExrPicture { image: &map, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("map.exr"), picture).unwrap();
    let files = ["map.exr", "scene.bin"].map(|name| (name, fs::read(bench.path(name)).unwrap()));
    let done = AtomicBool::new(false);
    let (mut read, mut refusals) = (0, Vec::new());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut random = SplitMix(9);
            while !done.load(Ordering::Relaxed) {
                for (name, bytes) in &files {
                    let path = bench.path(name);
                    let _ = match random.below(4) {
                        0 => fs::remove_file(path),
                        1 => fs::write(path, &bytes[..random.below(bytes.len())]),
                        _ => fs::write(path, bytes),
                    };
                }
                std::thread::sleep(Duration::from_micros(random.below(300) as u64));
            }
        });
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(count(2, 60)) {
            let loaded = gltf::load(&bench.path("scene.gltf")).map(|_| ());
            for result in [loaded, read_map(&bench.path("map.exr")).map(|_| ())] {
                match result {
                    Ok(()) => read += 1,
                    Err(error) => refusals.push(error.to_string()),
                }
            }
        }
        done.store(true, Ordering::Relaxed);
    });
    for says in &refusals {
        let is_named = says.contains("map.exr") || says.contains("scene.gltf");
        assert!(is_named && !says.contains('\n'), "{says}");
    }
    assert!(read >= 1 && !refusals.is_empty(), "{read} reads of whole files, {refusals:?}");
}

#[cfg(unix)]
mod signals {
    use super::*;
    use crate::cli::send;

    /// Waits until a process catches a signal, however busy the machine is; where that cannot be seen, a second.
    fn wait_until_caught(child: &std::process::Child, signal: i32) {
        let is_caught = || {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
            let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?;
            Some(u64::from_str_radix(caught.trim(), 16).ok()? & 1 << (signal - 1) != 0)
        };
        while is_caught() == Some(false) {
            std::thread::sleep(Duration::from_millis(10));
        }
        if is_caught().is_none() {
            std::thread::sleep(Duration::from_secs(1));
        }
    }

    #[test]
    fn before_there_is_anything_to_keep_a_signal_ends_at_once() {
        for (signal, number) in [("-INT", 2), ("-TERM", 15)] {
            let bench = Bench::new();
            // Nothing can be kept while it learns.
            let child = bench
                .command("render living-room --device cpu --learning-paths 1000000000 -o a.png")
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            wait_until_caught(&child, number);
            let start = Instant::now();
            send(&child, signal);
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(128 + number));
            let says = text(&output.stderr);
            assert!(says.contains("before there was anything to keep"), "{says}");
            assert!(start.elapsed() < Duration::from_secs(30));
            assert!(!bench.files().iter().any(|name| name.contains("a.png")));
        }
    }
}
