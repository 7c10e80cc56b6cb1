// A developed picture into a rectangle of the frame: for src/app/blit.rs.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

// Corners of a strip of two triangles: where in the frame, and where in the picture.
@vertex
fn corner(@location(0) at: vec4f) -> Corner {
    return Corner(vec4f(at.xy, 0.0, 1.0), at.zw);
}

// Into a target that is written as it is.
@fragment
fn levels(corner: Corner) -> @location(0) vec4f {
    return textureSample(picture, between, corner.uv);
}

// Into a target that encodes what is written, by IEC 61966-2-1.
@fragment
fn decoded(corner: Corner) -> @location(0) vec4f {
    let srgb = textureSample(picture, between, corner.uv);
    let low = srgb.rgb / 12.92;
    let high = pow((srgb.rgb + 0.055) / 1.055, vec3f(2.4));
    return vec4f(select(high, low, srgb.rgb <= vec3f(0.04045)), srgb.a);
}
