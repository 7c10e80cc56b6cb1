// Whether a surface scatters much the same to and from places side by side: twin of `Bsdf::is_broad` in
// src/bsdf/mod.rs, of fields of `SurfaceScatterer` in src/path/vertex.rs and of `Path::is_in_air` in
// src/path/mod.rs.
fn is_broad(vertex: Vertex, least_alpha: f32) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
    let interface_ = vertex.bsdf.interface_;
    let is_broad = interface_is_absent(interface_) || interface_.ggx.alpha >= least_alpha;
    return is_broad && coat_is_absent(vertex.bsdf.coat) && !bsdf_is_delta_only(vertex.bsdf);
}

fn transmits(vertex: Vertex) -> bool {
    var transmits = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    transmits = transmits || vertex.point.parameters.diffuse_transmission > 0.0;
//#end
    return transmits;
}

// Whether some of that is refracted or goes on inside of a body.
fn refracts(vertex: Vertex) -> bool {
    var refracts = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    let diffuses = vertex.point.parameters.diffuse_transmission > 0.0;
    refracts = refracts || (diffuses && !vertex.point.parameters.thin);
//#end
    return refracts;
}

// Whether the path is outside of all bodies.
fn is_in_air(path: ptr<function, Path>) -> bool {
//#if SOLID_TRANSMISSION
//#if MEDIUM
    return !(*path).body.is_solid;
//#else
    let body = (*path).body;
    return body.squared_index == 1.0 && all(body.absorption == vec3f(0.0));
//#end
//#else
    return true;
//#end
}
