//! Pictures rendered in parts, and ones whose process was killed.

use std::fs;

use crate::cli::{Bench, render_line, text};

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
        ("seed.part", "seed.part: does not belong to a.part: another seed"),
        ("size.part", "size.part: does not belong to a.part: another camera, size"),
        ("camera.part", "camera.part: does not belong to a.part: another camera"),
        ("settings.part", "settings.part: does not belong to a.part: another settings"),
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
        ("", "the picture is not whole: of 2 parts are missing: 2 (--allow-missing"),
        ("b.part --denoise", "a.part: has no albedo, normal and depth"),
    ] {
        let message = bench.refusal(&format!("merge a.part {names} -o c.exr"), 1);
        assert!(message.contains(sentence), "{names}: {message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
    let output = bench.run("merge a.part --allow-missing -o c.png");
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("of 2 parts are missing: 2\n"));
    for (rest, status, sentence) in [
        ("--part 1/2 -o c.png", 1, "c.png: a part is written as .part"),
        ("--part 1/2 -o c.part -o d.part", 1, "--part writes one file"),
        ("--part 1/3 --spp 2 -o c.part", 1, "2 samples a pixel cannot be shared by so many"),
        ("--part 3/2 -o c.part", 2, "expected two numbers like 2/8"),
        ("--part 1/2 --seconds 1 -o c.part", 2, "cannot be used with"),
        ("--part 1/2 --noise 0.1 -o c.part", 2, "cannot be used with"),
        ("-o c.part", 1, "c.part: pictures are written as .png or .exr"),
        ("-o c.exr --checkpoint a.part --spp 3", 1, "a.part: is the checkpoint of part 1 of 2"),
        ("-o c.exr --checkpoint map.exr", 1, "map.exr: is neither a part of a picture nor"),
        ("-o c.exr --checkpoint c.exr", 1, "two outputs would be written to this one file"),
    ] {
        let message = bench.refusal(&render_line(rest), status);
        assert!(message.contains(sentence), "{rest}: {message}");
    }
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
            ("a.exr", "--spp 300 --size 66x64"),
            ("a.exr", "--noise 0.03 --sampling talk"),
            ("a.part", "--spp 400 --size 66x64 --part 2/2"),
        ] {
            let bench = Bench::new();
            let line = format!("{rule} --reproducible --device cpu");
            bench.render(&format!("{line} -o whole-{output}"));
            let command = format!("{line} --checkpoint film.checkpoint -o {output}");
            let checkpoint = bench.path("film.checkpoint");
            let written = || fs::metadata(&checkpoint).and_then(|facts| facts.modified()).ok();
            for _ in 0..2 {
                let before = written();
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
                assert!(!bench.path(output).exists(), "{rule}: killed before the end");
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
            assert!(message.contains("of another picture, which differs in seed"), "{message}");
        }
    }

    /// What follows the first line of a part, without the checksum.
    fn content(part: &[u8]) -> &[u8] {
        let line = part.iter().position(|byte| *byte == b'\n').expect("a line");
        &part[line..part.len() - 8]
    }
}
