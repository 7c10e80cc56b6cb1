// A path that begins anywhere in the picture: number `offset` of a dispatch, of one long sequence. Its
// high bits count its restarts.
fn path_anywhere(offset: u32, seed: u32) -> Path {
    let index = globals.work.first + offset;
    let restarts = globals.work.first_high + select(0u, 1u, index < globals.work.first);
    var sampler = sampler_new(globals.seed ^ seed, restarts, index);
    let on_picture = next_pair(&sampler);
    let lens = lens_point(&sampler);
    let pixel = on_picture * vec2f(f32(globals.width), f32(globals.height));
    return path_new(camera_ray(pixel, lens), sampler);
}
