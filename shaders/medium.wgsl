// What lies between surfaces: twin of src/medium.rs.

const UNIT_OF_2_POW_32 = 2.3283064365386963e-10;

// What a medium does to light, per metre, and the mean cosine of its scattering.
struct Interior {
    scattering: vec3f,
    mean_cosine: f32,
    extinction: vec3f,
}

// The part of a ray that is in a medium; none if it does not end after its start.
struct Stretch {
    interior: Interior,
    start: f32,
    end: f32,
}

// What happened to light on its way: it was scattered unless `scattered_at` is F32_MAX.
struct Flight {
    weight: vec3f,
    scattered_at: f32,
}

// Twin of `optical_depth`.
fn optical_depth(bits: u32) -> f32 {
    let u = f32(bits) * UNIT_OF_2_POW_32;
    if u < 0.0625 {
        return u * (1.0 + u * (0.5 + u * (1.0 / 3.0 + u * (0.25 + u * (0.2 + u * (1.0 / 6.0))))));
    }
    return -log((f32(~bits) + 1.0) * UNIT_OF_2_POW_32);
}

// Twin of `Interior::fly`.
fn fly_through(interior: Interior, throughput: vec3f, length_: f32, bits: vec2u) -> Flight {
    let pair = throughput.x + throughput.y;
    let sum = pair + throughput.z;
    let target_ = unit_from_bits(bits.y) * sum;
    let channel = select(0u, 1u, target_ >= throughput.x) + select(0u, 1u, target_ >= pair);
    let choice = throughput / sum;
    let depth = optical_depth(bits.x);
    let extinction = interior.extinction[channel];
    let is_scattered = depth < extinction * length_;
    let distance = select(length_, depth / extinction, is_scattered);
    let left = exp(-interior.extinction * distance);
    if is_scattered {
        let weight = interior.scattering * left / dot(choice, interior.extinction * left);
        return Flight(weight, distance);
    }
    return Flight(left / dot(choice, left), F32_MAX);
}

// Twin of `Phase::sample`.
fn sample_phase(g: f32, direction: vec3f, u: vec2f) -> vec3f {
    let s = 2.0 * u.x - 1.0;
    let numerator = s * (1.0 + g * g) + 0.5 * g * (s * s + 3.0) - 0.5 * g * g * g * (1.0 - s * s);
    let denominator = (1.0 + g * s) * (1.0 + g * s);
    let cosine = clamp(numerator / denominator, -1.0, 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let phi = sin_cos_turns(u.y);
    return world_from_local(frame_from_z(direction), vec3f(sine * phi.y, sine * phi.x, cosine));
}

// Twin of `Phase::pdf_solid_angle`.
fn phase_pdf_solid_angle(g: f32, cosine: f32) -> f32 {
    let squared = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
    return (1.0 - g * g) / (4.0 * PI * squared * sqrt(squared));
}

// Twin of `Fog::stretch`.
fn fog_stretch(origin: vec3f, direction: vec3f, distance: f32) -> Stretch {
    let size = max(abs(direction), vec3f(MIN_COMPONENT));
    let inverse = 1.0 / select(size, -size, direction < vec3f(0.0));
    let a = (globals.fog_low - origin) * inverse;
    let b = (globals.fog_high - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let start = max(max_element(near), 0.0);
    let end = min(min(far.x, min(far.y, far.z)), distance);
    let interior =
        Interior(globals.fog_scattering, globals.fog_mean_cosine, globals.fog_extinction);
    return Stretch(interior, start, end);
}

// A straight way, as one of those that `fly_through` chooses from: what is left at its end, and how likely
// it is.
struct Crossing {
    weight: vec3f,
    density: f32,
}

// Twin of `Interior::crossing`.
fn crossing(interior: Interior, throughput: vec3f, distance: f32, is_scattered: bool) -> Crossing {
    let left = exp(-interior.extinction * distance);
    let choice = throughput / (throughput.x + throughput.y + throughput.z);
    if is_scattered {
        return Crossing(interior.scattering * left, dot(choice, interior.extinction * left));
    }
    let scatters = any(interior.scattering != vec3f(0.0));
    return Crossing(left, select(1.0, dot(choice, left), scatters));
}
