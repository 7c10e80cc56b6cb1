// The path tracing loop, one ray a step: twin of src/path/mod.rs, the same random numbers.

struct Path {
    sampler: Sampler,
    ray: Ray,
    throughput: vec3f,
    radiance: vec3f,
    // The vertex the ray left from: density of its direction (F32_MAX if no NEE competes with
    // it), tile distribution, and what lights are chosen for.
    departure_pdf_solid_angle: f32,
    departure_distribution: u32,
//#if EMITTERS
    departure_receiver: Receiver,
//#end
//#if SOLID_TRANSMISSION
    body: Body,
//#end
    travelled: f32,
    passes: u32,
    bounces: u32,
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
//#end
//#if LEARNING
//#else
//#if MAP_SAMPLING
    map_shadow: Shadow,
//#end
//#if LOCAL_LIGHTS
    lamp_shadow: Shadow,
//#end
//#end
}

//#if SHADOW_RAYS
// A ray towards a light. It waits until the path has chosen where to go on: so nothing of the vertex
// takes registers while it is followed.
struct Shadow {
    // Its reach is 0 if there is none.
    ray: Ray,
    // What arrives if nothing is in the way, before its weight.
    light: vec3f,
    weight: f32,
//#if SHADOW_MEDIA
    // What media let through of it.
    left: vec3f,
//#end
//#if COUNTING
    visibility: Visibility,
//#end
}
//#end

struct FirstHit {
    albedo: vec3f,
    depth: f32,
    normal: vec3f,
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

//#if SOLID_TRANSMISSION
struct Body {
//#if MEDIUM
    interior: Interior,
    is_solid: bool,
//#else
    absorption: vec3f,
//#end
    squared_index: f32,
}

fn body_air() -> Body {
    var body: Body;
    body.squared_index = 1.0;
    return body;
}

//#if MEDIUM
//#else
fn body_transmittance(body: Body, distance: f32) -> vec3f {
    if all(body.absorption == vec3f(0.0)) || distance >= F32_MAX {
        return vec3f(1.0);
    }
    return exp(-body.absorption * distance);
}
//#end

fn body_behind(point: SurfacePoint, before: Body) -> Body {
    if point.parameters.thin {
        return before;
    }
    var body = body_air();
    if point.front_face {
        let index = max(point.parameters.ior, 1.0);
        body.squared_index = index * index;
//#if MEDIUM
        let inside = material_numbers(point.material, SCATTERING);
        body.interior =
            Interior(inside.xyz, inside.w, point.parameters.absorption + inside.xyz);
        body.is_solid = true;
//#else
        body.absorption = point.parameters.absorption;
//#end
    }
    return body;
}
//#end

fn path_new(ray: Ray, sampler: Sampler) -> Path {
    var path: Path;
    path.sampler = sampler;
    path.ray = ray;
    path.throughput = vec3f(1.0);
    path.departure_pdf_solid_angle = F32_MAX;
    path.departure_distribution = WHOLE_MAP;
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

//#if PARTIAL
// Share of light that goes straight through a surface: what alpha does not cover, and what smooth
// thin glass transmits.
fn straight_through(point: SurfacePoint, direction: vec3f) -> vec3f {
    if (material_flags(point.material) & PARTIAL) == 0u {
        return vec3f(0.0);
    }
    var glass = vec3f(0.0);
//#if TRANSMISSION
    if point.parameters.transmission > 0.0 {
        let bsdf = bsdf_new(point.parameters, point.front_face);
        glass = bsdf_straight_transmittance(
            bsdf, local_from_world(point.shading_frame, -direction));
    }
//#end
    let covered = coverage(point);
    return (1.0 - covered) + covered * glass;
}

fn coverage(point: SurfacePoint) -> f32 {
    let blended = (material_flags(point.material) & ALPHA_BLEND) != 0u;
    return select(1.0, saturate(point.parameters.alpha), blended);
}
//#end

//#if FILTERED_HITS
// Whether a path sees a hit: not where a mask cuts it out, nor, for camera rays, a back side.
fn accepts(hit: Hit, from_camera: bool) -> bool {
    if from_camera && (hit.flags & (DOUBLE_SIDED | FROM_BEHIND)) == FROM_BEHIND {
        return false;
    }
//#if ALPHA_MASK
    if (hit.flags & ALPHA_MASK) != 0u {
        return alpha_at(hit.triangle, hit.barycentric) > 0.0;
    }
//#end
    return true;
}
//#end

//#if PASS_THROUGH
// Share of light that a surface on a shadow ray's way lets through.
fn passed(hit: Hit, direction: vec3f) -> vec3f {
//#if PARTIAL
    if (hit.flags & PARTIAL) != 0u {
        return straight_through(surface_at(hit.triangle, hit.barycentric, direction), direction);
    }
//#end
//#if ALPHA_MASK
    if (hit.flags & ALPHA_MASK) != 0u {
        return vec3f(1.0 - alpha_at(hit.triangle, hit.barycentric));
    }
//#end
    return vec3f(0.0);
}
//#end

// Follows the path along one ray, and the rays towards lights from where it arrives. `false` when it
// has ended.
fn path_step(path: ptr<function, Path>) -> bool {
    let hit = closest_hit((*path).ray, (*path).bounces == 0u);
    let goes_on = follow(path, hit);
//#if LEARNING
//#else
//#if SHADOW_RAYS
    add_lights(path);
//#end
//#end
    return goes_on;
}

// What becomes of the path at the end of its ray. `false` if it ends.
fn follow(path: ptr<function, Path>, hit: Hit) -> bool {
    (*path).rays += 1u;
//#if MEDIUM
    let stretch = stretch_ahead(path, (*path).ray.origin, (*path).ray.direction, hit.t);
    if stretch.start < stretch.end {
        if all(stretch.interior.scattering == vec3f(0.0)) {
            (*path).throughput *=
                exp(-stretch.interior.extinction * (stretch.end - stretch.start));
        } else if !has_faded(path) {
            let bits = path_pair_bits(path);
            let flight = fly_through(
                stretch.interior, (*path).throughput, stretch.end - stretch.start, bits);
            (*path).throughput *= flight.weight;
            if flight.scattered_at < F32_MAX {
                let position =
                    (*path).ray.origin + (*path).ray.direction * (stretch.start + flight.scattered_at);
                return visit(path, medium_vertex(path, position, stretch.interior.mean_cosine));
            }
        }
    }
//#else
//#if SOLID_TRANSMISSION
    (*path).throughput *= body_transmittance((*path).body, hit.t);
//#end
//#end
    if has_faded(path) {
        return false;
    }
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
    add_emitted(path, point);
//#end
//#if PARTIAL
    if passes(path, point) {
        (*path).ray.origin = offset_origin(point.position, -point.geometric_normal);
        (*path).passes += 1u;
        return (*path).passes < MAX_PASSES;
    }
//#end
    return arrive(path, point);
}

// Whether nothing is left that f32 can weigh.
fn has_faded(path: ptr<function, Path>) -> bool {
    return max_element((*path).throughput) < 1.17549435e-38;
}

//#if MEDIUM
// What fills the way of a ray from where the path is.
fn stretch_ahead(
    path: ptr<function, Path>,
    origin: vec3f,
    direction: vec3f,
    distance: f32,
) -> Stretch {
//#if SOLID_TRANSMISSION
    return stretch_in((*path).body, origin, direction, distance);
//#else
    return fog_stretch(origin, direction, distance);
//#end
}

//#if SOLID_TRANSMISSION
// Twin of `Body::stretch`.
fn stretch_in(body: Body, origin: vec3f, direction: vec3f, distance: f32) -> Stretch {
    if !body.is_solid {
        return fog_stretch(origin, direction, distance);
    }
    let fills = distance < F32_MAX && any(body.interior.extinction != vec3f(0.0));
    return Stretch(body.interior, 0.0, select(0.0, distance, fills));
}
//#end

fn is_in_solid(path: ptr<function, Path>) -> bool {
//#if SOLID_TRANSMISSION
    return (*path).body.is_solid;
//#else
    return false;
//#end
}

fn medium_vertex(path: ptr<function, Path>, position: vec3f, mean_cosine: f32) -> Vertex {
    var vertex: Vertex;
    vertex.point.position = position;
    vertex.is_in_medium = true;
    vertex.mean_cosine = mean_cosine;
    vertex.distribution = WHOLE_MAP;
//#if LIGHT_GRID
    // From inside of a solid the map is not seen anyway.
    if !is_in_solid(path) {
        vertex.cell = cell_in_medium(position);
        vertex.distribution = distribution_of_cell(vertex.cell);
    }
//#end
    return vertex;
}
//#end

//#if PARTIAL
fn passes(path: ptr<function, Path>, point: SurfacePoint) -> bool {
    let through = straight_through(point, (*path).ray.direction);
    let probability = min(max_element(through), 1.0);
    if probability <= 0.0 {
        return false;
    }
    var goes_on = probability >= 1.0;
    if !goes_on {
        goes_on = path_pair(path).x < probability;
    }
//#if SHARING
    (*path).is_clear = (*path).is_clear && (!goes_on || all(through == vec3f(1.0)));
//#end
    if goes_on {
        (*path).throughput *= through / probability;
    } else {
        (*path).throughput *= coverage(point) / (1.0 - probability);
    }
    return goes_on;
}
//#end

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
        var albedo = bsdf_albedo(bsdf);
        if point.parameters.unlit {
            albedo = point.parameters.base_color;
        }
        (*path).first_hit = FirstHit(albedo, (*path).travelled, point.shading_frame.z, 1.0);
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
    vertex.distribution = WHOLE_MAP;
//#if LIGHT_GRID
    vertex.cell = cell_of(point.position, point.geometric_normal);
    vertex.distribution = distribution_of_cell(vertex.cell);
//#end
    return visit(path, vertex);
}

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
    if (*path).bounces == most_vertices() {
        return false;
    }
//#if CACHED
    if ends_in_cache(path, vertex) {
        return false;
    }
//#end
//#if TRAINING
    meet_training_vertices(path, vertex);
//#end
//#if FINDING
    if (*path).bounces == 1u && meet_second(path, vertex) {
        return false;
    }
    let waits = (*path).bounces == 0u && meet_first(path, vertex);
//#end
    (*path).bounces += 1u;
    forget_arrival(path);
    (*path).travelled = 0.0;
    (*path).passes = 0u;
    var gathers = !bsdf_is_delta_only(vertex.bsdf);
//#if SHARING
    (*path).is_clear = true;
//#end
//#if MEDIUM
    gathers = gathers || vertex.is_in_medium;
//#if LEARNING
    gathers = gathers && !(vertex.is_in_medium && is_in_solid(path));
//#end
//#end
//#if FINDING
    gathers = gathers && !waits;
//#end
    if gathers {
//#if LEARNING
        for (var i = 0u; i < globals.tries_per_vertex; i++) {
            look_at_map(path, vertex);
        }
//#else
//#if SHADOW_RAYS
        gather(path, vertex);
//#end
//#end
    }
    if !scatter(path, vertex) {
        return false;
    }
    return survives(path);
}

// What nobody asks for any more, for it comes anew or the path ends: else it would take registers.
fn forget_arrival(path: ptr<function, Path>) {
    (*path).ray.origin = vec3f(0.0);
//#if MEDIUM
//#else
    (*path).ray.direction = vec3f(0.0);
//#end
    (*path).departure_pdf_solid_angle = 0.0;
    (*path).departure_distribution = 0u;
//#if EMITTERS
    (*path).departure_receiver = Receiver();
//#end
}

//#if SCENE_LIGHTS
// Twin of `Vertex::receiver`. In a medium the frame is zero.
fn receiver_of(vertex: Vertex) -> Receiver {
    var transmits = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    transmits = transmits || vertex.point.parameters.diffuse_transmission > 0.0;
//#end
    let normal = select(vertex.point.shading_frame.z, vec3f(0.0), transmits);
    return Receiver(vertex.point.position, normal);
}
//#end

//#if EMITTERS
fn add_emitted(path: ptr<function, Path>, point: SurfacePoint) {
    if point.parameters.unlit {
        return;
    }
    let radiance = emitted(point);
    if max_element(radiance) <= 0.0 {
        return;
    }
    var weight = 1.0;
    if (*path).departure_pdf_solid_angle < F32_MAX {
        let receiver = (*path).departure_receiver;
        let distance = length(receiver.position - point.position);
        let nee =
            local_light_pdf_solid_angle(point.triangle, receiver, (*path).ray.direction, distance);
        weight = balance_heuristic((*path).departure_pdf_solid_angle, nee);
    }
    (*path).radiance += (*path).throughput * radiance * weight;
}
//#end

//#if BACKGROUND_BLUR
// Twin of `background::spread`.
fn spread(direction: vec3f, concentration: f32, u: vec2f) -> vec3f {
    let share = u.x + (1.0 - u.x) * exp(-2.0 * concentration);
    let cosine = clamp(1.0 + log(max(share, 1e-30)) / concentration, -1.0, 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let phi = sin_cos_turns(u.y);
    return world_from_local(frame_from_z(direction), vec3f(sine * phi.y, sine * phi.x, cosine));
}
//#end

// The ray leaves the scene: adds the map's radiance, or for the camera the background's.
fn escape(path: ptr<function, Path>) {
    let direction = (*path).ray.direction;
//#if BACKGROUND_BLUR
    if (*path).bounces == 0u {
        var sampler = (*path).sampler;
        let blurred = spread(direction, globals.background_concentration, next_pair(&sampler));
        (*path).radiance += (*path).throughput * environment_radiance(blurred);
        return;
    }
//#end
//#if BACKGROUND_COLOR
    if (*path).bounces == 0u {
        (*path).radiance += (*path).throughput * globals.background;
        return;
    }
//#end
//#if MAP_SAMPLING
    if (*path).departure_pdf_solid_angle < F32_MAX {
        let seen = radiance_and_tile_pdf(direction);
        var nee = choice_probability((*path).departure_distribution, seen.tile) * seen.pdf_solid_angle;
//#if SHARING
        nee *= (*path).departure_map_samples;
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
    if (wi.z > 0.0) != (dot(vertex.point.geometric_normal, direction) > 0.0) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    return bsdf_eval_pdf(vertex.bsdf, vertex.wo, wi);
}

//#if SHADOW_RAYS
// A ray from the vertex towards a light so far away; its light is zero. There is none if media let
// nothing through.
fn shadow_towards(
    path: ptr<function, Path>,
    vertex: Vertex,
    direction: vec3f,
    distance: f32,
) -> Shadow {
    let normal = vertex.point.geometric_normal;
    let is_above = dot(normal, direction) > 0.0;
    var shadow: Shadow;
    var origin = offset_origin(vertex.point.position, select(-normal, normal, is_above));
//#if SHADOW_MEDIA
    shadow.left = vec3f(1.0);
//#if SOLID_TRANSMISSION
    var body = (*path).body;
//#if MEDIUM
    let goes_behind = !is_above && !vertex.is_in_medium;
//#else
    let goes_behind = !is_above;
//#end
    if goes_behind {
        body = body_behind(vertex.point, body);
    }
//#end
//#if MEDIUM
    if vertex.is_in_medium {
        origin = vertex.point.position;
    }
//#if SOLID_TRANSMISSION
    let stretch = stretch_in(body, origin, direction, distance);
//#else
    let stretch = fog_stretch(origin, direction, distance);
//#end
    if stretch.start < stretch.end {
        shadow.left = exp(-stretch.interior.extinction * (stretch.end - stretch.start));
    }
//#else
    shadow.left = body_transmittance(body, distance);
//#end
    if all(shadow.left == vec3f(0.0)) {
        return shadow;
    }
//#end
    // Stop short of the light's own surface.
    shadow.ray = Ray(origin, direction, distance * (1.0 - 1e-4));
    return shadow;
}

// Share of light that comes along a shadow ray, if there is one.
fn follow_shadow(path: ptr<function, Path>, shadow: Shadow) -> vec3f {
    if shadow.ray.t_max <= 0.0 {
        return vec3f(0.0);
    }
    (*path).rays += 1u;
    let visible = transmittance_along(shadow.ray);
//#if SHADOW_MEDIA
    return visible * shadow.left;
//#else
    return visible;
//#end
}

//#if LEARNING
//#else
// Follows a shadow ray and adds what comes along it.
fn add_light(path: ptr<function, Path>, shadow: Shadow) {
    let visible = follow_shadow(path, shadow);
    if any(visible != vec3f(0.0)) {
//#if COUNTING
        count_visible(shadow.visibility, visible);
//#end
        (*path).radiance += shadow.light * visible * shadow.weight;
    }
}

// Follows the path's shadow rays, the map's first. They share the code, which is long where panes and
// leaves let light through.
fn add_lights(path: ptr<function, Path>) {
//#if MAP_SAMPLING
    var shadow = (*path).map_shadow;
    (*path).map_shadow = Shadow();
//#if LOCAL_LIGHTS
    for (var i = 0u; i < 2u; i++) {
        add_light(path, shadow);
        shadow = (*path).lamp_shadow;
        (*path).lamp_shadow = Shadow();
    }
//#else
    add_light(path, shadow);
//#end
//#else
    let shadow = (*path).lamp_shadow;
    (*path).lamp_shadow = Shadow();
    add_light(path, shadow);
//#end
}
//#end
//#end

//#if LEARNING
//#else
//#if SHADOW_RAYS
// Light that may reach a vertex from a direction.
struct Arriving {
    is_some: bool,
    direction: vec3f,
    distance: f32,
    // Its radiance, or for lamps that over the density of the direction.
    light: vec3f,
    pdf_solid_angle: f32,
    // For the map: what is divided by the sum of all densities.
    weight: f32,
//#if COUNTING
    // Of the try; 0 if it has none.
    counter: u32,
//#end
}

// The ray towards it.
fn shadow_of(
    path: ptr<function, Path>,
    vertex: Vertex,
    arriving: Arriving,
    is_of_map: bool,
) -> Shadow {
    if !arriving.is_some {
        return Shadow();
    }
    let f = scattered(path, vertex, arriving.direction);
    if max_element(f.value) <= 0.0 {
        return Shadow();
    }
    var shadow = shadow_towards(path, vertex, arriving.direction, arriving.distance);
    shadow.light = (*path).throughput * f.value * arriving.light;
    if is_of_map {
        let both_pdfs = arriving.pdf_solid_angle + f.pdf_solid_angle;
        shadow.weight = select(0.0, arriving.weight / both_pdfs, both_pdfs > 0.0);
    } else {
        shadow.weight = balance_heuristic(arriving.pdf_solid_angle, f.pdf_solid_angle);
    }
//#if COUNTING
    shadow.visibility = Visibility(
        arriving.counter, visibility_share(vertex, arriving.direction, f.pdf_solid_angle));
//#end
    return shadow;
}

//#if MAP_SAMPLING
fn light_of_map(path: ptr<function, Path>, vertex: Vertex) -> Arriving {
    var arriving: Arriving;
    let bits = path_pair_bits(path);
    let choice = choose_tile(vertex.distribution, bits, globals.whole_map_share);
    let sample = sample_in_tile(choice.tile, vec2u(choice.remainder, bits.y));
    if sample.pdf_solid_angle > 0.0 {
        arriving.is_some = true;
        arriving.direction = sample.direction;
        arriving.distance = F32_MAX;
        arriving.light = sample.radiance;
        arriving.pdf_solid_angle = choice.probability * sample.pdf_solid_angle;
//#if SHARING
        arriving.pdf_solid_angle *= (*path).map_samples;
//#end
        arriving.weight = sample.weight;
//#if COUNTING
        arriving.counter = count_try(path, vertex, choice.tile);
//#end
    }
    return arriving;
}
//#end

//#if LOCAL_LIGHTS
fn light_of_lamps(path: ptr<function, Path>, vertex: Vertex) -> Arriving {
    var arriving: Arriving;
    let bits = path_pair_bits(path);
    let sample = sample_local_light(receiver_of(vertex), bits);
    if max_element(sample.radiance_over_pdf) > 0.0 {
        arriving.is_some = true;
        arriving.direction = sample.direction;
        arriving.distance = sample.distance;
        arriving.light = sample.radiance_over_pdf;
        arriving.pdf_solid_angle = sample.pdf_solid_angle;
    }
    return arriving;
}
//#end

// Chooses light that may reach a vertex, the map's first. Both share the code for what the vertex makes
// of it, which is long.
fn gather(path: ptr<function, Path>, vertex: Vertex) {
//#if MAP_SAMPLING
//#if LOCAL_LIGHTS
    for (var i = 0u; i < 2u; i++) {
        var arriving: Arriving;
        if i == 0u {
            arriving = light_of_map(path, vertex);
        } else {
            arriving = light_of_lamps(path, vertex);
        }
        let shadow = shadow_of(path, vertex, arriving, i == 0u);
        if i == 0u {
            (*path).map_shadow = shadow;
        } else {
            (*path).lamp_shadow = shadow;
        }
    }
//#else
    (*path).map_shadow = shadow_of(path, vertex, light_of_map(path, vertex), true);
//#end
//#else
    (*path).lamp_shadow = shadow_of(path, vertex, light_of_lamps(path, vertex), false);
//#end
}
//#end
//#end

// Chooses where the path goes on. `false` if it ends.
fn scatter(path: ptr<function, Path>, vertex: Vertex) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        let travel = (*path).ray.direction;
        let turned_ = normalize(sample_phase(vertex.mean_cosine, travel, path_pair(path)));
        (*path).departure_pdf_solid_angle =
            phase_pdf_solid_angle(vertex.mean_cosine, dot(travel, turned_));
        (*path).departure_distribution = vertex.distribution;
//#if EMITTERS
        (*path).departure_receiver = receiver_of(vertex);
//#end
        (*path).ray = Ray(vertex.point.position, turned_, F32_MAX);
        return true;
    }
//#end
    let lobe = path_pair(path).x;
    let u = path_pair(path);
    let sample = bsdf_sample(vertex.bsdf, vertex.wo, vec3f(lobe, u));
    if all(sample.weight == vec3f(0.0)) {
        return false;
    }
    let direction = normalize(world_from_local(vertex.point.shading_frame, sample.wi));
    let normal = vertex.point.geometric_normal;
    let is_above = dot(normal, direction) > 0.0;
    let is_transmission = sample.wi.z < 0.0;
    if is_above == is_transmission {
        return false;
    }
    (*path).throughput *= sample.weight;
    if max_element((*path).throughput) <= 0.0 || !is_finite3((*path).throughput) {
        return false;
    }
//#if SOLID_TRANSMISSION
    if is_transmission {
        (*path).body = body_behind(vertex.point, (*path).body);
    }
//#end
    (*path).departure_pdf_solid_angle = select(sample.pdf_solid_angle, F32_MAX, sample.is_delta);
    (*path).departure_distribution = vertex.distribution;
//#if EMITTERS
    (*path).departure_receiver = receiver_of(vertex);
//#end
//#if SHARING
    (*path).departure_map_samples = (*path).map_samples;
    (*path).map_samples = 1.0;
//#end
    let origin = offset_origin(vertex.point.position, select(-normal, normal, is_above));
    (*path).ray = Ray(origin, direction, F32_MAX);
    return true;
}

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
    return globals.russian_roulette != 0u && (*path).bounces >= ROULETTE_AFTER;
}

fn roulette_probability(path: ptr<function, Path>) -> f32 {
    var in_air = max_element((*path).throughput);
//#if SOLID_TRANSMISSION
    in_air *= (*path).body.squared_index;
//#end
//#if SHARING
    in_air *= (*path).throughput_before;
//#end
    return clamp(ROULETTE_MILDNESS * in_air, 0.05, 1.0);
}
