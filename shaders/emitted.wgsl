// Emissive triangles that a path meets: twin of `Path::add_emitted` in src/path/tracer.rs.

fn add_emitted(path: ptr<function, Path>, point: SurfacePoint) {
    if point.parameters.unlit {
        return;
    }
    let radiance = emitted(point, -(*path).ray.direction);
    if max_element(radiance) <= 0.0 {
        return;
    }
    var weight = 1.0;
    if (*path).departure_pdf_solid_angle < F32_MAX {
        let receiver = (*path).departure_receiver;
        let distance = length(receiver.position - point.position);
//#if CLEAR_SOLIDS
        var nee = 0.0;
        if (*path).is_refracted {
            nee = departure_lamp_pdf(path);
        } else {
            nee = local_light_pdf_solid_angle(
                point.triangle, receiver, (*path).ray.direction, distance);
        }
//#else
        let nee =
            local_light_pdf_solid_angle(point.triangle, receiver, (*path).ray.direction, distance);
//#end
        weight = balance_heuristic((*path).departure_pdf_solid_angle, nee);
    }
    (*path).radiance += (*path).throughput * radiance * weight;
}
