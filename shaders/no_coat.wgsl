// In place of coat.wgsl where no material has a clearcoat.

struct Coat {
    unused: u32,
}

fn coat_new(p: SurfaceParameters, entering: bool) -> Coat {
    return Coat();
}

fn coat_is_absent(coat: Coat) -> bool {
    return true;
}

fn coat_is_delta_or_absent(coat: Coat) -> bool {
    return true;
}

fn coat_attenuation(coat: Coat, v: vec3f) -> f32 {
    return 1.0;
}

fn coat_albedo(coat: Coat, wo: vec3f) -> f32 {
    return 0.0;
}

fn coat_sample(coat: Coat, wo: vec3f, u: vec2f, probability: f32) -> LobeSample {
    return NO_SAMPLE;
}

fn coat_eval_pdf(coat: Coat, wo: vec3f, wi: vec3f) -> vec2f {
    return vec2f(0.0);
}
