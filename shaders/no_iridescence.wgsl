// In place of iridescence.wgsl where no material has a thin film.

struct Film {
    unused: u32,
}

fn film_new(p: SurfaceParameters) -> Film {
    return Film();
}

fn film_is_absent(film: Film) -> bool {
    return true;
}

fn film_over(film: Film, plain: vec3f, cosine: f32) -> vec3f {
    return plain;
}

fn film_over_glass(film: Film, bare: vec3f, cosine: f32, eta: f32, f90: f32) -> vec3f {
    return bare;
}

fn film_over_glass_alone(film: Film) -> Film {
    return film;
}

fn film_largest_f0(film: Film, bare: f32, specular: f32) -> f32 {
    return bare;
}
