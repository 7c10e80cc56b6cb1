// The path tracing loop, one ray a step: twin of src/path/mod.rs, the same random numbers.

const ROULETTE_AFTER = 3u;
// Panes and leaves one ray may pass; only a scene that is broken has more.
const MAX_PASSES = 1000u;

struct Path {
    sampler: Sampler,
    ray: Ray,
    throughput: vec3f,
    radiance: vec3f,
    // The vertex the ray left from: density of its direction (F32_MAX if no NEE competes with
    // it), place, tile law.
    departure_pdf_solid_angle: f32,
    departure_position: vec3f,
    departure_law: u32,
//#if solid_transmission
    body: Body,
//#end
    travelled: f32,
    passes: u32,
    bounces: u32,
    rays: u32,
//#if layers
    first_hit: FirstHit,
//#end
}

struct FirstHit {
    albedo: vec3f,
    depth: f32,
    normal: vec3f,
    hits: f32,
}

struct Vertex {
    point: SurfacePoint,
    bsdf: Bsdf,
    wo: vec3f,
    law: u32,
}

//#if solid_transmission
struct Body {
    absorption: vec3f,
    squared_index: f32,
}

fn body_transmittance(body: Body, distance: f32) -> vec3f {
    if all(body.absorption == vec3f(0.0)) || distance >= F32_MAX {
        return vec3f(1.0);
    }
    return exp(-body.absorption * distance);
}

fn body_behind(p: SurfaceParameters, front_face: bool, before: Body) -> Body {
    if p.thin {
        return before;
    }
    if front_face {
        let index = max(p.ior, 1.0);
        return Body(p.absorption, index * index);
    }
    return Body(vec3f(0.0), 1.0);
}
//#end

fn path_new(ray: Ray, sampler: Sampler) -> Path {
    var path: Path;
    path.sampler = sampler;
    path.ray = ray;
    path.throughput = vec3f(1.0);
    path.departure_pdf_solid_angle = F32_MAX;
    path.departure_position = ray.origin;
    path.departure_law = WHOLE_MAP;
//#if solid_transmission
    path.body = Body(vec3f(0.0), 1.0);
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

//#if partial
// Share of light that goes straight through a surface: what alpha does not cover, and what smooth
// thin glass transmits.
fn straight_through(point: SurfacePoint, direction: vec3f) -> vec3f {
    if (material_flags(point.material) & PARTIAL) == 0u {
        return vec3f(0.0);
    }
    var glass = vec3f(0.0);
//#if transmission
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

//#if filtered_hits
// Whether a path sees a hit: not where a mask cuts it out, nor, for camera rays, a back side.
fn accepts(hit: Hit, direction: vec3f, from_camera: bool) -> bool {
    let flags = material_flags(material_of(hit.triangle));
    if from_camera && (flags & DOUBLE_SIDED) == 0u {
        let corners = triangles(hit.triangle).xyz;
        let a = vertex_position(corners.x);
        let b = vertex_position(corners.y);
        let c = vertex_position(corners.z);
        if dot(cross(b - a, c - a), direction) > 0.0 {
            return false;
        }
    }
//#if alpha_mask
    if (flags & ALPHA_MASK) != 0u {
        return alpha_at(hit.triangle, hit.barycentric) > 0.0;
    }
//#end
    return true;
}
//#end

//#if pass_through
// Share of light that a surface on a shadow ray's way lets through.
fn passed(hit: Hit, direction: vec3f) -> vec3f {
    let flags = material_flags(material_of(hit.triangle));
//#if partial
    if (flags & PARTIAL) != 0u {
        return straight_through(surface_at(hit.triangle, hit.barycentric, direction), direction);
    }
//#end
//#if alpha_mask
    if (flags & ALPHA_MASK) != 0u {
        return vec3f(1.0 - alpha_at(hit.triangle, hit.barycentric));
    }
//#end
    return vec3f(0.0);
}
//#end

// Follows the path along one ray. `false` when it has ended.
fn path_step(path: ptr<function, Path>) -> bool {
    (*path).rays += 1u;
    let hit = closest_hit((*path).ray, (*path).bounces == 0u);
    if hit.t >= MISS {
        escape(path);
        return false;
    }
//#if solid_transmission
    (*path).throughput *= body_transmittance((*path).body, hit.t);
//#end
    (*path).travelled += hit.t;
    let direction = (*path).ray.direction;
    let point = surface_at(hit.triangle, hit.barycentric, direction);
//#if emitters
    add_emitted(path, point);
//#end
//#if partial
    if passes(path, point) {
        (*path).ray.origin = offset_origin(point.position, -point.geometric_normal);
        (*path).passes += 1u;
        return (*path).passes < MAX_PASSES;
    }
//#end
    return arrive(path, point);
}

//#if partial
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
    if goes_on {
        (*path).throughput *= through / probability;
    } else {
        (*path).throughput *= coverage(point) / (1.0 - probability);
    }
    return goes_on;
}
//#end

// Makes the surface a vertex, gathers light there and chooses where the path goes on.
fn arrive(path: ptr<function, Path>, point: SurfacePoint) -> bool {
    let bsdf = bsdf_new(point.parameters, point.front_face);
//#if layers
    if (*path).bounces == 0u {
        var albedo = bsdf_albedo(bsdf);
        if point.parameters.unlit {
            albedo = point.parameters.base_color;
        }
        (*path).first_hit = FirstHit(albedo, (*path).travelled, point.shading_frame.z, 1.0);
    }
//#end
//#if unlit
    if point.parameters.unlit {
        (*path).radiance += (*path).throughput * point.parameters.emissive;
        return false;
    }
//#end
    if (*path).bounces == globals.bounces {
        return false;
    }
    (*path).bounces += 1u;
    (*path).travelled = 0.0;
    (*path).passes = 0u;
    let wo = local_from_world(point.shading_frame, -(*path).ray.direction);
    var law = WHOLE_MAP;
//#if light_grid
    law = law_of(point.position, point.geometric_normal);
//#end
    let vertex = Vertex(point, bsdf, wo, law);
    if !bsdf_is_delta_only(bsdf) {
//#if learning
        record(path, vertex);
//#else
//#if map_sampling
        gather_environment(path, vertex);
//#end
//#if local_lights
        gather_local(path, vertex);
//#end
//#end
    }
    if !scatter(path, vertex) {
        return false;
    }
    return survives(path);
}

//#if emitters
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
        let distance = length((*path).departure_position - point.position);
        let nee = local_light_pdf_solid_angle(point.triangle, (*path).ray.direction, distance);
        weight = balance_heuristic((*path).departure_pdf_solid_angle, nee);
    }
    (*path).radiance += (*path).throughput * radiance * weight;
}
//#end

// The ray leaves the scene: adds the map's radiance.
fn escape(path: ptr<function, Path>) {
    let direction = (*path).ray.direction;
//#if map_sampling
    if (*path).departure_pdf_solid_angle < F32_MAX {
        let seen = radiance_and_tile_pdf(direction);
        let nee = tile_probability((*path).departure_law, seen.tile) * seen.pdf_solid_angle;
        let weight = balance_heuristic((*path).departure_pdf_solid_angle, nee);
        (*path).radiance += (*path).throughput * seen.radiance * weight;
        return;
    }
//#end
    (*path).radiance += (*path).throughput * environment_radiance(direction);
}

// BSDF times cosine and the BSDF's density for light from `direction`; zero where shading and
// geometric normal disagree about the side.
fn scattered(vertex: Vertex, direction: vec3f) -> EvalPdf {
    let wi = local_from_world(vertex.point.shading_frame, direction);
    if (wi.z > 0.0) != (dot(vertex.point.geometric_normal, direction) > 0.0) {
        return EvalPdf(vec3f(0.0), 0.0);
    }
    return bsdf_eval_pdf(vertex.bsdf, vertex.wo, wi);
}

//#if shadow_rays
fn transmittance(
    path: ptr<function, Path>,
    vertex: Vertex,
    direction: vec3f,
    distance: f32,
) -> vec3f {
    (*path).rays += 1u;
    let normal = vertex.point.geometric_normal;
    let is_above = dot(normal, direction) > 0.0;
    let origin = offset_origin(vertex.point.position, select(-normal, normal, is_above));
    // Stop short of the light's own surface.
    let ray = Ray(origin, direction, distance * (1.0 - 1e-4));
    var result = transmittance_along(ray);
//#if solid_transmission
    var body = (*path).body;
    if !is_above {
        body = body_behind(vertex.point.parameters, vertex.point.front_face, body);
    }
    result *= body_transmittance(body, distance);
//#end
    return result;
}
//#end

//#if map_sampling
//#if learning
//#else
fn gather_environment(path: ptr<function, Path>, vertex: Vertex) {
    let bits = path_pair_bits(path);
    let choice = sample_tile(vertex.law, bits.x);
    let sample = sample_in_tile(choice.tile, vec2f(choice.remainder, unit_from_bits(bits.y)));
    if sample.pdf_solid_angle <= 0.0 {
        return;
    }
    let pdf = choice.probability * sample.pdf_solid_angle;
    let f = scattered(vertex, sample.direction);
    if max_element(f.value) <= 0.0 {
        return;
    }
    let visible = transmittance(path, vertex, sample.direction, F32_MAX);
    let weight = balance_heuristic(pdf, f.pdf_solid_angle) / pdf;
    if any(visible != vec3f(0.0)) {
        (*path).radiance += (*path).throughput * f.value * sample.radiance * visible * weight;
    }
}
//#end
//#end

//#if local_lights
fn gather_local(path: ptr<function, Path>, vertex: Vertex) {
    let u = path_pair(path);
    let sample = sample_local_light(vertex.point.position, u);
    if max_element(sample.radiance_over_pdf) <= 0.0 {
        return;
    }
    let f = scattered(vertex, sample.direction);
    if max_element(f.value) <= 0.0 {
        return;
    }
    let visible = transmittance(path, vertex, sample.direction, sample.distance);
    let weight = balance_heuristic(sample.pdf_solid_angle, f.pdf_solid_angle);
    if any(visible != vec3f(0.0)) {
        (*path).radiance +=
            (*path).throughput * f.value * sample.radiance_over_pdf * visible * weight;
    }
}
//#end

// Chooses where the path goes on. `false` if it ends.
fn scatter(path: ptr<function, Path>, vertex: Vertex) -> bool {
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
//#if solid_transmission
    if is_transmission {
        (*path).body = body_behind(vertex.point.parameters, vertex.point.front_face, (*path).body);
    }
//#end
    (*path).departure_pdf_solid_angle = select(sample.pdf_solid_angle, F32_MAX, sample.is_delta);
    (*path).departure_position = vertex.point.position;
    (*path).departure_law = vertex.law;
    let origin = offset_origin(vertex.point.position, select(-normal, normal, is_above));
    (*path).ray = Ray(origin, direction, F32_MAX);
    return true;
}

fn survives(path: ptr<function, Path>) -> bool {
    if globals.russian_roulette == 0u || (*path).bounces < ROULETTE_AFTER {
        return true;
    }
    var in_air = max_element((*path).throughput);
//#if solid_transmission
    in_air *= (*path).body.squared_index;
//#end
    let probability = clamp(in_air, 0.05, 1.0);
    if probability < 1.0 {
        let draw = path_pair(path).y;
        if draw >= probability {
            return false;
        }
    }
    (*path).throughput /= probability;
    return true;
}
