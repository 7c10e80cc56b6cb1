// The body under the interface: twin of src/bsdf/diffuse.rs where no light comes through it.

struct Diffuse {
    // Base colour times share, over what the interface lets in on average.
    reflected: vec3f,
}

fn diffuse_new(p: SurfaceParameters, i: Interface) -> Diffuse {
    return Diffuse(p.base_color * ((1.0 - p.metallic) * (1.0 - p.transmission)));
}

// Under an interface that lets so much in.
fn diffuse_let_in(d: Diffuse, let_in: f32) -> Diffuse {
    return Diffuse(select(vec3f(0.0), d.reflected / let_in, let_in > 1e-4));
}

fn diffuse_is_absent(d: Diffuse) -> bool {
    return all(d.reflected == vec3f(0.0));
}

fn diffuse_sum(d: Diffuse) -> vec3f {
    return d.reflected;
}

// Without what the interface takes.
fn diffuse_albedo(d: Diffuse, i: Interface) -> vec3f {
    return d.reflected;
}

fn diffuse_sample(d: Diffuse, choice: f32, u: vec2f) -> vec3f {
    return cosine_hemisphere(u);
}

// Whether there may be light from this side.
fn diffuse_is_seen(d: Diffuse, wi: vec3f) -> bool {
    return wi.z > 0.0;
}

// Of a direction on such a side, both ways through an interface that leaves `left`.
fn diffuse_eval_pdf(d: Diffuse, left: f32, wi: vec3f) -> EvalPdf {
    let lambert = wi.z * FRAC_1_PI;
    return EvalPdf(d.reflected * (left * lambert), lambert);
}
