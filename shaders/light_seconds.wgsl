// Estimates what arrives at the second vertices that are kept, one estimate a lane.

// Keeps a direction of light, and what coat and interface transmit of it to the body below.
fn put_incident(at: u32, vertex: Vertex, direction: vec3f, light: vec3f, rays: u32) {
    var left = 0.0;
//#if !SHEEN
    let wi = local_from_world(vertex.point.shading_frame, direction);
    left = bsdf_diffuse_left_at(vertex.bsdf, select(-wi, wi, wi.z > 0.0))
        * coat_attenuation(vertex.bsdf.coat, wi);
//#end
    seconds[at] = packed(direction, bitcast<u32>(left));
    put_light(at, light, rays);
}

fn put_light(at: u32, light: vec3f, rays: u32) {
    let is_valid = is_finite3(light);
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

// Where the light is kept that an estimate finds on its path onwards.
fn onward_at(group: u32, lane: u32) -> u32 {
    let item = 64u * group + lane;
    let incident = item % CONTINUATIONS * INCIDENTS + INCIDENTS - 1u;
    return item / CONTINUATIONS * SECOND_TEXELS + 2u + 2u * incident;
}

// Gathers light at the vertex of an estimate. The path that goes on from there is kept in a slot.
fn begin_estimate(group: u32, lane: u32) {
    let slot = slot_of(group, lane);
    slots[slot + 64u * STATE] = vec4u(0u, IS_IDLE, 0u, 0u);
    let item = 64u * group + lane;
    let owner = item / CONTINUATIONS;
    let estimate = item % CONTINUATIONS;
    let at = owner * SECOND_TEXELS;
    let hit = seconds[at];
    if (hit.w & IS_FOUND) == 0u {
        return;
    }
    let arrived = seconds[at + 1u];
    let direction = float3(arrived);
    let member = member_of(globals.work.first * TILES_OF_GROUP + owner / OWNERS, hit.w & 63u);
    let sample = globals.work.sample - globals.first_of_sequence;
    var sampler = sampler_of_pixel(globals.seed, member.place, sample);
    sampler.pair = pair_in(hit.w, 8u);
    sampler = sampler_of_estimate(sampler, CONTINUATIONS, estimate);
    var path = path_new(Ray(vec3f(0.0), direction, F32_MAX), sampler);
    path.bounces = 2u;
    path.throughput_before = bitcast<f32>(arrived.w);
//#if COUNTING
    path.is_counted = (hit.w & IS_COUNTED_SECOND) != 0u;
//#end
    var vertex = vertex_at(&path, hit, direction);
//#if SPLIT_LOBES
    vertex.bsdf = broad_part_of_second(vertex.bsdf);
//#end
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
//#if AIMING
    let by_bsdf = select(1.0, 1.0 - globals.aim_probability, path.aim != NO_AIM);
    let density = path.departure_pdf_solid_angle * by_bsdf;
//#else
    let density = path.departure_pdf_solid_angle;
//#end
    path.throughput_before *= max_element(path.throughput) / max(survival_, 1e-30);
    path.throughput = vec3f(1.0);
//#if MAP_SAMPLING
    put_incident(put_at, vertex, map_shadow.ray.direction, light_along(&path, map_shadow), 0u);
    put_at += 2u;
//#end
//#if LOCAL_LIGHTS
    put_incident(put_at, vertex, lamp_shadow.ray.direction, light_along(&path, lamp_shadow), 0u);
    put_at += 2u;
//#end
    put_incident(put_at, vertex, path.ray.direction, vec3f(0.0), path.rays);
    if survival_ > 0.0 {
        let weight = 1.0 / (survival_ * density * f32(CONTINUATIONS));
        write_path(slot, bitcast<u32>(weight), &path);
    }
}

@compute @workgroup_size(64)
fn light_seconds(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(local_invocation_index) lane_: u32,
) {
    own_lane = lane_;
    for (var round = 0u; round < globals.work.rounds; round++) {
        let group = workgroup.x * globals.work.rounds + round;
        if group < globals.work.count {
            begin_estimate(group, lane_);
        }
    }
    storageBarrier();
    begin_items(lane_);
    var item = lane_;
    var path: Path;
    var is_over = true;
    loop {
        let group = workgroup.x * globals.work.rounds + item / 64u;
        let lane = item % 64u;
        let slot = slot_of(group, lane);
        if is_over {
            if is_past_items(item, group) {
                break;
            }
            if slot_state(slot).what == IS_IDLE {
                item = next_item();
                continue;
            }
            path = read_path(slot);
        }
        is_over = !path_step(&path);
        if is_over {
            let light = path.radiance * bitcast<f32>(slot_state(slot).pixel);
            put_light(onward_at(group, lane), light, path.rays);
            item = next_item();
        }
    }
}
