// How light is scattered at a surface point: twin of src/bsdf/mod.rs. Directions are unit, local to the
// shading frame, z on the viewer's side.

struct Bsdf {
    interface_: Interface,
    diffuse: Diffuse,
    // The dielectric's largest F0 and its F90.
    f0_f90: vec2f,
    roughness: f32,
    rescatter: Rescatter,
    sheen: Sheen,
    coat: Coat,
//#if SPLIT_LOBES
    // Of the coat, of the interface with what its microfacets scatter more than once, and of the other lobes.
    weights: vec3f,
//#end
}

// What depends on `wo` alone. All probabilities are zero if nothing is scattered.
struct Outgoing {
    diffuse_left: f32,
    // What the interface's single scattering loses.
    lost: f32,
    coat_probability: f32,
    interface_probability: f32,
    sheen_probability: f32,
    rescatter_probability: f32,
    diffuse_probability: f32,
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

fn bsdf_new(p: SurfaceParameters, entering: bool) -> Bsdf {
    let f90 = p.specular;
    let f0 = min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0)) * p.specular;
    var b: Bsdf;
    b.roughness = p.roughness;
    b.interface_ = interface_new(p, f0, f90, entering);
    b.f0_f90 = vec2f(interface_largest_f0(b.interface_, p, f0), f90);
    b.diffuse = diffuse_new(p, b.interface_);
    if f90 > 0.0 && !diffuse_is_absent(b.diffuse) {
        b.diffuse = diffuse_let_in(b.diffuse, bsdf_let_in(b));
    }
    b.rescatter = rescatter_new(p, b.interface_);
    b.sheen = sheen_new(p, entering);
    b.coat = coat_new(p, entering);
//#if SPLIT_LOBES
    b.weights = vec3f(1.0);
//#end
    return b;
}

fn bsdf_is_delta_only(b: Bsdf) -> bool {
//#if SPLIT_LOBES
    let is_perfect = interface_is_delta_or_absent(b.interface_) && rescatter_is_absent(b.rescatter);
    return (b.weights.z == 0.0 || (diffuse_is_absent(b.diffuse) && sheen_is_hidden(b.sheen)))
        && (b.weights.y == 0.0 || is_perfect)
        && (b.weights.x == 0.0 || coat_is_delta_or_absent(b.coat));
//#else
    return diffuse_is_absent(b.diffuse) && rescatter_is_absent(b.rescatter)
        && interface_is_delta_or_absent(b.interface_) && sheen_is_hidden(b.sheen) && coat_is_delta_or_absent(b.coat);
//#end
}

// What the interface lets in on average.
fn bsdf_let_in(b: Bsdf) -> f32 {
    return 1.0 - dot(b.f0_f90, terms_mean(b.interface_.ggx, b.roughness));
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

fn rescatter_lost_or_none(b: Bsdf, v: vec3f) -> f32 {
    if rescatter_is_absent(b.rescatter) {
        return 0.0;
    }
    return rescatter_lost(b.rescatter, b.interface_, v);
}

// What coat and sheen leave of the base's light between two directions.
fn bsdf_left_by_layers(b: Bsdf, wo: vec3f, wi: vec3f) -> f32 {
    return coat_attenuation(b.coat, wo) * coat_attenuation(b.coat, wi)
        * sheen_left(b.sheen, wo, wi);
}

fn bsdf_outgoing(b: Bsdf, wo: vec3f) -> Outgoing {
    var out: Outgoing;
    if !(wo.z > 0.0) {
        return out;
    }
    let has_diffuse = !diffuse_is_absent(b.diffuse);
    let has_interface = !interface_is_absent(b.interface_);
    let has_one_lobe = coat_is_absent(b.coat) && sheen_is_absent(b.sheen)
        && rescatter_is_absent(b.rescatter) && !(has_diffuse && has_interface);
    if has_one_lobe {
        out.diffuse_left = 1.0;
        out.interface_probability = select(0.0, 1.0, has_interface);
        out.diffuse_probability = select(0.0, 1.0, has_diffuse);
        return out;
    }
    let terms = terms_towards(b.interface_.ggx, b.roughness, wo);
    let diffuse_left = bsdf_diffuse_left(b, terms);
    let under = coat_attenuation(b.coat, wo);
    let base = under * sheen_left(b.sheen, wo, wo);
    var coat = coat_albedo(b.coat, wo);
    var interface_share = base * importance(interface_albedo(b.interface_, wo.z, terms));
    var sheen = under * importance(sheen_colored_albedo(b.sheen, wo));
    var diffuse = base * diffuse_left * importance(diffuse_sum(b.diffuse));
    out.lost = rescatter_lost_or_none(b, wo);
    var rescatter = base * importance(rescatter_sum(b.rescatter)) * out.lost;
//#if SPLIT_LOBES
    coat *= b.weights.x;
    interface_share *= b.weights.y;
    sheen *= b.weights.z;
    diffuse *= b.weights.z;
    rescatter *= b.weights.y;
//#end
    let sum = coat + interface_share + sheen + rescatter + diffuse;
    if !(sum > 0.0) {
        return out;
    }
    out.diffuse_left = diffuse_left;
    out.coat_probability = coat / sum;
    out.interface_probability = interface_share / sum;
    out.sheen_probability = sheen / sum;
    out.rescatter_probability = rescatter / sum;
    out.diffuse_probability = diffuse / sum;
    return out;
}

fn bsdf_eval_pdf_with(b: Bsdf, wo: vec3f, wi: vec3f, out: Outgoing) -> EvalPdf {
    var result = EvalPdf(vec3f(0.0), 0.0);
    if out.diffuse_probability > 0.0 && diffuse_is_seen(b.diffuse, wi) {
        let left = out.diffuse_left * bsdf_diffuse_left_at(b, select(-wi, wi, wi.z > 0.0));
        let lobe = diffuse_eval_pdf(b.diffuse, left, wi);
        result.value += lobe.value;
        result.pdf_solid_angle += out.diffuse_probability * lobe.pdf_solid_angle;
    }
    if out.interface_probability > 0.0 {
        let lobe = interface_eval_pdf(b.interface_, wo, wi);
        result.value += lobe.value;
        result.pdf_solid_angle += out.interface_probability * lobe.pdf_solid_angle;
    }
    if !rescatter_is_absent(b.rescatter) && out.rescatter_probability > 0.0 {
        let lobe = rescatter_eval_pdf(b.rescatter, b.interface_, out.lost, wi);
        result.value += lobe.value;
        result.pdf_solid_angle += out.rescatter_probability * lobe.pdf_solid_angle;
    }
    if !sheen_is_absent(b.sheen) {
        result.value *= sheen_left(b.sheen, wo, wi);
        if out.sheen_probability > 0.0 {
            let lobe = sheen_eval_pdf(b.sheen, wo, wi);
            result.value += lobe.value;
            result.pdf_solid_angle += out.sheen_probability * lobe.pdf_solid_angle;
        }
    }
    if !coat_is_absent(b.coat) {
        result.value *= coat_attenuation(b.coat, wo) * coat_attenuation(b.coat, wi);
        if out.coat_probability > 0.0 {
            let coat = coat_eval_pdf(b.coat, wo, wi);
            result.value += vec3f(coat.x);
            result.pdf_solid_angle += out.coat_probability * coat.y;
        }
    }
//#if SPLIT_LOBES
    result.value *= max_element(b.weights);
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
    let any_probability = out.coat_probability + out.interface_probability
        + out.sheen_probability + out.rescatter_probability + out.diffuse_probability;
    var lobe = NO_SAMPLE;
    let choice = u.x - out.coat_probability;
    if any_probability <= 0.0 {
        lobe.kind = ABSORBED;
    } else if choice < 0.0 {
        lobe = coat_sample(b.coat, wo, u.yz, out.coat_probability);
    } else if choice < out.interface_probability {
        let within = min(choice / out.interface_probability, 0.99999988);
        lobe = interface_sample(b.interface_, wo, within, u.yz);
    } else {
        let rest = choice - out.interface_probability;
        if !sheen_is_absent(b.sheen) && rest < out.sheen_probability {
            lobe = LobeSample(SPREAD, sheen_sample(u.yz), vec3f(0.0));
        } else {
            let of_two = rest - out.sheen_probability;
            if !rescatter_is_absent(b.rescatter) && of_two < out.rescatter_probability {
                let within = of_two / out.rescatter_probability;
                let wi = rescatter_sample(b.rescatter, within, u.yz);
                lobe = LobeSample(SPREAD, wi, vec3f(0.0));
            } else {
                let within = (of_two - out.rescatter_probability) / out.diffuse_probability;
                lobe = LobeSample(SPREAD, diffuse_sample(b.diffuse, within, u.yz), vec3f(0.0));
            }
        }
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
            weight *= bsdf_left_by_layers(b, wo, lobe.wi) / out.interface_probability;
        }
//#if SPLIT_LOBES
        weight *= max_element(b.weights);
//#end
        if is_finite3(weight) {
            result = BsdfSample(lobe.wi, weight, 1.0, true);
        }
    }
    return result;
}

// Light that goes straight through: smooth thin-walled transmission.
fn bsdf_straight_transmittance(b: Bsdf, wo: vec3f) -> vec3f {
    let coat = coat_attenuation(b.coat, wo);
    let left = coat * coat * sheen_left(b.sheen, wo, wo);
    return interface_straight_transmittance(b.interface_, abs(wo.z)) * left;
}

// Share of uniform light that reaches a viewer straight above.
fn bsdf_albedo(b: Bsdf) -> vec3f {
    let up = vec3f(0.0, 0.0, 1.0);
    let terms = terms_towards(b.interface_.ggx, b.roughness, up);
    var diffuse = diffuse_albedo(b.diffuse, b.interface_)
        * (bsdf_diffuse_left(b, terms) * bsdf_let_in(b));
    var interface_share = interface_albedo(b.interface_, 1.0, terms)
        + interface_straight_transmittance(b.interface_, 1.0);
    var rescattered = rescatter_albedo(b.rescatter, b.interface_) * rescatter_lost_or_none(b, up);
    var sheen = sheen_colored_albedo(b.sheen, up);
    var coat = coat_albedo(b.coat, up);
    var most = 1.0;
//#if SPLIT_LOBES
    coat *= b.weights.x;
    interface_share *= b.weights.y;
    diffuse *= b.weights.z;
    rescattered *= b.weights.y;
    sheen *= b.weights.z;
    most = max_element(b.weights);
//#end
    let base = (diffuse + interface_share + rescattered) * sheen_left(b.sheen, up, SHEEN_TYPICAL);
    let under = coat_attenuation(b.coat, up);
    return clamp(coat + under * under * (sheen + base), vec3f(0.0), vec3f(most));
}
