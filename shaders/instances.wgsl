// Instances of meshes that are held once: twin of src/scene/instances.rs and src/bvh/instance.rs.

// No instance: a triangle that lies in the world.
const NO_INSTANCE = 0xffffffffu;

// Texels of an instance: rows of world from mesh, then of mesh from world; how far coordinates move in the
// mesh's space and the largest one on the way; then INSTANCE_LIST.
const INSTANCE_TEXELS = 8u;
const MESH_FROM_WORLD = 3u;
const STRETCH_REACH = 6u;
// Root of the mesh's tree; whether triangles are turned around; what a number is larger by than the
// place in the list of triangles; largest coordinate in the mesh's space. For ray queries the first and
// the last are where the mesh's triangles begin, and how many of them end every ray.
const INSTANCE_LIST = 7u;

fn instance_words(instance: u32, texel: u32) -> vec4u {
    return instances(INSTANCE_TEXELS * instance + texel);
}

// Which instance the triangle of a number is of.
fn instance_of(triangle: u32) -> u32 {
    if triangle < globals.first_of_instances {
        return NO_INSTANCE;
    }
    return instance_slots((triangle - globals.first_of_instances) >> globals.slot_log2).x;
}

// How an instance, or what lies in the world, gets there.
struct Placement {
    // Rows of the map.
    x: vec4f,
    y: vec4f,
    z: vec4f,
    mirrors: bool,
    // What a number is larger by than the place in the list of triangles.
    shift: u32,
}

fn placement_of(instance: u32) -> Placement {
    if instance == NO_INSTANCE {
        return Placement(
            vec4f(1.0, 0.0, 0.0, 0.0), vec4f(0.0, 1.0, 0.0, 0.0), vec4f(0.0, 0.0, 1.0, 0.0),
            false, 0u);
    }
    let list = instance_words(instance, INSTANCE_LIST);
    return Placement(
        bitcast<vec4f>(instance_words(instance, 0u)),
        bitcast<vec4f>(instance_words(instance, 1u)),
        bitcast<vec4f>(instance_words(instance, 2u)),
        list.y != 0u,
        list.z,
    );
}

// World position of a vertex. Fused by hand: the walk and the surface must find the same place, or a
// surface far from its mesh's origin would shade itself.
fn in_world(placement: Placement, p: vec3f) -> vec3f {
    return vec3f(mapped(placement.x, p), mapped(placement.y, p), mapped(placement.z, p));
}

fn mapped(row: vec4f, p: vec3f) -> f32 {
    return fma(row.x, p.x, fma(row.y, p.y, fma(row.z, p.z, row.w)));
}

// Twin of `Placing::normal`: zero stays zero.
fn normal_in_world(placement: Placement, normal: vec3f) -> vec3f {
    let x = placement.x.xyz;
    let y = placement.y.xyz;
    let z = placement.z.xyz;
    let cofactors =
        vec3f(dot(cross(y, z), normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
    return normalize_or(select(cofactors, -cofactors, placement.mirrors), vec3f(0.0));
}

//#if TANGENTS
// Twin of `Placing::tangent`.
fn tangent_in_world(placement: Placement, tangent: vec4f) -> vec4f {
    let t = tangent.xyz;
    let along = vec3f(dot(placement.x.xyz, t), dot(placement.y.xyz, t), dot(placement.z.xyz, t));
    let handedness = select(tangent.w, -tangent.w, placement.mirrors);
    return vec4f(normalize_or(along, vec3f(1.0, 0.0, 0.0)), handedness);
}
//#end
