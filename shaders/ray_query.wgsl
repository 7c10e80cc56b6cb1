// What a ray hits, asked of the device's own ray queries: stands in for the walk in bvh.wgsl, which
// stays the reference. Distances and edges are the device's: near an edge another triangle may be hit,
// of two that coincide either one.

// What a query has found, as the walk would tell it.
fn queried_hit(found: RayIntersection, direction: vec3f) -> Hit {
    var place = found.primitive_index;
    var opaque = globals.opaque_triangles;
    var barycentric = found.barycentrics;
//#if INSTANCES
    // Zero is what lies in the world.
    let instance = found.instance_custom_data - 1u;
    let placement = placement_of(instance);
    if instance != NO_INSTANCE {
        let list = instance_words(instance, INSTANCE_LIST);
        place += list.x;
        opaque = list.w;
    }
    if placement.mirrors {
        barycentric = barycentric.yx;
    }
//#end
    if found.geometry_index != 0u {
        place += opaque;
    }
    let listed = query_triangles(place).x;
    var triangle = listed;
    var flags = 0u;
//#if FILTERED_OR_PASSED
    let corners = triangles(listed);
    flags = material_flags(corners.w);
//#if SINGLE_SIDED
    let a = vertex_position(corners.x);
    let b = vertex_position(corners.y);
    let c = vertex_position(corners.z);
    var normal = cross(b - a, c - a);
//#if INSTANCES
    normal = normal_in_world(placement, normal);
//#end
    if dot(normal, direction) > 0.0 {
        flags |= FROM_BEHIND;
    }
//#end
//#end
//#if INSTANCES
    triangle += placement.shift;
//#end
    return Hit(found.t, triangle, barycentric, flags);
}

// Whether a query may be asked about a ray at all.
fn can_be_queried(ray: Ray) -> bool {
    return is_finite3(ray.origin) && is_finite3(ray.direction) && ray.t_max > 0.0;
}

// Nearest surface along a ray.
fn closest_hit(ray: Ray, from_camera: bool) -> Hit {
    let none = Hit(MISS, 0xffffffffu, vec2f(0.0), 0u);
    if !can_be_queried(ray) {
        return none;
    }
    var query: ray_query;
//#if FILTERED_HITS
    var flags = RAY_FLAG_NONE;
//#if SINGLE_SIDED
    // Only camera rays ask from which side.
    if from_camera {
        flags = RAY_FLAG_FORCE_NO_OPAQUE;
    }
//#end
    rayQueryInitialize(
        &query, tree, RayDesc(flags, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction));
    while rayQueryProceed(&query) {
        let found = rayQueryGetCandidateIntersection(&query);
        if accepts(queried_hit(found, ray.direction), from_camera) {
            rayQueryConfirmIntersection(&query);
        }
    }
//#else
    rayQueryInitialize(
        &query,
        tree,
        RayDesc(RAY_FLAG_FORCE_OPAQUE, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction));
    while rayQueryProceed(&query) {}
//#end
    let found = rayQueryGetCommittedIntersection(&query);
    if found.kind == RAY_QUERY_INTERSECTION_NONE {
        return none;
    }
    return queried_hit(found, ray.direction);
}

// Share of light that arrives along a shadow ray: zero if a surface scatters it all.
fn transmittance_along(ray: Ray) -> vec3f {
    if !can_be_queried(ray) {
        return vec3f(1.0);
    }
    var query: ray_query;
    var transmittance = vec3f(1.0);
    rayQueryInitialize(
        &query,
        tree,
        RayDesc(
            RAY_FLAG_TERMINATE_ON_FIRST_HIT, 0xffu, 0.0, ray.t_max, ray.origin, ray.direction));
    while rayQueryProceed(&query) {
//#if PASS_THROUGH
        let found = rayQueryGetCandidateIntersection(&query);
        transmittance *= passed(queried_hit(found, ray.direction), ray.direction);
        if max_element(transmittance) <= 0.0 {
            rayQueryConfirmIntersection(&query);
        }
//#end
    }
    let found = rayQueryGetCommittedIntersection(&query);
    return select(vec3f(0.0), transmittance, found.kind == RAY_QUERY_INTERSECTION_NONE);
}
