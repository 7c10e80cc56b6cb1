// The path tracing loop, one ray a step: twin of src/path/tracer.rs, src/path/looks.rs and src/path/vertex.rs, the same
// random numbers.

struct Path {
    sampler: Sampler,
    ray: Ray,
    throughput: vec3f,
    radiance: vec3f,
    // The vertex the ray left from: density of its direction (F32_MAX if no NEE competes with
    // it), tile distribution, and what lights are chosen for.
    departure_pdf_solid_angle: f32,
    departure_distribution: u32,
//#if AREA_SOURCES
    departure_receiver: Receiver,
//#end
//#if AIMING
    // Whether the ray was aimed; see aim.wgsl.
    aim: u32,
//#end
//#if CLEAR_SOLIDS
    // The ray as it left, and whether smooth glass has refracted it since.
    departure_origin: vec3f,
    departure_direction: vec3f,
    is_refracted: bool,
//#end
//#if SOLID_TRANSMISSION
    body: Body,
//#end
    travelled: f32,
    passes: u32,
    bounces: u32,
//#if PERFECT_INTERFACES
    // Perfect reflections and refractions since the last vertex that scatters.
    interfaces: u32,
//#end
    rays: u32,
//#if CACHED
    // Metres over which surfaces average what the path would find.
    spread: f32,
//#end
//#if SHARING
    // What the path carried where its throughput was set to one.
    throughput_before: f32,
    // Whether nothing on the way since the last vertex has taken any light.
    is_clear: bool,
    // Samples of the map that the next vertex takes, and that the last one took.
    map_samples: f32,
    departure_map_samples: f32,
//#end
//#if COUNTING
    is_counted: bool,
//#end
//#if LAYERS
    first_hit: FirstHit,
//#if PERFECT_INTERFACES
    // Metres gone to the last mirror or glass before that, albedo that they take from what is seen by way of them, and
    // what they have on the other way.
    looks_before: f32,
    looks_taken: vec3f,
    looks_added: vec3f,
//#end
//#end
//#if !LEARNING
//#if MAP_SAMPLING
    map_shadow: Shadow,
//#end
//#if LOCAL_LIGHTS
    lamp_shadow: Shadow,
//#end
//#end
}

struct FirstHit {
    albedo: vec3f,
    depth: f32,
    normal: vec3f,
    // -1 if the path tells nothing of what is seen first.
    hits: f32,
}

// A place at which light is scattered; in a medium only the point's position means anything.
struct Vertex {
    point: SurfacePoint,
    bsdf: Bsdf,
    // Direction to where the path came from, in the shading frame.
    wo: vec3f,
    distribution: u32,
//#if LIGHT_GRID
    cell: u32,
//#end
//#if MEDIUM
    is_in_medium: bool,
    mean_cosine: f32,
//#end
}

// Where a ray from a vertex in this direction begins.
fn vertex_origin_toward(vertex: Vertex, direction: vec3f) -> vec3f {
//#if MEDIUM
    if vertex.is_in_medium {
        return vertex.point.position;
    }
//#end
    return origin_toward(vertex.point, direction);
}

fn path_new(ray: Ray, sampler: Sampler) -> Path {
    var path: Path;
    path.sampler = sampler;
    path.ray = ray;
    path.throughput = vec3f(1.0);
    path.departure_pdf_solid_angle = F32_MAX;
    path.departure_distribution = WHOLE_MAP;
//#if CLEAR_SOLIDS
    path.departure_origin = ray.origin;
    path.departure_direction = ray.direction;
//#end
//#if SOLID_TRANSMISSION
    path.body = body_air();
//#end
//#if SHARING
    path.throughput_before = 1.0;
    path.is_clear = true;
    path.map_samples = 1.0;
    path.departure_map_samples = 1.0;
//#end
    return path;
}

// The next pair of random numbers. (Pointers to members cannot be passed on.)
fn path_pair_bits(path: ptr<function, Path>) -> vec2u {
    var sampler = (*path).sampler;
    let bits = next_pair_bits(&sampler);
    (*path).sampler = sampler;
    return bits;
}

fn path_pair(path: ptr<function, Path>) -> vec2f {
    let bits = path_pair_bits(path);
    return vec2f(unit_from_bits(bits.x), unit_from_bits(bits.y));
}

// Follows the path along one ray, and the rays towards lights from where it arrives. `false` when it
// has ended.
fn path_step(path: ptr<function, Path>) -> bool {
    let hit = closest_hit((*path).ray, is_of_camera(path));
    let goes_on = follow(path, hit);
    add_lights(path);
    return goes_on;
}

// Whether the path has met no vertex yet.
fn is_of_camera(path: ptr<function, Path>) -> bool {
//#if PERFECT_INTERFACES
    return ((*path).bounces | (*path).interfaces) == 0u;
//#else
    return (*path).bounces == 0u;
//#end
}

// What becomes of the path at the end of its ray. `false` if it ends.
fn follow(path: ptr<function, Path>, hit: Hit) -> bool {
    (*path).rays += 1u;
//#if MEDIUM
    let stretch = stretch_ahead(path, (*path).ray.origin, (*path).ray.direction, hit.t);
    if stretch.start < stretch.end {
        if all(stretch.interior.scattering == vec3f(0.0)) {
            let left = exp(-stretch.interior.extinction * (stretch.end - stretch.start));
            (*path).throughput *= left;
            look_through_body(path, left);
        } else if !has_faded(path) {
            let bits = path_pair_bits(path);
            let flight = fly_through(
                stretch.interior, (*path).throughput, stretch.end - stretch.start, bits);
            (*path).throughput *= flight.weight;
            if flight.scattered_at < F32_MAX {
//#if AIMING
                if is_aimed(path) {
                    return false;
                }
//#end
                let position =
                    (*path).ray.origin + (*path).ray.direction * (stretch.start + flight.scattered_at);
                return visit(path, medium_vertex(path, position, stretch.interior.mean_cosine));
            }
        }
    }
//#else
//#if SOLID_TRANSMISSION
    let left = body_transmittance((*path).body, hit.t);
    (*path).throughput *= left;
    look_through_body(path, left);
//#end
//#end
    if has_faded(path) {
        return false;
    }
//#if AIMING
    if hit.t >= MISS && is_aimed(path) {
        return false;
    }
//#end
    if hit.t >= MISS {
        escape(path);
        return false;
    }
    (*path).travelled += hit.t;
//#if FINDING
    arrival = hit;
//#end
    let direction = (*path).ray.direction;
    let point = surface_at(hit.triangle, hit.barycentric, direction);
//#if EMITTERS
//#if AIMING
    if !is_aimed(path) {
        add_emitted(path, point);
    }
//#else
    add_emitted(path, point);
//#end
//#end
//#if PARTIAL
    if passes(path, point) {
        (*path).ray.origin = offset_origin(point.position, -point.geometric_normal);
        (*path).passes += 1u;
        return (*path).passes < MAX_PASSES;
    }
//#end
//#if AIMING
    if !arrives_as_aimed(path, point) {
        return false;
    }
//#end
    return arrive(path, point);
}

// Takes from the looks of what is behind a body what that absorbs.
fn look_through_body(path: ptr<function, Path>, left: vec3f) {
//#if LAYERS
//#if PERFECT_INTERFACES
//#if SOLID_TRANSMISSION
//#if MEDIUM
    let is_inside = (*path).body.is_solid;
//#else
    let is_inside = true;
//#end
    if is_inside && (*path).bounces == 0u {
        (*path).looks_taken = 1.0 - (1.0 - (*path).looks_taken) * left;
    }
//#end
//#end
//#end
}

// Whether nothing is left that f32 can weigh.
fn has_faded(path: ptr<function, Path>) -> bool {
    return max_element((*path).throughput) < 1.17549435e-38;
}

// Makes the surface a vertex, unless it is unlit: then it is seen as it is.
fn arrive(path: ptr<function, Path>, point: SurfacePoint) -> bool {
//#if DISPERSION
    var bsdf = bsdf_new(point.parameters, point.front_face);
    if point.parameters.dispersion > 0.0 {
        let hero = hero_choose((*path).throughput, path_pair(path).x);
        bsdf.interface_ = interface_of_hero(bsdf.interface_, hero);
    }
//#else
    let bsdf = bsdf_new(point.parameters, point.front_face);
//#end
//#if LAYERS
    if (*path).bounces == 0u {
        look_at(path, point, bsdf);
    }
//#end
//#if UNLIT
    if point.parameters.unlit {
        (*path).radiance += (*path).throughput * point.parameters.emissive;
        return false;
    }
//#end
    var vertex: Vertex;
    vertex.point = point;
    vertex.bsdf = bsdf;
    vertex.wo = local_from_world(point.shading_frame, -(*path).ray.direction);
//#if SPLIT_LOBES
    vertex.bsdf = split(path, vertex);
//#end
    vertex.distribution = WHOLE_MAP;
//#if LIGHT_GRID
    vertex.cell = cell_of(point.position, point.geometric_normal);
    vertex.distribution = distribution_of_cell(vertex.cell);
//#end
    return visit(path, vertex);
}

//#if LAYERS
// Keeps what a surface looks like. Mirrors and smooth glass are kept until something is seen in them.
fn look_at(path: ptr<function, Path>, point: SurfacePoint, bsdf: Bsdf) {
    var albedo = bsdf_albedo(bsdf);
    if point.parameters.unlit {
        albedo = point.parameters.base_color;
    }
    var depth = (*path).travelled;
//#if PERFECT_INTERFACES
    let hits = (*path).first_hit.hits;
    let is_interface = bsdf_is_delta_only(bsdf) && !point.parameters.unlit;
    if hits < 0.0 || (hits > 0.0 && is_interface) {
        return;
    }
    albedo = albedo * (1.0 - (*path).looks_taken) + (*path).looks_added;
    depth += (*path).looks_before;
//#end
    (*path).first_hit = FirstHit(albedo, depth * METRES, point.shading_frame.z, 1.0);
}

//#if PERFECT_INTERFACES
// Keeps which way it goes at a mirror or smooth glass before the first surface.
fn goes_by(path: ptr<function, Path>, bsdf: Bsdf, wo: vec3f, is_through: bool) {
    let facet = interface_facet(bsdf.interface_, abs(wo.z));
    let transmits_more = importance(facet.transmittance) > importance(facet.reflectance);
    let left = 1.0 - (*path).looks_taken;
    (*path).looks_added += left * select(facet.transmittance, facet.reflectance, transmits_more);
    (*path).looks_taken =
        1.0 - left * select(facet.reflectance, facet.transmittance, transmits_more);
    if is_through != transmits_more {
        (*path).first_hit = FirstHit(vec3f(0.0), 0.0, vec3f(0.0), -1.0);
    }
}
//#end
//#end

fn most_vertices() -> u32 {
//#if TRAINING
    // The last that train see as far as the others.
    return globals.bounces + TRAINING_VERTICES - 2u;
//#else
    return globals.bounces;
//#end
}

// Gathers light at a vertex, if the path may have one more, and chooses where the path goes on.
fn visit(path: ptr<function, Path>, vertex: Vertex) -> bool {
//#if PERFECT_INTERFACES
    let is_perfect = is_perfect_interface(vertex);
    if !may_meet(path, is_perfect) {
        return false;
    }
//#else
    if (*path).bounces == most_vertices() {
        return false;
    }
//#end
//#if CACHED
    if ends_in_cache(path, vertex) {
        return false;
    }
//#end
//#if TRAINING
//#if PERFECT_INTERFACES
    // What is seen in a mirror belongs to the vertex before.
    if !is_perfect {
        meet_training_vertices(path, vertex);
    }
//#else
    meet_training_vertices(path, vertex);
//#end
//#end
//#if FINDING
    if is_next_to_first(path) && meet_second(path, vertex) {
        return false;
    }
    let waits = (*path).bounces == 0u && meet_first(path, vertex);
//#end
//#if PERFECT_INTERFACES
    (*path).bounces += select(1u, 0u, is_perfect);
    (*path).interfaces = select(0u, (*path).interfaces + 1u, is_perfect);
//#else
    (*path).bounces += 1u;
//#end
    forget_arrival(path);
//#if LAYERS
//#if PERFECT_INTERFACES
    (*path).looks_before += (*path).travelled;
//#end
//#end
    (*path).travelled = 0.0;
    (*path).passes = 0u;
    var gathers = !bsdf_is_delta_only(vertex.bsdf);
//#if SHARING
    (*path).is_clear = true;
//#end
//#if MEDIUM
    gathers = gathers || vertex.is_in_medium;
//#end
//#if FINDING
    gathers = gathers && !waits;
//#end
    if gathers {
        gather(path, vertex);
    }
    if !scatter(path, vertex) {
        return false;
    }
    return survives(path);
}

//#if PERFECT_INTERFACES
// Whether light is only reflected and refracted there, each in one direction.
fn is_perfect_interface(vertex: Vertex) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
//#if SPLIT_LOBES
    // The narrow lobes of a surface that has others, too, are none.
    if vertex.bsdf.weights.z == 0.0 {
        return false;
    }
//#end
    return bsdf_is_delta_only(vertex.bsdf);
}

// Whether the path may have one more of these, or of the vertices that scatter.
fn may_meet(path: ptr<function, Path>, is_perfect: bool) -> bool {
    if is_perfect {
        return (*path).interfaces < MAX_INTERFACES;
    }
    return (*path).bounces != most_vertices();
}
//#end

// What nobody asks for any more, for it comes anew or the path ends: else it would take registers.
fn forget_arrival(path: ptr<function, Path>) {
    (*path).ray.origin = vec3f(0.0);
//#if !MEDIUM
    (*path).ray.direction = vec3f(0.0);
//#end
//#if CLEAR_SOLIDS
    // Refraction keeps the departure.
//#else
    (*path).departure_pdf_solid_angle = 0.0;
    (*path).departure_distribution = 0u;
//#if AREA_SOURCES
    (*path).departure_receiver = Receiver();
//#end
//#end
}

// The ray leaves the scene: adds the map's radiance, or for the camera the background's.
fn escape(path: ptr<function, Path>) {
    let direction = (*path).ray.direction;
//#if BACKGROUND_BLUR
    if is_of_camera(path) {
        var sampler = (*path).sampler;
        let blurred = spread(direction, globals.background_concentration, next_pair(&sampler));
        (*path).radiance += (*path).throughput * environment_radiance(blurred);
        return;
    }
//#end
//#if BACKGROUND_COLOR
    if is_of_camera(path) {
        (*path).radiance += (*path).throughput * globals.background;
        return;
    }
//#end
//#if MAP_SAMPLING
    if (*path).departure_pdf_solid_angle < F32_MAX {
//#if CLEAR_SOLIDS
        var seen = radiance_and_tile_pdf((*path).departure_direction);
        if (*path).is_refracted {
            seen.radiance = environment_radiance(direction);
        }
//#else
        let seen = radiance_and_tile_pdf(direction);
//#end
//#if MEDIUM
//#if SOLID_TRANSMISSION
        if (*path).departure_distribution == NO_ARRAY {
            (*path).radiance += (*path).throughput * seen.radiance;
            return;
        }
//#end
//#end
        var nee = choice_probability((*path).departure_distribution, seen.tile) * seen.pdf_solid_angle;
//#if SHARING
        nee *= (*path).departure_map_samples;
//#end
//#if CLEAR_SOLIDS
        if (*path).is_refracted && is_departure_blocked(path) {
            nee = 0.0;
        }
//#end
        let weight = balance_heuristic((*path).departure_pdf_solid_angle, nee);
        (*path).radiance += (*path).throughput * seen.radiance * weight;
        return;
    }
//#end
    (*path).radiance += (*path).throughput * environment_radiance(direction);
}

// What share of light from `direction` goes on along the path, and the density with which `scatter`
// chooses that direction; zero where shading and geometric normal disagree about the side.
fn scattered(path: ptr<function, Path>, vertex: Vertex, direction: vec3f) -> EvalPdf {
//#if MEDIUM
    if vertex.is_in_medium {
        let cosine = dot((*path).ray.direction, direction);
        let density = phase_pdf_solid_angle(vertex.mean_cosine, cosine);
        return EvalPdf(vec3f(density), density);
    }
//#end
    let wi = local_from_world(vertex.point.shading_frame, direction);
    if (wi.z > 0.0) != is_above(vertex.point, direction) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    return bsdf_eval_pdf(vertex.bsdf, vertex.wo, wi);
}

// Chooses where the path goes on. `false` if it ends.
fn scatter(path: ptr<function, Path>, vertex: Vertex) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        let travel = (*path).ray.direction;
        let turned_ = normalize(sample_phase(vertex.mean_cosine, travel, path_pair(path)));
        (*path).departure_pdf_solid_angle =
            phase_pdf_solid_angle(vertex.mean_cosine, dot(travel, turned_));
        (*path).departure_distribution = vertex.distribution;
//#if AREA_SOURCES
        (*path).departure_receiver = receiver_of(vertex);
//#end
//#if AIMING
        (*path).aim = NO_AIM;
//#end
//#if SHARING
        (*path).departure_map_samples = (*path).map_samples;
        (*path).map_samples = 1.0;
//#end
        (*path).ray = Ray(vertex.point.position, turned_, F32_MAX);
//#if CLEAR_SOLIDS
        keep_departure(path);
//#end
        return true;
    }
//#end
//#if AIMING
    let choice = path_pair(path);
    let sample = sample_aiming(path, vertex, choice, path_pair_bits(path));
//#else
    let lobe = path_pair(path).x;
    let u = path_pair(path);
    let sample = bsdf_sample(vertex.bsdf, vertex.wo, vec3f(lobe, u));
//#end
    if all(sample.weight == vec3f(0.0)) {
        return false;
    }
    let direction = normalize(world_from_local(vertex.point.shading_frame, sample.wi));
    let is_transmission = sample.wi.z < 0.0;
    if is_above(vertex.point, direction) == is_transmission {
        return false;
    }
//#if LAYERS
//#if PERFECT_INTERFACES
    if (*path).bounces == 0u {
        goes_by(path, vertex.bsdf, vertex.wo, is_transmission);
    }
//#end
//#end
    (*path).throughput *= sample.weight;
    if max_element((*path).throughput) <= 0.0 || !is_finite3((*path).throughput) {
        return false;
    }
//#if SOLID_TRANSMISSION
    if is_transmission {
        (*path).body = body_behind(vertex.point, (*path).body);
    }
//#end
    (*path).ray = Ray(origin_toward(vertex.point, direction), direction, F32_MAX);
//#if CLEAR_SOLIDS
    if is_transmission && is_clear_solid(vertex.point.material) {
        // NEE at the vertex before goes the same way.
        (*path).is_refracted = true;
        return true;
    }
    keep_departure(path);
//#end
    (*path).departure_pdf_solid_angle = select(sample.pdf_solid_angle, F32_MAX, sample.is_delta);
    (*path).departure_distribution = vertex.distribution;
//#if AREA_SOURCES
    (*path).departure_receiver = receiver_of(vertex);
//#end
//#if SHARING
    (*path).departure_map_samples = (*path).map_samples;
    (*path).map_samples = 1.0;
//#end
    return true;
}

//#if CLEAR_SOLIDS
fn keep_departure(path: ptr<function, Path>) {
    (*path).departure_origin = (*path).ray.origin;
    (*path).departure_direction = (*path).ray.direction;
    (*path).is_refracted = false;
}
//#end

fn survives(path: ptr<function, Path>) -> bool {
    if !plays_roulette(path) {
        return true;
    }
    let probability = roulette_probability(path);
    if probability < 1.0 {
        let draw = path_pair(path).y;
        if draw >= probability {
            return false;
        }
    }
    (*path).throughput /= probability;
    return true;
}

fn plays_roulette(path: ptr<function, Path>) -> bool {
    var vertices = (*path).bounces;
//#if PERFECT_INTERFACES
    vertices += (*path).interfaces;
//#end
    return globals.russian_roulette != 0u && vertices >= ROULETTE_AFTER;
}

fn roulette_probability(path: ptr<function, Path>) -> f32 {
    var in_air = max_element((*path).throughput);
//#if SOLID_TRANSMISSION
    in_air *= (*path).body.squared_index;
//#end
//#if SHARING
    in_air *= (*path).throughput_before;
//#end
    return clamp(ROULETTE_MILDNESS * in_air, MIN_SURVIVAL, 1.0);
}
