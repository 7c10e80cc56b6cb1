// Chooses a light by how much of its light may reach a place: twin of src/path/light_tree/mod.rs and
// of node.rs beside it.
// `light_nodes` holds its nodes, three texels each; `lights` holds the emissive triangles
// (ascending), the node of each, the distant lights (share and light) and the punctual lights.

const LIGHT_NODE_TEXELS = 3u;

// A place at which light is gathered; the normal is zero where light from all around is scattered.
struct Receiver {
    position: vec3f,
    normal: vec3f,
}

struct LightChoice {
    light: u32,
    probability: f32,
    remainder: f32,
}

// About the mean of cosines, negative ones counted as zero, that scatter around this one.
fn clamped_mean(cosine: f32, scatter: f32) -> f32 {
    return 0.5 * (cosine + sqrt(cosine * cosine + 0.25 * max(scatter, 0.0)));
}

// Twin of `Node::importance`.
fn light_importance(node: u32, receiver: Receiver) -> f32 {
    let at = LIGHT_NODE_TEXELS * node;
    let center_variance = bitcast<vec4f>(light_nodes(at));
    let axis_intensity = bitcast<vec4f>(light_nodes(at + 1u));
    let squares_around = bitcast<vec3f>(light_nodes(at + 2u).xyz);
    let to_lights = center_variance.xyz - receiver.position;
    let squared = max(dot(to_lights, to_lights) + center_variance.w, NEAREST_SQUARED);
    let inverse = 1.0 / sqrt(squared);
    let direction = to_lights * inverse;
    let inverse_squared = inverse * inverse;
    let scatter = center_variance.w * inverse_squared;
    let known = squares_around.y * (1.0 - scatter);
    let aimed = clamped_mean(-dot(axis_intensity.xyz, direction), squares_around.x - known);
    let emitted = max(squares_around.z + aimed, MIN_COSINE);
    var received = 1.0;
    if any(receiver.normal != vec3f(0.0)) {
        received = max(clamped_mean(dot(receiver.normal, direction), scatter), MIN_COSINE);
    }
    return axis_intensity.w * emitted * received * inverse_squared;
}

// The second child of a node (the first one is the next node), or `LIGHT_LEAF` and a light.
fn light_link(node: u32) -> u32 {
    return light_nodes(LIGHT_NODE_TEXELS * node + 2u).w;
}

// Share of a node's first child.
fn share_of_first(node: u32, second: u32, receiver: Receiver) -> u32 {
    let first = light_importance(node + 1u, receiver);
    let sum = first + light_importance(second, receiver);
    return share_of(select(0.5, first / sum, sum > 0.0));
}

// Word of `lights` at which a distant light begins: its share and itself.
fn distant_light_at(index: u32) -> u32 {
    return 2u * globals.light_triangle_count + 2u * index;
}

// Chooses a light with a uniform 32-bit number.
fn choose_light(receiver: Receiver, bits: u32) -> LightChoice {
    var draw = draw_new(bits);
//#if PUNCTUAL_LIGHTS
    for (var i = 0u; i < globals.distant_light_count; i++) {
        let at = distant_light_at(i);
        if draw_chooses_first(&draw, lights(at).x) {
            let light = lights(at + 1u).x;
            return LightChoice(light, interval_probability(draw.left), draw_remainder(draw));
        }
    }
//#end
    let light = descend_lights(0u, receiver, &draw);
    return LightChoice(light, interval_probability(draw.left), draw_remainder(draw));
}

// Chooses a light of the tree with this root.
fn descend_lights(root: u32, receiver: Receiver, draw: ptr<function, Draw>) -> u32 {
    var node = root;
    var link = light_link(node);
    while (link & LIGHT_LEAF) == 0u {
        let share = share_of_first(node, link, receiver);
        node = select(link, node + 1u, draw_chooses_first(draw, share));
        link = light_link(node);
    }
    return link & ~LIGHT_LEAF;
}

//#if AREA_SOURCES
// The part of an interval of random numbers with which the tree with this root chooses a leaf.
fn choose_leaf(root: u32, leaf: u32, before: Interval, receiver: Receiver) -> Interval {
    var chosen = before;
    var node = root;
    while node != leaf {
        let second = light_link(node);
        let first = leaf < second;
        chosen = interval_choose(chosen, share_of_first(node, second, receiver), first);
        node = select(second, node + 1u, first);
    }
    return chosen;
}
//#end

//#if EMITTERS
// Probability with which `choose_light` chooses an emissive triangle, counted among such.
fn light_probability(receiver: Receiver, light: u32) -> f32 {
    let leaf = lights(globals.light_triangle_count + light).x;
    var chosen = whole_interval();
//#if PUNCTUAL_LIGHTS
    for (var i = 0u; i < globals.distant_light_count; i++) {
        chosen = interval_choose(chosen, lights(distant_light_at(i)).x, false);
    }
//#end
    return interval_probability(choose_leaf(0u, leaf, chosen, receiver));
}
//#end
