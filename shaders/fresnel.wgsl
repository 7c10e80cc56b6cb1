// How much a flat interface reflects, and which way it refracts: twin of src/bsdf/fresnel.rs.

// `dielectric` of total internal reflection.
const TOTAL_REFLECTION = -1.0;

fn schlick_weight(cosine: f32) -> f32 {
    let m = saturate(1.0 - cosine);
    let m2 = m * m;
    return m2 * m2 * m;
}

fn normal_reflectance(ior: f32) -> f32 {
    let r = (ior - 1.0) / (ior + 1.0);
    return r * r;
}

fn dielectric(cosine: f32, eta: f32) -> f32 {
    let c = saturate(cosine);
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if sin2_t >= 1.0 {
        return TOTAL_REFLECTION;
    }
    let cos_t = sqrt(1.0 - sin2_t);
    let parallel = (eta * c - cos_t) / (eta * c + cos_t);
    let perpendicular = (c - eta * cos_t) / (c + eta * cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// Zero at total internal reflection.
fn refracted(wo: vec3f, h: vec3f, eta: f32) -> vec3f {
    let cosine = dot(wo, h);
    let sin2_t = max(1.0 - cosine * cosine, 0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return vec3f(0.0);
    }
    let cos_t = sqrt(1.0 - sin2_t);
    return normalize(h * (cosine / eta - cos_t) - wo / eta);
}

fn reflected(wo: vec3f, h: vec3f) -> vec3f {
    return h * (2.0 * dot(wo, h)) - wo;
}
