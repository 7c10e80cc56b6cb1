// From a point on the picture to a ray: twin of src/path/camera.rs and src/render/filter.rs.

fn disk_from_square(u: vec2f) -> vec2f {
    let p = 2.0 * u - 1.0;
    if all(p == vec2f(0.0)) {
        return vec2f(0.0);
    }
    var radius = p.y;
    var turns = 0.25 - 0.125 * (p.x / p.y);
    if abs(p.x) > abs(p.y) {
        radius = p.x;
        turns = 0.125 * (p.y / p.x);
    }
    return radius * sin_cos_turns(turns).yx;
}

// Ray through `pixel` (continuous, origin at the top left corner).
fn camera_ray(pixel: vec2f, lens: vec2f) -> Ray {
    let ndc = pixel / vec2f(f32(globals.width), f32(globals.height)) * 2.0 - 1.0;
    let offset = globals.camera_right * (ndc.x * globals.half_width)
        - globals.camera_up * (ndc.y * globals.half_height);
    var origin = globals.camera_position;
    var direction = globals.camera_forward + offset;
    if globals.orthographic != 0u {
        origin = globals.camera_position + offset;
        direction = globals.camera_forward;
    }
//#if LENS
    let focus = origin + direction * globals.focus_distance;
    let on_lens = disk_from_square(lens) * globals.lens_radius;
    origin += globals.camera_right * on_lens.x + globals.camera_up * on_lens.y;
    direction = focus - origin;
//#end
    return Ray(origin, normalize(direction), F32_MAX);
}

fn lens_point(sampler: ptr<function, Sampler>) -> vec2f {
//#if LENS
    return next_pair(sampler);
//#else
    return vec2f(0.0);
//#end
}

//#if WIDE_FILTER

// Inverts the running integral of the filter's window.
fn invert_filter(u: f32) -> f32 {
    var upper = 1u;
    var last = FILTER_STEPS;
    while upper < last {
        let middle = (upper + last) / 2u;
        if tables(FILTER_AT + middle).x <= u {
            upper = middle + 1u;
        } else {
            last = middle;
        }
    }
    let low = tables(FILTER_AT + upper - 1u).x;
    let high = tables(FILTER_AT + upper).x;
    var fraction = 0.5;
    if high > low {
        fraction = (u - low) / (high - low);
    }
    return FILTER_RADIUS * (2.0 * (f32(upper - 1u) + fraction) / f32(FILTER_STEPS) - 1.0);
}
//#end

// Offset from the pixel's centre in pixels.
fn filter_sample(u: vec2f) -> vec2f {
//#if WIDE_FILTER
    return vec2f(invert_filter(u.x), invert_filter(u.y));
//#else
    return u - 0.5;
//#end
}
