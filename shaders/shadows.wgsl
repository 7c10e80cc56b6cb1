// Rays towards lights: twin of `Path::transmittance` in src/path/mod.rs, which src/path/gather.rs asks.

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
}

// A ray from the vertex towards a light so far away; its light is zero. There is none if media let
// nothing through.
fn shadow_towards(
    path: ptr<function, Path>,
    vertex: Vertex,
    direction: vec3f,
    distance: f32,
) -> Shadow {
    let normal = vertex.point.geometric_normal;
    let is_above = dot(normal, direction) > 0.0;
    var shadow: Shadow;
    var origin = offset_origin(vertex.point.position, select(-normal, normal, is_above));
//#if SHADOW_MEDIA
    shadow.left = vec3f(1.0);
//#if SOLID_TRANSMISSION
    var body = (*path).body;
//#if MEDIUM
    let goes_behind = !is_above && !vertex.is_in_medium;
//#else
    let goes_behind = !is_above;
//#end
    if goes_behind {
        body = body_behind(vertex.point, body);
    }
//#end
//#if MEDIUM
    if vertex.is_in_medium {
        origin = vertex.point.position;
    }
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
    if all(shadow.left == vec3f(0.0)) {
        return shadow;
    }
//#end
    // Stop short of the light's own surface.
    shadow.ray = Ray(origin, direction, distance * SHADOW_RAY_SHARE);
    return shadow;
}

// Share of light that comes along a shadow ray, if there is one.
fn follow_shadow(path: ptr<function, Path>, shadow: Shadow) -> vec3f {
    if shadow.ray.t_max <= 0.0 {
        return vec3f(0.0);
    }
    (*path).rays += 1u;
    let visible = transmittance_along(shadow.ray);
//#if SHADOW_MEDIA
    return visible * shadow.left;
//#else
    return visible;
//#end
}
