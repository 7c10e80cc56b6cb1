// Summed-area tables over the whole map: twin of src/environment/summed_area.rs. Masses are pairs
// of f32 that add up to them (48 bits), for want of f64; so are their sums and differences.

// `x` as an f32 of its own: drivers (Mesa, for one) take `(a + b) - a` for `b`, fuse products with sums and,
// where their maths is fast (Metal's), add in any order, which would leave nothing of the errors below.
fn rounded(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ globals.zero);
}

// Sum of two f32 and what rounding left of it (Knuth's two-sum).
fn two_sum(a: f32, b: f32) -> vec2f {
    let s = rounded(a + b);
    let v = rounded(s - a);
    return vec2f(s, rounded(a - rounded(s - v)) + rounded(b - v));
}

fn pair_difference(a: vec2f, b: vec2f) -> vec2f {
    let s = two_sum(a.x, -b.x);
    return two_sum(s.x, s.y + (a.y - b.y));
}

fn corner_at(x: u32, y: u32) -> vec2f {
    let index = y * (globals.map_width + 1u) + x;
//#if TABLE_U32
    let bits = sums(index).x;
    return vec2f(f32(bits & 0xffff0000u), f32(bits & 0xffffu));
//#end
//#if TABLE_F32
    return vec2f(bitcast<f32>(sums(index).x), 0.0);
//#end
//#if TABLE_F64
    return vec2f(bitcast<f32>(sums(2u * index).x), bitcast<f32>(sums(2u * index + 1u).x));
//#end
}

fn rectangle_mass(first: vec2u, end: vec2u) -> vec2f {
    return pair_difference(
        pair_difference(corner_at(end.x, end.y), corner_at(first.x, end.y)),
        pair_difference(corner_at(end.x, first.y), corner_at(first.x, first.y)),
    );
}

struct Choice {
    index: u32,
    mass: f32,
    fraction: f32,
}

// Mass of the entries before `end`: rows of the rectangle, or columns of its row.
fn mass_before(patches: TilePatches, along_y: bool, end: u32) -> vec2f {
    if along_y {
        return rectangle_mass(patches.first, vec2u(patches.end.x, end));
    }
    return rectangle_mass(patches.first, vec2u(end, patches.end.y));
}

fn search(patches: TilePatches, along_y: bool, u: vec2u) -> Choice {
    let first = select(patches.first.x, patches.first.y, along_y);
    let end = select(patches.end.x, patches.end.y, along_y);
    let total = mass_before(patches, along_y, end);
    // 24 bits and 24 below, of which f32 loses none.
    let unit = f32(u.x >> 8u) * (1.0 / 16777216.0);
    let rest = f32(((u.x & 0xffu) << 16u) | (u.y >> 16u)) * 3.5527137e-15; // 2^-48
    // The product with 24 more bits below: exact as far as the sums are.
    let high = rounded(total.x * unit);
    let error = product_error(total.x, unit, high);
    let sought = two_sum(high, error + total.x * rest + total.y * unit);
    var low = first;
    var last = end - 1u;
    while low < last {
        let middle = low + (last - low) / 2u;
        let above = pair_difference(mass_before(patches, along_y, middle + 1u), sought);
        if above.x + above.y > 0.0 {
            last = middle;
        } else {
            low = middle + 1u;
        }
    }
    let before = mass_before(patches, along_y, low);
    let mass = pair_difference(mass_before(patches, along_y, low + 1u), before);
    let into = pair_difference(sought, before);
    return Choice(low, mass.x, saturate(into.x / mass.x));
}

// What rounding left of the product `a * b = p` (Dekker's).
fn product_error(a: f32, b: f32, p: f32) -> f32 {
    let a_high = bitcast<f32>(bitcast<u32>(a) & 0xfffff000u);
    let b_high = bitcast<f32>(bitcast<u32>(b) & 0xfffff000u);
    let a_low = a - a_high;
    let b_low = b - b_high;
    let high = rounded(a_high * b_high - p);
    return rounded(rounded(high + a_high * b_low) + a_low * b_high) + a_low * b_low;
}

fn sample_patch(tile: u32, u: array<vec2u, 2>) -> PatchSample {
    var result: PatchSample;
    var patches = tile_patches(tile);
    let total = rectangle_mass(patches.first, patches.end);
    let row = search(patches, true, u[1]);
    if !(row.mass > 0.0 && total.x > 0.0) {
        return result;
    }
    patches.first.y = row.index;
    patches.end.y = row.index + 1u;
    let column = search(patches, false, u[0]);
    if !(column.mass > 0.0) {
        return result;
    }
    result.at = vec2u(column.index, row.index);
    result.within = vec2f(column.fraction, row.fraction);
    result.probability = patch_probability(tile, result.at);
    return result;
}

fn patch_probability(tile: u32, at: vec2u) -> f32 {
    let patches = tile_patches(tile);
    let total = rectangle_mass(patches.first, patches.end);
    let mass = rectangle_mass(at, at + 1u);
    return select(0.0, mass.x / total.x, total.x > 0.0 && mass.x > 0.0);
}
