//! The examples do what they say.

use std::path::Path;
use std::process::{Command, Output};

use lightgrid::image::read_picture;

/// An example run in a folder; `None`, said on stderr, where only the suite was built.
fn run(name: &str, words: &[&str], folder: &Path) -> Option<Output> {
    let binary = Path::new(env!("CARGO_BIN_EXE_lightgrid")).with_file_name("examples").join(name);
    if !binary.exists() {
        eprintln!("SKIPPED: the example {name} is not built; `cargo test` builds it");
        return None;
    }
    let output = Command::new(binary).args(words).current_dir(folder).output();
    let output = output.expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output)
}

#[test]
fn a_picture_is_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = ["open", "sky:day@64x32", "a.png"];
    if run("render", &words, folder.path()).is_some() {
        let picture = read_picture(&folder.path().join("a.png")).expect("a picture");
        assert_eq!((picture.width, picture.height), (320, 180));
        let brightest = picture.pixels.iter().flatten().fold(0.0, |a: f32, b| a.max(*b));
        assert!(brightest > 0.1, "{brightest}");
    }
}

#[test]
fn the_light_grid_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    if let Some(output) = run("light_grid", &["living-room"], folder.path()) {
        let says = String::from_utf8_lossy(&output.stdout);
        assert!(
            says.contains("has distribution") && !says.contains("has distribution 0"),
            "{says}"
        );
        assert_eq!(says.matches(" tile ").count(), 5, "{says}");
    }
}
