// Reading textures: twin of src/scene/texture.rs. Texels of all images lie in one array.

const REPEAT = 0u;
const MIRRORED_REPEAT = 1u;

struct Footprint {
    low: u32,
    high: u32,
    fraction: f32,
    nearest: u32,
}

fn sample_texture(reference: u32, mesh_uvs: vec4f) -> vec4f {
    // First texel, width, height, flags; columns of the texture transform; its translation.
    let head = texture_refs(3u * reference);
    let matrix = bitcast<vec4f>(texture_refs(3u * reference + 1u));
    let translation = bitcast<vec2f>(texture_refs(3u * reference + 2u).xy);
    if head.y == 0u {
        return vec4f(1.0);
    }
    let flags = head.w;
    let mesh_uv = select(mesh_uvs.xy, mesh_uvs.zw, (flags & SECOND_UV_SET) != 0u);
    let uv = matrix.xy * mesh_uv.x + matrix.zw * mesh_uv.y + translation;
    let x = footprint(uv.x, head.y, (flags >> WRAP_U_SHIFT) & 3u);
    let y = footprint(uv.y, head.z, (flags >> WRAP_V_SHIFT) & 3u);
    if (flags & NEAREST) != 0u {
        return texel(head.x + y.nearest * head.y + x.nearest, head);
    }
    let upper = head.x + y.low * head.y;
    let lower = head.x + y.high * head.y;
    let top = mix(texel(upper + x.low, head), texel(upper + x.high, head), x.fraction);
    let bottom = mix(texel(lower + x.low, head), texel(lower + x.high, head), x.fraction);
    return mix(top, bottom, y.fraction);
}

fn texel(index: u32, head: vec4u) -> vec4f {
    let flags = head.w;
    var encoded = texels(index);
    if (flags & DEEP) != 0u {
        // After all high bytes come all low ones.
        encoded = mix(texels(index + head.y * head.z), encoded, 256.0 / 257.0);
    }
    let srgb = (flags & SRGB) != 0u;
    let x = encoded.xyz;
    let linear = select(
        pow((x + 0.055) / 1.055, vec3f(2.4)),
        x / 12.92,
        x <= vec3f(0.04045),
    );
    return vec4f(select(x, linear, srgb), encoded.w);
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
        let half = 0.5 * t;
        return 1.0 - abs(2.0 * (half - floor(half)) - 1.0);
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
