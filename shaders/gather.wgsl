// Light that next event estimation finds: twin of src/path/gather.rs.

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

//#if MAP_SAMPLING
fn light_of_map(path: ptr<function, Path>, vertex: Vertex, bits: vec2u) -> Arriving {
    var arriving: Arriving;
//#if MEDIUM
//#if SOLID_TRANSMISSION
    if vertex.distribution == NO_ARRAY {
        return arriving;
    }
//#end
//#end
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
//#if CLEAR_SOLIDS
    shadow.is_of_map = is_of_map;
    shadow.carried = (*path).throughput * f.value;
    shadow.pdf_solid_angle = arriving.pdf_solid_angle;
    shadow.own_pdf = f.pdf_solid_angle;
//#if EMITTERS
    shadow.receiver = receiver_of(vertex);
//#end
//#end
//#if COUNTING
    shadow.visibility = Visibility(
        arriving.counter, visibility_share(vertex, arriving.direction, f.pdf_solid_angle));
//#end
    return shadow;
}

// Chooses light that may reach a vertex, the map's first. Both share the code for what the vertex makes
// of it, which is long.
fn gather(path: ptr<function, Path>, vertex: Vertex) {
//#if MAP_SAMPLING
//#if LOCAL_LIGHTS
    for (var i = 0u; i < 2u; i++) {
        var arriving: Arriving;
        if i == 0u {
            arriving = light_of_map(path, vertex, path_pair_bits(path));
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
    let of_map = light_of_map(path, vertex, path_pair_bits(path));
    (*path).map_shadow = shadow_of(path, vertex, of_map, true);
//#end
//#else
    (*path).lamp_shadow = shadow_of(path, vertex, light_of_lamps(path, vertex), false);
//#end
}

// Follows a shadow ray and adds what comes along it.
fn add_light(path: ptr<function, Path>, chosen: Shadow) {
    var shadow = chosen;
    let visible = follow_shadow(path, &shadow);
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
