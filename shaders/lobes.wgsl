// The split of a BSDF into its narrow and its broad lobes: twin of `Bsdf::split` in src/bsdf/mod.rs, of
// src/bsdf/lobes.rs, of src/path/splitting.rs, of `Path::is_in_air` in src/path/tracer.rs and of fields of
// `SurfaceScatterer` in src/path/vertex.rs.

// Whether coat and interface are narrower than GGX makes them with this alpha.
fn narrow_lobes(b: Bsdf, min_alpha: f32) -> vec2<bool> {
    var coat = false;
//#if CLEARCOAT
    coat = !coat_is_absent(b.coat) && b.coat.ggx.alpha < min_alpha;
//#end
    var interface_ = !interface_is_absent(b.interface_) && b.interface_.ggx.alpha < min_alpha;
//#if SPLIT_LOBES
    coat = coat && b.weights.x > 0.0;
    interface_ = interface_ && b.weights.y > 0.0;
//#end
    return vec2<bool>(coat, interface_);
}

//#if SPLIT_LOBES
// Share of the narrow lobes in the albedo towards `wo`; 0 of a BSDF that stays whole.
fn narrow_share(b: Bsdf, min_alpha: f32, wo: vec3f) -> f32 {
    let narrow = narrow_lobes(b, min_alpha);
    if !any(narrow) {
        return 0.0;
    }
    let out = bsdf_outgoing(b, wo);
    let share = select(0.0, out.coat_probability, narrow.x)
        + select(0.0, out.interface_probability + out.rescatter_probability, narrow.y);
    return select(0.0, share, share > 0.0 && share <= MAX_NARROW_SHARE);
}

// One part of a BSDF, by the share of its narrow lobes and a uniform number: twin of `LobeWeights::of_part`.
fn part_of(b: Bsdf, min_alpha: f32, share: f32, min_probability: f32, u: f32) -> Bsdf {
    let narrow = vec3f(select(vec2f(0.0), vec2f(1.0), narrow_lobes(b, min_alpha)), 0.0);
    let probability = max(share, min_probability);
    var part = b;
    if u < probability {
        part.weights = narrow / probability;
    } else {
        part.weights = (1.0 - narrow) / (1.0 - probability);
    }
    return part;
}

// The broad lobes of a vertex that is shared.
fn broad_part(b: Bsdf, wo: vec3f, min_probability: f32) -> Bsdf {
    let share = narrow_share(b, MIN_SHARED_ALPHA, wo);
    if share == 0.0 {
        return b;
    }
    return part_of(b, MIN_SHARED_ALPHA, share, min_probability, 1.0);
}

fn broad_part_of_first(b: Bsdf, wo: vec3f) -> Bsdf {
    return broad_part(b, wo, MIN_NARROW);
}

fn broad_part_of_second(b: Bsdf) -> Bsdf {
    return broad_part(b, vec3f(0.0, 0.0, 1.0), MIN_SHARED_NARROW);
}

// Twin of `Path::part_of`.
fn split(path: ptr<function, Path>, vertex: Vertex) -> Bsdf {
    let bounces = (*path).bounces;
    var wo = vertex.wo;
    var min_probability = MIN_NARROW;
    var is_of_use = is_in_air(path) && !bsdf_is_delta_only(vertex.bsdf) && !transmits(vertex);
//#if FINDING
    let min_alpha = MIN_SHARED_ALPHA;
    is_of_use = is_of_use && (bounces == 0u || (bounces == 1u && (first[0].w & IS_SHARED) != 0u));
    if bounces == 1u {
        wo = vec3f(0.0, 0.0, 1.0);
        min_probability = MIN_SHARED_NARROW;
    }
//#else
    let min_alpha = MIN_CACHED_ALPHA;
//#if TRAINING
    is_of_use = is_of_use && bounces < TRAINING_VERTICES;
//#else
//#if CACHED
    is_of_use = is_of_use && bounces > 0u && is_known(path, vertex.point);
//#else
    is_of_use = false;
//#end
//#end
//#end
    if !is_of_use {
        return vertex.bsdf;
    }
    let share = narrow_share(vertex.bsdf, min_alpha, wo);
    if share == 0.0 {
        return vertex.bsdf;
    }
    return part_of(vertex.bsdf, min_alpha, share, min_probability, path_pair(path).x);
}

// Twin of `ViewedBsdf::albedo`.
fn bsdf_albedo_towards(b: Bsdf, wo: vec3f) -> vec3f {
    let up = vec3f(0.0, 0.0, 1.0);
    var transmitted = vec2f(1.0);
    if b.weights.x == 0.0 {
        transmitted *= vec2f(coat_attenuation(b.coat, wo), coat_attenuation(b.coat, up));
    }
    if b.weights.y == 0.0 {
        transmitted *= vec2f(bsdf_diffuse_left_at(b, wo), bsdf_diffuse_left_at(b, up));
    }
    let albedo = bsdf_albedo(b) * (transmitted.x / transmitted.y);
    return select(vec3f(0.0), albedo, transmitted.y > 0.0);
}
//#end

// Whether a surface scatters much the same to and from places side by side.
fn is_broad(vertex: Vertex, min_alpha: f32) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
    return !any(narrow_lobes(vertex.bsdf, min_alpha)) && !bsdf_is_delta_only(vertex.bsdf);
}

fn transmits(vertex: Vertex) -> bool {
    var transmits = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    transmits = transmits || vertex.point.parameters.diffuse_transmission > 0.0;
//#end
    return transmits;
}

// Whether some of that is refracted or goes on inside of a body.
fn refracts(vertex: Vertex) -> bool {
    var refracts = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    let diffuses = vertex.point.parameters.diffuse_transmission > 0.0;
    refracts = refracts || (diffuses && !vertex.point.parameters.thin);
//#end
    return refracts;
}

// Whether the path is outside of all bodies.
fn is_in_air(path: ptr<function, Path>) -> bool {
//#if SOLID_TRANSMISSION
//#if MEDIUM
    return !(*path).body.is_solid;
//#else
    let body = (*path).body;
    return body.squared_index == 1.0 && all(body.absorption == vec3f(0.0));
//#end
//#else
    return true;
//#end
}
