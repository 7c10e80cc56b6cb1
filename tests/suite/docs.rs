//! What README.md and `docs/*.md` show: commands that parse and, where that takes a moment, run; links, pictures
//! and names that are there.
//!
//! - A *command* is an indented or fenced line with `lightgrid` in it, whatever is passed to it by a pipe or a shell
//!   included, and the comment beside a picture. It must parse. Words in capitals are placeholders, `[A]` may be
//!   left out, `A|B` is a choice, `A...` a list: see [`filled`].
//! - A *mention* is inline code that begins with `lightgrid` and is no whole command: its options must exist.
//! - Commands that are shown run as they stand, but small and on files made for them: see [`shrunk`].

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use lightgrid::cli::accepts;

use crate::cli::{Bench, text};
use crate::farm::put_moving_scene;

/// Bytes that README.md stays under.
const README_BYTES: u64 = 8_000;
/// Most bytes of a picture, of one that moves, and of all of `docs`.
const PICTURE_BYTES: u64 = 350_000;
const GIF_BYTES: u64 = 1_500_000;
const DOCS_BYTES: u64 = 5_000_000;

/// Where something stands in a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// An indented or fenced line.
    Shown,
    /// The comment beside a picture.
    Picture,
    /// Inline code.
    Inline,
}

/// Code that begins with `lightgrid`.
#[derive(Debug, Clone)]
struct Shown {
    kind: Kind,
    page: String,
    /// After the program's name.
    words: Vec<String>,
}

struct Page {
    name: String,
    text: String,
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// README.md, CONTRIBUTING.md, CHANGELOG.md and `docs/*.md`.
fn pages() -> Vec<Page> {
    let mut pages = pages_in("docs");
    pages.extend(["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(page));
    pages.sort_by(|a, b| a.name.cmp(&b.name));
    pages
}

/// Pages of a folder. Those of `docs/notebook` are records: only their links must hold.
fn pages_in(folder: &str) -> Vec<Page> {
    let files = fs::read_dir(root().join(folder)).expect("a folder");
    let names = files.map(|entry| entry.expect("readable").file_name().into_string());
    let names = names.map(|name| name.expect("UTF-8")).filter(|name| name.ends_with(".md"));
    names.map(|name| page(&format!("{folder}/{name}"))).collect()
}

fn page(name: &str) -> Page {
    let text = fs::read_to_string(root().join(name)).expect("readable");
    Page { name: name.to_owned(), text }
}

/// Lines of code blocks, those that end in `\` joined, and the page's prose.
fn split(page: &Page) -> (Vec<String>, String) {
    let (mut code, mut prose) = (Vec::<String>::new(), String::new());
    let (mut is_fenced, mut goes_on) = (false, false);
    for line in page.text.lines() {
        if line.starts_with("```") {
            is_fenced = !is_fenced;
        } else if is_fenced || line.starts_with("    ") {
            let part = line.trim().trim_end_matches('\\').trim_end();
            match code.last_mut().filter(|_| goes_on) {
                Some(last) => *last = format!("{last} {part}"),
                None => code.push(part.to_owned()),
            }
            goes_on = line.ends_with('\\');
        } else {
            prose += line;
            prose.push('\n');
        }
    }
    (code, prose)
}

/// Inline code of the prose, its line breaks as spaces.
fn inline(prose: &str) -> Vec<String> {
    let words = |code: &str| code.split_whitespace().collect::<Vec<_>>().join(" ");
    let paragraphs = prose.split("\n\n");
    paragraphs.flat_map(|paragraph| paragraph.split('`').skip(1).step_by(2).map(words)).collect()
}

/// What follows the program's name up to the end of the command, without quotes.
fn words_of(code: &str) -> Option<Vec<String>> {
    let after = code
        .strip_prefix("lightgrid ")
        .or_else(|| code.split_once(" lightgrid ").map(|(_, after)| after))
        .or_else(|| code.split_once("\"lightgrid ").map(|(_, after)| after))
        .or_else(|| code.strip_prefix("cargo run --release -- "))?;
    let end = after.find(" | ").or_else(|| after.find(" > ")).unwrap_or(after.len());
    Some(after[..end].split_whitespace().map(|word| word.trim_matches('"').to_owned()).collect())
}

fn all_shown() -> Vec<Shown> {
    let mut all = Vec::new();
    for page in pages() {
        let (code, prose) = split(&page);
        let mut add = |kind: Kind, code: &str| {
            if let Some(words) = words_of(code) {
                all.push(Shown { kind, page: page.name.clone(), words });
            }
        };
        // What a shell puts in is tried by the test that runs those scripts (`farm::slurm`).
        code.iter().filter(|line| !line.contains('$')).for_each(|line| add(Kind::Shown, line));
        for line in prose.lines() {
            if let Some(code) = line.strip_prefix("<!-- ").and_then(|l| l.strip_suffix(" -->")) {
                add(Kind::Picture, code);
            }
        }
        for code in inline(&prose).iter().filter(|code| code.starts_with("lightgrid ")) {
            add(Kind::Inline, code);
        }
    }
    assert!(all.len() > 60, "{} commands are found", all.len());
    all
}

/// A synopsis with something in the place of each placeholder.
fn filled(words: &[String]) -> Vec<String> {
    let mut filled = Vec::<String>::new();
    for word in words {
        let word = word.trim_matches(['[', ']']).trim_end_matches("...").trim_end_matches(']');
        let word = word.split('|').next().unwrap_or(word);
        let before = filled.last().map_or("", String::as_str);
        let value = match (before, word) {
            ("--overlay", "NAME") => "cells",
            ("--panel", "NAME") => "inspect",
            (_, "NAME") => "name",
            (_, "SCENE") => "office",
            (_, "MAP") => "sky:day",
            ("--distributions", "FILE") => "distributions.csv",
            ("--json", "FILE") => "figures.json",
            (_, "FILE") => "out.png",
            (_, "PICTURE" | "REFERENCE") => "out.exr",
            (_, "PART") => "a.part",
            (_, "DIR") => "out",
            (_, "SHELL") => "bash",
            (_, "LIST") => "plain,adaptive",
            (_, "WxH") => "32x18",
            (_, "COMMAND") => "render",
            (_, "{}/8") => "1/8",
            _ => word,
        };
        filled.push(value.replace("{}", "1"));
    }
    filled
}

/// Options of every command, by its name; from its help.
fn options() -> BTreeMap<String, Vec<String>> {
    let help = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightgrid"));
        let output = command.args(words).arg("--help").output().expect("the binary starts");
        text(&output.stdout)
    };
    let overview = help(&[]);
    let commands = overview.split("Commands:").nth(1).expect("commands").split("Options:").next();
    let names = commands.into_iter().flat_map(str::lines).filter_map(|line| {
        let is_name = line.starts_with("  ") && !line.starts_with("   ");
        line.split_whitespace().next().filter(|name| is_name && *name != "help")
    });
    let of = |name: &str| {
        let mut all = help(&[name]);
        if name == "report" {
            all += &["talk", "ablations", "sat"].map(|what| help(&[name, what])).concat();
        }
        let is_part = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
        all.split(is_part).filter(|word| word.starts_with('-')).map(str::to_owned).collect()
    };
    names.map(|name| (name.to_owned(), of(name))).collect()
}

#[test]
fn every_command_parses() {
    let options = options();
    for shown in all_shown() {
        let words = filled(&shown.words);
        let page = &shown.page;
        if accepts(&words) {
            continue;
        }
        assert!(
            shown.kind == Kind::Inline || words.iter().any(|word| word == "--help"),
            "{page}: `lightgrid {}` is no command line",
            words.join(" ")
        );
        let known = options.get(&words[0]);
        let known = known.unwrap_or_else(|| panic!("{page}: there is no command {}", words[0]));
        for word in words.iter().filter(|word| word.starts_with('-')) {
            assert!(known.contains(word), "{page}: `{}` has no {word}", words[0]);
        }
    }
}

#[test]
fn every_option_that_is_spoken_of_exists() {
    let known: Vec<String> = options().into_values().flatten().collect();
    // Those of srun, sbatch, GNU parallel, cargo, and of no command.
    let others = [
        "--version",
        "--requeue",
        "--retries",
        "--transferfile",
        "--profile",
        "--features",
        "--no-default-features",
    ];
    for page in pages() {
        for code in inline(&split(&page).1) {
            let Some(option) = code.split([' ', '=', ',']).next() else { continue };
            if option.starts_with("--") && !others.contains(&option) {
                assert!(known.iter().any(|o| o == option), "{}: {option}", page.name);
            }
        }
    }
}

/// Parts of the tests and benches that pages name are there.
#[test]
fn cargo_is_asked_for_what_there_is() {
    let mut count = 0;
    for page in pages() {
        let (code, prose) = split(&page);
        for line in code.into_iter().chain(inline(&prose)) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let part = words.iter().skip_while(|word| **word != "suite").nth(1);
            let file = match (words.first(), words.get(1), part) {
                (Some(&"cargo"), Some(&"test"), Some(part)) => {
                    format!("tests/suite/{}.rs", part.trim_end_matches("::"))
                }
                (Some(&"cargo"), Some(&"bench"), _) if words.last() != Some(&"NAME") => {
                    format!("benches/{}.rs", words[words.len() - 1])
                }
                _ => continue,
            };
            count += 1;
            // `slurm` is a part of `farm`.
            let is_there = root().join(&file).is_file() || file.ends_with("slurm.rs");
            assert!(is_there, "{}: `{line}`: {file} is not there", page.name);
        }
    }
    assert!(count > 5, "{count} parts of tests and benches are named");
}

/// A picture of a moment, of few pixels and samples; `None` for what takes longer whatever is asked, or needs
/// what an earlier command would have written.
fn shrunk(words: &[String]) -> Option<Vec<String>> {
    let size = match words[0].as_str() {
        "info" | "devices" | "completions" | "man" => return Some(words.to_vec()),
        "stability" => return words.contains(&"--list".to_owned()).then(|| words.to_vec()),
        // Without a display, where there are such machines.
        "view" if !cfg!(target_os = "linux") => return None,
        "render" | "view" => "32x18",
        // Opens a graphics device: `app` has its tests.
        "screenshot" => return None,
        // Minutes, or files of others: `report`, `bench`, `environment`, `farm` and `cli` have their tests.
        "report" | "bench" | "sat" | "merge" | "compare" => return None,
        other => panic!("{other}: say here whether it is to be run"),
    };
    let mut small = Vec::<String>::new();
    for word in words {
        let before = small.last().map_or("", String::as_str);
        small.push(match before {
            "--size" => size.to_owned(),
            "--spp" | "--samples" => "8".to_owned(),
            "--seconds" => "0.2".to_owned(),
            "--region" => "4,2,16,8".to_owned(),
            "--turntable" => "2".to_owned(),
            "--frames" => "0..1".to_owned(),
            // `ffmpeg` is tried in `farm`.
            "-o" => word.replace(".mp4", ".####.exr"),
            _ => word.clone(),
        });
    }
    for (option, value) in [("--size", size), ("--spp", "8")] {
        if !small.iter().any(|word| word == option) {
            small.extend([option, value].map(str::to_owned));
        }
    }
    Some(small)
}

/// Makes the file or folder that a command speaks of, if it is one that it reads.
fn provide(bench: &Bench, word: &str) {
    let copy = |from: &str| {
        fs::copy(bench.path(from), bench.path(word)).expect("copied");
    };
    match word {
        // The one whose camera moves.
        "walk.glb" => put_moving_scene(bench, word),
        "out" => fs::create_dir(bench.path(word)).expect("made"),
        _ if word.ends_with(".glb") => copy("scene.gltf"),
        _ if word.ends_with(".hdr") => copy("map.exr"),
        _ => {}
    }
}

#[test]
fn commands_that_are_shown_run() {
    let mut lines: Vec<(String, Vec<String>)> = all_shown()
        .into_iter()
        .filter(|shown| shown.kind == Kind::Shown && !shown.words.contains(&"--help".to_owned()))
        .filter_map(|shown| Some((shown.page, shrunk(&filled(&shown.words))?)))
        .collect();
    lines.sort();
    lines.dedup_by(|a, b| a.1 == b.1);
    assert!(lines.len() > 15, "{} commands are run", lines.len());
    for (page, words) in lines {
        // In a folder of its own: a checkpoint of another picture would be refused.
        let bench = Bench::new();
        words.iter().for_each(|word| provide(&bench, word));
        let mut command = bench.command(&words.join(" "));
        for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            command.env_remove(display);
        }
        command.env("XDG_CONFIG_HOME", bench.path("config"));
        let output = command.output().expect("the binary starts");
        let (says, words) = (text(&output.stderr), words.join(" "));
        if says.starts_with("lightgrid: no GPU: ") && words.contains("--device gpu") {
            eprintln!("SKIPPED: {page}: lightgrid {words}: there is no GPU");
            continue;
        }
        assert!(output.status.success(), "{page}: lightgrid {words}: {says}");
    }
}

/// What is linked to or shown by a page: its targets, as they are written.
fn targets(prose: &str) -> Vec<String> {
    let ends = prose.split("](").skip(1);
    ends.filter_map(|end| end.split_once(')').map(|(target, _)| target.to_owned())).collect()
}

/// What a heading is called in a link.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn what_pages_link_to_is_there() {
    let mut count = 0;
    for page in pages().into_iter().chain(pages_in("docs/notebook")) {
        let (_, prose) = split(&page);
        let folder = root().join(&page.name);
        let folder = folder.parent().expect("a folder");
        for target in targets(&prose).iter().filter(|target| !target.starts_with("https://")) {
            count += 1;
            let (file, place) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() { root().join(&page.name) } else { folder.join(file) };
            assert!(path.is_file(), "{}: {target} is not there", page.name);
            if !place.is_empty() {
                let text = fs::read_to_string(&path).expect("readable");
                let mut headings = text.lines().filter(|line| line.starts_with('#')).map(anchor);
                assert!(headings.any(|a| a == place), "{}: {target}: no such heading", page.name);
            }
        }
    }
    assert!(count > 40, "{count} links are found");
}

/// Text of all files below a folder of the project.
fn text_below(folder: PathBuf) -> String {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("readable").path());
    let text = |path: PathBuf| match path.is_dir() {
        true => text_below(path),
        false => fs::read_to_string(path).expect("readable"),
    };
    paths.map(text).collect()
}

/// Files and folders that pages name exist, and so do the types and constants of method.md and architecture.md.
#[test]
fn code_that_pages_name_exists() {
    let sources = text_below(root().join("src"));
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let words: BTreeSet<&str> = sources.split(|c| !is_word(c)).collect();
    let folders = ["src", "shaders", "tests", "benches", "examples", "docs", "assets", ".ci"];
    let (mut paths, mut names) = (0, 0);
    for page in pages() {
        let explains = ["docs/method.md", "docs/architecture.md"].contains(&page.name.as_str());
        for code in inline(&split(&page).1) {
            let is_path = code.chars().all(|c| is_word(c) || "./-".contains(c));
            let is_in = |folder: &&str| code.starts_with(&format!("{folder}/"));
            if is_path && folders.iter().any(is_in) {
                paths += 1;
                assert!(root().join(&code).exists(), "{}: {code} does not exist", page.name);
            }
            let is_name = code.starts_with(char::is_uppercase)
                && code.split("::").all(|part| part.chars().all(is_word));
            if is_name && explains {
                names += 1;
                let name = code.rsplit("::").next().unwrap_or(&code);
                assert!(words.contains(name), "{}: src has no {code}", page.name);
            }
        }
    }
    assert!(paths > 60 && names > 50, "{paths} paths and {names} names are found");
}

#[test]
fn the_readme_and_pictures_are_small() {
    let readme = fs::metadata(root().join("README.md")).expect("there").len();
    assert!(readme < README_BYTES, "README.md has {readme} bytes");
    let mut total = 0;
    for folder in ["docs", "docs/pictures", "docs/notebook"] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder") {
            let entry = entry.expect("readable");
            let bytes = entry.metadata().expect("readable").len();
            let name = entry.file_name().into_string().expect("UTF-8");
            let most = if name.ends_with(".gif") { GIF_BYTES } else { PICTURE_BYTES };
            assert!(bytes <= most, "{folder}/{name} has {bytes} bytes");
            total += bytes;
        }
    }
    assert!(total < DOCS_BYTES, "docs has {total} bytes");
}

/// Every picture in `docs/pictures` is shown, and comes from a command beside it or from a script.
#[test]
fn every_picture_is_shown_and_has_its_command() {
    let shown: Vec<String> = pages().iter().flat_map(|page| targets(&split(page).1)).collect();
    let commands = all_shown().into_iter().filter(|shown| shown.kind == Kind::Picture);
    let made: Vec<String> = commands.filter_map(|shown| shown.words.last().cloned()).collect();
    let scripts = ["docs/blender.py", "docs/moving.sh", "docs/strip.sh", "docs/relearn.sh"]
        .map(|script| fs::read_to_string(root().join(script)).expect("there"));
    for entry in fs::read_dir(root().join("docs/pictures")).expect("a folder") {
        let name = entry.expect("readable").file_name().into_string().expect("UTF-8");
        let is_it = |target: &String| target.ends_with(&format!("pictures/{name}"));
        assert!(shown.iter().any(is_it), "{name} is not shown");
        let written = format!("docs/pictures/{}", name.replace(".jpg", ".png"));
        assert!(
            made.contains(&written) || scripts.iter().any(|script| script.contains(&name)),
            "{name}: by which command?"
        );
    }
    for written in made {
        let kept = root().join(written.replace(".png", ".jpg"));
        assert!(kept.is_file(), "{written} was never made");
    }
}

/// Names of buttons, keys and panels that the guides speak of, in asterisks or as keys.
#[test]
fn what_the_guides_call_things_is_what_the_window_calls_them() {
    let mut window = String::new();
    for folder in ["src/app", "src/app/panels", "src/app/overlays"] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder") {
            let path = entry.expect("readable").path();
            if path.is_file() {
                window += &fs::read_to_string(path).expect("readable");
            }
        }
    }
    let window = window.to_lowercase();
    for name in ["docs/guide.md", "docs/inspect.md"] {
        let page = fs::read_to_string(root().join(name)).expect("readable");
        let page = page.replace("**", "").replace('\n', " ");
        for called in page.split('*').skip(1).step_by(2) {
            // Another program's menu, and what is only stressed.
            let is_other =
                called.contains(", ") || ["cell", "tile", "distribution"].contains(&called);
            let is_there = window.contains(&format!("\"{}", called.to_lowercase()));
            assert!(is_other || is_there, "{name}: the window has no \"{called}\"");
        }
    }
}
