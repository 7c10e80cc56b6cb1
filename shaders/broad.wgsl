// Whether a surface scatters much the same to and from places side by side, all on one side: twin of
// `SurfaceScatterer::is_broad` in src/path/vertex.rs and of `Path::is_in_air` in src/path/mod.rs.
fn is_broad(vertex: Vertex, least_alpha: f32) -> bool {
//#if MEDIUM
    if vertex.is_in_medium {
        return false;
    }
//#end
    var transmits = vertex.point.parameters.transmission > 0.0;
//#if DIFFUSE_TRANSMISSION
    transmits = transmits || vertex.point.parameters.diffuse_transmission > 0.0;
//#end
    let interface_ = vertex.bsdf.interface_;
    let is_broad = interface_is_absent(interface_) || interface_.ggx.alpha >= least_alpha;
    return !transmits && is_broad && coat_is_absent(vertex.bsdf.coat)
        && !bsdf_is_delta_only(vertex.bsdf);
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
