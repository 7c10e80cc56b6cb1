// A thin film on the interface: twin of src/bsdf/iridescence.rs.

struct Film {
    share: f32,
    ior: f32,
    // Micrometres.
    thickness: f32,
    // What is under it: F0 and share of the opaque dielectric and of the metal.
    base_f0: vec3f,
    dielectric_share: f32,
    metal_f0: vec3f,
    metal_share: f32,
}

fn film_new(p: SurfaceParameters) -> Film {
    let t = saturate(p.iridescence_thickness / 0.03);
    let ior = 1.0 + (max(p.iridescence_ior, 1.0) - 1.0) * (t * t * (3.0 - 2.0 * t));
    let opaque_share = (1.0 - p.metallic) * (1.0 - p.transmission);
    return Film(
        p.iridescence,
        ior,
        1e-3 * p.iridescence_thickness,
        min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0)),
        p.specular * opaque_share,
        p.base_color,
        p.metallic,
    );
}

fn film_is_absent(film: Film) -> bool {
    return film.share == 0.0;
}

fn film_sensitivity(path: f32, signs: vec3f) -> vec3f {
    let phase = TAU * path;
    let weight = vec3f(0.846590, 1.0002219, 1.0011225);
    let position = vec3f(1.6810, 1.7953, 2.2084);
    let variance = vec3f(4.3278e-3, 9.3046e-3, 6.6121e-3);
    let square = phase * phase;
    var xyz = weight * cosines(position * path) * exp(-square * variance);
    xyz.x += 0.1538683 * sin_cos_turns(2.2399 * path).y * exp(-square * 4.5282e-3);
    xyz *= signs;
    return vec3f(
        dot(vec3f(3.24097, -1.5373832, -0.49861076), xyz),
        dot(vec3f(-0.9692436, 1.8759675, 0.04155506), xyz),
        dot(vec3f(0.05563008, -0.20397696, 1.0569715), xyz),
    );
}

fn cosines(turns: vec3f) -> vec3f {
    return vec3f(sin_cos_turns(turns.x).y, sin_cos_turns(turns.y).y, sin_cos_turns(turns.z).y);
}

fn film_schlick(f0: vec3f, cosine: f32) -> vec3f {
    return f0 + (1.0 - f0) * schlick_weight(cosine);
}

fn film_reflectance(film: Film, cosine: f32, f0: vec3f) -> vec3f {
    let c = saturate(cosine);
    let cos_inside = sqrt(max(1.0 - (1.0 - c * c) / (film.ior * film.ior), 0.0));
    let exact = dielectric(c, film.ior);
    let outer = select(exact, 1.0, exact == TOTAL_REFLECTION);
    let through = 1.0 - outer;
    let roots = sqrt(clamp(f0, vec3f(0.0), vec3f(0.9999)));
    let base_ior = (1.0 + roots) / (1.0 - roots);
    let ratios = (base_ior / film.ior - 1.0) / (base_ior / film.ior + 1.0);
    let inner = film_schlick(ratios * ratios, cos_inside);
    let signs = select(vec3f(-1.0), vec3f(1.0), base_ior < vec3f(film.ior));
    let path = 2.0 * film.ior * film.thickness * cos_inside;
    let both = min(outer * inner, vec3f(0.9999));
    let mean = through * through * inner / (1.0 - both);
    var order = mean - through;
    var sum = outer + mean;
    for (var n = 1u; n <= 2u; n++) {
        order *= sqrt(both);
        sum += order * 2.0
            * film_sensitivity(f32(n) * path, select(vec3f(1.0), signs, n == 1u));
    }
    return saturate(sum);
}

// Reflectance of the opaque share, given the one without a film.
fn film_over(film: Film, plain: vec3f, cosine: f32) -> vec3f {
    if film.share == 0.0 {
        return plain;
    }
    var filmed = vec3f(0.0);
    // A loop, for what it calls is long.
    for (var part = 0u; part < 2u; part++) {
        let share = select(film.dielectric_share, film.metal_share, part == 1u);
        if share > 0.0 {
            let f0 = select(film.base_f0, film.metal_f0, part == 1u);
            filmed += film_reflectance(film, cosine, f0) * share;
        }
    }
    return mix(plain, filmed, film.share);
}

// Fresnel's factor of glass of this relative index and F90, given the one without a film.
fn film_over_glass(film: Film, bare: vec3f, cosine: f32, eta: f32, f90: f32) -> vec3f {
    if film.share == 0.0 {
        return bare;
    }
    // Both sides see the film alike: by the angle outside.
    let sin2 = (1.0 - cosine * cosine) / select(1.0, eta * eta, eta < 1.0);
    let filmed = film_reflectance(film, sqrt(max(1.0 - sin2, 0.0)), film.base_f0);
    return mix(bare, filmed * f90, film.share);
}

// The film, with nothing opaque under it.
fn film_over_glass_alone(film: Film) -> Film {
    var alone = film;
    alone.dielectric_share = 0.0;
    alone.metal_share = 0.0;
    return alone;
}

// Twin of `Film::largest_f0` and of what is asked of it: the largest F0 of a dielectric, given the one
// without a film.
fn film_largest_f0(film: Film, bare: f32, specular: f32) -> f32 {
    if film.share == 0.0 || film.dielectric_share == 0.0 {
        return bare;
    }
    var largest = 0.0;
    for (var i = 1; i <= 12; i++) {
        let cosine = f32(i) / 12.0;
        let weight = schlick_weight(cosine);
        let f0 = film.base_f0 * specular;
        let plain = f0 + (specular - f0) * weight;
        let filmed = film_reflectance(film, cosine, film.base_f0) * specular;
        let mixed = mix(plain, filmed, film.share);
        largest = max(largest, (max_element(mixed) - specular * weight) / (1.0 - weight));
    }
    return max(bare, min(largest, specular));
}
