// In place of rescatter.wgsl where no metal and no glass is rough.

struct Rescatter {
    unused: u32,
}

fn rescatter_new(p: SurfaceParameters, i: Interface) -> Rescatter {
    return Rescatter();
}

fn rescatter_is_absent(r: Rescatter) -> bool {
    return true;
}

fn rescatter_lost(r: Rescatter, i: Interface, wo: vec3f) -> f32 {
    return 0.0;
}

fn rescatter_sum(r: Rescatter) -> vec3f {
    return vec3f(0.0);
}

fn rescatter_albedo(r: Rescatter, i: Interface) -> vec3f {
    return vec3f(0.0);
}

fn rescatter_sample(r: Rescatter, choice: f32, u: vec2f) -> vec3f {
    return vec3f(0.0);
}

fn rescatter_eval_pdf(r: Rescatter, i: Interface, lost: f32, wi: vec3f) -> EvalPdf {
    return EvalPdf(vec3f(0.0), 0.0);
}
