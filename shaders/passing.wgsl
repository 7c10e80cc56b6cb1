// Surfaces that a ray does not meet or goes straight through: twin of src/path/world.rs and of `Path::passes` in
// src/path/tracer.rs.

//#if PARTIAL
// Share of light that goes straight through a surface: what alpha does not cover, and what smooth
// thin glass transmits.
fn straight_through(point: SurfacePoint, direction: vec3f) -> vec3f {
    if (material_flags(point.material) & PARTIAL) == 0u {
        return vec3f(0.0);
    }
    var glass = vec3f(0.0);
//#if TRANSMISSION
    if point.parameters.transmission > 0.0 {
        let bsdf = bsdf_new(point.parameters, point.front_face);
        glass = bsdf_straight_transmittance(
            bsdf, local_from_world(point.shading_frame, -direction));
    }
//#end
    let covered = coverage(point);
    return (1.0 - covered) + covered * glass;
}

fn coverage(point: SurfacePoint) -> f32 {
    let blended = (material_flags(point.material) & ALPHA_BLEND) != 0u;
    return select(1.0, saturate(point.parameters.alpha), blended);
}

fn passes(path: ptr<function, Path>, point: SurfacePoint) -> bool {
    let through = straight_through(point, (*path).ray.direction);
    let probability = min(max_element(through), 1.0);
    if probability <= 0.0 {
        return false;
    }
    var goes_on = probability >= 1.0;
    if !goes_on {
        goes_on = path_pair(path).x < probability;
    }
//#if SHARING
    (*path).is_clear = (*path).is_clear && (!goes_on || all(through == vec3f(1.0)));
//#end
//#if LAYERS
//#if PERFECT_INTERFACES
//#if TRANSMISSION
    if goes_on && (*path).bounces == 0u && point.parameters.transmission > 0.0 {
        let bsdf = bsdf_new(point.parameters, point.front_face);
        if bsdf_is_delta_only(bsdf) {
            let wo = local_from_world(point.shading_frame, -(*path).ray.direction);
            goes_by(path, bsdf, wo, true);
        }
    }
//#end
//#end
//#end
    if goes_on {
        (*path).throughput *= through / probability;
    } else {
        (*path).throughput *= coverage(point) / (1.0 - probability);
    }
    return goes_on;
}
//#end

//#if FILTERED_HITS
// Whether a path sees a hit: not where a mask cuts it out, nor a back side that
// has a front in the same place or, for camera rays, any.
fn accepts(hit: Hit, from_camera: bool) -> bool {
    if from_camera && (hit.flags & (DOUBLE_SIDED | FROM_BEHIND)) == FROM_BEHIND {
        return false;
    }
//#if BACKED
    if (hit.flags & (BACKED | FROM_BEHIND)) == (BACKED | FROM_BEHIND) {
        return false;
    }
//#end
//#if ALPHA_MASK
    if (hit.flags & ALPHA_MASK) != 0u {
        return alpha_at(hit.triangle, hit.barycentric) > 0.0;
    }
//#end
    return true;
}
//#end

//#if PASS_THROUGH
// Share of light that a surface on a shadow ray's way lets through.
fn passed(hit: Hit, direction: vec3f) -> vec3f {
//#if BACKED
    if (hit.flags & (BACKED | FROM_BEHIND)) == (BACKED | FROM_BEHIND) {
        return vec3f(1.0);
    }
//#end
//#if CLEAR_SOLIDS
    if (hit.flags & CLEAR_SOLID) != 0u {
        meets_glass = true;
        return vec3f(1.0);
    }
//#end
//#if PARTIAL
    if (hit.flags & PARTIAL) != 0u {
        return straight_through(surface_at(hit.triangle, hit.barycentric, direction), direction);
    }
//#end
//#if ALPHA_MASK
    if (hit.flags & ALPHA_MASK) != 0u {
        return vec3f(1.0 - alpha_at(hit.triangle, hit.barycentric));
    }
//#end
    return vec3f(0.0);
}
//#end
