// The share of an interface that refracts or passes light: twin of src/bsdf/interface.rs.

struct Glass {
    // In [0,1], with the F0 and F90 of its dielectric.
    share: f32,
    f0: vec3f,
    f90: f32,
    // Index on the far side over this side; of the hero channel if there is one.
    eta: f32,
    // Colour per crossing times the share.
    tint: vec3f,
    thin: bool,
    channels: Channels,
}

fn glass_new(p: SurfaceParameters, f0: vec3f, f90: f32, entering: bool) -> Glass {
    let share = (1.0 - p.metallic) * p.transmission;
    let eta = eta_of(p.ior, entering || p.thin);
    let tint = p.base_color * share;
    return Glass(share, f0, f90, eta, tint, p.thin, channels_new(p, eta, entering));
}

// Index on the far side over this side.
fn eta_of(index: f32, is_outside: bool) -> f32 {
    let ior = max(index, 1.0);
    if abs(ior - 1.0) < STRAIGHT_ETA {
        return 1.0;
    }
    return select(1.0 / ior, ior, is_outside);
}

fn glass_is_absent(glass: Glass) -> bool {
    return glass.share == 0.0;
}

fn glass_reflects_nothing(glass: Glass) -> bool {
    return all(glass.f0 == vec3f(0.0));
}

fn passes_straight(i: Interface) -> bool {
    return i.glass.share > 0.0 && i.glass.thin && is_smooth(i.ggx);
}

fn transmits_delta(i: Interface) -> bool {
    return is_smooth(i.ggx) || (!i.glass.thin && i.glass.eta == 1.0);
}

// A facet, given the reflectance of the opaque share.
fn facet_with_glass(i: Interface, cosine: f32, opaque_share: vec3f) -> Facet {
    if i.glass.share == 0.0 {
        return Facet(opaque_share, vec3f(0.0));
    }
    let glass = glass_of_channels(i, cosine);
    return Facet(opaque_share + i.glass.share * glass.xyz, i.glass.tint * glass.w);
}

// Reflectance of the glass, and what passes it, at a relative index.
fn glass_at(i: Interface, cosine: f32, eta: f32) -> vec4f {
    let exact = dielectric(cosine, eta);
    if exact == TOTAL_REFLECTION {
        return vec4f(1.0, 1.0, 1.0, 0.0);
    }
    let exact_f0 = normal_reflectance(eta);
    let weight = saturate((exact - exact_f0) / (1.0 - exact_f0));
    let bare = i.glass.f0 + (i.glass.f90 - i.glass.f0) * weight;
    let fresnel = film_over_glass(i.film, bare, cosine, eta, i.glass.f90);
    let most = max_element(fresnel);
    if i.glass.thin {
        return vec4f(2.0 * fresnel / (1.0 + fresnel), (1.0 - most) / (1.0 + most));
    }
    return vec4f(fresnel, 1.0 - most);
}

fn scattering_facets(i: Interface, cosine: f32, wo: vec3f) -> Facets {
    var facets: Facets;
    // A loop, for what it calls is long.
    let turns = select(1u, 2u, i.glass.share > 0.0 && transmits_delta(i));
    for (var turn = 0u; turn < turns; turn++) {
        facets.deciding = scattering_facet(i, select(wo.z, cosine, turn == 0u));
        if turn == 0u {
            facets.seen = facets.deciding;
        }
    }
    return facets;
}

// A direction on the far side, given what passes there over the probability of going there.
fn sample_through(i: Interface, wo: vec3f, h: vec3f, transmittance: vec3f) -> LobeSample {
    var result = NO_SAMPLE;
    if transmits_delta(i) {
        let eta = i.glass.eta;
        let wi = refracted(wo, vec3f(0.0, 0.0, 1.0), eta);
        if any(wi != vec3f(0.0)) {
            let radiance = transmittance * hero_weights(i.glass) / (eta * eta);
            result = LobeSample(DELTA, wi, radiance);
        }
    } else {
        var wi = reflected(wo, h) * vec3f(1.0, 1.0, -1.0);
        if !i.glass.thin {
            wi = refracted(wo, h, i.glass.eta);
        }
        result = LobeSample(select(ABSORBED, SPREAD, wi.z < 0.0), wi, vec3f(0.0));
    }
    return result;
}

// Whether what passes is spread as what is reflected, but to the far side.
fn passes_mirrored(i: Interface) -> bool {
    return i.glass.share > 0.0 && i.glass.thin && !transmits_delta(i);
}

fn eval_pdf_refracted(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    let none = EvalPdf(vec3f(0.0), 0.0);
    if i.glass.share == 0.0 || transmits_delta(i) {
        return none;
    }
    let eta = i.glass.eta;
    var h = normalize_or(wo + eta * wi, vec3f(0.0));
    h = select(h, -h, h.z < 0.0);
    let cos_o = dot(wo, h);
    let cos_i = dot(wi, h);
    if cos_o <= 0.0 || cos_i >= 0.0 {
        return none;
    }
    let facet = interface_facet(i, cos_o);
    let denominator = cos_o + eta * cos_i;
    let jacobian = -cos_i / (denominator * denominator);
    let visible = ggx_visible_normal_pdf_solid_angle(i.ggx, wo, h) * jacobian;
    let masking = 2.0 * -wi.z * ggx_visibility(i.ggx, -wi);
    let probability = 1.0 - facet_reflection_probability(facet);
    return EvalPdf(
        facet.transmittance * hero_weights(i.glass) * (visible * masking),
        visible * eta * eta * probability,
    );
}

// What the glass adds to the interface's albedo.
fn glass_albedo(i: Interface, cosine: f32) -> vec3f {
    if i.glass.share == 0.0 {
        return vec3f(0.0);
    }
    var glass = i;
    glass.f0 = vec3f(0.0);
    glass.f90 = 0.0;
    glass.film = film_over_glass_alone(i.film);
    let passing = scattering_facet(glass, cosine);
    return passing.reflectance + passing.transmittance;
}

// Twin of `Interface::radiance_scale`.
fn radiance_scale(i: Interface) -> vec3f {
    if i.glass.thin {
        return vec3f(1.0);
    }
    let etas = etas_of_channels(i.glass);
    return 1.0 / (etas * etas);
}
