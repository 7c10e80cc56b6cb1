// What a ray finds at a point of a triangle: twin of src/scene/surface.rs.

// Texels of a material in `materials`, as `layout::Material` has them.
const MATERIAL_TEXELS = 16u;
const BASE_COLOR_ALPHA = 0u;
const EMISSIVE_CUTOFF = 1u;
const SPECULAR_COLOR_STRENGTH = 2u;
const ABSORPTION_IOR = 3u;
// Metallic, roughness, transmission, clearcoat.
const FACTORS = 4u;
// Clearcoat roughness, normal scale, clearcoat normal scale, flags.
const SCALES_FLAGS = 5u;
const FIRST_TEXTURES = 6u;
// Scattering inside of a body and its mean cosine.
const SCATTERING = 11u;
// Strength, cosine and sine of the rotation.
const ANISOTROPY_SHEEN_ROUGHNESS = 12u;
const SHEEN_COLOR_DISPERSION = 13u;
const DIFFUSE_TRANSMISSION = 14u;
// Share, index, least and largest thickness.
const FILM = 15u;

// Textures of a material.
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
//#if UNCOMMON_TEXTURES
const ANISOTROPY_MAP = 10u;
const SHEEN_COLOR_MAP = 11u;
const SHEEN_ROUGHNESS_MAP = 12u;
const DIFFUSE_TRANSMISSION_MAP = 13u;
const DIFFUSE_TRANSMISSION_COLOR_MAP = 14u;
const IRIDESCENCE_MAP = 15u;
const IRIDESCENCE_THICKNESS_MAP = 16u;
const TEXTURES = 17u;
//#else
const TEXTURES = 10u;
//#end

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
//#if ANISOTROPY
    anisotropy: f32,
    anisotropy_axis: vec2f,
//#end
//#if SHEEN
    sheen_color: vec3f,
    sheen_roughness: f32,
//#end
//#if DIFFUSE_TRANSMISSION
    diffuse_transmission: f32,
    diffuse_transmission_color: vec3f,
//#end
//#if IRIDESCENCE
    iridescence: f32,
    iridescence_ior: f32,
    iridescence_thickness: f32,
//#end
//#if DISPERSION
    dispersion: f32,
//#end
}

struct SurfacePoint {
    position: vec3f,
    geometric_normal: vec3f,
//#if LIFTED
    lift: f32,
//#end
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
//#if INSTANCES
    placement: Placement,
//#end
}

fn corner_new(triangle: u32, barycentric: vec2f) -> Corner {
    let weights = vec3f(1.0 - barycentric.x - barycentric.y, barycentric);
//#if INSTANCES
    let placement = placement_of(instance_of(triangle));
    let listed = triangles(triangle - placement.shift);
    let record = select(listed, listed.xzyw, placement.mirrors);
    return Corner(record.xyz, weights, record.w, placement);
//#else
    let record = triangles(triangle);
    return Corner(record.xyz, weights, record.w);
//#end
}

fn material_words(material: u32, texel: u32) -> vec4u {
    return materials(MATERIAL_TEXELS * material + texel);
}

fn material_numbers(material: u32, texel: u32) -> vec4f {
    return bitcast<vec4f>(material_words(material, texel));
}

fn material_flags(material: u32) -> u32 {
    return material_words(material, SCALES_FLAGS).w;
}

// One of the texels of a vertex: position and normal.x, normal.yz and first texture coordinates,
// then those that the scene needs.
fn vertex_texel(vertex: u32, texel: u32) -> vec4f {
    return bitcast<vec4f>(vertices(VERTEX_TEXELS * vertex + texel));
}

fn vertex_position(vertex: u32) -> vec3f {
    return vertex_texel(vertex, 0u).xyz;
}

fn corner_value(corner: Corner, texel: u32) -> vec4f {
    return vertex_texel(corner.vertices.x, texel) * corner.weights.x
        + vertex_texel(corner.vertices.y, texel) * corner.weights.y
        + vertex_texel(corner.vertices.z, texel) * corner.weights.z;
}

// The texture's value at coordinates of both sets, ones without a texture.
fn read_texture(reference: u32, uvs: vec4f) -> vec4f {
//#if TEXTURES
    if reference != NO_TEXTURE {
        return sample_texture(reference, uvs);
    }
//#end
    return vec4f(1.0);
}

// Texture coordinates of both sets.
fn corner_uvs(corner: Corner, first_set: vec2f) -> vec4f {
//#if SECOND_UV_SET
    return vec4f(first_set, corner_value(corner, SECOND_UV_TEXEL).xy);
//#else
    return vec4f(first_set, 0.0, 0.0);
//#end
}

// All textures of the material here. One loop, over those that any material of the scene has: a
// shader holds the code of a texture read once.
fn read_textures(corner: Corner, uvs: vec4f) -> array<vec4f, TEXTURES> {
    var values: array<vec4f, TEXTURES>;
    for (var i = 0u; i < TEXTURES; i++) {
        values[i] = vec4f(1.0);
    }
    var left = TEXTURES_IN_SCENE & ((1u << TEXTURES) - 1u);
    while left != 0u {
        let i = firstTrailingBit(left);
        left &= left - 1u;
        let value = read_texture(texture_of(corner.material, i), uvs);
        values[BASE_COLOR] = put_texture(BASE_COLOR, i, value, values[BASE_COLOR]);
        values[METALLIC_ROUGHNESS] =
            put_texture(METALLIC_ROUGHNESS, i, value, values[METALLIC_ROUGHNESS]);
        values[NORMAL] = put_texture(NORMAL, i, value, values[NORMAL]);
        values[EMISSIVE] = put_texture(EMISSIVE, i, value, values[EMISSIVE]);
        values[SPECULAR] = put_texture(SPECULAR, i, value, values[SPECULAR]);
        values[SPECULAR_COLOR] = put_texture(SPECULAR_COLOR, i, value, values[SPECULAR_COLOR]);
        values[TRANSMISSION] = put_texture(TRANSMISSION, i, value, values[TRANSMISSION]);
        values[CLEARCOAT] = put_texture(CLEARCOAT, i, value, values[CLEARCOAT]);
        values[CLEARCOAT_ROUGHNESS] =
            put_texture(CLEARCOAT_ROUGHNESS, i, value, values[CLEARCOAT_ROUGHNESS]);
        values[CLEARCOAT_NORMAL] =
            put_texture(CLEARCOAT_NORMAL, i, value, values[CLEARCOAT_NORMAL]);
//#if UNCOMMON_TEXTURES
        values[ANISOTROPY_MAP] = put_texture(ANISOTROPY_MAP, i, value, values[ANISOTROPY_MAP]);
        values[SHEEN_COLOR_MAP] = put_texture(SHEEN_COLOR_MAP, i, value, values[SHEEN_COLOR_MAP]);
        values[SHEEN_ROUGHNESS_MAP] =
            put_texture(SHEEN_ROUGHNESS_MAP, i, value, values[SHEEN_ROUGHNESS_MAP]);
        values[DIFFUSE_TRANSMISSION_MAP] =
            put_texture(DIFFUSE_TRANSMISSION_MAP, i, value, values[DIFFUSE_TRANSMISSION_MAP]);
        values[DIFFUSE_TRANSMISSION_COLOR_MAP] = put_texture(
            DIFFUSE_TRANSMISSION_COLOR_MAP, i, value, values[DIFFUSE_TRANSMISSION_COLOR_MAP]);
        values[IRIDESCENCE_MAP] = put_texture(IRIDESCENCE_MAP, i, value, values[IRIDESCENCE_MAP]);
        values[IRIDESCENCE_THICKNESS_MAP] =
            put_texture(IRIDESCENCE_THICKNESS_MAP, i, value, values[IRIDESCENCE_THICKNESS_MAP]);
//#end
    }
    return values;
}

// The `value` read for texture `read` if it is `texture`, else what was there. With these, no index
// into the values is computed, which would keep all of them in registers or in memory.
fn put_texture(texture: u32, read: u32, value: vec4f, before: vec4f) -> vec4f {
    if (TEXTURES_IN_SCENE & (1u << texture)) == 0u {
        return before;
    }
    return select(before, value, read == texture);
}

fn texture_of(material: u32, texture: u32) -> u32 {
    return material_words(material, FIRST_TEXTURES + texture / 4u)[texture % 4u];
}

fn corner_base_color(corner: Corner, texture: vec4f) -> vec4f {
    var color = material_numbers(corner.material, BASE_COLOR_ALPHA) * texture;
//#if VERTEX_COLORS
    color *= corner_value(corner, COLOR_TEXEL);
//#end
    return color;
}

//#if TANGENTS
// Interpolated tangent, and the handedness of the first corner's.
fn corner_tangent(corner: Corner) -> vec4f {
//#if INSTANCES
    let a = tangent_in_world(corner.placement, vertex_texel(corner.vertices.x, TANGENT_TEXEL));
    let b = tangent_in_world(corner.placement, vertex_texel(corner.vertices.y, TANGENT_TEXEL));
    let c = tangent_in_world(corner.placement, vertex_texel(corner.vertices.z, TANGENT_TEXEL));
    let w = corner.weights;
    return vec4f(a.xyz * w.x + b.xyz * w.y + c.xyz * w.z, a.w);
//#else
    let first = vertex_texel(corner.vertices.x, TANGENT_TEXEL);
    return vec4f(corner_value(corner, TANGENT_TEXEL).xyz, first.w);
//#end
}
//#end

// The normal a tangent-space map makes of `normal`, not of unit length (see `Corner::mapped`).
fn mapped_normal(corner: Corner, normal: vec3f, slot: u32, texture: vec4f, scale: f32) -> vec3f {
//#if NORMAL_MAPS
    if texture_of(corner.material, slot) != NO_TEXTURE {
        let found = corner_tangent(corner);
        let tangent = found.xyz;
        let bitangent = cross(normal, tangent) * found.w;
        let map = texture.xyz * 2.0 - 1.0;
        return tangent * (map.x * scale) + bitangent * (map.y * scale) + normal * map.z;
    }
//#end
    return normal;
}

//#if ANISOTROPY
// Twin of `Corner::anisotropy_direction`.
fn anisotropy_direction(corner: Corner, normal: vec3f, texture: vec4f) -> vec3f {
    let found = corner_tangent(corner);
    let tangent = found.xyz;
    let bitangent = cross(normal, tangent) * found.w;
    var direction = vec2f(1.0, 0.0);
    if texture_of(corner.material, ANISOTROPY_MAP) != NO_TEXTURE {
        direction = texture.xy * 2.0 - 1.0;
    }
    let turn = material_numbers(corner.material, ANISOTROPY_SHEEN_ROUGHNESS).yz;
    return tangent * (turn.x * direction.x - turn.y * direction.y)
        + bitangent * (turn.y * direction.x + turn.x * direction.y);
}
//#end

fn opacity(flags: u32, cutoff: f32, alpha: f32) -> f32 {
    if (flags & ALPHA_MASK) != 0u {
        return select(0.0, 1.0, alpha >= cutoff);
    }
    return select(1.0, saturate(alpha), (flags & ALPHA_BLEND) != 0u);
}

// Twin of `surface::alpha_at`.
fn alpha_at(triangle: u32, barycentric: vec2f) -> f32 {
    let corner = corner_new(triangle, barycentric);
    let flags = material_flags(corner.material);
    if (flags & (ALPHA_MASK | ALPHA_BLEND)) == 0u {
        return 1.0;
    }
    let uvs = corner_uvs(corner, corner_value(corner, 1u).zw);
    let texture = read_texture(texture_of(corner.material, BASE_COLOR), uvs);
    let cutoff = material_numbers(corner.material, EMISSIVE_CUTOFF).w;
    return opacity(flags, cutoff, corner_base_color(corner, texture).w);
}

fn corner_parameters(corner: Corner, textures: array<vec4f, TEXTURES>) -> SurfaceParameters {
    let m = corner.material;
    let flags = material_flags(m);
    let factors = material_numbers(m, FACTORS);
    let specular = material_numbers(m, SPECULAR_COLOR_STRENGTH);
    let emissive = material_numbers(m, EMISSIVE_CUTOFF);
    let absorption_ior = material_numbers(m, ABSORPTION_IOR);
    let base = corner_base_color(corner, textures[BASE_COLOR]);
    var p: SurfaceParameters;
    p.base_color = saturate(base.xyz);
    p.alpha = opacity(flags, emissive.w, base.w);
    p.metallic = saturate(factors.x * textures[METALLIC_ROUGHNESS].z);
    p.roughness = saturate(factors.y * textures[METALLIC_ROUGHNESS].y);
    p.ior = absorption_ior.w;
    p.specular = saturate(specular.w * textures[SPECULAR].w);
    p.specular_color = specular.xyz * textures[SPECULAR_COLOR].xyz;
    p.thin = (flags & THIN) != 0u;
//#if TRANSMISSION
    p.transmission = saturate(factors.z * textures[TRANSMISSION].x);
    p.absorption = absorption_ior.xyz;
//#end
    p.clearcoat_normal = vec3f(0.0, 0.0, 1.0);
//#if CLEARCOAT
    let roughness = material_numbers(m, SCALES_FLAGS).x;
    p.clearcoat = saturate(factors.w * textures[CLEARCOAT].x);
    p.clearcoat_roughness = saturate(roughness * textures[CLEARCOAT_ROUGHNESS].y);
//#end
//#if ANISOTROPY
    p.anisotropy =
        saturate(material_numbers(m, ANISOTROPY_SHEEN_ROUGHNESS).x * textures[ANISOTROPY_MAP].z);
    p.anisotropy_axis = vec2f(1.0, 0.0);
//#end
//#if SHEEN
    p.sheen_color = material_numbers(m, SHEEN_COLOR_DISPERSION).xyz * textures[SHEEN_COLOR_MAP].xyz;
    let sheen_roughness = material_numbers(m, ANISOTROPY_SHEEN_ROUGHNESS).w;
    p.sheen_roughness = saturate(sheen_roughness * textures[SHEEN_ROUGHNESS_MAP].w);
//#end
//#if DIFFUSE_TRANSMISSION
    let through = material_numbers(m, DIFFUSE_TRANSMISSION);
    p.diffuse_transmission = saturate(through.w * textures[DIFFUSE_TRANSMISSION_MAP].w);
    p.diffuse_transmission_color = through.xyz * textures[DIFFUSE_TRANSMISSION_COLOR_MAP].xyz;
//#end
//#if IRIDESCENCE
    let film = material_numbers(m, FILM);
    p.iridescence = saturate(film.x * textures[IRIDESCENCE_MAP].x);
    p.iridescence_ior = film.y;
    p.iridescence_thickness = film.z + (film.w - film.z) * textures[IRIDESCENCE_THICKNESS_MAP].y;
//#end
//#if DISPERSION
    if !p.thin && factors.z > 0.0 {
        p.dispersion = material_numbers(m, SHEEN_COLOR_DISPERSION).w;
    }
//#end
    p.unlit = (flags & UNLIT) != 0u;
    if p.unlit {
        p.emissive = p.base_color * emissive.xyz;
    } else {
//#if EMITTERS
        p.emissive = emissive.xyz * textures[EMISSIVE].xyz;
//#end
    }
    return p;
}

// The point of `triangle` at `barycentric`, met by a ray that travels along `ray_direction`.
fn surface_at(triangle: u32, barycentric: vec2f, ray_direction: vec3f) -> SurfacePoint {
    let corner = corner_new(triangle, barycentric);
    let w = corner.weights;
    let a0 = vertex_texel(corner.vertices.x, 0u);
    let b0 = vertex_texel(corner.vertices.y, 0u);
    let c0 = vertex_texel(corner.vertices.z, 0u);
    let a1 = vertex_texel(corner.vertices.x, 1u);
    let b1 = vertex_texel(corner.vertices.y, 1u);
    let c1 = vertex_texel(corner.vertices.z, 1u);
    var normals = mat3x3f(vec3f(a0.w, a1.xy), vec3f(b0.w, b1.xy), vec3f(c0.w, c1.xy));
//#if INSTANCES
    let placement = corner.placement;
    let a = in_world(placement, a0.xyz);
    let b = in_world(placement, b0.xyz);
    let c = in_world(placement, c0.xyz);
    normals[0] = normal_in_world(placement, normals[0]);
    normals[1] = normal_in_world(placement, normals[1]);
    normals[2] = normal_in_world(placement, normals[2]);
//#else
    let a = a0.xyz;
    let b = b0.xyz;
    let c = c0.xyz;
//#end
    let front_normal = normalize_or(cross(b - a, c - a), -ray_direction);
    var point: SurfacePoint;
    point.position = a * w.x + b * w.y + c * w.z;
    point.front_face = dot(ray_direction, front_normal) < 0.0;
    point.geometric_normal = select(-front_normal, front_normal, point.front_face);
    point.triangle = triangle;
    point.material = corner.material;
    let unmapped = smooth_normal(normals, w, front_normal);
//#if LIFTED
    // Early, so that the corners need no registers later.
    let lift = lift_of(point, mat3x3f(a, b, c), normals, w, unmapped);
//#end
    let uvs = corner_uvs(corner, a1.zw * w.x + b1.zw * w.y + c1.zw * w.z);
    let textures = read_textures(corner, uvs);
    point.parameters = corner_parameters(corner, textures);

    let to_viewer = -ray_direction;
    let scales = material_numbers(corner.material, SCALES_FLAGS);
    var normal = mapped_normal(corner, unmapped, NORMAL, textures[NORMAL], scales.y);
    normal = turned(normal, unmapped, point.geometric_normal, to_viewer);
//#if METALS
    if point.parameters.metallic > 0.0 {
        let mirroring = mirroring_normal(normal, point.geometric_normal, to_viewer);
        normal = mix(normal, mirroring, point.parameters.metallic);
    }
//#end
    point.shading_frame = frame_from_z(normalize(normal));
//#if LIFTED
    point.lift = select(0.0, lift, is_opaque(point.parameters));
//#end
//#if ANISOTROPY
    if point.parameters.anisotropy > 0.0 {
        let wide = anisotropy_direction(corner, unmapped, textures[ANISOTROPY_MAP]);
        let axis = local_from_world(point.shading_frame, wide).xy;
        point.parameters.anisotropy_axis =
            normalize_or(vec3f(axis, 0.0), vec3f(1.0, 0.0, 0.0)).xy;
    }
//#end
//#if CLEARCOAT
    let maps = TEXTURES_IN_SCENE & ((1u << NORMAL) | (1u << CLEARCOAT_NORMAL));
    let is_mapped = maps != 0u && (bitcast<u32>(scales.w) & NORMAL_MAPPED) != 0u;
    if point.parameters.clearcoat > 0.0 && is_mapped {
        let mapped = mapped_normal(corner, unmapped, CLEARCOAT_NORMAL, textures[CLEARCOAT_NORMAL],
            scales.z);
        let coat = turned(mapped, unmapped, point.geometric_normal, to_viewer);
        point.parameters.clearcoat_normal = local_from_world(
            point.shading_frame, mirroring_normal(coat, point.geometric_normal, to_viewer));
    }
//#end
    return point;
}

// Twin of `Sides::is_above`.
fn is_above(point: SurfacePoint, direction: vec3f) -> bool {
//#if LIFTED
    let horizon = horizon_of(point.geometric_normal, point.shading_frame.z, point.lift);
    return dot(point.geometric_normal, direction) > horizon;
//#else
    return dot(point.geometric_normal, direction) > 0.0;
//#end
}

// Twin of `Sides::origin_toward`.
fn origin_toward(point: SurfacePoint, direction: vec3f) -> vec3f {
    let is_in_front = dot(point.geometric_normal, direction) > 0.0;
    let normal = select(-point.geometric_normal, point.geometric_normal, is_in_front);
//#if LIFTED
    if lifts(point, direction) {
        return offset_origin(point.position - point.lift * normal, -normal);
    }
//#end
    return offset_origin(point.position, normal);
}

//#if LIFTED
// Twin of `Sides::of`.
fn horizon_of(geometric_normal: vec3f, shading_normal: vec3f, lift: f32) -> f32 {
    let cosine = dot(geometric_normal, shading_normal);
    let tilt = min(sqrt(max(1.0 - cosine * cosine, 0.0)), MAX_TILT);
    return select(0.0, -tilt, lift > 0.0);
}

// Twin of `Sides::lifts`.
fn lifts(point: SurfacePoint, direction: vec3f) -> bool {
    return is_above(point, direction) && dot(point.geometric_normal, direction) <= 0.0;
}

fn is_opaque(p: SurfaceParameters) -> bool {
//#if DIFFUSE_TRANSMISSION
    if p.diffuse_transmission > 0.0 {
        return false;
    }
//#end
    return p.transmission <= 0.0;
}

// Twin of `Corner::lift`; corners and their normals are columns.
fn lift_of(
    point: SurfacePoint,
    corners: mat3x3f,
    normals: mat3x3f,
    weights: vec3f,
    smooth_: vec3f,
) -> f32 {
    let normal = point.geometric_normal;
    if length(cross(smooth_, normal)) < MIN_TILT * length(smooth_) {
        return 0.0;
    }
    let side = copysign(1.0, dot(smooth_, normal));
    var height = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let corner = normals[i] * side;
        let below = max(-dot(corner, point.position - corners[i]), 0.0);
        height += weights[i] * below * max(dot(corner, normal), 0.0) / dot(corner, corner);
    }
    return height;
}
//#end

// Interpolated normal of the corners' (the columns), not of unit length; `flat_normal` where the
// triangle is flat.
fn smooth_normal(normals: mat3x3f, weights: vec3f, flat_normal: vec3f) -> vec3f {
    let zero = vec3f(0.0);
    if all(normals[0] == zero) || all(normals[1] == zero) || all(normals[2] == zero) {
        return flat_normal;
    }
    let normal = normals * weights;
    return select(flat_normal, normal, dot(normal, normal) > 1e-12);
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
