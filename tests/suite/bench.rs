//! `lightgrid bench`: figures of every device there is, and devices that agree.

use std::process::Command;

use lightgrid::render::gpu::adapters;

#[test]
fn a_machine_is_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let has_gpu = !adapters().is_empty();
    let devices = if has_gpu { "cpu,gpu" } else { "cpu" };
    if !has_gpu {
        eprintln!("SKIPPED: the GPU's half; no adapter");
    }
    let line = format!(
        "bench open --env sky:day@128x64 --device {devices} --size 64x36 --seconds 0.1 --json b.json"
    );
    let output = Command::new(env!("CARGO_BIN_EXE_lightgrid"))
        .current_dir(folder.path())
        .args(line.split_whitespace())
        .output()
        .expect("the binary starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("M rays/s"), "{text}");
    let json = std::fs::read_to_string(folder.path().join("b.json")).expect("written");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let of = json["devices"].as_array().expect("devices");
    assert_eq!(of.len(), if has_gpu { 2 } else { 1 });
    for device in of {
        let scene = &device["scenes"][0];
        assert!(scene["failure"].is_null(), "{scene}");
        let kinds: Vec<_> = scene["rays"].as_array().expect("rays").iter().collect();
        assert_eq!(kinds.len(), 3, "{scene}");
        assert!(kinds.iter().all(|rays| rays["per_second"].as_f64() > Some(1e3)), "{scene}");
        assert!(scene["paths"]["samples_per_second"].as_f64() > Some(1e2), "{scene}");
        let waits = &scene["paths"];
        let (distributions, picture) =
            (&waits["first_distributions_seconds"], &waits["first_picture_seconds"]);
        assert!(
            distributions.as_f64() <= picture.as_f64() && distributions.as_f64() > Some(0.0),
            "{waits}"
        );
    }
    if has_gpu {
        let parity = &json["parity"][0];
        assert!((parity["mean_ratio"].as_f64().expect("a ratio") - 1.0).abs() < 0.01, "{parity}");
        assert!(parity["other_triangles"].as_f64() < Some(1e-3), "{parity}");
        assert!(parity["share_apart"].as_f64() < Some(0.1), "{parity}");
    }
}
