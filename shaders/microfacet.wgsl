// GGX: twin of src/bsdf/microfacet.rs.

struct Ggx {
    alpha: f32,
//#if ANISOTROPY
    along: f32,
    axis: vec2f,
//#end
}

fn ggx_from_roughness(roughness: f32) -> Ggx {
    let alpha = roughness * roughness;
//#if ANISOTROPY
    return Ggx(alpha, alpha, vec2f(1.0, 0.0));
//#else
    return Ggx(alpha);
//#end
}

fn is_smooth(ggx: Ggx) -> bool {
    return ggx.alpha < SMOOTH_ALPHA;
}

//#if ANISOTROPY
fn ggx_of(p: SurfaceParameters) -> Ggx {
    return ggx_stretched(p.roughness, p.anisotropy, p.anisotropy_axis);
}

fn ggx_stretched(roughness: f32, strength: f32, axis: vec2f) -> Ggx {
    let ggx = ggx_from_roughness(roughness);
    let along = ggx.alpha + (1.0 - ggx.alpha) * (strength * strength);
    if strength == 0.0 || along < SMOOTH_ALPHA {
        return ggx;
    }
    return Ggx(max(ggx.alpha, SMOOTH_ALPHA), along, axis);
}

fn is_stretched(ggx: Ggx) -> bool {
    return ggx.along != ggx.alpha;
}

fn ggx_along_axis(ggx: Ggx, v: vec3f) -> vec2f {
    return vec2f(dot(v.xy, ggx.axis), dot(v.xy, vec2f(-ggx.axis.y, ggx.axis.x)));
}

fn widened(ggx: Ggx, v: vec3f) -> vec3f {
    return vec3f(ggx_along_axis(ggx, v) * vec2f(ggx.along, ggx.alpha), v.z);
}

fn roughness_off_axis(ggx: Ggx, cosine: f32, sine: f32) -> f32 {
    return sqrt(length(vec2f(ggx.along * cosine, ggx.alpha * sine)));
}

fn roughness_towards(ggx: Ggx, v: vec3f) -> f32 {
    let flat = ggx_along_axis(ggx, v);
    let squared = dot(flat, flat);
    let unit_flat = select(vec2f(1.0, 0.0), flat / sqrt(squared), squared > 0.0);
    return roughness_off_axis(ggx, unit_flat.x, unit_flat.y);
}
//#else
fn ggx_of(p: SurfaceParameters) -> Ggx {
    return ggx_from_roughness(p.roughness);
}
//#end

fn ggx_distribution(ggx: Ggx, h: vec3f) -> f32 {
//#if ANISOTROPY
    if is_stretched(ggx) {
        let slopes = ggx_along_axis(ggx, h) / vec2f(ggx.along, ggx.alpha);
        let t = dot(slopes, slopes) + h.z * h.z;
        return 1.0 / (PI * ggx.along * ggx.alpha * t * t);
    }
//#end
    let a2 = ggx.alpha * ggx.alpha;
    let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    return 1.0 / (PI * a2 * t * t);
}

fn ggx_visibility(ggx: Ggx, v: vec3f) -> f32 {
//#if ANISOTROPY
    if is_stretched(ggx) {
        return 1.0 / (v.z + length(widened(ggx, v)));
    }
//#end
    let a2 = ggx.alpha * ggx.alpha;
    return 1.0 / (v.z + sqrt(a2 + (1.0 - a2) * v.z * v.z));
}

fn ggx_sample_visible_normal(ggx: Ggx, wo: vec3f, u: vec2f) -> vec3f {
//#if ANISOTROPY
    let wo_std = normalize(widened(ggx, wo));
//#else
    let wo_std = normalize(vec3f(ggx.alpha * wo.xy, wo.z));
//#end
    let z = (1.0 - u.y) * (1.0 + wo_std.z) - wo_std.z;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let sin_cos = sin_cos_turns(u.x);
    let h_std = vec3f(r * sin_cos.y, r * sin_cos.x, z) + wo_std;
//#if ANISOTROPY
    let flat = ggx.axis * (ggx.along * h_std.x)
        + vec2f(-ggx.axis.y, ggx.axis.x) * (ggx.alpha * h_std.y);
//#else
    let flat = ggx.alpha * h_std.xy;
//#end
    return normalize(vec3f(flat, max(h_std.z, 1e-7)));
}

fn ggx_visible_normal_pdf_solid_angle(ggx: Ggx, wo: vec3f, h: vec3f) -> f32 {
    return 2.0 * ggx_visibility(ggx, wo) * ggx_distribution(ggx, h) * max(dot(wo, h), 0.0);
}
