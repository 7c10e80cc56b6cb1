// Rays towards lights: twin of src/path/shadows.rs, which src/path/gather.rs asks.

// A ray towards a light. It waits until the path has chosen where to go on: so nothing of the vertex
// takes registers while it is followed.
struct Shadow {
    // Its reach is 0 if there is none.
    ray: Ray,
    // What arrives if nothing is in the way, before its weight.
    light: vec3f,
    weight: f32,
//#if SHADOW_MEDIA
    // What media let through of it.
    left: vec3f,
//#end
//#if COUNTING
    visibility: Visibility,
//#end
//#if CLEAR_SOLIDS
    is_of_map: bool,
    // What `light` is without radiance and density.
    carried: vec3f,
    // Densities with which a lamp is chosen, F32_MAX if it has no size, and with which the path goes there.
    pdf_solid_angle: f32,
    own_pdf: f32,
    // What it begins in.
    body: Body,
//#if EMITTERS
    receiver: Receiver,
//#end
//#end
}

// A ray from the vertex towards a light so far away; its light is zero. There is none if media let
// nothing through.
fn shadow_towards(
    path: ptr<function, Path>,
    vertex: Vertex,
    direction: vec3f,
    distance: f32,
) -> Shadow {
    var shadow: Shadow;
    let origin = vertex_origin_toward(vertex, direction);
//#if SHADOW_MEDIA
    shadow.left = vec3f(1.0);
//#if SOLID_TRANSMISSION
    var body = (*path).body;
    var goes_behind = !is_above(vertex.point, direction);
//#if MEDIUM
    goes_behind = goes_behind && !vertex.is_in_medium;
//#end
    if goes_behind {
        body = body_behind(vertex.point, body);
    }
//#end
//#if MEDIUM
//#if SOLID_TRANSMISSION
    let stretch = stretch_in(body, origin, direction, distance);
//#else
    let stretch = fog_stretch(origin, direction, distance);
//#end
    if stretch.start < stretch.end {
        shadow.left = exp(-stretch.interior.extinction * (stretch.end - stretch.start));
    }
//#else
    shadow.left = body_transmittance(body, distance);
//#end
//#if CLEAR_SOLIDS
    // It may leave the body by glass.
    shadow.body = body;
    shadow.is_of_map = true;
//#else
    if all(shadow.left == vec3f(0.0)) {
        return shadow;
    }
//#end
//#end
    // Stop short of the light's own surface.
    shadow.ray = Ray(origin, direction, distance * SHADOW_RAY_SHARE);
    return shadow;
}

// Share of light that comes along a shadow ray, if there is one. If glass refracts it, its light is another.
fn follow_shadow(path: ptr<function, Path>, shadow: ptr<function, Shadow>) -> vec3f {
    if (*shadow).ray.t_max <= 0.0 {
        return vec3f(0.0);
    }
    (*path).rays += 1u;
//#if CLEAR_SOLIDS
    meets_glass = false;
//#end
    let visible = transmittance_along((*shadow).ray);
//#if CLEAR_SOLIDS
    if meets_glass && any(visible != vec3f(0.0)) {
        return follow_through_glass(path, shadow);
    }
//#end
//#if SHADOW_MEDIA
    return visible * (*shadow).left;
//#else
    return visible;
//#end
}

//#if CLEAR_SOLIDS
// The same behind glass: twin of `Path::share_of_map` and of part of `Path::light_of_lamps`.
fn follow_through_glass(path: ptr<function, Path>, shadow: ptr<function, Shadow>) -> vec3f {
    let is_punctual = !(*shadow).is_of_map && (*shadow).pdf_solid_angle >= F32_MAX;
    var ray = (*shadow).ray;
    if !is_punctual || ray.t_max >= F32_MAX * SHADOW_RAY_SHARE {
        ray.t_max = F32_MAX;
    }
    var radiance = vec3f(0.0);
    var is_straight = is_punctual;
    // A loop, for the walk is long.
    loop {
//#if EMITTERS
        let walk = walk_glass(path, ray, (*shadow).body, is_straight, (*shadow).receiver);
//#else
        let walk = walk_glass(path, ray, (*shadow).body, is_straight);
//#end
        if is_punctual {
            return walk.transmittance;
        }
        if (*shadow).is_of_map {
            radiance = environment_radiance(walk.direction);
            (*shadow).light = (*shadow).carried * radiance;
            return walk.transmittance;
        }
        var chosen = (*shadow).pdf_solid_angle;
//#if SHEER_EMITTERS
        if !is_straight {
            radiance = walk.emitted;
            if all(radiance == vec3f(0.0)) {
                return vec3f(0.0);
            }
            is_straight = true;
            continue;
        }
        // Where a lamp is found through an edge, rounding may lose the one that was chosen.
        chosen = max(walk.lamp_pdf, chosen);
//#else
        // The straight ray ends at an opaque lamp.
        radiance = walk.emitted;
//#end
        (*shadow).light = (*shadow).carried * radiance;
        (*shadow).weight = 1.0 / (chosen + (*shadow).own_pdf);
        return vec3f(1.0);
    }
    return vec3f(0.0);
}
//#end
