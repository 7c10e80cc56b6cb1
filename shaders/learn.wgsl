// What the map shows to the vertices of camera paths: twin of src/path/learn.rs.

//#if RECORD_RATIO
const WHOLE_MAP_SHARE = 128u;
//#else
const WHOLE_MAP_SHARE = 256u;
//#end

// Samples the map to see what is visible of it.
fn look_at_map(path: ptr<function, Path>, vertex: Vertex, bits: vec2u) {
    let choice = choose_tile(vertex.distribution, bits, WHOLE_MAP_SHARE);
    let sample = sample_in_tile(choice.tile, vec2u(choice.remainder, bits.y));
    if sample.pdf_solid_angle <= 0.0 {
        return;
    }
    let counter = count_try(path, vertex, choice.tile);
    let f = scattered(path, vertex, sample.direction);
    if max_element(f.value) <= 0.0 {
        return;
    }
    var shadow = shadow_towards(path, vertex, sample.direction, F32_MAX);
    let visible = follow_shadow(path, &shadow);
//#if RECORD_RATIO
    let share = visibility_share(vertex, sample.direction, f.pdf_solid_angle);
    count_visible(Visibility(counter, share), visible);
//#else
    let pdf = choice.probability * sample.pdf_solid_angle;
    let weight = sample.weight * importance(f.value * sample.radiance * visible)
        / (pdf * globals.mean_contribution);
    count_weight(counter, weight);
//#end
}

// What gather.wgsl does in other kernels: nothing but looking.
fn gather(path: ptr<function, Path>, vertex: Vertex) {
//#if MEDIUM
    if vertex.is_in_medium && is_in_solid(path) {
        return;
    }
//#end
    if (*path).bounces > MAX_COUNTED {
        return;
    }
    let tries = globals.tries_per_vertex;
    for (var i = 0u; i < tries; i++) {
        var stream = sampler_of_estimate((*path).sampler, tries, i);
        look_at_map(path, vertex, next_pair_bits(&stream));
    }
    (*path).sampler.pair += 1u;
}

fn add_lights(path: ptr<function, Path>) {}

@compute @workgroup_size(64)
fn learn(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let offset = group.x * 64u + lane;
    if offset >= globals.work.count {
        return;
    }
    var path = path_anywhere(offset, LEARNING_SEED);
    path.is_counted = true;
    // Not in the condition; see train.wgsl.
    var goes_on = true;
    while goes_on {
        goes_on = path_step(&path);
    }
    atomicAdd(&learning_rays, path.rays);
}
