// What the map shows to the vertices of camera paths: twin of src/path/learn.rs and
// light_grid/counters.rs.

const WEIGHT_ONE = 256.0;
const MAX_WEIGHT = 4.0;
const NO_SLOT = 0xffffffffu;
const LEARNING_SEED = 0x6c656172u;

fn count(cell: u32, tile: u32, weight: f32) {
    atomicAdd(&visits[cell], 1u);
    let slot = slot_of_cell[cell];
    if slot == NO_SLOT {
        return;
    }
    let counter = 2u * (slot * globals.tile_columns * globals.tile_rows + tile);
    atomicAdd(&counters[counter], 1u);
    let scaled = u32(floor(clamp(weight, 0.0, MAX_WEIGHT) * WEIGHT_ONE + 0.5));
    if scaled > 0u {
        atomicAdd(&counters[counter + 1u], scaled);
    }
}

fn record(path: ptr<function, Path>, vertex: Vertex) {
    var law = WHOLE_MAP;
//#if record_ratio
    if (path_pair_bits(path).x >> 31u) == 0u {
        law = vertex.law;
    }
//#end
    let bits = path_pair_bits(path);
    let choice = sample_tile(law, bits.x);
    let sample = sample_in_tile(choice.tile, vec2f(choice.remainder, unit_from_bits(bits.y)));
    if sample.pdf_solid_angle <= 0.0 {
        return;
    }
    var cell = cell_of(vertex.point.position, vertex.point.geometric_normal);
//#if medium
    if vertex.is_in_medium {
        cell = cell_in_medium(vertex.point.position);
    }
//#end
    var weight = 0.0;
    let f = scattered(path, vertex, sample.direction);
    if max_element(f.value) > 0.0 {
        let visible = transmittance(path, vertex, sample.direction, F32_MAX);
//#if record_ratio
        weight = luminance(visible);
        var share = abs(dot(vertex.point.shading_frame.z, sample.direction));
//#if medium
        if vertex.is_in_medium {
            share = 4.0 * PI * f.pdf_solid_angle;
        }
//#end
//#if record_cosine
        weight *= share;
//#end
//#if record_squared_cosine
        weight *= share * share;
//#end
//#else
        let pdf = choice.probability * sample.pdf_solid_angle;
        weight = importance(f.value * sample.radiance * visible)
            / (pdf * globals.mean_contribution);
//#end
    }
    count(cell, choice.tile, weight);
}

@compute @workgroup_size(64)
fn learn(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let offset = group.x * 64u + lane;
    if offset >= globals.work.count {
        return;
    }
    // One long sequence over the whole picture; its high bits count its restarts.
    let index = globals.work.first + offset;
    let restarts = globals.work.first_high + select(0u, 1u, index < globals.work.first);
    var sampler = sampler_new(globals.seed ^ LEARNING_SEED, restarts, index);
    let on_picture = next_pair(&sampler);
    let lens = lens_point(&sampler);
    let pixel = on_picture * vec2f(f32(globals.width), f32(globals.height));
    var path = path_new(camera_ray(pixel, lens), sampler);
    while path_step(&path) {}
    atomicAdd(&learning_rays, path.rays);
}
