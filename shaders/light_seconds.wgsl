// Estimates what arrives at the second vertices that are kept, one estimate a lane.

fn put_incident(at: u32, direction: vec3f, light: vec3f, rays: u32) {
    let is_valid = is_finite3(light);
    seconds[at] = packed(direction, 0u);
    seconds[at + 1u] = packed(select(vec3f(0.0), light, is_valid), rays);
}

// With which probability a path that has left a second vertex survives; 0 if it has not. (`survives`
// divides by it at once: were it to ask this, a scene's kernel would take 16 registers more.)
fn survival(path: ptr<function, Path>) -> f32 {
    if !plays_roulette(path) {
        return 1.0;
    }
    let probability = roulette_probability(path);
    if probability < 1.0 {
        let draw = path_pair(path).y;
        if draw >= probability {
            return 0.0;
        }
    }
    return probability;
}

//#if SHADOW_RAYS
// What comes along a ray towards a light.
fn light_along(path: ptr<function, Path>, chosen: Shadow) -> vec3f {
    var shadow = chosen;
    let visible = follow_shadow(path, &shadow);
//#if COUNTING
    if any(visible != vec3f(0.0)) {
        count_visible(shadow.visibility, visible);
    }
//#end
    return shadow.light * visible * (shadow.weight / f32(CONTINUATIONS));
}

// The ray towards light that arrives, as it is before the vertex scatters it.
fn unscattered_shadow(
    path: ptr<function, Path>,
    vertex: Vertex,
    arriving: Arriving,
    is_of_map: bool,
) -> Shadow {
    var shadow = shadow_of(path, vertex, arriving, is_of_map);
    shadow.light = arriving.light;
//#if CLEAR_SOLIDS
    shadow.carried = vec3f(1.0);
//#end
    return shadow;
}
//#end

@compute @workgroup_size(64)
fn light_seconds(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let item = group.x * 64u + lane;
    let owner = item / CONTINUATIONS;
    let estimate = item % CONTINUATIONS;
    if owner >= globals.work.count * TILES_OF_GROUP * OWNERS {
        return;
    }
    let at = owner * SECOND_TEXELS;
    let hit = seconds[at];
    if (hit.w & IS_FOUND) == 0u {
        return;
    }
    let arrived = seconds[at + 1u];
    let direction = float3(arrived);
    let member = member_of(globals.work.first * TILES_OF_GROUP + owner / OWNERS, hit.w & 63u);
    let pixel = member.place.y * globals.width + member.place.x;
    var sampler =
        sampler_new(globals.seed, pixel, globals.work.sample - globals.first_of_sequence);
    sampler.pair = pair_in(hit.w, 8u);
    sampler = sampler_of_estimate(sampler, CONTINUATIONS, estimate);
    var path = path_new(Ray(vec3f(0.0), direction, F32_MAX), sampler);
    path.bounces = 2u;
    path.throughput_before = bitcast<f32>(arrived.w);
//#if COUNTING
    path.is_counted = (hit.w & IS_COUNTED_SECOND) != 0u;
//#end
    let vertex = vertex_at(&path, hit, direction);
    var put_at = at + 2u + 2u * INCIDENTS * estimate;
//#if MAP_SAMPLING
    let of_map = light_of_map(&path, vertex, path_pair_bits(&path));
    let map_shadow = unscattered_shadow(&path, vertex, of_map, true);
//#end
//#if LOCAL_LIGHTS
    let lamp_shadow = unscattered_shadow(&path, vertex, light_of_lamps(&path, vertex), false);
//#end
    var survival_ = 0.0;
    if scatter(&path, vertex) {
        survival_ = survival(&path);
    }
    let density = path.departure_pdf_solid_angle;
    let onwards = path.ray.direction;
    path.throughput_before *= max_element(path.throughput) / max(survival_, 1e-30);
    path.throughput = vec3f(1.0);
//#if MAP_SAMPLING
    put_incident(put_at, map_shadow.ray.direction, light_along(&path, map_shadow), 0u);
    put_at += 2u;
//#end
//#if LOCAL_LIGHTS
    put_incident(put_at, lamp_shadow.ray.direction, light_along(&path, lamp_shadow), 0u);
    put_at += 2u;
//#end
    var light = vec3f(0.0);
    if survival_ > 0.0 {
        while path_step(&path) {}
        light = path.radiance * (1.0 / (survival_ * density * f32(CONTINUATIONS)));
    }
    put_incident(put_at, onwards, light, path.rays);
}
