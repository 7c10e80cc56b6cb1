// The edge-avoiding filter in passes. Twin of `src/denoise/a_trous.rs`, `guides.rs` and `edges.rs`, which say what
// and why, and whose constants stand before it.

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
    coverage: f32,
    normal: vec3f,
    nearness: f32,
    // Variances of the normal and, where it is chance, of the coverage.
    doubt: f32,
    chance: f32,
    // How much the nearness changes from pixel to pixel.
    slope: f32,
    // How many of the 24 pixels around are like it.
    support: f32,
}

@group(0) @binding(0) var<uniform> settings: Pass;
@group(0) @binding(1) var<storage, read> sum: array<vec4f>;
@group(0) @binding(2) var<storage, read> counts: array<vec4u>;
@group(0) @binding(3) var<storage, read> surfaces: array<FirstHit>;
@group(0) @binding(4) var<storage, read_write> guides: array<Guide>;
// Light without albedo, and the variance of its luminance: negative where it is not known.
@group(0) @binding(5) var<storage, read_write> light: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> result: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> result_counts: array<vec4u>;

const REACH = 2;
const TERMS = 6;
const TINY = 1.1754944e-38;
const QUARTER = 7;

fn luminance(rgb: vec3f) -> f32 {
    return dot(rgb, vec3f(0.2126, 0.7152, 0.0722));
}

fn compared_luminance(rgb: vec3f) -> f32 {
    return min(luminance(rgb), MAX_LUMINANCE);
}

// Tukey's biweight.
fn falling(squared: f32) -> f32 {
    let rest = max(1.0 - squared, 0.0);
    return rest * rest;
}

fn index_of(place: vec2i) -> u32 {
    return u32(place.y) * settings.size.x + u32(place.x);
}

fn is_inside(place: vec2i) -> bool {
    return all(place >= vec2i()) && all(place < vec2i(settings.size));
}

// How much two pixels so far apart belong to one surface, from 1 to 0.
fn likeness(a: Guide, b: Guide, offset: vec2i) -> f32 {
    let distance = vec2f(abs(offset));
    let growth = DEPTH_TOLERANCE * (1.0 + DEPTH_GROWTH * (distance.x + distance.y));
    let slopes = SLOPE_TOLERANCE * (1.0 + max(distance.x, distance.y));
    let albedo = a.albedo - b.albedo;
    let normal = a.normal - b.normal;
    let doubts = NORMAL_VARIANCES * (a.doubt + b.doubt);
    let covered = a.coverage - b.coverage;
    let chances = CHANCES * (a.chance + b.chance);
    let depth = (a.nearness - b.nearness)
        / (growth * max(a.nearness, b.nearness) + slopes * max(a.slope, b.slope) + MIN_NEARNESS);
    return falling(dot(albedo, albedo) * (1.0 / ALBEDO_TOLERANCE))
        * falling(dot(normal, normal) / (NORMAL_TOLERANCE + doubts))
        * falling(covered * covered / (COVERAGE_TOLERANCE + chances))
        * falling(depth * depth);
}

@compute @workgroup_size(8, 8)
fn undress(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let index = index_of(vec2i(id.xy));
    let samples = f32(max(counts[index].x, 1u));
    let hit = surfaces[index];
    var guide = Guide();
    guide.coverage = hit.hits / samples;
    let albedo = hit.albedo / samples + (1.0 - guide.coverage);
    guide.albedo = max(albedo, vec3f(MIN_ALBEDO));
    guide.normal = hit.normal / samples;
    if hit.depth > 0.0 {
        guide.nearness = guide.coverage * hit.hits / hit.depth;
    }
    let squared_normal = dot(guide.normal, guide.normal) / max(guide.coverage, TINY);
    guide.doubt = max(guide.coverage - squared_normal, 0.0) / max(samples - 1.0, 1.0);
    guides[index] = guide;

    let mean = sum[index].xyz / samples * settings.unscale;
    var variance = -1.0;
    if counts[index].x > 1u {
        let brightness = luminance(mean);
        let squared = sum[index].w / samples * settings.unscale * settings.unscale;
        let spread = max(squared - brightness * brightness, 0.0);
        let scale = 1.0 / luminance(guide.albedo);
        variance = min(spread / (samples - 1.0) * scale * scale, MAX_VARIANCE);
    }
    light[index] = vec4f(mean / guide.albedo, variance);
}

// Nearness of the pixel before, itself and the one after.
fn slope_of(before: f32, own: f32, after: f32) -> f32 {
    let steps = vec2f(own - before, after - own);
    return select(0.0, min(abs(steps.x), abs(steps.y)), steps.x * steps.y > 0.0);
}

// What the guides around a pixel say of its own.
@compute @workgroup_size(8, 8)
fn survey(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let centre = vec2i(id.xy);
    let index = index_of(centre);
    let low = max(centre - 1, vec2i());
    let high = min(centre + 1, vec2i(settings.size) - 1);
    var chance = 1.0;
    var normals = vec4f();
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let other = index_of(vec2i(x, y));
            let coverage = guides[other].coverage;
            let others = max(f32(max(counts[other].x, 1u)) - 1.0, 1.0);
            chance = min(chance, coverage * (1.0 - coverage) / others);
            let normal = guides[other].normal;
            normals += select(vec4f(), vec4f(normal, 1.0), any(normal != vec3f()));
        }
    }
    guides[index].chance = chance;
    if counts[index].x < 2u && normals.w > 0.0 {
        let mean = normals.xyz / normals.w;
        guides[index].doubt = max(1.0 - dot(mean, mean), 0.0);
    }
    let own = guides[index].nearness;
    let last = vec2i(settings.size) - 1;
    var slope = 0.0;
    if centre.x > 0 && centre.x < last.x {
        slope += slope_of(guides[index - 1u].nearness, own, guides[index + 1u].nearness);
    }
    if centre.y > 0 && centre.y < last.y {
        let row = settings.size.x;
        slope += slope_of(guides[index - row].nearness, own, guides[index + row].nearness);
    }
    guides[index].slope = slope;
}

// Variance over squared luminance of a pixel; of single samples neighbours tell.
fn relative_variance(place: vec2i) -> f32 {
    let here = light[index_of(place)];
    let own = compared_luminance(here.xyz);
    if here.w >= 0.0 {
        return here.w / max(own * own, TINY);
    }
    let is_last = place.x + 1 == i32(settings.size.x);
    let next = index_of(place + vec2i(select(1, -min(place.x, 1), is_last), 0));
    let other = compared_luminance(light[next].xyz);
    let off = (own - other) / max(own + other, TINY);
    return 2.0 * off * off;
}

// The variance of a pixel that shows the map alone; negative where it does not, and where one
// sample does not tell.
fn variance_of_map(centre: vec2i) -> f32 {
    let index = index_of(centre);
    if guides[index].coverage > 0.0 {
        return -1.0;
    }
    var smallest = array<f32, QUARTER>();
    for (var i = 0; i < QUARTER; i++) {
        smallest[i] = MAX_VARIANCE;
    }
    var count = 0;
    for (var dy = -REACH; dy <= REACH; dy++) {
        for (var dx = -REACH; dx <= REACH; dx++) {
            let place = centre + vec2i(dx, dy);
            if !is_inside(place) || guides[index_of(place)].coverage > 0.0 {
                continue;
            }
            var variance = relative_variance(place);
            count++;
            for (var i = 0; i < QUARTER; i++) {
                let kept = smallest[i];
                smallest[i] = min(kept, variance);
                variance = max(kept, variance);
            }
        }
    }
    let freedom = f32(max(counts[index].x, 2u) - 1u);
    let variance = smallest[(count - 1) / 4] * (1.0 + 8.85 * pow(freedom, -1.6));
    let brightness = compared_luminance(light[index].xyz);
    let most = MAX_MAP_NOISE * MAX_MAP_NOISE;
    let is_told = counts[index].x > 1u || variance <= most;
    return select(-1.0, min(variance, most) * brightness * brightness, is_told);
}

@compute @workgroup_size(8, 8)
fn share_errors(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let centre = vec2i(id.xy);
    let index = index_of(centre);
    let guide = guides[index];
    // Weights of those whose errors are known, and their errors.
    var known = vec2f();
    // Weights of all, and moments of their luminance.
    var all_weights = 0.0;
    var moments = vec2f();
    var support = 0.0;
    for (var dy = -REACH; dy <= REACH; dy++) {
        for (var dx = -REACH; dx <= REACH; dx++) {
            let place = centre + vec2i(dx, dy);
            if !is_inside(place) {
                continue;
            }
            let other = index_of(place);
            let alike = likeness(guide, guides[other], vec2i(dx, dy));
            let weight = alike + MIN_LIKENESS;
            let there = light[other];
            if there.w >= 0.0 {
                known += weight * vec2f(1.0, there.w);
            }
            let brightness = compared_luminance(there.xyz);
            all_weights += weight;
            moments += weight * vec2f(brightness, brightness * brightness);
            support += alike;
        }
    }
    let own = light[index];
    let mean = moments.x / all_weights;
    let off = compared_luminance(own.xyz) - mean;
    let chance = SINGLE * pow(FEWER, f32(max(counts[index].x, 1u) - 1u)) * off * off;
    var variance = max(max(own.w, known.y / max(known.x, TINY)), chance);
    if own.w < 0.0 {
        let spread = max(moments.y / all_weights - mean * mean, MIN_SPREAD * mean * mean);
        variance = SINGLE * max(spread, off * off);
    }
    let of_map = variance_of_map(centre);
    variance = min(select(variance, of_map, of_map >= 0.0), MAX_VARIANCE);
    result[index] = vec4f(own.xyz, variance);
    // The pixel itself is its like.
    guides[index].support = support - 1.0;
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
    let index = index_of(vec2i(id.xy));
    let guide = guides[index];
    let own = light[index];
    let own_luminance = compared_luminance(own.xyz);
    var rgb = vec3f();
    var variance = 0.0;
    var total = 0.0;
    var squares = 0.0;
    for (var dy = -2; dy <= 2; dy++) {
        for (var dx = -2; dx <= 2; dx++) {
            let offset = vec2i(dx, dy) * i32(settings.step);
            let place = vec2i(id.xy) + offset;
            if !is_inside(place) {
                continue;
            }
            let other = index_of(place);
            let there = light[other];
            var weight = kernel(dx) * kernel(dy);
            if other != index {
                let difference = compared_luminance(there.xyz) - own_luminance;
                let tolerance = own.w + there.w + MIN_VARIANCE;
                weight *= likeness(guide, guides[other], offset) * falling(
                    difference * difference * (1.0 / (ERRORS_TOLERATED * ERRORS_TOLERATED)) / tolerance
                );
            }
            rgb += there.xyz * weight;
            variance += there.w * weight * weight;
            total += weight;
            squares += weight * weight;
        }
    }
    // The centre always counts, so the total is not zero.
    let independent = variance / (total * total);
    let shared_noise = inverseSqrt(sqrt(squares) / total);
    result[index] = vec4f(rgb / total, independent * select(shared_noise, 1.0, settings.step == 1u));
}

// A pixel of those that tell another's light.
struct Witness {
    weight: f32,
    terms: array<f32, TERMS>,
    rgb: vec3f,
}

fn witness(own: Guide, own_light: f32, index: u32, offset: vec2i) -> Witness {
    let guide = guides[index];
    let there = light[index];
    var witness = Witness();
    witness.rgb = there.xyz * guide.albedo;
    let near = 1.0 - f32(dot(offset, offset)) / f32((REACH + 1) * (REACH + 1));
    let bright = compared_luminance(witness.rgb);
    let relative = RELATIVE_ERROR * RELATIVE_ERROR * (bright * bright + own_light * own_light);
    let dressed = luminance(guide.albedo);
    witness.weight = near / (there.w * dressed * dressed + relative + MIN_VARIANCE);
    let normal = guide.normal - own.normal;
    let nearness = (guide.nearness - own.nearness)
        / max(DEPTH_SCALE * max(own.nearness, guide.nearness), TINY);
    let albedo = luminance(guide.albedo - own.albedo);
    witness.terms = array(1.0, albedo, normal.x, normal.y, normal.z, nearness);
    return witness;
}

// What the pixels around one say it shows, blended with what it shows. Leaves radiance.
@compute @workgroup_size(8, 8)
fn mend(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let centre = vec2i(id.xy);
    let index = index_of(centre);
    let own = guides[index];
    let shown = light[index].xyz * own.albedo;
    if own.support >= MIN_ALIKE {
        result[index] = vec4f(shown, 0.0);
        return;
    }
    let own_light = compared_luminance(shown);
    let low = max(centre - REACH, vec2i());
    let high = min(centre + REACH, vec2i(settings.size) - 1);
    var system = array<array<f32, TERMS>, TERMS>();
    var sides = array<vec3f, TERMS>();
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let place = vec2i(x, y);
            let other = witness(own, own_light, index_of(place), place - centre);
            for (var row = 0; row < TERMS; row++) {
                let weighted = other.weight * other.terms[row];
                for (var column = 0; column <= row; column++) {
                    system[row][column] += weighted * other.terms[column];
                }
                sides[row] += other.rgb * weighted;
            }
        }
    }
    let total = system[0][0];
    for (var term = 1; term < TERMS; term++) {
        system[term][term] += RIDGE * total;
    }
    // By LDL^T.
    let least = 1e-9 * total;
    for (var row = 0; row < TERMS; row++) {
        for (var column = 0; column <= row; column++) {
            var rest = system[row][column];
            for (var k = 0; k < column; k++) {
                rest -= system[row][k] * system[column][k] * system[k][k];
            }
            if column < row {
                system[row][column] = rest / system[column][column];
            } else {
                system[row][column] = max(rest, least);
            }
        }
        for (var k = 0; k < row; k++) {
            sides[row] -= sides[k] * system[row][k];
        }
    }
    for (var row = TERMS - 1; row >= 0; row--) {
        sides[row] /= system[row][row];
        for (var k = row + 1; k < TERMS; k++) {
            sides[row] -= sides[k] * system[k][row];
        }
    }
    var error = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let place = vec2i(x, y);
            let other = witness(own, own_light, index_of(place), place - centre);
            var fitted = vec3f();
            for (var term = 0; term < TERMS; term++) {
                fitted += sides[term] * other.terms[term];
            }
            let off = luminance(fitted - other.rgb);
            error += other.weight * off * off;
        }
    }
    error /= total;
    let dressed = luminance(own.albedo);
    let share = error / max(error + light[index].w * dressed * dressed, TINY);
    result[index] = vec4f(mix(max(sides[0], vec3f()), shown, share), 0.0);
}

// The filtered picture, edges as wide as the pixel filter draws them, as a film of one sample a pixel where there
// are any.
@compute @workgroup_size(8, 8)
fn dress(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= settings.size) {
        return;
    }
    let centre = vec2i(id.xy);
    let index = index_of(centre);
    let own = light[index].xyz;
    var shown = own;
    if guides[index].support < WHOLE {
        var around = vec4f();
        for (var dy = -1; dy <= 1; dy++) {
            for (var dx = -1; dx <= 1; dx++) {
                let place = centre + vec2i(dx, dy);
                if is_inside(place) {
                    let weight = f32((2 - abs(dx)) * (2 - abs(dy)));
                    around += weight * vec4f(light[index_of(place)].xyz, 1.0);
                }
            }
        }
        shown = mix(own, around.xyz / around.w, min(CHANCE_SAMPLES / f32(max(counts[index].x, 1u)), 1.0));
    }
    result[index] = vec4f(shown, 0.0);
    result_counts[index] = vec4u(min(counts[index].x, 1u), 0u, 0u, 0u);
}
