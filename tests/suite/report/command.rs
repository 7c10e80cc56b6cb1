//! `lightgrid report` from outside: files, resuming, references, refusals.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use lightgrid::image::{ExrPicture, Rgb8, read_picture, write_exr, write_png};
use serde_json::Value;

use crate::cli::{Bench, text};

const LINE: &str = "report scene.gltf --env map.exr --sampling plain,adaptive --seconds 0.4 --seeds 2 \
                    --size 32x18 --bounces 2 --reference-noise 0.2 -o out";

fn succeed(bench: &Bench, line: &str) -> Output {
    let output = bench.run(line);
    assert!(output.status.success(), "{line}: {}", text(&output.stderr));
    output
}

/// Files of runs, and when each run was where: no two measurements agree to the last digit.
fn runs(bench: &Bench) -> Vec<(PathBuf, Vec<f64>)> {
    let entries = fs::read_dir(bench.path("out/runs")).expect("a folder");
    let mut found = Vec::new();
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        if path.extension().is_some_and(|e| e == "json") {
            let run: Value =
                serde_json::from_slice(&fs::read(&path).expect("readable")).expect("JSON");
            let points = run["points"].as_array().into_iter().flatten();
            let seconds = points.map(|p| number(&p["seconds"])).collect();
            found.push((path, seconds));
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

fn reference_facts(bench: &Bench) -> (PathBuf, Value) {
    let mut entries = fs::read_dir(bench.path("out/references")).expect("a folder");
    let path = entries.next().expect("one").expect("an entry").path();
    assert!(entries.next().is_none(), "one picture, one reference");
    let bytes = fs::read(&path).expect("readable");
    let line = bytes.split(|b| *b == b'\n').next().expect("a line");
    (path, serde_json::from_slice(line).expect("JSON"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_report_has_all_its_parts_and_goes_on_where_it_stopped() {
    let bench = Bench::new();
    // No reference is so noisy that it had to grow, upon which all runs are measured anew.
    let line = &LINE.replace("--reference-noise 0.2", "--reference-noise 1");
    let output = succeed(&bench, line);
    let table = text(&output.stdout);
    assert!(table.contains("| scene.gltf / map.exr | CPU |"), "{table}");
    assert!(text(&output.stderr).contains("2 methods x 2 runs of 0.4 s"));
    assert!(
        table.contains("Seconds to FLIP 0.10 / 0.07 / 0.05 of pictures denoised by"),
        "{table}"
    );

    let json = bench.json("out/report.json");
    assert_eq!(json["is_finished"], true);
    let row = &json["rows"][0];
    assert_eq!(row["reference"]["is_good"], true, "{}", row["reference"]);
    let methods = row["devices"][0]["methods"].as_array().expect("methods");
    assert_eq!(methods.len(), 2);
    for method in methods {
        // What was reached at the end was reached at some time, and what is cleaner later.
        let errors = method["errors"].as_array().expect("errors");
        let last = errors.iter().find(|e| e[0] == "denoised-flip").expect("it is a measure");
        let mut before = 0.0;
        for (flip, reached) in
            [0.10, 0.07, 0.05].into_iter().zip(method["clean_seconds"].as_array().expect("times"))
        {
            assert_eq!(
                reached.is_array(),
                number(&last[1]["mean"]) <= flip,
                "{last} {flip} {reached}"
            );
            if reached.is_array() {
                assert!((before..=0.4).contains(&number(&reached[0])), "{reached}");
                before = number(&reached[0]);
            }
        }
        let costs = &method["costs"];
        let (rays, all) = (number(&costs["ray_seconds"]), number(&costs["render_seconds"]));
        assert!(rays > 0.0 && rays <= all, "{costs}");
        if method["method"]["name"] == "plain" {
            // Against seconds, which other processes stretch.
            let slope = number(&method["slopes"][0][1]["mean"]);
            assert!(slope < 0.0, "{slope}");
        }
        for run in method["runs"].as_array().expect("runs") {
            let points = run["points"].as_array().expect("points");
            let seconds: Vec<f64> = points.iter().map(|p| number(&p["seconds"])).collect();
            assert!(seconds.is_sorted() && seconds.last().is_some_and(|s| *s >= 0.4));
            assert!(points.iter().all(|p| number(&p["errors"]["flip"]) >= 0.0));
            assert!(points.iter().all(|p| number(&p["errors"]["mse"]) > 0.0));
            assert!(points.iter().all(|p| (0.0..0.5).contains(&number(&p["denoised_flip"]))));
            if method["method"]["name"] == "plain" {
                // Without learning even a run this short has enough points; Sobol's are a little steeper.
                let [first, last] = [&points[0], &points[points.len() - 1]];
                let ratio = |of: &dyn Fn(&Value) -> f64| (of(last) / of(first)).ln();
                let error = ratio(&|p| number(&p["errors"]["mse"]));
                let slope = error / ratio(&|p| number(&p["samples"]));
                assert!((-1.9..=-0.6).contains(&slope), "{slope}");
            }
        }
    }
    for shares in row["shares"].as_array().expect("two") {
        let total = number(&shares["total"]);
        let parts = ["filter", "first_vertex", "later_vertices"].map(|p| number(&shares[p]));
        assert!(parts.iter().all(|p| (0.0..3.0 * total).contains(p)), "{shares}");
        assert!(parts.iter().sum::<f64>() > 0.3 * total, "{shares}");
    }

    let csv = fs::read_to_string(bench.path("out/report.csv")).expect("written");
    let mut lines = csv.lines();
    let columns = lines.next().expect("a head").split(',').count();
    assert!(lines.clone().count() > 8 && lines.all(|l| l.split(',').count() == columns), "{csv}");
    let plot = fs::read_to_string(bench.path("out/plots/scene.gltf-map.exr-cpu.svg"));
    assert!(plot.expect("written").contains("seconds (table, learning, rendering)"));
    let html = fs::read_to_string(bench.path("out/report.html")).expect("written");
    assert!(html.contains("data:image/png;base64,") && html.contains("<svg"));
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http") && !outside.contains("src=\"/"), "readable offline");

    // Nothing is missing: nothing is measured. One run is: it alone is measured.
    let before = runs(&bench);
    succeed(&bench, line);
    assert_eq!(runs(&bench), before);
    let (lost, _) = before.iter().find(|(_, seconds)| !seconds.is_empty()).expect("a run");
    fs::remove_file(lost).expect("removed");
    succeed(&bench, line);
    let after = runs(&bench);
    assert!(after.iter().any(|(path, _)| path == lost), "measured again");
    for run in &before {
        assert_eq!(after.contains(run), run.0 != *lost, "{run:?}");
    }
    // A file cut short is as good as none.
    fs::write(lost, "{\"method\":").expect("written");
    succeed(&bench, line);
    assert!(fs::read_to_string(lost).expect("readable").contains("points"));
}

#[test]
fn the_reference_grows_until_it_is_good_enough() {
    let bench = Bench::new();
    let line =
        |noise: &str| LINE.replace("--reference-noise 0.2", &format!("--reference-noise {noise}"));
    succeed(&bench, &line("0.5"));
    let (path, first) = reference_facts(&bench);
    let share =
        |bench: &Bench| number(&bench.json("out/report.json")["rows"][0]["reference"]["share"]);
    let noisy = share(&bench);
    assert!(noisy <= 0.5001);
    // Less than it happens to be.
    succeed(&bench, &line(&format!("{:.5}", 0.3 * noisy)));
    let (same, second) = reference_facts(&bench);
    assert_eq!(same, path);
    let pictures = |facts: &Value| facts["pictures"].as_u64().expect("a count");
    assert!(pictures(&second) > pictures(&first), "{first} {second}");
    assert!(share(&bench) <= 0.301 * noisy, "{} {noisy}", share(&bench));
    // The first ones were kept: a picture more or less could not hide this many.
    assert!(number(&second["seconds"]) > number(&first["seconds"]));
    assert_eq!(second["samples_per_picture"], first["samples_per_picture"]);

    // A reference cut short is not taken for one.
    let bytes = fs::read(&path).expect("readable");
    fs::write(&path, &bytes[..bytes.len() - 8]).expect("written");
    fs::remove_dir_all(bench.path("out/runs")).expect("removed");
    succeed(&bench, &line("0.5"));
    let (_, third) = reference_facts(&bench);
    assert!(pictures(&third) < pictures(&second), "{third}");

    // Another picture has a reference of its own.
    let other = line("0.5").replace("--bounces 2", "--bounces 1");
    succeed(&bench, &other);
    assert_eq!(fs::read_dir(bench.path("out/references")).expect("a folder").count(), 2);
    let row = &bench.json("out/report.json")["rows"][0];
    for shares in row["shares"].as_array().expect("two") {
        assert_eq!(number(&shares["later_vertices"]), 0.0, "one bounce has no later vertices");
    }
}

#[test]
fn a_given_reference_is_judged_by_the_runs() {
    let bench = Bench::new();
    let render = "render scene.gltf --env map.exr --size 32x18 --bounces 2 --filter box";
    succeed(&bench, &format!("{render} --spp 16384 --seed 5 -o good.exr"));
    let good = read_picture(&bench.path("good.exr")).expect("a picture");
    let mut wrong = good.clone();
    wrong.pixels.iter_mut().for_each(|rgb| *rgb = rgb.map(|v| 1.3 * v));
    let picture = ExrPicture { image: &wrong, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("wrong.exr"), picture).expect("written");
    // Short runs: the error of what a quick machine renders in them still exceeds the reference's noise by far.
    let line = LINE.replace("--seconds 0.4", "--seconds 0.1");
    let share = |file: &str| {
        succeed(&bench, &format!("{line}-{file} --reference {file}"));
        let row = bench.json(&format!("out-{file}/report.json"))["rows"][0].clone();
        (number(&row["reference"]["share"]), row["reference"]["is_good"] == true)
    };
    let (wrong, is_good) = share("wrong.exr");
    assert!(wrong > 0.5 && !is_good, "{wrong}");
    let html = fs::read_to_string(bench.path("out-wrong.exr/report.html")).expect("written");
    assert!(html.contains("The reference is too noisy"), "it is said");
    let (good, _) = share("good.exr");
    assert!(good < 0.5 * wrong, "{good} {wrong}");
}

#[test]
fn what_cannot_be_reported_is_refused_at_once() {
    let bench = Bench::new();
    let picture = lightgrid::image::Image::filled(8, 8, [1.0; 3]);
    let picture = ExrPicture { image: &picture, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("small.exr"), picture).expect("written");
    let black = lightgrid::image::Image::filled(8, 8, [0.0; 3]);
    let picture = ExrPicture { image: &black, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("black.exr"), picture).expect("written");
    let developed = Rgb8 { width: 8, height: 8, pixels: vec![[90; 3]; 64] };
    write_png(&bench.path("small.png"), &developed, None, &[]).expect("written");
    let out = |rest: &str| format!("report {rest} -o out");
    for (line, reason) in [
        (out("none"), "neither a file nor a built-in scene"),
        (out("office none.glb"), "none.glb: there is no such file"),
        (out("office --env sky:mars"), "no built-in sky called \"mars\""),
        (out("office --env sky:day --env none.hdr"), "none.hdr: there is no such file"),
        (out("office open --reference small.exr"), "one of each"),
        (out("talk --device cpu --adapter x").replace("out", "map.exr"), "map.exr"),
        (out("scene.gltf --reference small.exr"), "is 8x8 pixels, the runs are 240x135"),
        (
            out("scene.gltf --size 8x8 --reference small.png"),
            "small.png: is developed for a display",
        ),
        (out("scene.gltf --size 8x8 --reference black.exr"), "black.exr: is black"),
        ("report office -o map.exr".to_owned(), "map.exr: cannot be a folder: something else is"),
        ("report ablations --only xyz -o out".to_owned(), "MIS compensation"),
    ] {
        let message = bench.refusal(&line, 1);
        assert!(message.contains(reason), "{line}: {message}");
    }
    for (line, reason) in [
        ("report office".to_owned(), "--output"),
        (out("office --seeds 0"), "is not in 1.."),
        (out("office --seconds 0"), "above 0"),
        (out("office --bounces 0"), "is not in 1.."),
        (out("office --reference-noise 1.5"), "at most 1"),
        (out("office --sampling best"), "adaptive"),
        (out("office --device tpu"), "cpu"),
        (out("office --size 0x3"), "two positive whole numbers"),
        ("report sat --scale 0".to_owned(), "above 0"),
    ] {
        let message = bench.refusal(&line, 2);
        assert!(message.contains(reason), "{line}: {message}");
    }
}

#[test]
fn a_black_picture_is_refused_as_a_reference_by_its_names() {
    let bench = Bench::new();
    let black = lightgrid::image::Image::filled(8, 8, [0.0; 3]);
    let picture = ExrPicture { image: &black, layers: vec![], metadata: &[], preview: None };
    write_exr(&bench.path("black.exr"), picture).expect("written");
    let line = "report scene.gltf --env black.exr --size 8x8 --seconds 0.1 --seeds 1 -o out";
    let output = bench.run(line);
    let says = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{says}");
    assert!(says.contains("scene.gltf / black.exr: the picture is black"), "{says}");
}

#[test]
fn importance_tables_are_compared_and_kept() {
    let bench = Bench::new();
    let table = text(&succeed(&bench, "report sat --scale 0.02 -o out").stdout);
    for title in ["Hallway", "Day", "Night", "Sunset", "Extreme"] {
        assert_eq!(table.matches(&format!("| {title} ")).count(), 4, "{table}");
    }
    assert!(table.contains("1.0e-5") && table.contains("3.8e-1"), "the talk's figures: {table}");
    let csv = fs::read_to_string(bench.path("out/sat.csv")).expect("written");
    assert_eq!(csv.lines().count(), 21);
    let missed = |table: &str| -> f64 {
        let line = csv.lines().find(|l| l.starts_with("Extreme") && l.contains(table));
        let field = line.and_then(|l| l.split(',').nth(5)?.parse().ok());
        field.expect("a number")
    };
    assert_eq!(missed(",tile-local,"), 0.0);
    assert!(bench.path("out/sat.json").exists());
    let again = text(&succeed(&bench, "report sat --scale 0.02 -o out").stdout);
    assert_eq!(again, table, "timings too: nothing was measured again");
}

#[cfg(unix)]
#[test]
fn an_interrupted_report_says_so_and_goes_on() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    use crate::cli::send;

    let bench = Bench::new();
    let child = bench.command(LINE).stderr(Stdio::piped()).stdout(Stdio::null()).spawn();
    let child = child.expect("the binary starts");
    let start = Instant::now();
    let has_run = |folder: &Path| {
        fs::read_dir(folder).is_ok_and(|mut entries| {
            entries.any(|e| e.is_ok_and(|e| e.path().extension().is_some_and(|e| e == "json")))
        })
    };
    while !has_run(&bench.path("out/runs")) {
        assert!(start.elapsed() < Duration::from_secs(120), "the first run takes too long");
        std::thread::sleep(Duration::from_millis(10));
    }
    send(&child, "-INT");
    let output = child.wait_with_output().expect("it ends");
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("the same command goes on from here"), "{message}");
    let html = fs::read_to_string(bench.path("out/report.html")).expect("written");
    assert!(html.contains("Not finished"));
    let before = runs(&bench);
    assert!(!before.is_empty());
    succeed(&bench, LINE);
    let after = runs(&bench);
    let names = |list: &[(PathBuf, Vec<f64>)]| -> Vec<PathBuf> {
        list.iter().map(|(path, _)| path.clone()).collect()
    };
    assert!(names(&before).iter().all(|name| names(&after).contains(name)), "they were taken over");
    assert_eq!(bench.json("out/report.json")["is_finished"], true);
}
