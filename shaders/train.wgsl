// Training paths for the radiance cache: twin of src/path/train.rs and of what counts in
// src/radiance_cache/sums.rs.

const NO_CACHE_SLOT = 0xffffffffu;
const MAX_UNITS = 1099511627776.0;
const TWO_TO_32 = 4294967296.0;

// A vertex of the path that has not yet brought back all that the cache is to learn from it.
struct TrainingVertex {
    throughput: vec3f,
    slot: u32,
    radiance_before: vec3f,
    // Most luminance that is believed.
    most: f32,
}

var<private> training_vertices: array<TrainingVertex, TRAINING_VERTICES>;

// The slot of a cell, a new one if it has none.
fn slot_to_train(key: CacheKey) -> u32 {
    for (var probe = 0u; probe < CACHE_PROBES; probe++) {
        let slot = (key.place + probe) & (CACHE_SLOTS - 1u);
        loop {
            let found = atomicCompareExchangeWeak(&cache_sums[slot * CACHE_WORDS], 0u, key.check);
            if found.exchanged || found.old_value == key.check {
                return slot;
            }
            if found.old_value != 0u {
                break;
            }
        }
    }
    return NO_CACHE_SLOT;
}

// Bits that differ from place to place, for what may be the same everywhere.
fn dice(position: vec3f) -> u32 {
    let bits = bitcast<vec3u>(position);
    return hash(bits.x ^ hash(bits.y ^ hash(bits.z)));
}

// A whole number near `value`, of which no two are alike, as often above as makes the mean right, in floats.
fn dithered(value: f32) -> f32 {
    let bounded = clamp(value, 0.0, MAX_UNITS);
    return floor(bounded + unit_from_bits(hash(bitcast<u32>(bounded))));
}

fn training_vertex_at(path: ptr<function, Path>, vertex: Vertex) -> TrainingVertex {
    var trained = TrainingVertex(vec3f(0.0), NO_CACHE_SLOT, vec3f(0.0), F32_MAX);
    let throughput = (*path).throughput;
    let least = min(min(throughput.x, throughput.y), throughput.z);
    let trains = is_in_air(path)
        && !transmits(vertex) && is_broad(vertex, MIN_CACHED_ALPHA)
        && least > MIN_SHARE * max_element(throughput);
    if !trains {
        return trained;
    }
    let position = vertex.point.position;
    let normal = vertex.point.geometric_normal;
    let cell = cache_cell(position, normal);
    let parent = slot_to_train(cache_key(cache_parent(cell)));
    let slot = slot_to_train(cache_key(cell));
    if parent == NO_CACHE_SLOT || slot == NO_CACHE_SLOT {
        return trained;
    }
    let words = slot * CACHE_WORDS;
    var albedo = cached_albedo(vertex);
//#if SPLIT_LOBES
    // Parts of BSDFs have weights, which would bring their albedo above 1.
    let weight = max_element(vertex.bsdf.weights);
    albedo /= weight;
    trained.throughput = throughput * weight;
//#else
    trained.throughput = throughput;
//#end
    atomicStore(&cache_sums[words + 1u], parent + 1u);
    atomicAdd(&cache_sums[words + 2u], 1u);
    let bits = dice(position);
    for (var channel = 0u; channel < 3u; channel++) {
        let units = clamp(albedo[channel] * ALBEDO_ONE, 0.0, ALBEDO_ONE);
        let dithered_units = u32(units + unit_from_bits(hash(bits ^ channel)));
        atomicAdd(&cache_sums[words + 3u + channel], dithered_units);
    }
    if globals.cache_is_known != 0u {
        let known = luminance(cached_radiance_over_albedo(position, normal) * albedo);
        // Where nothing was found, nothing is known.
        if known > 0.0 {
            trained.most = MAX_TIMES * known;
        }
    }
    trained.slot = slot;
    trained.radiance_before = (*path).radiance;
    return trained;
}

// Adds what the path has brought back since.
fn end_training_vertex(path: ptr<function, Path>, index: u32) {
    let trained = training_vertices[index];
    training_vertices[index].slot = NO_CACHE_SLOT;
    if trained.slot == NO_CACHE_SLOT {
        return;
    }
    var radiance = ((*path).radiance - trained.radiance_before) / trained.throughput;
    if !is_finite3(radiance) {
        return;
    }
    let own = luminance(radiance);
    if own > trained.most {
        radiance *= trained.most / own;
    }
    for (var channel = 0u; channel < 3u; channel++) {
        let units = dithered(radiance[channel] * globals.cache_scale);
        let high = floor(units / TWO_TO_32);
        let low = u32(units - high * TWO_TO_32);
        let at = trained.slot * CACHE_WORDS + 6u + 2u * channel;
        let before = atomicAdd(&cache_sums[at], low);
        let carry = select(0u, 1u, before + low < low);
        atomicAdd(&cache_sums[at + 1u], u32(high) + carry);
    }
}

// At each vertex of the path.
fn meet_training_vertices(path: ptr<function, Path>, vertex: Vertex) {
    let arrived = (*path).bounces;
    let window = globals.bounces - 1u;
    if arrived >= window && arrived - window < TRAINING_VERTICES {
        end_training_vertex(path, arrived - window);
    }
    if arrived < TRAINING_VERTICES {
        training_vertices[arrived] = training_vertex_at(path, vertex);
    }
}

@compute @workgroup_size(64)
fn train(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    own_lane = lane;
    let offset = group.x * 64u + lane;
    if offset >= globals.work.count {
        return;
    }
    for (var i = 0u; i < TRAINING_VERTICES; i++) {
        training_vertices[i].slot = NO_CACHE_SLOT;
    }
    var path = path_anywhere(offset, TRAINING_SEED);
    // Where the call is the condition itself, Mesa 22.3 adds light of some paths twice.
    var goes_on = true;
    while goes_on {
        goes_on = path_step(&path);
    }
    for (var i = 0u; i < TRAINING_VERTICES; i++) {
        end_training_vertex(&path, i);
    }
    atomicAdd(&learning_rays, path.rays);
}
