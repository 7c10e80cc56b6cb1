//! Inputs that are kept: of each target those that together reach all that was reached, and those that once
//! failed. `examples/keep.rs` writes them; each stands behind its length, four bytes with the lowest first.

/// Targets and what is kept of them.
pub(crate) const FILES: [(&str, &[u8]); 8] = [
    ("gltf", include_bytes!("../kept/gltf")),
    ("meshopt", include_bytes!("../kept/meshopt")),
    ("draco", include_bytes!("../kept/draco")),
    ("textures", include_bytes!("../kept/textures")),
    ("exr", include_bytes!("../kept/exr")),
    ("hdr", include_bytes!("../kept/hdr")),
    ("maps", include_bytes!("../kept/maps")),
    ("settings", include_bytes!("../kept/settings")),
];

/// All inputs, each with its target.
pub(crate) fn all() -> Vec<(&'static str, &'static [u8])> {
    let inputs = |(target, mut rest): (&'static str, &'static [u8])| {
        std::iter::from_fn(move || {
            let (length, after) = rest.split_first_chunk()?;
            let (input, after) = after.split_at(u32::from_le_bytes(*length) as usize);
            rest = after;
            Some((target, input))
        })
    };
    FILES.into_iter().flat_map(inputs).collect()
}
