// Vertices between surfaces: twin of `Path::fly` in src/path/tracer.rs.

// What fills the way of a ray from where the path is.
fn stretch_ahead(
    path: ptr<function, Path>,
    origin: vec3f,
    direction: vec3f,
    distance: f32,
) -> Stretch {
//#if SOLID_TRANSMISSION
    return stretch_in((*path).body, origin, direction, distance);
//#else
    return fog_stretch(origin, direction, distance);
//#end
}

//#if SOLID_TRANSMISSION
// Twin of `Body::stretch` in src/path/body.rs.
fn stretch_in(body: Body, origin: vec3f, direction: vec3f, distance: f32) -> Stretch {
    if !body.is_solid {
        return fog_stretch(origin, direction, distance);
    }
    let fills = distance < F32_MAX && any(body.interior.extinction != vec3f(0.0));
    return Stretch(body.interior, 0.0, select(0.0, distance, fills));
}
//#end

fn is_in_solid(path: ptr<function, Path>) -> bool {
//#if SOLID_TRANSMISSION
    return (*path).body.is_solid;
//#else
    return false;
//#end
}

fn medium_vertex(path: ptr<function, Path>, position: vec3f, mean_cosine: f32) -> Vertex {
    var vertex: Vertex;
    vertex.point.position = position;
    vertex.is_in_medium = true;
    vertex.mean_cosine = mean_cosine;
    // From inside of a solid the map is not seen: it is not asked in vain.
    vertex.distribution = NO_ARRAY;
    if !is_in_solid(path) {
        vertex.distribution = WHOLE_MAP;
//#if LIGHT_GRID
        vertex.cell = cell_in_medium(position);
        vertex.distribution = distribution_of_cell(vertex.cell);
//#end
    }
    return vertex;
}
