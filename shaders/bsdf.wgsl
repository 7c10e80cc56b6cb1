// How light is scattered at a surface point: twin of src/bsdf/ (mod.rs, diffuse.rs). Directions are
// unit, local to the shading frame, z on the viewer's side.

struct Bsdf {
    interface_: Interface,
    // Lambert's lobe: base colour times share, over what the interface lets in on average.
    diffuse_color: vec3f,
//#if DIFFUSE_TRANSMISSION
    // The same for light from the far side, and the probability of choosing it.
    transmitted_color: vec3f,
    through: f32,
//#end
    // The dielectric's largest F0 and its F90.
    f0_f90: vec2f,
    roughness: f32,
//#if SHEEN
    sheen: Sheen,
//#end
//#if CLEARCOAT
    coat: Coat,
//#end
}

// What depends on `wo` alone. All probabilities are zero if nothing is scattered.
struct Outgoing {
    diffuse_left: f32,
    coat_probability: f32,
    interface_probability: f32,
    diffuse_probability: f32,
//#if SHEEN
    sheen_probability: f32,
//#end
}

// Value times cosine, and density per steradian.
struct EvalPdf {
    value: vec3f,
    pdf_solid_angle: f32,
}

const ABSORBED = 0u;
// A direction with a density, to be evaluated with all lobes.
const SPREAD = 1u;
// Perfect reflection or refraction: direction and weight.
const DELTA = 2u;
const COAT_DELTA = 3u;

struct LobeSample {
    kind: u32,
    wi: vec3f,
    weight: vec3f,
}

struct BsdfSample {
    // Unit local direction the light comes from.
    wi: vec3f,
    // f |cos wi| / pdf; zero means absorption.
    weight: vec3f,
    pdf_solid_angle: f32,
    is_delta: bool,
}

const NO_SAMPLE = LobeSample(ABSORBED, vec3f(0.0), vec3f(0.0));

fn has_diffuse(b: Bsdf) -> bool {
//#if DIFFUSE_TRANSMISSION
    return any(b.diffuse_color != vec3f(0.0)) || any(b.transmitted_color != vec3f(0.0));
//#else
    return any(b.diffuse_color != vec3f(0.0));
//#end
}

// Both of Lambert's lobes.
fn diffuse_sum(b: Bsdf) -> vec3f {
//#if DIFFUSE_TRANSMISSION
    return b.diffuse_color + b.transmitted_color;
//#else
    return b.diffuse_color;
//#end
}

fn bsdf_new(p: SurfaceParameters, entering: bool) -> Bsdf {
    let f90 = p.specular;
    let f0 = min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0)) * p.specular;
    var b: Bsdf;
    b.f0_f90 = vec2f(max_element(f0), f90);
    b.roughness = p.roughness;
    b.interface_ = interface_new(p, f0, f90, entering);
//#if IRIDESCENCE
    let film = b.interface_.film;
    if film.share > 0.0 && b.interface_.dielectric_share > 0.0 {
        let most = film_largest_f0(film, b.interface_.base_f0, p.specular);
        b.f0_f90.x = max(b.f0_f90.x, most);
    }
//#end
    b.diffuse_color = p.base_color * ((1.0 - p.metallic) * (1.0 - p.transmission));
//#if DIFFUSE_TRANSMISSION
    if p.diffuse_transmission > 0.0 {
        let share = (1.0 - p.metallic) * (1.0 - p.transmission);
        b.diffuse_color = p.base_color * (share * (1.0 - p.diffuse_transmission));
        b.transmitted_color = p.diffuse_transmission_color * (share * p.diffuse_transmission)
            * radiance_scale(b.interface_);
        let through = importance(b.transmitted_color);
        if through > 0.0 {
            b.through = through / (importance(b.diffuse_color) + through);
        }
    }
//#end
    if f90 > 0.0 && has_diffuse(b) {
        let let_in = 1.0 - dot(b.f0_f90, terms_mean(b.interface_.ggx, p.roughness));
        b.diffuse_color = select(vec3f(0.0), b.diffuse_color / let_in, let_in > 1e-4);
//#if DIFFUSE_TRANSMISSION
        b.transmitted_color = select(vec3f(0.0), b.transmitted_color / let_in, let_in > 1e-4);
//#end
    }
//#if SHEEN
    b.sheen = sheen_new(p, entering);
//#end
//#if CLEARCOAT
    b.coat = coat_new(p, entering);
//#end
    return b;
}

fn bsdf_is_delta_only(b: Bsdf) -> bool {
    var delta = !has_diffuse(b) && interface_is_delta_or_absent(b.interface_);
//#if SHEEN
    delta = delta && sheen_is_hidden(b.sheen);
//#end
//#if CLEARCOAT
    delta = delta && coat_is_delta_or_absent(b.coat);
//#end
    return delta;
}

fn bsdf_diffuse_left(b: Bsdf, terms: vec2f) -> f32 {
    return max(1.0 - dot(b.f0_f90, terms), 0.0);
}

fn bsdf_diffuse_left_at(b: Bsdf, v: vec3f) -> f32 {
    if all(b.f0_f90 == vec2f(0.0)) {
        return 1.0;
    }
    return bsdf_diffuse_left(b, terms_towards(b.interface_.ggx, b.roughness, v));
}

fn bsdf_outgoing(b: Bsdf, wo: vec3f) -> Outgoing {
    var out: Outgoing;
    if !(wo.z > 0.0) {
        return out;
    }
    let has_diffuse_ = has_diffuse(b);
    let has_interface = !interface_is_absent(b.interface_);
    var bare = true;
//#if CLEARCOAT
    bare = b.coat.strength == 0.0;
//#end
//#if SHEEN
    bare = bare && b.sheen.strength == 0.0;
//#end
    if bare && !(has_diffuse_ && has_interface) {
        out.diffuse_left = 1.0;
        out.interface_probability = select(0.0, 1.0, has_interface);
        out.diffuse_probability = select(0.0, 1.0, has_diffuse_);
        return out;
    }
    let terms = terms_towards(b.interface_.ggx, b.roughness, wo);
    let diffuse_left = bsdf_diffuse_left(b, terms);
    var interface_albedo_ = importance(interface_albedo(b.interface_, wo.z, terms));
    var diffuse = diffuse_left * importance(diffuse_sum(b));
    var coat = 0.0;
//#if SHEEN
    let base = sheen_left(b.sheen, wo, wo);
    interface_albedo_ *= base;
    diffuse *= base;
    var sheen = importance(b.sheen.color) * sheen_albedo(b.sheen, wo);
//#end
//#if CLEARCOAT
    let under = coat_attenuation(b.coat, wo);
    interface_albedo_ *= under;
    diffuse *= under;
//#if SHEEN
    sheen *= under;
//#end
    coat = coat_albedo(b.coat, wo);
//#end
    var sum = coat + interface_albedo_ + diffuse;
//#if SHEEN
    sum += sheen;
//#end
    if !(sum > 0.0) {
        return out;
    }
    out.diffuse_left = diffuse_left;
    out.coat_probability = coat / sum;
    out.interface_probability = interface_albedo_ / sum;
    out.diffuse_probability = diffuse / sum;
//#if SHEEN
    out.sheen_probability = sheen / sum;
//#end
    return out;
}

fn bsdf_eval_pdf_with(b: Bsdf, wo: vec3f, wi: vec3f, out: Outgoing) -> EvalPdf {
    var result = EvalPdf(vec3f(0.0), 0.0);
    if out.diffuse_probability > 0.0 && wi.z > 0.0 {
        let lambert = wi.z * FRAC_1_PI;
        let left = out.diffuse_left * bsdf_diffuse_left_at(b, wi);
        result.value += b.diffuse_color * (left * lambert);
//#if DIFFUSE_TRANSMISSION
        result.pdf_solid_angle += out.diffuse_probability * lambert * (1.0 - b.through);
//#else
        result.pdf_solid_angle += out.diffuse_probability * lambert;
//#end
    }
//#if DIFFUSE_TRANSMISSION
    if out.diffuse_probability > 0.0 && wi.z <= 0.0 && b.through > 0.0 {
        let lambert = -wi.z * FRAC_1_PI;
        let left = out.diffuse_left * bsdf_diffuse_left_at(b, -wi);
        result.value += b.transmitted_color * (left * lambert);
        result.pdf_solid_angle += out.diffuse_probability * lambert * b.through;
    }
//#end
    if out.interface_probability > 0.0 {
        let lobe = interface_eval_pdf(b.interface_, wo, wi);
        result.value += lobe.value;
        result.pdf_solid_angle += out.interface_probability * lobe.pdf_solid_angle;
    }
//#if SHEEN
    if b.sheen.strength > 0.0 {
        result.value *= sheen_left(b.sheen, wo, wi);
        if out.sheen_probability > 0.0 {
            let lobe = sheen_eval_pdf(b.sheen, wo, wi);
            result.value += lobe.value;
            result.pdf_solid_angle += out.sheen_probability * lobe.pdf_solid_angle;
        }
    }
//#end
//#if CLEARCOAT
    if b.coat.strength > 0.0 {
        result.value *= coat_attenuation(b.coat, wo) * coat_attenuation(b.coat, wi);
        if out.coat_probability > 0.0 {
            let coat = coat_eval_pdf(b.coat, wo, wi);
            result.value += vec3f(coat.x);
            result.pdf_solid_angle += out.coat_probability * coat.y;
        }
    }
//#end
    return result;
}

// Zero if nothing is scattered towards `wo`.
fn bsdf_eval_pdf(b: Bsdf, wo: vec3f, wi: vec3f) -> EvalPdf {
    return bsdf_eval_pdf_with(b, wo, wi, bsdf_outgoing(b, wo));
}

fn cosine_hemisphere(u: vec2f) -> vec3f {
    let sin_cos = sin_cos_turns(u.x);
    let r = sqrt(u.y);
    return vec3f(r * sin_cos.y, r * sin_cos.x, sqrt(max(1.0 - u.y, 0.0)));
}

// A direction to continue in; weight zero is absorption. (This function and those that sample a lobe
// return at one place: with several, drivers keep a result in registers from one ray to the next.)
fn bsdf_sample(b: Bsdf, wo: vec3f, u: vec3f) -> BsdfSample {
    var result = BsdfSample(vec3f(0.0), vec3f(0.0), 0.0, false);
    let out = bsdf_outgoing(b, wo);
    var any_probability = out.coat_probability + out.interface_probability + out.diffuse_probability;
//#if SHEEN
    any_probability += out.sheen_probability;
//#end
    var lobe = NO_SAMPLE;
    let choice = u.x - out.coat_probability;
    if any_probability <= 0.0 {
        lobe.kind = ABSORBED;
    } else if choice < 0.0 {
//#if CLEARCOAT
        lobe = coat_sample(b.coat, wo, u.yz, out.coat_probability);
//#end
    } else if choice < out.interface_probability {
        let within = min(choice / out.interface_probability, 0.99999988);
        lobe = interface_sample(b.interface_, wo, within, u.yz);
    } else {
        lobe = LobeSample(SPREAD, cosine_hemisphere(u.yz), vec3f(0.0));
//#if SHEEN
        let is_sheen = choice - out.interface_probability < out.sheen_probability;
        if is_sheen {
            lobe.wi = sheen_sample(u.yz);
        }
//#end
//#if DIFFUSE_TRANSMISSION
        var rest = choice - out.interface_probability;
//#if SHEEN
        rest = select(rest - out.sheen_probability, out.diffuse_probability, is_sheen);
//#end
        if rest / out.diffuse_probability < b.through {
            lobe.wi = -lobe.wi;
        }
//#end
    }
    if lobe.kind == SPREAD {
        let f = bsdf_eval_pdf_with(b, wo, lobe.wi, out);
        let weight = f.value / f.pdf_solid_angle;
        if f.pdf_solid_angle > 0.0 && is_finite3(weight) {
            result = BsdfSample(lobe.wi, weight, f.pdf_solid_angle, false);
        }
    } else if lobe.kind != ABSORBED {
        var weight = lobe.weight;
        if lobe.kind == DELTA {
            weight /= out.interface_probability;
//#if CLEARCOAT
            weight *= coat_attenuation(b.coat, wo) * coat_attenuation(b.coat, lobe.wi);
//#end
//#if SHEEN
            weight *= sheen_left(b.sheen, wo, lobe.wi);
//#end
        }
        if is_finite3(weight) {
            result = BsdfSample(lobe.wi, weight, 1.0, true);
        }
    }
    return result;
}

//#if TRANSMISSION
// Light that goes straight through: smooth thin-walled transmission.
fn bsdf_straight_transmittance(b: Bsdf, wo: vec3f) -> vec3f {
    var through = interface_straight_transmittance(b.interface_, abs(wo.z));
//#if CLEARCOAT
    let coat = coat_attenuation(b.coat, wo);
    through *= coat * coat;
//#end
//#if SHEEN
    through *= sheen_left(b.sheen, wo, wo);
//#end
    return through;
}
//#end

//#if ALBEDO
// Share of uniform light that reaches a viewer straight above.
fn bsdf_albedo(b: Bsdf) -> vec3f {
    let terms = terms_towards(b.interface_.ggx, b.roughness, vec3f(0.0, 0.0, 1.0));
    let let_in = 1.0 - dot(b.f0_f90, terms_mean(b.interface_.ggx, b.roughness));
    let up = vec3f(0.0, 0.0, 1.0);
    var body = b.diffuse_color;
//#if DIFFUSE_TRANSMISSION
    body += b.transmitted_color / radiance_scale(b.interface_);
//#end
    var albedo = body * (bsdf_diffuse_left(b, terms) * let_in)
        + interface_albedo(b.interface_, 1.0, terms);
//#if TRANSMISSION
    albedo += interface_straight_transmittance(b.interface_, 1.0);
//#end
//#if SHEEN
    albedo = albedo * sheen_left(b.sheen, up, SHEEN_TYPICAL)
        + b.sheen.color * sheen_albedo(b.sheen, up);
//#end
//#if CLEARCOAT
    let under = coat_attenuation(b.coat, up);
    albedo = coat_albedo(b.coat, up) + under * under * albedo;
//#end
    return saturate(albedo);
}
//#end
