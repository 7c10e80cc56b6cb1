// What a ray is in: twin of `Body` in src/path/body.rs and of `ReadyMaterial::behind` in src/path/materials.rs.

struct Body {
//#if MEDIUM
    interior: Interior,
    is_solid: bool,
//#else
    absorption: vec3f,
//#end
    squared_index: f32,
}

fn body_air() -> Body {
    var body: Body;
    body.squared_index = 1.0;
    return body;
}

fn body_behind(point: SurfacePoint, before: Body) -> Body {
    if point.parameters.thin {
        return before;
    }
    var body = body_air();
    if point.front_face {
        let index = max(point.parameters.ior, 1.0);
        body.squared_index = index * index;
//#if MEDIUM
        let inside = material_numbers(point.material, SCATTERING);
        body.interior =
            Interior(inside.xyz, inside.w, point.parameters.absorption + inside.xyz);
        body.is_solid = true;
//#else
        body.absorption = point.parameters.absorption;
//#end
    }
    return body;
}

//#if !MEDIUM
fn body_transmittance(body: Body, distance: f32) -> vec3f {
    if all(body.absorption == vec3f(0.0)) || distance >= F32_MAX {
        return vec3f(1.0);
    }
    return exp(-body.absorption * distance);
}
//#end
