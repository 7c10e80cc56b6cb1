// Exact integer sums tile by tile: twin of src/environment/tile_local.rs.

struct Choice {
    index: u32,
    mass: u32,
    fraction: f32,
}

// Finds the entry of the inclusive prefix sums `sums(first).x..` that holds the fraction `u`, 32 bits
// and 32 more below, of their total.
fn choose(first: u32, count: u32, total: u32, u: vec2u) -> Choice {
    // total * u as whole units and 2^-32 parts of one.
    let coarse = multiply_wide(total, u.x);
    let fine = multiply_wide(total, u.y);
    let parts = coarse.y + fine.x;
    let whole = coarse.x + select(0u, 1u, parts < fine.x);
    var low = 0u;
    var high = count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if sums(first + middle).x <= whole {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var before = 0u;
    if low > 0u {
        before = sums(first + low - 1u).x;
    }
    let mass = sums(first + low).x - before;
    let into = f32(whole - before) + f32(parts) * (1.0 / 4294967296.0);
    return Choice(low, mass, min(into / f32(mass), 1.0));
}

fn first_row_sum(tile: u32, patches: TilePatches) -> u32 {
    return globals.tile_sums_at + patches.first.y * globals.tile_columns
        + (tile % globals.tile_columns) * (patches.end.y - patches.first.y);
}

fn first_column_sum(patches: TilePatches, row: u32) -> u32 {
    return patches.first.y * globals.map_width
        + patches.first.x * (patches.end.y - patches.first.y)
        + row * (patches.end.x - patches.first.x);
}

fn sample_patch(tile: u32, u: array<vec2u, 2>) -> PatchSample {
    var result: PatchSample;
    let patches = tile_patches(tile);
    let size = patches.end - patches.first;
    let rows = first_row_sum(tile, patches);
    let total = sums(rows + size.y - 1u).x;
    if total == 0u {
        return result;
    }
    let row = choose(rows, size.y, total, u[1]);
    let column = choose(first_column_sum(patches, row.index), size.x, row.mass, u[0]);
    result.at = patches.first + vec2u(column.index, row.index);
    result.within = vec2f(column.fraction, row.fraction);
    result.probability = f32(column.mass) / f32(total);
    return result;
}
