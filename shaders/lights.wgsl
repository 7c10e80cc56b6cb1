// Light sources inside the scene: twin of src/path/lights.rs.

struct LightSample {
    direction: vec3f,
    distance: f32,
    // Zero where no light shines that way.
    radiance_over_pdf: vec3f,
    // F32_MAX for a light without size.
    pdf_solid_angle: f32,
}

fn light_f32(at: u32) -> f32 {
    return bitcast<f32>(lights(at).x);
}

fn light_vec3(at: u32) -> vec3f {
    return vec3f(light_f32(at), light_f32(at + 1u), light_f32(at + 2u));
}

fn sample_local_light(receiver: Receiver, bits: vec2u) -> LightSample {
    let choice = choose_light(receiver, bits.x);
    let probability = choice.probability;
//#if PUNCTUAL_LIGHTS
    if choice.light >= globals.light_triangle_count {
        let index = choice.light - globals.light_triangle_count;
        return sample_punctual(index, receiver.position, probability);
    }
//#end
    var none: LightSample;
//#if EMITTERS
    let barycentric = barycentric_of(vec2f(choice.remainder, unit_from_bits(bits.y)));
    let triangle = lights(choice.light).x;
    let corners = light_corners(triangle);
    let to_light = place_on(corners, barycentric) - receiver.position;
    let distance = length(to_light);
    let direction = to_light / distance;
    let pdf = probability * area_to_solid_angle(corners, direction, distance * distance);
    if !(pdf > 0.0 && is_finite(pdf)) {
        return none;
    }
    let point = surface_at(triangle, barycentric, direction);
    return LightSample(direction, distance, emitted(point, -direction) / pdf, pdf);
//#else
    return none;
//#end
}

//#if AREA_SOURCES
// Uniform barycentric coordinates: weights of the second and third corner.
fn barycentric_of(u: vec2f) -> vec2f {
    let root = sqrt(u.x);
    return vec2f(root * (1.0 - u.y), root * u.y);
}

fn place_on(corners: array<vec3f, 3>, barycentric: vec2f) -> vec3f {
    return corners[0] + (corners[1] - corners[0]) * barycentric.x
        + (corners[2] - corners[0]) * barycentric.y;
}

fn light_corners(triangle: u32) -> array<vec3f, 3> {
    let corners = triangles(triangle).xyz;
    return array<vec3f, 3>(
        vertex_position(corners.x),
        vertex_position(corners.y),
        vertex_position(corners.z),
    );
}

// Density in solid angle of a uniform point on a triangle; zero where it is seen edge-on.
fn area_to_solid_angle(corners: array<vec3f, 3>, direction: vec3f, squared: f32) -> f32 {
    let normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    let projected_area = 0.5 * abs(dot(normal, direction));
    let density = squared / projected_area;
    return select(0.0, density, is_finite(density));
}

// Number of a triangle among `count` ascending ones; `count` or more if it is none of them.
fn index_of_triangle(at: u32, count: u32, triangle: u32) -> u32 {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if lights(at + middle).x < triangle {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    if low < count && lights(at + low).x != triangle {
        return count;
    }
    return low;
}
//#end

//#if EMITTERS
// Density with which a triangle's point along `direction` is chosen; zero if it is no light.
fn local_light_pdf_solid_angle(
    triangle: u32,
    receiver: Receiver,
    direction: vec3f,
    distance: f32,
) -> f32 {
    let index = index_of_triangle(0u, globals.light_triangle_count, triangle);
    if index >= globals.light_triangle_count {
        return 0.0;
    }
    let density = area_to_solid_angle(light_corners(triangle), direction, distance * distance);
    return light_probability(receiver, index) * density;
}

// Radiance a surface point sends towards its viewer: as much as alpha covers it, and its coat lets through.
fn emitted(point: SurfacePoint, to_viewer: vec3f) -> vec3f {
    let both_sides = (material_flags(point.material) & DOUBLE_SIDED) != 0u;
    if !(point.front_face || both_sides) {
        return vec3f(0.0);
    }
    var radiance = point.parameters.emissive * point.parameters.alpha;
//#if COATED_EMITTERS
    let wo = local_from_world(point.shading_frame, to_viewer);
    radiance *= coat_attenuation(coat_new(point.parameters, point.front_face), wo);
//#end
    return radiance;
}
//#end

//#if PUNCTUAL_LIGHTS
fn sample_punctual(index: u32, position: vec3f, probability: f32) -> LightSample {
    var none: LightSample;
    let at = distant_light_at(globals.distant_light_count) + PUNCTUAL_WORDS * index;
    let kind = lights(at).x;
    let light_position = light_vec3(at + 1u);
    let light_direction = light_vec3(at + 4u);
    let intensity = light_vec3(at + 7u);
    let range = light_f32(at + 10u);
    if kind == DIRECTIONAL_LIGHT {
        return LightSample(-light_direction, F32_MAX, intensity / probability, F32_MAX);
    }
    let to_light = light_position - position;
    let distance = length(to_light);
    let direction = to_light / distance;
    var attenuation = 1.0;
    if kind == SPOT_LIGHT {
        let inner = light_f32(at + 11u);
        let outer = light_f32(at + 12u);
        let t = saturate((dot(light_direction, -direction) - outer) / max(inner - outer, 1e-4));
        attenuation = t * t;
    }
    if range < F32_MAX {
        let near = distance / range;
        attenuation *= saturate(1.0 - near * near * near * near);
    }
    let irradiance = intensity * attenuation / (distance * distance);
    if !is_finite3(irradiance) {
        return none;
    }
    return LightSample(direction, distance, irradiance / probability, F32_MAX);
}
//#end

// Twin of `Vertex::receiver`. In a medium the frame is zero.
fn receiver_of(vertex: Vertex) -> Receiver {
    var transmits = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    transmits = transmits || vertex.point.parameters.diffuse_transmission > 0.0;
//#end
    let normal = select(vertex.point.shading_frame.z, vec3f(0.0), transmits);
    return Receiver(vertex.point.position, normal);
}
