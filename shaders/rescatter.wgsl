// Light that rough metal and glass scatter more than once: twin of src/bsdf/rescatter.rs.

struct Rescatter {
    // Share of the lost light that leaves on this side, by colour.
    reflected: vec3f,
    // Across the axis of the interface.
    roughness: f32,
    // One over the mean of what is lost on this side.
    inverse_mean: f32,
//#if SPREADING_GLASS
    // Index of refraction of a solid's far side over this side, of the green channel; 0 where this
    // side's losses are those of a mirror.
    eta: f32,
    // The same on the far side.
    inverse_mean_far: f32,
    transmitted: vec3f,
    // Probability of choosing the far side.
    through: f32,
//#end
}

fn rescatter_new(p: SurfaceParameters, i: Interface) -> Rescatter {
    var r: Rescatter;
    r.roughness = p.roughness;
    if is_smooth(i.ggx) {
        return r;
    }
    if p.metallic > 0.0 || p.ior == 0.0 {
        let terms = terms_mean(i.ggx, p.roughness);
        r.inverse_mean = 1.0 / max(1.0 - (terms.x + terms.y), RESCATTER_MIN_LOSS);
        r.reflected = metals_color(p, terms);
    }
//#if SPREADING_GLASS
    if i.glass.share > 0.0 && !transmits_delta(i) {
        let share = (1.0 - p.metallic) * p.transmission;
        r.eta = select(i.glass.eta, 0.0, i.glass.thin);
        r.inverse_mean = 1.0 / mean_loss(r, i, false);
        r.inverse_mean_far = 1.0 / mean_loss(r, i, true);
        if i.glass.thin {
            let normal = glass_at(i, 1.0, i.glass.eta);
            r.reflected += share * normal.xyz;
            r.transmitted = p.base_color * (share * normal.w);
        } else {
            let squared_index = i.glass.eta * i.glass.eta;
            let a = 1.0 / r.inverse_mean;
            let b = squared_index / r.inverse_mean_far;
            let part = share * p.specular / (a + b);
            r.reflected += vec3f(a * part);
            r.transmitted = p.base_color * (b * part / squared_index);
        }
    }
    let through = importance(r.transmitted);
    r.through = select(0.0, through / (importance(r.reflected) + through), through > 0.0);
//#end
    return r;
}

// What leaves of light that is scattered twice or more by metal, and by a dielectric of infinite
// index.
fn metals_color(p: SurfaceParameters, mean: vec2f) -> vec3f {
    var color = metal_color(p.base_color, mean) * p.metallic;
    if p.ior == 0.0 {
        let opaque = (1.0 - p.metallic) * (1.0 - p.transmission);
        let share = p.specular * opaque * (1.0 - p.base_color);
        color += metal_color(min(p.specular_color, vec3f(1.0)), mean) * share;
    }
    return color;
}

// What leaves of light that a metal scatters twice or more.
fn metal_color(f0: vec3f, mean: vec2f) -> vec3f {
    let escapes = mean.x + mean.y;
    let fresnel = f0 + (1.0 - f0) * (1.0 / 21.0);
    return fresnel * fresnel * escapes / (1.0 - fresnel * (1.0 - escapes));
}

fn rescatter_is_absent(r: Rescatter) -> bool {
    return all(rescatter_sum(r) == vec3f(0.0));
}

// What single scattering loses towards `wo`, above the surface.
fn rescatter_lost(r: Rescatter, i: Interface, wo: vec3f) -> f32 {
    return loss_at(r, i, wo, false);
}

fn rescatter_sum(r: Rescatter) -> vec3f {
//#if SPREADING_GLASS
    return r.reflected + r.transmitted;
//#else
    return r.reflected;
//#end
}

// Of light that is lost.
fn rescatter_albedo(r: Rescatter, i: Interface) -> vec3f {
//#if SPREADING_GLASS
    return r.reflected + r.transmitted / radiance_scale(i);
//#else
    return r.reflected;
//#end
}

fn rescatter_sample(r: Rescatter, choice: f32, u: vec2f) -> vec3f {
    let wi = cosine_hemisphere(u);
//#if SPREADING_GLASS
    return select(wi, -wi, choice < r.through);
//#else
    return wi;
//#end
}

fn rescatter_eval_pdf(r: Rescatter, i: Interface, lost: f32, wi: vec3f) -> EvalPdf {
    let is_near = wi.z > 0.0;
    let lambert = abs(wi.z) * FRAC_1_PI;
    var color = r.reflected;
    var inverse_mean = r.inverse_mean;
    var probability = select(0.0, 1.0, is_near);
//#if SPREADING_GLASS
    color = select(r.transmitted, r.reflected, is_near);
    inverse_mean = select(r.inverse_mean_far, r.inverse_mean, is_near);
    probability = select(r.through, 1.0 - r.through, is_near);
//#end
    if probability <= 0.0 {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let loss = loss_at(r, i, select(-wi, wi, is_near), !is_near);
    return EvalPdf(color * (lost * loss * inverse_mean * lambert), lambert * probability);
}

// What single scattering loses towards `v`, above the surface or on its far side.
fn loss_at(r: Rescatter, i: Interface, v: vec3f, is_far: bool) -> f32 {
//#if SPREADING_GLASS
    if r.eta > 0.0 {
        var across = sqrt(i.ggx.alpha);
//#if ANISOTROPY
        if is_stretched(i.ggx) {
            across = roughness_towards(i.ggx, v);
        }
//#end
        let column = sqrt(saturate(v.z)) * f32(RESCATTER_NODES - 1u);
        return glass_loss_at(index_towards(r, is_far), across, column);
    }
//#end
    let terms = terms_towards(i.ggx, r.roughness, v);
    return max(1.0 - (terms.x + terms.y), 0.0);
}

//#if SPREADING_GLASS
fn index_towards(r: Rescatter, is_far: bool) -> f32 {
    return select(r.eta, 1.0 / r.eta, is_far);
}

fn mean_loss(r: Rescatter, i: Interface, is_far: bool) -> f32 {
    if r.eta == 0.0 {
        let terms = terms_mean(i.ggx, r.roughness);
        return max(1.0 - (terms.x + terms.y), RESCATTER_MIN_LOSS);
    }
    var across = sqrt(i.ggx.alpha);
//#if ANISOTROPY
    across = roughness_off_axis(i.ggx, 0.70710678, 0.70710678);
//#end
    let mean = glass_loss_at(index_towards(r, is_far), across, f32(RESCATTER_NODES));
    return max(mean, RESCATTER_MIN_LOSS);
}

// Twin of `glass_loss_at` in src/bsdf/rescatter.rs.
fn glass_loss_at(eta: f32, roughness: f32, column: f32) -> f32 {
    let shifted = clamp((eta - 1.0) / (eta + 1.0), -RESCATTER_INDEX, RESCATTER_INDEX);
    let z = (shifted + RESCATTER_INDEX) * (f32(RESCATTER_INDICES - 1u) / (2.0 * RESCATTER_INDEX));
    let index = min(u32(z), RESCATTER_INDICES - 2u);
    let y = roughness * f32(RESCATTER_NODES - 1u);
    let row = min(u32(y), RESCATTER_NODES - 2u);
    let at = min(u32(column), RESCATTER_NODES);
    let rest = column - f32(at);
    let start = RESCATTER_AT + (index * (RESCATTER_NODES - 1u) + row) * (RESCATTER_NODES + 1u);
    let here = tables(start + at);
    let nodes = mix(here, tables(start + min(at + 1u, RESCATTER_NODES)), rest);
    let rows = mix(nodes.xz, nodes.yw, y - f32(row));
    return mix(rows.x, rows.y, z - f32(index));
}
//#end
