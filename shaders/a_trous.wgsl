// The edge-avoiding filter in passes. Twin of `src/denoise/a_trous.rs`, which says what and why.

struct Pass {
    size: vec2u,
    // Pixels between two taps.
    step: u32,
    // Factor from the film's sums to those of radiance.
    unscale: f32,
}

// As in `path.wgsl`: sums over hits.
struct FirstHit {
    albedo: vec3f,
    depth: f32,
    normal: vec3f,
    hits: f32,
}

// What tells surfaces apart.
struct Guide {
    albedo: vec3f,
    depth: f32,
    normal: vec3f,
    // How strictly others are compared with it: a power of their likeness.
    strictness: f32,
}

@group(0) @binding(0) var<uniform> settings: Pass;
@group(0) @binding(1) var<storage, read> sum: array<vec4f>;
@group(0) @binding(2) var<storage, read> counts: array<vec4u>;
@group(0) @binding(3) var<storage, read> surfaces: array<FirstHit>;
@group(0) @binding(4) var<storage, read_write> guides: array<Guide>;
// Light without albedo, and the variance of its luminance.
@group(0) @binding(5) var<storage, read_write> light: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> result: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> result_counts: array<vec4u>;

const LEAST_ALIKE = 3.0;
const STRICT_STEP = 4u;
const ERRORS_TOLERATED = 1.5;
const REACH = 3;
const LEAST_ALBEDO = 0.02;
// No variance is larger, so that sums of variances are finite.
const LARGEST_VARIANCE = 1e30;

fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, vec3f(0.2126, 0.7152, 0.0722));
}

// How much two pixels belong to one surface, 1 for the same.
fn likeness(a: Guide, b: Guide, step: f32) -> f32 {
    let difference = a.albedo - b.albedo;
    let albedo = exp(-dot(difference, difference) / 0.01);
    let a_is_sky = all(a.normal == vec3f());
    let b_is_sky = all(b.normal == vec3f());
    if a_is_sky || b_is_sky {
        return select(0.0, albedo, a_is_sky && b_is_sky);
    }
    // To the power of 64.
    var normal = max(dot(a.normal, b.normal), 0.0);
    for (var i = 0; i < 6; i++) {
        normal *= normal;
    }
    let nearer = max(min(a.depth, b.depth), 1e-3);
    let depth = exp(-abs(a.depth - b.depth) / (0.02 * nearer * step));
    return albedo * normal * depth;
}

@compute @workgroup_size(8, 8)
fn undress(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = id.y * settings.size.x + id.x;
    let samples = f32(max(counts[index].x, 1u));
    let hit = surfaces[index];
    var guide = Guide();
    guide.depth = hit.depth / max(hit.hits, 1.0);
    let length_squared = dot(hit.normal, hit.normal);
    if length_squared > 0.0 {
        guide.normal = hit.normal * inverseSqrt(length_squared);
    }
    let seen = select(vec3f(1.0), hit.albedo / samples, length_squared > 0.0);
    guide.albedo = max(seen, vec3f(LEAST_ALBEDO));
    guides[index] = guide;

    let mean = sum[index].xyz / samples * settings.unscale;
    let brightness = luminance(mean);
    // One sample says nothing about its error: then anything goes.
    var variance = brightness * brightness + 1.0;
    if counts[index].x > 1u {
        let squared = sum[index].w / samples * settings.unscale * settings.unscale;
        let spread = max(squared - brightness * brightness, 0.0);
        variance = min(variance, spread / (samples - 1.0));
    }
    let scale = 1.0 / luminance(guide.albedo);
    light[index] = vec4f(mean / guide.albedo, min(variance * scale * scale, LARGEST_VARIANCE));
}

// What another pixel counts for one that compares so strictly.
fn weight_of(guide: Guide, other: Guide, step: f32, strictness: f32) -> f32 {
    let alike = likeness(guide, other, step);
    if strictness == 1.0 {
        return alike;
    }
    return select(0.0, pow(alike, strictness), alike > 0.0);
}

// Finds out how strictly a pixel is to be compared. Nobody asks another pixel how strict it is.
@compute @workgroup_size(8, 8)
fn relax(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = id.y * settings.size.x + id.x;
    let centre = vec2i(id.xy);
    let low = max(centre - 2, vec2i());
    let high = min(centre + 2, vec2i(settings.size) - 1);
    var alike = vec3f();
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let other = u32(y) * settings.size.x + u32(x);
            if other != index {
                let one = likeness(guides[index], guides[other], 1.0);
                let fourth = sqrt(sqrt(one));
                alike += vec3f(one, fourth, sqrt(sqrt(fourth)));
            }
        }
    }
    var strictness = 1.0 / 16.0;
    if alike.x >= LEAST_ALIKE {
        strictness = 1.0;
    } else if alike.y >= LEAST_ALIKE {
        strictness = 1.0 / 4.0;
    }
    guides[index].strictness = strictness;
}

@compute @workgroup_size(8, 8)
fn share_errors(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = id.y * settings.size.x + id.x;
    let centre = vec2i(id.xy);
    let low = max(centre - REACH, vec2i());
    let high = min(centre + REACH, vec2i(settings.size) - 1);
    let guide = guides[index];
    var variance = 0.0;
    var total = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let other = u32(y) * settings.size.x + u32(x);
            let weight = weight_of(guide, guides[other], 1.0, guide.strictness);
            variance += weight * light[other].w;
            total += weight;
        }
    }
    // The pixel itself always counts.
    let own = light[index];
    result[index] = vec4f(own.xyz, max(own.w, variance / total));
}

// B3 spline.
fn kernel(offset: i32) -> f32 {
    switch abs(offset) {
        case 0 { return 3.0 / 8.0; }
        case 1 { return 1.0 / 4.0; }
        default { return 1.0 / 16.0; }
    }
}

@compute @workgroup_size(8, 8)
fn smooth_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = id.y * settings.size.x + id.x;
    let guide = guides[index];
    let own = light[index];
    let own_luminance = luminance(own.xyz);
    // Larger steps reach other edges.
    let strictness = select(1.0, guide.strictness, settings.step < STRICT_STEP);
    var rgb = vec3f();
    var variance = 0.0;
    var total = 0.0;
    for (var dy = -2; dy <= 2; dy++) {
        for (var dx = -2; dx <= 2; dx++) {
            let place = vec2i(id.xy) + vec2i(dx, dy) * i32(settings.step);
            if any(place < vec2i()) || any(place >= vec2i(settings.size)) {
                continue;
            }
            let other = u32(place.y) * settings.size.x + u32(place.x);
            let there = light[other];
            let tolerance = ERRORS_TOLERATED * sqrt(max(own.w + there.w, 0.0)) + 1e-6;
            let weight = kernel(dx) * kernel(dy)
                * weight_of(guide, guides[other], f32(settings.step), strictness)
                * exp(-abs(luminance(there.xyz) - own_luminance) / tolerance);
            rgb += there.xyz * weight;
            variance += there.w * weight * weight;
            total += weight;
        }
    }
    // The centre always counts, so the total is not zero.
    result[index] = vec4f(rgb / total, variance / (total * total));
}

// The filtered picture as a film of one sample a pixel where there are any.
@compute @workgroup_size(8, 8)
fn dress(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = id.y * settings.size.x + id.x;
    result[index] = vec4f(light[index].xyz * guides[index].albedo, 0.0);
    result_counts[index] = vec4u(min(counts[index].x, 1u), 0u, 0u, 0u);
}
