// Paths that aim at surfaces: twin of src/path/aim_targets.rs and src/path/aim.rs. From word
// `globals.targets_at` on, `lights` holds the triangles (ascending) and the node of each in `light_nodes`, where
// their tree begins at node `globals.targets_root`.

// What `Path::aim` is where the ray may not have been aimed, and where it may have been, but was not. Otherwise it is
// the triangle and 2.
const NO_AIM = 0u;
const FREE_AIM = 1u;

fn is_aimed(path: ptr<function, Path>) -> bool {
    return (*path).aim > FREE_AIM;
}

// Twin of `PathTracer::aiming_from`: whether the path may aim from there.
fn may_aim(path: ptr<function, Path>, vertex: Vertex) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
    return is_in_air(path) && !transmits(vertex) && is_broad(vertex, MIN_CACHED_ALPHA);
}

// Where the path goes on, by a number for the lobe, one that decides whether it aims, and two more: twin of
// `Aiming::onward`.
fn sample_aiming(path: ptr<function, Path>, vertex: Vertex, choice: vec2f, bits: vec2u) -> BsdfSample {
    let u = vec2f(unit_from_bits(bits.x), unit_from_bits(bits.y));
    let may_aim_ = may_aim(path, vertex);
    (*path).aim = select(NO_AIM, FREE_AIM, may_aim_);
    var sample: BsdfSample;
    if may_aim_ && choice.y < globals.aim_probability {
        let receiver = receiver_of(vertex);
        var draw = draw_new(bits.x);
        let light = descend_lights(globals.targets_root, receiver, &draw);
        let triangle = lights(globals.targets_at + light).x;
        let barycentric = barycentric_of(vec2f(draw_remainder(draw), u.y));
        let target_ = place_on(light_corners(triangle), barycentric);
        // From where the ray begins, or it would miss small triangles.
        let origin = origin_toward(vertex.point, target_ - receiver.position);
        let direction = normalize(target_ - origin);
        (*path).aim = triangle + 2u;
        let f = scattered(path, vertex, direction);
        if max_element(f.value) > 0.0 {
            sample.wi = local_from_world(vertex.point.shading_frame, direction);
            sample.weight = f.value / f.pdf_solid_angle;
            sample.pdf_solid_angle = f.pdf_solid_angle;
        }
    } else {
        sample = bsdf_sample(vertex.bsdf, vertex.wo, vec3f(choice.x, u));
    }
    sample.weight /= select(1.0, 1.0 - globals.aim_probability, may_aim_);
    return sample;
}

// Density in solid angle of arriving at a place of a triangle, some metres away, from where the BSDF has that of
// `bsdf_pdf`: twin of `Aiming::pdf_solid_angle`.
fn aiming_pdf(receiver: Receiver, triangle: u32, direction: vec3f, distance: f32, bsdf_pdf: f32) -> f32 {
    var pdf = (1.0 - globals.aim_probability) * bsdf_pdf;
    let index = index_of_triangle(globals.targets_at, globals.target_count, triangle);
    if index < globals.target_count {
        let leaf = lights(globals.targets_at + globals.target_count + index).x;
        let root = globals.targets_root;
        let chosen = interval_probability(choose_leaf(root, leaf, whole_interval(), receiver));
        let density = area_to_solid_angle(light_corners(triangle), direction, distance * distance);
        pdf += globals.aim_probability * chosen * density;
    }
    return pdf;
}

// Weighs a path that may have been aimed where it has arrived; `false` if it ends there. Twin of
// `Departure::weight_at`.
fn arrives_as_aimed(path: ptr<function, Path>, point: SurfacePoint) -> bool {
    if is_aimed(path) && (*path).aim != point.triangle + 2u {
        return false;
    }
    let bsdf_pdf = (*path).departure_pdf_solid_angle;
    if (*path).aim != NO_AIM && bsdf_pdf < F32_MAX {
        let receiver = (*path).departure_receiver;
        let distance = length(receiver.position - point.position);
        let pdf = aiming_pdf(receiver, point.triangle, (*path).ray.direction, distance, bsdf_pdf);
        (*path).throughput *= (1.0 - globals.aim_probability) * bsdf_pdf / pdf;
    }
    (*path).aim = NO_AIM;
    return true;
}
