//! The product's files, and their code without comments, texts and tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A file of the product.
pub(super) struct Source {
    /// Where it is below its folder (`src` or `shaders`), without ending and without `/mod`.
    pub(super) place: String,
    /// Its code: comments and tests are blank, so are the insides of texts (`_` for each character).
    pub(super) code: String,
}

impl Source {
    /// First name of the place.
    pub(super) fn room(&self) -> &str {
        self.place.split('/').next().unwrap_or_default()
    }

    /// Whether it is this part of the house, or lies in it.
    pub(super) fn is_in(&self, part: &str) -> bool {
        self.place.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}

/// All Rust files but those that are tests alone.
pub(super) fn sources() -> &'static [Source] {
    static SOURCES: LazyLock<Vec<Source>> = LazyLock::new(read);
    &SOURCES
}

fn read() -> Vec<Source> {
    let (mut sources, mut tests) = (Vec::new(), Vec::new());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in files(&root, "rs") {
        let text = fs::read_to_string(&path).expect("a source file");
        tests.extend(test_modules(&path, &text));
        let place = path.strip_prefix(&root).expect("below it").with_extension("");
        let place = place.to_str().expect("plain names").replace('\\', "/");
        let place = place.strip_suffix("/mod").unwrap_or(&place).to_owned();
        sources.push((path, Source { place, code: without_tests(&plain(&text)) }));
    }
    let is_test = |path: &Path| tests.iter().any(|test| path.with_extension("").starts_with(test));
    sources.into_iter().filter(|(path, _)| !is_test(path)).map(|(_, source)| source).collect()
}

/// Files with an ending in a folder of the project and below it.
pub(super) fn files(root: &Path, ending: &str) -> Vec<PathBuf> {
    let mut folders = vec![root.to_owned()];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the project") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Paths without endings of the modules that a file declares for tests.
fn test_modules(path: &Path, text: &str) -> Vec<PathBuf> {
    let stem = path.file_stem().expect("a name");
    let is_folder = ["mod", "lib", "main"].iter().any(|name| stem == *name);
    let folder = if is_folder { path.with_file_name("") } else { path.with_extension("") };
    let mut found = Vec::new();
    let mut is_for_tests = false;
    for line in text.lines().map(str::trim) {
        let declared = line.split("mod ").nth(1).and_then(|rest| rest.strip_suffix(';'));
        match declared {
            _ if line.starts_with("#[cfg(") && line.contains("test") => is_for_tests = true,
            _ if line.starts_with("#[") => {}
            Some(name) if is_for_tests => {
                found.push(folder.join(name));
                is_for_tests = false;
            }
            _ => is_for_tests = false,
        }
    }
    found
}

/// Rust or WGSL with blanks for comments and `_` for what is inside of texts and characters.
pub(super) fn plain(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let (length, filler) = if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), ' ')
        } else if rest.starts_with("/*") {
            (rest.find("*/").map_or(rest.len(), |end| end + 2), ' ')
        } else if first == '"' {
            (1 + text_length(&rest[1..]), '_')
        } else if let Some(hashes) = raw_text(rest) {
            let end = format!("\"{}", "#".repeat(hashes));
            let begin = hashes + 2;
            (rest[begin..].find(&end).map_or(rest.len(), |at| begin + at + end.len()), '_')
        } else if let Some(length) = character_length(rest) {
            (length, '_')
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        };
        let (gone, left) = rest.split_at(length);
        code.extend(gone.chars().map(|c| if c.is_whitespace() { c } else { filler }));
        rest = left;
    }
    code
}

/// Bytes of a text behind its first quote, the last one included.
fn text_length(rest: &str) -> usize {
    let mut is_escaped = false;
    for (at, c) in rest.char_indices() {
        match c {
            '"' if !is_escaped => return at + 1,
            _ => is_escaped = c == '\\' && !is_escaped,
        }
    }
    rest.len()
}

/// Marks of a raw text that begins here.
fn raw_text(rest: &str) -> Option<usize> {
    let rest = rest.strip_prefix('r')?;
    let hashes = rest.len() - rest.trim_start_matches('#').len();
    rest[hashes..].starts_with('"').then_some(hashes)
}

/// Bytes of a character that begins here, rather than a lifetime.
fn character_length(rest: &str) -> Option<usize> {
    let inside = rest.strip_prefix('\'')?;
    if inside.starts_with('\\') {
        return inside[2..].find('\'').map(|end| end + 4);
    }
    let length = inside.chars().next()?.len_utf8();
    inside[length..].starts_with('\'').then_some(length + 2)
}

/// Plain code without what is for tests alone.
fn without_tests(code: &str) -> String {
    let mut kept = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(at) =
        ["#[cfg(test)]", "#[cfg(all(test"].iter().filter_map(|mark| rest.find(mark)).min()
    {
        kept += &rest[..at];
        rest = &rest[at + item_length(&rest[at..])..];
    }
    kept + rest
}

/// Bytes of an item with its attributes: to its semicolon, or to the end of its braces.
fn item_length(code: &str) -> usize {
    let mut depth = 0_i32;
    for (at, c) in code.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' => depth -= 1,
            '}' => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
            }
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    code.len()
}

/// Bytes of a block in braces that begins here.
pub(super) fn block_length(code: &str) -> usize {
    item_length(code)
}

/// Lines that are not blank.
pub(super) fn lines(code: &str) -> usize {
    code.lines().filter(|line| !line.trim().is_empty()).count()
}

#[test]
fn comments_texts_and_tests_are_no_code() {
    let code = r##"
use a::b; // c::d
/* e::f */ fn g<'a>(x: &'a str) -> char { '"' }
const H: &str = "i::j \" k::l";
const M: &str = r#"n"::o"#;
#[cfg(test)]
mod p { fn q() { "}" } }
#[cfg(test)]
use r::s;
fn t() {}
"##;
    let code = without_tests(&plain(code));
    let found = ["b;", "g<'a>(x: &'a str)", "const H", "const M", "fn t() {}"];
    assert!(found.iter().all(|there| code.contains(there)), "{code}");
    let gone = ["c::d", "e::f", "i::j", "k::l", "n\"", "mod p", "r::s"];
    assert!(!gone.iter().any(|gone| code.contains(gone)), "{code}");
    assert_eq!(lines(&code), 5);
}
