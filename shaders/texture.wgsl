// Reading textures: twin of src/scene/texture.rs. Texels of all images lie in one array.

// TextureRef.flags
const SECOND_UV_SET = 1u;
const NEAREST = 2u;
const SRGB = 4u;
const WRAP_U_SHIFT = 4u;
const WRAP_V_SHIFT = 6u;
const REPEAT = 0u;
const MIRRORED_REPEAT = 1u;

struct TextureRef {
    first_texel: u32,
    width: u32,
    height: u32,
    flags: u32,
    // Columns of the texture transform.
    matrix: vec4f,
    translation: vec2f,
    padding: vec2f,
}

struct Footprint {
    low: u32,
    high: u32,
    fraction: f32,
    nearest: u32,
}

fn texture_uv_set(reference: u32) -> u32 {
    return texture_refs[reference].flags & SECOND_UV_SET;
}

fn sample_texture(reference: u32, mesh_uv: vec2f) -> vec4f {
    let t = texture_refs[reference];
    if t.width == 0u {
        return vec4f(1.0);
    }
    let uv = t.matrix.xy * mesh_uv.x + t.matrix.zw * mesh_uv.y + t.translation;
    let x = footprint(uv.x, t.width, (t.flags >> WRAP_U_SHIFT) & 3u);
    let y = footprint(uv.y, t.height, (t.flags >> WRAP_V_SHIFT) & 3u);
    let srgb = (t.flags & SRGB) != 0u;
    if (t.flags & NEAREST) != 0u {
        return texel(t.first_texel + y.nearest * t.width + x.nearest, srgb);
    }
    let upper = t.first_texel + y.low * t.width;
    let lower = t.first_texel + y.high * t.width;
    let top = mix(texel(upper + x.low, srgb), texel(upper + x.high, srgb), x.fraction);
    let bottom = mix(texel(lower + x.low, srgb), texel(lower + x.high, srgb), x.fraction);
    return mix(top, bottom, y.fraction);
}

fn texel(index: u32, srgb: bool) -> vec4f {
    let bytes = texels(index);
    let linear = vec4f(
        f32(bytes & 0xffu),
        f32((bytes >> 8u) & 0xffu),
        f32((bytes >> 16u) & 0xffu),
        f32(bytes >> 24u),
    ) / 255.0;
    if !srgb {
        return linear;
    }
    return vec4f(
        tables[SRGB_AT + (bytes & 0xffu)],
        tables[SRGB_AT + ((bytes >> 8u) & 0xffu)],
        tables[SRGB_AT + ((bytes >> 16u) & 0xffu)],
        linear.w,
    );
}

fn footprint(t: f32, size: u32, wrap: u32) -> Footprint {
    let position = into_unit(t, wrap) * f32(size);
    let below = floor(position - 0.5);
    return Footprint(
        neighbour(i32(below), i32(size), wrap),
        neighbour(i32(below) + 1, i32(size), wrap),
        position - 0.5 - below,
        min(u32(position), size - 1u),
    );
}

fn into_unit(t: f32, wrap: u32) -> f32 {
    if !is_finite(t) {
        return 0.0;
    }
    if wrap == REPEAT {
        return t - floor(t);
    }
    if wrap == MIRRORED_REPEAT {
        return 1.0 - abs(t - 2.0 * floor(0.5 * t) - 1.0);
    }
    return saturate(t);
}

// `index` is at most one texel outside of the image.
fn neighbour(index: i32, size: i32, wrap: u32) -> u32 {
    if wrap != REPEAT {
        return u32(clamp(index, 0, size - 1));
    }
    if index < 0 {
        return u32(index + size);
    }
    return u32(select(index, index - size, index >= size));
}
