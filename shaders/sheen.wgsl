// Light that upright fibres scatter back at grazing angles: twin of src/bsdf/sheen.rs.

const UNIFORM_HEMISPHERE = 0.15915494;

struct Sheen {
    color: vec3f,
    strength: f32,
    roughness: f32,
    thin: bool,
    entering: bool,
    // Of the microfacets: 1 / alpha, and the terms a, b, c, d of the fit of lambda; e.
    inverse_alpha: f32,
    fit: vec4f,
    fit_last: f32,
}

fn sheen_new(p: SurfaceParameters, entering: bool) -> Sheen {
    let base = max(p.sheen_roughness, MIN_SHEEN_ROUGHNESS);
    let alpha = base * base;
    let t = (1.0 - alpha) * (1.0 - alpha);
    let rough = vec4f(21.5473, 3.82987, 0.19823, -1.97760);
    let smooth_ = vec4f(25.3245, 3.32435, 0.16801, -1.27393);
    return Sheen(
        p.sheen_color,
        max_element(p.sheen_color),
        p.sheen_roughness,
        p.thin,
        entering,
        1.0 / alpha,
        rough + (smooth_ - rough) * t,
        -4.32054 + (-4.85967 + 4.32054) * t,
    );
}

fn sheen_is_absent(sheen: Sheen) -> bool {
    return sheen.strength == 0.0;
}

fn sheen_is_outside(sheen: Sheen, z: f32) -> bool {
    return sheen.thin || (z > 0.0) == sheen.entering;
}

fn sheen_is_hidden(sheen: Sheen) -> bool {
    return sheen.strength == 0.0 || !sheen_is_outside(sheen, 1.0);
}

// Twin of `Sheen::gain`.
fn sheen_gain(sheen: Sheen, cosine: f32) -> f32 {
    let y = sheen.roughness * f32(SHEEN_NODES - 1u);
    let row = min(u32(y), SHEEN_NODES - 2u);
    let x = sqrt(saturate(cosine)) * f32(SHEEN_NODES - 1u);
    let column = min(u32(x), SHEEN_NODES - 2u);
    let at = SHEEN_AT + row * SHEEN_NODES + column;
    let rows = mix(tables(at).xy, tables(at + 1u).xy, x - f32(column));
    return mix(rows.x, rows.y, y - f32(row));
}

fn sheen_albedo(sheen: Sheen, v: vec3f) -> f32 {
    if !sheen_is_outside(sheen, v.z) {
        return 0.0;
    }
    return min(sheen_gain(sheen, abs(v.z)), 1.0);
}

fn sheen_colored_albedo(sheen: Sheen, v: vec3f) -> vec3f {
    return sheen.color * sheen_albedo(sheen, v);
}

// What of a base's light is left between two directions.
fn sheen_left(sheen: Sheen, wo: vec3f, wi: vec3f) -> f32 {
    if sheen.strength == 0.0 {
        return 1.0;
    }
    return 1.0 - sheen.strength * max(sheen_albedo(sheen, wo), sheen_albedo(sheen, wi));
}

fn sheen_sample(u: vec2f) -> vec3f {
    let sin_cos = sin_cos_turns(u.x);
    let r = sqrt(max(1.0 - u.y * u.y, 0.0));
    return vec3f(r * sin_cos.y, r * sin_cos.x, u.y);
}

fn sheen_distribution(sheen: Sheen, h: vec3f) -> f32 {
    let sin2 = max(h.x * h.x + h.y * h.y, 1e-30);
    return (2.0 + sheen.inverse_alpha) * pow(sin2, 0.5 * sheen.inverse_alpha) / TAU;
}

fn lambda_exponent(sheen: Sheen, x: f32) -> f32 {
    let f = sheen.fit;
    return f.x / (1.0 + f.y * pow(max(x, 1e-9), f.z)) + f.w * x + sheen.fit_last;
}

fn sheen_lambda(sheen: Sheen, cosine: f32) -> f32 {
    if cosine < 0.5 {
        return exp(lambda_exponent(sheen, cosine));
    }
    return exp(2.0 * lambda_exponent(sheen, 0.5) - lambda_exponent(sheen, 1.0 - cosine));
}

fn sheen_eval_pdf(sheen: Sheen, wo: vec3f, wi: vec3f) -> EvalPdf {
    if wi.z <= 0.0 || !sheen_is_outside(sheen, wo.z) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    let h = normalize_or(wo + wi, vec3f(0.0));
    if all(h == vec3f(0.0)) {
        return EvalPdf(vec3f(0.0), UNIFORM_HEMISPHERE);
    }
    let gain = max(max(sheen_gain(sheen, wo.z), sheen_gain(sheen, wi.z)), 1.0);
    let masking = 1.0 + sheen_lambda(sheen, wo.z) + sheen_lambda(sheen, wi.z);
    let value = sheen_distribution(sheen, h) / (masking * (4.0 * wo.z * wi.z)) * wi.z;
    return EvalPdf(sheen.color * (value / gain), UNIFORM_HEMISPHERE);
}
