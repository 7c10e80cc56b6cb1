// A clear layer over everything else: twin of src/bsdf/coat.rs.

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

fn coat_is_absent(coat: Coat) -> bool {
    return coat.strength == 0.0;
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
    var result = NO_SAMPLE;
    if local_wi.z > 0.0 && wi.z > 0.0 {
        if smooth_ {
            let weight = vec3f(coat.strength * coat_fresnel(local.z) / probability);
            result = LobeSample(COAT_DELTA, wi, weight);
        } else {
            result = LobeSample(SPREAD, wi, vec3f(0.0));
        }
    }
    return result;
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
