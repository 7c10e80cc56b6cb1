// From sums of radiance to a picture for a display. Twin of `src/tone.rs`, `src/tone/lut.rs` and
// `src/tone/white_balance.rs`; the CPU's results and these differ by one 8-bit level at most.

struct Develop {
    // White balance, linear Rec.709 to the same.
    matrix: mat3x3f,
    size: vec2u,
    // Pixels of `small`.
    small_size: vec2u,
    // Times the radiance, after the white balance.
    gain: f32,
    // Index into `ToneCurve::ALL`.
    curve: u32,
    // How much of the picture the overlay covers, where it has a colour and where it has none.
    opacity: vec2f,
    is_balanced: u32,
    has_overlay: u32,
    // Factor from the film's sums to those of radiance.
    unscale: f32,
    // Entries along a side of `look`, 0 without one, and its share.
    look_side: u32,
    look_strength: f32,
}

// Not a uniform: software Vulkan compiles a shader anew for each value that it branches on, and keeps that.
@group(0) @binding(0) var<storage, read> settings: Develop;
@group(0) @binding(1) var<storage, read> sum: array<vec4f>;
@group(0) @binding(2) var<storage, read> counts: array<vec4u>;
@group(0) @binding(4) var overlay: texture_2d<f32>;
@group(0) @binding(5) var display: texture_storage_2d<rgba8unorm, write>;
@group(0) @binding(6) var<storage, read_write> small: array<vec4f>;
// Colours over sRGB ones, red fastest.
@group(0) @binding(7) var<storage, read> look: array<vec4f>;

// Beyond what any curve tells from white, and small enough that its square is finite.
const BRIGHTEST = 1e6;
// Sums of so large values are finite.
const MAX_COMPONENT = 1e30;
// What an overlay says nothing about becomes this: it steps back.
const BACKGROUND = vec3f(24.0, 25.0, 28.0);
const INFINITY_BITS = 0x7f800000u;

// Shaders may be compiled as if there were no NaN: its bits tell.
fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > INFINITY_BITS;
}

// Mean radiance; black where there are no samples.
fn radiance(pixel: vec2u) -> vec3f {
    let index = pixel.y * settings.size.x + pixel.x;
    return sum[index].xyz / f32(max(counts[index].x, 1u)) * settings.unscale;
}

fn finite(x: f32) -> f32 {
    return select(clamp(x, -MAX_COMPONENT, MAX_COMPONENT), 0.0, is_nan(x));
}

fn balanced(rgb: vec3f) -> vec3f {
    if settings.is_balanced == 0u {
        return rgb;
    }
    return max(settings.matrix * vec3f(finite(rgb.x), finite(rgb.y), finite(rgb.z)), vec3f());
}

// NaN and negative values as 0, and what is brighter than the brightest as that; by bits, which
// order positive values as the values themselves.
fn displayable(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    if bits > INFINITY_BITS {
        return 0.0;
    }
    return bitcast<f32>(min(bits, bitcast<u32>(f32(BRIGHTEST))));
}

fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, vec3f(0.2126, 0.7152, 0.0722));
}

fn power(x: f32, exponent: f32) -> f32 {
    return select(0.0, pow(x, exponent), x > 0.0);
}

fn agx_sigmoid(linear: f32) -> f32 {
    let least = -12.47393;
    let most = 4.026069;
    let x = clamp((log2(max(linear, 1e-10)) - least) / (most - least), 0.0, 1.0);
    let x2 = x * x;
    let x4 = x2 * x2;
    return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2
        + 0.1191 * x - 0.00232;
}

fn agx(rgb: vec3f) -> vec3f {
    let inset = mat3x3f(
        0.842479, 0.042328, 0.042376, 0.078434, 0.878469, 0.078434, 0.079224, 0.079166, 0.879143,
    );
    let outset = mat3x3f(
        1.196879, -0.052897, -0.052972, -0.098021, 1.151903, -0.098043, -0.099030, -0.098961,
        1.151074,
    );
    let v = inset * rgb;
    let encoded = outset * vec3f(agx_sigmoid(v.x), agx_sigmoid(v.y), agx_sigmoid(v.z));
    return vec3f(power(encoded.x, 2.2), power(encoded.y, 2.2), power(encoded.z, 2.2));
}

fn aces(rgb: vec3f) -> vec3f {
    let input = mat3x3f(
        0.59719, 0.076, 0.0284, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777,
    );
    let output = mat3x3f(
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602,
    );
    let v = input * rgb;
    let numerator = v * (v + 0.0245786) - 0.000090537;
    let denominator = v * (0.983729 * v + 0.432951) + 0.238081;
    return output * (numerator / denominator);
}

fn neutral(rgb: vec3f) -> vec3f {
    let start_compression = 0.8 - 0.04;
    let desaturation = 0.15;
    let least = min(rgb.x, min(rgb.y, rgb.z));
    let offset = select(0.04, least - 6.25 * least * least, least < 0.08);
    let v = rgb - offset;
    let peak = max(v.x, max(v.y, v.z));
    if peak < start_compression {
        return v;
    }
    let d = 1.0 - start_compression;
    let new_peak = 1.0 - d * d / (peak + d - start_compression);
    let towards_white = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(v * (new_peak / peak), vec3f(new_peak), towards_white);
}

fn tone(exposed: vec3f) -> vec3f {
    let rgb = vec3f(displayable(exposed.x), displayable(exposed.y), displayable(exposed.z));
    var light = rgb;
    switch settings.curve {
        case 0u { light = agx(rgb); }
        case 1u { light = aces(rgb); }
        case 2u { light = neutral(rgb); }
        case 3u { light = rgb / (1.0 + luminance(rgb)); }
        default {}
    }
    return clamp(light, vec3f(), vec3f(1.0));
}

fn srgb_from_linear(x: f32) -> f32 {
    return select(12.92 * x, 1.055 * power(x, 1.0 / 2.4) - 0.055, x > 0.0031308);
}

// The look of an sRGB colour, linear within the tetrahedra of the table's cells.
fn graded(rgb: vec3f) -> vec3f {
    let side = settings.look_side;
    if side == 0u {
        return rgb;
    }
    let place = clamp(rgb, vec3f(), vec3f(1.0)) * f32(side - 1u);
    let corner = min(floor(place), vec3f(f32(side - 2u)));
    let t = place - corner;
    let step = vec3u(1u, side, side * side);
    let at = dot(vec3u(corner), step);
    let all = step.x + step.y + step.z;
    let greatest = max(t.x, max(t.y, t.z));
    let least = min(t.x, min(t.y, t.z));
    let middle = t.x + t.y + t.z - greatest - least;
    let first = select(select(step.z, step.y, t.y == greatest), step.x, t.x == greatest);
    let last = select(select(step.z, step.y, t.y == least), step.x, t.x == least);
    let color = look[at] * (1.0 - greatest) + look[at + first] * (greatest - middle)
        + look[at + all - last] * (middle - least) + look[at + all] * least;
    return mix(rgb, color.xyz, settings.look_strength);
}

fn quantise(value: f32, dither: f32) -> f32 {
    let level = value * 255.0;
    let nearest = round(level);
    // Rounding errors of the curve are not worth a dither.
    return select(floor(level + dither), nearest, abs(level - nearest) < 1e-3);
}

fn gradient_noise(pixel: vec2u) -> f32 {
    return fract(52.98292 * fract(dot(vec2f(0.06711056, 0.00583715), vec2f(pixel))));
}

fn blended(level: vec3f, pixel: vec2u) -> vec3f {
    let over = textureLoad(overlay, pixel, 0);
    let speaks = over.w > 0.5;
    let color = select(BACKGROUND, round(255.0 * over.xyz), speaks);
    let opacity = select(settings.opacity.y, settings.opacity.x, speaks);
    return floor(level + (color - level) * opacity + 0.5);
}

@compute @workgroup_size(8, 8)
fn develop(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let light = tone(balanced(radiance(id.xy)) * settings.gain);
    let dither = gradient_noise(id.xy);
    let encoded = vec3f(
        srgb_from_linear(light.x), srgb_from_linear(light.y), srgb_from_linear(light.z),
    );
    let color = graded(encoded);
    var level = vec3f(
        quantise(color.x, dither), quantise(color.y, dither), quantise(color.z, dither),
    );
    if settings.has_overlay != 0u {
        level = blended(level, id.xy);
    }
    textureStore(display, id.xy, vec4f(level / 255.0, 1.0));
}

// Pixels that pixel `i` of `count` covers of `all`: the first, and the one after the last. In pieces,
// for the product of two sizes may not fit into 32 bits.
fn edge(i: u32, count: u32, all: u32) -> u32 {
    return i * (all / count) + i * (all % count) / count;
}

// The balanced picture made small, each pixel the mean of those it covers.
@compute @workgroup_size(8, 8)
fn shrink(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.small_size) {
        return;
    }
    let from_x = edge(id.x, settings.small_size.x, settings.size.x);
    let from_y = edge(id.y, settings.small_size.y, settings.size.y);
    let to_x = max(edge(id.x + 1u, settings.small_size.x, settings.size.x), from_x + 1u);
    let to_y = max(edge(id.y + 1u, settings.small_size.y, settings.size.y), from_y + 1u);
    var mean = vec3f();
    for (var y = from_y; y < to_y; y++) {
        for (var x = from_x; x < to_x; x++) {
            mean += balanced(radiance(vec2u(x, y)));
        }
    }
    mean /= f32((to_x - from_x) * (to_y - from_y));
    small[id.y * settings.small_size.x + id.x] = vec4f(mean, 1.0);
}
