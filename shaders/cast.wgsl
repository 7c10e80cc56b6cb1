// Rays that the host made; see src/render/gpu/cast.rs.

struct CastRay {
    origin: vec3f,
    // F32_MAX if nothing ends the ray.
    t_max: f32,
    direction: vec3f,
    padding: u32,
}

fn cast_ray(index: u32) -> Ray {
    let ray = cast_rays[index];
    return Ray(ray.origin, ray.direction, ray.t_max);
}
