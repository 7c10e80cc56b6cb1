// The environment map as a light: twin of src/environment/mod.rs.

struct MapPoint {
    position: vec2f,
    texel: vec2u,
}

struct EnvironmentSample {
    direction: vec3f,
    // Given the tile; zero if the tile is black.
    pdf_solid_angle: f32,
    radiance: vec3f,
}

struct RadianceAndTilePdf {
    radiance: vec3f,
    tile: u32,
    pdf_solid_angle: f32,
}

// A texel chosen by a table.
struct TexelSample {
    texel: vec2u,
    // Place in the texel, in [0,1]^2.
    within: vec2f,
    // Given the tile; zero if the table has no mass there.
    probability: f32,
}

// Texels of a tile: first, and one past the last.
struct TileTexels {
    first: vec2u,
    end: vec2u,
}

fn tile_texels(tile: u32) -> TileTexels {
    let tiles = vec2u(globals.tile_columns, globals.tile_rows);
    let size = vec2u(globals.map_width, globals.map_height);
    let at = vec2u(tile % tiles.x, tile / tiles.x);
    return TileTexels(at * size / tiles, (at + 1u) * size / tiles);
}

fn tile_of_texel(texel: vec2u) -> u32 {
    let tiles = vec2u(globals.tile_columns, globals.tile_rows);
    let size = vec2u(globals.map_width, globals.map_height);
    let at = ((texel + 1u) * tiles - 1u) / size;
    return at.y * tiles.x + at.x;
}

fn map_point(direction: vec3f) -> MapPoint {
    let uv = uv_from_direction(direction);
    let turned_u = uv.x - globals.rotation_turns;
    let u = select(turned_u, turned_u + 1.0, turned_u < 0.0);
    let size = vec2u(globals.map_width, globals.map_height);
    let position = vec2f(u, uv.y) * vec2f(size);
    return MapPoint(position, min(vec2u(position), size - 1u));
}

//#if map
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

fn radiance_at(point: MapPoint) -> vec3f {
//#if nearest_lookup
    let radiance = map_texel(point.texel.x, point.texel.y);
//#else
    let size = vec2u(globals.map_width, globals.map_height);
    let x = point.position.x - 0.5;
    let y = clamp(point.position.y - 0.5, 0.0, f32(size.y - 1u));
    let across = x - floor(x);
    let down = y - floor(y);
    let left = select(min(u32(max(x, 0.0)), size.x - 1u), size.x - 1u, x < 0.0);
    let right = select(0u, left + 1u, left + 1u < size.x);
    let top = u32(y);
    let bottom = min(top + 1u, size.y - 1u);
    let upper = mix(map_texel(left, top), map_texel(right, top), across);
    let lower = mix(map_texel(left, bottom), map_texel(right, bottom), across);
    let radiance = mix(upper, lower, down);
//#end
    return min(radiance * globals.intensity, vec3f(F32_MAX));
}

//#end

fn environment_radiance(direction: vec3f) -> vec3f {
//#if map
    return radiance_at(map_point(direction));
//#else
    return vec3f(0.0);
//#end
}

//#if map_sampling
// Distance of the cosine at a row's upper and lower edge from its pole's, which keeps its digits
// near it; 1 / steradian of a texel.
fn map_row(row: u32) -> vec3f {
    return tables(ROWS_AT + row).xyz;
}

fn radiance_and_tile_pdf(direction: vec3f) -> RadianceAndTilePdf {
    let point = map_point(direction);
    let tile = tile_of_texel(point.texel);
    let probability = texel_probability(tile, point.texel);
    return RadianceAndTilePdf(
        radiance_at(point),
        tile,
        probability * map_row(point.texel.y).z,
    );
}

// Draws a direction from a tile; `u` in [0,1)^2.
fn sample_in_tile(tile: u32, u: vec2f) -> EnvironmentSample {
    var result: EnvironmentSample;
    let chosen = sample_texel(tile, u);
    if chosen.probability <= 0.0 {
        return result;
    }
    let size = vec2f(f32(globals.map_width), f32(globals.map_height));
    let margin = min(vec2f(size.x, 4.0 * size.y) * (1.0 / 4194304.0), vec2f(0.25));
    let within = margin + chosen.within * (1.0 - 2.0 * margin);

    let x = f32(chosen.texel.x) + within.x;
    let world_turns = x / size.x + globals.rotation_turns - 0.5;
    let sin_cos_phi = sin_cos_turns(world_turns - round(world_turns));
    let row = map_row(chosen.texel.y);
    let z = mix(row.x, row.y, within.y);
    let is_upper = 2u * chosen.texel.y + 1u <= globals.map_height;
    let cos_theta = select(z - 1.0, 1.0 - z, is_upper);
    let sin_theta = sqrt(max(z * (2.0 - z), 0.0));
    result.direction = vec3f(sin_theta * sin_cos_phi.y, cos_theta, sin_theta * sin_cos_phi.x);

    let y = uv_from_direction(result.direction).y * size.y;
    result.radiance = radiance_at(MapPoint(vec2f(x, y), chosen.texel));
    result.pdf_solid_angle = chosen.probability * row.z;
    return result;
}

// Twin of `environment::refine`: 24 more bits below each random number's last, as (coarse, fine).
fn refine(u: vec2f) -> array<vec2u, 2> {
    let x = min(u32(u.x * 16777216.0), 0xffffffu);
    let y = min(u32(u.y * 16777216.0), 0xffffffu);
    let fine_x = hash(hash(x) ^ y);
    return array<vec2u, 2>(vec2u(x, fine_x >> 8u), vec2u(y, hash(fine_x ^ x) >> 8u));
}
//#end
