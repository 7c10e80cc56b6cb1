//! Sound files of many small objects: what is made of a list must not be many times its text.

use std::fmt::Write as _;

/// Room for the largest of them.
pub(crate) const MAX_BYTES: usize = 64 << 20;

/// Writes an object of a list, given its number.
type Object = fn(&mut String, usize) -> std::fmt::Result;

/// The lists of a file that are not the usual ones: names, how many objects, and what each is.
type Lists = &'static [(&'static str, usize, Object)];

/// What there is of each of them otherwise.
const USUAL: [(&str, &str); 4] =
    [("accessors", ACCESSOR), ("meshes", MESH), ("nodes", r#"{"mesh":0}"#), ("bufferViews", VIEW)];
const ACCESSOR: &str = r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}"#;
const MESH: &str = r#"{"primitives":[{"attributes":{"POSITION":0}}]}"#;
const VIEW: &str = r#"{"buffer":0,"byteLength":36}"#;

/// The corners (0, 0, 0), (1, 0, 0) and (0, 1, 0).
const BUFFER: &str = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

/// Name and lists of each file.
pub(crate) const FILES: &[(&str, Lists)] = &[
    ("views", &[("bufferViews", 1_000_000, |to, _| to.write_str(VIEW))]),
    ("meshes", &[("meshes", 400_000, |to, _| to.write_str(MESH))]),
    ("accessors", &[("accessors", 400_000, |to, _| to.write_str(ACCESSOR))]),
    ("unused-materials", &[("materials", 200_000, material)]),
    (
        "used-materials",
        &[
            ("materials", 200_000, material),
            ("meshes", 1, |to, _| {
                to.write_str(r#"{"primitives":["#)?;
                list(to, 200_000, |to, number| {
                    write!(to, r#"{{"attributes":{{"POSITION":0}},"material":{number}}}"#)
                })?;
                to.write_str("]}")
            }),
        ],
    ),
    (
        "images",
        &[
            ("textures", 500_000, |to, number| write!(to, r#"{{"source":{number}}}"#)),
            ("images", 500_000, |to, number| write!(to, r#"{{"uri":"{number}.png"}}"#)),
        ],
    ),
    ("names", &[("extensionsUsed", 1_000_000, |to, number| write!(to, r#""E{number}""#))]),
    ("nodes", &[("nodes", 400_000, node)]),
    (
        "numbers-with-a-point",
        &[("nodes", 400_000, |to, number| match number {
            0 => to.write_str(r#"{"mesh":0.0}"#),
            _ => node(to, number),
        })],
    ),
    (
        "empty-nodes",
        &[("nodes", 3_000_000, |to, number| to.write_str(if number == 0 { NODE } else { "{}" }))],
    ),
    (
        "a-chain-of-nodes",
        &[("nodes", 400_000, |to, number| match number {
            399_999 => to.write_str(NODE),
            _ => write!(to, r#"{{"children":[{}]}}"#, number + 1),
        })],
    ),
];

const NODE: &str = r#"{"mesh":0}"#;

fn node(to: &mut String, number: usize) -> std::fmt::Result {
    match number {
        0 => to.write_str(NODE),
        _ => write!(to, r#"{{"name":"node {number}","translation":[1.5,{number},2.5]}}"#),
    }
}

fn material(to: &mut String, number: usize) -> std::fmt::Result {
    write!(
        to,
        r#"{{"name":"material {number}","pbrMetallicRoughness":{{"roughnessFactor":0.{number:06}}}}}"#
    )
}

fn list(to: &mut String, count: usize, object: Object) -> std::fmt::Result {
    for number in 0..count {
        to.write_str(if number > 0 { "," } else { "" })?;
        object(to, number)?;
    }
    Ok(())
}

/// Writes a file's JSON.
pub(crate) fn write(to: &mut String, lists: Lists) -> std::fmt::Result {
    write!(
        to,
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,"uri":"{BUFFER}"}}]"#
    )?;
    for (name, object) in USUAL {
        if !lists.iter().any(|(other, ..)| *other == name) {
            write!(to, r#","{name}":[{object}]"#)?;
        }
    }
    for (name, count, object) in lists {
        write!(to, r#","{name}":["#)?;
        list(to, *count, *object)?;
        to.write_str("]")?;
    }
    to.write_str("}")
}
