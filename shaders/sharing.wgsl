// Second vertices shared between the pixels of a tile: twin of src/path/sharing.rs, which says why that
// is right. `find_seconds` follows paths to their second vertices, `light_seconds` estimates what
// arrives at those that are kept, `connect_seconds` gathers light at the first vertices, from the second
// ones of the whole tile, too. A workgroup holds one tile or several.

// Pixels of a tile, and tiles of a workgroup.
const MEMBERS = TILE_SIDE * TILE_SIDE;
const TILES_OF_GROUP = 64u / MEMBERS;
// Second vertices of a tile.
const OWNERS = MEMBERS / (OWNER_SIDE * OWNER_SIDE);

// A pixel of a tile.
struct Member {
    // Outside of the picture if it is not less than its size.
    place: vec2u,
    is_inside: bool,
    // Of the squares of which each keeps one second vertex.
    square: u32,
    is_owner: bool,
}

// Pixel number `index` of a tile of the picture.
fn member_of(tile: u32, index: u32) -> Member {
    let seed = hash(globals.seed ^ hash(globals.work.sample ^ TILE_SEED));
    let before = vec2u(seed % TILE_SIDE, (seed >> 16u) % TILE_SIDE);
    let across = (globals.width + before.x + TILE_SIDE - 1u) / TILE_SIDE;
    let local = vec2u(index % TILE_SIDE, index / TILE_SIDE);
    let corner = vec2u(tile % max(across, 1u), tile / max(across, 1u)) * TILE_SIDE;
    var member: Member;
    // What is left of or above the picture becomes very large.
    member.place = corner + local - before;
    member.is_inside = member.place.x < globals.width && member.place.y < globals.height;
    let square = local / OWNER_SIDE;
    let within = local % OWNER_SIDE;
    member.square = square.y * (TILE_SIDE / OWNER_SIDE) + square.x;
    let chosen = hash(hash(seed + tile) + member.square) % (OWNER_SIDE * OWNER_SIDE);
    member.is_owner = within.y * OWNER_SIDE + within.x == chosen;
    return member;
}

fn lane_member(group: u32, lane: u32) -> Member {
    return member_of((globals.work.first + group) * TILES_OF_GROUP + lane / MEMBERS, lane % MEMBERS);
}

// Texels of a first vertex: triangle, barycentric coordinates and what it is; throughput and rays of its
// path; the radiance that path brought back on its own; if mirrors or glass may be before it, the direction it was
// found in. Then what the surface looks like.
const IS_SHARED = 1u;
const IS_COUNTED_FIRST = 2u;
//#if MEDIUM
// Of first and second vertices alike: one in fog, of which the position is kept in place of triangle and
// barycentric coordinates.
const IS_IN_MEDIUM = 0x80000000u;
//#end
//#if PERFECT_INTERFACES
const LOOKS_TEXEL = 4u;
//#else
const LOOKS_TEXEL = 3u;
//#end
//#if LAYERS
const FIRST_TEXELS = LOOKS_TEXEL + 2u;
//#else
const FIRST_TEXELS = LOOKS_TEXEL;
//#end

// Where a lane's first vertex is; texels of a workgroup's lie side by side.
fn first_at(group: u32, lane: u32) -> u32 {
    return group * FIRST_TEXELS * 64u + lane;
}

// Texels of a second vertex: triangle, barycentric coordinates and what it is; direction of the ray that
// found it and what its path carried. Then light that arrives, two texels each: direction; radiance over
// density, and rays.
const IS_FOUND = 64u;
const IS_COUNTED_SECOND = 128u;
//#if MAP_SAMPLING
const MAP_INCIDENTS = 1u;
//#else
const MAP_INCIDENTS = 0u;
//#end
//#if LOCAL_LIGHTS
const INCIDENTS = MAP_INCIDENTS + 2u;
//#else
const INCIDENTS = MAP_INCIDENTS + 1u;
//#end
const SECOND_TEXELS = 2u + 2u * CONTINUATIONS * INCIDENTS;

// Where the second vertex of a square of a lane's tile is.
fn second_at(group: u32, lane: u32, square: u32) -> u32 {
    return ((group * TILES_OF_GROUP + lane / MEMBERS) * OWNERS + square) * SECOND_TEXELS;
}

// A workgroup does the work of `globals.work.rounds` groups: each lane takes one item, and another one as soon as
// its path has ended, so that no lane waits for the longest path.
var<workgroup> items_taken: atomic<u32>;

fn begin_items(lane: u32) {
    if lane == 0u {
        atomicStore(&items_taken, 64u);
    }
    workgroupBarrier();
}

fn next_item() -> u32 {
    return atomicAdd(&items_taken, 1u);
}

// Whether there is no such item; it is of this group.
fn is_past_items(item: u32, group: u32) -> bool {
    return item >= 64u * globals.work.rounds || group >= globals.work.count;
}

fn packed(xyz: vec3f, w: u32) -> vec4u {
    return vec4u(bitcast<vec3u>(xyz), w);
}

fn packed_hit(triangle: u32, barycentric: vec2f, what: u32) -> vec4u {
    return vec4u(triangle, bitcast<vec2u>(barycentric), what);
}

// Whether a vertex that is kept so lies in fog.
fn is_kept_in_medium(what: u32) -> bool {
//#if MEDIUM
    return (what & IS_IN_MEDIUM) != 0u;
//#else
    return false;
//#end
}

// What comes with a vertex that is kept: the number of its next random numbers.
fn pair_in(what: u32, shift: u32) -> u32 {
//#if MEDIUM
    return (what & ~IS_IN_MEDIUM) >> shift;
//#else
    return what >> shift;
//#end
}

// The vertex where a ray along `direction` has hit a triangle or was scattered in fog.
fn vertex_at(path: ptr<function, Path>, hit: vec4u, direction: vec3f) -> Vertex {
//#if MEDIUM
    if is_kept_in_medium(hit.w) {
        return medium_vertex(path, float3(hit), globals.fog_mean_cosine);
    }
//#end
    var vertex: Vertex;
    vertex.point = surface_at(hit.x, bitcast<vec2f>(hit.yz), direction);
    vertex.bsdf = bsdf_new(vertex.point.parameters, vertex.point.front_face);
    vertex.wo = local_from_world(vertex.point.shading_frame, -direction);
    vertex.distribution = WHOLE_MAP;
//#if LIGHT_GRID
    vertex.cell = cell_of(vertex.point.position, vertex.point.geometric_normal);
    vertex.distribution = distribution_of_cell(vertex.cell);
//#end
    return vertex;
}

// Twin of `SurfaceScatterer::is_true_from`.
fn is_true_from(frame: Frame, b: Bsdf, geometric_normal: vec3f, to_viewer: vec3f) -> bool {
    var is_true = is_normal_true_from(frame.z, geometric_normal, to_viewer);
//#if CLEARCOAT
    if is_true && !coat_is_absent(b.coat) {
        let coat_normal = world_from_local(frame, b.coat.frame.z);
        is_true = is_normal_true_from(coat_normal, geometric_normal, to_viewer);
    }
//#end
    return is_true;
}

fn is_normal_true_from(normal: vec3f, geometric_normal: vec3f, to_viewer: vec3f) -> bool {
    let geometric_cosine = dot(geometric_normal, to_viewer);
    let cosine = dot(normal, to_viewer);
    let mirrored = 2.0 * cosine * dot(normal, geometric_normal) - geometric_cosine;
    return geometric_cosine > 0.0 && cosine >= TRUE_COSINE_SHARE * geometric_cosine
        && mirrored >= min(TRUE_MIRROR_SHARE * geometric_cosine, TRUE_MIRROR_COSINE);
}
