// What a ray finds at a point of a triangle: twin of src/scene/surface.rs.

const MIN_COSINE_SHARE = 0.05;
const MIN_MIRROR_COSINE = 0.01;

// Material.flags
const ALPHA_MASK = 1u;
const ALPHA_BLEND = 2u;
const DOUBLE_SIDED = 4u;
const UNLIT = 8u;
const THIN = 16u;
// Part of the light may go straight through.
const PARTIAL = 32u;
const NORMAL_MAPPED = 64u;

const NO_TEXTURE = 0xffffffffu;

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    alpha_cutoff: f32,
    specular_color: vec3f,
    specular: f32,
    absorption: vec3f,
    ior: f32,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    clearcoat: f32,
    clearcoat_roughness: f32,
    normal_scale: f32,
    clearcoat_normal_scale: f32,
    flags: u32,
    // By the numbers below.
    textures: array<u32, 10>,
    padding_0: u32,
    padding_1: u32,
}

// Material.textures
const BASE_COLOR = 0u;
const METALLIC_ROUGHNESS = 1u;
const NORMAL = 2u;
const EMISSIVE = 3u;
const SPECULAR = 4u;
const SPECULAR_COLOR = 5u;
const TRANSMISSION = 6u;
const CLEARCOAT = 7u;
const CLEARCOAT_ROUGHNESS = 8u;
const CLEARCOAT_NORMAL = 9u;
const TEXTURES = 10u;

struct SurfaceParameters {
    base_color: vec3f,
    alpha: f32,
    metallic: f32,
    roughness: f32,
    ior: f32,
    specular: f32,
    specular_color: vec3f,
    transmission: f32,
    absorption: vec3f,
    clearcoat: f32,
    clearcoat_normal: vec3f,
    clearcoat_roughness: f32,
    emissive: vec3f,
    thin: bool,
    unlit: bool,
}

struct SurfacePoint {
    position: vec3f,
    geometric_normal: vec3f,
    shading_frame: Frame,
    parameters: SurfaceParameters,
    triangle: u32,
    material: u32,
    front_face: bool,
}

// A point of a triangle, ready to interpolate what its corners have.
struct Corner {
    vertices: vec3u,
    weights: vec3f,
    material: u32,
}

fn corner_new(triangle: u32, barycentric: vec2f) -> Corner {
    let first = globals.triangles_at + 3u * triangle;
    return Corner(
        vec3u(geometry(first), geometry(first + 1u), geometry(first + 2u)),
        vec3f(1.0 - barycentric.x - barycentric.y, barycentric),
        material_of(triangle),
    );
}

fn material_of(triangle: u32) -> u32 {
    return geometry(globals.triangle_materials_at + triangle);
}

fn geometry_f32(at: u32) -> f32 {
    return bitcast<f32>(geometry(at));
}

fn geometry_vec2(at: u32) -> vec2f {
    return vec2f(geometry_f32(at), geometry_f32(at + 1u));
}

fn geometry_vec3(at: u32) -> vec3f {
    return vec3f(geometry_f32(at), geometry_f32(at + 1u), geometry_f32(at + 2u));
}

fn geometry_vec4(at: u32) -> vec4f {
    return vec4f(geometry_vec3(at), geometry_f32(at + 3u));
}

fn vertex_position(vertex: u32) -> vec3f {
    return geometry_vec3(globals.positions_at + 3u * vertex);
}

//#if textures
fn corner_uv(corner: Corner, uv_set: u32) -> vec2f {
    let at = select(globals.uvs_at.x, globals.uvs_at.y, uv_set == 1u);
    if at == NO_ARRAY {
        return vec2f(0.0);
    }
    return geometry_vec2(at + 2u * corner.vertices.x) * corner.weights.x
        + geometry_vec2(at + 2u * corner.vertices.y) * corner.weights.y
        + geometry_vec2(at + 2u * corner.vertices.z) * corner.weights.z;
}
//#end

// The texture's value here, ones without a texture.
fn read_texture(corner: Corner, reference: u32) -> vec4f {
//#if textures
    if reference != NO_TEXTURE {
        return sample_texture(reference, corner_uv(corner, texture_uv_set(reference)));
    }
//#end
    return vec4f(1.0);
}

// All textures of the material here. One loop: a shader holds the code of a texture read once.
fn read_textures(corner: Corner) -> array<vec4f, TEXTURES> {
    var values: array<vec4f, TEXTURES>;
    for (var i = 0u; i < TEXTURES; i++) {
        values[i] = read_texture(corner, materials[corner.material].textures[i]);
    }
    return values;
}

fn corner_base_color(corner: Corner, texture: vec4f) -> vec4f {
    var color = materials[corner.material].base_color * texture;
//#if vertex_colors
    let at = globals.colors_at;
    color *= geometry_vec4(at + 4u * corner.vertices.x) * corner.weights.x
        + geometry_vec4(at + 4u * corner.vertices.y) * corner.weights.y
        + geometry_vec4(at + 4u * corner.vertices.z) * corner.weights.z;
//#end
    return color;
}

// Interpolated normal, not of unit length; `flat_normal` where the triangle is flat.
fn smooth_normal(corner: Corner, flat_normal: vec3f) -> vec3f {
    let at = globals.normals_at;
    if at == NO_ARRAY {
        return flat_normal;
    }
    let a = geometry_vec3(at + 3u * corner.vertices.x);
    let b = geometry_vec3(at + 3u * corner.vertices.y);
    let c = geometry_vec3(at + 3u * corner.vertices.z);
    if all(a == vec3f(0.0)) || all(b == vec3f(0.0)) || all(c == vec3f(0.0)) {
        return flat_normal;
    }
    let normal = a * corner.weights.x + b * corner.weights.y + c * corner.weights.z;
    return select(flat_normal, normal, dot(normal, normal) > 1e-12);
}

// The normal a tangent-space map makes of `normal`, not of unit length (see `Corner::mapped`).
fn mapped_normal(corner: Corner, normal: vec3f, slot: u32, texture: vec4f, scale: f32) -> vec3f {
//#if normal_maps
    let at = globals.tangents_at;
    if materials[corner.material].textures[slot] != NO_TEXTURE && at != NO_ARRAY {
        let first = geometry_vec4(at + 4u * corner.vertices.x);
        let tangent = first.xyz * corner.weights.x
            + geometry_vec3(at + 4u * corner.vertices.y) * corner.weights.y
            + geometry_vec3(at + 4u * corner.vertices.z) * corner.weights.z;
        let bitangent = cross(normal, tangent) * first.w;
        let map = texture.xyz * 2.0 - 1.0;
        return tangent * (map.x * scale) + bitangent * (map.y * scale) + normal * map.z;
    }
//#end
    return normal;
}

fn opacity(flags: u32, cutoff: f32, alpha: f32) -> f32 {
    if (flags & ALPHA_MASK) != 0u {
        return select(0.0, 1.0, alpha >= cutoff);
    }
    return select(1.0, saturate(alpha), (flags & ALPHA_BLEND) != 0u);
}

// Twin of `surface::alpha_at`.
fn alpha_at(triangle: u32, barycentric: vec2f) -> f32 {
    let material = material_of(triangle);
    let flags = materials[material].flags;
    if (flags & (ALPHA_MASK | ALPHA_BLEND)) == 0u {
        return 1.0;
    }
    let corner = corner_new(triangle, barycentric);
    let texture = read_texture(corner, materials[material].textures[BASE_COLOR]);
    let alpha = corner_base_color(corner, texture).w;
    return opacity(flags, materials[material].alpha_cutoff, alpha);
}

fn corner_parameters(corner: Corner, textures: array<vec4f, TEXTURES>) -> SurfaceParameters {
    let m = corner.material;
    let flags = materials[m].flags;
    let base = corner_base_color(corner, textures[BASE_COLOR]);
    let metallic_roughness = textures[METALLIC_ROUGHNESS];
    var p: SurfaceParameters;
    p.base_color = saturate(base.xyz);
    p.alpha = opacity(flags, materials[m].alpha_cutoff, base.w);
    p.metallic = saturate(materials[m].metallic * metallic_roughness.z);
    p.roughness = saturate(materials[m].roughness * metallic_roughness.y);
    p.ior = materials[m].ior;
    p.specular = saturate(materials[m].specular * textures[SPECULAR].w);
    p.specular_color = materials[m].specular_color
        * textures[SPECULAR_COLOR].xyz;
    p.thin = (flags & THIN) != 0u;
//#if transmission
    p.transmission = saturate(
        materials[m].transmission * textures[TRANSMISSION].x);
    p.absorption = materials[m].absorption;
//#end
    p.clearcoat_normal = vec3f(0.0, 0.0, 1.0);
//#if clearcoat
    p.clearcoat = saturate(
        materials[m].clearcoat * textures[CLEARCOAT].x);
    p.clearcoat_roughness = saturate(materials[m].clearcoat_roughness
        * textures[CLEARCOAT_ROUGHNESS].y);
//#end
    p.unlit = (flags & UNLIT) != 0u;
    if p.unlit {
        p.emissive = p.base_color;
    } else {
//#if emitters
        p.emissive = materials[m].emissive
            * textures[EMISSIVE].xyz;
//#end
    }
    return p;
}

// The point of `triangle` at `barycentric`, met by a ray that travels along `ray_direction`.
fn surface_at(triangle: u32, barycentric: vec2f, ray_direction: vec3f) -> SurfacePoint {
    let corner = corner_new(triangle, barycentric);
    let a = vertex_position(corner.vertices.x);
    let b = vertex_position(corner.vertices.y);
    let c = vertex_position(corner.vertices.z);
    let front_normal = normalize_or(cross(b - a, c - a), -ray_direction);
    var point: SurfacePoint;
    point.position = a * corner.weights.x + b * corner.weights.y + c * corner.weights.z;
    point.front_face = dot(ray_direction, front_normal) < 0.0;
    point.geometric_normal = select(-front_normal, front_normal, point.front_face);
    point.triangle = triangle;
    point.material = corner.material;
    let textures = read_textures(corner);
    point.parameters = corner_parameters(corner, textures);

    let to_viewer = -ray_direction;
    let unmapped = smooth_normal(corner, front_normal);
    var normal = mapped_normal(corner, unmapped, NORMAL, textures[NORMAL],
        materials[corner.material].normal_scale);
    normal = turned(normal, unmapped, point.geometric_normal, to_viewer);
//#if metals
    if point.parameters.metallic > 0.0 {
        let mirroring = mirroring_normal(normal, point.geometric_normal, to_viewer);
        normal = mix(normal, mirroring, point.parameters.metallic);
    }
//#end
    point.shading_frame = frame_from_z(normalize(normal));
//#if clearcoat
    let is_mapped = (materials[corner.material].flags & NORMAL_MAPPED) != 0u;
    if point.parameters.clearcoat > 0.0 && is_mapped {
        let mapped = mapped_normal(corner, unmapped, CLEARCOAT_NORMAL, textures[CLEARCOAT_NORMAL],
            materials[corner.material].clearcoat_normal_scale);
        let coat = turned(mapped, unmapped, point.geometric_normal, to_viewer);
        point.parameters.clearcoat_normal = local_from_world(
            point.shading_frame, mirroring_normal(coat, point.geometric_normal, to_viewer));
    }
//#end
    return point;
}

// Twin of `Facing::turned`.
fn turned(normal: vec3f, unmapped: vec3f, geometric_normal: vec3f, to_viewer: vec3f) -> vec3f {
    let side = copysign(1.0, dot(unmapped, geometric_normal));
    let facing = normalize_or(normal, geometric_normal * side) * side;
    return bent(bent(facing, geometric_normal, geometric_normal), to_viewer, geometric_normal);
}

// Twin of `Facing::bent`.
fn bent(normal: vec3f, toward: vec3f, geometric_normal: vec3f) -> vec3f {
    let cosine = dot(normal, toward);
    let geometric_cosine = dot(geometric_normal, toward);
    let least = MIN_COSINE_SHARE * geometric_cosine;
    if cosine >= least {
        return normal;
    }
    let t = (least - cosine) / (geometric_cosine - cosine);
    return normalize_or(mix(normal, geometric_normal, t), geometric_normal);
}

// Twin of `Facing::mirroring`.
fn mirroring_normal(normal: vec3f, geometric_normal: vec3f, to_viewer: vec3f) -> vec3f {
    let z = dot(to_viewer, geometric_normal);
    let least = min(MIN_MIRROR_COSINE, 0.9 * z);
    let mirrored = 2.0 * dot(normal, to_viewer) * normal - to_viewer;
    if dot(mirrored, geometric_normal) >= least {
        return normal;
    }
    let along = normalize_or(normal - geometric_normal * dot(normal, geometric_normal), vec3f(0.0));
    let x = dot(to_viewer, along);
    let reach = sqrt(x * x + z * z);
    let height = clamp(least / reach, -1.0, 1.0);
    let tilt = 0.5 * (angle_of(x, z) + angle_of(sqrt(max(1.0 - height * height, 0.0)), height));
    let sin_cos = sin_cos_turns(tilt / TAU);
    return sin_cos.x * along + sin_cos.y * geometric_normal;
}
