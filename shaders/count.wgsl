// What samples of the map see, counted: twin of src/light_grid/counters.rs and of part of src/path/learn.rs.

const NO_SLOT = 0xffffffffu;

// A try's counter of what is seen, 0 if it has none, and what its share of light is multiplied by.
struct Visibility {
    counter: u32,
    share: f32,
}

// Counts a try of a tile of the map, if this path's are counted; returns the counter of its weight, 0
// if there is none.
fn count_try(path: ptr<function, Path>, vertex: Vertex, tile: u32) -> u32 {
    if !(*path).is_counted || (*path).bounces > MAX_COUNTED {
        return 0u;
    }
//#if MEDIUM
    // Inside of a solid the map is never seen; its vertices would spoil what fog sees.
    if vertex.is_in_medium && is_in_solid(path) {
        return 0u;
    }
//#end
    return count_try_in_cell(vertex.cell, tile);
}

fn count_try_in_cell(cell: u32, tile: u32) -> u32 {
    let slot = slot_of_cell[cell];
    if slot == NO_SLOT {
        atomicAdd(&visits[cell], 1u);
        return 0u;
    }
    let counter = 2u * (slot * globals.tile_columns * globals.tile_rows + tile);
    atomicAdd(&counters[counter], 1u);
    return counter + 1u;
}

// Adds the weight of a try to its counter.
fn count_weight(counter: u32, weight: f32) {
    let scaled = u32(floor(clamp(weight, 0.0, MAX_WEIGHT) * WEIGHT_ONE + 0.5));
    if counter != 0u && scaled > 0u {
        atomicAdd(&counters[counter], scaled);
    }
}

//#if RECORD_RATIO
// What a try counts whose light is not held up: one, or what the surface or the phase function makes of
// its direction.
fn visibility_share(vertex: Vertex, direction: vec3f, own_pdf: f32) -> f32 {
    var share = abs(dot(vertex.point.shading_frame.z, direction));
//#if MEDIUM
    if vertex.is_in_medium {
        share = 4.0 * PI * own_pdf;
    }
//#end
//#if RECORD_COSINE
    return share;
//#else
    return 1.0;
//#end
}

// Counts what a try has seen of the light.
fn count_visible(visibility: Visibility, transmittance: vec3f) {
    count_weight(visibility.counter, luminance(transmittance) * visibility.share);
}
//#end
