// Which distribution over the map's tiles a point uses, and the distributions: twin of src/light_grid/.

// Twin of `cells::dominant_face`.
fn dominant_face(normal: vec3f) -> u32 {
    let a = abs(normal);
    if a.x >= a.y && a.x >= a.z {
        return select(0u, 1u, normal.x < 0.0);
    }
    if a.y >= a.z {
        return select(2u, 3u, normal.y < 0.0);
    }
    return select(4u, 5u, normal.z < 0.0);
}

//#if MAP_SAMPLING
struct TileChoice {
    tile: u32,
    probability: f32,
    // A fresh 32-bit fraction of one.
    remainder: u32,
}

fn cell_of(position: vec3f, normal: vec3f) -> u32 {
//#if FACES
    return cell_on_face(position, dominant_face(normal));
//#else
    return cell_on_face(position, 0u);
//#end
}

//#if MEDIUM

fn cell_in_medium(position: vec3f) -> u32 {
//#if FACES
    return cell_on_face(position, select(0u, MEDIUM_FACE, globals.grid_medium != 0u));
//#else
    return cell_on_face(position, 0u);
//#end
}
//#end

fn cell_on_face(position: vec3f, face: u32) -> u32 {
    let uv = uv_from_direction(position - globals.grid_center);
    let column = min(u32(max(uv.x, 0.0) * f32(globals.grid_columns)), globals.grid_columns - 1u);
    let row = min(u32(max(uv.y, 0.0) * f32(globals.grid_rows)), globals.grid_rows - 1u);
    return (face * globals.grid_rows + row) * globals.grid_columns + column;
}

// The 16-bit number `index` of an array that begins at word `at`.
fn distribution_u16(at: u32, index: u32) -> u32 {
    return (distributions(at + index / 2u).x >> (16u * (index & 1u))) & 0xffffu;
}

fn distribution_of_cell(cell: u32) -> u32 {
    if globals.distribution_of_cell_at == NO_ARRAY {
        return WHOLE_MAP;
    }
    return distribution_u16(globals.distribution_of_cell_at, cell);
}

// Probability of the entry with numbers `low..=last`.
fn entry_probability(low: u32, last: u32) -> f32 {
    return (f32(last - low) + 1.0) * (1.0 / 4294967296.0);
}

// `finer` is the bits below `bits`.
fn sample_tile(distribution: u32, bits: u32, finer: u32) -> TileChoice {
    let start = distributions(globals.distribution_starts_at + distribution).x;
    let first = globals.distribution_last_at + start;
    var below = 0u;
    var above = distributions(globals.distribution_starts_at + distribution + 1u).x - start - 1u;
    while below < above {
        let middle = (below + above) / 2u;
        if distributions(first + middle).x < bits {
            below = middle + 1u;
        } else {
            above = middle;
        }
    }
    var low = 0u;
    if below > 0u {
        low = distributions(first + below - 1u).x + 1u;
    }
    let last = distributions(first + below).x;
    let count = f32(last - low) + 1.0;
    let remainder = min((f32(bits - low) + unit_from_bits(finer)) / count, 0.99999994);
    return TileChoice(
        distribution_u16(globals.distribution_tiles_at, start + below),
        entry_probability(low, last),
        (u32(remainder * 16777216.0) << 8u) | (finer & 0xffu),
    );
}

fn tile_probability(distribution: u32, tile: u32) -> f32 {
    let word = distribution * globals.words_per_distribution + tile / 64u;
    let mask = vec2u(
        distributions(globals.distribution_masks_at + 2u * word).x,
        distributions(globals.distribution_masks_at + 2u * word + 1u).x,
    );
    let in_high = (tile & 32u) != 0u;
    let bit = 1u << (tile & 31u);
    if (select(mask.x, mask.y, in_high) & bit) == 0u {
        return 0.0;
    }
    let below = select(countOneBits(mask.x & (bit - 1u)),
        countOneBits(mask.x) + countOneBits(mask.y & (bit - 1u)), in_high);
    let rank = distribution_u16(globals.distribution_ranks_at, word) + below;
    let entry = globals.distribution_last_at + distributions(globals.distribution_starts_at + distribution).x + rank;
    var low = 0u;
    if rank > 0u {
        low = distributions(entry - 1u).x + 1u;
    }
    return entry_probability(low, distributions(entry).x);
}

//#if LIGHT_GRID
// A probability of the whole map's distribution and one of a learned distribution, mixed.
fn mixed(whole_map: f32, learned: f32, whole_map_share: u32) -> f32 {
    let share = f32(whole_map_share) * (1.0 / 256.0);
    return share * whole_map + (1.0 - share) * learned;
}
//#end

// Twin of `LightGrid::sample_sharing`.
fn choose_tile(distribution: u32, both_bits: vec2u, whole_map_share: u32) -> TileChoice {
    var bits = both_bits.x;
    let finer = hash(bits ^ hash(both_bits.y));
//#if LIGHT_GRID
    if distribution == WHOLE_MAP || whole_map_share == 0u {
        return sample_tile(distribution, bits, finer);
    }
    // The number is split at the share; both parts keep its order.
    let by_whole_map = (bits >> 24u) < whole_map_share;
    let rest = bits - select(whole_map_share << 24u, 0u, by_whole_map);
    let width = select(256u - whole_map_share, whole_map_share, by_whole_map);
    bits = ((rest / width) << 8u) + ((((rest % width) << 8u) | (finer & 0xffu)) / width);
    var choice = sample_tile(select(distribution, WHOLE_MAP, by_whole_map), bits, finer);
    let other = tile_probability(select(WHOLE_MAP, distribution, by_whole_map), choice.tile);
    let probabilities = select(
        vec2f(other, choice.probability), vec2f(choice.probability, other), by_whole_map);
    choice.probability = mixed(probabilities.x, probabilities.y, whole_map_share);
    return choice;
//#else
    return sample_tile(WHOLE_MAP, bits, finer);
//#end
}

// Twin of `LightGrid::probability`.
fn choice_probability(distribution: u32, tile: u32) -> f32 {
    let learned = tile_probability(distribution, tile);
//#if LIGHT_GRID
    if distribution != WHOLE_MAP && globals.whole_map_share != 0u {
        let whole_map = tile_probability(WHOLE_MAP, tile);
        return mixed(whole_map, learned, globals.whole_map_share);
    }
//#end
    return learned;
}
//#end
