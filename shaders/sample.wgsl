// Where samples of a pixel begin.

// A lane's pixel in an 8x8 tile; it may lie outside of the picture.
fn pixel_in_tile(tile: u32, lane: u32) -> vec2u {
    let tiles_across = (globals.width + 7u) / 8u;
    return vec2u(tile % tiles_across, tile / tiles_across) * 8u + vec2u(lane & 7u, lane >> 3u);
}

fn start_sample(x: u32, y: u32, index: u32) -> Path {
    var sampler =
        sampler_of_pixel(globals.seed, vec2u(x, y), index - globals.first_of_sequence);
    let offset = filter_sample(next_pair(&sampler));
    let lens = lens_point(&sampler);
    let centre = vec2f(f32(x) + 0.5, f32(y) + 0.5);
    var path = path_new(camera_ray(centre + offset, lens), sampler);
//#if COUNTING
    let stride = globals.work.stride;
    path.is_counted = stride != 0u && (y * globals.width + x + index) % max(stride, 1u) == 0u;
//#end
    return path;
}
