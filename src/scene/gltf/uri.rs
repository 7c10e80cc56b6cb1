//! URIs of buffers and images: `data:` and relative paths.

use std::path::Path;

use super::Fallible;
use crate::image::read_cause;

/// The bytes a URI stands for; relative ones are files beside the glTF file.
pub(super) fn read(uri: &str, base_dir: Option<&Path>) -> Fallible<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        return read_data_uri(data);
    }
    let path = percent_decoded(uri);
    let path = String::from_utf8(path).map_err(|_| format!("`{uri}` is not valid UTF-8"))?;
    if path.contains("://") {
        return Err(format!("`{path}` is not a file beside it, and nothing is fetched"));
    }
    let base_dir = base_dir.ok_or_else(|| {
        format!("`{path}` cannot be looked up: the folder of the file is unknown")
    })?;
    std::fs::read(base_dir.join(&path)).map_err(|e| format!("`{path}`: {}", read_cause(&e)))
}

/// A URI as it is shown to a person: data URIs would fill pages.
pub(super) fn shown(uri: &str) -> &str {
    if uri.starts_with("data:") { "data URI" } else { uri }
}

fn read_data_uri(data: &str) -> Fallible<Vec<u8>> {
    let (kind, payload) = data.split_once(',').ok_or("a data URI has no comma before its data")?;
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
        assert_eq!(read("data:text/plain,a%00b", None).unwrap(), b"a\0b");
        assert!(read("data:nothing", None).unwrap_err().contains("comma"));
        assert!(
            read("https://example.org/a.bin", None).unwrap_err().contains("nothing is fetched")
        );
    }
}
