// Follows each pixel's path to its second vertex, or to its end if that cannot be shared.

// Where the last ray ended.
var<private> arrival: Hit;
// The first vertex of the path, as `firsts` keeps it.
var<private> first: array<vec4u, 2>;
//#if PERFECT_INTERFACES
// The direction in which it was found.
var<private> first_direction: vec3f;
//#end
//#if LIFTED
// Its geometric normal; zero where it lifts no ray.
var<private> first_normal: vec3f;
//#end
// The second one, as `seconds` keeps it; there is none if the last word of the first texel is 0.
var<private> second: array<vec4u, 2>;

// Twin of `Scatterer::is_alike_nearby`.
fn is_alike_nearby(vertex: Vertex) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return true;
    }
//#end
    var min_alpha = MIN_WHOLE_ALPHA;
//#if SPLIT_LOBES
    min_alpha = select(MIN_SHARED_ALPHA, MIN_WHOLE_ALPHA, vertex.bsdf.weights.z == 1.0);
//#end
    return !refracts(vertex) && is_broad(vertex, min_alpha);
}

// The vertex that the path is at, as it is kept.
fn packed_vertex(vertex: Vertex, what: u32) -> vec4u {
//#if MEDIUM
    if vertex.is_in_medium {
        return packed(vertex.point.position, what | IS_IN_MEDIUM);
    }
//#end
    return packed_hit(arrival.triangle, arrival.barycentric, what);
}

// Twin of `Scatterer::is_true_from`.
fn is_vertex_true_from(vertex: Vertex, to_viewer: vec3f) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return true;
    }
//#end
    return is_true_from(
        vertex.point.shading_frame, vertex.bsdf, vertex.point.geometric_normal, to_viewer);
}

// At the first vertex: whether its light is gathered later, by `connect_seconds`.
fn meet_first(path: ptr<function, Path>, vertex: Vertex) -> bool {
    if !is_alike_nearby(vertex) || !is_in_air(path) {
        return false;
    }
    let pair = (*path).sampler.pair;
    var what = IS_SHARED | (pair << 2u);
//#if COUNTING
    what |= select(0u, IS_COUNTED_FIRST, (*path).is_counted);
//#end
    first[0] = packed_vertex(vertex, what);
    first[1] = packed((*path).throughput, 0u);
//#if PERFECT_INTERFACES
    first_direction = (*path).ray.direction;
//#end
//#if LIFTED
    let is_lifted = vertex.point.lift > 0.0;
    first_normal = select(vec3f(0.0), vertex.point.geometric_normal, is_lifted);
//#end
    var pairs = 0u;
//#if MAP_SAMPLING
    pairs += 1u;
//#end
//#if LOCAL_LIGHTS
    pairs += 1u;
//#end
    (*path).sampler.pair = pair + pairs;
    (*path).map_samples = f32(MAP_SAMPLES);
    return true;
}

// Whether the path comes from its first vertex that scatters, and has met nothing since.
fn is_next_to_first(path: ptr<function, Path>) -> bool {
//#if PERFECT_INTERFACES
    return (*path).bounces == 1u && (*path).interfaces == 0u;
//#else
    return (*path).bounces == 1u;
//#end
}

// At the second vertex: whether it is shared, and the path ends.
fn meet_second(path: ptr<function, Path>, vertex: Vertex) -> bool {
    var shares = (first[0].w & IS_SHARED) != 0u
        && (*path).is_clear
        && (*path).departure_pdf_solid_angle < F32_MAX
        && is_alike_nearby(vertex);
    if shares {
        shares = is_vertex_true_from(vertex, -(*path).ray.direction);
    }
//#if LIFTED
    // Connections start from the triangle.
    shares = shares && dot(first_normal, (*path).ray.direction) >= 0.0;
//#end
    if shares {
        var what = IS_FOUND | ((*path).sampler.pair << 8u);
//#if COUNTING
        what |= select(0u, IS_COUNTED_SECOND, (*path).is_counted);
//#end
        second[0] = packed_vertex(vertex, what);
        let carried = max_element((*path).throughput);
        second[1] = packed((*path).ray.direction, bitcast<u32>(carried));
    }
    return shares;
}

// Keeps what was found for a lane of a group, and the light of its path.
fn keep_found(group: u32, lane: u32, path: ptr<function, Path>) {
    let at = first_at(group, lane);
    firsts[at] = first[0];
    firsts[at + 64u] = vec4u(first[1].xyz, (*path).rays);
    firsts[at + 128u] = packed((*path).radiance, 0u);
//#if PERFECT_INTERFACES
    firsts[at + 192u] = packed(first_direction, 0u);
//#end
//#if LAYERS
    let hit = (*path).first_hit;
    let looks_at = at + 64u * LOOKS_TEXEL;
    firsts[looks_at] = packed(hit.albedo, bitcast<u32>(hit.depth));
    firsts[looks_at + 64u] = packed(hit.normal, bitcast<u32>(hit.hits));
//#end
    let member = lane_member(group, lane);
    if member.is_owner {
        let kept_at = second_at(group, lane, member.square);
        let is_found = second[0].w != 0u;
        seconds[kept_at] =
            vec4u(second[0].xyz, select(0u, second[0].w | (lane % MEMBERS), is_found));
        seconds[kept_at + 1u] = second[1];
    }
}

@compute @workgroup_size(64)
fn find_seconds(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(local_invocation_index) lane_: u32,
) {
    own_lane = lane_;
    begin_items(lane_);
    var item = lane_;
    var path: Path;
    var is_over = true;
    var is_inside = true;
    loop {
        let group = workgroup.x * globals.work.rounds + item / 64u;
        let lane = item % 64u;
        if is_over {
            if is_past_items(item, group) {
                break;
            }
            let member = lane_member(group, lane);
            first[0] = vec4u(0u);
            second[0] = vec4u(0u);
            path = start_sample(member.place.x, member.place.y, globals.work.sample);
            is_inside = member.is_inside;
        }
        is_over = !(is_inside && path_step(&path));
        if is_over {
            keep_found(group, lane, &path);
            item = next_item();
        }
    }
}
