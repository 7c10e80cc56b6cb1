// GGX: twin of src/bsdf/microfacet.rs.

const SMOOTH_ALPHA = 1e-3;

fn ggx_distribution(alpha: f32, h: vec3f) -> f32 {
    let a2 = alpha * alpha;
    let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    return 1.0 / (PI * a2 * t * t);
}

fn ggx_visibility(alpha: f32, cosine: f32) -> f32 {
    let a2 = alpha * alpha;
    return 1.0 / (cosine + sqrt(a2 + (1.0 - a2) * cosine * cosine));
}

fn ggx_sample_visible_normal(alpha: f32, wo: vec3f, u: vec2f) -> vec3f {
    let wo_std = normalize(vec3f(alpha * wo.x, alpha * wo.y, wo.z));
    let z = (1.0 - u.y) * (1.0 + wo_std.z) - wo_std.z;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let sin_cos = sin_cos_turns(u.x);
    let h_std = vec3f(r * sin_cos.y, r * sin_cos.x, z) + wo_std;
    return normalize(vec3f(alpha * h_std.x, alpha * h_std.y, max(h_std.z, 1e-7)));
}

fn ggx_visible_normal_pdf_solid_angle(alpha: f32, wo: vec3f, h: vec3f) -> f32 {
    return 2.0 * ggx_visibility(alpha, wo.z) * ggx_distribution(alpha, h) * max(dot(wo, h), 0.0);
}
