//! Which channels of an OpenEXR file are the picture.

use exr::meta::attribute::ChannelDescription;
use exr::meta::header::Header;

use crate::error::{Decoded, Notices};

/// What the picture is made of: indices into the part's channel list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Channels {
    Rgb([usize; 3]),
    /// Luminance with the colour differences `(R-Y)/Y` and `(B-Y)/Y`.
    LumaChroma([usize; 3]),
    Grey(usize),
}

impl Channels {
    /// The indices in use; a grey channel counts once.
    pub(crate) fn indices(self) -> Vec<usize> {
        match self {
            Self::Rgb(indices) | Self::LumaChroma(indices) => indices.to_vec(),
            Self::Grey(index) => vec![index],
        }
    }
}

/// One way to read a file: a part of it and channels of that.
pub(crate) struct Selection {
    pub(crate) part: usize,
    pub(crate) channels: Channels,
    /// How far it is from the plainest (0).
    rank: u32,
    layer: String,
}

/// Layer names that denote the finished picture, as Blender, Nuke and others write them.
const PICTURE_NAMES: [&str; 6] = ["rgba", "rgb", "color", "colour", "combined", "beauty"];

/// Chooses what to read among all flat parts. In order: RGB at the top level of the only part or of
/// one named like a picture, RGB of a layer named like a picture, top-level RGB of another part, any
/// RGB layer, luminance with colour differences, luminance, any other channel.
///
/// # Errors
/// If all parts are deep.
pub(crate) fn select(headers: &[Header], notices: &mut Notices) -> Decoded<Selection> {
    let flat = headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let all = flat.flat_map(|(part, header)| candidates(part, header, headers.len() == 1));
    let best = all.min_by_key(|candidate| candidate.rank);
    let Some(best) = best else {
        return Err("holds deep data only, which lightgrid does not read".into());
    };
    if headers.len() > 1 {
        let (count, part) = (headers.len(), part_name(&headers[best.part]));
        notices.add(format!("of the {count} parts of the file, only '{part}' is read"));
    }
    let Channels::Grey(index) = best.channels else {
        if !best.layer.is_empty() {
            notices.add(format!("the layer '{}' of the file is read", best.layer));
        }
        return Ok(best);
    };
    let name = headers[best.part].channels.list[index].name.to_string();
    notices.add(format!("the file has no RGB channels; its channel '{name}' is read as grey"));
    Ok(best)
}

/// All ways to read one part, layer by layer.
fn candidates(part: usize, header: &Header, only_part: bool) -> Vec<Selection> {
    let names: Vec<(String, String)> = header.channels.list.iter().map(layer_and_name).collect();
    let mut layers: Vec<&str> = names.iter().map(|(layer, _)| layer.as_str()).collect();
    layers.dedup();
    let part_is_picture = is_picture_name(&part_name(header));
    let candidate =
        |rank, layer: &str, channels| Selection { part, channels, rank, layer: layer.to_owned() };
    let mut found = Vec::new();
    for layer in layers {
        let index = |wanted: &[&str]| {
            names.iter().position(|(l, name)| l == layer && wanted.contains(&name.as_str()))
        };
        let mut push = |rank, channels| found.push(candidate(rank, layer, channels));
        if let (Some(r), Some(g), Some(b)) =
            (index(&["r", "red"]), index(&["g", "green"]), index(&["b", "blue"]))
        {
            let rank = match (layer.is_empty(), is_picture_name(layer)) {
                (true, _) if only_part || part_is_picture => 0,
                (false, true) => 1,
                (true, _) => 2,
                (false, false) => 3,
            };
            push(rank, Channels::Rgb([r, g, b]));
        } else if let (Some(y), None, None) = (index(&["y"]), index(&["x"]), index(&["z"])) {
            match (index(&["ry"]), index(&["by"])) {
                (Some(ry), Some(by)) => push(4, Channels::LumaChroma([y, ry, by])),
                _ => push(5, Channels::Grey(y)),
            }
        }
    }
    let not_alpha = names.iter().position(|(_, name)| !["a", "alpha"].contains(&name.as_str()));
    let rank = if not_alpha.is_some() { 6 } else { 7 };
    found.push(candidate(rank, "", Channels::Grey(not_alpha.unwrap_or(0))));
    found
}

/// `ViewLayer.Combined.R` to `("ViewLayer.Combined", "r")`.
fn layer_and_name(channel: &ChannelDescription) -> (String, String) {
    let full = channel.name.to_string();
    let (layer, name) = full.rsplit_once('.').unwrap_or(("", &full));
    (layer.to_owned(), name.to_ascii_lowercase())
}

/// Whether the last component of a layer's name denotes the finished picture.
fn is_picture_name(layer: &str) -> bool {
    let last = layer.rsplit('.').next().unwrap_or(layer).to_ascii_lowercase();
    PICTURE_NAMES.contains(&last.as_str())
}

fn part_name(header: &Header) -> String {
    header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::meta::attribute::{SampleType, Text};

    /// A part with `f32` channels, in the order of the file.
    fn part(name: &str, channels: &[&str]) -> Header {
        let mut names = channels.to_vec();
        names.sort_unstable();
        let channels =
            names.iter().map(|name| ChannelDescription::named(*name, SampleType::F32)).collect();
        Header::new(Text::new_or_panic(name), (4, 4), channels)
    }

    /// The part, and the names of the channels that are read.
    fn selected(headers: &[Header]) -> (usize, Vec<String>, Notices) {
        let mut notices = Notices::default();
        let selection = select(headers, &mut notices).unwrap();
        let list = &headers[selection.part].channels.list;
        let names = selection.channels.indices().into_iter().map(|i| list[i].name.to_string());
        (selection.part, names.collect(), notices)
    }

    fn assert_selected(headers: &[Header], part: usize, names: &[&str], notice: &str) {
        let (got_part, got_names, notices) = selected(headers);
        assert_eq!((got_part, got_names), (part, names.iter().map(|n| (*n).to_owned()).collect()));
        let notices: Vec<&str> = notices.iter().collect();
        assert!(notices.is_empty() == notice.is_empty(), "{notices:?}");
        assert!(notices.join(" ").contains(notice), "{notices:?}");
    }

    #[test]
    fn top_level_rgb_comes_first() {
        let file = part("", &["A", "B", "G", "R", "albedo.R", "albedo.G", "albedo.B", "beauty.R"]);
        assert_selected(&[file], 0, &["R", "G", "B"], "");
    }

    #[test]
    fn a_blender_file_gives_its_combined_layer() {
        let layer = |name: &str| ["R", "G", "B"].map(|c| format!("ViewLayer.{name}.{c}"));
        let all = [layer("AO"), layer("Combined"), layer("DiffDir")].concat();
        let file = part("", &all.iter().map(String::as_str).collect::<Vec<_>>());
        let names: Vec<&str> = all[3..6].iter().map(String::as_str).collect();
        assert_selected(&[file], 0, &names, "layer 'ViewLayer.Combined'");
    }

    #[test]
    fn the_part_named_like_a_picture_comes_first() {
        let rgb = ["R", "G", "B"];
        let parts = [part("depth", &["Z"]), part("albedo", &rgb), part("ViewLayer.Combined", &rgb)];
        assert_selected(&parts, 2, &rgb, "of the 3 parts of the file, only 'ViewLayer.Combined'");
        assert_selected(&parts[..2], 1, &rgb, "only 'albedo'");
    }

    #[test]
    fn other_names_and_kinds_of_channels() {
        assert_selected(&[part("", &["red", "green", "blue"])], 0, &["red", "green", "blue"], "");
        assert_selected(&[part("", &["BY", "RY", "Y"])], 0, &["Y", "RY", "BY"], "");
        assert_selected(&[part("", &["A", "Y"])], 0, &["Y"], "channel 'Y' is read as grey");
        assert_selected(&[part("", &["A", "mask"])], 0, &["mask"], "'mask' is read as grey");
        // A normal is not luminance.
        let normals = part("", &["N.X", "N.Y", "N.Z", "lum.Y"]);
        assert_selected(&[normals], 0, &["lum.Y"], "'lum.Y' is read as grey");
    }

    #[test]
    fn deep_parts_are_passed_over() {
        let mut deep = part("deep", &["R", "G", "B"]);
        deep.deep = true;
        assert!(select(&[deep.clone()], &mut Notices::default()).is_err());
        assert_selected(&[deep, part("flat", &["R", "G", "B"])], 1, &["R", "G", "B"], "'flat'");
    }
}
