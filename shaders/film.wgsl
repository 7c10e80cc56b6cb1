// What samples add up to, each sum in two f32: nothing is lost at 1e7 samples, and sums do not depend
// on how the work is cut into dispatches. See src/render/gpu/film.rs.

// A sum, and what rounding it to f32 left out.
struct Sum {
    high: vec4f,
    low: vec4f,
}

// What no compiler may see through: the rounding errors below are not zero.
fn rounded4(x: vec4f) -> vec4f {
    return bitcast<vec4f>(bitcast<vec4u>(x) ^ vec4u(globals.zero));
}

// Knuth's two-sum, then Dekker's fast one, after which `low` is at most half a unit of `high`.
fn add_to_sum(sum: Sum, x: vec4f) -> Sum {
    let total = rounded4(sum.high + x);
    let added = rounded4(total - sum.high);
    let lost = rounded4(sum.high - rounded4(total - added)) + rounded4(x - added);
    let low = rounded4(sum.low + lost);
    let high = rounded4(total + low);
    return Sum(high, rounded4(low - rounded4(high - total)));
}

// Adds a finished path to its pixel; one that is not finite, or with which the sum would not be, is
// left out and counted.
fn add_to_film(pixel: u32, path: ptr<function, Path>) {
    let radiance = (*path).radiance * globals.film_scale;
    let light = luminance(radiance);
    let sample = vec4f(radiance, min(light * light, F32_MAX));
    let before = Sum(film_sum[pixel], film_rest[pixel]);
    var after = add_to_sum(before, sample);
    if !is_finite(after.high.w) {
        after.high.w = F32_MAX;
        after.low.w = 0.0;
    }
    let is_valid = is_finite3((*path).radiance) && is_finite3(after.high.xyz);
    if is_valid {
        film_sum[pixel] = after.high;
        film_rest[pixel] = after.low;
    }
    film_counts[pixel] += vec4u(1u, select(1u, 0u, is_valid), (*path).rays, 0u);
//#if LAYERS
    var hit = (*path).first_hit;
//#if PERFECT_INTERFACES
    // Twin of `Surface::add` in src/render/film.rs. A sample that says nothing counts as much as the others on average,
    // those that come first as much as the first that says something: until then the depth counts them down.
    let met = surfaces[2u * pixel];
    let seen = surfaces[2u * pixel + 1u];
    let waiting = max(-met.w, 0.0);
    if hit.hits >= 0.0 {
        let times = hit.hits * (1.0 + waiting);
        hit = FirstHit(hit.albedo * times, hit.depth * times + waiting, hit.normal * times, times);
    } else if seen.w > 0.0 {
        hit = FirstHit(met.xyz / seen.w, met.w / seen.w, seen.xyz / seen.w, 1.0);
    } else {
        hit = FirstHit(vec3f(0.0), -1.0, vec3f(0.0), 0.0);
    }
//#end
    let albedo = add_to_sum(
        Sum(surfaces[2u * pixel], surfaces_rest[2u * pixel]), vec4f(hit.albedo, hit.depth));
    let normal = add_to_sum(
        Sum(surfaces[2u * pixel + 1u], surfaces_rest[2u * pixel + 1u]), vec4f(hit.normal, hit.hits));
    surfaces[2u * pixel] = albedo.high;
    surfaces_rest[2u * pixel] = albedo.low;
    surfaces[2u * pixel + 1u] = normal.high;
    surfaces_rest[2u * pixel + 1u] = normal.low;
//#end
}
