//! URIs of buffers and images: `data:` and relative paths.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::limits::Fallible;
use crate::image::{names_device_or_stream, read_cause, read_file};

/// How a URI begins that is data itself.
const DATA: &str = "data:";

/// The folder that URIs are looked up in.
#[derive(Default)]
pub(super) struct Folder<'a> {
    /// Where the scene's file lies; `None`: there is no folder, only embedded data can be read.
    pub(super) path: Option<&'a Path>,
    /// Whether files outside of it may be read.
    pub(super) allow_outside: bool,
    /// Files that were found.
    pub(super) found: Mutex<BTreeSet<PathBuf>>,
}

/// What a URI stands for.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place<'u> {
    /// In the URI itself, which is a `data:` one.
    Embedded(Cow<'u, str>),
    /// A file, by its one name without links.
    File(PathBuf),
}

impl Folder<'_> {
    /// Where the data of a URI are. A file must lie in the folder or below it, links followed: a scene
    /// that somebody sent must not make a picture of what is private.
    ///
    /// # Errors
    /// A cause: the URI is empty, names no file beside the scene, or a file that is not there.
    pub(super) fn place<'u>(&self, uri: Cow<'u, str>) -> Fallible<Place<'u>> {
        if is_data(&uri) {
            return Ok(Place::Embedded(uri));
        }
        let names = file_names(&uri)?;
        let Some(first) = names.first() else { return Err("its URI is empty".into()) };
        let name = shown(first);
        if first.contains("://") {
            return Err(format!("`{name}` is not a file beside it, and nothing is fetched"));
        }
        let Some(path) = self.path else {
            return Err(format!("`{name}` cannot be looked up: the file's folder is unknown"));
        };
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        let folder = resolved(path)
            .and_then(|real| Ok([real, std::path::absolute(path).map_err(|e| read_cause(&e))?]));
        let folder = folder.map_err(|cause| format!("`{name}`: {cause}"))?;
        let mut failure = String::new();
        for candidate in &names {
            match self.file(&folder, candidate) {
                Ok(file) => {
                    let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
                    found.insert(file.clone());
                    return Ok(Place::File(file));
                }
                // Few files have a name with an escape in it.
                Err(_) if !failure.is_empty() && candidate.contains('%') => {}
                Err(cause) => failure = cause,
            }
        }
        Err(format!("`{name}`{failure}"))
    }

    /// The file of a name in the folder, which is given by its one path without links and as it was named.
    /// What the name alone forbids is refused before the system sees it: on Windows a look at
    /// `\\host\share` already sends the user's credentials to that host.
    fn file(&self, folder: &[PathBuf; 2], name: &str) -> Fallible<PathBuf> {
        const OUTSIDE: &str = " lies outside of the scene's folder; --allow-outside would read it";
        let [real, _] = folder;
        if !self.allow_outside {
            let is_below = folder.iter().any(|folder| is_below(&folder.join(name), folder));
            if names_host_or_drive(name) || !is_below {
                return Err(OUTSIDE.into());
            }
            if name.split(SLASHES).any(names_device_or_stream) {
                return Err(" names a device or a stream; --allow-outside would read it".into());
            }
        }
        let file = resolved(&real.join(name)).map_err(|cause| match other_case(real, name) {
            Some(other) => format!(": {cause}; there is {other}"),
            None => format!(": {cause}"),
        })?;
        let is_refused = !self.allow_outside && !file.starts_with(real);
        if is_refused { Err(OUTSIDE.into()) } else { Ok(file) }
    }
}

const SLASHES: [char; 2] = ['/', '\\'];

/// The one path of a file, without links.
fn resolved(path: &Path) -> Fallible<PathBuf> {
    fs::canonicalize(path).map_err(|e| read_cause(&e))
}

/// Names of files that a URI may mean, in the order in which they are looked for: decoded, then without `?query` and
/// `#fragment`, each also with slashes for the backslashes of programs on Windows; last, as it is written.
fn file_names(uri: &str) -> Fallible<Vec<String>> {
    let path = uri.split(['?', '#']).next().unwrap_or_default();
    let mut names = Vec::new();
    for text in [uri, path] {
        let name = String::from_utf8(percent_decoded(text))
            .map_err(|_| format!("`{}` is not UTF-8", shown(uri)))?;
        let with_slashes = name.replace('\\', "/");
        names.extend([name, with_slashes]);
    }
    if uri.contains('%') {
        names.push(uri.to_owned());
    }
    names.retain(|name| !name.is_empty());
    names.dedup();
    Ok(names)
}

/// Whether a path stays in a folder, by its components alone.
fn is_below(path: &Path, folder: &Path) -> bool {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    plain.starts_with(folder)
}

/// Whether Windows takes a name for one on another machine, of a device (`\\.\`) or on a drive of its own.
fn names_host_or_drive(name: &str) -> bool {
    let is_drive = matches!(name.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic());
    is_drive || (name.starts_with(SLASHES) && name[1..].starts_with(SLASHES))
}

/// What there is in the folder under a name that differs in the case of its letters alone.
fn other_case(folder: &Path, name: &str) -> Option<String> {
    let mut found = PathBuf::new();
    for component in Path::new(name).components() {
        match component {
            Component::CurDir => {}
            Component::Normal(part) => {
                let wanted = part.to_string_lossy().to_lowercase();
                let entries = fs::read_dir(folder.join(&found)).ok()?.flatten();
                let mut names = entries.map(|entry| entry.file_name());
                found.push(names.find(|it| it.to_string_lossy().to_lowercase() == wanted)?);
            }
            _ => return None,
        }
    }
    Some(found.display().to_string())
}

impl Place<'_> {
    /// The bytes there.
    pub(super) fn read(&self) -> Fallible<Vec<u8>> {
        match self {
            Self::Embedded(uri) => read_data_uri(uri),
            Self::File(path) => read_file(path).map_err(|cause| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                format!("`{name}` {cause}")
            }),
        }
    }
}

/// Whether the data are in the URI itself; schemes are written in either case (RFC 3986, section 3.1).
fn is_data(uri: &str) -> bool {
    uri.get(..DATA.len()).is_some_and(|scheme| scheme.eq_ignore_ascii_case(DATA))
}

/// A URI as it is shown to a person: data URIs, and some others, would fill pages.
pub(super) fn shown(uri: &str) -> String {
    const MAX_SHOWN: usize = 100;
    if is_data(uri) {
        return "data URI".to_owned();
    }
    let end = uri.char_indices().nth(MAX_SHOWN);
    end.map_or_else(|| uri.to_owned(), |(end, _)| format!("{}...", &uri[..end]))
}

fn read_data_uri(uri: &str) -> Fallible<Vec<u8>> {
    let (kind, payload) = uri.split_once(',').ok_or("a data URI has no comma before its data")?;
    let coding = kind.rsplit_once(';').map(|(_, coding)| coding.trim());
    if coding.is_some_and(|coding| coding.eq_ignore_ascii_case("base64")) {
        base64_decoded(payload.as_bytes()).ok_or_else(|| "a data URI is not valid base64".into())
    } else {
        Ok(percent_decoded(payload))
    }
}

/// RFC 3986 percent-decoding; a `%` that does not begin an escape is kept.
fn percent_decoded(text: &str) -> Vec<u8> {
    let mut parts = text.split('%');
    let mut decoded = Vec::with_capacity(text.len());
    decoded.extend(parts.next().unwrap_or_default().bytes());
    for part in parts {
        let is_hex = |digits: &&str| digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        let digits = part.get(..2).filter(is_hex);
        let escaped = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        decoded.push(escaped.unwrap_or(b'%'));
        decoded.extend(part.bytes().skip(2 * usize::from(escaped.is_some())));
    }
    decoded
}

/// RFC 4648 base64, both alphabets, padding optional, white space passed over.
fn base64_decoded(text: &[u8]) -> Option<Vec<u8>> {
    let is_space = |symbol: &u8| b" \n\r\t".contains(symbol);
    let last = text.iter().rposition(|symbol| *symbol != b'=' && !is_space(symbol));
    let text = &text[..last.map_or(0, |last| last + 1)];
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0_u32, 0);
    for &symbol in text.iter().filter(|symbol| !is_space(symbol)) {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            decoded.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    // Six bits left over are no byte.
    (count < 6).then_some(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc() {
        // RFC 4648, section 10.
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64_decoded(coded.as_bytes()).unwrap(), plain.as_bytes());
        }
        assert_eq!(base64_decoded(b"-_8"), Some(vec![0xfb, 0xff]));
        assert_eq!(base64_decoded(b"Zg==Zg=="), None);
        assert_eq!(base64_decoded(b"Z"), None);
        assert_eq!(base64_decoded(b"Z!=="), None);
    }

    #[test]
    fn percent_escapes_and_stray_percent_signs() {
        assert_eq!(percent_decoded("a%20b%2"), b"a b%2");
        assert_eq!(percent_decoded("100%-%c3%A9"), "100%-\u{e9}".as_bytes());
    }

    #[test]
    fn data_uris_may_be_plain_text() {
        let nowhere = Folder::default();
        let read = |uri: &'static str| nowhere.place(uri.into()).and_then(|place| place.read());
        assert_eq!(read("data:text/plain,a%00b").unwrap(), b"a\0b");
        assert_eq!(read("DATA:image/png;BASE64,Zm9v").unwrap(), b"foo");
        assert_eq!(read("data:image/png; base64,Zm9v").unwrap(), b"foo");
        assert!(read("data:nothing").unwrap_err().contains("comma"));
        assert!(read("https://example.org/a.bin").unwrap_err().contains("nothing is fetched"));
        assert_eq!(read("").unwrap_err(), "its URI is empty");
    }

    /// A folder with `tex/plain.png` and what a URI means in it: the file's content, or the cause.
    fn looked_up(uri: &str, allow_outside: bool) -> Fallible<Vec<u8>> {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("tex")).unwrap();
        fs::write(folder.path().join("tex/plain.png"), "plain").unwrap();
        // Names that Windows does not have.
        if cfg!(unix) {
            fs::write(folder.path().join("tex/back\\slash?#.png"), "odd").unwrap();
        }
        Folder { path: Some(folder.path()), allow_outside, ..Folder::default() }
            .place(uri.into())?
            .read()
    }

    /// None of these is there, so what says that it lies outside has not been looked for.
    #[test]
    fn names_of_hosts_drives_devices_and_streams_are_refused_before_the_system_sees_them() {
        for uri in [
            r"\\host\share\x.png",
            "//host/share/x.png",
            r"/\host\share\x.png",
            "%5C%5Chost/share/x.png",
            r"\\.\pipe\x",
            r"\\?\C:\x.png",
            r"C:\textures\x.png",
            "c:x.png",
            r"\textures\x.png",
            "/net/host/x.png",
            r"..\..\net\host\x.png",
            "tex/../../x.png",
        ] {
            let cause = looked_up(uri, false).unwrap_err();
            assert!(cause.contains("lies outside of the scene's folder"), "{uri}: {cause}");
        }
        for uri in [
            "CON",
            "tex/nul.png",
            r"tex\Aux .x.png",
            "com1",
            "LPT9.bin",
            "com\u{b9}.bin",
            "prn/x.png",
            "conin$",
            "tex/plain.png:stream",
            "tex/plain.png::$DATA",
        ] {
            let cause = looked_up(uri, false).unwrap_err();
            assert!(cause.contains("names a device or a stream"), "{uri}: {cause}");
        }
        for uri in ["console.png", "com.png", "com10.bin", "complete1", "x.con"] {
            assert!(looked_up(uri, false).unwrap_err().contains("no such file"), "{uri}");
        }
        // Where others are read, the system says what it has of them.
        for uri in ["/nowhere/x.png", "tex/../../nowhere/x.png"] {
            assert!(looked_up(uri, true).unwrap_err().contains("no such file"), "{uri}");
        }
    }

    #[test]
    fn files_are_found_by_what_programs_write_for_them() {
        for uri in [
            "tex/plain.png",
            r"tex\plain.png",
            r".\tex\plain.png",
            "tex/../tex/plain.png",
            "tex/plain.png?v=12:30",
            r"tex\plain.png#top",
            "tex%2Fplain.png?a#b",
        ] {
            assert_eq!(looked_up(uri, false).as_deref(), Ok(&b"plain"[..]), "{uri}");
        }
        if cfg!(unix) {
            assert_eq!(looked_up(r"tex/back\slash?#.png", false).unwrap(), b"odd");
        }
    }

    #[test]
    fn a_name_in_other_letters_is_told() {
        for uri in ["Tex/Plain.PNG", r"TEX\PLAIN.PNG?x", "./tex/plain.Png"] {
            let found = looked_up(uri, false);
            // Some systems find it.
            let Err(cause) = found else { continue };
            let there = Path::new("tex").join("plain.png");
            let expected = format!(": there is no such file; there is {}", there.display());
            assert!(cause.ends_with(&expected), "{uri}: {cause}");
        }
        let cause = looked_up("tex/plane.png", false).unwrap_err();
        assert_eq!(cause, "`tex/plane.png`: there is no such file");
    }
}
