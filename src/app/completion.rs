//! What a path that is being typed may go on to, as in a shell.

use std::path::{MAIN_SEPARATOR, PathBuf, is_separator};

/// How a typed path goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Completion {
    /// It, and all that the ways to go on have in common.
    pub(super) path: String,
    /// The ways to go on where there are several: paths, those of folders with a separator behind.
    pub(super) offers: Vec<String>,
}

/// Completes a path to a folder or to a file with one of these extensions. What begins with a dot is only
/// offered to who types it, and capitals count where both are there.
pub(super) fn complete(typed: &str, extensions: &[&str]) -> Completion {
    let typed = if typed == "~" { "~/" } else { typed };
    let start = typed.rfind(is_separator).map_or(0, |at| at + 1);
    let (folder, start) = typed.split_at(start);
    let names = names(folder, extensions);
    let beginning = |is_same: fn(&str, &str) -> bool| -> Vec<String> {
        let begins = |name: &&String| {
            let head = name.get(..start.len());
            head.is_some_and(|head| is_same(head, start))
                && (start.starts_with('.') || !name.starts_with('.'))
        };
        names.iter().filter(begins).cloned().collect()
    };
    let mut found = beginning(|head, start| head == start);
    if found.is_empty() {
        found = beginning(|head, start| head.eq_ignore_ascii_case(start));
    }
    found.sort_unstable();
    let Some(common) = found.iter().map(String::as_str).reduce(common_start) else {
        return Completion { path: typed.to_owned(), offers: Vec::new() };
    };
    // Names that differ in capitals alone may have less in common than is typed.
    let common = if common.len() < start.len() { start } else { common };
    let path = format!("{folder}{common}");
    let offers = if found.len() == 1 { Vec::new() } else { found };
    Completion { path, offers: offers.iter().map(|name| format!("{folder}{name}")).collect() }
}

/// Folders, and files with one of these extensions, in what is typed as a folder.
fn names(folder: &str, extensions: &[&str]) -> Vec<String> {
    let folder =
        if folder.is_empty() { PathBuf::from(".") } else { PathBuf::from(in_home(folder)) };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let name = |entry: std::fs::DirEntry| {
        let name = entry.file_name().into_string().ok()?;
        let path = entry.path();
        if path.is_dir() {
            return Some(format!("{name}{MAIN_SEPARATOR}"));
        }
        let extension = path.extension()?.to_str()?;
        extensions.iter().any(|known| known.eq_ignore_ascii_case(extension)).then_some(name)
    };
    entries.filter_map(name).collect()
}

fn common_start<'a>(a: &'a str, b: &str) -> &'a str {
    let differ = a.char_indices().zip(b.chars()).find(|((_, a), b)| a != b);
    let end = differ.map_or_else(|| a.len().min(b.len()), |((at, _), _)| at);
    &a[..end]
}

/// A path in which `~` at the beginning is the user's own folder.
pub(super) fn in_home(path: &str) -> String {
    let rest =
        path.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with(is_separator));
    match rest.zip(std::env::home_dir()) {
        Some((rest, home)) => format!("{}{rest}", home.display()),
        None => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_on_as_far_as_they_are_unique() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = format!("{}{MAIN_SEPARATOR}", folder.path().display());
        for name in ["kitchen.glb", "kitchen-old.GLTF", "kitchen.txt", "Bath.glb", ".kept.glb"] {
            std::fs::write(folder.path().join(name), "").expect("written");
        }
        std::fs::create_dir(folder.path().join("maps")).expect("made");
        let of = |start: &str| {
            let Completion { path, offers } = complete(&format!("{root}{start}"), &["glb", "gltf"]);
            let short = |path: &str| path.strip_prefix(&root).expect("in the folder").to_owned();
            (short(&path), offers.iter().map(|offer| short(offer)).collect::<Vec<_>>())
        };
        let maps = format!("maps{MAIN_SEPARATOR}");
        let one = |path: &str| (path.to_owned(), Vec::new());
        assert_eq!(of("m"), one(&maps));
        assert_eq!(of("b"), one("Bath.glb"));
        assert_eq!(of("kitchen.t"), one("kitchen.t"));
        assert_eq!(of("."), one(".kept.glb"));
        assert_eq!(of("kitchen-"), one("kitchen-old.GLTF"));
        let both = ["kitchen-old.GLTF", "kitchen.glb"].map(str::to_owned).to_vec();
        assert_eq!(of("kit"), ("kitchen".to_owned(), both));
        assert_eq!(of("").1.len(), 4);
        assert_eq!(of(&format!("{maps}x")), one(&format!("{maps}x")));
        let nowhere = complete("/nowhere at all/x", &["glb"]);
        assert_eq!((nowhere.path.as_str(), nowhere.offers.len()), ("/nowhere at all/x", 0));
    }

    #[test]
    fn a_tilde_is_the_users_folder() {
        let home = std::env::home_dir().expect("a folder").display().to_string();
        assert_eq!(in_home("~"), home);
        assert_eq!(in_home(&format!("~{MAIN_SEPARATOR}a")), format!("{home}{MAIN_SEPARATOR}a"));
        assert_eq!((in_home("~a").as_str(), in_home("b/~").as_str()), ("~a", "b/~"));
    }
}
