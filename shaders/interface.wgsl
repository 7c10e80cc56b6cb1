// The GGX interface of a dielectric or a metal: twin of src/bsdf/interface.rs.

struct Interface {
    f0: vec3f,
    f90: f32,
    ggx: Ggx,
//#if TRANSMISSION
    glass: f32,
    glass_f90: f32,
    eta: f32,
    glass_f0: vec3f,
    thin: bool,
    tint: vec3f,
//#end
//#if DISPERSION
    etas: vec3f,
    hero: vec3f,
//#end
//#if IRIDESCENCE
    film: Film,
    // What is under the film: F0 and share of the opaque dielectric and of the metal.
    base_f0: vec3f,
    dielectric_share: f32,
    metal_f0: vec3f,
    metal_share: f32,
//#end
}

struct Facet {
    reflectance: vec3f,
    transmittance: vec3f,
}

fn interface_new(p: SurfaceParameters, f0: vec3f, f90: f32, entering: bool) -> Interface {
    var i: Interface;
//#if ANISOTROPY
    i.ggx = ggx_stretched(p.roughness, p.anisotropy, p.anisotropy_axis);
//#else
    i.ggx = ggx_from_roughness(p.roughness);
//#end
    let opaque_share = (1.0 - p.metallic) * (1.0 - p.transmission);
    i.f0 = f0 * opaque_share + p.base_color * p.metallic;
    i.f90 = f90 * opaque_share + p.metallic;
//#if TRANSMISSION
    i.glass = (1.0 - p.metallic) * p.transmission;
    i.glass_f0 = f0;
    i.glass_f90 = f90;
    i.tint = p.base_color * i.glass;
    i.thin = p.thin;
    i.eta = eta_of(p.ior, entering || p.thin);
//#end
//#if DISPERSION
    i.etas = vec3f(i.eta);
    i.hero = vec3f(1.0);
    if p.dispersion > 0.0 && p.ior > 0.0 {
        let spread = (p.ior - 1.0) * (0.025 * p.dispersion);
        i.etas.x = eta_of(p.ior - spread, entering || p.thin);
        i.etas.z = eta_of(p.ior + spread, entering || p.thin);
    }
//#end
//#if IRIDESCENCE
    i.film = film_new(p);
    i.base_f0 = min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0));
    i.dielectric_share = p.specular * opaque_share;
    i.metal_f0 = p.base_color;
    i.metal_share = p.metallic;
//#end
    return i;
}

//#if TRANSMISSION
// Index on the far side over this side.
fn eta_of(index: f32, is_outside: bool) -> f32 {
    let ior = max(index, 1.0);
    if abs(ior - 1.0) < STRAIGHT_ETA {
        return 1.0;
    }
    return select(1.0 / ior, ior, is_outside);
}
//#end

//#if DISPERSION
struct Hero {
    channel: u32,
    probability: f32,
}

// Twin of `Hero::choose`.
fn hero_choose(throughput: vec3f, u: f32) -> Hero {
    let scaled = throughput / max_element(throughput);
    let share = scaled / (scaled.x + scaled.y + scaled.z);
    if u < share.x || (share.y == 0.0 && share.z == 0.0) {
        return Hero(0u, share.x);
    }
    if u < share.x + share.y || share.z == 0.0 {
        return Hero(1u, share.y);
    }
    return Hero(2u, share.z);
}

fn is_dispersive(i: Interface) -> bool {
    return i.etas.x != i.etas.z && i.glass > 0.0;
}

// Twin of `Interface::of_hero`.
fn interface_of_hero(i: Interface, hero: Hero) -> Interface {
    var of_hero = i;
    if is_dispersive(i) {
        let channel = vec3u(hero.channel);
        let is_hero = channel == vec3u(0u, 1u, 2u);
        of_hero.hero = select(vec3f(0.0), vec3f(1.0 / hero.probability), is_hero);
        of_hero.eta = dot(i.etas, select(vec3f(0.0), vec3f(1.0), is_hero));
    }
    return of_hero;
}
//#end

//#if IRIDESCENCE
// Reflectance of the opaque share.
fn interface_opaque(i: Interface, cosine: f32) -> vec3f {
    let plain = i.f0 + (i.f90 - i.f0) * schlick_weight(cosine);
    if i.film.share == 0.0 {
        return plain;
    }
    var filmed = vec3f(0.0);
    // A loop, for what it calls is long.
    for (var part = 0u; part < 2u; part++) {
        let share = select(i.dielectric_share, i.metal_share, part == 1u);
        if share > 0.0 {
            let f0 = select(i.base_f0, i.metal_f0, part == 1u);
            filmed += film_reflectance(i.film, cosine, f0) * share;
        }
    }
    return mix(plain, filmed, i.film.share);
}
//#end

fn interface_is_absent(i: Interface) -> bool {
    var absent = i.f90 == 0.0 && all(i.f0 == vec3f(0.0));
//#if TRANSMISSION
    absent = absent && i.glass == 0.0;
//#end
    return absent;
}

fn interface_is_delta_or_absent(i: Interface) -> bool {
    if is_smooth(i.ggx) || interface_is_absent(i) {
        return true;
    }
//#if TRANSMISSION
    let reflects_nothing = i.f90 == 0.0 && all(i.f0 == vec3f(0.0)) && all(i.glass_f0 == vec3f(0.0));
    return transmits_delta(i) && reflects_nothing;
//#else
    return false;
//#end
}

// Reflectance and transmittance of a facet seen at this cosine.
fn interface_facet(i: Interface, cosine: f32) -> Facet {
//#if IRIDESCENCE
    let opaque_share = interface_opaque(i, cosine);
//#else
    let opaque_share = i.f0 + (i.f90 - i.f0) * schlick_weight(cosine);
//#end
//#if TRANSMISSION
    if i.glass > 0.0 {
//#if DISPERSION
        // A loop, for what it calls is long: first the hero's index, then that of each channel.
        let turns = select(1u, 4u, is_dispersive(i));
        var reflected_share = vec3f(0.0);
        var passing = 0.0;
        var etas = vec4f(i.eta, i.etas);
        for (var turn = 0u; turn < turns; turn++) {
            let glass = glass_at(i, cosine, etas.x);
            let is_told = vec3<bool>(turn == 0u) | (vec3u(turn) == vec3u(1u, 2u, 3u));
            reflected_share = select(reflected_share, glass.xyz, is_told);
            passing = select(passing, glass.w, turn == 0u);
            etas = etas.yzwx;
        }
        return Facet(opaque_share + i.glass * reflected_share, i.tint * passing);
//#else
        let glass = glass_at(i, cosine, i.eta);
        return Facet(opaque_share + i.glass * glass.xyz, i.tint * glass.w);
//#end
    }
//#end
    return Facet(opaque_share, vec3f(0.0));
}

//#if TRANSMISSION
// Reflectance of the transmissive share, and what passes it, at a relative index.
fn glass_at(i: Interface, cosine: f32, eta: f32) -> vec4f {
    let exact = dielectric(cosine, eta);
    if exact == TOTAL_REFLECTION {
        return vec4f(1.0, 1.0, 1.0, 0.0);
    }
    let exact_f0 = normal_reflectance(eta);
    let weight = saturate((exact - exact_f0) / (1.0 - exact_f0));
    var fresnel = i.glass_f0 + (i.glass_f90 - i.glass_f0) * weight;
//#if IRIDESCENCE
    if i.film.share > 0.0 {
        let sin2 = (1.0 - cosine * cosine) / select(1.0, eta * eta, eta < 1.0);
        let filmed = film_reflectance(i.film, sqrt(max(1.0 - sin2, 0.0)), i.base_f0);
        fresnel = mix(fresnel, filmed * i.glass_f90, i.film.share);
    }
//#end
    let most = max_element(fresnel);
    if i.thin {
        return vec4f(2.0 * fresnel / (1.0 + fresnel), (1.0 - most) / (1.0 + most));
    }
    return vec4f(fresnel, 1.0 - most);
}
//#end

fn facet_reflection_probability(facet: Facet) -> f32 {
    let r = importance(facet.reflectance);
    let t = importance(facet.transmittance);
    return select(1.0, r / (r + t), t > 0.0);
}

//#if TRANSMISSION
fn passes_straight(i: Interface) -> bool {
    return i.glass > 0.0 && i.thin && is_smooth(i.ggx);
}

fn transmits_delta(i: Interface) -> bool {
    return is_smooth(i.ggx) || (!i.thin && i.eta == 1.0);
}

fn interface_straight_transmittance(i: Interface, cosine: f32) -> vec3f {
    if passes_straight(i) {
        return interface_facet(i, cosine).transmittance;
    }
    return vec3f(0.0);
}
//#end

// The facet as far as evaluation and sampling answer for it.
fn scattering_facet(i: Interface, cosine: f32) -> Facet {
    var facet = interface_facet(i, cosine);
//#if TRANSMISSION
    if passes_straight(i) {
        facet.transmittance = vec3f(0.0);
    }
//#end
    return facet;
}

// A facet, and the one whose reflectance says how likely reflection is: delta refraction is chosen
// before the facet is.
struct Facets {
    seen: Facet,
    deciding: Facet,
}

fn scattering_facets(i: Interface, cosine: f32, wo: vec3f) -> Facets {
    var facets: Facets;
//#if TRANSMISSION
    // A loop, for what it calls is long.
    let turns = select(1u, 2u, i.glass > 0.0 && transmits_delta(i));
    for (var turn = 0u; turn < turns; turn++) {
        facets.deciding = scattering_facet(i, select(wo.z, cosine, turn == 0u));
        if turn == 0u {
            facets.seen = facets.deciding;
        }
    }
//#else
    facets.seen = scattering_facet(i, cosine);
    facets.deciding = facets.seen;
//#end
    return facets;
}

fn interface_sample(i: Interface, wo: vec3f, choice: f32, u: vec2f) -> LobeSample {
    let smooth_ = is_smooth(i.ggx);
    var h = vec3f(0.0, 0.0, 1.0);
    if !smooth_ {
        h = ggx_sample_visible_normal(i.ggx, wo, u);
    }
    let facets = scattering_facets(i, dot(wo, h), wo);
    let probability = facet_reflection_probability(facets.deciding);
    var result = NO_SAMPLE;
    if choice < probability {
        let wi = reflected(wo, h);
        if smooth_ {
            result = LobeSample(DELTA, wi, facets.seen.reflectance / probability);
        } else {
            result = LobeSample(select(ABSORBED, SPREAD, wi.z > 0.0), wi, vec3f(0.0));
        }
//#if TRANSMISSION
    } else if transmits_delta(i) {
        let wi = refracted(wo, vec3f(0.0, 0.0, 1.0), i.eta);
        if any(wi != vec3f(0.0)) {
            var radiance = facets.deciding.transmittance / (i.eta * i.eta);
//#if DISPERSION
            radiance *= i.hero;
//#end
            result = LobeSample(DELTA, wi, radiance / (1.0 - probability));
        }
    } else {
        var wi = reflected(wo, h) * vec3f(1.0, 1.0, -1.0);
        if !i.thin {
            wi = refracted(wo, h, i.eta);
        }
        result = LobeSample(select(ABSORBED, SPREAD, wi.z < 0.0), wi, vec3f(0.0));
//#end
    }
    return result;
}

fn interface_eval_pdf(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    if is_smooth(i.ggx) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let is_reflected = wi.z > 0.0;
//#if TRANSMISSION
    if !is_reflected && (i.glass == 0.0 || transmits_delta(i)) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    if is_reflected || i.thin {
        let above = select(wi * vec3f(1.0, 1.0, -1.0), wi, is_reflected);
        return eval_pdf_mirrored(i, wo, above, is_reflected);
    }
    return eval_pdf_refracted(i, wo, wi);
//#else
    if is_reflected {
        return eval_pdf_mirrored(i, wo, wi, true);
    }
    return EvalPdf(vec3f(0.0), 0.0);
//#end
}

fn eval_pdf_mirrored(i: Interface, wo: vec3f, wi: vec3f, is_reflected: bool) -> EvalPdf {
    let h = normalize_or(wo + wi, vec3f(0.0));
    if all(h == vec3f(0.0)) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let facets = scattering_facets(i, dot(wo, h), wo);
    let reflects = facet_reflection_probability(facets.deciding);
    let color = select(facets.seen.transmittance, facets.seen.reflectance, is_reflected);
    let probability = select(1.0 - reflects, reflects, is_reflected);
    let visible = ggx_distribution(i.ggx, h) * ggx_visibility(i.ggx, wo);
    return EvalPdf(
        color * (visible * ggx_visibility(i.ggx, wi) * wi.z),
        0.5 * visible * probability,
    );
}

//#if TRANSMISSION
fn eval_pdf_refracted(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    let none = EvalPdf(vec3f(0.0), 0.0);
    var h = normalize_or(wo + i.eta * wi, vec3f(0.0));
    h = select(h, -h, h.z < 0.0);
    let cos_o = dot(wo, h);
    let cos_i = dot(wi, h);
    if cos_o <= 0.0 || cos_i >= 0.0 {
        return none;
    }
    let facet = interface_facet(i, cos_o);
    let denominator = cos_o + i.eta * cos_i;
    let jacobian = -cos_i / (denominator * denominator);
    let visible = ggx_visible_normal_pdf_solid_angle(i.ggx, wo, h) * jacobian;
    let masking = 2.0 * -wi.z * ggx_visibility(i.ggx, -wi);
    let probability = 1.0 - facet_reflection_probability(facet);
    var transmitted = facet.transmittance;
//#if DISPERSION
    transmitted *= i.hero;
//#end
    return EvalPdf(
        transmitted * (visible * masking),
        visible * i.eta * i.eta * probability,
    );
}
//#end

fn interface_albedo(i: Interface, cosine: f32, terms: vec2f) -> vec3f {
    var albedo = i.f0 * terms.x + i.f90 * terms.y;
//#if IRIDESCENCE
    if i.film.share > 0.0 {
        albedo = interface_opaque(i, cosine) * (terms.x + terms.y);
    }
//#end
//#if TRANSMISSION
    if i.glass > 0.0 {
        var glass = i;
        glass.f0 = vec3f(0.0);
        glass.f90 = 0.0;
//#if IRIDESCENCE
        glass.dielectric_share = 0.0;
        glass.metal_share = 0.0;
//#end
        let passing = scattering_facet(glass, cosine);
        albedo += passing.reflectance + passing.transmittance;
    }
//#end
    return albedo;
}

//#if DIFFUSE_TRANSMISSION
// Twin of `Interface::radiance_scale`.
fn radiance_scale(i: Interface) -> vec3f {
//#if TRANSMISSION
    if !i.thin {
//#if DISPERSION
        return 1.0 / (i.etas * i.etas);
//#else
        return vec3f(1.0 / (i.eta * i.eta));
//#end
    }
//#end
    return vec3f(1.0);
}
//#end
