// In place of sheen.wgsl where no material has a sheen.

struct Sheen {
    unused: u32,
}

fn sheen_new(p: SurfaceParameters, entering: bool) -> Sheen {
    return Sheen();
}

fn sheen_is_absent(sheen: Sheen) -> bool {
    return true;
}

fn sheen_is_hidden(sheen: Sheen) -> bool {
    return true;
}

fn sheen_colored_albedo(sheen: Sheen, v: vec3f) -> vec3f {
    return vec3f(0.0);
}

fn sheen_left(sheen: Sheen, wo: vec3f, wi: vec3f) -> f32 {
    return 1.0;
}

fn sheen_sample(u: vec2f) -> vec3f {
    return vec3f(0.0);
}

fn sheen_eval_pdf(sheen: Sheen, wo: vec3f, wi: vec3f) -> EvalPdf {
    return EvalPdf(vec3f(0.0), 0.0);
}
