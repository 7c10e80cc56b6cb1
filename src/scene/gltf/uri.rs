//! URIs of buffers and images: `data:` and relative paths.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use super::Fallible;
use crate::image::{read_cause, read_file};

/// How a URI begins that is data itself.
const DATA: &str = "data:";

/// The folder that URIs are looked up in.
#[derive(Clone, Copy)]
pub(super) struct Folder<'a> {
    /// Where the scene's file lies; `None`: there is no folder, only embedded data can be read.
    pub(super) path: Option<&'a Path>,
    /// Whether files outside of it may be read.
    pub(super) allow_outside: bool,
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
    pub(super) fn place(self, uri: Cow<'_, str>) -> Fallible<Place<'_>> {
        if is_data(&uri) {
            return Ok(Place::Embedded(uri));
        }
        let path = percent_decoded(&uri);
        let path =
            String::from_utf8(path).map_err(|_| format!("`{}` is not UTF-8", shown(&uri)))?;
        let name = shown(&path);
        if path.contains("://") {
            return Err(format!("`{name}` is not a file beside it, and nothing is fetched"));
        }
        let Some(folder) = self.path else {
            return Err(format!("`{name}` cannot be looked up: the file's folder is unknown"));
        };
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let found = |path: &Path| {
            fs::canonicalize(path).map_err(|e| format!("`{name}`: {}", read_cause(&e)))
        };
        let file = found(&folder.join(&path))?;
        if !self.allow_outside && !file.starts_with(found(folder)?) {
            return Err(format!(
                "`{name}` lies outside of the scene's folder; --allow-outside would read it"
            ));
        }
        Ok(Place::File(file))
    }
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
    match uri.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}...", &uri[..end]),
        None => uri.to_owned(),
    }
}

fn read_data_uri(uri: &str) -> Fallible<Vec<u8>> {
    let (kind, payload) = uri.split_once(',').ok_or("a data URI has no comma before its data")?;
    if kind.ends_with(";base64") {
        base64_decoded(payload.as_bytes()).ok_or_else(|| "a data URI is not valid base64".into())
    } else {
        Ok(percent_decoded(payload))
    }
}

/// RFC 3986 percent-decoding; a `%` that does not begin an escape is kept.
fn percent_decoded(text: &str) -> Vec<u8> {
    let mut decoded = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let escape = match rest {
            [b'%', high, low, ..] => hex_digit(*high).zip(hex_digit(*low)),
            _ => None,
        };
        if let Some((high, low)) = escape {
            decoded.push(high << 4 | low);
            rest = &rest[3..];
        } else {
            decoded.push(*first);
            rest = tail;
        }
    }
    decoded
}

fn hex_digit(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).and_then(|value| u8::try_from(value).ok())
}

/// RFC 4648 base64, both alphabets, padding optional, white space passed over.
fn base64_decoded(text: &[u8]) -> Option<Vec<u8>> {
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0_u32, 0);
    let mut ended = false;
    for &symbol in text {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => {
                ended = true;
                continue;
            }
            b' ' | b'\n' | b'\r' | b'\t' => continue,
            _ => return None,
        };
        if ended {
            return None;
        }
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
        let nowhere = Folder { path: None, allow_outside: false };
        let read = |uri: &'static str| nowhere.place(uri.into()).and_then(|place| place.read());
        assert_eq!(read("data:text/plain,a%00b").unwrap(), b"a\0b");
        assert!(read("data:nothing").unwrap_err().contains("comma"));
        assert!(read("https://example.org/a.bin").unwrap_err().contains("nothing is fetched"));
    }
}
