// In place of glass.wgsl where no material lets light through.

struct Glass {
    unused: u32,
}

fn glass_new(p: SurfaceParameters, f0: vec3f, f90: f32, entering: bool) -> Glass {
    return Glass();
}

fn glass_is_absent(glass: Glass) -> bool {
    return true;
}

fn glass_reflects_nothing(glass: Glass) -> bool {
    return true;
}

fn passes_straight(i: Interface) -> bool {
    return false;
}

fn transmits_delta(i: Interface) -> bool {
    return false;
}

fn facet_with_glass(i: Interface, cosine: f32, opaque_share: vec3f) -> Facet {
    return Facet(opaque_share, vec3f(0.0));
}

fn scattering_facets(i: Interface, cosine: f32, wo: vec3f) -> Facets {
    let facet = interface_facet(i, cosine);
    return Facets(facet, facet);
}

fn sample_through(i: Interface, wo: vec3f, h: vec3f, transmittance: vec3f) -> LobeSample {
    return NO_SAMPLE;
}

fn passes_mirrored(i: Interface) -> bool {
    return false;
}

fn eval_pdf_refracted(i: Interface, wo: vec3f, wi: vec3f) -> EvalPdf {
    return EvalPdf(vec3f(0.0), 0.0);
}

fn glass_albedo(i: Interface, cosine: f32) -> vec3f {
    return vec3f(0.0);
}

fn radiance_scale(i: Interface) -> vec3f {
    return vec3f(1.0);
}
