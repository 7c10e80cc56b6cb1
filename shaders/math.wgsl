// Frames, directions on the lat-long map, and luminance: twin of src/math.rs and src/color.rs.

const PI = 3.14159265358979;
const TAU = 6.28318530717959;
const FRAC_1_PI = 0.318309886183791;
// Stands for infinity, which WGSL does not promise to have.
const F32_MAX = 3.4028234e38;

struct Frame {
    x: vec3f,
    y: vec3f,
    z: vec3f,
}

fn copysign(magnitude: f32, sign_of: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(magnitude) & 0x7fffffffu)
        | (bitcast<u32>(sign_of) & 0x80000000u));
}

// A test of bits: comparisons with infinities may be optimised away.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_finite3(v: vec3f) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

fn max_element(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// `v` at unit length; `fallback` where it has no direction.
fn normalize_or(v: vec3f, fallback: vec3f) -> vec3f {
    let inverse = 1.0 / length(v);
    if is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return fallback;
}

fn frame_from_z(z: vec3f) -> Frame {
    let sign = copysign(1.0, z.z);
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    return Frame(
        vec3f(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
        vec3f(b, sign + z.y * z.y * a, -z.y),
        z,
    );
}

fn local_from_world(frame: Frame, v: vec3f) -> vec3f {
    return vec3f(dot(v, frame.x), dot(v, frame.y), dot(v, frame.z));
}

fn world_from_local(frame: Frame, v: vec3f) -> vec3f {
    return frame.x * v.x + frame.y * v.y + frame.z * v.z;
}

// Twin of `math::atan2`; the built-in may be off by 4096 units in the last place.
fn angle_of(y: f32, x: f32) -> f32 {
    const TAN_PI_8 = 0.41421357;
    let small = min(abs(x), abs(y));
    let large = max(abs(x), abs(y));
    let reduce = small > TAN_PI_8 * large;
    let numerator = select(small, small - large, reduce);
    let denominator = select(large, small + large, reduce);
    let t = select(0.0, numerator / denominator, denominator > 0.0);
    let z = t * t;
    let polynomial = ((8.0537445e-2 * z - 1.3877686e-1) * z + 1.9977711e-1) * z - 3.333295e-1;
    let reduced = polynomial * z * t + t;
    let octant = select(reduced, 0.25 * PI + reduced, reduce);
    let quadrant = select(octant, 0.5 * PI - octant, abs(y) > abs(x));
    return copysign(select(quadrant, PI - quadrant, x < 0.0), y);
}

// Twin of `math::sin_cos_turns`: sine and cosine of an angle in turns; the built-ins may be off
// by 2^-11.
fn sin_cos_turns(turns: f32) -> vec2f {
    let quarter = round(4.0 * turns);
    let x = (turns - 0.25 * quarter) * TAU;
    let z = x * x;
    let sine = ((-1.9515296e-4 * z + 8.332161e-3) * z - 1.6666655e-1) * z * x + x;
    let cosine = ((2.4433157e-5 * z - 1.3887316e-3) * z + 4.1666646e-2) * z * z - 0.5 * z + 1.0;
    let quadrant = i32(quarter) & 3;
    let swapped = (quadrant & 1) == 1;
    let s = select(sine, cosine, swapped);
    let c = select(cosine, sine, swapped);
    return vec2f(
        select(s, -s, quadrant >= 2),
        select(c, -c, quadrant == 1 || quadrant == 2),
    );
}

fn uv_from_direction(direction: vec3f) -> vec2f {
    let u = 0.5 + angle_of(direction.z, direction.x) / TAU;
    let sin_theta = sqrt(direction.x * direction.x + direction.z * direction.z);
    return vec2f(select(u, 0.0, u >= 1.0), angle_of(sin_theta, direction.y) / PI);
}

// Balance heuristic; a `pdf` of F32_MAX has no competition.
fn balance_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    if pdf >= F32_MAX {
        return 1.0;
    }
    let sum = pdf + other_pdf;
    return select(0.0, pdf / sum, sum > 0.0);
}

fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, vec3f(0.2126, 0.7152, 0.0722));
}

// Twin of `color::importance`.
fn importance(rgb: vec3f) -> f32 {
    return 0.5 * (luminance(rgb) + (rgb.x + rgb.y + rgb.z) / 3.0);
}

// High and low word of the 64-bit product.
fn multiply_wide(a: u32, b: u32) -> vec2u {
    let low_low = (a & 0xffffu) * (b & 0xffffu);
    let high_low = (a >> 16u) * (b & 0xffffu);
    let low_high = (a & 0xffffu) * (b >> 16u);
    let high_high = (a >> 16u) * (b >> 16u);
    let middle = (low_low >> 16u) + (high_low & 0xffffu) + (low_high & 0xffffu);
    return vec2u(
        high_high + (high_low >> 16u) + (low_high >> 16u) + (middle >> 16u),
        (middle << 16u) | (low_low & 0xffffu),
    );
}
