// Gathers light at the first vertices: from the map and from lamps, and from the second vertices that
// their tile has kept. Then the samples are added to the film.

// Second vertices of a tile that are looked at together.
const BATCH = 4u;

struct Second {
    // 0 if there is none, else as in `seconds`.
    what: u32,
    position: vec3f,
    geometric_normal: vec3f,
//#if AIMING
    triangle: u32,
//#end
//#if LIFTED
    lift: f32,
//#end
    shading_frame: Frame,
    bsdf: Bsdf,
//#if !SHEEN
    // What its body scatters, but for the share that leaves it.
    diffuse: vec3f,
//#end
}

var<workgroup> batch: array<Second, TILES_OF_GROUP * BATCH>;
// What of a second vertex's radiance reaches a lane's pixel, and the density with which it would have
// found that vertex.
var<workgroup> connections: array<vec4f, 64u * BATCH>;
// Sums of BATCH densities that follow each other in `connections`: of pixels of one tile, for one second vertex.
var<workgroup> partial_densities: array<f32, 64u>;

// What connects a lane's first vertex with second vertex `index` of the batch.
fn connection(path: ptr<function, Path>, vertex: Vertex, index: u32, member: u32) -> vec4f {
    let what = batch[index].what;
    let normal = batch[index].geometric_normal;
    let position = batch[index].position;
    let to_second = position - vertex.point.position;
    let squared = dot(to_second, to_second);
    let direction = to_second / sqrt(squared);
    let cosine = select(-dot(normal, direction), 1.0, is_kept_in_medium(what));
    if what == 0u || !(cosine > 0.0 && squared > 0.0) {
        return vec4f(0.0);
    }
//#if LIFTED
    // Connections start from the vertex.
    if lifts(vertex.point, direction) {
        return vec4f(0.0);
    }
//#end
    let is_in_medium = is_kept_in_medium(what);
    let f = scattered(path, vertex, direction);
    let carried = (*path).throughput * f.value;
    if max_element(carried) <= 0.0 {
        return vec4f(0.0);
    }
    if (what & 63u) != member {
        if !is_in_medium
            && !is_true_from(batch[index].shading_frame, batch[index].bsdf, normal, -direction) {
            return vec4f(0.0);
        }
        let origin = vertex_origin_toward(vertex, direction);
        var target_ = position;
        if !is_in_medium {
            target_ = offset_origin(position, normal);
        }
        let way = target_ - origin;
        let distance = length(way);
        (*path).rays += 1u;
//#if CLEAR_SOLIDS
        meets_glass = false;
//#end
        let visible = transmittance_along(Ray(origin, way / distance, distance * SHADOW_RAY_SHARE));
        if any(visible != vec3f(1.0)) {
            return vec4f(0.0);
        }
//#if CLEAR_SOLIDS
        if meets_glass {
            return vec4f(0.0);
        }
//#end
    }
    let area = cosine / squared;
    var pdf = f.pdf_solid_angle;
//#if AIMING
    if may_aim(path, vertex) {
        if is_in_medium {
            pdf *= 1.0 - globals.aim_probability;
        } else {
            let triangle = batch[index].triangle;
            pdf = aiming_pdf(receiver_of(vertex), triangle, direction, sqrt(squared), pdf);
        }
    }
//#end
    let density = pdf * area / f32(OWNER_SIDE * OWNER_SIDE);
//#if MEDIUM
    let way = fog_stretch(vertex.point.position, direction, sqrt(squared));
    let flown = crossing(way.interior, carried, max(way.end - way.start, 0.0), is_in_medium);
    return vec4f(carried * area * flown.weight, density * flown.density);
//#else
    return vec4f(carried * area, density);
//#end
}

// Below which cosine to the geometric normal light comes from behind second vertex `index` of the batch.
fn horizon_of_second(index: u32) -> f32 {
//#if LIFTED
    let normal = batch[index].geometric_normal;
    return horizon_of(normal, batch[index].shading_frame.z, batch[index].lift);
//#else
    return 0.0;
//#end
}

// Whether light from a direction, `wi` in the shading frame, is on one side of both normals of second vertex `index`.
fn is_on_one_side(index: u32, direction: vec3f, wi: vec3f, horizon: f32) -> bool {
    return (wi.z > 0.0) == (dot(batch[index].geometric_normal, direction) > horizon);
}

//#if !SHEEN
// What the body of second vertex `index` of the batch scatters of the light that is kept at `at`, but for the share
// that leaves it towards a viewer.
fn diffuse_light_of(index: u32, at: u32) -> vec3f {
    let body = batch[index].bsdf.diffuse;
    var light = vec3f(0.0);
    if diffuse_is_absent(body) {
        return light;
    }
    let horizon = horizon_of_second(index);
    for (var i = 0u; i < CONTINUATIONS * INCIDENTS; i++) {
        let arriving = seconds[at + 2u * i + 2u];
        let wi = local_from_world(batch[index].shading_frame, float3(arriving));
        if is_on_one_side(index, float3(arriving), wi, horizon) && diffuse_is_seen(body, wi) {
            let scattered_ = diffuse_eval_pdf(body, bitcast<f32>(arriving.w), wi).value;
            light += scattered_ * float3(seconds[at + 2u * i + 3u]);
        }
    }
    return light;
}
//#end

// Radiance of second vertex `index` of the batch towards a first one.
fn radiance_from(index: u32, at: u32, position: vec3f) -> vec3f {
    let direction = normalize(position - batch[index].position);
    var radiance = vec3f(0.0);
//#if MEDIUM
    if is_kept_in_medium(batch[index].what) {
        for (var i = 0u; i < CONTINUATIONS * INCIDENTS; i++) {
            let from_ = float3(seconds[at + 2u * i + 2u]);
            let turned = phase_pdf_solid_angle(globals.fog_mean_cosine, -dot(from_, direction));
            radiance += turned * float3(seconds[at + 2u * i + 3u]);
        }
        return radiance;
    }
//#end
    let frame = batch[index].shading_frame;
    let bsdf = batch[index].bsdf;
    let wo = local_from_world(frame, direction);
    var out = bsdf_outgoing(bsdf, wo);
//#if !SHEEN
    radiance = batch[index].diffuse * (out.diffuse_left * coat_attenuation(bsdf.coat, wo));
//#if SPLIT_LOBES
    radiance *= max_element(bsdf.weights);
//#end
    if out.coat_probability + out.interface_probability + out.rescatter_probability <= 0.0 {
        return radiance;
    }
    out.diffuse_probability = 0.0;
//#end
    let horizon = horizon_of_second(index);
    for (var i = 0u; i < CONTINUATIONS * INCIDENTS; i++) {
        let light = float3(seconds[at + 2u * i + 3u]);
        if any(light != vec3f(0.0)) {
            let from_ = float3(seconds[at + 2u * i + 2u]);
            let wi = local_from_world(frame, from_);
            if is_on_one_side(index, from_, wi, horizon) {
                radiance += bsdf_eval_pdf_with(bsdf, wo, wi, out).value * light;
            }
        }
    }
    return radiance;
}

@compute @workgroup_size(64)
fn connect_seconds(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let member = lane_member(group.x, lane);
    let at = first_at(group.x, lane);
    let hit = firsts[at];
    let shares = (hit.w & IS_SHARED) != 0u;
    var path: Path;
    var vertex: Vertex;
    if member.is_inside {
        path = start_sample(member.place.x, member.place.y, globals.work.sample);
        let carried = firsts[at + 64u];
        path.throughput = float3(carried);
        path.rays = carried.w;
        path.radiance = float3(firsts[at + 128u]);
        path.bounces = 1u;
    }
    if shares {
//#if PERFECT_INTERFACES
        path.ray.direction = float3(firsts[at + 192u]);
//#end
        vertex = vertex_at(&path, hit, path.ray.direction);
//#if SPLIT_LOBES
        vertex.bsdf = broad_part_of_first(vertex.bsdf, vertex.wo);
//#end
        path.sampler.pair = pair_in(hit.w, 2u);
        path.map_samples = f32(MAP_SAMPLES);
//#if COUNTING
        path.is_counted = (hit.w & IS_COUNTED_FIRST) != 0u;
//#end
//#if MAP_SAMPLING
        for (var i = 0u; i < MAP_SAMPLES; i++) {
            var stream = sampler_of_estimate(path.sampler, MAP_SAMPLES, i);
            let of_map = light_of_map(&path, vertex, next_pair_bits(&stream));
            add_light(&path, shadow_of(&path, vertex, of_map, true));
        }
        path.sampler.pair += 1u;
//#end
//#if LOCAL_LIGHTS
        add_light(&path, shadow_of(&path, vertex, light_of_lamps(&path, vertex), false));
//#end
    }
    let tile_in_group = lane / MEMBERS;
    for (var first_of_batch = 0u; first_of_batch < OWNERS; first_of_batch += BATCH) {
        workgroupBarrier();
        if lane < TILES_OF_GROUP * BATCH {
            let second_at_ =
                second_at(group.x, lane / BATCH * MEMBERS, first_of_batch + lane % BATCH);
            let found = seconds[second_at_];
            batch[lane].what = found.w;
            batch[lane].position = float3(found);
            if (found.w & IS_FOUND) == 0u {
                batch[lane].what = 0u;
            } else if !is_kept_in_medium(found.w) {
                let point =
                    surface_at(found.x, bitcast<vec2f>(found.yz), float3(seconds[second_at_ + 1u]));
                batch[lane].position = point.position;
                batch[lane].geometric_normal = point.geometric_normal;
//#if AIMING
                batch[lane].triangle = point.triangle;
//#end
//#if LIFTED
                batch[lane].lift = point.lift;
//#end
                batch[lane].shading_frame = point.shading_frame;
                batch[lane].bsdf = bsdf_new(point.parameters, point.front_face);
//#if SPLIT_LOBES
                batch[lane].bsdf = broad_part_of_second(batch[lane].bsdf);
//#end
//#if !SHEEN
                batch[lane].diffuse = diffuse_light_of(lane, second_at_);
//#end
            }
        }
        workgroupBarrier();
        for (var i = 0u; i < BATCH; i++) {
            var found = vec4f(0.0);
            if shares {
                found = connection(&path, vertex, tile_in_group * BATCH + i, lane % MEMBERS);
            }
            connections[64u * i + lane] = found;
        }
        workgroupBarrier();
        var summed = 0.0;
        for (var m = 0u; m < BATCH; m++) {
            summed += connections[BATCH * lane + m].w;
        }
        partial_densities[lane] = summed;
        workgroupBarrier();
        for (var i = 0u; i < BATCH; i++) {
            let own = connections[64u * i + lane];
            if all(own.xyz == vec3f(0.0)) {
                continue;
            }
            var density = 0.0;
            for (var m = 0u; m < MEMBERS / BATCH; m++) {
                let of_tile = 64u * i + tile_in_group * MEMBERS;
                density += partial_densities[of_tile / BATCH + m];
            }
            let index = tile_in_group * BATCH + i;
            let second_at_ = second_at(group.x, lane, first_of_batch + i);
            let radiance = radiance_from(index, second_at_, vertex.point.position);
            let added = path.radiance + own.xyz * radiance / density;
            path.radiance = select(path.radiance, added, is_finite3(added));
        }
    }
    if !member.is_inside {
        return;
    }
    if member.is_owner {
        let second_at_ = second_at(group.x, lane, member.square);
        if (seconds[second_at_].w & IS_FOUND) != 0u {
            for (var i = 1u; i <= CONTINUATIONS; i++) {
                path.rays += seconds[second_at_ + 1u + 2u * INCIDENTS * i].w;
            }
        }
    }
//#if LAYERS
    let albedo = firsts[at + 64u * LOOKS_TEXEL];
    let normal = firsts[at + 64u * (LOOKS_TEXEL + 1u)];
    path.first_hit = FirstHit(
        float3(albedo), bitcast<f32>(albedo.w), float3(normal), bitcast<f32>(normal.w));
//#end
    let pixel = member.place.y * globals.width + member.place.x;
    // Another device may have been ahead in parts.
    if film_counts[pixel].x == globals.work.sample {
        add_to_film(pixel, &path);
    }
}
