// Exact integer sums tile by tile: twin of src/environment/tile_local.rs.

struct Choice {
    index: u32,
    mass: u32,
    fraction: f32,
}

// Finds the entry of the inclusive prefix sums `sums(first).x..` that holds `u` of the total.
fn choose(first: u32, count: u32, u: vec2u) -> Choice {
    let total = sums(first + count - 1u).x;
    // total * u as whole units and 2^-32 parts of one.
    let coarse = multiply_wide(total, u.x);
    let fine = multiply_wide(total, u.y);
    let part = (fine.x << 16u) | (fine.y >> 16u);
    let parts = (coarse.y << 8u) + part;
    let carry = select(0u, 1u, parts < part);
    let whole = ((coarse.x << 8u) | (coarse.y >> 24u)) + (fine.x >> 16u) + carry;
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

fn first_row_sum(tile: u32, texels: TileTexels) -> u32 {
    return globals.tile_sums_at + texels.first.y * globals.tile_columns
        + (tile % globals.tile_columns) * (texels.end.y - texels.first.y);
}

fn first_column_sum(texels: TileTexels, row: u32) -> u32 {
    return texels.first.y * globals.map_width
        + texels.first.x * (texels.end.y - texels.first.y)
        + row * (texels.end.x - texels.first.x);
}

fn sample_texel(tile: u32, u: vec2f) -> TexelSample {
    var result: TexelSample;
    let texels = tile_texels(tile);
    let size = texels.end - texels.first;
    let rows = first_row_sum(tile, texels);
    let total = sums(rows + size.y - 1u).x;
    if total == 0u {
        return result;
    }
    let fine = refine(u);
    let row = choose(rows, size.y, fine[1]);
    let column = choose(first_column_sum(texels, row.index), size.x, fine[0]);
    result.texel = texels.first + vec2u(column.index, row.index);
    result.within = vec2f(column.fraction, row.fraction);
    result.probability = f32(column.mass) / f32(total);
    return result;
}

fn texel_probability(tile: u32, texel: vec2u) -> f32 {
    let texels = tile_texels(tile);
    let size = texels.end - texels.first;
    let total = sums(first_row_sum(tile, texels) + size.y - 1u).x;
    if total == 0u {
        return 0.0;
    }
    let columns = first_column_sum(texels, texel.y - texels.first.y);
    let column = texel.x - texels.first.x;
    var before = 0u;
    if column > 0u {
        before = sums(columns + column - 1u).x;
    }
    return f32(sums(columns + column).x - before) / f32(total);
}
