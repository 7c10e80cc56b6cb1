// How light is scattered at a surface point: twin of src/bsdf/ (mod.rs, interface.rs, coat.rs,
// diffuse.rs, albedo.rs). Directions are unit, local to the shading frame, z on the viewer's side.

const STRAIGHT_ETA = 1e-3;
// Rows and columns of the table of directional albedos.
const ALBEDO_NODES = 32u;

struct Interface {
    f0: vec3f,
    f90: f32,
    ggx: Ggx,
//#if transmission
    glass: f32,
    glass_f90: f32,
    eta: f32,
    glass_f0: vec3f,
    thin: bool,
    tint: vec3f,
//#end
//#if dispersion
    etas: vec3f,
    hero: vec3f,
//#end
//#if iridescence
    film: Film,
    // What is under the film: F0 and share of the opaque dielectric and of the metal.
    base_f0: vec3f,
    dielectric_share: f32,
    metal_f0: vec3f,
    metal_share: f32,
//#end
}

struct Bsdf {
    interface_: Interface,
    // Lambert's lobe: base colour times share, over what the interface lets in on average.
    diffuse_color: vec3f,
//#if diffuse_transmission
    // The same for light from the far side, and the probability of choosing it.
    transmitted_color: vec3f,
    through: f32,
//#end
    // The dielectric's largest F0 and its F90.
    f0_f90: vec2f,
    roughness: f32,
//#if sheen
    sheen: Sheen,
//#end
//#if clearcoat
    coat: Coat,
//#end
}

struct Facet {
    reflectance: vec3f,
    transmittance: vec3f,
}

// What depends on `wo` alone. All probabilities are zero if nothing is scattered.
struct Outgoing {
    diffuse_left: f32,
    coat_probability: f32,
    interface_probability: f32,
    diffuse_probability: f32,
//#if sheen
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

// Terms of a row and a column, and of the row after it.
fn albedo_nodes(row: u32, column: u32) -> vec4f {
    return tables(ALBEDO_AT + row * (ALBEDO_NODES + 1u) + column);
}

// `AlbedoTerms::at`: (A, B) seen from a direction of this cosine.
fn albedo_terms_at(roughness: f32, cosine: f32) -> vec2f {
    let y = roughness * f32(ALBEDO_NODES - 1u);
    let row = min(u32(y), ALBEDO_NODES - 2u);
    let x = sqrt(saturate(cosine)) * f32(ALBEDO_NODES - 1u);
    let column = min(u32(x), ALBEDO_NODES - 2u);
    let terms = mix(albedo_nodes(row, column), albedo_nodes(row, column + 1u), x - f32(column));
    return mix(terms.xy, terms.zw, y - f32(row));
}

// `AlbedoTerms::mean`: the last column.
fn albedo_terms_mean(roughness: f32) -> vec2f {
    let y = roughness * f32(ALBEDO_NODES - 1u);
    let row = min(u32(y), ALBEDO_NODES - 2u);
    let terms = albedo_nodes(row, ALBEDO_NODES);
    return mix(terms.xy, terms.zw, y - f32(row));
}

//#if anisotropy
fn stretched_terms(ggx: Ggx, diagonal: vec2f, towards: vec2f) -> vec2f {
    let a = diagonal.x + 0.3 * (1.0 - ggx.alpha / ggx.along) * (1.0 - diagonal.x);
    return vec2f(min(a, 1.0 - towards.y), towards.y);
}
//#end

// `AlbedoTerms::at` and `AlbedoTerms::mean` of a GGX of this roughness across its axis.
fn terms_towards(ggx: Ggx, roughness: f32, v: vec3f) -> vec2f {
//#if anisotropy
    if is_stretched(ggx) {
        let diagonal = roughness_off_axis(ggx, 0.70710678, 0.70710678);
        let towards = albedo_terms_at(roughness_towards(ggx, v), v.z);
        return stretched_terms(ggx, albedo_terms_at(diagonal, v.z), towards);
    }
//#end
    return albedo_terms_at(roughness, v.z);
}

fn terms_mean(ggx: Ggx, roughness: f32) -> vec2f {
//#if anisotropy
    if is_stretched(ggx) {
        let diagonal = roughness_off_axis(ggx, 0.70710678, 0.70710678);
        let towards = albedo_terms_mean(roughness_off_axis(ggx, 0.92387953, 0.38268343))
            + albedo_terms_mean(roughness_off_axis(ggx, 0.38268343, 0.92387953));
        return stretched_terms(ggx, albedo_terms_mean(diagonal), 0.5 * towards);
    }
//#end
    return albedo_terms_mean(roughness);
}

fn interface_new(p: SurfaceParameters, f0: vec3f, f90: f32, entering: bool) -> Interface {
    var i: Interface;
//#if anisotropy
    i.ggx = ggx_stretched(p.roughness, p.anisotropy, p.anisotropy_axis);
//#else
    i.ggx = ggx_from_roughness(p.roughness);
//#end
    let opaque_share = (1.0 - p.metallic) * (1.0 - p.transmission);
    i.f0 = f0 * opaque_share + p.base_color * p.metallic;
    i.f90 = f90 * opaque_share + p.metallic;
//#if transmission
    i.glass = (1.0 - p.metallic) * p.transmission;
    i.glass_f0 = f0;
    i.glass_f90 = f90;
    i.tint = p.base_color * i.glass;
    i.thin = p.thin;
    i.eta = eta_of(p.ior, entering || p.thin);
//#end
//#if dispersion
    i.etas = vec3f(i.eta);
    i.hero = vec3f(1.0);
    if p.dispersion > 0.0 && p.ior > 0.0 {
        let spread = (p.ior - 1.0) * (0.025 * p.dispersion);
        i.etas.x = eta_of(p.ior - spread, entering || p.thin);
        i.etas.z = eta_of(p.ior + spread, entering || p.thin);
    }
//#end
//#if iridescence
    i.film = film_new(p);
    i.base_f0 = min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0));
    i.dielectric_share = p.specular * opaque_share;
    i.metal_f0 = p.base_color;
    i.metal_share = p.metallic;
//#end
    return i;
}

//#if transmission
// Index on the far side over this side.
fn eta_of(index: f32, is_outside: bool) -> f32 {
    let ior = max(index, 1.0);
    if abs(ior - 1.0) < STRAIGHT_ETA {
        return 1.0;
    }
    return select(1.0 / ior, ior, is_outside);
}
//#end

//#if dispersion
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

//#if iridescence
// Reflectance of the opaque share.
fn interface_opaque(i: Interface, cosine: f32) -> vec3f {
    let plain = i.f0 + (i.f90 - i.f0) * schlick_weight(cosine);
    if i.film.share == 0.0 {
        return plain;
    }
    var filmed = vec3f(0.0);
    if i.dielectric_share > 0.0 {
        filmed += film_reflectance(i.film, cosine, i.base_f0) * i.dielectric_share;
    }
    if i.metal_share > 0.0 {
        filmed += film_reflectance(i.film, cosine, i.metal_f0) * i.metal_share;
    }
    return mix(plain, filmed, i.film.share);
}
//#end

fn interface_is_absent(i: Interface) -> bool {
    var absent = i.f90 == 0.0 && all(i.f0 == vec3f(0.0));
//#if transmission
    absent = absent && i.glass == 0.0;
//#end
    return absent;
}

fn interface_is_delta_or_absent(i: Interface) -> bool {
    if is_smooth(i.ggx) || interface_is_absent(i) {
        return true;
    }
//#if transmission
    let reflects_nothing = i.f90 == 0.0 && all(i.f0 == vec3f(0.0)) && all(i.glass_f0 == vec3f(0.0));
    return transmits_delta(i) && reflects_nothing;
//#else
    return false;
//#end
}

// Reflectance and transmittance of a facet seen at this cosine.
fn interface_facet(i: Interface, cosine: f32) -> Facet {
//#if iridescence
    let opaque_share = interface_opaque(i, cosine);
//#else
    let opaque_share = i.f0 + (i.f90 - i.f0) * schlick_weight(cosine);
//#end
//#if transmission
    if i.glass > 0.0 {
        let glass = glass_at(i, cosine, i.eta);
        var reflected_share = glass.xyz;
//#if dispersion
        if is_dispersive(i) {
            reflected_share = vec3f(
                glass_at(i, cosine, i.etas.x).x,
                glass_at(i, cosine, i.etas.y).y,
                glass_at(i, cosine, i.etas.z).z,
            );
        }
//#end
        return Facet(opaque_share + i.glass * reflected_share, i.tint * glass.w);
    }
//#end
    return Facet(opaque_share, vec3f(0.0));
}

//#if transmission
// Reflectance of the transmissive share, and what passes it, at a relative index.
fn glass_at(i: Interface, cosine: f32, eta: f32) -> vec4f {
    let exact = dielectric(cosine, eta);
    if exact == TOTAL_REFLECTION {
        return vec4f(1.0, 1.0, 1.0, 0.0);
    }
    let exact_f0 = normal_reflectance(eta);
    let weight = saturate((exact - exact_f0) / (1.0 - exact_f0));
    var fresnel = i.glass_f0 + (i.glass_f90 - i.glass_f0) * weight;
//#if iridescence
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

//#if transmission
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
//#if transmission
    if passes_straight(i) {
        facet.transmittance = vec3f(0.0);
    }
//#end
    return facet;
}

// Probability of reflecting at a facet; delta refraction is chosen before the facet is.
fn reflection_probability(i: Interface, facet: Facet, wo: vec3f) -> f32 {
//#if transmission
    if i.glass > 0.0 && transmits_delta(i) {
        return facet_reflection_probability(scattering_facet(i, wo.z));
    }
//#end
    return facet_reflection_probability(facet);
}

fn interface_sample(i: Interface, wo: vec3f, choice: f32, u: vec2f) -> LobeSample {
    let smooth_ = is_smooth(i.ggx);
    var h = vec3f(0.0, 0.0, 1.0);
    if !smooth_ {
        h = ggx_sample_visible_normal(i.ggx, wo, u);
    }
    let facet = scattering_facet(i, dot(wo, h));
    let probability = reflection_probability(i, facet, wo);
    if choice < probability {
        let wi = reflected(wo, h);
        if smooth_ {
            return LobeSample(DELTA, wi, facet.reflectance / probability);
        }
        return LobeSample(select(ABSORBED, SPREAD, wi.z > 0.0), wi, vec3f(0.0));
    }
//#if transmission
    if transmits_delta(i) {
        let wi = refracted(wo, vec3f(0.0, 0.0, 1.0), i.eta);
        if all(wi == vec3f(0.0)) {
            return NO_SAMPLE;
        }
        var radiance = scattering_facet(i, wo.z).transmittance / (i.eta * i.eta);
//#if dispersion
        radiance *= i.hero;
//#end
        return LobeSample(DELTA, wi, radiance / (1.0 - probability));
    }
    var wi = reflected(wo, h) * vec3f(1.0, 1.0, -1.0);
    if !i.thin {
        wi = refracted(wo, h, i.eta);
    }
    return LobeSample(select(ABSORBED, SPREAD, wi.z < 0.0), wi, vec3f(0.0));
//#else
    return NO_SAMPLE;
//#end
}

fn interface_eval_pdf(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    if is_smooth(i.ggx) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    if wi.z > 0.0 {
        return eval_pdf_mirrored(i, wo, wi, true);
    }
//#if transmission
    if i.glass == 0.0 || transmits_delta(i) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    if i.thin {
        return eval_pdf_mirrored(i, wo, wi * vec3f(1.0, 1.0, -1.0), false);
    }
    return eval_pdf_refracted(i, wo, wi);
//#else
    return EvalPdf(vec3f(0.0), 0.0);
//#end
}

fn eval_pdf_mirrored(i: Interface, wo: vec3f, wi: vec3f, is_reflected: bool) -> EvalPdf {
    let h = normalize_or(wo + wi, vec3f(0.0));
    if all(h == vec3f(0.0)) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let facet = interface_facet(i, dot(wo, h));
    let reflects = reflection_probability(i, facet, wo);
    let color = select(facet.transmittance, facet.reflectance, is_reflected);
    let probability = select(1.0 - reflects, reflects, is_reflected);
    let visible = ggx_distribution(i.ggx, h) * ggx_visibility(i.ggx, wo);
    return EvalPdf(
        color * (visible * ggx_visibility(i.ggx, wi) * wi.z),
        0.5 * visible * probability,
    );
}

//#if transmission
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
//#if dispersion
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
//#if iridescence
    if i.film.share > 0.0 {
        albedo = interface_opaque(i, cosine) * (terms.x + terms.y);
    }
//#end
//#if transmission
    if i.glass > 0.0 {
        var glass = i;
        glass.f0 = vec3f(0.0);
        glass.f90 = 0.0;
//#if iridescence
        glass.dielectric_share = 0.0;
        glass.metal_share = 0.0;
//#end
        let passing = scattering_facet(glass, cosine);
        albedo += passing.reflectance + passing.transmittance;
    }
//#end
    return albedo;
}

//#if clearcoat
const COAT_F0 = 0.04;

struct Coat {
    strength: f32,
    ggx: Ggx,
    frame: Frame,
    thin: bool,
    entering: bool,
}

fn coat_new(p: SurfaceParameters, entering: bool) -> Coat {
    return Coat(
        p.clearcoat,
        ggx_from_roughness(p.clearcoat_roughness),
        frame_from_z(p.clearcoat_normal),
        p.thin,
        entering,
    );
}

fn coat_is_outside(coat: Coat, z: f32) -> bool {
    return coat.thin || (z > 0.0) == coat.entering;
}

fn coat_fresnel(cosine: f32) -> f32 {
    return COAT_F0 + (1.0 - COAT_F0) * schlick_weight(cosine);
}

fn coat_is_delta_or_absent(coat: Coat) -> bool {
    return coat.strength == 0.0 || !coat_is_outside(coat, 1.0) || is_smooth(coat.ggx);
}

fn coat_attenuation(coat: Coat, v: vec3f) -> f32 {
    if coat.strength == 0.0 || !coat_is_outside(coat, v.z) {
        return 1.0;
    }
    return 1.0 - coat.strength * coat_fresnel(abs(dot(v, coat.frame.z)));
}

fn coat_albedo(coat: Coat, wo: vec3f) -> f32 {
    let cosine = dot(wo, coat.frame.z);
    let reflects = coat_is_outside(coat, wo.z) && cosine > 0.0;
    return select(0.0, coat.strength * coat_fresnel(cosine), reflects);
}

fn coat_sample(coat: Coat, wo: vec3f, u: vec2f, probability: f32) -> LobeSample {
    let local = local_from_world(coat.frame, wo);
    let smooth_ = is_smooth(coat.ggx);
    var h = vec3f(0.0, 0.0, 1.0);
    if !smooth_ {
        h = ggx_sample_visible_normal(coat.ggx, local, u);
    }
    let local_wi = reflected(local, h);
    let wi = world_from_local(coat.frame, local_wi);
    if local_wi.z <= 0.0 || wi.z <= 0.0 {
        return NO_SAMPLE;
    }
    if smooth_ {
        let weight = vec3f(coat.strength * coat_fresnel(local.z) / probability);
        return LobeSample(COAT_DELTA, wi, weight);
    }
    return LobeSample(SPREAD, wi, vec3f(0.0));
}

fn coat_eval_pdf(coat: Coat, wo: vec3f, wi: vec3f) -> vec2f {
    let o = local_from_world(coat.frame, wo);
    let i = local_from_world(coat.frame, wi);
    if is_smooth(coat.ggx) || wi.z <= 0.0 || o.z <= 0.0 || i.z <= 0.0 {
        return vec2f(0.0);
    }
    let h = normalize(o + i);
    let visible = ggx_distribution(coat.ggx, h) * ggx_visibility(coat.ggx, o);
    let value = coat.strength * coat_fresnel(dot(o, h)) * visible
        * ggx_visibility(coat.ggx, i) * i.z;
    return vec2f(value, 0.5 * visible);
}
//#end

fn has_diffuse(b: Bsdf) -> bool {
//#if diffuse_transmission
    return any(b.diffuse_color != vec3f(0.0)) || any(b.transmitted_color != vec3f(0.0));
//#else
    return any(b.diffuse_color != vec3f(0.0));
//#end
}

// Both of Lambert's lobes.
fn diffuse_sum(b: Bsdf) -> vec3f {
//#if diffuse_transmission
    return b.diffuse_color + b.transmitted_color;
//#else
    return b.diffuse_color;
//#end
}

//#if diffuse_transmission
// Twin of `Interface::radiance_scale`.
fn radiance_scale(i: Interface) -> vec3f {
//#if transmission
    if !i.thin {
//#if dispersion
        return 1.0 / (i.etas * i.etas);
//#else
        return vec3f(1.0 / (i.eta * i.eta));
//#end
    }
//#end
    return vec3f(1.0);
}
//#end

fn bsdf_new(p: SurfaceParameters, entering: bool) -> Bsdf {
    let f90 = p.specular;
    let f0 = min(normal_reflectance(p.ior) * p.specular_color, vec3f(1.0)) * p.specular;
    var b: Bsdf;
    b.f0_f90 = vec2f(max_element(f0), f90);
    b.roughness = p.roughness;
    b.interface_ = interface_new(p, f0, f90, entering);
//#if iridescence
    let film = b.interface_.film;
    if film.share > 0.0 && b.interface_.dielectric_share > 0.0 {
        let most = film_largest_f0(film, b.interface_.base_f0, p.specular);
        b.f0_f90.x = max(b.f0_f90.x, most);
    }
//#end
    b.diffuse_color = p.base_color * ((1.0 - p.metallic) * (1.0 - p.transmission));
//#if diffuse_transmission
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
//#if diffuse_transmission
        b.transmitted_color = select(vec3f(0.0), b.transmitted_color / let_in, let_in > 1e-4);
//#end
    }
//#if sheen
    b.sheen = sheen_new(p, entering);
//#end
//#if clearcoat
    b.coat = coat_new(p, entering);
//#end
    return b;
}

fn bsdf_is_delta_only(b: Bsdf) -> bool {
    var delta = !has_diffuse(b) && interface_is_delta_or_absent(b.interface_);
//#if sheen
    delta = delta && sheen_is_hidden(b.sheen);
//#end
//#if clearcoat
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
//#if clearcoat
    bare = b.coat.strength == 0.0;
//#end
//#if sheen
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
//#if sheen
    let base = sheen_left(b.sheen, wo, wo);
    interface_albedo_ *= base;
    diffuse *= base;
    var sheen = importance(b.sheen.color) * sheen_albedo(b.sheen, wo);
//#end
//#if clearcoat
    let under = coat_attenuation(b.coat, wo);
    interface_albedo_ *= under;
    diffuse *= under;
//#if sheen
    sheen *= under;
//#end
    coat = coat_albedo(b.coat, wo);
//#end
    var sum = coat + interface_albedo_ + diffuse;
//#if sheen
    sum += sheen;
//#end
    if !(sum > 0.0) {
        return out;
    }
    out.diffuse_left = diffuse_left;
    out.coat_probability = coat / sum;
    out.interface_probability = interface_albedo_ / sum;
    out.diffuse_probability = diffuse / sum;
//#if sheen
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
//#if diffuse_transmission
        result.pdf_solid_angle += out.diffuse_probability * lambert * (1.0 - b.through);
//#else
        result.pdf_solid_angle += out.diffuse_probability * lambert;
//#end
    }
//#if diffuse_transmission
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
//#if sheen
    if b.sheen.strength > 0.0 {
        result.value *= sheen_left(b.sheen, wo, wi);
        if out.sheen_probability > 0.0 {
            let lobe = sheen_eval_pdf(b.sheen, wo, wi);
            result.value += lobe.value;
            result.pdf_solid_angle += out.sheen_probability * lobe.pdf_solid_angle;
        }
    }
//#end
//#if clearcoat
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

// A direction to continue in; weight zero is absorption.
fn bsdf_sample(b: Bsdf, wo: vec3f, u: vec3f) -> BsdfSample {
    let none = BsdfSample(vec3f(0.0), vec3f(0.0), 0.0, false);
    let out = bsdf_outgoing(b, wo);
    var any_probability = out.coat_probability + out.interface_probability + out.diffuse_probability;
//#if sheen
    any_probability += out.sheen_probability;
//#end
    if any_probability <= 0.0 {
        return none;
    }
    var lobe: LobeSample;
    let choice = u.x - out.coat_probability;
    if choice < 0.0 {
//#if clearcoat
        lobe = coat_sample(b.coat, wo, u.yz, out.coat_probability);
//#end
    } else if choice < out.interface_probability {
        let within = min(choice / out.interface_probability, 0.99999988);
        lobe = interface_sample(b.interface_, wo, within, u.yz);
    } else {
        lobe = LobeSample(SPREAD, cosine_hemisphere(u.yz), vec3f(0.0));
//#if sheen
        let is_sheen = choice - out.interface_probability < out.sheen_probability;
        if is_sheen {
            lobe.wi = sheen_sample(u.yz);
        }
//#end
//#if diffuse_transmission
        var rest = choice - out.interface_probability;
//#if sheen
        rest = select(rest - out.sheen_probability, out.diffuse_probability, is_sheen);
//#end
        if rest / out.diffuse_probability < b.through {
            lobe.wi = -lobe.wi;
        }
//#end
    }
    if lobe.kind == ABSORBED {
        return none;
    }
    if lobe.kind == SPREAD {
        let f = bsdf_eval_pdf_with(b, wo, lobe.wi, out);
        let weight = f.value / f.pdf_solid_angle;
        if !(f.pdf_solid_angle > 0.0) || !is_finite3(weight) {
            return none;
        }
        return BsdfSample(lobe.wi, weight, f.pdf_solid_angle, false);
    }
    var weight = lobe.weight;
    if lobe.kind == DELTA {
        weight /= out.interface_probability;
//#if clearcoat
        weight *= coat_attenuation(b.coat, wo) * coat_attenuation(b.coat, lobe.wi);
//#end
//#if sheen
        weight *= sheen_left(b.sheen, wo, lobe.wi);
//#end
    }
    if !is_finite3(weight) {
        return none;
    }
    return BsdfSample(lobe.wi, weight, 1.0, true);
}

//#if transmission
// Light that goes straight through: smooth thin-walled transmission.
fn bsdf_straight_transmittance(b: Bsdf, wo: vec3f) -> vec3f {
    var through = interface_straight_transmittance(b.interface_, abs(wo.z));
//#if clearcoat
    let coat = coat_attenuation(b.coat, wo);
    through *= coat * coat;
//#end
//#if sheen
    through *= sheen_left(b.sheen, wo, wo);
//#end
    return through;
}
//#end

//#if layers
// Share of uniform light that reaches a viewer straight above, for guide layers.
fn bsdf_albedo(b: Bsdf) -> vec3f {
    let terms = terms_towards(b.interface_.ggx, b.roughness, vec3f(0.0, 0.0, 1.0));
    let let_in = 1.0 - dot(b.f0_f90, terms_mean(b.interface_.ggx, b.roughness));
    let up = vec3f(0.0, 0.0, 1.0);
    var body = b.diffuse_color;
//#if diffuse_transmission
    body += b.transmitted_color / radiance_scale(b.interface_);
//#end
    var albedo = body * (bsdf_diffuse_left(b, terms) * let_in)
        + interface_albedo(b.interface_, 1.0, terms);
//#if transmission
    albedo += interface_straight_transmittance(b.interface_, 1.0);
//#end
//#if sheen
    albedo = albedo * sheen_left(b.sheen, up, SHEEN_TYPICAL)
        + b.sheen.color * sheen_albedo(b.sheen, up);
//#end
//#if clearcoat
    let under = coat_attenuation(b.coat, up);
    albedo = coat_albedo(b.coat, up) + under * under * albedo;
//#end
    return saturate(albedo);
}
//#end
