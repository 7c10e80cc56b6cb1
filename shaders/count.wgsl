// What samples of the map see, counted: twin of light_grid/counters.rs and part of src/path/learn.rs.

const WEIGHT_ONE = 256.0;
const MAX_WEIGHT = 4.0;
const NO_SLOT = 0xffffffffu;

fn count_in_cell(cell: u32, tile: u32, weight: f32) {
    let slot = slot_of_cell[cell];
    if slot == NO_SLOT {
        atomicAdd(&visits[cell], 1u);
        return;
    }
    let counter = 2u * (slot * globals.tile_columns * globals.tile_rows + tile);
    atomicAdd(&counters[counter], 1u);
    let scaled = u32(floor(clamp(weight, 0.0, MAX_WEIGHT) * WEIGHT_ONE + 0.5));
    if scaled > 0u {
        atomicAdd(&counters[counter + 1u], scaled);
    }
}

// Counts a try of a tile of the map, if this path's are counted.
fn count(path: ptr<function, Path>, vertex: Vertex, tile: u32, weight: f32) {
    if !(*path).is_counted {
        return;
    }
//#if medium
    // Inside of a solid the map is never seen; its vertices would spoil what fog sees.
    if vertex.is_in_medium && is_in_solid(path) {
        return;
    }
//#end
    count_in_cell(vertex.cell, tile, weight);
}

//#if record_ratio
// What a try that met no obstacle but `transmittance` counts.
fn visibility(vertex: Vertex, direction: vec3f, own_pdf: f32, transmittance: vec3f) -> f32 {
    var share = abs(dot(vertex.point.shading_frame.z, direction));
//#if medium
    if vertex.is_in_medium {
        share = 4.0 * PI * own_pdf;
    }
//#end
    var weight = luminance(transmittance);
//#if record_cosine
    weight *= share;
//#end
//#if record_squared_cosine
    weight *= share * share;
//#end
    return weight;
}
//#end
