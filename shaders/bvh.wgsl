// What a ray hits: obvhs' compressed wide BVH (Ylitie, Karras, Laine, HPG 2017) and a watertight
// triangle test (Woop, Benthin, Wald, JCGT 2013). The same hits as src/bvh/, by another tree.

// No hit: Hit.t.
const MISS = F32_MAX;

struct Ray {
    origin: vec3f,
    direction: vec3f,
    t_max: f32,
}

struct Hit {
    // Distance in lengths of the ray's direction; MISS if there is none.
    t: f32,
    // Index in the scene's list of triangles.
    triangle: u32,
    // Weights of the second and the third vertex.
    barycentric: vec2f,
    // Flags of its material, and FROM_BEHIND.
    flags: u32,
}

// Of a hit: the ray came from behind the triangle.
const FROM_BEHIND = 0x80000000u;

// Which invocation of its workgroup this is.
var<private> own_lane: u32;

//#if SOFTWARE_WALK
// Invocations of a workgroup.
const LANES = 64u;
// The lower entries of a walk's stack; at most SHARED_STACK_SIZE of them. In registers or a lane's own
// memory they would cost far more.
var<workgroup> shared_stack: array<vec2u, LANES * SHARED_STACK_SIZE>;
//#if DEEP_TREE
// The others, seldom reached.
var<private> far_stack: array<vec2u, STACK_SIZE - SHARED_STACK_SIZE>;
//#end

fn stack_put(height: u32, group: vec2u) {
//#if DEEP_TREE
    if height >= SHARED_STACK_SIZE {
        far_stack[height - SHARED_STACK_SIZE] = group;
        return;
    }
//#end
    shared_stack[LANES * height + own_lane] = group;
}

fn stack_at(height: u32) -> vec2u {
//#if DEEP_TREE
    if height >= SHARED_STACK_SIZE {
        return far_stack[height - SHARED_STACK_SIZE];
    }
//#end
    return shared_stack[LANES * height + own_lane];
}

// A ray as the boxes want it. Boxes are made larger by 16 u (|origin| + extent), u = 2^-24, which
// covers all rounding here and in the triangle test (see `BoxRay` in src/bvh/traverse.rs).
struct BoxRay {
    inverse: vec3f,
    near_origin: vec3f,
    far_origin: vec3f,
    // Which bytes of a node hold the planes met first.
    negative: vec3<bool>,
    octant: u32,
}

// A ray as the triangles want it: the frame in which it runs along the third axis.
struct Shear {
    axis: u32,
    factors: vec3f,
    origin: vec3f,
}

//#if INSTANCES
fn box_ray_new(ray: Ray, extent: f32, slack: vec3f) -> BoxRay {
//#else
fn box_ray_new(ray: Ray) -> BoxRay {
    let extent = globals.scene_extent;
//#end
    let size = abs(ray.direction);
    let least = max_element(size) * 8.6736174e-19; // 2^-60
    let inverse = 1.0 / vec3f(
        copysign(max(size.x, least), ray.direction.x),
        copysign(max(size.y, least), ray.direction.y),
        copysign(max(size.z, least), ray.direction.z),
    );
    let reach = max_element(abs(ray.origin)) + extent;
    let pad = reach * 9.536743e-7 + 1.1754944e-38; // 16 * 2^-24
    let negative = inverse < vec3f(0.0);
    var toward = select(vec3f(pad), vec3f(-pad), negative);
//#if INSTANCES
    toward += select(slack, -slack, negative);
//#end
    let octant = select(4u, 0u, negative.x) | select(2u, 0u, negative.y) | select(1u, 0u, negative.z);
    return BoxRay(inverse, ray.origin + toward, ray.origin - toward, negative, octant * 0x01010101u);
}

fn shear_new(ray: Ray) -> Shear {
    let size = abs(ray.direction);
    var axis = 0u;
    if size.y > size.x { axis = 1u; }
    if size.z > max(size.x, size.y) { axis = 2u; }
    let d = along_axis(ray.direction, axis);
    return Shear(axis, vec3f(d.x / d.z, d.y / d.z, 1.0 / d.z), along_axis(ray.origin, axis));
}

// Cyclic permutation that puts `axis` last.
fn along_axis(v: vec3f, axis: u32) -> vec3f {
    return select(select(v.xyz, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn sheared(vertex: vec3f, shear: Shear) -> vec3f {
    let v = along_axis(vertex, shear.axis) - shear.origin;
    return vec3f(v.x - shear.factors.x * v.z, v.y - shear.factors.y * v.z, v.z);
}

// On which side of the edge from `b` to `a` the ray passes. Two triangles compute the same number for their
// shared edge, but for its sign, and a ray cannot slip between them.
fn edge(a: vec3f, b: vec3f) -> f32 {
//#if FUSING
    // Both products are rounded: then it does not matter which one a device would fuse with the difference.
    let products = bitcast<vec2f>(bitcast<vec2u>(a.xy * b.yx) ^ vec2u(globals.zero));
    return products.x - products.y;
//#else
    // The ends are put in order.
    let swap = a.x > b.x || (a.x == b.x && a.y > b.y);
    let first = select(a.xy, b.xy, swap);
    let second = select(b.xy, a.xy, swap);
    let area = first.x * second.y - first.y * second.x;
    return select(area, -area, swap);
//#end
}

// Distance to the plane of a triangle that is far larger than the distance `rough`, whose error then
// is per cents. The CPU's twin is in f64; in f32 this is exact for planes that face an axis, as
// grounds do.
//#if INSTANCES
fn plane_distance(index: u32, shear: Shear, rough: f32, placement: Placement) -> f32 {
    let corners = tree_corners(index, placement);
    let a = along_axis(corners[0], shear.axis);
    let b = along_axis(corners[1], shear.axis);
    let c = along_axis(corners[2], shear.axis);
//#else
fn plane_distance(index: u32, shear: Shear, rough: f32) -> f32 {
    let a = along_axis(bitcast<vec3f>(bvh_triangles(3u * index).xyz), shear.axis);
    let b = along_axis(bitcast<vec3f>(bvh_triangles(3u * index + 1u).xyz), shear.axis);
    let c = along_axis(bitcast<vec3f>(bvh_triangles(3u * index + 2u).xyz), shear.axis);
//#end
    let normal = cross(b - a, c - a);
    let approach = dot(normal, vec3f(shear.factors.xy, 1.0));
    if approach == 0.0 {
        return rough;
    }
    return dot(normal, a - shear.origin) * shear.factors.z / approach;
}

// The hit of one triangle of the tree, MISS if there is none within `t_max`.
//#if INSTANCES
fn intersect_triangle(index: u32, shear: Shear, t_max: f32, instance: u32) -> Hit {
    let placement = placement_of(instance);
    let corners = tree_corners(index, placement);
    let number = bvh_triangles(3u * index).w + placement.shift;
    let tag = bvh_triangles(3u * index + 1u).w;
    let a = sheared(corners[0], shear);
    let b = sheared(corners[1], shear);
    let c = sheared(corners[2], shear);
//#else
fn intersect_triangle(index: u32, shear: Shear, t_max: f32) -> Hit {
    let v0 = bvh_triangles(3u * index);
    let v1 = bvh_triangles(3u * index + 1u);
    let a = sheared(bitcast<vec3f>(v0.xyz), shear);
    let b = sheared(bitcast<vec3f>(v1.xyz), shear);
    let c = sheared(bitcast<vec3f>(bvh_triangles(3u * index + 2u).xyz), shear);
    let number = v0.w;
    let tag = v1.w;
//#end
    let edges = vec3f(edge(c, b), edge(a, c), edge(b, a));
    let none = Hit(MISS, 0u, vec2f(0.0), 0u);
    if any(edges < vec3f(0.0)) && any(edges > vec3f(0.0)) {
        return none;
    }
    let determinant = edges.x + edges.y + edges.z;
    if determinant == 0.0 {
        return none;
    }
    var t = (edges.x * a.z + edges.y * b.z + edges.z * c.z) * shear.factors.z / determinant;
    let reach = max(max(abs(a.z), abs(b.z)), abs(c.z)) * abs(shear.factors.z);
    if abs(t) <= reach * 6.1035156e-5 { // 2^-14
//#if INSTANCES
        t = plane_distance(index, shear, t, placement);
//#else
        t = plane_distance(index, shear, t);
//#end
    }
    if !(t >= 0.0 && t <= t_max) {
        return none;
    }
    let side = select(0u, FROM_BEHIND, determinant * shear.factors.z < 0.0);
    return Hit(t, number, edges.yz / determinant, tag | side);
}

// Four of a node's eight boxes; bits for the hit mask.
fn enter_four(
    meta4: u32,
    planes: array<u32, 6>,
    scale: vec3f,
    near_offset: vec3f,
    far_offset: vec3f,
    ray: BoxRay,
    t_max: f32,
) -> u32 {
    let is_inner4 = (meta4 & (meta4 << 1u)) & 0x10101010u;
    let inner_mask4 = (is_inner4 >> 4u) * 0xffu;
    let bit_index4 = (meta4 ^ (ray.octant & inner_mask4)) & 0x1f1f1f1fu;
    let child_bits4 = (meta4 >> 5u) & 0x07070707u;
    let near_x = select(planes[0], planes[1], ray.negative.x);
    let far_x = select(planes[1], planes[0], ray.negative.x);
    let near_y = select(planes[2], planes[3], ray.negative.y);
    let far_y = select(planes[3], planes[2], ray.negative.y);
    let near_z = select(planes[4], planes[5], ray.negative.z);
    let far_z = select(planes[5], planes[4], ray.negative.z);
    var mask = 0u;
    for (var i = 0u; i < 4u; i++) {
        let shift = 8u * i;
        let near = vec3f(
            f32((near_x >> shift) & 0xffu),
            f32((near_y >> shift) & 0xffu),
            f32((near_z >> shift) & 0xffu),
        ) * scale + near_offset;
        let far = vec3f(
            f32((far_x >> shift) & 0xffu),
            f32((far_y >> shift) & 0xffu),
            f32((far_z >> shift) & 0xffu),
        ) * scale + far_offset;
        let enters = max(max_element(near), 0.0);
        let leaves = min(min(far.x, min(far.y, far.z)), t_max);
        let bits = ((child_bits4 >> shift) & 0xffu) << ((bit_index4 >> shift) & 0xffu);
        mask |= select(0u, bits, enters <= leaves);
    }
    return mask;
}

struct Entered {
    child_base: u32,
    inner: u32,
    triangle_base: u32,
    triangles: u32,
}

// Which children of a node the ray enters: inner ones in the high byte of `inner` (its low byte
// says which children are inner), triangles as bits of `triangles`.
fn enter_node(index: u32, ray: BoxRay, t_max: f32) -> Entered {
    let n0 = bvh_nodes(5u * index);
    let n1 = bvh_nodes(5u * index + 1u);
    let n2 = bvh_nodes(5u * index + 2u);
    let n3 = bvh_nodes(5u * index + 3u);
    let n4 = bvh_nodes(5u * index + 4u);
    let corner = bitcast<vec3f>(n0.xyz);
    let exponents = vec3u(n0.w & 0xffu, (n0.w >> 8u) & 0xffu, (n0.w >> 16u) & 0xffu);
    let scale = bitcast<vec3f>(exponents << vec3u(23u)) * ray.inverse;
    let near_offset = (corner - ray.near_origin) * ray.inverse;
    let far_offset = (corner - ray.far_origin) * ray.inverse;
    let low = array<u32, 6>(n2.x, n2.z, n3.x, n3.z, n4.x, n4.z);
    let high = array<u32, 6>(n2.y, n2.w, n3.y, n3.w, n4.y, n4.w);
    let mask = enter_four(n1.z, low, scale, near_offset, far_offset, ray, t_max)
        | enter_four(n1.w, high, scale, near_offset, far_offset, ray, t_max);
    return Entered(n1.x, (mask & 0xff000000u) | (n0.w >> 24u), n1.y, mask & 0x00ffffffu);
}

// The next inner child of a group, nearest octant first: its node. Takes it out of the group.
fn take_child(group: ptr<function, vec2u>, octant: u32) -> u32 {
    let inner = (*group).y;
    let bit = firstLeadingBit(inner);
    (*group).y = inner & ~(1u << bit);
    let slot = (bit - 24u) ^ (octant & 0xffu);
    return (*group).x + countOneBits(inner & ~(0xffffffffu << slot));
}

// Nearest surface along a ray; of equally near ones that with the lowest number.
fn closest_hit(ray: Ray, from_camera: bool) -> Hit {
//#if INSTANCES
    var level = Level(NO_INSTANCE, 0u);
    var boxes = boxes_of(NO_INSTANCE, ray);
//#else
    let boxes = box_ray_new(ray);
//#end
    let shear = shear_new(ray);
    var best = Hit(MISS, 0xffffffffu, vec2f(0.0), 0u);
    var t_max = ray.t_max;
    var height = 0u;
    var group = vec2u(0u, 0x80000000u);
    loop {
        let node = take_child(&group, boxes.octant);
        if group.y > 0x00ffffffu {
            stack_put(height, group);
            height += 1u;
        }
        let entered = enter_node(node, boxes, t_max);
//#if INSTANCES
        var triangles = without_instances(entered, level, &height);
//#else
        var triangles = entered.triangles;
//#end
        while triangles != 0u {
            let bit = firstTrailingBit(triangles);
            triangles &= triangles - 1u;
//#if INSTANCES
            let hit = intersect_triangle(
                entered.triangle_base + bit, shear, t_max, level.instance);
//#else
            let hit = intersect_triangle(entered.triangle_base + bit, shear, t_max);
//#end
            let nearer = hit.t < best.t || (hit.t == best.t && hit.triangle < best.triangle);
            if hit.t < MISS && nearer {
//#if FILTERED_HITS
                if !accepts(hit, from_camera) {
                    continue;
                }
//#end
                best = hit;
                t_max = hit.t;
            }
        }
        group = vec2u(entered.child_base, entered.inner);
        if group.y <= 0x00ffffffu {
//#if INSTANCES
            if !next_group(&group, &height, &level, &boxes, ray) {
                break;
            }
//#else
            if height == 0u {
                break;
            }
            height -= 1u;
            group = stack_at(height);
//#end
        }
    }
    return best;
}

// A walk through the tree that can be interrupted at a hit: the group of nodes being entered, how
// many groups wait, and the triangles left of the last node (the first; which of the following).
struct Walk {
    group: vec2u,
    waiting: u32,
    triangles: vec2u,
//#if INSTANCES
    level: Level,
//#end
}

fn walk_new() -> Walk {
//#if INSTANCES
    return Walk(vec2u(0u, 0x80000000u), 0u, vec2u(0u), Level(NO_INSTANCE, 0u));
//#else
    return Walk(vec2u(0u, 0x80000000u), 0u, vec2u(0u));
//#end
}

// The next hit of a walk, in no order; MISS at its end. What boxes and triangles want of the ray is
// made anew: kept, it would take registers while materials are looked at.
fn next_hit(walk: ptr<function, Walk>, ray: Ray) -> Hit {
//#if INSTANCES
    var level = (*walk).level;
    var boxes = boxes_of(level.instance, ray);
//#else
    let boxes = box_ray_new(ray);
//#end
    let shear = shear_new(ray);
    var group = (*walk).group;
    var height = (*walk).waiting;
    var triangles = (*walk).triangles;
    var hit = Hit(MISS, 0u, vec2f(0.0), 0u);
    loop {
        while triangles.y != 0u && hit.t >= MISS {
            let bit = firstTrailingBit(triangles.y);
            triangles.y &= triangles.y - 1u;
//#if INSTANCES
            hit = intersect_triangle(triangles.x + bit, shear, ray.t_max, level.instance);
//#else
            hit = intersect_triangle(triangles.x + bit, shear, ray.t_max);
//#end
        }
        if hit.t < MISS {
            break;
        }
        if group.y <= 0x00ffffffu {
//#if INSTANCES
            if !next_group(&group, &height, &level, &boxes, ray) {
                break;
            }
//#else
            if height == 0u {
                break;
            }
            height -= 1u;
            group = stack_at(height);
//#end
        }
        let node = take_child(&group, boxes.octant);
        if group.y > 0x00ffffffu {
            stack_put(height, group);
            height += 1u;
        }
        let entered = enter_node(node, boxes, ray.t_max);
//#if INSTANCES
        triangles = vec2u(entered.triangle_base, without_instances(entered, level, &height));
//#else
        triangles = vec2u(entered.triangle_base, entered.triangles);
//#end
        group = vec2u(entered.child_base, entered.inner);
    }
//#if INSTANCES
    *walk = Walk(group, height, triangles, level);
//#else
    *walk = Walk(group, height, triangles);
//#end
    return hit;
}

// Share of light that arrives along a shadow ray: zero if a surface scatters it all. Materials are
// looked at outside of the walk, where lanes that have not found any do not wait for them.
fn transmittance_along(ray: Ray) -> vec3f {
    var walk = walk_new();
    var transmittance = vec3f(1.0);
    loop {
        let hit = next_hit(&walk, ray);
        if hit.t >= MISS {
            break;
        }
//#if PASS_THROUGH
        transmittance *= passed(hit, ray.direction);
        if max_element(transmittance) > 0.0 {
            continue;
        }
//#end
        transmittance = vec3f(0.0);
        break;
    }
    return transmittance;
}

//#end
// Twin of `bvh::offset_origin`.
fn offset_origin(position: vec3f, geometric_normal: vec3f) -> vec3f {
    let steps = vec3i(geometric_normal * 256.0);
    let away = select(steps, -steps, position < vec3f(0.0));
    let moved = bitcast<vec3f>(bitcast<vec3i>(position) + away);
    let near_zero = position + geometric_normal * (1.0 / 65536.0);
    return select(moved, near_zero, abs(position) < vec3f(1.0 / 32.0));
}
