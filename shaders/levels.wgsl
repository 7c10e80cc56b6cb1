// The walk's second level: from the tree of the scene into those of meshes and back. See bvh.wgsl and
// src/bvh/instance.rs.

// Corners of a triangle of the tree, in the world.
fn tree_corners(index: u32, placement: Placement) -> mat3x3f {
    let a = in_world(placement, bitcast<vec3f>(bvh_triangles(3u * index).xyz));
    let b = in_world(placement, bitcast<vec3f>(bvh_triangles(3u * index + 1u).xyz));
    let c = in_world(placement, bitcast<vec3f>(bvh_triangles(3u * index + 2u).xyz));
    if placement.mirrors {
        return mat3x3f(a, c, b);
    }
    return mat3x3f(a, b, c);
}

// Of a leaf that is an instance; see src/bvh/compressed.rs.
const INSTANCE_TAG = 0x40000000u;

// Where in the two levels a walk is.
struct Level {
    // Whose mesh is walked; NO_INSTANCE in the upper level.
    instance: u32,
    // Height of the stack at which that has ended.
    below: u32,
}

// A ray as the boxes of an instance's mesh want it, or those in the world; see `Placed::brought`.
fn boxes_of(instance: u32, ray: Ray) -> BoxRay {
    if instance == NO_INSTANCE {
        return box_ray_new(ray, globals.scene_extent, vec3f(0.0));
    }
    let x = bitcast<vec4f>(instance_words(instance, MESH_FROM_WORLD));
    let y = bitcast<vec4f>(instance_words(instance, MESH_FROM_WORLD + 1u));
    let z = bitcast<vec4f>(instance_words(instance, MESH_FROM_WORLD + 2u));
    let d = ray.direction;
    let there = Ray(
        vec3f(mapped(x, ray.origin), mapped(y, ray.origin), mapped(z, ray.origin)),
        vec3f(dot(x.xyz, d), dot(y.xyz, d), dot(z.xyz, d)),
        ray.t_max,
    );
    let stretch = bitcast<vec4f>(instance_words(instance, STRETCH_REACH));
    let way = max_element(abs(ray.origin)) + globals.scene_extent + stretch.w;
    let extent = bitcast<f32>(instance_words(instance, INSTANCE_LIST).w);
    return box_ray_new(there, extent, stretch.xyz * (way * 1.9073486e-6)); // 32 * 2^-24
}

// Puts those leaves of a node aside that are instances; returns the triangles.
fn without_instances(entered: Entered, level: Level, height: ptr<function, u32>) -> u32 {
    if level.instance != NO_INSTANCE {
        return entered.triangles;
    }
    var found = 0u;
    var left = entered.triangles;
    while left != 0u {
        let bit = firstTrailingBit(left);
        left &= left - 1u;
        let tag = bvh_triangles(3u * (entered.triangle_base + bit) + 1u).w;
        found |= select(0u, 1u << bit, (tag & INSTANCE_TAG) != 0u);
    }
    if found != 0u {
        stack_put(*height, vec2u(entered.triangle_base, found));
        *height += 1u;
    }
    return entered.triangles & ~found;
}

// The next group of nodes that waits, after the walk has left an instance or entered one if need be.
// `false` if none waits.
fn next_group(
    group: ptr<function, vec2u>,
    height: ptr<function, u32>,
    level: ptr<function, Level>,
    boxes: ptr<function, BoxRay>,
    ray: Ray,
) -> bool {
    if (*level).instance != NO_INSTANCE && *height == (*level).below {
        (*level).instance = NO_INSTANCE;
        *boxes = boxes_of(NO_INSTANCE, ray);
    }
    if *height == 0u {
        return false;
    }
    *height -= 1u;
    let waiting = stack_at(*height);
    *group = waiting;
    if waiting.y > 0x00ffffffu {
        return true;
    }
    let left = waiting.y & (waiting.y - 1u);
    if left != 0u {
        stack_put(*height, vec2u(waiting.x, left));
        *height += 1u;
    }
    let instance = bvh_triangles(3u * (waiting.x + firstTrailingBit(waiting.y))).w;
    *level = Level(instance, *height);
    *boxes = boxes_of(instance, ray);
    *group = vec2u(instance_words(instance, INSTANCE_LIST).x, 0x80000000u);
    return true;
}
