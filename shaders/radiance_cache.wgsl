// A world-space cache of reflected radiance: twin of src/radiance_cache/cells.rs, of what reads the cache
// in src/radiance_cache/look_up.rs, and of src/path/cached.rs.

struct CacheCell {
    coordinates: vec3i,
    kind: u32,
}

// Where a cell is looked for in the table, and what tells it apart there.
struct CacheKey {
    place: u32,
    check: u32,
}

fn cache_level(position: vec3f) -> u32 {
    let times = length(position - globals.cache_center) / globals.cache_least_distance;
    return min((bitcast<u32>(max(times, 1.0)) >> 23u) - 127u, 31u);
}

fn cache_edge(level: u32) -> f32 {
    return globals.cache_edge * f32(1u << level);
}

fn cache_cell(position: vec3f, normal: vec3f) -> CacheCell {
    let level = cache_level(position);
    let place = (position - globals.cache_center) / cache_edge(level) + 0.25 * normal;
    return CacheCell(vec3i(floor(place)), dominant_face(normal) | (level << 3u));
}

fn cache_parent(cell: CacheCell) -> CacheCell {
    return CacheCell(cell.coordinates >> vec3u(2u), cell.kind | CACHE_PARENT);
}

fn hash_of_cell(cell: CacheCell, seed: u32) -> u32 {
    let at = bitcast<vec3u>(cell.coordinates);
    return hash(hash(hash(hash(seed) ^ at.x) ^ at.y) ^ at.z);
}

fn cache_key(cell: CacheCell) -> CacheKey {
    return CacheKey(hash_of_cell(cell, cell.kind), hash_of_cell(cell, cell.kind ^ CACHE_CHECK_SEED) | 1u);
}

fn find_cached(key: CacheKey) -> vec4u {
    for (var probe = 0u; probe < CACHE_PROBES; probe++) {
        let slot = cache_slots((key.place + probe) & (CACHE_SLOTS - 1u));
        if slot.x == key.check || slot.x == 0u {
            return slot;
        }
    }
    return vec4u(0u);
}

// What radiance is divided by in the cache.
fn cached_albedo(vertex: Vertex) -> vec3f {
//#if SPLIT_LOBES
    return bsdf_albedo_towards(vertex.bsdf, vertex.wo);
//#else
    return bsdf_albedo(vertex.bsdf);
//#end
}

fn cached_radiance_over_albedo(position: vec3f, normal: vec3f) -> vec3f {
    let cell = cache_cell(position, normal);
    var slot = find_cached(cache_key(cell));
    if slot.x == 0u {
        slot = find_cached(cache_key(cache_parent(cell)));
    }
    return select(globals.cache_mean, bitcast<vec3f>(slot.yzw), slot.x != 0u);
}

//#if CACHED
// Ends the path at a vertex after its first if what it would find from there is averaged over more than
// a cell.
fn ends_in_cache(path: ptr<function, Path>, vertex: Vertex) -> bool {
    if globals.cache_is_known == 0u || (*path).bounces == 0u {
        return false;
    }
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
    let normal = vertex.point.geometric_normal;
    let position = vertex.point.position;
    let ends = is_known(path, vertex.point) && is_in_air(path)
        && !transmits(vertex) && is_broad(vertex, MIN_CACHED_ALPHA);
    (*path).spread = spread_at(path, normal);
    if ends {
        (*path).radiance += (*path).throughput
            * cached_albedo(vertex)
            * cached_radiance_over_albedo(position, normal);
    }
    return ends;
}

// How wide the path spreads where it has arrived.
fn spread_at(path: ptr<function, Path>, normal: vec3f) -> f32 {
    let pdf = (*path).departure_pdf_solid_angle;
    if pdf >= F32_MAX {
        return (*path).spread;
    }
    return (*path).spread + (*path).travelled / sqrt(pdf * abs(dot(normal, (*path).ray.direction)));
}

// Twin of `cached::is_known`, but for `is_in_air`.
fn is_known(path: ptr<function, Path>, point: SurfacePoint) -> bool {
    return globals.cache_is_known != 0u
        && spread_at(path, point.geometric_normal) >= cache_edge(cache_level(point.position));
}
//#end
