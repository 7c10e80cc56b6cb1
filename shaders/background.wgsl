// The map as the camera sees it, blurred: twin of src/path/background.rs.

// Twin of `background::spread`.
fn spread(direction: vec3f, concentration: f32, u: vec2f) -> vec3f {
    let share = u.x + (1.0 - u.x) * exp(-2.0 * concentration);
    let cosine = clamp(1.0 + log(max(share, 1e-30)) / concentration, -1.0, 1.0);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let phi = sin_cos_turns(u.y);
    return world_from_local(frame_from_z(direction), vec3f(sine * phi.y, sine * phi.x, cosine));
}
