// In place of diffuse.wgsl where light comes through a body, too: twin of src/bsdf/diffuse.rs.

struct Diffuse {
    // Base colour times share, over what the interface lets in on average.
    reflected: vec3f,
    // The same for light from the far side, and the probability of choosing it.
    transmitted: vec3f,
    through: f32,
}

fn diffuse_new(p: SurfaceParameters, i: Interface) -> Diffuse {
    let share = (1.0 - p.metallic) * (1.0 - p.transmission);
    var d = Diffuse(p.base_color * (share * (1.0 - p.diffuse_transmission)), vec3f(0.0), 0.0);
    if p.diffuse_transmission > 0.0 {
        d.transmitted = p.diffuse_transmission_color * (share * p.diffuse_transmission)
            * radiance_scale(i);
        let through = importance(d.transmitted);
        if through > 0.0 {
            d.through = through / (importance(d.reflected) + through);
        }
    }
    return d;
}

// Under an interface that lets so much in.
fn diffuse_let_in(d: Diffuse, let_in: f32) -> Diffuse {
    return Diffuse(
        select(vec3f(0.0), d.reflected / let_in, let_in > 1e-4),
        select(vec3f(0.0), d.transmitted / let_in, let_in > 1e-4),
        d.through,
    );
}

fn diffuse_is_absent(d: Diffuse) -> bool {
    return all(diffuse_sum(d) == vec3f(0.0));
}

// Both lobes.
fn diffuse_sum(d: Diffuse) -> vec3f {
    return d.reflected + d.transmitted;
}

// Without what the interface takes, and without the scale of radiance on its way through.
fn diffuse_albedo(d: Diffuse, i: Interface) -> vec3f {
    return d.reflected + d.transmitted / radiance_scale(i);
}

fn diffuse_sample(d: Diffuse, choice: f32, u: vec2f) -> vec3f {
    let wi = cosine_hemisphere(u);
    return select(wi, -wi, choice < d.through);
}

// Whether there may be light from this side.
fn diffuse_is_seen(d: Diffuse, wi: vec3f) -> bool {
    return wi.z > 0.0 || d.through > 0.0;
}

// Of a direction on such a side, both ways through an interface that leaves `left`.
fn diffuse_eval_pdf(d: Diffuse, left: f32, wi: vec3f) -> EvalPdf {
    let lambert = abs(wi.z) * FRAC_1_PI;
    if wi.z > 0.0 {
        return EvalPdf(d.reflected * (left * lambert), lambert * (1.0 - d.through));
    }
    return EvalPdf(d.transmitted * (left * lambert), lambert * d.through);
}
