//! The add-on for Blender, in Blender: what it sends is the scene that Cycles renders.

use std::path::Path;
use std::process::Command;

use lightgrid::image::read_picture;
use serde_json::Value;

use crate::cli::text;

/// Pixels of a block whose means are compared, each way.
const BLOCK: usize = 6;

/// Blender as a Python module: the Python that `LIGHTGRID_BPY` names, else the system's.
fn python() -> Option<String> {
    let python = std::env::var("LIGHTGRID_BPY").unwrap_or_else(|_| "python3".into());
    let has_blender = Command::new(&python).args(["-c", "import bpy"]).output();
    if has_blender.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    eprintln!("SKIPPED: {python} has no bpy (pip install bpy; LIGHTGRID_BPY names another Python)");
    None
}

fn run(command: &mut Command) -> String {
    let output = command.output().expect("it starts");
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(output.status.success(), "{command:?}: {said}");
    said
}

/// Mean radiance of each block.
fn blocks(file: &Path) -> Vec<[f64; 3]> {
    let image = read_picture(file).expect("a picture");
    let [width, height] = [image.width, image.height].map(|side| side as usize);
    assert_eq!([width, height], [64, 36]);
    let mut sums = vec![[0.0; 3]; (width / BLOCK) * (height / BLOCK)];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = (i % width / BLOCK, i / width / BLOCK);
        if x < width / BLOCK {
            let sum = &mut sums[y * (width / BLOCK) + x];
            sum.iter_mut().zip(pixel).for_each(|(sum, own)| *sum += f64::from(*own));
        }
    }
    sums.iter().map(|sum| sum.map(|channel| channel / (BLOCK * BLOCK) as f64)).collect()
}

#[test]
fn a_scene_sent_by_blender_is_the_one_that_cycles_renders() {
    let Some(python) = python() else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let zip = run(Command::new(root.join(".ci/blender")).arg(folder.path()));
    let lightgrid = env!("CARGO_BIN_EXE_lightgrid");
    run(Command::new(python)
        .arg(root.join("tests/blender/addon.py"))
        .args([zip.trim(), lightgrid])
        .arg(folder.path())
        .env("BLENDER_USER_RESOURCES", at("user"))
        .env("TMPDIR", folder.path())
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY"));
    let found = std::fs::read_to_string(at("sent.json")).expect("the script wrote it");
    let found: Value = serde_json::from_str(&found).expect("JSON");
    let says = |key: &str| found[key].as_str().unwrap_or_default();
    assert!(says("without a program").contains("choose the program"), "{found}");
    assert!(says("log").contains("rendering into lightgrid.png instead"), "{found}");
    assert!(found["picture"] == true, "a stopped program leaves its picture: {found}");

    for (room, arguments) in found["rooms"].as_object().expect("rooms") {
        let arguments = arguments.as_array().expect("arguments").iter();
        let arguments: Vec<&str> = arguments.map(|it| it.as_str().expect("text")).collect();
        assert_eq!(arguments[0], "view");
        let (ours, theirs) = (at(&format!("{room}-ours.exr")), at(&format!("{room}.exr")));
        let said = run(Command::new(lightgrid)
            .arg("render")
            .args(&arguments[1..])
            .args(["--size", "64x36", "--spp", "512", "--filter", "box", "--device", "cpu", "-o"])
            .arg(&ours));
        assert!(!said.contains("683"), "watts are asked for: {said}");
        let (ours, theirs) = (blocks(&ours), blocks(&theirs));
        let mean = |blocks: &[[f64; 3]]| blocks.iter().flatten().sum::<f64>();
        let ratio = mean(&ours) / mean(&theirs);
        assert!((ratio - 1.0).abs() < 0.01, "{room}: {ratio} times the light of Cycles");
        let scale = mean(&theirs) / theirs.len() as f64 / 3.0;
        for (i, (own, other)) in ours.iter().zip(&theirs).enumerate() {
            for (own, other) in own.iter().zip(other) {
                let difference = (own - other).abs() / (other + 0.1 * scale);
                assert!(difference < 0.06, "{room}, block {i}: {own} for {other}");
            }
        }
    }
}
