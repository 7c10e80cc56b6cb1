// The environment map as a light: twin of src/environment/mod.rs. Patches are the areas within which
// radiance is read smoothly, see src/environment/patches.rs.

// How far patch edges lie before texel edges, in texels.
const MAP_SHIFT = 0.5;

// A patch by column and row, and a place in it, in [0,1]^2 of its extent.
struct MapPoint {
    at: vec2u,
    within: vec2f,
}

// Radiance of the texels at a patch's corners.
struct Corners {
    upper_left: vec3f,
    upper_right: vec3f,
    lower_left: vec3f,
    lower_right: vec3f,
}

struct EnvironmentSample {
    direction: vec3f,
    // Given the tile; zero if the tile is black.
    pdf_solid_angle: f32,
    radiance: vec3f,
    // That density over the one of the integers that drew the direction.
    weight: f32,
}

struct RadianceAndTilePdf {
    radiance: vec3f,
    tile: u32,
    pdf_solid_angle: f32,
}

// A patch chosen by a table.
struct PatchSample {
    at: vec2u,
    // What the random numbers have left, in [0,1]^2.
    within: vec2f,
    // Given the tile; zero if the table has no mass there.
    probability: f32,
}

// Patches of a tile: first, and one past the last.
struct TilePatches {
    first: vec2u,
    end: vec2u,
}

// Columns and rows of patches.
fn patch_grid() -> vec2u {
    return vec2u(globals.map_width, globals.map_height + 1u);
}

fn tile_patches(tile: u32) -> TilePatches {
    let tiles = vec2u(globals.tile_columns, globals.tile_rows);
    let size = patch_grid();
    let at = vec2u(tile % tiles.x, tile / tiles.x);
    return TilePatches(at * size / tiles, (at + 1u) * size / tiles);
}

fn tile_of_patch(at: vec2u) -> u32 {
    let tiles = vec2u(globals.tile_columns, globals.tile_rows);
    let tile = ((at + 1u) * tiles - 1u) / patch_grid();
    return tile.y * tiles.x + tile.x;
}

//#if MAP
// Of a row of patches: distance of the cosine at its upper edge from its pole's, which keeps its digits
// near that, the lower edge's less that, steradians of a patch.
fn patch_row(row: u32) -> vec3f {
    return tables(ROWS_AT + row).xyz;
}

// Whether a row's cosines are told from the upper pole.
fn is_upper_row(row: u32) -> bool {
    return 2u * row < patch_grid().y;
}

fn map_point(direction: vec3f) -> MapPoint {
    let uv = uv_from_direction(direction);
    let turned_u = uv.x - globals.rotation_turns;
    let u = select(turned_u, turned_u + 1.0, turned_u < 0.0);
    let x = u * f32(globals.map_width) + MAP_SHIFT;
    let column = u32(x);
    let y = uv.y * f32(globals.map_height) + MAP_SHIFT;
    let row = min(u32(y), patch_grid().y - 1u);
    let edges = patch_row(row);
    let near = (direction.x * direction.x + direction.z * direction.z) / (1.0 + abs(direction.y));
    let distance = select(2.0 - near, near, (direction.y >= 0.0) == is_upper_row(row));
    // The last half texel before the seam belongs to the patch across it.
    return MapPoint(
        vec2u(select(column, 0u, column >= globals.map_width), row),
        vec2f(x - floor(x), saturate((distance - edges.x) / edges.y)),
    );
}

fn map_texel(x: u32, y: u32) -> vec3f {
    return unpack_radiance(map_texels(y * globals.map_width + x).xy);
}

// Three 18-bit mantissas and a common exponent; packed by `layout::pack_radiance`.
fn unpack_radiance(words: vec2u) -> vec3f {
    let mantissas = vec3u(
        words.x & 0x3ffffu,
        ((words.x >> 18u) | (words.y << 14u)) & 0x3ffffu,
        (words.y >> 4u) & 0x3ffffu,
    );
    let scale = bitcast<f32>((words.y >> 24u) << 23u);
    return vec3f(mantissas) * (1.0 / 131072.0) * scale;
}

// Wrapped in u, clamped in v.
fn corners_of(at: vec2u) -> Corners {
    let left = select(at.x, globals.map_width, at.x == 0u) - 1u;
    let above = max(at.y, 1u) - 1u;
    let below = min(at.y, globals.map_height - 1u);
    return Corners(
        map_texel(left, above),
        map_texel(at.x, above),
        map_texel(left, below),
        map_texel(at.x, below),
    );
}

fn interpolated(corners: Corners, within: vec2f) -> vec3f {
    let upper = corners.upper_left + within.x * (corners.upper_right - corners.upper_left);
    let lower = corners.lower_left + within.x * (corners.lower_right - corners.lower_left);
    return upper + within.y * (lower - upper);
}

fn scaled_radiance(radiance: vec3f) -> vec3f {
    return min(radiance * globals.intensity, vec3f(F32_MAX));
}
//#end

fn environment_radiance(direction: vec3f) -> vec3f {
//#if MAP
    let point = map_point(direction);
    return scaled_radiance(interpolated(corners_of(point.at), point.within));
//#else
    return vec3f(0.0);
//#end
}

//#if MAP_SAMPLING
// Scaled importance of radiance at intensity 1. Drivers take a common factor out of a sum, which then
// overflows where radiance nearly does: so that is cut off.
fn map_importance(radiance: vec3f) -> f32 {
    return importance(min(radiance, vec3f(1e37)) * globals.importance_scale);
}

// Scaled energy of a patch of row `y` whose corners' importances add up to `sum`.
fn patch_energy(sum: f32, y: u32) -> f32 {
    return 0.25 * sum * patch_row(y).z;
}

// One over a tile's scaled energy.
fn inverse_energy(tile: u32) -> f32 {
    return tables(ROWS_AT + patch_grid().y + tile).x;
}

// Density of `sample_in_tile`, given the tile, where it shows this radiance.
fn tile_density(tile: u32, radiance: vec3f) -> f32 {
    return map_importance(radiance) * inverse_energy(tile);
}

fn radiance_and_tile_pdf(direction: vec3f) -> RadianceAndTilePdf {
    let point = map_point(direction);
    let tile = tile_of_patch(point.at);
    let radiance = interpolated(corners_of(point.at), point.within);
    let pdf = tile_density(tile, radiance);
    return RadianceAndTilePdf(scaled_radiance(radiance), tile, pdf);
}

// Twin of `patches::sample_linear`.
fn sample_linear(from_: f32, to: f32, u: f32) -> f32 {
    let sum = from_ + to;
    if sum <= 0.0 {
        return u;
    }
    let scale = select(1.0 / sum, 1.0, sum > 1e-15 && sum < 1e15);
    let a = from_ * scale;
    let b = to * scale;
    let root = sqrt(max(a * a + u * ((b - a) * (sum * scale)), 0.0));
    return min(u * (sum * scale) / max(a + root, 1.17549435e-38), 1.0);
}

// Draws a direction from a tile by two 32-bit fractions of one.
fn sample_in_tile(tile: u32, u: vec2u) -> EnvironmentSample {
    var result: EnvironmentSample;
    let chosen = sample_patch(tile, refine(u));
    if chosen.probability <= 0.0 {
        return result;
    }
    let corners = corners_of(chosen.at);
    let a = map_importance(corners.upper_left);
    let b = map_importance(corners.upper_right);
    let c = map_importance(corners.lower_left);
    let d = map_importance(corners.lower_right);
    let down = sample_linear(a + b, c + d, chosen.within.y);
    let across = sample_linear(a + down * (c - a), b + down * (d - b), chosen.within.x);
    let radiance = interpolated(corners, vec2f(across, down));
    result.radiance = scaled_radiance(radiance);
    result.pdf_solid_angle = tile_density(tile, radiance);
    let row = patch_row(chosen.at.y);
    let energy = patch_energy(a + b + c + d, chosen.at.y);
    result.weight = energy * inverse_energy(tile) / chosen.probability;

    let x = f32(chosen.at.x) + across - MAP_SHIFT;
    let world_turns = x / f32(globals.map_width) + globals.rotation_turns - 0.5;
    let sin_cos_phi = sin_cos_turns(world_turns);
    let distance = row.x + down * row.y;
    let cos_theta = select(distance - 1.0, 1.0 - distance, is_upper_row(chosen.at.y));
    let sin_theta = sqrt(max(distance * (2.0 - distance), 0.0));
    result.direction = vec3f(sin_theta * sin_cos_phi.y, cos_theta, sin_theta * sin_cos_phi.x);
    return result;
}

// Twin of `environment::refine`: 32 more bits below each number, as (coarse, fine).
fn refine(u: vec2u) -> array<vec2u, 2> {
    let fine_x = hash(hash(u.x) ^ u.y);
    return array<vec2u, 2>(vec2u(u.x, fine_x), vec2u(u.y, hash(fine_x ^ u.x)));
}
//#end
