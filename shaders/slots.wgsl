// Paths between the kernels that bring them one ray further in turn: `trace` finds what their rays
// hit, `shade` what becomes of them there, `follow_shadows` what lights add. Each kernel has registers
// for its own part alone, and so more waves for the walks.
//
// A slot holds a path. Slots outnumber neither pixels nor what keeps a device busy: one whose pixel
// has all its samples takes the next pixel. See src/render/gpu/queue.rs.

// What the host reads of the work; see src/render/gpu/queue.rs.
struct Queue {
    // The next pixel to be taken.
    next: atomic<u32>,
    // Slots that hold a path.
    left: atomic<u32>,
    // Paths that were added to the film.
    samples: atomic<u32>,
    padding: u32,
}

// What a slot's path is; 0 where there is none.
// There are no more pixels.
const IS_IDLE = 1u;
const HAS_ENDED = 2u;
const GOES_ON = 3u;
// Added if it is counted.
const IS_COUNTED = 4u;

// Texels of a slot that all have.
const ORIGIN = 0u;
const DIRECTION = 1u;
const THROUGHPUT = 2u;
const RADIANCE = 3u;
const SAMPLER = 4u;
const STATE = 5u;
const HIT = 6u;

// Of the word that counts vertices.
const INTERFACES_SHIFT = 24u;

struct State {
    // Which pixel, tile after tile.
    pixel: u32,
    what: u32,
}

// A lane's slot: where its first texel is. Texels of a workgroup's slots lie side by side.
fn slot_of(group: u32, lane: u32) -> u32 {
    return group * SLOT_TEXELS * 64u + lane;
}

fn slot_read(slot: u32, texel: u32) -> vec4u {
    return slots[slot + 64u * texel];
}

fn slot_write(slot: u32, texel: u32, xyz: vec3f, w: u32) {
    slots[slot + 64u * texel] = vec4u(bitcast<vec3u>(xyz), w);
}

fn slot_state(slot: u32) -> State {
    let texel = slot_read(slot, STATE);
    return State(texel.x, texel.y & 3u);
}

// How many vertices a path has met.
fn vertices_of(path: ptr<function, Path>) -> u32 {
    var vertices = (*path).bounces;
//#if PERFECT_INTERFACES
    vertices |= (*path).interfaces << INTERFACES_SHIFT;
//#end
    return vertices;
}

fn read_vertices(vertices: u32, path: ptr<function, Path>) {
//#if PERFECT_INTERFACES
    (*path).bounces = vertices & ((1u << INTERFACES_SHIFT) - 1u);
    (*path).interfaces = vertices >> INTERFACES_SHIFT;
//#else
    (*path).bounces = vertices;
//#end
}

// The light of a slot's path so far.
fn read_radiance(slot: u32, path: ptr<function, Path>) {
    let texel = slot_read(slot, RADIANCE);
    (*path).radiance = float3(texel);
    (*path).rays = texel.w;
}

fn write_radiance(slot: u32, path: ptr<function, Path>) {
    slot_write(slot, RADIANCE, (*path).radiance, (*path).rays);
}

//#if LAYERS
fn read_first_hit(slot: u32, path: ptr<function, Path>) {
    let albedo = slot_read(slot, FIRST_HIT_TEXEL);
    let normal = slot_read(slot, FIRST_HIT_TEXEL + 1u);
    (*path).first_hit = FirstHit(
        float3(albedo), bitcast<f32>(albedo.w), float3(normal), bitcast<f32>(normal.w));
//#if PERFECT_INTERFACES
    let taken = slot_read(slot, FIRST_HIT_TEXEL + 2u);
    (*path).looks_before = bitcast<f32>(taken.w);
    (*path).looks_taken = float3(taken);
    (*path).looks_added = float3(slot_read(slot, FIRST_HIT_TEXEL + 3u));
//#end
}

fn write_first_hit(slot: u32, path: ptr<function, Path>) {
    let hit = (*path).first_hit;
    slot_write(slot, FIRST_HIT_TEXEL, hit.albedo, bitcast<u32>(hit.depth));
    slot_write(slot, FIRST_HIT_TEXEL + 1u, hit.normal, bitcast<u32>(hit.hits));
//#if PERFECT_INTERFACES
    let before = bitcast<u32>((*path).looks_before);
    slot_write(slot, FIRST_HIT_TEXEL + 2u, (*path).looks_taken, before);
    slot_write(slot, FIRST_HIT_TEXEL + 3u, (*path).looks_added, 0u);
//#end
}
//#end

// A slot's path, without rays towards lights.
fn read_path(slot: u32) -> Path {
    var path: Path;
    let origin = slot_read(slot, ORIGIN);
    let direction = slot_read(slot, DIRECTION);
    let throughput = slot_read(slot, THROUGHPUT);
    let sampler = slot_read(slot, SAMPLER);
    let state = slot_read(slot, STATE);
    path.ray = Ray(float3(origin), float3(direction), F32_MAX);
    path.departure_pdf_solid_angle = bitcast<f32>(origin.w);
    path.departure_distribution = direction.w;
    path.throughput = float3(throughput);
    path.travelled = bitcast<f32>(throughput.w);
    path.sampler = Sampler(sampler.x, sampler.y, sampler.z);
    read_vertices(sampler.w, &path);
    path.passes = state.z;
//#if COUNTING
    path.is_counted = (state.y & IS_COUNTED) != 0u;
//#end
    read_radiance(slot, &path);
//#if SHARING
    path.throughput_before = bitcast<f32>(slot_read(slot, HIT).x);
    path.map_samples = 1.0;
    path.departure_map_samples = 1.0;
//#end
//#if AREA_SOURCES
    let position = slot_read(slot, RECEIVER_TEXEL);
    let normal = slot_read(slot, RECEIVER_TEXEL + 1u);
    path.departure_receiver = Receiver(float3(position), float3(normal));
//#if AIMING
    path.aim = position.w;
//#end
//#end
//#if CLEAR_SOLIDS
    let departure_origin = slot_read(slot, DEPARTURE_TEXEL);
    path.departure_origin = float3(departure_origin);
    path.departure_direction = float3(slot_read(slot, DEPARTURE_TEXEL + 1u));
    path.is_refracted = departure_origin.w != 0u;
//#end
//#if SOLID_TRANSMISSION
    path.body.squared_index = bitcast<f32>(state.w);
    let inside = slot_read(slot, BODY_TEXEL);
//#if MEDIUM
    let extinction = slot_read(slot, BODY_TEXEL + 1u);
    path.body.interior =
        Interior(float3(inside), bitcast<f32>(inside.w), float3(extinction));
    path.body.is_solid = extinction.w != 0u;
//#else
    path.body.absorption = float3(inside);
//#end
//#end
//#if LAYERS
    read_first_hit(slot, &path);
//#end
    return path;
}

// Keeps a path of pixel `pixel` that goes on.
fn write_path(slot: u32, pixel: u32, path: ptr<function, Path>) {
    slot_write(slot, ORIGIN, (*path).ray.origin, bitcast<u32>((*path).departure_pdf_solid_angle));
    slot_write(slot, DIRECTION, (*path).ray.direction, (*path).departure_distribution);
    slot_write(slot, THROUGHPUT, (*path).throughput, bitcast<u32>((*path).travelled));
    let sampler = (*path).sampler;
    slots[slot + 64u * SAMPLER] =
        vec4u(sampler.reversed_index, sampler.sequence_seed, sampler.pair, vertices_of(path));
    var what = GOES_ON;
//#if COUNTING
    what |= select(0u, IS_COUNTED, (*path).is_counted);
//#end
    var squared_index = 1.0;
//#if SOLID_TRANSMISSION
    squared_index = (*path).body.squared_index;
//#end
    slots[slot + 64u * STATE] =
        vec4u(pixel, what, (*path).passes, bitcast<u32>(squared_index));
    write_radiance(slot, path);
//#if SHARING
    // Its ray has hit nothing yet.
    slot_write(slot, HIT, vec3f((*path).throughput_before, 0.0, 0.0), 0u);
//#end
//#if AREA_SOURCES
    let receiver = (*path).departure_receiver;
    var aim = 0u;
//#if AIMING
    aim = (*path).aim;
//#end
    slot_write(slot, RECEIVER_TEXEL, receiver.position, aim);
    slot_write(slot, RECEIVER_TEXEL + 1u, receiver.normal, 0u);
//#end
//#if CLEAR_SOLIDS
    let is_refracted = select(0u, 1u, (*path).is_refracted);
    slot_write(slot, DEPARTURE_TEXEL, (*path).departure_origin, is_refracted);
    slot_write(slot, DEPARTURE_TEXEL + 1u, (*path).departure_direction, 0u);
//#end
//#if SOLID_TRANSMISSION
//#if MEDIUM
    let inside = (*path).body.interior;
    slot_write(slot, BODY_TEXEL, inside.scattering, bitcast<u32>(inside.mean_cosine));
    slot_write(slot, BODY_TEXEL + 1u, inside.extinction, select(0u, 1u, (*path).body.is_solid));
//#else
    slot_write(slot, BODY_TEXEL, (*path).body.absorption, 0u);
//#end
//#end
//#if LAYERS
    write_first_hit(slot, path);
//#end
}

//#if SHADOW_RAYS
fn read_shadow(slot: u32, texel: u32) -> Shadow {
    var shadow: Shadow;
    let origin = slot_read(slot, texel);
    shadow.ray.t_max = bitcast<f32>(origin.w);
    if shadow.ray.t_max <= 0.0 {
        return shadow;
    }
    let direction = slot_read(slot, texel + 1u);
    let light = slot_read(slot, texel + 2u);
    shadow.ray.origin = float3(origin);
    shadow.ray.direction = float3(direction);
    shadow.weight = bitcast<f32>(direction.w);
    shadow.light = float3(light);
//#if SHADOW_MEDIA
    shadow.left = float3(slot_read(slot, texel + 3u));
//#end
//#if COUNTING
    shadow.visibility =
        Visibility(light.w, bitcast<f32>(slot_read(slot, texel + 3u).w));
//#end
//#if CLEAR_SOLIDS
    read_glass_shadow(slot, texel + 4u, &shadow);
//#end
    return shadow;
}

//#if CLEAR_SOLIDS
// What a shadow needs if it meets glass. The map's needs less.
fn read_glass_shadow(slot: u32, texel: u32, shadow: ptr<function, Shadow>) {
    let carried = slot_read(slot, texel);
    let body = slot_read(slot, texel + 1u);
    (*shadow).is_of_map = (body.w & 2u) != 0u;
    (*shadow).carried = float3(carried);
    (*shadow).own_pdf = bitcast<f32>(carried.w);
    (*shadow).body = body_air();
//#if MEDIUM
    (*shadow).body.interior.extinction = float3(body);
    (*shadow).body.is_solid = (body.w & 1u) != 0u;
//#else
    (*shadow).body.absorption = float3(body);
//#end
    if (*shadow).is_of_map {
        return;
    }
    let position = slot_read(slot, texel + 2u);
    (*shadow).pdf_solid_angle = bitcast<f32>(position.w);
//#if EMITTERS
    (*shadow).receiver = Receiver(float3(position), float3(slot_read(slot, texel + 3u)));
//#end
}

fn write_glass_shadow(slot: u32, texel: u32, shadow: Shadow) {
    slot_write(slot, texel, shadow.carried, bitcast<u32>(shadow.own_pdf));
    var what = select(0u, 2u, shadow.is_of_map);
//#if MEDIUM
    what |= select(0u, 1u, shadow.body.is_solid);
    slot_write(slot, texel + 1u, shadow.body.interior.extinction, what);
//#else
    slot_write(slot, texel + 1u, shadow.body.absorption, what);
//#end
    if shadow.is_of_map {
        return;
    }
    var position = vec3f(0.0);
//#if EMITTERS
    position = shadow.receiver.position;
    slot_write(slot, texel + 3u, shadow.receiver.normal, 0u);
//#end
    slot_write(slot, texel + 2u, position, bitcast<u32>(shadow.pdf_solid_angle));
}
//#end

fn write_shadow(slot: u32, texel: u32, shadow: Shadow) {
    slot_write(slot, texel, shadow.ray.origin, bitcast<u32>(shadow.ray.t_max));
    if shadow.ray.t_max <= 0.0 {
        return;
    }
    var left = vec3f(1.0);
    var counter = 0u;
    var share = 0.0;
//#if SHADOW_MEDIA
    left = shadow.left;
//#end
//#if COUNTING
    counter = shadow.visibility.counter;
    share = shadow.visibility.share;
//#end
    slot_write(slot, texel + 1u, shadow.ray.direction, bitcast<u32>(shadow.weight));
    slot_write(slot, texel + 2u, shadow.light, counter);
    slot_write(slot, texel + 3u, left, bitcast<u32>(share));
//#if CLEAR_SOLIDS
    write_glass_shadow(slot, texel + 4u, shadow);
//#end
}
//#end
