// The GGX interface of a dielectric or a metal: twin of src/bsdf/interface.rs. Glass and film are empty
// where no material has any.

struct Interface {
    // Opaque share: metal and dielectric, weights included.
    f0: vec3f,
    f90: f32,
    ggx: Ggx,
    glass: Glass,
    film: Film,
}

struct Facet {
    reflectance: vec3f,
    transmittance: vec3f,
}

// A facet, and the one whose reflectance says how likely reflection is: delta refraction is chosen
// before the facet is.
struct Facets {
    seen: Facet,
    deciding: Facet,
}

fn interface_new(p: SurfaceParameters, f0: vec3f, f90: f32, entering: bool) -> Interface {
    let opaque_share = (1.0 - p.metallic) * (1.0 - p.transmission);
    return Interface(
        f0 * opaque_share + p.base_color * p.metallic,
        f90 * opaque_share + p.metallic,
        ggx_of(p),
        glass_new(p, f0, f90, entering),
        film_new(p),
    );
}

// The dielectric's largest F0, that of its film too if there is one.
fn interface_largest_f0(i: Interface, p: SurfaceParameters, f0: vec3f) -> f32 {
    return film_largest_f0(i.film, max_element(f0), p.specular);
}

// Whether the opaque share reflects nothing.
fn is_black(i: Interface) -> bool {
    return i.f90 == 0.0 && all(i.f0 == vec3f(0.0));
}

fn interface_is_absent(i: Interface) -> bool {
    return is_black(i) && glass_is_absent(i.glass);
}

fn interface_is_delta_or_absent(i: Interface) -> bool {
    return is_smooth(i.ggx) || interface_is_absent(i)
        || (is_black(i) && glass_reflects_nothing(i.glass) && transmits_delta(i));
}

// Reflectance of the opaque share.
fn interface_opaque(i: Interface, cosine: f32) -> vec3f {
    return film_over(i.film, i.f0 + (i.f90 - i.f0) * schlick_weight(cosine), cosine);
}

// Reflectance and transmittance of a facet seen at this cosine.
fn interface_facet(i: Interface, cosine: f32) -> Facet {
    return facet_with_glass(i, cosine, interface_opaque(i, cosine));
}

fn facet_reflection_probability(facet: Facet) -> f32 {
    let r = importance(facet.reflectance);
    let t = importance(facet.transmittance);
    return select(1.0, r / (r + t), t > 0.0);
}

fn interface_straight_transmittance(i: Interface, cosine: f32) -> vec3f {
    if passes_straight(i) {
        return interface_facet(i, cosine).transmittance;
    }
    return vec3f(0.0);
}

// The facet as far as evaluation and sampling answer for it.
fn scattering_facet(i: Interface, cosine: f32) -> Facet {
    var facet = interface_facet(i, cosine);
    if passes_straight(i) {
        facet.transmittance = vec3f(0.0);
    }
    return facet;
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
    } else {
        let transmittance = facets.deciding.transmittance / (1.0 - probability);
        result = sample_through(i, wo, h, transmittance);
    }
    return result;
}

fn interface_eval_pdf(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    if is_smooth(i.ggx) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let is_reflected = wi.z > 0.0;
    if is_reflected || passes_mirrored(i) {
        let above = select(wi * vec3f(1.0, 1.0, -1.0), wi, is_reflected);
        return eval_pdf_mirrored(i, wo, above, is_reflected);
    }
    return eval_pdf_refracted(i, wo, wi);
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

fn interface_albedo(i: Interface, cosine: f32, terms: vec2f) -> vec3f {
    var albedo = i.f0 * terms.x + i.f90 * terms.y;
    if !film_is_absent(i.film) {
        albedo = interface_opaque(i, cosine) * (terms.x + terms.y);
    }
    return albedo + glass_albedo(i, cosine);
}
